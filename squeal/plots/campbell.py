"""Campbell diagram: whirl frequencies over the speed, lines of its multiples, critical speeds."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.plots.maps import symbol_of
from squeal.plots.modes import RED, RING
from squeal.plots.style import DOUBLE, Drawing, origin, style, write_beside
from squeal.queries.critical_speeds import CriticalSpeeds

MARKS = {"forward": "^", "backward": "v", None: "o"}
NAMED = 8  # critical speeds that stand in words beside their marks
MARGIN = 1.6  # shown frequencies over the highest critical one
NAMED_AT = 1.4  # share of that frequency at which the line of a multiple is named, at most


def campbell_drawing(answer: CriticalSpeeds, name: str) -> Drawing:
    """Draw a Campbell diagram: frequencies as dots over the speed, those of growing modes in red.

    Critical speeds are marks that point up for forward whirl and down for backward whirl.
    """
    if answer.critical:
        highest = max(critical.frequency_hz for critical in answer.critical)
    else:
        highest = max(answer.orders) * answer.high / (2 * np.pi)
    with style():
        figure = Figure(figsize=(DOUBLE, 3.2))
        axes = figure.add_subplot()
        _draw_frequencies(axes, answer, MARGIN * highest)
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
                write_beside(axes, f"{critical.speed:.4g} rad/s", point, offset, fontsize=7)
        axes.set(xlim=(answer.low, answer.high), ylim=(0.0, MARGIN * highest))
        axes.set(xlabel=f"{symbol_of(answer.parameter)} [rad/s]", ylabel="frequency [Hz]")
        figure.legend(handles=_entries(), loc="outside upper center", ncols=4)
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


def _entries() -> list[Line2D]:
    """What a legend shows of the marks."""
    entries = []
    for direction, mark in MARKS.items():
        name = direction or "not moved by speed"
        entries.append(Line2D([], [], ls="", marker=mark, mfc="white", mec="black", label=name))
    return [*entries, Line2D([], [], ls="", marker=".", color=RED, label="grows")]
