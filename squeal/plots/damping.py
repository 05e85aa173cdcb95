"""Damping ratio over frequency through a sweep, and beside it the modes that meet."""

import math
from collections.abc import Sequence
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
    move_apart,
    origin,
    style,
    write_beside,
)
from squeal.queries.mode_paths import Paths, is_growing
from squeal.results.sources import unit_of
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds
from squeal.schema import Place, Word

COLOURS = ("#C8380E", "#0072B2", "#6A1B7B", "#009E73", "#E69F00", "#56B4E9")
"""Of modes that grow, the fastest first, and of their partners, the modes that they meet."""
LARGEST = 160.0  # points squared: the bubble of the fastest growth
SPACING = 0.05  # of the axes: bubbles of a mode do not merge
BELOW = 1.35  # shown damping ratios below zero, over the depth of the lowest one
PANELS = 3  # of modes that meet, or that grow alone
NOISE = 1e-7  # %: a damping ratio below is rounding
ABOVE = 1.4  # shown damping ratios above zero, over the depth of the lowest one
ALONE = 0.2  # of the frequency of a mode: a threshold farther from it belongs to another mode
WIDTHS = ("page", "column")
"""A chart over the width of a page has its panels side by side; in a column one is below."""


def colours_of(paths: Paths) -> dict[int, str]:
    """The colours of modes by their numbers: of those in panels, then of others that grow.

    Modes that are left when the colours are used up have none, and are drawn grey.
    """
    shown: list[int] = []
    for group in paths.groups[:PANELS]:
        shown += sorted(group, key=lambda mode: mode not in paths.growing)  # those that grow first
    coloured = dict.fromkeys([*shown, *paths.growing])  # without repetitions
    return dict(zip(coloured, COLOURS, strict=False))


def damping_drawing(
    name: str, sweep: Sweep, thresholds: Thresholds | None = None, width: str = "page"
) -> Drawing:
    """Draw damping ratios in % over frequency, a line for each mode, with bubbles by growth.

    Beside it stand panels over the parameter: frequencies of a mode that grows and of the one that
    it meets, or its damping ratio if it grows alone, with the value from which on it grows. Rings
    mark the subject's own value.

    Parameters
    ----------
    name : str
        The subject, for the alternative text.
    sweep : Sweep
        What is drawn.
    thresholds : Thresholds, optional
        Of the same subject: they tell more exactly than the sweep where growth begins.
    width : {"page", "column"}
        Whether the panels stand beside the first one or below.
    """
    Word(WIDTHS).read(width, Place("width"))
    paths = Paths(sweep)
    groups = paths.groups[:PANELS]
    count = "1 mode grows" if len(paths.growing) == 1 else f"{len(paths.growing)} modes grow"
    texts = [f"Damping ratio over frequency of {name}, {count}"]
    rows = max(len(groups), 1)  # an empty panel says that no mode grows
    with style():
        if width == "column":
            figure = Figure(figsize=(SINGLE, 3.2 + 2.0 * rows))
            upper, *panels = figure.subplots(1 + rows, 1, height_ratios=[1.3, *rows * [1.0]])
        else:
            figure = Figure(figsize=(DOUBLE, 2.0 + 0.6 * rows))
            grid = figure.add_gridspec(rows, 2, width_ratios=[1.3, 1.0])
            upper = figure.add_subplot(grid[:, 0])
            panels = [figure.add_subplot(grid[row, 1]) for row in range(rows)]
        entries = _draw_ratios(upper, sweep, paths)
        first = sweep.steps[0].value
        last = sweep.steps[-1].value
        for axes in panels:
            if first < last:  # of one value Matplotlib chooses limits about it
                axes.set_xlim(first, last)
        panels[-1].set(xlabel=friction_symbol(sweep.parameter, unit_of(sweep.source)))
        if not groups:
            panels[0].set_title("no mode grows", loc="left")
            panels[0].set(yticks=[])
        for axes, group in zip(panels, groups, strict=False):
            title = _draw_group(axes, sweep, paths, group, thresholds)
            texts.append(title.replace(r"$\mu$", "mu"))
        entries += _mark_own_value(upper, panels, sweep, paths)
        if entries:
            columns = 2 if width == "column" else len(entries)
            figure.legend(handles=entries, loc="outside lower center", ncols=columns)
        move_apart(figure)
    title = f"Damping ratios of {name}"
    return Drawing(figure, f"{'; '.join(texts)}.", title, origin(__name__))


