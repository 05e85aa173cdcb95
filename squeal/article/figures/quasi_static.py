"""Fig. 13: where the conditions (23a, b) for quasi-static sliding hold."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from squeal.article.cases import CASES
from squeal.article.studies.quasi_static import QuasiStatic
from squeal.plots import parts
from squeal.plots.style import DOUBLE, Drawing, origin, style

Marks = Mapping[str, tuple[float, float]]
"""Letters of cases with their (alpha1, alpha2) in rad."""


def quasi_static_figure(found: QuasiStatic, marks: Marks) -> Figure:
    """Fig. 13 as the article reads Eqs. (23a, b), and beside it with the signs followed.

    The regions are black as in the article, within their traced boundaries.
    """
    told = ("(a) as printed", "(b) signs followed")
    ring = {"boxstyle": "circle,pad=0.2", "ec": "#C8380E", "lw": 1.0}
    with style():
        figure = Figure(figsize=(DOUBLE, 3.75), layout=ConstrainedLayoutEngine(w_pad=0.1))
        panels = figure.subplots(1, 2)
        for axes, name, title in zip(panels, ("as_printed", "sign_aware"), told, strict=True):
            parts.draw(axes, getattr(found, name), ("white", "black"), np.pi)
            parts.mark(axes, marks, np.pi, 8, **ring)
            share = f"{100 * getattr(found.share, name):.1f} % of the map"
            axes.set_title(f"{title}: {share}", pad=9.0)
            parts.angle_axes_of_pi(axes)
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
