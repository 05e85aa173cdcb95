"""Projection of a large system onto few vectors, the same at all values of its parameters.

The reduced matrices V' A_i V keep the factors of the full ones, so that the reduced system is a
system of terms like any other. Its roots are judged by the residual of the full problem, which
random vectors estimate.

Modes come rough from a subspace in single precision and are corrected: in the space of what is
known of some modes the full problem has Ritz pairs; P(shift)^-1, applied to the residuals of all of
them at once, brings the directions that they lack (residual inverse iteration, Neumaier 1985, as a
subspace method). What a factor in single precision solves is good enough for that, since the
residuals are those of the full problem in double precision.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.dampings import frictionless
from squeal.linear.matrices import norm_of
from squeal.linear.system import Term, TermSystem
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.dense import dense_roots, dense_values, roots_at
from squeal.sparse.eigensolver import STEPS, Krylov, modes_in
from squeal.sparse.factor import Factor, Progress, factorise_at, quiet
from squeal.sparse.quadratic import (
    PARTS,
    Array,
    ComplexArray,
    Quadratic,
    Roots,
    ScaledSystem,
    combined,
)

TOLERANCE = 3e-8  # of the backward error; that of a root is of the order of its square
DROPPED = 3e-9  # part of a snapshot outside the basis that is left out
MARGIN = 0.04  # snapshots are taken from a region this much larger on each side
SKETCH = 48  # random vectors that estimate a residual within a factor of two
NEARLY = 0.25  # of the largest estimate: what exceeds this may be the largest residual
COLUMNS = 32  # of which a residual is computed at a time
SAMPLES = 20  # full solutions before a reduction is given up
SPURIOUS = 1e-5  # backward error of what is no root of the full problem
WIDER = 12  # times a region without a root is made three times as wide
GROWS = 1e-6  # of |lambda|: growth whose root is held against the full problem in any case
CORRECTED = 2e-9  # backward error of right and left modes, with which this ends
ROUNDS = 10
BORDER = 0.01  # of a side of the region: roots this close to it may come to lie on its other side
BESIDE = 1e-4  # of a unit vector: part outside the known space that is followed
OFF_MIDDLE = 0.03 + 0.04j  # of the radius of a region: where its shift stands off its middle
BEGINS = 1e-6  # the same of what begins it

Changes = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class ReducedModes:
    """Roots (m,) of the reduced system in a region, with backward errors in the full one.

    The errors are estimates from random vectors, within a factor of two. `spurious` others were
    left out: roots of the reduced system alone.
    """

    values: ComplexArray
    vectors: ComplexArray = field(repr=False)  # (d, m), of unit length
    residuals: Array
    spurious: int = 0


@dataclass(frozen=True, eq=False)
class Begun:
    """A basis (n, d) that a reduction has come to, and the indices of the values that made it."""

    vectors: Array = field(repr=False)
    samples: tuple[int, ...]


class Basis:
    """A growing orthonormal basis (n, d) and all that follows from it."""

    def __init__(self, scaled: ScaledSystem) -> None:
        self.scaled = scaled
        self.vectors: Array = np.zeros((scaled.n, 0))
        self._matrices = {part: scaled.terms(part) for part in PARTS}
        self._norms = {part: [norm_of(A) for A in self._matrices[part]] for part in PARTS}
        rng = np.random.default_rng(48)
        probes = rng.standard_normal((scaled.n, SKETCH)) / np.sqrt(SKETCH)
        self._probed = {part: [A.T @ probes for A in self._matrices[part]] for part in PARTS}
        self._sketch: np.ndarray | None = None

    @property
    def size(self) -> int:
        """Number of vectors d."""
        return self.vectors.shape[1]

    def extend(self, snapshots: ComplexArray) -> int:
        """Add what the real and imaginary parts of columns (n, m) bring; how many it is."""
        before = self.size
        self.vectors = enlarged(self.vectors, snapshots, DROPPED)
        self._sketch = None
        return self.size - before

    def system(self) -> TermSystem:
        """The reduced system: the full one's factors, matrices (d, d)."""
        given, V = self.scaled.system, self.vectors
        parts = {
            part: tuple(
                Term(V.T @ (A @ V), t.factor)
                for A, t in zip(self._matrices[part], getattr(given, part), strict=True)
            )
            for part in PARTS
        }
        return TermSystem(
            parts["M"], parts["C"], parts["K"], given.parameters, given.parameter, given.name
        )

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

    def sketch(self) -> np.ndarray:
        """Blocks (terms, SKETCH, d) whose combinations estimate a residual."""
        if self._sketch is None:
            V = self.vectors
            self._sketch = np.array([W.T @ V for part in PARTS for W in self._probed[part]])
        return self._sketch

    def residuals(self, weights: ComplexArray, vectors: ComplexArray) -> Array:
        """Norms (m,) of the sums of all terms' matrices times weights (terms, m), on vectors
        (d, m): of P x in the full problem."""
        blocks = [A for part in PARTS for A in self._matrices[part]]
        norms = []
        for k in range(0, vectors.shape[1], COLUMNS):
            columns = slice(k, k + COLUMNS)
            x = combined(self.vectors, vectors[:, columns])
            parts = np.hstack([x.real, x.imag])
            images = (np.split(A @ parts, 2, axis=1) for A in blocks)
            terms = (
                (y + 1j * z) * w for (y, z), w in zip(images, weights[:, columns], strict=True)
            )
            norms.append(np.linalg.norm(sum(terms), axis=0))
        return np.concatenate(norms)

    def weights(self, values: ComplexArray, changes: Changes) -> tuple[ComplexArray, Array]:
        """Factors (terms, m) of the blocks at each root and the size (m,) of P there.

        The size sums the norms of the terms, a bound of that of their sum.
        """
        p = self.scaled.system.values(changes)
        rows, size = [], np.zeros(len(values))
        for part, power in zip(PARTS, (2, 1, 0), strict=True):
            for term, bound in zip(
                getattr(self.scaled.system, part), self._norms[part], strict=True
            ):
                factor = term.factor.value(p)
                rows.append(factor * values**power)
                if abs(factor) * bound > 0:
                    size += abs(factor) * bound * np.abs(values) ** power
        return np.array(rows), size


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
        """The roots in a region without vectors and errors: the least work."""
        if self.spurious:
            return self.modes(region, changes).values
        p = changes or {}
        M, C, K = self.system.at(p)
        found = dense_values(M, C, K, self.basis.stiffness(p))
        found = found[region.contains(found)]
        grows = found.real > GROWS * np.abs(found)
        if self.method == "modal" or not np.any(grows):
            return found
        kept = self._genuine(roots_at(M, C, K, found[grows]), p).values
        return np.concatenate([found[~grows], kept])

    def _genuine(self, roots: Roots, changes: Changes) -> ReducedModes:
        """Roots with their errors, without those that are none of the full problem."""
        weights = self.basis.weights(roots.values, changes)
        residuals = _residuals(self.basis.sketch(), *weights, roots.right)
        good = residuals <= (np.inf if self.method == "modal" else SPURIOUS)
        left_out = int(np.sum(~good))
        return ReducedModes(roots.values[good], roots.right[:, good], residuals[good], left_out)

    def shapes(self, vectors: ComplexArray) -> ComplexArray:
        """Mode shapes (n, m) in the full system's coordinates of reduced vectors (d, m)."""
        return np.asarray(self.basis.scaled.scale[:, None] * (self.basis.vectors @ vectors))


