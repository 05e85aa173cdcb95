"""Estimates of the roots of a region over parameters, from real modes, and the error of each root.

The basis V holds real modes of a structure without friction, up to a multiple of the region's
highest frequency, and what friction, contact and damping add to them: F^-1 R and F^-1 S, with the
structure's own F = K - w^2 M, factorised once, and the residuals R = P x, S = P^H y of right and
left modes in the full problem. Directions outside of V are stiff, so that there P is F up to a part
T = 1 - F^-1 P which contracts by q < 1. Eliminated (a Schur complement), they change the roots of
the projected problem as D = (Y^H P' X)^-1 S^H F^-1 R does; the further terms of the series in T are
at most q / (1 - q) times the product of the energy norms of R and S. In D the entry of a root
itself acts directly, two of different roots through the gap between them. The sum is the error of
the root, in rad/s; where it leaves the sign of the growth rate open the root is corrected in the
full problem.

Without q < 1 directions outside of V may have roots of their own: the full problem is then solved.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.linear.damping import frictionless
from squeal.linear.eigen import Eigenvalue, arrays_of
from squeal.linear.matrices import divisor
from squeal.linear.verdicts import ACCEPTED
from squeal.numerics.differentiation import Parameters
from squeal.numerics.threads import side_by_side
from squeal.sparse.argument_principle import Rectangle, count_roots, disc_around
from squeal.sparse.corrections import corrected_roots
from squeal.sparse.dense import dense_values
from squeal.sparse.factor import Factor, factorise
from squeal.sparse.krylov import MOST_COLUMNS, BlockArnoldi
from squeal.sparse.quadratic import (
    Array,
    Bools,
    ComplexArray,
    Roots,
    ScaledProblem,
    ScaledSystem,
    eigenvalues_of,
    multiply,
    report_progress,
)
from squeal.sparse.reduced_basis import (
    COARSE_ERROR,
    ESTIMATED_MARGIN,
    Probes,
    ReducedBasis,
    ResidualSketch,
    random_vectors,
    root_error_bounds,
)
from squeal.sparse.reduction import LARGEST_CONTRACTION, Complement, Reduction
from squeal.sparse.region_roots import modes_in

if TYPE_CHECKING:
    from scipy.sparse import csc_array


# What a basis holds, and which roots are corrected
REACH_OF_MODES = 2.0  # of the real modes, over the highest frequency
BLOCK_SIZE = 6  # vectors of a step towards them
MODE_RESIDUAL = 1e-4  # of a real mode
ONE_ROUND_ERROR = 1e-3  # of |lambda|: errors for which one more round of corrections suffices
GOOD_ERROR = 1e-7  # of |lambda|: roots with smaller errors add no corrections
MOST_ROUNDS = 5  # of corrections at most
DROPPED_PART = 1e-2  # of unit vectors: what they add less is left out
MOST_TRAINED = 13  # values at most that few modes are made for, without those that are added
SHORTEST_INTERVAL = 4e-3  # of the range of a parameter: where a root may jump it is not divided
DECAYED = 2.0  # times its error: a root that decays by more is not corrected


class Structure:
    """F = K - shift M of the symmetric parts of M and K at some parameters, without friction.

    `shift` is half the square of the `highest` frequency (rad/s) of the region, raised a little
    where F is singular. `factor` is F, factorised.
    """

    def __init__(self, frictionless_problem: ScaledProblem, highest: float) -> None:
        """frictionless_problem: at some parameters; highest: rad/s, of the region."""
        K = _symmetric_part(frictionless_problem.K)
        self.M = _symmetric_part(frictionless_problem.M)
        for name, matrix in {"K": K, "M": self.M}.items():
            if not abs(matrix).max():
                raise InputError(f"{name}: is zero without friction; real modes need a structure")
        self.shift = highest**2 / 2
        self.F = (K - self.shift * self.M).tocsc()
        try:
            self.factor = factorise(self.F)
        except ZeroDivisionError:  # the shift is the square of a natural frequency
            # by a millionth, or by as much as stands out from the rounding of F
            shift_change = max(1e-6 * self.shift, 1e-12 * abs(self.F).max() / abs(self.M).max())
            self.shift += shift_change
            self.F = (self.F - shift_change * self.M).tocsc()
            self.factor = factorise(self.F)

    def probes(self, V: Array, projected: Array) -> Probes:
        """Random vectors (n, SKETCH) whose products left right' average to F^-1.

        Independent random vectors r average r r' to the unit matrix, so that (A r) (B r)' averages
        to A B'. With an orthonormal V (n, d) and E = V' F V (`projected`), F^-1 is the sum of two
        such products: inside of V, V E^-1 V' = (V Q |e|^-1/2) (V Q sign(e) |e|^-1/2)' with the
        eigenvalues e and vectors Q of E; outside of V, G = F^-1 - V E^-1 V' = (1 - V E^-1 V' F) G,
        since V' F G = 0.
        """
        energies, Q = np.linalg.eigh(projected)
        inverse = (Q / energies) @ Q.T  # E^-1
        inside = random_vectors(V.shape[1], seed=50) / np.sqrt(np.abs(energies))[:, None]
        with_sign = np.sign(energies)[:, None] * inside
        random = random_vectors(len(V), seed=49)
        outside_left = random - V @ (inverse @ (V.T @ (self.F @ random)))
        outside_right = self.factor.solve(random) - V @ (inverse @ (V.T @ random))
        # left and right ones get equal lengths: products of outside and inside vectors, which are
        # zero on the average, then scatter least
        balance = math.sqrt(np.linalg.norm(outside_right) / divisor(np.linalg.norm(outside_left)))
        return Probes(
            left=balance * outside_left + V @ (Q @ inside),
            right=outside_right / balance + V @ (Q @ with_sign),
        )

    def modes(self, highest: float) -> NDArray:
        """Real modes as columns (n, m): all up to the frequency `highest` (rad/s); if there is none
        the nearest one.

        By shift-and-invert block Arnoldi: the eigenvalues of F^-1 M are theta = 1 / (w^2 - shift),
        the largest ones those of the modes nearest to the shift.
        """
        reach = highest**2 - self.shift  # of w^2, from the shift to the highest frequency
        start = np.random.default_rng(0).standard_normal((self.F.shape[0], BLOCK_SIZE))
        krylov = BlockArnoldi(lambda x: self.factor.solve(self.M @ x), start, MOST_COLUMNS)
        for ritz in krylov.growing():
            theta = np.abs(ritz.values)
            closeness = reach * theta  # reach / |w^2 - shift|: >= 1 up to the highest frequency
            is_wanted = closeness >= min(1.0, closeness.max())  # the nearest mode in any case
            is_converged = ritz.residuals <= MODE_RESIDUAL * theta
            # the nearest modes appear first: once there is one beyond the highest frequency, none
            # below it is missing
            if not is_wanted.all() and is_converged[is_wanted].all():
                break
        return krylov.basis[:, : krylov.applied] @ ritz.coordinates[:, is_wanted]


def _symmetric_part(A: csc_array) -> csc_array:
    return (A + A.T).real.tocsc() / 2


class EstimatedRoots(NamedTuple):
    """Roots (m,) of the region at some parameters, in no order."""

    values: ComplexArray  # rad/s
    residuals: Array  # backward errors in the full problem
    errors: Array  # of the growth rate, 1/s
    corrected: Bools  # True where solved in the full problem, False where estimated
    projected: Roots  # the roots, but for those without an estimate, with reduced vectors
    rough_values: ComplexArray  # of all roots that were estimated, also outside of the region
    spurious: int = 0  # how many roots of the projected problem the full one does not have


class _ProjectedRoots(NamedTuple):
    """Roots (m,) of the projected problem, their errors, and corrections of their vectors."""

    roots: Roots  # with reduced vectors
    residuals: Array  # backward errors in the full problem
    errors: Array  # rad/s
    stay_on_axis: Bools  # undamped, and alone on the imaginary axis: their growth rate is zero
    corrections: ComplexArray  # F^-1 [R, S] (n, 2 m), directions to add to the basis


class FirstLook(Reduction):
    """A reduction onto real modes and their corrections, which knows the errors of its roots.

    `build` fills it, from structures without friction: one for each different M and K among those
    of the first, the middle and the last value of the parameters, three at most.

    Attributes
    ----------
    structures : list of Structure
        The structures.
    samples : tuple of mapping
        The parameters at which modes are corrected: with three structures those of each, with one
        or two the first and the last value.
    trained : list of mapping
        The values of the parameters at which the `reduced_basis` is trained.
    reduced_basis : ReducedBasis or None
        Few modes that serve at all values; None if they are not needed or do not suffice.
    contraction : float
        q of the head of this module; 0.5 until `build` has computed it.
    error : float
        The largest error of a root at the samples before the last corrections, as a share of
        |lambda|.
    _matrices, _norms, _sketch :
        Of the terms of M, C and K: matrices (n, n), their norms (terms,), and random vectors times
        each matrix times the basis (terms, SKETCH, d).
    """

    method = "modal"

    def __init__(
        self, scaled: ScaledSystem, region: Rectangle, values: Sequence[Parameters]
    ) -> None:
        """Factorise the structures, and choose the values at which modes are corrected.

        values: of the parameters, in order along the range.
        """
        super().__init__(scaled, region)
        self.contraction = 0.5  # a guess, for errors of roots before it is known
        self.reduced_basis: ReducedBasis | None = None
        self.error = np.inf
        self.wide = region.widened(ESTIMATED_MARGIN)
        highest = max(abs(region.low_imag), abs(region.high_imag))
        self.reach = REACH_OF_MODES * highest
        # the parameters of each structure, by its factors: structures of equal factors are one
        parameters_of: dict[tuple[complex, ...], Parameters] = {}
        for k in (0, len(values) // 2, len(values) - 1):
            parameters_of[self._structure_factors(values[k])] = values[k]
        self._frictionless = []
        for changes in parameters_of.values():
            self._frictionless.append(frictionless(scaled.system, changes))
        problems = map(scaled.at, self._frictionless)
        structure = partial(Structure, highest=highest)
        self.structures = list(side_by_side(structure, problems))
        self._factors = np.array(list(parameters_of))  # (structures, terms of M and K)
        index = np.linspace(0, len(values) - 1, min(len(values), MOST_TRAINED))
        self.trained = [values[round(k)] for k in index.tolist()]
        self.samples = tuple(parameters_of.values())
        if len(parameters_of) <= 2:
            self.samples = (values[0], values[-1]) if len(values) > 1 else (values[0],)

    def _structure_factors(self, changes: Parameters) -> tuple[complex, ...]:
        """The factors of the terms of M and K without friction: where they agree the structure is
        the same."""
        system = self.scaled.system
        parameters = frictionless(system, changes)
        return tuple(term.factor.value(parameters) for term in system.M + system.K)

    def _nearest_structure(self, changes: Parameters) -> int:
        """Index of the structure whose factors differ least from those at some parameters."""
        differences = self._factors - self._structure_factors(changes)
        relative = differences / divisor(np.abs(self._factors).max(axis=0))
        return int(np.argmin(np.linalg.norm(relative, axis=1)))

    def build(self) -> FirstLook:
        """The reduction itself, after filling its basis with real modes of the middle structure and
        corrections at the samples, and training the `reduced_basis` of few modes."""
        report_progress(f"real modes of {self.scaled.n} rows")
        middle = len(self.structures) // 2
        self.extend(self.structures[middle].modes(self.reach), DROPPED_PART)
        for _ in range(MOST_ROUNDS):
            shares = self._add_corrections()  # errors of roots over |lambda|, at each sample
            self.error = max(shares)
            if self.error <= ONE_ROUND_ERROR:
                break
        self.contraction = max(side_by_side(self._contraction, self.samples))
        # few modes save time only if there are more values than samples, and only with damping:
        # without C the projected problem is one of w^2, of half the size
        if self.is_complete and len(self.trained) > len(self.samples) and self.system.C:
            basis = ReducedBasis(self.system, self._residual_sketch(), self.region)
            around = self.region.surroundings
            values_around = [z[around.contains(z)] for z in self._add_trained_where_roots_jump()]
            basis.train(self.trained, values_around, self.roots)
            self.reduced_basis = basis if basis.size else None
        return self

    def _add_corrections(self) -> list[float]:
        """Enlarge the basis by corrections of the modes at the samples, and set `worst_residual`.

        Returns the largest error of a root at each sample before that, as a share of |lambda|.
        """
        shares = []
        residuals = []
        corrections = []
        for estimated in side_by_side(self._inexact_roots, self.samples):
            sizes = np.abs(estimated.roots.values)
            is_off = estimated.errors > GOOD_ERROR * sizes
            # corrections of right vectors, then of left ones
            corrections.append(estimated.corrections[:, np.tile(is_off, 2)])
            shares.append(float(np.max(estimated.errors / sizes, initial=0.0)))
            residuals.append(float(np.max(estimated.residuals, initial=0.0)))
        self.worst_residual = max(residuals)
        report_progress(f"{self.size} vectors, errors up to {max(shares):.2g} of |lambda|")
        self.extend(np.hstack(corrections), DROPPED_PART)
        return shares

    def _inexact_roots(self, changes: Parameters) -> _ProjectedRoots:
        """The roots of the projected problem in and around the region, without the exact root 0 of
        a rigid body, at some parameters."""
        values = self._projected_values(changes)
        near_values = values[self.wide.contains(values)]
        return self._roots_with_errors(changes, near_values[near_values != 0.0])

    def _residual_sketch(self) -> ResidualSketch:
        """Random vectors times terms times basis, to estimate residuals in the full problem.

        With the terms A of P, each with its weight w (factor times power of lambda), and reduced
        vectors x and y, the residuals are R = sum of w A V x and S = sum of conj(w) A^H V y. Their
        products with random vectors are right' R = sum of w ((A' right)' V) x and
        left' conj(S) = sum of w ((A left)' V) conj(y): the arrays (terms, SKETCH, d) hold the
        factors between w and the vectors. A' is the transpose.
        """
        V = self.vectors
        probes = []
        for k, structure in enumerate(self.structures):
            left, right = structure.probes(V, self._projected_structure(k))
            # default arguments: threads may call the functions when `left` and `right` are the next
            of_left = side_by_side(lambda A, left=left: (A @ left).T @ V, self._matrices)
            of_right = side_by_side(lambda A, right=right: (A.T @ right).T @ V, self._matrices)
            probes.append(Probes(np.array(list(of_left)), np.array(list(of_right))))
        return ResidualSketch(
            residual=self._sketch,
            probes=probes,
            norms=self._norms,
            structure_at=self._nearest_structure,
            series=self._series,
        )

    def _projected_structure(self, k: int) -> Array:
        """V' F V (d, d) of structure number k."""
        M, _, K = self.system.at(self._frictionless[k])
        F = (K - self.structures[k].shift * M).real
        return (F + F.T) / 2

    def _add_trained_where_roots_jump(self) -> list[ComplexArray]:
        """Add values to `trained`, and return all roots (rad/s) of the projected problem at each.

        If one parameter varies, a value is added in the middle between two where a root may jump
        over the region and its surroundings: fewer roots are below them and more above, or the
        reverse. Then both halves are examined alike.
        """
        values = list(side_by_side(self._projected_values, self.trained))
        names = {name for changes in self.trained for name in changes}
        if len(names) != 1 or {} in self.trained:  # {}: the parameters as they are
            return values
        (name,) = names
        shortest = SHORTEST_INTERVAL * (self.trained[-1][name] - self.trained[0][name])
        k = 0
        while k + 1 < len(self.trained):
            start = self.trained[k][name]
            end = self.trained[k + 1][name]
            if abs(end - start) > abs(shortest) and self._may_jump(values[k], values[k + 1]):
                middle = {name: (start + end) / 2}
                self.trained.insert(k + 1, middle)
                values.insert(k + 1, self._projected_values(middle))
            else:
                k += 1
        return values

    def _may_jump(self, before: ComplexArray, after: ComplexArray) -> bool:
        """Whether a root may have passed the region and its surroundings from one list of all roots
        to the other: up or down, or from decay to growth or back.

        That is so if there are fewer roots on one side of the surroundings and more on the other.
        Roots that pass in opposite directions at once are not seen. before, after: the roots at two
        values of the parameters, rad/s.
        """
        around = self.region.surroundings
        upper = (before[before.imag > 0.0], after[after.imag > 0.0])

        def rise(is_there: Callable[[ComplexArray], Bools]) -> int:
            """By how many more roots are at a place."""
            counts = [int(np.sum(is_there(values))) for values in upper]
            return counts[1] - counts[0]

        rise_below = rise(lambda z: z.imag < around.low_imag)
        rise_above = rise(lambda z: z.imag > around.high_imag)
        rise_left = rise(lambda z: z.real < around.low_real)
        rise_right = rise(lambda z: z.real > around.high_real)
        return rise_below * rise_above < 0 or rise_left * rise_right < 0

    def estimate(self, changes: Parameters) -> EstimatedRoots:
        """The roots of the region with their errors, by few modes where they suffice, otherwise by
        the whole basis."""
        by_few_modes = self.estimate_by_few_modes(changes)
        if by_few_modes is not None:
            return by_few_modes
        return self.estimate_by_basis(changes)

    def estimate_by_few_modes(self, changes: Parameters) -> EstimatedRoots | None:
        """The roots of the region with their errors by few modes; None if there are no few modes or
        if a root is doubtful.

        A root is doubtful if its error leaves open the sign of its growth rate or on which side of
        the region's border it lies, or if the error is coarse, above `COARSE_ERROR` of |lambda|. A
        root that clearly decays, by more than `DECAYED` times its error, may have a coarse error.
        """
        if self.reduced_basis is None:
            return None
        estimated = self.reduced_basis.estimate(changes)
        values = estimated.roots.values
        errors = estimated.errors
        distances = self.region.distance(values)  # beyond its sides, rad/s: below zero inside
        is_inside = self.region.contains(values)
        may_grow = values.real >= -DECAYED * errors
        may_be_inside = distances <= errors
        is_sign_open = is_inside & (errors >= np.abs(values.real))
        is_coarse = may_be_inside & (errors > COARSE_ERROR * np.abs(values)) & may_grow
        is_on_border = np.abs(distances) <= errors
        if np.any(is_sign_open | is_coarse | is_on_border):
            return None
        inside = estimated.roots.select(is_inside)
        return EstimatedRoots(
            values=inside.values,
            residuals=estimated.residuals[is_inside],
            errors=errors[is_inside],
            corrected=np.zeros(len(inside.values), dtype=bool),
            projected=inside,
            rough_values=inside.values,
        )

    def values(self, changes: Parameters) -> ComplexArray:
        """The roots (m,) of the region, rad/s; the signs of their growth rates are those in the
        full problem."""
        return self.estimate(changes).values

    def basis_values(self, changes: Parameters) -> ComplexArray:
        """The roots (m,) of the projected problem in the region, rad/s."""
        values = self._projected_values(changes)
        return values[self.region.contains(values)]

    @property
    def path_reduction(self) -> ReducedBasis | Reduction:
        """The reduced system on which eigenvalue paths are computed: few modes if they suffice."""
        return self.reduced_basis or self

    def misses_none(self, changes: Parameters, growing: int) -> bool:
        """True if a count on the full problem confirms the roots of the projected one.

        It must find as many roots in a disc around the region as the projected problem has there.
        Of these `growing`, the number that the caller expects, must grow in the region.
        """
        values = self._projected_values(changes)
        known = values[np.abs(values) <= self.reach]
        disc = disc_around(self.region, known, self.reach)
        count = count_roots(self.scaled.at(changes), disc, known)
        inside = known[self.region.contains(known)]
        is_counted = count == np.sum(disc.contains(known))
        return bool(is_counted and np.sum(inside.real > 0.0) == growing)

    @property
    def converged(self) -> bool:
        """True if errors were small before the last corrections, and the basis misses no root."""
        return self.error <= ONE_ROUND_ERROR and self.is_complete

    @property
    def is_complete(self) -> bool:
        """True if the basis misses no root of the region: T contracts, so that directions outside
        of the basis have none."""
        return self.contraction < LARGEST_CONTRACTION

    @property
    def _series(self) -> float:
        """q / (1 - q), a bound of the further terms of the series in T as a multiple of its first
        one. Where q is too large (not `is_complete`) it is finite too, but bounds nothing."""
        return self.contraction / max(1.0 - self.contraction, 1.0 - LARGEST_CONTRACTION)

    def _projected_values(self, changes: Parameters) -> ComplexArray:
        """All roots of the projected problem at some parameters."""
        return dense_values(*self.system.at(changes), self._stiffness_norm(changes))

    def _roots_with_errors(self, changes: Parameters, values: ComplexArray) -> _ProjectedRoots:
        """Roots of the projected problem next to some values (m,), with their errors.

        They come with corrections of their vectors in the full problem. The head of this module
        derives both from the residuals R = P x and S = P^H y. changes: the parameters that differ
        from the system's own.
        """
        roots = self.roots(changes, values)
        problem = self.scaled.at(changes)
        structure = self.structures[self._nearest_structure(changes)]
        z = roots.values
        # (n, m): vectors of the full problem, from those in the basis
        X = multiply(self.vectors, roots.right)
        Y = multiply(self.vectors, roots.left)
        R = problem.apply(z, X)
        S = problem.transposed().apply(z, Y.conj()).conj()  # P^H y = conj(P^T conj(y))
        solved = structure.factor.solve(np.hstack([R, S]))  # F^-1 R and F^-1 S
        solved_R, solved_S = np.split(solved, 2, axis=1)
        # y_i^H ((z_i + z_j) M + C) x_j: the divided difference (P(z_i) - P(z_j)) / (z_i - z_j)
        slope = np.add.outer(z, z) * (Y.conj().T @ multiply(problem.M, X))
        slope += Y.conj().T @ multiply(problem.C, X)
        energies = np.outer(_energy_norms(S, solved_S), _energy_norms(R, solved_R))
        bounds = root_error_bounds(
            z,
            slope,
            truncation=S.conj().T @ solved_R,
            uncertainty=self._series * energies,  # at most the further terms of the series in T
        )
        return _ProjectedRoots(
            roots=roots,
            # backward errors: `size` is |z|^2 |M| + |z| |C| + |K|
            residuals=np.linalg.norm(R, axis=0) / (problem.size(z) * np.linalg.norm(X, axis=0)),
            errors=bounds.errors,
            stay_on_axis=bounds.stay_on_axis & self.system.undamped,
            corrections=solved,
        )

    def _contraction(self, changes: Parameters) -> float:
        """q: the factor by which T contracts the directions outside of the basis at the parameters;
        the larger of those at two corners of the region."""
        k = self._nearest_structure(changes)
        structure = self.structures[k]
        complement = Complement(
            basis=self.vectors,
            projected=self._projected_structure(k),
            matrix=structure.F,
            factor=structure.factor,
        )
        return complement.contraction_in(self.region, self.scaled.at(changes))

    def estimate_by_basis(self, changes: Parameters) -> EstimatedRoots:
        """The roots of the region with their errors, by all vectors of the basis.

        Roots of the projected problem are estimated, with errors. Doubtful ones are then solved in
        the full problem: where the error leaves open the sign of the growth rate or on which side
        of the border the root lies, or where the residual is too large for a root of the full
        problem. All roots of the region are solved if the basis may miss one, or if the error of
        one is coarse.
        """
        problem = self.scaled.at(changes)  # the full problem
        all_values = self._projected_values(changes)
        # the basis holds all real modes up to `reach`; `wide` is the region with a margin
        rough_values = all_values[np.abs(all_values) <= self.reach]
        near_values = all_values[self.wide.contains(all_values)]
        is_zero = near_values == 0.0  # the root of a rigid body, which is exact
        projected = self._roots_with_errors(changes, near_values[~is_zero])
        z = projected.roots.values
        errors = projected.errors
        distances = self.region.distance(z)  # rad/s, negative inside
        is_inside = self.region.contains(z)
        zeros = near_values[is_zero & self.region.contains(near_values)]
        no_error = np.zeros(len(zeros))
        values = np.concatenate([z[is_inside], zeros])
        estimated = EstimatedRoots(
            values=values,
            residuals=np.concatenate([projected.residuals[is_inside], no_error]),
            errors=np.concatenate([errors[is_inside], no_error]),
            corrected=np.zeros(len(values), dtype=bool),
            projected=projected.roots.select(is_inside),
            rough_values=rough_values,
        )
        may_be_inside = distances <= errors
        is_coarse = errors > COARSE_ERROR * np.abs(z)
        if not self.is_complete or np.any(may_be_inside & is_coarse):
            return self._with_solved(estimated, self.region, self._solve(problem, self.region))
        is_sign_open = is_inside & ~projected.stay_on_axis & (errors >= np.abs(z.real))
        is_on_border = np.abs(distances) <= errors
        may_be_spurious = is_inside & (projected.residuals > ACCEPTED)
        is_doubtful = is_sign_open | is_on_border | may_be_spurious
        if not is_doubtful.any():
            return estimated
        part = _box_around(z[is_doubtful], errors[is_doubtful])
        structure = self.structures[self._nearest_structure(changes)]
        return self._with_solved(estimated, part, self._solve(problem, part, structure.factor))

    def _with_solved(
        self, estimated: EstimatedRoots, part: Rectangle, solved: Sequence[Eigenvalue]
    ) -> EstimatedRoots:
        """The estimated roots, those in a `part` of the plane replaced by the roots solved there.

        Solved roots outside of the region are left out, and the error of a solved root is its
        rounding. Their vectors are projected onto the basis. If fewer roots are solved than
        replaced, the difference is the number of spurious ones.
        """
        is_kept = ~part.contains(estimated.values)
        inside = [e for e in solved if self.region.contains(np.array(e.value))]
        solved_roots = Roots(*arrays_of(inside, self.scaled.n))
        projected = estimated.projected
        # without the zeros of `estimated`, which have no vectors
        kept_with_vectors = projected.select(~part.contains(projected.values))
        replaced = int(np.sum(~is_kept))
        return estimated._replace(
            values=np.append(estimated.values[is_kept], solved_roots.values),
            residuals=np.append(estimated.residuals[is_kept], [e.residual for e in inside]),
            errors=np.append(estimated.errors[is_kept], [e.rounding for e in inside]),
            corrected=np.append(estimated.corrected[is_kept], np.ones(len(inside), dtype=bool)),
            # a vector q of all rows is q / scale in scaled coordinates, and V^T (q / scale) in the
            # basis
            projected=kept_with_vectors.joined(
                solved_roots.expanded(self.vectors.T / self.scaled.scale)
            ),
            spurious=max(0, replaced - len(inside)),
        )

    def _solve(
        self, problem: ScaledProblem, region: Rectangle, factor: Factor | None = None
    ) -> tuple[Eigenvalue, ...]:
        """The roots of the full problem in a region.

        With a factor of F the rough roots of the basis are corrected. Without one, or where the
        corrections do not converge, Krylov subspaces are searched.
        """
        roots = None
        if factor is not None:
            roots = corrected_roots(problem, factor, self.vectors, region)
        if roots is None:
            roots = modes_in(problem, region, certify=False, start=self.vectors).roots
        return eigenvalues_of(problem, roots)


def _energy_norms(forces: ComplexArray, solved: ComplexArray) -> Array:
    """sqrt |f^H F^-1 f| of columns f (n, m), from F^-1 f."""
    return np.sqrt(np.abs(np.sum(forces.conj() * solved, axis=0)))


def _box_around(values: ComplexArray, errors: Array) -> Rectangle:
    """The rectangle around roots (m,), four times its error beyond each, at least 1e-6 of it."""
    half_widths = np.maximum(4 * errors, 1e-6 * np.abs(values))
    return Rectangle(
        low_real=float((values.real - half_widths).min()),
        high_real=float((values.real + half_widths).max()),
        low_imag=float((values.imag - half_widths).min()),
        high_imag=float((values.imag + half_widths).max()),
    )
