"""Sweeps of friction and a branch of cycles, from the study of that name."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from squeal.article.results.energy import motion_title
from squeal.article.results.onset import Cycles, Onset, Step, Sweep
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

COLOURS = ("#000000", "#3498DB", "#C8380E", "#6A1B7B")
UP: dict[str, Any] = {"marker": "^", "ms": 3.5}
DOWN: dict[str, Any] = {"marker": "v", "ms": 3.5, "mfc": "w"}
LIVELY: dict[str, Any] = {"marker": "x", "ms": 3.5}
PALE = 0.3
COLUMNS = 3


def _way(axes: Axes, way: tuple[Step, ...], colour: str, look: dict[str, Any]) -> None:
    """Peaks of steps; those of a pad faster than the surface are pale."""
    for slides, alpha in ((True, 1.0), (False, PALE)):
        some = [(step.mu, step.peak) for step in way if step.slides == slides and not step.off]
        axes.plot(
            *np.array(some).reshape(-1, 2).T, color=colour, ls="", mew=0.6, alpha=alpha, **look
        )


def _colours(found: Onset) -> dict[float, str]:
    ratios = sorted({sweep.ratio for sweeps in found.sweeps.values() for sweep in sweeps})
    return dict(zip(ratios, COLOURS, strict=False))


def _threshold(axes: Axes, mu: float | None) -> None:
    if mu is not None:
        axes.axvline(mu, color="0.5", lw=0.7, ls="--", zorder=0)
    axes.set_xlabel(r"friction $\mu$")


def _sweeps(axes: Axes, sweeps: tuple[Sweep, ...], colours: dict[float, str]) -> None:
    for sweep in sweeps:
        _way(axes, sweep.up, colours[sweep.ratio], UP)
        _way(axes, sweep.down[1:] + sweep.beyond[1:], colours[sweep.ratio], DOWN)
        _way(axes, sweep.lively, colours[sweep.ratio], LIVELY)
    low, high = axes.get_ylim()
    if high > 5.0 * max(low, 0.1):
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.yaxis.set_minor_formatter(NullFormatter())


def _branch(axes: Axes, found: Cycles, sweep: Sweep | None, colour: str) -> None:
    mu = np.array([point.mu for point in found.branch])
    peak = np.array([point.peak for point in found.branch])
    stable = np.array([point.stable for point in found.branch])
    # a piece between a stable and an unstable cycle is drawn with the stable ones
    joined = stable | np.append(stable[1:], False) | np.append(False, stable[:-1])
    axes.plot(mu, np.where(joined, peak, np.nan), "-", color="k", label="cycle, stable")
    axes.plot(mu, np.where(stable, np.nan, peak), "--", color="k", label="cycle, unstable")
    reach = 0.1 * np.ptp(mu)
    for way, look in ((sweep.up, UP), (sweep.down[1:], DOWN)) if sweep else ():
        near = (step for step in way if mu.min() - reach <= step.mu <= mu.max() + reach)
        _way(axes, tuple(step for step in near if step.slides), colour, look)


def onset_figure(found: Onset) -> Figure:
    """A panel a motion that is followed in friction, and one with a branch of cycles."""
    names = list(found.sweeps)
    panels = len(names) + isinstance(found.cycles, Cycles)
    columns = min(panels, COLUMNS)
    rows = -(-panels // columns)
    colours = _colours(found)
    with style():
        figure = Figure(figsize=(DOUBLE, 0.6 + 2.2 * rows))
        grid = figure.subplots(rows, columns, squeeze=False)
        for axes, letter, name in zip(grid.flat, "abcdefgh", names, strict=False):
            _sweeps(axes, found.sweeps[name], colours)
            _threshold(axes, found.thresholds[name])
            axes.set_title(f"({letter}) {motion_title(name)}", loc="left", pad=3.0)
        if isinstance(found.cycles, Cycles):
            axes, own = grid.flat[len(names)], found.cycles.name
            ratio = found.cycles.ratio
            sweep = next((one for one in found.sweeps[own] if one.ratio == ratio), None)
            _branch(axes, found.cycles, sweep, colours.get(ratio, "k"))
            _threshold(axes, found.thresholds[own])
            letter = "abcdefghi"[len(names)]
            axes.set_title(f"({letter}) {motion_title(own)}, cycles", loc="left", pad=3.0)
        for axes in grid.flat[panels:]:
            axes.remove()
        for axes in grid[:, 0]:
            axes.set_ylabel("peak force over $F_n$")
        handles = [
            Line2D([], [], color=c, marker="o", ls="", ms=3.5, label=rf"$\zeta = {100 * r:g}\,\%$")
            for r, c in colours.items()
        ]
        handles += [
            Line2D([], [], color="k", ls="", label=label, **look)
            for label, look in (
                (r"$\mu$ raised", UP),
                (r"$\mu$ lowered", DOWN),
                ("other starts", LIVELY),
            )
        ]
        handles.append(Line2D([], [], color="0.5", ls="--", lw=0.7, label="flutter begins"))
        pale: Any = {"color": "k", "marker": "o", "ls": "", "ms": 3.5, "alpha": PALE}
        handles.append(Line2D([], [], label="face faster than $V$", **pale))
        figure.legend(handles=handles, loc="outside upper center", ncols=5)
    return figure


def _range(way: tuple[Step, ...]) -> str:
    some = [step.mu for step in way if step.goes_on and step.slides]
    return f"from {min(some):.2g} to {max(some):.2g}" if some else "nowhere"


def draw(found: Onset) -> Drawing:
    """The figure, ready to be saved."""
    if not found.sweeps:
        why = found.left_out or "No motion goes on losing contact with damping."
        return blank("Lasting changes of contact with damping", why, __name__, found.provenance)
    parts = []
    for name, sweeps in found.sweeps.items():
        ends = [
            f"{100 * s.ratio:g} % damping {_range(s.up)} raised and {_range(s.down)} lowered"
            + (f", from other starts {_range(s.lively)}" if s.lively else "")
            for s in sweeps
        ]
        parts.append(f"{motion_title(name)} changes contact with {', '.join(ends)}")
    text = (
        "Peak force over friction, raised and lowered, for some damping ratios, pale where the pad "
        f"is faster than the surface; while it is slower {'; '.join(parts)}."
    )
    if isinstance(found.cycles, Cycles):
        text += f" Then the branch of cycles of {motion_title(found.cycles.name)} over friction."
    made = origin(__name__, found.provenance)
    return Drawing(onset_figure(found), text, "Lasting changes of contact with damping", made)
