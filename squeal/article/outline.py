"""Boundaries of a map traced as curves: where between two neighbouring points the code changes.

The place of the change on each edge of the grid is found by bisection, all edges at once, so that
any boundary is traced alike: flutter, divergence, a fold, a change of contact, an inequality.
Marching squares then connect the places.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from squeal.article.cases import CASES
from squeal.plots.maps import QUARTERS

HALVINGS = 20  # of an edge, to a millionth of it
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
        """Segments joined: points (n, 2) of each curve and the codes on its two sides, ascending.

        Segments between the same two codes form a graph; each curve is a walk that uses up its
        segments, from an open end first, the closed curves last.
        """
        # by pair of codes, for each point those that a segment joins to it
        graphs: dict[tuple[int, ...], dict[Any, list[Any]]] = defaultdict(lambda: defaultdict(list))
        for (a, b), sides in zip(self.segments.tolist(), np.sort(self.sides).tolist(), strict=True):
            neighbours = graphs[tuple(sides)]
            neighbours[tuple(a)].append(tuple(b))
            neighbours[tuple(b)].append(tuple(a))
        curves = []
        for (low, high), neighbours in graphs.items():
            ends = [point for point, others in neighbours.items() if len(others) != 2]
            for start in [*ends, *neighbours]:
                point = start
                curve = [start]
                while neighbours[point]:
                    following = neighbours[point].pop()
                    neighbours[following].remove(point)
                    curve.append(following)
                    point = following
                if len(curve) > 1:
                    curves.append((np.array(curve), (low, high)))
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
        return Outline(
            segments=np.array(plain["segments"], dtype=float).reshape(-1, 2, 2),
            sides=np.array(plain["sides"], dtype=int).reshape(-1, 2),
            polygons=np.array(plain["polygons"], dtype=float).reshape(-1, 4, 2),
            codes=np.array(plain["codes"], dtype=int),
        )

    def regrouped(self, group_of: np.ndarray) -> Outline:
        """The outline of group_of[code] in place of the code."""
        sides = group_of[self.sides]
        between = sides[:, 0] != sides[:, 1]
        return Outline(self.segments[between], sides[between], self.polygons, group_of[self.codes])

    @property
    def area(self) -> dict[int, float]:
        """Area of each code that occurs, by the shoelace formula."""
        x, y = np.moveaxis(self.polygons, -1, 0)
        cross = np.roll(x, -1, axis=1) * y - x * np.roll(y, -1, axis=1)
        areas = np.abs(cross.sum(axis=1)) / 2
        return {int(c): float(areas[self.codes == c].sum()) for c in np.unique(self.codes)}


def _shares(
    x: np.ndarray, y: np.ndarray, codes: np.ndarray, codes_at: Codes | None
) -> tuple[np.ndarray, np.ndarray]:
    """Where the code changes on the edges of a grid along x (n1 - 1, n2) and y (n1, n2 - 1), as a
    share of the edge; one half on edges without a change, and on all edges without `codes_at`.

    Bisection locates the changes, on all edges at once. codes (n1, n2): at the points of the grid.
    """
    along_x = np.full((len(x) - 1, len(y)), 0.5)
    along_y = np.full((len(x), len(y) - 1), 0.5)
    # the grid points before a change along x, and along y
    ix, jx = np.nonzero(codes[1:] != codes[:-1])
    iy, jy = np.nonzero(codes[:, 1:] != codes[:, :-1])
    count_x = len(ix)
    if codes_at is None or count_x + len(iy) == 0:
        return along_x, along_y
    i = np.concatenate([ix, iy])
    j = np.concatenate([jx, jy])
    code_before = codes[i, j]
    start = np.array([x[i], y[j]])
    edge = np.zeros_like(start)
    edge[0, :count_x] = x[ix + 1] - x[ix]
    edge[1, count_x:] = y[jy + 1] - y[jy]
    # the change lies on the part of the edge from the share `low` to `low + width`
    low = np.zeros(len(i))
    width = 1.0
    for _ in range(HALVINGS):
        width /= 2
        not_yet_changed = codes_at(start + (low + width) * edge) == code_before
        low += width * not_yet_changed
    share = low + width / 2
    along_x[ix, jx] = share[:count_x]
    along_y[iy, jy] = share[count_x:]
    return along_x, along_y


def outline(
    ends: tuple[tuple[float, float], tuple[float, float]],
    x: np.ndarray,
    y: np.ndarray,
    codes: np.ndarray,
    codes_at: Codes | None = None,
) -> Outline:
    """Trace a map with codes (n1, n2) at x (n1,), y (n2,); `ends` are (low, high) of both axes.

    A square whose corners have one code belongs to that code whole. Any other square is cut. Its
    centre is the mean of the points at which the code changes on its edges. A segment leads from
    the centre to each such point, and each corner owns the piece between its two edges. Features
    smaller than a square of the grid are not seen, and corners of a boundary are cut within one.

    codes_at: the codes at any points, which locate a change on an edge; without it a change counts
    as in the middle of its edge.
    """
    inner_x, inner_y = _shares(x, y, codes, codes_at)
    # between the outermost grid points and the ends the map is as at those points: a point is added
    # at both ends of each axis. `along_x` (n1 + 1, n2 + 2) and `along_y` (n1 + 2, n2 + 1) say where
    # the code changes on each edge, as a share of the edge
    along_x = np.pad(inner_x, 1, mode="edge")
    along_y = np.pad(inner_y, 1, mode="edge")
    padded = np.pad(codes, 1, mode="edge")
    (first_x, last_x), (first_y, last_y) = ends
    xs = np.concatenate([[first_x], x, [last_x]])
    ys = np.concatenate([[first_y], y, [last_y]])
    # (4, n1 + 1, n2 + 1): of each square, counterclockwise from its lower left corner
    corner_codes = np.array([padded[:-1, :-1], padded[1:, :-1], padded[1:, 1:], padded[:-1, 1:]])
    mixed = (corner_codes != corner_codes[0]).any(axis=0)
    boxes, box_codes = _boxes(xs, ys, np.where(mixed, -1, corner_codes[0]))
    i, j = np.nonzero(mixed)
    mixed_codes = corner_codes[:, i, j]
    left = xs[i]
    right = xs[i + 1]
    low = ys[j]
    high = ys[j + 1]
    corners = np.array([[left, low], [right, low], [right, high], [left, high]])
    # on each edge the point of a change, (edge, coordinate, square), from the lower edge on; equal
    # to the last bit in both squares that share the edge, so that their segments join
    changing_points = np.array(
        [
            [left + along_x[i, j] * (right - left), low],
            [right, low + along_y[i + 1, j] * (high - low)],
            [left + along_x[i, j + 1] * (right - left), high],
            [left, low + along_y[i, j] * (high - low)],
        ]
    )
    # (end, edge, square): edge k leads from corner k to the next corner
    end_codes = np.array([mixed_codes, np.roll(mixed_codes, -1, axis=0)])
    changes = end_codes[0] != end_codes[1]  # (edge, square)
    centre = (changing_points * changes[:, None]).sum(axis=0) / changes.sum(axis=0)
    segments = []
    sides = []
    pieces = []
    for k in range(4):
        # segments and pieces as (point, coordinate, square); edges k and k - 1 meet at corner k
        segment = np.array([changing_points[k], centre])[:, :, changes[k]]
        piece = np.array([corners[k], changing_points[k], centre, changing_points[k - 1]])
        segments.append(np.moveaxis(segment, -1, 0))
        sides.append(end_codes[:, k, changes[k]].T)
        pieces.append(np.moveaxis(piece, -1, 0))
    return Outline(
        segments=np.concatenate(segments),
        sides=np.concatenate(sides),
        polygons=np.concatenate([boxes, *pieces]),
        codes=np.concatenate([box_codes, mixed_codes.ravel()]),
    )


def _boxes(x: np.ndarray, y: np.ndarray, codes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Neighbouring squares of one code merged along y into rectangles: the corners (n, 4, 2) and
    the code (n,) of each rectangle. Squares of code -1 are left out.

    codes (n1, n2): of the squares between x (n1 + 1,) and between y (n2 + 1,).
    """
    boxes = []
    codes_of = []
    for i, column in enumerate(codes):
        # indices of the squares at which the code along y changes
        starts = np.concatenate([[0], np.flatnonzero(np.diff(column)) + 1])
        stops = np.append(starts[1:], len(column))
        left = x[i]
        right = x[i + 1]
        for a, b in zip(starts, stops, strict=True):
            if column[a] >= 0:
                boxes.append([[left, y[a]], [right, y[a]], [right, y[b]], [left, y[b]]])
                codes_of.append(column[a])
    return np.array(boxes).reshape(-1, 4, 2), np.array(codes_of, dtype=int)


