"""Campbell diagram: whirl frequencies over the speed, lines of its multiples, critical speeds."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.linear.shaft import RPM, speed_words
from squeal.plots.damping import colours_of, draw_mode
from squeal.plots.maps import symbol_of
from squeal.plots.modes import RED, RING
from squeal.plots.style import (
    DOUBLE,
    SINGLE,
    Drawing,
    move_apart,
    origin,
    style,
    write_beside,
)
from squeal.queries.critical_speeds import CriticalSpeeds
from squeal.queries.mode_paths import Paths
from squeal.results.sweep import Sweep

MARKS = {"forward": "^", "backward": "v", "mixed": "D", "straight": "s", None: "o"}
NAMED = 8  # critical speeds that stand in words beside their marks
REACH = 6.0  # a growing frequency above so many times the highest critical one stays outside
ABOVE = 1.05  # shown frequencies over the highest one that grows
MARGIN = 1.6  # shown frequencies over the highest critical one
NAMED_AT = 1.4  # of the highest critical frequency: where the line of a multiple is named, at most
NAME_WIDTH = 0.08  # of the axis: names of critical speeds nearer than that are left out
BISECTIONS = 16  # of the interval between two speeds in which growth begins


def campbell_drawing(
    answer: CriticalSpeeds,
    name: str,
    paths: Sweep | None = None,
    width: str = "page",
) -> Drawing:
    """Draw a Campbell diagram: frequencies over the speed, thick and red where a mode grows.

    Critical speeds, and the ends of lines, are marks that point up for forward whirl and down for
    backward whirl, diamonds where parts of the rotor differ, squares where orbits are straight.

    Parameters
    ----------
    answer : CriticalSpeeds
        What is drawn.
    name : str
        The rotor, for the alternative text.
    paths : Sweep, optional
        Of the same rotor: modes that grow have the colours and numbers of its chart of damping.
    width : {"page", "column"}
        Of the figure.
    """
    # `highest` (Hz) lies in the figure, and so do growing frequencies up to REACH times `highest`
    if answer.critical:
        highest = max(critical.frequency_hz for critical in answer.critical)
    else:  # where the highest multiple of the speed ends
        highest = max(answer.orders) * answer.high / math.tau
    growing_hz = answer.frequencies_hz[answer.growing]
    growing_hz = growing_hz[growing_hz <= REACH * highest]
    # the highest frequency (Hz) shown, over the whole range of speed
    top = max(MARGIN * highest, ABOVE * float(growing_hz.max(initial=0.0)))
    with style():
        figure = Figure(figsize=(DOUBLE, 2.1))
        if width == "column":
            figure.set_size_inches(SINGLE, 3.0)
        axes = figure.add_subplot()
        axes.tick_params(top=False)
        rpm = axes.secondary_xaxis(
            "top", functions=(lambda x: np.multiply(x, RPM), lambda x: np.divide(x, RPM))
        )
        rpm.set_xlabel(f"{symbol_of(answer.parameter)} [rpm]")
        _draw_frequencies(axes, answer, top)
        for order in answer.orders:
            _draw_multiple(axes, answer, order, highest)
        _mark_critical_speeds(axes, answer)
        axes.set(
            xlim=(answer.low, answer.high),
            ylim=(0.0, top),
            xlabel=f"{symbol_of(answer.parameter)} [rad/s]",
            ylabel="frequency [Hz]",
        )
        _name_onset(axes, answer, top)
        directions_at_end = _mark_directions(axes, answer, top)
        entries = _entries(answer, directions_at_end)
        if paths is not None:
            _draw_named_modes(axes, paths, top)
            own_value = Paths(paths).own_value
            if own_value is not None:
                axes.axvline(own_value, color="0.4", lw=0.6, ls="-.", zorder=0, gid="own value")
                present = f"present {own_value:.4g} rad/s"
                entries.append(Line2D([], [], color="0.4", lw=0.6, ls="-.", label=present))
        if entries:
            figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))
        move_apart(figure)
    speeds = []
    for critical in answer.critical:
        direction = critical.direction or "no direction"
        speeds.append(f"{critical.speed:.5g} rad/s ({critical.order:g}x, {direction})")
    text = (
        f"Campbell diagram of {name} from {answer.low:g} to {answer.high:g} rad/s; critical "
        f"speeds: {', '.join(speeds) or 'none'}."
    )
    return Drawing(figure, text, f"Campbell diagram of {name}", origin(__name__))


def _mark_critical_speeds(axes: Axes, answer: CriticalSpeeds) -> None:
    """Mark each critical speed, and write its value beside the mark of the first `NAMED` ones.

    Values that would be written over an earlier one are left out: the table has them.
    """
    named: list[float] = []  # rising
    for critical in answer.critical:
        speed = critical.speed
        point = (speed, critical.frequency_hz)
        axes.plot(*point, MARKS[critical.direction], mfc="w", mec="k", ms=5.5, zorder=4)
        is_apart = all(speed - other > NAME_WIDTH * answer.high for other in named)
        if is_apart and len(named) < NAMED:
            text = f"{speed:.4g}{speed_words(speed, 'rad/s')}"
            write_beside(axes, text, point, (4, -4), fontsize=7)
            named.append(speed)


def _draw_frequencies(axes: Axes, answer: CriticalSpeeds, top: float) -> None:
    """Draw frequencies up to `top` (Hz) over the speed, red and thick where the mode grows."""
    # a column for each rank of the frequencies, NaN at speeds where it is no mode of the band
    for hertz, grows in zip(answer.frequencies_hz.T, answer.growing.T, strict=True):
        if (hertz <= top).any():
            axes.plot(answer.speeds, hertz, color="0.45", lw=0.7, zorder=1)
            axes.plot(answer.speeds, np.where(grows, hertz, np.nan), color=RED, lw=2.0, zorder=2)


def _draw_named_modes(axes: Axes, sweep: Sweep, top: float) -> None:
    """Draw and name the modes that have a colour, up to a frequency (Hz)."""
    paths = Paths(sweep)
    for mode, colour in colours_of(paths).items():
        hertz = paths.roots[mode].imag / math.tau
        draw_mode(axes, paths, mode, hertz)
        middle = len(hertz) // 2
        if hertz[middle] <= top:
            point = (paths.at[mode][middle], hertz[middle])
            write_beside(axes, f"mode {mode}", point, (4, -4), fontsize=7, color=colour)


def _mark_directions(axes: Axes, answer: CriticalSpeeds, top: float) -> set[str | None]:
    """Mark the direction of whirl of each mode up to `top` (Hz) at the highest speed.

    Returns the directions that are marked.
    """
    speed = float(answer.speeds[-1])
    directions: set[str | None] = set()
    roots = answer.diagram.ranked_roots(speed)[answer.diagram.are_modes(speed)]
    for root in roots.tolist():
        hertz = root.imag / math.tau
        direction = None
        if 0.0 < hertz <= top:
            direction = answer.diagram.direction(speed, root)
        if direction is not None:
            directions.add(direction)
            axes.plot(
                speed,
                hertz,
                MARKS[direction],
                mfc="0.45",
                mec="none",
                ms=4.5,
                clip_on=False,
                zorder=3,
                gid=f"end {direction}",
            )
    return directions


def _draw_multiple(axes: Axes, answer: CriticalSpeeds, order: float, highest: float) -> None:
    """Draw the line of a multiple of the speed, with its name where it leaves the figure.

    order: which multiple; highest: the frequency (Hz) that the figure has to show.
    """
    ends = np.array([answer.low, answer.high])
    axes.plot(ends, order * ends / math.tau, color=RING, lw=0.9, ls="--", zorder=0)
    speed = min(answer.high, math.tau * NAMED_AT * highest / order)
    point = (speed, order * speed / math.tau)
    write_beside(axes, f"{order:g}x", point, (-6, 3), color=RING)


def _name_onset(axes: Axes, answer: CriticalSpeeds, top: float) -> None:
    """Write the speed from which on some mode grows, beside the lowest frequency that grows there.

    Modes above `top` (Hz) do not count. Two neighbouring speeds of the answer enclose that speed;
    bisection refines it.
    """
    grows = answer.growing & (answer.frequencies_hz <= top)
    unstable = np.flatnonzero(grows.any(axis=1))  # indices of speeds
    if not unstable.size:
        return
    first = unstable[0]
    speed = float(answer.speeds[first])
    hertz = float(answer.frequencies_hz[first][grows[first]].min())
    if first > 0:
        below = float(answer.speeds[first - 1])
        for _ in range(BISECTIONS):
            middle = (below + speed) / 2
            omega = answer.diagram.ranked_roots(middle).imag
            if answer.diagram.growing(middle)[omega <= math.tau * top].any():
                speed = middle
            else:
                below = middle
        speed = below  # the end of the last interval at which nothing grows yet
    text = f"unstable from {speed:.4g}{speed_words(speed, 'rad/s')} on, {hertz:.4g} Hz"
    # offsets of the text in points, away from the nearer border
    up = 8 if hertz < 0.8 * top else -8
    right = 4 if speed < 0.5 * answer.high else -4
    write_beside(axes, text, (speed, hertz), (right, up), fontsize=7, color=RED)


def _entries(answer: CriticalSpeeds, directions_at_end: set[str | None]) -> list[Line2D]:
    """What a legend shows of the marks: those of critical speeds, and those at the highest speed.

    directions_at_end: the directions of whirl that the latter mark.
    """
    drawn = {critical.direction for critical in answer.critical} | directions_at_end
    entries = []
    for direction, mark in MARKS.items():
        if direction in drawn:
            name = direction or "no direction"
            entries.append(Line2D([], [], label=name, ls="", marker=mark, mfc="w", mec="k"))
    if answer.growing.any():
        entries.append(Line2D([], [], color="0.3", lw=2.4, label="thick: unstable"))
    return entries
