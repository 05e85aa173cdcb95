"""What the pads of all formulations keep, by search, and by chance."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from squeal.article.results.ensembles import Ensembles
from squeal.plots.style import DOUBLE, Drawing, origin, style

SMALL = 7.5


def names(found: Ensembles) -> list[str]:
    """A formulation in two lines: force, then where delta is from and the moment's sign."""
    return [
        f"{e.formulation.line_force}\n{e.formulation.delta_from} "
        + e.formulation.delta_moment.replace("-", "\N{MINUS SIGN}")
        for e in found.ensembles
    ]


def _counts(axes: Axes, found: Ensembles) -> None:
    for at, e in enumerate(found.ensembles):
        most = [seed.most.counted for seed in e.seeds]
        spread = np.linspace(-0.2, 0.2, len(most))
        axes.plot(at + spread, most, "o", color="#3498DB", ms=3.5, zorder=3)
        axes.plot(at, e.best.counted, "_", color="#C8380E", ms=11, mew=1.4)
        axes.plot(at, e.median.counted, "_", color="0.4", ms=11, mew=1.4)
    labels = ("best of a search", "best random pad", "median random pad that runs")
    styles = (("o", "#3498DB", 3.5), ("_", "#C8380E", 11), ("_", "0.4", 11))
    for label, (marker, colour, size) in zip(labels, styles, strict=True):
        axes.plot([], [], marker, color=colour, ms=size, mew=1.4, ls="none", label=label)
    axes.axhline(found.total.counted - 1, color="k", lw=0.6, ls=":")
    axes.set_ylim(0, found.total.counted + 0.5)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel("counted statements kept")
    axes.set_xticks(range(len(found.ensembles)), [])
    axes.set_xlim(-0.5, len(found.ensembles) - 0.5)
    axes.legend(loc="lower center", ncols=3, columnspacing=1.2, handletextpad=0.3)


def _statements(axes: Axes, found: Ensembles) -> None:
    ids = list(found.counted)
    table = np.array([[e.best_pads[i].share for e in found.ensembles] for i in ids])
    axes.imshow(table, cmap="Blues", vmin=0.0, vmax=1.6, aspect="auto")
    for (row, column), share in np.ndenumerate(table):
        e = found.ensembles[column]
        chance = e.chance[ids[row]].share
        words = f"{share * len(e.seeds):.0f} ({100 * chance:.2g} %)"
        axes.text(column, row, words, ha="center", va="center", fontsize=SMALL)
    axes.set_yticks(range(len(ids)), ids, fontsize=SMALL)
    axes.set_xticks(range(len(found.ensembles)), names(found), fontsize=SMALL)
    axes.tick_params(length=0)


def draw(found: Ensembles) -> Drawing:
    """The figure, ready to be saved."""
    with style():
        figure = Figure(figsize=(DOUBLE, 6.4))
        upper, lower = figure.subplots(2, 1, gridspec_kw={"height_ratios": [1.0, 2.0]})
        _counts(upper, found)
        _statements(lower, found)
        for axes, letter in ((upper, "a"), (lower, "b")):
            axes.text(-0.1, 1.0, f"({letter})", transform=axes.transAxes, va="bottom", ha="right")
    parts = []
    for e in found.ensembles:
        most = [seed.most.counted for seed in e.seeds]
        name = ", ".join(vars(e.formulation).values())
        least, best = min(most), max(most)
        parts.append(f"{name}: {least} to {best}, by chance at most {e.best.counted}")
    text = (
        f"Counted statements of {found.total.counted} that the best pads of the searches "
        f"keep, by formulation: {'; '.join(parts)}. Below, how many searches end in a pad that "
        "keeps each statement, and the share of random pads that keep it."
    )
    return Drawing(figure, text, "What the ensembles keep", origin(__name__, found.provenance))
