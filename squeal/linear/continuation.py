"""Eigenvalues of a parametrised system along its parameter: a spectrum with slopes at each value.
Nothing here knows of verdicts; `steps` matches one value with the next.

The eigenvalues z of A(p) v = z v stand for lambda in one of three problem classes. Without damping
they are z = -lambda^2 in mass-normalised coordinates. An undamped gyroscopic system (M and K
symmetric, C skew) has z = -i lambda, any other one z = lambda, both over a frequency scale and of
the first-order form. What neither grows nor decays lies on a line: the real axis of the first two,
*conservative* classes, the imaginary axis of the third. A spectrum that is symmetric about its line
leaves it only where two eigenvalues meet on it.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError, MatrixError
from squeal.linear.condensation import THROUGH_INFINITY, Condensation
from squeal.linear.functions import SystemFunction, matrices_of, with_slopes
from squeal.linear.matrices import (
    EPS,
    ILL_CONDITIONED,
    MCK,
    Array,
    StandardProblem,
    components,
    divisor,
    first_order,
    is_regular,
    norm_of,
    normalised_system,
    null_spaces,
    reaches,
)
from squeal.linear.roots import ComplexArray, left_vectors, root_rounding, square_roots
from squeal.linear.verdicts import (
    DIVERGENCE,
    FLUTTER,
    Codes,
    UnstableCount,
    is_undamped,
    kinds,
)

Bools = NDArray[np.bool_]


class ProblemClass(StrEnum):
    """What the eigenvalues z stand for: -lambda^2, -i lambda or lambda, see above."""

    UNDAMPED = "undamped"
    GYROSCOPIC = "gyroscopic"
    DAMPED = "damped"

    def exponents(self, z: ComplexArray, scale: float | Array) -> ComplexArray:
        """The eigenvalues lambda (...), rad/s, of z (...); of z = -lambda^2 the root with Re >= 0.

        scale: the frequency scale, 1/s, by which z was divided; not used where z = -lambda^2.
        """
        if self is UNDAMPED:
            return np.sqrt(-z + 0j)
        if self is GYROSCOPIC:
            z = 1j * z
        return z * scale

    def z_of(self, exponents: ComplexArray, scale: float | Array) -> ComplexArray:
        """The z (...) of eigenvalues lambda (...), rad/s."""
        if self is UNDAMPED:
            return -(exponents**2)
        z = exponents / scale
        return -1j * z if self is GYROSCOPIC else z

    @property
    def growth_sign(self) -> int:
        """1 if growth begins where the function of an event rises with the parameter, -1 if it
        begins where that falls; see `LocalRoots.event_function`."""
        return 1 if self is DAMPED else -1


UNDAMPED, GYROSCOPIC, DAMPED = ProblemClass


SMALL_ROWS = 40
"""Rows up to which systems are stacked, and SciPy's loading is not worth while."""


Numbers = NDArray | complex


def hermite_cubic(a: Numbers, da: Numbers, b: Numbers, db: Numbers) -> NDArray:
    """Coefficients (4, ...) by rising powers of t through values and derivatives at 0 and 1."""
    return np.array([a, da, 3 * (b - a) - 2 * da - db, 2 * (a - b) + da + db])


def zeros_between(cubic: Array) -> list[float]:
    """Real zeros in 0 <= t <= 1, or next to it, of a cubic by rising powers."""
    if not np.any(cubic[1:]):
        return []
    roots = np.roots(cubic[::-1])
    real = roots[np.abs(roots.imag) < 1e-9].real
    return sorted(real[np.abs(real - 0.5) <= 0.5 + 1e-9].tolist())


