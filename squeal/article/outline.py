"""Boundaries of a map traced as curves: where between two neighbouring points the code changes.

The place of the change on each edge of the grid is found by bisection, all edges at once, so that
any boundary is traced alike: flutter, divergence, a fold, a change of contact, an inequality.
Marching squares then connect the places.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from squeal.plots.maps import QUARTERS

Codes = Callable[[np.ndarray], np.ndarray]
"""Codes (n,) at points (2, n)."""


@dataclass(frozen=True, eq=False)
class Outline:
    """Areas of equal code between low and high of two axes, and the curves between them.

    segments (n, 2, 2): line pieces from point to point, between the two codes in sides (n, 2);
    polygons (m, 4, 2) with their codes (m,) cover the area. Points are (first, second) parameter.
    """

    segments: np.ndarray
    sides: np.ndarray
    polygons: np.ndarray
    codes: np.ndarray

    @property
    def curves(self) -> list[tuple[np.ndarray, tuple[int, int]]]:
        """Segments joined: points (n, 2) of each curve and the codes on its two sides."""
        ways: dict[tuple[int, ...], dict[Any, list[Any]]] = defaultdict(lambda: defaultdict(list))
        for (a, b), sides in zip(self.segments.tolist(), np.sort(self.sides).tolist(), strict=True):
            for start, end in ((tuple(a), tuple(b)), (tuple(b), tuple(a))):
                ways[tuple(sides)][start].append(end)
        curves = []
        for (low, high), way in ways.items():
            ends = [point for point, next_ones in way.items() if len(next_ones) != 2]
            for start in [*ends, *way]:  # closed curves are what is left after the open ones
                line = [start]
                while way[line[-1]]:
                    here = line[-1]
                    line.append(way[here].pop())
                    way[line[-1]].remove(here)
                if len(line) > 1:
                    curves.append((np.array(line), (low, high)))
        return curves

    def to_dict(self) -> dict[str, Any]:
        """The outline as plain lists for a result file, lengths to 1e-7."""
        return {
            "segments": np.round(self.segments, 7).tolist(),
            "sides": self.sides.tolist(),
            "polygons": np.round(self.polygons, 7).tolist(),
            "codes": self.codes.tolist(),
        }

    @staticmethod
    def from_dict(plain: dict[str, Any]) -> Outline:
        """An outline from what `to_dict` gave."""
        segments, polygons = (np.array(plain[key], dtype=float) for key in ("segments", "polygons"))
        sides, codes = (np.array(plain[key], dtype=int) for key in ("sides", "codes"))
        shapes = segments.reshape(-1, 2, 2), sides.reshape(-1, 2), polygons.reshape(-1, 4, 2)
        return Outline(*shapes, codes)

    def regrouped(self, group_of: np.ndarray) -> Outline:
        """The outline of group_of[code] in place of the code."""
        sides = group_of[self.sides]
        between = sides[:, 0] != sides[:, 1]
        return Outline(self.segments[between], sides[between], self.polygons, group_of[self.codes])

    @property
    def area(self) -> dict[int, float]:
        """Area of each code that occurs."""
        x, y = np.moveaxis(self.polygons, -1, 0)
        ahead = np.roll(x, -1, axis=1) * y - x * np.roll(y, -1, axis=1)
        areas = np.abs(ahead.sum(axis=1)) / 2
        return {int(c): float(areas[self.codes == c].sum()) for c in np.unique(self.codes)}


def _shares(
    x: np.ndarray, y: np.ndarray, codes: np.ndarray, at: Codes | None
) -> tuple[np.ndarray, np.ndarray]:
    """Where the code changes on the edges of a grid along x (n1 - 1, n2) and y (n1, n2 - 1), as a
    share of the edge; one half elsewhere, and everywhere without `at`."""
    along_x = np.full((len(x) - 1, len(y)), 0.5)
    along_y = np.full((len(x), len(y) - 1), 0.5)
    if at is None:
        return along_x, along_y
    ix, jx = np.nonzero(codes[1:] != codes[:-1])
    iy, jy = np.nonzero(codes[:, 1:] != codes[:, :-1])
    first = np.concatenate([codes[ix, jx], codes[iy, jy]])
    start = np.array([np.concatenate([x[ix], x[iy]]), np.concatenate([y[jx], y[jy]])])
    step = np.zeros_like(start)
    step[0, : len(ix)] = x[ix + 1] - x[ix]
    step[1, len(ix) :] = y[jy + 1] - y[jy]
    low = np.zeros(len(first))
    width = 1.0
    for _ in range(20 if len(first) else 0):  # places to a millionth of an edge
        width /= 2
        low = low + width * (at(start + (low + width) * step) == first)
    share = low + width / 2
    along_x[ix, jx] = share[: len(ix)]
    along_y[iy, jy] = share[len(ix) :]
    return along_x, along_y


def outline(
    ends: tuple[tuple[float, float], tuple[float, float]],
    x: np.ndarray,
    y: np.ndarray,
    codes: np.ndarray,
    at: Codes | None = None,
) -> Outline:
    """Trace a map with codes (n1, n2) at x (n1,), y (n2,); `ends` are (low, high) of both axes.

    Features smaller than the grid are not seen; corners are cut within one square of it.
    """
    along_x, along_y = (np.pad(v, 1, mode="edge") for v in _shares(x, y, codes, at))
    # the outer points stand for the strips between them and the ends
    x, y = (np.concatenate([[e[0]], v, [e[1]]]) for e, v in zip(ends, (x, y), strict=True))
    codes = np.pad(codes, 1, mode="edge")
    # of each square the codes of its corners, counterclockwise from the lower left one
    four = np.array([codes[:-1, :-1], codes[1:, :-1], codes[1:, 1:], codes[:-1, 1:]])
    mixed = (four != four[0]).any(axis=0)
    runs, run_codes = _runs(x, y, np.where(mixed, -1, four[0]))
    i, j = np.nonzero(mixed)
    at_corner = four[:, i, j]
    left = x[i]
    right = x[i + 1]
    low = y[j]
    high = y[j + 1]
    corners = np.array([[left, low], [right, low], [right, high], [left, high]])
    # on each edge the place of a change, (edge, coordinate, square), from the lower edge on; equal
    # to the last bit in both squares that share the edge, so that their segments join
    places = np.array(
        [
            [left + along_x[i, j] * (right - left), low],
            [right, low + along_y[i + 1, j] * (high - low)],
            [left + along_x[i, j + 1] * (right - left), high],
            [left, low + along_y[i, j] * (high - low)],
        ]
    )
    beside = np.array([at_corner, np.roll(at_corner, -1, axis=0)])
    changes = beside[0] != beside[1]
    centre = (places * changes[:, None]).sum(axis=0) / changes.sum(axis=0)
    pieces = [np.array([corners[k], places[k], centre, places[k - 1]]) for k in range(4)]
    segments = [np.array([places[k], centre])[:, :, changes[k]] for k in range(4)]
    return Outline(
        np.concatenate([np.moveaxis(one, -1, 0) for one in segments]),
        np.concatenate([beside[:, k, changes[k]].T for k in range(4)]),
        np.concatenate([runs, *(np.moveaxis(one, -1, 0) for one in pieces)]),
        np.concatenate([run_codes, at_corner.ravel()]),
    )


def _runs(x: np.ndarray, y: np.ndarray, codes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squares of one code merged along y into rectangles; squares of code -1 are left out."""
    boxes = []
    codes_of = []
    for i, column in enumerate(codes):
        starts = np.concatenate([[0], np.flatnonzero(np.diff(column)) + 1])
        stops = np.append(starts[1:], len(column))
        for a, b in zip(starts, stops, strict=True):
            if column[a] >= 0:
                boxes.append([[x[i], y[a]], [x[i + 1], y[a]], [x[i + 1], y[b]], [x[i], y[b]]])
                codes_of.append(column[a])
    return np.array(boxes).reshape(-1, 4, 2), np.array(codes_of, dtype=int)


