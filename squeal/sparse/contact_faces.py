"""Contact between meshes that do not match: points of one surface on the faces of the other.

Each face of the second component is integrated at its own points, and each point is projected
along its normal onto the faces of the first. Displacements on both sides are interpolated by the
shape functions of the faces (Zienkiewicz, Taylor & Zhu, The Finite Element Method, ch. 6).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import InputError

if TYPE_CHECKING:
    from squeal.sparse.components import Component

Array: TypeAlias = NDArray[np.float64]
Labels: TypeAlias = NDArray[np.str_]

INSIDE_TOLERANCE = 1e-6  # by which a point may lie beyond a face, of the face's reference length
NEWTON_STEPS = 20  # for the projection of a point; flat faces take one or two
FARTHEST_COORDINATE = 10.0  # reference coordinates beyond which no projection is followed
CONVERGED_CHANGE = 1e-10  # change of reference coordinates at which Newton's method ends


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Points at which two components touch, each a weighted mean of nodes of either side.

    Parameters
    ----------
    first, second : array_like of str (m, a) and (m, b)
        Labels of the nodes of the first and of the second component; "" is none, of weight 0.
    first_weights, second_weights : array_like (m, a) and (m, b)
        The displacement of a point is the sum of weight times displacement over its nodes. On
        either side the weights of a point add up to one, less those of nodes that do not move.
    places : array_like (m, 3), optional
        Where in m the points lie; left out the weighted mean of the places of their nodes.
    """

    first: Labels = field(repr=False)
    second: Labels = field(repr=False)
    first_weights: Array = field(repr=False)
    second_weights: Array = field(repr=False)
    places: Array | None = field(default=None, repr=False)

    @classmethod
    def at_nodes(cls, pairs: Labels) -> ContactPoints:
        """Points (m,) at pairs (m, 2) of single nodes."""
        ones = np.ones((len(pairs), 1))
        return cls(pairs[:, :1], pairs[:, 1:], ones, ones)

    def __len__(self) -> int:
        return len(self.first)

    def side(self, number: int) -> tuple[Labels, Array]:
        """Labels and weights of the first (0) or the second (1) component."""
        if number == 0:
            return self.first, self.first_weights
        return self.second, self.second_weights

    def nodes(self, number: int) -> Labels:
        """Labels of the nodes of one side that have a weight, each once."""
        labels, weights = self.side(number)
        return np.unique(labels[weights != 0.0])

    def name_of(self, point: int) -> str:
        """The nodes of a point, for messages."""
        labels = dict.fromkeys([*self.first[point], *self.second[point]])
        return ", ".join(filter(None, labels))


class FaceContact(NamedTuple):
    """Points of a contact between faces, the area (m,) in m^2 of each, and its unit normal (m, 3)
    from the first component to the second."""

    points: ContactPoints
    area: Array
    normal: Array


class _Shape(NamedTuple):
    """Shape functions of a face at p places, given by their reference coordinates (p, 2)."""

    values: Array  # (p, nodes)
    slopes: Array  # (p, nodes, 2), derivatives by the reference coordinates


def _triangle(coordinates: Array) -> _Shape:
    """Three corners: area coordinates 1 - r - s, r, s."""
    r, s = coordinates.T
    values = np.stack([1.0 - r - s, r, s], axis=1)
    slopes = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    return _Shape(values, np.broadcast_to(slopes, (len(coordinates), 3, 2)))


def _triangle_with_middles(coordinates: Array) -> _Shape:
    """Six nodes: L (2 L - 1) at the corners and 4 L_i L_j in the middles of the edges, of the area
    coordinates L."""
    corners = _triangle(coordinates)  # whose three values are L
    values = []
    slopes = []
    for i in range(3):
        L = corners.values[:, i]
        values.append(L * (2.0 * L - 1.0))
        slopes.append((4.0 * L - 1.0)[:, None] * corners.slopes[:, i])
    for i, j in ((0, 1), (1, 2), (2, 0)):
        L_i = corners.values[:, i]
        L_j = corners.values[:, j]
        values.append(4.0 * L_i * L_j)
        slope = L_i[:, None] * corners.slopes[:, j] + L_j[:, None] * corners.slopes[:, i]
        slopes.append(4.0 * slope)
    return _Shape(np.stack(values, axis=1), np.stack(slopes, axis=1))


_CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
_MIDDLES = ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))
"""Reference coordinates (r_i, s_i) of the nodes of a quadrilateral."""


def _quad(coordinates: Array) -> _Shape:
    """Four corners: (1 + r_i r) (1 + s_i s) / 4."""
    r_i, s_i = np.array(_CORNERS).T
    along_r = 1.0 + r_i * coordinates[:, :1]  # (p, 4)
    along_s = 1.0 + s_i * coordinates[:, 1:]
    slopes = np.stack([r_i * along_s, s_i * along_r], axis=2)
    return _Shape(along_r * along_s / 4.0, slopes / 4.0)


def _quad_with_middles(coordinates: Array) -> _Shape:
    """Eight nodes (serendipity), at the reference coordinates (r, s) of points (g, 2).

    (1 + r_i r) (1 + s_i s) (r_i r + s_i s - 1) / 4 at the corners,
    (1 - r^2) (1 + s_i s) / 2 or (1 + r_i r) (1 - s^2) / 2 in the middles of the edges.
    """
    r, s = coordinates.T
    values = []
    slopes = []
    for r_i, s_i in _CORNERS:
        along_r = 1.0 + r_i * r
        along_s = 1.0 + s_i * s
        diagonal = r_i * r + s_i * s - 1.0
        values.append(along_r * along_s * diagonal / 4.0)
        by_r = r_i * along_s * (diagonal + along_r)
        by_s = s_i * along_r * (diagonal + along_s)
        slopes.append(np.stack([by_r, by_s], axis=1) / 4.0)
    for r_i, s_i in _MIDDLES:
        if r_i == 0.0:
            along_s = 1.0 + s_i * s
            values.append((1.0 - r**2) * along_s / 2.0)
            slopes.append(np.stack([-r * along_s, s_i * (1.0 - r**2) / 2.0], axis=1))
        else:
            along_r = 1.0 + r_i * r
            values.append((1.0 - s**2) * along_r / 2.0)
            slopes.append(np.stack([r_i * (1.0 - s**2) / 2.0, -s * along_r], axis=1))
    return _Shape(np.stack(values, axis=1), np.stack(slopes, axis=1))


SHAPES = {3: _triangle, 4: _quad, 6: _triangle_with_middles, 8: _quad_with_middles}


def _triangle_rule() -> tuple[Array, Array]:
    """Points and weights of a triangle: six of degree 4 (Dunavant, Int. J. Numer. Methods Eng. 21,
    1985) in each of the four triangles between its corners and the middles of its edges."""
    inner = (0.445948490915965, 0.223381589678011)
    outer = (0.091576213509771, 0.109951743655322)
    points: list[tuple[float, float]] = []
    weights: list[float] = []
    for a, weight in (inner, outer):
        points += [(a, a), (1.0 - 2.0 * a, a), (a, 1.0 - 2.0 * a)]
        weights += 3 * [weight / 8.0]  # of the area 1/2 of the reference triangle a quarter
    half = np.array(points) / 2.0
    # the three triangles at the corners, and the one between them, which is turned
    parts = [half, half + [0.5, 0.0], half + [0.0, 0.5], 0.5 - half]
    return np.concatenate(parts), np.tile(weights, 4)


def _quad_rule() -> tuple[Array, Array]:
    """Six by six Gauss points and their weights: a face of the second component may lie across
    edges of the first, where the integrand has kinks."""
    along, weights = np.polynomial.legendre.leggauss(6)
    r, s = np.meshgrid(along, along, indexing="ij")
    return np.column_stack([r.ravel(), s.ravel()]), np.outer(weights, weights).ravel()


