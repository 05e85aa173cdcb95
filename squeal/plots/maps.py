"""Maps over two parameters: verdicts as areas with the curves between them, and contours."""

import dataclasses
import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from squeal.analysis.maps import (
    BEYOND_FOLD,
    NAMES,
    QUANTITIES,
    Axis,
    Field,
    StabilityMap,
    traced_map,
)
from squeal.analysis.systems.chart import NAMES as CHART_NAMES
from squeal.analysis.threshold_curve import ThresholdCurve
from squeal.io.scene import Scene
from squeal.model.pad import PARAMETERS
from squeal.plots.parts import OF_PI, QUARTERS, VERDICT_COLOURS, draw
from squeal.plots.style import SINGLE, Drawing, literal, origin, style

THRESHOLD = "#E69F00"
GREEK = {"alpha": r"\alpha", "theta": r"\theta", "mu": r"\mu"}


def symbol(name: str) -> str:
    """A parameter's symbol in mathtext: alpha1 becomes \\alpha_1."""
    letters, index = re.fullmatch(r"([A-Za-z]+?)_?(\d|[a-z])?", name).groups()  # type: ignore[union-attr]
    if name in GREEK:
        letters, index = name, None
    letters = GREEK.get(letters, letters)
    return f"${letters}_{index}$" if index else f"${letters}$"


def unit_of(axis: Axis) -> float:
    """What the numbers of an axis are divided by: pi over 0 to pi, else a power of a thousand.

    One on a logarithmic axis, and for a number without a unit unless it is tiny or huge.
    """
    if PARAMETERS[axis.name].angle and (axis.low, axis.high) == (0.0, math.pi):
        return math.pi
    size = max(abs(axis.low), abs(axis.high))
    if axis.log or (PARAMETERS[axis.name].unit == "1" and 0.01 <= size < 1e4):
        return 1.0
    return float(1000.0 ** math.floor(math.log10(size) / 3)) if size else 1.0


def _label(axis: Axis) -> str:
    unit, factor = PARAMETERS[axis.name].unit, unit_of(axis)
    power = round(math.log10(factor)) if factor != math.pi else 0
    scale = f"$10^{{{power}}}$ " if power else ""
    shown = "" if unit == "1" and not power else f" [{scale}{'' if unit == '1' else unit}]"
    return symbol(axis.name) + shown.replace(" ]", "]")


def draw_thresholds(
    axes: Axes, pair: tuple[Axis, Axis], curves: Sequence[ThresholdCurve]
) -> list[Line2D]:
    """Curves on which stability is lost, over `unit_of`; what stands for them in a legend."""
    units = np.array([unit_of(axis) for axis in pair])
    look: Any = {"color": THRESHOLD, "linewidth": 1.8}
    for curve in curves:
        axes.plot(*(curve.points / units).T, gid="threshold", zorder=4, **look)
    return [Line2D([], [], label="threshold, continued", **look)] if curves else []


def settle(axes: Axes, pair: tuple[Axis, Axis], own: tuple[float, float] | None) -> None:
    """Limits, ticks and labels of both axes, whose numbers are over `unit_of`; the pad marked if it
    lies in the ranges."""
    for axis, way in zip(pair, ("x", "y"), strict=True):
        factor = unit_of(axis)
        axes.set(
            **{f"{way}lim": (axis.low / factor, axis.high / factor), f"{way}label": _label(axis)}
        )
        if axis.log:
            axes.set(**{f"{way}scale": "log"})
        if factor == math.pi:
            getattr(axes, f"set_{way}ticks")(QUARTERS, OF_PI)
    if all(unit_of(axis) == math.pi for axis in pair):
        axes.set_aspect("equal")
    if own is not None and all(a.low <= at <= a.high for a, at in zip(pair, own, strict=True)):
        place = np.array(own) / [unit_of(axis) for axis in pair]
        look = {"mfc": "white", "mec": "black", "ms": 5.0, "mew": 1.0, "zorder": 6}
        axes.plot(*place, "o", clip_on=False, gid="own pad", **look)  # type: ignore[arg-type]


def stability_figure(
    found: StabilityMap,
    own: tuple[float, float] | None = None,
    curves: Sequence[ThresholdCurve] = (),
) -> Figure:
    """Verdict over two parameters: areas with the traced curves between them, the pad marked.

    Raises ValueError for a map that was not traced.
    """
    if found.outline is None:
        raise ValueError("only a traced map can be drawn")
    with style():
        figure = Figure(figsize=(SINGLE, 3.6))
        axes = figure.add_subplot()
        met = [i for i, name in enumerate(NAMES) if found.share[name] > 0.0]
        draw(axes, found.outline, VERDICT_COLOURS, tuple(unit_of(a) for a in found.axes))
        settle(axes, found.axes, own)
        far = hatch(axes, found)
        handles: list[Any] = [
            Patch(facecolor=VERDICT_COLOURS[i], edgecolor="k", linewidth=0.5) for i in met
        ]
        names = [f"{NAMES[i]} ({100 * found.share[NAMES[i]]:.1f} %)" for i in met]
        if far is not None:
            handles.append(far)
            names.append("not admissible")
        for line in draw_thresholds(axes, found.axes, curves):
            handles.append(line)
            names.append(str(line.get_label()))
        figure.legend(handles, names, loc="outside upper center", ncols=2)
    return figure


