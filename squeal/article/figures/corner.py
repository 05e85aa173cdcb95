"""Where the numbers of the pads lie that the last populations hold: one law on either side."""

import numpy as np
from matplotlib.figure import Figure

from squeal.article.results.ensembles import CORNER, SYMBOLS, Ensembles
from squeal.plots.style import DOUBLE, Drawing, origin, style

COLOURS = ("#3498DB", "#C8380E")


def draw(found: Ensembles) -> Drawing:
    """The figure, ready to be saved."""
    searched = next(iter(found.ranges.values()))
    names = list(searched)
    ends = {
        name: [f"{end:g}".replace("-", "\N{MINUS SIGN}") for end in searched[name].searched]
        for name in CORNER
    }
    labels = {name: SYMBOLS[name] + " (log)" * searched[name].log for name in CORNER}
    points = {law: np.array(rows) for law, rows in found.samples.items()}
    size = len(CORNER)
    with style():
        figure = Figure(figsize=(DOUBLE, 0.84 * DOUBLE))
        grid = figure.subplots(size, size, squeeze=False)
        for row, below in enumerate(CORNER):
            for column, across in enumerate(CORNER):
                axes = grid[row, column]
                x, y = names.index(across), names.index(below)
                for side, (law, values) in zip((-1, 1), points.items(), strict=True):
                    colour = COLOURS[side > 0]
                    if row == column:
                        label, bins = law if row == 0 else None, np.linspace(0.0, 1.0, 16)
                        axes.hist(values[:, x], bins, histtype="step", color=colour, label=label)
                    elif side == np.sign(column - row):  # one law below the diagonal, one above
                        axes.plot(values[:, x], values[:, y], ".", color=colour, ms=4.0, mew=0)
                        axes.set_ylim(0.0, 1.0)
                axes.set_xlim(0.0, 1.0)
                axes.set_yticks([])
                axes.set_xticks([0.0, 1.0], ends[across] if row == size - 1 else ["", ""])
                if row == size - 1:
                    axes.set_xlabel(labels[across], labelpad=1.0)
                if column == 0 and row:
                    axes.set_yticks([0.0, 1.0], ends[below])
                    axes.set_ylabel(labels[below], labelpad=1.0)
        figure.legend(loc="outside upper center", ncols=2)
    widths = {
        law: ", ".join(f"{name} {100 * ranges[name].width:.0f} %" for name in CORNER)
        for law, ranges in found.ranges.items()
    }
    words = "; ".join(f"{law}: {text}" for law, text in widths.items())
    text = (
        "The numbers of the pads in the last populations of two laws, pair by pair: one law below "
        "the diagonal, the other above, and histograms of both on it. Width of the "
        f"middle nine tenths over the searched range, {words}."
    )
    title = "Numbers of the pads that keep most"
    return Drawing(figure, text, title, origin(__name__, found.provenance))
