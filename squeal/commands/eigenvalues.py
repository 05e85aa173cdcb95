"""`squeal eigenvalues`: complex eigenvalue analysis of the sliding equilibrium."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from squeal.commands.base import Answer, Command, Parser, table
from squeal.commands.plain import (
    eigenvalue_data,
    eigenvalue_rows,
    eigenvalue_table,
    eigenvalue_text,
    read_if_plain,
    value_of,
)
from squeal.errors import InputError
from squeal.provenance import provenance
from squeal.scene import read_scene
from squeal.sliding import Analysis, analyse, swept


def options(parser: Parser) -> None:
    """Options of `squeal eigenvalues`."""
    parser.add_argument(
        "--mu", metavar="A:B:N", help="also sweep mu from A to B, N values, along the branch"
    )
    parser.add_argument(
        "--at", metavar="MU", help="plain systems M, C, K(mu) only: value of mu (0 if left out)"
    )


def sweep_rows(analyses: list[tuple[float, Analysis | None]]) -> list[dict[str, Any]]:
    """A row for each mu; eigenvalues and verdict are null where the branch does not reach it."""
    return [
        {
            "mu": mu,
            "contact": None if a is None else a.contact,
            "eigenvalues": None if a is None else eigenvalue_rows(a.spectrum),
            "verdict": None if a is None else a.judgement.verdict,
        }
        for mu, a in analyses
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
        "eigenvalues": eigenvalue_rows(analysis.spectrum),
        "verdict": analysis.judgement.verdict,
        "criterion": str(analysis.judgement),
    }


def text(analysis: Analysis) -> str:
    """The same for people."""
    x, y, theta = analysis.q
    reaction = "" if analysis.R_n is None else f", R_n = {analysis.R_n:.6g} N"
    return "\n".join(
        [
            f"model {analysis.model}: x = {x:.6g} m, y = {y:.6g} m, theta = {theta:.6g} rad, "
            f"contact {analysis.contact}{reaction}",
            f"({analysis.how})",
            "",
            eigenvalue_table(analysis.spectrum),
            "",
            f"verdict: {analysis.judgement}",
        ]
    )


def sweep_text(analyses: list[tuple[float, Analysis | None]]) -> str:
    """The sweep for people: frequencies, largest growth rate and verdict at each mu."""
    rows = [("  mu", "contact", "frequencies, Hz", "largest real, 1/s", "verdict")]
    for mu, a in analyses:
        if a is None:
            rows.append((f"  {mu:.6g}", "-", "-", "-", "no equilibrium on the branch"))
            continue
        eigenvalues = a.spectrum.eigenvalues
        frequencies = ", ".join(f"{e.frequency_hz:.6g}" for e in eigenvalues[::2])
        growth = max(e.value.real for e in eigenvalues)
        rows.append((f"  {mu:.6g}", a.contact, frequencies, f"{growth:.6g}", a.judgement.verdict))
    return "sweep of mu along the branch\n" + table(rows)


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
    mus = sweep_range(given.mu) if given.mu else None
    system = read_if_plain(given.scene)
    at = value_of(given.at, system)
    if system is not None:
        return Answer(
            lambda: (
                eigenvalue_data(system, at, mus)
                | {"provenance": provenance(given.scene, "squeal.commands.eigenvalues", ("numpy",))}
            ),
            lambda: eigenvalue_text(system, at, mus),
        )
    scene = read_scene(given.scene)
    analysis = analyse(scene)
    sweep = swept(scene, mus) if mus else None

    def full() -> dict[str, Any]:
        where = provenance(scene.source, "squeal.commands.eigenvalues", ("numpy",))
        return (
            data(analysis) | ({"sweep": sweep_rows(sweep)} if sweep else {}) | {"provenance": where}
        )

    def shown() -> str:
        return text(analysis) + ("\n\n" + sweep_text(sweep) if sweep else "")

    return Answer(full, shown)


COMMAND = Command(
    "eigenvalues", "Complex eigenvalues and verdict of the sliding equilibrium.", run, options
)

if __name__ == "__main__":
    sys.exit(COMMAND.main())
