"""A reduced basis of few right and left modes for one band: parametric model order reduction.

A projection onto hundreds of real vectors holds the modes at all values of the parameters; those of
one band need few complex ones. X holds right and Y left modes at some of the values, both in the
coordinates of that projection, so that Y^H A X of its matrices are the terms of a small problem.
Values at which its roots may be off too far add their own modes (greedy training). The error of a
root follows from the residuals R and S of its right and left vectors in the full problem, which
meet through the inverse of a symmetric structure's F: S^H F^-1 R, estimated by random vectors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import EPS, divisor
from squeal.linear.system import TermSystem
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.dense import roots_at
from squeal.sparse.quadratic import (
    Array,
    Bools,
    Changes,
    ComplexArray,
    Roots,
    projected,
    report,
)

SKETCH = 48  # random vectors that estimate a residual within a factor of two
DROPPED = 2e-4  # of unit vectors: what modes of another value add less is left out
COARSE = 1e-3  # of |lambda|: greater errors are corrected, and roots that decay more decide nothing
FINE = 1e-5  # of |lambda|: errors with which training ends
FINE_GROWTH = 0.1  # ... or of the growth rate
ADDED = 0.05  # of the largest error: modes of greater ones are added
MARGIN = 0.05  # of the region's size: roots that close to it are estimated too
TRAINED_MARGIN = 0.1  # ... and modes that close to it are among those that are added
UNCERTAINTY = 2.0
"""Of the product of two estimated norms: what is added to an estimated product. Norms and product
come from the same SKETCH vectors. Of parallel residuals they are all too small by the same share,
chi-squared of SKETCH degrees over SKETCH, which is below 1 / (1 + 2) once in a million times."""


class ErrorBounds(NamedTuple):
    """How far roots (m,) of a projected problem may be from those of the full one."""

    errors: Array  # rad/s
    stay_on_axis: Bools  # of an undamped problem: alone on the imaginary axis, so they stay there


def root_error_bounds(
    values: ComplexArray, slope: ComplexArray, truncation: ComplexArray, uncertainty: Array
) -> ErrorBounds:
    """How far roots of a projected problem may be from those of the full one, by first order.

    Parameters
    ----------
    values : ndarray (m,)
        The roots l_i of the projected problem, rad/s.
    slope : ndarray (m, m)
        y_i^H ((l_i + l_j) M + C) x_j of left and right modes: divided differences of P, and P' on
        the diagonal.
    truncation : ndarray (m, m)
        What the directions outside of the projection add to y_i^H P x_j: S^H F^-1 R of the
        residuals R = P x and S = P^H y.
    uncertainty : ndarray (m, m)
        How far an entry of `truncation` may be off.
    """
    try:
        inverse = np.linalg.inv(slope)
    except np.linalg.LinAlgError:  # a multiple root without as many modes
        inverse = np.full_like(slope, np.inf)
    with np.errstate(invalid="ignore", over="ignore"):
        D = np.abs(inverse @ truncation) + np.abs(inverse) @ uncertainty
        gaps = np.abs(np.subtract.outer(values, values))
        products = D * D.T
        np.fill_diagonal(products, 0.0)
        # two roots at a gap g that a product d couples move by |g - sqrt(g^2 - 4 d)| / 2, which is
        # at most 2 d / g while they repel (4 d <= g^2), and sqrt(d) where they meet
        repelled = np.full_like(gaps, np.inf)
        np.divide(2 * products, gaps, out=repelled, where=gaps > 0)
        errors = np.diag(D) + np.minimum(np.sqrt(products), repelled).sum(axis=1)
    np.fill_diagonal(gaps, np.inf)
    # the nearest root may come as far towards it
    is_alone = 2 * errors < gaps.min(axis=1, initial=np.inf)
    return ErrorBounds(np.nan_to_num(errors, nan=np.inf), (values.real == 0.0) & is_alone)


def random_vectors(rows: int, seed: int) -> Array:
    """Columns (rows, SKETCH) whose products with a vector have its length, on the average."""
    return np.random.default_rng(seed).standard_normal((rows, SKETCH)) / np.sqrt(SKETCH)


def term_weights(system: TermSystem, p: Changes, values: ComplexArray) -> NDArray:
    """The weights (terms, m) of the terms of M, C and K in P(values) x: factor times power."""
    weights = []
    for terms, power in zip(system.parts, (2, 1, 0), strict=True):
        for term in terms:
            weights.append(term.factor.value(p) * values**power)
    return np.array(weights)


def near_axis(values: ComplexArray, decay: float, gap: float) -> Bools:
    """True for roots that may decide, and those near one: shares of |lambda| for both.

    A root may decide if it decays by less than a share, or least of all.
    """
    may_decide = (values.real > -decay * np.abs(values)) | (values.real == values.real.max())
    deciding = values[may_decide]
    gaps = np.abs(np.subtract.outer(values, deciding))
    return np.any(gaps <= gap * np.abs(deciding), axis=1) | may_decide


class Probes(NamedTuple):
    """Random vectors, left right' = F^-1 of a structure on the average, or their products."""

    left: NDArray
    right: NDArray


