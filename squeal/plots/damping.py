"""Damping ratio over frequency through a sweep, and beside it the two modes that meet."""

import math
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.linear.shaft import speed_words
from squeal.plots.maps import friction_symbol, symbol_of
from squeal.plots.modes import RED
from squeal.plots.style import (
    DOUBLE,
    SINGLE,
    Drawing,
    frequency_limits,
    origin,
    style,
    write_beside,
)
from squeal.results.sources import PadSource, unit_of
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds
from squeal.schema import Place, Word

COLOURS = ("#C8380E", "#0072B2", "#6A1B7B", "#009E73", "#E69F00", "#56B4E9")
"""Of modes that grow, the fastest first, and of the partners that they meet."""
LARGEST = 160.0  # points squared: the bubble of the fastest growth
SPACING = 0.05  # of the axes: bubbles of a mode do not merge
BELOW = 1.35  # shown damping ratios below zero, over the depth of the lowest one
GROWS = 1e-9  # of |lambda|: a growth rate below is rounding
NEAREST = 0.1  # of the frequency: no partner is farther from a mode where it grows fastest
NEARER = 0.5  # of their first distance: two frequencies nearer than that come together
TWINS = 0.05  # of the frequency: so near are the two whirls of a shaft on unlike bearings
FED = 0.25  # of the rise of a growth rate: that of a partner falls by as much at least
ABOVE = 1.4  # shown damping ratios above zero, over the depth of the lowest one
MET = 0.05  # of their first distance: two frequencies have met where they are nearer
ALONE = 0.2  # of the frequency: a threshold farther from a mode is none of it
WIDTHS = ("page", "column")
"""A chart over the width of a page has its panels side by side; in a column one is below."""


class Paths:
    """The modes of a sweep with Im >= 0, by rising value of the parameter, and their colours.

    at, roots: values and roots of each mode by its number; growing: modes that grow somewhere, the
    fastest first; pair: the fastest and, if it has met another one, its partner; colours: of both
    and of what grows.
    """

    def __init__(self, sweep: Sweep) -> None:
        self.values = values = np.array([step.value for step in sweep.steps])
        whole: dict[int, np.ndarray] = {}  # NaN where a mode is not known
        number_behind = _behind_meetings(sweep)
        for k, step in enumerate(sweep.steps):
            for number, root in step.root_of_mode().items():
                if root.value.imag > 0.0:
                    mode = number_behind.get(number, number)
                    path = whole.setdefault(mode, np.full(len(values), np.nan, dtype=complex))
                    path[k] = root.value
        self.whole = whole
        self.at = {mode: values[np.isfinite(path)] for mode, path in whole.items()}
        self.roots = {mode: path[np.isfinite(path)] for mode, path in whole.items()}
        growing = [mode for mode, roots in self.roots.items() if _grows(roots).any()]
        self.growing = sorted(growing, key=self.growth, reverse=True)
        self.pair = self.growing[:1]
        for lead in self.growing[:1]:
            self.pair += self._partners(lead, is_speed=bool(unit_of(sweep.source)))[:1]
        coloured = dict.fromkeys([*self.pair, *self.growing])  # each once
        self.colours = dict(zip(coloured, COLOURS, strict=False))  # beyond these grey

    def root_at(self, mode: int, value: float) -> complex | None:
        """The root of a mode at a value, interpolated; None where its path does not reach."""
        at = self.at[mode]
        if not at[0] <= value <= at[-1]:
            return None
        return complex(np.interp(value, at, self.roots[mode]))

    def meeting(self) -> float | None:
        """The first value at which the frequencies of the pair have met; None if they never do."""
        first, second = self.pair
        distances = np.abs((self.whole[first] - self.whole[second]).imag)
        met = self.values[distances < MET * distances[np.isfinite(distances)][0]]
        return float(met[0]) if met.size else None

    def height(self, roots: np.ndarray) -> np.ndarray:
        """What the panel of the pair shows of roots: frequencies (Hz), of a mode alone damping
        ratios (%)."""
        if len(self.pair) == 2:
            return roots.imag / math.tau
        return _ratio(roots)

    def growth(self, mode: int) -> float:
        """The fastest growth rate of a mode, 1/s."""
        return float(self.roots[mode].real.max())

    def _partners(self, mode: int, is_speed: bool) -> list[int]:
        """The modes with which `mode` has met where it grows fastest, the nearest first.

        Two modes that meet feed each other: their frequencies come together, and the growth rate of
        the partner falls as that of `mode` rises. Over friction they may be together from the
        first value on, as the two modes of a disc; over a speed (`is_speed`) two that begin so near
        as `TWINS` are a forward and a backward whirl, of which one grows alone.
        """
        leading = self.whole[mode]
        fastest = int(np.nanargmax(leading.real))
        distances: dict[int, float] = {}
        for other, following in self.whole.items():
            gaps = leading - following
            if other == mode or np.isnan(gaps[fastest]):
                continue
            first = int(np.argmax(np.isfinite(gaps)))
            rise = leading.real[fastest] - leading.real[first]
            fall = following.real[first] - following.real[fastest]
            distance = abs(gaps.imag[fastest])
            limit = NEARER * abs(gaps.imag[first])
            if is_speed and abs(gaps.imag[first]) < TWINS * leading.imag[first]:
                continue
            if not is_speed:
                limit = max(limit, gaps.real[fastest])
            limit = min(limit, NEAREST * leading.imag[fastest])
            if distance <= limit and fall >= FED * rise:
                distances[other] = distance
        return sorted(distances, key=distances.__getitem__)


