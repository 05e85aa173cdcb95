"""`squeal map` of a system from matrices: its stability chart over two named parameters."""

import argparse
import dataclasses
from typing import Any

from squeal.analysis.systems.chart import NAMES, Chart, Side, system_chart
from squeal.analysis.systems.wanted import Wanted
from squeal.cli.base import Answer
from squeal.cli.numbers import numbers, whole
from squeal.cli.system_options import check_work, progress_of, wanted_of
from squeal.cli.systems import basis_row, basis_text, identity
from squeal.cli.tables import columns_with, table
from squeal.errors import InputError
from squeal.io.journal import Checkpoint
from squeal.io.system import SystemFile
from squeal.io.writing import write_table
from squeal.linear.system import TermSystem

POINTS = 41  # a side, if left out
MOST_POINTS = 4000


def chart_of(given: argparse.Namespace, file: SystemFile) -> Answer:
    """The answer of `squeal map` for a system."""
    system = file.system
    if len(system.parameters) < 2:
        raise InputError(
            f"{given.source.name}: {', '.join(system.parameters)} is the only parameter; a map "
            "needs a system of the general form with two named under its key parameters"
        )
    if given.quantity is not None:
        raise InputError(f"--quantity {given.quantity}: is not allowed with a system of matrices")
    if given.curve is not None:
        raise InputError(
            f"{given.curve_option} {given.curve}: is not allowed with a system of matrices"
        )
    n = POINTS if given.n is None else whole(given.n, "--n", 2, MOST_POINTS)
    sides = (_side(given.first, "--first", system, n), _side(given.second, "--second", system, n))
    check_work(given, system)
    wanted = wanted_of(given)
    checkpoint = Checkpoint(
        given.table,
        lambda: {
            "sides": [dataclasses.asdict(s) for s in sides],
            "wanted": repr(wanted),
            "system": identity(system),
        },
    )
    found = system_chart(system, sides, wanted, progress_of(given), checkpoint)
    checkpoint.close()
    if given.table is not None:
        _write(given, found)
    if given.figure is not None:
        from squeal.plots.maps import draw_chart

        names = (sides[0].name, sides[1].name)
        values = (sides[0].values, sides[1].values)
        draw_chart(given.figure, system.name, names, values, found.codes)
    inputs = [given.source.file, *file.inputs]
    return Answer(lambda: _data(found, wanted), lambda: _text(found, wanted), inputs)


def _side(given: str | None, option: str, system: TermSystem, n: int) -> Side:
    names = ", ".join(sorted(system.parameters))
    words = f"NAME:LOW:HIGH with LOW < HIGH, NAME one of {names}"
    if given is None:
        raise InputError(f"{option}: is missing; a system of matrices needs {words}")
    name, _, ends = given.partition(":")
    if name not in system.parameters:
        raise InputError(f"{option} {given}: is not allowed; it must be {words}")
    try:
        low, high = numbers(ends, option, 2, words, lambda a, b: a < b)
    except InputError:
        raise InputError(f"{option} {given}: is not allowed; it must be {words}") from None
    return Side(name, low, high, n)


def _data(found: Chart, wanted: Wanted) -> dict[str, Any]:
    return {
        "share": found.share,
        "n": found.sides[0].n,
        "axes": [{"name": s.name, "low": s.low, "high": s.high} for s in found.sides],
        "verdicts": [[NAMES[k] for k in row] for row in found.codes],
        "basis": basis_row(found.reduction, wanted),
    }


def _text(found: Chart, wanted: Wanted) -> str:
    first, second = found.sides
    head = f"{first.name} x {second.name}, {first.n} x {second.n} points"
    rows = [(f"  {name}", f"{100 * share:.3f} %") for name, share in found.share.items()]
    parts = [f"share of the area: {head}", table(rows)]
    if found.reduction is not None:
        parts.append(basis_text(found.reduction, wanted))
    return "\n".join(parts)


def _write(given: argparse.Namespace, found: Chart) -> None:
    first, second = found.sides
    rows = (
        (float(a), float(b), NAMES[found.codes[i, j]], float(found.growth[i, j]))
        for i, a in enumerate(first.values)
        for j, b in enumerate(second.values)
    )
    others = {"verdict": "", "largest_real": "1/s"}
    heads = columns_with([first.name, second.name], others)
    write_table(given.table, heads, rows)
