"""Damping ratio over frequency through a sweep, and beside it the two modes that meet."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.plots.maps import symbol_of
from squeal.plots.modes import RED
from squeal.plots.style import DOUBLE, Drawing, frequency_limits, origin, style
from squeal.results.sweep import Sweep

COLOURS = ("#C8380E", "#0072B2", "#6A1B7B", "#009E73", "#E69F00", "#56B4E9")
"""Of modes that grow, the fastest first, and of the partners that they meet."""
LARGEST = 160.0  # points squared: the bubble of the fastest growth
ABOVE = 1.4  # shown damping ratios above zero, over the depth of the lowest one


class _Paths:
    """Values of the parameter and roots with Im >= 0 of each mode of a sweep, by rising value."""

    def __init__(self, sweep: Sweep) -> None:
        rows: dict[int, list[tuple[float, complex]]] = {}
        for step in sweep.steps:
            for root, mode in zip(step.eigenvalues, step.numbers, strict=True):
                if mode and root.value.imag > 0.0:
                    rows.setdefault(mode, []).append((step.value, root.value))
        self.at: dict[int, np.ndarray] = {}
        self.roots: dict[int, np.ndarray] = {}
        for mode, path in rows.items():
            self.at[mode] = np.array([value for value, _ in path])
            self.roots[mode] = np.array([root for _, root in path])

    def growth(self, mode: int) -> float:
        """Its fastest growth rate, 1/s."""
        return float(self.roots[mode].real.max())

    def partner(self, mode: int) -> int | None:
        """The mode that comes nearest to it where it grows fastest, over its frequency; None where
        none comes within a tenth."""
        fastest = int(np.argmax(self.roots[mode].real))
        frequency = self.roots[mode][fastest].imag
        nearest = None
        least = 0.1
        for other, values in self.at.items():
            here = np.flatnonzero(values == self.at[mode][fastest])
            if other != mode and here.size:
                distance = abs(self.roots[other][here[0]].imag - frequency) / frequency
                if distance < least:
                    nearest = other
                    least = distance
        return nearest


def damping_drawing(name: str, sweep: Sweep) -> Drawing:
    """Damping ratio in % over frequency, a line for each mode through the sweep, bubbles by growth;
    beside it the frequencies of the mode that grows fastest and of its partner over the parameter,
    with the value from which on it grows."""
    paths = _Paths(sweep)
    growing = []
    for swept in sweep.modes:
        mode = swept.mode
        if swept.growth_rate <= 0.0 or mode not in paths.at:
            continue
        if paths.growth(mode) > 1e-9 * abs(paths.roots[mode][0]):
            growing.append(mode)
    growing.sort(key=paths.growth, reverse=True)
    lead = growing[0] if growing else None
    partner = None if lead is None else paths.partner(lead)
    first = [mode for mode in (lead, partner) if mode is not None]
    colours = dict(zip(dict.fromkeys([*first, *growing]), COLOURS, strict=False))
    with style():
        figure = Figure(figsize=(DOUBLE, 3.2))
        left, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
        _ratios(left, paths, colours)
        _pair(right, sweep, paths, lead, partner, colours)
    count = "1 mode grows" if len(growing) == 1 else f"{len(growing)} modes grow"
    text = f"Damping ratio over frequency of {name}, {count}"
    if lead is not None:
        text += f"; the fastest is mode {lead} by {paths.growth(lead):.4g} 1/s"
    if partner is not None:
        text += f", which meets mode {partner}"
    return Drawing(figure, f"{text}.", f"Damping ratios of {name}", origin(__name__))


def _ratios(axes: Axes, paths: _Paths, colours: dict[int, str]) -> None:
    """All modes in the plane of frequency and damping ratio; grey where they never grow."""
    every = np.concatenate([np.zeros(0, complex), *paths.roots.values()])
    lowest = min(0.0, float((-100 * every.real / np.abs(every)).min(initial=0.0)))
    fastest = max(float(every.real.max(initial=0.0)), 1e-300)
    depth = -lowest or 1.0
    limits = frequency_limits(every)
    for mode, roots in sorted(paths.roots.items(), key=lambda item: item[0] in colours):
        hertz = roots.imag / math.tau
        ratio = -100 * roots.real / np.abs(roots)
        colour = colours.get(mode, "0.7")
        axes.plot(hertz, ratio, color=colour, lw=0.8, gid=f"mode {mode}")
        axes.plot(hertz[:1], ratio[:1], "|", color=colour, ms=6)
        if mode not in colours:
            continue
        grows = roots.real > 0.0
        size = LARGEST * np.maximum(roots.real[grows], 0.0) / fastest
        axes.scatter(hertz[grows], ratio[grows], s=size, fc=colour, alpha=0.35, lw=0, zorder=3)
        lowest_point = int(np.argmin(ratio))
        x = hertz[lowest_point]
        y = ratio[lowest_point]
        if y < 0.0:  # named on the side where there is room
            right = x > limits[0] + 0.8 * (limits[1] - limits[0])
            axes.annotate(
                f"{x:.4g} Hz",
                (x, y),
                (-9 if right else 9, 0),
                textcoords="offset points",
                fontsize=7,
                color=colour,
                ha="right" if right else "left",
                va="center",
            )
    axes.axhspan(-1.25 * depth, 0.0, color=RED, alpha=0.06, lw=0, zorder=0)
    axes.axhline(0.0, color="0.3", lw=0.6)
    axes.set(xlim=limits, ylim=(-1.25 * depth, ABOVE * depth))
    axes.set(xlabel="frequency [Hz]", ylabel="damping ratio [%]")
    axes.set_title("unstable below zero; bubbles by growth rate", loc="left")


def _pair(
    axes: Axes,
    sweep: Sweep,
    paths: _Paths,
    lead: int | None,
    partner: int | None,
    colours: dict[int, str],
) -> None:
    """The fastest mode and its partner over the parameter, magnified."""
    at = symbol_of(sweep.parameter)
    axes.set(xlabel=f"friction {at}" if sweep.parameter == "mu" else at, ylabel="frequency [Hz]")
    axes.set(xlim=(sweep.steps[0].value, sweep.steps[-1].value))
    if lead is None:
        axes.set_title("no mode grows", loc="left")
        axes.set(yticks=[])
        return
    both = [lead] if partner is None else [lead, partner]
    for mode in both[::-1]:
        hertz = paths.roots[mode].imag / math.tau
        grows = paths.roots[mode].real > 0.0
        axes.plot(paths.at[mode], hertz, color=colours[mode], lw=1.0, gid=f"pair {mode}")
        axes.plot(paths.at[mode][grows], hertz[grows], ".", color=colours[mode], ms=4)
    swept = next(mode for mode in sweep.modes if mode.mode == lead)
    axes.set_title(
        "the modes that meet" if partner is not None else "the mode that grows", loc="left"
    )
    if swept.interval is not None:
        low, high = swept.interval
        axes.axvspan(low, high, color="0.8", lw=0, zorder=0, gid="onset")
        axes.annotate(
            f"growth begins: {low:.4g} to {high:.4g}",
            (high, 0.03),
            (3, 0),
            ("data", "axes fraction"),
            "offset points",
            rotation=90,
            va="bottom",
            ha="left",
            fontsize=7,
        )
