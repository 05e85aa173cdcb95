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
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.linear.damping import frictionless
from squeal.linear.eigen import ACCEPTED
from squeal.linear.matrices import divisor
from squeal.sparse import eigensolver
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.compression import Compression, weights
from squeal.sparse.dense import dense_values
from squeal.sparse.eigensolver import corrected, modes_in, orthogonal
from squeal.sparse.quadratic import (
    PROGRESS,
    Array,
    ComplexArray,
    Factor,
    Quadratic,
    Roots,
    ScaledSystem,
    combined,
    factorise,
    listed,
)
from squeal.sparse.reduction import CONTRACTS, SKETCH, Changes, Reduction, contraction


@dataclass(frozen=True)
class LookOptions:
    """What a basis holds, and which roots are corrected."""

    beyond: float = 2.0  # the real modes reach so many times the highest frequency
    block: int = 6  # vectors of a step towards them
    rough: float = 1e-4  # residual of a real mode
    content: float = 1e-3  # of |lambda|: errors that call for one round of corrections alone
    rounds: int = 5  # of corrections at most
    dropped: float = 1e-2  # of unit vectors: what they add less is left out
    around: float = 0.05  # of the region's size: roots that close to it are looked at too
    coarse: float = 1e-3  # of |lambda|: greater errors are corrected
    trained: int = 25  # values at most that few modes are made for
    fine: float = 1e-5  # of |lambda|: errors there with which they end
    clear: float = 0.1  # ... or of the growth
    share: float = 0.05  # of the largest error: modes of greater ones are added
    beside: float = 0.1  # of the region's size: modes that close to it are among them
    sure: float = 1.5  # random vectors may underrate a product of two norms so far
    plain: float = 2.0  # times its error: a root that decays by more is not corrected


OPTIONS = LookOptions()


