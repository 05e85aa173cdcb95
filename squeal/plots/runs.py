"""What the figures of a motion show: one simulated scene, its summary and its sampled history."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from squeal.io.provenance import Provenance


class Interval(NamedTuple):
    """A stretch of time (s) spent in one contact state."""

    start: float
    stop: float
    state: str


class Event(NamedTuple):
    """A change of contact state at the time t (s)."""

    t: float
    source: str
    target: str


@dataclass(frozen=True)
class Summary:
    """What figures and tables take from the summary of a simulated scene.

    name: of the file; stop: end of the run (s); shares of time by state; extrema [min, max] by
    signal, forces over F_n and delta over w, None without contact.
    """

    name: str
    model: str
    stop: float
    events: tuple[Event, ...]
    shares: dict[str, float]
    extrema: dict[str, tuple[float, float] | None]
    method: str
    tolerance: float
    steps: int
    provenance: Provenance

    @property
    def scene(self) -> str:
        """Name of the scene's file."""
        return self.provenance.inputs[0].name

    @cached_property
    def timeline(self) -> list[Interval]:
        """Contact states in order, with the located times of their changes."""
        if not self.events:
            (only,) = (s for s, share in self.shares.items() if share > 0.0)
            return [Interval(0.0, self.stop, only)]
        times = [0.0, *(event.t for event in self.events), self.stop]
        states = [self.events[0].source, *(event.target for event in self.events)]
        return [Interval(a, b, s) for a, b, s in zip(times[:-1], times[1:], states, strict=True)]

    @cached_property
    def states_met(self) -> list[str]:
        """Names of the states in which any time was spent, in the article's order."""
        met = {i.state for i in self.timeline if i.stop > i.start}
        return [name for name in self.shares if name in met]


@dataclass(frozen=True)
class Run:
    """One simulated scene: its summary and the sampled history.

    `history` maps column names to arrays of equal length; quantities are in SI units, forces over
    F_n, delta over w (NaN where there is no contact), `state` holds state names.
    """

    summary: Summary
    history: dict[str, np.ndarray] = field(repr=False)