def angle_axes_of_pi(axes: Axes) -> None:
    """Axes of the two spring angles, drawn over pi."""
    axes.set_xticks(*QUARTERS)
    axes.set_yticks(*QUARTERS)
    axes.set(aspect="equal", xlim=(0.0, 1.0), ylim=(0.0, 1.0))
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


def draw_areas(axes: Axes, areas: Outline, colours: Sequence[str], unit: Any = 1.0) -> None:
    """Areas in the colours of their codes and the curves between them, coordinates over `unit`.

    unit: a number, or one for each axis.
    """
    unit = np.asarray(unit)
    for k in np.unique(areas.codes):
        boxes = areas.polygons[areas.codes == k] / unit
        closed = np.concatenate([boxes, boxes[:, :1]], axis=1)
        ways = [Path.MOVETO, *[Path.LINETO] * (boxes.shape[1] - 1), Path.CLOSEPOLY]
        # one path, which is drawn faster than many; a stroke of its own colour hides the hairlines
        # that viewers leave between polygons
        area = Path(closed.reshape(-1, 2), np.tile(ways, len(boxes)))
        patch = PathPatch(area, color=colours[k], lw=0.4, joinstyle="round", zorder=1)
        axes.add_artist(patch)  # add_patch would look for the limits of each line
        axes.update_datalim(area.vertices)
    lines = [curve / unit for curve, _ in areas.curves]
    look: Any = {"colors": "black", "linewidths": 0.6, "capstyle": "round"}
    axes.add_collection(LineCollection(lines, zorder=2, **look))
