"""A verdict is of what was proven: some of a system's roots cannot make it stable."""

import json
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import coo_array

import squeal
from squeal.errors import ComputationError, MatrixError
from squeal.linear.eigen import spectrum_of
from squeal.linear.terms import Term
from squeal.queries.systems import all_roots, roots
from squeal.queries.systems.roots import system_roots
from squeal.results.sources import EigenvalueSelection
from squeal.sparse import region_roots
from tests.conftest import ROOT
from tests.known import system_of

HIGH = 6400.0  # Hz, of the pair that grows


def brake(n, growth):
    """n rows of 10 Hz and more, damped, and above all of them a pair at HIGH that grows (1/s)."""
    omega = 2 * np.pi * np.concatenate([10.0 * np.arange(1, n), [HIGH]])
    C = np.full(n, 0.5)
    C[-1] = -2 * growth
    return system_of(*(sparse.csr_array(sparse.diags(d)) for d in (np.ones(n), C, omega**2)))


@pytest.mark.parametrize("n", [100, 420])
@pytest.mark.parametrize("growth", [-20.0, 20.0])
def test_some_roots_alone_never_say_stable(n, growth):
    system = brake(n, growth)
    whole = "flutter" if growth > 0 else "stable"
    lowest = system_roots(system)
    assert lowest.verdict == (whole if n == 100 else None)
    assert lowest.certified  # of the disc that is named
    above = system_roots(system, EigenvalueSelection(band=(HIGH - 100, HIGH + 100)))
    below = system_roots(system, EigenvalueSelection(band=(5.0, 205.0)))
    assert above.verdict == (whole if n == 100 or growth > 0 else None)
    assert below.verdict == ("stable" if n == 100 and growth < 0 else None)
    assert len(below.eigenvalues) == 20


def test_an_answer_names_the_modes_that_it_is_about():
    """The one that grows lies above the 20 that are listed."""
    found = squeal.eigenvalues(brake(420, 20.0))
    assert not found.unstable
    assert "20" in found.extent
    assert squeal.eigenvalues(brake(100, 20.0)).extent == ""


def test_a_root_that_does_not_solve_the_equations_decides_nothing():
    """A penalty of 1e30 leaves the other roots no digit."""
    K = np.array([[1e30, 0.0, 0.0], [0.0, 4e6, 1e6], [0.0, 0.0, 9e6]])
    found = system_roots(system_of(np.eye(3), None, K))
    solved = [e for e in found.eigenvalues if e.residual <= 1e-6]
    assert found.verdict not in ("flutter", "divergence")
    assert all(e.value.real <= 1e-6 * abs(e.value) for e in solved)


@pytest.mark.parametrize("wanted", [EigenvalueSelection(), EigenvalueSelection(modes=3)])
def test_a_list_that_lacks_a_root_is_not_certified(wanted, monkeypatch):
    whole = spectrum_of
    system = brake(10, -20.0)
    assert system_roots(system, wanted).certified

    def lacking(*known):
        spectrum = whole(*known)
        return replace(spectrum, eigenvalues=spectrum.eigenvalues[2:])

    monkeypatch.setattr(roots, "spectrum_of", lacking)
    found = system_roots(system, wanted)
    assert found.count is not None
    assert not found.certified
    assert found.verdict is None


def turned(parts, seed):
    """Matrices of which the last row has no mass, in coordinates turned at random: rounding leaves
    it a mass of either sign, which no list in doubles knows."""
    n = len(parts[0])
    Q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))
    M, C, K = (Q.T @ X @ Q for X in parts)
    return (M + M.T) / 2, C, (K + K.T) / 2


def without_last_mass(n, damping):
    stiffness = 4.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return np.diag(np.r_[np.ones(n - 1), 0.0]), damping * stiffness, stiffness


ROUNDED = [
    # of the last two rows C is singular in decimals, and regular in doubles
    (
        np.diag([1.0, 0, 0]),
        [[0.1, 0, 0], [0, 0.1, 0.3], [0, 0.3, 0.9]],
        [[2, 1, 0], [1, 1, 0], [0, 0, 1]],
    ),
    *[turned(without_last_mass(4, damping), seed) for damping in (0.0, 0.1) for seed in range(3)],
    turned(without_last_mass(90, 0.1), 0),  # too many rows for the exact means of the referee
]


