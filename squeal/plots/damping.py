"""Damping ratio over frequency through a sweep, and beside it the two modes that meet."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.linear.events import Crossing
from squeal.plots.maps import friction_symbol, symbol_of
from squeal.plots.modes import RED
from squeal.plots.style import (
    DOUBLE,
    SINGLE,
    Drawing,
    frequency_limits,
    origin,
    style,
)
from squeal.results.sources import PadSource, Source
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds
from squeal.schema import Place, Word

COLOURS = ("#C8380E", "#0072B2", "#6A1B7B", "#009E73", "#E69F00", "#56B4E9")
"""Of modes that grow, the fastest first, and of the partners that they meet."""
LARGEST = 160.0  # points squared: the bubble of the fastest growth
BUBBLES = 20  # of a mode, at most
BELOW = 1.35  # shown damping ratios below zero, over the depth of the lowest one
GROWS = 1e-9  # of |lambda|: a growth rate below is rounding
NEAREST = 0.1  # of the frequency: no partner is farther from a mode where it grows fastest
ABOVE = 1.4  # shown damping ratios above zero, over the depth of the lowest one
MET = 0.05  # of their first distance: two frequencies have met where they are nearer
ALONE = 0.2  # of the frequency: a threshold farther from a mode is none of it
WIDTHS = ("page", "column")
"""A chart over the width of a page has its panels side by side; in a column one is below."""


class _Paths:
    """Values of the parameter and roots with Im >= 0 of each mode of a sweep, by rising value."""

    def __init__(self, sweep: Sweep) -> None:
        values: dict[int, list[float]] = {}
        roots: dict[int, list[complex]] = {}
        for step in sweep.steps:
            for root, mode in zip(step.eigenvalues, step.numbers, strict=True):
                if mode and root.value.imag > 0.0:
                    values.setdefault(mode, []).append(step.value)
                    roots.setdefault(mode, []).append(root.value)
        self.at = {mode: np.array(path) for mode, path in values.items()}
        self.roots = {mode: np.array(path) for mode, path in roots.items()}

    def root_at(self, mode: int, value: float) -> complex | None:
        """The root of a mode at a value, interpolated; None where its path does not reach."""
        at = self.at[mode]
        if not at[0] <= value <= at[-1]:
            return None
        return complex(np.interp(value, at, self.roots[mode]))

    def meeting(self, pair: Sequence[int]) -> float | None:
        """The first value at which the frequencies of two modes have met; None if they never do."""
        first, second = pair
        values, of_first, of_second = np.intersect1d(
            self.at[first], self.at[second], return_indices=True
        )
        if not values.size:
            return None
        upper = self.roots[first].imag[of_first]
        distances = np.abs(upper - self.roots[second].imag[of_second])
        have_met = distances < MET * distances[0]
        return float(values[np.argmax(have_met)]) if have_met.any() else None

    def growth(self, mode: int) -> float:
        """The fastest growth rate of a mode, 1/s."""
        return float(self.roots[mode].real.max())

    def growing(self, sweep: Sweep) -> list[int]:
        """The modes that grow somewhere, the fastest first."""
        modes = []
        for swept in sweep.modes:
            mode = swept.mode
            if swept.growth_rate <= 0.0 or mode not in self.at:
                continue
            if self.growth(mode) > GROWS * abs(self.roots[mode][0]):
                modes.append(mode)
        return sorted(modes, key=self.growth, reverse=True)

    def partner(self, mode: int) -> int | None:
        """The mode whose frequency is nearest to that of `mode` where `mode` grows fastest.

        None if none is as near as `NEAREST`, of the frequency.
        """
        fastest = int(np.argmax(self.roots[mode].real))
        value = self.at[mode][fastest]
        frequency = self.roots[mode][fastest].imag
        nearest = None
        least = NEAREST
        for other, values in self.at.items():
            steps = np.flatnonzero(values == value)
            if other == mode or not steps.size:
                continue
            distance = abs(self.roots[other][steps[0]].imag - frequency) / frequency
            if distance < least:
                nearest = other
                least = distance
        return nearest


def damping_drawing(
    name: str, sweep: Sweep, thresholds: Thresholds | None = None, width: str = "page"
) -> Drawing:
    """Draw damping ratios in % over frequency, a line for each mode, with bubbles by growth.

    Beside it stand the frequencies of the mode that grows fastest and of its partner over the
    parameter, with the value from which on it grows. Rings mark the subject's own value.

    Parameters
    ----------
    name : str
        The subject, for the alternative text.
    sweep : Sweep
        What is drawn.
    thresholds : Thresholds, optional
        Of the same subject: they tell more exactly than the sweep where growth begins.
    width : {"page", "column"}
        Whether the second panel stands beside the first one or below.
    """
    Word(WIDTHS).read(width, Place("width"))
    paths = _Paths(sweep)
    growing = paths.growing(sweep)
    pair = []  # the fastest mode, and its partner if it has one
    count = "1 mode grows" if len(growing) == 1 else f"{len(growing)} modes grow"
    text = f"Damping ratio over frequency of {name}, {count}"
    if growing:
        lead = growing[0]
        pair.append(lead)
        text += f"; the fastest is mode {lead} by {paths.growth(lead):.4g} 1/s"
        partner = paths.partner(lead)
        if partner is not None:
            pair.append(partner)
            text += f", which meets mode {partner}"
    coloured = dict.fromkeys([*pair, *growing])  # each once; those beyond COLOURS remain grey
    colours = dict(zip(coloured, COLOURS, strict=False))
    source = sweep.source
    if source is None and thresholds is not None:
        source = thresholds.source
    own_value = _own_value(sweep, source)
    with style():
        if width == "column":
            figure = Figure(figsize=(SINGLE, 5.2))
            upper, lower = figure.subplots(2, 1, height_ratios=[1.3, 1.0])
        else:
            figure = Figure(figsize=(DOUBLE, 3.4))
            upper, lower = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
        entries = _draw_ratios(upper, sweep, paths, colours)
        onset = None
        if pair:
            onset = _onset(sweep, paths, pair[0], thresholds)
        _draw_pair(lower, sweep, paths, pair, colours, onset)
        if own_value is not None:
            entries += _mark_own_value(upper, lower, sweep, paths, pair, colours, own_value)
        if entries:
            columns = 2 if width == "column" else len(entries)
            figure.legend(handles=entries, loc="outside lower center", ncols=columns)
    return Drawing(figure, f"{text}.", f"Damping ratios of {name}", origin(__name__))


def _own_value(sweep: Sweep, source: Source | None) -> float | None:
    """The subject's own value of the parameter, None where it is not known or not in the sweep."""
    if source is None:
        return None
    if isinstance(source, PadSource):
        own_value = float(source.scene.pad.mu)
    else:
        own_value = source.file.system.parameters[sweep.parameter]
    values = [step.value for step in sweep.steps]
    return own_value if min(values) <= own_value <= max(values) else None