class ModalCouplings(NamedTuple):
    """Pairs of roots that may meet, and how a change of the parameter couples the two of each.

    W and T are those of the head of `steps`: dA/dp in the eigenvectors, and the coupling of two
    roots by way of all others.

    Attributes
    ----------
    k, l : array of int (pairs,)
        Indices of the two roots.
    conjugate : array of bool (pairs,)
        Whether the two are conjugate, or meet at zero.
    direct : array (2, pairs)
        W_kl and W_lk.
    indirect : array (2, pairs)
        T_kl and T_lk.
    bend : array (pairs,)
        Half of z_k'' - z_l'', as far as it comes from all other roots.
    """

    k: NDArray[np.intp]
    l: NDArray[np.intp]
    conjugate: Bools
    direct: ComplexArray
    indirect: ComplexArray
    bend: ComplexArray


@dataclass(frozen=True, eq=False, repr=False)
class SpectrumAtParameter:
    """The spectrum at one value of the parameter.

    `z` (m,) are the eigenvalues that stand for lambda, see the head of the module; `exponents` are
    lambda itself. `right` and `left` are unit vectors (N, m); `coupling` (m, m) is dA/dp in them,
    with left^H right = 1, and has the slopes dz/dp on its diagonal. `rounding` (m,) bounds how far
    rounding moves each z.
    """

    value: float
    z: ComplexArray
    right: ComplexArray
    left: ComplexArray
    coupling: ComplexArray
    rounding: Array
    problem: ProblemClass = DAMPED
    frequency_scale: float | Array = 1.0

    @property
    def slopes(self) -> ComplexArray:
        """Derivatives dz/dp (m,)."""
        return self.coupling.diagonal()

    @cached_property
    def exponents(self) -> ComplexArray:
        """The eigenvalues lambda (m,), rad/s; without damping those that do not decay."""
        return self.problem.exponents(self.z, self.frequency_scale)

    @cached_property
    def omegas(self) -> Array:
        """Angular frequencies |Im lambda| (m,), rad/s."""
        return np.abs(self.exponents.imag)

    @cached_property
    def z_is_real(self) -> Bools:
        """Which z (m,) are real, as far as rounding tells: lambda itself only with damping."""
        return np.abs(self.z.imag) <= self.rounding

    @cached_property
    def on_line(self) -> Bools:
        """Which roots (m,) neither grow nor decay, as far as rounding tells."""
        if self.problem is DAMPED:
            return np.abs(self.z.real) <= self.rounding
        if self.problem is GYROSCOPIC:
            return self.z_is_real
        return self.z_is_real & (self.z.real >= -self.rounding)

    @cached_property
    def close(self) -> Bools:
        """Which two roots (m, m) rounding does not separate; each root is close to itself.

        The bound counts twice: rounding e of a difference moves its square by twice e times it.
        """
        distances = np.abs(self.z[:, None] - self.z)
        return distances <= 2 * self.unresolved

    @property
    def unresolved(self) -> Array:
        """How far two roots z (m, m) must lie apart so that rounding does not explain it."""
        return np.add.outer(self.rounding, self.rounding)

    @property
    def conjugate(self) -> Bools:
        """Which two z (m, m) are conjugate, as far as rounding tells."""
        return np.abs(self.z[:, None] - self.z.conj()) <= self.unresolved

    @cached_property
    def kinds(self) -> Codes:
        """What each root (m,) does, an index into `VERDICTS`; of a pair that grows both do."""
        if self.problem is UNDAMPED:
            exponents, rounding = square_roots(self.z, self.rounding)
            return kinds(exponents, rounding)
        if self.problem is GYROSCOPIC:  # z = -i lambda
            return kinds(1j * self.z, self.rounding)
        return kinds(self.z, self.rounding)

    @property
    def grows(self) -> Bools:
        """Which roots (m,) grow by more than rounding."""
        return self.kinds >= FLUTTER

    @cached_property
    def unstable_pairs(self) -> list[int]:
        """Indices of the upper roots of growing pairs, the fastest first."""
        imag = self.z.imag
        if self.problem is GYROSCOPIC:  # z = -i lambda
            imag = self.z.real
        return self._fastest_first((self.kinds == FLUTTER) & (imag > 0.0))

    @cached_property
    def unstable_reals(self) -> list[int]:
        """Indices of growing real roots, the fastest first."""
        return self._fastest_first(self.kinds == DIVERGENCE)

    def _fastest_first(self, chosen: Bools) -> list[int]:
        """Indices of the roots of a mask (m,), by falling growth rate."""
        order = np.argsort(-self.exponents.real)
        return [int(k) for k in order if chosen[k]]

    @cached_property
    def unstable_count(self) -> UnstableCount:
        """How many pairs and real roots lambda grow by more than rounding, and how fast."""
        rates = self.exponents.real
        pairs = self.unstable_pairs
        reals = self.unstable_reals
        return UnstableCount(
            pairs=len(pairs),
            reals=len(reals),
            pair_rate=float(rates[pairs[0]]) if pairs else 0.0,
            real_rate=float(rates[reals[0]]) if reals else 0.0,
        )

    @property
    def verdict(self) -> str:
        """flutter or divergence, whichever grows faster, or quiet."""
        return self.unstable_count.verdict

    @property
    def growing_roots(self) -> int:
        """How many roots lambda grow by more than rounding, two for a pair."""
        return self.unstable_count.growing_roots

    @cached_property
    def count_bounds(self) -> tuple[int, int]:
        """The least and the greatest number of growing roots lambda (two for a pair), as far as
        rounding tells.

        Masks (m,) tell which z certainly stand for growing roots, and which possibly do.
        """
        z = self.z
        rounding = 2 * self.rounding  # as far as two roots count as close, see `close`
        per_root = np.ones(len(z))  # how many growing roots lambda each z stands for
        has_close_root = self.close.sum(axis=1) > 1
        if self.problem is DAMPED:
            certain = z.real > rounding
            possible = z.real > -rounding
            # a real root counts as 1, a complex one above the real axis as 2, for its pair, and one
            # below it as 0
            per_root += np.sign(z.imag) * ~self.z_is_real
        elif self.problem is GYROSCOPIC:  # z = -i lambda
            certain = z.imag < -rounding
            possible = has_close_root  # z leaves the real axis only together with another
        else:  # each complex s and each negative one gives a growing root
            certain = (np.abs(z.imag) > rounding) | (z.real < -rounding)
            possible = has_close_root | (z.real < rounding)
        return int(per_root[certain].sum()), int(per_root[certain | possible].sum())

    @property
    def count_is_certain(self) -> bool:
        """True if rounding leaves no doubt about how many roots grow."""
        least, most = self.count_bounds
        return least == most

    @cached_property
    def couplings(self) -> ModalCouplings:
        """The couplings of all pairs of roots that may meet, each pair once.

        With damping two roots may meet on the real axis or above it, without damping on the line at
        positive frequencies; what lies below mirrors them. Conjugate roots may meet, too.

        With F_kl = W_kl / (z_k - z_l) and F_kk = 0, half of z_k'' is (F W)_kk, and
        2 T_kl = (F W - W F)_kl + F_kl (W_kk - W_ll): derived in docs/searching.md, "Couplings
        of roots".
        """
        z = self.z
        W = self.coupling
        slopes = self.slopes
        differences = z[:, None] - z
        unresolved = self.unresolved
        conjugate = self.conjugate  # a new array, which is changed below
        if self.problem is DAMPED:
            may_meet = z.imag >= -self.rounding
        else:
            positive = z.real > (0.0 if self.problem is UNDAMPED else -self.rounding)
            may_meet = self.z_is_real & positive
            conjugate &= positive
        if self.problem is GYROSCOPIC:  # two that are opposite meet at zero
            conjugate |= (np.abs(z[:, None] + z) <= unresolved) & self.z_is_real
        k, l = np.nonzero(np.triu((may_meet[:, None] & may_meet) | conjugate, 1))  # k < l
        both_ways = np.stack([k, l]), np.stack([l, k])  # (2, pairs): entries (k, l) and (l, k)
        with np.errstate(all="ignore"):
            inverse = np.where(np.abs(differences) > unresolved, 1 / differences, 0.0)
            F = W * inverse
            T = (F @ W - W @ F + F * (slopes[:, None] - slopes)) / 2
            half_second_derivative = np.einsum("km,mk->k", F, W)
            bend = half_second_derivative[k] - half_second_derivative[l]
            # by other roots alone: the term m = l of z_k''/2 is W_kl W_lk / (z_k - z_l), the term
            # m = k of z_l''/2 is the same with the other sign, and their difference is left out
            bend = bend - 2 * W[k, l] * W[l, k] * inverse[k, l]
        return ModalCouplings(
            k=k,
            l=l,
            conjugate=conjugate[k, l],
            direct=W[both_ways],
            indirect=T[both_ways],
            bend=bend,
        )