@pytest.mark.parametrize(("M", "C", "K"), ROUNDED)
@pytest.mark.parametrize(("prove", "stiffness_terms"), [(None, 1), (False, 2)])
def test_what_hangs_on_the_rounding_of_a_mass_has_no_verdict(M, C, K, prove, stiffness_terms):
    """A mass of 1e-17 and of either sign adds roots of 1e8 1/s and more that decay or grow."""
    factors = {"mu": K}
    if stiffness_terms == 2:  # whose sum is rounded
        factors = {"1": 0.9 * np.array(K), "mu": 0.1 * np.array(K)}
    system = squeal.System(M, C, factors, parameters={"mu": 1.0})
    found = squeal.eigenvalues(system, prove=prove)
    assert len(found.eigenvalues) < found.count == 2 * len(M) - 2 * (M[-1][-1] == 0)
    assert not found.certified
    assert found.verdict is None
    assert found.conclusion.startswith("Open")
    assert found.to_dict()["proof"]["status"] == "open"
    if prove is None and len(M) == 90:
        assert "of the growth rates no bound is proved" in str(found)
    assert squeal.sweep(system, [1.0]).steps[0].verdict is None


def fluttering(n, damping, seed):
    """Rows of which two exchange energy, the last one without mass but for rounding."""
    M, C, K = without_last_mass(n, damping)
    K[:2, :2] += [[0.0, 3.5], [-3.5, 0.0]]
    Q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))
    M = Q.T @ M @ Q
    return (M + M.T) / 2, Q.T @ C @ Q, Q.T @ K @ Q


def fastest_kinds(M, C, K):
    """What grows fastest where the last entry of M is an ulp less, as given, or more: of 60 digits,
    as a root may be 1e15 times as fast as another."""
    n = len(M)
    kinds = set()
    with mp.workdps(60):
        for last in (np.nextafter(M[-1, -1], -np.inf), M[-1, -1], np.nextafter(M[-1, -1], np.inf)):
            changed = mp.matrix(M.tolist())
            changed[n - 1, n - 1] = mp.mpf(float(last))
            inverse = mp.inverse(changed)
            A = mp.zeros(2 * n)
            A[:n, n:] = mp.eye(n)
            A[n:, :n] = -inverse * mp.matrix(K.tolist())
            A[n:, n:] = -inverse * mp.matrix(C.tolist())
            fastest = max(mp.eig(A, left=False, right=False), key=lambda root: root.real)
            kinds.add("flutter" if abs(fastest.imag) > 1e-9 else "divergence")
    return kinds


@pytest.mark.parametrize(("damping", "prove"), [(0.0, False), (0.02, None)])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("ulps", "kinds"), [(-16, {"divergence"}), (0, None), (16, {"flutter"})])
def test_growth_is_no_verdict_where_the_rounding_of_a_mass_may_add_faster_growth(
    damping, seed, prove, ulps, kinds
):
    """The mass is a rounding of any sign, and by some ulps of one entry negative or positive."""
    M, C, K = fluttering(4, damping, seed)
    without_mass = np.linalg.svd(M)[2][-1]
    row = np.argmax(np.abs(without_mass))
    M[row, row] += ulps * np.spacing(M[row, row])
    if kinds is not None:
        assert fastest_kinds(M, C, K) == kinds
    found = squeal.eigenvalues(squeal.System(M, C, K), prove=prove)
    assert (found.verdict, found.certified) == (None, False)
    assert "roots are listed, there may be up to 8" in found.criterion
    assert [mode.kind for mode in found.unstable] == ["flutter"]  # which grows whatever the mass


@pytest.mark.parametrize("n", [1, 30])
@pytest.mark.parametrize("prove", [None, False])
def test_entries_that_cancel_exactly_take_roots(n, prove):
    """Masses in a chain, each with a dashpot and two springs in series to the ground: the ends of
    the dashpots have no mass, and each dashpot adds one root. All is passive."""
    M, C, K = np.zeros((3, 3 * n, 3 * n))
    M[range(n), range(n)] = 1.0

    def couple(X, one, other, size):
        X[one, one] += size
        X[other, other] += size
        X[one, other] -= size
        X[other, one] -= size

    for k in range(n):
        first, second = n + 2 * k, n + 2 * k + 1
        couple(K, k, first, 10.1)
        couple(C, first, second, 0.3)
        K[second, second] += 7.3
        K[k, k] += 1.0
        if k:
            couple(K, k, k - 1, 99.7)
    found = squeal.eigenvalues(squeal.System(M, C, K), prove=prove)
    assert len(found.eigenvalues) == found.count == 3 * n
    assert found.verdict == "stable"


ROWS = 2100