def _mark_own_value(
    upper: Axes,
    lower: Axes,
    sweep: Sweep,
    paths: _Paths,
    pair: Sequence[int],
    colours: dict[int, str],
    own_value: float,
) -> list[Artist]:
    """Mark the subject's own value by rings in both panels and a line in the lower one.

    Returns the entry of a legend.
    """
    ring: Any = {"marker": "o", "ls": "", "mfc": "none", "mec": "k", "mew": 0.9, "ms": 6.0}
    for mode in colours:
        root = paths.root_at(mode, own_value)
        if root is None:
            continue
        frequency = root.imag / math.tau
        upper.plot(frequency, _ratio(np.array(root)), zorder=5, gid="own value", **ring)
        if mode in pair:
            lower.plot(own_value, frequency, zorder=5, gid="own value", **ring)
    lower.axvline(own_value, color="0.4", lw=0.6, ls="-.", zorder=0)
    name = f"present {symbol_of(sweep.parameter)} = {own_value:.4g}"
    return [Line2D([], [], label=name, **ring)]


def _draw_ratios(axes: Axes, sweep: Sweep, paths: _Paths, colours: dict[int, str]) -> list[Artist]:
    """Draw all modes in the plane of frequency and damping ratio, grey without a colour.

    colours: by the number of the mode, of modes that grow and of the partner of the fastest.
    Returns entries of a legend, which give the scale of the bubbles.
    """
    all_roots = np.concatenate([np.zeros(0, complex), *paths.roots.values()])
    depth = -float(_ratio(all_roots).min(initial=0.0)) or 1.0  # of the lowest ratio below 0, %
    fastest = max(float(all_roots.real.max(initial=0.0)), 1e-300)  # 1/s, a divisor
    limits = frequency_limits(all_roots)
    # coloured modes are drawn over grey ones
    for mode, roots in sorted(paths.roots.items(), key=lambda item: item[0] in colours):
        hertz = roots.imag / math.tau
        ratio = _ratio(roots)
        colour = colours.get(mode, "0.7")
        axes.plot(hertz, ratio, color=colour, lw=0.8, gid=f"mode {mode}")
        axes.plot(hertz[:1], ratio[:1], "|", color=colour, ms=6)
        if mode not in colours:
            continue
        grows = np.flatnonzero(roots.real > 0.0)[::-1]
        grows = grows[:: math.ceil(len(grows) / BUBBLES) or 1]  # so that they do not merge
        size = LARGEST * roots.real[grows] / fastest
        axes.scatter(hertz[grows], ratio[grows], s=size, fc=colour, alpha=0.35, lw=0, zorder=3)
        lowest = int(np.argmin(ratio))
        if ratio[lowest] < 0.0:
            name = sweep.names.get(mode, f"mode {mode}, {hertz[lowest]:.4g} Hz")
            _name_mode(axes, name, hertz[lowest], ratio[lowest], limits, colour)
    axes.axhspan(-BELOW * depth, 0.0, color=RED, alpha=0.06, lw=0, zorder=0)
    axes.axhline(0.0, color="0.3", lw=0.6)
    axes.set(xlim=limits, ylim=(-BELOW * depth, ABOVE * depth))
    axes.set(xlabel="frequency [Hz]", ylabel="damping ratio [%]")
    first = sweep.steps[0].value
    last = sweep.steps[-1].value
    swept = f"{symbol_of(sweep.parameter)} from {first:g} to {last:g}"
    axes.set_title(f"{swept}: unstable below zero, bubbles by growth", loc="left")
    entries: list[Artist] = []
    if all_roots.real.max(initial=0.0) > 0.0:
        large = _round_down(fastest)
        for growth in (0.25 * large, large):
            diameter = math.sqrt(LARGEST * growth / fastest)
            look: Any = {"marker": "o", "ls": "", "mfc": "0.4", "mew": 0.0, "alpha": 0.45}
            label = f"growth rate {growth:.4g} 1/s"
            entries.append(Line2D([], [], ms=diameter, label=label, **look))
    return entries


