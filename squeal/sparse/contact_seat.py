"""Contact between two components: pairs, their directions, and the static contact solution.

Contact acts between nodes of two components, or between points of their faces, so that it changes
without a new reduction. Which pairs touch follows from the brake load: pairs that would pull open,
and carry neither stiffness nor friction.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import ComputationError, InputError
from squeal.linear.matrices import EPS, Matrix, divisor, is_sparse
from squeal.linear.system import System
from squeal.numerics.differentiation import Formula, Parameters
from squeal.schema import ANY, POSITIVE, Number, Place, refuse_unit
from squeal.sparse.components import Component
from squeal.sparse.contact_faces import ContactPoints, Labels
from squeal.sparse.factor import factorise
from squeal.sparse.quadratic import Array, Bools

if TYPE_CHECKING:
    from scipy.sparse import csr_array

ALL_OPEN = "all pairs open under the load; it must press the components together"
LIFTED = (
    "the load lifts or tips a component off its pairs, and nothing else holds it; each needs "
    "supports, or a load that presses it on"
)
UNSETTLED = "the contact is not settled: the search for its closed pairs ends"
MATCHED = 1e-10
"""Share of itself up to which a force must be that of its tangent in the last step."""
TANGENT = 1e-4
"""Share of itself by which a force may change while its tangent stays."""
LEFT = 1e-12
"""Share of the work of load and pairs that the residual may do, each along what it moves."""
LEAST_SPRING = 1e-8
"""Of the stiffness at the reference: springs at open pairs where these leave a motion free."""
LEAST_DIAGONAL = 1e-13
"""Share that is added to the diagonal there, as stiffnesses may be too far apart for doubles."""
RESISTED = 1e-4
"""A motion is free if structure and closed pairs take up less than this share of the work."""
EXPONENT = Number(0.0, 0.99, low_allowed=True)  # at 1 a contact would be infinitely soft


@dataclass(frozen=True, eq=False)
class Contact:
    """Node pairs between two components, and what acts between them.

    A pair is pressed by h, the approach of its nodes along the normal less the gap. Its pressure p
    grows by dp/dh = stiffness (p / reference)^exponent.

    Parameters
    ----------
    between : (str, str)
        Names of the components.
    pairs : array_like (m, 2), float or ContactPoints (m,)
        Labels of a node of the first and of one of the second component; or the distance (m) within
        which each node of the second is paired with the nearest one of the first; or points of
        their faces, as `contact_between_faces` finds them.
    normal : array_like (3,) or (m, 3)
        From the first to the second, of any length above 0.
    stiffness : float or array_like (m,)
        Normal stiffness, N/m^3 of the area; without `area` N/m of a pair.
    area : float or array_like (m,), optional
        m^2 of the whole contact, shared evenly, or of each pair.
    sliding : array_like (3,) or (m, 3), optional
        Along which the first moves past the second; friction pulls the second there.
    axis, through : array_like (3,), optional
        The same as a rotation of the first: axis x (r - through), at each pair.
    tangential : float or array_like (m,)
        Stiffness in the two directions across the normal, as `stiffness`.
    gap : float or array_like (m,)
        What separates the nodes before the load, in m: wear, machined height. Their coordinates do
        not count: at a gap of 0 they touch, wherever they lie.
    exponent, reference : float
        Of the normal stiffness by pressure (Pa; N without `area`); 0, up to 0.99, is a constant
        stiffness, as that of bonded pairs always is.
    bonded : bool
        True for a joint, whose pairs cannot open.
    friction, factor : str
        Formulas of the parameters, or numbers: the coefficient of friction and the factor of the
        normal stiffness. That of the tangential one is the parameter `tangential`.
    speed : str, optional
        Formula of the sliding speed v in m/s; about `axis` of the rotation in rad/s, and v is that
        times the distance of the pair from the axis. Friction follows the direction in which a pair
        slides, which motion across the sliding turns: a pair that carries N in the seat is damped
        there by friction N / v. Left out there is no such damping.
    slope : str
        Formula of d friction / dv in s/m: below 0 where friction falls. Along the sliding a pair is
        damped by slope N.

    Examples
    --------
    >>> touch = Contact(("disc", "pad"), [(1, 7)], (0, 0, 1), stiffness=2e6, sliding=(1, 0, 0))
    >>> touch.name, touch.friction
    ('disc - pad', 'mu')
    """

    between: tuple[str, str]
    pairs: Any = field(repr=False)
    normal: Any = field(repr=False)
    stiffness: Any
    area: Any = None
    sliding: Any = field(default=None, repr=False)
    axis: Any = None
    through: Any = (0.0, 0.0, 0.0)
    tangential: Any = 0.0
    gap: Any = 0.0
    exponent: float = 0.0
    reference: float = 1.0
    bonded: bool = False
    friction: Any = "mu"
    factor: Any = "contact"
    speed: Any = ""
    slope: Any = "0"

    def __post_init__(self) -> None:
        at = Place(f"contact {self.name}")
        for name, value in vars(self).items():
            refuse_unit(value, at / name)
        for name in ("friction", "factor", "speed", "slope"):  # formulas, of which some are numbers
            object.__setattr__(self, name, str(getattr(self, name)))
        EXPONENT.read(self.exponent, at / "exponent")
        POSITIVE.read(self.reference, at / "reference")
        if self.sliding is not None or self.axis is not None:
            return
        if self.speed:
            raise InputError("speed: needs sliding or axis beside it")
        slope = Formula(self.slope)
        if slope.names or slope.value({}) != 0.0:
            raise InputError("slope: needs sliding or axis beside it")

    @property
    def name(self) -> str:
        """The names of both components."""
        return " - ".join(self.between)

    @property
    def is_damped(self) -> bool:
        """Whether the normal forces damp: by the speed of sliding or its slope."""
        return bool(self.speed) or self.slope != "0"

    @property
    def has_seat(self) -> bool:
        """Whether the matrices depend on the static solution: pairs can open, and may then
        stiffen with their force, or damp by it."""
        return not self.bonded or self.is_damped

    def require_direction(self, values: Parameters, varied: Collection[str] = ()) -> None:
        """Raises InputError for friction without a direction; bonded pairs need none, since they do
        not slide.

        values: of all parameters; varied: names of those that will be varied, so that friction that
        is zero now may rise.

        Examples
        --------
        >>> touch = Contact(("disc", "pad"), [(1, 7)], (0, 0, 1), stiffness=2e6)
        >>> touch.require_direction({"mu": 0.0})
        """
        if self.bonded or self.sliding is not None or self.axis is not None:
            return
        formula = Formula(self.friction)
        coefficient = formula.value(values)
        if coefficient != 0.0 or not formula.names.isdisjoint(varied):
            raise InputError(
                f"friction: {self.friction} is {coefficient:g} and has no direction; sliding or "
                "axis beside it is allowed, or friction: 0"
            )

    def located(self, bodies: Mapping[str, Component]) -> Contact:
        """The contact with its pairs as ContactPoints, searched if `pairs` is a distance.

        bodies: the components by their names. Raises InputError for unknown components, without a
        pair, and for arrays of another length; callers put the name of the contact before the
        message.

        Examples
        --------
        >>> import squeal
        >>> rows = squeal.System([[1, 0], [0, 1]], K=[[2, -1], [-1, 2]], name="plate")
        >>> plate = squeal.Component(rows, [1, 2], [2, 2], places=[[0, 0, 0], [1, 0, 0]])
        >>> block = squeal.System([[1.0]], K=[[1.0]], name="other")
        >>> other = squeal.Component(block, [7], [2], [[1, 0, 0]])
        >>> touch = squeal.Contact(("plate", "other"), 0.1, (0, 0, 1), 2e6)  # nodes within 0.1 m
        >>> touch.located({"plate": plate, "other": other}).pairs.first.tolist()
        [['2']]
        """
        if len(bodies.keys() & {*self.between}) != 2:
            raise InputError(f"is not allowed; it must be two of {', '.join(bodies)}")
        if isinstance(self.pairs, ContactPoints):
            self._require_arrays_of(len(self.pairs))
            return self
        pairs = np.asarray(self.pairs)  # labels (m, 2), or the greatest distance in m
        if not pairs.ndim:
            first, second = self.between
            pairs = _nearest_pairs(bodies[first], bodies[second], self.pairs)
        if pairs.ndim != 2 or pairs.shape[1] != 2 or not len(pairs):
            raise InputError("pairs: there is none; labels (m, 2) or a greater distance are needed")
        self._require_arrays_of(len(pairs))
        return replace(self, pairs=ContactPoints.at_nodes(pairs.astype(str)))

    def _require_arrays_of(self, count: int) -> None:
        """Raises InputError unless numbers are finite, areas above 0, and arrays fit `count` pairs.

        Stiffness, area and the like are one number or one for each pair, directions one vector (3,)
        or one for each pair.
        """
        numbers = ("stiffness", "tangential", "gap", "area")
        for name in (*numbers, "normal", "sliding", "axis", "through"):
            entries = getattr(self, name)
            if entries is None and name in ("area", "sliding", "axis"):
                continue
            shape = () if name in numbers else (3,)
            needed = "a number" if name in numbers else "a vector (3,)"
            try:
                values = np.asarray(entries, dtype=float)
            except (TypeError, ValueError):
                raise Place(name).must_be(entries, f"{needed}, or one for each pair") from None
            if values.shape not in (shape, (count, *shape)):
                raise InputError(
                    f"{name}: an array {values.shape} is not allowed; it must be {needed}, or one "
                    f"for each of {count} pairs"
                )
            kind = POSITIVE if name == "area" else ANY
            for value in values.ravel().tolist():
                kind.read(value, Place(name))


def _nearest_pairs(first: Component, second: Component, distance: float) -> NDArray[np.str_]:
    """Labels (m, 2) of a node of the first and of one of the second component: each node of the
    second with the nearest node of the first, if both lie within a distance (m)."""
    from scipy.spatial import KDTree

    nodes = np.unique(first.nodes[first.directions >= 0])
    second_nodes = np.unique(second.nodes[second.directions >= 0])
    tree = KDTree(first.places_of(nodes))
    distances, nearest = tree.query(second.places_of(second_nodes))
    return np.column_stack([nodes[nearest], second_nodes])[distances <= distance]


class PairDirections(NamedTuple):
    """The m pairs of a contact in the n rows of the assembly.

    A matrix (m, n) times the displacements of all rows gives the displacement of the second side
    less that of the first along a direction, pair by pair.
    """

    contact: Contact
    area: Array  # (m,), 1 where the contact names none
    normal: csr_array  # displacements above 0 open the pairs
    sliding: csr_array  # without any entry where the contact does not slide
    across: tuple[csr_array, csr_array]  # both directions across the normal, sliding first
    # (m,), sliding speed (m/s) over the contact's `speed`: about an axis the distance (m) from it,
    # otherwise 1
    radius: Array


def pair_directions(contact: Contact, bodies: Mapping[str, Component]) -> PairDirections:
    """The pairs of a located contact, in the rows of all components one after the other.

    Raises InputError for a direction of no length, a sliding along the normal, or pairs that do not
    move along the normal.
    """
    points = contact.pairs
    sides = []
    for number, name in enumerate(contact.between):
        sides.append(_Side(bodies, name, *points.side(number)))
    first, second = sides

    def relative_displacement(vectors: Array) -> csr_array:
        return second.displacement(vectors) - first.displacement(vectors)

    normals = _unit_vectors("normal", contact.normal, points)
    normal = relative_displacement(normals)
    has_entries = np.diff(normal.indptr) > 0  # by rows of the CSR array, one for each pair
    _require_at_pairs(has_entries, "pairs: no row moves along the normal", points)
    # motion: vectors (m, 3) of any length along which the pairs slide; if they do not slide, any
    # vectors that are not normal
    radius = np.ones(len(points))
    slides = True
    if contact.sliding is not None:
        motion = contact.sliding
    elif contact.axis is not None:
        centres = points.places
        if centres is None:
            # weights of one side may add up to less than 1, where nodes do not move
            total_weights = sum(side.weights.sum(axis=1) for side in sides)
            centres = sum(side.weighted_places() for side in sides) / total_weights[:, None]
        axes = _unit_vectors("axis", contact.axis, points)
        motion = np.cross(axes, centres - contact.through)  # velocities (m, 3) at 1 rad/s
        radius = np.linalg.norm(motion, axis=1)
    else:
        slides = False
        # any direction serves: the axis x, y or z that is farthest from the normal
        motion = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    tangents = _tangents(motion, normals, points)
    return PairDirections(
        contact=contact,
        area=_areas(contact, len(points)),
        normal=normal,
        sliding=relative_displacement(slides * tangents),  # zeros make no entries
        across=(
            relative_displacement(tangents),
            relative_displacement(np.cross(normals, tangents)),
        ),
        radius=radius,
    )


def _tangents(motion: ArrayLike, normals: Array, points: ContactPoints) -> Array:
    """Unit vectors (m, 3) along a motion, without its part along the normals (m, 3). Raises
    InputError where both are parallel."""
    directions = _unit_vectors("sliding", motion, points)
    tangents = directions - np.sum(directions * normals, axis=1)[:, None] * normals
    is_across = np.linalg.norm(tangents, axis=1) > np.sqrt(EPS)
    _require_at_pairs(is_across, "sliding: is parallel to the normal", points)
    return _unit_vectors("sliding", tangents, points)


def _areas(contact: Contact, count: int) -> Array:
    """The area of each pair: its own, an equal share of that of the contact, or 1."""
    if contact.area is None:
        return np.ones(count)
    if np.ndim(contact.area):
        return np.broadcast_to(contact.area, count)
    return np.full(count, contact.area / count)


class _Side:
    """One side of all pairs (m,) of a contact: nodes and weights (m, k) of one component."""

    def __init__(
        self, bodies: Mapping[str, Component], name: str, labels: Labels, weights: Array
    ) -> None:
        ends = np.cumsum([body.system.n for body in bodies.values()])
        starts = dict(zip(bodies, [0, *ends[:-1]], strict=True))  # first row of each component
        self.body = bodies[name]
        self.labels = labels
        self.weights = weights
        self.size = int(ends[-1])  # rows of all components
        self.is_used = weights != 0.0  # False where a pair has fewer than k nodes
        # rows of x, y, z in the assembly (m, k, 3); -1 where a node does not move along one
        rows = self.body.rows_of(labels[self.is_used])
        self.rows = np.full((*labels.shape, 3), -1)
        self.rows[self.is_used] = np.where(rows >= 0, rows + starts[name], -1)

    def displacement(self, vectors: Array) -> csr_array:
        """The matrix (m, n) of the displacements of the pairs along vectors (m, 3)."""
        from scipy.sparse import coo_array

        entries = self.weights[:, :, None] * vectors[:, None, :]  # (m, k, 3), as `rows`
        is_used = (self.rows >= 0) & (entries != 0.0)
        pair_numbers, _, _ = np.nonzero(is_used)
        where = (pair_numbers, self.rows[is_used])
        return coo_array((entries[is_used], where), shape=(len(self.labels), self.size)).tocsr()

    def weighted_places(self) -> Array:
        """The sums of weight times place (m, 3) over the nodes of each pair. Raises InputError
        without coordinates."""
        places = np.zeros((*self.labels.shape, 3))
        places[self.is_used] = self.body.places_of(self.labels[self.is_used])
        return np.einsum("mk,mkx->mx", self.weights, places)


def _unit_vectors(name: str, directions: ArrayLike, points: ContactPoints) -> Array:
    """Unit vectors (m, 3) of all pairs. Raises InputError where one has no length."""
    vectors = np.broadcast_to(np.asarray(directions, dtype=float), (len(points), 3))
    lengths = np.linalg.norm(vectors, axis=1)
    _require_at_pairs(lengths > 0.0, f"{name}: has no length", points)
    return vectors / lengths[:, None]


def _require_at_pairs(holds: Bools, refusal: str, points: ContactPoints) -> None:
    """Raises InputError with a refusal and the name of the first pair where `holds` is False."""
    if not np.all(holds):
        raise InputError(f"{refusal} at the pair {points.name_of(int(np.argmin(holds)))}")


@dataclass(frozen=True, eq=False)
class StaticContact:
    """A contact under the load.

    `closed` (m,) are the pairs that touch, `forces` (m,) their normal forces in N, `pressures` (m,)
    the forces over the areas in Pa; `stiffness` (m,) is the normal stiffness of the pairs in N/m
    without its factor, zero where they are open. `force_errors` and `stiffness_errors` (m,) are how
    far rounding may have moved both. `constant`: whether the stiffness of a closed pair does not
    depend on the load.
    """

    name: str
    closed: Bools = field(repr=False)
    forces: Array = field(repr=False)
    pressures: Array = field(repr=False)
    stiffness: Array = field(repr=False)
    force_errors: Array = field(repr=False)
    stiffness_errors: Array = field(repr=False)
    constant: bool = False

    def summary(self) -> dict[str, Any]:
        """What a JSON object says of it: pairs, force in N, largest pressure in Pa."""
        return {
            "between": self.name,
            "pairs": len(self.closed),
            "closed": int(np.count_nonzero(self.closed)),
            "force": float(self.forces.sum()),
            "largest_pressure": float(self.pressures.max()),
        }

    def __str__(self) -> str:
        text = (
            "contact {between}: {closed} of {pairs} pairs closed, {force:.6g} N, largest "
            "pressure {largest_pressure:.4g}"
        ).format(**self.summary())
        if self.constant and self.closed.all():
            text += "; as long as all are, load and gap move the forces alone, not the roots"
        return text


class _PairLaws(NamedTuple):
    """What acts at each pair (m,), of one contact or of all."""

    area: Array
    factor: Array  # of the normal stiffness
    stiffness: Array  # N/m, normal to the pair, where its force is the reference
    gap: Array
    exponent: Array
    reference: Array
    bonded: Bools
    tangential: Array  # N/m, stiffness across the normal

    def closed(self, approach: Array) -> Bools:
        """Which pairs (m,) touch; bonded ones do, though they pull."""
        return (approach > 0.0) | self.bonded

    def unit_forces(self, approach: Array) -> tuple[Array, Array]:
        """Normal forces (m,) over the factor, and their derivatives by the approach (m,).

        The stiffness grows with a power of the force, dF/du = c k (F / R)^e: integrated from 0,
        F = (1 - e) c k u (F / R)^e with (F / R)^e = ((1 - e) c k u / R)^(e / (1 - e)). u is the
        approach, c the factor, R the reference. Both are 0 where a pair is open.
        """
        closed = self.closed(approach)
        share = 1 - self.exponent
        linear_force = closed * share * (self.stiffness * approach)
        # from 1e-60 to 1e60 for (F / R)^e: no step of a search overflows
        largest_power = np.minimum(60.0 * share / divisor(self.exponent), 300.0)
        ratio = np.abs(self.factor * linear_force) / self.reference
        ratio = np.clip(ratio, 10.0**-largest_power, 10.0**largest_power)
        power = ratio ** (self.exponent / share)  # (F / R)^e
        return linear_force * power, closed * self.stiffness * power


def _pair_laws(directions: PairDirections, parameters: Parameters) -> _PairLaws:
    """The laws of the pairs of one contact at some parameters.

    Stiffnesses and reference of a `Contact` are those of a unit of area, of which each pair has its
    share; without areas the share of each is 1.
    """
    contact = directions.contact
    area = directions.area
    # where the contact slides friction is all that acts across the normal
    tangential: ArrayLike = 0.0
    if not directions.sliding.nnz:  # without an entry: the contact does not slide
        tangential = parameters["tangential"] * area * contact.tangential

    def of_pairs(value: ArrayLike) -> Array:
        return np.broadcast_to(np.asarray(value, dtype=float), len(area))

    return _PairLaws(
        area=area,
        factor=of_pairs(Formula(contact.factor).value(parameters)),
        stiffness=area * contact.stiffness,
        gap=of_pairs(contact.gap),
        exponent=of_pairs(0.0 if contact.bonded else contact.exponent),
        reference=area * contact.reference,
        bonded=of_pairs(contact.bonded) > 0.0,
        tangential=of_pairs(tangential),
    )


def seat_contacts(
    structure: System, pair_sets: Sequence[PairDirections], bodies: Sequence[Component]
) -> tuple[list[StaticContact], Array]:
    """Each contact under the load of the components, and the displacements (n,) of all rows in m.

    `structure` are the components side by side without contact, with n rows; `pair_sets` are the
    pairs of each contact. Raises InputError without a load if pairs may open, if all pairs open,
    and if nothing holds a component; ComputationError where the search for the closed pairs does
    not end.
    """
    loads = []
    for body in bodies:
        loads.append(np.zeros(body.system.n) if body.load is None else body.load)
    load = np.concatenate(loads)
    if not load.any() and not all(pairs.contact.bonded for pairs in pair_sets):
        raise InputError("load: missing; pairs that may open are seated under the brake load")
    _, _, K = structure.at()
    joined = _JoinedPairs.of(pair_sets, structure.parameters)
    seat = _seat(K.real, load, joined)  # imaginary parts are structural damping, which is at rest
    normal_forces = joined.laws.factor * seat.unit_forces
    contacts = []
    start = 0
    for pairs in pair_sets:
        of_contact = slice(start, start + len(pairs.area))
        start = of_contact.stop
        contacts.append(
            StaticContact(
                name=pairs.contact.name,
                closed=seat.closed[of_contact],
                forces=normal_forces[of_contact],
                pressures=normal_forces[of_contact] / pairs.area,
                stiffness=seat.unit_slopes[of_contact],
                force_errors=np.abs(joined.laws.factor * seat.force_errors)[of_contact],
                stiffness_errors=seat.slope_errors[of_contact],
                constant=pairs.contact.bonded or not pairs.contact.exponent,
            )
        )
    return contacts, seat.displacements


class _JoinedPairs(NamedTuple):
    """The pairs (m,) of all contacts in the n rows of the assembly."""

    laws: _PairLaws
    normal: csr_array  # (m, n), relative displacements along the normals
    across: csr_array  # (2 m, n), those along both directions across them
    push: csr_array  # (n, m), loads on all rows by a unit normal force of a pair and its friction

    @staticmethod
    def of(pair_sets: Sequence[PairDirections], parameters: Parameters) -> _JoinedPairs:
        """The joined pairs of some contacts at some parameters."""
        from scipy.sparse import vstack

        laws = [_pair_laws(pairs, parameters) for pairs in pair_sets]
        pushes = []
        for pairs in pair_sets:
            friction = Formula(pairs.contact.friction).value(parameters)
            # a normal force pushes the second side along the normal, and its friction pulls that
            # side to where the first one slides; on the first side both act in reverse
            pushes.append(pairs.normal + friction * pairs.sliding)
        first = [pairs.across[0] for pairs in pair_sets]
        second = [pairs.across[1] for pairs in pair_sets]
        # each field of all laws, one contact after the other
        fields = [np.hstack(of_contacts) for of_contacts in zip(*laws, strict=True)]
        return _JoinedPairs(
            laws=_PairLaws(*fields),
            normal=vstack([pairs.normal for pairs in pair_sets]),
            across=vstack(first + second),
            push=vstack(pushes).T,
        )

    def normal_springs(self, unit_slopes: Array) -> csr_array:
        """The stiffness (n, n) of pairs whose forces over the factor have some slopes (m,)."""
        springs = self.laws.factor * unit_slopes
        return self.push @ self.normal.multiply(springs[:, None])

    def tangential_springs(self, closed: Bools) -> csr_array:
        """The stiffness (n, n) of the closed pairs (m,) across their normals."""
        springs = np.tile(closed * self.laws.tangential, 2)  # for both directions of `across`
        return self.across.T @ self.across.multiply(springs[:, None])


class _Seat(NamedTuple):
    """The equilibrium under the load. Errors are how far rounding may have moved numbers."""

    closed: Bools  # (m,), pairs that touch
    unit_forces: Array  # (m,), normal forces over the factor
    unit_slopes: Array  # (m,), their derivatives by the approach
    displacements: Array  # (n,)
    force_errors: Array  # (m,)
    slope_errors: Array  # (m,)


def _seat(K: Matrix, load: Array, pairs: _JoinedPairs) -> _Seat:
    """The equilibrium (K + T) u = load + push F(approach) of the structure K (n, n) under a load
    (n,), by Newton's method: T are the tangential springs of the closed pairs, F their normal
    forces, and the approach (m,) is -gap - normal u. Of m pairs, `normal` (m, n) and `across`
    (2 m, n) take displacements to relative ones, and `push` (n, m) takes normal forces to loads
    with their friction.

    Each step solves the structure with the tangent springs of the pairs; at first all pairs touch,
    with springs as at the reference. `_step_length` says how much of the step is taken. Without
    friction it lowers the energy, which is convex for a given T, as far as the step can: each
    problem with a solution is solved, whatever its exponents, and however far its pairs are from
    the reference. The tangential springs stay until the forces match them, and are then those of
    the pairs that are closed.

    Raises InputError where all pairs stay open, where nothing holds the structure with its closed
    pairs, and where nothing resists the load; ComputationError if the search does not end in 100
    steps and one more for each pair.
    """
    from scipy.sparse import diags_array

    laws = pairs.laws
    displacements = np.zeros(len(load))
    approach = -laws.gap
    unit_slopes = laws.stiffness
    unit_forces = unit_slopes * approach
    touching = np.ones(len(approach), dtype=bool)  # pairs whose tangential springs act
    is_lifted = False
    for number in range(100 + len(approach)):
        held = K + pairs.tangential_springs(touching)
        residual = load + pairs.push @ (laws.factor * unit_forces) - held @ displacements
        refusal = None
        try:
            solve = _solver(held + pairs.normal_springs(unit_slopes))
        except InputError as error:
            if not number:
                raise
            refusal = error
            unit_slopes = np.maximum(unit_slopes, LEAST_SPRING * laws.stiffness)
            A = held + pairs.normal_springs(unit_slopes)
            solve = _solver(A + diags_array(LEAST_DIAGONAL * np.abs(A.diagonal())))
        step = solve(residual)
        change = -(pairs.normal @ step)
        new_forces, _ = laws.unit_forces(approach + change)
        if _match(unit_forces + unit_slopes * change, new_forces, MATCHED):
            closed = laws.closed(approach + change)
            if np.array_equal(touching * laws.tangential, closed * laws.tangential):
                if not closed.any():
                    raise InputError(ALL_OPEN)
                if refusal:
                    raise refusal
                seat = _refined(displacements + step, approach + change, load, held, pairs, solve)
                if seat is not None:
                    return seat
            touching = closed
        if refusal:
            # the springs that hold open pairs resist a motion that opens them; nothing else may
            resisting = np.where(laws.closed(approach), change, np.maximum(change, 0.0))
            springs = laws.factor * unit_slopes
            resisted_work = step @ (held @ step) + (springs * resisting) @ resisting
            is_lifted |= bool(resisted_work < RESISTED * (residual @ step))
        # with the tangent A and, without friction, S, A' w = S step; w is the step if A is S
        without_friction = pairs.normal.T @ (laws.factor * unit_slopes * -change)
        weights = solve(held @ step + without_friction, transposed=True)
        length = _step_length(
            laws,
            approach,
            change,
            work_of_loads=weights @ (load - held @ displacements),
            work_of_structure=weights @ (held @ step),
            pushed=pairs.push.T @ weights,
        )
        displacements = displacements + length * step
        summed = approach + length * change
        approach = -laws.gap - pairs.normal @ displacements
        # where displacements cancel the sum is more precise, unless they were far greater before
        rounding = 8 * EPS * (np.abs(laws.gap) + abs(pairs.normal) @ np.abs(displacements))
        approach = np.where(np.abs(summed - approach) < rounding, summed, approach)
        unit_forces, unit_slopes = laws.unit_forces(approach)
    if is_lifted:
        raise InputError(LIFTED)
    raise ComputationError(f"{UNSETTLED} with a set of closed pairs that keeps changing")


def _match(forces: Array, others: Array, share: float) -> bool:
    """Whether forces (m,) are others, up to a share of each or to the rounding of the largest."""
    return np.allclose(forces, others, share, 8 * EPS * np.max(np.abs(others)))


def _refined(
    displacements: Array,
    approach: Array,
    load: Array,
    held: Matrix,
    pairs: _JoinedPairs,
    solve: Callable[..., Array],
) -> _Seat | None:
    """The seat after three more steps with the last tangent.

    They take away what is left of the residual. What the last one changes shows the rounding, to
    which that of a power is added. None if a step does work, or changes forces by more than the
    tangent allows: then the structure is so nearly singular that there is no equilibrium yet.
    """
    laws = pairs.laws
    unit_forces, unit_slopes = laws.unit_forces(approach)
    work_of_pairs = np.abs(laws.factor) @ (unit_forces**2 / divisor(unit_slopes))
    work = abs(load @ solve(load)) + work_of_pairs
    for _ in range(3):
        previous_forces = unit_forces
        previous_slopes = unit_slopes
        residual = load + pairs.push @ (laws.factor * unit_forces) - held @ displacements
        step = solve(residual)
        displacements = displacements + step
        approach = approach - pairs.normal @ step
        unit_forces, unit_slopes = laws.unit_forces(approach)
        is_balanced = abs(residual @ step) <= LEFT * work
        if not is_balanced or not _match(previous_forces, unit_forces, TANGENT):
            return None
    power = laws.exponent / (1 - laws.exponent)
    force_rounding = 8 * EPS * (1 + power) * np.abs(unit_forces)
    slope_rounding = 8 * EPS * power * unit_slopes
    return _Seat(
        closed=laws.closed(approach),
        unit_forces=unit_forces,
        unit_slopes=unit_slopes,
        displacements=displacements,
        force_errors=np.abs(unit_forces - previous_forces) + force_rounding,
        slope_errors=np.abs(unit_slopes - previous_slopes) + slope_rounding,
    )


def _step_length(
    laws: _PairLaws,
    approach: Array,
    change: Array,
    work_of_loads: float,
    work_of_structure: float,
    pushed: Array,
) -> float:
    """The length t of a step after which the forces do no more work.

    The approach (m,) grows by t times the change (m,). The work is a sum over the rows of the
    residual with the weights w: `work_of_loads` at t = 0 without the pairs, less t times
    `work_of_structure`, and the forces of the pairs times `pushed` (m,). Without friction w is the
    step, and no work is left where the energy is least.

    The length is 1 if that is within a tenth, where no work is left at t = 0, and where no such
    length is found.
    """
    from scipy.optimize import brentq

    def work(length: float) -> float:
        unit_forces, _ = laws.unit_forces(approach + length * change)
        work_of_pairs = float(pushed @ (laws.factor * unit_forces))
        return work_of_loads - length * work_of_structure + work_of_pairs

    if work(0.0) <= 0.0 or work(0.9) >= 0.0 >= work(1.1):
        return 1.0
    low = 0.0
    high = 1.0
    while work(high) > 0.0:
        if high > 1e30:
            return 1.0
        low = high
        high *= 4.0
    return brentq(work, low, high, xtol=1e-300, rtol=1e-3, maxiter=2000)


def _solver(A: Matrix) -> Callable[..., Array]:
    """The function from b (n,) to the solution x of A x = b, or with `transposed` of A'x = b.

    Raises InputError where A is singular to rounding.
    """
    from scipy.linalg import LinAlgWarning, lu_factor, lu_solve
    from scipy.linalg.lapack import dgecon

    # B_ij = scale_i A_ij scale_j has a unit diagonal, so that units do not matter
    scale = 1.0 / np.sqrt(divisor(np.abs(A.diagonal())))
    if is_sparse(A):
        with suppress(ZeroDivisionError):
            factor = factorise(A.tocsc())
            # B is singular to rounding if its condition |B| |B^-1| is 1 / EPS: |B| is at least 1,
            # and B^-1 times some random forces is about as long as |B^-1| or longer
            forces = np.random.default_rng(0).standard_normal((8, len(scale)))
            responses = factor.solve((forces / scale).T).T / scale
            if EPS * np.linalg.norm(responses) < 1.0:
                return factor.solve
    else:
        B = A * scale[:, None] * scale
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", LinAlgWarning)  # exactly singular
            factors = lu_factor(B)
        reciprocal_condition, _ = dgecon(factors[0], np.linalg.norm(B, 1))
        if reciprocal_condition > EPS:

            def solve(right: Array, transposed: bool = False) -> Array:
                return scale * lu_solve(factors, scale * right, trans=int(transposed))

            return solve
    raise InputError(
        "nothing holds some motion of the components under the load; each needs supports, or "
        "contact that holds it"
    )
