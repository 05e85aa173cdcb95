"""The growing modes of a system, each with the parameter value at which it began to grow."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from squeal.linear.crossing import Crossing
from squeal.linear.eigen import Eigenvalue, complex_eigenvalues
from squeal.linear.system import System, check_system, matrices_at

AT_ONCE = 1e-9  # of the range: what begins to grow here grows from its start on
STEPS = 8  # in which several growing modes are followed from one crossing to the next


@dataclass(frozen=True)
class UnstableMode:
    """A mode that grows: a pair of eigenvalues (flutter) or a real one (divergence).

    damping_ratio is negative; onset is the parameter value at which this mode began to grow, None
    where it is not known or the mode grows from the start of the range on.
    """

    kind: str
    frequency_hz: float
    growth_rate: float  # 1/s
    damping_ratio: float
    onset: float | None = None

    @classmethod
    def of(cls, e: Eigenvalue, kind: str, onset: float | None = None) -> Self:
        """The mode of an eigenvalue that grows."""
        return cls(kind, e.frequency_hz, e.growth_rate, e.damping_ratio, onset)

    def __str__(self) -> str:
        at = "" if self.onset is None else f", from {self.onset:.6g} on"
        return (
            f"{self.kind} at {self.frequency_hz:.6g} Hz growing at {self.growth_rate:.4g} 1/s{at}"
        )


def growing_eigenvalues(system: System, mu: float) -> list[Eigenvalue]:
    """What grows at mu by more than rounding, as the verdict counts it; of a pair Im > 0.

    Sorted by falling growth rate.
    """
    return list(complex_eigenvalues(*matrices_at(system, mu)).unstable)


def unstable_modes(
    system: System, mu: float, crossings: Sequence[Crossing] | None = None
) -> tuple[UnstableMode, ...]:
    """All modes of system(mu) -> (M, C, K) that grow at mu, the fastest first.

    `crossings` are those of the range from 0 to mu, from which the onsets follow; without them
    the onsets are None. Raises InputError.
    """
    check_system(system, "unstable_modes")
    grow = growing_eigenvalues(system, mu)
    onsets: Sequence[float | None] = [None] * len(grow)
    if crossings is not None and grow:
        onsets = _onsets(system, mu, crossings)
    return tuple(
        UnstableMode.of(e, "flutter" if e.value.imag else "divergence", onset)
        for e, onset in zip(grow, onsets, strict=True)
    )


def _onsets(system: System, mu: float, crossings: Sequence[Crossing]) -> list[float | None]:
    """The onset of what grows at mu, carried along from crossing to crossing."""
    below = [c for c in crossings if 0.0 <= c.mu < mu]
    starts = [c.mu for c in below if c.direction == "up" and c.mu > AT_ONCE * mu]
    stops = sorted({0.0, mu, *(c.mu for c in below)})
    onsets: list[float | None] = []
    before: list[Eigenvalue] = []
    for low, high in itertools.pairwise(stops):
        margin = 1e-6 * (high - low)
        fresh = low if low in starts else None
        several = len(onsets) + sum(at == low for at in starts) > 1
        inner = np.linspace(low + margin, high - margin, STEPS if several else 2)
        for at in (*inner.tolist(), *([mu] if high == mu else [])):
            now = growing_eigenvalues(system, at)
            onsets = _matched(_unlike(system, at, before, now), onsets, fresh)
            before, fresh = now, None
    return onsets


def _unlike(
    system: System, mu: float, before: Sequence[Eigenvalue], now: Sequence[Eigenvalue]
) -> np.ndarray:
    """How much eigenvalues and shapes differ, (len(before), len(now)): 0 for the same mode."""
    if not before or not now:
        return np.zeros((len(before), len(now)))
    M = np.asarray(system(mu)[0], dtype=float)
    first, second = (np.array([e.right for e in modes]) for modes in (before, now))
    values = np.array([e.value for e in before])[:, None] - np.array([e.value for e in now])
    likeness = np.abs(first.conj() @ M @ second.T) ** 2
    return np.asarray(np.abs(values) / max(abs(e.value) for e in now) - likeness)


def _matched(
    unlike: np.ndarray, onsets: Sequence[float | None], fresh: float | None
) -> list[float | None]:
    """Onsets of the modes now: each of the one most like it before, or `fresh`.

    What is new where nothing crossed has parted from the one most like it (a real root from a
    pair) and began with it.
    """
    m, n = unlike.shape
    taken: dict[int, int] = {}
    for k in np.argsort(unlike, axis=None):
        i, j = divmod(int(k), n)
        if j not in taken and i not in taken.values():
            taken[j] = i
    if fresh is None and m:
        taken = {j: int(np.argmin(unlike[:, j])) for j in range(n) if j not in taken} | taken
    return [onsets[taken[j]] if j in taken else fresh for j in range(n)]
