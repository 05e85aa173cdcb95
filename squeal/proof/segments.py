"""Gershgorin's discs of a pencil A - s B, over an interval of the parameter or at one value.

Let X hold approximate right vectors and Y be about the inverse of B X. With G = Y B X, R = Y A X
and |G - 1| <= E, of row sums e < 1, no matrix in the balls makes Y, B or X singular, so that the
roots are the eigenvalues of S = G^-1 R, and

    |G^-1 - 1| <= E + (row sums of E) (column maxima of E) / (1 - e).

Over an interval p = m + d, |d| <= h, the matrices are A0 + d A1 but for at most d^2 A2, hence S is
S0 + d S1 but for at most Q. A second similarity 1 + d Z, with S1 + S0 Z - Z S0 close to zero
between columns that are apart, lets the vectors move. What is left of order d is the motion of the
centres, so that the discs hold terms of second order; columns that meet keep their coupling.
`docs/proof.md` derives the bounds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from squeal.proof.balls import EPS, TINY, Balls, Floats, row_sums, size, upper
from squeal.proof.chains import Chain, find_chains
from squeal.proof.pieces import Failure, Side, Tally, strong_parts

try:
    import flint
except ImportError:  # an extra
    flint = None

NEAR = 0.125  # h |coupling| of two columns by their distance, above which they stay together
LARGEST_E = 0.5  # row sums of |Y B X - 1| up to which the inverse is bounded
BEYOND = "the entries lie beyond double precision"
ILL = "the eigenvectors are too ill-conditioned"


@dataclass(frozen=True, eq=False)
class Expansion:
    """All matrices (n, n) in `value` + d `slope`, but for at most d^2 `rest`."""

    value: Balls
    slope: Balls
    rest: Floats

    @staticmethod
    def constant(X: Balls) -> Expansion:
        """Matrices that do not depend on the parameter."""
        none = np.zeros(X.mid.shape)
        return Expansion(X, Balls.exact(none), none)


class Basis(NamedTuple):
    """Approximate right vectors X (n, n); the index (n,) of the column that is the conjugate of
    each, None where that is not known; chains in X in place of vectors; and Y, if it is known."""

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
            yield Basis(X, None, chains)
        return
    mirror = np.arange(len(X))
    first = np.flatnonzero(values.imag > 0.0)
    mirror[first] = first + 1
    mirror[first + 1] = first
    yield Basis(X, mirror.copy(), ())
    chains = []
    for chain in find_chains(A, B, values, X):
        partners = mirror[chain.members]
        if not np.iscomplexobj(chain.basis):
            if not np.isin(partners, chain.members).all():
                continue
            mirror[chain.members] = chain.members
            X = chain.put_into(X)
            chains.append(chain)
        elif values[chain.members].imag.mean() > 0.0:  # the others come with their conjugates
            other = replace(chain, members=partners, basis=chain.basis.conj())
            X = other.put_into(chain.put_into(X))
            chains += [chain, other]
    if chains:
        yield Basis(X, mirror, chains)


class Moving(NamedTuple):
    """Matrices S (n, n) over the interval: S0 + d L but for at most N, S0 and L zero but next to
    the diagonal and where columns stay together; `is_real` (n,) are the columns of real vectors."""

    S0: NDArray
    L: NDArray
    N: Floats
    is_real: NDArray[np.bool_]

    @property
    def centres(self) -> NDArray:
        """Centres of the discs (n,) at the middle."""
        return self.S0.diagonal()

    @property
    def speeds(self) -> NDArray:
        """How the centres (n,) move with the parameter."""
        return self.L.diagonal()


def moving(A: Expansion, B: Expansion, half: float, basis: Basis) -> Moving | Failure:
    """The pencil A - s B on approximate vectors, which move with the parameter if `half` > 0."""
    X, mirror, chains, Y = basis
    n = len(X)
    if Y is None:
        try:
            Y = np.linalg.inv(B.value.mid @ X)
        except LinAlgError:
            return Failure(ILL)
    left = Balls.exact(Y)
    right = Balls.exact(X)
    G0 = left @ (B.value @ right)
    R0 = left @ (A.value @ right)
    together = np.eye(n, dtype=bool)
    for chain in chains:
        together[np.ix_(chain.members, chain.members)] = True
    S0 = Balls.exact(_structured(np.where(together, R0.mid, 0.0), mirror))
    S1 = Balls.exact(np.zeros((n, n)))
    E = Balls(G0.mid - np.eye(n), upper(G0.rad + EPS * size(G0.mid), 2)).bound()
    U = _less(R0, G0 @ S0).bound()  # of R - G (S0 + d S1), order by order
    if half > 0.0:
        G1 = left @ (B.slope @ right)
        G2 = half**2 * (size(Y) @ B.rest @ size(X))
        E = E + half * G1.bound() + G2
        first = _less(left @ (A.slope @ right), G1 @ S0)
        S1 = Balls.exact(_structured(first.mid, mirror))
        U = U + half * _less(first, G0 @ S1).bound() + half**2 * (size(Y) @ A.rest @ size(X))
        U = U + G2 @ (size(S0.mid) + half * size(S1.mid)) + half**2 * (G1.bound() @ size(S1.mid))
    F = inverse_excess(upper(E, 6 * n + 16))
    if F is None:
        return Failure(ILL)
    N = upper(U + F @ U, 8 * n + 16)
    L = S1.mid
    if half > 0.0:
        rotated = _rotated(S0, S1, N, together, mirror, half)
        if isinstance(rotated, Failure):
            return rotated
        L, N = rotated
    if not np.isfinite(N).all():
        return Failure(BEYOND)
    values = S0.mid
    for chain in chains:
        coupling = size(values) + half * size(L) + N
        shifts = chain.shifts(coupling - np.diag(coupling.diagonal()))
        N = upper(np.ldexp(N, shifts), 1)
        values = values * np.ldexp(1.0, shifts)
        L = L * np.ldexp(1.0, shifts)
    is_real = np.zeros(n, dtype=bool) if mirror is None else mirror == np.arange(n)
    return Moving(values, L, N, is_real)


def _rotated(
    S0: Balls,
    S1: Balls,
    Q: Floats,
    together: NDArray[np.bool_],
    mirror: NDArray[np.intp] | None,
    half: float,
) -> tuple[NDArray, Floats] | Failure:
    """L and N after the similarity 1 + d Z of S0 + d S1, known but for Q.

    With V = (1 + d Z)^-1 - 1 it is S0 + d (S1 + [S0, Z]) + d^2 [S1, Z] + V (d [S0, Z] +
    d^2 [S1, Z]) and what Q becomes; V = -d Z but for terms of second order.
    """
    centres = S0.mid.diagonal()
    gaps = centres[:, None] - centres
    near = half * np.abs(S1.mid) > NEAR * np.abs(gaps)
    together = together | near | near.T
    block = S0.mid - np.diag(centres)
    Z = np.zeros_like(S1.mid)
    for _ in range(3 if block.any() else 1):
        pull = S1.mid + block @ Z - Z @ block
        Z = np.where(together, 0.0, -pull / np.where(together, 1.0, gaps))
    turn = Balls.exact(_structured(Z, mirror))
    reach = half * size(turn.mid)
    V = inverse_excess(upper(reach, 1))
    if V is None:
        return Failure(ILL)
    zeroth = _less(S0 @ turn, turn @ S0)
    first = _less(S1 @ turn, turn @ S1)
    slope = S1.plus(zeroth)
    L = _structured(np.where(together, slope.mid, 0.0), mirror)
    second = half**2 * _less(first, turn @ zeroth).bound()
    third = reach @ (V @ (half * zeroth.bound())) + V @ (half**2 * first.bound())
    moved = Q @ reach + reach @ Q
    N = Q + half * _less(slope, Balls.exact(L)).bound() + second + third + moved + V @ moved
    return L, upper(N, 8 * len(Q) + 16)


def _less(a: Balls, b: Balls) -> Balls:
    """The difference."""
    return a.plus(b.times(-1.0))


def _structured(W: NDArray, mirror: NDArray[np.intp] | None) -> NDArray:
    """The part of W (n, n) that is real in real columns, and conjugate in conjugate ones."""
    if mirror is None or not np.iscomplexobj(W):
        return W
    return (W + W[np.ix_(mirror, mirror)].conj()) / 2.0


def inverse_excess(E: Floats) -> Floats | None:
    """Bounds of |(1 + W)^-1 - 1| for all |W| <= E (n, n); None where the row sums are too large."""
    sums = row_sums(E)
    e = float(np.max(sums))
    if not e <= LARGEST_E:
        return None
    return upper(E + np.outer(sums, E.max(axis=0)) / (1.0 - e), 6)


class Neighbours(NamedTuple):
    """Discs around moving centres: radii (n,), by how much each two stay apart (n, n), the entries
    beside the diagonal (n, n), and the union of discs that meet somewhere, by parts."""

    radii: Floats
    room: Floats
    beside: Floats
    parts: list[NDArray[np.intp]]


def nearest(D: NDArray, V: NDArray, half: float) -> Floats:
    """Lower bounds of |D + d V| for |d| <= half."""
    speed = np.abs(V) ** 2
    along = (D * V.conj()).real
    d = np.clip(-along / np.where(speed > 0.0, speed, 1.0), -half, half)
    return np.abs(D + d * V) - 32.0 * EPS * (np.abs(D) + half * np.abs(V)) - TINY


def neighbours(found: Moving, half: float) -> Neighbours:
    """Gershgorin's discs of the matrices over the interval."""
    centres = found.centres
    speeds = found.speeds
    beside = upper(size(found.S0) + half * size(found.L) + found.N, 4)
    np.fill_diagonal(beside, 0.0)
    own = found.N.diagonal()
    others = row_sums(beside)
    radii = upper(own + others, 2)
    gaps = nearest(centres[:, None] - centres, speeds[:, None] - speeds, half)
    room = gaps - radii[:, None] - radii[None, :]
    np.fill_diagonal(room, np.inf)
    isolated = np.all(room > 0.0, axis=1)
    share = np.max(2.0 * beside.T / np.where(room > 0.0, room, 1.0), axis=1, initial=0.0)
    share = np.clip(upper(share, 4), 1e-12, None)
    smaller = upper(own + share * others, 4)
    radii = np.where(isolated & (share < 1.0), np.minimum(smaller, radii), radii)
    touching = ~(room > 0.0)
    np.fill_diagonal(touching, True)
    return Neighbours(radii, room, beside, strong_parts(touching))


