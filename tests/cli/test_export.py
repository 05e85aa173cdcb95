"""`export`, `terms` and `map` of systems from matrices: round trips, closed forms, refusals."""

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import csc_array, random_array

from squeal.io.matrices import read_matrix
from tests.cli.calls import answer, assert_refused, run
from tests.conftest import SCENES


def test_terms_of_a_stiffness_at_two_frictions(tmp_path, capsys):
    rng = np.random.default_rng(1)
    K0, K1 = (csc_array(random_array((40, 40), density=0.1, rng=rng)) for _ in range(2))
    for k, mu in enumerate((0.1, 0.4, 0.7)):
        mmwrite(tmp_path / f"k{k}.mtx", K0 + mu * K1)
    given = [f"{mu}:{tmp_path / f'k{k}.mtx'}" for k, mu in enumerate((0.1, 0.4, 0.7))]
    found = answer(capsys, "terms", *given, "--output", tmp_path / "K.mtx")
    assert found["checked"]
    assert found["error"] < 1e-14
    assert [t["file"] for t in found["terms"]] == ["K0.mtx", "K1.mtx"]
    for name, matrix in (("K0", K0), ("K1", K1)):
        assert abs(read_matrix(tmp_path / f"{name}.mtx").matrix - matrix).max() < 1e-14
    assert found["terms"][1]["nonzeros"] == K1.nnz
    mmwrite(tmp_path / "k2.mtx", K0 + 0.71 * K1)
    code, _, err = run(capsys, "terms", *given)
    assert code == 1
    assert "is not linear in mu" in err


def test_terms_overwrite_no_file(tmp_path, capsys):
    for name in ("a", "b"):
        mmwrite(tmp_path / f"{name}.mtx", np.eye(2))
    given = ("terms", f"1:{tmp_path}/a.mtx", f"2:{tmp_path}/b.mtx", "--output", tmp_path / "K.mtx")
    (tmp_path / "K1.mtx").touch()
    assert "K1.mtx: exists" in assert_refused(capsys, *given)
    assert not (tmp_path / "K0.mtx").exists()
    (tmp_path / "K1.mtx").unlink()
    assert run(capsys, *given)[0] == 0
    assert (tmp_path / "K0.mtx").exists()


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
