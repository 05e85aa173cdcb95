"""Parametrised systems M(p) q'' + C(p) q' + K(p) q = 0: functions of p, or sums of terms.

A system is any function of one parameter that gives M, C and K.

Damping that is not given as a matrix refers to the structure's own stiffness: the symmetric part of
K at the system's own parameters, without friction. The friction coefficient is the parameter `mu`;
in a system without one it is the swept parameter, if all matrices of K that it multiplies are
unsymmetric. A factor of one changes nothing.

A factor may be complex and depend on the frequency. Where this has no value of its own, it is that
of each root, |Im lambda|: the roots are then those of a nonlinear eigenproblem.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import InputError, MatrixError, within_doubles
from squeal.linear.matrices import (
    EPS,
    SKEW,
    Array,
    checked,
    dense,
    divisor,
    given_matrix,
    is_sparse,
    norm_of,
    unit_diagonal,
)
from squeal.linear.moduli import FREQUENCY, Modulus, Tabulated
from squeal.numerics.differentiation import ONE, Formula
from squeal.schema import TEXT, Place, kind_of

if TYPE_CHECKING:
    from control import StateSpace

Matrix = Any
"""A square NumPy array or SciPy sparse array (n, n)."""


class SparseMatrix(Protocol):
    """A SciPy sparse array or matrix."""

    @property
    def shape(self) -> tuple[int, ...]: ...

    def tocsc(self) -> Any: ...


Matrices = tuple[ArrayLike, ArrayLike | None, ArrayLike]
SystemFunction = Callable[[float], Matrices]
"""p -> (M, C, K); C may be None (undamped). A method `many` may give them at several values."""


@dataclass(frozen=True, eq=False)
class Term:
    """A copy of a finite matrix (n, n), and the formula or complex modulus that multiplies it.

    `digits` are the significant digits to which its entries are known, None if they are exact.
    """

    matrix: Matrix = field(repr=False)
    factor: Formula | Modulus | Tabulated = ONE
    digits: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", given_matrix(self.matrix).copy())


SystemMatrix = ArrayLike | Sequence[object] | SparseMatrix | Mapping[str, object] | tuple[Term, ...]
"""A matrix as `System` takes it: one array, arrays by their factors, or terms."""


@dataclass(frozen=True, eq=False, init=False)
class System:
    """A system M q'' + C q' + K q = 0 from arrays in memory, each matrix a sum of terms.

    Rows that a penalty on the diagonal of K holds are supports: they are left out with a warning.
    Terms are taken as they are, with all their rows.

    Parameters
    ----------
    M, C, K : array_like (n, n), SciPy sparse array, mapping of formulas to such, or tuple of Term
        A mapping holds terms by their factors, formulas of the parameters, such as
        ``{"1": K0, "mu": K1}``. C may be left out (undamped). Data frames of pandas and data arrays
        of xarray must have the same labels.
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
        What was guessed when it was made; nothing is certified after it.

    Raises
    ------
    InputError
        If matrices differ in shape, or a factor names no parameter.

    Examples
    --------
    >>> K0, K1 = [[2, -1], [-1, 2]], [[0, 4 / 3], [0, 0]]
    >>> coupled = System([[1, 0], [0, 1]], K={"1": K0, "mu": K1})
    >>> coupled.n, coupled.parameter
    (2, 'mu')

    The same from terms:

    >>> import numpy as np
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
    ) -> None:
        if K is None:
            words = "missing; a matrix or a mapping of formulas to matrices is"
            raise InputError(f"System: K: {words}")
        given = {part: () if X is None else X for part, X in zip("MCK", (M, C, K), strict=True)}
        from_terms = all(_are_terms(each) for each in given.values())
        if not from_terms:  # as somebody typed it
            if parameters is not None:
                where = Place("System", "parameters")
                parameters = kind_of(Mapping[str, float]).read(parameters, where)
            parameter = TEXT.read(parameter, Place("System", "parameter"))
            name = TEXT.read(name, Place("System", "name"))
        object.__setattr__(self, "parameters", parameters or {})
        object.__setattr__(self, "parameter", parameter)
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "follows", follows)
        object.__setattr__(self, "assumptions", assumptions)
        with within_doubles():
            for part, terms in _read_terms(given).items():
                object.__setattr__(self, part, terms)
            self._check()
            if from_terms:
                return
            free, supports = without_supports(self)
        if supports.size:
            vars(self).update(vars(free))
            Place("System", "K").warn(supported(supports))

    def _check(self) -> None:
        """Complete the parameters. Raises InputError for matrices that do not fit together."""
        if not self.M or not self.K:
            raise InputError("M and K: at least one matrix each is required")
        values = {self.parameter: 0.0} | dict(self.parameters)
        if free := sorted((FREQUENCY.keys() & self.names) - values.keys()):
            object.__setattr__(self, "follows", tuple(free))
            values |= self.frequency(None)
        object.__setattr__(self, "parameters", MappingProxyType(values))
        shape = self.M[0].matrix.shape
        for letter in "MCK":
            for term in getattr(self, letter):
                if term.matrix.shape != shape or shape[0] != shape[1] or not shape[0]:
                    raise InputError(
                        f"{letter}: shape {term.matrix.shape}; every matrix must be square and of "
                        f"the shape of the first M, {shape}"
                    )
                for name in sorted(term.factor.names - values.keys()):
                    words = f"factor {term.factor.text}: {name} is no parameter; allowed are "
                    raise InputError(f"{letter}: {words}{', '.join(sorted(values))}")

    @staticmethod
    def from_control(plant: StateSpace) -> System:
        """The states x' = A x of a continuous :class:`control.StateSpace` as a system.

        It has no mass, C = I and K = -A, so that its eigenvalues are the poles; inputs and outputs
        have no part in it. Raises InputError for a discrete state space.

        Examples
        --------
        >>> import control
        >>> plant = control.ss([[0.0, 1.0], [-4.0, -0.4]], [[0.0], [1.0]], [[1.0, 0.0]], 0.0)
        >>> System.from_control(plant).n
        2
        """
        if plant.isdtime(strict=True):
            words = "is discrete in time; a continuous state space is required"
            raise InputError(f"{plant.name}: {words}")
        n = len(plant.A)
        mass = Term(np.zeros((n, n)))
        damping = Term(np.eye(n))
        stiffness = Term(-np.asarray(plant.A))
        return System((mass,), (damping,), (stiffness,), name=plant.name or "system")

    def __reduce__(self) -> tuple[type[System], tuple[object, ...]]:
        parameters = dict(self.parameters)  # a view of them is not sent to other processes
        own = *self.parts, parameters, self.parameter, self.name, self.follows, self.assumptions
        return type(self), own

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
    def given(self) -> dict[str, float]:
        """The parameters, without the frequency where it is that of each root."""
        return {name: self.parameters[name] for name in self.parameters if name not in self.follows}

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return int(self.M[0].matrix.shape[0])

    @property
    def real(self) -> bool:
        """True if all matrices are real, so that roots come in conjugate pairs."""
        return not self.follows and self._real_terms

    @property
    def _real_terms(self) -> bool:
        """True if no matrix or factor is complex, at whatever frequency."""
        return not any(
            np.iscomplexobj(term.matrix) or isinstance(term.factor, Modulus) for term in self.terms
        )

    @property
    def undamped(self) -> bool:
        """True if C has no terms and the others are real: nothing damps at any frequency."""
        return not self.C and self._real_terms

    def values(self, changes: Mapping[str, float] | None = None) -> dict[str, float]:
        """The parameters with some of them changed. Raises InputError for an unknown name."""
        values = {**self.parameters, **(changes or {})}
        for name in values.keys() - self.parameters.keys():
            allowed = ", ".join(sorted(self.parameters))
            raise InputError(f"{name}: is no parameter; allowed are {allowed}")
        return values

    def replace(self, changes: Mapping[str, float]) -> System:
        """The same system with other values of some parameters."""
        return dataclasses.replace(self, parameters=self.values(changes))

    @property
    def covered(self) -> tuple[float, float]:
        """The frequencies (Hz) that all tables of factors cover."""
        tables = [t.factor.table for t in self.terms if isinstance(t.factor, Modulus)]
        ends = [(t.frequencies[0], t.frequencies[-1]) for t in tables if t]
        return max([0.0, *(a for a, _ in ends)]), min([math.inf, *(b for _, b in ends)])

    def frequency(self, omega: float | None) -> dict[str, float]:
        """The values of `follows` at omega (rad/s), None in the middle of what tables cover."""
        if omega is None:
            low, high = self.covered
            omega = math.tau * ((low + high) / 2 if high < math.inf else max(1000.0, low))
        return {name: omega * FREQUENCY[name] for name in self.follows}

    def frozen(self, omega: float | None = None) -> System:
        """The linear system at one frequency (rad/s; see `frequency`)."""
        if not self.follows:
            return self
        parameters = self.values(self.frequency(omega))
        system = dataclasses.replace(self, parameters=parameters)
        object.__setattr__(system, "follows", ())
        return system

    def at(self, changes: Mapping[str, float] | None = None) -> tuple[Any, Any, Any]:
        """M, C, K (C None without terms) at the parameters, some of them changed.

        Raises InputError where the frequency is that of each root.
        """
        if not (changes or {}).keys() >= set(self.follows):
            raise InputError(
                f"{self.name}: matrices depend on the {self.follows[0]} of each root; it must be "
                "one of the parameters here, the same for all roots"
            )
        p = self.values(changes)
        M, C, K = (self._sum(X, [t.factor.value(p) for t in X]) for X in self.parts)
        return M, C, K

    def arrays(self, changes: Mapping[str, float] | None = None) -> tuple[Any, Any, Any]:
        """The same as NumPy arrays."""
        M, C, K = self.at(changes)
        return dense(M), None if C is None else dense(C), dense(K)

    def __call__(self, value: float) -> tuple[Any, Any, Any]:
        """M, C, K at a value of the free parameter."""
        return self.at({self.parameter: value})

    def derivative(
        self, name: str, changes: Mapping[str, float] | None = None
    ) -> tuple[Any, Any, Any]:
        """Derivatives of M, C, K by a parameter, exact; None where they vanish."""
        self.values({name: 0.0})
        p = self.values(changes)
        moved = ([t for t in X if name in t.factor.names] for X in self.parts)
        M, C, K = (self._sum(terms, [t.factor.slope(p, name) for t in terms]) for terms in moved)
        return M, C, K

    def _sum(self, terms: Sequence[Term], factors: Sequence[complex]) -> Any:
        if not terms:
            return None
        zeros, convert = np.zeros, np.asarray
        if any(is_sparse(term.matrix) for term in self.terms):
            from scipy.sparse import csc_array

            zeros = convert = csc_array
        with np.errstate(over="ignore", invalid="ignore"):
            each = zip(factors, terms, strict=True)
            return sum((f * convert(t.matrix) for f, t in each if f), zeros((self.n, self.n)))


