"""Periodic motions over friction beside the sliding equilibrium, from the study `onset`."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.article.studies.onset import GREATEST, Cycles, Onset
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

TITLES = {"b1-d": "B1 (d)", "b2-d-integral": "B2 (d)", "b2-c-integral": "B2 (c)"}
LOOKS: dict[bool, dict[str, Any]] = {
    True: {"color": "#C8380E", "lw": 1.5},
    False: {"color": "k", "lw": 0.9, "ls": (0, (3, 1.5))},
}
"""Of stable and unstable motions."""
EDGES: dict[str, dict[str, Any]] = {
    "trailing": {"color": "#6A1B7B", "lw": 0.9, "ls": "-"},
    "leading": {"color": "#3498DB", "lw": 1.1, "ls": (0, (1, 1))},
}
"""Forces at the edges of B1, beside their sum."""
SHIFTS = {"trailing": 2.0, "leading": -27.0}  # of their labels, clear of the other curves
CAPTION = r"""Periodic motions over friction under modal damping: peak of the whole contact force,
the sum of both edges. The damping ratio is \val[p1]{onset.ratio}. Solid: stable; dashed: unstable.
On points: peaks of the force at the trailing (thin) and at the leading edge (dotted) too, which do
not occur at once; on the unstable branch of (a) the sum is greatest when the trailing edge is, and
the two curves coincide. Bar below: the sliding equilibrium is stable (grey) or flutters (black).
Ring: the friction of the reference set. The curve of (c) begins where contact begins to change, and
ends where the lower face becomes as fast as the surface."""


def _label(axes: Axes, mu: np.ndarray, values: np.ndarray, text: str, shift: float) -> None:
    """Write a text `shift` points above the greatest value of a curve."""
    greatest = int(np.argmax(values))
    offset: Any = {
        "xytext": (0.0, shift),
        "textcoords": "offset points",
        "ha": "left",
        "va": "bottom",
    }
    axes.annotate(text, (mu[greatest], values[greatest]), **offset)


def _panel(axes: Axes, cycles: Cycles) -> None:
    """Draw peak forces of the branch over friction, and below them where sliding is stable."""
    mu = np.array([point.mu for point in cycles.branch])
    peak = np.array([point.peak for point in cycles.branch])
    stable = np.array([point.stable for point in cycles.branch])
    changes = np.flatnonzero(np.diff(stable)) + 1
    # parts of the branch that are all stable or all unstable, as indices of their points
    for part in np.split(np.arange(len(mu)), changes):
        first = part[0]
        shown = slice(first, part[-1] + 2)  # the first point of the next part closes the gap
        axes.plot(mu[shown], peak[shown], **LOOKS[bool(stable[first])])
    for edge, look in EDGES.items():
        values = [getattr(point, edge) for point in cycles.branch]
        if None not in values:  # B1 alone has forces at the edges
            axes.plot(mu, values, gid=edge, **look)
            _label(axes, mu, np.array(values), edge, SHIFTS[edge])
    # of B2, which touches along one line, the sum is the only curve and needs no label
    if cycles.own.leading is not None:
        _label(axes, mu, peak, "sum", 2.0)
    # a ring at the friction of the reference set
    axes.plot(cycles.own.mu, cycles.own.peak, "o", mfc="none", mec="k", ms=5)
    high = 1.2 * peak.max()
    # the bar below: grey over all friction, black where the equilibrium flutters
    axes.fill_between([0.0, GREATEST], -0.07 * high, 0.0, color="0.75", lw=0.0)
    for interval in cycles.unstable:
        axes.fill_between(interval, -0.07 * high, 0.0, color="k", lw=0.0)
    axes.set_xlim(0.0, GREATEST)
    axes.set_ylim(-0.07 * high, high)
    axes.set_xlabel(r"friction $\mu$")


def draw(record: Onset) -> Drawing:
    """The figure, ready to be saved."""
    title = "Periodic motions over friction"
    shown = {}
    for name in TITLES:
        cycles = record.cycles.get(name)
        if isinstance(cycles, Cycles):
            shown[name] = cycles
    if not shown:
        why = record.left_out or "No motion that lasts is periodic."
        return blank(title, why, __name__, record.provenance)
    with style():
        figure = Figure(figsize=(DOUBLE, 2.2))
        panels = figure.subplots(1, len(shown), squeeze=False)[0]
        for axes, letter, (name, cycles) in zip(panels, "abc", shown.items(), strict=False):
            _panel(axes, cycles)
            axes.set_title(f"({letter}) {TITLES[name]}", loc="left", pad=3.0)
        panels[0].set_ylabel("peak contact force over $F_n$")
    parts = []
    for name, cycles in shown.items():
        flutter = "nowhere" if cycles.threshold is None else f"from {cycles.threshold:.3g}"
        parts.append(f"{TITLES[name]} from {cycles.fold:.3g}, flutter of the equilibrium {flutter}")
    text = f"Peak force of periodic motions over the friction coefficient. {'; '.join(parts)}."
    return Drawing(figure, text, title, origin(__name__, record.provenance))