@dataclass(frozen=True, eq=False)
class ResidualSketch:
    """What estimates residuals in the full problem of vectors in the coordinates of a projection.

    `residual` (terms, SKETCH, d) are random vectors against what each term makes of right vectors;
    `probes` of each structure are its probes against those of left and of right vectors. `norms`
    (terms,) are those of the full terms, `structure_at` is the index of the structure that serves
    some parameters, and `series` bounds the rest of the series of F^-1 by its first term.
    """

    residual: NDArray
    probes: Sequence[Probes]
    norms: Array
    structure_at: Callable[[Changes], int]
    series: float

    def of_modes(self, left: ComplexArray, right: ComplexArray) -> ResidualSketch:
        """The sketch for vectors in the coordinates of columns (d, k)."""
        probes = [Probes(one.left @ left.conj(), one.right @ right) for one in self.probes]
        return replace(self, residual=self.residual @ right, probes=probes)


class ModesWithErrors(NamedTuple):
    """Roots (m,) of a reduced basis in and around its region."""

    roots: Roots  # with unit vectors in the coordinates of the projection
    residuals: Array  # backward errors in the full problem
    errors: Array  # rad/s

    def shares_of_allowed(self) -> Array:
        """Errors over those with which training ends."""
        values = self.roots.values
        allowed = np.maximum(FINE * np.abs(values), FINE_GROWTH * np.abs(values.real))
        return self.errors / divisor(allowed)


class _SmallProblem(NamedTuple):
    """lambda^2 M + lambda C + K of few modes, complex matrices (k, k)."""

    M: ComplexArray
    C: ComplexArray
    K: ComplexArray

    def values(self, region: Rectangle) -> ComplexArray:
        """All finite roots (rad/s), those in and around a region to rounding."""
        M, C, K = self
        shift = region.centre + (0.03 + 0.04j) * region.radius
        radius = region.radius
        # theta = radius / (lambda - shift) of the companion form
        images = np.hstack([radius * (2 * shift * M + C), radius**2 * M])
        solved = np.linalg.solve(shift * (shift * M + C) + K, images)
        companion = np.vstack([-solved, np.eye(len(M), 2 * len(M))])
        theta = np.linalg.eigvals(companion)
        sizes = np.abs(theta)
        theta = theta[sizes > np.finfo(float).eps * sizes.max(initial=0.0)]
        return shift + radius / theta

    def roots_at(self, values: ComplexArray) -> Roots:
        """Roots with right and left unit vectors (k, m), by inverse iteration."""
        z = values[:, None, None] * (1.0 + 8 * EPS)  # beside a root that is exact
        P = z * (z * self.M + self.C) + self.K
        start = np.random.default_rng(51).standard_normal((len(self.M), 1))
        right = np.linalg.solve(P, start)[:, :, 0].T
        left = np.linalg.solve(P.conj().transpose(0, 2, 1), start)[:, :, 0].T
        return Roots(
            values=values,
            right=right / np.linalg.norm(right, axis=0),
            left=left / np.linalg.norm(left, axis=0),
        )


