"""Projection of a large system onto few vectors, the same at all values of its parameters.

The reduced matrices V' A_i V keep the factors of the full ones, so that the reduced system is a
system of terms like any other. Its roots are judged by the residual of the full problem, which
random vectors estimate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.matrices import norm_of
from squeal.linear.system import Term, TermSystem, frictionless
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.dense import dense_roots, dense_values, roots_at
from squeal.sparse.eigensolver import OPTIONS, enlarged, modes_in
from squeal.sparse.quadratic import (
    PARTS,
    Array,
    ComplexArray,
    Progress,
    Quadratic,
    Roots,
    ScaledSystem,
    quiet,
)

TOLERANCE = 3e-8  # of the backward error; that of a root is of the order of its square
SPURIOUS = 1e-5  # backward error of what is no root of the full problem
SKETCH = 48  # random vectors that estimate a residual within a factor of two
SAMPLES = 20  # full solutions before a reduction is given up

Changes = Mapping[str, float]


class ReducedModes(NamedTuple):
    """Roots (m,) of the reduced system in a region, with backward errors in the full one.

    The errors are estimates from random vectors, within a factor of two. `spurious` others were
    left out: roots of the reduced system alone.
    """

    values: ComplexArray
    vectors: ComplexArray  # (d, m), of unit length
    residuals: Array
    spurious: int = 0


class Basis:
    """A growing orthonormal basis (n, d) and all that follows from it."""

    def __init__(self, scaled: ScaledSystem) -> None:
        self.scaled = scaled
        self.vectors: Array = np.zeros((scaled.n, 0))
        self._matrices = {part: scaled.terms(part) for part in PARTS}
        self._norms = {part: [norm_of(A) for A in self._matrices[part]] for part in PARTS}
        rng = np.random.default_rng(48)
        probes = rng.standard_normal((scaled.n, SKETCH)) / np.sqrt(SKETCH)
        self._probed = [A.T @ probes for part in PARTS for A in self._matrices[part]]
        self._sketch: Array | None = None

    @property
    def size(self) -> int:
        """Number of vectors d."""
        return self.vectors.shape[1]

    def extend(self, snapshots: ComplexArray) -> None:
        """Add what the real and imaginary parts of columns (n, m) bring."""
        self.vectors, self._sketch = enlarged(self.vectors, snapshots, TOLERANCE / 10), None

    def system(self) -> TermSystem:
        """The reduced system: the full one's factors, matrices (d, d)."""
        given, V = self.scaled.system, self.vectors
        M, C, K = (
            tuple(
                Term(V.T @ (A @ V), t.factor)
                for A, t in zip(self._matrices[part], getattr(given, part), strict=True)
            )
            for part in PARTS
        )
        return replace(given, M=M, C=C, K=K)

    def stiffness(self, changes: Changes) -> float:
        """A bound of the norm of the full K, whose rounding the reduced one carries."""
        p = self.scaled.system.values(changes)
        terms = zip(self.scaled.system.K, self._norms["K"], strict=True)
        return float(sum(abs(t.factor.value(p)) * bound for t, bound in terms))

    def roots(
        self, system: TermSystem, region: Rectangle, changes: Changes, left: bool = False
    ) -> Roots:
        """The roots in a region of the reduced `system` at its parameters, some of them changed."""
        return dense_roots(*system.at(changes), region, left, self.stiffness(changes))

    def residuals(self, roots: Roots, changes: Changes) -> Array:
        """Backward errors (m,) in the full problem of roots of the reduced one, estimated.

        They are relative to the sum of the norms of the terms, a bound of that of their sum.
        """
        if self._sketch is None:
            self._sketch = np.array([W.T @ self.vectors for W in self._probed])
        p, size = self.scaled.system.values(changes), np.abs(roots.values)
        weights, bounds = [], np.zeros(len(size))
        for part, power in zip(PARTS, (2, 1, 0), strict=True):
            terms = getattr(self.scaled.system, part)
            for term, bound in zip(terms, self._norms[part], strict=True):
                factor = term.factor.value(p)
                weights.append(factor * roots.values**power)
                bounds += abs(factor) * bound * size**power if factor else 0.0
        rest = np.einsum(
            "trd,tm,dm->rm", self._sketch, np.array(weights), roots.right, optimize=True
        )
        return np.asarray(np.linalg.norm(rest, axis=0) / bounds)


@dataclass(frozen=True, eq=False)
class Reduction:
    """A reduced system, and how far its roots are from satisfying the full one."""

    system: TermSystem = field(repr=False)  # dense (d, d), with the parameters of the full one
    basis: Basis = field(repr=False)
    samples: tuple[Changes, ...]  # where the full problem was solved
    worst: float  # largest backward error in the full problem of a root, over all values
    method: str  # reduced (complex modes) or modal (real modes)
    spurious: int = 0  # roots of the reduced system alone at the samples, over all of them

    @property
    def size(self) -> int:
        """Number of vectors d."""
        return self.basis.size

    @property
    def converged(self) -> bool:
        """True if all roots at all values meet the full problem to the tolerance."""
        return self.worst <= TOLERANCE

    def modes(self, region: Rectangle, changes: Changes | None = None) -> ReducedModes:
        """The roots in a region at the parameters, some of them changed."""
        return self._genuine(self.roots(region, changes), changes or {})

    def roots(self, region: Rectangle, changes: Changes | None = None, left: bool = False) -> Roots:
        """The same without errors, spurious ones among them; left vectors if wanted."""
        return self.basis.roots(self.system, region, changes or {}, left)

    def values(self, region: Rectangle, changes: Changes | None = None) -> ComplexArray:
        """The roots in a region without vectors and errors: the least work.

        Those that grow are held against the full problem in any case.
        """
        p = changes or {}
        M, C, K = self.system.at(p)
        values = dense_values(M, C, K, self.basis.stiffness(p))
        values = values[region.contains(values)]
        doubtful = (values.real > 1e-6 * np.abs(values)) | (self.spurious > 0)
        if self.method == "modal" or not np.any(doubtful):
            return values
        genuine = self._genuine(roots_at(M, C, K, values[doubtful]), p).values
        return np.concatenate([values[~doubtful], genuine])

    def _genuine(self, roots: Roots, changes: Changes) -> ReducedModes:
        """Roots with their errors, without those that are none of the full problem."""
        errors = self.basis.residuals(roots, changes)
        good = errors <= (np.inf if self.method == "modal" else SPURIOUS)
        left_out = int(np.sum(~good))
        return ReducedModes(roots.values[good], roots.right[:, good], errors[good], left_out)

    def shapes(self, vectors: ComplexArray) -> ComplexArray:
        """Mode shapes (n, m) in the full system's coordinates of reduced vectors (d, m)."""
        return np.asarray(self.basis.scaled.scale[:, None] * (self.basis.vectors @ vectors))


