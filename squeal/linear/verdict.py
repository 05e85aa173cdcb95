"""The verdict on a system: stable, marginal, flutter or divergence, and how it was reached.

How is flutter decided? Every eigenvalue comes with the distance that rounding may move it
(`eigen.root_rounding`). A root grows if its real part is greater than this distance; a growing root
whose imaginary part is greater too is one of a pair (flutter), else it is real (divergence). The
fastest growing one names the verdict. Nothing grows: `marginal` if some root lies within the
distance from the imaginary axis, `stable` if none does. That is `decide`, of any roots.

At a flutter boundary two roots coalesce, and computed real parts are noise of the size of the
square root of the machine precision. Up to three rows without damping the roots therefore follow
the signs of the discriminant and of the coefficients of the polynomial in lambda^2, each against a
bound of its own rounding (`invariants`). Maps take these signs themselves, for whole arrays.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.linear import invariants
from squeal.linear.eigen import ComplexArray, roots_of
from squeal.linear.invariants import DIVERGENCE, FLUTTER, STABLE, UNDECIDED, VERDICTS
from squeal.linear.matrices import EPS, Array, Reduced, first_order, reduce

GROWING = ("flutter", "divergence")
UNKNOWN = "unknown"
"""The verdict where some root is too uncertain and none of the others grows."""
ACCEPTED = 1e-6  # backward error up to which a root decides


@dataclass(frozen=True)
class Judgement:
    """A verdict with the number that decided it and the tolerance that number was held against."""

    verdict: str
    criterion: str
    value: float
    tolerance: float

    def __str__(self) -> str:
        size = f"{self.value:.6g} (rounding {self.tolerance:.2g})"
        return f"{self.verdict}: {self.criterion} = {size}"


@dataclass(frozen=True)
class UnstableCount:
    """How many pairs and how many real roots grow, and the fastest rate of each (1/s)."""

    pairs: int
    reals: int
    pair_rate: float
    real_rate: float

    @property
    def verdict(self) -> str:
        """flutter or divergence, whichever grows faster, or quiet."""
        if not self.pairs and not self.reals:
            return "quiet"
        return "flutter" if self.pairs and self.pair_rate >= self.real_rate else "divergence"

    @property
    def numbers(self) -> tuple[int, int]:
        """Growing pairs and growing real roots."""
        return self.pairs, self.reals

    @property
    def roots(self) -> int:
        """Growing roots, two for a pair."""
        return 2 * self.pairs + self.reals


def decide(values: ArrayLike, rounding: ArrayLike, residuals: ArrayLike = 0.0) -> Judgement:
    """The verdict on roots lambda (m,), rad/s, of a pair at least that with Im > 0.

    `rounding` (rad/s) is how far each may lie from where it was computed. One whose backward error,
    of `residuals`, is above `ACCEPTED` decides nothing; the verdict is `UNKNOWN` if no other grows.

    >>> decide([1j, 0.1 + 2j], 1e-9).verdict, decide([-0.1 + 1j, 0.5], 1e-9, [0.0, 0.5]).verdict
    ('flutter', 'unknown')
    """
    values = np.atleast_1d(np.asarray(values, dtype=complex))
    rounding = np.broadcast_to(rounding, values.shape)
    sure = np.broadcast_to(residuals, values.shape) <= ACCEPTED
    excess = np.where(sure & (values.real > rounding), values.real, -np.inf)
    k = int(np.argmax(excess))
    if excess[k] > 0.0:
        name = "flutter" if abs(values[k].imag) > rounding[k] else "divergence"
    else:
        name = "marginal" if np.any(np.abs(values.real) <= rounding) else "stable"
        name = name if sure.all() else UNKNOWN
        k = int(np.argmax(values.real))
    return Judgement(name, "largest Re lambda", float(values[k].real), float(rounding[k]))


def unstable_count(values: ComplexArray, rounding: float | Array) -> UnstableCount:
    """How many of the roots (m,) of a system, both of each pair, grow; as `decide` does."""
    grows, oscillates = values.real > rounding, np.abs(values.imag) > rounding
    both = grows & oscillates & (values.imag > 0), grows & ~oscillates
    pairs, reals = (int(np.sum(some)) for some in both)
    return UnstableCount(
        pairs, reals, *(float(np.max(values.real[some], initial=0.0)) for some in both)
    )


def judge(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> Judgement:
    """The verdict on M q'' + C q' + K q = 0, with the reason.

    Parameters
    ----------
    M, C, K : array (n, n)
        M symmetric and positive definite; C None without damping.

    Raises
    ------
    InputError
        For matrices that make no system.

    Examples
    --------
    >>> judge([[1, 0], [0, 1]], None, [[2, -1], [0.25, 2]]).verdict
    'flutter'
    """
    return judge_reduced(reduce(M, C, K))


def verdict(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> str:
    """Verdict on M q'' + C q' + K q = 0 in one word, see `judge`."""
    return judge(M, C, K).verdict


