"""All roots of a large sparse system in a disc |lambda| <= R, enclosed by a core and a remainder.

Let X and Y (n, k) be real bases of the right and left vectors of K - s M beyond the band, and let
U and W be the vectors u with u' M X = 0 and w with w' M Y = 0. Between U and W, K has no singular
value below sigma in the norm of N = M + (a share of the damping): the inertia of a sparse symmetric
matrix of 2 n rows proves it. The remainder of P(lambda) = lambda^2 M + lambda C + K is then regular
for |lambda| <= R, and its Schur complement is the core Y' P X with a radius. The enclosure of small
systems does the rest. `docs/proof.md` derives the bounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, eigh, qr
from scipy.sparse import block_array, csc_array, diags_array
from scipy.sparse.linalg import ArpackError, LinearOperator, eigs, splu

from squeal.proof.balls import EPS, TINY, Balls, Floats, Quadratic, row_sums, upper
from squeal.proof.enclosure import enclose
from squeal.proof.pieces import Failure, Piece

Matrices = tuple[csc_array, csc_array, csc_array]  # M, C, K
MASS_SHARES = (0.5, 0.1, 0.02, 0.004)  # c of M >= c diag(M), the first that is proved
SIGMA = 1.25  # sigma over R^2
DAMPING = 0.01  # what damping that is not Rayleigh's may take of sigma
BEYOND_CORE = "soft modes above the band, or local damping, reach into it; try a narrower band"
MARGINS = (1e-3, 1e-4, 1e-5, 1e-6)  # of the inertia, shares of sigma


@dataclass(frozen=True, eq=False)
class BandProof:
    """What is proved of the roots with |lambda| <= radius.

    Attributes
    ----------
    radius : float
        The band, rad/s.
    pieces : tuple of Piece
        Unions of discs. All roots of the band lie in them, and a piece within the band holds as
        many roots as discs. Those that reach beyond the band may hold fewer.
    reason : str
        Why nothing is proved; empty where something is.
    core : int
        Rows of the core.
    """

    radius: float
    pieces: tuple[Piece, ...] = ()
    reason: str = ""
    core: int = 0

    @property
    def is_proved(self) -> bool:
        """True if the pieces hold."""
        return not self.reason

    @property
    def growth_below(self) -> float:
        """A rate (1/s) that no root of the band exceeds, infinity if nothing is proved."""
        if not self.is_proved:
            return np.inf
        return max((piece.high for piece in self.pieces), default=-np.inf)


class _Inertia(NamedTuple):
    """Number of negative pivots, and a bound of |A - L D L'| as a share of the weights."""

    negative: int
    error: float


class _Damping(NamedTuple):
    """C = alpha M + beta K + C', and `local` (n,) with |u' C' w| <= |u| |w| in its norm."""

    alpha: float
    beta: float
    local: Floats


def prove_band(M: Any, C: Any | None, K: Any, radius: float, core: int = 100) -> BandProof:
    """Enclose all roots with |lambda| <= radius of M q'' + C q' + K q = 0.

    Parameters
    ----------
    M, C, K : sparse or dense (n, n)
        Real matrices, exact as given; M symmetric and positive definite, C None without damping.
    radius : float
        The band, rad/s.
    core : int
        How many eigenvalues of K - s M are computed, at most n - 2.

    Raises
    ------
    ValueError
        Unless the matrices are real, square and finite, of one size, and radius is positive.
    """
    mass, damping, stiffness = _checked(M, C, K)
    if not (np.isfinite(radius) and radius > 0.0):
        raise ValueError(f"radius: {radius} must be positive")
    with np.errstate(all="ignore"):
        try:
            return _proved(mass, damping, stiffness, float(radius), core)
        except (LinAlgError, ArpackError, RuntimeError) as error:
            return BandProof(radius, reason=f"a factorisation failed: {error}")


