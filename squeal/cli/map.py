"""`squeal map`: the verdict over alpha1 and alpha2, or over any two parameters."""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis import maps
from squeal.analysis.maps import QUANTITIES, Field, field_of
from squeal.analysis.threshold_curve import ThresholdCurve, threshold_curves
from squeal.cli.base import Answer, Parser
from squeal.cli.outputs import file_options
from squeal.cli.system_chart import chart_of
from squeal.cli.system_options import band_option, refuse_options, system_of, work_options
from squeal.cli.tables import table
from squeal.io.document import scalar
from squeal.io.scene import Scene
from squeal.io.writing import picked, write_table
from squeal.model.pad import PARAMETERS
from squeal.schema.place import Place
from squeal.schema.values import Angle, Number, Whole, warn_of_degrees

MOST_POINTS = 4000


def options(parser: Parser) -> None:
    """Options of `squeal map`."""
    parser.add_argument(
        "--n", metavar="N", help="points a side (200 if left out; 41 for a system from matrices)"
    )
    for name, default in (("first", "alpha1"), ("second", "alpha2")):
        parser.add_argument(
            f"--{name}",
            metavar="NAME:LOW:HIGH[:log]",
            help=f"{name} parameter and its range ({default}:0:pi if left out; :log for scenes)",
        )
    parser.add_argument(
        "--quantity",
        metavar="NAME",
        help=f"contours of a number beside the verdicts: {', '.join(QUANTITIES)}",
    )
    band_option(parser)
    work_options(parser)
    file_options(
        parser,
        table="write the verdicts to FILE",
        figure="draw the map into FILE",
        curve="continue the curves on which stability is lost, and write them to FILE",
    )


def _axis(given: str, option: str, scene: Scene, n: int) -> maps.Axis:
    at = Place(f"{option} {given}")
    parts = given.split(":")
    maps.check_names(scene, parts[:1], at)
    log = parts[3:] == ["log"]
    if len(parts) != 3 + log:
        raise at.refuse(
            "it must be NAME:LOW:HIGH, a parameter of the scene and its range, or NAME:LOW:HIGH:log"
        )
    kind = Angle() if PARAMETERS[parts[0]].angle else Number()
    ends = [scalar(end) for end in parts[1:3]]
    low, high = (kind.read(end, at) for end in ends)
    if isinstance(kind, Angle):
        warn_of_degrees(ends[1], at)
    maps.check_axis(parts[0], low, high, n, at, log)
    return maps.Axis(parts[0], low, high, n, log)


def axes(given: argparse.Namespace, scene: Scene) -> tuple[maps.Axis, maps.Axis]:
    """The two axes that the options name. Raises InputError."""
    number = "200" if given.n is None else given.n
    n = Whole(2, MOST_POINTS).read(scalar(number), Place(f"--n {number}"))
    first, second = maps.angle_axes(n)
    if given.first:
        first = _axis(given.first, "--first", scene, n)
    if given.second:
        second = _axis(given.second, "--second", scene, n)
    maps.check_names(
        scene, (first.name, second.name), Place(f"--second {given.second or 'alpha2'}")
    )
    return first, second


def write_map(path: Path, found: maps.StabilityMap, shown: Field | None, judged: bool) -> None:
    """A row for each point: both parameters, the verdict, the quantity if there is one.

    judged: also whether the equilibrium is admissible, 1 or 0.
    """
    first, second = (axis.values.tolist() for axis in found.axes)
    admissible = found.admissible
    rows = (
        (
            a,
            b,
            maps.NAMES[found.codes[i, j]],
            *([] if shown is None else [float(shown.values[i, j])]),
            *([int(admissible[i, j])] if judged else []),
        )
        for i, a in enumerate(first)
        for j, b in enumerate(second)
    )
    heads = {axis.name: PARAMETERS[axis.name].unit.removeprefix("1") for axis in found.axes}
    heads |= {"verdict": ""}
    if shown is not None:
        heads |= {shown.quantity: shown.unit.removeprefix("1")}
    if judged:
        heads |= {"admissible": ""}
    write_table(path, heads, rows)


def write_curves(
    path: Path, axes: tuple[maps.Axis, maps.Axis], curves: Sequence[ThresholdCurve]
) -> None:
    """A row for each point of each curve: its number, both parameters, what happens, frequency."""
    heads = {"curve": ""}
    heads |= {axis.name: PARAMETERS[axis.name].unit.removeprefix("1") for axis in axes}
    rows = (
        (i, *point, curve.kind, rate)
        for i, curve in enumerate(curves, 1)
        for point, rate in zip(curve.points.tolist(), curve.frequency_hz.tolist(), strict=True)
    )
    write_table(path, heads | {"kind": "", "frequency_hz": ""}, rows)


def _curve(curve: ThresholdCurve) -> dict[str, Any]:
    return {
        "kind": curve.kind,
        "closed": curve.closed,
        "points": curve.points.tolist(),
        "frequency_hz": curve.frequency_hz.tolist(),
    }


def _numbers(shown: Field) -> dict[str, Any]:
    rows = [[v if math.isfinite(v) else None for v in row] for row in shown.values.tolist()]
    return {"quantity": shown.quantity, "unit": shown.unit, "values": rows}


def _span(shown: Field) -> str:
    words, unit = QUANTITIES[shown.quantity]
    known = shown.values[np.isfinite(shown.values)]
    if not known.size:
        return f"{words}: at no point"
    share = 100 * known.size / shown.values.size
    unit = unit.removeprefix("1")
    return f"{words}: {known.min():.6g} to {known.max():.6g} {unit}".rstrip() + (
        f", on {share:.1f} % of the points"
    )


def run(given: argparse.Namespace) -> Answer:
    """Read the scene, compute the map, write what is asked."""
    matrices = system_of(given, short=True)
    if matrices is not None:
        return chart_of(given, matrices)
    refuse_options(given, ("band",))
    scene = given.source.scene()
    wanted = axes(given, scene)
    shown = None if given.quantity is None else field_of(scene, wanted, given.quantity)
    found = maps.stability_map(scene, wanted, traced=given.figure is not None and shown is None)
    if given.table is not None:
        write_map(given.table, found, shown, not scene.pad_model.linear)
    curves = None if given.curve is None else threshold_curves(scene, wanted, found.codes)
    if curves is not None:
        write_curves(given.curve, wanted, curves)
    own = (getattr(scene.pad, wanted[0].name), getattr(scene.pad, wanted[1].name))
    if given.figure is not None and shown is None:
        from squeal.plots.maps import draw_stability_map

        draw_stability_map(found, given.figure, own, curves or ())
    elif given.figure is not None and shown is not None:
        from squeal.plots.maps import draw_contours

        level = scene.pad.mu if shown.quantity == "critical-friction" else None
        draw_contours(shown, given.figure, own, level, curves or ())
    head = f"{wanted[0].name} x {wanted[1].name}, {wanted[0].n} x {wanted[1].n} points"
    rows = [(f"  {name}", f"{100 * share:.3f} %") for name, share in found.share.items()]
    return Answer(
        lambda: {
            "share": found.share,
            "admissible_share": float(found.admissible.mean()),
            "n": wanted[0].n,
            "axes": [
                picked(a, "name low high") | {"scale": "log" if a.log else "linear"} for a in wanted
            ],
            **({} if shown is None else _numbers(shown)),
            **({} if curves is None else {"threshold_curve": [_curve(c) for c in curves]}),
        },
        lambda: (
            f"share of the area: {head}\n{table(rows)}"
            + ("" if shown is None else f"\n{_span(shown)}")
        ),
        warnings=found.warnings,
    )
