"""Figures of systems from matrices: roots in the complex plane, sweeps, stability charts."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from squeal.analysis.systems.chart import NAMES
from squeal.analysis.systems.sweeps import SweepRow
from squeal.plots.areas import VERDICT_COLOURS
from squeal.plots.style import DOUBLE, SINGLE, Drawing, origin, save, style
from squeal.plots.units import Unit, in_unit, units_of

NAMED = 6  # growing frequencies that are named in a figure
NOISE = 1e-9  # of |lambda|: growth that may be rounding
MIDDLE = ("center", 0)  # how a name stands over its point, and by how far (points)
STABLE, GROWING = "0.25", "#C8380E"
NAME: Any = {"textcoords": "offset points", "fontsize": 7, "color": GROWING}


def _grows(values: np.ndarray) -> np.ndarray:
    return np.asarray(values.real > NOISE * np.abs(values))


def roots_figure(values: np.ndarray) -> Figure:
    """Roots (rad/s) of the upper half plane, those that grow in red and with their frequency."""
    figure = Figure(figsize=(SINGLE, 3.0))
    axes = figure.add_subplot()
    upper = values[values.imag >= -NOISE * np.abs(values)]
    axes.axvline(0.0, color="0.7", linewidth=0.6, zorder=0)
    grows, unit = _grows(upper), units_of(upper)[0]
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


def sweep_figure(parameter: str, rows: Sequence[SweepRow]) -> Figure:
    """Roots over a parameter: frequency and growth rate, and their way in the complex plane.

    Points that grow are red; the frequencies that grow anywhere are named where they grow most.
    """
    figure = Figure(figsize=(DOUBLE, 3.8))
    left, plane = figure.subplots(1, 2, gridspec_kw={"width_ratios": [1.5, 1.0]})
    left.remove()
    grid = left.get_subplotspec().subgridspec(2, 1, height_ratios=[1.5, 1.0])
    upper = figure.add_subplot(grid[0])
    lower = figure.add_subplot(grid[1], sharex=upper)
    x = np.array([row.value for row in rows])
    at = np.concatenate([np.full(len(row.roots), row.value) for row in rows])
    values = np.concatenate([row.roots for row in rows])
    keep = values.imag >= -NOISE * np.abs(values)
    at, values = at[keep], values[keep]
    grows, unit = _grows(values), units_of(values)[0]
    frequency = values.imag / unit.factor
    _background((upper, lower), x, rows)
    for kept, colour, size in ((~grows, STABLE, 1.5), (grows, GROWING, 4.0)):
        for axes, y in ((upper, frequency), (lower, values.real)):
            axes.scatter(at[kept], y[kept], s=size, color=colour, linewidth=0)
    lower.axhline(0.0, color="0.5", linewidth=0.6)
    upper.set_xlim(x[0], x[-1])
    _named(upper, at[grows], values[grows], unit)
    points = plane.scatter(values.real, frequency, c=at, s=5, cmap="viridis", linewidth=0)
    plane.axvline(0.0, color="0.5", linewidth=0.6)
    bar = figure.colorbar(points, ax=plane, location="top", aspect=30)
    bar.set_label(parameter)
    upper.set_ylabel(f"frequency [{unit.name}]")
    upper.margins(y=0.12)  # room for the names of what grows
    upper.tick_params(labelbottom=False)
    lower.set_ylabel("real part [1/s]")
    lower.set_xlabel(parameter)
    plane.set_xlabel("real part [1/s]")
    plane.set_ylabel(f"frequency [{unit.name}]")
    return figure


def _background(axes_list: Sequence, x: np.ndarray, rows: Sequence[SweepRow]) -> None:
    edges = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
    for axes in axes_list:
        for low, high, row in zip(edges, edges[1:], rows, strict=False):
            colour = VERDICT_COLOURS[NAMES.index(row.verdict)]
            axes.axvspan(low, high, color=colour, alpha=0.2, linewidth=0)


def _named(axes, at: np.ndarray, values: np.ndarray, unit: Unit) -> None:  # type: ignore
    taken: list[float] = []
    for k in np.argsort(-values.real):
        if len(taken) == NAMED:
            return
        one = abs(float(values[k].imag))
        if all(abs(one - other) > 0.04 * max(one, other) for other in taken):
            taken.append(one)
            share = (at[k] - axes.get_xlim()[0]) / np.ptp(axes.get_xlim())
            side, moved = ("left", 3) if share < 0.1 else ("right", -3) if share > 0.9 else MIDDLE
            place = (at[k], one / unit.factor)
            axes.annotate(in_unit(one, unit), place, (moved, 4), ha=side, **NAME)


def chart_figure(
    names: tuple[str, str], sides: tuple[np.ndarray, np.ndarray], codes: np.ndarray
) -> Figure:
    """A stability chart: verdict codes (n1, n2) over the values of two parameters."""
    figure = Figure(figsize=(SINGLE, 3.0))
    axes = figure.add_subplot()
    x, y = (_edges(values) for values in sides)
    colours = ListedColormap(VERDICT_COLOURS[: len(NAMES)])
    axes.pcolormesh(x, y, codes.T, cmap=colours, vmin=-0.5, vmax=len(NAMES) - 0.5, rasterized=True)
    axes.set_xlabel(names[0])
    axes.set_ylabel(names[1])
    seen = [k for k in range(len(NAMES)) if np.any(codes == k)]
    patches = [Patch(fc=VERDICT_COLOURS[k], ec="0.6", lw=0.4, label=NAMES[k]) for k in seen]
    figure.legend(handles=patches, loc="outside upper center", ncols=len(patches))
    return figure


def _edges(values: np.ndarray) -> np.ndarray:
    half = (values[1] - values[0]) / 2
    return np.concatenate([values - half, values[-1:] + half])


def draw_chart(
    path: Path,
    name: str,
    names: tuple[str, str],
    sides: tuple[np.ndarray, np.ndarray],
    codes: np.ndarray,
) -> None:
    """Save a stability chart as PDF, SVG or PNG."""
    shares = ", ".join(
        f"{verdict} on {100 * np.mean(codes == k):.1f} %"
        for k, verdict in enumerate(NAMES)
        if np.any(codes == k)
    )
    text = f"Stability chart of {name} over {names[0]} and {names[1]}: {shares} of the points."
    with style():
        figure = chart_figure(names, sides, codes)
    title = f"Stability chart of {name}"
    save(Drawing(figure, text, title, origin(__name__)), path, text=False)


def draw_roots(path: Path, name: str, values: np.ndarray) -> None:
    """Save the roots in the complex plane as PDF, SVG or PNG."""
    growing = np.sort(values[_grows(values) & (values.imag >= 0)].imag) / (2 * np.pi)
    listed = ", ".join(f"{f:.1f}" for f in growing) or "none"
    text = f"Roots of {name} in the complex plane; growing frequencies in Hz: {listed}."
    with style():
        figure = roots_figure(values)
    save(Drawing(figure, text, f"Roots of {name}", origin(__name__)), path, text=False)


def draw_system_sweep(path: Path, name: str, parameter: str, rows: Sequence[SweepRow]) -> None:
    """Save a sweep as PDF, SVG or PNG."""
    seen = ", ".join(dict.fromkeys(row.verdict for row in rows))
    text = (
        f"Frequencies and real parts of the roots of {name} over {parameter} from "
        f"{rows[0].value:g} to {rows[-1].value:g}, and their way in the complex plane; verdicts "
        f"in this order: {seen}."
    )
    with style():
        figure = sweep_figure(parameter, rows)
    save(Drawing(figure, text, f"Sweep of {name}", origin(__name__)), path, text=False)
