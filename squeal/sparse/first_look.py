"""A first look at the roots of a region over parameters: real modes, and how far each root is off.

The basis V holds the real modes of the structure without friction, up to a multiple of the region's
highest frequency, and what friction, contact and damping add to them: F^-1 R and F^-1 S, with the
structure's own F = K - w^2 M, factorised once, and the residuals R = P x, S = P^H y of right and
left modes in the full problem. Directions that V lacks are stiff, so that there P is F up to a part
T = 1 - F^-1 P which contracts by q < 1. Eliminated, they change the roots of the projected problem
as D = (Y^H P' X)^-1 S^H F^-1 R does; the rest of the series in T is at most q / (1 - q) times the
product of the energies of R and S. In D the entry of a root itself acts directly, two of different
roots through the gap between them. The sum is the error of the root, in 1/s; where it leaves the
sign of the growth open the root is corrected in the full problem.

Without q < 1 something that V lacks may have roots of its own: then the full problem is solved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.linear.damping import frictionless
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import divisor
from squeal.linear.verdicts import ACCEPTED
from squeal.sparse.argument_principle import Rectangle, count_roots, disc_around
from squeal.sparse.dense import dense_values
from squeal.sparse.eigensolver import COLUMNS, BlockArnoldi, corrected_roots, modes_in
from squeal.sparse.factor import Factor, factorise
from squeal.sparse.quadratic import (
    Array,
    Bools,
    Changes,
    ComplexArray,
    Quadratic,
    Roots,
    ScaledSystem,
    eigenvalues_of,
    multiply,
    report,
)
from squeal.sparse.reduced_basis import (
    COARSE,
    MARGIN,
    TRAINED_MARGIN,
    Probes,
    ReducedBasis,
    ResidualSketch,
    near_axis,
    random_vectors,
    root_error_bounds,
)
from squeal.sparse.reduction import CONTRACTS, Complement, Reduction

if TYPE_CHECKING:
    from scipy.sparse import csc_array


# What a basis holds, and which roots are corrected
REACH = 2.0  # of the real modes, over the highest frequency
BLOCK = 6  # vectors of a step towards them
MODE_RESIDUAL = 1e-4  # of a real mode
ONE_ROUND = 1e-3  # of |lambda|: errors that call for one round of corrections alone
ROUNDS = 5  # of corrections at most
DROPPED = 1e-2  # of unit vectors: what they add less is left out
TRAINED = 13  # values at most that few modes are made for
DECAYED = 2.0  # times its error: a root that decays by more is not corrected


class Structure:
    """The symmetric K at some parameters, without friction, less a shift of M: F, factorised where
    it is needed."""

    def __init__(self, frictionless_problem: Quadratic, highest: float) -> None:
        K = _symmetric_part(frictionless_problem.K)
        self.M = _symmetric_part(frictionless_problem.M)
        if not abs(K).max():
            raise InputError("K: is zero without friction; real modes need a structure")
        self.shift = highest**2 / 2
        self.F = (K - self.shift * self.M).tocsc()

    @cached_property
    def factor(self) -> Factor:
        """F, factorised."""
        try:
            return factorise(self.F)
        except ZeroDivisionError:  # the shift is the square of a frequency
            more = max(1e-6 * self.shift, 1e-12 * abs(self.F).max() / abs(self.M).max())
            self.F = (self.F - more * self.M).tocsc()
            return factorise(self.F)

    def probes(self, V: Array) -> Probes:
        """Random vectors whose products average to F^-1, in energies where an orthonormal V (n, d)
        reaches."""
        FV = self.F @ V
        energies, Q = np.linalg.eigh(V.T @ FV)
        inverse = (Q / energies) @ Q.T
        inside = random_vectors(V.shape[1], seed=50) / np.sqrt(np.abs(energies))[:, None]
        with_sign = np.sign(energies)[:, None] * inside
        # of forces what is orthogonal to V, and of displacements what F makes orthogonal to it
        outside = random_vectors(len(V), seed=49)
        forces = outside - V @ (inverse @ (FV.T @ outside))
        displacements = self.factor.solve(outside) - V @ (inverse @ (V.T @ outside))
        balance = math.sqrt(np.linalg.norm(displacements) / divisor(np.linalg.norm(forces)))
        return Probes(
            left=balance * forces + V @ (Q @ inside),
            right=displacements / balance + V @ (Q @ with_sign),
        )

    def __getstate__(self) -> dict[str, object]:
        return {name: value for name, value in vars(self).items() if name != "factor"}

    def modes(self, highest: float) -> NDArray:
        """Real modes as columns (n, m): all up to a frequency (rad/s), by block Arnoldi.

        The largest theta = 1 / (w^2 - shift) come first.
        """
        reach = highest**2 - self.shift
        start = np.random.default_rng(0).standard_normal((self.F.shape[0], BLOCK))
        krylov = BlockArnoldi(lambda x: self.factor.solve(self.M @ x), start, COLUMNS)
        next_look = 2 * BLOCK
        while True:
            krylov.grow()
            is_invariant = krylov.applied == krylov.size
            if krylov.applied < next_look and not is_invariant:
                continue
            next_look = krylov.applied + max(2 * BLOCK, krylov.applied // 8)
            theta, coordinates, residuals = krylov.eigenpairs()
            closeness = reach * np.abs(theta)
            is_wanted = closeness >= min(1.0, closeness.max())  # one at least
            are_good = np.all((residuals <= MODE_RESIDUAL * np.abs(theta))[is_wanted])
            if is_invariant or (not is_wanted.all() and are_good):
                return krylov.basis[:, : krylov.applied] @ coordinates[:, is_wanted]


def _symmetric_part(A: csc_array) -> csc_array:
    return (A + A.T).real.tocsc() / 2


class EstimatedRoots(NamedTuple):
    """Roots (m,) of the region at some parameters, in no order."""

    values: ComplexArray  # rad/s
    residuals: Array  # backward errors in the full problem
    errors: Array  # of the growth, 1/s
    corrected: Bools  # in the full problem, else estimated
    spurious: int  # roots that the full problem has not
    projected: Roots  # roots of the projected problem, with its vectors
    rough_values: ComplexArray  # all roots that the real modes reach


class _ProjectedRoots(NamedTuple):
    """Roots of the projected problem, and what their vectors lack in the full one."""

    roots: Roots  # reduced vectors
    residuals: Array  # backward errors in the full problem
    errors: Array  # 1/s
    stay_on_axis: Bools  # undamped, and alone on the imaginary axis
    missing: ComplexArray  # F^-1 [R, S] (n, 2 m), directions that correct the vectors


class FirstLook(Reduction):
    """A reduction onto real modes and their corrections, which knows the errors of its roots.

    `contraction` is q, `error` the largest error at the samples before the last corrections, as a
    share of |lambda|. Few modes that serve all values are the `reduced_basis`.
    """

    method = "modal"

    def __init__(self, scaled: ScaledSystem, region: Rectangle, values: Sequence[Changes]) -> None:
        super().__init__(scaled, region)
        self.contraction = 0.5
        self.reduced_basis: ReducedBasis | None = None
        self.error = np.inf
        self.wide = region.widened(MARGIN)
        highest = max(abs(region.low_imag), abs(region.high_imag))
        self.reach = REACH * highest
        # one structure for each different K and M without friction, at the ends and in the middle
        representatives: dict[bytes, Changes] = {}
        for k in dict.fromkeys((0, len(values) // 2, len(values) - 1)):
            representatives[self._structure_factors(values[k]).tobytes()] = values[k]
        self.structures = []
        for changes in representatives.values():
            problem = scaled.at(frictionless(scaled.system, changes))
            self.structures.append(Structure(problem, highest))
        self._factors = np.array([self._structure_factors(p) for p in representatives.values()])
        index = np.linspace(0, len(values) - 1, min(len(values), TRAINED))
        self.trained = [values[round(k)] for k in index.tolist()]
        if len(representatives) > 2:
            self.samples = tuple(representatives.values())
        else:
            self.samples = (values[0], values[-1])[: len(values)]

    def _structure_factors(self, changes: Changes) -> Array:
        """The factors of M and K without friction: where they agree the structure is the same."""
        system = self.scaled.system
        p = frictionless(system, changes)
        return np.array([term.factor.value(p) for term in system.M + system.K])

    def _nearest_structure(self, changes: Changes) -> int:
        """Index of the structure whose factors are nearest."""
        differences = self._factors - self._structure_factors(changes)
        relative = differences / divisor(np.abs(self._factors).max(axis=0))
        return int(np.argmin(np.linalg.norm(relative, axis=1)))

    def build(self) -> FirstLook:
        """Fill the basis with real modes and their corrections, and train the one of few modes;
        returns itself."""
        for structure in self.structures:
            report(f"real modes of {self.scaled.n} rows")
            self.extend(structure.modes(self.reach), DROPPED)
        for _ in range(ROUNDS):
            at_samples = []
            for changes in self.samples:
                values = self._projected_values(changes)
                near = values[self.wide.contains(values)]
                at_samples.append(self._roots_with_errors(changes, near[near != 0.0]))
            shares = []
            for found in at_samples:
                sizes = np.abs(found.roots.values)
                shares.append(np.max(found.errors / sizes, initial=0.0))
            self.error = float(max(shares))
            self.worst = float(max(np.max(found.residuals, initial=0.0) for found in at_samples))
            report(f"{self.size} vectors, errors up to {self.error:.2g} of |lambda|")
            self.extend(np.hstack([found.missing for found in at_samples]), DROPPED)
            if self.error <= ONE_ROUND:
                break
        self.contraction = self._contraction(self.samples[int(np.argmax(shares))])
        if self.holds and len(self.trained) > len(self.samples) and self.system.C:
            basis = ReducedBasis(self.system, self._residual_sketch(), self.region)
            basis.train(self.trained, self._modes_at)
            self.reduced_basis = basis if basis.size else None
        return self

    def _residual_sketch(self) -> ResidualSketch:
        """What estimates residuals in the full problem of vectors of the basis."""
        V = self.vectors
        probes = []
        for structure in self.structures:
            left, right = structure.probes(V)
            of_left = np.array([(A @ left).T @ V for A in self._matrices])
            of_right = np.array([(A.T @ right).T @ V for A in self._matrices])
            probes.append(Probes(of_left, of_right))
        return ResidualSketch(
            residual=self._sketch,
            probes=probes,
            norms=self._norms,
            structure_at=self._nearest_structure,
            series=self._series,
        )

    def _modes_at(self, changes: Changes, values: ComplexArray | None) -> Roots:
        """The modes of the basis next to some values, or all in and around the region."""
        if values is None:
            values = self._projected_values(changes)
            values = values[self.region.widened(TRAINED_MARGIN).contains(values)]
        return self.roots(changes, left=True, values=values)

    def estimate(self, changes: Changes, deciding: bool = False) -> EstimatedRoots:
        """The roots of the region with their errors, by few modes where they suffice.

        Of roots that clearly decay the errors are left out (NaN) if those that decide are wanted.
        """
        found = self.estimate_by_few_modes(changes, deciding)
        return found or self.estimate_by_basis(changes, deciding)

    def estimate_by_few_modes(
        self, changes: Changes, deciding: bool = False
    ) -> EstimatedRoots | None:
        """The roots of the region by few modes; None without these, and where an error leaves open
        the sign of a growth or whether a root lies in the region."""
        if self.reduced_basis is None:
            return None
        found = self.reduced_basis.estimate(changes, deciding)
        values = found.roots.values
        distances = self.region.distance(values)
        is_inside = self.region.contains(values)
        is_sign_open = is_inside & (found.errors >= np.abs(values.real))
        is_coarse = (distances <= found.errors) & (found.errors > COARSE * np.abs(values))
        is_on_border = np.abs(distances) <= found.errors
        decays = values.real < -DECAYED * found.errors
        if np.any(is_sign_open | ((is_coarse | is_on_border) & ~decays)):
            return None
        if np.any(is_on_border) and not deciding:
            return None
        inside = found.roots.select(is_inside)
        return EstimatedRoots(
            values=inside.values,
            residuals=found.residuals[is_inside],
            errors=found.errors[is_inside],
            corrected=np.zeros(len(inside.values), dtype=bool),
            spurious=0,
            projected=inside,
            rough_values=inside.values,
        )

    def values(self, changes: Changes) -> ComplexArray:
        """The values of the roots of the region; the sign of each growth is that of the full
        problem."""
        return self.estimate(changes).values

    def basis_values(self, changes: Changes) -> ComplexArray:
        """The values of the roots of the projected problem in the region."""
        values = self._projected_values(changes)
        return values[self.region.contains(values)]

    @property
    def searched(self) -> ReducedBasis | Reduction:
        """Where roots are followed: the few modes, if there are some."""
        return self.reduced_basis or self

    def misses_none(self, changes: Changes, growing: int) -> bool:
        """True if a count on the full problem finds the roots of the basis around the region and no
        others, as many `growing` in it as expected."""
        values = self._projected_values(changes)
        known = values[np.abs(values) <= self.reach]
        disc = disc_around(self.region, known, self.reach)
        count = count_roots(self.scaled.at(changes), disc, known)
        inside = known[self.region.contains(known)]
        is_counted = count == np.sum(disc.contains(known))
        return bool(is_counted and np.sum(inside.real > 0.0) == growing)

    @property
    def converged(self) -> bool:
        """True if the last corrections were of small errors and what the basis lacks contracts."""
        return self.error <= ONE_ROUND and self.holds

    @property
    def holds(self) -> bool:
        """True if what the basis lacks has no roots of its own in the region."""
        return self.contraction < CONTRACTS

    @property
    def _series(self) -> float:
        """How much the rest of the series in T is at most of its first term."""
        return self.contraction / max(1.0 - self.contraction, 1.0 - CONTRACTS)

    def _projected_values(self, changes: Changes) -> ComplexArray:
        """All roots of the projected problem at some parameters."""
        return dense_values(*self.system.at(changes), self._stiffness_norm(changes))

    def _roots_with_errors(self, changes: Changes, values: ComplexArray) -> _ProjectedRoots:
        """Some roots of the projected problem, with what their vectors lack in the full one."""
        roots = self.roots(changes, left=True, values=values)
        problem = self.scaled.at(changes)
        structure = self.structures[self._nearest_structure(changes)]
        z = roots.values
        X = multiply(self.vectors, roots.right)
        Y = multiply(self.vectors, roots.left)
        R = problem.apply(z, X)
        S = problem.transposed().apply(z, Y.conj()).conj()
        solved = structure.factor.solve(np.hstack([R, S]))
        solved_R, solved_S = np.split(solved, 2, axis=1)
        slope = np.add.outer(z, z) * (Y.conj().T @ multiply(problem.M, X))
        slope = slope + Y.conj().T @ multiply(problem.C, X)
        energies = np.outer(_energy_norms(S, solved_S), _energy_norms(R, solved_R))
        bounds = root_error_bounds(
            z,
            slope,
            truncation=S.conj().T @ solved_R,
            uncertainty=self._series * energies,
        )
        is_undamped = self.system.real and not self.system.C
        return _ProjectedRoots(
            roots=roots,
            residuals=np.linalg.norm(R, axis=0) / (problem.size(z) * np.linalg.norm(X, axis=0)),
            errors=bounds.errors,
            stay_on_axis=bounds.stay_on_axis & is_undamped,
            missing=solved,
        )

    def _contraction(self, changes: Changes) -> float:
        """How T contracts what the basis lacks, at two corners of the region."""
        structure = self.structures[self._nearest_structure(changes)]
        factor = structure.factor  # which may move F
        complement = Complement(
            basis=self.vectors,
            projected=self.vectors.T @ (structure.F @ self.vectors),
            matrix=structure.F,
            factor=factor,
        )
        return complement.contraction_in(self.region, self.scaled.at(changes))

    def estimate_by_basis(self, changes: Changes, deciding: bool = False) -> EstimatedRoots:
        """The roots of the region with their errors; of those that clearly decay and are not near
        others the error is left out (NaN) if the ones that decide are wanted."""
        problem = self.scaled.at(changes)
        every = self._projected_values(changes)
        rough_values = every[np.abs(every) <= self.reach]
        near = every[self.wide.contains(every)]
        is_estimated = near != 0.0  # what nothing holds stays where it is
        if deciding and len(near):
            is_estimated &= near_axis(near, self.error, MARGIN)
        found = self._roots_with_errors(changes, near[is_estimated])
        others = near[~is_estimated & self.region.contains(near)]
        z = found.roots.values
        distances = self.region.distance(z)
        is_inside = self.region.contains(z)
        projected = found.roots.select(is_inside)
        may_be_inside = distances <= found.errors
        is_coarse = found.errors > COARSE * np.abs(z)
        unknown = np.where(others == 0.0, 0.0, np.nan)
        values = np.concatenate([z[is_inside], others])
        estimated = EstimatedRoots(
            values=values,
            residuals=np.concatenate([found.residuals[is_inside], unknown]),
            errors=np.concatenate([found.errors[is_inside], unknown]),
            corrected=np.zeros(len(values), dtype=bool),
            spurious=0,
            projected=projected,
            rough_values=rough_values,
        )
        if not self.holds or np.any(may_be_inside & is_coarse):
            return self._with_solved(estimated, self.region, self._solve(problem, self.region))
        is_sign_open = is_inside & ~found.stay_on_axis & (found.errors >= np.abs(z.real))
        is_on_border = np.abs(distances) <= found.errors
        is_no_root = is_inside & (found.residuals > ACCEPTED)  # such roots decide nothing
        doubtful = is_sign_open | is_on_border | is_no_root
        if not doubtful.any():
            return estimated
        part = _box_around(z[doubtful], found.errors[doubtful])
        structure = self.structures[self._nearest_structure(changes)]
        return self._with_solved(estimated, part, self._solve(problem, part, structure.factor))

    def _with_solved(
        self, estimated: EstimatedRoots, part: Rectangle, solved: Sequence[Eigenvalue]
    ) -> EstimatedRoots:
        """Estimated roots, those in a part of the plane replaced by solved ones in the region."""
        rest = ~part.contains(estimated.values)
        inside = [e for e in solved if self.region.contains(np.array(e.value))]
        lost = int((~rest).sum()) - len(inside)
        rounding = [e.rounding for e in inside]
        return estimated._replace(
            values=np.append(estimated.values[rest], [e.value for e in inside]),
            residuals=np.append(estimated.residuals[rest], [e.residual for e in inside]),
            errors=np.append(estimated.errors[rest], rounding),
            corrected=np.append(estimated.corrected[rest], np.ones(len(inside), dtype=bool)),
            spurious=max(0, lost),
        )

    def _solve(
        self, problem: Quadratic, region: Rectangle, factor: Factor | None = None
    ) -> tuple[Eigenvalue, ...]:
        """Roots of the full problem in a region: on the basis, corrected with a factor, or by
        Krylov subspaces where that does not converge."""
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
    """The rectangle that holds roots with four times their errors."""
    half_widths = np.maximum(4 * errors, 1e-6 * np.abs(values))
    return Rectangle(
        low_real=float((values.real - half_widths).min()),
        high_real=float((values.real + half_widths).max()),
        low_imag=float((values.imag - half_widths).min()),
        high_imag=float((values.imag + half_widths).max()),
    )