class _Faces(NamedTuple):
    """Faces of one kind of a surface.

    places (f, k, 3): where the k nodes of each of f faces lie. labels (f, w): of these nodes; w is
    the number of nodes of the largest face of the surface, and the last label fills the row.
    """

    places: Array
    labels: Labels

    @property
    def is_triangle(self) -> bool:
        return self.places.shape[1] in (3, 6)

    def shape(self, coordinates: Array) -> _Shape:
        """The shape functions of the k nodes at reference coordinates (m, 2)."""
        return SHAPES[self.places.shape[1]](coordinates)

    def weights(self, coordinates: Array) -> Array:
        """The weights (m, w) of the labels at reference coordinates (m, 2), 0 of repeated ones."""
        values = self.shape(coordinates).values
        missing = self.labels.shape[1] - values.shape[1]
        return np.pad(values, ((0, 0), (0, missing)))


class Surface(NamedTuple):
    """Faces of a component, and where their nodes lie.

    Parameters
    ----------
    faces : sequence of sequences of str
        The labels of the nodes of each face in order round it, seen from outside: 3 or 4 corners,
        then perhaps the 3 or 4 middles of its edges, the first between the first two corners.
    places : mapping of str to array_like (3,)
        In m, of all of them. A node that is none of the component's does not move.

    Examples
    --------
    >>> places = {"1": (0, 0, 0), "2": (1, 0, 0), "3": (0, 1, 0)}
    >>> Surface([["1", "2", "3"]], places).faces
    [['1', '2', '3']]
    """

    faces: Sequence[Sequence[str]]
    places: Mapping[str, ArrayLike]


def _faces_by_kind(surface: Surface) -> list[_Faces]:
    """The faces of a surface, one entry for each number of nodes. Raises InputError."""
    if not surface.faces:
        raise InputError("faces: there is none")
    sizes = sorted({len(face) for face in surface.faces})
    kinds: list[_Faces] = []
    for size in sizes:
        if size not in SHAPES:
            raise InputError(f"faces: {size} nodes are not allowed; a face has 3, 4, 6 or 8")
        faces = [face for face in surface.faces if len(face) == size]
        places = [[surface.places[node] for node in face] for face in faces]
        labels = np.pad(np.array(faces), ((0, 0), (0, sizes[-1] - size)), mode="edge")
        kinds.append(_Faces(np.array(places, dtype=float), labels))
    return kinds


def _moving(body: Component, labels: Labels, weights: Array) -> Array:
    """The weights (m, k) of nodes (m, k), zero where a node is none of the component's."""
    return np.where(np.isin(labels, body.nodes), weights, 0.0)


class _SurfacePoints(NamedTuple):
    """Integration points of a surface: places (m, 3), outward unit normals (m, 3), areas (m,), and
    labels and weights (m, w) of the nodes of their faces."""

    places: Array
    normals: Array
    areas: Array
    labels: Labels
    weights: Array


def _integration_points(surface: Surface) -> _SurfacePoints:
    """The points of the quadrature of all faces of a surface, kind by kind. Raises InputError."""
    of_kinds = [_points_of_kind(faces) for faces in _faces_by_kind(surface)]
    fields = zip(*of_kinds, strict=True)
    return _SurfacePoints(*map(np.concatenate, fields))


def _points_of_kind(faces: _Faces) -> _SurfacePoints:
    """The points of the quadrature of all faces of one kind, face by face.

    Raises InputError if a face has no area.
    """
    rule_points, rule_weights = _triangle_rule() if faces.is_triangle else _quad_rule()
    values, slopes = faces.shape(rule_points)
    # f faces, g points of the rule, k nodes, t tangents, x coordinates
    places = np.einsum("gk,fkx->fgx", values, faces.places)
    tangents = np.einsum("gkt,fkx->fgtx", slopes, faces.places)
    normals = np.cross(tangents[:, :, 0], tangents[:, :, 1])
    stretch = np.linalg.norm(normals, axis=2)  # area of the face over that of its reference
    if not np.all(stretch > 0.0):
        raise InputError("faces: one has no area")
    return _SurfacePoints(  # m = f g
        places=places.reshape(-1, 3),
        normals=(normals / stretch[:, :, None]).reshape(-1, 3),
        areas=(stretch * rule_weights).ravel(),
        labels=np.repeat(faces.labels, len(rule_points), axis=0),
        weights=np.tile(faces.weights(rule_points), (len(faces.labels), 1)),
    )


