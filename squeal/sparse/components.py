"""Components joined by node pairs: Craig-Bampton reduction, contact with friction, seating.

A reduced component keeps the rows of its boundary nodes. Its inside follows these statically
(constraint modes) and moves by its normal modes with the boundary held, up to a frequency. Those
above are represented by their static answer to the inertia of the constraint modes. Contact
acts between nodes of two components, so that it changes without a new reduction. What touches is
found under the brake load: pairs that would pull open, and carry neither stiffness nor friction.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import ComputationError, InputError
from squeal.linear.damping import structure_stiffness
from squeal.linear.eigen import Eigenvalue, assumed_rounding
from squeal.linear.matrices import EPS, divisor, is_sparse, norm_of
from squeal.linear.system import Matrix, Term, TermSystem
from squeal.numerics.differentiation import Formula
from squeal.schema import Place
from squeal.sparse.first_look import movements
from squeal.sparse.quadratic import Array, ComplexArray, Factor, factorise

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

SHARE = 1e-4  # of the energy of a boundary motion, below which what it adds inside is left out
OWN = {"mu": 0.0, "contact": 1.0, "tangential": 1.0}  # parameters of every assembly


@dataclass(frozen=True, eq=False)
class Component:
    """One body of an assembly: its matrices, and which node and direction each row is.

    Parameters
    ----------
    system : TermSystem
        M, C and K (n, n), dense or sparse; its name is the component's.
    nodes : array_like (n,)
        Label of the node of each row; empty where a row belongs to none.
    directions : array_like (n,)
        0, 1, 2 for displacements along x, y, z; -1 for rotations and what moves no node.
    places : array_like (n, 3), optional
        Where in m the node of each row lies.
    load : array_like (n,), optional
        Brake load in N (N m for rotations), under which contact is seated.
    rows, cutoff, basis, lacks : int, float, array (rows, n), array (s t n, s t n)
        Of a reduced one how many rows it had, up to which frequency in Hz it kept modes, the
        displacements of those rows, and W^H K^-1 W of what its t terms do to these displacements
        inside: as right vectors and, if a term is not Hermitian, as left ones too (s = 2).

    Examples
    --------
    A chain of three masses that keeps its last node, and all of its modes:

    >>> import numpy as np, squeal
    >>> K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    >>> chain = Component(squeal.System(np.eye(3), K=K), [1, 2, 3], [0, 0, 0])
    >>> small = chain.reduced([3], cutoff=1.0)
    >>> small.nodes.tolist()
    ['3', '', '']
    >>> squeal.eigenvalues(small.system).values[::2].imag.round(9)
    array([0.44504187, 1.2469796 , 1.80193774])
    """

    system: TermSystem
    nodes: Any = field(repr=False)
    directions: Any = field(repr=False)
    places: Any = field(default=None, repr=False)
    load: Any = field(default=None, repr=False)
    rows: int | None = None
    cutoff: float = np.inf
    basis: Array | None = field(default=None, repr=False)
    lacks: Any = field(default=None, repr=False)

    def __post_init__(self) -> None:
        for name, kind in {"nodes": str, "directions": int, "places": float, "load": float}.items():
            if (given := getattr(self, name)) is not None:
                value: Any = np.asarray(given).astype(kind)
                if len(value) != self.system.n:
                    words = f"{len(value)} rows are not allowed; the matrices have {self.system.n}"
                    raise InputError(f"{self.name}: {name}: {words}")
                object.__setattr__(self, name, value)

    @property
    def name(self) -> str:
        """What the component is called."""
        return self.system.name

    def rows_of(self, nodes: ArrayLike) -> NDArray[np.intp]:
        """The rows (m, 3) of nodes (m,), -1 where there is none. Raises InputError if unknown."""
        wanted = np.asarray(nodes).astype(str)
        labels, inverse = np.unique(self.nodes, return_inverse=True)
        where = np.minimum(np.searchsorted(labels, wanted), len(labels) - 1)
        if np.any(unknown := (labels[where] != wanted) | (wanted == "")):
            raise InputError(f"{wanted[unknown][0]} is no node of {self.name}")
        table, moving = np.full((len(labels), 3), -1), np.flatnonzero(self.directions >= 0)
        table[inverse[moving], self.directions[moving]] = moving
        return table[where]

    def places_of(self, nodes: ArrayLike) -> Array:
        """Where nodes (m,) lie (m, 3). Raises InputError without coordinates."""
        if self.places is None:
            raise InputError(f"{self.name} has no coordinates; they are needed here")
        return np.asarray(self.places[self.rows_of(nodes).max(axis=1)])

    def rotating(
        self, axis: ArrayLike, speed: str, values: Mapping[str, float], preloaded: bool = False
    ) -> Component:
        """The same component seen from a frame that turns with it at constant speed.

        Coriolis forces 2 speed G enter C and centrifugal forces -speed^2 Z enter K, of each term of
        M: G = (M J + J M) / 2 and Z = -(M J^2 + J^2 M) / 2, in which J x = axis x x at each node.
        The centrifugal load itself, and the stiffness of its stress, are the program's.

        Parameters
        ----------
        axis : array_like (3,)
            Of the rotation, in its sense, of any length above 0.
        speed : str
            Formula of the speed in rad/s.
        values : mapping of str to float
            The parameters that the formula names.
        preloaded : bool
            Whether K has the centrifugal forces already, as that of a step about the turning state;
            Coriolis forces alone are then added.

        Raises
        ------
        InputError
            If the axis has no length.

        Examples
        --------
        A mass of 1 kg on springs of 100 N/m, seen from a frame that turns by 2 rad/s:

        >>> import numpy as np, squeal
        >>> mass = squeal.Component(squeal.System(np.eye(2), K=100 * np.eye(2)), [1, 1], [0, 1])
        >>> turned = mass.rotating((0, 0, 1), "speed", {"speed": 2.0})
        >>> squeal.eigenvalues(turned.system).values[::2].imag.round(9).tolist()
        [8.0, 12.0]
        """
        from scipy.sparse import csc_array

        turn = self._turn(axis)
        squared = csc_array(turn @ turn)
        formula = Formula(speed)
        coriolis = list[Term]()
        softening = list[Term]()
        for term in self.system.M:
            mass = csc_array(term.matrix)
            gyroscopic = mass @ turn + turn @ mass  # 2 G
            centrifugal = (mass @ squared + squared @ mass) / 2.0  # -Z
            each = (gyroscopic, centrifugal)
            if not is_sparse(term.matrix):
                each = tuple(matrix.toarray() for matrix in each)
            of_speed = f"({formula.text}) * ({term.factor.text})"
            coriolis.append(Term(each[0], Formula(of_speed)))
            softening.append(Term(each[1], Formula(f"({formula.text}) * {of_speed}")))
        own = {name: values[name] for name in formula.names if name in values}
        system = replace(
            self.system,
            C=(*self.system.C, *coriolis),
            K=self.system.K if preloaded else (*self.system.K, *softening),
            parameters=dict(self.system.parameters) | own,
        )
        return replace(self, system=system)

    def _turn(self, axis: ArrayLike) -> csc_array:
        """The sparse matrix J (n, n) of the cross product with a unit axis at each node. Raises
        InputError."""
        from scipy.sparse import coo_array

        given = np.asarray(axis, dtype=float)
        length = np.linalg.norm(given)
        if not length > 0.0:
            raise InputError(f"{self.name}: axis: has no length")
        x, y, z = given / length
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        moving = np.unique(self.nodes[self.directions >= 0])
        rows = self.rows_of(moving)
        n = self.system.n
        turn = coo_array((n, n)).tocsc()
        for to, of in zip(*np.nonzero(np.abs(cross) > EPS), strict=True):
            both = (rows[:, to] >= 0) & (rows[:, of] >= 0)
            where = (rows[both, to], rows[both, of])
            entries = np.full(np.count_nonzero(both), cross[to, of])
            turn = turn + coo_array((entries, where), shape=(n, n)).tocsc()
        return turn

    def reduced(self, nodes: ArrayLike, cutoff: float) -> Component:
        """Craig-Bampton reduction: all rows of some nodes, and modes up to a frequency.

        Modes above it count by their static answer to the inertia of the constraint modes, where
        that matters at half the frequency.

        Parameters
        ----------
        nodes : array_like
            Labels of the nodes that stay: those of contact, mounts, and where it is observed.
        cutoff : float
            Highest frequency in Hz of the normal modes with these nodes held; twice the highest
            one of interest.

        Returns
        -------
        Component
            Dense, the rows of the nodes first. Every term is projected and keeps its factor; the
            basis is that of the component's own parameters.

        Raises
        ------
        InputError
            For an unknown node, or if these nodes do not hold the component.
        """
        from scipy.linalg import eigh
        from scipy.sparse import block_diag, csc_array

        self.rows_of(nodes)
        kept = np.isin(self.nodes, np.asarray(nodes).astype(str))
        b, i = np.flatnonzero(kept), np.flatnonzero(~kept)
        V = np.zeros((len(kept), len(b)))
        V[b, np.arange(len(b))] = 1.0
        if len(i):
            K, M = map(csc_array, (structure_stiffness(self.system)[0], self.system.at()[0]))
            inside, mass = csc_array(K[i][:, i]), csc_array(M[i][:, i])
            try:
                factor = factorise(inside)
                squares, modes = _modes(inside, mass, factor, cutoff)
                if np.any(squares <= 4 * EPS * len(i) * norm_of(inside) / norm_of(M)):
                    raise ZeroDivisionError
            except ZeroDivisionError:
                words = "the nodes in contact do not hold it; it needs supports"
                raise InputError(f"{self.name}: {words}") from None
            V[i] = -factor.solve(K[i][:, b].toarray())
            # what modes above the cutoff add at half of it: the static answer to inertia
            late, rate = factor.solve((M @ V)[i]), np.pi * cutoff
            late -= modes @ (modes.T @ (mass @ late))
            own = V.T @ (K @ V) + rate**2 * (V.T @ (M @ V))
            share, turn = eigh(rate**4 * (late.T @ (inside @ late)), own)
            late = late @ turn[:, share > SHARE]
            late /= np.sqrt(np.sum(late * (mass @ late), axis=0))
            V = np.hstack([V, np.zeros((len(kept), modes.shape[1] + late.shape[1]))])
            V[i, len(b) :] = np.hstack([modes, late])
        M, C, K = (
            tuple(Term(V.T @ (t.matrix @ V), t.factor) for t in terms)
            for terms in self.system.parts
        )
        every = [t.matrix for t in self.system.terms]
        left = [A.conj().T for A in every]
        if any(
            norm_of(A - B) > np.sqrt(EPS) * norm_of(A) for A, B in zip(every, left, strict=True)
        ):
            every += left
        each = [(csc_array(A)[i], factor.solve((A @ V)[i]) if len(i) else V[i]) for A in every]
        lacks = np.block([[V.T @ (A.conj().T @ solved) for _, solved in each] for A, _ in each])
        if self.lacks is not None:
            wide = block_diag([V] * (len(self.lacks) // self.system.n), "csc")
            lacks = lacks + wide.T @ self.lacks @ wide
        rest = V.shape[1] - len(b)
        return Component(
            replace(self.system, M=M, C=C, K=K),
            [*self.nodes[b], *[""] * rest],
            [*self.directions[b], *[-1] * rest],
            None if self.places is None else np.vstack([self.places[b], np.zeros((rest, 3))]),
            None if self.load is None else V.T @ self.load,
            self.rows or self.system.n,
            min(cutoff, self.cutoff),
            V if self.basis is None else self.basis @ V,
            lacks,
        )

    def lack(
        self, z: ComplexArray, right: ComplexArray, left: ComplexArray, at: Mapping[str, float]
    ) -> tuple[ComplexArray, Array, Array]:
        """Of what right and left modes (n, m) of roots z (m,) at parameters lack inside, the
        residuals R = P x and S = P^H y: S^H K^-1 R (m, m), R^H K^-1 R and S^H K^-1 S (m,)."""
        parts = zip(self.system.parts, (2, 1, 0), strict=True)
        rates = [[t.factor.value(at) * z**k for t in terms] for terms, k in parts]
        weights = np.array(list(itertools.chain(*rates)))[:, None]
        R, S = (
            (w * part).reshape(-1, len(z)) for w, part in ((weights, right), (weights.conj(), left))
        )
        if len(self.lacks) > len(R):  # the terms from the left follow those from the right
            R, S = np.vstack([R, 0 * R]), np.vstack([0 * S, S])
        FR, FS = self.lacks @ R, self.lacks @ S
        return S.conj().T @ FR, *(np.sum(A.conj() * B, axis=0).real for A, B in ((R, FR), (S, FS)))


def _modes(K: Any, M: Any, factor: Factor, cutoff: float) -> tuple[Array, Array]:
    """Squares (rad/s)^2 and modes (n, k) up to a frequency (Hz); ZeroDivisionError if not held."""
    from scipy.linalg import eigh
    from scipy.sparse.linalg import LinearOperator, eigsh

    n, limit, count = K.shape[0], (2 * np.pi * cutoff) ** 2, 24
    while 4 * count < n:
        inverse = LinearOperator((n, n), matvec=factor.solve, dtype=float)
        start = np.random.default_rng(n).standard_normal(n)
        squares, modes = eigsh(K, count, M, sigma=0.0, OPinv=inverse, v0=start)
        if squares.max() > limit:
            return squares[squares <= limit], modes[:, squares <= limit]
        count *= 2
    try:  # of 1/squares, since M may be singular
        values, modes = eigh(M.toarray(), K.toarray(), subset_by_value=(1 / limit, np.inf))
    except np.linalg.LinAlgError:  # K is not definite
        raise ZeroDivisionError from None
    return 1 / values, modes / np.sqrt(values)


@dataclass(frozen=True, eq=False)
class Contact:
    """Node pairs between two components, and what acts between them.

    A pair is pressed by h, the approach of its nodes along the normal less the gap. Its pressure p
    grows by dp/dh = stiffness (p / reference)^exponent.

    Parameters
    ----------
    between : (str, str)
        Names of the components.
    pairs : array_like (m, 2) or float
        Labels of the nodes of the one and the other; or the distance (m) within which each node of
        the other is paired with the nearest one of the first.
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
        What is between the nodes beside their places, in m: wear and machined height.
    exponent, reference : float
        Of the normal stiffness by pressure (Pa; N without `area`); 0 is a constant stiffness.
    bonded : bool
        True for a joint, whose pairs cannot open.
    friction, factor : str
        Formulas of the parameters: the coefficient of friction and the factor of the normal
        stiffness. That of the tangential one is the parameter `tangential`.
    speed : str, optional
        Formula of the sliding speed: m/s where `sliding` is constant, rad/s about `axis`. It turns
        friction with the direction of sliding: across it a pair that carries N in the seat is
        damped by friction N / speed. Left out there is no such damping.
    slope : str
        Formula of d friction / d speed in s/m: below 0 where friction falls. Along sliding a pair
        is damped by slope N.
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
    friction: str = "mu"
    factor: str = "contact"
    speed: str = ""
    slope: str = "0"

    def __post_init__(self) -> None:
        moves = self.sliding is not None or self.axis is not None
        slope = Formula(self.slope)
        has_slope = bool(slope.names) or slope.value({}) != 0.0
        for key, given in (("speed", bool(self.speed)), ("slope", has_slope)):
            if given and not moves:
                raise InputError(f"{key}: needs sliding or axis beside it")

    @property
    def name(self) -> str:
        """The names of both components."""
        return " - ".join(self.between)

    def labelled(self, bodies: Mapping[str, Component]) -> Contact:
        """The same contact with the labels of its pairs (m, 2). Raises InputError."""
        if len(bodies.keys() & {*self.between}) != 2:
            raise InputError(f"is not allowed; it must be two of {', '.join(bodies)}")
        pairs = np.asarray(self.pairs)
        if not pairs.ndim:
            from scipy.spatial import KDTree

            one, other = (bodies[name] for name in self.between)
            first, second = (np.unique(x.nodes[x.directions >= 0]) for x in (one, other))
            near, which = KDTree(one.places_of(first)).query(other.places_of(second))
            pairs = np.column_stack([first[which], second])[near <= self.pairs]
        if pairs.ndim != 2 or pairs.shape[1] != 2 or not len(pairs):
            raise InputError("pairs: there is none; labels (m, 2) or a greater distance are needed")
        return replace(self, pairs=pairs.astype(str))


