"""Fig. 13: where the conditions (23a, b) for quasi-static sliding hold; and maps of verdicts."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Patch

from squeal.figures.areas import draw
from squeal.figures.style import DOUBLE, SINGLE, Drawing, origin, program, save, style
from squeal.outline import Outline
from squeal.quasi_static import READINGS
from squeal.scene import read_scene

if TYPE_CHECKING:
    from squeal.angle_map import StabilityMap

_QUARTERS = [0.0, 0.25, 0.5, 0.75, 1.0]
_NAMES = ["$0$", r"$\pi/4$", r"$\pi/2$", r"$3\pi/4$", r"$\pi$"]
Marks = Mapping[str, tuple[float, float]]
"""Letters of cases with their (alpha1, alpha2) in rad."""


def _angle_axes(axes: Axes) -> None:
    axes.set_aspect("equal")
    axes.set_xticks(_QUARTERS, _NAMES)
    axes.set_yticks(_QUARTERS, _NAMES)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    axes.set_xlabel(r"spring angle $\alpha_1$ [rad]")
    axes.set_ylabel(r"spring angle $\alpha_2$ [rad]")


def _region(axes: Axes, found: Outline, marks: Marks, title: str) -> None:
    """The region within its traced boundary, in black as in the article, with cases marked."""
    draw(axes, found, ("white", "black"), np.pi)
    for case, (a, b) in marks.items():
        axes.text(
            a / np.pi,
            b / np.pi,
            case,
            ha="center",
            va="center",
            bbox={
                "boxstyle": "circle,pad=0.2",
                "facecolor": "white",
                "edgecolor": "#C8380E",
                "linewidth": 1.0,
            },
            zorder=5,
            clip_on=False,
        )
    axes.set_title(title, pad=9.0)
    _angle_axes(axes)


def quasi_static_figure(found: dict[str, Any], marks: Marks) -> Figure:
    """Fig. 13 as the article reads Eqs. (23a, b), and beside it with the signs followed."""
    told = ("(a) as printed", "(b) signs followed")
    with style():
        figure = Figure(figsize=(DOUBLE, 3.75), layout=ConstrainedLayoutEngine(w_pad=0.1))
        panels = figure.subplots(1, 2)
        for axes, name, title in zip(panels, READINGS, told, strict=True):
            share = f"{100 * found['share'][name]:.1f} % of the map"
            _region(axes, Outline.of(found[name]), marks, f"{title}: {share}")
        panels[1].set_ylabel("")
    return figure


def alternative_text(found: dict[str, Any]) -> str:
    """The two maps in words."""
    share = found["share"]
    return (
        "Two maps over the spring angles alpha1 and alpha2 from 0 to pi at the friction "
        f"coefficient {found['mu']:g}. (a) The conditions (23a) and (23b) as printed hold in the "
        f"black region, {100 * share['as_printed']:.1f} % of the map. (b) With the signs of the "
        f"stiffness entries followed, they hold on {100 * share['sign_aware']:.1f} % of the map. "
        "Letters mark the article's cases."
    )


def drawing(found: dict[str, Any], marks: Marks) -> Drawing:
    """The figure of `squeal.quasi_static` results, ready to be saved."""
    return Drawing(
        quasi_static_figure(found, marks),
        alternative_text(found),
        "Map of the quasi-static sliding motion, model B3",
        origin("squeal.figures.maps", [found]),
    )


VERDICT_COLOURS = ("#FFFFFF", "#CFE6F5", "#C8380E", "#6A1B7B", "#8C8C8C")
"""Colours of `squeal.angle_map.NAMES`: stable, marginal, flutter, divergence, beyond a fold."""


def stability_figure(found: StabilityMap) -> Figure:
    """Verdict over two parameters: areas with the traced curves between them.

    Raises ValueError for a map that was not traced.
    """
    from squeal.angle_map import NAMES

    if found.outline is None:
        raise ValueError("only a traced map can be drawn")
    first, second = found.axes
    with style():
        figure = Figure(figsize=(SINGLE, 3.6))
        axes = figure.add_subplot()
        angles = {first.name, second.name} <= {"alpha1", "alpha2"}
        unit = np.pi if angles else 1.0
        met = [i for i, name in enumerate(NAMES) if found.share[name] > 0.0]
        draw(axes, found.outline, VERDICT_COLOURS, unit)
        axes.set_xlim(first.low / unit, first.high / unit)
        axes.set_ylim(second.low / unit, second.high / unit)
        if angles:
            _angle_axes(axes)
        axes.set_xlabel(f"{first.name}" if not angles else r"spring angle $\alpha_1$ [rad]")
        axes.set_ylabel(f"{second.name}" if not angles else r"spring angle $\alpha_2$ [rad]")
        handles = [Patch(facecolor=VERDICT_COLOURS[i], edgecolor="k", linewidth=0.5) for i in met]
        names = [f"{NAMES[i]} ({100 * found.share[NAMES[i]]:.1f} %)" for i in met]
        figure.legend(handles, names, loc="outside upper center", ncols=2)
    return figure


def draw_stability_map(found: StabilityMap, path: Path) -> None:
    """Save a map of verdicts as PDF, with its alternative text beside it."""
    shares = ", ".join(f"{name} {100 * share:.1f} %" for name, share in found.share.items())
    title = f"Verdict over {found.axes[0].name} and {found.axes[1].name}"
    text = f"{title}; shares of the area: {shares}."
    save(Drawing(stability_figure(found), text, title, origin("squeal.figures.maps")), path)


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("map", type=Path, metavar="JSON", help="of squeal.quasi_static")
    parser.add_argument(
        "--mark", type=Path, nargs="*", default=[], metavar="SCENE.yaml", help="cases to mark"
    )


def _draw(given: argparse.Namespace) -> Drawing:
    pads = {path.stem[-1]: read_scene(path).pad for path in given.mark}
    marks = {letter: (pad.alpha1, pad.alpha2) for letter, pad in pads.items()}
    return drawing(json.loads(given.map.read_text(encoding="utf-8")), marks)


if __name__ == "__main__":
    sys.exit(program("Draw the map of quasi-static sliding.", _arguments, _draw))