class Continuation:
    """The spectrum of system(p) -> (M, C, K) for low <= p <= high.

    Of complex matrices only roots above the real axis mean something; each stands for a pair.

    Examples
    --------
    >>> import numpy as np
    >>> K = lambda p: np.array([[2.0, -1.0 + 4 * p / 3], [-1.0, 2.0]])
    >>> continuation = Continuation(lambda p: (np.eye(2), None, K(p)), 0.0, 2.0)
    >>> continuation.problem.value, continuation.at(0.75).z.real.round(6).tolist()
    ('undamped', [2.0, 2.0])
    """

    problem: ProblemClass
    frequency_scale: float | Array = 0.0
    """By which z is lambda, or -i lambda, 1/s; 0 until the first problem sets it."""

    def __init__(
        self,
        system: SystemFunction,
        low: float,
        high: float,
        all_roots: bool = False,
    ) -> None:
        """all_roots: keep roots far faster than the others, although the others lose digits."""
        self.system = system
        self.low = low
        self.high = high
        # not at round values, at which an entry may be zero by chance
        inner_values = [low + x * (high - low) for x in (0.07, 0.31, 0.53, 0.71, 0.97)]
        samples = matrices_of(system, inner_values)
        self._projections = _without_free_motions(samples)
        self.problem = problem_class_of(samples)
        projected: list[MCK] = []
        masses = []
        for M, C, K in samples:
            projected.append((self._projected(M), self._projected(C), self._projected(K)))
            masses.append(projected[-1][0])
        n = len(masses[0])
        self.size = n if self.problem is UNDAMPED else 2 * n  # rows N of A
        self._condensation: Condensation | None = None
        if not all(map(is_regular, masses)):
            self._condensation = Condensation(projected, self.problem is UNDAMPED, all_roots)
            self.size = self._condensation.size
            self.frequency_scale = self._condensation.frequency_scale
        if self.problem is UNDAMPED:
            self.frequency_scale = 1.0
        self._spectra: dict[float, SpectrumAtParameter] = {}
        self._last: tuple[float, StandardProblem] | None = None  # the last value, and A there
        self._pattern = np.zeros((self.size, self.size), dtype=bool)  # entries of A that are not 0
        # rows of the strong components of A at all values so far; each by itself where A is zero
        self._components: list[NDArray[np.intp]] = list(np.arange(self.size)[:, None])
        self._state_scales = np.ones(self.size)
        zero = np.zeros_like(samples[0][0])
        # these calls set the frequency scale and the components too; slopes do not matter yet
        problems = [self._standard_problem(matrices, (zero, zero, zero)) for matrices in samples]
        if (
            self.problem is not UNDAMPED
            and self._condensation is None
            and len(self._components) > 1
        ):
            self._state_scales = _balanced_states(
                [problem.A for problem in problems], self._components
            )

    @property
    def has_all_roots(self) -> bool:
        """Whether no finite root is left out, as very fast ones of light motions are."""
        return not self.hidden and (self._condensation is None or not self._condensation.left_out)

    @property
    def hidden(self) -> int:
        """How many finite roots are missing, as rounding makes them infinite."""
        return self._condensation.hidden if self._condensation is not None else 0

    @property
    def spectra(self) -> list[SpectrumAtParameter]:
        """All spectra so far, by rising value."""
        return [self._spectra[p] for p in sorted(self._spectra)]

    def _standard_problem(self, matrices: MCK, slopes: MCK, value: float = 0.0) -> StandardProblem:
        """The standard eigenproblem of M, C and K, and its derivative for slopes dM, dC and dK.

        It is that of the projected matrices, see `_regular_problem`, or of the condensation where
        M is singular. Entries of A by which one strong component of the rows acts on another change
        no eigenvalue and cost digits: they are set to zero.

        The first call sets the frequency scale for all others. Entries that were zero at all values
        so far renew the pattern and the components.

        value: of the parameter, if the slopes are by it.
        """
        M, C, K = (self._projected(X) for X in matrices)
        dM, dC, dK = (self._projected(X) for X in slopes)
        if self._condensation is not None:
            A, dA, sizes = self._condensation.problem((M, C, K), (dM, dC, dK), value)
        else:
            A, dA, sizes = self._regular_problem((M, C, K), (dM, dC, dK))
        if self.problem is GYROSCOPIC:
            A = -1j * A
            dA = -1j * dA
        pattern = self._pattern | (A != 0.0) | (dA != 0.0)
        if not np.array_equal(pattern, self._pattern):
            self._pattern = pattern
            self._components = components(reaches(pattern))
        if len(self._components) > 1:
            within = np.zeros(A.shape)
            for rows in self._components:
                within[np.ix_(rows, rows)] = 1.0
            return StandardProblem(A * within, dA * within, sizes * within)
        return StandardProblem(A, dA, sizes)

    def _regular_problem(self, matrices: MCK, slopes: MCK) -> StandardProblem:
        """The problem of projected matrices with a regular M: undamped that of A, else of the
        first-order form of A and B.

        With L M R = 1 (`left`, `right`) A = L K R and B = L C R. As d(M^-1) = -M^-1 dM M^-1 their
        derivatives are dA = L dK R - (L dM R) A and dB = L dC R - (L dM R) B. slopes: dM, dC and
        dK.
        """
        M, C, K = matrices
        dM, dC, dK = slopes
        left, right = _normalising(M)
        A: NDArray = left @ K @ right
        B = left @ C @ right
        mass_slope = left @ dM @ right
        dA: NDArray = left @ dK @ right - mass_slope @ A
        dB = left @ dC @ right - mass_slope @ B
        abs_left = np.abs(left)
        abs_right = np.abs(right)
        # sizes: rounding of each entry over the machine precision. The last term is that of
        # left M right = 1, which moves A by its product with A
        mass_error = abs_left @ np.abs(M) @ abs_right
        sizes = abs_left @ np.abs(K) @ abs_right + mass_error @ np.abs(A)
        damping_sizes = abs_left @ np.abs(C) @ abs_right + mass_error @ np.abs(B)
        if self.problem is not UNDAMPED:
            n = len(A)
            # the first call finds the scale 0 and sets it; all later ones keep it
            A, self.frequency_scale = first_order(A, B, self.frequency_scale or None)
            dA = first_order(dA, dB, self.frequency_scale)[0]
            # `first_order` changes the signs of its blocks
            sizes = first_order(-sizes, -damping_sizes, self.frequency_scale)[0]
            dA[:n] = 0.0  # the upper rows are exact and constant
            sizes[:n] = 0.0
            # D^-1 A D with D = diag(state scales), which balances A and leaves its eigenvalues
            ratios = self._state_scales / self._state_scales[:, None]
            A *= ratios
            dA *= ratios
            sizes *= ratios
        return StandardProblem(A, dA, sizes)

    def _projected(self, X: Array) -> Array:
        """M, C or K (n, n), or a derivative, without the free motions."""
        if self._projections is None:
            return X
        P, Q = self._projections
        return P.conj().T @ X @ Q

    def _standard_problems(self, ps: Sequence[float]) -> list[StandardProblem]:
        """The standard eigenproblem at each value."""
        at_values = with_slopes(self.system, ps, self.low, self.high)
        problems = []
        for value, (matrices, slopes) in zip(ps, at_values, strict=True):
            problems.append(self._standard_problem(matrices, slopes, value))
        return problems

    def standard_problem(self, p: float) -> StandardProblem:
        """The standard eigenproblem at p; the last one computed is stored."""
        if self._last is None or self._last[0] != p:
            self._last = p, self._standard_problems([p])[0]
        return self._last[1]

    def rows_of_components(self, right: NDArray, left: NDArray) -> NDArray[np.intp]:
        """The rows of all strong components in which some of the vectors (N, k) is not zero."""
        is_nonzero = np.any((right != 0.0) | (left != 0.0), axis=1)
        chosen = np.zeros(self.size, dtype=bool)
        for rows in self._components:
            chosen[rows] = is_nonzero[rows].any()
        return np.flatnonzero(chosen)

    def couplings(self, spectrum: SpectrumAtParameter, change: MCK) -> ComplexArray:
        """The coupling (m, m) of the roots of a spectrum by a change dM, dC, dK of the matrices.

        It is what `SpectrumAtParameter.coupling` is for a change of the parameter: the change of A
        in the eigenvectors, with the slopes of the roots on the diagonal.
        """
        (matrices,) = matrices_of(self.system, [spectrum.value])
        derivative = self._standard_problem(matrices, change).derivative
        return _in_vectors(derivative, spectrum.left, spectrum.right)

    def perturbed_by_rounding(self, p: float) -> list[StandardProblem]:
        """Problems at p whose `derivative` is that of A by a relative change of a number behind it.

        One for each number that the system computes its matrices from, such as those of a pad's
        equilibrium; none if the system has no method `perturbed_by_rounding`.
        """
        perturbed = getattr(self.system, "perturbed_by_rounding", None)
        if perturbed is None:
            return []
        return [self._standard_problem(matrices, slopes) for matrices, slopes in perturbed(p)]

    def at(self, p: float) -> SpectrumAtParameter:
        """The spectrum at p, computed once."""
        if p not in self._spectra:
            problem = self.standard_problem(p)
            roots, right = _eigenpairs(problem.A, self._components)
            self._add(p, problem, roots, right)
        return self._spectra[p]

    def prepare(self, ps: Iterable[float]) -> None:
        """Compute the spectra at several values together, if that saves time."""
        new = [p for p in dict.fromkeys(ps) if p not in self._spectra]
        if new and self.size <= SMALL_ROWS:
            problems = self._standard_problems(new)
            matrices = np.array([problem.A for problem in problems])
            roots, right = _eigenpairs(matrices, self._components)
            for i, p in enumerate(new):
                self._add(p, problems[i], roots[i], right[i])

    def _add(self, p: float, problem: StandardProblem, roots: NDArray, right: NDArray) -> None:
        """Store the spectrum at p, from its roots (N,) and unit right vectors (N, N).

        Left vectors and the rounding of the roots are computed here, component by component.
        """
        A = problem.A
        left = np.zeros_like(right)
        rounding = np.zeros(len(A))
        for rows in self._components:
            block = np.ix_(rows, rows)
            left[block] = left_vectors(A[block], roots[rows], right[block])
        # how far a root moves per backward error: 1 / |y^H x| of unit vectors, inf at a multiple
        # root without as many vectors
        with np.errstate(all="ignore"):
            condition = 1.0 / np.abs(np.sum(left.conj() * right, axis=0))
        for rows in self._components:
            size = norm_of(A[np.ix_(rows, rows)])
            backward_error = 2 * len(rows) * EPS  # of the QR algorithm, a share of the norm
            rounding[rows] = root_rounding(roots[rows], condition[rows], backward_error, size)
        self._spectra[p] = SpectrumAtParameter(
            value=p,
            z=roots,
            right=right,
            left=left,
            coupling=_in_vectors(problem.derivative, left, right),
            rounding=rounding,
            problem=self.problem,
            frequency_scale=self.frequency_scale,
        )


