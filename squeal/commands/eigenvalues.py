"""`squeal eigenvalues`: complex eigenvalue analysis of the sliding equilibrium."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from squeal.commands.base import Answer, Command, Parser, table
from squeal.errors import InputError
from squeal.provenance import provenance
from squeal.scene import read_scene
from squeal.sliding import Analysis, analyse


def options(parser: Parser) -> None:
    """Options of `squeal eigenvalues`."""
    parser.add_argument(
        "--mu", metavar="A:B:N", help="also sweep mu from A to B in N equal steps along the branch"
    )


def eigenvalue_rows(analysis: Analysis) -> list[dict[str, float]]:
    """The six eigenvalues as JSON rows, sorted by frequency."""
    return [
        {
            "real": e.value.real,
            "imag": e.value.imag,
            "frequency_hz": e.frequency_hz,
            "damping_ratio": e.damping_ratio,
        }
        for e in analysis.spectrum.eigenvalues
    ]


def data(analysis: Analysis) -> dict[str, Any]:
    """What was found about one equilibrium, as a JSON object."""
    x, y, theta = analysis.q
    return {
        "equilibrium": {
            "x": x,
            "y": y,
            "theta": theta,
            "R_n": analysis.R_n,
            "contact": analysis.contact,
        },
        "how": analysis.how,
        "M": analysis.matrices.M.tolist(),
        "C": analysis.matrices.C.tolist(),
        "K": analysis.matrices.K.tolist(),
        "eigenvalues": eigenvalue_rows(analysis),
        "verdict": analysis.judgement.verdict,
        "criterion": str(analysis.judgement),
    }


def text(analysis: Analysis) -> str:
    """The same for people."""
    x, y, theta = analysis.q
    reaction = "" if analysis.R_n is None else f", R_n = {analysis.R_n:.6g} N"
    rows = [("  mode", "real, 1/s", "imag, rad/s", "frequency, Hz", "damping ratio")]
    for i, e in enumerate(analysis.spectrum.eigenvalues, 1):
        rows.append(
            (
                f"  {i}",
                f"{e.value.real:.6g}",
                f"{e.value.imag:.6g}",
                f"{e.frequency_hz:.6g}",
                f"{e.damping_ratio:.6g}",
            )
        )
    return "\n".join(
        [
            f"model {analysis.model}: x = {x:.6g} m, y = {y:.6g} m, theta = {theta:.6g} rad, "
            f"contact {analysis.contact}{reaction}",
            f"({analysis.how})",
            "",
            table(rows),
            "",
            f"verdict: {analysis.judgement}",
        ]
    )


def sweep_range(given: str) -> list[float]:
    """The values of mu that A:B:N names. Raises InputError."""
    parts = given.split(":")
    try:
        low, high, count = float(parts[0]), float(parts[1]), int(parts[2])
    except (ValueError, IndexError):
        low, high, count = 0.0, -1.0, 0
    if len(parts) != 3 or not 0.0 <= low < high <= 1e3 or not 2 <= count <= 100_000:
        raise InputError(
            f"--mu {given}: is not allowed; it must be A:B:N with 0 <= A < B <= 1000 and a whole "
            "number N from 2 to 100000"
        )
    return [low + (high - low) * i / (count - 1) for i in range(count)]


def run(given: argparse.Namespace) -> Answer:
    """Read the scene, find its equilibrium, analyse it."""
    scene = read_scene(given.scene)
    mus = sweep_range(given.mu) if given.mu else None
    analysis = analyse(scene)
    found = data(analysis)
    return Answer(
        lambda: (
            found
            | {"provenance": provenance(scene.source, "squeal.commands.eigenvalues", ("numpy",))}
        ),
        lambda: text(analysis),
    )


COMMAND = Command(
    "eigenvalues", "Complex eigenvalues and verdict of the sliding equilibrium.", run, options
)

if __name__ == "__main__":
    sys.exit(COMMAND.main())
