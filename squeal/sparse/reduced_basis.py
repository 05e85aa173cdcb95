"""A reduced basis of the states of right and left modes for one band: parametric model reduction.

A projection onto hundreds of real vectors holds the modes at all values of the parameters; those of
one band need few complex ones. A state is a displacement and a velocity: (x, l x) of a right mode,
(y, l^* y) of a left one. Between the states of left mode i and right mode j, modes at any values of
the parameters, the first-order form l [[C, M], [M, 0]] + [[K, 0], [0, -M]] of l^2 M + l C + K is
the pencil l B + A, which has one root for each state:

    B = y_i^H ((l_i + l_j) M + C) x_j,    A = y_i^H (K - l_i l_j M) x_j.

At one value of the parameters these are the divided differences of a Loewner pencil. Values at
which its roots may be off too far add their own modes (greedy training). The error of a root
follows from the residuals R and S of its right and left vectors in the full problem, which meet
through the inverse of a symmetric structure's F: S^H F^-1 R, estimated by random vectors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import EPS, Matrix, divisor, solver_near_singular
from squeal.linear.system import System
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Parameters
from squeal.numerics.threads import side_by_side
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.quadratic import Array, Bools, ComplexArray, Roots, projected, report_progress

SKETCH = 48  # random vectors that estimate a residual within a factor of two
DROPPED_SHARE = 1e-8  # of the largest singular value of a pencil: smaller ones are left out
INCONSISTENT = 0.3  # of the region's radius times x: where velocities differ so, it is spurious
COARSE_ERROR = 1e-3  # of |lambda|: greater errors are corrected; roots that decay faster are stable
FINE_ERROR = 1e-5  # of |lambda|: errors with which training ends
FINE_GROWTH_ERROR = 0.1  # ... or of the growth rate
ADDED_SHARE = 0.05  # of the largest error: the modes of roots with greater errors are added
ESTIMATED_MARGIN = 0.05  # of the region's size: roots that close to it are estimated too
ABSENT = 1e-3  # of |lambda|: further than this from all estimates, a root is not among them
UNCERTAINTY = 2.0
"""Of the product of two estimated norms: the share that is added to an estimated product. Norms and
product come from the same SKETCH vectors. Of parallel residuals all are too small by one share,
chi-squared of SKETCH degrees over SKETCH, which is below 1 / (1 + 2) once in a million times."""


class ErrorBounds(NamedTuple):
    """How far roots (m,) of a projected problem may be from those of the full one."""

    errors: Array  # rad/s
    stay_on_axis: Bools  # of an undamped problem: alone on the imaginary axis, so they stay there


class TruncationTerm(NamedTuple):
    """What the directions outside of a projection subtract from y_i^H P x_j.

    Eliminated from P (a Schur complement), they subtract S^H P^-1 R of the residuals R = P x and
    S = P^H y.
    """

    value: ComplexArray  # (m, m), with a structure's F^-1 in place of P^-1
    uncertainty: Array  # (m, m), how far an entry may be off


def root_error_bounds(
    values: ComplexArray, slope: ComplexArray, truncation: ComplexArray, uncertainty: Array
) -> ErrorBounds:
    """How far roots of a projected problem may be from those of the full one.

    First-order perturbation theory in modal coordinates: D = slope^-1 truncation is added to the
    diagonal matrix of the roots. D_ii moves root i itself. Two roots at a gap g, coupled by
    d = |D_ij D_ji|, become the eigenvalues of [[0, D_ij], [D_ji, g]]: each moves by at most
    |g - sqrt(g^2 - 4 d)| / 2, which is at most 2 d / g while they stay apart (4 d <= g^2), and
    sqrt(d) where they meet. The error of root i is |D_ii| + sum over j of min(2 d / g, sqrt(d)).

    Parameters
    ----------
    values : ndarray (m,)
        The roots l_i of the projected problem, rad/s.
    slope : ndarray (m, m)
        y_i^H ((l_i + l_j) M + C) x_j of left and right modes: divided differences of P, and P' on
        the diagonal.
    truncation, uncertainty : ndarray (m, m)
        What the directions outside of the projection add to y_i^H P x_j or subtract from it (only
        the size counts), and how far an entry may be off. See `TruncationTerm`.

    Returns
    -------
    ErrorBounds
        Errors (m,) in rad/s, infinite where slope is singular; and a mask (m,) of the roots that
        stay on the imaginary axis if the problem is undamped, which this function does not check.
    """
    try:
        inverse = np.linalg.inv(slope)
    except np.linalg.LinAlgError:  # a multiple root without as many modes
        inverse = np.full_like(slope, np.inf)
    with np.errstate(invalid="ignore", over="ignore"):
        # |D_ij| at most, rad/s
        D = np.abs(inverse @ truncation) + np.abs(inverse) @ uncertainty
        gaps = np.abs(np.subtract.outer(values, values))
        products = D * D.T  # d
        np.fill_diagonal(products, 0.0)
        if_apart = np.full_like(gaps, np.inf)
        np.divide(2 * products, gaps, out=if_apart, where=gaps > 0)
        errors = np.diag(D) + np.minimum(np.sqrt(products), if_apart).sum(axis=1)
    np.fill_diagonal(gaps, np.inf)
    # a root of an undamped problem leaves the axis only where it meets another one; each may move
    # by its error, and both errors are taken as equal
    is_alone = 2 * errors < gaps.min(axis=1, initial=np.inf)
    return ErrorBounds(
        errors=np.nan_to_num(errors, nan=np.inf, posinf=np.inf),
        stay_on_axis=(values.real == 0.0) & is_alone,
    )


def random_vectors(rows: int, seed: int) -> Array:
    """Columns (rows, SKETCH) whose products with a vector have its length, on the average."""
    return np.random.default_rng(seed).standard_normal((rows, SKETCH)) / np.sqrt(SKETCH)


def term_weights(system: System, p: Parameters, values: ComplexArray) -> NDArray:
    """The weights (terms, m) of the terms of M, C and K in P(values) x: factor times power."""
    weights = []
    for terms, power in zip(system.parts, (2, 1, 0), strict=True):
        for term in terms:
            weights.append(term.factor.value(p) * values**power)
    return np.array(weights)


class Probes(NamedTuple):
    """Random vectors whose products left right' average to F^-1 of a structure: arrays (n, SKETCH).

    In a `ResidualSketch` arrays (terms, SKETCH, d): these vectors times each term times a basis.
    """

    left: NDArray
    right: NDArray


@dataclass(frozen=True, eq=False)
class ResidualSketch:
    """Estimates residuals in the full problem of vectors in the coordinates of a projection.

    Its arrays are random vectors times each term times the d columns of the projection, so that no
    estimate needs a vector of the full length.
    """

    residual: NDArray  # (terms, SKETCH, d), for the length of P x
    probes: Sequence[Probes]  # of each structure, (terms, SKETCH, d), for products with its F^-1
    norms: Array  # (terms,) of the matrices of the full terms
    structure_at: Callable[[Parameters], int]  # the index of the structure nearest to parameters
    series: float  # a bound of the further terms of the series of P^-1, as a multiple of its first

    def of_modes(self, left: ComplexArray, right: ComplexArray) -> ResidualSketch:
        """The sketch for vectors in the coordinates of left and right columns (d, k)."""
        probes = []
        for of_structure in self.probes:
            probes.append(Probes(of_structure.left @ left.conj(), of_structure.right @ right))
        return replace(self, residual=self.residual @ right, probes=probes)

    def truncation(
        self, changes: Parameters, right: ComplexArray, left: ComplexArray, weights: NDArray
    ) -> TruncationTerm:
        """What the directions outside of the projection subtract from y_i^H P x_j of modes x, y.

        right, left: the modes (k, m); weights: see `term_weights`.
        """
        probes = self.probes[self.structure_at(changes)]
        # products (SKETCH, m) of random vectors with S and R, whose S.T @ R averages to S^H F^-1 R
        S = _sum_of_terms(probes.left, left.conj(), weights)
        R = _sum_of_terms(probes.right, right, weights)
        norms = np.outer(np.linalg.norm(S, axis=0), np.linalg.norm(R, axis=0))
        return TruncationTerm(S.T @ R, (UNCERTAINTY + self.series) * norms)


class ModesWithErrors(NamedTuple):
    """Roots (m,) of a reduced basis in and around its region."""

    roots: Roots  # with unit vectors in the coordinates of the projection
    residuals: Array  # backward errors in the full problem
    errors: Array  # rad/s

    def ratios_to_allowed(self) -> Array:
        """Errors (m,) over the allowed ones, the largest with which training ends."""
        values = self.roots.values
        allowed = np.maximum(FINE_ERROR * np.abs(values), FINE_GROWTH_ERROR * np.abs(values.real))
        return self.errors / divisor(allowed)


class ReducedBasis:
    """The right and left modes that have been added, and a pencil of combinations of their states.

    `modes` are all that were added, in the coordinates (d,) of a projection. Of their states k
    combinations are used: `left` and `right` (d, k) are the displacements of left and right ones,
    `velocities` (d, k) the velocities of the right ones. `system` is their pencil, a system of the
    first order (its C is the pencil's B, its K the pencil's A). `grow` makes all of them anew from
    the modes; before that k is 0.

    `shift` is a value beside the centre of `region`: there, and at the parameters `middle` given to
    `grow`, the pencil is the unit matrix. `estimated_region` is `region` widened, and `residuals`
    estimates residuals of vectors in the coordinates of the projection.
    """

    system: System  # of k rows
    velocities: ComplexArray
    _products: NDArray  # (terms, k, k), left^H X right of each term X of the projection
    _mode_residuals: ResidualSketch  # `residuals` for vectors in the coordinates of the states

    def __init__(self, projection: System, residuals: ResidualSketch, region: Rectangle) -> None:
        self.projection = projection
        self.residuals = residuals
        self.region = region
        self.estimated_region = region.widened(ESTIMATED_MARGIN)
        self.shift = region.off_centre
        self.modes = Roots.none(projection.n)
        self.right = self.modes.right
        self.left = self.modes.left

    @property
    def size(self) -> int:
        """Number of right states k, and of left ones."""
        return self.right.shape[1]

    def train(
        self,
        points: Sequence[Parameters],
        values_around: Sequence[ComplexArray],
        modes_at: Callable[[Parameters, ComplexArray], Roots],
    ) -> None:
        """Add modes until all errors at the points are allowed ones, or no further state is added.

        First all modes at the middle, the first and the last point are added, and at the other
        points those of roots that are in or around the region only there. Then, again and
        again, the point with the largest error (as a multiple of the allowed one) adds the modes
        next to roots whose errors are more than `ADDED_SHARE` of it. Larger errors than allowed
        remain where the projection has no modes next to such roots, or where the basis has their
        states already.

        Parameters
        ----------
        points : sequence of mapping
            Values of the parameters, in order along the range.
        values_around : sequence of array (m,)
            The roots of the projection in and around the region, at each of the points.
        modes_at : callable
            From values of the parameters and roots (m,): the modes of the projection next to these
            roots.
        """
        last = len(points) - 1
        middle = points[last // 2]
        modes = Roots.none(self.projection.n)
        ends = (last // 2, 0, last)
        for of_point in side_by_side(lambda k: modes_at(points[k], values_around[k]), ends):
            modes = modes.joined(of_point)
        self.grow(modes, middle)
        for changes, values in zip(points, values_around, strict=True):
            absent = self._absent(changes, values)
            self.grow(modes_at(changes, absent), middle)
        while self.size:
            estimates = list(side_by_side(self.estimate, points))
            ratios = [estimate.ratios_to_allowed() for estimate in estimates]
            largest = [float(np.max(of_point, initial=0.0)) for of_point in ratios]
            k = int(np.argmax(largest))
            report_progress(f"{self.size} states, errors up to {largest[k]:.2g} of allowed")
            if largest[k] <= 1.0:
                return
            is_missed = ratios[k] > ADDED_SHARE * largest[k]
            modes = modes_at(points[k], estimates[k].roots.values[is_missed])
            if not self.grow(modes, middle):
                return

    def _absent(self, changes: Parameters, values: ComplexArray) -> ComplexArray:
        """Those of the roots `values` (m,) of the projection that the pencil does not have.

        A root that is in the region only between the values of the parameters whose modes were
        added has left no trace in them.
        """
        if not self.size:
            return values
        _, B, A = self.system.at(changes)
        of_pencil = self._roots_in(self.region.surroundings, B, A).values
        distances = np.abs(np.subtract.outer(values, of_pencil)).min(axis=1, initial=np.inf)
        return values[distances > ABSENT * np.abs(values)]

    def grow(self, modes: Roots, middle: Parameters) -> bool:
        """Add right and left modes of the projection, which may be of any parameters.

        With the singular values s of the pencil of all modes at the shift and at the parameters
        `middle`, U s V^H, the left states are combined by U / sqrt(s) and the right ones by
        V / sqrt(s): there the pencil becomes the unit matrix. Small s are left out, as in a Loewner
        realisation. Returns False, with the states as they were, if there are no modes to add, or
        if no more s are large than there are states already.
        """
        if not len(modes.values):
            return False
        self.modes = self.modes.joined(modes)
        products = projected(self.projection, self.modes.left, self.modes.right)
        z = self.modes.values
        pencil = _pencil_of_states(products, z)
        _, B, A = pencil.at(middle)  # l B + A is a system without mass
        left, sizes, right = np.linalg.svd(self.shift * B + A)
        size = int(np.sum(sizes > DROPPED_SHARE * sizes[0]))
        if size <= self.size:
            return False
        balance = np.sqrt(sizes[:size])
        left = left[:, :size] / balance
        right = right[:size].conj().T / balance
        self.left = self.modes.left @ left
        self.right = self.modes.right @ right
        # of each state: displacements combine the modes x, velocities combine z x
        self.velocities = (self.modes.right * z) @ right
        self.system = projected(pencil, left, right)
        # for y^H P x of vectors in the projection, which `estimate` computes
        self._products = np.array([left.conj().T @ term.matrix @ right for term in products.terms])
        self._mode_residuals = self.residuals.of_modes(self.left, self.right)
        return True

    def roots(self, changes: Parameters) -> Roots:
        """The roots in the region with right and left vectors (k, m) of the small system."""
        _, B, A = self.system.at(changes)
        return self._roots_in(self.region, B, A)

    def _roots_in(self, region: Rectangle, B: Matrix, A: Matrix) -> Roots:
        """The roots of (lambda B + A) x = 0 in a region, without spurious ones, see `_are_modes`.

        With at_shift = shift B + A the equation is at_shift^-1 B x = theta x, where
        theta = 1 / (shift - lambda).
        """
        at_shift = self.shift * B + A
        theta, right = np.linalg.eig(np.linalg.solve(at_shift, B))
        # theta that are zero to rounding are infinite roots
        is_finite = np.abs(theta) > EPS * np.abs(theta).max(initial=0.0)
        values = self.shift - 1.0 / np.where(is_finite, theta, 1.0)
        is_chosen = is_finite & region.contains(values)
        # left vectors are those with left^H at_shift right = 1: columns of (at_shift right)^-H
        solve = solver_near_singular(at_shift @ right, np.finfo(float).tiny)
        left = solve(np.eye(len(B), dtype=complex)[:, is_chosen], True)  # True: by the adjoint
        roots = Roots(values[is_chosen], right[:, is_chosen], left)
        return roots.select(self._are_modes(roots))

    def _are_modes(self, roots: Roots) -> Bools:
        """True for roots (m,) whose right states have velocities lambda times their displacements,
        as the states of modes have; other roots are spurious."""
        displacements = self.right @ roots.right
        differences = self.velocities @ roots.right - displacements * roots.values
        sizes = self.region.radius * np.linalg.norm(displacements, axis=0)
        return np.linalg.norm(differences, axis=0) <= INCONSISTENT * sizes

    def in_projection(
        self, right: ComplexArray, left: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Right and left vectors (k,) of the small system in the coordinates of the projection."""
        return self.right @ right, self.left @ left

    def estimate(self, changes: Parameters) -> ModesWithErrors:
        """Roots in and around the region, with estimated errors and residuals in the full problem.

        To first order the error of a root follows from y^H P x of its modes in the full problem,
        less what the directions outside of the projection subtract, see `TruncationTerm`: the
        difference vanishes for an exact root. y^H P x is computed in the projection, the other term
        is estimated by random vectors.
        """
        _, B, A = self.system.at(changes)  # the pencil l B + A is a system without mass
        roots = self._roots_in(self.estimated_region, B, A)
        values = roots.values
        x, y = self.in_projection(roots.right, roots.left)
        x_lengths = np.linalg.norm(x, axis=0)
        y_lengths = np.linalg.norm(y, axis=0)
        right = roots.right / x_lengths
        left = roots.left / y_lengths
        weights = term_weights(self.projection, self.projection.values(changes), values)
        sketch = self._mode_residuals
        outside = sketch.truncation(changes, right, left, weights)
        # y^H P x, not zero since the velocities are not exactly z x
        inside = left.conj().T @ _sum_of_terms(self._products, right, weights)
        bounds = root_error_bounds(
            values,
            slope=left.conj().T @ B @ right,
            truncation=outside.value - inside,  # only its size counts
            uncertainty=outside.uncertainty,
        )
        return ModesWithErrors(
            roots=Roots(values, x / x_lengths, y / y_lengths),
            residuals=estimated_backward_errors(sketch.residual, sketch.norms, right, weights),
            errors=bounds.errors,
        )