def _balanced_states(
    samples: Sequence[NDArray], component_rows: Sequence[NDArray[np.intp]]
) -> Array:
    """Scale factors (N,) of the states: those with which the matrix of each strongly connected
    component has a norm close to its own largest root.

    The first half of the states are displacements, the second half velocities over one frequency
    scale, that of the fastest component, so that each component has the matrix [[0, 1], [-k, -c]].
    Of a component that is far slower than the fastest one, k and c lie below the rounding of the
    entries 1 beside them, and its roots would be lost. The caller multiplies entry (i, j) by
    s[j] / s[i] with the factors s. With s of the velocities about the larger one of sqrt(k) and c,
    the entries become s, k / s and c, none of them much larger than s. The factors are powers of
    two, which round nothing.

    Parameters
    ----------
    samples : sequence of array (N, N)
        The matrix at some values of the parameter.
    component_rows : sequence of array of int
        The rows of its strongly connected components.
    """
    scales = np.ones(len(samples[0]))
    half = len(scales) // 2
    for rows in component_rows:
        upper = rows[rows < half]
        lower = rows[rows >= half]
        # of blocks without rows or columns the norm is 0
        stiffness = max(norm_of(A[np.ix_(lower, upper)]) for A in samples)
        damping = max(norm_of(A[np.ix_(lower, lower)]) for A in samples)
        highest = max(math.sqrt(stiffness), damping)
        if len(upper) and len(lower) and highest:
            scales[lower] = 2.0 ** round(math.log2(highest))
    return scales