def judge_reduced(reduced: Reduced) -> Judgement:
    """As `judge`, for a system in mass-normalised coordinates."""
    roots = roots_of(reduced)
    return decide(roots.values, roots.rounding)


def _code(A: Array, B: Array | None, rounding: float) -> int:
    return VERDICTS.index(judge_reduced(Reduced(A, B, np.eye(len(A)), rounding)).verdict)


def damped_verdicts(A: Array, B: Array, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (N,), indices into VERDICTS, of z'' + B z' + A z = 0; A, B of (N, n, n).

    The coordinates are mass-normalised and no B is zero throughout. The codes are those of
    `judge`: its tolerances are bounded from above for all systems together, and only those with an
    eigenvalue within this bound of an axis are judged one by one.
    """
    matrices, _ = first_order(A, B)
    values = np.linalg.eigvals(matrices)
    error, norm = 2 * matrices.shape[-1] * rounding, np.linalg.norm(matrices, axis=(-2, -1))
    apart = np.abs(values[:, :, None] - values[:, None, :]) / norm[:, None, None]
    cluster = np.maximum(2, np.sum(apart <= 4 * error ** (1 / 3), axis=-1))
    bound = norm[:, None] * error ** (1 / cluster)
    grows = np.take_along_axis(values, values.real.argmax(axis=-1)[:, None], axis=-1)[:, 0]
    codes = np.where(grows.imag != 0.0, FLUTTER, DIVERGENCE).astype(np.int8)
    codes[grows.real < 0.0] = STABLE
    doubtful = np.abs(values.real) <= bound
    doubtful |= (values.real > 0.0) & (values.imag != 0.0) & (np.abs(values.imag) <= bound)
    for k in np.flatnonzero(doubtful.any(axis=-1)):
        codes[k] = _code(A[k], B[k], rounding)
    return codes


def undamped_verdicts(A: Array, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (...), indices into VERDICTS, of undamped systems A = M^-1 K (..., 3, 3)."""
    codes = invariants.undamped_verdicts(A, rounding)
    for at in map(tuple, np.argwhere(codes == UNDECIDED)):
        codes[at] = _code(A[at], None, rounding)
    return codes


def sum_verdicts(Q: NDArray, u: NDArray, rounding: float = 4 * EPS) -> NDArray[np.int8]:
    """Verdict codes (n1, n2), indices into VERDICTS, of A = Q[:, :, k] + u[:, i] u[:, i]'.

    Q (3, 3, n2) and u (3, n1) are in coordinates with a mass matrix of one.
    """
    codes = invariants.sum_verdicts(Q, u, rounding)
    for i, k in np.argwhere(codes == UNDECIDED):
        codes[i, k] = _code(Q[:, :, k] + np.outer(u[:, i], u[:, i]), None, rounding)
    return codes
