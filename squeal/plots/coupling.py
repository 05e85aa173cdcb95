"""Modes over a parameter: frequencies, growth rates, and the root locus beside them."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from squeal.analysis.answers import Step
from squeal.analysis.pads import ModeSweep
from squeal.linear import GROWING
from squeal.linear.eigen import assumed_rounding
from squeal.plots.maps import COLOUR_OF, symbol_of
from squeal.plots.modes import NAME, RED
from squeal.plots.style import (
    DOUBLE,
    Drawing,
    frequency_limits,
    hertz,
    origin,
    state_label,
    style,
)

LOOKS: list[dict[str, Any]] = [
    {"color": "#3498DB", "linestyle": "-"},
    {"color": "#6A1B7B", "linestyle": (0, (4, 1.5))},
    {"color": RED, "linestyle": (0, (5, 1.5, 1, 1.5))},
]
"""Of the modes of a pad."""
NOWHERE = "no equilibrium"


def draw_modes(
    upper: Axes,
    lower: Axes,
    mu: np.ndarray,
    values: np.ndarray,
    looks: Sequence[dict[str, Any]],
    units: tuple[float, float] = (math.tau, 1.0),
) -> None:
    """Curves of each mode over mu (k,); of its conjugate the growth rate too.

    values (k, 2n) in rad/s, columns 2j and 2j + 1 a mode and its conjugate (a real pair has two
    growth rates); looks: one for each mode; units: of frequency (rad/s) and growth (1/s).
    """
    pairs = np.split(values, values.shape[1] // 2, axis=1)
    for k, (look, pair) in enumerate(zip(looks, pairs, strict=False), 1):
        upper.plot(mu, np.abs(pair[:, 0].imag) / units[0], gid=f"mode {k}", **look)
        lower.plot(mu, pair.real / units[1], gid=f"mode {k}", **look)


def mark_events(
    events: Sequence[tuple[float, str, str]],
    upper: Axes,
    lower: Axes,
    low: float = 0.0,
    reach: float = 1.0,
) -> None:
    """Verticals (mu, label, line style), sorted, through both panels, labelled in the lower one.

    A label stands before its line unless another one is there; the axis of mu begins at `low` and
    shows as much as `reach`.
    """
    width, free = 0.12 * reach, low
    look: Any = {"rotation": 90, "va": "top", "bbox": {"fc": "w", "ec": "none", "pad": 0.6}}
    look |= {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
    for mu, label, line in events:
        for axes in (upper, lower):
            axes.axvline(mu, color="k", linewidth=0.7, linestyle=line, zorder=0, gid=label)
        before = mu - free > width
        x, side = (-2.0, "right") if before else (2.0, "left")
        lower.annotate(label, (mu, 0.96), (x, 0.0), ha=side, **look)
        free = mu if before else mu + width


def _panels(
    parameter: str, at: np.ndarray, values: np.ndarray, ends: tuple[float, float]
) -> tuple[Figure, tuple[Axes, Axes], Axes]:
    """Empty panels of frequency over growth rate, beside them the roots as dots coloured by `at`.

    at, values (m,): the parameter and the roots (rad/s), of pairs both.
    """
    reach = 1.1 * np.abs(values.real).max(initial=0.0) or 1.0
    figure = Figure(figsize=(DOUBLE, 3.9))
    grid = figure.add_gridspec(2, 2, width_ratios=[1.55, 1.0], height_ratios=[1.6, 1.0])
    upper, beside = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[:, 1])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    name = f"friction {symbol_of(parameter)}" if parameter == "mu" else symbol_of(parameter)
    frequency, growth, span = "frequency [Hz]", "growth rate [1/s]", frequency_limits(values)
    upper.set(xlim=ends, ylim=span, ylabel=frequency)
    upper.tick_params(labelbottom=False)
    lower.set(ylim=(-reach, reach), xlabel=name, ylabel=growth)
    beside.set(xlim=(-reach, reach), ylim=span, xlabel=growth, ylabel=frequency)
    shown = values.imag >= -1e-9 * np.abs(values)
    x, y, mu = values.real[shown], values.imag[shown] / math.tau, at[shown]
    few = len(values) <= 6 * len(np.unique(at))
    beside.axvline(0.0, color="0.75", linewidth=0.5, zorder=0)
    look: Any = {"cmap": "viridis", "vmin": ends[0], "vmax": ends[1], "lw": 0, "zorder": 2}
    dots = beside.scatter(x, y, c=mu, s=9.0 if few else 3.0, **look)
    start = mu == mu.min(initial=np.inf)
    beside.plot(x[start], y[start], "k_", ms=11 if few else 5, mew=0.8)
    figure.colorbar(dots, ax=beside, label=name, aspect=35, pad=0.02)
    figure.align_ylabels([upper, lower])
    return figure, (upper, lower), beside


def _shaded(both: tuple[Axes, Axes], spans: Iterable[tuple[float, float, str]]) -> dict[str, Patch]:
    """Ranges in the colour of their verdict where something grows; what a legend shows of them."""
    looks: dict[str, Any] = {
        verdict: {"fc": COLOUR_OF[verdict], "alpha": 0.13, "lw": 0} for verdict in GROWING
    }
    looks[NOWHERE] = {"fc": "none", "ec": "0.7", "hatch": "////", "lw": 0}
    entries = {}
    for low, high, verdict in spans:
        if verdict in looks and high > low:
            for axes in both:
                axes.axvspan(low, high, zorder=0, gid=verdict, **looks[verdict])
            entries[verdict] = Patch(**looks[verdict])
    return entries


def _legend(figure: Figure, entries: dict[str, Any]) -> None:
    look: Any = {"loc": "outside upper center", "ncols": 3, "columnspacing": 1.4}
    if entries:
        figure.legend(list(entries.values()), list(entries), **look)


def coupling_figure(sweep: ModeSweep, own: float | None = None) -> Figure:
    """Frequencies over growth rates of a pad along the parameter, and the root locus beside them.

    Growing stretches are thick and named in the legend; the background changes colour at the
    thresholds. own: the value of the parameter at which the subject stands, marked.
    """
    values, mus, low, high = sweep.values, sweep.mus, sweep.low, sweep.high
    # the faster growing one of each pair, which of complex pairs is the upper one
    pairs = values.reshape(len(mus), -1, 2)
    rank = np.where(pairs.imag >= 0.0, pairs.real, -np.inf)
    modes = np.take_along_axis(pairs, rank.argmax(axis=2)[:, :, None], axis=2)[:, :, 0]
    # rounding alone grows where no verdict says so
    noise = float(assumed_rounding(np.abs(values).max(), undamped=True))
    noise = noise if {v for *_, v in sweep.spans} & {*GROWING} else np.inf
    best, entries = modes.real.max(axis=0), dict[str, Any]()
    with style():
        at = np.repeat(mus, values.shape[1])
        figure, both, _ = _panels("mu", at, values.ravel(), (low, high))
        draw_modes(*both, mus, values, LOOKS)
        for k in np.argsort(-best).tolist():
            if best[k] > noise:
                on = modes[:, k].real > noise
                frequency = np.where(on, np.abs(modes[:, k].imag) / math.tau, np.nan)
                look: Any = {"color": LOOKS[k]["color"], "linewidth": 2.4}
                both[0].plot(mus, frequency, zorder=4, gid=f"grows {k + 1}", **look)
                words = _words(sweep, float(mus[int(np.argmax(on))]), modes[on, k])
                entries[words] = Line2D([], [], **look)
        entries = entries or {"nothing grows": Line2D([], [], color="k")}
        if own is not None and low <= own <= high:
            look = {"color": "0.5", "linewidth": 0.8, "linestyle": "-."}
            for axes in both:
                axes.axvline(own, zorder=0, **look)
            entries[f"present {symbol_of('mu')} = {own:.4g}"] = Line2D([], [], **look)
        entries |= _shaded(both, [*sweep.spans, (sweep.end, high, NOWHERE)])
        contacts = [(mu, state_label(name), ":") for mu, name in sweep.contacts]
        mark_events(contacts, *both, low, high - low)
        _legend(figure, entries)
    return figure


def _words(sweep: ModeSweep, start: float, values: np.ndarray) -> str:
    """What a growing mode does, from which value on, and how fast it vibrates."""
    ups = [c for c in sweep.crossings if c.direction == "up"]
    near = min(ups, key=lambda c: abs(c.mu - start), default=None)
    vibrates = abs(values[int(np.argmax(values.real))].imag) > 0.0
    words = "flutter" if vibrates else "divergence"
    if near is not None and start > sweep.low:
        words += f" from {symbol_of('mu')} = {near.mu:.4g}"
    return f"{words}, {hertz(abs(values[0].imag))}" if vibrates else words


def coupling_drawing(name: str, sweep: ModeSweep, own: float | None = None) -> Drawing:
    """The coupling figure of what is called `name`, ready to be saved."""
    spans = [*sweep.spans, *[(sweep.end, sweep.high, NOWHERE)] * (sweep.end < sweep.high)]
    words = ", ".join(f"{v} from {low:.6g} to {high:.6g}" for low, high, v in spans)
    ups = [f"{c.kind} at {c.mu:.6g} ({c.frequency_hz:.4g} Hz)" for c in sweep.crossings]
    text = (
        f"Frequencies, growth rates and root locus of {name} over mu from {sweep.low:g} to "
        f"{sweep.high:g}: {words}. Crossings of the imaginary axis: {', '.join(ups) or 'none'}."
    )
    return Drawing(coupling_figure(sweep, own), text, f"Mode coupling of {name}", origin(__name__))


def sweep_drawing(name: str, parameter: str, rows: Sequence[Step]) -> Drawing:
    """Roots at some values of a parameter, a line for each mode; as dots without numbers.

    Those that grow are red, and named beside the roots in the plane.
    """
    steps = [(row.value, row.roots, row.verdict or "") for row in rows if row.roots is not None]
    x = np.array([value for value, *_ in steps])
    at = np.concatenate([np.full(len(roots), value) for value, roots, _ in steps])
    values = np.concatenate([roots for _, roots, _ in steps])
    grows = np.array([e.kind in GROWING for row in rows for e in row.eigenvalues], dtype=bool)
    edges = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
    with style():
        ends = float(x[0]), float(x[-1])
        figure, (upper, lower), beside = _panels(parameter, at, values, ends)
        above = values.imag >= -1e-9 * np.abs(values)
        numbers = np.array([k or 0 for row in rows for k in row.numbers], dtype=int)
        at, values, grows, numbers = (part[above] for part in (at, values, grows, numbers))
        for k in sorted({*numbers.tolist()} - {0}):
            own = np.flatnonzero(numbers == k)
            line: Any = {"color": "0.25", "lw": 0.7, "gid": f"mode {k}"}
            own = own[np.argsort(at[own])]
            upper.plot(at[own], values.imag[own] / math.tau, **line)
            lower.plot(at[own], values.real[own], **line)
        for some, colour, size in ((~grows, "0.25", 1.5), (grows, RED, 4.0)):
            look: Any = {"s": size, "color": colour, "linewidth": 0}
            upper.scatter(at[some], values.imag[some] / math.tau, **look)
            lower.scatter(at[some], values.real[some], **look)
        lower.axhline(0.0, color="0.5", linewidth=0.6)
        spans = zip(edges, edges[1:], [verdict for *_, verdict in steps], strict=False)
        _legend(figure, _shaded((upper, lower), spans))
        _name_growing(beside, values[grows], numbers[grows])
    verdicts = ", ".join(dict.fromkeys(row.verdict or "-" for row in rows))
    text = (
        f"Frequencies and growth rates of the roots of {name} over {parameter} from "
        f"{rows[0].value:g} to {rows[-1].value:g}; verdicts in this order: {verdicts}."
    )
    return Drawing(figure, text, f"Sweep of {name}", origin(__name__))


def _name_growing(axes: Axes, values: np.ndarray, numbers: np.ndarray) -> None:
    """Six modes that grow, each beside its fastest growth, where no other mode is."""
    taken, (right, top) = list[float](), (axes.get_xlim()[1], axes.get_ylim()[1])
    for k in np.argsort(-values.real):
        one = float(values[k].imag)
        if len(taken) < 6 and all(abs(one - other) > 0.04 * max(one, other) for other in taken):
            taken.append(one)
            fits, below = values[k].real < 0.2 * right, one / math.tau > 0.95 * top
            place = (values[k].real if fits else right, one / math.tau)
            look: Any = {"ha": "left" if fits else "right", "va": "top" if below else "bottom"}
            words = f"mode {numbers[k]}, {hertz(one)}" if numbers[k] else hertz(one)
            axes.annotate(words, place, (-2 + 4 * fits, -4 if below else 4), **look, **NAME)
