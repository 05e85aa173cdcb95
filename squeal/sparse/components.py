"""One body of an assembly: its matrices and nodes, and its Craig-Bampton reduction.

A reduced component keeps the rows of its boundary nodes. Its inside follows the boundary
statically (constraint modes) and moves by its normal modes with the boundary fixed, up to a
frequency. The modes above are represented by their static response to the inertia of the constraint
modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import InputError
from squeal.linear.damping import structure_stiffness
from squeal.linear.matrices import EPS, Matrix, norm_of
from squeal.linear.system import System
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula, Parameters
from squeal.schema import ANY, POSITIVE, Place, refuse_unit
from squeal.sparse.factor import Factor, factorise, modes_near
from squeal.sparse.quadratic import Array, ComplexArray, Indices
from squeal.sparse.reduced_basis import term_weights

if TYPE_CHECKING:
    from scipy.sparse import csc_array

SHARE = 1e-4  # of the energy of a boundary motion: a static response of less energy is left out


@dataclass(frozen=True, eq=False)
class Component:
    """One body of an assembly: its matrices, and which node and direction each row is.

    Parameters
    ----------
    system : System
        M, C and K (n, n), dense or sparse; its name is the component's.
    nodes : array_like (n,)
        Label of the node of each row; empty where a row belongs to none.
    directions : array_like (n,)
        0, 1, 2 for displacements along x, y, z; -1 for rotations and what moves no node.
    places : array_like (n, 3), optional
        Where in m the node of each row lies.
    load : array_like (n,), optional
        Brake load in N (N m for rotations), under which contact is seated.
    rows, cutoff, basis : int, float, array (rows, n)
        Of a reduced component: how many rows it had, up to which frequency in Hz it kept modes, and
        the displacements of those rows.
    residual_flexibility : array (t n, t n) or (2 t n, 2 t n)
        Of a reduced component with t terms, for the errors of roots: W^H K^-1 W inside, in which W
        are the forces that each term exerts there by each column of the basis. If a term is not
        Hermitian, W has the forces of all transposed terms too.

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

    system: System
    nodes: Any = field(repr=False)
    directions: Any = field(repr=False)
    places: Any = field(default=None, repr=False)
    load: Any = field(default=None, repr=False)
    rows: int | None = None
    cutoff: float = np.inf
    basis: Array | None = field(default=None, repr=False)
    residual_flexibility: Any = field(default=None, repr=False)

    def __post_init__(self) -> None:
        n = self.system.n
        # directions are read as floats, so that 0.5 is refused and not cut off to 0
        types = {"nodes": str, "directions": float, "places": float, "load": float}
        for name, type_of_entries in types.items():
            entries = getattr(self, name)
            if entries is None:
                continue
            at = Place(self.name, name)
            refuse_unit(entries, at)
            values: NDArray = np.asarray(entries).astype(type_of_entries)
            shape = (n, 3) if name == "places" else (n,)
            if values.shape != shape:
                raise at.refuse(
                    f"an array {values.shape} is not allowed; the matrices have {n} rows, and it "
                    f"must be {shape}"
                )
            ANY.check(values, Place(self.name), name)
            object.__setattr__(self, name, values)
        unknown = self.directions[~np.isin(self.directions, (-1, 0, 1, 2))]
        if len(unknown):
            raise InputError(
                f"{self.name}: directions: {unknown[0]:g} is not allowed; it must be 0, 1, 2 or -1"
            )
        object.__setattr__(self, "directions", self.directions.astype(int))
        if self.cutoff < np.inf:
            assumption = f"reduced to its modes up to {self.cutoff:g} Hz, which moves roots"
            object.__setattr__(self, "system", self.system.assuming(assumption))

    @property
    def name(self) -> str:
        """What the component is called."""
        return self.system.name

    def rows_of(self, nodes: ArrayLike) -> Indices:
        """The rows (m, 3) of nodes (m,) for displacements along x, y and z, -1 where a node has no
        such row. Raises InputError for a node that is none of the component's, and where several
        rows are one displacement.

        Examples
        --------
        >>> import squeal
        >>> rows = squeal.System([[1, 0], [0, 1]], K=[[2, -1], [-1, 2]], name="plate")
        >>> plate = squeal.Component(rows, [1, 2], [2, 2], places=[[0, 0, 0], [1, 0, 0]])
        >>> plate.rows_of([2]).tolist()  # it moves along z alone
        [[-1, -1, 1]]
        """
        requested = np.asarray(nodes).astype(str)
        labels, label_of_row = np.unique(self.nodes, return_inverse=True)
        # the position of an unknown label is that of some other label
        position = np.minimum(np.searchsorted(labels, requested), len(labels) - 1)
        is_unknown = (labels[position] != requested) | (requested == "")
        if np.any(is_unknown):
            raise InputError(f"{requested[is_unknown][0]} is no node of {self.name}")
        rows = np.full((len(labels), 3), -1)
        moving = np.flatnonzero((self.directions >= 0) & (self.nodes != ""))
        where = (label_of_row[moving], self.directions[moving])
        rows[where] = moving
        # of several rows with one node and direction the last one has replaced the others
        replaced = moving[rows[where] != moving]
        if len(replaced):
            raise InputError(
                f"{self.name}: several rows move the node {self.nodes[replaced[0]]} along "
                f"{'xyz'[self.directions[replaced[0]]]}; one may"
            )
        return rows[position]

    def places_of(self, nodes: ArrayLike) -> Array:
        """Where nodes (m,) lie (m, 3).

        Raises InputError without coordinates, and for a node that is none of the component's.

        Examples
        --------
        >>> import squeal
        >>> rows = squeal.System([[1, 0], [0, 1]], K=[[2, -1], [-1, 2]], name="plate")
        >>> plate = squeal.Component(rows, [1, 2], [2, 2], places=[[0, 0, 0], [1, 0, 0]])
        >>> plate.places_of([2]).tolist()
        [[1.0, 0.0, 0.0]]
        """
        if self.places is None:
            raise InputError(f"{self.name} has no coordinates; they are needed here")
        self.rows_of(nodes)  # which refuses unknown ones
        labels, first_row = np.unique(self.nodes, return_index=True)
        position = np.searchsorted(labels, np.asarray(nodes).astype(str))
        return self.places[first_row[position]]  # each row of a node has its place

    def rotating(
        self, axis: ArrayLike, speed: str | float, values: Parameters, preloaded: bool = False
    ) -> Component:
        """The component seen from a frame that turns with it at constant speed.

        Coriolis forces 2 speed G enter C and centrifugal forces -speed^2 Z enter K, for each term
        of M: G = (M J + J M) / 2 and Z = -(M J^2 + J^2 M) / 2, in which J is the cross product with
        the unit axis at each node. The static centrifugal load, and the stiffness that its stress
        adds, have to come from the finite-element program.

        Parameters
        ----------
        axis : array_like (3,)
            Of the rotation, in its sense, of any length above 0.
        speed : str
            Formula of the speed in rad/s, or a number.
        values : mapping of str to float
            The parameters that the formula names.
        preloaded : bool
            Whether K has the centrifugal forces already, as that of a step about the turning state;
            Coriolis forces alone are then added.

        Raises
        ------
        InputError
            If the axis is not three numbers, or has no length; of a reduced component.

        Examples
        --------
        A mass of 1 kg on springs of 100 N/m, seen from a frame that turns by 2 rad/s:

        >>> import numpy as np, squeal
        >>> mass = squeal.Component(squeal.System(np.eye(2), K=100 * np.eye(2)), [1, 1], [0, 1])
        >>> turned = mass.rotating((0, 0, 1), "speed", {"speed": 2.0})
        >>> squeal.eigenvalues(turned.system).values[::2].imag.round(9).tolist()
        [8.0, 12.0]
        """
        if self.rows is not None:  # the rows of modes belong to no node, but move all
            raise InputError(
                f"{self.name} is reduced, so that no rotation is allowed; rotate the full "
                "component, then reduce it"
            )
        cross = self._cross_product(axis)
        squared = cross @ cross
        formula = Formula(str(speed))
        coriolis: list[Term] = []
        softening: list[Term] = []
        for term in self.system.M:
            by_speed = Formula(f"({formula.text}) * ({term.factor.text})")
            by_square = Formula(f"({formula.text}) * {by_speed.text}")  # speed^2 times the factor
            gyroscopic = partial(_sum_of_products, cross, 1.0)  # 2 G = M J + J M
            centrifugal = partial(_sum_of_products, squared, 0.5)  # -Z
            # the same with |J| bounds the errors of the entries
            gyroscopic_errors = partial(_sum_of_products, abs(cross), 1.0)
            centrifugal_errors = partial(_sum_of_products, abs(squared), 0.5)
            coriolis.append(term.mapped(gyroscopic, gyroscopic_errors, by_speed))
            if not preloaded:
                softening.append(term.mapped(centrifugal, centrifugal_errors, by_square))
        # a name that is left out here may be a parameter of the system already
        needed = {name: values[name] for name in formula.names if name in values}
        system = replace(
            self.system,
            C=(*self.system.C, *coriolis),
            K=(*self.system.K, *softening),
            parameters={**self.system.parameters, **needed},
        )
        return replace(self, system=system)

    def _cross_product(self, axis: ArrayLike) -> csc_array:
        """The sparse matrix J (n, n) of the cross product with a unit axis at each node.

        Rows of rotations and of no node stay zero. Raises InputError for an axis without a length,
        and where several rows are one displacement.
        """
        from scipy.sparse import csc_array

        vector = np.asarray(axis, dtype=float)
        length = np.linalg.norm(vector)
        if vector.shape != (3,) or not 0.0 < length < np.inf:
            raise InputError(f"{self.name}: axis: must be three numbers, with a length")
        x, y, z = vector / length
        # at one node: its product with a displacement u is axis x u
        of_node = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        # (nodes, 3): the row of each node and direction, -1 where it has none
        rows = self.rows_of(np.unique(self.nodes[self.directions >= 0]))
        n = self.system.n
        cross = csc_array((n, n))
        # from displacements along j to products along i, at all nodes that have both directions; a
        # component of the axis that is mere rounding makes no entries
        for i, j in np.argwhere(np.abs(of_node) > EPS):
            have_both = (rows[:, i] >= 0) & (rows[:, j] >= 0)
            where = (rows[have_both, i], rows[have_both, j])
            entries = np.full(np.count_nonzero(have_both), of_node[i, j])
            cross = cross + csc_array((entries, where), shape=(n, n))
        return cross

    def reduced(self, nodes: ArrayLike, cutoff: float) -> Component:
        """The component after Craig-Bampton reduction: all rows of some nodes, and modes up to a
        frequency.

        Modes above the cutoff are represented by their static response to the inertia of the
        constraint modes, for those motions of the boundary to whose energy this response adds more
        than `SHARE` at half the cutoff.

        Parameters
        ----------
        nodes : array_like
            Labels of the nodes that stay: in contact, at mounts, and where motion is observed.
        cutoff : float
            Highest frequency in Hz of the normal modes with these nodes fixed, above 0; twice the
            highest one of interest.

        Returns
        -------
        Component
            Dense, the rows of the nodes first. Every term is projected and keeps its factor; the
            basis is made at the component's own parameters. The unreduced component if all of its
            rows belong to the nodes.

        Raises
        ------
        InputError
            For an unknown node, a cutoff that is not above 0, a component that is reduced already,
            or if these nodes do not hold the component.

        Examples
        --------
        >>> import squeal
        >>> rows = squeal.System([[1, 0], [0, 1]], K=[[2, -1], [-1, 1]], name="chain")
        >>> small = Component(rows, [1, 2], [0, 0]).reduced([2], cutoff=1.0)
        >>> small.rows, small.nodes.tolist()  # a row of node 2, and a mode inside
        (2, ['2', ''])
        """
        POSITIVE.read(cutoff, Place(self.name, "cutoff"))
        if self.cutoff < np.inf:
            raise InputError(f"{self.name}: is reduced already; only a full component is allowed")
        self.rows_of(nodes)  # which refuses unknown ones
        is_boundary = np.isin(self.nodes, np.asarray(nodes).astype(str))
        boundary = np.flatnonzero(is_boundary)
        interior = np.flatnonzero(~is_boundary)
        if not len(interior):
            return self
        factor, basis = self._craig_bampton(boundary, interior, cutoff)
        matrices = [term.matrix for term in self.system.terms]
        if not all(_is_hermitian(A) for A in matrices):
            matrices += [A.conj().T for A in matrices]  # for the residuals of left vectors
        modes = basis.shape[1] - len(boundary)
        places = None
        if self.places is not None:
            places = np.vstack([self.places[boundary], np.zeros((modes, 3))])
        # the rows of modes are inside: they belong to no node ("") and to no direction (-1)
        return Component(
            system=self.system.mapped(partial(_projected, basis), labels=()),
            nodes=[*self.nodes[boundary], *[""] * modes],
            directions=[*self.directions[boundary], *[-1] * modes],
            places=places,
            load=None if self.load is None else basis.T @ self.load,
            rows=self.system.n,  # before the reduction
            cutoff=cutoff,
            basis=basis,
            residual_flexibility=_residual_flexibility(matrices, basis, interior, factor),
        )

    def _craig_bampton(
        self, boundary: Indices, interior: Indices, cutoff: float
    ) -> tuple[Factor, Array]:
        """The factorised K of the interior rows, and the basis (n, d) of the reduction.

        Its columns: the constraint modes (static, by a unit displacement of each boundary row), the
        normal modes up to the cutoff in Hz with the boundary fixed, and the static response of the
        modes above the cutoff to the inertia of the constraint modes. boundary, interior: indices
        of the rows of the nodes that stay, and of all other rows. Raises InputError if the
        component can move freely with the boundary fixed.
        """
        from scipy.linalg import eigh
        from scipy.sparse import csc_array

        stiffness, _ = structure_stiffness(self.system)  # without friction and damping
        mass, _, _ = self.system.at()
        K = csc_array(stiffness)
        M = csc_array(mass)
        inner_K = csc_array(K[interior][:, interior])
        inner_M = csc_array(M[interior][:, interior])
        rounding = 4 * EPS * len(interior) * norm_of(inner_K)
        is_held = False
        with suppress(ZeroDivisionError):  # K is singular: it is not held
            factor = factorise(inner_K)
            # omega^2, and modes of unit modal mass
            squares, modes = _real_modes(inner_K, inner_M, factor, cutoff)
            # the stiffness of each mode, omega^2 |M|, must exceed rounding of K
            is_held = bool(np.all(squares * norm_of(inner_M) > rounding))
        if not is_held:
            raise InputError(f"{self.name}: the nodes in contact do not hold it; it needs supports")
        constraint = _unit_columns(self.system.n, boundary)
        constraint[interior] = -factor.solve(K[interior][:, boundary].toarray())
        # the static response K^-1 M constraint of all modes inside, less that of the modes up to
        # the cutoff
        static = factor.solve((M @ constraint)[interior])
        static -= modes @ (modes.T @ (inner_M @ static))
        # the response is kept for motions v of the boundary to whose energy it adds a share above
        # SHARE at half of the cutoff. To a boundary motion v at omega the inside responds by
        # omega^2 static v, of the energy omega^4 v^T static^T K static v. This over the energy of
        # constraint v is a Rayleigh quotient: its stationary values are the eigenvalues `shares`
        omega = np.pi * cutoff  # rad/s, of cutoff / 2
        energy_of_constraint = constraint.T @ (K @ constraint)
        energy_of_constraint += omega**2 * (constraint.T @ (M @ constraint))
        shares, motions = eigh(omega**4 * (static.T @ (inner_K @ static)), energy_of_constraint)
        static = static @ motions[:, shares > SHARE]
        static /= np.sqrt(np.sum(static * (inner_M @ static), axis=0))  # to unit modal mass
        inside = np.zeros((self.system.n, modes.shape[1] + static.shape[1]))
        inside[interior] = np.hstack([modes, static])
        return factor, np.hstack([constraint, inside])

    def interior_truncation(
        self, z: ComplexArray, right: ComplexArray, left: ComplexArray, parameters: Parameters
    ) -> InteriorTruncation:
        """S^H K^-1 R and the energies R^H K^-1 R and S^H K^-1 S of the residuals R and S that modes
        leave on the interior rows, where the truncated motions are.

        `residual_flexibility` holds W^H K^-1 W of the forces W that each term exerts inside by each
        column of the basis. The residuals are sums of these forces, R = W r and S = W s: r has the
        modes x times the weights (factor and power of z) of each term in P, s has the modes y times
        the conjugate weights.

        Parameters
        ----------
        z : ndarray (m,)
            Roots, rad/s.
        right, left : ndarray (n, m)
            Their modes x and y on the rows of the reduced component; R = P x and S = P^H y.
        parameters : mapping of str to float
            All of them.

        Examples
        --------
        >>> import numpy as np, squeal
        >>> K = np.array([[2.0, -1.0], [-1.0, 1.0]])
        >>> chain = Component(squeal.System(np.eye(2), K=K), [1, 2], [0, 0])
        >>> small = chain.reduced([2], cutoff=0.3)  # which keeps all modes: nothing is truncated
        >>> [root, *_] = squeal.eigenvalues(small.system).eigenvalues
        >>> z = np.array([root.value])
        >>> vectors = root.right[:, None], root.left[:, None]
        >>> truncation = small.interior_truncation(z, *vectors, small.system.parameters)
        >>> truncation.value.real.round(9).tolist()
        [[0.0]]
        """
        weights = term_weights(self.system, parameters, z)[:, None]  # (terms, 1, m)
        r = (weights * right).reshape(-1, len(z))  # (terms n, m)
        s = (weights.conj() * left).reshape(-1, len(z))
        if len(self.residual_flexibility) > len(r):
            # W = [forces of the terms, forces of the transposed terms]: R is a sum of the first
            # half, S of the second one
            r = np.vstack([r, np.zeros_like(r)])
            s = np.vstack([np.zeros_like(s), s])
        solved_r = self.residual_flexibility @ r
        solved_s = self.residual_flexibility @ s
        return InteriorTruncation(
            value=s.conj().T @ solved_r,
            right_energies=np.sum(r.conj() * solved_r, axis=0).real,
            left_energies=np.sum(s.conj() * solved_s, axis=0).real,
        )


