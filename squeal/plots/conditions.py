"""The matrix of operating conditions, coloured by growth."""

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from squeal.plots.maps import symbol, symbol_of
from squeal.plots.style import DOUBLE, Drawing, engineering, origin, style
from squeal.results.conditions import Condition, Conditions

NAMED = 160  # cells up to which each growing one names its frequency
TICKS = 24  # rows or columns that are named
DARK = 0.6  # share of the largest growth from which on a cell is dark
LEAST = 1e-12  # share of it from which on a cell is coloured: all that grows, however slowly
UNKNOWN = "#BBBBBB"  # a condition without an answer
LOOKS_WITHOUT_GROWTH: dict[str, dict[str, Any]] = {
    "stable": {"fc": "white"},
    "marginal": {"fc": "white", "hatch": "////"},
    "open": {"fc": "white", "hatch": "...."},
    "no answer": {"fc": UNKNOWN},
}
"""Cells in which nothing grows, or nothing is known to grow, by what the legend says of them."""


def conditions_drawing(answer: Conditions, name: str) -> Drawing:
    """Draw the matrix with its colour bar and legend: a cell for each condition.

    A cell is white where nothing grows, and the darker the faster the fastest mode grows. It names
    the frequency of that mode, and how many modes grow if these are several.
    """
    row_count = len(_combinations(answer, _sides(answer).rows))
    with style():
        height = 1.5 + 0.26 * min(row_count, TICKS)
        figure = Figure(figsize=(DOUBLE, max(height, 2.2)))
        axes = figure.add_subplot()
        coloured = draw_matrix(answer, axes)
        figure.colorbar(coloured, ax=axes, label="growth rate [1/s]", pad=0.02)
        title = "frequency of the fastest mode in kHz"
        if any(len(condition.modes) > 1 for condition in answer.conditions):
            title += ", in brackets how many grow if more than one"
        axes.set_title(title, loc="left")
        entries = _entries(answer)
        if entries:
            figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))
    modes = []
    for mode in answer.modes:
        percent = f"{100 * mode.propensity:.3g} %"
        modes.append(f"{mode.frequency_hz:.4g} Hz at {percent} of the conditions")
    text = f"Matrix of operating conditions of {name}. {answer.conclusion}. "
    text += f"Modes: {'; '.join(modes) or 'none'}."
    return Drawing(figure, text, f"Operating conditions of {name}", origin(__name__))


def draw_matrix(answer: Conditions, axes: Axes, **look: object) -> ScalarMappable:
    """Draw the matrix into an Axes, and return its cells for a colour bar (growth rate, 1/s).

    `look` goes to the cells.
    """
    sides = _sides(answer)
    rows = _combinations(answer, sides.rows)
    columns = _combinations(answer, sides.columns)
    growth = np.zeros(len(answer.conditions))  # the fastest of each, NaN without an answer
    for k, condition in enumerate(answer.conditions):
        if condition.reason is not None:
            growth[k] = np.nan
        elif condition.modes:  # those that grow, the fastest first
            growth[k] = condition.modes[0].growth_rate
    largest = float(np.nanmax(growth, initial=0.0)) or 1.0
    defaults: dict[str, Any] = {
        "cmap": matplotlib.colormaps["OrRd"].with_extremes(under="white", bad=UNKNOWN),
        "norm": Normalize(LEAST * largest, largest),
        "edgecolors": "0.8",
        "linewidth": 0.4,
    }
    # the parameters of the columns vary fastest
    cells = axes.pcolormesh(growth.reshape(len(rows), len(columns)), **(defaults | look))
    for k, condition in enumerate(answer.conditions):
        hatched = LOOKS_WITHOUT_GROWTH.get(_kind_without_growth(condition), {})
        if "hatch" in hatched:
            row, column = divmod(k, len(columns))
            axes.add_patch(Rectangle((column, row), 1.0, 1.0, ec="0.8", lw=0.4, **hatched))
    if len(answer.conditions) <= NAMED:
        _name_frequencies(axes, answer, len(columns), DARK * largest)
    axes.set_xticks(*_ticks(columns, "\n"))
    axes.set_yticks(*_ticks(rows, ", "))
    axes.tick_params(length=0.0)
    axes.set_xlabel(", ".join(_label(answer, name) for name in sides.columns))
    axes.set_ylabel(", ".join(_label(answer, name) for name in sides.rows))
    return cells


def _label(answer: Conditions, name: str) -> str:
    """A parameter as it stands on an axis: with its unit, where that is known, as of a pad."""
    unit = answer.units.get(name)
    if unit is None:
        return symbol_of(name)
    return symbol(name) if unit == "1" else f"{symbol(name)} [{unit}]"


def _kind_without_growth(condition: Condition) -> str:
    """The key of `LOOKS_WITHOUT_GROWTH` of a condition; "" where a mode grows."""
    if condition.reason is not None:
        return "no answer"
    return "" if condition.modes else condition.verdict or "open"


def _entries(answer: Conditions) -> list[Patch]:
    """What a legend shows of the conditions at which nothing grows."""
    present = {_kind_without_growth(condition) for condition in answer.conditions}
    entries = []
    for name, look in LOOKS_WITHOUT_GROWTH.items():
        if name in present:
            entries.append(Patch(ec="0.6", lw=0.4, label=name, **look))
    return entries


def _name_frequencies(axes: Axes, answer: Conditions, columns: int, dark: float) -> None:
    """Write the frequency (kHz) of the fastest mode into each cell, and how many grow if several.

    columns: how many columns of cells there are. A cell is dark above the growth rate `dark`, and
    its text white.
    """
    for k, condition in enumerate(answer.conditions):
        if not condition.modes:
            continue
        row, column = divmod(k, columns)  # the parameters of the columns vary fastest
        fastest = condition.modes[0]
        text = f"{fastest.frequency_hz / 1e3:#.3g}".rstrip(".")
        if len(condition.modes) > 1:
            text += f" ({len(condition.modes)})"
        axes.text(
            column + 0.5,
            row + 0.5,
            text,
            ha="center",
            va="center",
            fontsize=7,
            color="white" if fastest.growth_rate > dark else "black",
        )


class _Sides(NamedTuple):
    """Names of the parameters that vary from row to row, and from column to column."""

    rows: list[str]
    columns: list[str]


def _sides(answer: Conditions) -> _Sides:
    """The first half of the parameters along the rows, the others, which vary fastest, along the
    columns."""
    names = list(answer.axes)
    half = len(names) // 2
    return _Sides(names[:half], names[half:])


def _combinations(answer: Conditions, names: Sequence[str]) -> list[tuple[float, ...]]:
    """The values of some parameters in each row, or in each column."""
    return list(itertools.product(*(answer.axes[name] for name in names)))


def _ticks(values: Sequence[tuple[float, ...]], between: str) -> tuple[list[float], list[str]]:
    """Positions and labels of the rows or columns that are named: at most `TICKS`, evenly spaced.

    values: of each row or column those of its parameters; between: stands between them in a label.
    """
    step = math.ceil(len(values) / TICKS)
    positions = []
    labels = []
    for k in range(0, len(values), step):
        positions.append(k + 0.5)  # the middle of a cell
        labels.append(between.join(map(engineering, values[k])))
    return positions, labels
