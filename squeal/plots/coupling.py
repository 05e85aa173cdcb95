"""Modes over friction: frequencies, growth rates, and the root locus beside them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from squeal.analysis.answers import Step
from squeal.analysis.modes import ModeSweep
from squeal.analysis.systems.chart import NAMES as VERDICT_NAMES
from squeal.linear import GROWING, VERDICTS
from squeal.plots.maps import symbol
from squeal.plots.modes import NAME, NAMED, growing_roots
from squeal.plots.modes import STABLE as PLAIN
from squeal.plots.parts import (
    COLOURS,
    FINE,
    LOOKS,
    VERDICT_COLOURS,
    draw_locus,
    draw_modes,
    mark_events,
)
from squeal.plots.style import (
    DOUBLE,
    Drawing,
    Unit,
    in_unit,
    literal,
    origin,
    state_label,
    style,
    units_of,
)

MORE = ("#117A65", "#B7950B", "#000000")  # of further modes
FEW = 3  # modes that have a colour and line each; of more only those that grow
NOISE = 1e-7  # of the largest eigenvalue: growth that is drawn as such
LISTED = 6  # growing modes in a legend


def _upper(found: ModeSweep) -> np.ndarray:
    """Values (k, n) of each mode in the upper half plane, the faster growing one if both are."""
    pairs = found.values.reshape(len(found.mus), -1, 2)
    rank = np.where(pairs.imag >= 0.0, pairs.real, -np.inf)
    return np.take_along_axis(pairs, rank.argmax(axis=2)[:, :, None], axis=2)[:, :, 0]


def _growing(found: ModeSweep) -> list[int]:
    """Modes that grow somewhere, the fastest first."""
    if not any(verdict in GROWING for *_, verdict in found.spans):
        return []
    best = _upper(found).real.max(axis=0)
    return [k for k in np.argsort(-best).tolist() if best[k] > NOISE * np.abs(found.values).max()]


def _looks(found: ModeSweep, growing: Sequence[int]) -> list[dict[str, Any]]:
    count = found.values.shape[1] // 2
    if count <= FEW:
        return LOOKS[:count]
    looks: list[dict[str, Any]] = [{"color": "0.72", "linewidth": 0.5, "zorder": 1}] * count
    colours = (*COLOURS[::-1], *MORE)
    for i, k in enumerate(growing):
        looks[k] = {"color": colours[i] if i < LISTED else "0.3", "linewidth": 1.1, "zorder": 3}
    return looks


def _thick(
    upper: Axes, found: ModeSweep, growing: Sequence[int], looks: Sequence[dict[str, Any]], u: Unit
) -> list[tuple[Line2D, str]]:
    """Stretches of growth drawn thick in the upper panel; handles and words for a legend."""
    entries = []
    noise = NOISE * np.abs(found.values).max()
    modes = _upper(found)
    for i, k in enumerate(growing):
        own, colour = modes[:, k], looks[k]["color"]
        on = own.real > noise
        frequency = np.where(on, np.abs(own.imag) / u.factor, np.nan)
        name = f"grows {k + 1}"
        upper.plot(found.mus, frequency, color=colour, linewidth=2.4, zorder=4, gid=name)
        if i < LISTED:
            words = _words(found, float(found.mus[int(np.argmax(on))]), own[on], u)
            entries.append((Line2D([], [], color=colour, linewidth=2.4), words))
    if len(growing) > LISTED:
        handle = Line2D([], [], color="0.3", linewidth=2.4)
        entries.append((handle, f"{len(growing) - LISTED} more that grow"))
    return entries


def _words(found: ModeSweep, start: float, own: np.ndarray, u: Unit) -> str:
    ups = [c for c in found.crossings if c.direction == "up"]
    near = min(ups, key=lambda c: abs(c.mu - start), default=None)
    vibrates = abs(own[int(np.argmax(own.real))].imag) > 0.0
    words = "flutter" if vibrates else "divergence"
    if near is not None and start > found.low:
        words += f" from {symbol_of(found.parameter)} = {near.mu:.4g}"
    return f"{words}, {in_unit(abs(own[0].imag), u)}" if vibrates else words


def coupling_figure(found: ModeSweep, own: float | None = None) -> Figure:
    """Frequencies over growth rates along the parameter, and the root locus beside them.

    Growing stretches are thick and named in the legend; the background changes colour at the
    thresholds. own: the value of the parameter at which the subject stands, marked.
    """
    values, mus = found.values, found.mus
    units, growing = units_of(values), _growing(found)
    looks = _looks(found, growing)
    with style():
        figure = Figure(figsize=(DOUBLE, 3.9))
        grid = figure.add_gridspec(2, 2, width_ratios=[1.55, 1.0], height_ratios=[1.6, 1.0])
        upper = figure.add_subplot(grid[0, 0])
        lower = figure.add_subplot(grid[1, 0], sharex=upper)
        beside = figure.add_subplot(grid[:, 1])
        upper.set_xlim(found.low, found.high)
        draw_modes(upper, lower, mus, values, looks, units)
        entries = _thick(upper, found, growing, looks, units[0])
        patches = _background(found, upper, lower)
        contacts = [(mu, state_label(name), ":") for mu, name in found.contacts]
        mark_events(contacts, upper, lower, found.low, found.high - found.low)
        if own is not None and found.low <= own <= found.high:
            for axes in (upper, lower):
                axes.axvline(own, color="0.5", linewidth=0.8, linestyle="-.", zorder=0, gid="own")
            words = f"present {symbol_of(found.parameter)} = {own:.4g}"
            entries.append((Line2D([], [], color="0.5", lw=0.8, ls="-."), words))
        upper.tick_params(labelbottom=False)
        upper.set_ylim(0.0, 1.05 * np.abs(values.imag).max() / units[0].factor or 1.0)
        reach = 1.1 * np.abs(values.real).max() / units[1].factor or 1.0
        lower.set_ylim(-reach, reach)
        upper.set_ylabel(f"frequency [{units[0].name}]")
        lower.set_ylabel(f"growth rate [{units[1].name}]")
        lower.set_xlabel(_name(found.parameter))
        _locus(found, figure, beside, units, reach)
        figure.align_ylabels([upper, lower])
        if not growing:
            entries.insert(0, (Line2D([], [], color="k"), "nothing grows"))
        handles, names = [list(part) for part in zip(*entries, *patches, strict=True)]
        figure.legend(handles, names, loc="outside upper center", ncols=3, columnspacing=1.4)
    return figure


def symbol_of(parameter: str) -> str:
    """The parameter as it stands on an axis."""
    return symbol(parameter) if parameter == "mu" else literal(parameter)


def _name(parameter: str) -> str:
    return rf"friction {symbol(parameter)}" if parameter == "mu" else literal(parameter)


def _background(found: ModeSweep, upper: Axes, lower: Axes) -> list[tuple[Any, str]]:
    met = {}
    for low, high, verdict in found.spans:
        if verdict in GROWING:
            colour = VERDICT_COLOURS[VERDICTS.index(verdict)]
            for axes in (upper, lower):
                axes.axvspan(low, high, color=colour, alpha=0.13, lw=0, zorder=0, gid=verdict)
            met[verdict] = Patch(facecolor=colour, alpha=0.13)
    if found.end < found.high:
        for axes in (upper, lower):
            axes.axvspan(
                found.end, found.high, fc="none", ec="0.7", hatch="////", lw=0, gid="no equilibrium"
            )
        met["no equilibrium"] = Patch(facecolor="none", edgecolor="0.7", hatch="////", lw=0)
    return [(patch, name) for name, patch in met.items()]


def _locus(
    found: ModeSweep, figure: Figure, axes: Axes, units: tuple[Unit, Unit], reach: float
) -> None:
    inside = found.values.imag >= 0.0
    growth, frequency = found.values.real / units[1].factor, found.values.imag / units[0].factor
    mu = np.broadcast_to(found.mus[:, None], growth.shape)[inside]
    few = found.values.shape[1] <= 2 * FEW
    dots = draw_locus(
        axes, growth[inside], frequency[inside], mu, (found.low, found.high), 9.0 if few else FINE
    )
    axes.set_xlim(-reach, reach)
    axes.set_ylim(0.0, 1.05 * np.abs(found.values.imag).max() / units[0].factor or 1.0)
    axes.set_xlabel(f"growth rate [{units[1].name}]")
    axes.set_ylabel(f"frequency [{units[0].name}]")
    figure.colorbar(dots, ax=axes, label=_name(found.parameter), aspect=35, pad=0.02)


def coupling_drawing(name: str, found: ModeSweep, own: float | None = None) -> Drawing:
    """The coupling figure of what is called `name`, ready to be saved."""
    spans = ", ".join(f"{v} from {low:.6g} to {high:.6g}" for low, high, v in found.spans)
    ups = [f"{c.kind} at {c.mu:.6g} ({c.frequency_hz:.4g} Hz)" for c in found.crossings]
    text = (
        f"Frequencies, growth rates and root locus of {name} over {found.parameter} from "
        f"{found.low:g} to {found.high:g}: {spans}."
    )
    if ups:
        text += f" Crossings of the imaginary axis: {', '.join(ups)}."
    if found.end < found.high:
        text += f" No equilibrium on the branch beyond {found.end:.6g}."
    figure = coupling_figure(found, own)
    return Drawing(figure, text, f"Mode coupling of {name}", origin(__name__))


MIDDLE = ("center", 0)  # how a name stands over its point, and by how far (points)


def sweep_figure(parameter: str, rows: Sequence[Step]) -> Figure:
    """Roots over a parameter: frequency and growth rate, and their way in the complex plane.

    Points that grow are red; the frequencies that grow anywhere are named where they grow most.
    """
    figure = Figure(figsize=(DOUBLE, 3.8))
    left, plane = figure.subplots(1, 2, gridspec_kw={"width_ratios": [1.5, 1.0]})
    left.remove()
    grid = left.get_subplotspec().subgridspec(2, 1, height_ratios=[1.5, 1.0])
    upper = figure.add_subplot(grid[0])
    lower = figure.add_subplot(grid[1], sharex=upper)
    known = [(row.value, row.roots) for row in rows if row.roots is not None]
    x = np.array([value for value, _ in known])
    at = np.concatenate([np.full(len(roots), value) for value, roots in known])
    values = np.concatenate([roots for _, roots in known])
    keep = values.imag >= -1e-9 * np.abs(values)
    at, values = at[keep], values[keep]
    grows, unit = growing_roots(values), units_of(values)[0]
    frequency = values.imag / unit.factor
    _verdict_background((upper, lower), x, rows)
    for kept, colour, size in ((~grows, PLAIN, 1.5), (grows, COLOURS[2], 4.0)):
        for axes, y in ((upper, frequency), (lower, values.real)):
            axes.scatter(at[kept], y[kept], s=size, color=colour, linewidth=0)
    lower.axhline(0.0, color="0.5", linewidth=0.6)
    upper.set_xlim(x[0], x[-1])
    _named(upper, at[grows], values[grows], unit)
    points = plane.scatter(values.real, frequency, c=at, s=5, cmap="viridis", linewidth=0)
    plane.axvline(0.0, color="0.5", linewidth=0.6)
    bar = figure.colorbar(points, ax=plane, location="top", aspect=30)
    bar.set_label(_name(parameter))
    upper.set_ylabel(f"frequency [{unit.name}]")
    upper.margins(y=0.12)  # room for the names of what grows
    upper.tick_params(labelbottom=False)
    lower.set_ylabel("real part [1/s]")
    lower.set_xlabel(_name(parameter))
    plane.set_xlabel("real part [1/s]")
    plane.set_ylabel(f"frequency [{unit.name}]")
    return figure


def _verdict_background(axes_list: Sequence, x: np.ndarray, rows: Sequence[Step]) -> None:
    edges = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
    for axes in axes_list:
        for low, high, row in zip(edges, edges[1:], rows, strict=False):
            colour = VERDICT_COLOURS[VERDICT_NAMES.index(row.verdict)]
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


def sweep_drawing(name: str, parameter: str, rows: Sequence[Step]) -> Drawing:
    """The figure of a sweep, ready to be saved."""
    seen = ", ".join(dict.fromkeys(row.verdict or "-" for row in rows))
    text = (
        f"Frequencies and real parts of the roots of {name} over {parameter} from "
        f"{rows[0].value:g} to {rows[-1].value:g}, and their way in the complex plane; verdicts "
        f"in this order: {seen}."
    )
    with style():
        figure = sweep_figure(parameter, rows)
    return Drawing(figure, text, f"Sweep of {name}", origin(__name__))