TermSystem = System
"""The class by the name that it had when `System` was a function."""


def _are_terms(given: object) -> bool:
    """Whether terms are given, no array."""
    return isinstance(given, tuple) and all(isinstance(term, Term) for term in given)


def _read_terms(given: Mapping[str, Any]) -> dict[str, tuple[Term, ...]]:
    """The terms of M, C and K: as they are, from arrays, or from mappings of formulas to arrays.

    Raises InputError for what is no matrix, and for data frames whose labels differ.
    """
    parts: dict[str, tuple[Term, ...]] = {}
    labels: dict[str, list[object]] = {}
    for part, value in given.items():
        if _are_terms(value):
            parts[part] = value
            continue
        has_factors = isinstance(value, Mapping) and not is_sparse(value)
        arrays = value if has_factors else {"1": value}
        terms = []
        with Place("System", part).named():
            for factor, array in arrays.items():
                if (along := _labels_of(array)) is not None:
                    name = f"{part} {factor}" if has_factors else part
                    labels[f"index of {name}"], labels[f"columns of {name}"] = along
                matrix = given_matrix(array, real=part == "M")
                terms.append(Term(matrix, Formula(TEXT.read(factor, Place("factor")))))
        parts[part] = tuple(terms)
    _refuse_other_labels(labels)
    return parts