class ReducedBasis:
    """The right and left modes that have been added, and their small system.

    `right` and `left` (d, k) are orthonormal columns in the coordinates of a projection. Modes of
    `trained_region` are added, so that roots of the `region` inside it are good.
    """

    system: TermSystem

    def __init__(
        self, projection: TermSystem, residuals: ResidualSketch, region: Rectangle
    ) -> None:
        self.projection = projection
        self.residuals = residuals
        self.region = region
        self.estimated_region = region.widened(MARGIN)
        self.trained_region = region.widened(TRAINED_MARGIN)
        self.right: ComplexArray = np.zeros((projection.n, 0), dtype=complex)
        self.left = self.right

    @property
    def size(self) -> int:
        """Number of right modes k, and of left ones."""
        return self.right.shape[1]

    def train(
        self, points: Sequence[Changes], modes_at: Callable[[Changes, ComplexArray | None], Roots]
    ) -> None:
        """Add modes until no error at the points is above what is allowed.

        All of those at the first, the last and the middle one; then greedily, where the largest
        error is, those whose errors are too large. `modes_at` has the modes of the projection next
        to some values, or all in the trained region.
        """
        last = len(points) - 1
        for k in (last // 2, 0, last):
            self.grow(modes_at(points[k], None))
        while self.size:
            estimates = [self.estimate(changes) for changes in points]
            ratios = [found.shares_of_allowed() for found in estimates]
            largest = [float(np.max(of_point, initial=0.0)) for of_point in ratios]
            k = int(np.argmax(largest))
            report(f"{self.size} modes, errors up to {largest[k]:.2g} of allowed")
            if largest[k] <= 1.0:
                return
            is_wrong = ratios[k] > ADDED * largest[k]
            if not self.grow(modes_at(points[k], estimates[k].roots.values[is_wrong])):
                return

    def grow(self, modes: Roots) -> bool:
        """Add right and left modes of the projection; False if that brings nothing."""
        right, right_sizes = _directions_beyond(self.right, modes.right)
        left, left_sizes = _directions_beyond(self.left, modes.left)
        new = int(np.sum(np.maximum(right_sizes, left_sizes) > DROPPED))
        if new == 0:
            return False
        self.right = np.hstack([self.right, right[:, :new]])
        self.left = np.hstack([self.left, left[:, :new]])
        self.system = projected(self.projection, self.left, self.right)
        self._mode_residuals = self.residuals.of_modes(self.left, self.right)
        return True

    def roots(self, changes: Changes, left: bool = False) -> Roots:
        """The roots in the region with vectors of the few modes, multiple ones with several."""
        problem = self._at(changes)
        values = problem.values(self.trained_region)
        return roots_at(*problem, values[self.region.contains(values)], left)

    def _at(self, changes: Changes) -> _SmallProblem:
        """The small problem at some parameters."""
        M, C, K = self.system.at(changes)
        return _SmallProblem(M, C, K)

    def in_projection(
        self, right: ComplexArray, left: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Right and left vectors (k,) of the few modes in the coordinates of the projection."""
        return self.right @ right, self.left @ left

    def estimate(self, changes: Changes, deciding: bool = False) -> ModesWithErrors:
        """Roots in and around the region; of a decision those alone that are near the axis."""
        problem = self._at(changes)
        values = problem.values(self.trained_region)
        values = values[self.estimated_region.contains(values)]
        if deciding and len(values):
            values = values[near_axis(values, COARSE, COARSE)]
        roots = problem.roots_at(values)
        left = roots.left.conj().T
        mass = left @ problem.M @ roots.right
        damping = left @ problem.C @ roots.right
        weights = term_weights(self.projection, self.projection.values(changes), values)
        sketch = self._mode_residuals
        probes = sketch.probes[sketch.structure_at(changes)]
        S = _images(probes.left, roots.left.conj(), weights)
        R = _images(probes.right, roots.right, weights)
        share = UNCERTAINTY + sketch.series
        bounds = root_error_bounds(
            values,
            slope=np.add.outer(values, values) * mass + damping,
            truncation=S.T @ R,
            uncertainty=share * np.outer(np.linalg.norm(S, axis=0), np.linalg.norm(R, axis=0)),
        )
        residuals = np.linalg.norm(_images(sketch.residual, roots.right, weights), axis=0)
        in_projection = self.in_projection(roots.right, roots.left)
        return ModesWithErrors(
            roots=Roots(values, *in_projection),
            residuals=residuals / divisor(weighted_norms(weights, sketch.norms)),
            errors=bounds.errors,
        )


def weighted_norms(weights: NDArray, norms: Array) -> Array:
    """The sum (m,) of the norms (terms,) of the full terms with weights (terms, m)."""
    sizes = np.abs(weights)
    return np.sum(sizes * norms[:, None], axis=0, where=sizes > 0.0)


def _images(sketch: NDArray, vectors: ComplexArray, weights: NDArray) -> ComplexArray:
    """Random vectors against residuals (SKETCH, m) of vectors (k, m), from (terms, SKETCH, k)."""
    return np.einsum("trm,tm->rm", sketch @ vectors, weights)


def _directions_beyond(basis: ComplexArray, columns: ComplexArray) -> tuple[ComplexArray, Array]:
    """Orthonormal directions that unit columns add to a basis, and their sizes, falling."""
    remainder = columns
    for _ in range(2):
        remainder = remainder - basis @ (basis.conj().T @ remainder)
    axes, sizes, _ = np.linalg.svd(remainder, full_matrices=False)
    return axes, sizes