def _in_vectors(matrix: NDArray, left: NDArray, right: NDArray) -> ComplexArray:
    """A matrix (N, N) in eigenvectors: left^H matrix right (m, m), scaled as if left^H right = 1.

    left, right: unit vectors (N, m). The product left^H right of a defective eigenvalue, which has
    no slope, is zero to rounding; it is replaced by EPS.
    """
    products = np.sum(left.conj() * right, axis=0)
    products = np.where(np.abs(products) < EPS, EPS, products)
    return np.asarray(left.conj().T @ (matrix @ right) / products[:, None], dtype=complex)


def _eigenpairs(A: NDArray, component_rows: Sequence[NDArray[np.intp]]) -> tuple[NDArray, NDArray]:
    """Eigenvalues (..., N) and unit right vectors (..., N, N) of matrices (..., N, N).

    `component_rows` are the rows of each strong component of the matrices; each component is solved
    by itself and has as many eigenvalues as rows.
    """
    roots = np.zeros(A.shape[:-1], complex)
    right = np.zeros(A.shape, complex)
    for rows in component_rows:
        block = A[..., rows[:, None], rows]
        hermitian = np.array_equal(block, block.conj().swapaxes(-1, -2))
        solver = np.linalg.eigh if hermitian else np.linalg.eig
        roots[..., rows], right[..., rows[:, None], rows] = solver(block)
    return roots, right


