"""Maps of verdicts over two parameters."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from squeal.analysis.maps import NAMES, StabilityMap
from squeal.plots.areas import VERDICT_COLOURS, draw
from squeal.plots.parameters import settle, unit_of
from squeal.plots.style import SINGLE, Drawing, origin, save, style


def stability_figure(found: StabilityMap, own: tuple[float, float] | None = None) -> Figure:
    """Verdict over two parameters: areas with the traced curves between them, the pad marked.

    Raises ValueError for a map that was not traced.
    """
    if found.outline is None:
        raise ValueError("only a traced map can be drawn")
    with style():
        figure = Figure(figsize=(SINGLE, 3.6))
        axes = figure.add_subplot()
        met = [i for i, name in enumerate(NAMES) if found.share[name] > 0.0]
        draw(axes, found.outline, VERDICT_COLOURS, tuple(unit_of(a) for a in found.axes))
        settle(axes, found.axes, own)
        handles = [Patch(facecolor=VERDICT_COLOURS[i], edgecolor="k", linewidth=0.5) for i in met]
        names = [f"{NAMES[i]} ({100 * found.share[NAMES[i]]:.1f} %)" for i in met]
        figure.legend(handles, names, loc="outside upper center", ncols=2)
    return figure


def draw_stability_map(
    found: StabilityMap, path: Path, own: tuple[float, float] | None = None
) -> None:
    """Save a map of verdicts as PDF, SVG or PNG."""
    shares = ", ".join(f"{name} {100 * share:.1f} %" for name, share in found.share.items())
    title = f"Verdict over {found.axes[0].name} and {found.axes[1].name}"
    text = f"{title}; shares of the area: {shares}."
    made = origin("squeal.plots.maps")
    save(Drawing(stability_figure(found, own), text, title, made), path, text=False)
