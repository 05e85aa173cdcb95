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
    monkeypatch.setattr("squeal.analysis.systems.wanted.ALL_ROWS", ROWS)


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


@pytest.fixture
def flutters(tmp_path):
    """Two rows, flutter at some 100 Hz for mu > 0 and little damping s."""
    path = tmp_path / "fl.yaml"
    path.write_text(
        "M: [[1, 0], [0, 1]]\nparameters: {mu: 1.0, s: 1.0}\n"
        "K: [{matrix: [[4.0e5, 0], [0, 4.0e5]]}, {matrix: [[0, 4.0e5], [-4.0e5, 0]], factor: mu}]\n"
        "C: {matrix: [[1, 0], [0, 1]], factor: s}\n"
    )
    return path


def test_a_band_without_roots_has_a_verdict_of_its_own(flutters, folder, capsys):
    for path in (flutters, folder[0] / "flutters.yaml"):
        found = answer(capsys, "eigenvalues", path, "--band", "1681:1683")
        assert (found["eigenvalues"], found["verdict"]) == (
            [],
            None if path == folder[0] / "flutters.yaml" else found["verdict"],
        )
    path = flutters
    options = ("--sweep", "0:1:2", "--band", "1000:2000", "--csv", path.with_suffix(".csv"))
    found = answer(capsys, "eigenvalues", path, *options, "--png", path.with_suffix(".png"))
    assert [row["verdict"] for row in found["sweep"]] == [None] * 2
    lines = path.with_suffix(".csv").read_text().splitlines()[1:]
    assert [(line[:3], line[-8:]) for line in lines] == [("0.0", ".0,,,,,,"), ("1.0", ".0,,,,,,")]


def test_a_chart_tells_points_without_roots(flutters, capsys):
    """In 90 to 105 Hz lies the pair at mu = 0 (100.7 Hz), which leaves it upwards."""
    table = flutters.with_suffix(".csv")
    options = ("--first", "mu:0:2", "--second", "s:0.5:2", "--n", "4", "--csv", table)
    picture = flutters.with_suffix(".png")
    found = answer(capsys, "map", flutters, "--band", "90:105", *options, "--png", picture)
    verdicts = found["verdicts"]
    hertz = [np.sqrt(np.sqrt(16e10 * (1 + mu**2)) / 2 + 2e5) / 2 / np.pi for mu in MIDDLES]
    assert [row[0] == "no root" for row in verdicts] == [f > 105 for f in hertz]
    assert found["share"]["no root"] == np.mean([row == ["no root"] * 4 for row in verdicts]) > 0
    assert sum(found["share"].values()) == pytest.approx(1.0)
    rows = table.read_text().splitlines()[1:]
    assert len(rows) == 16
    assert rows[-1].endswith(",no root,")
    assert picture.exists()


MIDDLES = (0.25, 0.75, 1.25, 1.75)


def test_a_reduced_system_says_where_its_band_ends(folder, capsys):
    path, options = folder[0] / "flutters.yaml", ("--band", "100:120", "--sweep", "0:0.1:3")
    found = answer(capsys, "eigenvalues", path, *options)
    assert found["basis"]["growth_limit"] == pytest.approx(2 * np.pi * 120 / 4)
    assert found["basis"]["converged"]
    assert found["growth_limit"] is None