class InteriorTruncation(NamedTuple):
    """Products of the residuals R and S of m modes inside a reduced component with K^-1 there."""

    value: ComplexArray  # S^H K^-1 R (m, m)
    right_energies: Array  # diagonal of R^H K^-1 R (m,)
    left_energies: Array  # diagonal of S^H K^-1 S (m,)


def _residual_flexibility(
    matrices: Sequence[Matrix], basis: Array, interior: Indices, factor: Factor
) -> Array:
    """The array (t d, t d) of blocks V^T A^H K^-1 B V for all pairs A, B of t matrices (n, n).

    V is the basis (n, d). A V and B V are forces on the rows inside alone, since truncated motions
    move no boundary row; K^-1 is the inverse of K inside, whose factor is `factor`. interior: the
    rows inside.
    """
    from scipy.sparse import csc_array

    rows_inside = [csc_array(A)[interior] for A in matrices]
    displacements = [factor.solve(B @ basis) for B in rows_inside]
    blocks = []
    for A in rows_inside:
        blocks.append([basis.T @ (A.conj().T @ x) for x in displacements])
    return np.block(blocks)


def _sum_of_products(J: csc_array, factor: float, X: Matrix) -> Matrix:
    """factor (X J + J X), which is dense if X is."""
    return factor * (X @ J + J @ X)