def problem_class_of(samples: Sequence[tuple[Array, Array | None, Array]]) -> ProblemClass:
    """The problem class of matrices M, C, K at some values; C may be None."""
    if not all(is_undamped(M, C, K) for M, C, K in samples):
        return DAMPED
    is_gyroscopic = any(C is not None and C.any() for _, C, _ in samples)
    return GYROSCOPIC if is_gyroscopic else UNDAMPED


def _without_free_motions(samples: Sequence[MCK]) -> tuple[Array, Array] | None:
    """Projections P and Q that remove free motions, whose roots are zero at all values.

    P' M Q a'' + P' C Q a' + P' K Q a = 0 has all other roots.

    A free motion is a vector x with K x = C x = 0 at all samples. With P' M x = 0 and, for some y
    of regular y' M x, y' M Q = 0, let q = Q a + x b. Then x b vanishes from the rows P' of the
    equations, so that a moves by itself, and the rows y' add y' M x b'' = (terms of a): each
    removal takes the double zero root of each x, and no other root.

    Of the transposed matrices a free motion is a combination y of rows with y' K = y' C = 0. The
    parameter may leave only some x free, or only some y, as a force that acts on one of two bodies
    alone. Zeros may also form a longer chain, of which a removal leaves another free motion. So
    motions of the matrices and of their transposes are removed in turn until none can be removed
    (see `_complement_of_free_motions`); if all that are left are free, they stay.

    Parameters
    ----------
    samples : sequence of (M, C, K)
        Arrays (n, n) at some values of the parameter.

    Returns
    -------
    (P, Q) or None
        Arrays (n, n - k). None if there are no free motions, or if M varies.
    """
    M = samples[0][0]
    acting: list[Array] = []
    for other_M, C, K in samples:
        if not np.array_equal(M, other_M):
            return None
        acting += C, K
    P = Q = np.eye(len(M))
    size_before = len(M) + 1
    while len(M) < size_before:
        size_before = len(M)
        for _ in range(2):
            # bases of what is left of the rows and of the motions
            rows, columns = _complement_of_free_motions(M, acting)
            # P' X Q becomes its transpose, for which P and Q change places; the second pass
            # changes them back
            P, Q = Q @ columns, P @ rows
            M, *acting = [(rows.conj().T @ X @ columns).conj().T for X in (M, *acting)]
    if len(M) == len(P):
        return None
    return P, Q


