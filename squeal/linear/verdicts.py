"""How flutter is decided.

A root grows if its real part is greater than its rounding; if its imaginary part is greater too it
is one of a pair (flutter), else real (divergence). That is `kinds`, of any roots. The fastest
growing one names the verdict (`decide`). Nothing grows: `marginal` if some root lies within its
rounding of the imaginary axis, else `stable`.

How far rounding moves a root is computed with it (`roots.root_rounding`). Where conditions are not
computed it is a share of |lambda| (`assumed_rounding`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import InputError
from squeal.linear.matrices import Array, Matrix, has_symmetry, normalised_system
from squeal.linear.roots import roots_of

Codes = NDArray[np.int8]
STABLE, MARGINAL, FLUTTER, DIVERGENCE = range(4)
VERDICTS = ("stable", "marginal", "flutter", "divergence")
"""In the order of their int8 codes: those from `FLUTTER` on grow."""
GROWING = ("flutter", "divergence")
ACCEPTED = 1e-6
"""The backward error up to which a root decides."""


def assumed_rounding(values: ArrayLike, undamped: bool = False) -> Array:
    """How far rounding may move roots (...) whose condition is unknown: a share of |lambda|.

    The share is greater without damping, where rounding separates two equal roots by its square
    root.
    """
    share = 1e-7 if undamped else 1e-10
    return share * np.abs(values)


def is_undamped(M: Matrix, C: Matrix | None, K: Matrix) -> bool:
    """Whether roots leave the imaginary axis in pairs: real matrices without damping, or symmetric
    ones with gyroscopic forces alone. Of terms `System.undamped` tells it."""
    if np.iscomplexobj(K):  # structural damping
        return False
    if C is None or not abs(C).max():
        return True
    if np.iscomplexobj(C):
        return False
    return has_symmetry(C, -1) and has_symmetry(M, 1) and has_symmetry(K, 1)


def kinds(values: ArrayLike, rounding: ArrayLike) -> Codes:
    """What each of the roots lambda (...) does, as an index into `VERDICTS`.

    rounding: how far rounding may move each, rad/s.
    """
    values = np.asarray(values)
    if_growing = np.where(np.abs(values.imag) > rounding, FLUTTER, DIVERGENCE)
    if_not = np.where(values.real >= -np.asarray(rounding), MARGINAL, STABLE)
    return np.where(values.real > rounding, if_growing, if_not).astype(np.int8)


@dataclass(frozen=True)
class Judgement:
    """A verdict, the largest real part and the rounding (rad/s) that it was held against."""

    verdict: str
    value: float
    tolerance: float

    def __str__(self) -> str:
        size = f"{self.value:.6g} (rounding {self.tolerance:.2g})"
        return f"{self.verdict}: largest Re lambda = {size}"


def decide(values: ArrayLike, rounding: ArrayLike) -> Judgement:
    """The verdict on one or more roots lambda (m,), rad/s.

    The fastest of the growing roots names it, and the result carries its real part; if none grows
    the result carries the largest real part. Of a conjugate pair the root with Im > 0 suffices.
    `rounding` (rad/s) is how far each root may lie from where it was computed. Raises InputError
    without roots.

    >>> decide([1j, 0.1 + 2j], 1e-9).verdict, decide([-0.1 + 1j, 1j], 1e-9).verdict
    ('flutter', 'marginal')
    """
    values = np.atleast_1d(np.asarray(values, dtype=complex))
    rounding = np.broadcast_to(rounding, values.shape)
    if not values.size:
        raise InputError("roots: there are none; at least one is required for a verdict")
    codes = kinds(values, rounding)
    grows = codes >= FLUTTER
    if grows.any():  # not always the largest real part: a larger one may lie within its rounding
        decisive = int(np.argmax(np.where(grows, values.real, -np.inf)))
        name = VERDICTS[codes[decisive]]
    else:
        decisive = int(np.argmax(values.real))
        name = "marginal" if np.any(codes == MARGINAL) else "stable"
    return Judgement(name, float(values[decisive].real), float(rounding[decisive]))


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
        if not self.growing_roots:
            return "quiet"
        return "flutter" if self.pairs and self.pair_rate >= self.real_rate else "divergence"

    @property
    def growing_roots(self) -> int:
        """Growing roots, two for a pair."""
        return 2 * self.pairs + self.reals


def judge(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> Judgement:
    """The verdict on M q'' + C q' + K q = 0, with the reason; matrices as `complex_eigenvalues`.

    Examples
    --------
    >>> judge([[1, 0], [0, 1]], None, [[2, -1], [0.25, 2]]).verdict
    'flutter'
    """
    roots = roots_of(normalised_system(M, C, K))
    return decide(roots.values, roots.rounding)


def verdict(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> str:
    """Verdict on M q'' + C q' + K q = 0 in one word, see `judge`."""
    return judge(M, C, K).verdict
