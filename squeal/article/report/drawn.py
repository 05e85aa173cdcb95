"""The data that a figure draws, read back from the figure, as rows for a CSV file."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.figure import Figure

HEAD = ("panel", "x is", "y is", "kind", "curve", "x", "y")
"""Columns: the panel's number, its axes' labels, line, points or area, the curve, its values."""


def _named(artist: Any, order: int) -> str:
    """Name of an artist: what it was given, what the legend says, else its place in the panel."""
    label = str(artist.get_label())
    if artist.get_gid():
        return str(artist.get_gid())
    return str(order) if label.startswith("_") else label


def _shapes(axes: Axes) -> Iterator[tuple[str, Any, list[np.ndarray]]]:
    """Kind, artist and stretches of points (n, 2) of all that is drawn in data coordinates."""
    for line in axes.get_lines():
        if line.get_transform() == axes.transData:
            marked = line.get_linestyle() in ("None", "none", " ", "")
            yield "points" if marked else "line", line, [np.asarray(line.get_xydata())]
    for drawn in axes.collections:
        if isinstance(drawn, PathCollection):
            yield "points", drawn, [np.ma.filled(drawn.get_offsets(), np.nan)]
        elif isinstance(drawn, (LineCollection, PolyCollection)):
            kind = "line" if isinstance(drawn, LineCollection) else "area"
            yield kind, drawn, [np.asarray(path.vertices) for path in drawn.get_paths()]


def rows(figure: Figure) -> Iterator[tuple[Any, ...]]:
    """One row per point, in drawing order; a row without x and y ends a piece of a curve."""
    for panel, axes in enumerate(figure.axes, start=1):
        labels = axes.get_xlabel(), axes.get_ylabel()
        for order, (kind, artist, stretches) in enumerate(_shapes(axes), start=1):
            name = _named(artist, order)
            for i, points in enumerate(stretches):
                if i > 0:
                    yield (panel, *labels, kind, name, None, None)
                for x, y in points.tolist():
                    yield (panel, *labels, kind, name, x, y)
