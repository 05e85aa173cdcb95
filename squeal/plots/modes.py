"""Eigenvalues in the complex plane and, of a pad, the shapes of its modes beside them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from squeal.analysis.modes import ModeShape
from squeal.model.pad import Pad
from squeal.plots.style import (
    DOUBLE,
    SINGLE,
    Drawing,
    frequency_limits,
    in_unit,
    origin,
    style,
    units_of,
)

LARGEST = 0.35  # drawn size of the largest of x, y, w theta, in half lengths
RING, RED = "#3498DB", "#C8380E"
NAME: Any = {"textcoords": "offset points", "fontsize": 7, "color": RED}
PHASES: dict[str, dict[str, Any]] = {
    "rest": {"color": "0.6"},
    "first phase": {"color": RED},
    "second phase": {"color": RING, "linestyle": (0, (3, 1.5))},
}


def exaggeration(w: float) -> str:
    """How much larger than a motion of a micrometre shapes of a pad of half length w (m) are drawn,
    in words."""
    factor = LARGEST * w / 1e-6
    digits = 10 ** int(np.floor(np.log10(factor)) - 1)
    return rf"motion of 1 $\mu$m enlarged {round(factor / digits) * digits} times"


def is_real(shape: np.ndarray) -> bool:
    """True for a shape whose parts all move in phase; rounding leaves imaginary parts."""
    return bool(np.abs(shape.imag).max() < 1e-6)


def outline(w: float, h: float, pose: np.ndarray) -> np.ndarray:
    """Corners (5, 2) of a pad at pose (x, y, theta), the first corner repeated."""
    corners = np.array([[-w, -h], [w, -h], [w, h], [-w, h], [-w, -h]])
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray(corners @ np.array([[c, s], [-s, c]]) + pose[:2])


def outlines(slenderness: float, rest: np.ndarray, shape: np.ndarray) -> list[np.ndarray]:
    """The pad at rest and at two phases of a mode, in half lengths.

    slenderness: h/w; rest: (x/w, y/w, theta); shape: complex (x, y, w theta), its largest part 1.
    The phases are opposite ones, or a quarter turn apart for a complex shape.
    """
    # in half lengths w theta is the angle itself
    turns = (1.0, -1.0 if is_real(shape) else 1j)
    poses = (rest, *(rest + LARGEST * (shape * turn).real for turn in turns))
    return [outline(1.0, slenderness, pose) for pose in poses]


def draw_pad(axes: Axes, lines: Sequence[np.ndarray]) -> None:
    """Pad at rest and at both phases."""
    for corners, (name, look) in zip(lines, PHASES.items(), strict=True):
        axes.plot(*corners.T, linewidth=0.8, gid=name, **look)
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_visible(False)


def draw_surface(axes: Axes, height: float, left: float, right: float, bottom: float) -> None:
    """The sliding surface as a line, and what lies below it in grey."""
    ground = (left, bottom), right - left, height - bottom
    axes.add_patch(Rectangle(*ground, facecolor="0.92", linewidth=0.0, zorder=0))
    axes.axhline(height, color="k", linewidth=0.6, zorder=0)


def legend_of_phases(shapes: Sequence[np.ndarray]) -> tuple[list[Line2D], list[str]]:
    """Handles and names for a legend of pads at rest and at two phases."""
    complex_too = any(not is_real(shape) for shape in shapes)
    second = "a quarter period later" if complex_too else "half a period later"
    if complex_too and any(map(is_real, shapes)):
        second = "half a period later (complex shapes: a quarter)"
    handles = [Line2D([], [], **look) for look in PHASES.values()]
    return handles, ["equilibrium", "displaced", second]


def growing(values: np.ndarray) -> np.ndarray:
    """Which eigenvalues grow by more than rounding."""
    return np.asarray(values.real > 1e-9 * np.abs(values))


def draw_eigenvalues(axes: Axes, values: np.ndarray, beside: np.ndarray | None = None) -> None:
    """Eigenvalues (rad/s) of the upper half plane, those that grow as red squares.

    beside: of a pad those about the origin, as crosses.
    """
    everything = values if beside is None else np.concatenate([values, beside])
    units = units_of(everything)
    axes.axvline(0.0, color="0.7", linewidth=0.6, zorder=0)
    upper = values[values.imag >= -1e-9 * np.abs(values)]
    grows = growing(upper)
    sets: list[tuple[np.ndarray, dict[str, Any]]] = [
        (upper[~grows], {"marker": "o", "fc": "none", "ec": RING, "label": "equilibrium"}),
        (upper[grows], {"marker": "s", "fc": "none", "ec": RED}),
    ]
    if beside is not None:
        shown = beside[beside.imag >= 0.0]
        sets.append((shown, {"marker": "x", "fc": RED, "label": "origin, full contact"}))
    for points, look in sets:
        axes.scatter(points.real / units[1].factor, points.imag / units[0].factor, s=26, **look)
    reach = max(1.0, 1.2 * float(np.abs(everything.real).max(initial=0.0))) / units[1].factor
    axes.set_xlim(-reach, reach)
    axes.set_ylim(*frequency_limits(everything, units[0]))
    axes.set_xlabel(f"growth rate [{units[1].name}]")
    axes.set_ylabel(f"frequency [{units[0].name}]")
    for root in sorted(upper[grows & (upper.imag > 0.0)], key=lambda r: -r.real)[:6]:
        place = (root.real / units[1].factor, root.imag / units[0].factor)
        words = in_unit(root.imag, units[0])
        axes.annotate(words, place, (-5, 0), ha="right", va="center", **NAME)
    if beside is not None:
        axes.legend(loc="lower right", borderaxespad=0.4)


def pad_figure(
    pad: Pad,
    q: Sequence[float],
    shapes: Sequence[ModeShape],
    values: np.ndarray,
    beside: np.ndarray | None = None,
) -> Figure:
    """Eigenvalues of a pad about its equilibrium q (x, y, theta), and the shape of each mode."""
    slender = pad.h / pad.w
    rest = np.array([0.0, (pad.y0 + q[1]) / pad.w, pad.theta0 + q[2]])
    moved = [np.array([1.0, 1.0, pad.w]) * one.shape for one in shapes]
    lines = [outlines(slender, rest, shape) for shape in moved]
    corners = np.concatenate([corner for three in lines for corner in three])
    left, bottom = corners.min(axis=0) - 0.08
    right, top = corners.max(axis=0) + 0.08
    bottom = min(bottom, -slender - 0.12)
    units = units_of(values)
    with style():
        figure = Figure(figsize=(DOUBLE, 0.5 + 1.3 * len(shapes)))
        grid = figure.add_gridspec(len(shapes), 2, width_ratios=[1.5, 1.0])
        draw_eigenvalues(figure.add_subplot(grid[:, 0]), values, beside)
        for k, (one, three) in enumerate(zip(shapes, lines, strict=True)):
            axes = figure.add_subplot(grid[k, 1])
            draw_surface(axes, -slender, left, right, bottom)
            draw_pad(axes, three)
            name = f"mode {one.number}: {in_unit(2 * np.pi * one.frequency_hz, units[0])}"
            if one.growth_rate:
                name += f", ${one.growth_rate / units[1].factor:+.4g}$ {units[1].name}"
            axes.set_title(name, pad=2.0, color=RED if one.growth_rate > 0.0 else "k")
            axes.set_xlim(left, right)
            axes.set_ylim(bottom, top)
        handles, names = legend_of_phases(moved)
        names[1] += f" ({exaggeration(pad.w)})"
        figure.legend(handles, names, loc="outside upper center", ncols=3, columnspacing=1.2)
    return figure


def modes_drawing(name: str, values: np.ndarray, figure: Figure | None = None) -> Drawing:
    """Eigenvalues alone, or a figure of them with mode shapes."""
    shapes = "" if figure is None else " and mode shapes"
    if figure is None:
        with style():
            figure = Figure(figsize=(SINGLE, 3.0))
            draw_eigenvalues(figure.add_subplot(), values)
    listed = ", ".join(f"{v.real:.4g} {v.imag:+.4g}i" for v in values[:100])
    more = f", and {len(values) - 100} more" if len(values) > 100 else ""
    text = f"Eigenvalues of {name} in the complex plane{shapes}; in rad/s: {listed}{more}."
    return Drawing(figure, text, f"Eigenvalues of {name}", origin(__name__))