def _labels_of(matrix: Any) -> tuple[list[object], list[object]] | None:
    """The labels of rows and columns of a data frame (pandas) or a data array (xarray) that has
    them; None of any other matrix."""
    if hasattr(matrix, "columns") and hasattr(matrix, "index"):
        return list(matrix.index), list(matrix.columns)
    indexes = getattr(matrix, "indexes", {})
    along = [list(indexes[name]) for name in getattr(matrix, "dims", ()) if name in indexes]
    return (along[0], along[1]) if len(along) == 2 else None


def _refuse_other_labels(labels: Mapping[str, list[object]]) -> None:
    """Refuse data frames whose rows or columns have other labels, or another order, than those of
    the first. Raises InputError."""
    first = next(iter(labels), "")
    for name, others in labels.items():
        if others != labels[first]:
            raise InputError(
                f"System: the {name} is not the {first}; labelled matrices must have the same "
                "labels in the same order as rows and as columns (frame.loc[labels, labels] sorts "
                "them)"
            )


def matrices_of(system: SystemFunction, ps: Sequence[float]) -> list[tuple[Array, Array, Array]]:
    """M, C (zero without damping) and K, arrays (n, n), at each value.

    Raises InputError where the system gives no square, finite, real matrices of one size.
    """
    many = getattr(system, "many", None)
    given = many(list(ps)) if many else [matrices_at(system, p) for p in ps]
    each = (checked(M, C, K) for M, C, K in given)
    return [(M, np.zeros_like(M) if C is None else C, K) for M, C, K in each]