class _Joint(NamedTuple):
    """A contact in the rows of the assembly: areas (m,), and displacements (m, n) of the second
    less those of the first: normal, sliding (zero without), in two directions across. `radius`
    (m,) times the contact's `speed` is the speed of sliding: 1, or the distance from the axis."""

    contact: Contact
    area: Array
    normal: Any
    sliding: Any
    across: tuple[Any, Any]
    radius: Array


def _joint(contact: Contact, bodies: Mapping[str, Component]) -> _Joint:
    from scipy.sparse import coo_array

    nodes, m = contact.pairs, len(contact.pairs)
    *ends, n = np.cumsum([body.system.n for body in bodies.values()])
    starts = dict(zip(bodies, [0, *ends], strict=True))
    each = list(zip([bodies[name] for name in contact.between], nodes.T, strict=True))
    rows = np.hstack([body.rows_of(labels) for body, labels in each])
    columns = rows + np.repeat([starts[name] for name in contact.between], 3)

    def require(holds: Any, words: str) -> None:
        if not np.all(holds):
            raise InputError(f"{words} at the pair {', '.join(nodes[np.argmin(holds)])}")

    def unit(name: str, given: ArrayLike) -> Array:
        vectors = np.broadcast_to(np.asarray(given, dtype=float), (m, 3))
        length = np.linalg.norm(vectors, axis=1)
        require(length > 0.0, f"{name}: has no length")
        return np.asarray(vectors / length[:, None])

    def along(vectors: Array) -> Any:
        data = np.hstack([-vectors, vectors])
        used = (rows >= 0) & (data != 0.0)
        where = np.nonzero(used)[0], columns[used]
        return coo_array((data[used], where), shape=(m, n)).tocsr()

    normal, slides = unit("normal", contact.normal), contact.sliding
    require(np.diff(along(normal).indptr) > 0, "pairs: no row moves along the normal")
    radius = np.ones(m)
    if slides is None and contact.axis is not None:
        centre = np.mean([body.places_of(labels) for body, labels in each], axis=0)
        slides = np.cross(unit("axis", contact.axis), centre - contact.through)
        radius = np.linalg.norm(slides, axis=1)
    none = slides is None
    given = unit("sliding", np.eye(3)[np.argmin(np.abs(normal), axis=1)] if none else slides)
    given = given - np.sum(given * normal, axis=1)[:, None] * normal
    require(np.linalg.norm(given, axis=1) > np.sqrt(EPS), "sliding: is parallel to the normal")
    tangent = unit("sliding", given)
    area = m if contact.area is None else contact.area  # a pair's is 1 without
    area = np.broadcast_to(area, m) / (1 if np.ndim(area) else m)
    across = along(tangent), along(np.cross(normal, tangent))
    sliding = along(0.0 * tangent) if none else across[0]
    return _Joint(contact, area, along(normal), sliding, across, radius)