def forces_of_pressure(surface: Surface) -> dict[str, Array]:
    """The forces (3,) in N on the nodes of a surface under a pressure of 1 Pa, by their labels.

    Parameters
    ----------
    surface : Surface
        The faces that the pressure pushes inwards.

    Raises
    ------
    InputError
        Without faces, and for faces of another number of nodes or without area.

    Examples
    --------
    A square of 4 m^2, seen from above:

    >>> corners = {"a": (0, 0, 0), "b": (2, 0, 0), "c": (2, 2, 0), "d": (0, 2, 0)}
    >>> forces = forces_of_pressure(Surface([("a", "b", "c", "d")], corners))
    >>> [round(float(force), 12) for force in forces["b"]]
    [0.0, 0.0, -1.0]
    """
    points = _integration_points(surface)
    # the force of a point goes to the nodes of its face by their shape functions: (points, nodes)
    shares = points.areas[:, None] * points.weights
    forces = -shares[:, :, None] * points.normals[:, None, :]  # (points, nodes, 3)
    labels, index = np.unique(points.labels, return_inverse=True)
    sums = np.zeros((len(labels), 3))
    np.add.at(sums, index.ravel(), forces.reshape(-1, 3))
    return dict(zip(labels.tolist(), sums, strict=True))


class _Feet(NamedTuple):
    """Where points (m,) meet the faces of a surface along their normals."""

    distances: Array  # (m,), infinite where a point meets no face
    labels: Labels  # (m, w), nodes of the face
    weights: Array  # (m, w), their shape functions there


def _project(points: _SurfacePoints, kinds: Sequence[_Faces], farthest: float) -> _Feet:
    """Where each point meets the nearest face of a surface along its normal, in either sense.

    `kinds` are the faces of the surface, one entry for each number of nodes. Faces farther away
    than `farthest` (m) do not count. A tree of all points gives those close to each face; if a
    point meets several faces, the nearest one replaces the others.
    """
    from scipy.spatial import KDTree

    labels_of_faces = np.concatenate([faces.labels for faces in kinds])
    distances = np.full(len(points.places), np.inf)
    face_of_point = np.zeros(len(distances), dtype=int)  # 0, with the weights 0, if none is met
    weights = np.zeros((len(distances), labels_of_faces.shape[1]))
    tree = KDTree(points.places)
    faces_before = 0  # faces of the kinds so far
    for faces in kinds:
        centres = faces.places.mean(axis=1)
        # radii of balls that hold all nodes of a face and what lies within `farthest` of them
        radii = np.linalg.norm(faces.places - centres[:, None], axis=2).max(axis=1) + farthest
        for face, close_points in enumerate(tree.query_ball_point(centres, radii)):
            candidates = np.array(close_points, dtype=int)
            if not len(candidates):
                continue
            feet, heights = _feet_on_face(
                faces.places[face], points.places[candidates], points.normals[candidates]
            )
            away = np.abs(heights)
            is_met = _is_inside(feet, faces.is_triangle) & (away <= farthest)
            is_nearer = is_met & (away < distances[candidates])
            nearer = candidates[is_nearer]
            distances[nearer] = away[is_nearer]
            weights[nearer] = faces.weights(feet[is_nearer])
            face_of_point[nearer] = faces_before + face
        faces_before += len(centres)
    return _Feet(distances, labels_of_faces[face_of_point], weights)