def _round_down(value: float) -> float:
    """The largest number of one digit up to a value above 0."""
    unit = 10.0 ** math.floor(math.log10(value))
    return math.floor(value / unit) * unit


def _name_mode(
    axes: Axes, name: str, hertz: float, ratio: float, limits: tuple[float, float], colour: str
) -> None:
    """Write the name of a mode below its lowest point, aligned so that it stays in the axis."""
    share_of_axis = (hertz - limits[0]) / (limits[1] - limits[0])
    alignment = ("left", "center", "right")[int(3 * share_of_axis)]
    axes.annotate(
        name,
        (hertz, ratio),
        (0, -7),
        textcoords="offset points",
        ha=alignment,
        va="top",
        fontsize=7,
        color=colour,
    )


def _ratio(roots: np.ndarray) -> np.ndarray:
    """Damping ratios, %."""
    return -100 * roots.real / np.abs(roots)


def _onset(
    sweep: Sweep, paths: _Paths, mode: int, thresholds: Thresholds | None
) -> float | tuple[float, float] | None:
    """Where a mode begins to grow: a threshold where one is known, else two values of the sweep."""
    swept = next(known for known in sweep.modes if known.mode == mode)
    if swept.interval is None:
        return None
    low, high = swept.interval
    crossing = None
    if thresholds is not None:
        crossing = _crossing(thresholds, (low, high), paths.root_at(mode, high))
    return swept.interval if crossing is None else crossing.mu


