"""Results of simulations as read back from the files that `squeal simulate` writes."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from squeal.errors import InputError
from squeal.files.provenance import Provenance


class Interval(NamedTuple):
    """A stretch of time (s) spent in one contact state."""

    start: float
    stop: float
    state: str


@dataclass(frozen=True)
class Run:
    """One simulated scene: the JSON summary (with events and shares) and the sampled history.

    `history` maps column names to arrays of equal length; quantities are in SI units, forces over
    F_n, delta over w (NaN where there is no contact), `state` holds state names.
    """

    name: str
    summary: dict[str, Any]
    history: dict[str, np.ndarray] = field(repr=False)

    @property
    def model(self) -> str:
        """B1 or B2."""
        return str(self.summary["model"])

    @property
    def stop(self) -> float:
        """Time (s) at which the run ends."""
        return float(self.summary["final"]["t"])

    @property
    def provenance(self) -> Provenance:
        """What made the run."""
        return Provenance.from_dict(self.summary["provenance"])

    @cached_property
    def timeline(self) -> list[Interval]:
        """Contact states in order, with the located times of their changes."""
        events = self.summary["events"]
        if not events:
            (only,) = (s for s, share in self.summary["shares"].items() if share > 0.0)
            return [Interval(0.0, self.stop, only)]
        times = [0.0, *(e["t"] for e in events), self.stop]
        states = [events[0]["from"], *(e["to"] for e in events)]
        return [Interval(a, b, s) for a, b, s in zip(times[:-1], times[1:], states, strict=True)]

    @cached_property
    def states_met(self) -> list[str]:
        """Names of the states in which any time was spent, in the article's order."""
        met = {i.state for i in self.timeline if i.stop > i.start}
        return [name for name in self.summary["shares"] if name in met]


def read_run(stem: str | Path) -> Run:
    """Read STEM.json and STEM.csv. Raises InputError if the summary lacks events or shares."""
    stem = Path(stem)
    summary_file, history_file = Path(f"{stem}.json"), Path(f"{stem}.csv")
    summary = json.loads(summary_file.read_text(encoding="utf-8"))
    for key in ("events", "shares", "extrema"):
        if key not in summary:
            raise InputError(f"{summary_file}: {key}: missing; the scene's outputs must name it")
    summary.pop("history", None)
    with history_file.open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    history = {
        name: np.array(column)
        if name == "state"
        else np.array([float(v) if v else np.nan for v in column])
        for name, column in zip(header, zip(*rows, strict=True), strict=True)
    }
    return Run(stem.name, summary, history)
