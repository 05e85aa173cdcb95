"""`export` and `map` of systems from matrices: round trips, closed forms, refusals."""

import numpy as np
import pytest

from tests.cli.calls import B1, answer, assert_refused, run

CHART = """\
parameters: {mu: 0.3, gap: 0.5}
M: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
K:
  - {matrix: [[4, 0, 0, 0], [0, 4, 0, 0], [0, 0, 20, 0], [0, 0, 0, 30]]}
  - {matrix: [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]], factor: gap}
  - {matrix: [[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]], factor: mu}
"""


@pytest.mark.parametrize("log", ["", ":log"])
def test_a_map_over_two_parameters_flutters_exactly_where_it_must(tmp_path, capsys, log):
    """Flutter exactly where mu exceeds the gap."""
    path = tmp_path / "system.yaml"
    table = tmp_path / "t.csv"
    figure = tmp_path / "f.svg"
    path.write_text(CHART)
    ends = f"0.01:1{log}" if log else "0:1"
    axes = ("--first", f"mu:{ends}", "--second", f"gap:{ends}", "--n", "21")
    found = answer(capsys, "map", path, *axes, "--csv", table, "--pdf", figure)
    expected = np.where(np.tri(21, k=-1, dtype=bool), "flutter", "marginal")
    off = ~np.eye(21, dtype=bool)
    assert (np.array(found["verdicts"])[off] == expected[off]).all()
    assert found["share"]["flutter"] == pytest.approx(0.5, abs=0.03)
    assert len(table.read_text().splitlines()) == 1 + 21 * 21
    assert "</svg>" in figure.read_text()


def test_a_pad_comes_back_and_what_no_matrix_depends_on_is_not_set(tmp_path, capsys):
    system = tmp_path / "out" / "system.yaml"
    answer(capsys, "export", B1, "--output", system.parent)
    pad = answer(capsys, "eigenvalues", B1)
    matrices = answer(capsys, "eigenvalues", system)
    for key in ("real", "imag"):
        given = [root[key] for root in pad["eigenvalues"]]
        found = [root[key] for root in matrices["eigenvalues"]]
        assert found == pytest.approx(given, abs=1e-6)
    told = assert_refused(capsys, "eigenvalues", system, "--set", "mu=0.3")
    assert "--set mu=0.3: mu is not allowed, no matrix depends on it" in told
    code, _, err = run(capsys, "critical-friction", system)
    assert code == 0
    assert err.startswith("squeal: warning: b1-c: no matrix depends on mu")
    assert "parameter" not in system.read_text().replace("no parameter", "")
