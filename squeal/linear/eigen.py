"""Eigenvalues of M q'' + C q' + K q = 0 as callers see them, and the modes that grow.

Each carries its mode shapes, its residual and how far rounding may move it. `roots` computes them,
`verdicts` decides whether they are flutter.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.linear.matrices import (
    EPS,
    Array,
    NormalisedSystem,
    components,
    normalised_system,
    solver_near_singular,
)
from squeal.linear.roots import ComplexArray, RootsWithRounding, dependence, ordered, roots_of
from squeal.linear.verdicts import ACCEPTED, GROWING, VERDICTS, kinds

ROUNDINGS = 16.0  # of a root: what rounding may make of a real part that is zero


@dataclass(frozen=True, eq=False)
class Eigenvalue:
    """One eigenvalue of (value^2 M + value C + K) right = 0 and what is known of it.

    Attributes
    ----------
    value : complex
        rad/s.
    right, left : array (n,)
        The mode shape, right^H M right = 1, and the left eigenvector alike.
    residual : float
        The backward error |P(value) x| / (|value|^2 |M| + |value| |C| + |K|), mass-normalised.
    condition : float
        1 / |y^H x| of the standard problem that was solved (in value^2 without damping), or inf.
    rounding : float
        How far rounding may move it, rad/s.
    error : float, optional
        How far a reduction, or the digits that data do not have, may move it, rad/s. After a proof
        it is set only where a table shows it: from a millionth of the real or imaginary part on.
    sign_is_open : bool
        True if `error` leaves open whether it grows.
    proved_sense : {1, -1, 0}
        1 if it is proved to grow, -1 if to decay, however far rounding may move it.
    """

    value: complex
    right: ComplexArray = field(repr=False)
    left: ComplexArray = field(repr=False)
    residual: float = field(repr=False)
    condition: float = field(repr=False)
    rounding: float = field(default=0.0, repr=False)
    error: float | None = field(default=None, repr=False)
    sign_is_open: bool = field(default=False, repr=False)
    proved_sense: int = field(default=0, repr=False)

    @property
    def kind(self) -> str:
        """The verdict on it alone."""
        if self.proved_sense < 0:
            return "stable"
        if self.proved_sense > 0:
            return "flutter" if self.value.imag != 0.0 else "divergence"
        return VERDICTS[kinds(self.value, self.rounding)]

    @property
    def decides(self) -> bool:
        """Whether a verdict may rest on it: it solves the equations, or its sense is proved."""
        return self.proved_sense != 0 or self.residual <= ACCEPTED

    @property
    def frequency_hz(self) -> float:
        """|Im| / (2 pi), in Hz."""
        return abs(self.value.imag) / math.tau

    @property
    def growth_rate(self) -> float:
        """Real part, 1/s: positive where the motion grows; 0 if rounding of the value hides it."""
        return self.value.real if self.proved_sense else growth_of(self.value)

    @property
    def damping_ratio(self) -> float:
        """-Re / |value|; 0 for a rigid-body root, which neither grows nor decays."""
        if self.value == 0.0:
            return 0.0
        return -self.growth_rate / abs(self.value) + 0.0  # + 0.0: no negative zero


def growth_of(value: complex) -> float:
    """The real part of a root, 0 if it is less than some roundings of the root.

    Examples
    --------
    >>> growth_of(-1e-70 + 3j), growth_of(-1e-70 + 0j)
    (0.0, -1e-70)
    """
    return value.real if abs(value.real) > ROUNDINGS * EPS * abs(value) else 0.0


@dataclass(frozen=True, eq=False)
class Spectrum:
    """All 2n eigenvalues, by rising frequency; of one frequency the fastest growing first.

    Conjugate pairs stand together, positive imaginary part first.
    """

    eigenvalues: tuple[Eigenvalue, ...]

    @property
    def values(self) -> ComplexArray:
        """The eigenvalues as an array (2n,), rad/s."""
        return values_of(self.eigenvalues)

    @property
    def rounding(self) -> Array:
        """How far rounding may move each (2n,), rad/s."""
        return np.array([e.rounding for e in self.eigenvalues])

    @property
    def dominant(self) -> Eigenvalue:
        """The eigenvalue of largest real part (of several, the one of largest frequency)."""
        return max(self.eigenvalues, key=lambda e: (e.value.real, e.value.imag))

    def __len__(self) -> int:
        return len(self.eigenvalues)


def values_of(roots: Iterable[Eigenvalue]) -> ComplexArray:
    """The values (m,) of roots, rad/s."""
    return np.array([root.value for root in roots], dtype=complex)


def arrays_of(
    roots: Sequence[Eigenvalue], n: int
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """The values (m,) of roots of n rows, their right vectors (n, m) and their left ones."""
    right = np.array([root.right for root in roots], dtype=complex)
    left = np.array([root.left for root in roots], dtype=complex)
    return values_of(roots), right.reshape(-1, n).T, left.reshape(-1, n).T


def of_unit_mass(vector: ComplexArray, M: Array) -> ComplexArray:
    """A vector (n,) with x^H M x = 1, as it is without mass; its phase stays."""
    mass = abs(np.vdot(vector, M @ vector))
    return vector / (math.sqrt(mass) or 1.0)


@dataclass(frozen=True)
class UnstableMode:
    """A mode that grows: a pair of eigenvalues (flutter) or a real one (divergence).

    damping_ratio is negative; onset is the parameter value at which this mode began to grow, None
    where it is not known or the mode grows from the start of the range on; interval holds the
    onset, None where it is known to rounding.
    """

    kind: str
    frequency_hz: float
    growth_rate: float  # 1/s
    damping_ratio: float
    onset: float | None = None
    interval: tuple[float, float] | None = None

    @property
    def root(self) -> complex:
        """The eigenvalue (rad/s), of a pair that above the axis."""
        return complex(self.growth_rate, math.tau * self.frequency_hz)


def growing(values: Iterable[Eigenvalue]) -> tuple[UnstableMode, ...]:
    """The modes of eigenvalues that grow by more than rounding, the fastest first.

    Eigenvalues on which no verdict may rest are left out, and of each pair the conjugate with
    Im < 0. Two conjugates that rounding does not tell from real roots count as two divergences.
    """
    modes = []
    for e in sorted(values, key=lambda e: -e.growth_rate):
        is_lower = e.kind == "flutter" and e.value.imag < 0.0
        if not is_lower and e.decides and e.kind in GROWING:
            modes.append(UnstableMode(e.kind, e.frequency_hz, e.growth_rate, e.damping_ratio))
    return tuple(modes)


def complex_eigenvalues(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> Spectrum:
    """All 2n eigenvalues of M q'' + C q' + K q = 0, in rad/s, by rising frequency.

    Without damping the n x n problem in lambda^2 is solved, so that marginal modes have real
    parts, and divergent ones imaginary parts, of exactly zero.

    Parameters
    ----------
    M, C, K : array (n, n)
        In consistent units; M symmetric, positive definite, C None without damping.

    Raises
    ------
    InputError
        For matrices that are not square, real, finite and of one size.
    ComputationError
        If roots are beyond double precision.

    Examples
    --------
    >>> mode = complex_eigenvalues([[2.0]], [[0.4]], [[50.0]]).eigenvalues[0]
    >>> round(mode.frequency_hz, 4), round(mode.damping_ratio, 4)
    (0.7956, 0.02)
    """
    return spectrum_of(normalised_system(M, C, K))


def spectrum_of(system: NormalisedSystem, roots: RootsWithRounding | None = None) -> Spectrum:
    """All eigenvalues of a system in mass-normalised coordinates, see `complex_eigenvalues`.

    roots: the result of `roots_of` for this system, if the caller has it; its vectors and condition
    numbers are completed in place.
    """
    A = system.A
    B = np.zeros_like(A) if system.B is None else system.B
    reach = dependence(system)  # (n, n): which rows depend on which unknowns
    values, right, left, condition, rounding = roots or roots_of(system, reach)
    # `roots_of` solves strong components one by one: its vectors are zero in all other components,
    # also in those on which their own acts
    one_component_drives_another = (reach != reach.T).any()
    if one_component_drives_another:
        _complete_vectors(A, B, reach, values, right, left, condition)
    abs_values = np.abs(values)
    norm_A = float(np.linalg.norm(A, 2))
    norm_B = float(np.linalg.norm(B, 2))
    # the size of the terms of P(lambda) x = (lambda^2 + lambda B + A) x, whose sum is the defect
    size = (abs_values**2 + abs_values * norm_B + norm_A) * np.linalg.norm(right, axis=0)
    defect = np.linalg.norm(values**2 * right + values * (B @ right) + A @ right, axis=0)
    residuals = np.divide(defect, size, out=np.zeros_like(defect), where=size > 0)
    shapes = _physical(system.T, right)
    left_shapes = _physical(system.T, left)
    eigenvalues = []
    for k in ordered(values):
        eigenvalue = Eigenvalue(
            value=complex(values[k]),
            right=shapes[:, k],
            left=left_shapes[:, k],
            residual=float(residuals[k]),
            condition=float(condition[k]),
            rounding=float(rounding[k]),
        )
        eigenvalues.append(eigenvalue)
    return Spectrum(tuple(eigenvalues))


def _complete_vectors(
    A: Array,
    B: Array,
    reach: NDArray[np.bool_],
    values: ComplexArray,
    right: ComplexArray,
    left: ComplexArray,
    condition: Array,
) -> None:
    """Complete the vectors of strong components by their entries in other components, in place.

    `roots_of` leaves these entries zero. The right vector gets entries in the components that the
    root's component drives, the left one in those that drive it. So both are nonzero in the root's
    component alone, and y^H P'(lambda) x is still a sum over it. Scaling the longer vectors to unit
    length divides this sum, and multiplies the condition number, by the product of their lengths.

    Parameters
    ----------
    A, B : array (n, n)
        Of z'' + B z' + A z = 0.
    reach : array of bool (n, n)
        reach[i, j]: row i depends on unknown j, see `dependence`.
    values : array (m,)
        The roots, rad/s.
    right, left : array (n, m)
        Vectors as columns, zero outside of the component of each root; on return of unit length.
    condition : array (m,)
        Condition numbers of the roots in their components; on return in the whole system.
    """
    identity = np.eye(len(A))
    # a component depends on all unknowns on which a component that drives it depends, and on more:
    # sorted by their number it comes behind. In the adjoint problem driving ones come behind
    driven_last = sorted(components(reach), key=lambda rows: reach[rows[0]].sum())
    driving_last = sorted(components(reach), key=lambda rows: reach.T[rows[0]].sum())
    for k, z in enumerate(values):
        P = z * z * identity + z * B + A
        # the factor of y^H P' x: the product of the lengths of both vectors within the component
        lengths = _complete_vector(P, reach, driven_last, right[:, k])
        lengths *= _complete_vector(P.conj().T, reach.T, driving_last, left[:, k])
        condition[k] /= max(lengths, EPS)


def _complete_vector(
    P: ComplexArray,
    reach: NDArray[np.bool_],
    component_rows: Sequence[NDArray[np.intp]],
    vector: ComplexArray,
) -> float:
    """Complete the null vector (n,) of one component of P by its entries in driven ones, in place.

    In the rows of each driven component P x = 0 is solved for its entries; those of the components
    before it are known by then. Where a driven component is singular, too, its own null vector
    outweighs all other entries.

    Parameters
    ----------
    P : array (n, n)
        The matrix.
    reach : array of bool (n, n)
        reach[i, j]: row i of P depends on unknown j.
    component_rows : sequence of array of int
        The rows of each component, behind those of the ones that it depends on.
    vector : array (n,)
        Zero outside of its component before, of unit length after.

    Returns
    -------
    float
        The length of the vector within its own component afterwards, at most 1.
    """
    largest = int(np.argmax(np.abs(vector)))  # a row of the vector's own component
    entry_before = abs(vector[largest]) / np.linalg.norm(vector)
    size = float(np.linalg.norm(P)) or 1.0  # P is zero at a root of zero without stiffness
    for rows in component_rows:
        # these rows depend on the vector's own component, and not the reverse
        is_driven = reach[rows[0], largest] and not reach[largest, rows[0]]
        if is_driven:
            block = P[np.ix_(rows, rows)]
            solve = solver_near_singular(block, EPS * size)
            vector[rows] = -solve(P[rows] @ vector, False)  # the block itself, not its adjoint
            vector /= np.abs(vector).max()
    vector /= np.linalg.norm(vector)
    # all entries within the component were divided by one number, which one entry shows
    return float(abs(vector[largest]) / entry_before)


def _physical(T: Array, z: ComplexArray) -> ComplexArray:
    """Mode shapes T z (n, m) in the caller's coordinates, from mass-normalised vectors z (n, m).

    They have x^H M x = 1, and a largest entry that is real and positive.
    """
    return normalised(T @ (z / np.linalg.norm(z, axis=0)), np.ones(z.shape[1]))


def normalised(vectors: ComplexArray, lengths: Array) -> ComplexArray:
    """Vectors (n, m) divided by lengths (m,), read-only, their largest entries real, positive."""
    largest = vectors[np.argmax(np.abs(vectors), axis=0), np.arange(vectors.shape[1])]
    vectors = vectors * (np.abs(largest) / largest / lengths)
    vectors.setflags(write=False)
    return np.asarray(vectors, dtype=complex)
