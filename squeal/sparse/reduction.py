"""Projection of a large system onto few vectors, the same at all values of its parameters.

The reduced matrices V' A_i V keep the factors of the full ones, so that the reduced system is a
system of terms like any other. Its roots are judged by the residual of the full problem, which
random vectors estimate.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.matrices import MCK, Matrix, norm_of
from squeal.linear.system import System
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Parameters
from squeal.numerics.threads import side_by_side
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.corrections import ACCEPTED_RESIDUAL, corrected_roots, enlarged, grown
from squeal.sparse.dense import dense_values, roots_at
from squeal.sparse.factor import Factor
from squeal.sparse.krylov import MOST_COLUMNS, BlockArnoldi
from squeal.sparse.quadratic import (
    Array,
    ComplexArray,
    Roots,
    ScaledProblem,
    ScaledSystem,
    multiply,
    report_progress,
)
from squeal.sparse.reduced_basis import (
    SKETCH,
    ReducedBasis,
    estimated_backward_errors,
    random_vectors,
    term_weights,
)
from squeal.sparse.region_roots import modes_in

if TYPE_CHECKING:
    from scipy.sparse import csc_array

RESIDUAL_TOLERANCE = 3e-8  # of the backward error; that of a root is of the order of its square
SPURIOUS_RESIDUAL = 1e-5  # backward error of what is no root of the full problem
MOST_SAMPLES = 20  # full solutions before a reduction is given up
LARGEST_CONTRACTION = 0.9  # what counts as contracting
FEWEST_PRODUCTS = 8  # of a vector with T, to see how T contracts
MOST_PRODUCTS = 30
LEAST_SHARE = 1e-5  # of an eigenvector in a random vector, up to some 10^8 rows


@dataclass(frozen=True, eq=False)
class Complement:
    """The directions outside of an orthonormal basis V (n, d): all x with V' F x = 0."""

    basis: Array
    projected: NDArray  # V' F V
    matrix: csc_array  # F
    factor: Factor  # of F

    def contraction(self, P: csc_array) -> float:
        """An estimate of the largest |eigenvalue| of T = 1 - F^-1 P in the directions outside.

        Below 1 the Neumann series P^-1 = (1 + T + T^2 + ...) F^-1 converges there: P is regular
        outside, so that these directions add no root to those of the projection onto V.

        The estimate is the largest |Ritz value| in the Krylov subspace of a random vector, mostly
        one from below: of a normal T no Ritz value exceeds the largest |eigenvalue|. An eigenvalue
        of `LARGEST_CONTRACTION` would show in that vector after m products with T, unless its share
        in the vector is below (estimate / LARGEST_CONTRACTION)^m; products end when this is less
        than `LEAST_SHARE`, or at `MOST_PRODUCTS`. These see an eigenvalue of 1 among 30,000 others
        if the others are real and at most 0.89, or complex in all directions and at most 0.8; they
        may miss it among complex ones of 0.85.
        """
        start = np.random.default_rng(1).standard_normal((len(self.basis), 1)).astype(complex)
        krylov = BlockArnoldi(partial(self._times_T, P), start, MOST_PRODUCTS + 1)
        estimate = 0.0
        for ritz in krylov.growing(MOST_PRODUCTS):
            estimate = float(np.max(np.abs(ritz.values), initial=0.0))
            share = (estimate / LARGEST_CONTRACTION) ** krylov.applied
            if krylov.applied >= FEWEST_PRODUCTS and share < LEAST_SHARE:
                break
        return estimate

    def _times_T(self, P: csc_array, x: ComplexArray) -> ComplexArray:
        """T x (n, m), without its part inside of the basis."""
        image = x - self.factor.solve(P @ x)
        # outside V' F x = 0: x less V (V' F V)^-1 V' F x
        inside = np.linalg.solve(self.projected, multiply(self.basis.T, self.matrix @ image))
        return image - multiply(self.basis, inside)

    def contraction_in(self, region: Rectangle, problem: ScaledProblem) -> float:
        """The larger `contraction` of P(lambda) at the two right corners of a region, where roots
        grow fastest, taken into the upper half plane: there lie conjugates of roots below it."""
        corners = (
            complex(region.high_real, max(region.low_imag, 0.0)),
            complex(region.high_real, max(abs(region.low_imag), abs(region.high_imag))),
        )
        return max(side_by_side(lambda corner: self.contraction(problem.at(corner)), corners))


class EstimatedModes(NamedTuple):
    """Roots of the reduced system that are some of the full one."""

    roots: Roots
    residuals: Array  # backward errors (m,) in the full problem, estimated
    spurious: int  # roots of the reduced system alone, which are left out


class ReducedProblem(NamedTuple):
    """The reduced matrices at some values of the parameters."""

    parameters: Parameters  # all
    matrices: MCK
    stiffness: float  # a bound of the norm of the full K, whose rounding the reduced K carries