def _residuals(
    blocks: np.ndarray, weights: ComplexArray, size: Array, vectors: ComplexArray
) -> Array:
    rest = np.einsum("trd,tm,dm->rm", blocks, weights, vectors, optimize=True)
    return np.asarray(np.linalg.norm(rest, axis=0) / size)


def reduce_system(
    scaled: ScaledSystem,
    region: Rectangle,
    values: Sequence[Changes],
    progress: Progress = quiet,
    begun: Begun | None = None,
    keep: Callable[[Begun], None] = lambda begun: None,
) -> Reduction:
    """A reduced system whose roots in a region meet `TOLERANCE` at all values of the parameters.

    Right and left modes of the full system at one of the `values` (changes of one to three
    parameters) start the basis; of the other values that where a root's residual in the full
    problem is worst adds its own, until all are below that (a backward error). Where the
    full problem was solved, what exceeds it by far is no root of it. `worst` exceeds the tolerance
    if 20 samples do not suffice. Of a region without a root the basis holds those around it. `keep`
    is given what there is after each sample, and `begun` goes on from there. Raises InputError for
    no values, ComputationError.
    """
    if not values:
        raise InputError("at least one value of the parameters is required")
    basis, wide = Basis(scaled), region.widened(MARGIN)
    samples: list[int] = []
    if begun is not None:
        basis.vectors, samples = begun.vectors, list(begun.samples)
    where, proved = len(values) // 2, set[int]()
    while True:
        if samples:
            system = basis.system()
            roots = [basis.roots(system, region, changes) for changes in values]
            errors = _Errors(basis, roots, values, samples)
            if doubtful := errors.with_spurious - proved:
                where = doubtful.pop()
                progress(f"counting the roots at {_named(values[where])}")
                basis.extend(_vectors(scaled.at(values[where]), region, True, progress))
                proved.add(where)
                continue
            worst, where = errors.largest(~errors.spurious, TOLERANCE)
            if worst <= TOLERANCE:
                break
            others, where = errors.largest(~errors.sampled, TOLERANCE)
            if others <= TOLERANCE or len(samples) == SAMPLES:
                worst, _ = errors.largest(~errors.spurious)
                break
        progress(f"sample {len(samples) + 1} at {_named(values[where])}")
        basis.extend(_snapshots(scaled.at(values[where]), wide, basis.vectors, progress))
        samples.append(where)
        if basis.size == 0:  # what may enter the region at other values lies around it
            basis.extend(_around(scaled.at(values[where]), wide, progress))
        keep(Begun(basis.vectors, tuple(samples)))
    at = tuple(values[k] for k in samples)
    return Reduction(system, basis, at, worst, "reduced", int(np.sum(errors.spurious)))


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
    K = (K + K.T) / 2
    shift = -1e-6 * norm_of(K) / norm_of(M)  # below all squares, so that rigid bodies pass
    try:
        if modes > scaled.n - 2:
            vectors = np.eye(scaled.n)
        else:
            _, vectors = eigsh(K, k=modes, M=M, sigma=shift)
    except (ArpackError, RuntimeError, ValueError) as error:
        raise ComputationError(f"the real modes were not found: {error}") from None
    basis = Basis(scaled)
    basis.extend(vectors / np.linalg.norm(vectors, axis=0))
    system = basis.system()
    roots = [basis.roots(system, region, changes) for changes in values]
    errors = _Errors(basis, roots, values, ())
    worst, _ = errors.largest(~errors.sampled)
    return Reduction(system, basis, (), worst, "modal")


