"""Campbell diagram: whirl frequencies over the speed, lines of its multiples, critical speeds."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.plots.maps import symbol_of
from squeal.plots.modes import RED, RING
from squeal.plots.style import DOUBLE, Drawing, origin, style, write_beside
from squeal.queries.critical_speeds import CriticalSpeeds

MARKS = {"forward": "^", "backward": "v", "mixed": "D", None: "o"}
NAMED = 8  # critical speeds that stand in words beside their marks
RPM = 60 / (2 * np.pi)  # revolutions per minute of 1 rad/s
REACH = 3.0  # a growing frequency above so many times the highest critical one stays outside
ABOVE = 1.05  # shown frequencies over the highest one that grows
MARGIN = 1.6  # shown frequencies over the highest critical one
NAMED_AT = 1.4  # share of that frequency at which the line of a multiple is named, at most


def campbell_drawing(answer: CriticalSpeeds, name: str) -> Drawing:
    """Draw a Campbell diagram: frequencies as dots over the speed, those of growing modes in red.

    Critical speeds are marks that point up for forward whirl and down for backward whirl, diamonds
    where parts of the rotor differ.
    """
    if answer.critical:
        highest = max(critical.frequency_hz for critical in answer.critical)
    else:
        highest = max(answer.orders) * answer.high / (2 * np.pi)
    top = MARGIN * highest
    growing_hz = answer.frequencies_hz[answer.growing]
    growing_hz = growing_hz[growing_hz <= REACH * highest]
    top = max(top, ABOVE * float(growing_hz.max(initial=0.0)))  # over the whole range of speed
    with style():
        figure = Figure(figsize=(DOUBLE, 3.2))
        axes = figure.add_subplot()
        _draw_frequencies(axes, answer, top)
        for order in answer.orders:
            _draw_multiple(axes, answer, order, highest)
        for k, critical in enumerate(answer.critical):
            axes.plot(
                critical.speed,
                critical.frequency_hz,
                MARKS[critical.direction],
                mfc="white",
                mec="black",
                ms=5.5,
                zorder=4,
            )
            if k < NAMED:
                # on alternating sides, so that names of neighbours do not meet
                point = (critical.speed, critical.frequency_hz)
                offset = (-4, 4) if k % 2 == 0 else (4, -4)
                rpm = critical.speed * RPM
                text = f"{critical.speed:.4g} rad/s ({rpm:.4g} rpm)"
                write_beside(axes, text, point, offset, fontsize=7)
        axes.set(xlim=(answer.low, answer.high), ylim=(0.0, top))
        axes.set(xlabel=f"{symbol_of(answer.parameter)} [rad/s]", ylabel="frequency [Hz]")
        _name_onset(axes, answer, top)
        entries = _entries(answer)
        if entries:
            figure.legend(handles=entries, loc="outside upper center", ncols=5)
    speeds = []
    for critical in answer.critical:
        direction = critical.direction or "no direction"
        speeds.append(f"{critical.speed:.5g} rad/s ({critical.order:g}x, {direction})")
    text = (
        f"Campbell diagram of {name} from {answer.low:g} to {answer.high:g} rad/s; critical "
        f"speeds: {', '.join(speeds) or 'none'}."
    )
    return Drawing(figure, text, f"Campbell diagram of {name}", origin(__name__))


def _draw_frequencies(axes: Axes, answer: CriticalSpeeds, top: float) -> None:
    """Draw frequencies up to `top` (Hz) as dots over the speed, red where the mode grows."""
    is_shown = answer.frequencies_hz <= top
    speeds = np.broadcast_to(answer.speeds[:, None], is_shown.shape)
    decays = is_shown & ~answer.growing
    grows = is_shown & answer.growing
    axes.scatter(speeds[decays], answer.frequencies_hz[decays], s=1.2, color="0.25", lw=0)
    axes.scatter(speeds[grows], answer.frequencies_hz[grows], s=4.0, color=RED, lw=0)


def _draw_multiple(axes: Axes, answer: CriticalSpeeds, order: float, highest: float) -> None:
    """Draw the line of a multiple of the speed, with its name where it leaves the figure.

    order: which multiple; highest: the frequency (Hz) that the figure has to show.
    """
    ends = np.array([answer.low, answer.high])
    axes.plot(ends, order * ends / (2 * np.pi), color=RING, lw=0.9, ls="--", zorder=0)
    speed = min(answer.high, 2 * np.pi * NAMED_AT * highest / order)
    point = (speed, order * speed / (2 * np.pi))
    write_beside(axes, f"{order:g}x", point, (-6, 3), color=RING)


def _name_onset(axes: Axes, answer: CriticalSpeeds, top: float) -> None:
    """Write beside the lowest frequency that grows (at most `top`) from which speed on it does."""
    grows = answer.growing & (answer.frequencies_hz <= top)
    speeds = np.flatnonzero(grows.any(axis=1))
    if not speeds.size:
        return
    first = speeds[0]
    speed = float(answer.speeds[first])
    hertz = float(answer.frequencies_hz[first][grows[first]].min())
    text = f"unstable from {speed:.4g} rad/s on, {hertz:.4g} Hz"
    if first > 0:
        below = float(answer.speeds[first - 1])
        rpm = f"{below * RPM:.4g} to {speed * RPM:.4g} rpm"
        text = f"growth begins: {below:.4g} to {speed:.4g} rad/s ({rpm}), {hertz:.4g} Hz"
    up = 28 if hertz < 0.8 * top else -28  # so that a slope does not cross it
    write_beside(axes, text, (speed, hertz), (4, up), fontsize=7, color=RED)


def _entries(answer: CriticalSpeeds) -> list[Line2D]:
    """What a legend shows of the marks that are drawn."""
    drawn = {critical.direction for critical in answer.critical}
    entries = []
    for direction, mark in MARKS.items():
        if direction in drawn:
            name = direction or "no direction"
            look: Any = {"ls": "", "marker": mark, "mfc": "white", "mec": "black"}
            entries.append(Line2D([], [], label=name, **look))
    if answer.growing.any():
        entries.append(Line2D([], [], ls="", marker=".", color=RED, label="unstable"))
    return entries
