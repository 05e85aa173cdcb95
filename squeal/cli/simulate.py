"""`squeal simulate`: integrate a B1 or B2 scene through its contact changes."""

import argparse
import dataclasses
import sys
from typing import Any

from squeal.cli.base import Answer, Parser
from squeal.cli.motion import UNITS, asked, task_of, write_files
from squeal.cli.outputs import file_options
from squeal.cli.streams import say
from squeal.cli.tables import number, table
from squeal.io.scene import Scene
from squeal.io.scene_keys import COORDINATES
from squeal.io.writing import plain
from squeal.model.contact import contact_law
from squeal.simulation import Simulation, simulate
from squeal.simulation.response import Response

SHOWN_EVENTS = 20


def options(parser: Parser) -> None:
    """Options of `squeal simulate`."""
    file_options(
        parser,
        table="write the history to FILE",
        figure="draw forces, place of the reaction, contact states and spectrum into FILE",
        sound="write one second of the pad's normal velocity to FILE",
    )
    parser.add_argument(
        "--integrator",
        choices=("auto", "heyoka", "scipy"),
        default="auto",
        help="auto takes heyoka where it is installed, else SciPy",
    )


def data(scene: Scene, result: Simulation) -> dict[str, Any]:
    """The JSON object of a simulation: only what the scene asked for."""
    events, response = result.events, result.response
    wanted: dict[str, Any] = {
        "events": events and [{"t": e.t, "from": e.source, "to": e.target} for e in events],
        "shares": result.shares,
        "extrema": result.extrema,
        "response": response and dataclasses.asdict(response),
    }
    found = {
        "model": result.model,
        "final": dict(zip(("t", *COORDINATES), result.final, strict=True)),
        **{name: value for name, value in wanted.items() if value is not None},
        "sliding_holds": result.sliding_holds,
    }
    if result.sliding_holds is False:
        found["sliding_lost_at"] = result.sliding_lost_at
    if result.history is not None and scene.wants("history"):
        columns = result.history.items()
        found["history"] = {name: [plain(v) for v in values.tolist()] for name, values in columns}
    last = ("method", "tolerance", "steps", "contact_changes", "run_time")
    return found | {name: getattr(result, name) for name in last}


def text(scene: Scene, result: Simulation) -> str:
    """The same for people."""
    final = zip(UNITS.items(), result.final, strict=True)
    tables: dict[str, list[tuple[str, ...]]] = {
        "final state": [(f"  {name}", number(v, 9), unit) for (name, unit), v in final]
    }
    if result.shares is not None:
        tables["share of time"] = [(f"  {s}", f"{100 * v:.3f} %") for s, v in result.shares.items()]
    if result.extrema is not None:
        tables["extrema"] = [
            (f"  {signal.name}/{signal.over}", *_range(result.extrema[signal.name]))
            for signal in contact_law(result.model).plotted
        ]
    parts = [
        f"model {result.model}, {result.method}, tolerance {result.tolerance:g}: "
        f"{result.steps} steps, {result.contact_changes} contact changes",
        *(f"{title}\n{table(rows)}" for title, rows in tables.items()),
    ]
    if result.response is not None:
        parts.append("response\n" + table(response_rows(result.response), right=False))
    if result.events is not None:
        rows = [(f"  {e.t:.9g} s", f"{e.source} -> {e.target}") for e in result.events]
        left = len(rows) - SHOWN_EVENTS
        shown = f"\n{table(rows[:SHOWN_EVENTS])}" if rows else ": none"
        more = f"\n  and {left} more (all with --json)" if left > 0 else ""
        parts.append(f"contact changes{shown}{more}")
    if result.sliding_holds is not None:
        parts.append(
            "sliding: the surface stays faster than the pad"
            if result.sliding_holds
            else f"WARNING: the pad reaches the speed V of the surface at t = "
            f"{result.sliding_lost_at:.9g} s; the equations do not hold from there on"
        )
    return "\n\n".join(parts)


def response_rows(response: Response) -> list[tuple[str, str]]:
    """Name and value of all that a response tells."""
    unknown = "cannot be told"
    size = response.amplitude and ", ".join(
        f"{name} {number(value)} {UNITS[name]}" for name, value in response.amplitude.items()
    )
    frequency, growth = response.frequency_hz, response.growth_rate
    grows = unknown
    if growth is not None:
        grows = f"{number(growth)} 1/s at {number(response.growth_frequency_hz or 0.0)} Hz"
    settled = {True: "yes", False: "no", None: unknown}[response.settled]
    return [
        ("  dominant frequency", unknown if frequency is None else f"{number(frequency)} Hz"),
        ("  amplitude", size or unknown),
        ("  growth at the start", grows),
        ("  settled", settled),
    ]


def _range(limits: tuple[float, float] | None) -> tuple[str, str]:
    return ("none", "none") if limits is None else (number(limits[0]), number(limits[1]))


def run(given: argparse.Namespace) -> Answer:
    """Read the scene, simulate it, write the files that are asked for."""
    scene = given.source.scene("simulate")
    task, every = task_of(given, scene)
    progress = _progress if sys.stderr.isatty() else None
    whole = simulate(task, given.integrator, progress)
    files = write_files(given, scene, whole, every)
    result = asked(scene, whole, every)
    return Answer(
        lambda: data(scene, result) | files,
        lambda: "\n\n".join([text(scene, result), *map(sound_text, files.values())]),
        warnings=_start_warnings(scene),
    )


def sound_text(sound: dict[str, Any]) -> str:
    """What the sound's file holds."""
    return (
        f"sound: {sound['signal']} from {number(sound['start'])} s for "
        f"{number(sound['duration'])} s at {sound['rate_hz']} samples a second, full scale "
        f"{number(sound['full_scale'])} m/s"
    )


def _start_warnings(scene: Scene) -> tuple[str, ...] | None:
    """What speaks against the equilibrium that the motion starts from; None without one."""
    if scene.start != "equilibrium":
        return None
    from squeal.equilibrium import sliding_equilibrium  # a motion from elsewhere needs none

    found, _ = sliding_equilibrium(scene.pad_model)
    return () if found is None else found.warnings


def _progress(share: float) -> None:
    say(f"\r{100 * share:3.0f} %", end="" if share < 1 else "\n")
