"""Maps as areas of one colour with the curves between them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from squeal.numerics.outline import Outline

VERDICT_COLOURS = ("#FFFFFF", "#CFE6F5", "#C8380E", "#6A1B7B", "#8C8C8C")
"""Colours of `squeal.analysis.maps.NAMES`: stable, marginal, flutter, divergence, beyond a fold."""

QUARTERS = [0.0, 0.25, 0.5, 0.75, 1.0]
OF_PI = ["$0$", r"$\pi/4$", r"$\pi/2$", r"$3\pi/4$", r"$\pi$"]


def angle_axes_of_pi(axes: Axes) -> None:
    """Axes of the two spring angles, drawn over pi."""
    axes.set_aspect("equal")
    axes.set_xticks(QUARTERS, OF_PI)
    axes.set_yticks(QUARTERS, OF_PI)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    axes.set_xlabel(r"spring angle $\alpha_1$ [rad]")
    axes.set_ylabel(r"spring angle $\alpha_2$ [rad]")


def mark(
    axes: Axes,
    marks: Mapping[str, tuple[float, float]],
    unit: float = 1.0,
    size: float = 7,
    **ring: Any,
) -> None:
    """Names in rings at their places, coordinates over `unit`; `ring`: how it looks otherwise."""
    box = {"boxstyle": "circle,pad=0.15", "fc": "w", "ec": "k", "lw": 0.6} | ring
    for name, (x, y) in marks.items():
        look: Any = {"ha": "center", "va": "center", "clip_on": False, "zorder": 5}
        axes.text(x / unit, y / unit, name, fontsize=size, bbox=box, **look)


def draw(axes: Axes, found: Outline, colours: Sequence[str], unit: Any = 1.0) -> None:
    """Areas in the colours of their codes and the curves between them, coordinates over `unit`.

    unit: a number, or one for each axis.
    """
    unit = np.asarray(unit)
    for k in np.unique(found.codes):
        own = found.polygons[found.codes == k] / unit
        closed = np.concatenate([own, own[:, :1]], axis=1)
        ways = [Path.MOVETO, *[Path.LINETO] * (own.shape[1] - 1), Path.CLOSEPOLY]
        # one path, which is drawn faster than many; a stroke of its own colour hides the hairlines
        # that viewers leave between polygons
        area = Path(closed.reshape(-1, 2), np.tile(ways, len(own)))
        patch = PathPatch(area, color=colours[k], lw=0.4, joinstyle="round", zorder=1)
        axes.add_artist(patch)  # add_patch would look for the limits of each line
        axes.update_datalim(area.vertices)
    lines = [curve / unit for curve, _ in found.curves]
    axes.add_collection(
        LineCollection(lines, colors="black", linewidths=0.6, capstyle="round", zorder=2)
    )
