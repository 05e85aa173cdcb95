"""Maps as areas of one colour with the curves between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from squeal.numerics.outline import Outline


def draw(axes: Axes, found: Outline, colours: Sequence[str], unit: float = 1.0) -> None:
    """Areas in the colours of their codes and the curves between them, coordinates over `unit`."""
    for k in np.unique(found.codes):
        own = found.polygons[found.codes == k] / unit
        # a stroke of its own colour hides the hairlines that viewers leave between polygons
        axes.add_collection(
            PolyCollection(
                list(own), facecolors=colours[k], edgecolors=colours[k], linewidths=0.4, zorder=1
            )
        )
    lines = [curve / unit for curve, _ in found.curves]
    axes.add_collection(
        LineCollection(lines, colors="black", linewidths=0.6, capstyle="round", zorder=2)
    )