def _stays_within(
    found: Moving, discs: Neighbours, half: float, turned: NDArray, speeds: NDArray
) -> NDArray[np.bool_]:
    """For each part whether its mirror image, around turned centres, meets no other part."""
    gaps = nearest(turned[:, None] - found.centres, speeds[:, None] - found.speeds, half)
    label = np.empty(len(turned), dtype=int)
    for number, part in enumerate(discs.parts):
        label[part] = number
    meets = ~(gaps - discs.radii[:, None] - discs.radii > 0.0) & (label[:, None] != label)
    return np.array([not meets[part].any() for part in discs.parts])


def tallies_of_values(found: Moving, half: float, is_hamiltonian: bool) -> list[Tally]:
    """What all roots lambda, the eigenvalues, do over the interval.

    In a Hamiltonian system a root that equals its mirror image lies on the imaginary axis.
    """
    discs = neighbours(found, half)
    lows, highs = _bounds_of(found.centres.real, found.speeds.real, discs.radii, half)
    is_own = np.zeros(len(discs.parts), dtype=bool)
    if is_hamiltonian:
        is_own = _stays_within(found, discs, half, -found.centres.conj(), -found.speeds.conj())
    each = []
    for part, own in zip(discs.parts, is_own.tolist(), strict=True):
        if own and len(part) == 1:
            each.append(Tally(1, 0.0, 0.0, "axis"))
            continue
        each.append(_tally(len(part), float(lows[part].min()), float(highs[part].max())))
    return each


