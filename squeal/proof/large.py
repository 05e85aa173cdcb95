"""All roots of a large sparse system in a disc |lambda| <= R, enclosed by a core and a remainder.

Let X and Y (n, k) be real bases of the right and left vectors of K - s M for the eigenvalues of the
band and some beyond it, and let U and W be the vectors u with u' M X = 0 and w with w' M Y = 0.
Between U and W, K has no singular value below sigma in the norm of N = M + (a share of the
damping): the inertia of a sparse symmetric matrix of 2 n rows proves it. The remainder of
P(lambda) = lambda^2 M + lambda C + K is then regular for |lambda| <= R, and its Schur complement is
the core Y' P X with a radius. The enclosure of small systems does the rest. `docs/proof.md` derives
the bounds.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, eigh, qr
from scipy.sparse import block_array, csc_array, diags_array, sparray
from scipy.sparse.linalg import ArpackError, LinearOperator, SuperLU, eigs, splu

from squeal.proof.balls import EPS, TINY, Balls, Floats, Quadratic, row_sums, upper
from squeal.proof.enclosure import enclose
from squeal.proof.pieces import Failure, Piece

Matrices = tuple[csc_array, csc_array, csc_array]
"""M, C and K."""
MASS_SHARES = (0.5, 0.1, 0.02, 0.004)
"""c of M >= c diag(M), the first that is proved."""
SIGMA = 1.25
"""sigma over R^2."""
DAMPING = 0.01
"""The share of sigma that damping beyond Rayleigh's may take."""
BEYOND_CORE = "soft modes above the band, or local damping, reach into it; try a narrower band"
MARGINS = (1e-3, 1e-4, 1e-5, 1e-6)
"""Shares of sigma by which the inertia is tried to both sides of it."""
DEFINITE = 1e-6
"""The diagonal of a form must exceed the sum of its row by this for the sign to count."""


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
    """

    radius: float
    pieces: tuple[Piece, ...] = ()
    reason: str = ""

    @property
    def is_proved(self) -> bool:
        """True if the pieces hold."""
        return not self.reason


class _Inertia(NamedTuple):
    """The inertia of a symmetric matrix A, in the sense of Sylvester: the number of its negative
    pivots, hence eigenvalues, and a bound of |A - L D L'| as a share of the weights."""

    negative: int
    error: float


class _Damping(NamedTuple):
    """C = alpha M + beta K + C', and `local` (n,) with |u' C' w| <= |u| |w| in the norm of
    diag(local)."""

    alpha: float
    beta: float
    local: Floats


def prove_band(
    M: ArrayLike | sparray,
    C: ArrayLike | sparray | None,
    K: ArrayLike | sparray,
    radius: float,
    core: int = 100,
) -> BandProof:
    """Enclose all roots with |lambda| <= radius of M q'' + C q' + K q = 0.

    Parameters
    ----------
    M, C, K : sparse or dense (n, n)
        Real matrices, exact as given, n at least 3; M symmetric and positive definite, C None
        without damping.
    radius : float
        The band, rad/s.
    core : int
        How many eigenvalues of K - s M are computed, at least 1; n - 2 if it is larger than that.

    Raises
    ------
    ValueError
        Unless the matrices are real, square and finite, of one size, of at least 3 rows, radius is
        positive and finite, and core is at least 1.
    """
    mass, damping, stiffness = _checked_matrices(M, C, K)
    if not (np.isfinite(radius) and radius > 0.0):
        raise ValueError(f"radius: {radius} must be positive and finite")
    if core < 1:
        raise ValueError(f"core: {core} must be at least 1")
    with np.errstate(all="ignore"):
        try:
            return _prove(mass, damping, stiffness, float(radius), core)
        except (LinAlgError, ArpackError, RuntimeError) as error:
            return BandProof(radius, reason=f"a factorisation failed: {error}")


