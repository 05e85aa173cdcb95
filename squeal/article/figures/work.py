"""Error of the final place against work, a panel per case, from the study `accuracy`."""

import math
from collections.abc import Callable, Sequence
from string import ascii_lowercase
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from squeal.article.studies.accuracy import Accuracy, Point
from squeal.plots.style import DOUBLE, Drawing, blank, origin, style

CAPTIONS = {
    "work": r"""Error against work: relative error of the final place over evaluations of the
right-hand side, which no machine changes. (a) Motion of case (d) of the line in full contact;
(b), (c) hammering of the points and of the line in case (c); (d) points
\val[n]{accuracy.stiff} times as stiff as a support, over one support period. A Taylor step of order
$p$ counts as $p$ evaluations. The SciPy methods locate contact changes by SciPy's events; the fixed
step switches at the end of a step. Open marks: contact changes are missed or made up.""",
    "run_times": r"""Error against run time on the machine that the picture names: (a) to (d) as in
the figure with the evaluations, of the batch the time of one motion of 256 side by side; (e) the
greatest relative error of an eigenvalue of case (c) of the line, the equilibrium and the bounds of
rounding included with squeal, from given matrices with the others; (f) that of its critical
friction, by the query and by bisection of the growth, with an equilibrium each time, all against 50
digits. This figure alone differs from build to build.""",
}
LOOKS = {
    "squeal": ("#C8380E", "o", "-"),
    "squeal, batch": ("#C8380E", "s", "--"),
    "SciPy DOP853": ("#3498DB", "^", "-"),
    "SciPy RK45": ("#3498DB", "v", "--"),
    "SciPy LSODA": ("#6A1B7B", "P", "-."),
    "SciPy Radau": ("#000000", "D", ":"),
    "RK4, fixed step": ("#000000", "X", "-"),
    "CVODE Adams": ("#2E7D32", ">", "--"),
    "diffrax Dopri8": ("#B8860B", "p", "--"),
}
"""Colour, mark and line of an integrator."""

Abscissa = Callable[[Point], float]
"""What is drawn to the right of a run: its evaluations, or its run time."""


def panel(axes: Axes, points: Sequence[Point], abscissa: Abscissa) -> None:
    """Draw the errors of the runs of one case, a curve for each integrator.

    Runs whose error is not finite (None) or 0 have no place on the logarithmic axis. A mark is open
    where the run misses contact changes of the reference or makes some up.
    """
    for path, (colour, marker, line) in LOOKS.items():
        runs = [p for p in points if p.path == path and p.error]
        x = [abscissa(p) for p in runs]
        y = [p.error or 0.0 for p in runs]
        axes.plot(x, y, line, color=colour, lw=0.8)
        for i, p in enumerate(runs):
            fill = colour if p.missed == p.extra == 0 else "white"
            axes.plot(x[i], y[i], marker, color=colour, mfc=fill, ms=4, mew=0.7)
    axes.set(xscale="log", yscale="log", ylim=(1e-16, 1.0))
    axes.set_yticks([10.0**n for n in range(-16, 1, 4)])
    axes.minorticks_off()


def panels(
    record: Accuracy, abscissa: Abscissa, label: str, rows: int, height: float
) -> tuple[Figure, list[Axes]]:
    """A figure with a panel per case, row by row, and the axes of the grid that stay empty.

    label: name of the abscissa; rows, height: number of rows of panels, and height of the figure in
    inches. A row has half as many panels as there are cases: two rows are enough, and one raises
    ValueError.
    """
    figure = Figure(figsize=(DOUBLE, height))
    columns = math.ceil(len(record.changes) / 2)
    grid = figure.subplots(rows, columns, squeeze=False)
    panels_in_order = list(grid.ravel())
    count = len(record.changes)
    used = zip(panels_in_order[:count], record.changes, ascii_lowercase[:count], strict=True)
    for axes, case, letter in used:
        panel(axes, [p for p in record.points if p.case == case], abscissa)
        axes.set_xlabel(label)
        axes.set_title(f"({letter}) {case}", loc="left", pad=3.0)
    for row in grid:
        row[0].set_ylabel("relative error")
    handles: list[Line2D] = []
    for path in dict.fromkeys(p.path for p in record.points):
        colour, marker, line = LOOKS[path]
        looks: Any = {"color": colour, "ls": line, "marker": marker, "label": path}
        handles.append(Line2D([], [], ms=4, lw=0.8, **looks))
    figure.legend(handles=handles, loc="outside upper center", ncols=4)
    return figure, panels_in_order[count:]


def draw(record: Accuracy) -> Drawing:
    """The figure over evaluations, ready to be saved."""
    name = "Error against evaluations of the right-hand side"
    if not record.points:
        return blank(name, record.left_out, __name__, record.provenance)
    parts = []
    for case in record.changes:
        # by integrator the fewest evaluations with which the error is small enough
        least = {path: record.least(case, path) for path in LOOKS}
        reached = [f"{path} {count}" for path, count in least.items() if count is not None]
        parts.append(f"{case}: {', '.join(reached)}")
    text = (
        f"Error of the final place over evaluations in {len(record.changes)} cases. Evaluations "
        f"for an error of at most {record.aim:g}: {'; '.join(parts)}."
    )
    with style():
        figure, _ = panels(record, lambda p: float(p.evaluations), "evaluations", 2, 4.6)
        for axes in figure.axes:
            axes.set(xlim=(4e2, 1.2e5), xticks=[1e3, 1e4, 1e5])
            axes.minorticks_off()
    return Drawing(figure, text, name, origin(__name__, record.provenance))
