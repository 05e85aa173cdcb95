"""Queries of systems from matrices: bands, verdicts, onsets and keys, against closed forms."""

import math
import re

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import coo_array, csc_array, diags_array

from tests import large
from tests.cli.calls import answer, assert_refused
from tests.conftest import SCENES

ROWS = 80  # more are treated as many


@pytest.fixture(autouse=True)
def _few_rows_are_many(monkeypatch):
    monkeypatch.setattr("squeal.queries.systems.all_roots.ALL_ROWS", ROWS)


def put(folder, text, **matrices):
    """A system file and the matrices that it names; vectors are diagonals."""
    for name, matrix in matrices.items():
        sparse = diags_array(matrix) if np.ndim(matrix) == 1 else matrix
        mmwrite(folder / f"{name}.mtx", coo_array(sparse))
    path = folder / "system.yaml"
    path.write_text(text)
    return path


FILE = """\
name: blocks
parameters: {mu: 0.2}
M: {file: m.mtx}
C: {file: c.mtx}
K: [{file: k.mtx}, {file: f.mtx, factor: mu}]
"""


def _blocks(folder, n):
    """A system of n rows and its roots."""
    rng = np.random.default_rng(3)
    a = rng.uniform(0.5, 3.0, n)
    w = np.sort(rng.uniform(100.0, 5000.0, n))
    M, C, K = large.blocks(a, w, rng)
    F = csc_array(([2e4], ([0], [1])), shape=(n, n))
    put(folder, FILE, m=M, c=C, k=K, f=F)
    A = np.linalg.solve(M.toarray(), np.hstack([-(K + 0.2 * F).toarray(), -C.toarray()]))
    return np.linalg.eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), A]))


