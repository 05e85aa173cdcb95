"""Bands of large systems, judged by chains whose roots are known in closed form and by LAPACK."""

import numpy as np
import pytest
from scipy.linalg import eig, sqrtm, svdvals
from scipy.sparse import csc_array, diags_array, kron

from squeal.proof import large
from squeal.proof.large import BandProof, prove_band

LINKS = 300


def chain(links: int = LINKS) -> tuple[csc_array, csc_array]:
    """Mass (consistent) and stiffness (links, links) of a fixed chain of rods."""
    ones = np.ones(links)
    offsets = [-1, 0, 1]
    mass = diags_array([ones[1:] / 6, 4 * ones / 6, ones[1:] / 6], offsets=offsets)
    stiffness = diags_array([-ones[1:], 2 * ones, -ones[1:]], offsets=offsets)
    return csc_array(mass), csc_array(1e6 * stiffness)


def two_chains(coupling: list[list[float]], links: int = LINKS) -> tuple[csc_array, csc_array]:
    """Two chains; the coupling (2, 2) times the mass joins each point with its like."""
    mass, stiffness = chain(links)
    M = kron(np.eye(2), mass)
    K = kron(np.eye(2), stiffness) + kron(np.array(coupling), mass)
    order = np.random.default_rng(5).permutation(2 * links)
    return csc_array(M.tocsr()[order][:, order]), csc_array(K.tocsr()[order][:, order])


def known_roots(
    coupling: list[list[float]], alpha: float = 0.0, beta: float = 0.0, links: int = LINKS
) -> np.ndarray:
    """Their roots in closed form, with C = alpha M + beta K."""
    angles = np.arange(1, links + 1) * np.pi / (links + 1)
    own = 1e6 * 6.0 * 4.0 * np.sin(angles / 2) ** 2 / (4.0 + 2.0 * np.cos(angles))
    squares = (own[:, None] + np.linalg.eigvals(np.array(coupling))[None, :]).ravel()
    half = (alpha + beta * squares) / 2.0
    turn = np.sqrt((half**2 - squares).astype(complex))
    return np.concatenate([-half + turn, -half - turn])


def assert_holds(proof: BandProof, roots: np.ndarray, slack: float = 0.0) -> None:
    """Each root of the band lies in a piece, and pieces within hold as many as they say."""
    assert proof.is_proved, proof.reason

    def in_piece(piece) -> np.ndarray:
        apart = np.abs(roots[:, None] - piece.centres[None, :])
        return np.any(apart <= piece.radii + slack, axis=1)

    held = np.array([in_piece(piece) for piece in proof.pieces])
    in_band = np.abs(roots) <= proof.radius
    assert in_band.any()
    assert held[:, in_band].any(axis=0).all()
    for piece, inside in zip(proof.pieces, held, strict=True):
        if np.all(np.abs(piece.centres) + piece.radii < proof.radius):
            assert inside.sum() == piece.count
    assert max(piece.high for piece in proof.pieces) >= roots[in_band].real.max() - slack


FLUTTER = [[0.0, 300.0], [-200.0, 150.0]]
QUIET = [[0.0, 300.0], [-200.0, 900.0]]


@pytest.mark.parametrize("coupling", [FLUTTER, QUIET])
@pytest.mark.parametrize(("alpha", "beta"), [(0.0, 0.0), (2.0, 1e-6)])
def test_two_chains_have_the_roots_of_the_closed_form(coupling, alpha, beta):
    M, K = two_chains(coupling)
    C = csc_array(alpha * M + beta * K) if alpha else None
    roots = known_roots(coupling, alpha, beta)
    proof = prove_band(M, C, K, radius=205.0, core=80)
    assert_holds(proof, roots, slack=1e-9)
    assert max(piece.radii.max() for piece in proof.pieces) < 1e-3
    fastest = roots[np.abs(roots) <= 205.0].real.max()
    assert max(piece.high for piece in proof.pieces) == pytest.approx(fastest, abs=1e-6)


def sliding(seed: int, rows: int = 600) -> tuple[csc_array, csc_array, csc_array]:
    """Two chains in contact at some points, with friction there and a few dashpots."""
    rng = np.random.default_rng(seed)
    mass, stiffness = chain(rows // 2)
    M = csc_array(kron(np.diag([1.0, 0.8]), mass))
    K = kron(np.diag([1.0, 1.3]), stiffness).tolil()
    C = csc_array(0.5 * M + 1e-7 * K).tolil()
    for point in rng.choice(rows // 2, 12, replace=False):
        other = point + rows // 2
        pair = [point, other]
        normal = rng.uniform(1e5, 1e6)
        friction = 0.5 * normal * rng.uniform(-1.0, 1.0)
        block = np.array([[normal, -normal + friction], [-normal - friction, normal]])
        for i, a in enumerate(pair):
            for j, b in enumerate(pair):
                K[a, b] += block[i, j]
        C[point, point] += rng.uniform(0.0, 0.5)
    return M, csc_array(C), csc_array(K)


def test_friction_and_dashpots_agree_with_lapack():
    M, C, K = sliding(0)
    n = M.shape[0]
    inverse = np.linalg.inv(M.toarray())
    lower = np.hstack([-inverse @ K.toarray(), -inverse @ C.toarray()])
    roots = eig(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower]), right=False)
    proof = prove_band(M, C, K, radius=150.0, core=80)
    assert_holds(proof, roots, slack=1e-6)
    assert max(piece.radii.max() for piece in proof.pieces) < 1.0


