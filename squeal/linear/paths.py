"""Which mode is which along a parameter: modes of a sweep, and where each one began to grow.

Both are read off the eigenvalue paths of the continuation, on which slopes tell from one value to
the next which root is which.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from squeal.linear.continuation import (
    Continuation,
    ContinuationOptions,
    State,
    Step,
    pairwise_steps,
)
from squeal.linear.eigen import ComplexArray, Eigenvalue, complex_eigenvalues, ordered
from squeal.linear.matrices import Array
from squeal.linear.search import grows
from squeal.linear.system import System, check_system, matrices_at, values_of
from squeal.linear.thresholds import Thresholds


@dataclass(frozen=True, eq=False)
class TrackedModes:
    """Modes over a sweep: column k of `values` is one and the same mode throughout."""

    mus: Array = field(repr=False)  # (n_mu,)
    values: ComplexArray = field(repr=False)  # (n_mu, 2n) rad/s

    @property
    def frequencies_hz(self) -> Array:
        """|Im| / (2 pi), shape (n_mu, 2n)."""
        return np.asarray(np.abs(self.values.imag) / (2 * np.pi))


def track(system: System, mus: Iterable[float], halvings: int = 7) -> TrackedModes:
    """Modes of system(mu) -> (M, C, K) along the values `mus`, in the order they are given.

    Eigenvalues at neighbouring values are matched by where their slopes at both point; what is in
    doubt halves the step, up to `halvings` times. Modes that cross go on as they are, modes that
    veer keep their branch if the steps are no longer than the veering.

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
    check_system(system, "track")
    steps = values_of("track", mus)
    low, high = min(steps), max(steps)
    high = high if high > low else low + 1e-6 * max(abs(low), 1.0)
    along = Continuation(system, low, high, ContinuationOptions(depth=halvings))
    rows = [along.exponents(along.at(steps[0]).roots)]
    here = np.arange(len(rows[0]))  # index of each mode
    upper, wanted = rows[0], iter(steps[1:])
    goal = next(wanted, None)
    for step in pairwise_steps(along, steps):
        here = step.order[here]
        exponents = along.exponents(step.b.roots)[here]
        if along.form == "undamped":  # of both square roots that which goes on
            exponents = np.where(
                np.abs(exponents - upper) <= np.abs(exponents + upper), exponents, -exponents
            )
        upper = exponents
        if step.b.value == goal:
            rows.append(upper)
            goal = next(wanted, None)
    values = np.array(rows)
    if along.form == "undamped":
        values = np.hstack([values, -values])
    free = 2 * len(np.asarray(matrices_at(system, steps[0])[0])) - values.shape[1]
    values = np.hstack([values, np.zeros((len(values), free))])
    return TrackedModes(np.array(steps), values[:, ordered(values[0])])


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


def unstable_modes(
    system: System, mu: float, found: Thresholds | None = None
) -> tuple[UnstableMode, ...]:
    """All modes of system(mu) -> (M, C, K) that grow at mu, the fastest first.

    `found` are the thresholds of the range from 0 to mu, on whose eigenvalue paths the onsets are
    read; without them the onsets are None. Raises InputError.
    """
    check_system(system, "unstable_modes")
    grow = complex_eigenvalues(*matrices_at(system, mu)).unstable
    ends = list(_onsets(found, mu)) if found is not None and grow else []
    modes = []
    for e in grow:
        nearest = min(ends, key=lambda end: abs(end[0] - e.value), default=(0j, None))
        modes.append(UnstableMode.of(e, "flutter" if e.value.imag else "divergence", nearest[1]))
    return tuple(modes)


def _onsets(result: Thresholds, mu: float) -> Iterator[tuple[complex, float | None]]:
    """Each eigenvalue that grows at mu, with Im >= 0, and where it began to."""
    low = result.searched[0].line.low
    began = [c for c in result.crossings if c.direction == "up"]
    z, grew, onset = np.zeros(0, dtype=complex), np.zeros(0, dtype=bool), np.zeros(0)
    before: tuple[Continuation, State] | None = None
    for line, state in _looked_at(result, mu):
        old, z, now = z, line.exponents(state.roots), grows(state)
        if before is None:
            grew, onset = now, np.full(len(now), np.nan)
        else:
            if before[0] is line:
                back = np.argsort(Step.of(before[1], state, line.options).order)
            else:  # beyond a jump
                back = np.argmin(np.abs(z[:, None] - old), axis=1)
            grew, onset = grew[back], onset[back]
            fresh = [c for c in began if before[1].value < c.mu <= state.value]
            for k in np.flatnonzero(now & ~grew):
                hertz = line.omega(complex(state.roots[k])) / (2 * np.pi)
                own = min(fresh, key=lambda c: abs(c.frequency_hz - hertz), default=None)
                at_once = own is None or own.mu - low <= line.options.same * (mu - low)
                onset[k] = np.nan if own is None or at_once else own.mu
        grew, before = now, (line, state)
    for k in np.flatnonzero(grew):
        yield complex(z[k].real, abs(z[k].imag)), None if np.isnan(onset[k]) else float(onset[k])


def _looked_at(result: Thresholds, mu: float) -> Iterator[tuple[Continuation, State]]:
    """The states up to mu, without those next to a crossing, and that at mu."""
    margin = 1e-6 * (mu - result.searched[0].line.low)  # rounding may hide what grows there
    for part in result.searched:
        line = part.line
        for p in [s.value for s in line.states if line.low <= s.value < min(mu, line.high)]:
            if all(
                abs(p - c.mu) > margin + c.interval[1] - c.interval[0] for c in result.crossings
            ):
                yield line, line.at(p)
        if line.low < mu <= line.high:
            yield line, line.at(mu)
