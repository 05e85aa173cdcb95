"""Curves of modes over friction and in the complex plane, from arrays alone."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from squeal.plots.units import Unit

COLOURS = ("#3498DB", "#6A1B7B", "#C8380E")
LOOKS: list[dict[str, Any]] = [
    {"color": colour, "linestyle": line}
    for colour, line in zip(COLOURS, ("-", (0, (4, 1.5)), (0, (5, 1.5, 1, 1.5))), strict=True)
]
FINE = 3.0  # size of the dots of many modes in a root locus
WIDTH_OF_LABEL = 0.12  # of the axis of mu


def draw_modes(
    upper: Axes,
    lower: Axes,
    mu: np.ndarray,
    values: np.ndarray,
    looks: Sequence[dict[str, Any]],
    units: tuple[Unit, Unit],
) -> None:
    """Curves of each mode over mu (k,); of its conjugate the growth rate too.

    values (k, 2n) in rad/s, columns 2j and 2j + 1 a mode and its conjugate (a real pair has two
    growth rates); looks: one for each mode; units: of frequency and growth.
    """
    for k, look in enumerate(looks):
        own = look | {"gid": f"mode {k + 1}"}
        upper.plot(mu, np.abs(values[:, 2 * k].imag) / units[0].factor, **own)
        for j in (2 * k, 2 * k + 1):
            lower.plot(mu, values[:, j].real / units[1].factor, **own)


def mark_events(
    events: Sequence[tuple[float, str, str]],
    upper: Axes,
    lower: Axes,
    low: float = 0.0,
    reach: float = 1.0,
    height: float = 0.96,
) -> None:
    """Verticals (mu, label, line style), sorted, through both panels, which may be one.

    Labels stand in the lower one below a height (share of the axis), before their line unless
    another one is there; the axis of mu begins at `low` and shows as much as `reach`.
    """
    width, free = WIDTH_OF_LABEL * reach, low
    for mu, label, line in events:
        for axes in dict.fromkeys((upper, lower)):
            axes.axvline(mu, color="k", linewidth=0.7, linestyle=line, zorder=0, gid=label)
        before = mu - free > width
        x, side = (-2.0, "right") if before else (2.0, "left")
        place: Any = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
        look: Any = {"rotation": 90, "va": "top", "bbox": {"fc": "w", "ec": "none", "pad": 0.6}}
        lower.annotate(label, (mu, height), (x, 0.0), ha=side, **place, **look)
        free = mu if before else mu + width


def draw_locus(
    axes: Axes, growth: np.ndarray, frequency: np.ndarray, mu: np.ndarray, span: Any, size: float
) -> Any:
    """Eigenvalues of the upper half plane as dots coloured by mu, ticks at the least mu.

    span: the least and largest mu of the colours. Returns the dots, for a colour bar.
    """
    axes.axvline(0.0, color="0.75", linewidth=0.5, zorder=0)
    low, high = span
    look: dict[str, Any] = {"cmap": "viridis", "vmin": low, "vmax": high, "lw": 0, "zorder": 2}
    dots = axes.scatter(growth, frequency, c=mu, s=size, gid="mu", **look)
    start = mu == low
    axes.plot(
        growth[start], frequency[start], "k_", ms=11 if size > FINE else 5, mew=0.8, gid="start"
    )
    return dots
