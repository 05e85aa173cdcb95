"""Sweeps of friction and a branch of cycles, from the study of that name."""

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from squeal.article.results.onset import Cycles, Onset, Step, Sweep
from squeal.article.studies.energy import motion_title
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

COLOURS = ("#000000", "#3498DB", "#C8380E", "#6A1B7B")
SIZES = (7.0, 4.0, 2.2, 1.2)  # of marks, by damping: the smaller ones lie on the greater
UP: dict[str, Any] = {"marker": "^"}
DOWN: dict[str, Any] = {"marker": "v", "mfc": "none"}
LIVELY: dict[str, Any] = {"marker": "x"}
PALE = 0.3
COLUMNS = 3


class _Mark(NamedTuple):
    colour: str
    size: float


def _way(axes: Axes, way: tuple[Step, ...], mark: _Mark, look: dict[str, Any]) -> None:
    """Peaks of steps; those of a pad faster than the surface are pale."""
    for slides, alpha in ((True, 1.0), (False, PALE)):
        some = [(step.mu, step.peak) for step in way if step.slides == slides and not step.off]
        axes.plot(
            *np.array(some).reshape(-1, 2).T,
            color=mark.colour,
            ms=mark.size,
            ls="",
            mew=0.6,
            alpha=alpha,
            **look,
        )


def _marks(found: Onset) -> dict[float, _Mark]:
    ratios = sorted({sweep.ratio for sweeps in found.sweeps.values() for sweep in sweeps})
    return dict(zip(ratios, map(_Mark, COLOURS, SIZES), strict=False))


def _threshold(axes: Axes, mu: float | None) -> None:
    if mu is not None:
        axes.axvline(mu, color="0.5", lw=0.7, ls="--", zorder=0)
    axes.set_xlabel(r"friction $\mu$")


def _sweeps(axes: Axes, sweeps: tuple[Sweep, ...], marks: dict[float, _Mark]) -> None:
    for sweep in sweeps:
        _way(axes, sweep.up, marks[sweep.ratio], UP)
        _way(axes, sweep.down[1:] + sweep.beyond[1:], marks[sweep.ratio], DOWN)
        _way(axes, sweep.lively, marks[sweep.ratio], LIVELY)
    low, high = axes.get_ylim()
    if high > 5.0 * max(low, 0.1):
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.yaxis.set_minor_formatter(NullFormatter())


def _branch(axes: Axes, found: Cycles, sweep: Sweep | None, mark: _Mark) -> None:
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
        _way(axes, tuple(step for step in near if step.slides), mark, look)


def onset_figure(found: Onset) -> Figure:
    """A panel a motion that is followed in friction, and one with a branch of cycles."""
    names = list(found.sweeps)
    panels = len(names) + isinstance(found.cycles, Cycles)
    columns = min(panels, COLUMNS)
    rows = -(-panels // columns)
    marks = _marks(found)
    with style():
        figure = Figure(figsize=(DOUBLE, 0.6 + 2.2 * rows))
        grid = figure.subplots(rows, columns, squeeze=False)
        for axes, letter, name in zip(grid.flat, "abcdefgh", names, strict=False):
            _sweeps(axes, found.sweeps[name], marks)
            _threshold(axes, found.thresholds[name])
            axes.set_title(f"({letter}) {motion_title(name)}", loc="left", pad=3.0)
        if isinstance(found.cycles, Cycles):
            axes, own = grid.flat[len(names)], found.cycles.name
            ratio = found.cycles.ratio
            sweep = next((one for one in found.sweeps[own] if one.ratio == ratio), None)
            _branch(axes, found.cycles, sweep, marks.get(ratio, _Mark("k", SIZES[1])))
            _threshold(axes, found.thresholds[own])
            letter = "abcdefghi"[len(names)]
            axes.set_title(f"({letter}) {motion_title(own)}, cycles", loc="left", pad=3.0)
        for axes in grid.flat[panels:]:
            axes.remove()
        for axes in grid[:, 0]:
            axes.set_ylabel("peak force over $F_n$")
        handles = [
            Line2D([], [], color=c, marker="o", ls="", ms=s, label=rf"$\zeta = {100 * r:g}\,\%$")
            for r, (c, s) in marks.items()
        ]
        handles += [
            Line2D([], [], color="k", ls="", ms=3.5, label=label, **look)
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
