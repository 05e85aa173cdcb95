"""Eigenvalues in the complex plane and, of a pad, the shapes of its modes beside them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.analysis.eigenvalues import analyse
from squeal.analysis.modes import ModeShape, shapes_of_pad
from squeal.io.scene import Scene, takes_scene
from squeal.model.pad import Pad
from squeal.plots.parts import (
    draw_pad,
    draw_surface,
    exaggeration,
    legend_of_phases,
    outlines,
)
from squeal.plots.style import DOUBLE, SINGLE, Drawing, in_unit, origin, style, units_of

RING, CROSS = "#3498DB", "#C8380E"
PANEL = 1.3  # in, height of a panel with a mode shape


def draw_eigenvalues(axes: Axes, values: np.ndarray, beside: np.ndarray | None = None) -> None:
    """Eigenvalues (rad/s) of the upper half plane; `beside`: those about the origin, as crosses."""
    everything = values if beside is None else np.concatenate([values, beside])
    units = units_of(everything)
    axes.axvline(0.0, color="0.7", linewidth=0.6, zorder=0)
    sets = [(values, "o", "equilibrium"), (beside, "x", "origin, full contact")]
    for points, marker, label in sets:
        if points is not None:
            shown = points[points.imag >= 0.0]
            face, edge = ("none", RING) if marker == "o" else (CROSS, None)
            real, imag = shown.real / units[1].factor, shown.imag / units[0].factor
            axes.scatter(real, imag, marker=marker, fc=face, ec=edge, s=26, label=label)
    reach = max(1.0, 1.2 * float(np.abs(everything.real).max())) / units[1].factor
    top = 1.1 * float(np.abs(everything.imag).max()) / units[0].factor
    axes.set_xlim(-reach, reach)
    axes.set_ylim(0.0, top or 1.0)
    axes.set_xlabel(f"growth rate [{units[1].name}]")
    axes.set_ylabel(f"frequency [{units[0].name}]")
    if beside is not None:
        axes.legend(loc="lower right", borderaxespad=0.4)


def eigenvalue_figure(values: np.ndarray) -> Figure:
    """Eigenvalues alone."""
    with style():
        figure = Figure(figsize=(SINGLE, 2.9))
        draw_eigenvalues(figure.add_subplot(), values)
    return figure


def pad_figure(
    pad: Pad,
    q: Sequence[float],
    shapes: Sequence[ModeShape],
    values: np.ndarray,
    beside: np.ndarray | None = None,
) -> Figure:
    """Eigenvalues of a pad about its equilibrium q (x, y, theta), and the shape of each mode."""
    slender = pad.h / pad.w
    lever = np.array([1.0, 1.0, pad.w])
    rest = np.array([0.0, (pad.y0 + q[1]) / pad.w, pad.theta0 + q[2]])
    moved = [lever * one.shape for one in shapes]
    lines = [outlines(slender, rest, shape) for shape in moved]
    corners = np.concatenate([corner for three in lines for corner in three])
    left, bottom = corners.min(axis=0) - 0.08
    right, top = corners.max(axis=0) + 0.08
    bottom = min(bottom, -slender - 0.12)
    units = units_of(values)
    with style():
        figure = Figure(figsize=(DOUBLE, 0.5 + len(shapes) * PANEL))
        grid = figure.add_gridspec(len(shapes), 2, width_ratios=[1.5, 1.0])
        draw_eigenvalues(figure.add_subplot(grid[:, 0]), values, beside)
        for k, (one, three) in enumerate(zip(shapes, lines, strict=True)):
            axes = figure.add_subplot(grid[k, 1])
            draw_surface(axes, -slender, left, right, bottom)
            draw_pad(axes, three)
            grows = one.growth_rate > 0.0
            name = f"mode {one.number}: {in_unit(2 * np.pi * one.frequency_hz, units[0])}"
            if one.growth_rate:
                name += f", ${one.growth_rate / units[1].factor:+.3g}$ {units[1].name}"
            axes.set_title(name, pad=2.0, color=CROSS if grows else "k")
            axes.set_xlim(left, right)
            axes.set_ylim(bottom, top)
        handles, names = legend_of_phases(moved)
        names[1] += f" ({exaggeration(pad.w)})"
        figure.legend(handles, names, loc="outside upper center", ncols=3, columnspacing=1.2)
    return figure


@takes_scene
def mode_figure(scene: Scene) -> Figure:
    """Eigenvalues of a scene about its sliding equilibrium, and the shapes of its modes.

    Raises ComputationError if no steady sliding exists.
    """
    found = analyse(scene)
    shapes = shapes_of_pad(found, scene.pad.w)
    return pad_figure(scene.pad, found.q, shapes, found.spectrum.values)


def modes_drawing(name: str, figure: Figure, values: np.ndarray) -> Drawing:
    """A figure of eigenvalues, and of mode shapes if it has them, ready to be saved."""
    listed = ", ".join(f"{v.real:.4g} {v.imag:+.4g}i" for v in values)
    shapes = " and mode shapes" if len(figure.axes) > 1 else ""
    text = f"Eigenvalues of {name} in the complex plane{shapes}; in rad/s: {listed}."
    return Drawing(figure, text, f"Eigenvalues of {name}", origin(__name__))


NAMED = 6  # growing frequencies that are named in a figure
NOISE = 1e-9  # of |lambda|: growth that may be rounding
STABLE, GROWING = "0.25", "#C8380E"
NAME: Any = {"textcoords": "offset points", "fontsize": 7, "color": GROWING}


def growing_roots(values: np.ndarray) -> np.ndarray:
    return np.asarray(values.real > NOISE * np.abs(values))


def roots_figure(values: np.ndarray) -> Figure:
    """Roots (rad/s) of the upper half plane, those that grow in red and with their frequency."""
    figure = Figure(figsize=(SINGLE, 3.0))
    axes = figure.add_subplot()
    upper = values[values.imag >= -NOISE * np.abs(values)]
    axes.axvline(0.0, color="0.7", linewidth=0.6, zorder=0)
    grows, unit = growing_roots(upper), units_of(upper)[0]
    for kept, colour, marker in ((~grows, STABLE, "o"), (grows, GROWING, "s")):
        own = upper[kept]
        ring: Any = {"s": 14, "facecolor": "none", "edgecolor": colour, "linewidth": 0.8}
        axes.scatter(own.real, own.imag / unit.factor, marker=marker, **ring)
    for root in sorted(upper[grows], key=lambda r: -r.real)[:NAMED]:
        at = (root.real, root.imag / unit.factor)
        axes.annotate(in_unit(root.imag, unit), at, (-4, 0), ha="right", va="center", **NAME)
    axes.set_xlabel("real part [1/s]")
    axes.set_ylabel(rf"imaginary part / $2\pi$ [{unit.name}]")
    axes.margins(x=0.15)
    return figure


def roots_drawing(name: str, values: np.ndarray) -> Drawing:
    """The roots in the complex plane, ready to be saved."""
    growing = np.sort(values[growing_roots(values) & (values.imag >= 0)].imag) / (2 * np.pi)
    listed = ", ".join(f"{f:.1f}" for f in growing) or "none"
    text = f"Roots of {name} in the complex plane; growing frequencies in Hz: {listed}."
    with style():
        figure = roots_figure(values)
    return Drawing(figure, text, f"Roots of {name}", origin(__name__))