def _checked(M: Any, C: Any | None, K: Any) -> Matrices:
    mass = csc_array(M)
    given = [mass, csc_array(mass.shape) if C is None else csc_array(C), csc_array(K)]
    n = mass.shape[0]
    for A in given:
        if A.shape != (n, n) or A.dtype.kind not in "biuf" or not np.isfinite(A.data).all():
            raise ValueError(
                f"matrices: shape {A.shape}, {A.dtype}; finite real (n, n) is required"
            )
    floats = [A.astype(float) for A in given]
    for A in floats:
        A.sum_duplicates()
    return floats[0], floats[1], floats[2]


def _proved(M: csc_array, C: csc_array, K: csc_array, radius: float, core: int) -> BandProof:
    metric = csc_array((M + M.T) * 0.5)  # any symmetric positive definite matrix would do
    diagonal = metric.diagonal()
    if not np.all(diagonal > 0.0):
        return BandProof(radius, reason="the diagonal of M is not positive")
    share = _mass_share(metric, diagonal)
    if share == 0.0:
        return BandProof(radius, reason="M is not proved to be positive definite")
    weights = np.sqrt(diagonal)
    X, Y = _bases(metric, K, core, radius)
    k = X.shape[1]
    MX = metric @ X
    MY = metric @ Y
    sigma = SIGMA * radius**2
    spread = _damping(metric, C, K)
    # C' has a norm of at most DAMPING sigma / radius in this norm
    extra = upper(spread.local * (radius / (DAMPING * sigma)), 8)
    wider = csc_array(metric + diags_array(extra))
    reason = _singular_values_above(wider, K, MX, MY, sigma)
    if reason:
        return BandProof(radius, reason=reason, core=k)
    skewed = _norm_of(csc_array(abs(M - metric) + EPS * abs(M)), weights, share)
    inverse = sigma * (1.0 - DAMPING - radius * abs(spread.beta))
    inverse -= radius * (radius * (1.0 + skewed) + abs(spread.alpha))
    # N is a sum in floating point; it misses by no more than EPS / share of itself
    inverse -= 32.0 * (EPS / share) * (sigma + radius * abs(spread.alpha))
    if not inverse > 0.0:
        return BandProof(radius, reason="damping beyond the core is too large", core=k)

    floor = ((share - 4.0 * EPS) * diagonal + extra) * (1.0 - 8.0 * EPS)
    parts = (M, C, K)
    fitted = [np.linalg.lstsq(MX, A @ X, rcond=None)[0] for A in parts]
    right = _couplings(parts, X, MX, fitted, floor, radius)
    turned = (csc_array(M.T), csc_array(C.T), csc_array(K.T))
    fitted = [np.linalg.lstsq(MY, A @ Y, rcond=None)[0] for A in turned]
    left = _couplings(turned, Y, MY, fitted, floor, radius)
    added = upper(np.outer(left, right) / inverse, 8)

    if not (_is_regular(Y, MX) and _is_regular(X, MY)):
        return BandProof(radius, reason="left and right vectors are nearly orthogonal", core=k)
    balls = [_projected(Y, A, X) for A in parts]
    balls[2] = Balls(balls[2].mid, upper(balls[2].rad + added, 2))
    if not C.nnz:
        balls[1] = Balls.exact(np.zeros((k, k)))
    pieces = enclose(Quadratic(balls[0], balls[1], balls[2]))
    if isinstance(pieces, Failure):
        return BandProof(radius, reason=pieces.reason, core=k)
    return BandProof(radius, tuple(_within(pieces, radius)), core=k)


def _within(pieces: list[Piece], radius: float) -> list[Piece]:
    """The pieces that meet the band; of those that reach beyond it only where they lie."""
    found = []
    for piece in pieces:
        sizes = np.abs(piece.centres)
        if np.all(sizes * (1.0 - 8.0 * EPS) - piece.radii > radius):
            continue
        if np.all(sizes * (1.0 + 8.0 * EPS) + piece.radii < radius):
            found.append(piece)
            continue
        # each lambda has its own core here, so that neither counts nor mirror images hold
        low = float(np.min(np.nextafter(piece.centres.real - piece.radii, -np.inf)))
        high = float(np.max(np.nextafter(piece.centres.real + piece.radii, np.inf)))
        found.append(Piece(piece.centres, piece.radii, low, high, "unknown", None))
    return found


