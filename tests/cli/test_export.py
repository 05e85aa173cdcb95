"""`export` and `map` of systems from matrices: round trips, closed forms, refusals."""

import numpy as np
import pytest

from tests.cli.calls import answer, assert_refused, run
from tests.conftest import SCENES

CHART = """\
parameters: {mu: 0.3, gap: 0.5}
M: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
K:
  - {matrix: [[4, 0, 0, 0], [0, 4, 0, 0], [0, 0, 20, 0], [0, 0, 0, 30]]}
  - {matrix: [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]], factor: gap}
  - {matrix: [[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]], factor: mu}
"""


def test_a_chart_over_two_parameters(tmp_path, capsys):
    """Flutter exactly where mu exceeds the gap."""
    path, table, figure = (tmp_path / name for name in ("system.yaml", "t.csv", "f.svg"))
    path.write_text(CHART)
    axes = ("--first", "mu:0:1", "--second", "gap:0:1", "--n", "21")
    found = answer(capsys, "map", path, *axes, "--csv", table, "--pdf", figure)
    at = (np.arange(21) + 0.5) / 21
    for i, mu in enumerate(at):
        for j, gap in enumerate(at):
            if abs(mu - gap) > 1e-9:
                assert found["verdicts"][i][j] == ("flutter" if mu > gap else "marginal")
    assert found["share"]["flutter"] == pytest.approx(0.5, abs=0.03)
    assert len(table.read_text().splitlines()) == 1 + 21 * 21
    assert "</svg>" in figure.read_text()


def test_complex_matrices_are_not_written(tmp_path, capsys):
    path = tmp_path / "system.yaml"
    path.write_text(CHART + "damping: {structural: 0.1}\n")
    err = assert_refused(capsys, "export", path, "--output", tmp_path / "out")
    assert "K: is complex (structural damping) and cannot be written" in err
    assert_refused(capsys, "export", path, "--output", tmp_path / "new" / "out")
    assert list(tmp_path.iterdir()) == [path]
    (tmp_path / "out").mkdir()
    assert_refused(capsys, "export", path, "--output", tmp_path / "out")
    assert not list((tmp_path / "out").iterdir())


def test_what_no_matrix_depends_on_is_not_set(tmp_path, capsys):
    folder = tmp_path / "out"
    answer(capsys, "export", SCENES / "b1-c.yaml", "--output", folder)
    told = assert_refused(capsys, "eigenvalues", folder / "system.yaml", "--set", "mu=0.3")
    assert "no matrix of system.yaml depends on mu" in told
    code, _, err = run(capsys, "critical-friction", folder / "system.yaml")
    assert (code, err) == (0, "squeal: warning: no matrix depends on mu\n")
