"""Damping ratio over frequency through a sweep, and beside it the two modes that meet."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.plots.maps import friction_symbol, symbol_of
from squeal.plots.modes import RED
from squeal.plots.style import (
    DOUBLE,
    Drawing,
    frequency_limits,
    origin,
    style,
    write_upright,
)
from squeal.results.sweep import Sweep

COLOURS = ("#C8380E", "#0072B2", "#6A1B7B", "#009E73", "#E69F00", "#56B4E9")
"""Of modes that grow, the fastest first, and of the partners that they meet."""
LARGEST = 160.0  # points squared: the bubble of the fastest growth
BELOW = 1.25  # shown damping ratios below zero, over the depth of the lowest one
GROWS = 1e-9  # of |lambda|: a growth rate below is rounding
NEAREST = 0.1  # of the frequency: no partner is farther from a mode where it grows fastest
ABOVE = 1.4  # shown damping ratios above zero, over the depth of the lowest one


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


def damping_drawing(name: str, sweep: Sweep) -> Drawing:
    """Draw damping ratios in % over frequency, a line for each mode, with bubbles by growth.

    Beside it stand the frequencies of the mode that grows fastest and of its partner over the
    parameter, with the value from which on it grows.
    """
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
    with style():
        figure = Figure(figsize=(DOUBLE, 3.2))
        left, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
        _draw_ratios(left, sweep, paths, colours)
        _draw_pair(right, sweep, paths, pair, colours)
    return Drawing(figure, f"{text}.", f"Damping ratios of {name}", origin(__name__))


def _draw_ratios(axes: Axes, sweep: Sweep, paths: _Paths, colours: dict[int, str]) -> None:
    """Draw all modes in the plane of frequency and damping ratio, grey without a colour.

    colours: by the number of the mode, of modes that grow and of the partner of the fastest.
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
        grows = roots.real > 0.0
        size = LARGEST * np.maximum(roots.real[grows], 0.0) / fastest
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


def _draw_pair(
    axes: Axes, sweep: Sweep, paths: _Paths, pair: Sequence[int], colours: dict[int, str]
) -> None:
    """Draw the frequencies of the fastest mode and of its partner over the parameter.

    pair: numbers of the fastest mode and, if it has one, of its partner; empty if none grows.
    """
    axes.set(xlabel=friction_symbol(sweep.parameter), ylabel="frequency [Hz]")
    axes.set(xlim=(sweep.steps[0].value, sweep.steps[-1].value))
    if not pair:
        axes.set_title("no mode grows", loc="left")
        axes.set(yticks=[])
        return
    for mode in reversed(pair):  # the fastest one on top
        hertz = paths.roots[mode].imag / math.tau
        grows = paths.roots[mode].real > 0.0
        axes.plot(paths.at[mode], hertz, color=colours[mode], lw=1.0, gid=f"pair {mode}")
        axes.plot(paths.at[mode][grows], hertz[grows], ".", color=colours[mode], ms=4)
    roots = paths.roots[pair[0]]
    first_growing = roots[roots.real > 0.0][0]
    at = f"{first_growing.imag / math.tau:.4g} Hz"
    title = f"mode {pair[0]} begins to grow at {at}"
    if len(pair) == 2:
        title = f"modes {min(pair)} and {max(pair)} meet at {at}"
    axes.set_title(title, loc="left")
    fastest = next(mode for mode in sweep.modes if mode.mode == pair[0])
    if fastest.interval is not None:
        low, high = fastest.interval
        axes.axvspan(low, high, color="0.8", lw=0, zorder=0, gid="onset")
        write_upright(axes, high, f"growth begins: {low:.4g} to {high:.4g}")
