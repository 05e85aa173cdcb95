"""Where loss of contact coexists with stable sliding, from the study of the same name."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from squeal.article.studies.coexistence import (
    Coexistence,
    Margin,
    Motion,
    Point,
    floor_at,
    height_at,
    inside,
)
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

TITLES = {
    "b1-d": "points (B1)",
    "b2-d-integral": "line (B2), energy-consistent",
    "b2-d-mean": "line (B2), as printed",
}
COEXISTING = "#E69F00"
UNSTABLE = "0.6"  # colours of areas: both stable, sliding unstable
LOOKS: dict[str, dict[str, Any]] = {
    "fold": {"color": "#C8380E", "lw": 1.5},
    "torus": {"color": "#3B0F4A", "lw": 1.1, "ls": (0, (4, 1.5))},
    "period doubling": {"color": "#3B0F4A", "lw": 1.1, "ls": (0, (1, 1))},
    "grazing": {"color": "#3B0F4A", "lw": 0.9, "ls": (0, (4, 1.5, 1, 1.5))},
}
"""Of a boundary of cycles, by its kind."""
WORDS = {
    "fold": "fold of cycles",
    "torus": "cycle loses stability (torus)",
    "period doubling": "cycle doubles its period",
    "grazing": "an edge grazes",
}
HALO = [withStroke(linewidth=2.4, foreground="w")]
FINE = 300  # abscissae at which areas are drawn
CAPTION = r"""Where a stable cycle that loses contact coexists with stable sliding in case (d)
(orange), over modal damping $\zeta$ and contact damping $a$ of Hunt and Crossley's law (top,
reference friction), and over friction at $a = {}$\val[2]{coexistence.a_over_friction}\,s/m (bottom;
dotted: reference friction). White: we followed no such cycle; grey: sliding is unstable. Two folds
in one panel are those of two cycles. Numbers: least disturbance found that leads from sliding to a
lasting loss of contact, in micrometres. Under the printed law longer cycles and irregular motions
lose contact at low damping, and some motions outrun the surface; neither are counted."""


def _interpolated(points: Sequence[Point], over: str, values: np.ndarray) -> np.ndarray:
    """Modal dampings (v,) at which sliding becomes stable, at `values` (v,) of `over`.

    over: contact damping "a" or friction "mu"; points: of that boundary, between which the damping
    is linear. Outside of their range it is 0: sliding is stable without modal damping.
    """
    if not points:
        return np.zeros(len(values))
    known = np.array([getattr(point, over) for point in points])
    dampings = np.array([point.zeta for point in points])
    return np.interp(values, known, dampings, left=0.0, right=0.0)


def _regions(
    axes: Axes, motion: Motion, over: str, values: np.ndarray, low: float, high: float
) -> None:
    """Draw a panel of modal damping over contact damping "a" or friction "mu".

    Grey, from the bottom up to `unstable`: sliding is unstable. Orange, from `lower` to `upper`:
    sliding and a cycle with loss of contact are stable. A fold ends that cycle at `upper`; below
    `lower` sliding or the cycle is unstable. values (v,): of `over`; low, high: modal damping at
    the bottom and the top of the panel.
    """
    sliding = motion.sliding if over == "a" else motion.over_friction
    unstable = np.maximum(_interpolated(sliding, over, values), low)
    upper = np.array([height_at(motion.boundaries, over, float(value)) for value in values])
    for curve in motion.boundaries:
        if curve.over == over and curve.kind == "fold":
            last = curve.points[-1]
            if last.zeta > high:
                # the fold was traced up to a point above the panel: at greater `values` `height_at`
                # knows no fold, but the cycle is stable up to the top
                upper[values >= getattr(last, over)] = high
    floor = np.array([floor_at(motion.boundaries, over, float(value)) for value in values])
    lower = np.maximum(unstable, floor)
    axes.fill_between(values, low, unstable, color=UNSTABLE, lw=0.0)
    axes.fill_between(
        values, lower, upper, where=list(upper > lower), color=COEXISTING, lw=0.0, alpha=0.55
    )
    axes.plot(values, np.where(unstable > low, unstable, np.nan), color="k", lw=1.5)
    for curve in motion.boundaries:
        if curve.over == over:
            abscissae = [getattr(point, over) for point in curve.points]
            axes.plot(abscissae, [point.zeta for point in curve.points], **LOOKS[curve.kind])


def _number(axes: Axes, margin: Margin, record: Coexistence) -> None:
    """Write a least disturbance (micrometres) at its dampings, clear of the edges of the panel."""
    at_left = margin.a == record.a_range[0]
    at_bottom = margin.zeta == record.zeta_range[0]
    axes.text(
        1.07 * margin.a if at_left else margin.a,
        1.05 * margin.zeta if at_bottom else margin.zeta,
        f"{margin.micrometres:.2g}",
        ha="left" if at_left else "center",
        va="bottom" if at_bottom else "center",
        fontsize=6.5,
        path_effects=HALO,
    )


def draw(record: Coexistence) -> Drawing:
    """The figure, ready to be saved."""
    title = "Loss of contact beside stable sliding"
    if not record.motions:
        return blank(title, record.left_out, __name__, record.provenance)
    low, high = record.zeta_range
    kinds: dict[str, None] = {}  # of all boundaries drawn, each once, in order
    for motion in record.motions.values():
        kinds |= dict.fromkeys(curve.kind for curve in motion.boundaries)
    with style():
        figure = Figure(figsize=(DOUBLE, 4.4))
        panels = figure.subplots(2, len(TITLES), sharey=True)
        for column, (name, words) in enumerate(TITLES.items()):
            motion = record.motions[name]
            top = panels[0, column]
            bottom = panels[1, column]
            _regions(top, motion, "a", np.geomspace(*record.a_range, FINE), low, high)
            for margin in motion.margins:
                if inside(motion, margin) and margin.micrometres is not None:
                    _number(top, margin, record)
            top.set_xscale("log")
            top.set_xlim(*record.a_range)
            top.set_title(f"({'abc'[column]}) {words}", loc="left", pad=3.0)
            top.set_xlabel("contact damping $a$, s/m")
            _regions(bottom, motion, "mu", np.linspace(*record.mu_range, FINE), low, high)
            # all points of `sliding` have the reference friction
            bottom.axvline(motion.sliding[0].mu, color="k", lw=0.6, ls=":")
            bottom.set_xlim(*record.mu_range)
            bottom.set_title(f"({'def'[column]}) {words}", loc="left", pad=3.0)
            bottom.set_xlabel(r"friction $\mu$")
        for axes in panels[:, 0]:
            axes.set_yscale("log")
            axes.set_ylim(low, high)
            axes.set_yticks([0.001, 0.01], ["0.1 %", "1 %"])
            axes.set_ylabel(r"modal damping $\zeta$")
        handles = [
            Patch(facecolor=COEXISTING, alpha=0.55, label="both stable"),
            Patch(facecolor=UNSTABLE, label="sliding unstable"),
            Line2D([], [], color="k", lw=1.5, label="sliding becomes stable"),
            *(Line2D([], [], label=WORDS[kind], **LOOKS[kind]) for kind in kinds),
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=4)
    parts = []
    for name, motion in record.motions.items():
        reach = "at every contact damping shown"
        if motion.closes is not None:
            reach = f"up to a contact damping of {motion.closes:.2g} s/m"
        parts.append(
            f"{TITLES[name]}: up to a modal damping of {100 * motion.highest:.2g} % at "
            f"{record.a_range[0]:g} s/m, {reach}"
        )
    text = (
        "Planes of modal damping over contact damping and over friction. " + "; ".join(parts) + "."
    )
    return Drawing(figure, text, title, origin(__name__, record.provenance))
