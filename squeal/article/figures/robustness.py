"""Robustness: which claims hold around the best pad, and which number breaks one first."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.article.results.robustness import SYMBOLS, Break, Robustness, Sample
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

WAYS = {"more": ("^", "#C8380E", -0.2), "less": ("v", "#3498DB", 0.2)}
SMALL = 7.5


def _shares(axes: Axes, samples: Sequence[Sample]) -> None:
    ids = list(samples[0].claims)
    table = np.array([[s.claims[i].share for s in samples] for i in ids])
    axes.imshow(table, cmap="Blues", vmin=0.0, vmax=1.6, aspect="auto")
    for (row, column), share in np.ndenumerate(table):
        axes.text(column, row, f"{100 * share:.0f}", ha="center", va="center", fontsize=SMALL)
    axes.set_yticks(range(len(ids)), ids, fontsize=SMALL)
    axes.set_xticks(range(len(samples)), [s.sample for s in samples])
    axes.tick_params(length=0)
    axes.set_title("share of pads that keep a statement [%]")
    axes.set_xlabel("scatter of all numbers about the pad")


def _label(claims: Sequence[str]) -> str:
    return claims[0] + (f" and {len(claims) - 1} more" if len(claims) > 1 else "")


def _breaks(axes: Axes, breaks: Sequence[Break]) -> None:
    names = list(dict.fromkeys(b.number for b in breaks))
    for b in breaks:
        marker, colour, offset = WAYS[b.way]
        row = names.index(b.number) + offset
        if b.change is None:
            axes.text(110, row, f"none ({b.way})", ha="right", va="center", fontsize=SMALL)
            continue
        percent = 100 * b.change
        axes.plot(percent, row, marker, color=colour, ms=4)
        x, side = (-5, "right") if percent > 4 else (5, "left")
        look: Any = {"textcoords": "offset points", "va": "center", "fontsize": SMALL}
        axes.annotate(_label(b.claims), (percent, row), (x, 0), ha=side, **look)
    for way, (marker, colour, _) in WAYS.items():
        axes.plot([], [], marker, color=colour, ms=4, label=way)
    axes.set_xscale("log")
    axes.set_xlim(0.08, 130)
    axes.set_xticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    axes.set_ylim(len(names) + 0.2, -0.5)
    axes.set_yticks(range(len(names)), [SYMBOLS[n] for n in names])
    axes.grid(axis="y", which="major", color="0.92", linewidth=8, zorder=0)
    axes.set_axisbelow(True)
    axes.set_title("change of one number at which a statement first breaks", pad=6)
    axes.set_xlabel("change [%]")
    axes.legend(loc="lower left", ncols=1, borderaxespad=0.4, labelspacing=0.2)


def robustness(found: Robustness) -> Figure:
    """Shares of pads that keep each claim, and the first break by each number."""
    figure = Figure(figsize=(DOUBLE, 6.2))
    left, right = figure.subplots(1, 2, gridspec_kw={"width_ratios": [1.0, 1.5]})
    _shares(left, found.samples)
    _breaks(right, found.breaks)
    return figure


def alternative(found: Robustness) -> str:
    """The picture in words."""
    medians = ", ".join(f"{s.median_kept:.0f} ({s.sample})" for s in found.samples)
    broken = [(b.change, b) for b in found.breaks if b.change is not None]
    text = f"Median number of claims kept by pads that scatter about the best one: {medians}."
    if broken:
        change, first = min(broken, key=lambda pair: pair[0])
        text += (
            f" The most delicate number is {first.number}: {100 * change:.2g} per cent "
            f"{first.way} breaks {' and '.join(first.claims)}."
        )
    return text


def draw(found: Robustness) -> Drawing:
    """The figure, ready to be saved."""
    if not found.samples:
        return blank("Robustness of the claims", found.left_out, __name__, found.provenance)
    with style():
        figure = robustness(found)
    made = origin(__name__, found.provenance)
    return Drawing(figure, alternative(found), "Robustness of the claims", made)