def _checked_matrices(
    M: ArrayLike | sparray, C: ArrayLike | sparray | None, K: ArrayLike | sparray
) -> Matrices:
    """M, C and K as sparse matrices of floats, without doubled entries.

    Raises ValueError for any that `prove_band` does not take.
    """
    mass = csc_array(M)
    damping = csc_array(mass.shape) if C is None else csc_array(C)
    given = [mass, damping, csc_array(K)]
    n = mass.shape[0]
    if n < 3:
        raise ValueError(f"matrices: {n} rows; at least 3 are required")
    for A in given:
        if A.shape != (n, n) or A.dtype.kind not in "biuf" or not np.isfinite(A.data).all():
            raise ValueError(
                f"matrices: shape {A.shape}, {A.dtype}; finite real (n, n) is required"
            )
    floats = [A.astype(float) for A in given]
    for A in floats:
        A.sum_duplicates()
    mass, damping, stiffness = floats
    return mass, damping, stiffness


def _prove(M: csc_array, C: csc_array, K: csc_array, radius: float, core: int) -> BandProof:
    """The proof for checked matrices, in the steps that the top of the module names.

    `metric` is M made symmetric, whose norm measures vectors. N is the metric with a larger
    diagonal: in its norm damping beyond Rayleigh's takes at most the share `DAMPING` of sigma.
    """
    metric = csc_array((M + M.T) * 0.5)  # any symmetric positive definite matrix would do
    diagonal = metric.diagonal()
    if not np.all(diagonal > 0.0):
        return BandProof(radius, reason="the diagonal of M is not positive")
    share = _mass_share(metric, diagonal)
    if share == 0.0:
        return BandProof(radius, reason="M is not proved to be positive definite")
    X, Y = _bases(metric, K, core, radius)
    k = X.shape[1]
    MX = metric @ X
    MY = metric @ Y
    sigma = SIGMA * radius**2
    damping = _damping(metric, C, K)
    # N = metric + diag(extra), so that |u' C' w| <= DAMPING sigma / radius for u and w of norm 1 in
    # N; the 8 and 2 of `upper`, here and below, are more than the roundings there
    extra = upper(damping.local * (radius / (DAMPING * sigma)), 8)
    N = csc_array(metric + diags_array(extra))
    reason = _singular_values_above(N, K, MX, MY, sigma)
    if reason:
        return BandProof(radius, reason=reason)

    # |M - metric| in its norm: M may be symmetric but for rounding
    skewness = _norm_of(csc_array(abs(M - metric) + EPS * abs(M)), np.sqrt(diagonal), share)
    smallest = _least_singular_value(damping, sigma, radius, skewness, share)
    if not smallest > 0.0:
        return BandProof(radius, reason="damping beyond the core is too large")

    # N >= diag(floor), as the metric >= share diag(M), less the rounding of N
    floor = ((share - 4.0 * EPS) * diagonal + extra) * (1.0 - 8.0 * EPS)
    # the Schur complement differs from Y' P X by at most (couplings of Y) (couplings of X) /
    # smallest
    couplings_of_X = _couplings((M, C, K), X, MX, floor, radius)
    transposed = (csc_array(M.T), csc_array(C.T), csc_array(K.T))
    couplings_of_Y = _couplings(transposed, Y, MY, floor, radius)
    core_error = upper(np.outer(couplings_of_Y, couplings_of_X) / smallest, 8)
    # Y and U, and X and W, must span everything; both are tested, as MX and MY, which define U and
    # W, are rounded apart from each other
    if not (_is_regular(Y, MX) and _is_regular(X, MY)):
        return BandProof(radius, reason="left and right vectors are nearly orthogonal")
    core_M = _projected(Y, M, X)
    core_C = Balls.exact(np.zeros((k, k)))  # without damping exactly zero
    if C.nnz:
        core_C = _projected(Y, C, X)
    projected_K = _projected(Y, K, X)
    core_K = Balls(projected_K.mid, upper(projected_K.rad + core_error, 2))
    pieces = enclose(Quadratic(core_M, core_C, core_K))
    if isinstance(pieces, Failure):
        return BandProof(radius, reason=pieces.reason)
    return BandProof(radius, _pieces_in_band(pieces, radius))


