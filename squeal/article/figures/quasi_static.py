"""Fig. 13: where the conditions (23a, b) for quasi-static sliding hold."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from squeal.article.cases import CASES
from squeal.article.results.quasi_static import QuasiStatic
from squeal.numerics.outline import Outline
from squeal.plots import areas
from squeal.plots.areas import angle_axes_of_pi
from squeal.plots.style import DOUBLE, Drawing, origin, style

Marks = Mapping[str, tuple[float, float]]
"""Letters of cases with their (alpha1, alpha2) in rad."""


def _region(axes: Axes, found: Outline, marks: Marks, title: str) -> None:
    """The region within its traced boundary, in black as in the article, with cases marked."""
    areas.draw(axes, found, ("white", "black"), np.pi)
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


def quasi_static_figure(found: QuasiStatic, marks: Marks) -> Figure:
    """Fig. 13 as the article reads Eqs. (23a, b), and beside it with the signs followed."""
    told = ("(a) as printed", "(b) signs followed")
    with style():
        figure = Figure(figsize=(DOUBLE, 3.75), layout=ConstrainedLayoutEngine(w_pad=0.1))
        panels = figure.subplots(1, 2)
        for axes, name, title in zip(panels, ("as_printed", "sign_aware"), told, strict=True):
            share = f"{100 * getattr(found.share, name):.1f} % of the map"
            _region(axes, getattr(found, name), marks, f"{title}: {share}")
        panels[1].set_ylabel("")
    return figure


def alternative_text(found: QuasiStatic) -> str:
    """The two maps in words."""
    printed, followed = (
        f"{100 * share:.1f} % of the map"
        for share in (found.share.as_printed, found.share.sign_aware)
    )
    return (
        "Two maps over the spring angles alpha1 and alpha2 from 0 to pi at the friction "
        f"coefficient {found.mu:g}. (a) The conditions (23a) and (23b) as printed hold in the "
        f"black region, {printed}. (b) With the signs of the "
        f"stiffness entries followed, they hold on {followed}. "
        "Letters mark the article's cases."
    )


def draw(found: QuasiStatic, marks: Marks = CASES) -> Drawing:
    """The figure, ready to be saved."""
    title = "Map of the quasi-static sliding motion, model B3"
    made = origin(__name__, found.provenance)
    return Drawing(quasi_static_figure(found, marks), alternative_text(found), title, made)