def _crossing(
    thresholds: Thresholds, interval: tuple[float, float], root: complex | None
) -> Crossing | None:
    """The threshold in an interval that is nearest in frequency to a root; None without one."""
    low, high = interval
    nearest = None
    least = math.inf if root is None else ALONE * root.imag / math.tau
    for crossing in thresholds.crossings:
        if crossing.direction != "up" or not low <= crossing.mu <= high:
            continue
        distance = 0.0 if root is None else abs(crossing.frequency_hz - root.imag / math.tau)
        if distance < least:
            nearest = crossing
            least = distance
    return nearest


def _draw_pair(
    axes: Axes,
    sweep: Sweep,
    paths: _Paths,
    pair: Sequence[int],
    colours: dict[int, str],
    onset: float | tuple[float, float] | None,
) -> None:
    """Draw the frequencies of the fastest mode and of its partner over the parameter.

    pair: numbers of the fastest mode and, if it has one, of its partner; empty if none grows.
    onset: where the fastest begins to grow, a value or two values around it, None if unknown.
    """
    axes.set(xlabel=friction_symbol(sweep.parameter), ylabel="frequency [Hz]")
    axes.set(xlim=(sweep.steps[0].value, sweep.steps[-1].value))
    if not pair:
        axes.set_title("no mode grows", loc="left")
        axes.set(yticks=[])
        return
    for mode in reversed(pair):  # the fastest one on top
        hertz = paths.roots[mode].imag / math.tau
        growing = np.where(paths.roots[mode].real > 0.0, hertz, np.nan)
        axes.plot(paths.at[mode], hertz, color=colours[mode], lw=1.0, gid=f"pair {mode}")
        axes.plot(paths.at[mode], growing, color=colours[mode], lw=2.4)
    axes.set_title(_title_of_pair(sweep, paths, pair, onset), loc="left")
    if isinstance(onset, tuple):
        axes.axvspan(*onset, color="0.8", lw=0, zorder=0, gid="onset")
    elif onset is not None:
        axes.axvline(onset, color="0.5", lw=0.8, ls=":", zorder=0, gid="onset")


def _title_of_pair(
    sweep: Sweep,
    paths: _Paths,
    pair: Sequence[int],
    onset: float | tuple[float, float] | None,
) -> str:
    """Two lines: the modes with their first frequencies, and where they meet and growth begins."""
    numbers = sorted(pair)
    frequencies = sorted(paths.roots[mode][0].imag / math.tau for mode in numbers)
    first = [f"{frequency:.4g}" for frequency in frequencies]
    meeting = None
    if len(pair) == 2:
        meeting = paths.meeting(numbers)
        who = f"modes {numbers[0]} + {numbers[1]} ({', '.join(first)} Hz)"
    else:
        who = f"mode {numbers[0]} ({first[0]} Hz)"
    if isinstance(onset, tuple):
        low, high = onset
        begins = f"growth begins: {low:.4g} to {high:.4g}"
    elif onset is not None:
        begins = f"growth begins at {onset:.4g}"
    else:
        begins = f"growth from {sweep.steps[0].value:.4g} on"
    if meeting is not None:
        return f"{who} meet\nat {symbol_of(sweep.parameter)} = {meeting:.4g}; {begins}"
    return f"{who}\n{symbol_of(sweep.parameter)}: {begins}"