def _structure(scaled: ScaledSystem, part: str) -> np.ndarray:
    at = frictionless(scaled.system)
    terms = zip(getattr(scaled.system, part), scaled.terms(part), strict=True)
    found = sum(t.factor.value(at) * A for t, A in terms)
    if not abs(found).max():
        raise InputError(f"{part}: is zero without friction; real modes need a structure")
    return found


def _snapshots(
    problem: Quadratic, region: Rectangle, known: Array, progress: Progress
) -> ComplexArray:
    """Vectors (n, m) of the right and left modes in a region, in scaled coordinates."""
    near = corrected_modes(problem, region, known, progress)
    if near is not None:
        return np.hstack([near.right, near.left])
    return _vectors(problem, region, False, progress)


def _around(problem: Quadratic, region: Rectangle, progress: Progress) -> ComplexArray:
    """The same of the roots around a region that holds none. Raises ComputationError."""
    for _ in range(WIDER):
        region = region.widened(1.0)
        found = _snapshots(problem, region, np.zeros((problem.n, 0)), progress)
        if found.size:
            return found
    raise ComputationError("no root lies in the region or around it")


def _vectors(
    problem: Quadratic, region: Rectangle, certify: bool, progress: Progress
) -> ComplexArray:
    """The same from a search, which a count confirms if it is to certify."""
    full = modes_in(problem, region, certify=certify, progress=progress)
    columns = [v / problem.scale for e in full.eigenvalues for v in (e.right, e.left)]
    columns = [c for c in columns if not np.isnan(c[0])]
    return np.array(columns).T if columns else np.zeros((problem.n, 0), dtype=complex)