def with_slopes(
    system: SystemFunction, ps: Sequence[float], low: float, high: float, difference: float = 1e-6
) -> list[tuple[Any, Any]]:
    """M, C and K, and their derivatives by the parameter, at each value; as `matrices_of`.

    Derivatives of a System are exact; of another function they are differences over
    `difference` times the range from low to high, one-sided at its ends.

    >>> system = lambda p: (np.eye(1), None, np.array([[1 + p * p]]))
    >>> [((_, C, K), (_, _, dK))] = with_slopes(system, [1.0], 0.0, 2.0)
    >>> C.item(), K.item(), round(dK.item(), 6)
    (0.0, 2.0, 2.0)
    """
    if isinstance(system, System):
        name, zero = system.parameter, np.zeros((system.n, system.n))
        slopes = (system.derivative(name, {name: p}) for p in ps)
        filled = [[zero if X is None else dense(X) for X in each] for each in slopes]
        return list(zip(matrices_of(system, ps), filled, strict=True))
    inside, step = np.clip(ps, low, high), difference * (high - low)
    before, after = np.maximum(low, inside - step), np.minimum(high, inside + step)
    at, first, last = np.split(np.array(matrices_of(system, [*ps, *before, *after])), 3)
    return list(zip(at, (last - first) / (after - before)[:, None, None, None], strict=True))