class Structure:
    """The symmetric K at some parameters, without friction, less a shift of M: F, factorised where
    it is needed."""

    def __init__(self, own: Quadratic, highest: float) -> None:
        K, self.M = ((A + A.T).real.tocsc() / 2 for A in (own.K, own.M))
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
        return self.factor.solve(random_vectors(self.F.shape[0]), transposed=True)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "factor"}

    def modes(self, highest: float) -> ComplexArray:
        """Real modes as columns (n, m): all up to a frequency (rad/s), by block Arnoldi."""
        reach, look, done = highest**2 - self.shift, 2 * OPTIONS.block, 0
        start = np.random.default_rng(0).standard_normal((self.F.shape[0], OPTIONS.block))
        Q, _ = orthogonal(np.zeros((len(start), 0)), self.factor.solve(self.M @ start))
        H = np.zeros((Q.shape[1], 0))
        while True:
            new, column = orthogonal(Q, self.factor.solve(self.M @ Q[:, done:]))
            H = np.hstack([np.pad(H, ((0, new.shape[1]), (0, 0))), column])
            done, Q = Q.shape[1], np.hstack([Q, new])
            if done < look and new.size:
                continue
            look = done + max(2 * OPTIONS.block, done // 8)
            theta, Y = np.linalg.eig(H[:done])  # 1 / (w^2 - shift)
            wide = reach * np.abs(theta) >= min(1.0, reach * np.abs(theta).max())  # one at least
            rest = np.linalg.norm(H[done:] @ Y, axis=0) / np.abs(theta)
            if not new.size or (not wide.all() and np.all(rest[wide] <= OPTIONS.rough)):
                return np.asarray(Q[:, :done] @ Y[:, wide], dtype=complex)


def random_vectors(rows: int) -> Array:
    """Columns (rows, SKETCH) whose products with a vector have its length, on the average."""
    return np.random.default_rng(49).standard_normal((rows, SKETCH)) / np.sqrt(SKETCH)


class Judged(NamedTuple):
    """Roots (m,) of the region at some parameters, in no order."""

    values: ComplexArray  # rad/s
    residuals: Array  # backward errors in the full problem
    errors: Array  # of the growth, 1/s
    corrected: NDArray[np.bool_]  # in the full problem, else estimated
    spurious: int  # roots that the full problem has not
    projected: Roots  # roots of the projected problem, with its vectors
    seen: ComplexArray  # all roots that the real modes reach, roughly


class Lack(NamedTuple):
    """What roots of the projected problem lack in the full one."""

    roots: Roots  # reduced vectors
    solved: ComplexArray  # F^-1 [R, S]
    residuals: Array
    errors: Array
    steady: NDArray[np.bool_]  # undamped, apart from others: they stay on the imaginary axis


def movements(
    z: ComplexArray, slope: ComplexArray, lack: ComplexArray, more: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """How far roots z (m,) of a projected problem may be from those of the full one (rad/s), and
    which of them on the imaginary axis stay there if nothing damps.

    slope (m, m) is Y^H P' X of left and right modes, lack (m, m) S^H F^-1 R of what they lack,
    known up to `more` (m, m).
    """
    try:
        inverse = np.linalg.inv(slope)
    except np.linalg.LinAlgError:  # a multiple root without as many modes
        inverse = np.full_like(slope, np.inf)
    with np.errstate(invalid="ignore", over="ignore"):
        D = np.abs(inverse @ lack) + np.abs(inverse) @ more
        gaps = np.abs(np.subtract.outer(z, z))
        both = D * D.T
        np.fill_diagonal(both, 0.0)
        far = np.divide(2 * both, gaps, out=np.full_like(gaps, np.inf), where=gaps > 0)
        errors = np.diag(D) + np.minimum(np.sqrt(both), far).sum(axis=1)
    np.fill_diagonal(gaps, np.inf)
    steady = (z.real == 0.0) & (2 * errors < gaps.min(axis=1, initial=np.inf))
    return np.nan_to_num(errors, nan=np.inf), steady


class FirstLook(Reduction):
    """A reduction onto real modes and their corrections, which knows the errors of its roots.

    `contraction` is q, `held` the number of real modes, `error` the largest error at the samples
    before the last corrections, as a share of |lambda|.
    """

    method, contraction, error = "modal", 0.5, np.inf

    def __init__(self, scaled: ScaledSystem, region: Rectangle, values: Sequence[Changes]) -> None:
        super().__init__(scaled, region)
        self.wide = region.widened(OPTIONS.around)
        self.highest = max(abs(region.low_imag), abs(region.high_imag))
        self.reach = OPTIONS.beyond * self.highest
        ends = dict.fromkeys((0, len(values) // 2, len(values) - 1))
        each = {self._stiff(values[k]).tobytes(): values[k] for k in ends}
        self.stiff = np.array([self._stiff(p) for p in each.values()])
        self.structures = [
            Structure(scaled.at(frictionless(scaled.system, p)), self.highest)
            for p in each.values()
        ]
        index = np.linspace(0, len(values) - 1, min(len(values), OPTIONS.trained))
        self.trained = [values[round(k)] for k in index.tolist()]
        first_and_last = (values[0], values[-1])[: len(values)]
        self.samples = tuple(each.values()) if len(each) > 2 else first_and_last

    def _stiff(self, changes: Changes) -> Array:
        """The factors of M and K without friction: where they agree the structure is the same."""
        system = self.scaled.system
        p = frictionless(system, changes)
        return np.array([term.factor.value(p) for term in system.M + system.K])

    def _nearest(self, changes: Changes) -> int:
        """Index of the structure that is nearest."""
        away = (self.stiff - self._stiff(changes)) / divisor(np.abs(self.stiff).max(axis=0))
        return int(np.argmin(np.linalg.norm(away, axis=1)))

    def _structure(self, changes: Changes) -> Structure:
        """The one that is nearest."""
        return self.structures[self._nearest(changes)]

    def made(self) -> FirstLook:
        """The basis."""
        for structure in self.structures:
            PROGRESS.get()(f"real modes of {self.scaled.n} rows")
            self.extend(structure.modes(self.reach), OPTIONS.dropped)
        self.held = self.size
        for _ in range(OPTIONS.rounds):
            near = [(p, self._values(p)[0]) for p in self.samples]
            lacks = [self._lack(p, z[z != 0.0]) for p, z in near]
            off = [np.max(each.errors / np.abs(each.roots.values), initial=0.0) for each in lacks]
            self.error = float(max(off))
            self.worst = float(max(np.max(each.residuals, initial=0.0) for each in lacks))
            PROGRESS.get()(f"{self.size} vectors, errors up to {self.error:.2g} of |lambda|")
            self.extend(np.hstack([lack.solved for lack in lacks]), OPTIONS.dropped)
            if self.error <= OPTIONS.content:
                break
        self.contraction = self._contraction(self.samples[int(np.argmax(off))])
        self.compressed = Compression(self.system, self.region.widened(OPTIONS.beside))
        if self.holds and len(self.trained) > len(self.samples) and self.system.C:
            self._compress()
        return self

    def _compress(self) -> None:
        """Make few modes that serve the values: all of those at the first, the last and the middle
        one, and of the others those whose errors are too large."""
        self._sketch_basis()
        region = self.compressed.region
        last = len(self.trained) - 1
        pending = list(range(last + 1))
        for k in (last // 2, 0, last):
            changes = self.trained[k]
            values = dense_values(*self.system.at(changes), self._stiffness(changes))
            self._add_modes(changes, values[region.contains(values)])
        while pending and self.compressed.size:
            errors = [self._errors(self.trained[k]) for k in pending]
            worst = [float(np.max(ratios, initial=0.0)) for _, ratios in errors]
            at = int(np.argmax(worst))
            PROGRESS.get()(f"{self.compressed.size} modes, errors up to {worst[at]:.2g} of allowed")
            if worst[at] <= 1.0:
                break
            values, ratios = errors[at]
            changes = self.trained[pending[at]]
            pending = [k for k, ratio in zip(pending, worst, strict=True) if ratio > 1.0]
            if not self._add_modes(changes, values[ratios > OPTIONS.share * worst[at]]):
                pending.remove(self.trained.index(changes))

    def _add_modes(self, changes: Changes, values: ComplexArray) -> bool:
        """Add the modes of some roots of the basis; False if they bring nothing."""
        grown = self.compressed.grow(self.system, self.roots(changes, left=True, values=values))
        if grown:
            self._sketch_modes()
        return grown

    def _errors(self, changes: Changes) -> tuple[ComplexArray, Array]:
        """Roots of the few modes at some parameters, and their errors, of those allowed."""
        z, _, _, errors, _ = self._estimate(changes, deciding=False)
        allowed = np.maximum(OPTIONS.fine * np.abs(z), np.abs(z.real) * OPTIONS.clear)
        return z, errors / divisor(allowed)

    def _sketch_basis(self) -> None:
        """Random vectors against what each term makes of the basis, of left vectors, of right ones,
        and of right ones solved with the F of each structure."""
        probes, V = random_vectors(self.scaled.n), self.vectors
        terms = [A for matrices in self._terms for _, A in matrices]
        self._forced = np.array([(A @ probes).T @ V for A in terms])
        self._rest = np.array([(A.T @ probes).T @ V for A in terms])
        self._moved = [
            np.array([(A.T @ structure.probes).T @ V for A in terms])
            for structure in self.structures
        ]

    def _sketch_modes(self) -> None:
        """The same against the few modes."""
        right, left = self.compressed.right, self.compressed.left.conj()
        self._of_modes = (
            self._forced @ left,
            self._rest @ right,
            [moved @ right for moved in self._moved],
        )

    def _estimate(
        self, changes: Changes, deciding: bool
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, Array, Array]:
        """Roots of the few modes in and around the region, with right and left vectors in their
        coordinates, errors and backward errors; of a decision those alone that are near the axis.
        """
        compressed = self.compressed
        z, matrices = compressed.at(changes)
        z = z[self.wide.contains(z)]
        if deciding and len(z):
            near = (z.real > -OPTIONS.coarse * np.abs(z)) | (z.real == z.real.max())
            gaps = np.abs(np.subtract.outer(z, z[near]))
            z = z[np.any(gaps <= OPTIONS.coarse * np.abs(z[near]), axis=1)]
        right, left = compressed.vectors(matrices, z)
        mass, damping = (left.conj().T @ A @ right for A in matrices[:2])
        slope = np.add.outer(z, z) * mass + damping
        p = self.system.values(changes)
        share = weights(self.system.parts, p, z)

        def sizes(sketch: NDArray, vectors: NDArray) -> Array:
            images = sketch @ vectors
            return np.asarray(np.linalg.norm(np.einsum("trm,tm->rm", images, share), axis=0))

        of_left, of_right, of_solved = self._of_modes
        forced = sizes(of_left, left.conj())
        moved = sizes(of_solved[self._nearest(changes)], right)
        rest = 1.0 / max(1.0 - self.contraction, 1.0 - CONTRACTS)
        lack = OPTIONS.sure * rest * np.outer(forced, moved)
        errors, _ = movements(z, slope, np.zeros_like(slope), lack)
        factors = [abs(term.factor.value(p)) for term in self.system.terms]
        powers = [
            power for part, power in zip(self.system.parts, (2, 1, 0), strict=True) for _ in part
        ]
        norms = [bound for part in self._norms for bound in part]
        size = sum(
            factor * bound * np.abs(z) ** power
            for factor, bound, power in zip(factors, norms, powers, strict=True)
        )
        return z, right, left, errors, sizes(of_right, right) / divisor(size)

    def estimated(self, changes: Changes, deciding: bool = False) -> Judged | None:
        """The roots of the region by few modes; None without these, and where an error leaves open
        the sign of a growth or whether a root lies in the region."""
        if not self.compressed.size:
            return None
        z, right, left, errors, residuals = self._estimate(changes, deciding)
        inside = self.region.contains(z)
        open_ = inside & (errors >= np.abs(z.real))
        coarse = (self.region.distance(z) <= errors) & (errors > OPTIONS.coarse * np.abs(z))
        border = np.abs(self.region.distance(z)) <= errors
        decays = z.real < -OPTIONS.plain * errors
        if np.any(open_ | ((coarse | border) & ~decays)) or (np.any(border) and not deciding):
            return None
        x, y = (
            basis @ vectors[:, inside]
            for basis, vectors in ((self.compressed.right, right), (self.compressed.left, left))
        )
        z, errors, residuals = z[inside], errors[inside], residuals[inside]
        done = np.zeros(len(z), dtype=bool)
        return Judged(z, residuals, errors, done, 0, Roots(z, x, y), z)

    def decided(self, changes: Changes, deciding: bool = False) -> Judged:
        """The roots of the region, by few modes where they suffice."""
        return self.estimated(changes, deciding) or self.judged(changes, deciding)

    @property
    def converged(self) -> bool:
        """True if the last corrections were of small errors and what the basis lacks contracts."""
        return self.error <= OPTIONS.content and self.holds

    @property
    def holds(self) -> bool:
        """True if what the basis lacks has no roots of its own in the region."""
        return self.contraction < CONTRACTS

    def _values(self, changes: Changes) -> tuple[ComplexArray, ComplexArray]:
        """Roots of the projected problem in and around the region, and as far as real modes go."""
        values = dense_values(*self.system.at(changes), self._stiffness(changes))
        return values[self.wide.contains(values)], values[np.abs(values) <= self.reach]

    def _lack(self, changes: Changes, values: ComplexArray) -> Lack:
        """What some roots at the parameters lack."""
        problem, structure = self.scaled.at(changes), self._structure(changes)
        roots = self.roots(changes, left=True, values=values)
        z, count, V = roots.values, len(values), self.vectors
        if not count:
            none = np.zeros(0)
            return Lack(roots, np.zeros((len(V), 0), complex), none, none, none.astype(bool))
        X, Y = combined(V, roots.right), combined(V, roots.left)
        R = problem.apply(z, X)
        S = problem.transposed().apply(z, Y.conj()).conj()
        solved = structure.factor.solve(np.hstack([R, S]))
        FR, FS = solved[:, :count], solved[:, count:]
        meets = Y.conj().T @ combined(problem.M, X), Y.conj().T @ combined(problem.C, X)
        slope = np.add.outer(z, z) * meets[0] + meets[1]
        right, left = (np.sqrt(np.abs(np.sum(a.conj() * b, axis=0))) for a, b in ((R, FR), (S, FS)))
        rest = self.contraction / max(1.0 - self.contraction, 1.0 - CONTRACTS)
        lacks = S.conj().T @ FR, rest * np.outer(left, right)
        errors, steady = movements(z, slope, *lacks)
        steady &= self.system.real and not self.system.C
        size = problem.size(z) * np.linalg.norm(X, axis=0)
        return Lack(roots, solved, np.linalg.norm(R, axis=0) / size, errors, steady)

    def _contraction(self, changes: Changes) -> float:
        """How T contracts what the basis lacks, at two corners of the region."""
        problem, structure, V = self.scaled.at(changes), self._structure(changes), self.vectors
        given = V, V.T @ (structure.F @ V), structure.F, structure.factor
        ends = max(self.region.low_imag, 0.0), self.highest
        corners = (complex(self.region.high_real, frequency) for frequency in ends)
        return max(contraction(*given, problem.at(z)) for z in corners)

    def judged(self, changes: Changes, deciding: bool = False) -> Judged:
        """The roots of the region with their errors; of those that clearly decay and are not near
        others the error is left out (NaN) if the ones that decide are wanted."""
        problem, (z, seen) = self.scaled.at(changes), self._values(changes)
        wanted = z != 0.0  # what nothing holds stays where it is
        if deciding and len(z):
            near = (z.real > -self.error * np.abs(z)) | (z.real == z.real.max())
            gaps = np.abs(np.subtract.outer(z, z[near]))
            wanted &= np.any(gaps < OPTIONS.around * np.abs(z[near]), axis=1) | near
        lack = self._lack(changes, z[wanted])
        other = z[~wanted & self.region.contains(z)]
        z, errors = lack.roots.values, lack.errors
        inside, coarse = self.region.contains(z), OPTIONS.coarse * np.abs(z)
        projected = lack.roots.picked(inside)
        reaches = self.region.distance(z) <= errors
        if not self.holds or np.any(errors[reaches] > coarse[reaches]):
            found = self._solved(problem, self.region)
            lost = max(0, int(inside.sum()) + len(other) - len(found[0]))
            return Judged(*found, np.ones(len(found[0]), dtype=bool), lost, projected, seen)
        unknown = np.where(other == 0.0, 0.0, np.nan)
        values = np.concatenate([z[inside], other])
        residuals, bounds = (
            np.concatenate([part[inside], unknown]) for part in (lack.residuals, errors)
        )
        done = np.zeros(len(values), dtype=bool)
        open_ = inside & ~lack.steady & (errors >= np.abs(z.real))
        doubtful = open_ | (np.abs(self.region.distance(z)) <= errors)
        doubtful |= inside & (lack.residuals > ACCEPTED)  # which decide nothing
        if not doubtful.any():
            return Judged(values, residuals, bounds, done, 0, projected, seen)
        far = np.maximum(4 * errors, 1e-6 * np.abs(z))[doubtful]
        low, high = z[doubtful] - (1 + 1j) * far, z[doubtful] + (1 + 1j) * far
        part = Rectangle(
            *map(float, (low.real.min(), high.real.max(), low.imag.min(), high.imag.max()))
        )
        found = self._solved(problem, part, self._structure(changes).factor)
        within, rest = self.region.contains(found[0]), ~part.contains(values)
        new = *(each[within] for each in found), np.ones(within.sum(), dtype=bool)
        old = values, residuals, bounds, done
        joined = [np.concatenate([a[rest], b]) for a, b in zip(old, new, strict=True)]
        spurious = max(0, int((~rest).sum()) - int(within.sum()))
        return Judged(joined[0], joined[1], joined[2], joined[3], spurious, projected, seen)

    def _solved(
        self, problem: Quadratic, region: Rectangle, factor: Factor | None = None
    ) -> tuple[ComplexArray, Array, Array]:
        """Roots of the full problem in a region with backward errors and what these may move: on
        the basis, corrected with a factor, or by Krylov subspaces where that does not converge."""
        roots = None
        if factor is not None:
            roots = corrected(problem, factor, self.vectors, region, eigensolver.OPTIONS)
        if roots is None:
            roots = modes_in(problem, region, False, self.vectors).roots
        each = listed(problem, roots)
        numbers = [(e.value, e.residual, e.rounding) for e in each]
        values, residuals, errors = np.array(numbers, dtype=complex).reshape(-1, 3).T
        return values, residuals.real, errors.real
