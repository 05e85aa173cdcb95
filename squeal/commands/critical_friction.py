"""`squeal critical-friction`: every change of stability in a range of mu."""

from __future__ import annotations

import argparse
import math
import sys
from typing import Any

from squeal.commands.base import Answer, Command, Parser, table
from squeal.commands.plain import critical, read_if_plain
from squeal.critical import CriticalFriction, critical_friction
from squeal.errors import InputError
from squeal.provenance import provenance
from squeal.scene import read_scene


def options(parser: Parser) -> None:
    """Options of `squeal critical-friction`."""
    parser.add_argument(
        "--mu-max", metavar="MU", default="2", help="upper end of the range of mu (2 if left out)"
    )


def upper_end(given: str) -> float:
    """The value of --mu-max. Raises InputError."""
    try:
        value = float(given)
    except ValueError:
        value = math.nan
    if not 0.0 < value <= 1e3:
        raise InputError(
            f"--mu-max {given}: is not allowed; it must be a number above 0 and at most 1000"
        )
    return value


def data(found: CriticalFriction) -> dict[str, Any]:
    """The answer as a JSON object."""
    return {
        "critical": [
            {
                "mu": point.mu,
                "kind": point.kind,
                "frequency_hz": point.frequency_hz,
                "interval": list(point.interval),
                "converged": point.converged,
            }
            for point in found.points
        ],
        "verdict_at_zero": found.at_zero,
        "mu_end": found.mu_end,
        "end": found.end,
    }


def text(found: CriticalFriction) -> str:
    """The same for people."""
    head = f"without friction: {found.at_zero}"
    tail = f"followed up to mu = {found.mu_end:.9g}: {found.end}"
    if not found.points:
        return f"{head}\nno change of stability\n{tail}"
    rows = [("  mu", "change", "frequency, Hz")]
    rows += [(f"  {p.mu:.12g}", p.kind, f"{p.frequency_hz:.6g}") for p in found.points]
    return f"{head}\n{table(rows)}\n{tail}"


def run(given: argparse.Namespace) -> Answer:
    """Read the scene and answer."""
    mu_max = upper_end(given.mu_max)
    system = read_if_plain(given.scene)
    if system is not None:
        found = critical(system, mu_max)
    else:
        found = critical_friction(read_scene(given.scene), mu_max)
    where = ("squeal.commands.critical_friction", ("numpy",))
    return Answer(
        lambda: data(found) | {"provenance": provenance(given.scene, *where)},
        lambda: text(found),
    )


COMMAND = Command(
    "critical-friction",
    "Every flutter and divergence threshold in 0 < mu <= --mu-max, along the branch from mu = 0.",
    run,
    options,
)

if __name__ == "__main__":
    sys.exit(COMMAND.main())
