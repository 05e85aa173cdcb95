"""Maps over two parameters: verdicts as cells, and contours."""

import math
import re
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from squeal.plots.style import SINGLE, Drawing, literal, origin, style
from squeal.queries.pads.maps import NAMES, QUANTITIES
from squeal.results.map import Axis, Map

VERDICT_COLOURS = ("#FFFFFF", "#CFE6F5", "#C8380E", "#6A1B7B", "#8C8C8C", "#E0B040")
"""Colours of `NAMES`: stable, marginal, flutter, divergence, beyond a fold, unknown."""
BEYOND = "beyond a fold"
COLOUR_OF = dict(zip(NAMES, VERDICT_COLOURS, strict=True))
QUARTERS = ([0.0, 0.25, 0.5, 0.75, 1.0], ["$0$", r"$\pi/4$", r"$\pi/2$", r"$3\pi/4$", r"$\pi$"])
"""Ticks of an axis from 0 to pi, over pi, and their labels."""
THRESHOLD = "#E69F00"  # of the curves on which stability is lost
NO_VALUE = "0.85"  # where a quantity has none
OWN_LEVEL = "#C8380E"  # of the contour at the scene's own value
GREEK = {"alpha": r"\alpha", "theta": r"\theta", "mu": r"\mu"}

Own = tuple[float, float] | None
"""The pad's own values of both parameters; None where the map is one of a system."""


def symbol(name: str) -> str:
    """A parameter's symbol in mathtext: alpha1 becomes \\alpha_1."""
    if name in GREEK:
        return f"${GREEK[name]}$"
    # letters, and perhaps an index: one digit or small letter, or several behind an underscore
    parts = re.fullmatch(r"([A-Za-z]+?)_?(\d|[a-z]|(?<=_)\w+)?", name)
    assert parts is not None
    letters, index = parts.groups()
    base = GREEK.get(letters, letters)
    if not index:
        return f"${base}$"
    return f"${base}_{index}$" if len(index) == 1 else f"${base}_{{{index}}}$"


def symbol_of(parameter: str) -> str:
    """The free parameter of a pad or system as it stands on an axis."""
    return symbol(parameter) if parameter == "mu" else literal(parameter)


def friction_symbol(parameter: str, unit: str = "") -> str:
    """A parameter's symbol as it stands at an axis: the word friction before mu, a unit behind."""
    if parameter == "mu":
        return f"friction {symbol(parameter)}"
    if unit:
        return f"{literal(parameter)} [{unit}]"
    return literal(parameter)


def _finish_axes(axes: Axes, answer: Map, own_values: Own) -> list[Line2D]:
    """Draw the curves on which stability is lost, label both axes, and mark the pad.

    own_values: the pad is marked at these if they lie in the ranges; None of a system, which is not
    marked. Returns entries of a legend for the curves and the pad.
    """
    curves = answer.details.get("threshold_curve", ())
    look: Any = {"color": THRESHOLD, "linewidth": 1.8}
    for curve in curves:
        x, y = np.transpose(curve["points"])
        axes.plot(x, y, gid="threshold", zorder=4, **look)
    first, second = answer.axes
    is_pad = own_values is not None
    label_axis(axes, "x", first, answer.units[0], is_pad)
    label_axis(axes, "y", second, answer.units[1], is_pad)
    if _is_half_turn(first) and _is_half_turn(second):
        axes.set_aspect("equal")
    entries = []
    if curves:
        entries.append(Line2D([], [], label="stability is lost", **look))
    if own_values:
        x, y = own_values
        if first.low <= x <= first.high and second.low <= y <= second.high:
            dot: Any = {"marker": "o", "ls": "", "mfc": "white", "mec": "k", "ms": 5.0, "mew": 1.0}
            axes.plot(x, y, clip_on=False, gid="own pad", zorder=6, **dot)
            entries.append(Line2D([], [], label="the scene", **dot))
    return entries


def _is_half_turn(axis: Axis) -> bool:
    """Whether an axis goes from 0 to pi, as that of an angle does."""
    return (axis.low, axis.high) == (0.0, math.pi)


def label_axis(axes: Axes, which: str, axis: Axis, unit: str = "", is_pad: bool = False) -> None:
    """Set limits, label, scale and ticks of an axis; parameters of a pad have symbols.

    which: "x" or "y", the axis of the figure that gets those of the map's `axis`.
    """
    label = symbol(axis.name) if is_pad else literal(axis.name)
    if unit not in ("", "1"):
        label += f" [{unit}]"
    axes.set(**{f"{which}lim": (axis.low, axis.high), f"{which}label": label})
    if axis.log:
        axes.set(**{f"{which}scale": "log"})
    elif _is_half_turn(axis) and unit == "rad":
        quarters, labels = QUARTERS
        axes.set(**{f"{which}ticks": np.multiply(quarters, math.pi), f"{which}ticklabels": labels})


