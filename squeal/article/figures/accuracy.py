"""Error of the final place against tolerance, a panel a case, from the study of the same name."""

from collections.abc import Callable
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.article.studies.accuracy import Accuracy, Point
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

CAPTION = r"""Relative error of the final place against tolerance: our single and batch
integration, and SciPy with events on the same compiled equations. Open marks: contact changes are
missed or made up. A path that takes more than 3000 steps is not tried at lower tolerances. The
contact of the stiff pad is $10^6$ times as stiff as its supports."""
LOOKS = {
    "squeal": ("#C8380E", "o", "-"),
    "squeal, batch": ("#C8380E", "s", "--"),
    "SciPy DOP853": ("#3498DB", "^", "-"),
    "SciPy Radau": ("#000000", "D", ":"),
    "CVODE Adams": ("#2E7D32", ">", "--"),
    "diffrax Dopri8": ("#B8860B", "p", "--"),
}


Where = Callable[[Point], tuple[float, float]]


def _over_tolerance(point: Point) -> tuple[float, float]:
    return point.tolerance, point.error or 0.0


def _panel(axes: Axes, points: list[Point], place: Where) -> None:
    for path, (colour, marker, line) in LOOKS.items():
        own = [p for p in points if p.path == path and p.error]
        axes.plot(*zip(*map(place, own), strict=True), line, color=colour, lw=0.8)
        for p in own:
            face = colour if p.missed == p.extra == 0 else "white"
            axes.plot(*place(p), marker, color=colour, mfc=face, ms=4, mew=0.8)
    axes.set(xscale="log", yscale="log")
    axes.minorticks_off()
    axes.invert_xaxis()


def accuracy_figure(
    record: Accuracy,
    place: Where = _over_tolerance,
    labels: tuple[str, str] = ("tolerance", "relative error"),
) -> Figure:
    """A panel a case, with each run at its place."""
    with style():
        figure = Figure(figsize=(DOUBLE, 2.7))
        grid = figure.subplots(1, len(record.changes), sharey=True, squeeze=False)[0]
        for axes, case, letter in zip(grid, record.changes, "abcdef", strict=False):
            _panel(axes, [p for p in record.points if p.case == case], place)
            axes.set_xlabel(labels[0])
            axes.set_title(f"({letter}) {case}", loc="left", pad=3.0)
        grid[0].set_ylabel(labels[1])
        handles: list[Line2D] = []
        for path in dict.fromkeys(p.path for p in record.points):
            colour, marker, line = LOOKS[path]
            looks: Any = {"color": colour, "ls": line, "marker": marker, "label": path}
            handles.append(Line2D([], [], ms=4, lw=0.8, **looks))
        figure.legend(handles=handles, loc="outside upper center", ncols=4)
    return figure


def draw(record: Accuracy) -> Drawing:
    """The figure, ready to be saved."""
    name = "Error against tolerance"
    if not record.points:
        return blank(name, record.left_out, __name__, record.provenance)
    parts = []
    for path in dict.fromkeys(p.path for p in record.points):
        errors = [p.error for p in record.points if p.path == path and p.error]
        parts.append(f"{path} {max(errors):.1e} to {min(errors):.1e}")
    text = f"Error of the final place over the tolerance in {len(record.changes)} cases. "
    made = origin(__name__, record.provenance)
    return Drawing(accuracy_figure(record), f"{text}{'; '.join(parts)}.", name, made)