def _pencil_of_states(products: System, z: ComplexArray) -> System:
    """The pencil of the module's head, as a system without mass, its B in C and its A in K.

    products: the terms y_i^H X x_j of left modes i and right modes j; z: the values of the modes.
    """
    terms_of_B = list(products.C)
    terms_of_A = list(products.K)
    for term in products.M:
        terms_of_B.append(Term(np.add.outer(z, z) * term.matrix, term.factor))
        terms_of_A.append(Term(-np.outer(z, z) * term.matrix, term.factor))
    massless = Term(np.zeros((len(z), len(z))))
    return replace(products, M=(massless,), C=tuple(terms_of_B), K=tuple(terms_of_A))


def estimated_backward_errors(
    sketch: NDArray, norms: Array, vectors: ComplexArray, weights: NDArray
) -> Array:
    """Backward errors (m,) in the full problem of vectors (k, m), from their sketched residuals.

    They are relative to the sum of the norms (terms,) of the full terms, each times its |weight|: a
    bound of the norm of the sum of the terms. `sketch` (terms, SKETCH, k): random vectors times
    each term; `weights`: see `term_weights`.
    """
    sizes = np.abs(weights)
    bounds = np.sum(sizes * norms[:, None], axis=0, where=sizes > 0.0)
    return np.linalg.norm(_sum_of_terms(sketch, vectors, weights), axis=0) / divisor(bounds)


def _sum_of_terms(products: NDArray, vectors: ComplexArray, weights: NDArray) -> ComplexArray:
    """Products (r, m) of r vectors with P(z_j) x_j, from those (terms, r, k) with each term.

    vectors: x (k, m); weights (terms, m): the factor and the power of z_j of each term.
    """
    return np.einsum("trm,tm->rm", products @ vectors, weights)
