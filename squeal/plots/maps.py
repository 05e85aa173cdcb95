"""Maps of verdicts over two parameters."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from squeal.analysis.maps import BEYOND_FOLD, NAMES, StabilityMap
from squeal.analysis.threshold_curve import ThresholdCurve
from squeal.plots.areas import VERDICT_COLOURS, draw
from squeal.plots.parameters import draw_thresholds, settle, unit_of
from squeal.plots.style import SINGLE, Drawing, origin, save, style


def stability_figure(
    found: StabilityMap,
    own: tuple[float, float] | None = None,
    curves: Sequence[ThresholdCurve] = (),
) -> Figure:
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
        far = hatch(axes, found)
        handles: list[Any] = [
            Patch(facecolor=VERDICT_COLOURS[i], edgecolor="k", linewidth=0.5) for i in met
        ]
        names = [f"{NAMES[i]} ({100 * found.share[NAMES[i]]:.1f} %)" for i in met]
        if far is not None:
            handles.append(far)
            names.append("not admissible")
        for line in draw_thresholds(axes, found.axes, curves):
            handles.append(line)
            names.append(str(line.get_label()))
        figure.legend(handles, names, loc="outside upper center", ncols=2)
    return figure


def hatch(axes: Axes, found: StabilityMap) -> Patch | None:
    """Hatch the points whose equilibrium is not admissible; what stands for it in a legend."""
    far = ~found.admissible & (found.codes != BEYOND_FOLD)
    if not far.any():
        return None
    x, y = (axis.values / unit_of(axis) for axis in found.axes)
    values = far.T.astype(float)
    axes.contourf(x, y, values, [0.5, 1.5], hatches=["////"], colors="none", zorder=1.5)
    return Patch(facecolor="none", edgecolor="k", hatch="////", linewidth=0.5)


def draw_stability_map(
    found: StabilityMap,
    path: Path,
    own: tuple[float, float] | None = None,
    curves: Sequence[ThresholdCurve] = (),
) -> None:
    """Save a map of verdicts as PDF, SVG or PNG."""
    shares = ", ".join(f"{name} {100 * share:.1f} %" for name, share in found.share.items())
    title = f"Verdict over {found.axes[0].name} and {found.axes[1].name}"
    text = f"{title}; shares of the area: {shares}."
    made = origin("squeal.plots.maps")
    save(Drawing(stability_figure(found, own, curves), text, title, made), path, text=False)
