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
from squeal.sparse.compression import Compression
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
from squeal.sparse.reduction import (
    CONTRACTS,
    Complement,
    Reduction,
    random_vectors,
    term_weights,
)

if TYPE_CHECKING:
    from scipy.sparse import csc_array


# What a basis holds, and which roots are corrected
REACH = 2.0  # of the real modes, over the highest frequency
BLOCK = 6  # vectors of a step towards them
MODE_RESIDUAL = 1e-4  # of a real mode
ONE_ROUND = 1e-3  # of |lambda|: errors that call for one round of corrections alone
ROUNDS = 5  # of corrections at most
DROPPED = 1e-2  # of unit vectors: what they add less is left out
MARGIN = 0.05  # of the region's size: roots that close to it are estimated too
COARSE = 1e-3  # of |lambda|: greater errors are corrected
TRAINED = 25  # values at most that few modes are made for
FINE = 1e-5  # of |lambda|: errors there with which they end
FINE_GROWTH = 0.1  # ... or of the growth rate
ADDED = 0.05  # of the largest error: modes of greater ones are added
TRAINED_MARGIN = 0.1  # of the region's size: modes that close to it are among them
NORM_FACTOR = 1.5  # random vectors may underrate a product of two norms so far
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

    @cached_property
    def probes(self) -> Array:
        """F'^-1 of random vectors (n, SKETCH), the same for all."""
        return self.factor.solve(random_vectors(self.F.shape[0], seed=49), transposed=True)

    def __getstate__(self) -> dict[str, object]:
        return {name: value for name, value in vars(self).items() if name != "factor"}

    def modes(self, highest: float) -> ComplexArray:
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
                modes = krylov.basis[:, : krylov.applied] @ coordinates[:, is_wanted]
                return modes.astype(complex)


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


class _FewModeRoots(NamedTuple):
    """Roots of the few modes, with vectors in their coordinates."""

    roots: Roots
    residuals: Array  # backward errors in the full problem
    errors: Array  # 1/s


class ErrorBounds(NamedTuple):
    """How far roots (m,) of a projected problem may be from those of the full one."""

    errors: Array  # rad/s
    stay_on_axis: Bools  # of an undamped problem: alone on the imaginary axis, so they stay there


def root_error_bounds(
    values: ComplexArray, slope: ComplexArray, lack: ComplexArray, uncertainty: Array
) -> ErrorBounds:
    """How far roots (m,) of a projected problem may be from those of the full one.

    slope (m, m) is Y^H P' X of left and right modes, lack (m, m) S^H F^-1 R of what they lack,
    known up to `uncertainty` (m, m).
    """
    try:
        inverse = np.linalg.inv(slope)
    except np.linalg.LinAlgError:  # a multiple root without as many modes
        inverse = np.full_like(slope, np.inf)
    with np.errstate(invalid="ignore", over="ignore"):
        D = np.abs(inverse @ lack) + np.abs(inverse) @ uncertainty
        gaps = np.abs(np.subtract.outer(values, values))
        products = D * D.T
        np.fill_diagonal(products, 0.0)
        # two roots repel by the product over the gap, or meet by the square root of it
        repelled = np.full_like(gaps, np.inf)
        np.divide(2 * products, gaps, out=repelled, where=gaps > 0)
        errors = np.diag(D) + np.minimum(np.sqrt(products), repelled).sum(axis=1)
    np.fill_diagonal(gaps, np.inf)
    is_alone = 2 * errors < gaps.min(axis=1, initial=np.inf)
    return ErrorBounds(np.nan_to_num(errors, nan=np.inf), (values.real == 0.0) & is_alone)


