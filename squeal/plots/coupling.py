"""Modes over a parameter: frequencies, growth rates, and the root locus beside them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from squeal.linear import GROWING, Eigenvalue
from squeal.linear.events import hertz_of
from squeal.plots.maps import COLOUR_OF, symbol_of
from squeal.plots.modes import NAME, RED
from squeal.plots.style import DOUBLE, Drawing, frequency_limits, hertz, origin, state_label, style
from squeal.results.columns import onset_column
from squeal.results.sweep import Step, Sweep
from squeal.results.thresholds import Thresholds

NO_EQUILIBRIUM = "no equilibrium"
FREQUENCY = "frequency [Hz]"
GROWTH = "growth rate [1/s]"


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
    width = 0.12 * reach
    free = low  # from here on no label stands
    for mu, label, line in events:
        for axes in (upper, lower):
            axes.axvline(mu, color="k", linewidth=0.7, linestyle=line, zorder=0, gid=label)
        before = mu - free > width
        lower.annotate(
            label,
            (mu, 0.96),
            (-2.0 if before else 2.0, 0.0),
            ha="right" if before else "left",
            rotation=90,
            va="top",
            bbox={"fc": "w", "ec": "none", "pad": 0.6},
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
        )
        free = mu if before else mu + width


class _Panels(NamedTuple):
    """Frequency over growth rate along the parameter, and beside both the root locus."""

    figure: Figure
    upper: Axes
    lower: Axes
    locus: Axes


class _Roots(NamedTuple):
    """Roots (m,) of all steps of a sweep."""

    at: np.ndarray  # the parameter
    values: np.ndarray  # rad/s, of pairs both
    grow: np.ndarray
    numbers: np.ndarray  # of the modes, 0 where not known

    @staticmethod
    def of(sweep: Sweep) -> _Roots:
        """All roots of a sweep."""
        at: list[float] = []
        roots: list[Eigenvalue] = []
        numbers: list[int] = []
        for step in sweep.steps:
            if step.roots is not None:
                roots += step.eigenvalues
                at += [step.value] * len(step.eigenvalues)
                numbers += [number or 0 for number in step.numbers]
        return _Roots(
            at=np.array(at),
            values=np.array([root.value for root in roots], dtype=complex),
            grow=np.array([root.kind in GROWING for root in roots], dtype=bool),
            numbers=np.array(numbers, dtype=int),
        )

    def select(self, which: np.ndarray) -> _Roots:
        """Some of them."""
        return _Roots(*(part[which] for part in self))


def _panels(parameter: str, roots: _Roots, ends: tuple[float, float]) -> _Panels:
    """Empty panels beside the roots as dots coloured by the parameter."""
    values = roots.values
    reach = 1.1 * np.abs(values.real).max(initial=0.0) or 1.0
    figure = Figure(figsize=(DOUBLE, 3.9))
    grid = figure.add_gridspec(2, 2, width_ratios=[1.55, 1.0], height_ratios=[1.6, 1.0])
    upper = figure.add_subplot(grid[0, 0])
    locus = figure.add_subplot(grid[:, 1])
    lower = figure.add_subplot(grid[1, 0], sharex=upper)
    name = f"friction {symbol_of(parameter)}" if parameter == "mu" else symbol_of(parameter)
    limits = frequency_limits(values)
    upper.set(xlim=ends, ylim=limits, ylabel=FREQUENCY)
    upper.tick_params(labelbottom=False)
    lower.set(ylim=(-reach, reach), xlabel=name, ylabel=GROWTH)
    locus.set(xlim=(-reach, reach), ylim=limits, xlabel=GROWTH, ylabel=FREQUENCY)
    shown = roots.select(_is_upper(values))
    x = shown.values.real
    y = shown.values.imag / math.tau
    few = len(values) <= 6 * len(np.unique(roots.at))
    locus.axvline(0.0, color="0.75", linewidth=0.5, zorder=0)
    size = 9.0 if few else 3.0
    low, high = ends
    dots = locus.scatter(x, y, size, shown.at, cmap="viridis", vmin=low, vmax=high, lw=0, zorder=2)
    is_start = shown.at == shown.at.min(initial=np.inf)
    locus.plot(x[is_start], y[is_start], "k_", ms=11 if few else 5, mew=0.8)
    figure.colorbar(dots, ax=locus, label=name, aspect=35, pad=0.02)
    figure.align_ylabels([upper, lower])
    return _Panels(figure, upper, lower, locus)


def _is_upper(values: np.ndarray) -> np.ndarray:
    return values.imag >= -1e-9 * np.abs(values)


class Span(NamedTuple):
    """A range of the parameter with one verdict."""

    low: float
    high: float
    verdict: str


def _shade(panels: _Panels, spans: Sequence[Span]) -> dict[str, Artist]:
    """Ranges in the colour of their verdict where something grows; what a legend shows of them."""
    looks: dict[str, Any] = {NO_EQUILIBRIUM: {"fc": "none", "ec": "0.7", "hatch": "////", "lw": 0}}
    for verdict in GROWING:
        looks[verdict] = {"fc": COLOUR_OF[verdict], "alpha": 0.13, "lw": 0}
    entries: dict[str, Artist] = {}
    for low, high, verdict in spans:
        if verdict in looks and high > low:
            for axes in (panels.upper, panels.lower):
                axes.axvspan(low, high, zorder=0, gid=verdict, **looks[verdict])
            entries[verdict] = Patch(**looks[verdict])
    return entries


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
                spans.append(Span(step.value, following.value, _verdict(step)))
    else:
        # the kind of a threshold is the verdict from there up to the next one
        edges = [found.low, *(point.mu for point in found.points), found.high, max(ends)]
        verdicts = [found.verdict or "-", *(point.kind for point in found.points), NO_EQUILIBRIUM]
        spans = list(map(Span, edges[:-1], edges[1:], verdicts))
    joined: list[Span] = []
    for begin, end, verdict in spans:
        low = max(begin, ends[0])
        high = min(end, ends[1])
        if joined and joined[-1][1:] == (low, verdict):  # goes on where the last one ends
            low = joined.pop()[0]
        if high > low:
            joined.append(Span(low, high, verdict))
    return joined


def _verdict(step: Step) -> str:
    if step.verdict:
        return step.verdict
    return NO_EQUILIBRIUM if step.roots is None else "-"


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
    parameter = sweep.parameter
    low, high = ends or (sweep.steps[0].value, sweep.steps[-1].value)
    spans = _spans(sweep, found, (low, high))
    roots = _Roots.of(sweep)
    with style():
        panels = _panels(parameter, roots, (low, high))
        upper_roots = roots.select(_is_upper(roots.values))
        _draw_modes(panels, upper_roots)
        entries = _onsets(sweep, found) | _shade(panels, spans)
        if own is not None and low <= own <= high:
            look: Any = {"color": "0.5", "linewidth": 0.8, "linestyle": "-."}
            for axes in (panels.upper, panels.lower):
                axes.axvline(own, zorder=0, **look)
            entries[f"present {symbol_of(parameter)} = {own:.4g}"] = Line2D([], [], **look)
        mark_events(_contact_changes(sweep), panels.upper, panels.lower, low, high - low)
        if entries:
            panels.figure.legend(
                entries.values(), entries, loc="outside upper center", ncols=3, columnspacing=1.4
            )
        _name_growing(panels.locus, upper_roots.select(upper_roots.grow), numbered=found is None)
    ranges = [f"{span.verdict} from {span.low:.6g} to {span.high:.6g}" for span in spans]
    text = (
        f"Frequencies, growth rates and root locus of {name} over {parameter} from {low:g} to "
        f"{high:g}: {', '.join(ranges)}."
    )
    if found is not None:
        crossings = [f"{c.kind} at {c.mu:.6g} ({c.frequency_hz:.4g} Hz)" for c in found.crossings]
        text += f" Crossings of the imaginary axis: {', '.join(crossings) or 'none'}."
    return Drawing(panels.figure, text, f"Modes of {name} over {parameter}", origin(__name__))


def _draw_modes(panels: _Panels, roots: _Roots) -> None:
    """A line for each numbered mode, and all roots as dots, red where they grow."""
    curves = ((panels.upper, roots.values.imag / math.tau), (panels.lower, roots.values.real))
    for k in sorted({*roots.numbers.tolist()} - {0}):
        of_mode = np.flatnonzero(roots.numbers == k)
        of_mode = of_mode[np.argsort(roots.at[of_mode])]
        for axes, y in curves:
            axes.plot(roots.at[of_mode], y[of_mode], color="0.25", lw=0.7, gid=f"mode {k}")
    for which, colour, size in ((~roots.grow, "0.25", 1.5), (roots.grow, RED, 4.0)):
        for axes, y in curves:
            axes.scatter(roots.at[which], y[which], s=size, color=colour, linewidth=0, zorder=3)
    panels.lower.axhline(0.0, color="0.5", linewidth=0.6)


def _contact_changes(sweep: Sweep) -> list[tuple[float, str, str]]:
    """Verticals where the contact state changes between two values."""
    steps = [step for step in sweep.steps if step.roots is not None]
    changes = []
    for step, following in itertools.pairwise(steps):
        if following.contact is not None and step.contact != following.contact:
            middle = 0.5 * (step.value + following.value)
            changes.append((middle, state_label(following.contact), ":"))
    return changes


def _onsets(sweep: Sweep, found: Thresholds | None) -> dict[str, Artist]:
    """What a legend says of the first modes that grow: from where on."""
    at = symbol_of(sweep.parameter)
    if found is None:
        between = onset_column(sweep.parameter).cell
        began = [mode for mode in sweep.modes if mode.onset is not None]
        texts = [f"mode {m.mode}: growth begins at {at} = {between(m)}" for m in began]
    else:
        ups = [c for c in found.crossings if c.direction == "up"]
        texts = [f"{c.kind} from {at} = {c.mu:.4g}{hertz_of(c.frequency_hz)}" for c in ups]
    return {text: Line2D([], [], color=RED, marker=".", lw=0) for text in texts[:6]}


def _name_growing(axes: Axes, roots: _Roots, numbered: bool) -> None:
    """Six modes that grow, each beside its fastest growth, where no other mode is; by number where
    a table has the same numbers."""
    right = axes.get_xlim()[1]
    top = axes.get_ylim()[1]
    taken: list[float] = []
    named: list[int] = []
    for k in np.argsort(-roots.values.real):
        growth = roots.values[k].real
        omega = float(roots.values[k].imag)
        number = int(roots.numbers[k])
        is_free = all(abs(omega - other) > 0.04 * max(omega, other) for other in taken)
        if len(taken) == 6 or not is_free or number in named:
            continue
        taken.append(omega)
        text = hertz(omega)
        if number:
            named.append(number)
            text = f"mode {number}, {text}" if numbered else text
        fits = growth < 0.2 * right  # to the right of the root
        below = omega / math.tau > 0.95 * top
        axes.annotate(
            text,
            (growth if fits else right, omega / math.tau),
            (2 if fits else -2, -4 if below else 4),
            ha="left" if fits else "right",
            va="top" if below else "bottom",
            **NAME,
        )
