"""Direction of a whirl: forward is the sense in which the shaft turns.

In coordinates x, y across a shaft that turns from x to y with Omega, a disc gives the term
S = J Omega [[0, 1], [-1, 0]] in C. Of a shape q with Im lambda > 0, q^H (i S) q = 2 J Omega
Im(q_x conj(q_y)) is then the area that the orbit encloses, positive if forward: the gyroscopic
term alone raises the frequency. The eigenvectors of i S divide every shape into a forward and a
backward part, whatever its coordinates. How the frequency moves as a whole says nothing of a
direction: bearings stiffen with speed.

The term sees what discs do. Where the rows of nodes are known, their orbits tell more: the two
bearings may whirl against each other. Which way the shaft turns is told by the term too, if it
couples the two directions across the shaft; if it couples tilts alone, it decides.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.io.coordinates import NO_DIRECTION, Coordinates
from squeal.io.system import SystemFile
from squeal.linear.matrices import components, dense, reaches
from squeal.linear.shaft import turning_parts
from squeal.linear.system import TermSystem

FORWARD = "forward"
BACKWARD = "backward"
MIXED = "mixed"
STRAIGHT = "straight"
"""The direction of a shape: mixed where some parts whirl forward and others backward, straight
where each moves to and fro."""
UNSEEN = 1e-9  # of the energy of a shape: rows or terms with less do not decide its direction
ROUND = 0.1  # of the area of a circle: an orbit of less, 20 times as long as wide, is straight
STILL = 1e-6  # of the largest squared motion: the orbit of a node that moves less is not counted
OPPOSED = 0.5  # of the sum of |net| over the discs: where |their sum| is less, some whirl backward
LINE = 3.0  # the largest extent of the nodes over the second: from here on they lie along a shaft
TRANSVERSE = ((1, 2), (2, 0), (0, 1))
"""The directions across a shaft along x, y and z, which turns from the first to the second."""


def whirl_direction(
    file: SystemFile,
    system: TermSystem,
    speed: float,
    root: complex,
    shape: NDArray,
    basis: NDArray | None,
) -> str | None:
    """The direction of a whirl of a rotor at a speed: forward, backward, mixed where its parts
    differ, or straight where no orbit is round; None where nothing tells.

    The orbits of nodes tell it where it is known which node and direction each row belongs to.
    Without them, or where no node moves, the skew (gyroscopic or rotating damping) term that
    is proportional to the speed tells it.

    Parameters
    ----------
    file : SystemFile
        The rotor, with the node and direction of each row where they are known.
    system : TermSystem
        The rotor, or what it is reduced to; its free parameter is the speed.
    speed : float
        The speed of the shaft, rad/s.
    root : complex
        The root, Im > 0, rad/s.
    shape : array (n,)
        Its shape in the rows of `system`.
    basis : array (rows, n) or None
        What gives the rows of the rotor from those of `system`; None: they are the same.
    """
    of_orbits = None
    coordinates = coordinates_of(file)
    if coordinates is not None:
        rows = shape if basis is None else basis @ shape
        orbits = _by_orbits(coordinates, file.system, speed, rows)
        # orbits are mixed or straight whichever way the shaft turns. They are forward or backward
        # if a term has told which way it turns (the sense is not 0)
        is_known = orbits.direction is not None and orbits.sense != 0
        if is_known or orbits.direction in (MIXED, STRAIGHT):
            return orbits.direction
        of_orbits = orbits.direction  # the way was assumed: a term that sees the shape decides
    return _by_term(system, speed, root, shape, of_orbits)


def _by_term(
    system: TermSystem, speed: float, root: complex, shape: NDArray, of_orbits: str | None
) -> str | None:
    """The direction of a shape by the first term that turns with the shaft and sees the shape.

    A term sees the shape if more than `UNSEEN` of the shape's energy is in the term, summed over
    all discs. speed: of the shaft, rad/s; root: lambda, rad/s; shape (n,): its right vector;
    of_orbits: the direction by the orbits of the nodes, None if it is not known. It is returned
    where no term sees the shape, and in place of mixed and straight.
    """
    M, _, K = system.arrays({system.parameter: speed})
    # the larger one of twice the kinetic and twice the potential energy
    inertia = abs(root) ** 2 * abs(np.vdot(shape, M @ shape))
    energy = max(inertia, abs(np.vdot(shape, K @ shape)))
    for turning in turning_parts(system, speed):
        matrix = dense(turning.matrix)
        net = 0.0  # forward parts of the shape less backward ones
        net_sizes = 0.0  # the sum of |net| of each disc alone, which the term couples to no other
        total = 0.0  # forward and backward parts together
        # the rows of each disc, which the term couples; coupling is mutual in a skew matrix
        for rows in components(reaches(matrix != 0.0)):
            # eigenvalues of i S, see the module: above 0 of forward parts, below 0 of backward ones
            values, vectors = np.linalg.eigh(1j * matrix[np.ix_(rows, rows)])
            parts = values * np.abs(vectors.conj().T @ shape[rows]) ** 2
            net += parts.sum()
            net_sizes += abs(parts.sum())
            total += np.abs(parts).sum()
        # times |lambda| to the power 1 for a term of C, 0 for one of K, the total is an energy
        does_not_see_shape = abs(root) ** turning.power * total <= UNSEEN * energy
        if does_not_see_shape:
            continue
        if abs(net) < OPPOSED * net_sizes:  # some discs whirl forward, others backward
            return of_orbits or MIXED
        if abs(net) < ROUND * total:  # each disc moves to and fro
            return of_orbits or STRAIGHT
        return FORWARD if net > 0.0 else BACKWARD
    return of_orbits


class _Orbits(NamedTuple):
    """The direction of orbits, None where it is not known, and the sense in which the shaft turns
    by which forward was told from backward: 1, -1, or 0 where it was assumed, see `_sense`."""

    direction: str | None
    sense: float = 0.0


def _by_orbits(
    coordinates: Coordinates, system: TermSystem, speed: float, shape: NDArray
) -> _Orbits:
    """The direction of the orbits of the nodes; None where it is not known which directions are
    across the shaft, and where no node moves, as of discs that only tilt.

    The shaft turns from the first of these directions to the second, unless the term that turns
    with it, between the two at the same node, has the other sign.

    speed: rad/s; shape (n,): complex displacements of the rows.
    """
    across = _across(coordinates)
    if across is None:
        return _Orbits(None)
    u, v = coordinates.displacements(shape)[:, across].T
    sizes = np.abs(u) ** 2 + np.abs(v) ** 2
    # areas of the orbits, see the module. A circle from u to v (u = 1, v = -i) has the area 2 as
    # its size, one from v to u (v = i) the area -2, a straight line 0
    areas = 2 * (u * v.conj()).imag
    sense = 0.0  # unknown of reduced components, whose rows do not belong to nodes
    if not coordinates.bases:
        masses = np.abs(system.at({system.parameter: speed})[0].diagonal())
        energies = masses * np.abs(shape) ** 2
        translates = np.isin(coordinates.directions, across)
        if energies[translates].sum() <= UNSEEN * energies.sum():
            return _Orbits(None)
        sense = _sense(coordinates, across, system, speed)
    areas = areas * (sense or 1.0)  # where it is not known the sense of the directions is assumed
    moves = sizes > STILL * sizes.max()
    is_round = moves & (np.abs(areas) > ROUND * sizes)
    forward = bool(np.any(areas[is_round] > 0.0))
    backward = bool(np.any(areas[is_round] < 0.0))
    direction = STRAIGHT if moves.any() else None
    if forward and backward:
        direction = MIXED
    elif forward:
        direction = FORWARD
    elif backward:
        direction = BACKWARD
    return _Orbits(direction, sense)


def _sense(coordinates: Coordinates, across: list[int], system: TermSystem, speed: float) -> float:
    """1 if the shaft turns from the first of two directions to the second, -1 if the reverse.

    It is the sign of the term that turns with the shaft: the gyroscopic term S (see the module) has
    J Omega > 0 in the row of the first direction and the column of the second if the shaft turns
    from the first to the second. The entries of all nodes are added. If they add to zero, the term
    of K is taken instead of that of C; 0 if neither couples the two directions.

    across: the two directions, 0 to 2 for x, y and z; speed: rad/s.
    """
    row_at = {}  # by direction, the row of each node that moves in it
    for direction in across:
        rows = np.flatnonzero(coordinates.directions == direction)
        row_at[direction] = dict(zip(coordinates.nodes[rows].tolist(), rows.tolist(), strict=True))
    first, second = (row_at[direction] for direction in across)
    nodes = sorted(first.keys() & second.keys())
    # rows and columns of the entries that couple the two directions of a node
    entries = [first[node] for node in nodes], [second[node] for node in nodes]
    for turning in turning_parts(system, speed):
        sense = float(np.sign(turning.matrix[entries].sum()))
        if sense:
            return sense
    return 0.0


def _across(coordinates: Coordinates) -> list[int] | None:
    """The two directions across the shaft on which the nodes lie, None if unknown.

    They are the only two in which nodes move, or those across the line of the nodes.
    """
    moving = sorted({*coordinates.directions.tolist()} & {0, 1, 2})
    for pair in TRANSVERSE:
        if sorted(pair) == moving:
            return list(pair)
    extents = np.ptp(coordinates.places[np.unique(coordinates.nodes)], axis=0)  # along x, y and z
    _, second, largest = np.sort(extents)
    if len(moving) < 3 or not largest > LINE * second:
        return None
    return list(TRANSVERSE[int(np.argmax(extents))])


def coordinates_of(file: SystemFile) -> Coordinates | None:
    """The node and the direction of each row, from the coordinates of a file or from labels.

    A label is (node, degree of freedom), with 1 to 3 for displacements; the nodes have no places
    then, but zeros. None if some row has no such label.
    """
    if file.coordinates is not None:
        return file.coordinates
    labels = file.system.labels
    if len(labels) != file.system.n:
        return None
    nodes: dict[object, int] = {}
    node_of_row = []
    directions = []
    for label in labels:
        if not (isinstance(label, tuple) and len(label) == 2):
            return None
        node, freedom = label
        node_of_row.append(nodes.setdefault(node, len(nodes)))
        directions.append(freedom - 1 if freedom in (1, 2, 3) else NO_DIRECTION)
    places = np.zeros((len(nodes), 3))
    return Coordinates(np.array(node_of_row), np.array(directions), places)
