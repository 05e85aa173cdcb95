"""`squeal critical-friction`: every flutter and divergence threshold in 0 < mu <= --mu-max, along
the branch from mu = 0."""

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from squeal.analysis.subject import upper_end_of
from squeal.analysis.thresholds import CriticalFriction, critical_friction, critical_parameter
from squeal.cli.base import Answer, Parser
from squeal.cli.numbers import numbers
from squeal.cli.outputs import file_options, option_of
from squeal.cli.plain import refuse_sensitivity
from squeal.cli.sensitivity import threshold_moves, threshold_moves_text
from squeal.cli.sweep import draw
from squeal.cli.system_options import band_option, refuse_options, system_of, work_options
from squeal.cli.tables import elided, in_words, number
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.io.writing import write_table


def upper_option(parser: Parser, what: str) -> None:
    """The option --mu-max, the upper end of something."""
    words = f"upper end {what} (2 if left out)"
    parser.add_argument("--mu-max", "--max", metavar="MU", default="2", help=words)


def options(parser: Parser) -> None:
    """Options of `squeal critical-friction`."""
    upper_option(parser, "of the range of mu, or of a system's parameter")
    parser.add_argument(
        "--min", metavar="VALUE", help="systems only: lower end of the range (0 if left out)"
    )
    band_option(parser)
    work_options(parser)
    parser.add_argument(
        "--sensitivity",
        action="store_true",
        help="how the first loss of stability moves with each parameter of a scene",
    )
    parser.add_argument(
        "--scatter",
        metavar="FILE",
        type=Path,
        help="distribution of the first loss of stability over the tolerances that FILE names",
    )
    parser.add_argument(
        "--workers", metavar="N", help="processes that share the samples of --scatter (1)"
    )
    file_options(
        parser, table="write the thresholds to FILE", figure="draw the way to them into FILE"
    )


def write_thresholds(path: Path, found: CriticalFriction) -> None:
    """A row for each change of stability, then one for each crossing that changes no verdict."""
    rows: list[tuple[Any, ...]] = [
        (p.mu, p.kind, p.frequency_hz, *p.interval, int(p.converged), 1) for p in found.points
    ]
    rows += [
        (c.mu, f"{c.kind} {c.direction}", c.frequency_hz, *c.interval, 1, 0)
        for c in found.crossings
        if not c.changes_verdict
    ]
    names = ("mu", "kind", "frequency_hz", "low", "high", "converged", "changes_verdict")
    write_table(path, dict.fromkeys(names, ""), rows)


def upper_end(given: argparse.Namespace, subject: object) -> float:
    """The value of --mu-max for a scene or system. Raises InputError."""
    kind = upper_end_of(subject)
    return numbers(given.mu_max, option_of(given, "mu_max"), 1, kind.allowed(), kind.admits)[0]


def data(found: CriticalFriction) -> dict[str, Any]:
    """The answer as a JSON object."""
    return {
        "critical": [dataclasses.asdict(point) for point in found.points],
        "crossings": [dataclasses.asdict(crossing) for crossing in found.crossings],
        "verdict_at_zero": found.at_zero,
        "verdict_at_start": found.at_zero,
        "mu_start": 0.0,
        "mu_end": found.mu_end,
        "admissible_to": min(found.admissible_to, found.mu_end),
        "end": found.end,
        "certified": found.certified,
    }


def text(found: CriticalFriction, name: str = "mu") -> str:
    """The same for people; `name` is the parameter's."""
    start = "without friction" if name == "mu" else f"at {name} = 0"
    head = f"{start}: {in_words(found.at_zero)}"
    tail = f"followed up to {name} = {found.mu_end:.9g}: {found.end}"
    if not found.points:
        parts = [head, "no change of stability"]
    else:
        rows = [(f"  {name}", "change", "frequency, Hz")]
        rows += [(f"  {p.mu:.12g}", p.kind, number(p.frequency_hz)) for p in found.points]
        parts = [head, elided(rows, "--json")]
    hidden = [c for c in found.crossings if not c.changes_verdict]
    if hidden:
        table = [(f"  {name}", "mode", "crossing", "frequency, Hz")]
        table += [
            (f"  {c.mu:.12g}", f"{c.mode}", f"{c.kind} {c.direction}", number(c.frequency_hz))
            for c in hidden
        ]
        parts += ["crossings that another mode's growth hides", elided(table, "--json")]
    return "\n".join([*parts, tail])


def run(given: argparse.Namespace) -> Answer:
    """Read the scene or system and answer."""
    if given.scatter is None and given.workers is not None:
        raise InputError("--workers: is not allowed without --scatter, whose samples they share")
    if given.scatter is not None and given.sensitivity:
        raise InputError("--sensitivity: is not allowed with --scatter; one of both is allowed")
    matrices = None if given.scatter is not None else system_of(given)
    if matrices is not None:
        from squeal.cli.system_thresholds import thresholds_of  # a scene needs none of it

        return thresholds_of(given, matrices)
    refuse_options(given, ("min", "band"))
    if given.scatter is not None:
        from squeal.cli.scattered import scattered

        subject = given.source.subject("--scatter")
        return scattered(given, subject, upper_end(given, subject))
    system = given.source.system()
    if given.sensitivity:
        refuse_sensitivity(given.source.name, system)
    source = system or given.source.scene()
    mu_max = upper_end(given, source)
    moves, shown, name = None, "", "mu"
    if isinstance(source, Scene):
        found = critical_friction(source, mu_max)
        if given.sensitivity:
            moves = threshold_moves(source, found)
            shown = threshold_moves_text(source, moves)
    else:
        name = source.parameter
        found = critical_parameter(source, mu_max, name)
    if given.table is not None:
        write_thresholds(given.table, found)
    if given.figure is not None:
        own = source.pad.mu if isinstance(source, Scene) else None
        draw(given.figure, given.source.name, source, 0.0, mu_max, own)
    more: dict[str, Any] = {"sensitivity": moves} if given.sensitivity else {}
    return Answer(
        lambda: data(found) | more, lambda: text(found, name) + shown, warnings=found.warnings
    )