def _tally(number: int, low: float, high: float) -> Tally:
    """So many roots, which grow or decay if both bounds of their real parts say so."""
    side: Side = "unknown"
    if low > 0.0:
        side = "grows"
    elif high < 0.0:
        side = "decays"
    return Tally(number, low, high, side)


def tallies_above(found: Moving, half: float, are_squares: bool) -> list[Tally]:
    """What those roots lambda of complex matrices do that lie above the real axis; each counts as
    two, since it stands for a pair.

    Of eigenvalues s = -lambda^2, if `are_squares`, each has one such root, i sqrt(s), which grows
    if Im s < 0. Where the eigenvalues are lambda, those that may lie below may not be there.
    """
    discs = neighbours(found, half)
    lows, highs = _bounds_of(found.centres.real, found.speeds.real, discs.radii, half)
    bottoms, tops = _bounds_of(found.centres.imag, found.speeds.imag, discs.radii, half)
    each = []
    for part in discs.parts:
        low = float(lows[part].min())
        high = float(highs[part].max())
        bottom = float(bottoms[part].min())
        top = float(tops[part].max())
        slowest = low if bottom > 0.0 else -np.inf
        fastest = high
        if are_squares:
            slowest = _growth_above(low, high, top)
            fastest = -_growth_above(low, high, -bottom)
        elif top < 0.0:
            continue
        each.append(_tally(2 * len(part), slowest, fastest))
    return each


def _growth_above(low: float, high: float, top: float) -> float:
    """A lower bound of Re i sqrt(s), of s of real parts from low to high and Im s <= top."""
    if top < 0.0:
        return _growth(high, -top) * (1.0 - 8.0 * EPS)
    return -_growth(low, top) * (1.0 + 8.0 * EPS)