def _complement_of_free_motions(M: Array, acting: Sequence[Array]) -> tuple[Array, Array]:
    """P and Q (n, n - k) with P' M x = 0 and y' M Q = 0, without k free motions x.

    On these none of the matrices `acting` acts: X x = 0. y is x, or M x where y' M x would be
    singular. P and Q are identities if no motion is free, if all are, or if one of them has no
    mass.
    """
    # scaled to a unit diagonal of M and to a largest entry of 1, so that units do not matter
    scale = 1.0 / np.sqrt(divisor(np.abs(np.diag(M))))[:, None]
    unit_sized = []
    for X in acting:
        scaled = scale * X * scale.T
        unit_sized.append(scaled / divisor(np.abs(scaled).max()))
    stacked = np.vstack(unit_sized)
    noise = 8 * EPS * len(M) * float(np.linalg.norm(stacked, 2))
    motions = scale * null_spaces(stacked, noise)[0]
    k = motions.shape[1]
    if 0 < k < len(M):
        # in the scaled coordinates x~ = x / scale and M~ = scale M scale first y~ = x~, then
        # y~ = M~ x~. Of one motion y' M x is a number: it is compared with the sizes of its factors
        scaled_M = scale * M * scale.T
        for y in (motions, scale**2 * (M @ motions)):
            gram = y.conj().T @ M @ motions  # of unit vectors x~
            sizes = np.linalg.norm(y / scale, 2) * np.linalg.norm(scaled_M, 2)
            if np.linalg.svd(gram, compute_uv=False)[-1] > ILL_CONDITIONED * sizes:
                # P' M x = 0 with P = scale p, p orthogonal to scale M x; so for Q and y' M Q = 0
                P = scale * np.linalg.qr(scale * (M @ motions), "complete")[0][:, k:]
                Q = scale * np.linalg.qr(scale * (M.conj().T @ y), "complete")[0][:, k:]
                return P, Q
    return np.eye(len(M)), np.eye(len(M))


def _normalising(M: Array) -> tuple[Array, Array]:
    """L, R (n, n) with L M R = 1, which remove the units of the unknowns; M is regular.

    If M is symmetric, positive definite, L = R'. Else R is diagonal: it scales the columns of M,
    whose rows have been scaled to a largest entry of 1, to a largest entry of 1. L is the inverse
    of M R.
    """
    try:
        R = normalised_system(M, None, np.zeros_like(M)).T  # the field T, with T' M T = 1
    except InputError:  # not symmetric, positive definite
        if not is_regular(M):
            raise MatrixError(THROUGH_INFINITY) from None
        rows_scaled = np.abs(M) / np.abs(M).max(axis=1, keepdims=True)
        R = np.diag(1.0 / rows_scaled.max(axis=0))
        return np.asarray(np.linalg.inv(M @ R)), R
    return R.T, R
