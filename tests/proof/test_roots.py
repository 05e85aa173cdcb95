"""The referee on lists of roots, judged by systems whose roots are known by construction."""

import itertools
import warnings
from typing import Any

import numpy as np
import pytest

from squeal.proof import AS_GIVEN, HALF_ULP
from squeal.proof.balls import Quadratic
from squeal.proof.enclosure import components, enclose
from squeal.proof.exact import exact_roots
from squeal.proof.pieces import Failure, growing_counts
from squeal.proof.referee import (
    FREE,
    Proof,
    enclosed,
    possible_verdicts,
    prove_roots,
    unstable_count,
)
from tests.proof.families import FAMILIES, Known, sample, unimodular

NEARLY_FREE = (
    (
        np.diag([3.0, 3.0, 1.0, 1.0]),
        [
            [0.9999999990686774, 0.0, -1.0, 2.0**-30],
            [0.0, 2.0**-36, -(2.0**-36), 0.0],
            [-1.0, -(2.0**-36), 1.000000000014552, 0.0],
            [2.0**-30, 0.0, 0.0, -(2.0**-30)],
        ],
        [
            [10.0, 0.0, -5.0, -5.0],
            [0.0, 4.0, -4.0, 0.0],
            [-5.0, -4.0, 9.0, 0.0],
            [-5.0, 0.0, 0.0, 4.9999999999999964],
        ],
    ),
    (
        [[-1024.0, 1.5], [0.078125, -9.1552734375e-05]],
        [[-1280.0, 2.0], [0.09375, -0.0001373291015625]],
        [[-2304.000000000002, 4.5], [0.16406250000000014, -0.0003204345703125]],
    ),
)
VERDICTS = ("stable", "marginal", "flutter", "divergence")


def judge(M, C, K, values, verdict=None, data=HALF_ULP) -> Proof:
    """The proof of a list of roots (m,) of dense matrices."""
    return prove_roots(Quadratic.of(M, C, K, data), values, verdict)


def distances(proof, values) -> list[float]:
    """How far each listed value (m,) lies at most from the root that it is matched to."""
    bounds = []
    for value, match in zip(values, proof.matches, strict=True):
        bounds.append(max(piece.distance_bound(value) for piece in match))
    return bounds


@pytest.fixture
def flint():
    """The exact means need it; without it the enclosure alone is tested."""
    return pytest.importorskip("flint")


def systems(seed: int, number: int, most_rows: int = 10) -> list[Known]:
    rng = np.random.default_rng(seed)
    found = []
    for family in itertools.islice(itertools.cycle(FAMILIES), number):
        rows = int(rng.integers(1, most_rows))
        try:
            found.append(sample(family, rows, bool(rng.integers(2)), rng))
        except ValueError:
            continue  # an entry would be rounded
    return found


def of(system: Known, data: str = AS_GIVEN) -> Quadratic:
    return Quadratic.of(system.M, system.C, system.K, data)


def test_the_enclosure_never_contradicts_what_is_known():
    for system in systems(1, 160):
        for data in (AS_GIVEN, HALF_ULP, "9 digits"):
            finding = enclosed(of(system, data))
            least, most = growing_counts(finding.pieces)
            assert least <= system.growing <= most or finding.failure, system.family
            if finding.failure is None:
                assert system.verdict in possible_verdicts(finding.pieces), system.family
                centres = np.concatenate([p.centres for p in finding.pieces])
                radii = np.concatenate([p.radii for p in finding.pieces])
                inside = np.abs(system.roots[:, None] - centres) <= radii + 1e-14 * abs(centres)
                assert inside.any(axis=1).all(), system.family


def test_the_exact_means_know_every_count_and_verdict(flint):
    for system in systems(2, 80):
        given = of(system)
        pieces = []
        for rows in components(given.parts):
            part = exact_roots(given.block(rows))
            assert isinstance(part, list)
            pieces += part
        assert growing_counts(pieces) == (system.growing, system.growing), system.family
        assert possible_verdicts(pieces) == {system.verdict}, system.family
        centres = np.array([piece.centres[0] for piece in pieces])
        order = np.lexsort((system.roots.imag.round(9), system.roots.real.round(9)))
        found = np.lexsort((centres.imag.round(9), centres.real.round(9)))
        np.testing.assert_allclose(centres[found], system.roots[order], rtol=1e-9, atol=1e-9)


