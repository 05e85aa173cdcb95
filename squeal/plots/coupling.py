"""Modes over a parameter: frequencies, growth rates, and the root locus beside them."""

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from squeal.linear import GROWING
from squeal.linear.events import hertz_of
from squeal.plots.maps import COLOUR_OF, symbol_of
from squeal.plots.modes import NAME, RED
from squeal.plots.style import DOUBLE, Drawing, frequency_limits, hertz, origin, state_label, style
from squeal.results.columns import onset_column
from squeal.results.sweep import Step, Sweep
from squeal.results.thresholds import Thresholds

NOWHERE = "no equilibrium"


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


def _shaded(both: tuple[Axes, Axes], spans: Iterable[tuple[float, float, str]]) -> dict[str, Any]:
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


Span = tuple[float, float, str]


def _spans(sweep: Sweep, found: Thresholds | None, ends: tuple[float, float]) -> list[Span]:
    """Ranges within the ends of the axis, each with its verdict.

    With thresholds these are what lies between them; beyond the last value that was searched there
    is "no equilibrium". Without, a range lies between neighbouring values of the same verdict, so
    that none is claimed where it changes.
    """
    spans: list[Span] = []
    if found is None:
        for step, following in itertools.pairwise(sweep.steps):
            if _verdict(step) == _verdict(following):
                spans.append((step.value, following.value, _verdict(step)))
    else:
        # the kind of a threshold is the verdict from there up to the next one
        edges = [found.low, *(point.mu for point in found.points), found.high, max(ends)]
        verdicts = [found.verdict or "-", *(point.kind for point in found.points), NOWHERE]
        spans = list(zip(edges[:-1], edges[1:], verdicts, strict=True))
    joined: list[Span] = []
    for begin, end, verdict in spans:
        low = max(begin, ends[0])
        high = min(end, ends[1])
        if joined and joined[-1][1:] == (low, verdict):  # goes on where the last one ends
            low = joined.pop()[0]
        if high > low:
            joined.append((low, high, verdict))
    return joined


def _verdict(step: Step) -> str:
    if step.verdict:
        return step.verdict
    return NOWHERE if step.roots is None else "-"


def sweep_drawing(
    name: str,
    sweep: Sweep,
    found: Thresholds | None = None,
    ends: tuple[float, float] | None = None,
    own: float | None = None,
) -> Drawing:
    """Frequencies over growth rates along a parameter, a line for each mode, and the root locus
    beside them.

    Modes that grow are red, and named in the locus; the legend says from where on they do. The
    background changes colour where the verdict does. found: thresholds of the same subject;
    ends: of the axis; own: where the subject stands, marked.
    """
    steps, parameter = [step for step in sweep.steps if step.roots is not None], sweep.parameter
    rows = [row for step in steps for row in zip(step.eigenvalues, step.numbers, strict=True)]
    at = np.repeat([step.value for step in steps], [len(step.eigenvalues) for step in steps])
    values = np.array([root.value for root, _ in rows], dtype=complex)
    grows = np.array([root.kind in GROWING for root, _ in rows], dtype=bool)
    numbers = np.array([number or 0 for _, number in rows], dtype=int)
    ends = ends or (sweep.steps[0].value, sweep.steps[-1].value)
    spans = _spans(sweep, found, ends)
    with style():
        figure, (upper, lower), beside = _panels(parameter, at, values, ends)
        above = values.imag >= -1e-9 * np.abs(values)
        at, values, grows, numbers = (part[above] for part in (at, values, grows, numbers))
        for k in sorted({*numbers.tolist()} - {0}):
            mine = np.flatnonzero(numbers == k)
            line: Any = {"color": "0.25", "lw": 0.7, "gid": f"mode {k}"}
            mine = mine[np.argsort(at[mine])]
            upper.plot(at[mine], values.imag[mine] / math.tau, **line)
            lower.plot(at[mine], values.real[mine], **line)
        for some, colour, size in ((~grows, "0.25", 1.5), (grows, RED, 4.0)):
            look: Any = {"s": size, "color": colour, "linewidth": 0, "zorder": 3}
            upper.scatter(at[some], values.imag[some] / math.tau, **look)
            lower.scatter(at[some], values.real[some], **look)
        lower.axhline(0.0, color="0.5", linewidth=0.6)
        entries = _onsets(sweep, found) | _shaded((upper, lower), spans)
        if own is not None and ends[0] <= own <= ends[1]:
            look = {"color": "0.5", "linewidth": 0.8, "linestyle": "-."}
            for axes in (upper, lower):
                axes.axvline(own, zorder=0, **look)
            entries[f"present {symbol_of(parameter)} = {own:.4g}"] = Line2D([], [], **look)
        contacts = [
            (0.5 * (a.value + b.value), state_label(b.contact), ":")
            for a, b in itertools.pairwise(steps)
            if b.contact is not None and a.contact != b.contact
        ]
        mark_events(contacts, upper, lower, ends[0], ends[1] - ends[0])
        _legend(figure, entries)
        _name_growing(beside, values[grows], numbers[grows], found is None)
    words = ", ".join(f"{v} from {low:.6g} to {high:.6g}" for low, high, v in spans)
    text = (
        f"Frequencies, growth rates and root locus of {name} over {parameter} from {ends[0]:g} to "
        f"{ends[1]:g}: {words}."
    )
    if found is not None:
        ups = [f"{c.kind} at {c.mu:.6g} ({c.frequency_hz:.4g} Hz)" for c in found.crossings]
        text += f" Crossings of the imaginary axis: {', '.join(ups) or 'none'}."
    return Drawing(figure, text, f"Modes of {name} over {parameter}", origin(__name__))


def _onsets(sweep: Sweep, found: Thresholds | None) -> dict[str, Line2D]:
    """What a legend says of the first modes that grow: from where on."""
    at = symbol_of(sweep.parameter)
    if found is None:
        between = onset_column(sweep.parameter).cell
        began = [mode for mode in sweep.modes if mode.onset is not None]
        words = [f"mode {m.mode}: growth begins at {at} = {between(m)}" for m in began]
    else:
        ups = [c for c in found.crossings if c.direction == "up"]
        words = [f"{c.kind} from {at} = {c.mu:.4g}{hertz_of(c.frequency_hz)}" for c in ups]
    return {text: Line2D([], [], color=RED, marker=".", lw=0) for text in words[:6]}


def _name_growing(axes: Axes, values: np.ndarray, numbers: np.ndarray, numbered: bool) -> None:
    """Six modes that grow, each beside its fastest growth, where no other mode is; by number where
    a table has the same numbers."""
    taken, known, (right, top) = list[float](), {0}, (axes.get_xlim()[1], axes.get_ylim()[1])
    for k in np.argsort(-values.real):
        one, number = float(values[k].imag), int(numbers[k])
        free = all(abs(one - other) > 0.04 * max(one, other) for other in taken)
        if len(taken) < 6 and free and not (number and number in known):
            taken.append(one)
            known.add(number)
            fits, below = values[k].real < 0.2 * right, one / math.tau > 0.95 * top
            place = (values[k].real if fits else right, one / math.tau)
            look: Any = {"ha": "left" if fits else "right", "va": "top" if below else "bottom"}
            words = f"mode {number}, {hertz(one)}" if number and numbered else hertz(one)
            axes.annotate(words, place, (-2 + 4 * fits, -4 if below else 4), **look, **NAME)