def _least_singular_value(
    damping: _Damping, sigma: float, radius: float, skewness: float, share: float
) -> float:
    """A lower bound of the singular values of P(lambda) between U and W for |lambda| <= radius.

    Those of K are at least sigma, and lambda^2 M + lambda (alpha M + beta K + C') takes the rest
    (`docs/proof.md`, Above 400 rows, 4). Not positive where damping is too large.
    """
    smallest = sigma * (1.0 - DAMPING - radius * abs(damping.beta))
    smallest -= radius * (radius + abs(damping.alpha)) * (1.0 + skewness)
    # N is a sum in floating point; it misses by no more than EPS / share of itself
    return smallest - 32.0 * (EPS / share) * (sigma + radius * abs(damping.alpha))


def _pieces_in_band(pieces: list[Piece], radius: float) -> tuple[Piece, ...]:
    """The pieces that meet the band |lambda| <= radius.

    Of those that reach beyond it only the place is known. Open are their `side`, whether the roots
    grow, and `real`, whether they are real.
    """
    in_band = []
    for piece in pieces:
        sizes = np.abs(piece.centres)
        # 8 EPS: more than rounding of the sizes and of these sums
        is_outside = np.all(sizes * (1.0 - 8.0 * EPS) - piece.radii > radius)
        is_inside = np.all(sizes * (1.0 + 8.0 * EPS) + piece.radii < radius)
        if is_inside:
            in_band.append(piece)
        elif not is_outside:
            # the balls of the core hold the Schur complement at every |lambda| <= radius, and at no
            # other lambda: beyond, neither counts nor mirror images are proved
            low = float(np.min(np.nextafter(piece.centres.real - piece.radii, -np.inf)))
            high = float(np.max(np.nextafter(piece.centres.real + piece.radii, np.inf)))
            in_band.append(Piece(piece.centres, piece.radii, low, high, side="unknown", real=None))
    return tuple(in_band)


def _bases(M: csc_array, K: csc_array, core: int, radius: float) -> tuple[Floats, Floats]:
    """Real bases X and Y (n, k) of right and left vectors of K - s M.

    The proof holds for any bases. These span the vectors of the eigenvalues of smallest absolute
    value; the cut lies at the widest relative gap in the last quarter of those computed. All are
    taken if they are too few for a gap there.
    """
    count = min(core, M.shape[0] - 2)
    shift = -0.01 * radius**2  # left of zero, where free bodies leave K - s M regular
    right = _eigenpairs_near(K, M, shift, count)
    left = _eigenpairs_near(csc_array(K.T), M, shift, count)
    sizes = np.abs(right.values)  # rising
    last_quarter = 3 * count // 4
    gaps = sizes[last_quarter + 1 :] / sizes[last_quarter:-1]
    cut = count
    if len(gaps):
        cut = last_quarter + int(np.argmax(gaps)) + 1
    scale = np.sqrt(M.diagonal())[:, None]
    X = _real_basis(right, cut, scale)
    Y = _real_basis(left, cut, scale)
    k = min(X.shape[1], Y.shape[1])
    return X[:, :k], Y[:, :k]


class _Eigenpairs(NamedTuple):
    """Computed eigenvalues (m,) by rising absolute value, and their vectors (n, m)."""

    values: NDArray[np.complex128]
    vectors: NDArray[np.complex128]


def _eigenpairs_near(K: csc_array, M: csc_array, shift: float, count: int) -> _Eigenpairs:
    """The eigenvalues of K - s M nearest to a shift, by rising size, with right vectors."""
    n = M.shape[0]
    start = np.random.default_rng(0).standard_normal(n)
    factors = _factorised(csc_array(K - shift * M))
    inverse = LinearOperator((n, n), factors.solve, dtype=np.float64)
    values, vectors = eigs(K, k=count, M=M, sigma=shift, OPinv=inverse, v0=start)
    order = np.argsort(np.abs(values), kind="stable")
    return _Eigenpairs(values[order], vectors[:, order])


def _real_basis(pairs: _Eigenpairs, cut: int, scale: Floats) -> Floats:
    """A real basis (n, k) of the first `cut` vectors, orthonormal with rows times scale (n, 1).

    Of a complex pair it holds the real and the imaginary part of one vector.
    """
    vectors = pairs.vectors[:, :cut]
    imaginary_values = pairs.values[:cut].imag
    real_parts = vectors[:, imaginary_values >= 0.0].real
    imaginary_parts = vectors[:, imaginary_values > 0.0].imag
    spanning = np.hstack([real_parts, imaginary_parts])
    orthonormal, _ = qr(spanning * scale, mode="economic")
    return np.asarray(orthonormal / scale)