def chain(held=(), mass=None):
    """Equal masses and springs between walls, some rows held by penalties."""
    side = np.full(ROWS - 1, -1e6)
    K = sparse.lil_array(sparse.diags([side, np.full(ROWS, 2e6), side], [-1, 0, 1]))
    for row, penalty in held:
        K[row, row] = penalty
    mass = sparse.eye_array(ROWS) if mass is None else mass
    damping = 0.4 * sparse.eye_array(ROWS)
    return system_of(*(sparse.csc_array(X) for X in (mass, damping, K)))


@pytest.mark.parametrize("penalty", [1e22, 1e36])
def test_a_penalty_of_a_large_system_is_a_support(penalty):
    found = system_roots(chain([(0, penalty), (700, penalty)]), EigenvalueSelection(modes=6))
    k = np.arange(1, 7)
    left = 2e3 * np.sin(np.pi * k / (2 * 700))  # of so many springs between supports
    right = 2e3 * np.sin(np.pi * k / (2 * (ROWS - 700)))
    exact = np.sqrt(np.sort([*left, *right])[:6] ** 2 - 0.2**2)
    assert [e.value.imag for e in found.eigenvalues] == pytest.approx(exact, rel=1e-9)
    assert (found.verdict, found.certified) == (None, True)


def test_a_large_pencil_that_is_singular_everywhere_is_refused():
    empty = chain(mass=sparse.diags(np.r_[0.0, np.ones(ROWS - 1)]))
    K = sparse.lil_array(empty.K[0].matrix)
    K[0, :] = K[:, 0] = 0.0
    alone = replace(empty, C=(), K=(Term(sparse.csc_array(K)),))
    with pytest.raises(MatrixError, match="row 1 of M, C and K is empty"):
        system_roots(alone, EigenvalueSelection(band=(1.0, 9.0)))
    turned = np.array([[1.0, -1.0], [-1.0, 1.0]])
    M, K = (sparse.block_diag([turned, X.matrix]) for X in (*chain().M, *chain().K))
    hidden = system_of(sparse.csc_array(M), None, sparse.csc_array(K))
    with pytest.raises(ComputationError, match="share a null vector"):
        system_roots(hidden, EigenvalueSelection(band=(1.0, 9.0)))


# A small rotor against ROSS: `tests/data/rotor.py` says how its numbers were made

DATA = json.loads((ROOT / "squeal" / "examples" / "rotor.json").read_text("utf-8"))


@pytest.fixture(scope="module")
def rotor():
    parts = {}
    for name, entries in DATA["matrices"].items():
        rows, columns, values = zip(*entries, strict=True)
        parts[name] = coo_array((values, (rows, columns)), shape=(DATA["rows"],) * 2).toarray()
    C = parts["C"], (parts["G"], "speed")
    return system_of(parts["M"], C, parts["K"], {"speed": 0.0}, "speed")


@pytest.mark.parametrize("speed", DATA["eigenvalues"])
def test_eigenvalues_are_those_of_ross(rotor, speed):
    theirs = np.array([complex(*v) for v in DATA["eigenvalues"][speed]])
    found = system_roots(rotor.replace({"speed": float(speed)}))
    ours = np.array([e.value for e in found.eigenvalues if abs(e.value) > 1.0])
    assert len(ours) == len(theirs) == 32
    nearest = np.argmin(np.abs(theirs[:, None] - ours), axis=1)
    assert len(set(nearest)) == len(theirs)
    assert np.allclose(ours[nearest], theirs, rtol=1e-9)
    assert found.verdict == "flutter"  # the bearings drive a whirl
    assert np.max(ours.real) == pytest.approx(np.max(theirs.real), rel=1e-7)


@pytest.mark.parametrize("region", [(-5, 5, -30, 30), (-5, 5, 0, 30)])
@pytest.mark.parametrize("prove", [None, False])
def test_of_complex_matrices_roots_above_the_axis_alone_are_counted(region, prove):
    K = np.array([[100 * (1 + 0.02j), 1], [2, 400 * (1 + 0.01j)]])
    found = squeal.eigenvalues(squeal.System(np.eye(2), K=K), region=region, prove=prove)
    assert found.certified == (prove is None)
    assert found.count == len(found.eigenvalues) == 2


@pytest.mark.parametrize(
    ("damping", "stiffness", "part", "verdict"),
    [
        ([0.4, 0.0], [4.0, 100.0], {"band": (0.2, 0.5)}, "stable"),
        ([4.0, 0.0], [3.0, 100.0], {"region": (-3.5, -2.5, 0.0, 1.0)}, "stable"),
        ([0.4, 0.0], [4.0, 100.0], {"band": (1.0, 2.0)}, "marginal"),
        ([0.0, 0.0], [4.0, 0.0], {"band": (0.2, 0.5)}, "marginal"),
        ([0.0, 0.0], [4.0, 0.0], {"band": (0.5, 1.0)}, None),
    ],
)
def test_an_undamped_mode_elsewhere_makes_no_band_marginal(damping, stiffness, part, verdict):
    K = {"1": np.diag(stiffness), "mu": np.diag([1.0, 0.0])}
    system = squeal.System(np.eye(2), np.diag(damping), K, parameters={"mu": 0.0})
    assert squeal.eigenvalues(system, **part).verdict == verdict
    assert squeal.eigenvalues(system, prove=False, **part).verdict == verdict
    assert squeal.sweep(system, [0.0, 1.0], **part).steps[0].verdict == verdict


