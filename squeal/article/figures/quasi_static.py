"""Fig. 13: where the conditions (23a, b) for quasi-static sliding hold."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from squeal.files.provenance import Provenance
from squeal.numerics.outline import Outline
from squeal.plots.areas import draw
from squeal.plots.maps import angle_axes_of_pi
from squeal.plots.style import DOUBLE, Drawing, origin, program, style
from squeal.scene import read_scene

Marks = Mapping[str, tuple[float, float]]
"""Letters of cases with their (alpha1, alpha2) in rad."""


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
    angle_axes_of_pi(axes)


def quasi_static_figure(found: dict[str, Any], marks: Marks) -> Figure:
    """Fig. 13 as the article reads Eqs. (23a, b), and beside it with the signs followed."""
    told = ("(a) as printed", "(b) signs followed")
    with style():
        figure = Figure(figsize=(DOUBLE, 3.75), layout=ConstrainedLayoutEngine(w_pad=0.1))
        panels = figure.subplots(1, 2)
        for axes, name, title in zip(panels, ("as_printed", "sign_aware"), told, strict=True):
            share = f"{100 * found['share'][name]:.1f} % of the map"
            _region(axes, Outline.from_dict(found[name]), marks, f"{title}: {share}")
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
    """The figure of `squeal.article.studies.quasi_static` results, ready to be saved."""
    return Drawing(
        quasi_static_figure(found, marks),
        alternative_text(found),
        "Map of the quasi-static sliding motion, model B3",
        origin("squeal.article.figures.quasi_static", [Provenance.from_dict(found["provenance"])]),
    )


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "map", type=Path, metavar="JSON", help="of squeal.article.studies.quasi_static"
    )
    parser.add_argument(
        "--mark", type=Path, nargs="*", default=[], metavar="SCENE.yaml", help="cases to mark"
    )


def _draw(given: argparse.Namespace) -> Drawing:
    pads = {path.stem[-1]: read_scene(path).pad for path in given.mark}
    marks = {letter: (pad.alpha1, pad.alpha2) for letter, pad in pads.items()}
    return drawing(json.loads(given.map.read_text(encoding="utf-8")), marks)


if __name__ == "__main__":
    sys.exit(program("Draw the map of quasi-static sliding.", _arguments, _draw))