def without_supports(system: System) -> tuple[System, NDArray[np.intp]]:
    """The system without the rows that a penalty on the diagonal of K holds, and these rows.

    Finite-element programs write a support as a diagonal entry of 1e22 or more. Rows are supports
    if they are a minority and their diagonal entries, at the system's own parameters, are 1e10
    times greater than the diagonal of each other row, as a stiffness and per mass, and than each
    coupling to another row, at whatever value of the parameters.
    """
    from scipy.sparse import csc_array

    frozen = system.frozen()
    M, _, K = frozen.at()
    mass = np.abs(M.diagonal())
    gap = 1e10
    diagonal = np.abs(csc_array(K).diagonal())
    order = np.argsort(diagonal)
    order = order[diagonal[order] > 0.0]
    above_gap = 1 + np.flatnonzero(diagonal[order[1:]] >= gap * diagonal[order[:-1]])
    above_gap = above_gap[2 * above_gap > order.size]  # soft rows may lie below a gap too
    if not above_gap.size:
        return system, above_gap
    rows = np.sort(order[above_gap[0] :])
    rest = np.setdiff1d(np.arange(system.n), rows)
    heavy = rest[mass[rest] > 0.0]
    fastest = np.max(diagonal[heavy] / mass[heavy], initial=0.0)
    # a factor that is zero at these parameters need not be at others
    couplings = csc_array((system.n, system.n))
    for term in frozen.K:
        size = max(abs(term.factor.value(frozen.parameters)), 1.0)
        couplings = couplings + size * abs(csc_array(term.matrix))
    couplings.setdiag(0.0)
    most = max(
        couplings[rows].max(),
        couplings[:, rows].max(),
        fastest * mass[rows].max(),
    )
    if diagonal[rows].min() < gap * most:
        return system, rows[:0]

    def held(term: Term) -> Term:
        X = term.matrix.tocsc() if is_sparse(term.matrix) else term.matrix
        return Term(X[rest][:, rest], term.factor, term.digits)

    M, C, K = (tuple(map(held, terms)) for terms in (system.M, system.C, system.K))
    assumed = (*system.assumptions, f"{rows.size} rows are taken for supports and left out")
    return dataclasses.replace(system, M=M, C=C, K=K, assumptions=assumed), rows


def supported(rows: NDArray[np.intp]) -> str:
    """What is said of rows that `without_supports` left out."""
    return (
        f"{rows.size} rows whose diagonal stands decades above all others are taken for supports "
        f"and left out, the first is row {rows[0] + 1}"
    )


def matrices_at(system: SystemFunction, p: float) -> Matrices:
    """What a system gives at p. Raises InputError if it is no function that gives M, C and K."""
    given = system(p) if callable(system) else None
    if not isinstance(given, tuple | list) or len(given) != 3:
        words = "it must be a function of one parameter that gives M, C (or None) and K"
        raise InputError(f"system: {type(system).__name__} is not allowed; {words}")
    return given


# Slow roots where some motion has no mass, or hardly any


REFUSED = (
    "M: is ill conditioned, as where some motion has (nearly) no mass or coordinates nearly depend "
    "on each other, and that motion is damped or may grow, or M varies; those thresholds can be "
    "given that lie in a band (--band LOW:HIGH, in Hz)"
)


def _require(fine: Any) -> None:
    if not fine:
        raise MatrixError(REFUSED)


