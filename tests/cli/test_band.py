"""A band names frequencies: what grows in it is listed however fast it grows, in any size."""

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import csc_array, diags_array

from squeal.sparse import argument_principle
from tests.cli.calls import answer

ROWS = 80  # more are treated as many
N = ROWS + 20


@pytest.fixture(autouse=True)
def _few_rows_are_many(monkeypatch):
    monkeypatch.setattr("squeal.analysis.systems.roots.ALL_ROWS", ROWS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Modes at 4, 8, ... Hz, unit masses; one row diverges with 1000 1/s, or two flutter."""
    path = tmp_path_factory.mktemp("band")
    squares = (2 * np.pi * 4.0 * np.arange(1, N + 1)) ** 2
    diverges = squares.copy()
    diverges[40] = -1e6
    flutter = csc_array(([4e5, -4e5], ([30, 31], [31, 30])), shape=(N, N))
    mmwrite(path / "m.mtx", diags_array(np.ones(N)).tocoo())
    mmwrite(path / "d.mtx", diags_array(diverges).tocoo())
    mmwrite(path / "k.mtx", diags_array(squares).tocoo())
    mmwrite(path / "f.mtx", flutter.tocoo())
    (path / "diverges.yaml").write_text("M: {file: m.mtx}\nK: {file: d.mtx}\n")
    (path / "flutters.yaml").write_text(
        "parameters: {mu: 1.0}\nM: {file: m.mtx}\nK: [{file: k.mtx}, {file: f.mtx, factor: mu}]\n"
    )
    pair = np.sqrt(np.linalg.eigvals(-np.diag(squares[30:32]) - flutter[30:32, 30:32].toarray()))
    return path, max(pair, key=lambda root: root.real)


def test_a_divergence_far_right_of_a_low_band(folder, capsys):
    found = answer(capsys, "eigenvalues", folder[0] / "diverges.yaml", "--band", "0:50")
    assert found["verdict"] == "divergence"
    assert found["certified"]
    assert found["growth_limit"] is None
    assert found["unstable"][0]["growth_rate"] == pytest.approx(1000.0, rel=1e-9)
    assert len(found["eigenvalues"]) == 13  # 4 to 48 Hz, and the real one


def test_a_flutter_that_grows_faster_than_its_band_is_wide(folder, capsys):
    root = folder[1]
    hertz = abs(root.imag) / (2 * np.pi)
    low, high = hertz - 10.0, hertz + 10.0
    assert root.real > 2 * np.pi * high / 4
    path = folder[0] / "flutters.yaml"
    found = answer(capsys, "eigenvalues", path, "--band", f"{low}:{high}")
    assert found["verdict"] == "flutter"
    assert found["certified"]
    assert found["unstable"][0]["growth_rate"] == pytest.approx(root.real, rel=1e-9)


def test_without_a_bound_the_limit_is_said(folder, capsys, monkeypatch):
    monkeypatch.setattr(argument_principle, "BOUND_ROWS", 10)
    path = folder[0] / "diverges.yaml"
    found = answer(capsys, "eigenvalues", path, "--band", "1:50")
    assert found["growth_limit"] == pytest.approx(2 * np.pi * 50 / 4)
    assert found["verdict"] is None