@dataclass(frozen=True, eq=False)
class Seat:
    """A contact under the load.

    `closed` (m,) are the pairs that touch, `forces` (m,) their normal forces in N and `pressures`
    (m,) these over the areas; `constant` if their stiffness does not depend on it.
    """

    name: str
    closed: NDArray[np.bool_] = field(repr=False)
    forces: Array = field(repr=False)
    pressures: Array = field(repr=False)
    constant: bool = False

    def summary(self) -> dict[str, Any]:
        """What a JSON object says of it: pairs, force in N, largest pressure in Pa."""
        counts = {"pairs": len(self.closed), "closed": int(np.count_nonzero(self.closed))}
        sums = {"force": float(self.forces.sum()), "largest_pressure": float(self.pressures.max())}
        return {"between": self.name} | counts | sums

    def __str__(self) -> str:
        words = "contact {between}: {closed} of {pairs} pairs closed, {force:.6g} N, largest "
        words += "pressure {largest_pressure:.4g}"
        if self.constant and self.closed.all():
            words += "; as long as all are, load and gap move the forces alone, not the roots"
        return words.format(**self.summary())


@dataclass(frozen=True, eq=False)
class Assembly:
    """Components joined by contact: the `system` of all rows, component after component.

    It holds for small motions about the seat: `seats` are the contacts under the load,
    `displacements` (n,) those of all rows. `components` are as they were joined, reduced or not,
    and can be joined again.
    """

    system: TermSystem
    components: tuple[Component, ...] = field(repr=False)
    seats: tuple[Seat, ...]
    displacements: Array = field(repr=False)

    @property
    def cutoff(self) -> float:
        """The least cutoff of the components in Hz, infinite if none is reduced."""
        return min(body.cutoff for body in self.components)

    @property
    def reduction(self) -> dict[str, Any] | None:
        """What a JSON object says of a reduction, rows before and after it, cutoff; None if none of
        the components is reduced."""
        rows = sum(body.rows or body.system.n for body in self.components)
        known = {"method": "components", "size": self.system.n, "rows": rows}
        return known | {"cutoff_hz": self.cutoff} if np.isfinite(self.cutoff) else None

    def bounded(self, system: TermSystem, roots: Sequence[Eigenvalue]) -> tuple[Eigenvalue, ...]:
        """Roots of the system at its parameters with the error of the reduction, at least rounding,
        and a rounding raised to it: infinite above the cutoff."""
        top = math.tau * self.cutoff
        some = [e for e in roots if e.value.imag >= 0.0 and abs(e.value) < top]
        known: dict[complex, tuple[float | None, float]] = {}
        if some:
            z, (M, C, _) = np.array([e.value for e in some]), system.at()
            X, Y = (np.array([getattr(e, side) for e in some]).T for side in ("right", "left"))
            slope = np.add.outer(z, z) * (Y.conj().T @ M @ X)
            slope += 0.0 if C is None else Y.conj().T @ C @ X
            moved, steady = movements(z, slope, *self.lack(z, X, Y, system.parameters))
            steady &= (undamped := system.real and not system.C)
            far = np.maximum(moved, assumed_rounding(z, undamped))
            errors = zip(far.tolist(), np.where(steady, 0.0, moved).tolist(), strict=True)
            known = dict(zip(z.tolist(), errors, strict=True))
        known |= {z.conjugate(): error for z, error in known.items()}
        found = []
        for root in roots:
            error, moved_by = known.get(root.value, (None, np.inf))
            unknown_sign = error is not None and moved_by > 0.0 and abs(root.value.real) <= error
            rounding = max(root.rounding, moved_by)
            found.append(replace(root, error=error, rounding=rounding, open=unknown_sign))
        return tuple(found)

    def lack(
        self, roots: ArrayLike, right: ComplexArray, left: ComplexArray, at: Mapping[str, float]
    ) -> tuple[ComplexArray, Array]:
        """What y^H P x (m, m) of modes (n, m) of roots z (m,) at parameters lacks, and how much
        more it may be.

        What a component lacks moves inside with the other nodes held, above the cutoff: K, at the
        component's own parameters, alone meets the residuals there but for what contracts by
        `(|z| / cutoff)^2`.
        """
        z = np.asarray(roots)
        known, energies = np.zeros((len(z), len(z)), complex), np.zeros((2, len(z)))
        ends = np.cumsum([body.system.n for body in self.components])[:-1]
        parts = (np.split(vectors, ends) for vectors in (right, left))
        for body, *vectors in zip(self.components, *parts, strict=True):
            if body.lacks is not None:
                one, *both = body.lack(z, *vectors, at)
                known, energies = known + one, energies + both
        share = (np.abs(z) / (math.tau * self.cutoff)) ** 2
        rights, lefts = np.sqrt(np.abs(energies) * share / (1.0 - share))
        return known, np.outer(lefts, rights)


