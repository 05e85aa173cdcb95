"""The matrix of operating conditions, coloured by growth."""

import itertools
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from squeal.io.writing import number
from squeal.plots.maps import symbol_of
from squeal.plots.style import DOUBLE, Drawing, origin, style
from squeal.results.conditions import Conditions

NAMED = 160  # cells up to which each growing one names its frequency
TICKS = 24  # rows or columns that are named
DARK = 0.75  # share of the largest growth from which on a cell is dark
UNKNOWN = "#BBBBBB"  # a condition without an answer


def conditions_drawing(answer: Conditions, name: str) -> Drawing:
    """Rows and columns of conditions: white where nothing grows, the darker the faster it grows,
    the frequency of the fastest mode in the cell."""
    rows, _ = _sides(answer)
    with style():
        height = 1.2 + 0.26 * min(len(rows), TICKS)
        figure = Figure(figsize=(DOUBLE, max(height, 2.2)))
        axes = figure.add_subplot()
        coloured = draw_matrix(answer, axes)
        figure.colorbar(coloured, ax=axes, label="growth rate [1/s]", pad=0.02)
        axes.set_title("frequency of the fastest mode in kHz", loc="left")
    each = "; ".join(
        f"{mode.frequency_hz:.4g} Hz at {100 * mode.propensity:.3g} % of the conditions"
        for mode in answer.modes
    )
    text = (
        f"Matrix of operating conditions of {name}. {answer.conclusion}. Modes: {each or 'none'}."
    )
    return Drawing(figure, text, f"Operating conditions of {name}", origin(__name__))


def draw_matrix(answer: Conditions, axes: Axes, **look: object) -> ScalarMappable:
    """Draw the matrix into an Axes; `look` goes to its cells."""
    row_axes, column_axes = _names(answer)
    rows, columns = _sides(answer)
    growth = np.zeros(len(answer.conditions))
    for k, condition in enumerate(answer.conditions):
        if condition.reason is not None:
            growth[k] = np.nan
        elif condition.modes:
            growth[k] = condition.modes[0].growth_rate
    largest = float(np.nanmax(growth, initial=0.0)) or 1.0
    colours = matplotlib.colormaps["OrRd"].with_extremes(under="white", bad=UNKNOWN)
    least = largest * 1e-12  # what grows is coloured, however slowly
    own: dict[str, Any] = {
        "cmap": colours,
        "norm": Normalize(least, largest),
        "edgecolors": "0.8",
        "linewidth": 0.4,
    }
    cells = axes.pcolormesh(growth.reshape(len(rows), len(columns)), **(own | look))
    if len(answer.conditions) <= NAMED:
        for k, condition in enumerate(answer.conditions):
            if condition.modes:
                row, column = divmod(k, len(columns))
                fastest = condition.modes[0]
                is_dark = fastest.growth_rate > DARK * largest
                axes.text(
                    column + 0.5,
                    row + 0.5,
                    number(fastest.frequency_hz / 1e3, 3),
                    ha="center",
                    va="center",
                    fontsize=7,
                    color="white" if is_dark else "black",
                )
    x_places, x_labels = _ticks(columns, "\n")
    y_places, y_labels = _ticks(rows, ", ")
    axes.set_xticks(x_places, x_labels)
    axes.set_yticks(y_places, y_labels)
    axes.tick_params(length=0.0)
    axes.set_xlabel(", ".join(map(symbol_of, column_axes)))
    axes.set_ylabel(", ".join(map(symbol_of, row_axes)))
    return cells


def _names(answer: Conditions) -> tuple[list[str], list[str]]:
    """The parameters along rows and along columns: the last ones vary fastest, along columns."""
    names = list(answer.axes)
    half = len(names) // 2
    return names[:half], names[half:]


def _sides(answer: Conditions) -> tuple[list[tuple[float, ...]], list[tuple[float, ...]]]:
    """The values of these parameters in each row, and in each column."""
    rows, columns = _names(answer)
    return (
        list(itertools.product(*(answer.axes[name] for name in rows))),
        list(itertools.product(*(answer.axes[name] for name in columns))),
    )


def _ticks(values: Sequence[tuple[float, ...]], between: str) -> tuple[list[float], list[str]]:
    """Places and labels of the rows or columns that are named."""
    step = -(-len(values) // TICKS)
    places = []
    labels = []
    for k in range(0, len(values), step):
        places.append(k + 0.5)
        labels.append(between.join(number(value, 4) for value in values[k]))
    return places, labels
