"""Campbell diagram: whirl frequencies over the speed, lines of its multiples, critical speeds."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.analysis.critical_speeds import CriticalSpeeds
from squeal.plots.maps import symbol_of
from squeal.plots.modes import RED, RING
from squeal.plots.style import DOUBLE, Drawing, origin, style

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
        for some, colour, size in ((~answer.growing, "0.25", 1.2), (answer.growing, RED, 4.0)):
            here = some & shown
            look: Any = {"s": size, "color": colour, "lw": 0}
            axes.scatter(speeds[here], answer.frequencies_hz[here], **look)
        for order in answer.orders:
            ends = np.array([answer.low, answer.high])
            axes.plot(ends, order * ends / (2 * np.pi), color=RING, lw=0.9, ls="--", zorder=0)
            place = min(answer.high, 2 * np.pi * 1.4 * top / order)
            words: Any = {"color": RING, "ha": "right", "va": "bottom"}
            words |= {"textcoords": "offset points"}
            axes.annotate(f"{order:g}x", (place, order * place / (2 * np.pi)), (-6, 3), **words)
        for k, one in enumerate(answer.critical):
            mark: Any = {"mfc": "white", "mec": "black", "ms": 5.5, "zorder": 4}
            axes.plot(one.speed, one.frequency_hz, MARKS[one.direction], **mark)
            if k < NAMED:
                text = f"{one.speed:.4g} rad/s"
                below = k % 2  # two neighbours have theirs on either side of the line
                look = {"textcoords": "offset points", "fontsize": 7}
                look |= {"ha": "left", "va": "top"} if below else {"ha": "right", "va": "bottom"}
                offset = (4, -4) if below else (-4, 4)
                axes.annotate(text, (one.speed, one.frequency_hz), offset, **look)
        axes.set(xlim=(answer.low, answer.high), ylim=(0.0, 1.6 * top))
        axes.set(xlabel=f"{symbol_of(answer.parameter)} [rad/s]", ylabel="frequency [Hz]")
        entries = {"forward": "^", "backward": "v", "not moved by speed": "o"}
        handles = [
            Line2D([], [], ls="", marker=mark, mfc="white", mec="black", label=label)
            for label, mark in entries.items()
        ]
        handles += [Line2D([], [], ls="", marker=".", color=RED, label="grows")]
        figure.legend(handles=handles, loc="outside upper center", ncols=4)
    each = ", ".join(
        f"{one.speed:.5g} rad/s ({one.order:g}x, {one.direction or 'no direction'})"
        for one in answer.critical
    )
    text = (
        f"Campbell diagram of {name} from {answer.low:g} to {answer.high:g} rad/s; critical "
        f"speeds: {each or 'none'}."
    )
    return Drawing(figure, text, f"Campbell diagram of {name}", origin(__name__))