def test_right_answers_are_proved(flint):
    for system in systems(3, 80):
        proof = prove_roots(of(system), system.roots, system.verdict)
        assert proof.status == "proved", (system.family, proof)
        assert proof.growth_below < 1e-6
        count = unstable_count(of(system))
        assert count.is_certain
        assert count.lower == system.growing


def test_mutants_of_answers_are_never_proved(flint):
    rng = np.random.default_rng(4)
    for system in systems(5, 40):
        given = of(system)
        roots = system.roots
        k = int(rng.integers(len(roots)))
        mutants: list[tuple[np.ndarray, str]] = [
            (np.delete(roots, k), system.verdict),
            (np.append(roots, roots[k]), system.verdict),
        ]
        for verdict in VERDICTS:
            if verdict != system.verdict:
                mutants.append((roots, verdict))
        for values, verdict in mutants:
            assert prove_roots(given, values, verdict).status != "proved", system.family
            assert prove_roots(of(system, HALF_ULP), values, verdict).status != "proved"


def test_a_listed_root_is_matched_to_the_true_one(flint):
    for system in systems(5, 40):
        proof = prove_roots(of(system), system.roots, system.verdict)
        error = 1e-3 if system.family == "jordan" else 1e-9  # whose vectors coincide
        allowed = error * np.abs(system.roots) + 1e-12
        assert np.all(distances(proof, system.roots) <= allowed), system.family


def test_without_the_exact_means_the_enclosure_still_decides(monkeypatch):
    monkeypatch.setattr("squeal.proof.exact.flint", None)
    proved = 0
    plain = [system for system in systems(6, 160) if system.family in ("plain", "triangle")]
    for system in plain:
        proof = prove_roots(of(system), system.roots, system.verdict)
        assert proof.status != "refuted"
        proved += proof.status == "proved"
    assert proved >= 0.7 * len(plain)
    chain = judge(np.eye(2), None, [[1.0, -1.0], [-1.0, 1.0]], [0, 0, 2**0.5 * 1j, -(2**0.5) * 1j])
    assert chain.growth_below < 1e-6


def test_shuffled_triangle_of_the_first_false_flutter():
    """Five rows, one-way coupled, everything decays by 1.3e-5; entries reach 4."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        K = np.triu(rng.uniform(-4, 4, (5, 5)), 1) + np.diag(rng.uniform(1.003, 1.017, 5))
        order = rng.permutation(5)
        K = K[np.ix_(order, order)]
        finding = enclosed(Quadratic.of(np.eye(5), 2.65e-5 * np.eye(5), K, HALF_ULP))
        assert (finding.failure, growing_counts(finding.pieces)) == (None, (0, 0))


def test_free_body_hangs_on_its_digits(flint):
    K = np.array([[1.1, -1.1, 0.0], [-1.1, 2.3, -1.2], [0.0, -1.2, 1.2]])
    roots = np.linalg.eigvalsh(K)
    roots = np.sqrt(np.abs(roots)) * np.array([0.0, 1.0, 1.0])
    values = np.concatenate([1j * roots, -1j * roots])
    ten = judge(np.eye(3), None, K, values, "divergence", "10 digits")
    assert ten.status == "open"  # the data allow it, and a free motion as well
    assert {"marginal", "divergence"} <= ten.verdicts
    free = judge(np.eye(3), None, K, values, "marginal", "10 digits")
    assert (free.status, free.reason) == ("open", FREE)
    assert 0.0 < free.growth_below < 1e-4
    # integers sum to zero exactly
    whole = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    known = [0, 0, 1j, -1j, 3**0.5 * 1j, -(3**0.5) * 1j]
    proof = judge(np.eye(3), None, whole, known, "marginal", AS_GIVEN)
    assert (proof.status, proof.by) == ("proved", "exact")


def chain_held_by(share, n, rng):
    """A free chain of doubles, and a negative spring at its end of so many half ulps of all."""
    K = np.zeros((n, n))
    for i, stiffness in enumerate(rng.uniform(1.0, 2.0, n - 1)):
        K[i : i + 2, i : i + 2] += stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    K[0, 0] -= share * np.sum(np.where(K == 0.0, 0.0, np.spacing(np.abs(K)) / 2.0))
    return K


@pytest.mark.parametrize("damped", [False, True])
def test_exact_roots_are_those_of_single_equations(damped):
    """Of q'' + 4 q, q'' - 9 q, q'' and a pair with friction (5 + 2i, 5 - 2i), mixed in integers;
    if damped beside r^2 + 2 r + 10, without which no root depends on damping."""
    K = np.zeros((5, 5))
    K[:3, :3] = np.diag([4.0, -9.0, 0.0])
    K[3:, 3:] = [[5.0, -2.0], [2.0, 5.0]]
    C = np.zeros((5, 5))
    known = [2j, -2j, 3.0, -3.0, 0.0, 0.0]
    known += [sign * root for sign in (1, -1) for root in np.sqrt([-5 + 2j, -5 - 2j])]
    if damped:
        K, C = (np.pad(X, (0, 1)) for X in (K, C))
        K[5, 5] = 10.0
        C[5, 5] = 2.0
        known += [-1 + 3j, -1 - 3j]
    left = np.array(unimodular(len(K), np.random.default_rng(1), steps=12), dtype=float)
    pieces = exact_roots(Quadratic.of(left, left @ C, left @ K))
    assert not isinstance(pieces, Failure)
    assert len(pieces) == len(known)
    for root in known:
        held = [one for one in pieces if np.abs(one.centres - root).min() <= one.radii.max()]
        side = "axis" if root.real == 0.0 else ("grows" if root.real > 0.0 else "decays")
        assert {one.side for one in held} == {side}
        assert {one.real for one in held} == {root.imag == 0.0}


@pytest.mark.parametrize("n", [3, 30])
def test_only_growth_below_the_data_is_a_free_motion(n):
    """By the translation q = 1 the data move 1' K 1 by the sum of the half ulps, and no more."""
    rng = np.random.default_rng(n)
    for share, status in ((0.0, "open"), (0.3, "open"), (3.0, "open"), (1e5, "refuted")):
        K = chain_held_by(share, n, rng)
        squares, _ = np.linalg.eigh(K)
        squares[0] = 0.0
        values = np.concatenate([1j * np.sqrt(squares), -1j * np.sqrt(squares)])
        proof = judge(np.eye(n), None, K, values, "marginal")
        assert proof.status == status
        assert proof.reason in (FREE, "listed values cannot be told apart") or share > 1.0
        assert proof.growth_below < 1e-6