def tallies_of_squares(found: Moving, half: float) -> list[Tally]:
    """What all roots lambda do over the interval, of eigenvalues s = -lambda^2."""
    discs = neighbours(found, half)
    lows, highs = _bounds_of(found.centres.real, found.speeds.real, discs.radii, half)
    each: list[Tally] = []
    for part, (never_real, tall) in zip(discs.parts, heights(found, discs, half), strict=True):
        low = float(lows[part].min())
        high = float(highs[part].max())
        each += _of_squares(len(part), low, high, never_real, tall)
    return each


def heights(found: Moving, discs: Neighbours, half: float) -> list[tuple[bool, float]]:
    """Of the eigenvalues of each part whether none is a real number for certain, and a bound of the
    imaginary parts, 0 where all are real."""
    bottoms, tops = _bounds_of(found.centres.imag, found.speeds.imag, discs.radii, half)
    largest = np.maximum(np.abs(bottoms), np.abs(tops))
    is_off = (bottoms > 0.0) | (tops < 0.0)
    is_own = _stays_within(found, discs, half, found.centres.conj(), found.speeds.conj())
    each = []
    for part, own in zip(discs.parts, is_own.tolist(), strict=True):
        if own and len(part) == 1:
            each.append((False, 0.0))
        elif own and len(part) == 2 and found.is_real[part].all() and flint is not None:
            each.append(_height(found, discs, half, part))
        else:
            each.append((bool(is_off[part].all()), float(largest[part].max())))
    return each


def _bounds_of(values: Floats, speeds: Floats, radii: Floats, half: float) -> tuple[Floats, Floats]:
    """Bounds of values + d speeds +- radii for |d| <= half."""
    reach = upper(half * np.abs(speeds) + radii, 4) + 2.0 * EPS * np.abs(values)
    return np.nextafter(values - reach, -np.inf), np.nextafter(values + reach, np.inf)


def _height(
    found: Moving, discs: Neighbours, half: float, part: NDArray[np.intp]
) -> tuple[bool, float]:
    """Whether two roots s that share a part, of real columns, are no real numbers for certain, and
    a bound of |Im s|.

    At each d they are roots of (x - s) (y - s) = b c, whose entries are those of S and what the
    other columns do to them, at most `others`; for real s these are real.
    """
    rest = np.ones(len(discs.radii), dtype=bool)
    rest[part] = False
    room = discs.room[np.ix_(part, rest)].min(axis=0, initial=np.inf)
    to_rest = row_sums(discs.beside[np.ix_(part, rest)])
    from_rest = np.max(discs.beside[np.ix_(rest, part)] / room[:, None], axis=0, initial=0.0)
    others = upper(np.outer(to_rest, from_rest), 8)
    block = np.ix_(part, part)
    extra = upper(found.N[block] + others, 2)
    numbers = zip(found.S0[block].real.flat, found.L[block].real.flat, extra.flat, strict=True)
    interval = flint.arb(0, half)
    entries = []
    for value, slope, missed in numbers:
        entries.append(flint.arb_poly([flint.arb(float(value), float(missed)), float(slope)]))
    x, b, c, y = entries
    discriminant = ((x - y) * (x - y) + 4 * b * c)(interval)
    if discriminant > 0:
        return False, 0.0
    # S is real, so that |Im (x - s)| and |Im (y - s)| are |Im s| but for what the others do
    coupled = float((b(interval) * c(interval)).abs_upper())
    by_coupling = np.sqrt(coupled) + others.max()
    by_discriminant = (np.sqrt(float(discriminant.abs_upper())) + extra[0, 0] + extra[1, 1]) / 2.0
    height = min(by_coupling, by_discriminant) * (1.0 + 8.0 * EPS)
    return bool(discriminant < 0), float(height)


def _of_squares(count: int, low: float, high: float, never_real: bool, tall: float) -> list[Tally]:
    """What the roots +-sqrt(-s) do, of s of real parts from low to high and |Im s| <= tall.

    Their growth is sqrt((|s| - Re s) / 2); one of each two does not decay.
    """
    fastest = _growth(low, tall) * (1.0 + 8.0 * EPS)
    slowest = _growth(high, 0.0) * (1.0 - 8.0 * EPS)
    if fastest == 0.0:
        return [Tally(2 * count, 0.0, 0.0, "axis")]
    side: Side = "grows" if never_real or high < 0.0 else "unknown"
    return [Tally(count, slowest, fastest, side), Tally(count, -fastest, -slowest, "decays")]


def _growth(x: float, y: float) -> float:
    """sqrt((|s| - x) / 2) of s = x + i y, without cancellation."""
    length = float(np.hypot(x, y))
    if x <= 0.0:
        return float(np.sqrt((length - x) / 2.0))
    return float(y / np.sqrt(2.0 * (length + x)))
