"""Components joined by node pairs under the brake load, and the error of their reduction."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import InputError, meant
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import is_sparse
from squeal.linear.system import Term, TermSystem
from squeal.linear.verdicts import assumed_rounding
from squeal.numerics.differentiation import Formula
from squeal.schema import Place
from squeal.sparse.components import Component
from squeal.sparse.contact_seat import (
    Contact,
    PairDirections,
    StaticContact,
    pair_directions,
    seat_contacts,
)
from squeal.sparse.quadratic import (
    Array,
    Changes,
    ComplexArray,
)
from squeal.sparse.reduced_basis import root_error_bounds

if TYPE_CHECKING:
    from scipy.sparse import csr_array

OWN = {"mu": 0.0, "contact": 1.0, "tangential": 1.0}  # parameters of every assembly


class ReductionLack(NamedTuple):
    """What modes of roots (m,) lack by the reduction of the components."""

    known: ComplexArray  # (m, m): missing in y^H P x
    uncertainty: Array  # (m, m): how much more it may be


class _RootError(NamedTuple):
    """How far a root may be off, 1/s."""

    error: float | None  # with rounding; None where it is not known
    by_reduction: float


@dataclass(frozen=True, eq=False)
class Assembly:
    """Components joined by contact: the `system` of all rows, component after component.

    It holds for small motions about the seat: `seats` are the contacts under the load,
    `displacements` (n,) those of all rows. `components` are as they were joined, reduced or not,
    and can be joined again; `joined_at` does so at other values of some parameters.
    `contacts` are those that were given, each with its points.

    Examples
    --------
    >>> import squeal
    >>> fixed = squeal.Component(squeal.System([[1.0]], K=[[3.0]], name="one"), [1], [2])
    >>> free = squeal.System([[1.0]], K=[[0.0]], name="other")
    >>> pressed = squeal.Component(free, [1], [2], load=[-6.0])
    >>> touch = squeal.Contact(("one", "other"), [(1, 1)], (0, 0, 1), stiffness=2.0)
    >>> found = squeal.assemble([fixed, pressed], [touch])
    >>> len(found.components), found.cutoff, found.system.n
    (2, inf, 2)
    """

    system: TermSystem
    components: tuple[Component, ...] = field(repr=False)
    seats: tuple[StaticContact, ...]
    displacements: Array = field(repr=False)
    contacts: tuple[Contact, ...] = field(repr=False)
    joined_at: Callable[[Changes], Assembly] = field(repr=False)

    @property
    def cutoff(self) -> float:
        """The least cutoff of the components in Hz, infinite if none is reduced."""
        return min(body.cutoff for body in self.components)

    @property
    def reduction(self) -> dict[str, Any] | None:
        """What a JSON object says of a reduction, rows before and after it, cutoff; None if none of
        the components is reduced."""
        if not np.isfinite(self.cutoff):
            return None
        return {
            "method": "components",
            "size": self.system.n,
            "rows": sum(body.rows or body.system.n for body in self.components),
            "cutoff_hz": self.cutoff,
        }

    def bounded(self, system: TermSystem, roots: Sequence[Eigenvalue]) -> tuple[Eigenvalue, ...]:
        """Roots of the system at its parameters with the error of the reduction, at least rounding,
        and a rounding raised to it: infinite above the cutoff.

        Examples
        --------
        >>> import squeal
        >>> fixed = squeal.Component(squeal.System([[1.0]], K=[[3.0]], name="one"), [1], [2])
        >>> free = squeal.System([[1.0]], K=[[0.0]], name="other")
        >>> pressed = squeal.Component(free, [1], [2], load=[-6.0])
        >>> touch = squeal.Contact(("one", "other"), [(1, 1)], (0, 0, 1), stiffness=2.0)
        >>> found = squeal.assemble([fixed, pressed], [touch])
        >>> roots = squeal.eigenvalues(found.system).eigenvalues
        >>> [root.error for root in found.bounded(found.system, roots)][:1]  # none is reduced
        [1e-07]
        """
        errors = self._root_errors(system, roots)
        unknown = _RootError(None, math.inf)
        bounded = []
        for root in roots:
            error, by_reduction = errors.get(root.value, unknown)
            is_sign_open = False
            if error is not None and by_reduction > 0.0:
                is_sign_open = abs(root.value.real) <= error
            rounding = max(root.rounding, by_reduction)
            bounded.append(replace(root, error=error, rounding=rounding, open=is_sign_open))
        return tuple(bounded)

    def _root_errors(
        self, system: TermSystem, roots: Sequence[Eigenvalue]
    ) -> dict[complex, _RootError]:
        """The errors of the roots below the cutoff, and of their conjugates."""
        top = math.tau * self.cutoff
        upper = [root for root in roots if root.value.imag >= 0.0 and abs(root.value) < top]
        if not upper:
            return {}
        z = np.array([root.value for root in upper])
        right = np.array([root.right for root in upper]).T
        left = np.array([root.left for root in upper]).T
        M, C, _ = system.at()
        slope = np.add.outer(z, z) * (left.conj().T @ M @ right)
        if C is not None:
            slope += left.conj().T @ C @ right
        lack = self.lack(z, right, left, system.parameters)
        bounds = root_error_bounds(z, slope, lack.known, lack.uncertainty)
        is_undamped = system.real and not system.C
        by_reduction = np.where(bounds.stay_on_axis & is_undamped, 0.0, bounds.errors)
        with_rounding = np.maximum(bounds.errors, assumed_rounding(z, is_undamped))
        errors = {}
        for k, value in enumerate(z.tolist()):
            errors[value] = _RootError(float(with_rounding[k]), float(by_reduction[k]))
            errors[value.conjugate()] = errors[value]
        return errors

    def lack(
        self, roots: ArrayLike, right: ComplexArray, left: ComplexArray, at: Changes
    ) -> ReductionLack:
        """What y^H P x of modes (n, m) of roots z (m,) at parameters lacks.

        What a component lacks moves inside with the other nodes held, above the cutoff: K, at the
        component's own parameters, alone meets the residuals there but for what contracts by
        q = `(|z| / cutoff)^2`. The series of further terms is at most q / (1 - q) of the first.

        Examples
        --------
        >>> import squeal
        >>> fixed = squeal.Component(squeal.System([[1.0]], K=[[3.0]], name="one"), [1], [2])
        >>> free = squeal.System([[1.0]], K=[[0.0]], name="other")
        >>> pressed = squeal.Component(free, [1], [2], load=[-6.0])
        >>> touch = squeal.Contact(("one", "other"), [(1, 1)], (0, 0, 1), stiffness=2.0)
        >>> found = squeal.assemble([fixed, pressed], [touch])
        >>> [root, *_] = squeal.eigenvalues(found.system).eigenvalues
        >>> at = found.system.parameters
        >>> found.lack([root.value], root.right[:, None], root.left[:, None], at).known.tolist()
        [[0j]]
        """
        z = np.asarray(roots)
        known = np.zeros((len(z), len(z)), complex)
        right_energies = np.zeros(len(z))
        left_energies = np.zeros(len(z))
        start = 0
        for body in self.components:
            rows = slice(start, start + body.system.n)
            start = rows.stop
            if body.lacks is not None:
                inside = body.interior_lack(z, right[rows], left[rows], at)
                known = known + inside.known
                right_energies = right_energies + inside.right_energies
                left_energies = left_energies + inside.left_energies
        contraction = (np.abs(z) / (math.tau * self.cutoff)) ** 2
        series = contraction / (1.0 - contraction)
        right_norms = np.sqrt(np.abs(right_energies) * series)
        left_norms = np.sqrt(np.abs(left_energies) * series)
        return ReductionLack(known, np.outer(left_norms, right_norms))


def assemble(
    components: Sequence[Component],
    contacts: Sequence[Contact],
    parameters: Changes | None = None,
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
        For what does not fit together, friction without a direction of sliding, if no component is
        loaded although pairs may open, or if all pairs open.
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
    bodies = {body.name: body for body in components}
    if len(bodies) != len(components) or not contacts:
        raise InputError("an assembly needs contacts, and a name of its own for each component")
    located: list[Contact] = []
    for contact in contacts:
        with Place(f"contact {contact.name}").named():
            located.append(contact.located(bodies))
    if cutoff is not None:
        bodies = {key: _reduced(body, located, cutoff) for key, body in bodies.items()}
    joints: list[PairDirections] = []
    for contact in located:
        with Place(f"contact {contact.name}").named():
            joints.append(pair_directions(contact, bodies))
    joined = list(bodies.values())
    all_parameters = _merged_parameters(joined, parameters or {})
    if parameter not in all_parameters:
        hint = meant(parameter, sorted(all_parameters))
        raise InputError(f"parameter: {parameter} is no parameter; {hint}")
    structure = TermSystem(
        M=_merged(joined, part=0),
        C=_merged(joined, part=1),
        K=_merged(joined, part=2),
        parameters=all_parameters,
        parameter=parameter,
        name=name,
    )
    for contact in located:
        with Place(f"contact {contact.name}").named():
            contact.require_direction(structure.parameters)
    seats, displacements = seat_contacts(structure, joints, joined)
    is_large = is_sparse(structure.M[0].matrix)
    springs: list[Term] = []
    dampers: list[Term] = []
    for joint, static in zip(joints, seats, strict=True):
        springs += _contact_springs(joint, static, is_large)
        dampers += _contact_dampers(joint, static, is_large)
    system = replace(structure, C=(*structure.C, *dampers), K=(*structure.K, *springs))

    def joined_at(changes: Changes) -> Assembly:
        values = {**system.parameters, **changes}
        return assemble(joined, located, values, parameter, name)

    return Assembly(
        system=system,
        components=tuple(joined),
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


def _merged_parameters(bodies: Sequence[Component], given: Changes) -> dict[str, float]:
    """The parameters of all components, then those given. Raises InputError where matrices of two
    components depend on different numbers."""
    parameters = dict(OWN)
    used: set[str] = set()  # parameters that matrices depend on
    for body in bodies:
        for key in (used & body.system.names) - given.keys():
            value = body.system.parameters[key]
            if parameters[key] != value:
                raise InputError(
                    f"components: the parameter {key} is {value:g} in {body.name} and "
                    f"{parameters[key]:g} in another component; matrices of both depend on it, and "
                    "it must be one number"
                )
        parameters |= body.system.parameters
        used |= body.system.names
    return parameters | dict(given)


def _merged(bodies: Sequence[Component], part: int) -> tuple[Term, ...]:
    """Terms of M, C or K of all components on the rows of all, one for each factor."""
    from scipy.sparse import block_diag, csc_array

    is_large = any(is_sparse(term.matrix) for body in bodies for term in body.system.terms)
    blocks = {}
    factors = {}
    for k, body in enumerate(bodies):
        for term in body.system.parts[part]:
            text = term.factor.text
            if text not in factors:
                factors[text] = term.factor
                blocks[text] = [csc_array((b.system.n, b.system.n)) for b in bodies]
            blocks[text][k] = blocks[text][k] + term.matrix
    terms = []
    for text, factor in factors.items():
        matrix = block_diag(blocks[text], "csc")
        terms.append(Term(matrix if is_large else matrix.toarray(), factor))
    return tuple(terms)


def _contact_springs(joint: PairDirections, static: StaticContact, is_large: bool) -> list[Term]:
    """Terms of K: across the normal, along it, and its friction."""
    contact = joint.contact
    tangential = static.closed * joint.area * contact.tangential
    friction = f"({contact.friction}) * ({contact.factor})"
    springs = _coupling(joint.normal, static.stiffness, joint.normal, contact.factor, is_large)
    for rows in joint.across:
        springs += _coupling(rows, tangential, rows, "tangential", is_large)
    return springs + _coupling(joint.sliding, static.stiffness, joint.normal, friction, is_large)


def _contact_dampers(joint: PairDirections, static: StaticContact, is_large: bool) -> list[Term]:
    """Terms of C by the static normal forces: friction turns with the direction of sliding, and
    depends on its speed."""
    contact = joint.contact
    dampers: list[Term] = []
    if contact.speed:
        _, across = joint.across
        friction = f"({contact.friction}) / ({contact.speed})"
        dampers += _coupling(across, static.forces / joint.radius, across, friction, is_large)
    if contact.slope != "0":
        sliding = joint.sliding
        dampers += _coupling(sliding, static.forces, sliding, contact.slope, is_large)
    return dampers


def _coupling(
    left: csr_array, weights: Array, right: csr_array, factor: str, is_large: bool
) -> list[Term]:
    """The term of pairs that pull along `left` (m, n) by weights (m,) times what `right` (m, n)
    measures; none where nothing acts."""
    if not left.nnz or not weights.any():
        return []
    product = left.T @ right.multiply(weights[:, None])
    return [Term(product.tocsc() if is_large else product.toarray(), Formula(factor))]
