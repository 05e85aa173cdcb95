"""Parametrised systems M(p) q'' + C(p) q' + K(p) q = 0, each matrix a sum of terms.

A factor of a term (see `terms`) may depend on the frequency. Where this has no value of its own, it
is that of each root, |Im lambda|: the roots are then those of a nonlinear eigenproblem.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError, suggestion, within_doubles
from squeal.linear.labels import Label, row_name, rows_in_words
from squeal.linear.matrices import (
    MCK,
    Array,
    Matrix,
    dense,
    dense_matrices,
    has_symmetry,
    is_sparse,
)
from squeal.linear.moduli import FREQUENCY, Modulus
from squeal.linear.supports import support_rows, supports_warning
from squeal.linear.terms import SystemMatrix, Term, are_terms, read_terms
from squeal.linear.units import row_units
from squeal.numerics.differentiation import Parameters
from squeal.schema import ANY, TEXT, Place, instance, kind_of

if TYPE_CHECKING:
    from control import StateSpace


CHANGES = instance(Mapping, "a mapping of parameters to values, such as {'mu': 0.3}")


@dataclass(frozen=True, eq=False, init=False, repr=False)
class System:
    """A system M q'' + C q' + K q = 0 from arrays in memory, each matrix a sum of terms.

    Rows that a penalty on the diagonal of K holds are supports: they are left out with a warning.
    Terms are taken as they are, with all their rows.

    Parameters
    ----------
    M, C, K : array_like (n, n), SciPy sparse array, mapping of formulas to such, or tuple of Term
        A mapping holds terms by their factors, formulas of the parameters, such as
        ``{"1": K0, "mu": K1}``. C may be left out (undamped). Data frames of pandas and data arrays
        of xarray must have the same labels, which name the rows in answers.
    parameters : mapping of str to float
        Named numbers that the factors depend on; the free parameter is 0 if it is not among them.
    parameter : str
        The free parameter, in which thresholds lie.
    name : str
        What the system is called.
    follows : tuple of str
        Which of `omega` and `frequency` are those of each root: those that factors depend on and
        `parameters` does not name.
    assumptions : tuple of str
        What was guessed, left out or approximated when it was made; nothing is certified after it.
        A system that is made from it has them too.
    labels : iterable of hashable
        Of the first rows or of all: those of data frames, or (node, degree of freedom) of files.

    Raises
    ------
    InputError
        If matrices differ in shape, or a factor names no parameter.
    ComputationError
        If numbers are beyond double precision.

    Examples
    --------
    >>> K0, K1 = [[2, -1], [-1, 2]], [[0, 4 / 3], [0, 0]]
    >>> coupled = System([[1, 0], [0, 1]], K={"1": K0, "mu": K1})
    >>> coupled.n, coupled.parameter
    (2, 'mu')

    The same from terms:

    >>> import numpy as np
    >>> from squeal.numerics.differentiation import Formula
    >>> friction = Term(np.array([[0.0, 1.0], [0.0, 0.0]]), Formula("4/3 * mu"))
    >>> K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    >>> system = System((Term(np.eye(2)),), (), (Term(K), friction))
    >>> system(0.75)[2].tolist()
    [[2.0, 0.0], [-1.0, 2.0]]
    >>> system.derivative("mu")[2].round(3).tolist()
    [[0.0, 1.333], [0.0, 0.0]]
    """

    M: tuple[Term, ...]
    C: tuple[Term, ...]
    K: tuple[Term, ...]
    parameters: Mapping[str, float]
    parameter: str
    name: str
    follows: tuple[str, ...]
    assumptions: tuple[str, ...]
    labels: tuple[Label, ...]

    def __init__(
        self,
        M: SystemMatrix,
        C: SystemMatrix | None = None,
        K: SystemMatrix | None = None,
        parameters: Mapping[str, float] | None = None,
        parameter: str = "mu",
        name: str = "system",
        follows: tuple[str, ...] = (),
        assumptions: tuple[str, ...] = (),
        labels: Iterable[Label] = (),
    ) -> None:
        if K is None:
            raise InputError("System: K: missing; it must be a matrix or map formulas to matrices")
        arguments: dict[str, SystemMatrix] = {
            "M": () if M is None else M,  # without terms `_complete_parameters` refuses it
            "C": () if C is None else C,
            "K": K,
        }
        from_terms = all(map(are_terms, arguments.values()))
        if not from_terms:  # terms come from readers of files, which check these three
            if parameters is not None:
                where = Place("System", "parameters")
                parameters = kind_of(Mapping[str, float]).read(parameters, where)
            parameter = TEXT.read(parameter, Place("System", "parameter"))
            name = TEXT.read(name, Place("System", "name"))
        # `vars`, as the attributes of a frozen class cannot be assigned
        vars(self).update(
            parameters=parameters or {},
            parameter=parameter,
            name=name,
            follows=follows,
            assumptions=assumptions,
        )
        with within_doubles():
            parts, labels_of_frames = read_terms(arguments)  # parts: the attributes M, C and K
            vars(self).update(parts, labels=tuple(labels) or labels_of_frames)
            self._complete_parameters()
            self._check_terms()
            if from_terms:  # terms are taken with all their rows
                return
            reduced, supports = without_supports(self)
        others = self.parameters.keys() - {parameter}
        warn_of_unused_parameters(others, self, Place("System", "parameters"))
        if supports.size:
            Place("System", "K").warn(supports_warning(supports, self.labels))
            vars(self).update(vars(reduced))

    def _complete_parameters(self) -> None:
        """Give the free parameter the value 0 if it has none, and set `follows`.

        The frequencies that follow each root get a value in the middle of what tables cover, so
        that every factor has a value.
        """
        if not self.M or not self.K:
            raise InputError("M and K: at least one matrix each is required")
        values = {self.parameter: 0.0} | dict(self.parameters)
        without_value = sorted((FREQUENCY.keys() & self.names) - values.keys())
        if without_value:
            vars(self)["follows"] = tuple(without_value)
            values |= self.frequency(omega=None)
        vars(self)["parameters"] = MappingProxyType(values)

    def _check_terms(self) -> None:
        """Refuse more labels than rows, matrices that are not square and of one shape, and factors
        of parameters without a value. Raises InputError."""
        shape = self.M[0].matrix.shape
        if len(self.labels) > shape[0]:
            raise InputError(f"labels: {len(self.labels)} labels are not allowed; {shape[0]} are")
        for letter, terms in zip("MCK", self.parts, strict=True):
            for term in terms:
                if term.matrix.shape != shape or shape[0] != shape[1] or not shape[0]:
                    raise InputError(
                        f"{letter}: shape {term.matrix.shape}; every matrix must be square and of "
                        f"the shape of the first M, {shape}"
                    )
                for name in sorted(term.factor.names - self.parameters.keys()):
                    raise InputError(
                        f"{letter}: factor {term.factor.text}: {name} is none of the "
                        "`parameters` of the same system; "
                        f"{suggestion(name, sorted(self.parameters))}"
                    )

    @staticmethod
    def from_control(plant: StateSpace) -> System:
        """The states x' = A x of a continuous :class:`control.StateSpace` as a system.

        It has no mass, C = I and K = -A, so that its eigenvalues are the poles; inputs and outputs
        have no part in it. Raises InputError for anything else, also a discrete state space.

        Examples
        --------
        >>> import control
        >>> plant = control.ss([[0.0, 1.0], [-4.0, -0.4]], [[0.0], [1.0]], [[1.0, 0.0]], 0.0)
        >>> System.from_control(plant).n
        2
        """
        if not (hasattr(plant, "A") and hasattr(plant, "isdtime")):
            kind = type(plant).__name__
            raise InputError(f"{kind} is not allowed; it must be a StateSpace, see control.ss")
        if plant.isdtime(strict=True):
            raise InputError(
                f"{plant.name}: is discrete in time; a continuous state space is required"
            )
        n = len(plant.A)
        if n == 0:
            raise InputError(
                f"{plant.name}: has no states, so no roots; a plant with states is required"
            )
        mass = Term(np.zeros((n, n)))
        damping = Term(np.eye(n))
        stiffness = Term(-np.asarray(plant.A))
        return System((mass,), (damping,), (stiffness,), name=plant.name or "system")

    def __repr__(self) -> str:
        values = ", ".join(f"{name} = {value:g}" for name, value in self.given.items())
        return f"<System {self.name}: {self.n} rows, {len(self.terms)} terms, {values}>"

    def __reduce__(self) -> tuple[type[System], tuple[object, ...]]:
        parameters = dict(self.parameters)  # as a MappingProxyType cannot be pickled
        return type(self), (
            *self.parts,
            parameters,
            self.parameter,
            self.name,
            self.follows,
            self.assumptions,
            self.labels,
        )

    @property
    def parts(self) -> tuple[tuple[Term, ...], tuple[Term, ...], tuple[Term, ...]]:
        """The terms of M, of C and of K."""
        return self.M, self.C, self.K

    @property
    def terms(self) -> tuple[Term, ...]:
        """All terms."""
        return self.M + self.C + self.K

    @property
    def names(self) -> frozenset[str]:
        """Parameters that some matrix depends on."""
        return frozenset().union(*(term.factor.names for term in self.terms))

    @property
    def digits(self) -> int | None:
        """The significant digits of the matrix that is known to the fewest; None of doubles."""
        digits = [term.digits for term in self.terms if term.digits is not None]
        return min(digits, default=None)

    @property
    def given(self) -> dict[str, float]:
        """The parameters, without the frequency where it is that of each root."""
        return {name: self.parameters[name] for name in self.parameters if name not in self.follows}

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return int(self.M[0].matrix.shape[0])

    @property
    def row_names(self) -> list[str]:
        """What each row is called: by its label, such as 12:3 of (12, 3), or by its number, q3.

        Examples
        --------
        >>> System(np.eye(2), K=np.eye(2), labels=("pad.z",)).row_names
        ['pad.z', 'q2']
        """
        numbered = [f"q{row}" for row in range(len(self.labels) + 1, self.n + 1)]
        return [*map(row_name, self.labels), *numbered]

    @property
    def real(self) -> bool:
        """True if all matrices are real, so that roots come in conjugate pairs."""
        return not self.follows and self._real_terms

    @property
    def _real_terms(self) -> bool:
        """True if no matrix or factor is complex, at whatever frequency."""
        for term in self.terms:
            if np.iscomplexobj(term.matrix) or isinstance(term.factor, Modulus):
                return False
        return True

    @cached_property
    def undamped(self) -> bool:
        """True if nothing damps at any parameters or frequency, so that roots leave the imaginary
        axis in pairs: the terms are real, and those of C zero, or skew beside symmetric ones."""
        if not self._real_terms:
            return False
        if not any(abs(term.matrix).max() for term in self.C):
            return True
        are_symmetric = all(has_symmetry(term.matrix, 1) for term in (*self.M, *self.K))
        return are_symmetric and all(has_symmetry(term.matrix, -1) for term in self.C)

    def mapped(self, change: Callable[[Term], Term], labels: Iterable[Label]) -> System:
        """The system with a change of each term, on rows of these labels.

        Examples
        --------
        >>> system = System([[1.0]], K=[[2.0]])
        >>> twice = system.mapped(lambda term: Term(2.0 * term.matrix, term.factor), system.labels)
        >>> twice.K[0].matrix.tolist()
        [[4.0]]
        """
        M, C, K = (tuple(map(change, terms)) for terms in self.parts)
        return dataclasses.replace(self, M=M, C=C, K=K, labels=tuple(labels))

    @cached_property
    def row_units(self) -> Array:
        """Powers of two (n,) for rows of a small system whose units fit those of its columns."""
        values = self.values()
        sizes = np.zeros((3, self.n, self.n))
        for size, terms in zip(sizes, self.parts, strict=True):
            for term in terms:
                size += np.abs(term.factor.value(values) * dense(term.matrix))
        return row_units(*sizes)

    @cached_property
    def balanced(self) -> System:
        """The system with rows multiplied by `row_units`, as dense matrices: for few rows.

        It has the same roots and right vectors. Its entries are known to as many digits as those of
        this one, since the factors are powers of two.
        """
        factors = self.row_units[:, None]
        if np.all(factors == 1.0):
            return self

        def scaled(X: Matrix) -> Array:
            return factors * dense(X)

        def in_units(term: Term) -> Term:
            return term.mapped(scaled, scaled)  # the matrix, and the errors of its entries

        return self.mapped(in_units, self.labels)

    def values(self, changes: Parameters | None = None) -> dict[str, float]:
        """The parameters with some of them changed.

        Raises InputError for an unknown name, and for a value that is no finite number.

        Examples
        --------
        >>> system = System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
        >>> system.values({"k": 9.0})
        {'mu': 0.0, 'k': 9.0}
        """
        values = dict(self.parameters)
        if changes is not None:
            at = Place("System", "changes")
            for name, value in CHANGES.read(changes, at).items():
                if name not in values:
                    raise InputError(f"{name}: is no parameter; {suggestion(name, sorted(values))}")
                values[name] = ANY.read(value, at / name)
        return values

    def replace(self, changes: Parameters) -> System:
        """The system with other values of some parameters; a frequency among them is held there.

        Examples
        --------
        >>> system = System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
        >>> dict(system.replace({"k": 9.0}).parameters)
        {'mu': 0.0, 'k': 9.0}
        """
        follows = tuple(name for name in self.follows if name not in changes)
        return dataclasses.replace(self, parameters=self.values(changes), follows=follows)

    def assuming(self, *assumptions: str) -> System:
        """The system with more assumptions, those that it has not yet; nothing is certified then.

        Examples
        --------
        >>> reduced = System([[1.0]], K=[[4.0]]).assuming("it is reduced")
        >>> reduced.assumptions, reduced.assuming("it is reduced").assumptions
        (('it is reduced',), ('it is reduced',))
        """
        united = tuple(dict.fromkeys((*self.assumptions, *assumptions)))
        if united == self.assumptions:
            return self
        return dataclasses.replace(self, assumptions=united)

    @property
    def covered(self) -> tuple[float, float]:
        """The frequencies (Hz) that all tables of factors cover."""
        low = 0.0
        high = math.inf
        for term in self.terms:
            if isinstance(term.factor, Modulus) and term.factor.table:
                frequencies = term.factor.table.frequencies
                low = max(low, frequencies[0])
                high = min(high, frequencies[-1])
        return low, high

    def frequency(self, omega: float | None) -> dict[str, float]:
        """The values that the names in `follows` have at an angular frequency, rad/s or Hz.

        omega is in rad/s; None stands for the middle of the frequencies that the tables of factors
        cover, and for 1000 Hz without tables.

        Examples
        --------
        >>> lossy = System([[1.0]], K={"1 + 0.1 * frequency": [[1.0]]})
        >>> lossy.frequency(200.0 * math.pi)
        {'frequency': 100.0}
        """
        if omega is None:
            low, high = self.covered  # Hz
            hertz = (low + high) / 2
            if high == math.inf:  # no table
                hertz = 1000.0
            omega = math.tau * hertz
        return {name: omega * FREQUENCY[name] for name in self.follows}

    def frozen(self, omega: float | None = None) -> System:
        """The linear system at one frequency (rad/s; see `frequency`); itself without `follows`.

        Examples
        --------
        >>> lossy = System([[1.0]], K={"1 + omega": [[1.0]]})
        >>> lossy.frozen(3.0)(0.0)[2].tolist()
        [[4.0]]
        """
        return self.replace(self.frequency(omega)) if self.follows else self

    def at(self, changes: Parameters | None = None) -> MCK:
        """M, C, K (C None without terms) at the parameters, some of them changed.

        Raises InputError where matrices depend on the frequency of each root, if `changes` does not
        give the frequency.

        Examples
        --------
        >>> system = System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
        >>> M, C, K = system.at({"k": 9.0})
        >>> C is None, K.tolist()
        (True, [[9.0]])
        """
        parameters = self.values(changes)
        if not (changes or {}).keys() >= set(self.follows):
            raise InputError(
                f"{self.name}: matrices depend on the {self.follows[0]} of each root; it must be "
                "one of the parameters here, the same for all roots"
            )

        def value(term: Term) -> complex:
            return term.factor.value(parameters)

        return self._sum(self.M, value), self._sum(self.C, value), self._sum(self.K, value)

    def arrays(self, changes: Parameters | None = None) -> MCK:
        """M, C and K at some parameters as NumPy arrays.

        Examples
        --------
        >>> from scipy.sparse import eye_array
        >>> sparse = System(eye_array(2), K=4.0 * eye_array(2))
        >>> sparse.arrays()[2].tolist()
        [[4.0, 0.0], [0.0, 4.0]]
        """
        return dense_matrices(*self.at(changes))

    def __call__(self, value: float) -> MCK:
        """M, C, K at a value of the free parameter."""
        return self.at({self.parameter: value})

    def derivative(self, name: str, changes: Parameters | None = None) -> MCK:
        """Derivatives of M, C, K by a parameter, exact; None where no term depends on it.

        The frequency may be that of each root, and have no value in `changes`. The derivatives are
        then those at a frequency in the middle of what tables cover (see `frequency`), where `at`
        would refuse.

        Examples
        --------
        >>> system = System([[1.0]], K={"k ** 2": [[1.0]]}, parameters={"k": 4.0})
        >>> system.derivative("k")[2].tolist()
        [[8.0]]
        """
        self.values({name: 0.0})  # refuses an unknown name
        parameters = self.values(changes)

        def slope(term: Term) -> complex:
            return term.factor.slope(parameters, name)

        def dependent(terms: Sequence[Term]) -> list[Term]:
            return [term for term in terms if name in term.factor.names]

        return (
            self._sum(dependent(self.M), slope),
            self._sum(dependent(self.C), slope),
            self._sum(dependent(self.K), slope),
        )

    def _sum(self, terms: Sequence[Term], factor_of: Callable[[Term], complex]) -> Matrix | None:
        """The sum of the matrices of terms (n, n), each times what `factor_of` makes of its factor.

        Sparse if any matrix of the system is; None if there are no terms.
        """
        if not terms:
            return None
        as_matrix = np.asarray
        zeros: Callable[[tuple[int, int]], Matrix] = np.zeros
        if any(is_sparse(term.matrix) for term in self.terms):
            from scipy.sparse import csc_array

            as_matrix = csc_array
            zeros = csc_array
        total = zeros((self.n, self.n))
        with np.errstate(over="ignore", invalid="ignore"):
            for term in terms:
                factor = factor_of(term)
                if factor:
                    total = total + factor * as_matrix(term.matrix)
        return total


TermSystem = System
"""The class by the name that it had when `System` was a function."""


def without_supports(system: System) -> tuple[System, NDArray[np.intp]]:
    """The system without the rows that a penalty on the diagonal of K holds, and these rows.

    Finite-element programs write a support as a diagonal entry of K of 1e22 or more. Rows are
    supports if they are a minority and their diagonal entries are 1e10 times greater, at the
    system's own parameters, both than that of each free row and, per mass, than the largest omega^2
    of a free row. They must also be so much greater than each coupling to another row, at whatever
    value of the parameters.
    """
    from scipy.sparse import csc_array

    frozen = system.frozen()
    M, _, K = frozen.at()
    couplings = csc_array((system.n, system.n))
    for term in frozen.K:
        # a factor that is zero at these parameters need not be at others
        size = max(abs(term.factor.value(frozen.parameters)), 1.0)
        couplings += size * abs(csc_array(term.matrix))
    couplings.setdiag(0.0)
    supports = support_rows(np.abs(M.diagonal()), K.diagonal().real, couplings)
    if not supports.size:
        return system, supports
    assumption = f"{rows_in_words(supports.size)} taken for supports and left out"
    return _without_rows(system, supports).assuming(assumption), supports


def without_empty_rows(system: System) -> tuple[System, NDArray[np.intp]]:
    """The system without the rows in which neither M, C nor K has an entry, and these rows.

    A row counts as empty only if its column is empty, too. Nothing is left out where all are.
    """
    from scipy.sparse import coo_array

    has_entries = np.zeros(system.n, dtype=bool)
    for terms in system.parts:
        for term in terms:
            for indices in coo_array(term.matrix).coords:
                has_entries[indices] = True
    empty = np.flatnonzero(~has_entries)
    if not empty.size or not has_entries.any():
        return system, empty[:0]
    return _without_rows(system, empty).assuming(f"{empty.size} empty rows are left out"), empty


def _without_rows(system: System, rows: NDArray[np.intp]) -> System:
    """The system without some rows (k,) and the columns of these."""
    remaining = np.setdiff1d(np.arange(system.n), rows)

    def remaining_part(matrix: Matrix) -> Matrix:
        sliced = matrix.tocsc() if is_sparse(matrix) else matrix
        return sliced[remaining][:, remaining]

    labels = [system.labels[row] for row in remaining if row < len(system.labels)]
    return system.mapped(lambda term: term.mapped(remaining_part), labels)


def warn_of_unused_parameters(names: Iterable[str], system: System, at: Place) -> None:
    """Warn of those of some parameters that enter no matrix: most are misspelt.

    at: where they are given, for the message.
    """
    unused = sorted({*names} - system.names)
    if unused:
        used = [f"{name} = {system.parameters[name]:g}" for name in sorted(system.names)]
        hint = f"matrices depend on {', '.join(used) or 'no parameter'}"
        at.warn(f"no matrix depends on {', '.join(unused)}; {hint}")