def _mark_own_value(
    upper: Axes, panels: Sequence[Axes], sweep: Sweep, paths: Paths
) -> list[Artist]:
    """Mark the subject's own value by rings in all panels and a line in those over the parameter.

    upper: the axes of damping ratios over frequency; panels: those over the parameter, one for each
    group of modes. Returns the entry of a legend, none where that value is not drawn.
    """
    own_value = paths.own_value
    if own_value is None:
        return []
    ring: Any = {"marker": "o", "ls": "", "mfc": "none", "mec": "k", "mew": 0.9, "ms": 6.0}
    for mode in colours_of(paths):
        root = paths.root_at(mode, own_value)
        if root is None:  # the mode has no root there
            continue
        frequency = root.imag / math.tau
        upper.plot(frequency, _ratio(np.array(root)), zorder=5, gid="own value", **ring)
        for axes, group in zip(panels, paths.groups, strict=False):
            if mode in group:
                height = _height(group, np.array(root))
                axes.plot(own_value, height, zorder=5, gid="own value", **ring)
    for axes in panels:
        axes.axvline(own_value, color="0.4", lw=0.6, ls="-.", zorder=0)
    name = f"present {symbol_of(sweep.parameter)} = {own_value:.4g}"
    look = ring | {"color": "0.4", "lw": 0.6, "ls": "-."}  # the line and the ring
    return [Line2D([], [], label=f"{name} {unit_of(sweep.source)}".rstrip(), **look)]


def _draw_ratios(axes: Axes, sweep: Sweep, paths: Paths) -> list[Artist]:
    """Draw all modes in the plane of frequency and damping ratio.

    Modes that grow and those that they meet have colours, the others are grey. Along a mode that
    grows bubbles show the growth rate. It is named where its ratio is lowest, its partner where the
    ratio is highest among those below `depth`, since the axis ends little above. Returns entries of
    a legend, which give the scale of the bubbles.
    """
    colours = colours_of(paths)
    all_roots = np.concatenate([np.zeros(0, complex), *paths.roots.values()])
    depth = _shown_depth(_ratio(all_roots))  # ratios around 0 that the axis has to show, %
    growth_rates = [float(paths.roots[mode].real.max()) for mode in paths.growing]
    fastest = max(growth_rates, default=1.0)  # 1/s, a divisor
    limits = frequency_limits(all_roots)
    axes.set(xlim=limits, ylim=(-BELOW * depth, ABOVE * depth))
    # coloured modes are drawn over grey ones
    for mode, roots in sorted(paths.roots.items(), key=lambda item: item[0] in colours):
        hertz = roots.imag / math.tau
        ratio = _ratio(roots)
        colour = colours.get(mode, "0.7")
        axes.plot(hertz, ratio, color=colour, lw=0.8, gid=f"mode {mode}")
        axes.plot(hertz[:1], ratio[:1], "|", color=colour, ms=6)  # where the path begins
        if mode not in colours:
            continue
        bubbles = _spaced_where_growing(axes, roots)
        size = LARGEST * roots.real[bubbles] / fastest
        axes.scatter(hertz[bubbles], ratio[bubbles], s=size, fc=colour, alpha=0.35, lw=0, zorder=3)
        # the index of the root at which the mode is named
        if mode in paths.growing:
            k = int(np.argmin(ratio))
            name = sweep.names.get(mode, f"mode {mode}, {hertz[k]:.4g} Hz")
        else:
            k = int(np.argmax(np.where(ratio < depth, ratio, -np.inf)))
            name = f"mode {mode}"
        if ratio[k] < depth:
            right = 5 if hertz[k] < np.mean(limits) else -5  # points, clear of a ring
            point = (hertz[k], ratio[k])
            write_beside(axes, name, point, (right, -7), fontsize=7, color=colour)
    axes.axhspan(-BELOW * depth, 0.0, color=RED, alpha=0.06, lw=0, zorder=0)
    axes.axhline(0.0, color="0.3", lw=0.6)
    axes.set(xlabel="frequency [Hz]", ylabel="damping ratio [%]")
    first = sweep.steps[0].value
    last = sweep.steps[-1].value
    swept = f"from {first:g} to {last:g} {unit_of(sweep.source)}".rstrip()
    title = f"{symbol_of(sweep.parameter)} {swept}: unstable below zero"
    if len(paths.groups) > PANELS:
        title += f"\nat the right the first {PANELS} of {len(paths.groups)}"
    axes.set_title(title, loc="left", fontsize=7)
    return _entries_of_bubbles(fastest) if growth_rates else []


