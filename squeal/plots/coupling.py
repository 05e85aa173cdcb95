"""Modes over a parameter: frequencies, growth rates, and the root locus beside them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from squeal.analysis.answers import Step
from squeal.analysis.modes import ModeSweep
from squeal.linear import GROWING
from squeal.plots.maps import COLOUR_OF, symbol
from squeal.plots.modes import NAME, growing
from squeal.plots.style import (
    DOUBLE,
    Drawing,
    Unit,
    frequency_limits,
    in_unit,
    literal,
    origin,
    state_label,
    style,
    units_of,
)

COLOURS = ("#3498DB", "#6A1B7B", "#C8380E")
LOOKS: list[dict[str, Any]] = [
    {"color": colour, "linestyle": line}
    for colour, line in zip(COLOURS, ("-", (0, (4, 1.5)), (0, (5, 1.5, 1, 1.5))), strict=True)
]
"""Of few modes each has a look; of more only those that grow."""
OF_MANY = (*COLOURS[::-1], "#117A65", "#B7950B", "#000000")
"""Colours of growing modes among many, and so of those that a legend lists."""


def draw_modes(
    upper: Axes,
    lower: Axes,
    mu: np.ndarray,
    values: np.ndarray,
    looks: Sequence[dict[str, Any]],
    units: tuple[Unit, Unit],
) -> None:
    """Curves of each mode over mu (k,); of its conjugate the growth rate too.

    values (k, 2n) in rad/s, columns 2j and 2j + 1 a mode and its conjugate (a real pair has two
    growth rates); looks: one for each mode; units: of frequency and growth.
    """
    for k, look in enumerate(looks):
        own = look | {"gid": f"mode {k + 1}"}
        upper.plot(mu, np.abs(values[:, 2 * k].imag) / units[0].factor, **own)
        for j in (2 * k, 2 * k + 1):
            lower.plot(mu, values[:, j].real / units[1].factor, **own)


def mark_events(
    events: Sequence[tuple[float, str, str]],
    upper: Axes,
    lower: Axes,
    low: float = 0.0,
    reach: float = 1.0,
    height: float = 0.96,
) -> None:
    """Verticals (mu, label, line style), sorted, through both panels, which may be one.

    Labels stand in the lower one below a height (share of the axis), before their line unless
    another one is there; the axis of mu begins at `low` and shows as much as `reach`.
    """
    width, free = 0.12 * reach, low
    for mu, label, line in events:
        for axes in dict.fromkeys((upper, lower)):
            axes.axvline(mu, color="k", linewidth=0.7, linestyle=line, zorder=0, gid=label)
        before = mu - free > width
        x, side = (-2.0, "right") if before else (2.0, "left")
        place: Any = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
        look: Any = {"rotation": 90, "va": "top", "bbox": {"fc": "w", "ec": "none", "pad": 0.6}}
        lower.annotate(label, (mu, height), (x, 0.0), ha=side, **place, **look)
        free = mu if before else mu + width


def symbol_of(parameter: str) -> str:
    """The parameter as it stands on an axis."""
    return symbol(parameter) if parameter == "mu" else literal(parameter)


def _panels(
    parameter: str, at: np.ndarray, values: np.ndarray, ends: tuple[float, float]
) -> tuple[Figure, Axes, Axes, tuple[Unit, Unit]]:
    """Empty panels of frequency over growth rate, beside them the roots as dots coloured by `at`.

    at, values (m,): the parameter and the roots (rad/s), of pairs both.
    """
    units = units_of(values)
    reach = 1.1 * np.abs(values.real).max(initial=0.0) / units[1].factor or 1.0
    span = frequency_limits(values, units[0])
    figure = Figure(figsize=(DOUBLE, 3.9))
    grid = figure.add_gridspec(2, 2, width_ratios=[1.55, 1.0], height_ratios=[1.6, 1.0])
    upper = figure.add_subplot(grid[0, 0])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    beside = figure.add_subplot(grid[:, 1])
    upper.set_xlim(*ends)
    upper.set_ylim(*span)
    lower.set_ylim(-reach, reach)
    beside.set_xlim(-reach, reach)
    beside.set_ylim(*span)
    shown = values.imag >= -1e-9 * np.abs(values)
    x, y, mu = values.real[shown] / units[1].factor, values.imag[shown] / units[0].factor, at[shown]
    few = len(values) <= 6 * len(np.unique(at))
    beside.axvline(0.0, color="0.75", linewidth=0.5, zorder=0)
    look: dict[str, Any] = {"cmap": "viridis", "vmin": ends[0], "vmax": ends[1], "lw": 0}
    dots = beside.scatter(x, y, c=mu, s=9.0 if few else 3.0, gid="mu", zorder=2, **look)
    start = mu == mu.min(initial=np.inf)
    beside.plot(x[start], y[start], "k_", ms=11 if few else 5, mew=0.8, gid="start")
    name = rf"friction {symbol(parameter)}" if parameter == "mu" else literal(parameter)
    figure.colorbar(dots, ax=beside, label=name, aspect=35, pad=0.02)
    lower.set_xlabel(name)
    upper.tick_params(labelbottom=False)
    for axes in (upper, beside):
        axes.set_ylabel(f"frequency [{units[0].name}]")
    lower.set_ylabel(f"growth rate [{units[1].name}]")
    beside.set_xlabel(f"growth rate [{units[1].name}]")
    figure.align_ylabels([upper, lower])
    return figure, upper, lower, units


def _background(
    spans: Sequence[tuple[float, float, str]], both: tuple[Axes, Axes]
) -> list[tuple[Any, str]]:
    """Ranges in the colour of their verdict where something grows; what a legend says of them."""
    met = {}
    for low, high, verdict in spans:
        if verdict in GROWING:
            look: dict[str, Any] = {"color": COLOUR_OF[verdict], "alpha": 0.13, "lw": 0}
            for axes in both:
                axes.axvspan(low, high, zorder=0, gid=verdict, **look)
            met[verdict] = Patch(facecolor=COLOUR_OF[verdict], alpha=0.13)
    return [(patch, name) for name, patch in met.items()]


def coupling_figure(found: ModeSweep, own: float | None = None) -> Figure:
    """Frequencies over growth rates along the parameter, and the root locus beside them.

    Growing stretches are thick and named in the legend; the background changes colour at the
    thresholds. own: the value of the parameter at which the subject stands, marked.
    """
    values, mus, low, high = found.values, found.mus, found.low, found.high
    # the faster growing one of each pair, which of complex pairs is the upper one
    pairs = values.reshape(len(mus), -1, 2)
    rank = np.where(pairs.imag >= 0.0, pairs.real, -np.inf)
    modes = np.take_along_axis(pairs, rank.argmax(axis=2)[:, :, None], axis=2)[:, :, 0]
    noise = 1e-7 * np.abs(values).max()
    best = modes.real.max(axis=0)
    grow = [k for k in np.argsort(-best).tolist() if best[k] > noise]
    if not any(verdict in GROWING for *_, verdict in found.spans):
        grow = []
    looks: list[dict[str, Any]] = list(LOOKS[: modes.shape[1]])
    if modes.shape[1] > len(LOOKS):
        looks = [{"color": "0.72", "linewidth": 0.5, "zorder": 1}] * modes.shape[1]
        for k, colour in zip(grow, [*OF_MANY, *["0.3"] * len(grow)], strict=False):
            looks[k] = {"color": colour, "linewidth": 1.1, "zorder": 3}
    with style():
        at = np.repeat(mus, values.shape[1])
        figure, upper, lower, units = _panels(found.parameter, at, values.ravel(), (low, high))
        draw_modes(upper, lower, mus, values, looks, units)
        entries: list[tuple[Any, str]] = []
        for k in grow:
            on = modes[:, k].real > noise
            frequency = np.where(on, np.abs(modes[:, k].imag) / units[0].factor, np.nan)
            look = {"color": looks[k]["color"], "linewidth": 2.4}
            upper.plot(mus, frequency, zorder=4, gid=f"grows {k + 1}", **look)
            words = _words(found, float(mus[int(np.argmax(on))]), modes[on, k], units[0])
            entries.append((Line2D([], [], **look), words))
        more = len(grow) - len(OF_MANY)
        if more > 0:
            handle = Line2D([], [], color="0.3", linewidth=2.4)
            entries[len(OF_MANY) :] = [(handle, f"{more} more that grow")]
        if not grow:
            entries.append((Line2D([], [], color="k"), "nothing grows"))
        patches = _background(found.spans, (upper, lower))
        if found.end < high:
            look = {"fc": "none", "ec": "0.7", "hatch": "////", "lw": 0}
            for axes in (upper, lower):
                axes.axvspan(found.end, high, gid="no equilibrium", **look)
            patches.append((Patch(**look), "no equilibrium"))
        contacts = [(mu, state_label(name), ":") for mu, name in found.contacts]
        mark_events(contacts, upper, lower, low, high - low)
        if own is not None and low <= own <= high:
            look = {"color": "0.5", "linewidth": 0.8, "linestyle": "-."}
            for axes in (upper, lower):
                axes.axvline(own, zorder=0, gid="own", **look)
            words = f"present {symbol_of(found.parameter)} = {own:.4g}"
            entries.append((Line2D([], [], **look), words))
        handles, names = [list(part) for part in zip(*entries, *patches, strict=True)]
        figure.legend(handles, names, loc="outside upper center", ncols=3, columnspacing=1.4)
    return figure


def _words(found: ModeSweep, start: float, own: np.ndarray, unit: Unit) -> str:
    """What a growing mode does, from which value on, and how fast it vibrates."""
    ups = [c for c in found.crossings if c.direction == "up"]
    near = min(ups, key=lambda c: abs(c.mu - start), default=None)
    vibrates = abs(own[int(np.argmax(own.real))].imag) > 0.0
    words = "flutter" if vibrates else "divergence"
    if near is not None and start > found.low:
        words += f" from {symbol_of(found.parameter)} = {near.mu:.4g}"
    return f"{words}, {in_unit(abs(own[0].imag), unit)}" if vibrates else words


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


def sweep_figure(parameter: str, rows: Sequence[Step]) -> Figure:
    """Roots at some values of a parameter as dots, which need not be followed.

    Those that grow are red; the frequencies that grow anywhere are named where they grow most.
    """
    known = [(row.value, row.roots, row.verdict) for row in rows if row.roots is not None]
    x = np.array([value for value, *_ in known])
    at = np.concatenate([np.full(len(roots), value) for value, roots, _ in known])
    values = np.concatenate([roots for _, roots, _ in known])
    edges = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
    spans = zip(edges, edges[1:], [verdict or "" for *_, verdict in known], strict=False)
    with style():
        ends = (float(x[0]), float(x[-1]))
        figure, upper, lower, units = _panels(parameter, at, values, ends)
        keep = values.imag >= -1e-9 * np.abs(values)
        at, values = at[keep], values[keep]
        grows = growing(values)
        for kept, colour, size in ((~grows, "0.25", 1.5), (grows, COLOURS[2], 4.0)):
            look: dict[str, Any] = {"s": size, "color": colour, "linewidth": 0}
            upper.scatter(at[kept], values.imag[kept] / units[0].factor, **look)
            lower.scatter(at[kept], values.real[kept] / units[1].factor, **look)
        lower.axhline(0.0, color="0.5", linewidth=0.6)
        patches = _background(list(spans), (upper, lower))
        if patches:
            handles, names = [list(part) for part in zip(*patches, strict=True)]
            figure.legend(handles, names, loc="outside upper center", ncols=3)
        _name_growing(upper, at[grows], values[grows], units[0])
    return figure


def _name_growing(axes: Axes, at: np.ndarray, values: np.ndarray, unit: Unit) -> None:
    """Different frequencies that grow, each where it grows most; names stay within the frame."""
    taken: list[float] = []
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    for k in np.argsort(-values.real):
        one = float(values[k].imag)
        if len(taken) < 6 and all(abs(one - other) > 0.04 * max(one, other) for other in taken):
            taken.append(one)
            share, place = (at[k] - left) / (right - left), (at[k], one / unit.factor)
            below = place[1] - bottom > 0.8 * (top - bottom)
            look: Any = {"ha": "center", "va": "top" if below else "bottom"}
            aside = 0
            if not 0.1 <= share <= 0.9:
                look["ha"], aside = ("left", 3) if share < 0.1 else ("right", -3)
            by = (aside, -4 if below else 4)
            axes.annotate(in_unit(one, unit), place, by, **look, **NAME)


def sweep_drawing(name: str, parameter: str, rows: Sequence[Step]) -> Drawing:
    """The figure of a sweep, ready to be saved."""
    seen = ", ".join(dict.fromkeys(row.verdict or "-" for row in rows))
    text = (
        f"Frequencies and growth rates of the roots of {name} over {parameter} from "
        f"{rows[0].value:g} to {rows[-1].value:g}, and their way in the complex plane; verdicts "
        f"in this order: {seen}."
    )
    return Drawing(sweep_figure(parameter, rows), text, f"Sweep of {name}", origin(__name__))