class _Errors:
    """Backward errors in the full problem of the roots at all values, side by side.

    Random vectors estimate all of them, within a factor of two; those that may be the largest are
    computed, unless the estimate leaves no doubt that the largest exceeds a tolerance.
    """

    def __init__(
        self,
        basis: Basis,
        roots: Sequence[Roots],
        values: Sequence[Changes],
        samples: Sequence[int],
    ) -> None:
        at = [basis.weights(r.values, p) for r, p in zip(roots, values, strict=True)]
        self._basis = basis
        self._weights = np.hstack([weights for weights, _ in at])
        self._size = np.concatenate([size for _, size in at])
        self._vectors = np.hstack([r.right for r in roots])
        self._which = np.repeat(np.arange(len(values)), [len(r.values) for r in roots])
        self._estimates = _residuals(basis.sketch(), self._weights, self._size, self._vectors)
        self.sampled = np.isin(self._which, samples)
        self.spurious = self.sampled & (self._estimates > SPURIOUS)

    @property
    def with_spurious(self) -> set[int]:
        """Indices of the samples at which the reduced system has roots of its own."""
        return set(self._which[self.spurious].tolist())

    def largest(self, wanted: np.ndarray, tolerance: float = np.inf) -> tuple[float, int]:
        """The largest error of wanted roots, a mask (m,), and the index of its value; 0 without
        one."""
        if not np.any(wanted):
            return 0.0, 0
        estimates = np.where(wanted, self._estimates, 0.0)
        first = int(np.argmax(estimates))
        if estimates[first] > 2 * tolerance:
            return float(estimates[first]), int(self._which[first])
        large = np.flatnonzero(wanted & (estimates >= NEARLY * estimates[first]))
        rests = self._basis.residuals(self._weights[:, large], self._vectors[:, large])
        errors = rests / self._size[large]
        first = int(np.argmax(errors))
        return float(errors[first]), int(self._which[large[first]])


def _named(changes: Changes) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in changes.items()) or "the parameters"


def corrected_modes(
    problem: Quadratic,
    region: Rectangle,
    start: Array | None = None,
    progress: Progress = quiet,
) -> Roots | None:
    """The roots in a region with unit right and left vectors of backward errors below 2e-9.

    One Krylov subspace in single precision finds them all, roughly; None if it does not reach the
    region's corners, or if the corrections do not end with as many roots. Orthonormal vectors
    `start` (n, d) that nearly hold the modes save corrections.
    """
    # beside the middle: a root exactly there would hide all others from single precision
    beside = OFF_MIDDLE * region.radius
    centre, radius = region.centre + beside, region.radius + abs(beside)
    progress(f"factorising {problem.n} rows at {centre:.6g}")
    shift, factor = factorise_at(problem, centre, single=True)
    krylov = Krylov(problem, shift, factor, radius, np.random.default_rng(0), single=True)
    start = np.zeros((problem.n, 0)) if start is None else start
    limit = min(STEPS, 2 * problem.n)
    more = True
    while more:
        more = krylov.advance(limit)
        if krylov.found(vectors=False).reach >= radius:
            break
    else:
        return None
    near = krylov.found()
    del krylov  # its memory
    if not len(near.values):
        return Roots(near.values, near.vectors, near.vectors)
    inner = region.widened(-BORDER)
    found = _corrected(problem, factor, enlarged(start, near.vectors, BEGINS), region)
    enough = found is not None and len(found.values) >= np.sum(inner.contains(near.values))
    return found if enough else None