def _entries_of_bubbles(fastest: float) -> list[Artist]:
    """Entries of a legend: two bubbles, where that of the growth rate `fastest` (1/s) has the area
    `LARGEST`."""
    entries: list[Artist] = []
    large = _round_down(fastest)
    for growth in (0.25 * large, large):
        diameter = math.sqrt(LARGEST * growth / fastest)
        label = f"growth rate {growth:.4g} 1/s"
        bubble = Line2D([], [], marker="o", ls="", ms=diameter, label=label)
        bubble.set(mfc="0.4", mew=0.0, alpha=0.45)
        entries.append(bubble)
    return entries


def _shown_depth(ratios: np.ndarray) -> float:
    """The damping ratio (%, above 0) by which both ends of the axis of ratios are scaled.

    It is minus the lowest of the ratios (m,), in %; where nothing grows twice their median, so that
    the axis shows most of them.
    """
    depth = -float(ratios.min(initial=0.0))
    if len(ratios) and depth < NOISE:
        depth = 2.0 * float(np.median(ratios))
    if depth < NOISE:  # all of them are rounding
        depth = 1.0
    return depth


def _spaced_where_growing(axes: Axes, roots: np.ndarray) -> np.ndarray:
    """Indices of growing roots of a mode, about `SPACING` apart in the axes: those with bubbles.

    The path of the growing roots (m,) is divided into stretches of that length, from the last root
    backwards; of each stretch the first root is taken.
    """
    growing = np.flatnonzero(roots.real > 0.0)[::-1]
    # positions in the axes, over their width and height, as complex numbers
    across = roots[growing].imag / math.tau / np.ptp(axes.get_xlim())
    upwards = _ratio(roots[growing]) / np.ptp(axes.get_ylim())
    positions = across + 1j * upwards
    length = np.abs(np.diff(positions, prepend=positions[:1])).cumsum()  # of the path up to each
    _, first_of_stretch = np.unique(length // SPACING, return_index=True)
    return np.asarray(growing[first_of_stretch])


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
    """The value from which on a mode grows, or two values between which it begins to.

    The latter are the last value of the sweep without growth and the first one with it. Between
    these the threshold is taken that is nearest to the mode in frequency, unless it is farther than
    `ALONE`. None for a mode that grows from the first value on.
    """
    roots = paths.roots[mode]
    first = int(np.argmax(is_growing(roots)))  # index of the first value with growth
    if not first:
        return None
    low, high = paths.at[mode][first - 1 : first + 1].tolist()
    hertz = roots[first].imag / math.tau
    onsets: dict[float, float] = {}  # thresholds by their distance in frequency, Hz
    if thresholds is not None:
        for crossing in thresholds.crossings:
            if crossing.direction == "up" and low <= crossing.mu <= high:
                onsets[abs(crossing.frequency_hz - hertz)] = crossing.mu
    nearest = min(onsets, default=math.inf)
    if nearest < ALONE * hertz:
        return onsets[nearest]
    return low, high


def _fastest(paths: Paths, group: tuple[int, ...]) -> int:
    """The mode of a group that grows, the faster one if both do."""
    return next(mode for mode in paths.growing if mode in group)


def _height(group: tuple[int, ...], roots: np.ndarray) -> np.ndarray:
    """What a panel shows of roots: of two modes frequencies (Hz), of one damping ratios (%)."""
    return roots.imag / math.tau if len(group) == 2 else _ratio(roots)


def _draw_group(
    axes: Axes,
    sweep: Sweep,
    paths: Paths,
    group: tuple[int, ...],
    thresholds: Thresholds | None,
) -> str:
    """Draw the frequencies of a mode that grows and of its partner over the parameter, or the
    damping ratio of one that grows alone. Returns the title.

    group: the numbers of one or two modes, by rising frequency.
    """
    lead = _fastest(paths, group)
    onset = _onset(paths, lead, thresholds)
    for mode in sorted(group, key=lambda mode: mode == lead):  # the lead last, on top
        draw_mode(axes, paths, mode, _height(group, paths.roots[mode]))
    if len(group) == 2:
        axes.set(ylabel="frequency [Hz]")
        axes.margins(y=0.24 * len(paths.groups[:PANELS]))  # room for names
        for mode, up in zip(group, (-3, 3), strict=True):  # the lower one has its name below
            point = (paths.at[mode][0], paths.first_hz(mode))
            colour = colours_of(paths)[mode]
            write_beside(axes, f"mode {mode}", point, (4, up), fontsize=7, color=colour)
    else:
        # limits of the first panel, which shows the ratios of all modes
        axes.set(ylabel="damping ratio [%]", ylim=axes.figure.axes[0].get_ylim())
        axes.axhline(0.0, color="0.3", lw=0.6)
    title = _title_of_group(sweep, paths, group, onset)
    axes.set_title(title, loc="left", fontsize=7)
    if isinstance(onset, tuple):
        axes.axvspan(*onset, color="0.8", lw=0, zorder=0, gid="onset")
    elif onset is not None:
        axes.axvline(onset, color="0.5", lw=0.8, ls=":", zorder=0, gid="onset")
    return title


def draw_mode(axes: Axes, paths: Paths, mode: int, height: np.ndarray) -> None:
    """Draw a quantity of a mode over the parameter in its colour, thick where the mode grows."""
    growing = np.where(is_growing(paths.roots[mode]), height, np.nan)
    look: Any = {"color": colours_of(paths)[mode], "zorder": 2}
    axes.plot(paths.at[mode], height, lw=1.0, gid=f"pair {mode}", **look)
    axes.plot(paths.at[mode], growing, lw=2.4, **look)


def _title_of_group(
    sweep: Sweep,
    paths: Paths,
    group: tuple[int, ...],
    onset: float | tuple[float, float] | None,
) -> str:
    """The modes of a panel, where they meet, and from which value on one of them grows.

    group: the number of a mode, or of two that meet; onset: see `_onset`.
    """
    unit = unit_of(sweep.source)
    if onset is None:  # the mode grows from the first value of its path on
        onset = float(paths.at[_fastest(paths, group)][0])
    if isinstance(onset, tuple):
        low, high = onset
        begins = f"from {low:.4g} to {high:.4g} {unit}".rstrip()
    else:
        begins = f"from {onset:.4g}{speed_words(onset, unit)}"
    if len(group) == 1:
        return f"mode {group[0]} grows alone, {begins} on"
    meeting = paths.meeting(group)
    meet = "come together"
    if meeting is not None:
        meet = f"meet near {symbol_of(sweep.parameter)} = {meeting:.4g}"
    return f"modes {min(group)} + {max(group)} {meet}; growth {begins} on"