def _factorised(A: csc_array) -> SuperLU:
    """Triangular factors L U of A, with pivots on the diagonal unless one is zero.

    Raises RuntimeError where A is singular, as SuperLU does.
    """
    options = {"SymmetricMode": True, "Equil": False}
    return splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def _most_in_a_row(A: csc_array) -> int:
    """The largest number of entries in a row."""
    if not A.nnz:
        return 0
    return int(np.bincount(A.indices).max())  # of columns stored one by one, the indices of rows


def _inertia(A: csc_array, doubt: csc_array, weights: Floats) -> _Inertia | None:
    """The number of negative pivots of A = L D L', and how far matrices near A are from L D L'.

    By Sylvester's law the number is that of the negative eigenvalues of L D L'. For every symmetric
    matrix B with |B - A| <= doubt, entry by entry, |x' (B - L D L') x| <= error sum (weights x)^2.
    None if A has no such factors: it is singular, needs a pivot off the diagonal, or overflows.

    SuperLU pivots on the diagonal. Its triangles satisfy |A - L U| <= gamma |L| |U| in any order
    of elimination (Higham, Theorem 9.3; one rounding more for the inverse of the pivot).

    Parameters
    ----------
    A, doubt : csc_array (n, n)
        Symmetric matrices, the second with entries of at least 0.
    weights : array (n,)
        Above 0: the unit in which each coordinate is measured.
    """
    n = A.shape[0]
    try:
        factors = _factorised(A)
    except RuntimeError:  # a column without any pivot
        return None
    if not np.array_equal(factors.perm_r, factors.perm_c):
        return None  # a pivot off the diagonal
    L = csc_array(factors.L)
    U = csc_array(factors.U)
    pivots = U.diagonal()
    if not (np.isfinite(pivots).all() and np.all(pivots != 0.0)):
        return None
    # an entry of a product with L or L' sums at most `terms` - 8 products; 8 more roundings cover
    # those of D, of the inverse of a pivot, and of the weights
    terms = max(_most_in_a_row(L), _most_in_a_row(csc_array(L.T))) + 8
    inverse_weights = np.empty(n)  # in the order of elimination
    inverse_weights[factors.perm_c] = 1.0 / weights  # perm_c[i]: when row i of A is eliminated
    of_factors = _factorisation_error(L, U, inverse_weights, terms)
    # `doubt` is symmetric, so that its largest sum of a row bounds its 2-norm
    of_doubt = upper(doubt @ (1.0 / weights), _most_in_a_row(doubt) + 1) / weights
    # what underflows: each of n entries of a row of L D L' sums `terms` products, each of which may
    # lose TINY, in L D L' itself or in L, which a pivot then multiplies
    underflow = n * terms * TINY * (1.0 + np.max(np.abs(pivots))) / np.min(weights) ** 2
    error = float(upper(np.max(of_factors) + np.max(of_doubt) + underflow, terms + 8))
    if not np.isfinite(error):
        return None
    return _Inertia(int(np.sum(pivots < 0.0)), error)


def _factorisation_error(L: csc_array, U: csc_array, scale: Floats, terms: int) -> Floats:
    """Row sums (n,) of a bound E of |A - L D L'|, D = diag(U), made symmetric and scaled.

    E = gamma |L| |U| + |L| |U - D L'|. With S = diag(scale) the largest sum of a row of
    S (E + E') S / 2 bounds the 2-norm of the symmetric matrix S (A - L D L') S.
    """
    DLt = csc_array(diags_array(U.diagonal()) @ L.T)
    # gamma |U| for Higham's bound, gamma |D L'| for the rounding of D L'; EPS is two of its units
    gamma = terms * EPS
    right = csc_array(abs(U - DLt) + gamma * (abs(U) + abs(DLt)))
    left = abs(L)  # E = left @ right
    rows = upper(left @ upper(right @ scale, terms), terms)
    columns = upper(right.T @ upper(left.T @ scale, terms), terms)
    return 0.5 * (rows + columns) * scale