def _bases(M: csc_array, K: csc_array, core: int, radius: float) -> tuple[Floats, Floats]:
    """Real bases (n, k) of right and left vectors of K - s M; nothing is assumed of them.

    The smallest eigenvalues up to the widest relative gap in the last quarter of those computed.
    """
    n = M.shape[0]
    count = min(core, n - 2)
    found = []
    shift = -0.01 * radius**2  # left of zero, where free bodies leave K - s M regular
    start = np.random.default_rng(0).standard_normal(n)
    for A in (K, csc_array(K.T)):
        factors = _on_diagonal(csc_array(A - shift * M))
        inverse = LinearOperator((n, n), factors.solve, dtype=np.float64)
        values, vectors = eigs(A, k=count, M=M, sigma=shift, OPinv=inverse, v0=start)
        order = np.argsort(np.abs(values), kind="stable")
        found.append((values[order], vectors[:, order]))
    sizes = np.abs(found[0][0])
    first = 3 * count // 4
    gaps = sizes[first + 1 :] / sizes[first:-1]
    cut = first + int(np.argmax(gaps)) + 1
    scale = np.sqrt(M.diagonal())[:, None]
    bases = []
    for values, vectors in found:
        chosen = vectors[:, :cut]
        once = values[:cut].imag >= 0.0
        twice = values[:cut].imag > 0.0
        real = np.hstack([chosen[:, once].real, chosen[:, twice].imag])
        bases.append(qr(real * scale, mode="economic")[0] / scale)
    k = min(X.shape[1] for X in bases)
    return bases[0][:, :k], bases[1][:, :k]


def _on_diagonal(A: csc_array) -> Any:
    """Triangles of A, with pivots on the diagonal unless one is zero."""
    options = {"SymmetricMode": True, "Equil": False}
    return splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def _row_product(A: csc_array, x: Floats, terms: int) -> Floats:
    """Upper bounds of a product of non-negative arrays."""
    return upper(A @ x, terms)


def _most_in_a_row(A: csc_array) -> int:
    return int(np.bincount(A.indices, minlength=1).max()) if A.nnz else 0


def _inertia(A: csc_array, doubt: csc_array, weights: Floats) -> _Inertia | None:
    """Pivots of A, and e so that all |B - A| <= doubt are within e diag(weights^2) of L D L'.

    SuperLU with pivots on the diagonal. Its triangles satisfy |A - L U| <= gamma |L| |U| in any
    order of elimination (Higham, Theorem 9.3; one rounding more for the inverse of the pivot).
    """
    n = A.shape[0]
    factors = _on_diagonal(A)
    if not np.array_equal(factors.perm_r, factors.perm_c):
        return None
    L = csc_array(factors.L)
    U = csc_array(factors.U)
    pivots = U.diagonal()
    if not (np.isfinite(pivots).all() and np.all(pivots != 0.0)):
        return None
    scaled = csc_array(diags_array(pivots) @ L.T)
    apart = abs(U - scaled)
    size_l = abs(L)
    terms = max(_most_in_a_row(L), _most_in_a_row(csc_array(L.T))) + 8
    gamma = terms * EPS  # twice gamma of Higham, which holds products D L' too
    inverse = np.empty(n)
    inverse[factors.perm_c] = 1.0 / weights
    mixed = csc_array(apart + gamma * (abs(U) + abs(scaled)))
    mixed_t = csc_array(mixed.T)
    size_lt = csc_array(size_l.T)
    rows = _row_product(size_l, _row_product(mixed, inverse, terms), terms)
    columns = _row_product(mixed_t, _row_product(size_lt, inverse, terms), terms)
    # a symmetric matrix has the norm of its scaled row sums; the mean with its transpose has less
    sums = 0.5 * (rows + columns) * inverse
    own = _row_product(doubt, 1.0 / weights, _most_in_a_row(doubt) + 1) / weights
    lost = n * terms * TINY * (1.0 + np.max(np.abs(pivots))) / np.min(weights) ** 2  # underflow
    error = float(upper(np.max(sums) + np.max(own) + lost, terms + 8))
    return _Inertia(int(np.sum(pivots < 0.0)), error) if np.isfinite(error) else None


