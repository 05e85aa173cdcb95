"""`eigenvalues` of systems from matrices, against NumPy on the same matrices."""

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import csc_array

from tests import large
from tests.cli.calls import answer, assert_refused

ROWS = 80  # more are treated as many


@pytest.fixture(autouse=True)
def _few_rows_are_many(monkeypatch):
    monkeypatch.setattr("squeal.analysis.systems.roots.ALL_ROWS", ROWS)


FILE = """\
name: blocks
parameters: {mu: 0.2}
M: {file: m.mtx}
C: {file: c.mtx}
K: [{file: k.mtx}, {file: f.mtx, factor: mu}]
"""


def _folder(path, n):
    rng = np.random.default_rng(3)
    a, w = rng.uniform(0.5, 3.0, n), np.sort(rng.uniform(100.0, 5000.0, n))
    M, C, K = large.blocks(a, w, rng)
    F = csc_array(([2e4], ([0], [1])), shape=(n, n))
    for name, matrix in zip("mckf", (M, C, K, F), strict=True):
        mmwrite(path / f"{name}.mtx", matrix)
    (path / "system.yaml").write_text(FILE)
    mu = 0.2
    A = np.linalg.solve(M.toarray(), np.hstack([-(K + mu * F).toarray(), -C.toarray()]))
    return np.linalg.eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), A]))


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    path = tmp_path_factory.mktemp("small")
    return path, _folder(path, 30)


@pytest.fixture(scope="module")
def sparse(tmp_path_factory):
    path = tmp_path_factory.mktemp("sparse")
    return path, _folder(path, ROWS + 1)


def _values(found):
    return np.array([complex(e["real"], e["imag"]) for e in found["eigenvalues"]])


def _same(found, expected):
    assert len(found) == len(expected)
    distance = np.abs(found[:, None] - expected[None, :])
    assert distance.min(axis=0).max() < 1e-6 * np.abs(expected).max()


def test_all_roots_of_a_small_system(small, capsys):
    path, expected = small
    found = answer(capsys, "eigenvalues", path / "system.yaml")
    _same(_values(found), expected)
    assert found["certified"]
    assert found["count"] == 60
    assert max(e["residual"] for e in found["eigenvalues"]) < 1e-14
    assert [m["file"] for m in found["matrices"]] == ["m.mtx", "c.mtx", "k.mtx", "f.mtx"]
    assert found["basis"] is None


@pytest.mark.parametrize("which", ["small", "sparse"])
def test_a_band_is_complete(which, request, capsys):
    path, expected = request.getfixturevalue(which)
    found = answer(capsys, "eigenvalues", path / "system.yaml", "--band", "200:400")
    hertz = expected.imag / (2 * np.pi)
    _same(_values(found), expected[(hertz > 200) & (hertz < 400)])
    assert found["certified"]
    assert found["count"] == len(found["eigenvalues"]) > 5
    assert max(e["residual"] for e in found["eigenvalues"]) < 1e-12


def test_region_and_modes(sparse, capsys):
    path, expected = sparse
    found = answer(capsys, "eigenvalues", path / "system.yaml", "--region", "-2:1:300:900")
    r, i = expected.real, expected.imag
    _same(_values(found), expected[(r > -2) & (r < 1) & (i > 300) & (i < 900)])
    found = answer(capsys, "eigenvalues", path / "system.yaml", "--modes", "6")
    _same(_values(found), np.array(sorted(expected[i > 0], key=abs)[:6]))
    assert found["certified"]


@pytest.mark.parametrize("method", ["full", "reduced"])
def test_sweeps(method, sparse, capsys):
    path, expected = sparse
    options = ("--band", "200:260", "--sweep", "0:0.4:3", "--method", method)
    found = answer(capsys, "eigenvalues", path / "system.yaml", *options)
    assert [row["mu"] for row in found["sweep"]] == [0.0, 0.2, 0.4]
    hertz = expected.imag / (2 * np.pi)
    _same(_values(found["sweep"][1]), expected[(hertz > 200) & (hertz < 260)])
    assert all(e["residual"] < 1e-8 for row in found["sweep"] for e in row["eigenvalues"])
    assert (found["basis"] is None) == (method == "full")