def _mass_share(M: csc_array, diagonal: Floats) -> float:
    """A share c with M >= c diag(M), by the inertia of the difference; 0 if none is proved.

    diagonal (n,): that of M.
    """
    weights = np.sqrt(diagonal)
    for share in MASS_SHARES:
        A = csc_array(M - diags_array(share * diagonal))
        doubt = csc_array(diags_array(2.0 * EPS * diagonal))  # the rounding of this difference
        inertia = _inertia(A, doubt, weights * (1.0 - 4.0 * EPS))  # lower bounds of the roots
        if inertia is not None and not inertia.negative and inertia.error < share / 4.0:
            return (share - inertia.error) * (1.0 - 8.0 * EPS)
    return 0.0


class _Form(NamedTuple):
    """A symmetric matrix (m, m), how far the true one may lie from it, entry by entry, and the
    diagonal (m,) of the matrix of the norm."""

    T: csc_array
    doubt: csc_array
    diagonal: Floats

    @property
    def weights(self) -> Floats:
        """Lower bounds (m,) of the roots of the diagonal."""
        return np.sqrt(self.diagonal) * (1.0 - 4.0 * EPS)


class _InertiaOfAll(NamedTuple):
    """Number of negative eigenvalues of a matrix T, and of all that are near it by `gap`, as
    `_inertia_of_all` defines it."""

    negative: int
    gap: float


def _singular_values_above(N: csc_array, K: csc_array, MX: Floats, MY: Floats, sigma: float) -> str:
    """Prove that K between {u: MX' u = 0} and {w: MY' w = 0} has no singular value below sigma.

    Singular values are those in the norm of N. MX, MY (n, k): M times the k vectors of each basis.
    Returns why that is not proved, empty if it is.

    In p = (u + w)/sqrt 2 and d = (u - w)/sqrt 2 the form sigma (u'Nu + w'Nw) + 2 u'Kw has the
    matrix T of `_form`. Restricted to the constraints it has the eigenvalues sigma +- (singular
    value), so that n - k of them are negative if and only if no singular value is below sigma. The
    bordered matrix [[T, B], [B', 0]], B (2n, 2k) the constraints, has 2k negative ones more: n + k.
    By Haynsworth they are those of T and those of its Schur complement -B' T^-1 B (`docs/proof.md`,
    Above 400 rows, 2 and 3).
    """
    n, k = MX.shape
    form = _form(N, K, sigma)
    inertia = _inertia_of_all(form, sigma)
    if inertia is None:
        return "a singular value lies too near to sigma for the rounding of the inertia"
    # the constraints on u and on w, in p and d; the factor 1/sqrt 2 changes no sign
    border = np.vstack([np.hstack([MX, MY]), np.hstack([MX, -MY])])
    negative_of_complement = _negative_count(_schur_complement(form, border, inertia.gap))
    if negative_of_complement is None:
        return "the border of the inertia is not definite enough"
    if inertia.negative + negative_of_complement != n + k:
        return BEYOND_CORE
    return ""


def _form(N: csc_array, K: csc_array, sigma: float) -> _Form:
    """T (2n, 2n) = [[sigma N + S, A], [A', sigma N - S]] with K = S - A, S = S', A = -A'."""
    symmetric = csc_array((K + K.T) * 0.5)
    skew = csc_array((K.T - K) * 0.5)
    shifted = csc_array(sigma * N)
    T = csc_array(block_array([[shifted + symmetric, skew], [skew.T, shifted - symmetric]]))
    sizes = csc_array(abs(shifted) + abs(symmetric) + abs(skew))
    doubt = csc_array(block_array([[sizes, abs(skew)], [abs(skew.T), sizes]])) * (4.0 * EPS)
    diagonal = np.concatenate([N.diagonal(), N.diagonal()])
    return _Form(T, doubt, diagonal)