class Slow:
    """The slow motions of `system`, some of whose motions are light at p, as a system with M = 1.

    In eigenvectors of M and with s = -lambda^2, K21 q1 + K22 q2 = s D2 q2, where q2 are light. On
    the subspace of the slow roots q2 = -X q1, K22 X = K21 + D2 X L and D1 L = K11 - K12 X: static
    condensation of what has no mass, and with a light one a few iterations more, each of which
    gains a factor of D2 L / K22. Raises InputError if M varies, if what is light is damped, may
    grow or leaves the slow roots too few digits. `growth` is by how much it has increased rounding.
    """

    def __init__(self, system: SystemFunction, p: float) -> None:
        self._system, self.growth = system, 1.0
        ((self._M, _, K),) = matrices_of(system, [p])
        size = np.sqrt(np.abs(np.diag(self._M)))
        _require(size.any())
        masses, vectors = np.linalg.eigh(unit_diagonal(self._M))
        self._turn = vectors / divisor(size)[:, None]
        masses = np.where(masses > 4 * EPS * len(masses) * masses[-1], masses, 0.0)
        gaps = masses[1:] / np.maximum(masses[:-1], EPS * masses[-1])
        count = int(np.argmax(gaps)) + 1
        self._light, self._heavy = masses[:count], masses[count:]
        _require(gaps.max() >= 1e4 and np.count_nonzero(self._light) <= 1)
        self._sign = float(np.linalg.slogdet(self._turned(K)[0])[0])
        _require(self._sign > 0.0 or not self._light.any())

    def _turned(self, X: Array) -> tuple[Array, Array, Array, Array]:
        """Blocks 22, 21, 12 and 11 of a matrix, 2 being the light motions."""
        X, k = self._turn.T @ X @ self._turn, len(self._light)
        return X[:k, :k], X[:k, k:], X[k:, :k], X[k:, k:]

    def __call__(self, p: float) -> Matrices:
        """M, C and K of the slow motions at p."""
        ((M, C, K),) = matrices_of(self._system, [p])
        *light, own = self._turned(C)
        noise = 4 * EPS * len(M) * np.abs(own).max()
        _require(not any(np.abs(X).max() > noise for X in light))
        _require(np.array_equal(M, self._M) and not (C.any() and self._light.any()))
        unit = np.sqrt(np.outer(self._heavy, self._heavy))
        return np.eye(len(unit)), own / unit, self._condensed(*self._turned(K)) / unit

    def _condensed(self, K22: Array, K21: Array, K12: Array, K11: Array) -> Array:
        """D1 L (n1, n1)."""
        condition = float(np.linalg.cond(unit_diagonal(K22)))
        _require(condition < 1e8 and np.linalg.slogdet(K22)[0] == self._sign)
        X = np.linalg.solve(K22, K21)
        for _ in range(60):
            inertia = self._light[:, None] * (X @ ((K11 - K12 @ X) / self._heavy[:, None]))
            before, X = X, np.linalg.solve(K22, K21 + inertia)
            if np.abs(X - before).max() <= 4 * EPS * np.abs(X).max():
                break
        else:
            _require(False)
        terms, rest = np.abs(K11) + np.abs(K12) @ np.abs(X), K11 - K12 @ X
        lost = np.abs(terms).max() / np.abs(rest).max() * self._heavy[-1] / self._heavy[0]
        self.growth = max(self.growth, len(self._M) * condition * float(lost))
        return rest


# Damping that is not given as a matrix


def structure_stiffness(
    system: System, without: Collection[int] = ()
) -> tuple[Matrix, tuple[int, ...]]:
    """The stiffness (n, n) that damping refers to, and which terms of K it is of; `without` some.

    Raises InputError where there is none.
    """
    at = frictionless(system)
    parts = [(i, (t.factor.value(at) * t.matrix).real) for i, t in enumerate(system.K)]
    parts = [(i, part) for i, part in parts if i not in without and abs(part).max()]
    if not parts:
        beside = " beside the terms with a damping of their own" if without else ""
        raise InputError(f"damping: K has no stiffness without friction{beside}; it must have some")
    K = sum(part for _, part in parts)
    return (K + K.T) / 2, tuple(i for i, _ in parts)


def frictionless(system: System, changes: Mapping[str, float] | None = None) -> dict[str, float]:
    """The nominal parameters, some of them changed, without friction, at which a structure's
    stiffness is taken."""
    name = "mu" if "mu" in system.parameters else system.parameter
    own = [t.matrix for t in system.K if name in t.factor.names]
    symmetric = (abs(X - X.T).max() <= SKEW * abs(X).max() for X in own)
    held = name != "mu" and (not own or any(symmetric))
    return system.values({**(changes or {}), **({} if held else {name: 0.0})})