def map_drawing(
    name: str, answer: Map, own_values: Own = None, level: float | None = None
) -> Drawing:
    """Draw verdicts over two parameters, a cell for each point, or contours of a pad's quantity.

    own_values: the pad's, which are marked; level: a value of the quantity whose contour is drawn
    thick.
    """
    with_contours = own_values is not None and answer.quantity is not None
    with style():
        figure = Figure(figsize=(SINGLE, 3.2 if with_contours else 3.6))
        axes = figure.add_subplot(facecolor=NO_VALUE)
        drawn = _contours(axes, answer, level) if with_contours else _cells(axes, answer)
        handles = [*drawn.handles, *_finish_axes(axes, answer, own_values)]
        if handles:
            figure.legend(handles=handles, loc="outside upper center", ncols=2)
    title = f"{drawn.name} of {name} over {answer.axes[0].name} and {answer.axes[1].name}"
    return Drawing(figure, f"{title}: {drawn.extent}.", title, origin(__name__))


class _Drawn(NamedTuple):
    """Entries of a legend, the name of what is drawn, and for the alternative text its extent."""

    handles: list[Patch]
    name: str
    extent: str


def _edges(answer: Map) -> list[NDArray]:
    """Where the cells (n1, n2) of a map end: n1 + 1 and n2 + 1 values."""
    return [axis.at(np.linspace(0.0, 1.0, axis.n + 1)) for axis in answer.axes]


def _cells(axes: Axes, answer: Map) -> _Drawn:
    """Draw verdicts as cells, hatched where no equilibrium is admissible."""
    first, second = answer.axes
    # code k is the index of a verdict, whose colour covers the numbers from k - 1/2 to k + 1/2;
    # verdicts of systems that have no colour get that of "beyond a fold"
    colours = [COLOUR_OF.get(verdict, COLOUR_OF[BEYOND]) for verdict in answer.verdicts]
    axes.pcolormesh(
        *_edges(answer),
        answer.codes.T,
        rasterized=True,
        cmap=ListedColormap(colours),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
    )
    handles = []
    sentences = []
    for colour, (verdict, share) in zip(colours, answer.share.items(), strict=True):
        if share:
            percent = f"{100 * share:.1f} %"
            handles.append(Patch(fc=colour, ec="k", lw=0.5, label=f"{verdict} ({percent})"))
            sentences.append(f"{verdict} {percent}")
    if answer.admissible is not None:
        is_hatched = ~answer.admissible & (answer.codes != NAMES.index(BEYOND))
        if is_hatched.any() and min(is_hatched.shape) > 1:  # one row has no contours
            mask = is_hatched.T.astype(float)
            axes.contourf(
                first.values,
                second.values,
                mask,
                [0.5, 1.5],  # where the mask is 1
                hatches=["////"],
                colors="none",
                zorder=1.5,
            )
            handles.append(Patch(fc="none", ec="k", hatch="////", lw=0.5, label="not admissible"))
    return _Drawn(handles, "Verdict", ", ".join(sentences))


def _contours(axes: Axes, answer: Map, level: float | None) -> _Drawn:
    """Draw the quantity of a map as filled contours with labelled edges; grey where it has none.

    level: a value of the quantity whose contour is drawn thick, if the map reaches it.
    """
    assert answer.quantity is not None
    first, second = answer.axes
    grid = (first.values, second.values)
    quantity, unit, numbers = answer.quantity
    name, _ = QUANTITIES[quantity]
    values = np.ma.masked_invalid(numbers.T)  # rows of the second parameter; NaN is no value
    finite = values.compressed()
    if finite.size and np.ptp(finite) > 0.0 and min(values.shape) > 1:
        # at most 10 colours, between edges at round numbers
        filled = axes.contourf(*grid, values, 9, cmap="viridis", alpha=0.85)
        levels = np.asarray(filled.levels)  # of the edges between the colours
        if quantity == "growth" and answer.details.get("threshold_curve"):
            levels = levels[levels != 0.0]  # the exact curve is drawn instead
        edges = axes.contour(*grid, values, levels, colors="k", linewidths=0.5)
        axes.clabel(edges, fontsize=7, fmt="%g")
        axes.figure.colorbar(filled, ax=axes, label=f"{name} [{unit}]" if unit else name)
        if level is not None and finite.min() < level < finite.max():
            axes.contour(*grid, values, [level], colors=OWN_LEVEL, linewidths=1.6)
    elif finite.size:  # one value, or one row of them, has no contours
        axes.pcolormesh(*_edges(answer), values, cmap="viridis", alpha=0.85)
    span = "no value"
    if finite.size:
        span = f"{finite.min():.4g} to {finite.max():.4g} {unit}"
    percent = f"{100 * finite.size / values.size:.1f} %"
    handles = []
    if finite.size < values.size:
        handles.append(Patch(fc=NO_VALUE, ec="k", lw=0.5, label=f"no {name}"))
    return _Drawn(handles, name.capitalize(), f"{span}, on {percent} of the area")
