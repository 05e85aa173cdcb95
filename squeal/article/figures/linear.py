"""Error against run time of a map and of a threshold by eigenvalue programs, two panels."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from squeal.article.results.precision import Precision, Timing
from squeal.plots.style import DOUBLE, Drawing, origin, style

LOOKS = {
    "squeal": ("#C8380E", "o", "-"),
    "numpy.linalg.eigvals": ("#3498DB", "^", "--"),
    "control.ss().poles()": ("#6A1B7B", "v", ":"),
}
PANELS = {
    "map": ("(a) map of B3", "greatest error of a share of the area"),
    "threshold": ("(b) threshold of flutter", r"error of the critical $\mu$"),
}
LEAST = 1e-16  # errors below are drawn here


def linear(timings: Sequence[Timing]) -> Figure:
    """Map and threshold."""
    figure = Figure(figsize=(DOUBLE, 2.3))
    grid = figure.subplots(1, len(PANELS))
    for axes, (task, (title, label)) in zip(grid, PANELS.items(), strict=True):
        for name, (colour, marker, line) in LOOKS.items():
            own = [t for t in timings if (t.task, t.program) == (task, name)]
            x, y = [max(t.error, LEAST) for t in own], [1e3 * t.seconds for t in own]
            axes.plot(x, y, line, marker=marker, ms=3.2, linewidth=0.7, color=colour, label=name)
        axes.set(xscale="log", yscale="log", title=title, xlabel=label, ylabel="run time [ms]")
        axes.invert_xaxis()
        axes.minorticks_off()
    figure.legend(*grid[1].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def alternative(timings: Sequence[Timing]) -> str:
    """The picture in words."""
    parts = []
    for task in PANELS:
        for name in LOOKS:
            own = [t for t in timings if (t.task, t.program) == (task, name)]
            if own:
                least = min(own, key=lambda t: t.error)
                parts.append(
                    f"{task} by {name}: least error {least.error:.1e} in "
                    f"{1e3 * least.seconds:.2g} ms"
                )
    return "Error against run time of eigenvalue programs. " + "; ".join(parts) + "."


def draw(found: Precision) -> Drawing:
    """The figure, ready to be saved."""
    with style():
        figure = linear(found.linear)
    title = "Error against run time of eigenvalue programs"
    return Drawing(figure, alternative(found.linear), title, origin(__name__, found.provenance))