@pytest.fixture(scope="module", params=[30, ROWS + 1])
def system(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("blocks")
    return path / "system.yaml", _blocks(path, request.param)


def _same(found, expected):
    assert found["certified"]
    values = np.array([complex(e["real"], e["imag"]) for e in found["eigenvalues"]])
    assert len(values) == len(expected)
    distance = np.abs(values[:, None] - expected[None, :])
    assert distance.min(axis=0).max() < 1e-6 * np.abs(expected).max()


def test_a_band_a_region_and_the_lowest_modes_are_complete(system, capsys):
    path, expected = system
    found = answer(capsys, "eigenvalues", path, "--band", "200:400")
    hertz = expected.imag / (2 * np.pi)
    _same(found, expected[(hertz > 200) & (hertz < 400)])
    assert found["count"] == len(found["eigenvalues"]) > 5
    assert max(e["residual"] for e in found["eigenvalues"]) < 1e-12
    r = expected.real
    i = expected.imag
    found = answer(capsys, "eigenvalues", path, "--region", "-2:1:300:900")
    _same(found, expected[(r > -2) & (r < 1) & (i > 300) & (i < 900)])
    found = answer(capsys, "eigenvalues", path, "--modes", "6")
    _same(found, np.array(sorted(expected[i > 0], key=abs)[:6]))


@pytest.mark.parametrize("options", [["--modes", 1], ["--band", "0:0.6", "--modes", 1]])
def test_few_roots_are_listed_and_all_are_judged(options, tmp_path, capsys):
    """Four rows: a slow oscillator, two coupled ones that flutter at mu = 1, a fast one."""
    path = put(
        tmp_path,
        "M: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
        "C0: [[0.01, 0, 0, 0], [0, 0.01, 0, 0], [0, 0, 0.01, 0], [0, 0, 0, 0.01]]\n"
        "K0: [[0.2, 0, 0, 0], [0, 2, -1, 0], [0, -1, 2, 0], [0, 0, 0, 9]]\n"
        "K1: [[0, 0, 0, 0], [0, 0, 1.333, 0], [0, 0, 0, 0], [0, 0, 0, 0]]\n",
    )
    found = answer(capsys, "eigenvalues", path, "--at", 1, *options)
    assert len(found["eigenvalues"]) == 1
    assert found["verdict"] == "flutter"
    assert found["certified"]
    [grows] = found["unstable"]
    # s = 2 +- i sqrt(1/3) of the middle block, lambda^2 + 0.01 lambda + s = 0
    exact = -0.005 + np.sqrt(0.005**2 - 2 + 1j * np.sqrt(0.333) + 0j)
    assert grows["growth_rate"] == pytest.approx(exact.real, rel=1e-6)
    sweep = answer(capsys, "eigenvalues", path, "--sweep", "0:1:3", *options)["sweep"]
    assert [row["verdict"] for row in sweep] == ["stable", "stable", "flutter"]
    assert all(len(row["eigenvalues"]) == 1 for row in sweep)


def test_a_shape_is_drawn_on_nodes_and_refused_without_them(tmp_path, capsys):
    _blocks(tmp_path, 30)
    rows = [f"{k // 3},{'xyz'[k % 3]},{k // 3},0,0" for k in range(30)]
    (tmp_path / "nodes.csv").write_text("\n".join(["node,dof,x,y,z", *rows]))
    plain = tmp_path / "system.yaml"
    placed = tmp_path / "placed.yaml"
    still = tmp_path / "mode.png"
    placed.write_text(FILE + "coordinates: {file: nodes.csv}\n")
    answer(capsys, "eigenvalues", placed, "--shape", "3", "--png", still)
    assert still.read_bytes().startswith(b"\x89PNG")
    for given, *options in [
        (plain, "--shape", "1", "--png", still),
        (placed, "--shape", "61", "--png", still),
        (placed, "--shape", "1"),
        (placed, "--band", "1e7:1.1e7", "--shape", "1", "--png", still),
    ]:
        assert_refused(capsys, "eigenvalues", given, *options)


@pytest.mark.parametrize("kind", ["divergence", "flutter"])
def test_what_grows_far_right_of_a_band_is_in_a_region_and_beyond_a_named_limit(
    kind, tmp_path, capsys
):
    """Modes at 4, 8, ... Hz, unit masses; one row diverges with 1000 1/s, or two flutter: a region
    holds them, and of a band the limit of growth is named."""
    n = ROWS + 20
    squares = (2 * np.pi * 4.0 * np.arange(1, n + 1)) ** 2
    force = csc_array(([4e5, -4e5], ([30, 31], [31, 30])), shape=(n, n))
    pair = np.sqrt(np.linalg.eigvals(-np.diag(squares[30:32]) - force[30:32, 30:32].toarray()))
    root = max(pair, key=lambda root: root.real)
    low, high = abs(root.imag) / (2 * np.pi) + np.array([-10.0, 10.0])
    assert root.real > 2 * np.pi * high / 4
    if kind == "divergence":
        squares[40] = -1e6
        force = 0 * force
        root = 1000.0
        low = 0.0
        high = 50.0
    text = FILE.replace("C: {file: c.mtx}\n", "")
    path = put(tmp_path, text, m=np.ones(n), k=squares, f=5 * force)
    found = answer(capsys, "eigenvalues", path, "--band", f"{low}:{high}")
    assert found["certified"]
    assert found["verdict"] is None
    assert found["growth_limit"] == pytest.approx(2 * np.pi * high / 4)
    region = [-1, 1100, *(2 * np.pi * np.array([low, high]))]
    wide = answer(capsys, "eigenvalues", path, f"--region={':'.join(map(str, region))}")
    assert wide["certified"]
    assert wide["verdict"] == kind
    assert wide["unstable"][0]["growth_rate"] == pytest.approx(root.real, rel=1e-9)


def test_a_factor_that_divides_by_the_parameter_starts_above_zero(tmp_path, capsys):
    path = put(
        tmp_path,
        "parameters: {W: 1}\nparameter: W\nM: [[1, 0], [0, 1]]\n"
        "C: [{matrix: [[0.1, 0], [0, 0.1]], factor: 1/W}]\n"
        "K: [{matrix: [[2, 0], [0, 3]]}, {matrix: [[0, 1], [-1, 0]], factor: W}]\n",
    )
    found = answer(capsys, "critical-friction", path, "--max", "5000")
    assert found["mu_start"] == pytest.approx(50.0)
    found = answer(capsys, "critical-friction", path, "--max", "2", "--min", "0.1")
    # equal damping c = 0.1 / W: W^2 = 1/4 + c^2 times the mean square 5/2
    W = np.sqrt(np.roots([1.0, -0.25, -0.01 * 2.5]).max())
    assert [c["mu"] for c in found["crossings"]] == pytest.approx([W], rel=1e-9)


MEETS = (4e4 - 400) / 1.97e4
PASSES = 4e4 / 1.97e4


@pytest.mark.parametrize("options", [(), ("--band", "0:1000")])
@pytest.mark.parametrize("high", ["2.005", "3"])
def test_a_pair_that_meets_changes_the_verdict_and_crosses_nothing(options, high, tmp_path, capsys):
    """s^2 - 40 s + k, k = 4e4 - 1.97e4 mu: a growing pair, two real roots, then one of them."""
    meeting = put(
        tmp_path,
        "M: [[1, 0], [0, 1]]\nC: [{matrix: [[-40, 0], [0, 1]]}]\nK: [{matrix: [[4.0e4, 0], [0, "
        "1.0e+8]]}, {matrix: [[-1.97e4, 0], [0, 0]], factor: mu}]\n",
    )
    found = answer(capsys, "critical-friction", meeting, "--max", high, *options)
    beyond = float(high) > PASSES
    crossed = [(c["kind"], c["direction"], c["changes_verdict"]) for c in found["crossings"]]
    assert crossed == [("divergence", "down", False)] * beyond
    assert [p["kind"] for p in found["critical"]] == ["divergence"] * beyond
    assert [p["mu"] for p in found["critical"]] == pytest.approx([MEETS] * beyond, rel=1e-9)
    assert found["certified"]


def test_verdicts_in_a_band_of_a_large_system_change_where_growth_changes_hands(tmp_path, capsys):
    """A pair that grows at 0.05 beside r^2 + 0.3 r + 0.2 - mu = 0, and many that decay."""
    stiffness = np.r_[36.0, 0.2, np.linspace(400.0, 4000.0, ROWS)]
    damping = np.r_[-0.1, 0.3, np.full(ROWS, 0.4)]
    falls = np.r_[0.0, -1.0, np.zeros(ROWS)]
    path = put(tmp_path, FILE, m=np.ones(ROWS + 2), c=damping, k=stiffness, f=falls)
    found = answer(capsys, "critical-friction", path, "--max", "0.5", "--band", "0:1.5")
    (crossing,) = found["crossings"]
    (point,) = found["critical"]
    assert crossing["mu"] == pytest.approx(0.2, rel=1e-10)
    assert not crossing["changes_verdict"]
    assert point["mu"] == pytest.approx(0.2 + 0.05**2 + 0.3 * 0.05, rel=1e-9)
    assert point["kind"] == "divergence"
    assert found["certified"]
    assert found["left_out"] == []


@pytest.mark.parametrize("high", ["1.05", "2"])
def test_a_root_that_grows_beyond_the_band_is_said_to_leave(high, tmp_path, capsys):
    """r^2 + 0.1 r + 1 - mu = 0 from mu = 1 on; r is a quarter of 2 pi 0.2 Hz at mu = 1.13."""
    path = put(
        tmp_path,
        "M: [[1, 0], [0, 0]]\nC: [{matrix: [[0.1, 0], [0, 2]]}]\n"
        "K: [{matrix: [[1, 0], [0, 5]]}, {matrix: [[-1, 0], [0, 0]], factor: mu}]\n",
    )
    found = answer(capsys, "critical-friction", path, "--max", high, "--band", "0:0.2")
    (crossing,) = found["crossings"]
    (point,) = found["critical"]
    assert crossing["mu"] == pytest.approx(1.0, rel=1e-12)
    assert crossing["changes_verdict"]
    assert (point["kind"], point["mu"]) == ("divergence", crossing["mu"])
    assert found["unconfirmed"] == []
    assert found["proof"]["status"] == "counted"  # a row without mass: no proof
    assert len(found["left_out"]) == (high == "2")
    (of_all,) = answer(capsys, "critical-friction", path, "--max", high)["crossings"]
    assert of_all["mu"] == pytest.approx(1.0, rel=1e-12)  # without a band no root leaves


def test_a_root_that_comes_back_into_the_band_is_said_to_be_outside_in_between(tmp_path, capsys):
    """It grows from mu = 0.2 on; near mu = 0.3 it has twice the frequency, beyond the band."""
    fast = np.r_[0.0, np.linspace(3.0, 20.0, ROWS) ** 2]
    bump = "1 + 3/(1 + 200*(mu - 0.3)**2)"
    path = put(
        tmp_path,
        "M: {file: m.mtx}\nC: [{file: c.mtx}, {file: d.mtx, factor: 0.2 - mu}]\n"
        f"K: [{{file: k.mtx}}, {{file: f.mtx, factor: {bump}}}]\n",
        m=np.ones(ROWS + 1),
        c=0.01 * np.r_[0.0, np.ones(ROWS)],
        d=0.01 * np.r_[1.0, np.zeros(ROWS)],
        k=fast,
        f=np.r_[1.0, np.zeros(ROWS)],
    )
    found = answer(capsys, "critical-friction", path, "--max", "2", "--band", "0.01:0.25")
    (crossing,) = found["crossings"]
    assert crossing["mu"] == pytest.approx(0.2, rel=1e-9)
    (words,) = found["left_out"]
    outside, inside = map(float, re.findall(r"mu = ([\d.]+)", words))
    for mu, is_inside in ((outside, False), (inside, True)):
        hertz = np.sqrt(1 + 3 / (1 + 200 * (mu - 0.3) ** 2)) / math.tau
        assert (hertz < 0.25) == is_inside
    assert "leave or enter" in words
    assert outside < inside  # it comes back: words of a root that leaves "by" a value were wrong


@pytest.mark.parametrize(
    ("options", "onsets"),
    [
        ((), [0.5, 0.75]),
        (("--band", "0.1:1"), [0.75]),
        (("--band", "1:5"), [0.5]),
        (("--band", "6:7"), []),
        (("--modes", "1"), [0.5, 0.75]),
        (("--region", "-1:1:1:2"), [0.75]),
    ],
)
def test_a_mode_has_its_onset_however_few_roots_are_asked_for(options, onsets, tmp_path, capsys):
    """omega^2 = 2 +- sqrt(1 - 4 mu / 3), flutter from 3/4 on, and 200 +- 100 sqrt(1 - 2 mu)."""
    path = put(
        tmp_path,
        "M: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\nparameters: {mu: 1}\nK:\n"
        "- {matrix: [[2, -1, 0, 0], [-1, 2, 0, 0], [0, 0, 200, -100], [0, 0, -100, 200]]}\n"
        "- {matrix: [[0, 1.3333333333333333, 0, 0], [0, 0, 0, 0], [0, 0, 0, 200], [0, 0, 0, 0]], "
        "factor: mu}\n",
    )
    found = answer(capsys, "eigenvalues", path, *options)
    assert found["warnings"] == []
    assert sorted(mode["onset"] for mode in found["unstable"]) == pytest.approx(onsets, rel=1e-12)


# lambda^2 = -2 +- sqrt(1 - 4/3 mu): flutter above mu = 3/4, divergence below -9/4
SHORT = "M: [[1, 0], [0, 1]]\nK0: [[2, -1], [-1, 2]]\nK1: [[0, 1.3333333333333333], [0, 0]]\n"
GENERAL = """parameters: {mu: 0, k: 2}
M: [[1, 0], [0, 1]]
K:
  - {matrix: [[1, 0], [0, 1]], factor: k}
  - {matrix: [[0, -1], [-1, 0]]}
  - {matrix: [[0, 1.3333333333333333], [0, 0]], factor: mu}
"""


def test_verdict_at_start_is_that_of_the_lower_end_and_at_zero_only_of_zero(tmp_path, capsys):
    forms = [put(tmp_path, text).rename(tmp_path / text[:1]) for text in (SHORT, GENERAL)]
    for path in (*forms, SCENES / "b3.yaml"):
        found = answer(capsys, "critical-friction", path)
        assert found["verdict_at_zero"] == found["verdict_at_start"] == "marginal"
        assert (found["mu_start"], found["mu_end"]) == (0.0, 2.0)
    for path in forms:
        found = answer(capsys, "critical-friction", path, "--min", "1")
        assert (found["verdict_at_zero"], found["verdict_at_start"]) == (None, "flutter")


@pytest.mark.parametrize("key", ["K", "K0"])
def test_a_file_without_a_mass_is_refused_by_the_key_M(tmp_path, capsys, key):
    path = put(tmp_path, f"{key}: [[2, -1], [0.25, 2]]\n")
    for command in ("eigenvalues", "critical-friction", "check"):
        assert ": M: " in assert_refused(capsys, command, path)
