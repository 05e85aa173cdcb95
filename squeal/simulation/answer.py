"""A motion as an answer: the columns of its history, its tables and its JSON object."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import Any

from squeal.errors import InputError
from squeal.io.answer import Answer, Column, Table, number
from squeal.io.scene_keys import COORDINATES, INITIAL
from squeal.io.writing import plain
from squeal.model.contact import contact_law

UNITS = {"t": "s"} | {name: INITIAL.keys[name].unit for name in COORDINATES}
UNKNOWN = "cannot be told"


class Motion(Answer):
    """What a simulation prints, saves and draws; `Simulation` holds the fields."""

    model: str
    final: tuple[float, ...]
    method: str
    tolerance: float
    steps: int
    contact_changes: int
    run_time: float
    events: Any
    shares: Mapping[str, float] | None
    extrema: Mapping[str, tuple[float, float] | None] | None
    response: Any
    history: Mapping[str, Any] | None
    sliding_holds: bool | None
    sliding_lost_at: float | None

    def table(self) -> Table:
        """A row for each sample of the history; forces over F_n, places over w.

        Raises InputError where the scene's outputs do not name it.
        """
        if self.history is None:
            raise InputError("history: missing; the scene's outputs must name it")
        units = UNITS | {signal.name: signal.over for signal in contact_law(self.model).plotted}
        names = list(self.history)
        told = [Column(name, units.get(name, ""), itemgetter(k)) for k, name in enumerate(names)]
        columns = (self.history[name].tolist() for name in names)
        return Table(told, list(zip(*columns, strict=True)))

    def parts(self) -> Sequence[str | Table]:
        """Final state, shares, extrema, response, contact changes, and whether sliding holds."""

        def pairs(title: str, head: str, rows: Sequence[tuple[str, str]]) -> Table:
            told = (Column(head, value=lambda row: row[0]), Column("", value=lambda row: row[1]))
            return Table(told, rows, title, f"{title}: none")

        named = zip(UNITS.items(), self.final, strict=True)
        found: list[str | Table] = [
            f"model {self.model}, {self.method}, tolerance {self.tolerance:g}: {self.steps} steps, "
            f"{self.contact_changes} contact changes",
            pairs(
                "final state", "at", [(name, f"{number(v, 9)} {unit}") for (name, unit), v in named]
            ),
        ]
        if self.shares is not None:
            shares = [(state, f"{100 * v:.3f} %") for state, v in self.shares.items()]
            found.append(pairs("share of time", "state", shares))
        if self.extrema is not None:
            spans = [
                (
                    f"{signal.name}/{signal.over}",
                    "none" if (ends := self.extrema[signal.name]) is None
                    else f"{number(ends[0])} to {number(ends[1])}",
                )
                for signal in contact_law(self.model).plotted
            ]  # fmt: skip
            found.append(pairs("extrema", "signal", spans))
        if self.response is not None:
            found.append(pairs("response", "", _response(self.response)))
        if self.events is not None:
            rows = [(f"{e.t:.9g} s", f"{e.source} -> {e.target}") for e in self.events]
            found.append(pairs("contact changes", "t", rows))
        if self.sliding_holds:
            found.append("sliding: the surface stays faster than the pad")
        elif self.sliding_holds is False:
            found.append(
                f"WARNING: the pad reaches the speed V of the surface at t = "
                f"{self.sliding_lost_at:.9g} s; the equations do not hold from there on"
            )
        return found

    def to_dict(self) -> dict[str, Any]:
        """The JSON object of `squeal simulate`: only what the scene asked for."""
        found: dict[str, Any] = {
            "model": self.model,
            "final": dict(zip(UNITS, self.final, strict=True)),
        }
        if self.events is not None:
            found["events"] = [{"t": e.t, "from": e.source, "to": e.target} for e in self.events]
        for name in ("shares", "extrema"):
            if getattr(self, name) is not None:
                found[name] = getattr(self, name)
        if self.response is not None:
            found["response"] = dataclasses.asdict(self.response)
        found["sliding_holds"] = self.sliding_holds
        if self.sliding_holds is False:
            found["sliding_lost_at"] = self.sliding_lost_at
        if self.history is not None:
            columns = self.history.items()
            found["history"] = {
                name: [plain(v) for v in values.tolist()] for name, values in columns
            }
        last = ("method", "tolerance", "steps", "contact_changes", "run_time")
        return found | {name: getattr(self, name) for name in last}


def _response(response: Any) -> list[tuple[str, str]]:
    """Name and value of all that a response tells."""
    size = response.amplitude and ", ".join(
        f"{name} {number(value)} {UNITS[name]}" for name, value in response.amplitude.items()
    )
    frequency, growth = response.frequency_hz, response.growth_rate
    grows = UNKNOWN
    if growth is not None:
        grows = f"{number(growth)} 1/s at {number(response.growth_frequency_hz or 0.0)} Hz"
    return [
        ("dominant frequency", UNKNOWN if frequency is None else f"{number(frequency)} Hz"),
        ("amplitude", size or UNKNOWN),
        ("growth at the start", grows),
        ("settled", {True: "yes", False: "no", None: UNKNOWN}[response.settled]),
    ]
