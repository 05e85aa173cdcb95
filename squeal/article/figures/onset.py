"""Sweeps of friction, a branch of cycles and sections, from the study of that name."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from squeal.article.results.energy import motion_title
from squeal.article.results.onset import Cycles, Onset, Section, Sweep, Way
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

COLOURS = ("#3498DB", "#000000", "#C8380E", "#6A1B7B")
UP, DOWN = {"marker": "^", "ms": 3.0}, {"marker": "v", "ms": 3.0, "mfc": "w"}


def _way(axes: Axes, way: Way, colour: str, look: dict[str, object]) -> None:
    peak = [np.nan if v is None else v for v in way.peak]
    axes.plot(way.mu, peak, color=colour, lw=0.5, mew=0.5, **look)  # type: ignore[arg-type]


def _sweeps(axes: Axes, sweeps: tuple[Sweep, ...], threshold: float | None) -> None:
    for sweep, colour in zip(sweeps, COLOURS, strict=False):
        _way(axes, sweep.up, colour, UP)
        _way(axes, sweep.down, colour, DOWN)
    if threshold is not None:
        axes.axvline(threshold, color="0.5", lw=0.7, ls="--", zorder=0)
    low, high = axes.get_ylim()
    if high > 5.0 * max(low, 0.1):
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(r"friction $\mu$")


def _branch(axes: Axes, found: Cycles, sweeps: tuple[Sweep, ...], threshold: float | None) -> None:
    mu = np.array([point.mu for point in found.branch])
    peak = np.array([point.peak for point in found.branch])
    stable = np.array([point.stable for point in found.branch])
    # a piece between a stable and an unstable cycle is drawn with the stable ones
    joined = stable | np.append(stable[1:], False) | np.append(False, stable[:-1])
    axes.plot(mu, np.where(joined, peak, np.nan), "-", color="k", label="cycle, stable")
    axes.plot(mu, np.where(stable, np.nan, peak), "--", color="k", label="cycle, unstable")
    for sweep in sweeps:
        if sweep.ratio == found.ratio:
            _way(axes, sweep.up, COLOURS[1], UP | {"ls": ""})
            _way(axes, sweep.down, COLOURS[1], DOWN | {"ls": ""})
    if threshold is not None:
        axes.axvline(threshold, color="0.5", lw=0.7, ls="--", zorder=0)
    axes.set_xlabel(r"friction $\mu$")


def _section(axes: Axes, found: Section) -> None:
    axes.plot(found.height, found.rate, ".", color="k", ms=1.5, mew=0.0)
    axes.set_xlabel("height over static compression")
    axes.set_ylabel(r"$\dot{y}$ [m/s]")


def onset_figure(found: Onset) -> Figure:
    """Sweeps above; below the branch of cycles and the sections of the other motions.

    One motion has its sweeps and its branch side by side.
    """
    names = list(found.sweeps)
    has_cycles = isinstance(found.cycles, Cycles)
    others = [n for n in names if not has_cycles or n != found.cycles.name]  # type: ignore[union-attr]
    columns = max(len(names), len(others) + has_cycles)
    with style():
        figure = Figure(figsize=(DOUBLE, 4.4 if columns > 1 else 2.6))
        grid = figure.subplots(2, columns, squeeze=False) if columns > 1 else figure.subplots(1, 2)
        grid = grid.reshape(2, columns)
        for axes, name, letter in zip(grid[0], names, "abc", strict=False):
            _sweeps(axes, found.sweeps[name], found.thresholds[name])
            axes.set_title(f"({letter}) {motion_title(name)}", loc="left", pad=3.0)
        below = iter(zip(grid[1], "abcdefg"[len(names) :], strict=False))
        if isinstance(found.cycles, Cycles):
            axes, letter = next(below)
            own = found.cycles.name
            _branch(axes, found.cycles, found.sweeps[own], found.thresholds[own])
            axes.set_title(f"({letter}) {motion_title(own)}, cycles", loc="left", pad=3.0)
            axes.set_ylabel("peak force over $F_n$")
        for name in others:
            axes, letter = next(below)
            _section(axes, found.sections[name])
            axes.set_title(f"({letter}) {motion_title(name)}, section", loc="left", pad=3.0)
        grid[0, 0].set_ylabel("peak force over $F_n$")
        handles = [
            Line2D([], [], color=c, label=rf"$\zeta = {100 * sweep.ratio:g}\,\%$")
            for sweep, c in zip(next(iter(found.sweeps.values())), COLOURS, strict=False)
        ]
        handles += [
            Line2D([], [], color="k", ls="", label=label, **look)  # type: ignore[arg-type]
            for label, look in ((r"$\mu$ raised", UP), (r"$\mu$ lowered", DOWN))
        ]
        handles.append(Line2D([], [], color="0.5", ls="--", lw=0.7, label="flutter begins"))
        figure.legend(handles=handles, loc="outside upper center", ncols=7)
    return figure


def draw(found: Onset) -> Drawing:
    """The figure, ready to be saved."""
    if not found.sweeps:
        why = found.left_out or "No motion goes on losing contact with damping."
        return blank("Lasting changes of contact with damping", why, __name__, found.provenance)
    parts = []
    for name, sweeps in found.sweeps.items():
        ends = [
            f"{100 * s.ratio:g} % damping from {min(s.up.changing, default=float('nan')):.2g} up "
            f"and to {min(s.down.changing, default=float('nan')):.2g} down"
            for s in sweeps
        ]
        parts.append(f"{motion_title(name)} changes contact with {', '.join(ends)}")
    text = (
        "Peak force over friction, raised and lowered, for several damping ratios: "
        f"{'; '.join(parts)}. Then a branch of cycles over friction, and sections of "
        "other motions whenever the leading edge separates."
    )
    made = origin(__name__, found.provenance)
    return Drawing(onset_figure(found), text, "Lasting changes of contact with damping", made)
