"""Results of simulations as read back from the files that `squeal simulate` writes."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from squeal.errors import InputError
from squeal.io.provenance import Provenance
from squeal.io.writing import column_name


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
    """The JSON summary of a simulated scene: what figures and tables take from it.

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

    @classmethod
    def read(cls, file: Path) -> Summary:
        """What `squeal simulate --json` printed.

        Raises InputError if it lacks what the scene's outputs must have asked for.
        """
        found = json.loads(file.read_text(encoding="utf-8"))
        for key in ("events", "shares", "extrema"):
            if key not in found:
                raise InputError(f"{file}: {key}: missing; the scene's outputs must name it")
        same = {key: found[key] for key in ("model", "shares", "method", "tolerance", "steps")}
        return cls(
            name=file.stem,
            stop=found["final"]["t"],
            events=tuple(Event(e["t"], e["from"], e["to"]) for e in found["events"]),
            extrema={key: ends and (ends[0], ends[1]) for key, ends in found["extrema"].items()},
            provenance=Provenance.from_dict(found["provenance"]),
            **same,
        )

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


def read_run(summary_file: Path, history_file: Path) -> Run:
    """Read the JSON summary and the CSV history of `squeal simulate`.

    Raises InputError if the summary lacks events, shares or extrema.
    """
    with history_file.open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    names = map(column_name, header)
    history = {
        name: np.array(column)
        if name == "state"
        else np.array([float(v) if v else np.nan for v in column])
        for name, column in zip(names, zip(*rows, strict=True), strict=True)
    }
    return Run(Summary.read(summary_file), history)
