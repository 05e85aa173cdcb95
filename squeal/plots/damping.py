"""Damping ratio over frequency through a sweep, and beside it the two modes that meet."""

import math
from typing import Any

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
        self.at = {mode: np.array([value for value, _ in path]) for mode, path in rows.items()}
        self.roots = {mode: np.array([z for _, z in path]) for mode, path in rows.items()}

    def growth(self, mode: int) -> float:
        """Its fastest growth rate, 1/s."""
        return float(self.roots[mode].real.max())

    def partner(self, mode: int) -> int | None:
        """The mode that comes nearest to it where it grows fastest, over its frequency; None where
        none comes within a tenth."""
        fastest = int(np.argmax(self.roots[mode].real))
        value, frequency = self.at[mode][fastest], self.roots[mode][fastest].imag
        distance = {}
        for other, at in self.at.items():
            here = np.flatnonzero(at == value)
            if other != mode and here.size:
                apart = abs(self.roots[other][here[0]].imag - frequency)
                distance[other] = float(apart) / frequency
        nearest = min(distance, key=lambda other: distance[other], default=None)
        return nearest if nearest is not None and distance[nearest] < 0.1 else None


def damping_drawing(name: str, sweep: Sweep) -> Drawing:
    """Damping ratio in % over frequency, a line for each mode through the sweep, bubbles by growth;
    beside it the frequencies of the mode that grows fastest and of its partner over the parameter,
    with the value from which on it grows."""
    paths = _Paths(sweep)
    growing = [
        mode.mode for mode in sweep.modes if mode.growth_rate > 0.0 and mode.mode in paths.at
    ]
    growing = [mode for mode in growing if paths.growth(mode) > 1e-9 * abs(paths.roots[mode][0])]
    growing.sort(key=lambda mode: -paths.growth(mode))
    partner = paths.partner(growing[0]) if growing else None
    met = [] if partner is None else [partner]
    named = list(dict.fromkeys([*growing[:1], *met, *growing]))
    colours = dict(zip(named, COLOURS, strict=False))
    with style():
        figure = Figure(figsize=(DOUBLE, 3.2))
        left, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
        _ratios(left, paths, colours)
        lead = growing[0] if growing else None
        _pair(right, sweep, paths, lead, partner, colours)
    count = "1 mode grows" if len(growing) == 1 else f"{len(growing)} modes grow"
    text = f"Damping ratio over frequency of {name}, {count}"
    if lead is not None:
        fastest = f"the fastest is mode {lead} by {paths.growth(lead):.4g} 1/s"
        meets = f", which meets mode {partner}" * (partner is not None)
        text += f"; {fastest}{meets}"
    return Drawing(figure, f"{text}.", f"Damping ratios of {name}", origin(__name__))


def _ratios(axes: Axes, paths: _Paths, colours: dict[int, str]) -> None:
    """All modes in the plane of frequency and damping ratio; grey where they never grow."""
    every = np.concatenate([np.zeros(0, complex), *paths.roots.values()])
    lowest = min(0.0, float((-100 * every.real / np.abs(every)).min(initial=0.0)))
    fastest = max(float(every.real.max(initial=0.0)), 1e-300)
    depth = -lowest or 1.0
    limits = frequency_limits(every)
    for mode, roots in sorted(paths.roots.items(), key=lambda item: item[0] in colours):
        hertz, ratio = roots.imag / math.tau, -100 * roots.real / np.abs(roots)
        colour = colours.get(mode, "0.7")
        axes.plot(hertz, ratio, color=colour, lw=0.8, gid=f"mode {mode}")
        axes.plot(hertz[:1], ratio[:1], "|", color=colour, ms=6)
        grows = roots.real > 0.0
        if mode in colours:
            size = LARGEST * np.maximum(roots.real[grows], 0.0) / fastest
            look: Any = {"s": size, "fc": colour, "alpha": 0.35, "lw": 0, "zorder": 3}
            axes.scatter(hertz[grows], ratio[grows], **look)
            end = int(np.argmin(ratio))
            if ratio[end] < 0.0:
                beyond = hertz[end] > limits[0] + 0.8 * (limits[1] - limits[0])
                words: Any = {"fontsize": 7, "color": colour, "textcoords": "offset points"}
                words |= {"ha": "right" if beyond else "left", "va": "center"}
                offset = (-9 if beyond else 9, 0)
                axes.annotate(f"{hertz[end]:.4g} Hz", (hertz[end], ratio[end]), offset, **words)
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
        label = f"growth begins: {low:.4g} to {high:.4g}"
        look: Any = {"rotation": 90, "va": "bottom", "ha": "left", "fontsize": 7}
        where = ("data", "axes fraction")
        axes.annotate(label, (high, 0.03), (3, 0), where, "offset points", **look)