def assemble(
    components: Sequence[Component],
    contacts: Sequence[Contact],
    parameters: Mapping[str, float] | None = None,
    parameter: str = "mu",
    name: str = "assembly",
    cutoff: float | None = None,
) -> Assembly:
    """Join components by contact, seated under their load, into one system.

    Parameters
    ----------
    components : sequence of Component
        Full or reduced, of different names.
    contacts : sequence of Contact
        Between them.
    parameters : mapping of str to float
        Named numbers; `mu` is 0, `contact` and `tangential` are 1 if left out. The seat is that at
        these values, and stays while an answer varies them.
    parameter, name : str
        The free parameter; what the system is called.
    cutoff : float, optional
        Reduce each component that is not reduced to its nodes in contact and its modes up to this
        frequency in Hz.

    Returns
    -------
    Assembly
        Dense if all components are.

    Raises
    ------
    InputError
        For what does not fit together, if no component is loaded although pairs may open, or if
        all pairs open.
    ComputationError
        If the contact is not settled.

    Examples
    --------
    Two blocks in a row, the second one pressed on the first, which a spring of 3 N/m holds:

    >>> import squeal
    >>> fixed = squeal.Component(squeal.System([[1.0]], K=[[3.0]], name="one"), [1], [2])
    >>> free = squeal.System([[1.0]], K=[[0.0]], name="other")
    >>> pressed = squeal.Component(free, [1], [2], load=[-6.0])
    >>> touch = squeal.Contact(("one", "other"), [(1, 1)], (0, 0, 1), stiffness=2.0)
    >>> found = squeal.assemble([fixed, pressed], [touch])
    >>> found.displacements.tolist(), found.seats[0].forces.tolist()
    ([-2.0, -5.0], [6.0])
    >>> squeal.eigenvalues(found.system).values[::2].imag.round(6)
    array([1.     , 2.44949])
    """
    bodies, known, joints = {body.name: body for body in components}, [], []
    if len(bodies) != len(components) or not contacts:
        raise InputError("an assembly needs contacts, and a name of its own for each component")
    for contact in contacts:
        with Place(f"contact {contact.name}").named():
            known.append(contact.labelled(bodies))
    if cutoff is not None:
        for key, body in bodies.items():
            nodes = [c.pairs[:, c.between.index(key)] for c in known if key in c.between]
            if body.cutoff == np.inf:
                bodies[key] = body.reduced(np.concatenate([[], *nodes]), cutoff)
    for contact in known:
        with Place(f"contact {contact.name}").named():
            joints.append(_joint(contact, bodies))
    own = dict(OWN)
    used: set[str] = set()  # parameters that matrices depend on
    for body in bodies.values():
        for key in used & body.system.names - set(parameters or {}):
            value = body.system.parameters[key]
            if own[key] != value:
                raise InputError(
                    f"components: the parameter {key} is {value:g} in {body.name} and {own[key]:g} "
                    "in another component; matrices of both depend on it, and it must be one number"
                )
        own |= body.system.parameters
        used |= body.system.names
    M, C, K = (_merged(list(bodies.values()), part) for part in range(3))
    structure = TermSystem(M, C, K, own | dict(parameters or {}), parameter, name)
    seats, slopes, displacements = _seated(structure, joints, list(bodies.values()))
    is_large = is_sparse(M[0].matrix)
    springs = list[Term]()
    dampers = list[Term]()
    for joint, seat, slope in zip(joints, seats, slopes, strict=True):
        c = joint.contact
        stick = seat.closed * joint.area * c.tangential
        friction_factor = f"({c.friction}) * ({c.factor})"
        springs += _coupling(joint.normal, slope, joint.normal, c.factor, is_large)
        for rows in joint.across:
            springs += _coupling(rows, stick, rows, "tangential", is_large)
        springs += _coupling(joint.sliding, slope, joint.normal, friction_factor, is_large)
        # the seat's normal forces, which stay as the seat does
        if c.speed:
            turned = seat.forces / joint.radius
            damping_factor = f"({c.friction}) / ({c.speed})"
            dampers += _coupling(joint.across[1], turned, joint.across[1], damping_factor, is_large)
        if c.slope != "0":
            dampers += _coupling(joint.sliding, seat.forces, joint.sliding, c.slope, is_large)
    system = replace(structure, C=(*C, *dampers), K=(*K, *springs))
    return Assembly(system, tuple(bodies.values()), tuple(seats), displacements)