def _behind_meetings(sweep: Sweep) -> dict[int, int]:
    """The numbers behind a meeting, by those before it, of two modes that end where two begin."""
    numbers: dict[int, int] = {}
    ended = {loss[:2]: loss.modes for loss in sweep.losses if loss.kind == "end"}
    for loss in sweep.losses:
        modes = ended.get(loss[:2], ())
        if loss.kind == "begin" and len(loss.modes) == len(modes) == 2:
            numbers |= zip(modes, loss.modes, strict=True)
    return numbers


def _grows(roots: np.ndarray) -> np.ndarray:
    """Which roots grow by more than rounding."""
    return roots.real > GROWS * np.abs(roots)


def damping_drawing(
    name: str, sweep: Sweep, thresholds: Thresholds | None = None, width: str = "page"
) -> Drawing:
    """Draw damping ratios in % over frequency, a line for each mode, with bubbles by growth.

    Beside it stand the frequencies of the mode that grows fastest and of the one that it meets over
    the parameter, or its damping ratio if it grows alone, with the value from which on it grows.
    Rings mark the subject's own value.

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
    paths = Paths(sweep)
    growing = paths.growing
    pair = paths.pair
    count = "1 mode grows" if len(growing) == 1 else f"{len(growing)} modes grow"
    text = f"Damping ratio over frequency of {name}, {count}"
    if growing:
        lead = growing[0]
        text += f"; the fastest is mode {lead} by {paths.growth(lead):.4g} 1/s"
        if len(pair) == 2:
            partner = pair[1]
            text += f", which meets mode {partner}"
    own_value = _own_value(sweep)
    with style():
        if width == "column":
            figure = Figure(figsize=(SINGLE, 5.2))
            upper, lower = figure.subplots(2, 1, height_ratios=[1.3, 1.0])
        else:
            figure = Figure(figsize=(DOUBLE, 3.4))
            upper, lower = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
        entries = _draw_ratios(upper, sweep, paths)
        onset = None
        if pair:
            onset = _onset(paths, pair[0], thresholds)
        _draw_pair(lower, sweep, paths, onset)
        if own_value is not None:
            entries += _mark_own_value(upper, lower, sweep, paths, own_value)
        if entries:
            columns = 2 if width == "column" else len(entries)
            figure.legend(handles=entries, loc="outside lower center", ncols=columns)
    return Drawing(figure, f"{text}.", f"Damping ratios of {name}", origin(__name__))


def _own_value(sweep: Sweep) -> float | None:
    """The subject's own value of the parameter, None where it is not known or not in the sweep."""
    source = sweep.source
    if source is None:
        return None
    if isinstance(source, PadSource):
        own_value = float(source.scene.pad.mu)
    else:
        own_value = source.file.system.parameters[sweep.parameter]
    values = [step.value for step in sweep.steps]
    return own_value if min(values) <= own_value <= max(values) else None


