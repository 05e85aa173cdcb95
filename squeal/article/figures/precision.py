"""Work-precision diagrams: error of the final place and of contact times against run time."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.article.results.precision import Point, Precision
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

LOOKS = {
    "squeal": ("#C8380E", "o", "-"),
    "squeal, batch": ("#C8380E", "s", "--"),
    "SciPy DOP853": ("#3498DB", "^", "-"),
    "SciPy RK45": ("#6A1B7B", "v", "-"),
    "SciPy Radau": ("#000000", "D", ":"),
    "SciPy LSODA": ("#7A7A7A", "<", "-."),
    "CVODE Adams": ("#2E7D32", ">", "--"),
    "diffrax Dopri8": ("#B8860B", "p", "--"),
}


COLUMNS = {
    "error": "relative error of the final place",
    "time_error": "error of the contact times, units of time",
}


def _panel(axes: Axes, points: Sequence[Point], error: str, title: str) -> None:
    for path, (colour, marker, line) in LOOKS.items():
        own = [p for p in points if p.path == path and getattr(p, error)]
        if not own:
            continue
        x = [getattr(p, error) for p in own]
        y = [1e3 * p.seconds for p in own]
        axes.plot(x, y, line, color=colour, linewidth=0.7, zorder=1)
        for p, a, b in zip(own, x, y, strict=True):
            whole = p.missed == p.extra == 0
            face = colour if whole else "white"
            axes.plot(a, b, marker, color=colour, mfc=face, ms=3.2, mew=0.7, zorder=2)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.minorticks_off()
    axes.set_title(title)


def precision(points: Sequence[Point]) -> Figure:
    """A row for each case, with the error of the final place and of the contact times."""
    cases = list(dict.fromkeys(p.case for p in points))
    figure = Figure(figsize=(DOUBLE, 1.0 + 1.35 * len(cases)))
    grid = figure.subplots(len(cases), len(COLUMNS), sharex="col", sharey=True, squeeze=False)
    for row, case in zip(grid, cases, strict=True):
        own = [p for p in points if p.case == case]
        for axes, error in zip(row, COLUMNS, strict=True):
            _panel(axes, own, error, case)
            if not any(getattr(p, error) for p in own):
                axes.text(0.5, 0.5, "no contact changes", ha="center", transform=axes.transAxes)
        row[0].set_ylabel("run time [ms]")
    for axes, label in zip(grid[-1], COLUMNS.values(), strict=True):
        axes.invert_xaxis()
        axes.set_xlabel(label)
    present = {p.path for p in points}
    handles: list[Line2D] = []
    for path, (colour, marker, line) in LOOKS.items():
        if path in present:
            looks: Any = {"color": colour, "linestyle": line, "marker": marker, "label": path}
            handles.append(Line2D([], [], markersize=3.2, linewidth=0.7, **looks))
    figure.legend(handles=handles, loc="outside upper center", ncols=4)
    return figure


def alternative(points: Sequence[Point]) -> str:
    """The picture in words."""
    parts = []
    for path in dict.fromkeys(p.path for p in points):
        own = [p for p in points if p.path == path and p.error]
        low, high = (f(1e3 * p.seconds for p in own) for f in (min, max))
        best = min(p.error for p in own if p.error)
        lost = sum(p.missed + p.extra > 0 for p in own)
        parts.append(
            f"{path}: {low:.2g} to {high:.2g} ms, least error {best:.1e}, contact changes missed "
            f"or found in excess in {lost} of {len(own)} runs"
        )
    cases = len({p.case for p in points})
    return f"Work-precision diagrams of {cases} cases. " + "; ".join(parts) + "."


def draw(found: Precision) -> Drawing:
    """The figure, ready to be saved."""
    if not found.points:
        return blank("Work-precision diagrams", found.left_out, __name__, found.provenance)
    with style():
        figure = precision(found.points)
    made = origin(__name__, found.provenance)
    return Drawing(figure, alternative(found.points), "Work-precision diagrams", made)