def test_gyroscopic_systems_are_proved_marginal_by_mirror_images():
    G = np.array([[0.0, 3.0], [-3.0, 0.0]])
    K = np.diag([-1.0, -1.5])  # stabilised by the gyroscopic forces
    finding = enclosed(Quadratic.of(np.eye(2), G, K, HALF_ULP))
    assert (finding.failure, growing_counts(finding.pieces)) == (None, (0, 0))
    broken = Quadratic.of(np.eye(2), G + 1e-9 * np.eye(2), K, HALF_ULP)
    assert unstable_count(broken).lower == 2  # Kelvin and Tait: damping destroys it


def test_real_squares_close_to_a_coalescence_are_decided():
    """s = 2 +- sqrt(d) for an unsymmetric K: real for d > 0, a pair for d < 0."""
    for exponent in range(2, 14):
        d = 10.0**-exponent
        for sign in (1.0, -1.0):
            K = np.array([[2.0, d * sign], [1.0, 2.0]])
            count = unstable_count(Quadratic.of(np.eye(2), None, K, HALF_ULP))
            assert count.lower <= (0 if sign > 0 else 2) <= count.upper
            if exponent <= 12:
                assert count.is_certain


@pytest.mark.parametrize("data", [AS_GIVEN, HALF_ULP, "10 digits"])
def test_awkward_matrices_are_never_judged_wrongly(data):
    I = np.eye(2)
    full = np.full((2, 2), 1.7e308)
    tiny = 5e-324
    cases: list[tuple[Any, Any, Any, int | None]] = [
        # M, C, K and the roots that grow, None where every number is a root
        (I, None, 4.0 * I, 0),
        ([[1.0]], [[-1e-300]], [[4.0]], 2),
        (0.0 * I, None, 0.0 * I, None),
        (0.0 * I, None, I, 0),
        (I, None, 0.0 * I, 0),
        (I, I, 0.0 * I, 0),
        (1e150 * I, None, 1e-150 * I, 0),
        (1e-150 * I, 1e-3 * I, 1e150 * I, 0),
        (1e-308 * I, None, 1e308 * (I + 0.1), 0),
        (tiny * I, None, [[tiny, 0.0], [tiny, -tiny]], 1),
        (I, None, full, 0),
        (np.diag([1.0, -1.0]), None, np.diag([2.0, 3.0]), 1),
        (np.diag([1.0, 0.0]), None, [[2.0, -1.0], [-1.0, 1.0]], 0),
        (np.diag([1.0, 0.0]), np.diag([0.0, 1.0]), [[2.0, -1.0], [-1.0, 1.0]], 0),
        (np.diag([1e-150, 1e150]), None, np.diag([1e-150, -1e150]), 1),
        (I, None, [[0.0, 1.0], [-1.0, 2.0]], 0),
        (I, None, [[0.0, 1.0], [0.0, 0.0]], 0),
        (np.eye(2, dtype=int), None, np.array([[2, -1], [-1, 2]]), 0),
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for M, C, K, growing in cases:
            count = unstable_count(Quadratic.of(M, C, K, data))
            if growing is None:
                assert not count.is_certain
            else:
                assert count.lower <= growing <= count.upper, (M, K)


def test_what_is_no_number_is_open():
    K = np.array([[np.nan, 0.0], [0.0, 1.0]])
    proof = judge(np.eye(2), None, K, np.zeros(4))
    assert (proof.status, proof.reason) == (
        "open",
        "an entry is not finite",
    )
    empty = judge(np.zeros((0, 0)), None, np.zeros((0, 0)), [], verdict="stable")
    assert empty.status == "proved"
    with pytest.raises(ValueError, match="required"):
        judge(np.eye(2), None, np.eye(3), [])
    with pytest.raises(ValueError, match="digits"):
        judge(np.eye(2), None, np.eye(2), [], data="ten digits")
    lost = judge(np.eye(1), None, [[4.0]], [2j, np.nan])
    assert lost.status == "refuted"


def test_enclosures_of_many_rows_are_sharp():
    rng = np.random.default_rng(9)
    n = 60
    A = rng.normal(size=(n, n))
    K = A @ A.T / n + 0.1 * np.eye(n) + 0.05 * rng.normal(size=(n, n))
    pieces = enclose(Quadratic.of(np.eye(n), 0.01 * np.eye(n), K, HALF_ULP))
    assert isinstance(pieces, list)
    assert sum(piece.count for piece in pieces) == 2 * n
    assert max(radius for piece in pieces for radius in piece.radii) < 1e-9


@pytest.mark.parametrize(
    "K",
    [
        np.array([[2**53 + 1, 2**53], [2**53 + 2, 2**53 + 1]]),  # determinant 1, of doubles < 0
        np.array([[1.0 - np.longdouble(2) ** -60, 1.0], [1.0, 1.0]]),  # determinant < 0, 0
        np.array([[2**64 - 1, 0], [0, 1]], dtype=np.uint64),
    ],
)
def test_entries_that_no_double_holds_are_refused(K):
    if K.dtype.kind == "f" and K.dtype.itemsize == 8:
        pytest.skip("the longest float is a double here")
    with pytest.raises(ValueError, match="more digits than a double"):
        Quadratic.of(np.eye(2), None, K)


@pytest.mark.parametrize("kind", [bool, np.int8, np.int64, np.uint64, np.float16, np.float32])
def test_entries_of_any_type_and_order_are_the_same_numbers(kind):
    A = np.array([[3, 1, 0], [0, 2, 1], [1, 0, 4]]).astype(kind)
    same = Quadratic.of(np.eye(3), None, A.astype(float))
    strided = A.repeat(2, 0).repeat(2, 1)[::2, ::2]
    for X in (A, np.asfortranarray(A), strided, A[::-1, ::-1]):
        assert unstable_count(Quadratic.of(np.eye(3), None, X)) == unstable_count(same)


def hidden_complex(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M and complex K with the squares k (n,) of known frequencies, hidden by integer matrices."""
    k = rng.integers(1, 60, n) / 4 + 1j * rng.integers(-8, 9, n) / 64
    L = np.array(unimodular(n, rng, n), dtype=float)
    R = np.array(unimodular(n, rng, n), dtype=float)
    return L @ R, L @ np.diag(k) @ R, k


@pytest.mark.parametrize("data", [AS_GIVEN, HALF_ULP])
def test_of_complex_systems_the_upper_half_plane_decides(data):
    rng = np.random.default_rng(21)
    proved = 0
    for _ in range(40):
        M, K, k = hidden_complex(rng, int(rng.integers(1, 7)))
        upper = 1j * np.sqrt(k)  # of these the imaginary parts are positive
        roots = np.concatenate([upper, -upper])
        verdict = "stable"
        if (upper.real > 0.0).any():
            verdict = "flutter"
        elif (upper.real == 0.0).any():
            verdict = "marginal"
        right = judge(M, None, K, roots, verdict, data)
        assert right.status != "refuted"
        # a root on the axis stays on either side of it
        assert right.status == "proved" or (k.imag == 0.0).any() or len(set(k)) < len(k)
        proved += right.status == "proved"
        others = [word for word in VERDICTS if word != verdict]
        assert judge(M, None, K, roots, str(rng.choice(others)), data).status != "proved"
        assert judge(M, None, K, roots[1:], verdict, data).status == "refuted"
    assert proved > 15


def test_a_defective_real_eigenvalue_leaves_the_other_roots_of_complex_matrices_sharp():
    """lambda^2 = -1 three times with one vector, and lambda^2 = -4, which nothing blurs."""
    rng = np.random.default_rng(0)
    blocks = np.diag([1.0, 1.0, 1.0, 4.0]) + np.diag([1.0, 1.0, 0.0], 1)
    T = rng.standard_normal((4, 4)) + 1j * rng.standard_normal((4, 4))
    K = T @ blocks @ np.linalg.inv(T)
    pieces = enclosed(Quadratic.of(np.eye(4), None, K, HALF_ULP)).pieces
    simple = [piece for piece in pieces if piece.count == 1]
    assert sorted(abs(piece.centres[0].imag) for piece in simple) == pytest.approx([2.0, 2.0])
    assert all(piece.radii[0] < 1e-11 for piece in simple)


def test_free_bodies_with_damping_and_gyroscopic_terms_are_marginal_or_open():
    """Their vectors at zero coincide. Of bars along the axes, whose stiffness is of integers, they
    are marginal; of bars in any direction the entries are rounded, and do not say it."""
    rng = np.random.default_rng(8)
    for case in range(24):
        nodes = int(rng.integers(2, 7))
        places = rng.integers(0, 5, (nodes, 2)) if case % 2 else rng.random((nodes, 2))
        K = np.zeros((2 * nodes, 2 * nodes))
        for i, j in itertools.combinations(range(nodes), 2):
            bar = np.zeros(2 * nodes)
            bar[[2 * i, 2 * i + 1]] = places[i] - places[j]
            bar[[2 * j, 2 * j + 1]] = places[j] - places[i]
            K += np.outer(bar, bar)
        spin = np.kron(np.diag(rng.integers(1, 9, nodes) / 8.0), [[0.0, 1.0], [-1.0, 0.0]])
        for C in (2.0**-10 * K, spin, spin + 2.0**-10 * K):
            A = np.block([[np.zeros_like(K), np.eye(2 * nodes)], [-K, -C]])
            values = np.linalg.eigvals(A)
            proof = judge(np.eye(2 * nodes), C, K, values, "marginal")
            if case % 2:
                assert (proof.status, proof.verdicts) == ("proved", frozenset({"marginal"}))
            else:
                assert proof.status == "open" or proof.by == "exact", proof.reason


@pytest.mark.parametrize(("M", "C", "K"), NEARLY_FREE)
def test_what_is_free_within_the_data_only_is_no_proof_that_it_is_marginal(M, C, K):
    """Exactly, the first diverges by 2.1e-8 1/s, and the second decays by 1.8e-15 1/s."""
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    assert judge(M, C, K, np.linalg.eigvals(A), "marginal").status != "proved"


def test_a_tie_of_flutter_and_divergence_is_no_free_motion(flint):
    """The roots 1 and 1 +- 2i: the answer named motions that neither grow nor decay."""
    C = np.diag([0.0, -2.0])
    K = np.diag([-1.0, 5.0])
    roots = [1.0, -1.0, 1.0 + 2.0j, 1.0 - 2.0j]
    proof = prove_roots(Quadratic.of(np.eye(2), C, K), roots, "flutter")
    assert proof.status == "open"
    assert proof.reason == "the verdict may be divergence or flutter"
    assert proof.where is not None
    assert abs(proof.where.real - 1.0) < 1e-9


@pytest.mark.parametrize("name", ["M", "C"])
def test_that_there_is_no_root_is_known_of_the_given_doubles_alone(flint, name):
    """det = -1; with half an ulp more on one diagonal entry a root grows by 1e4 1/s or more."""
    ones = np.ones((2, 2))
    matrices = {"M": 0.0 * ones, "C": 0.0 * ones, name: ones}
    K = np.array([[0.0, 1.0], [1.0, 2.0]])
    given = Quadratic.of(matrices["M"], matrices["C"], K, "half an ulp")
    proof = prove_roots(given, [], "stable")
    assert (proof.status, proof.data) == ("proved", "as given")
