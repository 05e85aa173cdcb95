"""Maps of verdicts over two parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from squeal.analysis.maps import NAMES, StabilityMap
from squeal.plots.areas import VERDICT_COLOURS, angle_axes_of_pi, draw
from squeal.plots.style import SINGLE, Drawing, origin, save, style


def stability_figure(found: StabilityMap) -> Figure:
    """Verdict over two parameters: areas with the traced curves between them.

    Raises ValueError for a map that was not traced.
    """
    if found.outline is None:
        raise ValueError("only a traced map can be drawn")
    first, second = found.axes
    with style():
        figure = Figure(figsize=(SINGLE, 3.6))
        axes = figure.add_subplot()
        angles = {first.name, second.name} <= {"alpha1", "alpha2"}
        unit = np.pi if angles else 1.0
        met = [i for i, name in enumerate(NAMES) if found.share[name] > 0.0]
        draw(axes, found.outline, VERDICT_COLOURS, unit)
        axes.set_xlim(first.low / unit, first.high / unit)
        axes.set_ylim(second.low / unit, second.high / unit)
        if angles:
            angle_axes_of_pi(axes)
        axes.set_xlabel(f"{first.name}" if not angles else r"spring angle $\alpha_1$ [rad]")
        axes.set_ylabel(f"{second.name}" if not angles else r"spring angle $\alpha_2$ [rad]")
        handles = [Patch(facecolor=VERDICT_COLOURS[i], edgecolor="k", linewidth=0.5) for i in met]
        names = [f"{NAMES[i]} ({100 * found.share[NAMES[i]]:.1f} %)" for i in met]
        figure.legend(handles, names, loc="outside upper center", ncols=2)
    return figure


def draw_stability_map(found: StabilityMap, path: Path) -> None:
    """Save a map of verdicts as PDF, SVG or PNG."""
    shares = ", ".join(f"{name} {100 * share:.1f} %" for name, share in found.share.items())
    title = f"Verdict over {found.axes[0].name} and {found.axes[1].name}"
    text = f"{title}; shares of the area: {shares}."
    save(
        Drawing(stability_figure(found), text, title, origin("squeal.plots.maps")), path, text=False
    )