@pytest.mark.parametrize("dropped", [0, 7, 20])
def test_a_core_that_misses_a_mode_proves_nothing(dropped, monkeypatch):
    M, K = two_chains(FLUTTER)
    whole = large._bases

    def without(*given):
        X, Y = whole(*given)
        # a rotation first, so that the mode that is missing is a mixture of those of the core
        turn = np.linalg.qr(np.random.default_rng(dropped).standard_normal((X.shape[1],) * 2))[0]
        return (X @ turn)[:, 1:], (Y @ turn)[:, 1:]

    monkeypatch.setattr(large, "_bases", without)
    proof = prove_band(M, None, K, radius=205.0, core=80)
    assert not proof.is_proved


def test_singular_values_are_counted_as_lapack_counts_them():
    M, _, K = sliding(4, rows=60)
    root = np.real(sqrtm(M.toarray()))
    values = np.sort(svdvals(np.linalg.solve(root, K.toarray()) @ np.linalg.inv(root)))
    rng = np.random.default_rng(0)
    vectors = rng.standard_normal((60, 1))
    MX = M @ vectors
    basis = np.linalg.svd(MX.T @ np.linalg.inv(root))[2][1:]  # u' MX = 0 in the norm of M
    form = np.linalg.solve(root, K.toarray()) @ np.linalg.inv(root)
    least = svdvals(basis @ form @ basis.T).min()
    assert values[0] < least < values[2]
    # the least share of a chain is 1 - (cosine of its first angle) / 2, just above 1/2
    assert 0.49 < large._mass_share(M, M.diagonal()) <= 0.5
    assert large._singular_values_above(M, K, MX, MX, 0.99 * least) == ""
    assert large._singular_values_above(M, K, MX, MX, 1.01 * least) != ""


@pytest.mark.parametrize("seed", range(4))
def test_pivots_count_negative_eigenvalues(seed):
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((40, 40)) * (rng.random((40, 40)) < 0.2)
    A = csc_array(A + A.T + np.diag(rng.standard_normal(40) * 6.0))
    inertia = large._inertia(A, csc_array((40, 40)), np.ones(40))
    assert inertia is not None
    assert inertia.negative == np.sum(np.linalg.eigvalsh(A.toarray()) < 0.0)
    assert 0.0 < inertia.error < 1e-9


def test_the_inertia_of_a_singular_matrix_is_unknown():
    """SuperLU finds no pivot in a column of zeros, nor in two equal columns."""
    equal_columns = [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    for A in (np.diag([1.0, 0.0, 2.0]), np.array(equal_columns)):
        assert large._inertia(csc_array(A), csc_array((3, 3)), np.ones(3)) is None


def test_what_cannot_be_proved_says_why():
    M, K = two_chains(FLUTTER)
    assert prove_band(M, None, K, radius=600.0, core=40).reason == large.BEYOND_CORE
    assert "M" in prove_band(-M, None, K, radius=200.0).reason
    heavy = csc_array(5e3 * diags_array(np.arange(600) % 2.0))
    assert "damping" in prove_band(M, heavy, K, radius=200.0, core=80).reason
    with pytest.raises(ValueError, match="radius"):
        prove_band(M, None, K, radius=0.0)
    with pytest.raises(ValueError, match="shape"):
        prove_band(M, None, K[:5], radius=1.0)
    with pytest.raises(ValueError, match="complex"):
        prove_band(M, None, K * 1j, radius=1.0)
    with pytest.raises(ValueError, match="finite"):
        prove_band(M, None, K, radius=np.inf)
    with pytest.raises(ValueError, match="core: 0"):
        prove_band(M, None, K, radius=1.0, core=0)
    with pytest.raises(ValueError, match="2 rows"):
        prove_band(np.eye(2), None, np.eye(2), radius=1.0)


@pytest.mark.parametrize(("rows", "core"), [(3, 100), (4, 100), (6, 100), (8, 1), (8, 4), (8, 5)])
def test_few_rows_and_a_small_core_serve_too(rows, core):
    """Springs of 1 N/m and of 1e4 N/m and more on 1 kg each, without coupling."""
    squares = np.array([1.0, *np.linspace(1e4, 2e4, rows - 1)])
    frequencies = np.sqrt(squares)
    roots = np.concatenate([1j * frequencies, -1j * frequencies])
    proof = prove_band(np.eye(rows), None, np.diag(squares), radius=3.0, core=core)
    assert_holds(proof, roots)