def _projected(basis: Array, term: Term) -> Term:
    """The term V^T A V of a real basis V (n, d), with its factor."""
    # the same with |V| bounds the errors of the entries
    return term.mapped(partial(_onto, basis), partial(_onto, np.abs(basis)))


def _onto(V: Array, A: Matrix) -> Matrix:
    """The projection V^T A V (d, d)."""
    return V.T @ (A @ V)


def _unit_columns(n: int, rows: Indices) -> Array:
    """Columns (n, m) that are one in a row each."""
    columns = np.zeros((n, len(rows)))
    columns[rows, np.arange(len(rows))] = 1.0
    return columns


def _is_hermitian(A: Matrix) -> bool:
    """Whether a matrix is Hermitian to half of the digits of a double."""
    return norm_of(A - A.conj().T) <= np.sqrt(EPS) * norm_of(A)


def _real_modes(K: csc_array, M: csc_array, factor: Factor, cutoff: float) -> tuple[Array, Array]:
    """Squared frequencies (k,) in (rad/s)^2 and modes (n, k) with unit mass up to a cutoff in Hz.

    By shift-and-invert Lanczos with the factor of K, for 24 modes and then for twice as many each
    time, until one lies above the cutoff. Once that would be a quarter of the rows or more, by a
    dense solver. Raises ZeroDivisionError if that finds K not positive definite.
    """
    from scipy.linalg import eigh

    n = K.shape[0]
    limit = (2 * np.pi * cutoff) ** 2
    count = 24
    while 4 * count < n:
        squares, modes = modes_near(K, M, 0.0, count, factor, seed=n)
        if squares.max() > limit:
            return squares[squares <= limit], modes[:, squares <= limit]
        count *= 2
    try:  # M x = K x / square, since M may be singular and K is not
        inverses, modes = eigh(M.toarray(), K.toarray(), subset_by_value=(1 / limit, np.inf))
    except np.linalg.LinAlgError:  # K is not definite
        raise ZeroDivisionError from None
    return 1 / inverses, modes / np.sqrt(inverses)  # from x^T K x = 1 to x^T M x = 1
