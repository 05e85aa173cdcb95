"""Error of the final place against run time, a panel a case, from the study of the same name."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.article.studies.accuracy import Accuracy, Point
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

CAPTION = r"""Run time against relative error of the final place for tolerances from $10^{-4}$ to
$10^{-14}$: our single and batch integration, and SciPy with events on the same compiled equations.
Open marks: contact changes are missed or made up. The contact of the stiff pad is $10^6$ times as
stiff as its supports."""
LOOKS = {
    "squeal": ("#C8380E", "o", "-"),
    "squeal, batch": ("#C8380E", "s", "--"),
    "SciPy DOP853": ("#3498DB", "^", "-"),
    "SciPy Radau": ("#000000", "D", ":"),
    "CVODE Adams": ("#2E7D32", ">", "--"),
    "diffrax Dopri8": ("#B8860B", "p", "--"),
}


def _panel(axes: Axes, points: list[Point]) -> None:
    for path, (colour, marker, line) in LOOKS.items():
        own = [p for p in points if p.path == path and p.error]
        x, y = [p.error or 0.0 for p in own], [1e3 * p.seconds for p in own]
        axes.plot(x, y, line, color=colour, lw=0.8)
        for p, a, b in zip(own, x, y, strict=True):
            face = colour if p.missed == p.extra == 0 else "white"
            axes.plot(a, b, marker, color=colour, mfc=face, ms=4, mew=0.8)
    axes.set(xscale="log", yscale="log", xlabel="relative error")
    axes.minorticks_off()
    axes.invert_xaxis()


def accuracy_figure(record: Accuracy) -> Figure:
    """A panel a case."""
    with style():
        figure = Figure(figsize=(DOUBLE, 2.7))
        grid = figure.subplots(1, len(record.changes), sharey=True, squeeze=False)[0]
        for axes, case, letter in zip(grid, record.changes, "abcdef", strict=False):
            _panel(axes, [p for p in record.points if p.case == case])
            axes.set_title(f"({letter}) {case}", loc="left", pad=3.0)
        grid[0].set_ylabel("run time [ms]")
        handles: list[Line2D] = []
        for path in dict.fromkeys(p.path for p in record.points):
            colour, marker, line = LOOKS[path]
            looks: Any = {"color": colour, "ls": line, "marker": marker, "label": path}
            handles.append(Line2D([], [], ms=4, lw=0.8, **looks))
        figure.legend(handles=handles, loc="outside upper center", ncols=4)
    return figure


def draw(record: Accuracy) -> Drawing:
    """The figure, ready to be saved."""
    name = "Error against run time"
    if not record.points:
        return blank(name, record.left_out, __name__, record.provenance)
    parts = []
    for path in dict.fromkeys(p.path for p in record.points):
        own = [p for p in record.points if p.path == path and p.error]
        times = [1e3 * p.seconds for p in own]
        best = min(p.error for p in own if p.error)
        parts.append(f"{path} {min(times):.2g} to {max(times):.2g} ms, least error {best:.1e}")
    text = f"Run time over the error of the final place in {len(record.changes)} cases. "
    made = origin(__name__, record.provenance)
    return Drawing(accuracy_figure(record), f"{text}{'; '.join(parts)}.", name, made)
