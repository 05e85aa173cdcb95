"""Maps over the spring angles side by side, from `studies.angles` and `studies.quasi_static`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from squeal.article.studies.angles import Angles
from squeal.article.studies.quasi_static import QuasiStatic
from squeal.numerics.outline import Outline
from squeal.plots import parts
from squeal.plots.parts import VERDICT_COLOURS
from squeal.plots.style import DOUBLE, Drawing, origin, style

HOLDS = ("#FFFFFF", "#5A5A5A")
"""Colours of a condition that fails or holds."""
CONTACTS = {
    "full contact": "#C9BCE3",
    "no equilibrium on the branch": VERDICT_COLOURS[4],
    "leading edge": "#FBE9B0",
    "trailing edge": "#2E7D4F",
}
"""Colours of `squeal.model.states.STATES`, by what they mean here; they differ as greys too."""
TICKS = ([0.0, np.pi / 2, np.pi], ["$0$", r"$\pi/2$", r"$\pi$"])


Marks = Mapping[str, tuple[float, float]]


def _panel(axes: Axes, found: Outline, marks: Marks, colours: tuple[str, ...], title: str) -> None:
    parts.draw(axes, found, colours)
    edge = [withStroke(linewidth=1.5, foreground="w")]
    for name, (x, y) in marks.items():
        axes.plot(x, y, "o", ms=2.5, mfc="w", mec="k", mew=0.6, clip_on=False, zorder=5)
        # beside the area that a case is in, outside if it is on the frame
        away = (0.0, 5.0) if y >= np.pi else (5.0, 0.0) if x >= np.pi else (-4.5, 4.5)
        axes.annotate(
            name,
            (x, y),
            away,
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=7,
            path_effects=edge,
        )
    axes.set_aspect("equal")
    axes.set_xlim(0.0, np.pi)
    axes.set_ylim(0.0, np.pi)
    axes.set_xticks(*TICKS)
    axes.set_yticks(*TICKS)
    axes.set_title(title, pad=10.0)
    axes.set_xlabel(r"$\alpha_1$ [rad]")


def _key(axes: Axes, entries: list[tuple[str, str]], title: str, top: float) -> None:
    handles = [Patch(facecolor=colour, edgecolor="k", linewidth=0.5) for colour, _ in entries]
    place: Any = {"loc": "upper left", "bbox_to_anchor": (0.0, top), "alignment": "left"}
    axes.add_artist(Legend(axes, handles, [name for _, name in entries], title=title, **place))


def angle_figure(found: Angles, printed: QuasiStatic) -> Figure:
    """Two readings of (23a, b), verdict on B3, contact and verdict of B2's equilibria."""
    contacts = tuple(CONTACTS.values())
    contact = found.b2.regrouped(found.coding.contact_of)
    verdict = found.b2.regrouped(found.coding.verdict_of)
    panels = [
        (printed.as_printed, HOLDS, "(a) (23a, b) as printed"),
        (printed.sign_aware, HOLDS, "(b) (23a, b), signs followed"),
        (found.b3, VERDICT_COLOURS, "(c) verdict, B3 about the origin"),
        (contact, contacts, "(d) contact of B2's equilibrium"),
        (verdict, VERDICT_COLOURS, "(e) verdict on B2's equilibrium"),
    ]
    with style():
        figure = Figure(figsize=(DOUBLE, 5.1))
        grid = figure.subplots(2, 3)
        for axes, (curves, colours, title) in zip(grid.flat, panels, strict=False):
            _panel(axes, curves, found.marks, colours, title)
        for axes in grid[:, 0]:
            axes.set_ylabel(r"$\alpha_2$ [rad]")
        last = grid[1, 2]
        last.axis("off")
        met = [
            (VERDICT_COLOURS[k], name)
            for k, name in enumerate(found.verdicts[:-1])
            if found.share_b2[name] + found.share_b3[name] > 0.0
        ]
        _key(last, [(HOLDS[1], "(23a) and (23b) hold")], "(a), (b)", 1.0)
        _key(last, met, "(c), (e)", 0.78)
        _key(last, [(colour, name) for name, colour in CONTACTS.items()], "(d), (e)", 0.4)
    return figure


def draw(found: Angles, printed: QuasiStatic) -> Drawing:
    """The figure, ready to be saved."""
    holds, share = printed.share, found.share
    b2, b3 = (
        ", ".join(f"{name} {100 * part:.1f} %" for name, part in shares.items() if part)
        for shares in (found.share_b2, found.share_b3)
    )
    text = (
        f"Five maps over the two spring angles from 0 to pi at the friction {found.mu:g}. "
        f"(a) Conditions (23a, b) as printed hold on {100 * holds.as_printed:.1f} % of the "
        f"area, (b) with signs followed on {100 * holds.sign_aware:.1f} %. (c) Verdict on model "
        f"B3 about the origin: {b3}. (d) Model B2 slides in full contact on "
        f"{100 * share.full:.1f} %, on one edge on {100 * share.partial:.1f} %. (e) Verdict "
        f"on the equilibria of model B2: {b2}. Letters mark the article's cases."
    )
    made = origin(__name__, found.provenance, printed.provenance)
    return Drawing(angle_figure(found, printed), text, "Maps over the spring angles", made)