def hatch(axes: Axes, found: StabilityMap) -> Patch | None:
    """Hatch the points whose equilibrium is not admissible; what stands for it in a legend."""
    far = ~found.admissible & (found.codes != BEYOND_FOLD)
    if not far.any():
        return None
    x, y = (axis.values / unit_of(axis) for axis in found.axes)
    values = far.T.astype(float)
    axes.contourf(x, y, values, [0.5, 1.5], hatches=["////"], colors="none", zorder=1.5)
    return Patch(facecolor="none", edgecolor="k", hatch="////", linewidth=0.5)


def traced(scene: Scene, found: StabilityMap) -> StabilityMap:
    """The map with the boundaries between its points, for drawing."""
    if found.outline is not None:
        return found
    return dataclasses.replace(found, outline=traced_map(scene, found.axes, found.codes))


def stability_drawing(
    found: StabilityMap,
    own: tuple[float, float] | None = None,
    curves: Sequence[ThresholdCurve] = (),
) -> Drawing:
    """A map of verdicts, ready to be saved."""
    shares = ", ".join(f"{name} {100 * share:.1f} %" for name, share in found.share.items())
    title = f"Verdict over {found.axes[0].name} and {found.axes[1].name}"
    text = f"{title}; shares of the area: {shares}."
    made = origin("squeal.plots.maps")
    return Drawing(stability_figure(found, own, curves), text, title, made)


LEVELS = 9
OWN_LEVEL = "#C8380E"  # the curve on which the critical friction is the scene's


def contour_figure(
    found: Field,
    own: tuple[float, float] | None = None,
    level: float | None = None,
    curves: Sequence[ThresholdCurve] = (),
) -> Figure:
    """Labelled contours over filled ones; grey where there is no value.

    own: the scene's place, which is marked; level: a value whose curve is drawn thick.
    """
    first, second = found.axes
    x, y = first.values / unit_of(first), second.values / unit_of(second)
    values = np.ma.masked_invalid(found.values.T)
    with style():
        figure = Figure(figsize=(SINGLE, 3.2))
        axes = figure.add_subplot(facecolor="0.85")
        if values.count() and np.ptp(values.compressed()) > 0.0:
            filled = axes.contourf(x, y, values, LEVELS, cmap="viridis", alpha=0.85)
            edges = axes.contour(x, y, values, filled.levels, colors="k", linewidths=0.5)
            axes.clabel(edges, fontsize=7, fmt="%g")
            words, unit = QUANTITIES[found.quantity]
            figure.colorbar(filled, ax=axes, label=words if unit == "1" else f"{words} [{unit}]")
            if level is not None and values.min() < level < values.max():
                axes.contour(x, y, values, [level], colors=OWN_LEVEL, linewidths=1.6)
        lines = draw_thresholds(axes, found.axes, curves)
        if lines:
            figure.legend(handles=lines, loc="outside upper center")
        settle(axes, found.axes, own)
    return figure


def contours_drawing(
    found: Field,
    own: tuple[float, float] | None = None,
    level: float | None = None,
    curves: Sequence[ThresholdCurve] = (),
) -> Drawing:
    """A contour map, ready to be saved."""
    words, unit = QUANTITIES[found.quantity]
    title = f"{words} over {found.axes[0].name} and {found.axes[1].name}"
    known = found.values[np.isfinite(found.values)]
    span = f"from {known.min():.4g} to {known.max():.4g} {unit}" if known.size else "nowhere"
    share = 100 * known.size / found.values.size
    text = f"Contour map of the {title}: {span}, on {share:.1f} % of the area."
    figure = contour_figure(found, own, level, curves)
    made = origin("squeal.plots.maps")
    return Drawing(figure, text, title.capitalize(), made)


def chart_figure(
    names: tuple[str, str], sides: tuple[np.ndarray, np.ndarray], codes: np.ndarray
) -> Figure:
    """A stability chart: verdict codes (n1, n2) over the values of two parameters."""
    figure = Figure(figsize=(SINGLE, 3.0))
    axes = figure.add_subplot()
    x, y = (_edges(values) for values in sides)
    colours = ListedColormap(VERDICT_COLOURS[: len(CHART_NAMES)])
    axes.pcolormesh(
        x, y, codes.T, cmap=colours, vmin=-0.5, vmax=len(CHART_NAMES) - 0.5, rasterized=True
    )
    axes.set_xlabel(literal(names[0]))
    axes.set_ylabel(literal(names[1]))
    seen = [k for k in range(len(CHART_NAMES)) if np.any(codes == k)]
    patches = [Patch(fc=VERDICT_COLOURS[k], ec="0.6", lw=0.4, label=CHART_NAMES[k]) for k in seen]
    figure.legend(handles=patches, loc="outside upper center", ncols=len(patches))
    return figure


def _edges(values: np.ndarray) -> np.ndarray:
    half = (values[1] - values[0]) / 2
    return np.concatenate([values - half, values[-1:] + half])


def chart_drawing(
    name: str, names: tuple[str, str], sides: tuple[np.ndarray, np.ndarray], codes: np.ndarray
) -> Drawing:
    """A stability chart, ready to be saved."""
    shares = ", ".join(
        f"{verdict} on {100 * np.mean(codes == k):.1f} %"
        for k, verdict in enumerate(CHART_NAMES)
        if np.any(codes == k)
    )
    text = f"Stability chart of {name} over {names[0]} and {names[1]}: {shares} of the points."
    with style():
        figure = chart_figure(names, sides, codes)
    title = f"Stability chart of {name}"
    return Drawing(figure, text, title, origin(__name__))
