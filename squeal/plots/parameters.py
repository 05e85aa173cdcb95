"""Axes of maps over two parameters: symbols, units, and the scene's own pad marked."""

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from squeal.analysis.maps import Axis
from squeal.analysis.threshold_curve import ThresholdCurve
from squeal.model.pad import PARAMETERS
from squeal.plots.areas import OF_PI, QUARTERS

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