def angle_axes_of_pi(axes: Axes) -> None:
    """Axes of the two spring angles, drawn over pi."""
    axes.set_xticks(*QUARTERS)
    axes.set_yticks(*QUARTERS)
    axes.set(aspect="equal", xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    axes.set_xlabel(r"spring angle $\alpha_1$ [rad]")
    axes.set_ylabel(r"spring angle $\alpha_2$ [rad]")


def mark_cases(axes: Axes) -> None:
    """The letters of the four cases, in rings at their spring angles, drawn over pi."""
    box = {"boxstyle": "circle,pad=0.15", "fc": "w", "ec": "k", "lw": 0.6}
    look: Any = {"ha": "center", "va": "center", "clip_on": False, "zorder": 5, "fontsize": 8}
    for case, (alpha1, alpha2) in CASES.items():
        axes.text(alpha1 / np.pi, alpha2 / np.pi, case, bbox=box, **look)


def draw_areas(axes: Axes, areas: Outline, colours: Sequence[str]) -> None:
    """Areas in the colours of their codes and the curves between them, of angles drawn over pi.

    All polygons (k, 4, 2) are quadrilaterals, in rad; `colours` has one for each code.
    """
    for code in np.unique(areas.codes):
        polygons = areas.polygons[areas.codes == code] / np.pi
        closed = np.concatenate([polygons, polygons[:, :1]], axis=1)
        # how the pen goes to each point of a polygon
        strokes = [Path.MOVETO, *[Path.LINETO] * (polygons.shape[1] - 1), Path.CLOSEPOLY]
        # one path, which is drawn faster than many; a stroke of its own colour hides the hairlines
        # that viewers leave between polygons
        area = Path(closed.reshape(-1, 2), np.tile(strokes, len(polygons)))
        patch = PathPatch(area, color=colours[code], lw=0.4, joinstyle="round", zorder=1)
        axes.add_artist(patch)  # add_patch would look for the limits of each line
        axes.update_datalim(area.vertices)
    lines = [curve / np.pi for curve, _ in areas.curves]
    collection = LineCollection(lines, colors="black", linewidths=0.6, capstyle="round", zorder=2)
    axes.add_collection(collection)