def _mark_own_value(
    upper: Axes, lower: Axes, sweep: Sweep, paths: Paths, own_value: float
) -> list[Artist]:
    """Mark the subject's own value by rings in both panels and a line in the lower one.

    Returns the entry of a legend.
    """
    ring: Any = {"marker": "o", "ls": "", "mfc": "none", "mec": "k", "mew": 0.9, "ms": 6.0}
    for mode in paths.colours:
        root = paths.root_at(mode, own_value)
        if root is None:
            continue
        frequency = root.imag / math.tau
        upper.plot(frequency, _ratio(np.array(root)), zorder=5, gid="own value", **ring)
        if mode in paths.pair:
            lower.plot(own_value, paths.height(np.array(root)), zorder=5, gid="own value", **ring)
    lower.axvline(own_value, color="0.4", lw=0.6, ls="-.", zorder=0)
    name = f"present {symbol_of(sweep.parameter)} = {own_value:.4g}"
    return [Line2D([], [], label=f"{name} {unit_of(sweep.source)}".rstrip(), **ring)]


def _draw_ratios(axes: Axes, sweep: Sweep, paths: Paths) -> list[Artist]:
    """Draw all modes in the plane of frequency and damping ratio, grey without a colour.

    Returns entries of a legend, which give the scale of the bubbles.
    """
    colours = paths.colours
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
        across = hertz[grows] / np.ptp(limits)
        upwards = ratio[grows] / ((BELOW + ABOVE) * depth)
        path = np.array([across, upwards])
        travelled = np.hypot(*np.diff(path, prepend=path[:, :1])).cumsum()
        grows = grows[np.unique(travelled // SPACING, return_index=True)[1]]
        size = LARGEST * roots.real[grows] / fastest
        axes.scatter(hertz[grows], ratio[grows], s=size, fc=colour, alpha=0.35, lw=0, zorder=3)
        named = int(np.argmin(ratio))
        name = sweep.names.get(mode, f"mode {mode}, {hertz[named]:.4g} Hz")
        if mode not in paths.growing:  # a partner is named where it is damped most
            named = int(np.argmax(np.where(ratio < depth, ratio, -np.inf)))
            name = f"mode {mode}"
        if ratio[named] < depth:
            right = 2 if hertz[named] < np.mean(limits) else -2
            look: Any = {"fontsize": 7, "color": colour}
            write_beside(axes, name, (hertz[named], ratio[named]), (right, -7), **look)
    axes.axhspan(-BELOW * depth, 0.0, color=RED, alpha=0.06, lw=0, zorder=0)
    axes.axhline(0.0, color="0.3", lw=0.6)
    axes.set(xlim=limits, ylim=(-BELOW * depth, ABOVE * depth))
    axes.set(xlabel="frequency [Hz]", ylabel="damping ratio [%]")
    first = sweep.steps[0].value
    last = sweep.steps[-1].value
    swept = f"from {first:g} to {last:g} {unit_of(sweep.source)}".rstrip()
    axes.set_title(f"{symbol_of(sweep.parameter)} {swept}: unstable below zero", loc="left")
    entries: list[Artist] = []
    if all_roots.real.max(initial=0.0) > 0.0:
        large = _round_down(fastest)
        for growth in (0.25 * large, large):
            diameter = math.sqrt(LARGEST * growth / fastest)
            look = {"marker": "o", "ls": "", "mfc": "0.4", "mew": 0.0, "alpha": 0.45}
            label = f"growth rate {growth:.4g} 1/s"
            entries.append(Line2D([], [], ms=diameter, label=label, **look))
    return entries


def _round_down(value: float) -> float:
    """The largest number of one digit up to a value above 0."""
    unit = 10.0 ** math.floor(math.log10(value))
    return math.floor(value / unit) * unit


def _ratio(roots: np.ndarray) -> np.ndarray:
    """Damping ratios, %."""
    return -100 * roots.real / np.abs(roots)


def _onset(
    paths: Paths, mode: int, thresholds: Thresholds | None
) -> float | tuple[float, float] | None:
    """Where a mode begins to grow: the threshold that is nearest in frequency where one is known,
    else two values of the sweep; None where it grows from the first value on."""
    roots = paths.roots[mode]
    first = int(np.argmax(_grows(roots)))
    if not first:
        return None
    low, high = paths.at[mode][first - 1 : first + 1].tolist()
    hertz = roots[first].imag / math.tau
    onsets: dict[float, float] = {}  # by distance, Hz
    if thresholds is not None:
        for crossing in thresholds.crossings:
            if crossing.direction == "up" and low <= crossing.mu <= high:
                onsets[abs(crossing.frequency_hz - hertz)] = crossing.mu
    nearest = min(onsets, default=math.inf)
    if nearest < ALONE * hertz:
        return onsets[nearest]
    return low, high


def _draw_pair(
    axes: Axes, sweep: Sweep, paths: Paths, onset: float | tuple[float, float] | None
) -> None:
    """Draw the frequencies of the fastest mode and of its partner over the parameter, or the
    damping ratio of one that grows alone.

    onset: where the fastest begins to grow, a value or two values around it, None if unknown.
    """
    unit = unit_of(sweep.source)
    axes.set(xlabel=friction_symbol(sweep.parameter, unit))
    axes.set(xlim=(sweep.steps[0].value, sweep.steps[-1].value))
    if not paths.pair:
        axes.set_title("no mode grows", loc="left")
        axes.set(yticks=[])
        return
    for mode in reversed(paths.pair):  # the fastest one on top
        draw_mode(axes, paths, mode, paths.height(paths.roots[mode]))
    if len(paths.pair) == 2:
        axes.set(ylabel="frequency [Hz]")
        axes.margins(y=0.16)
        lower, upper = sorted(paths.pair, key=lambda mode: paths.roots[mode][0].imag)
        _name_beginning(axes, paths, lower, -3)
        _name_beginning(axes, paths, upper, 3)
    else:
        axes.set(ylabel="damping ratio [%]", ylim=axes.figure.axes[0].get_ylim())
        axes.axhline(0.0, color="0.3", lw=0.6)
    axes.set_title(_title_of_pair(sweep, paths, onset), loc="left")
    if isinstance(onset, tuple):
        axes.axvspan(*onset, color="0.8", lw=0, zorder=0, gid="onset")
    elif onset is not None:
        axes.axvline(onset, color="0.5", lw=0.8, ls=":", zorder=0, gid="onset")


def draw_mode(axes: Axes, paths: Paths, mode: int, height: np.ndarray) -> None:
    """Draw a quantity of a mode over the parameter in its colour, thick where the mode grows."""
    growing = np.where(_grows(paths.roots[mode]), height, np.nan)
    look: Any = {"color": paths.colours[mode], "zorder": 2}
    axes.plot(paths.at[mode], height, lw=1.0, gid=f"pair {mode}", **look)
    axes.plot(paths.at[mode], growing, lw=2.4, **look)


def _name_beginning(axes: Axes, paths: Paths, mode: int, up: float) -> None:
    """Write the number of a mode above (up > 0) or below the beginning of its frequency."""
    point = (paths.at[mode][0], paths.roots[mode][0].imag / math.tau)
    look: Any = {"color": paths.colours[mode], "fontsize": 7}
    write_beside(axes, f"mode {mode}", point, (4, up), **look)


def _title_of_pair(sweep: Sweep, paths: Paths, onset: float | tuple[float, float] | None) -> str:
    """Two lines: the modes with their first frequencies, and where they meet and growth begins."""
    numbers = sorted(paths.pair)
    frequencies = sorted(paths.roots[mode][0].imag / math.tau for mode in numbers)
    first = ", ".join(f"{frequency:.4g}" for frequency in frequencies)
    unit = unit_of(sweep.source)
    if isinstance(onset, tuple):
        low, high = onset
        begins = f"growth begins: {low:.4g} to {high:.4g} {unit}".rstrip()
    elif onset is not None:
        begins = f"growth begins at {onset:.4g}{speed_words(onset, unit)}"
    else:
        begins = f"growth from {sweep.steps[0].value:.4g} on"
    symbol = symbol_of(sweep.parameter)
    if len(numbers) == 1:
        name = sweep.names.get(numbers[0], f"mode {numbers[0]} ({first} Hz)")
        return f"{name}: grows alone\n{symbol}: {begins}"
    who = f"modes {numbers[0]} + {numbers[1]} ({first} Hz)"
    meeting = paths.meeting()
    if meeting is None:
        return f"{who}\n{symbol}: {begins}"
    return f"{who} meet\nat {symbol} = {meeting:.4g}; {begins}"