def _corrected(problem: Quadratic, factor: Factor, V: Array, region: Rectangle) -> Roots | None:
    """The roots in a region from an orthonormal basis (n, d) that nearly holds their right vectors,
    and a factor of P near them; None if they do not come to be good."""
    other = Quadratic(problem.M.T, problem.C.T, problem.K.T, problem.scale, problem.norms)
    space = _Space(problem, other, V)
    for _ in range(ROUNDS):
        M, C, K = space.parts
        ritz = dense_roots(M, C, K, region, left=True, stiffness=problem.norms[2])
        x, y = combined(space.V, ritz.right), combined(space.V, ritz.left.conj())
        rests = problem.apply(ritz.values, x), other.apply(ritz.values, y)
        errors = [np.linalg.norm(rest, axis=0) / problem.size(ritz.values) for rest in rests]
        bad = [error > CORRECTED for error in errors]
        if not np.any(bad):
            return Roots(ritz.values, x, y.conj())
        steps = [
            factor.solve(rest[:, which], transposed)
            for rest, which, transposed in zip(rests, bad, (False, True), strict=True)
            if np.any(which)
        ]
        space.enlarge(np.hstack(steps))
    return None


class _Space:
    """A growing orthonormal basis V (n, d) with the matrices V' A V of M, C and K."""

    def __init__(self, problem: Quadratic, other: Quadratic, V: Array) -> None:
        self._right, self._left = ((p.M, p.C, p.K) for p in (problem, other))
        self.V = V
        self.parts = [V.T @ (A @ V) for A in self._right]

    def enlarge(self, columns: ComplexArray) -> None:
        """Add columns (n, m)."""
        d = self.V.shape[1]
        self.V = enlarged(self.V, columns, BESIDE)
        old, new = self.V[:, :d], np.ascontiguousarray(self.V[:, d:])
        for k, (A, B) in enumerate(zip(self._right, self._left, strict=True)):
            image = A @ new
            side, corner = old.T @ image, new.T @ image
            self.parts[k] = np.block([[self.parts[k], side], [(B @ new).T @ old, corner]])


def enlarged(V: Array, columns: ComplexArray, dropped: float) -> Array:
    """An orthonormal basis (n, d) and what the real and imaginary parts of columns add to it, of
    unit vectors what exceeds `dropped`."""
    columns = columns / np.linalg.norm(columns, axis=0)
    rest = np.hstack([columns.real, columns.imag]).astype(float)
    while rest.size:
        rest -= V @ (V.T @ rest)
        new, least = _principal(rest, dropped)
        if not new.size:
            break
        new -= V @ (V.T @ new)  # once more, since it may have been a small part
        V = np.hstack([V, _principal(new, 0.1)[0]])
        if least == dropped:
            break
    return V


def _principal(columns: Array, least: float) -> tuple[Array, float]:
    """Orthonormal principal axes of columns (n, m) with singular values above `least` or, if that
    is more, 1e-5 of the largest; and this limit. Products of matrices, much faster than an SVD."""
    squares, axes = np.linalg.eigh(columns.T @ columns)
    least = max(least, 1e-5 * float(np.sqrt(max(squares[-1], 0.0))))
    kept = squares > least**2
    return columns @ (axes[:, kept] / np.sqrt(squares[kept])), least