def _mass_share(M: csc_array, diagonal: Floats) -> float:
    """c with M >= c diag(M), 0 if none is proved."""
    weights = np.sqrt(diagonal)
    for share in MASS_SHARES:
        A = csc_array(M - diags_array(share * diagonal))
        doubt = csc_array(diags_array(2.0 * EPS * diagonal))
        inertia = _inertia(A, doubt, weights * (1.0 - 4.0 * EPS))
        if inertia is not None and not inertia.negative and inertia.error < share / 4.0:
            return (share - inertia.error) * (1.0 - 8.0 * EPS)
    return 0.0


def _singular_values_above(N: csc_array, K: csc_array, MX: Floats, MY: Floats, sigma: float) -> str:
    """Why K between {u: MX' u = 0} and {w: MY' w = 0} may have a singular value below sigma.

    They are those in the norm of N.
    In p = (u + w)/sqrt 2 and d = (u - w)/sqrt 2 the form sigma (u'Nu + w'Nw) + 2 u'Kw has the
    matrix T below. On the constraints it has n - k negative eigenvalues if and only if no singular
    value is smaller; with the constraints as a border, n + k (Haynsworth).
    """
    n, k = MX.shape
    mean = csc_array((K + K.T) * 0.5)
    skew = csc_array((K.T - K) * 0.5)
    shifted = csc_array(sigma * N)
    T = csc_array(block_array([[shifted + mean, skew], [skew.T, shifted - mean]]))
    sizes = csc_array(abs(shifted) + abs(mean) + abs(skew))
    doubt = csc_array(block_array([[sizes, abs(skew)], [abs(skew.T), sizes]])) * (4.0 * EPS)
    both = np.concatenate([N.diagonal(), N.diagonal()])
    weights = np.sqrt(both) * (1.0 - 4.0 * EPS)
    negative = -1
    gap = 0.0
    for margin in MARGINS:
        shift = margin * sigma
        moved = diags_array(shift * both)
        sums = np.abs(T.diagonal()) + shift * both
        more = csc_array(doubt + diags_array(4.0 * EPS * sums))
        above = _inertia(csc_array(T + moved), more, weights)
        below = _inertia(csc_array(T - moved), more, weights)
        if above is None or below is None:
            continue
        gap = (shift - max(above.error, below.error)) * (1.0 - 8.0 * EPS)
        if gap > 0.0 and above.negative == below.negative:
            negative = above.negative
            break
    if negative < 0:
        return "a singular value lies too near to sigma for the rounding of the inertia"

    border = np.vstack([np.hstack([MX, MY]), np.hstack([MX, -MY])])
    factors = _on_diagonal(T)
    Z = factors.solve(border)
    Z += factors.solve(border - T @ Z)
    product = _sparse_times(T, doubt, Z)
    left = Balls.exact(Z.T)
    middle = left @ product
    edge = left @ Balls.exact(border)
    twice = Balls(edge.mid + edge.mid.T, upper(edge.rad + edge.rad.T + EPS * abs(edge.mid), 3))
    S = twice.plus(middle.times(-1.0)).times(-1.0)
    missed = upper(abs(border - product.mid) + product.rad + EPS * abs(border), 4)
    lengths = np.sqrt(upper(((missed / weights[:, None]) ** 2).sum(axis=0), 2 * n + 4))
    S = Balls(S.mid, upper(S.rad + np.outer(lengths, lengths) / gap, 8))
    found = _negative(S)
    if found is None:
        return "the border of the inertia is not definite enough"
    if negative + found != n + k:
        return BEYOND_CORE
    return ""


def _sparse_times(A: csc_array, doubt: csc_array, Z: Floats) -> Balls:
    """A Z for all matrices within `doubt` of A."""
    mid = A @ Z
    terms = _most_in_a_row(A) + 4
    sizes = abs(Z)
    rad = upper(abs(A) @ sizes, terms) * (terms * EPS)
    if doubt.nnz:
        rad = rad + upper(doubt @ sizes, terms)
    return Balls(mid, upper(rad, 4) + terms * TINY)


