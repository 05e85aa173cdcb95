"""`critical-friction` of systems from matrices: known thresholds, dense and sparse; refusals."""

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import block_diag, csc_array

from tests import large
from tests.cli.calls import answer

ROWS = 80  # more are treated as many
W1, W2, E1, E2 = 2 * np.pi * 100, 2 * np.pi * 75, 0.02, 0.04


@pytest.fixture(autouse=True)
def _few_rows_are_many(monkeypatch):
    monkeypatch.setattr("squeal.analysis.systems.roots.ALL_ROWS", ROWS)


def drum():
    """Hulten's drum brake: threshold by Routh and Hurwitz."""
    c1, c2 = E1 * W1, E2 * W2
    a3, a2, a1 = c1 + c2, W1**2 + W2**2 + c1 * c2, c1 * W2**2 + c2 * W1**2
    mu = np.sqrt(a1 * (a2 * a3 - a1) / (a3**2 * W1**2 * W2**2) - 1)
    K1 = np.array([[0.0, -(W2**2)], [W1**2, 0.0]])
    return np.diag([c1, c2]), np.diag([W1**2, W2**2]), K1, mu, np.sqrt(a1 / a3)


@pytest.fixture(scope="module")
def sparse(tmp_path_factory):
    """The drum brake among stable oscillators, mixed: more rows than are solved whole."""
    path = tmp_path_factory.mktemp("sparse")
    rng = np.random.default_rng(4)
    C, K0, K1, mu, omega = drum()
    size = ROWS
    blocks = large.blocks(rng.uniform(2.0, 9.0, size), rng.uniform(300.0, 9000.0, size), rng)
    ones = np.ones(size + 2)
    left, right = (large.blocks(ones, ones, rng, links=1)[0] for _ in range(2))
    parts = [block_diag([a, b]) for a, b in zip((np.eye(2), C, K0), blocks, strict=True)]
    parts.append(block_diag([K1, csc_array((size, size))]))
    for name, matrix in zip("mckf", parts, strict=True):
        mmwrite(path / f"{name}.mtx", csc_array(left @ csc_array(matrix) @ right))
    (path / "system.yaml").write_text(
        "M: {file: m.mtx}\nC: {file: c.mtx}\nK: [{file: k.mtx}, {file: f.mtx, factor: mu}]\n"
    )
    return path / "system.yaml", mu, omega


def test_a_sparse_system(sparse, capsys):
    path, mu, omega = sparse
    found = answer(capsys, "critical-friction", path, "--max", "0.6", "--band", "60:110")
    (crossing,) = found["crossings"]
    assert crossing["mu"] == pytest.approx(mu, rel=1e-10)
    assert crossing["interval"][0] <= mu <= crossing["interval"][1]
    assert (crossing["kind"], crossing["direction"]) == ("flutter", "up")
    assert crossing["changes_verdict"]
    (critical,) = found["critical"]
    assert critical["frequency_hz"] == pytest.approx(omega / (2 * np.pi), rel=1e-10)
    assert (critical["kind"], critical["residual"] < 1e-13) == ("flutter", True)
    assert found["certified"]
    assert found["basis"]["size"] < ROWS // 8


def test_a_factor_that_divides_by_the_parameter_starts_above_zero(tmp_path, capsys):
    path = tmp_path / "system.yaml"
    path.write_text(
        "parameters: {W: 1}\nparameter: W\nM: [[1, 0], [0, 1]]\n"
        "C: [{matrix: [[0.1, 0], [0, 0.1]], factor: 1/W}]\n"
        "K: [{matrix: [[2, 0], [0, 3]]}, {matrix: [[0, 1], [-1, 0]], factor: W}]\n"
    )
    found = answer(capsys, "critical-friction", path, "--max", "5000")
    assert found["mu_start"] == pytest.approx(5.0)
    found = answer(capsys, "critical-friction", path, "--max", "2", "--min", "0.1")
    # equal damping c = 0.1 / W: W^2 = 1/4 + c^2 times the mean square 5/2
    W = np.sqrt(np.roots([1.0, -0.25, -0.01 * 2.5]).max())
    assert [c["mu"] for c in found["crossings"]] == pytest.approx([W], rel=1e-9)