def _inertia_of_all(form: _Form, sigma: float) -> _InertiaOfAll | None:
    """The number of negative eigenvalues of the matrix T of a form, and of all matrices near T.

    A symmetric matrix X is near T if |v' (X - T) v| <= gap sum (weights v)^2 for each v. The gap is
    returned with the number; the squares of the weights of the form are at most diag(N), its
    `diagonal`. If T + margin sigma diag(N) and T - margin sigma diag(N) have the same number of
    negative eigenvalues, all matrices between have that number too. None if at each of the
    `MARGINS` the two numbers differ, or one of them is not known for rounding.
    """
    for margin in MARGINS:
        shift = margin * sigma
        shifts = diags_array(shift * form.diagonal)
        sizes = np.abs(form.T.diagonal()) + shift * form.diagonal
        # how far entries may be off: by the doubt of T, and by rounding of sums on the diagonal
        doubt = csc_array(form.doubt + diags_array(4.0 * EPS * sizes))
        above = _inertia(csc_array(form.T + shifts), doubt, form.weights)
        below = _inertia(csc_array(form.T - shifts), doubt, form.weights)
        if above is None or below is None:
            continue
        gap = (shift - max(above.error, below.error)) * (1.0 - 8.0 * EPS)  # rounded down
        if gap > 0.0 and above.negative == below.negative:
            return _InertiaOfAll(above.negative, gap)
    return None


def _schur_complement(form: _Form, border: Floats, gap: float) -> Balls:
    """-B' T^-1 B (j, j) with a border B (m, j) of a matrix T.

    With any Z near T^-1 B and R = B - T Z it equals S - R' T^-1 R, where S = Z'TZ - (Z'B + B'Z) is
    computed. In the norm of the weights no eigenvalue of T has an absolute value below the gap, so
    that entry (i, j) of R' T^-1 R is at most |R_i| |R_j| / gap, R_i column i of R; this is added to
    the radii of S.
    """
    factors = _factorised(form.T)
    Z = factors.solve(border)
    Z += factors.solve(border - form.T @ Z)  # one step of iterative refinement
    TZ = _sparse_times(form.T, form.doubt, Z)
    Zt = Balls.exact(Z.T)
    ZtB = Zt @ Balls.exact(border)
    S = (Zt @ TZ).minus(ZtB.plus(Balls(ZtB.mid.T, ZtB.rad.T)))
    residual = upper(abs(border - TZ.mid) + TZ.rad + EPS * abs(border), 4)  # bounds of |R|
    squares = ((residual / form.weights[:, None]) ** 2).sum(axis=0)
    lengths = np.sqrt(upper(squares, len(residual) + 4))
    return Balls(S.mid, upper(S.rad + np.outer(lengths, lengths) / gap, 8))


def _sparse_times(A: csc_array, doubt: csc_array, Z: Floats) -> Balls:
    """A Z for all matrices within `doubt` of A."""
    mid = A @ Z
    terms = _most_in_a_row(A) + 4
    sizes = abs(Z)
    rad = upper(abs(A) @ sizes, terms) * (terms * EPS)
    if doubt.nnz:
        rad = rad + upper(doubt @ sizes, terms)
    return Balls(mid, upper(rad, 4) + terms * TINY)


def _negative_count(S: Balls) -> int | None:
    """Number of negative eigenvalues of all symmetric matrices in the balls, None if unknown.

    V' S V with the scaled eigenvectors V is nearly diagonal, with entries of about +-1; by
    Gershgorin's theorem its eigenvalues have the signs of the diagonal where that exceeds the rest
    of its row. By Sylvester's law S has as many of each sign.
    """
    values, vectors = eigh((S.mid + S.mid.T) / 2.0)
    V = vectors / np.sqrt(np.abs(values))
    form = Balls.exact(V.T) @ (S @ Balls.exact(V))
    bounds = form.bound()
    off_diagonal = row_sums(bounds - np.diag(bounds.diagonal()))
    diagonal = form.mid.diagonal()
    dominance = np.abs(diagonal) - form.rad.diagonal() - off_diagonal
    if not np.all(dominance > DEFINITE):
        return None
    return int(np.sum(diagonal < 0.0))