class Damped(NamedTuple):
    """What is damped: terms by part and number, such as K.2, or modes; by what, and how much."""

    of: str
    by: str
    value: Any


def damped(
    system: System,
    rayleigh: Sequence[float] = (0.0, 0.0),
    ratios: float | Sequence[float] | Callable[[Array], Array] = (),
    structural: float = 0.0,
    own: Mapping[str, Collection[int]] | None = None,
) -> tuple[System, tuple[Damped, ...]]:
    """The system with damping of its structure, of which M and the stiffness K have modes Phi; and
    what is damped.

    C gains alpha M + beta K (`rayleigh`, 1/s and s) and M Phi diag(2 zeta omega) Phi' M, where
    Phi' M Phi = 1, of the `ratios` zeta of all modes, of the first ones by rising omega, or as a
    function of frequencies (Hz) that is NaN for other modes. K gains i eta K, eta the loss factor
    `structural`: that describes exp(lambda t) with Im lambda > 0, roots below the real axis are
    mirror images. Both leave out terms of K that depend on the frequency, or name their `own`:
    their indices by the name of the argument, of M by "M".

    Modal damping of more than 2000 rows is added by a row for each mode. Raises InputError without
    stiffness, for one ratio for all modes of so many rows, or with an M that is not symmetric,
    positive definite.
    """
    (alpha, beta), own = rayleigh, own or {}
    varied = {i for i, t in enumerate(system.K) if t.factor.names & set(system.follows)}
    C, K, done = list(system.C), list(system.K), list[Damped]()

    def note(by: str, value: float, part: str, terms: Iterable[int]) -> None:
        done.extend(Damped(f"{part}.{i + 1}", by, value) for i in terms)

    if alpha:
        heavy = [i for i in range(len(system.M)) if i not in own.get("M", ())]
        texts = ((system.M[i].matrix, f"{alpha!r} * ({system.M[i].factor.text})") for i in heavy)
        C += [Term(X, Formula(text)) for X, text in texts]
        note("rayleigh", alpha, "M", heavy)
    if beta:
        stiffness, terms = structure_stiffness(system, varied | set(own.get("rayleigh", ())))
        C.append(Term(beta * stiffness))
        note("rayleigh", beta, "K", terms)
    if structural:
        stiffness, terms = structure_stiffness(system, varied | set(own.get("structural", ())))
        K.append(Term(structural * stiffness, Modulus(imaginary=True)))
        note("structural", structural, "K", terms)
    result = dataclasses.replace(system, C=tuple(C), K=tuple(K))
    if callable(ratios) or np.size(ratios):
        result, modes = _with_modal_damping(result, system, ratios)
        done.append(modes)
    return result, tuple(done)


def _with_modal_damping(system: System, undamped: System, ratios: Any) -> tuple[System, Damped]:
    """A system with damping of the modes of an undamped one."""
    n, most = system.n, 2000
    K, M, count = structure_stiffness(undamped)[0], undamped.frozen().at()[0], n
    if not callable(ratios) and (np.ndim(ratios) or n > most):
        count = len(np.atleast_1d(ratios))
        if not (np.ndim(ratios) and count <= n):
            words = f"{count} ratios of {n} rows are not allowed; a list of one for each of the"
            raise InputError(f"damping.ratios: {words} first modes is, or a table of frequencies")
    omega, modes = _real_modes(K, M, count, ratios if callable(ratios) and n > most else None)
    if np.ndim(ratios) and len(omega) < count:
        words = f"{count} ratios of {len(omega)} modes are not allowed; the other rows have no mass"
        raise InputError(f"damping.ratios: {words}")
    zeta = ratios(omega / math.tau) if callable(ratios) else np.broadcast_to(ratios, len(omega))
    held = np.isfinite(zeta)
    if not held.any():
        raise InputError("damping.ratios: no mode of the structure lies in the table's range")
    U = (M @ modes[:, held]) * np.sqrt(2 * zeta * omega)[held]
    ends = ", ".join(f"{omega[k] / math.tau:.6g} Hz" for k in np.flatnonzero(held)[[0, -1]])
    what = Damped(f"{held.sum()} modes ({ends})", "ratios", [float(z) for z in zeta[held]])
    if n <= most:
        return dataclasses.replace(system, C=(*system.C, Term(U @ U.T))), what
    return _bordered(system, U), what