def _coupling(
    left: csr_array, weights: Array, right: csr_array, factor: str, is_large: bool
) -> tuple[Term, ...]:
    """The term of pairs that pull along `left` (m, n) by weights (m,) times what `right` (m, n)
    measures; none where nothing acts."""
    if not left.nnz or not weights.any():
        return ()
    product = left.T @ right.multiply(weights[:, None])
    return (Term(product.tocsc() if is_large else product.toarray(), Formula(factor)),)


def _merged(bodies: Sequence[Component], part: int) -> tuple[Term, ...]:
    """Terms of M, C or K of all components on the rows of all, one for each factor."""
    from scipy.sparse import block_diag, csc_array

    sparse = any(is_sparse(term.matrix) for body in bodies for term in body.system.terms)
    terms: dict[str, tuple[Any, list[Any]]] = {}
    for k, body in enumerate(bodies):
        for term in body.system.parts[part]:
            zeros = [csc_array((b.system.n,) * 2) for b in bodies]
            _, blocks = terms.setdefault(term.factor.text, (term.factor, zeros))
            blocks[k] = blocks[k] + term.matrix
    whole = [(block_diag(blocks, "csc"), factor) for factor, blocks in terms.values()]
    return tuple(Term(A if sparse else A.toarray(), factor) for A, factor in whole)