@pytest.mark.parametrize("n", [100, 420])
def test_a_map_of_a_band_says_that_its_verdicts_are_of_the_band(n):
    """The pair that grows lies above the band, at HIGH."""
    omega = 2 * np.pi * np.concatenate([10.0 * np.arange(1, n), [HIGH]])
    damping = np.full(n, 0.5)
    damping[-1] = -40.0
    terms = [sparse.diags_array(x, format="csc") for x in (np.ones(n), damping, omega**2)]
    M, C, K = terms
    system = squeal.System(M, C, {"1": K, "a": K, "b": K}, {"a": 0.0, "b": 0.0})
    axes = squeal.Axis("a", 0.0, 1e-3, 2), squeal.Axis("b", 0.0, 1e-3, 2)
    found = squeal.map(system, axes, band=(5.0, 55.0))
    verdict = "stable" if n == 100 else "open"  # of a first look, which counts nothing
    assert found.share[verdict] == 1.0
    conditions = squeal.conditions(system, {"a": [0.0, 1e-3]}, band=(5.0, 55.0))
    assert conditions.table().text().count("  open  ") == 2  # growth above may be known
    assert found.to_dict()["extent"] == "5 to 55 Hz"
    assert "Verdicts are of 5 to 55 Hz; what grows outside is left out" in str(found)
    if n == 100:
        whole = squeal.map(system, axes)
        assert whole.share["flutter"] == 1.0
        assert whole.to_dict()["extent"] is None
        assert "outside" not in str(whole)


def mixing(n, random):
    """An integer matrix of determinant 1 or -1: rows in another order, each added to one other."""
    order = random.permutation(n).reshape(-1, 2)
    signs = random.choice([-1.0, 1.0], size=n // 2)
    added = coo_array((signs, (order[:, 0], order[:, 1])), shape=(n, n))
    return (sparse.eye_array(n) + added).tocsr()[random.permutation(n)]


def test_defective_roots_on_the_axis_are_no_growth_in_a_large_system(monkeypatch):
    # Jordan blocks of the root 4096i among single modes; every entry is exact, so that no root has
    # a real part. Rounding splits a block of four by 0.2 1/s on either side of the axis
    monkeypatch.setattr("squeal.queries.systems.all_roots.ALL_ROWS", 40)
    random = np.random.default_rng(3)
    sizes = (4, 3, 2) * 4
    blocks = []
    for size in sizes:
        coupling = 2.0 ** (24 - random.integers(1, 9))
        blocks.append(2.0**24 * np.eye(size) + coupling * np.eye(size, k=1))
    omega = np.exp(random.uniform(np.log(300.0), np.log(60000.0), 60))
    mantissa, exponent = np.frexp(omega**2)
    single = np.ldexp(np.round(mantissa * 2**20), exponent - 20)
    K = sparse.block_diag([*blocks, sparse.diags_array(single)]).tocsr()
    left = mixing(K.shape[0], random)
    right = mixing(K.shape[0], random)
    system = squeal.System(left @ right, K=left @ K @ right)
    found = squeal.eigenvalues(system, band=(600.0, 700.0))
    assert len([root for root in found.eigenvalues if abs(root.value - 4096j) < 1.0]) == sum(sizes)
    assert found.certified
    assert found.verdict is None


def test_a_count_that_fails_is_named_as_such(monkeypatch):
    monkeypatch.setattr(region_roots, "count_roots", lambda *args: None)
    monkeypatch.setattr(region_roots, "UNCOUNTED_PART", 1.0)  # no part is halved for a count alone
    monkeypatch.setattr(all_roots, "ALL_ROWS", 40)
    omega = 2 * np.pi * 10.0 * np.arange(1.0, 61.0)
    system = squeal.System(sparse.eye_array(60), K=sparse.diags_array(omega**2))
    found = squeal.eigenvalues(system, band=(95.0, 125.0))
    assert (len(found.eigenvalues), found.count, found.certified) == (3, None, False)
    assert found.proof["reason"] == "no count agrees, others may be missing"