def _feet_on_face(nodes: Array, places: Array, normals: Array) -> tuple[Array, Array]:
    """Where lines from places (m, 3) along normals (m, 3) meet a face of nodes (k, 3).

    Returns reference coordinates (r, s) (m, 2), which may lie beyond the face, and heights (m,)
    along the normals. By Newton's method on face(r, s) - height normal - place = 0. NaN where the
    method does not converge in `NEWTON_STEPS` steps, where a line meets the face beyond
    `FARTHEST_COORDINATE`, and where it runs parallel to the face at some step.
    """
    shape = SHAPES[len(nodes)]
    unknowns = np.zeros((len(places), 3))  # r, s and height; a quadrilateral has its middle at 0, 0
    if len(nodes) in (3, 6):  # a triangle has it at 1/3, 1/3
        unknowns[:, :2] = 1.0 / 3.0
    is_lost = np.zeros(len(places), dtype=bool)
    for _ in range(NEWTON_STEPS):
        values, slopes = shape(unknowns[:, :2])
        residuals = values @ nodes - unknowns[:, 2:] * normals - places
        tangents = np.einsum("mkt,kx->mxt", slopes, nodes)
        jacobians = np.concatenate([tangents, -normals[:, :, None]], axis=2)
        is_lost |= np.linalg.det(jacobians) == 0.0  # the line is parallel to the face there
        jacobians[is_lost] = np.eye(3)  # any regular matrix: without a residual nothing moves
        residuals[is_lost] = 0.0
        change = np.linalg.solve(jacobians, residuals[:, :, None])[:, :, 0]
        unknowns = unknowns - change
        unknowns[:, :2] = np.clip(unknowns[:, :2], -FARTHEST_COORDINATE, FARTHEST_COORDINATE)
        is_moving = np.abs(change[:, :2]).max(axis=1) > CONVERGED_CHANGE
        if not is_moving.any():
            break
    unknowns[is_lost | is_moving] = np.nan
    return unknowns[:, :2], unknowns[:, 2]


def _is_inside(coordinates: Array, is_triangle: bool) -> NDArray[np.bool_]:
    """Whether reference coordinates (m, 2) lie on the face; False for NaN."""
    if is_triangle:
        return np.all(coordinates >= -INSIDE_TOLERANCE, axis=1) & (
            coordinates.sum(axis=1) <= 1.0 + INSIDE_TOLERANCE
        )
    return np.all(np.abs(coordinates) <= 1.0 + INSIDE_TOLERANCE, axis=1)


def contact_between_faces(
    first: Component,
    second: Component,
    first_surface: Surface,
    second_surface: Surface,
    distance: float,
) -> FaceContact:
    """The points at which the faces of one component lie on those of another.

    Parameters
    ----------
    first, second : Component
        What the faces belong to.
    first_surface, second_surface : Surface
        Their faces.
    distance : float
        How far in m, along the normal, a point of the second may lie from the first.

    Returns
    -------
    FaceContact
        What `Contact` takes as `pairs`, `area` and `normal`. Points of the second without a face
        of the first are left out.

    Raises
    ------
    InputError
        For faces of another number of nodes or without area, or if no face touches another.

    Examples
    --------
    A triangle that lies within a square of four other nodes: weights and areas follow.

    >>> import numpy as np, squeal
    >>> from squeal.sparse.contact_faces import Surface, contact_between_faces
    >>> def body(name):
    ...     system = squeal.System(np.eye(4), K=np.eye(4), name=name)
    ...     return squeal.Component(system, ["a", "b", "c", "d"], [2, 2, 2, 2])
    >>> corners = {"a": (0, 0, 0), "b": (1, 0, 0), "c": (1, 1, 0), "d": (0, 1, 0)}
    >>> small = {"a": (0, 0, 0), "b": (0.5, 0, 0), "d": (0, 0.5, 0)}
    >>> points, area, normal = contact_between_faces(
    ...     body("square"),
    ...     body("triangle"),
    ...     Surface([("a", "b", "c", "d")], corners),
    ...     Surface([("a", "d", "b")], small),
    ...     distance=1e-3,
    ... )
    >>> float(area.sum().round(12)), float(normal[0, 2])
    (0.125, 1.0)
    """
    points = _integration_points(second_surface)
    feet = _project(points, _faces_by_kind(first_surface), distance)
    is_met = np.isfinite(feet.distances)
    if not is_met.any():
        raise InputError(
            f"faces: none of {second.name} lies within {distance:g} m of {first.name}; a greater "
            "distance is needed"
        )
    first_labels = feet.labels[is_met]
    second_labels = points.labels[is_met]
    contact_points = ContactPoints(
        first=first_labels,
        second=second_labels,
        first_weights=_moving(first, first_labels, feet.weights[is_met]),
        second_weights=_moving(second, second_labels, points.weights[is_met]),
        places=points.places[is_met],
    )
    normal = -points.normals[is_met]  # outwards from the first, into the second
    return FaceContact(contact_points, points.areas[is_met], normal)
