"""The verdicts on random parameter sets, and what searches reach, from the study `ensemble`."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.article.studies._scenes import REFERENCE
from squeal.article.studies.ensemble import Ensemble, Share
from squeal.article.studies.sets import ParameterSet, Sets
from squeal.plots.style import DOUBLE, Drawing, origin, style

SHOWN = {
    "restless": "no motion settles",
    "permanent_some": "small release: points stay on in some case",
    "two_alike": "two like points lose it as long as the line",
    "points_longer": "points lose contact longer",
    "line_longer_all_edges": "the line longer, counting all edges",
    "differ": "points hammer in some cases, not in all",
    "locked_line": "the line separates only by rotation",
    "c_only": "(c) alone hammers with both models",
    "separates_fluttering": "line separates in (c) if (c) flutters",
    "separates_stable": "line separates in (c) if (c) is stable",
}
"""Properties by name, and in words."""
COEXIST = "contact lost beside stable sliding, 1 %"
RANDOM = "0.75"
SHUFFLED = "#E69F00"
PRINTED = "#3B0F4A"
CAPTION = r"""Random parameter sets within physical bounds (\val{ensemble.groups.all} valid
sets). (a)~Share of the sets for which each statement holds, with
95\,\% intervals, which include undecided sets; the last row is under modal damping of
\val[p0]{ensemble.ratio}, of \val{ensemble.damped} sets. (b)~Share of time in which an edge is
separated that touches in steady sliding, means over the cases of each set; cross: reference set.
(c)~Independent statements satisfied: by random sets (grey), and by searches that fit the article's
statements or shuffled ones."""


def _interval(axes: Axes, y: float, share: Share) -> None:
    """Draw a share as a point on its interval, in per cent."""
    low, high = share.interval
    axes.plot([100.0 * low, 100.0 * high], [y, y], color="k", lw=1.2, zorder=3)
    axes.plot(100.0 * share.share, y, "o", color=PRINTED, ms=4, zorder=4)


def _shares(axes: Axes, record: Ensemble) -> None:
    """Draw a row for each property, from top to bottom: the share of the sets that have it."""
    shown = {words: record.shares[name]["all"] for name, words in SHOWN.items()}
    shown[COEXIST] = record.coexist["either"]
    for y, share in enumerate(shown.values()):
        axes.axhline(y, color="0.9", lw=0.6, zorder=1)
        _interval(axes, y, share)
    axes.set_yticks(range(len(shown)), [*shown])
    axes.set_ylim(len(shown) - 0.5, -0.5)
    axes.set_xlim(-3.0, 103.0)
    axes.tick_params(axis="y", length=0.0)
    axes.set_xlabel("share of the sets [%]")


def _lost(axes: Axes, record: Ensemble, reference: ParameterSet) -> None:
    """Draw the share of time without contact on the line over that on points, a dot per set."""
    points, line = np.array(record.lost).T / 10.0  # stored per mille
    axes.plot([0, 100], [0, 100], "k-", lw=0.6)
    axes.plot(points, line, ".", color="#1F6FA8", ms=2.4, mew=0.0)
    own = [100.0 * reference.lost[model] for model in ("B1", "B2")]
    axes.plot(*own, "x", color="k", ms=7, mew=1.6)
    axes.set_xlim(0, 100)
    axes.set_ylim(0, 100)
    axes.set_xlabel("lost, points [%]")
    axes.set_ylabel("lost, line [%]")


def _statements(axes: Axes, record: Ensemble) -> None:
    """Draw the share of sets by the number of statements that they satisfy.

    The sets are random ones, and those at which searches ended.
    """
    total = sum(record.counts)  # record.counts[k]: random sets that satisfy k statements
    values = np.arange(record.statements + 1)
    axes.bar(values, np.array(record.counts) / total, width=0.9, color=RANDOM, label="random")
    looks = {"shuffled": (SHUFFLED, "//", -0.2), "printed": (PRINTED, "", 0.2)}
    for kind, (colour, hatch, shift) in looks.items():
        satisfied = record.searches[kind].satisfied  # by the set at which each search ended
        share = np.bincount(satisfied, minlength=len(values)) / len(satisfied)
        label = "fit, shuffled" if kind == "shuffled" else "fit, article's"
        axes.bar(
            values + shift, share, width=0.4, color=colour, hatch=hatch, ec="k", lw=0.4, label=label
        )
    axes.set_xlim(-0.6, record.statements + 0.6)
    axes.set_xticks([0, 4, 8, 12, 16])
    axes.set_xlabel("statements satisfied")
    axes.set_ylabel("share of sets")
    axes.set_ylim(0.0, 0.42)
    axes.legend(loc="upper right", handlelength=1.2)


def ensemble_figure(record: Ensemble, reference: ParameterSet) -> Figure:
    """Shares with intervals, lost contact of points and line, statements satisfied."""
    with style():
        figure = Figure(figsize=(DOUBLE, 2.55))
        left, middle, right = figure.subplots(1, 3, width_ratios=[1.1, 1.2, 1.2])
        _shares(left, record)
        _lost(middle, record, reference)
        _statements(right, record)
        for letter, axes in zip("abc", (left, middle, right), strict=True):
            axes.set_title(f"({letter})", loc="left", pad=3.0)
    return figure


def draw(record: Ensemble, sets: Sets) -> Drawing:
    """The figure, ready to be saved."""
    rows = "; ".join(
        f"{words} {100 * record.shares[name]['all'].share:.0f} %" for name, words in SHOWN.items()
    )
    printed = record.searches["printed"]
    shuffled = record.searches["shuffled"]
    text = (
        f"Of {record.groups['all']} random parameter sets: {rows}. Random sets satisfy "
        f"{record.median} of {record.statements} statements in the median, searches with the "
        f"article's statements {printed.median:g}, with shuffled statements {shuffled.median:g}."
    )
    figure = ensemble_figure(record, sets.sets[REFERENCE])
    made = origin(__name__, record.provenance, sets.provenance)
    return Drawing(figure, text, "Verdicts on random parameter sets", made)
