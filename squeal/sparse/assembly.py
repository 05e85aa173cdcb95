"""Components joined by node pairs under the brake load, and the error of their reduction."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import InputError, suggestion
from squeal.linear.eigen import Eigenvalue, arrays_of
from squeal.linear.matrices import Matrix, is_sparse
from squeal.linear.system import System
from squeal.linear.terms import Term, sum_of_terms
from squeal.linear.verdicts import assumed_rounding
from squeal.numerics.differentiation import Formula, Parameters
from squeal.schema import Place
from squeal.sparse.components import Component
from squeal.sparse.contact_seat import (
    Contact,
    PairDirections,
    StaticContact,
    pair_directions,
    seat_contacts,
)
from squeal.sparse.quadratic import Array, ComplexArray
from squeal.sparse.reduced_basis import TruncationTerm, root_error_bounds

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

ASSEMBLY_DEFAULTS = {"mu": 0.0, "contact": 1.0, "tangential": 1.0}  # parameters of every assembly


class _RootError(NamedTuple):
    """How far a root may be off, rad/s."""

    error: float | None  # by reduction and rounding; None where it is not known
    growth_error: float  # by the reduction alone, of Re lambda: 0 where the root stays on the axis


@dataclass(frozen=True, eq=False)
class Assembly:
    """Components joined by contact: the `seated_system` of all rows, component after component.

    It holds for small motions about the seat: `seats` are the contacts under the load, and
    `displacements` (n,) what the load moves all rows by, in m. `components` are as they were
    joined, reduced or not; `contacts` are those between them, each with its points. `joined_at`
    joins the components again, seated at other values of some parameters.

    Examples
    --------
    >>> import squeal
    >>> fixed = squeal.Component(squeal.System([[1.0]], K=[[3.0]], name="one"), [1], [2])
    >>> free = squeal.System([[1.0]], K=[[0.0]], name="other")
    >>> pressed = squeal.Component(free, [1], [2], load=[-6.0])
    >>> touch = squeal.Contact(("one", "other"), [(1, 1)], (0, 0, 1), stiffness=2.0)
    >>> joined = squeal.assemble([fixed, pressed], [touch])
    >>> len(joined.components), joined.cutoff, joined.system.n
    (2, inf, 2)
    """

    seated_system: System
    components: tuple[Component, ...] = field(repr=False)
    seats: tuple[StaticContact, ...]
    displacements: Array = field(repr=False)
    contacts: tuple[Contact, ...] = field(repr=False)
    joined_at: Callable[[Parameters], Assembly] = field(repr=False)

    @property
    def system(self) -> System:
        """The system, to be used without its components, which alone can seat contact anew: that
        contact is held is an assumption then, if it may change."""
        system = self.seated_system
        if not self.contacts_that_may_change:
            return system
        value = system.parameters[system.parameter]
        return system.assuming(f"contact is held as it is seated at {system.parameter} = {value:g}")

    @property
    def contacts_that_may_change(self) -> list[Contact]:
        """Contacts whose matrices depend on their normal forces.

        Some of their pairs are open or stiffen with the force, or their forces damp.
        """
        changing = []
        for contact, seat in zip(self.contacts, self.seats, strict=True):
            is_fixed = seat.constant and seat.closed.all()
            if not is_fixed or contact.is_damped:
                changing.append(contact)
        return changing

    @property
    def cutoff(self) -> float:
        """The least cutoff of the components in Hz, infinite if none is reduced."""
        return min(body.cutoff for body in self.components)

    @property
    def reduction(self) -> dict[str, Any] | None:
        """What a JSON object says of the reduction: method, rows after it and before it, cutoff in
        Hz; None if none of the components is reduced."""
        if not np.isfinite(self.cutoff):
            return None
        return {
            "method": "components",
            "size": self.seated_system.n,
            "rows": sum(body.rows or body.system.n for body in self.components),
            "cutoff_hz": self.cutoff,
        }

    def bounded(self, system: System, roots: Sequence[Eigenvalue]) -> tuple[Eigenvalue, ...]:
        """Roots of the system with the error that the reduction of the components brings.

        Parameters
        ----------
        system : System
            That of the assembly, at the values at which its roots were computed.
        roots : sequence of Eigenvalue
            With right and left vectors.

        Returns
        -------
        tuple of Eigenvalue
            The same roots, with three changes. `error` (rad/s) is how far the reduction, or
            rounding if that is more, may have moved the root. `rounding` is at least the error of
            the growth rate by the reduction. `sign_is_open` says that |Re lambda| is at most the
            error, unless the root is known to stay on the axis. Above the cutoff nothing is known:
            `error` is None, `rounding` infinite, and `sign_is_open` False.

        Examples
        --------
        >>> import squeal
        >>> fixed = squeal.Component(squeal.System([[1.0]], K=[[3.0]], name="one"), [1], [2])
        >>> free = squeal.System([[1.0]], K=[[0.0]], name="other")
        >>> pressed = squeal.Component(free, [1], [2], load=[-6.0])
        >>> touch = squeal.Contact(("one", "other"), [(1, 1)], (0, 0, 1), stiffness=2.0)
        >>> joined = squeal.assemble([fixed, pressed], [touch])
        >>> roots = squeal.eigenvalues(joined.system).eigenvalues
        >>> [root.error for root in joined.bounded(joined.system, roots)][:1]  # none is reduced
        [1e-07]
        """
        errors = self._root_errors(system, roots)
        unknown = _RootError(error=None, growth_error=math.inf)
        bounded = []
        for root in roots:
            error, growth_error = errors.get(root.value, unknown)
            is_sign_open = False
            # a growth error of 0 says that the root is known to stay on the axis
            if error is not None and growth_error > 0.0:
                is_sign_open = abs(root.value.real) <= error
            rounding = max(root.rounding, growth_error)
            bounded.append(replace(root, error=error, rounding=rounding, sign_is_open=is_sign_open))
        return tuple(bounded)

    def _root_errors(
        self, system: System, roots: Sequence[Eigenvalue]
    ) -> dict[complex, _RootError]:
        """The errors of the roots below the cutoff and of their conjugates, by the root."""
        top = math.tau * self.cutoff  # rad/s
        upper = [root for root in roots if root.value.imag >= 0.0 and abs(root.value) < top]
        if not upper:
            return {}
        z, right, left = arrays_of(upper, system.n)
        M, C, _ = system.at()
        # y_i^H ((z_i + z_j) M + C) x_j: the divided difference (P(z_i) - P(z_j)) / (z_i - z_j)
        slope = np.add.outer(z, z) * (left.conj().T @ M @ right)
        if C is not None:
            slope += left.conj().T @ C @ right
        # (m, m) each: the term, and how far an entry of it may be off
        truncation = self.truncation_term(z, right, left, system.parameters)
        bounds = root_error_bounds(z, slope, *truncation)
        # of an undamped system a root that meets no other one moves along the imaginary axis
        growth_errors = np.where(bounds.stay_on_axis & system.undamped, 0.0, bounds.errors)
        with_rounding = np.maximum(bounds.errors, assumed_rounding(z, system.undamped))
        errors = {}
        for k, value in enumerate(z.tolist()):
            errors[value] = _RootError(
                error=float(with_rounding[k]), growth_error=float(growth_errors[k])
            )
            errors[value.conjugate()] = errors[value]
        return errors

    def truncation_term(
        self, roots: ArrayLike, right: ComplexArray, left: ComplexArray, parameters: Parameters
    ) -> TruncationTerm:
        """What truncated motions of the reduced components subtract from y_i^H P x_j: S^H P^-1 R.

        Truncated motions are eliminated from P (a Schur complement); R = P x and S = P^H y are the
        residuals of the modes inside the components. `value` is S^H K^-1 R, the first term of the
        Neumann series of P^-1 about K, that of the component's own parameters. Truncated motions
        lie above the cutoff, so that each further term is at most q = (|z| / cutoff)^2 times the
        one before, with the cutoff in rad/s: all further terms together, the `uncertainty`, are at
        most q / (1 - q) times the product of the energy norms of R and S.

        Parameters
        ----------
        roots : array_like (m,)
            z in rad/s. From the cutoff on the uncertainty is infinite or NaN.
        right, left : ndarray (n, m)
            Their modes x and y, on the rows of the assembly.
        parameters : mapping of str to float
            All of them.

        Examples
        --------
        >>> import squeal
        >>> fixed = squeal.Component(squeal.System([[1.0]], K=[[3.0]], name="one"), [1], [2])
        >>> free = squeal.System([[1.0]], K=[[0.0]], name="other")
        >>> pressed = squeal.Component(free, [1], [2], load=[-6.0])
        >>> touch = squeal.Contact(("one", "other"), [(1, 1)], (0, 0, 1), stiffness=2.0)
        >>> joined = squeal.assemble([fixed, pressed], [touch])
        >>> [root, *_] = squeal.eigenvalues(joined.system).eigenvalues
        >>> x = root.right[:, None]
        >>> y = root.left[:, None]
        >>> joined.truncation_term([root.value], x, y, joined.system.parameters).value.tolist()
        [[0j]]
        """
        z = np.asarray(roots)
        value = np.zeros((len(z), len(z)), complex)
        right_energies = np.zeros(len(z))
        left_energies = np.zeros(len(z))
        start = 0
        for body in self.components:
            rows = slice(start, start + body.system.n)  # of the assembly, component by component
            start = rows.stop
            if body.residual_flexibility is not None:
                inside = body.interior_truncation(z, right[rows], left[rows], parameters)
                value = value + inside.value
                right_energies = right_energies + inside.right_energies
                left_energies = left_energies + inside.left_energies
        contraction = (np.abs(z) / (math.tau * self.cutoff)) ** 2  # q
        # an entry is a product of two norms (Cauchy-Schwarz), each with the square root of the
        # series of its root; an energy that is zero may be computed below zero
        with np.errstate(divide="ignore", invalid="ignore"):  # from the cutoff on
            series = contraction / (1.0 - contraction)
            right_norms = np.sqrt(np.abs(right_energies) * series)
            left_norms = np.sqrt(np.abs(left_energies) * series)
        return TruncationTerm(value, np.outer(left_norms, right_norms))


def assemble(
    components: Sequence[Component],
    contacts: Sequence[Contact],
    parameters: Parameters | None = None,
    parameter: str = "mu",
    name: str = "assembly",
    cutoff: float | None = None,
) -> Assembly:
    """Join components by contact, seated under their load, into one system.

    The points of each contact are located, components are reduced if a `cutoff` is given, and
    contact is seated on the components side by side; its springs and dampers become terms of K
    and C.

    Parameters
    ----------
    components : sequence of Component
        Full or reduced, of different names.
    contacts : sequence of Contact
        Between them.
    parameters : mapping of str to float
        Named numbers; `mu` is 0, `contact` and `tangential` are 1 if left out. Contact is seated at
        these values, and not again when an analysis of the system varies a parameter.
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
        For two components of one name, without a contact, for a contact that does not fit its
        components or has friction without a direction of sliding, for a `parameter` that is none,
        if no component is loaded although pairs may open, if all pairs open, and if nothing holds
        a component.
    ComputationError
        If the search for the closed pairs does not end.

    Examples
    --------
    Two blocks in a row, the second one pressed on the first, which a spring of 3 N/m holds:

    >>> import squeal
    >>> fixed = squeal.Component(squeal.System([[1.0]], K=[[3.0]], name="one"), [1], [2])
    >>> free = squeal.System([[1.0]], K=[[0.0]], name="other")
    >>> pressed = squeal.Component(free, [1], [2], load=[-6.0])
    >>> touch = squeal.Contact(("one", "other"), [(1, 1)], (0, 0, 1), stiffness=2.0)
    >>> joined = squeal.assemble([fixed, pressed], [touch])
    >>> joined.displacements.tolist(), joined.seats[0].forces.tolist()
    ([-2.0, -5.0], [6.0])
    >>> squeal.eigenvalues(joined.system).values[::2].imag.round(6)
    array([1.     , 2.44949])
    """
    bodies_by_name = {body.name: body for body in components}
    if len(bodies_by_name) != len(components) or not contacts:
        raise InputError("an assembly needs contacts, and a name of its own for each component")
    located: list[Contact] = []  # the contacts, each with its pairs of points
    for contact in contacts:
        with Place(f"contact {contact.name}").prefixing_errors():
            located.append(contact.located(bodies_by_name))
    if cutoff is not None:
        for key, body in bodies_by_name.items():
            bodies_by_name[key] = _reduced(body, located, cutoff)
    pair_sets: list[PairDirections] = []
    for contact in located:
        with Place(f"contact {contact.name}").prefixing_errors():
            pair_sets.append(pair_directions(contact, bodies_by_name))
    bodies = list(bodies_by_name.values())
    all_parameters = _merged_parameters(bodies, parameters or {})
    if parameter not in all_parameters:
        hint = suggestion(parameter, sorted(all_parameters))
        raise InputError(f"parameter: {parameter} is no parameter; {hint}")
    structure = System(  # the components side by side, without contact
        M=_merged(bodies, part=0),
        C=_merged(bodies, part=1),
        K=_merged(bodies, part=2),
        parameters=all_parameters,
        parameter=parameter,
        name=name,
        assumptions=_merged_assumptions(bodies),
    )
    for contact in located:
        with Place(f"contact {contact.name}").prefixing_errors():
            contact.require_direction(structure.parameters)
    seats, displacements = seat_contacts(structure, pair_sets, bodies)
    is_large = is_sparse(structure.M[0].matrix)
    springs: list[Term] = []
    dampers: list[Term] = []
    for pairs, static in zip(pair_sets, seats, strict=True):
        springs += _contact_springs(pairs, static, is_large)
        dampers += _contact_dampers(pairs, static, is_large)
    system = replace(structure, C=(*structure.C, *dampers), K=(*structure.K, *springs))
    if structure.digits is not None and any(contact.has_seat for contact in located):
        system = system.assuming(
            f"contact is seated on components that are known to {structure.digits} digits"
        )

    def joined_at(changes: Parameters) -> Assembly:
        # the bodies are reduced already: no cutoff
        return assemble(bodies, located, {**system.parameters, **changes}, parameter, name)

    return Assembly(
        seated_system=system,
        components=tuple(bodies),
        seats=tuple(seats),
        displacements=displacements,
        contacts=tuple(located),
        joined_at=joined_at,
    )


def _reduced(body: Component, contacts: Sequence[Contact], cutoff: float) -> Component:
    """A component reduced to its nodes in contact, unless it is reduced already."""
    if body.cutoff < math.inf:
        return body
    nodes: list[str] = []
    for contact in contacts:
        if body.name in contact.between:
            nodes += contact.pairs.nodes(contact.between.index(body.name)).tolist()
    return body.reduced(nodes, cutoff)


def _merged_parameters(bodies: Sequence[Component], overrides: Parameters) -> dict[str, float]:
    """The parameters of an assembly: `overrides` before those of the components, and these before
    the defaults.

    If several components have a parameter, its value is that of the first component whose matrices
    depend on it or, if no matrices do, that of the last component. Raises InputError if matrices of
    two components depend on a parameter and its values differ, unless it is overridden.
    """
    parameters = dict(ASSEMBLY_DEFAULTS)
    used: set[str] = set()  # parameters that matrices of the components so far depend on
    for body in bodies:
        names = body.system.names
        for key, value in body.system.parameters.items():
            if key not in used:
                parameters[key] = value
                continue
            is_needed_twice = key in names and key not in overrides
            if is_needed_twice and parameters[key] != value:
                raise InputError(
                    f"components: the parameter {key} is {value:g} in {body.name} and "
                    f"{parameters[key]:g} in another component; matrices of both depend on it, and "
                    "it must be one number"
                )
        used |= names
    return parameters | dict(overrides)


def _merged_assumptions(bodies: Sequence[Component]) -> tuple[str, ...]:
    """What was assumed of each component, with its name."""
    assumptions = []
    for body in bodies:
        assumptions += [f"{body.name}: {assumption}" for assumption in body.system.assumptions]
    return tuple(assumptions)


def _merged(bodies: Sequence[Component], part: int) -> tuple[Term, ...]:
    """Block-diagonal terms of M, C or K (part 0, 1 or 2) of all components.

    There is one for each formula: it holds the terms with this formula of all components.
    """
    from scipy.sparse import csc_array

    is_large = any(is_sparse(term.matrix) for body in bodies for term in body.system.terms)
    rows = sum(body.system.n for body in bodies)
    placed: dict[str, list[Term]] = {}  # terms on the rows of the assembly, by their formula
    start = 0
    for body in bodies:
        for term in body.system.parts[part]:
            on_all_rows = term.mapped(partial(_on_rows, start=start, rows=rows))
            placed.setdefault(term.factor.text, []).append(on_all_rows)
        start += body.system.n
    terms = []
    for terms_of_formula in placed.values():
        matrix = csc_array((rows, rows))
        for term in terms_of_formula:
            matrix = matrix + term.matrix
        if not is_large:
            matrix = matrix.toarray()
        # with the terms `sum_of_terms` takes over how precisely their entries are known
        weighted = [(1.0, term) for term in terms_of_formula]
        terms.append(sum_of_terms(matrix, terms_of_formula[0].factor, weighted))
    return tuple(terms)


def _on_rows(matrix: Matrix, start: int, rows: int) -> csc_array:
    """The sparse matrix (rows, rows) with another one on its diagonal, from row `start` on."""
    from scipy.sparse import coo_array

    entries = coo_array(matrix)
    positions = (entries.row + start, entries.col + start)
    return coo_array((entries.data, positions), shape=(rows, rows)).tocsc()


def _contact_springs(pairs: PairDirections, static: StaticContact, is_large: bool) -> list[Term]:
    """Terms of K of the closed pairs: normal springs, tangential springs in both directions across
    the normal, and the friction along sliding that the normal springs cause.

    The tangential springs act on small motions about the seat, also along sliding: only the static
    solution of a sliding contact is without them. is_large: the matrices are sparse.
    """
    contact = pairs.contact
    tangential = static.closed * pairs.area * contact.tangential
    friction = f"({contact.friction}) * ({contact.factor})"
    # static.stiffness is zero where a pair is open, and does not hold the factor yet
    normal = (static.stiffness, static.stiffness_errors)
    springs = _coupling(pairs.normal, *normal, pairs.normal, contact.factor, is_large)
    for direction in pairs.across:
        springs += _coupling(
            direction, tangential, np.zeros(len(tangential)), direction, "tangential", is_large
        )
    # a pair that opens by u along the normal loses the friction mu k u along sliding
    springs += _coupling(pairs.sliding, *normal, pairs.normal, friction, is_large)
    return springs


def _contact_dampers(pairs: PairDirections, static: StaticContact, is_large: bool) -> list[Term]:
    """Terms of C by friction of the static normal forces N.

    A small velocity across the sliding turns the direction of friction, which damps by mu N / v at
    the sliding speed v. A small velocity along it changes the coefficient of friction, which damps
    by (d mu / dv) N. The forces N hold the factor of the normal stiffness already, and are zero
    where a pair is open. is_large: the matrices are sparse.
    """
    contact = pairs.contact
    dampers: list[Term] = []
    if contact.speed:  # empty where the contact names no speed
        _, across = pairs.across  # the first direction is along sliding, the second across it
        # v = speed radius: the radius is 1 if `speed` is in m/s; if it is in rad/s, the radius is
        # the distance from the axis in m
        friction = f"({contact.friction}) / ({contact.speed})"
        forces = (static.forces / pairs.radius, static.force_errors / pairs.radius)
        # forces across the sliding, by velocities across it
        dampers += _coupling(across, *forces, across, friction, is_large)
    if contact.slope != "0":  # the default, of friction that does not depend on speed
        sliding = pairs.sliding
        # the slope is by v in m/s, about an axis too: no radius here
        forces = (static.forces, static.force_errors)
        dampers += _coupling(sliding, *forces, sliding, contact.slope, is_large)
    return dampers


def _coupling(
    force: csr_array,
    weights: Array,
    errors: Array,
    displacement: csr_array,
    factor: str,
    is_large: bool,
) -> list[Term]:
    """The term force^T diag(weights) displacement times a factor; none if the product is empty.

    At each of the m pairs a row of `displacement` (m, n) times the displacements of all rows is a
    relative displacement. This times the weight (m,) of the pair, a stiffness or damping, is a
    force, which acts on the rows as the pair's row of `force` (m, n) says. The errors (m,) of the
    weights leave each entry open by no more than the rounding of the term.
    """
    if not force.nnz or not weights.any():
        return []
    product = force.T @ displacement.multiply(weights[:, None])
    rounding = float((abs(force).T @ abs(displacement).multiply(errors[:, None])).max())
    matrix = product.tocsc() if is_large else product.toarray()
    return [Term(matrix, Formula(factor), rounding=rounding)]