class _FactorisedSample(NamedTuple):
    """P, factorised at a value near its roots (rad/s), at changed parameters."""

    changes: Parameters
    shift: complex
    factor: Factor


class Reduction:
    """A growing basis, the full system projected onto it, and residuals of roots in a region.

    `vectors` (n, d) are orthonormal, `system` is dense (d, d) with the parameters of the full one;
    both grow with each `sample`. `reduce_system` sets three attributes at its end, which are empty,
    infinite and 0 until then: `samples` are the values of parameters at which the full problem was
    solved; `worst_residual` is the largest backward error in the full problem of a root that is not
    spurious, over all values; `spurious` is the number of roots at the samples that only the
    reduced system has.
    """

    system: System
    method = "reduced"

    def __init__(self, scaled: ScaledSystem, region: Rectangle) -> None:
        self.scaled = scaled
        self.region = region
        self.vectors: Array = np.zeros((scaled.n, 0))
        self._factorised: _FactorisedSample | None = None  # by which later samples are corrected
        self.samples: tuple[Parameters, ...] = ()
        self.worst_residual = np.inf
        self.spurious = 0
        # the matrices of M, then of C, then of K
        self._matrices = list(itertools.chain(*scaled.terms))
        self._norms = np.array([norm_of(A) for A in self._matrices])
        self._probes = random_vectors(scaled.n, seed=48)
        self._probed = [A.T @ self._probes for A in self._matrices]
        self._sketch: Array = np.zeros((len(self._matrices), SKETCH, 0))
        self._outside = self._sketch  # of the images of the basis, their parts outside of it
        # roots of the reduced system by its parameters: all, or those of a part of the region.
        # Copies of a reduction share them: a search at frozen frequencies asks for the same ones as
        # the search of the basis
        self._values_at: dict[
            tuple[frozenset[tuple[str, float]], Rectangle | None], ComplexArray
        ] = {}

    def extend(self, columns: ComplexArray, dropped: float = RESIDUAL_TOLERANCE / 10) -> None:
        """Enlarge the basis by the real and imaginary parts of columns (n, m), and project the
        system onto it.

        Columns are scaled to unit length. Of their parts outside of the basis directions with
        singular values below `dropped` are left out.
        """
        old = self.vectors
        self.vectors = enlarged(old, columns, dropped)
        new = np.ascontiguousarray(self.vectors[:, old.shape[1] :])
        if not new.size:
            return
        # only the rows and columns of the new vectors are computed
        before = [np.zeros((0, 0))] * len(self._matrices)
        if old.size:
            before = [term.matrix for term in self.system.terms]
        reduced = side_by_side(partial(grown, old=old, new=new), before, self._matrices)
        self._values_at = {}  # those of the smaller basis are no longer valid
        # `mapped` asks for the terms of M, of C, then of K: the order of `self._matrices`
        self.system = self.scaled.system.mapped(
            lambda term: Term(next(reduced), term.factor),
            labels=(),  # the labels of the full system name its rows, not basis vectors
        )
        # the residuals' sketch: random vectors times each full matrix, times the new vectors
        sketch = np.array([images.T @ new for images in self._probed])
        self._sketch = np.concatenate([self._sketch, sketch], axis=2)
        probed_basis = self._probes.T @ self.vectors
        inside = [probed_basis @ term.matrix for term in self.system.terms]
        self._outside = self._sketch - inside

    def sample(self, changes: Parameters, region: Rectangle, certify: bool = False) -> None:
        """Add the modes of the full problem in a region at the parameters, some with `changes`.

        If they are to be counted (`certify`), they are computed by Krylov subspaces. Otherwise the
        modes that the basis has are corrected, see `_corrected`; where that is not possible they
        are computed by Krylov subspaces, too. The first of these that reaches the whole region
        leaves the factor with which later samples are corrected.
        """
        problem = self.scaled.at(changes)
        roots = modes_in(problem, region).roots if certify else self._corrected(problem, region)
        if roots is None:
            # residuals of 2e-9 suffice for a basis: the error of a root is of the order of their
            # square
            modes = modes_in(
                problem, region, certify=False, start=self.vectors, exact=ACCEPTED_RESIDUAL
            )
            roots = modes.roots
            # `rough` are the roots around one shift, with P factorised there; None where the
            # region was halved, so that no single shift serves it. Their vectors, too, are added to
            # the basis: outside of them 1 - F^-1 P contracts for F, which is P at these parameters,
            # and P at others, see `Complement`, so that later samples can use the factor
            if self._factorised is None and modes.rough is not None and len(roots.values):
                rough = modes.rough
                self._factorised = _FactorisedSample(changes, rough.shift, rough.factor)
                self.extend(rough.vectors)
        self.extend(np.hstack([roots.right, roots.left]))

    def _corrected(self, problem: ScaledProblem, region: Rectangle) -> Roots | None:
        """The roots of the reduced system in a region, corrected by the factor of a sample.

        `region` may be a part of `self.region`. None if no sample has left a factor, if the basis
        may miss a root of `self.region`, or if corrections do not converge or lead to no root. The
        basis may miss one unless T of its complement contracts, see `Complement.contraction`.
        """
        if self._factorised is None:
            return None
        # the parameters of the sample, the shift (rad/s), and the factor of the full P there
        changes, shift, factor = self._factorised
        M, C, K = self.system.at(changes)
        projected_P = shift * shift * M + K
        if C is not None:
            projected_P = projected_P + shift * C
        # the F of the complement is the full P at that sample and shift; V' F V is the reduced one
        complement = Complement(
            basis=self.vectors,
            projected=projected_P,
            matrix=self.scaled.at(changes).at(shift),
            factor=factor,
        )
        contraction = complement.contraction_in(self.region, problem)
        if contraction >= LARGEST_CONTRACTION:
            return None
        # a factor below the tolerance of the basis, so that a solved root is not sampled again
        exact = RESIDUAL_TOLERANCE / 3
        roots = corrected_roots(problem, factor, self.vectors, region, exact=exact, accepted=exact)
        if roots is None or not len(roots.values):  # the basis may hold no mode near the region
            return None
        return roots

    @property
    def size(self) -> int:
        """Number of vectors d."""
        return self.vectors.shape[1]

    @property
    def standalone_system(self) -> System:
        """The reduced system to be written or analysed by itself.

        It has bounds of the errors of its entries, projected from those of the full system, and the
        assumption that it approximates another system.
        """
        sizes = np.abs(self.scaled.scale[:, None] * self.vectors)  # of V in unscaled coordinates

        def bound(errors: Matrix) -> Matrix:
            """|V|' errors |V|, a bound of the errors of V' A V."""
            return sizes.T @ (errors @ sizes)

        full_terms = iter(self.scaled.system.terms)  # in the order of the reduced ones

        def with_errors(reduced: Term) -> Term:
            """The reduced term with bounds of errors, from the full term that stands behind it."""
            with_bounds = next(full_terms).mapped(bound, bound)  # its matrix is not used
            return replace(with_bounds, matrix=reduced.matrix)

        system = self.system.mapped(with_errors, self.system.labels)
        return system.assuming("a reduced system approximates the roots of its band or region")

    @property
    def path_reduction(self) -> ReducedBasis | Reduction:
        """The reduced system on which eigenvalue paths are computed."""
        return self

    def in_projection(
        self, right: ComplexArray, left: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Right and left vectors (d,) of the `path_reduction` in the coordinates of the basis."""
        return right, left

    @property
    def converged(self) -> bool:
        """True if all roots at all values satisfy the full problem to the tolerance."""
        return self.worst_residual <= RESIDUAL_TOLERANCE

    def replaced(self, changes: Parameters) -> Reduction:
        """The same basis, for the system with other values of some of its own parameters."""
        other = copy(self)
        other.scaled = copy(self.scaled)
        other.scaled.system = self.scaled.system.replace(changes)
        other.system = self.system.replace(changes)
        return other

    def _stiffness_norm(self, changes: Parameters) -> float:
        """A bound of the norm of the full K, whose rounding the reduced K carries too."""
        parameters = self.system.values(changes)
        factors = [abs(term.factor.value(parameters)) for term in self.system.K]
        norms = self._norms[-len(factors) :]  # those of the terms of K are the last ones
        return float(np.dot(factors, norms))

    def roots(self, changes: Parameters, values: ComplexArray | None = None) -> Roots:
        """Roots of the reduced system at the parameters, some of them changed.

        All in the region, spurious ones among them, or the roots of some `values` (m,).
        """
        problem = ReducedProblem(
            parameters=self.system.values(changes),
            matrices=self.system.at(changes),
            stiffness=self._stiffness_norm(changes),
        )
        if values is None:
            values = self._values_in_region(problem)
        return roots_at(*problem.matrices, values, problem.stiffness)

    def _values_in_region(self, problem: ReducedProblem) -> ComplexArray:
        """The roots of the reduced problem in the region, of all that it has."""
        key = frozenset(problem.parameters.items()), None
        if key not in self._values_at:
            self._values_at[key] = dense_values(*problem.matrices, problem.stiffness)
        values = self._values_at[key]
        return values[self.region.contains(values)]

    def residuals(self, roots: Roots, changes: Parameters) -> Array:
        """Backward errors (m,) in the full problem of roots of the reduced one, estimated.

        Of the residuals outside of the basis: those inside are rounding, and more than that where
        close roots share vectors, see `roots_at`, which more samples cannot lessen.
        """
        weights = term_weights(self.system, self.system.values(changes), roots.values)
        return estimated_backward_errors(self._outside, self._norms, roots.right, weights)

    def modes(self, changes: Parameters) -> EstimatedModes:
        """The roots in the region whose residuals in the full problem show that they are no
        spurious ones."""
        roots = self.roots(changes)
        residuals = self.residuals(roots, changes)
        is_genuine = residuals <= SPURIOUS_RESIDUAL
        return EstimatedModes(
            roots=roots.select(is_genuine),
            residuals=residuals[is_genuine],
            spurious=int(np.sum(~is_genuine)),
        )

    def values(self, changes: Parameters) -> ComplexArray:
        """The values of the roots that `modes` returns."""
        return self.modes(changes).roots.values


def reduce_system(
    scaled: ScaledSystem,
    region: Rectangle,
    values: Sequence[Parameters],
    kind: type[Reduction] = Reduction,
) -> Reduction:
    """A reduced system whose roots in a region have backward errors of at most `RESIDUAL_TOLERANCE`
    in the full problem, at all values of the parameters (a greedy reduced basis).

    The basis begins with the right and left modes of the full system at the middle, the first and
    the last value. Then, again and again:

    - A root of a residual above `SPURIOUS_RESIDUAL` at a sampled value is spurious, or it stands
      for a mode that the search there has missed. The full problem is solved there once more, with
      a count of its roots; a root whose residual is as large after that is spurious.
    - Where no such value is left, the value not yet sampled at which a root has the largest
      residual adds its modes; `reduce_system` ends when that residual meets the tolerance.

    Parameters
    ----------
    scaled : ScaledSystem
        The full system.
    region : Rectangle
        Where its roots are wanted. If it holds none, the basis holds modes around it.
    values : sequence of mapping
        Values of one to three parameters.
    kind : type
        Reduction or DispersiveReduction.

    Returns
    -------
    Reduction
        Its `worst_residual` exceeds the tolerance if `MOST_SAMPLES` values do not suffice.

    Raises
    ------
    ComputationError
        If there is no root in the region or around it.
    """
    reduction = kind(scaled, region)
    wide = region.surroundings
    sampled: list[int] = []  # indices of the values whose full modes the basis holds
    counted: set[int] = set()  # those at which the roots of the full problem were counted

    def sample(k: int, part: Rectangle, certify: bool = False) -> None:
        """Add the modes in a part of the plane at the value of index k."""
        texts = [f"{name} = {value:.6g}" for name, value in values[k].items()]
        report_progress(f"sample {len(sampled) + 1} at {', '.join(texts) or 'the parameters'}")
        reduction.sample(values[k], part, certify)
        if k not in sampled:
            sampled.append(k)
        if certify:
            counted.add(k)

    for k in dict.fromkeys([len(values) // 2, 0, len(values) - 1]):
        sample(k, wide)
        if reduction.size == 0:
            _sample_around(reduction, values[k], wide)
    while True:
        residuals = [reduction.residuals(reduction.roots(p), p) for p in values]
        spurious = {k: int(np.sum(residuals[k] > SPURIOUS_RESIDUAL)) for k in sampled}
        undecided = [k for k in sampled if spurious[k] and k not in counted]
        if undecided:
            sample(undecided[0], region, certify=True)  # in which the undecided roots lie
            continue
        for k in sampled:  # without the spurious roots
            residuals[k] = residuals[k][residuals[k] <= SPURIOUS_RESIDUAL]
        worst = np.array([np.max(of_value, initial=0.0) for of_value in residuals])
        unsolved = worst.copy()
        unsolved[sampled] = 0.0  # the basis has their modes already
        worst_index = int(np.argmax(unsolved))
        if unsolved[worst_index] <= RESIDUAL_TOLERANCE or len(sampled) == MOST_SAMPLES:
            break
        sample(worst_index, wide)
    reduction.samples = tuple(values[k] for k in sampled)
    reduction.worst_residual = float(worst.max())
    reduction.spurious = sum(spurious.values())
    return reduction


def _sample_around(reduction: Reduction, changes: Parameters, region: Rectangle) -> None:
    """Start the basis of a region without roots from modes around it, which may enter the region at
    other values. Raises ComputationError if the region holds no root however far it is widened."""
    scaled = reduction.scaled
    farthest = scaled.at(changes).frequency_scale + abs(region.centre)
    around = region
    while reduction.size == 0:
        around = around.widened(1.0)
        if around.radius <= farthest:
            reduction.sample(changes, around)
        elif scaled.n <= MOST_COLUMNS:
            reduction.extend(np.eye(scaled.n, dtype=complex))
        else:
            raise ComputationError("no root lies in the region or around it")
