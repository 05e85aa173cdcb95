"""Campbell diagram: whirl frequencies over the speed, lines of its multiples, critical speeds."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.plots.maps import symbol_of
from squeal.plots.modes import RED, RING
from squeal.plots.style import DOUBLE, Drawing, origin, style
from squeal.queries.critical_speeds import CriticalSpeed, CriticalSpeeds

MARKS = {"forward": "^", "backward": "v", None: "o"}
NAMED = 8  # critical speeds that stand in words beside their marks


def campbell_drawing(answer: CriticalSpeeds, name: str) -> Drawing:
    """Frequencies as dots over the speed, what grows in red; critical speeds as marks that point
    up for forward whirl and down for backward whirl."""
    highest = max(answer.orders) * answer.high / (2 * np.pi)
    top = max((one.frequency_hz for one in answer.critical), default=highest)
    shown = answer.frequencies_hz <= 1.6 * top
    speeds = np.broadcast_to(answer.speeds[:, None], shown.shape)
    with style():
        figure = Figure(figsize=(DOUBLE, 3.2))
        axes = figure.add_subplot()
        for is_shown, colour, size in (
            (shown & ~answer.growing, "0.25", 1.2),
            (shown & answer.growing, RED, 4.0),
        ):
            hertz = answer.frequencies_hz[is_shown]
            axes.scatter(speeds[is_shown], hertz, s=size, color=colour, lw=0)
        for order in answer.orders:
            _draw_multiple(axes, answer, order, top)
        for k, one in enumerate(answer.critical):
            axes.plot(
                one.speed,
                one.frequency_hz,
                MARKS[one.direction],
                mfc="white",
                mec="black",
                ms=5.5,
                zorder=4,
            )
            if k < NAMED:  # two neighbours have theirs on either side of the line
                _name_speed(axes, one, below=k % 2 == 1)
        axes.set(xlim=(answer.low, answer.high), ylim=(0.0, 1.6 * top))
        axes.set(xlabel=f"{symbol_of(answer.parameter)} [rad/s]", ylabel="frequency [Hz]")
        figure.legend(handles=_entries(), loc="outside upper center", ncols=4)
    each = ", ".join(
        f"{one.speed:.5g} rad/s ({one.order:g}x, {one.direction or 'no direction'})"
        for one in answer.critical
    )
    text = (
        f"Campbell diagram of {name} from {answer.low:g} to {answer.high:g} rad/s; critical "
        f"speeds: {each or 'none'}."
    )
    return Drawing(figure, text, f"Campbell diagram of {name}", origin(__name__))


def _draw_multiple(axes: Axes, answer: CriticalSpeeds, order: float, top: float) -> None:
    """The line of a multiple of the speed, named where it leaves the figure."""
    ends = np.array([answer.low, answer.high])
    axes.plot(ends, order * ends / (2 * np.pi), color=RING, lw=0.9, ls="--", zorder=0)
    speed = min(answer.high, 2 * np.pi * 1.4 * top / order)
    axes.annotate(
        f"{order:g}x",
        (speed, order * speed / (2 * np.pi)),
        (-6, 3),
        textcoords="offset points",
        color=RING,
        ha="right",
        va="bottom",
    )


def _name_speed(axes: Axes, critical: CriticalSpeed, below: bool) -> None:
    """A critical speed in words, right below its mark or left above it."""
    axes.annotate(
        f"{critical.speed:.4g} rad/s",
        (critical.speed, critical.frequency_hz),
        (4, -4) if below else (-4, 4),
        textcoords="offset points",
        fontsize=7,
        ha="left" if below else "right",
        va="top" if below else "bottom",
    )


def _entries() -> list[Line2D]:
    """What a legend shows of the marks."""
    names = {"forward": "^", "backward": "v", "not moved by speed": "o"}
    entries = []
    for name, mark in names.items():
        entries.append(Line2D([], [], ls="", marker=mark, mfc="white", mec="black", label=name))
    return [*entries, Line2D([], [], ls="", marker=".", color=RED, label="grows")]
