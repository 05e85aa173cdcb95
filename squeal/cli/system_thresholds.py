"""`squeal critical-friction` of a system from matrices: thresholds in its parameter."""

import argparse
import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.systems.critical import SystemThresholds, system_thresholds
from squeal.analysis.systems.sweeps import full_rows, reduced_rows
from squeal.analysis.systems.wanted import Wanted
from squeal.cli.base import Answer
from squeal.cli.numbers import numbers
from squeal.cli.outputs import option_of
from squeal.cli.system_options import (
    check_work,
    progress_of,
    value_in,
    wanted_of,
    warn_if_constant,
)
from squeal.cli.systems import basis_row, basis_text, identity
from squeal.cli.tables import elided, number
from squeal.errors import InputError
from squeal.io.journal import Checkpoint
from squeal.io.system import SystemFile
from squeal.io.writing import write_table
from squeal.linear import CriticalPoint, Crossing
from squeal.linear.system import TermSystem

SHOWN = 121  # values of the parameter in the figure


def thresholds_of(given: argparse.Namespace, file: SystemFile) -> Answer:
    """The answer of `squeal critical-friction` for a system."""
    if given.sensitivity:
        raise InputError(
            f"--sensitivity: is not allowed with {given.source.name}, a system of matrices; "
            "`squeal advise` is"
        )
    system, wanted, progress = file.system, wanted_of(given), progress_of(given)
    high = numbers(given.mu_max, option_of(given, "mu_max"), 1, "a finite number")[0]
    warn_if_constant(system)
    check_work(given, system)
    low = value_in(given.min, "--min")
    checkpoint = Checkpoint(
        given.table,
        lambda: {"range": [low, high], "wanted": repr(wanted), "system": identity(system)},
    )
    found = system_thresholds(system, high, low, wanted, progress, checkpoint)
    checkpoint.close()
    if given.table is not None:
        write_thresholds(given.table, found)
    if given.figure is not None:
        draw(given.figure, system, found, wanted)
    inputs = [given.source.file, *file.inputs]
    return Answer(lambda: data(system, found, wanted), lambda: text(system, found, wanted), inputs)


def data(system: TermSystem, found: SystemThresholds, wanted: Wanted) -> dict[str, Any]:
    """The answer as a JSON object."""
    return {
        "name": system.name,
        "parameter": system.parameter,
        "parameters": dict(system.parameters),
        "critical": [dataclasses.asdict(p) for p in found.points],
        "crossings": [dataclasses.asdict(c) for c in found.crossings],
        "verdict_at_start": found.verdict,
        "verdict_at_zero": found.verdict if found.low == 0.0 else None,
        "mu_start": found.low,
        "mu_end": found.high,
        "end": f"{system.parameter} = {found.high:g} is reached",
        "certified": found.certified,
        "unconfirmed": list(found.unconfirmed),
        "left_out": list(found.left_out),
        "crossings_outside": found.crossings_outside,
        "basis": basis_row(found.reduction, wanted),
    }


def text(system: TermSystem, found: SystemThresholds, wanted: Wanted) -> str:
    """The same for people."""
    p = system.parameter
    parts = [f"{system.name}, {wanted.words()} roots; at {p} = {found.low:g}: {found.verdict}"]
    rows: list[tuple[str, ...]] = [
        (f"  {p}", "crossing", "frequency, Hz", "mode", "verdict", "error")
    ]
    rows += [row for _, row in sorted(_rows(found), key=lambda pair: pair[0])]
    if not found.crossings:
        parts.append("no crossing of the imaginary axis")
    if len(rows) > 1:
        parts.append(elided(rows, "--json"))
    if found.crossings_outside:
        parts.append(f"crossings outside {wanted.words()}: {found.crossings_outside}")
    parts += [f"not confirmed on the full system: {words}" for words in found.unconfirmed]
    parts += found.left_out
    if found.certified is not None:
        agrees = "agrees" if found.certified else "does NOT agree"
        parts.append(f"a count of growing roots between the crossings {agrees}")
        foreseen = "foreseen, not excluded by proof" if system.real else "not sought"
        parts.append(f"windows between the values looked at are {foreseen}")
    if found.reduction is not None:
        parts.append(basis_text(found.reduction, wanted))
    parts.append(f"searched from {p} = {found.low:.9g} to {found.high:.9g}")
    return "\n".join(parts)


def _rows(found: SystemThresholds) -> Iterator[tuple[float, tuple[str, ...]]]:
    """Rows of the table: crossings, and changes of verdict where nothing crosses."""
    at = {c.mu: c for c in found.crossings if c.changes_verdict}
    verdicts = {point.mu: point.kind for point in found.points}
    alone = [point for point in found.points if point.mu not in at]
    every: list[Crossing | CriticalPoint] = [*found.crossings, *alone]
    for c in every:
        half = number((c.interval[1] - c.interval[0]) / 2, 2)
        kind, mode, change = "-", "-", verdicts.get(c.mu, "-")
        if isinstance(c, Crossing):
            kind, mode = f"{c.kind} {c.direction}", str(c.mode)
            change = change if c.changes_verdict else "-"
        yield c.mu, (f"  {c.mu:.12g}", kind, number(c.frequency_hz), mode, change, half)


def write_thresholds(path: Path, found: SystemThresholds) -> None:
    """A row for each crossing of the axis."""
    names = ("mu", "kind", "direction", "frequency_hz", "low", "high", "mode", "changes_verdict")
    rows = (
        (c.mu, c.kind, c.direction, c.frequency_hz, *c.interval, c.mode, int(c.changes_verdict))
        for c in found.crossings
    )
    write_table(path, dict.fromkeys(names, ""), rows)


def draw(path: Path, system: TermSystem, found: SystemThresholds, wanted: Wanted) -> None:
    """The way of the roots over the range, as a figure."""
    from squeal.plots.coupling import draw_system_sweep

    values = np.linspace(found.low, found.high, SHOWN).tolist()
    if found.reduction is None:
        rows = list(full_rows(system, wanted, values))
    else:
        region = wanted.rectangle
        assert region is not None
        rows = list(reduced_rows(found.reduction, region, system.parameter, values))
    draw_system_sweep(path, system.name, system.parameter, rows)
