"""One panel of an answer: a column of its table over another one, in an Axes of the user."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from squeal.io.writing import Answer, Column, Mark
from squeal.plots.conditions import draw_matrix
from squeal.plots.energy import draw_terms
from squeal.plots.maps import COLOUR_OF, label_axis
from squeal.plots.style import DOUBLE, Drawing, literal, origin, style
from squeal.queries.energy_sweep import EnergySweep
from squeal.results.conditions import Conditions
from squeal.results.map import Map

Row = Mapping[str, Any]


def panel_drawing(answer: Answer, name: str) -> Drawing:
    """The panel as a figure of its own."""
    title = f"{type(answer).__name__} of {name}"
    with style():
        figure = Figure(figsize=(DOUBLE, 3.2))
        axes = figure.add_subplot()
        draw_panel(answer, axes)
    text = f"{title}: {axes.get_ylabel()} over {axes.get_xlabel()}."
    return Drawing(figure, text, title, origin(__name__))


def draw_panel(answer: Answer, axes: Axes, **look: Any) -> None:
    """Draw an answer into an Axes: a column of its table over another one, as its `panel` says.

    Maps, conditions and energies have panels of their own. `look` goes to Matplotlib's artists.
    """
    if isinstance(answer, Map):
        _draw_map(answer, axes, **look)
        return
    if isinstance(answer, Conditions):
        draw_matrix(answer, axes, **look)
        return
    if isinstance(answer, EnergySweep):
        for fastest in answer.modes[:1]:  # none without a mode
            draw_terms(answer, axes, fastest, **look)
        return
    panel = answer.panel
    columns = answer.table().columns
    x_column = _column(columns, panel.x)
    y_column = _column(columns, panel.y)
    x = x_column.name
    y = y_column.name
    rows = []  # those that have both values
    for row in answer.to_records():
        if row[x] is not None and row[y] is not None:
            rows.append(row)
    axes.set_xlabel(literal(x_column.head))
    axes.set_ylabel(literal(y_column.head))
    if panel.mark is Mark.BARS:
        _draw_bars(axes, rows, x, y, panel.each, **look)
    elif panel.mark is Mark.LINES:
        _draw_lines(axes, rows, x, y, panel.each, **look)
    elif panel.mark is Mark.STEPS:
        axes.step(_cells(rows, x), _cells(rows, y), where="post", **look)
    else:
        points = {"marker": ".", "linestyle": ""} | look
        axes.plot(_cells(rows, x), _cells(rows, y), **points)


def _column(columns: Sequence[Column], key: str | int) -> Column:
    """A column by its name or by its index."""
    if isinstance(key, int):
        return columns[key]
    return next(column for column in columns if column.name == key)


def _cells(rows: Sequence[Row], name: str) -> list[Any]:
    """The values of a column."""
    return [row[name] for row in rows]


def _draw_bars(axes: Axes, rows: Sequence[Row], x: str, y: str, each: str, **look: Any) -> None:
    """Horizontal bars of y labelled by x, the first row on top.

    each: the column whose value in the first row selects the rows that are drawn; "" for all.
    """
    if each:
        title = each
        if rows:
            selected = rows[0][each]
            rows = [row for row in rows if row[each] == selected]
            title = f"{each} {selected}"
        axes.set_title(literal(title), loc="left")
    labels = [literal(str(row[x])) for row in rows]
    heights = range(len(rows))
    axes.barh(heights, _cells(rows, y), **look)
    axes.set_yticks(heights, labels)
    axes.invert_yaxis()
    # bars lie along the horizontal axis, which gets the label of y; those of x are beside the bars
    axes.set_xlabel(axes.get_ylabel())
    axes.set_ylabel("")


def _draw_lines(axes: Axes, rows: Sequence[Row], x: str, y: str, each: str, **look: Any) -> None:
    """A line for each value of the column `each`, or one."""
    if not each:
        axes.plot(_cells(rows, x), _cells(rows, y), **look)
        return
    rows_of: dict[Any, list[Row]] = {}
    for row in rows:
        rows_of.setdefault(row[each], []).append(row)
    for value, of_line in rows_of.items():
        label = {"label": f"{each} {value}"} | look
        axes.plot(_cells(of_line, x), _cells(of_line, y), **label)


def _draw_map(answer: Map, axes: Axes, **look: Any) -> None:
    """Draw the quantity of a map, if it has one, else its verdicts in their colours."""
    first, second = answer.axes
    values: NDArray[Any] = answer.codes  # indices of verdicts
    if answer.quantity is not None:
        _, _, values = answer.quantity
        defaults: dict[str, Any] = {}
    else:
        colours = [COLOUR_OF[verdict] for verdict in answer.verdicts]
        defaults = {"cmap": ListedColormap(colours), "vmin": -0.5, "vmax": len(colours) - 0.5}
    axes.pcolormesh(first.values, second.values, values.T, shading="nearest", **(defaults | look))
    label_axis(axes, "x", first)
    label_axis(axes, "y", second)