def _real_modes(
    K: Matrix, M: Matrix, count: int, ratios: Callable[[Array], Array] | None
) -> tuple[Array, Array]:
    """The lowest real modes, or all that `ratios` know of: rad/s (k,) and vectors (n, k), of a
    large sparse system by Lanczos' method. Rows without mass follow the others at rest."""
    from scipy.sparse.linalg import ArpackError, eigsh

    try:
        if (count == len(M.diagonal()) and ratios is None) or not is_sparse(K):
            squares, modes = _dense_modes(dense(K), dense(M), count)
        else:
            shift = -1e-9 * norm_of(K) / norm_of(M)  # below all squares: rigid bodies pass
            k, squares = 32 if ratios else count, np.zeros(1)
            while True:
                squares, modes = eigsh(K, k, M, shift)
                highest = np.sqrt(np.maximum(squares.max(keepdims=True), 0.0)) / math.tau
                if ratios is None or np.isnan(ratios(highest)[0]) or 4 * k > K.shape[0]:
                    break
                k *= 2
    except (np.linalg.LinAlgError, ArpackError, RuntimeError):
        words = "M must be symmetric and positive semidefinite, and K hold the rows without mass"
        raise InputError(f"damping.ratios: {words}") from None
    order = np.argsort(squares)
    return np.sqrt(np.maximum(squares[order], 0.0)), modes[:, order]


def _dense_modes(K: Array, M: Array, count: int) -> tuple[Array, Array]:
    """The lowest eigenvalues (k,) of K x = s M x, k <= count, and vectors (n, k) with x' M x = 1.

    Where M is singular, M x = r (K + shift M) x with r = 1/(s + shift) is solved instead, and the
    motions of rows without mass, r = 0, are left out. Raises LinAlgError if that is no definite
    pair either.
    """
    from scipy.linalg import eigh

    try:
        squares, modes = eigh(K, M, subset_by_index=(0, count - 1))
    except np.linalg.LinAlgError:
        shift = float(norm_of(K) / norm_of(M))
        inverse, modes = eigh(M, K + shift * M)
        rounding = 4 * len(M) * EPS * abs(inverse[-1])
        heavy = inverse > rounding
        if inverse[0] < -rounding or not heavy.any():
            raise
        inverse, modes = inverse[heavy][::-1], modes[:, heavy][:, ::-1]
        squares = 1.0 / inverse - shift
        modes = modes / np.sqrt(inverse)
    return squares[:count], modes[:, :count]


def _bordered(system: System, U: Array) -> System:
    """A sparse system with U U' added to C, a full matrix: by unknowns w = U' q of their own."""
    from scipy.sparse import block_array, csc_array, eye_array

    n, k = U.shape

    def wide(term: Term) -> Term:
        X = csc_array(term.matrix, copy=True)
        X.resize((n + k, n + k))
        return Term(X, term.factor, term.digits)

    M, C, K = (tuple(map(wide, terms)) for terms in system.parts)
    none, columns = csc_array((n, n)), csc_array(U)
    forces = block_array([[none, columns], [None, csc_array((k, k))]], format="csc")
    follows = block_array([[none, None], [-columns.T, eye_array(k)]], format="csc")
    return dataclasses.replace(system, M=M, C=(*C, Term(forces)), K=(*K, Term(follows)))