def reduce_system(
    scaled: ScaledSystem,
    region: Rectangle,
    values: Sequence[Changes],
    progress: Progress = quiet,
) -> Reduction:
    """A reduced system whose roots in a region meet `TOLERANCE` at all values of the parameters.

    Right and left modes of the full system at one of the `values` (changes of one to three
    parameters) start the basis; of the other values that where a root's residual in the full
    problem is worst adds its own, until all are below that (a backward error). Where the
    full problem was solved, what exceeds it by far is no root of it. `worst` exceeds the tolerance
    if 20 samples do not suffice. Of a region without a root the basis holds those around it.
    Raises InputError for no values, ComputationError.
    """
    if not values:
        raise InputError("at least one value of the parameters is required")
    basis, wide = Basis(scaled), region.widened(0.04)
    samples: list[int] = []
    where, proved = len(values) // 2, set[int]()
    while True:
        if samples:
            system = basis.system()
            errors = [basis.residuals(basis.roots(system, region, p), p) for p in values]
            spurious = {k: int(np.sum(errors[k] > SPURIOUS)) for k in samples}
            doubtful = [k for k in samples if spurious[k] and k not in proved]
            if doubtful:
                where = doubtful[0]
                progress(f"counting the roots at {_named(values[where])}")
                basis.extend(_snapshots(scaled.at(values[where]), region, None, True, progress))
                proved.add(where)
                continue
            genuine = [e[e <= SPURIOUS] if k in spurious else e for k, e in enumerate(errors)]
            worst = [float(np.max(e, initial=0.0)) for e in genuine]
            left = [0.0 if k in spurious else w for k, w in enumerate(worst)]
            where = int(np.argmax(left))
            if left[where] <= TOLERANCE or len(samples) == SAMPLES:
                break
        progress(f"sample {len(samples) + 1} at {_named(values[where])}")
        problem = scaled.at(values[where])
        basis.extend(_snapshots(problem, wide, basis.vectors, False, progress))
        samples.append(where)
        around = wide
        while basis.size == 0:  # what may enter the region at other values lies around it
            around = around.widened(1.0)
            if around.radius > problem.rate:
                raise ComputationError("no root lies in the region or around it")
            basis.extend(_snapshots(problem, around, None, False, progress))
    at = tuple(values[k] for k in samples)
    return Reduction(system, basis, at, max(worst), "reduced", sum(spurious.values()))


def _snapshots(
    problem: Quadratic, region: Rectangle, known: Array | None, certify: bool, progress: Progress
) -> ComplexArray:
    """Vectors (n, m) of the right and left modes in a region, in scaled coordinates."""
    exact = None if certify else OPTIONS.accepted
    roots = modes_in(problem, region, certify, progress, known, exact).roots
    return np.hstack([roots.right, roots.left])


def reduce_to_real_modes(
    scaled: ScaledSystem, region: Rectangle, values: Sequence[Changes], modes: int
) -> Reduction:
    """Projection onto the lowest real modes of the structure, as commercial programs do it.

    The modes are those of M and the symmetric part of K at the nominal parameters without friction
    and damping; of as many modes as rows, or one less, all directions are kept. Raises InputError
    for more modes than rows and ComputationError.
    """
    from scipy.sparse.linalg import ArpackError, eigsh

    if not 1 <= modes <= scaled.n:
        raise InputError(f"{modes} modes are not allowed; it must be 1 to {scaled.n}")
    M, K = (_structure(scaled, part) for part in ("M", "K"))
    shift = -1e-6 * norm_of(K) / norm_of(M)  # below all squares, so that rigid bodies pass
    try:
        if modes > scaled.n - 2:
            vectors = np.eye(scaled.n)
        else:
            _, vectors = eigsh((K + K.T) / 2, k=modes, M=M, sigma=shift)
    except (ArpackError, RuntimeError, ValueError) as error:
        raise ComputationError(f"the real modes were not found: {error}") from None
    basis = Basis(scaled)
    basis.extend(vectors.astype(complex))
    system = basis.system()
    errors = [basis.residuals(basis.roots(system, region, p), p) for p in values]
    worst = max(float(np.max(e, initial=0.0)) for e in errors)
    return Reduction(system, basis, (), worst, "modal")


def _structure(scaled: ScaledSystem, part: str) -> np.ndarray:
    at = frictionless(scaled.system)
    terms = zip(getattr(scaled.system, part), scaled.terms(part), strict=True)
    matrix = sum(t.factor.value(at) * A for t, A in terms)
    if not abs(matrix).max():
        raise InputError(f"{part}: is zero without friction; real modes need a structure")
    return matrix


def _named(changes: Changes) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in changes.items()) or "the parameters"