def _seated(
    structure: TermSystem, joints: Sequence[_Joint], bodies: Sequence[Component]
) -> tuple[list[Seat], list[Array], Array]:
    """The contacts under the load; the stiffness (m,) of their pairs without its factor, zero where
    they are open; and the displacements.

    Newton's method on the laws of the pairs, which with constant stiffness passes from one set of
    closed pairs to the next and ends where it does not change. Once a set returns, one pair changes
    at a time, the first that violates its condition, after which none returns (Murty).
    """
    from scipy.sparse import vstack

    at, K = structure.parameters, structure.at()[2].real
    load = np.concatenate([np.zeros(b.system.n) if b.load is None else b.load for b in bodies])
    if not load.any() and not all(joint.contact.bonded for joint in joints):
        raise InputError("load: missing; pairs that may open are seated under the brake load")
    pushes, columns = [], []
    for joint in joints:
        c = joint.contact
        area = joint.area
        # where it slides friction is all that acts across the normal
        pushes.append(joint.normal + Formula(c.friction).value(at) * joint.sliding)
        stick = 0.0 if joint.sliding.nnz else at["tangential"] * area * c.tangential
        law = area * c.stiffness, c.gap, 0.0 if c.bonded else c.exponent, area * c.reference
        numbers = area, Formula(c.factor).value(at), *law, c.bonded, stick
        columns.append(np.array(np.broadcast_arrays(*numbers), dtype=float))
    areas, factor, k, gap, exponent, reference, bonded, stick = np.hstack(columns)
    normal, push = vstack([joint.normal for joint in joints]), vstack(pushes).T
    across = vstack([joint.across[i] for i in (0, 1) for joint in joints])
    known, closed, h, careful = set[bytes](), np.ones(len(gap), dtype=bool), -gap, False
    forces, slopes, curved = k * h, k, exponent.any()  # without their factor
    for _ in range(100 + len(gap)):
        springs, held = closed * factor * slopes, np.tile(closed * stick, 2)
        A = K + push @ normal.multiply(springs[:, None]) + across.T @ across.multiply(held[:, None])
        u = _solved(A, load + push @ (closed * factor * (forces - slopes * (h + gap))))
        before, h = h, -gap - normal @ u
        pressed = k * np.where(bonded, h, np.maximum(h, 0.0))
        power = ((1 - exponent) * pressed / reference) ** (exponent / (1 - exponent))
        forces, slopes = (1 - exponent) * pressed * power, k * power
        now = (h > 0.0) | (bonded > 0.0)
        if not now.any():
            raise InputError("all pairs open under the load; it must press the components together")
        wrong = np.flatnonzero(now != closed)
        if not len(wrong) and (not curved or np.allclose(h, before, rtol=1e-11, atol=0.0)):
            break
        careful = careful or (len(wrong) > 0 and now.tobytes() in known)
        if careful and not curved:
            now[wrong[1:]] = closed[wrong[1:]]
        known.add(closed.tobytes())
        closed = now
    else:
        raise ComputationError("the contact is not settled: its set of closed pairs keeps changing")
    found = closed, closed * factor * forces, closed * factor * forces / areas, closed * slopes
    ends = np.cumsum([len(joint.area) for joint in joints])[:-1]
    *seated, rates = (np.split(x, ends) for x in found)
    each = [(j.contact, *one) for j, *one in zip(joints, *seated, strict=True)]
    return [Seat(of.name, a, b, c, not of.exponent) for of, a, b, c in each], rates, u


def _solved(A: Matrix, right: Array) -> Array:
    """A^-1 right. Raises InputError where A is singular."""
    from scipy.linalg import LinAlgWarning, solve

    try:
        if is_sparse(A):
            return np.asarray(factorise(A.tocsc()).solve(right))
        size = 1.0 / np.sqrt(divisor(np.abs(np.diag(A))))
        with warnings.catch_warnings():
            warnings.simplefilter("error", LinAlgWarning)
            return np.asarray(size * solve(A * size[:, None] * size, size * right))
    except (ZeroDivisionError, np.linalg.LinAlgError, LinAlgWarning):
        words = "each needs supports, or contact that holds it"
        raise InputError(
            f"nothing holds some motion of the components under the load; {words}"
        ) from None