def _negative(S: Balls) -> int | None:
    """Number of negative eigenvalues of all symmetric matrices in the balls, None if unknown."""
    values, V = eigh((S.mid + S.mid.T) / 2.0)
    V = V / np.sqrt(np.abs(values))
    form = Balls.exact(V.T) @ (S @ Balls.exact(V))
    others = row_sums(form.bound() - np.diag(form.bound().diagonal()))
    room = np.abs(form.mid.diagonal()) - form.rad.diagonal() - others
    if not np.all(room > 1e-6):
        return None
    return int(np.sum(form.mid.diagonal() < 0.0))


def _damping(M: csc_array, C: csc_array, K: csc_array) -> _Damping:
    """Rayleigh's part of C by least squares, and what is left of each row and column."""
    n = M.shape[0]
    if not C.nnz:
        return _Damping(0.0, 0.0, np.zeros(n))
    scale = diags_array(1.0 / np.sqrt(M.diagonal()))
    a, b, c = (csc_array(scale @ A @ scale) for A in (M, K, C))
    mixed = a.multiply(b).sum()
    normal = np.array([[a.multiply(a).sum(), mixed], [mixed, b.multiply(b).sum()]])
    units = np.sqrt(normal.diagonal())
    sides = np.array([a.multiply(c).sum(), b.multiply(c).sum()]) / units
    alpha, beta = np.linalg.solve(normal / np.outer(units, units), sides) / units
    left = abs(C - alpha * M - beta * K)
    sizes = abs(C) + abs(alpha) * abs(M) + abs(beta) * abs(K)
    left = csc_array(left + 8.0 * EPS * sizes)
    across = csc_array(left.T)
    terms = _most_in_a_row(left) + _most_in_a_row(across) + 8
    ones = np.ones(n)
    local = np.maximum(_row_product(left, ones, terms), _row_product(across, ones, terms))
    return _Damping(float(alpha), float(beta), local)


def _norm_of(sizes: csc_array, weights: Floats, share: float) -> float:
    """A bound of |A| in the norm of M for all |A| <= sizes, entry by entry."""
    terms = _most_in_a_row(sizes) + _most_in_a_row(csc_array(sizes.T)) + 8
    rows = _row_product(sizes, 1.0 / weights, terms) / weights
    columns = _row_product(csc_array(sizes.T), 1.0 / weights, terms) / weights
    norm = np.sqrt(np.max(rows)) * np.sqrt(np.max(columns)) / share
    return float(upper(norm, terms))


def _couplings(
    parts: Matrices, X: Floats, MX: Floats, fitted: list[Floats], floor: Floats, radius: float
) -> Floats:
    """Bounds (k,) of u' P(lambda) x_j over all |u| = 1 (norm of N >= diag(floor)) with u' MX = 0.

    What is a multiple of MX adds nothing; `fitted` (k, k) takes it out.
    """
    none = csc_array(parts[0].shape)
    total = np.zeros(X.shape[1])
    for A, fit, power in zip(parts, fitted, (2, 1, 0), strict=True):
        product = _sparse_times(A, none, X)
        known = Balls.exact(MX) @ Balls.exact(fit)
        missed = product.plus(known.times(-1.0)).bound()
        scaled = missed / np.sqrt(floor)[:, None]
        squares = upper((scaled**2).sum(axis=0), len(floor) + 8)
        total = upper(total + radius**power * upper(np.sqrt(squares), 8), 8)
    return total


def _projected(Y: Floats, A: csc_array, X: Floats) -> Balls:
    return Balls.exact(Y.T) @ _sparse_times(A, csc_array(A.shape), X)


def _is_regular(Y: Floats, MX: Floats) -> bool:
    """Whether Y' MX is regular, so that X and the vectors w with MY' w = 0 span everything."""
    G = Balls.exact(Y.T) @ Balls.exact(MX)
    test = Balls.exact(np.linalg.inv(G.mid)) @ G
    return bool(np.max(row_sums(Balls(test.mid - np.eye(len(Y.T)), test.rad).bound())) < 0.5)
