"""Gershgorin's discs of a pencil A - s B, over an interval of the parameter or at one value.

Let X hold approximate right vectors and Y be about the inverse of B X. With G = Y B X, R = Y A X
and |G - 1| <= E, of row sums e < 1, no matrix in the balls makes Y, B or X singular, so that the
roots are the eigenvalues of S = G^-1 R, and

    |G^-1 - 1| <= E + (row sums of E) (column maxima of E) / (1 - e).

Over an interval p = m + d, |d| <= h, the matrices are A0 + d A1 but for at most d^2 A2, hence S is
S0 + d S1 but for at most Q. A second similarity 1 + d Z, with S1 + S0 Z - Z S0 close to zero
between columns that are apart, lets the vectors move. What is left of order d is L, the motion of
the centres, and the rest N is of second order; columns that meet keep their coupling in L.
`docs/proof.md` derives the bounds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from squeal.proof.balls import EPS, TINY, Balls, Floats, divisor, magnitude, row_sums, upper
from squeal.proof.chains import Chain, find_chains
from squeal.proof.pieces import Failure, Side, Tally, labels, strong_components

try:
    import flint
except ImportError:  # an extra
    flint = None

NEAR_SHARE = 0.125  # h |coupling| of two columns by their distance, above which they stay together
LARGEST_E = 0.5  # row sums of |Y B X - 1| up to which the inverse is bounded
BEYOND = "the entries lie beyond double precision"
ILL_CONDITIONED = "the eigenvectors are too ill-conditioned"


@dataclass(frozen=True, eq=False)
class Expansion:
    """All matrices (n, n) in `value` + d `slope`, but for at most d^2 `remainder` entry by entry.

    d is the distance of the parameter from the middle of the interval.
    """

    value: Balls
    slope: Balls
    remainder: Floats

    @property
    def pattern(self) -> NDArray[np.bool_]:
        """Which entries (n, n) are not zero for certain at all values."""
        return self.value.pattern | self.slope.pattern | (self.remainder != 0.0)

    @staticmethod
    def constant(X: Balls) -> Expansion:
        """Matrices that do not depend on the parameter."""
        zeros = np.zeros(X.mid.shape)
        return Expansion(X, Balls.exact(zeros), zeros)


class Basis(NamedTuple):
    """Approximate right vectors of a pencil A - s B.

    X (n, n): the vectors, one a column; mirror (n,): the index of the column that is the conjugate
    of each, itself for a real one, None where that is not known; chains: groups of columns that
    hold a basis of an invariant subspace in place of vectors; Y (n, n): about (B X)^-1, None if it
    is still to be computed.
    """

    X: NDArray
    mirror: NDArray[np.intp] | None = None
    chains: Sequence[Chain] = ()
    Y: NDArray | None = None


def bases(A: NDArray, B: NDArray) -> Iterator[Basis]:
    """Bases for the pencil A - s B: its eigenvectors, then chains where some are nearly parallel.

    Raises LinAlgError where there are none.
    """
    values, X = np.linalg.eig(np.linalg.solve(B, A))
    if np.iscomplexobj(A) or np.iscomplexobj(B):
        yield Basis(X)
        chains = find_chains(A, B, values, X)
        for chain in chains:
            X = chain.put_into(X)
        if chains:
            yield Basis(X, chains=chains)
        return
    # mirror[k]: the column that is conjugate to column k, k itself if that is real. LAPACK puts the
    # conjugate of a pair right behind the one with the positive imaginary part
    mirror = np.arange(len(X))
    first = np.flatnonzero(values.imag > 0.0)
    mirror[first] = first + 1
    mirror[first + 1] = first
    yield Basis(X, mirror.copy())
    chains = []
    for chain in find_chains(A, B, values, X):
        partners = mirror[chain.members]
        if not np.iscomplexobj(chain.basis):
            # a real basis needs the conjugate of each member
            if not np.isin(partners, chain.members).all():
                continue
            mirror[chain.members] = chain.members  # which the real columns of the basis replace
            X = chain.put_into(X)
            chains.append(chain)
        elif values[chain.members].imag.mean() > 0.0:  # the others come with their conjugates
            conjugate_chain = replace(chain, members=partners, basis=chain.basis.conj())
            X = conjugate_chain.put_into(chain.put_into(X))
            chains += [chain, conjugate_chain]
    if chains:
        yield Basis(X, mirror, chains)


class NearDiagonal(NamedTuple):
    """All matrices S (n, n) with the eigenvalues of a pencil, over |d| <= h: S0 + d L but for N.

    S0 and L are zero but on the diagonal and where columns stay together, such as those of a chain;
    N bounds the absolute values of the rest; `is_real` (n,) says which columns belong to real
    vectors.
    """

    S0: NDArray
    L: NDArray
    N: Floats
    is_real: NDArray[np.bool_]

    @property
    def centres(self) -> NDArray:
        """Centres of the discs (n,) at the middle of the interval."""
        return self.S0.diagonal()

    @property
    def speeds(self) -> NDArray:
        """Derivatives (n,) of the centres by the parameter."""
        return self.L.diagonal()


def near_diagonal(A: Expansion, B: Expansion, half: float, basis: Basis) -> NearDiagonal | Failure:
    """The pencil A - s B on approximate vectors: S = G^-1 R = (Y B X)^-1 (Y A X), nearly diagonal.

    S0 + d S1 is the part of S that is computed; `N` bounds what it misses. Over an interval, if
    `half` of its width is above 0, the vectors then move with the parameter. See the top of the
    module for the symbols, and `docs/proof.md`, Ranges, 1 for the bounds.
    """
    X = basis.X
    Y = basis.Y
    n = len(X)
    if Y is None:
        try:
            Y = np.linalg.inv(B.value.mid @ X)
        except LinAlgError:
            return Failure(ILL_CONDITIONED)
    # below, `upper(bound, k)` allows for the rounding of k sums and products
    left = Balls.exact(Y)
    right = Balls.exact(X)
    G0 = left @ (B.value @ right)
    R0 = left @ (A.value @ right)
    stay_together = np.eye(n, dtype=bool)  # entries that S0 and L keep, all others go to N
    for chain in basis.chains:
        stay_together[np.ix_(chain.members, chain.members)] = True
    S0 = Balls.exact(_structured(np.where(stay_together, R0.mid, 0.0), basis.mirror))
    S1 = Balls.exact(np.zeros((n, n)))
    # With G = G0 + d G1 + d^2 G2 and R = R0 + d R1 + d^2 R2: |G - 1| <= E, and, summed by orders,
    # R - G (S0 + d S1) = (R0 - G0 S0) + d (R1 - G1 S0 - G0 S1) + d^2 (R2 - G2 (S0 + d S1) - G1 S1),
    # at most U, which is summed term by term. G1 below are balls, G2 is the bound of d^2 G2
    # |G0 - 1|; the radius takes in the rounding of the difference
    E = Balls(G0.mid - np.eye(n), upper(G0.rad + EPS * magnitude(G0.mid), 2)).bound()
    U = R0.minus(G0 @ S0).bound()  # of the order d^0
    if half > 0.0:
        sizes_of_X = magnitude(X)
        sizes_of_Y = magnitude(Y)
        sizes_of_S0 = magnitude(S0.mid)
        G1 = left @ (B.slope @ right)
        G2 = half**2 * (sizes_of_Y @ B.remainder @ sizes_of_X)
        E += half * G1.bound()
        E += G2
        first_order = (left @ (A.slope @ right)).minus(G1 @ S0)
        S1 = Balls.exact(_structured(first_order.mid, basis.mirror))
        sizes_of_S1 = magnitude(S1.mid)
        U += half * first_order.minus(G0 @ S1).bound()
        U += half**2 * (sizes_of_Y @ A.remainder @ sizes_of_X)  # d^2 R2
        U += G2 @ (sizes_of_S0 + half * sizes_of_S1)  # d^2 G2 (S0 + d S1)
        U += half**2 * (G1.bound() @ sizes_of_S1)  # d^2 G1 S1
    F = inverse_excess(upper(E, 6 * n + 16))  # |G^-1 - 1| <= F
    if F is None:
        return Failure(ILL_CONDITIONED)
    N = upper(U + F @ U, 8 * n + 16)  # S - (S0 + d S1) = G^-1 (R - G (S0 + d S1))
    L = S1.mid
    if half > 0.0:
        moved = _with_moving_vectors(S0, S1, N, stay_together, basis.mirror, half)
        if isinstance(moved, Failure):
            return moved
        L, N = moved
    if not np.isfinite(N).all():
        return Failure(BEYOND)
    is_real = np.zeros(n, dtype=bool)
    if basis.mirror is not None:  # a real column is its own conjugate
        is_real = basis.mirror == np.arange(n)
    S = NearDiagonal(S0.mid, L, N, is_real)
    for chain in basis.chains:
        S = _with_scaled_levels(S, chain, half)
    return S


def _with_scaled_levels(S: NearDiagonal, chain: Chain, half: float) -> NearDiagonal:
    """S with the columns of a chain scaled by powers of 2, which makes its largest disc smallest.

    A similarity by a diagonal matrix, so that the eigenvalues stay (see `chains`).
    """
    couplings = magnitude(S.S0) + half * magnitude(S.L) + S.N
    shifts = chain.shifts(couplings - np.diag(couplings.diagonal()))
    scale = np.ldexp(1.0, shifts)
    return S._replace(S0=S.S0 * scale, L=S.L * scale, N=upper(np.ldexp(S.N, shifts), 1))


def _with_moving_vectors(
    S0: Balls,
    S1: Balls,
    Q: Floats,
    stay_together: NDArray[np.bool_],
    mirror: NDArray[np.intp] | None,
    half: float,
) -> tuple[NDArray, Floats] | Failure:
    """L and N (n, n) of `NearDiagonal`, with vectors that move with the parameter, |d| <= half.

    The matrices are S0 + d S1 plus an unknown rest of entries up to Q (n, n). The similarity
    1 + d Z transforms them. Let [S, Z] = S Z - Z S and V = (1 + d Z)^-1 - 1. For any matrix S

        (1 + V) S (1 + d Z) = (1 + V) ((1 + d Z) S + d [S, Z]) = S + (1 + V) d [S, Z],

    as S (1 + d Z) = (1 + d Z) S + d [S, Z] and (1 + V) (1 + d Z) = 1. With S = S0 + d S1, and Q for
    the rest,

        (1 + V) (S0 + d S1 + Q) (1 + d Z) = S0 + d (S1 + [S0, Z]) + d^2 [S1, Z]
            + V (d [S0, Z] + d^2 [S1, Z]) + (1 + V) Q (1 + d Z).

    Z makes S1 + [S0, Z] zero between columns (`docs/proof.md`, Ranges, 2), but for those that
    `stay_together` or are too near to each other: they keep their coupling in L. N bounds all else.
    S0 and S1 are exact, without radii: how far the matrices are from S0 + d S1 is part of Q. mirror
    (n,): the column that is conjugate to each, None of complex matrices.
    V = -d Z - d Z V, since (1 + d Z) (1 + V) = 1, so that d V [S0, Z] is -d^2 Z [S0, Z], a term of
    second order, and one of third.
    """
    centres = S0.mid.diagonal()
    gaps = centres[:, None] - centres
    are_near = half * np.abs(S1.mid) >= NEAR_SHARE * np.abs(gaps)  # also where both are zero
    stay_together = stay_together | are_near | are_near.T
    chain_couplings = S0.mid - np.diag(centres)
    # S1 + S0 Z - Z S0 = 0 entry by entry; couplings in chains make that a fixed-point iteration
    Z = np.zeros_like(S1.mid)
    for _ in range(3 if chain_couplings.any() else 1):
        right_side = S1.mid + chain_couplings @ Z - Z @ chain_couplings
        Z = np.where(stay_together, 0.0, -right_side / np.where(stay_together, 1.0, gaps))
    Z_ball = Balls.exact(_structured(Z, mirror))
    dZ_bound = half * magnitude(Z_ball.mid)
    V_bound = inverse_excess(upper(dZ_bound, 1))  # of |(1 + d Z)^-1 - 1|
    if V_bound is None:
        return Failure(ILL_CONDITIONED)
    S0_Z = (S0 @ Z_ball).minus(Z_ball @ S0)
    S1_Z = (S1 @ Z_ball).minus(Z_ball @ S1)
    slope = S1.plus(S0_Z)
    L = _structured(np.where(stay_together, slope.mid, 0.0), mirror)
    first_order = half * slope.minus(Balls.exact(L)).bound()
    second_order = half**2 * S1_Z.minus(Z_ball @ S0_Z).bound()
    third_order = dZ_bound @ (V_bound @ (half * S0_Z.bound())) + V_bound @ (half**2 * S1_Z.bound())
    # (1 + V) Q (1 + d Z) = Q + (1 + V) (Q d Z - d Z Q), as of any matrix
    moved_Q = Q @ dZ_bound + dZ_bound @ Q
    N = Q + first_order + second_order + third_order + moved_Q + V_bound @ moved_Q
    return L, upper(N, 8 * len(Q) + 16)  # more terms than any entry of N sums


def _structured(W: NDArray, mirror: NDArray[np.intp] | None) -> NDArray:
    """The part of W (n, n) that is real in real columns, and conjugate in conjugate ones."""
    if mirror is None or not np.iscomplexobj(W):
        return W
    return (W + W[mirror[:, None], mirror].conj()) / 2.0


def inverse_excess(E: Floats) -> Floats | None:
    """Bounds of |(1 + W)^-1 - 1| for all |W| <= E (n, n); None where the row sums are too large.

    By Neumann's series it is at most E + E^2 + ..., and (E^k)_ij, k > 1, is at most the sum of
    row i times e^(k - 2) times the largest entry of column j, e the largest sum of a row.
    """
    sums = row_sums(E)
    e = float(np.max(sums))
    if not e <= LARGEST_E:
        return None
    return upper(E + np.outer(sums, E.max(axis=0)) / (1.0 - e), 6)


class MovingDiscs(NamedTuple):
    """Gershgorin's discs around centres that move with the parameter.

    radii (n,); separation (n, n): how far each two stay from each other over the interval, negative
    where they may meet, inf on the diagonal; off_diagonal (n, n): bounds of the entries of S off
    the diagonal, zero on it; parts: the indices of the discs of each connected part of their union.
    """

    radii: Floats
    separation: Floats
    off_diagonal: Floats
    parts: list[NDArray[np.intp]]


def least_distance(D: NDArray, V: NDArray, half: float) -> Floats:
    """Lower bounds of |D + d V| for |d| <= half, of complex numbers: the distance from zero of the
    line segment that they are."""
    speed_squared = np.abs(V) ** 2
    projection = (D * V.conj()).real
    nearest_d = np.clip(-projection / divisor(speed_squared), -half, half)
    rounding = 32.0 * EPS * (np.abs(D) + half * np.abs(V))
    return np.abs(D + nearest_d * V) - rounding - TINY


def moving_discs(S: NearDiagonal, half: float) -> MovingDiscs:
    """Gershgorin's discs of the matrices over the interval.

    The radius of a disc is the error of its diagonal entry plus the sum of the rest of its row. A
    disc i that meets no other is then shrunk by a diagonal similarity, which multiplies row i of S
    by a share a < 1 and column i by 1/a. That adds up to N_ji/a to the radius of each other disc j,
    which a = max_j 2 N_ji / separation_ij keeps to half of its separation from disc i: the two
    discs still do not meet.
    """
    centres = S.centres
    speeds = S.speeds
    off_diagonal = upper(magnitude(S.S0) + half * magnitude(S.L) + S.N, 4)  # 3 terms, one a product
    np.fill_diagonal(off_diagonal, 0.0)
    diagonal_errors = S.N.diagonal()
    off_diagonal_sums = row_sums(off_diagonal)
    radii = upper(diagonal_errors + off_diagonal_sums, 2)
    distances = least_distance(centres[:, None] - centres, speeds[:, None] - speeds, half)
    separation = distances - radii[:, None] - radii[None, :]
    np.fill_diagonal(separation, np.inf)
    is_isolated = np.all(separation > 0.0, axis=1)
    # shares[i, j] = 2 N_ji / separation_ij, that of disc i which disc j allows
    shares = 2.0 * off_diagonal.T / divisor(separation)
    # above zero, as its inverse multiplies a column
    share = np.clip(upper(np.max(shares, axis=1, initial=0.0), 4), 1e-12, None)
    shrunk = upper(diagonal_errors + share * off_diagonal_sums, 4)
    radii = np.where(is_isolated & (share < 1.0), np.minimum(shrunk, radii), radii)
    may_meet = ~(separation > 0.0)
    np.fill_diagonal(may_meet, True)
    return MovingDiscs(radii, separation, off_diagonal, strong_components(may_meet))


def _are_own_images(
    S: NearDiagonal,
    discs: MovingDiscs,
    half: float,
    image_centres: NDArray,
    image_speeds: NDArray,
) -> NDArray[np.bool_]:
    """For each part of the discs whether its mirror image meets no other part.

    Then the roots in it are their own mirror images, as a set. The mirror is the imaginary axis or
    the real one; the caller gives `image_centres` and `image_speeds` (n,), those of the n discs in
    the mirror: -conj(centres), or conj(centres). The radii are the same. half: half the length of
    the interval.
    """
    # distances[i, j], label[i]: from the image of disc i to disc j, and the part that disc i is in
    distances = least_distance(
        image_centres[:, None] - S.centres, image_speeds[:, None] - S.speeds, half
    )
    label = labels(discs.parts, len(image_centres))
    # "not above zero", so that discs without a finite radius may meet too
    may_meet = ~(distances - discs.radii[:, None] - discs.radii > 0.0)
    meets_others = may_meet & (label[:, None] != label)
    return np.array([not meets_others[part].any() for part in discs.parts])


def tallies_of_values(S: NearDiagonal, half: float, is_hamiltonian: bool) -> list[list[Tally]]:
    """Whether the roots lambda, which are the eigenvalues of S, grow or decay over the interval.

    One list, here of a single tally, for each part: discs that overlap, which hold as many roots as
    they have discs. In a Hamiltonian system the spectrum is symmetric about the imaginary axis. A
    part of one root that equals its own mirror image holds the image of that root, so that the root
    lies on the axis. Of a part of several roots this says nothing: they may mirror each other.

    S holds for m - half <= p <= m + half, m being the middle of the interval; is_hamiltonian says
    that M and K are symmetric and C is skew.
    """
    discs = moving_discs(S, half)
    bounds = _bounds_of_parts(S.centres.real, S.speeds.real, discs, half)
    is_own_image = np.zeros(len(discs.parts), dtype=bool)
    if is_hamiltonian:
        # the image of lambda in the imaginary axis is -conj(lambda)
        is_own_image = _are_own_images(S, discs, half, -S.centres.conj(), -S.speeds.conj())
    tallies = []
    for is_on_axis, part, (low, high) in zip(is_own_image, discs.parts, bounds, strict=True):
        tally = _tally(len(part), low, high)
        if is_on_axis and len(part) == 1:
            tally = Tally(1, 0.0, 0.0, "axis")  # one root, its real part from 0 to 0
        tallies.append([tally])
    return tallies


def frequencies_on_axis(S: NearDiagonal, half: float) -> list[tuple[float, float]]:
    """Bounds of Im lambda for each part of the discs above the real axis whose roots lambda, the
    eigenvalues of S, may lie on the imaginary axis somewhere in the interval."""
    discs = moving_discs(S, half)
    growth_rates = _bounds_of_parts(S.centres.real, S.speeds.real, discs, half)
    frequencies = _bounds_of_parts(S.centres.imag, S.speeds.imag, discs, half)
    on_axis = []
    for (slowest, fastest), (bottom, top) in zip(growth_rates, frequencies, strict=True):
        if slowest <= 0.0 <= fastest and bottom > 0.0:
            on_axis.append((bottom, top))
    return on_axis


def _tally(number: int, low: float, high: float) -> Tally:
    """So many roots, which grow or decay if both bounds of their real parts say so."""
    side: Side = "unknown"
    if low > 0.0:
        side = "grows"
    elif high < 0.0:
        side = "decays"
    return Tally(number, low, high, side)


def tallies_above(S: NearDiagonal, half: float, are_squares: bool) -> list[Tally]:
    """What those roots lambda of complex matrices do that lie above the real axis.

    Each counts as two, since it stands for a pair. Of eigenvalues s = -lambda^2, if `are_squares`,
    each has one such root, i sqrt(s), which grows if Im s < 0. Of eigenvalues lambda, a part that
    may lie below the real axis gets the lower bound -inf, so that none of its roots counts as
    growing for certain.
    """
    discs = moving_discs(S, half)
    real_parts = _bounds_of_parts(S.centres.real, S.speeds.real, discs, half)
    imaginary_parts = _bounds_of_parts(S.centres.imag, S.speeds.imag, discs, half)
    tallies = []
    parts = zip(discs.parts, real_parts, imaginary_parts, strict=True)
    for part, (low, high), (bottom, top) in parts:
        if are_squares:
            # the least growth of i sqrt(s) of the s of this part, and the greatest below
            slowest = _growth_above(low, high, top)
            # Re i sqrt(s) of the conjugate of s is that of s with the other sign, and its imaginary
            # part is at most -bottom
            fastest = -_growth_above(low, high, -bottom)
        elif top < 0.0:  # all below the real axis
            continue
        else:
            slowest = low if bottom > 0.0 else -np.inf
            fastest = high
        tallies.append(_tally(2 * len(part), slowest, fastest))
    return tallies


def _growth_above(low: float, high: float, top: float) -> float:
    """A lower bound of Re i sqrt(s), of s of real parts from low to high and Im s <= top.

    Its size (see `_growth`) falls with Re s and rises with |Im s|; it is positive if Im s < 0.
    """
    if top < 0.0:
        return _growth(high, -top) * (1.0 - 8.0 * EPS)
    return -_growth(low, top) * (1.0 + 8.0 * EPS)


def tallies_of_squares(S: NearDiagonal, half: float) -> list[list[Tally]]:
    """What all roots lambda do over the interval, of eigenvalues s = -lambda^2 of S, by parts."""
    discs = moving_discs(S, half)
    real_parts = _bounds_of_parts(S.centres.real, S.speeds.real, discs, half)
    imaginary_parts = imaginary_bounds(S, discs, half)
    tallies = []
    parts = zip(discs.parts, real_parts, imaginary_parts, strict=True)
    for part, (low, high), imaginary in parts:
        tallies.append(_tallies_of_square(len(part), low, high, imaginary))
    return tallies


def tallies_of_inverses(
    S: NearDiagonal, half: float, tallies: Sequence[list[Tally]], infinite: int, are_squares: bool
) -> list[Tally]:
    """What finite roots lambda do, by the `tallies` of their inverses z, or inverse squares, in the
    parts of the discs.

    Re lambda = Re z / |z|^2 has the sign of Re z. In the result `high` bounds Re lambda if it is
    above zero; of a `high` below zero, and of `low`, the sign alone holds. Parts that may hold zero
    say nothing of their roots. Of these eigenvalues `infinite` are zero at all matrices: they are
    inverses of infinite roots. The others may be roots of any size.
    """
    discs = moving_discs(S, half)
    distances = least_distance(S.centres, S.speeds, half) - discs.radii
    of_roots: list[Tally] = []
    around_zero = 0
    for part, of_part in zip(discs.parts, tallies, strict=True):
        nearest = float(distances[part].min())
        if not nearest > 0.0:
            around_zero += len(part)
            continue
        # an upper bound of 1 / |inverse of lambda|^2: of inverse squares, z has that size already
        stretch = (1.0 + 8.0 * EPS) / (nearest if are_squares else nearest**2)
        of_roots += [tally._replace(high=tally.high * stretch) for tally in of_part]
    unknown = around_zero - infinite
    if unknown:  # of each square two roots
        of_roots.append(Tally(unknown * (1 + are_squares), -np.inf, np.inf, "unknown"))
    return of_roots


class ImaginaryBound(NamedTuple):
    """Of the eigenvalues of a part of the discs: whether it is certain that none is real, and a
    bound of |Im s|, 0 where all are real."""

    never_real: bool
    largest: float


def imaginary_bounds(S: NearDiagonal, discs: MovingDiscs, half: float) -> list[ImaginaryBound]:
    """What the discs say of the imaginary parts of the eigenvalues of each part.

    S is of real matrices, whose eigenvalues come in conjugate pairs: one alone in a disc, the
    mirror image of which meets no other disc, is real. Of two that share a part the discriminant
    decides. half: half the width of the interval.
    """
    of_discs = _bounds_of_parts(S.centres.imag, S.speeds.imag, discs, half)
    is_own_image = _are_own_images(S, discs, half, S.centres.conj(), S.speeds.conj())
    bounds = []
    parts = zip(is_own_image, discs.parts, of_discs, strict=True)
    for has_own_image, part, (bottom, top) in parts:
        is_real_pair = len(part) == 2 and bool(S.is_real[part].all())
        if has_own_image and len(part) == 1:
            bounds.append(ImaginaryBound(never_real=False, largest=0.0))
        elif has_own_image and is_real_pair and flint is not None:
            bounds.append(_imaginary_bound_of_pair(S, discs, half, part))
        else:
            never_real = bottom > 0.0 or top < 0.0
            bounds.append(ImaginaryBound(never_real, max(-bottom, top)))
    return bounds


def _bounds_of_parts(
    values: Floats, speeds: Floats, discs: MovingDiscs, half: float
) -> list[tuple[float, float]]:
    """Bounds of values + d speeds +- radii for |d| <= half, over all discs of each part."""
    reach = upper(half * np.abs(speeds) + discs.radii, 4) + 2.0 * EPS * np.abs(values)
    lows = np.nextafter(values - reach, -np.inf)
    highs = np.nextafter(values + reach, np.inf)
    bounds = []
    for part in discs.parts:
        bounds.append((float(lows[part].min()), float(highs[part].max())))
    return bounds


def _imaginary_bound_of_pair(
    S: NearDiagonal, discs: MovingDiscs, half: float, part: NDArray[np.intp]
) -> ImaginaryBound:
    """The bound for two eigenvalues s that share a part, of real columns.

    At each d they are roots of (x - s) (y - s) = b c, where [[x - s, b], [c, y - s]] is the Schur
    complement that eliminates the other columns r from S - s: the block of these two, p, plus
    E = -S_pr (S_rr - s)^-1 S_rp. Each row k of S_rr - s is diagonally dominant by m_k, its
    `separation`, so that the solution of (S_rr - s) v = w is at most max_k |w_k| / m_k. Hence
    |E_ab| is at most (sum_k |S_ak|) (max_k |S_kb| / m_k), which is `through_others`. E is real for
    real s. The discriminant (x - y)^2 + 4 b c over all such E then says whether both s are real
    (`docs/proof.md`, Ranges, 4).
    """
    is_other = np.ones(len(discs.radii), dtype=bool)
    is_other[part] = False
    separation = discs.separation[np.ix_(part, is_other)].min(axis=0, initial=np.inf)
    to_others = row_sums(discs.off_diagonal[np.ix_(part, is_other)])
    from_others = np.max(
        discs.off_diagonal[np.ix_(is_other, part)] / separation[:, None], axis=0, initial=0.0
    )
    through_others = upper(np.outer(to_others, from_others), 8)
    block = np.ix_(part, part)
    errors = upper(S.N[block] + through_others, 2)
    interval = flint.arb(0, half)
    entries = []  # of the block, row by row, as polynomials in d
    numbers = zip(S.S0[block].real.flat, S.L[block].real.flat, errors.flat, strict=True)
    for value, slope, error in numbers:
        value_ball = flint.arb(float(value), float(error))
        entries.append(flint.arb_poly([value_ball, float(slope)]))
    x, b, c, y = entries
    discriminant = ((x - y) * (x - y) + 4 * b * c)(interval)
    if discriminant > 0:
        return ImaginaryBound(never_real=False, largest=0.0)
    # x and y are real but for `through_others`, so that each factor of (x - s) (y - s) = b c is at
    # least |Im s| - through_others, and their product at most |b c|
    coupled = float((b(interval) * c(interval)).abs_upper())
    by_coupling = np.sqrt(coupled) + through_others.max()
    # s = (x + y +- sqrt(discriminant)) / 2, where x and y are imaginary by their `errors` at most,
    # which include `through_others`
    root_of_discriminant = np.sqrt(float(discriminant.abs_upper()))
    by_discriminant = (root_of_discriminant + errors[0, 0] + errors[1, 1]) / 2.0
    largest = min(by_coupling, by_discriminant) * (1.0 + 8.0 * EPS)
    return ImaginaryBound(bool(discriminant < 0), float(largest))


def _tallies_of_square(
    count: int, low: float, high: float, imaginary: ImaginaryBound
) -> list[Tally]:
    """What the roots +-sqrt(-s) of `count` numbers s do, of real parts from low to high.

    Their growth is +-sqrt((|s| - Re s) / 2): of each two one does not decay, one does not grow.
    """
    fastest = _growth(low, imaginary.largest) * (1.0 + 8.0 * EPS)
    slowest = _growth(high, 0.0) * (1.0 - 8.0 * EPS)
    if fastest == 0.0:
        return [Tally(2 * count, 0.0, 0.0, "axis")]
    side: Side = "grows" if imaginary.never_real or high < 0.0 else "unknown"
    return [Tally(count, slowest, fastest, side), Tally(count, -fastest, -slowest, "decays")]


def _growth(x: float, y: float) -> float:
    """sqrt((|s| - x) / 2) of s = x + i y, without cancellation."""
    length = float(np.hypot(x, y))
    if x <= 0.0:
        return float(np.sqrt((length - x) / 2.0))
    return float(y / np.sqrt(2.0 * (length + x)))
