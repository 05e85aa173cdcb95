"""Contour maps of a number over two parameters, to read values from."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from squeal.analysis.fields import QUANTITIES, Field
from squeal.analysis.threshold_curve import ThresholdCurve
from squeal.plots.parameters import draw_thresholds, settle, unit_of
from squeal.plots.style import SINGLE, Drawing, origin, save, style

LEVELS = 9
OWN_LEVEL = "#C8380E"  # the curve on which the critical friction is the scene's


def contour_figure(
    found: Field,
    own: tuple[float, float] | None = None,
    level: float | None = None,
    curves: Sequence[ThresholdCurve] = (),
) -> Figure:
    """Labelled contours over filled ones; grey where there is no value.

    own: the scene's place, which is marked; level: a value whose curve is drawn thick.
    """
    first, second = found.axes
    x, y = first.values / unit_of(first), second.values / unit_of(second)
    values = np.ma.masked_invalid(found.values.T)
    with style():
        figure = Figure(figsize=(SINGLE, 3.2))
        axes = figure.add_subplot(facecolor="0.85")
        if values.count() and np.ptp(values.compressed()) > 0.0:
            filled = axes.contourf(x, y, values, LEVELS, cmap="viridis", alpha=0.85)
            edges = axes.contour(x, y, values, filled.levels, colors="k", linewidths=0.5)
            axes.clabel(edges, fontsize=7, fmt="%g")
            words, unit = QUANTITIES[found.quantity]
            figure.colorbar(filled, ax=axes, label=words if unit == "1" else f"{words} [{unit}]")
            if level is not None and values.min() < level < values.max():
                axes.contour(x, y, values, [level], colors=OWN_LEVEL, linewidths=1.6)
        lines = draw_thresholds(axes, found.axes, curves)
        if lines:
            figure.legend(handles=lines, loc="outside upper center")
        settle(axes, found.axes, own)
    return figure


def draw_contours(
    found: Field,
    path: Path,
    own: tuple[float, float] | None = None,
    level: float | None = None,
    curves: Sequence[ThresholdCurve] = (),
) -> None:
    """Save a contour map as PDF, SVG or PNG."""
    words, unit = QUANTITIES[found.quantity]
    title = f"{words} over {found.axes[0].name} and {found.axes[1].name}"
    known = found.values[np.isfinite(found.values)]
    span = f"from {known.min():.4g} to {known.max():.4g} {unit}" if known.size else "nowhere"
    share = 100 * known.size / found.values.size
    text = f"Contour map of the {title}: {span}, on {share:.1f} % of the area."
    figure = contour_figure(found, own, level, curves)
    made = origin("squeal.plots.contours")
    save(Drawing(figure, text, title.capitalize(), made), path, text=False)