def _damping(M: csc_array, C: csc_array, K: csc_array) -> _Damping:
    """Split C into Rayleigh's part alpha M + beta K, by least squares, and local damping C'.

    alpha and beta solve the normal equations of |C - alpha M - beta K| with each coordinate in
    units of its mass. C' is bounded by its row and column sums.
    """
    n = M.shape[0]
    if not C.nnz:
        return _Damping(0.0, 0.0, np.zeros(n))
    scale = diags_array(1.0 / np.sqrt(M.diagonal()))
    m, k, c = (csc_array(scale @ A @ scale) for A in (M, K, C))
    mixed = m.multiply(k).sum()
    normal = np.array([[m.multiply(m).sum(), mixed], [mixed, k.multiply(k).sum()]])
    units = np.sqrt(normal.diagonal())
    right_side = np.array([m.multiply(c).sum(), k.multiply(c).sum()]) / units
    # where K is a multiple of M the equations are singular, and every solution is as good
    split, *_ = np.linalg.lstsq(normal / np.outer(units, units), right_side)
    alpha, beta = split / units
    sizes = abs(C) + abs(alpha) * abs(M) + abs(beta) * abs(K)
    # of |C'|, with the rounding of this difference
    bounds = csc_array(abs(C - alpha * M - beta * K) + 8.0 * EPS * sizes)
    transposed = csc_array(bounds.T)
    # at least as many as a row or a column has, and 8 for the roundings of each entry itself
    terms = _most_in_a_row(bounds) + _most_in_a_row(transposed) + 8
    # by Cauchy and Schwarz |u' C' w|^2 <= (sum row_i |u_i|^2) (sum column_j |w_j|^2), of sums of
    # the bounds: the larger of both serves u and w
    local = np.maximum(upper(bounds.sum(axis=1), terms), upper(bounds.sum(axis=0), terms))
    return _Damping(float(alpha), float(beta), local)


def _norm_of(sizes: csc_array, weights: Floats, share: float) -> float:
    """A bound of |A| in the norm of M >= share diag(weights^2) for all |A| <= sizes, by entries.

    The 2-norm is at most the root of the largest sums of a row and of a column.
    """
    transposed = csc_array(sizes.T)
    terms = _most_in_a_row(sizes) + _most_in_a_row(transposed) + 8
    rows = upper(sizes @ (1.0 / weights), terms) / weights
    columns = upper(transposed @ (1.0 / weights), terms) / weights
    norm = np.sqrt(np.max(rows)) * np.sqrt(np.max(columns)) / share
    return float(upper(norm, terms))


def _couplings(matrices: Matrices, X: Floats, MX: Floats, floor: Floats, radius: float) -> Floats:
    """Bounds (k,) of |u' P(lambda) x_j| for |lambda| <= radius and all u with u' MX = 0, |u| = 1.

    Since u' MX = 0, each product A x_j of A = M, C or K counts only by what its least-squares fit
    by the columns of MX leaves of it, r. |u| is sqrt(u' N u) with a matrix N >= diag(floor), so
    that |u' r|^2 is at most the sum of r_i^2 / floor_i.

    X, MX (n, k): the basis, and M times it; floor (n,). `upper` makes room for the rounding of as
    many operations as it is told, so that the result is a bound in spite of it.
    """
    no_doubt = csc_array(matrices[0].shape)  # zeros (n, n): the entries are exact
    total = np.zeros(X.shape[1])
    for A, power in zip(matrices, (2, 1, 0), strict=True):
        fit = np.linalg.lstsq(MX, A @ X, rcond=None)[0]
        product = _sparse_times(A, no_doubt, X)
        fitted = Balls.exact(MX) @ Balls.exact(fit)
        residual = product.minus(fitted).bound()
        scaled = residual / np.sqrt(floor)[:, None]
        squares = upper((scaled**2).sum(axis=0), len(floor) + 8)
        total = upper(total + radius**power * upper(np.sqrt(squares), 8), 8)
    return total


def _projected(Y: Floats, A: csc_array, X: Floats) -> Balls:
    """Y' A X (k, k) of an exact matrix A."""
    return Balls.exact(Y.T) @ _sparse_times(A, doubt=csc_array(A.shape), Z=X)


def _is_regular(Y: Floats, MX: Floats) -> bool:
    """Whether G = Y' MX is regular, so that Y and the vectors u with MX' u = 0 span everything.

    It is if R G, with an approximate inverse R, differs from 1 by less than 1 in a norm.
    """
    G = Balls.exact(Y.T) @ Balls.exact(MX)
    RG = Balls.exact(np.linalg.inv(G.mid)) @ G
    deviation = Balls(RG.mid - np.eye(Y.shape[1]), RG.rad)
    return bool(np.max(row_sums(deviation.bound())) < 0.5)
