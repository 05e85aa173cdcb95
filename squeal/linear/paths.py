"""Which mode is which along a parameter: modes of a sweep, and where each one began to grow.

Both are read off the eigenvalue paths of the continuation, on which slopes tell from one value to
the next which root is which.
"""

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from squeal.linear.continuation import Continuation, Step
from squeal.linear.eigen import (
    ACCEPTED,
    FLUTTER,
    GROWING,
    ComplexArray,
    Eigenvalue,
    complex_eigenvalues,
    ordered,
)
from squeal.linear.matrices import Array
from squeal.linear.system import System, finite_numbers, matrices_at
from squeal.linear.thresholds import Thresholds


@dataclass(frozen=True, eq=False)
class TrackedModes:
    """Modes over a sweep: column k of `values` is one and the same mode throughout."""

    mus: Array = field(repr=False)  # (n_mu,)
    values: ComplexArray = field(repr=False)  # (n_mu, 2n) rad/s


def track(system: System, mus: Iterable[float]) -> TrackedModes:
    """Modes of system(mu) -> (M, C, K) along the values `mus`, in the order they are given.

    Eigenvalues at neighbouring values are matched by where their slopes at both point; what is in
    doubt halves the step. Modes that cross go on as they are, modes that veer keep their branch.

    Raises
    ------
    InputError
        For what is no sequence of numbers, for a singular M, and what `system` does.

    Examples
    --------
    >>> modes = track(lambda p: (np.eye(2), None, np.diag([1 + p, 3 - p])), [0.0, 0.9, 2.0])
    >>> (modes.values.imag[:, ::2] ** 2).round(6).tolist()
    [[1.0, 3.0], [1.9, 2.1], [3.0, 1.0]]
    """
    values = finite_numbers("track: mus", mus)
    low, high = min(values), max(values)
    high = high if high > low else low + 1e-6 * max(abs(low), 1.0)
    along = Continuation(system, low, high)
    along.prepare(values)
    rows = [along.at(values[0]).exponents]
    here = np.arange(len(rows[0]))  # index of each mode
    for a, b in itertools.pairwise(values):
        now = rows[-1]
        for step in _halved(along, a, b, 7):
            here = step.order[here]
            before, now = now, step.b.exponents[here]
            if along.form == "undamped":  # of both square roots that which goes on
                now = np.where(np.abs(now - before) <= np.abs(now + before), now, -now)
        rows.append(now)
    modes = np.array(rows)
    if along.form == "undamped":
        modes = np.hstack([modes, -modes])
    free = 2 * np.shape(matrices_at(system, values[0])[0])[0] - modes.shape[1]
    modes = np.hstack([modes, np.zeros((len(modes), free))])
    return TrackedModes(np.array(values), modes[:, ordered(modes[0])])


def _halved(along: Continuation, a: float, b: float, depth: int) -> Iterator[Step]:
    """Steps from a to b, halved until every root is matched, alone or in a pair."""
    step = Step(along.at(a), along.at(b), along.options)
    middle, doubtful = (a + b) / 2, np.flatnonzero(~step.matched).tolist()
    paired = 2 * len(list(step.pairs(doubtful)))
    if paired == len(doubtful) or not depth or middle in (a, b):
        yield step
    else:
        yield from _halved(along, a, middle, depth - 1)
        yield from _halved(along, middle, b, depth - 1)


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

    def __str__(self) -> str:
        at = "" if self.onset is None else f", from {self.onset:.6g} on"
        return (
            f"{self.kind} at {self.frequency_hz:.6g} Hz growing at {self.growth_rate:.4g} 1/s{at}"
        )


def growing(values: Iterable[Eigenvalue]) -> tuple[UnstableMode, ...]:
    """What grows by more than rounding and is accepted, the fastest first; of pairs the upper."""
    upper = (e for e in values if e.value.imag >= -e.rounding and e.residual <= ACCEPTED)
    each = sorted((e for e in upper if e.kind in GROWING), key=lambda e: -e.growth_rate)
    return tuple(UnstableMode(e.kind, e.frequency_hz, e.growth_rate, e.damping_ratio) for e in each)


def unstable_modes(
    system: System, mu: float, found: Thresholds | None = None
) -> tuple[UnstableMode, ...]:
    """All modes of system(mu) -> (M, C, K) that grow at mu, the fastest first.

    `found` are the thresholds of the range from 0 to mu, on whose eigenvalue paths the onsets are
    read; without them the onsets are None. Raises InputError.
    """
    modes = growing(complex_eigenvalues(*matrices_at(system, mu)).eigenvalues)
    ends = list(_onsets(found, mu)) if found is not None and modes else [(0j, None)]

    def onset(mode: UnstableMode) -> float | None:
        value = complex(mode.growth_rate, 2 * np.pi * mode.frequency_hz)
        return min(ends, key=lambda end: abs(end[0] - value))[1]

    return tuple(replace(mode, onset=onset(mode)) for mode in modes)


def _onsets(result: Thresholds, mu: float) -> Iterator[tuple[complex, float | None]]:
    """Each eigenvalue that grows at mu, with Im >= 0, and where it began to."""
    low, began = result.searched[0].line.low, [c for c in result.crossings if c.direction == "up"]
    margin = 1e-6 * (mu - low)  # next to a crossing rounding may hide what grows
    taken = [(c.interval[0] - margin, c.interval[1] + margin) for c in result.crossings]
    lines = [part.line for part in result.searched]
    known = [
        (line, state)
        for line in lines
        for state in line.states
        if line.low <= state.value <= line.high
        and (state.value == mu or not any(a <= state.value <= b for a, b in taken))
    ]
    last = lines[-1].at(mu)
    for own in np.flatnonzero(last.kinds >= FLUTTER).tolist():
        k, onset, end = own, None, last.exponents[own]
        for (line, before), (other, after) in reversed(list(itertools.pairwise(known))):
            hertz = after.omegas[k] / (2 * np.pi)
            if line is other:
                k = int(np.argsort(Step(before, after, line.options).order)[k])
            else:  # beyond a jump
                k = int(np.argmin(np.abs(before.exponents - after.exponents[k])))
            if before.kinds[k] < FLUTTER:
                fresh = [c for c in began if before.value < c.mu <= after.value]
                fresh = sorted(fresh, key=lambda c: abs(c.frequency_hz - hertz))[:1]
                onset = next((c.mu for c in fresh if c.mu - low > 1e-9 * (mu - low)), None)
                break
        yield complex(end.real, abs(end.imag)), onset