class FirstLook(Reduction):
    """A reduction onto real modes and their corrections, which knows the errors of its roots.

    `contraction` is q, `error` the largest error at the samples before the last corrections, as a
    share of |lambda|. Few modes that serve all values are `compressed`.
    """

    method = "modal"

    def __init__(self, scaled: ScaledSystem, region: Rectangle, values: Sequence[Changes]) -> None:
        super().__init__(scaled, region)
        self.contraction = 0.5
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
        """Fill the basis with real modes and their corrections, and compress it; returns itself."""
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
        self.compressed = Compression(self.size, self.region, self.region.widened(TRAINED_MARGIN))
        if self.holds and len(self.trained) > len(self.samples) and self.system.C:
            self._compress()
        return self

    def _compress(self) -> None:
        """Make few modes that serve the training values: all of those at the first, the last and
        the middle one, then greedily, where the largest error is, those whose errors are too
        large, until no error is above what is allowed."""
        self._sketch_basis()
        last = len(self.trained) - 1
        for k in (last // 2, 0, last):
            values = self._projected_values(self.trained[k])
            self._add_modes(
                self.trained[k], values[self.compressed.trained_region.contains(values)]
            )
        pending = list(self.trained)
        while pending and self.compressed.size:
            estimates = [self._few_mode_roots(changes) for changes in pending]
            ratios = [_error_ratios(found) for found in estimates]
            largest = [float(np.max(of_value, initial=0.0)) for of_value in ratios]
            k = int(np.argmax(largest))
            size = self.compressed.size
            report(f"{size} modes, errors up to {largest[k]:.2g} of allowed")
            if largest[k] <= 1.0:
                break
            changes = pending[k]
            is_wrong = ratios[k] > ADDED * largest[k]
            is_new = self._add_modes(changes, estimates[k].roots.values[is_wrong])
            pending = [p for p, ratio in zip(pending, largest, strict=True) if ratio > 1.0]
            if not is_new:
                pending.remove(changes)

    def _add_modes(self, changes: Changes, values: ComplexArray) -> bool:
        """Add the modes of some roots of the basis; False if they bring nothing."""
        roots = self.roots(changes, left=True, values=values)
        is_new = self.compressed.grow(self.system, roots)
        if is_new:
            self._sketch_modes()
        return is_new

    def _sketch_basis(self) -> None:
        """Random vectors against what each term makes of the basis: of left vectors, of right ones,
        and of right ones solved with the F of each structure; each (terms, SKETCH, d)."""
        probes = random_vectors(self.scaled.n, seed=49)
        V = self.vectors
        self._left_sketch = np.array([(A @ probes).T @ V for A in self._matrices])
        self._right_sketch = np.array([(A.T @ probes).T @ V for A in self._matrices])
        self._solved_sketches = []
        for structure in self.structures:
            solved = [(A.T @ structure.probes).T @ V for A in self._matrices]
            self._solved_sketches.append(np.array(solved))

    def _sketch_modes(self) -> None:
        """The same against the few modes."""
        right = self.compressed.right
        self._left_mode_sketch = self._left_sketch @ self.compressed.left.conj()
        self._right_mode_sketch = self._right_sketch @ right
        self._solved_mode_sketches = [sketch @ right for sketch in self._solved_sketches]

    def _few_mode_roots(self, changes: Changes, deciding: bool = False) -> _FewModeRoots:
        """Roots of the few modes in and around the region; of a decision those alone that are near
        the axis."""
        problem = self.compressed.at(changes)
        values = problem.values(self.compressed.trained_region)
        values = values[self.wide.contains(values)]
        if deciding and len(values):
            values = values[_is_near_axis(values, COARSE, COARSE)]
        roots = problem.roots_at(values)
        left = roots.left.conj().T
        slope = np.add.outer(values, values) * (left @ problem.M @ roots.right)
        slope = slope + left @ problem.C @ roots.right
        weights = term_weights(self.system, self.system.values(changes), values)

        def norms(sketch: NDArray, vectors: ComplexArray) -> Array:
            images = np.einsum("trm,tm->rm", sketch @ vectors, weights)
            return np.linalg.norm(images, axis=0)

        of_left = norms(self._left_mode_sketch, roots.left.conj())
        solved_sketch = self._solved_mode_sketches[self._nearest_structure(changes)]
        of_solved = norms(solved_sketch, roots.right)
        series = 1.0 / max(1.0 - self.contraction, 1.0 - CONTRACTS)
        uncertainty = NORM_FACTOR * series * np.outer(of_left, of_solved)
        bounds = root_error_bounds(values, slope, np.zeros_like(slope), uncertainty)
        residuals = norms(self._right_mode_sketch, roots.right) / divisor(self.bounds(weights))
        return _FewModeRoots(roots, residuals, bounds.errors)

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
        if not self.compressed.size:
            return None
        found = self._few_mode_roots(changes, deciding)
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
        in_basis = Roots(
            values=inside.values,
            right=self.compressed.right @ inside.right,
            left=self.compressed.left @ inside.left,
        )
        return EstimatedRoots(
            values=inside.values,
            residuals=found.residuals[is_inside],
            errors=found.errors[is_inside],
            corrected=np.zeros(len(inside.values), dtype=bool),
            spurious=0,
            projected=in_basis,
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
    def searched(self) -> Compression | Reduction:
        """Where roots are followed: the few modes, if there are some."""
        return self.compressed if self.compressed.size else self

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

    def _projected_values(self, changes: Changes) -> ComplexArray:
        """All roots of the projected problem at some parameters."""
        return dense_values(*self.system.at(changes), self._stiffness_norm(changes))

    def _roots_with_errors(self, changes: Changes, values: ComplexArray) -> _ProjectedRoots:
        """Some roots of the projected problem, with what their vectors lack in the full one."""
        roots = self.roots(changes, left=True, values=values)
        if not len(values):
            nothing = np.zeros(0)
            missing = np.zeros((self.scaled.n, 0), complex)
            return _ProjectedRoots(roots, nothing, nothing, nothing.astype(bool), missing)
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
        series = self.contraction / max(1.0 - self.contraction, 1.0 - CONTRACTS)
        bounds = root_error_bounds(
            z,
            slope,
            lack=S.conj().T @ solved_R,
            uncertainty=series * np.outer(_energy_norms(S, solved_S), _energy_norms(R, solved_R)),
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
            is_estimated &= _is_near_axis(near, self.error, MARGIN)
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


def _error_ratios(found: _FewModeRoots) -> Array:
    """Errors over those with which few modes end."""
    values = found.roots.values
    allowed = np.maximum(FINE * np.abs(values), FINE_GROWTH * np.abs(values.real))
    return found.errors / divisor(allowed)


def _is_near_axis(values: ComplexArray, decay: float, gap: float) -> Bools:
    """True for roots that may decide, and those near one: shares of |lambda| for both.

    A root may decide if it decays by less than a share, or least of all.
    """
    may_decide = (values.real > -decay * np.abs(values)) | (values.real == values.real.max())
    deciding = values[may_decide]
    gaps = np.abs(np.subtract.outer(values, deciding))
    return np.any(gaps <= gap * np.abs(deciding), axis=1) | may_decide


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