@pytest.mark.parametrize("method", ["full", "reduced", "modal"])
def test_the_lowest_modes_of_a_sweep_are_no_more_than_asked_for(method, tmp_path, capsys):
    # sqrt(1 - c^2/4) and sqrt(1.21 - c^2/4): a neighbour within a fifth, and it grows
    file = tmp_path / "two.yaml"
    file.write_text(
        "M: [[1, 0], [0, 1]]\nC: {matrix: [[0.1, 0], [0, -0.1]]}\n"
        "K: [{matrix: [[1, 0], [0, 1.21]]}, {factor: mu, matrix: [[0, 1e-9], [0, 0]]}]\n"
    )
    options = ("--modes", "1", "--sweep", "0:1:3", "--method", method)
    for row in answer(capsys, "eigenvalues", file, *options)["sweep"]:
        assert _values(row) == pytest.approx([-0.05 + 1j * (1 - 0.05**2) ** 0.5])
        assert row["verdict"] == "flutter"


@pytest.fixture
def flutters_in_the_second_mode(tmp_path):
    """Four rows: a slow oscillator, two coupled ones that flutter at mu = 1, a fast one."""
    rows = {
        "C0": np.diag([0.01] * 4),
        "K0": np.diag([0.2, 2.0, 2.0, 9.0])
        - np.diag([0.0, 1.0, 0.0], 1)
        - np.diag([0.0, 1, 0], -1),
        "K1": np.diag([0.0, 1.333, 0.0], 1),
    }
    path = tmp_path / "four.yaml"
    lines = [f"{name}: {matrix.tolist()}" for name, matrix in {"M": np.eye(4), **rows}.items()]
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize("options", [["--modes", 1], ["--band", "0:0.6", "--modes", 1]])
def test_few_roots_are_listed_and_all_are_judged(options, flutters_in_the_second_mode, capsys):
    path = flutters_in_the_second_mode
    found = answer(capsys, "eigenvalues", path, "--at", 1, *options)
    assert len(found["eigenvalues"]) == 1
    assert found["verdict"] == "flutter"
    assert found["certified"]
    [grows] = found["unstable"]
    # s = 2 +- i sqrt(1/3) of the middle block, lambda^2 + 0.01 lambda + s = 0
    exact = -0.005 + np.sqrt(0.005**2 - 2 + 1j * np.sqrt(0.333) + 0j)
    assert grows["growth_rate"] == pytest.approx(exact.real, rel=1e-6)
    sweep = answer(capsys, "eigenvalues", path, "--sweep", "0:1:3", *options)["sweep"]
    known = "stable" if len(options) == 2 else None  # of a band only what grows
    assert [row["verdict"] for row in sweep] == [known, known, "flutter"]
    assert all(len(row["eigenvalues"]) == 1 for row in sweep)


def test_a_shape_on_coordinates(small, tmp_path, capsys):
    path, _ = small
    rows = [f"{k // 3},{'xyz'[k % 3]},{k // 3},0,0" for k in range(30)]
    (path / "nodes.csv").write_text("\n".join(["node,dof,x,y,z", *rows]))
    file = path / "placed.yaml"
    file.write_text(FILE + "coordinates: {file: nodes.csv}\n")
    still, moving = tmp_path / "mode.png", tmp_path / "mode.gif"
    answer(capsys, "eigenvalues", file, "--shape", "3", "--png", still, "--gif", moving)
    assert still.read_bytes().startswith(b"\x89PNG")
    assert moving.read_bytes().startswith(b"GIF89a")
    for given, options in [
        (path / "system.yaml", ["--shape", "1", "--png", still]),
        (path / "system.yaml", ["--gif", moving]),
        (file, ["--shape", "61", "--png", still]),
        (file, ["--shape", "1"]),
        (file, ["--band", "1e7:1.1e7", "--shape", "1", "--png", still]),
        (file, ["--gif", tmp_path / "mode.mp4"]),
    ]:
        assert_refused(capsys, "eigenvalues", given, *options)
