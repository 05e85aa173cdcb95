"""Projection of a large system onto few vectors, the same at all values of its parameters.

The reduced matrices V' A_i V keep the factors of the full ones, so that the reduced system is a
system of terms like any other. Its roots are judged by the residual of the full problem, which
random vectors estimate.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.matrices import divisor, norm_of
from squeal.linear.system import Term, TermSystem
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.dense import dense_values, roots_at
from squeal.sparse.dispersive import settled, vectors
from squeal.sparse.eigensolver import OPTIONS, corrected_roots, enlarged, grown, modes_in
from squeal.sparse.factor import Factor
from squeal.sparse.quadratic import (
    PROGRESS,
    Array,
    ComplexArray,
    Quadratic,
    Roots,
    ScaledSystem,
    multiply,
)

TOLERANCE = 3e-8  # of the backward error; that of a root is of the order of its square
SPURIOUS = 1e-5  # backward error of what is no root of the full problem
SKETCH = 48  # random vectors that estimate a residual within a factor of two
SAMPLES = 20  # full solutions before a reduction is given up
CONTRACTS = 0.9  # what counts as contracting
POWERS = 5  # of T, to see how it contracts

Changes = Mapping[str, float]


def contraction(V: Array, inner: NDArray, F: Any, factor: Factor, P: Any) -> float:
    """How 1 - F^-1 P contracts what an orthonormal basis V (n, d) lacks; inner (d, d) is V' F V.

    Below 1 what is lacking has no root of P of its own.
    """
    x: Any = np.random.default_rng(1).standard_normal((len(V), 3)).astype(complex)
    for _ in range(1 + POWERS):
        x = x - factor.solve(P @ x)
        held: Any = np.linalg.solve(inner, multiply(V.T, F @ x))
        x = x - multiply(V, held)
        size = np.linalg.norm(x, axis=0)
        x /= np.where(size > 0, size, 1.0)
    return float(size.max())


class Reduction:
    """A growing basis, the system that it reduces to, and how far its roots in a region are from
    satisfying the full one.

    `vectors` (n, d) are orthonormal, `system` is dense (d, d) with the parameters of the full one;
    `samples` are where the full problem was solved, `worst` is the largest backward error in the
    full problem of a root, over all values; `spurious` counts the roots of the reduced system alone
    at the samples, over all of them.
    """

    system: TermSystem
    method = "reduced"

    def __init__(self, scaled: ScaledSystem, region: Rectangle) -> None:
        self.scaled, self.region = scaled, region
        self.vectors: Array = np.zeros((scaled.n, 0))
        self._sketch: Array = np.zeros(0)
        self.factor: Factor | None = None  # of P at the first sample
        self._first: tuple[Changes, complex] | None = None
        self.samples: tuple[Changes, ...] = ()
        self.worst, self.spurious = np.inf, 0
        parts = zip(scaled.system.parts, scaled.terms, strict=True)
        self._terms = [list(zip(*part, strict=True)) for part in parts]
        self._norms = [[norm_of(A) for _, A in terms] for terms in self._terms]
        probes = np.random.default_rng(48).standard_normal((scaled.n, SKETCH)) / np.sqrt(SKETCH)
        self._probed = [A.T @ probes for terms in self._terms for _, A in terms]

    def extend(self, snapshots: ComplexArray, dropped: float = TOLERANCE / 10) -> None:
        """Add what the real and imaginary parts of columns (n, m) bring, of unit vectors what
        exceeds `dropped`."""
        old, V = self.vectors, enlarged(self.vectors, snapshots, dropped)
        self.vectors, new = V, np.ascontiguousarray(V[:, old.shape[1] :])
        if not new.size:
            return
        before = self.system.parts if old.size else [[None] * len(t) for t in self._terms]
        M, C, K = (
            tuple(
                Term(grown(part.matrix if part else old.T @ old, A, old, new), term.factor)
                for (term, A), part in zip(terms, parts, strict=True)
            )
            for terms, parts in zip(self._terms, before, strict=True)
        )
        self.system = replace(self.scaled.system, M=M, C=C, K=K)
        sketch = np.array([W.T @ new for W in self._probed])
        self._sketch = np.concatenate([self._sketch, sketch], axis=2) if old.size else sketch

    def sample(self, changes: Changes, region: Rectangle, certify: bool = False) -> None:
        """Add the modes of the full problem in a region at the parameters, some of them changed.

        They are corrected by the factor of the first sample where that shows that none is missed,
        and found by Krylov subspaces elsewhere.
        """
        problem, roots = self.scaled.at(changes), None
        if certify:
            roots = modes_in(problem, region).roots
        elif self.factor is not None and self.size and self._reaches(problem):
            options = replace(OPTIONS, exact=TOLERANCE / 3, accepted=TOLERANCE / 3)
            roots = corrected_roots(problem, self.factor, self.vectors, region, options)
        if roots is None or not (certify or len(roots.values)):  # one may enter as it is corrected
            modes = modes_in(problem, region, False, self.vectors, OPTIONS.accepted)
            roots = modes.roots
            if self.factor is None and modes.near is not None and len(roots.values):
                self.factor, self._first = modes.near.factor, (changes, modes.near.shift)
                self.extend(modes.near.vectors)
        self.extend(np.hstack([roots.right, roots.left]))

    def _reaches(self, problem: Quadratic) -> bool:
        """True if what the basis lacks at some parameters has no root of its own in the region."""
        assert self.factor is not None
        assert self._first is not None
        changes, shift = self._first
        M, C, K = self.system.at(changes)
        inner = shift * (shift * M + (0.0 if C is None else C)) + K
        F, region = self.scaled.at(changes).at(shift), self.region
        corners = (complex(region.high_real, w) for w in (region.low_imag, region.high_imag))
        ratios = [contraction(self.vectors, inner, F, self.factor, problem.at(z)) for z in corners]
        return max(ratios) < CONTRACTS

    @property
    def size(self) -> int:
        """Number of vectors d."""
        return self.vectors.shape[1]

    @property
    def converged(self) -> bool:
        """True if all roots at all values meet the full problem to the tolerance."""
        return self.worst <= TOLERANCE

    def _own(self, changes: Changes) -> bool:
        """True if the frequency is that of each root."""
        return not changes.keys() >= set(self.system.follows)

    def frozen(self, omega: float, region: Rectangle) -> "Reduction":
        """The same at one frequency (rad/s), in a region around it."""
        other = copy(self)
        other.system, other.region = self.system.frozen(omega), region
        return other

    def replaced(self, changes: Changes) -> "Reduction":
        """The same with other values of some parameters as its own."""
        other = copy(self)
        other.scaled = copy(self.scaled)
        other.scaled.system = self.scaled.system.replace(changes)
        other.system = self.system.replace(changes)
        return other

    def _stiffness(self, changes: Changes) -> float:
        """A bound of the norm of the full K, whose rounding the reduced one carries."""
        p = self.system.values(changes)
        terms = zip(self.system.K, self._norms[2], strict=True)
        return float(sum(abs(t.factor.value(p)) * bound for t, bound in terms))

    def roots(
        self, changes: Changes, left: bool = False, values: ComplexArray | None = None
    ) -> Roots:
        """The roots in the region at the parameters, some of them changed, spurious ones among
        them, or the roots of these `values`; left vectors if wanted."""
        matrices, stiffness = self.system.at(changes), self._stiffness(changes)
        if values is None:
            values = dense_values(*matrices, stiffness)
            values = values[self.region.contains(values)]
        return roots_at(*matrices, values, left, stiffness)

    def residuals(self, roots: Roots, changes: Changes) -> Array:
        """Backward errors (m,) in the full problem of roots of the reduced one, estimated.

        They are relative to the sum of the norms of the terms, a bound of that of their sum.
        """
        if self._own(changes):  # each at its own frequency
            each = enumerate(self.system.frequency(abs(z.imag)) for z in roots.values)
            picked = [(roots.select(np.array([k])), {**changes, **at}) for k, at in each]
            return np.array([float(self.residuals(*one)[0]) for one in picked])
        p, size = self.system.values(changes), np.abs(roots.values)
        weights, bounds = [], np.zeros(len(size))
        for terms, norms, power in zip(self._terms, self._norms, (2, 1, 0), strict=True):
            for (term, _), bound in zip(terms, norms, strict=True):
                factor = term.factor.value(p)
                weights.append(factor * roots.values**power)
                bounds += abs(factor) * bound * size**power if factor else 0.0
        parts = self._sketch, np.array(weights), roots.right
        rest = np.einsum("trd,tm,dm->rm", *parts, optimize=True)
        return np.asarray(np.linalg.norm(rest, axis=0) / divisor(bounds))

    def modes(
        self, changes: Changes, values: ComplexArray | None = None, left: bool = False
    ) -> tuple[Roots, Array, int]:
        """The roots in the region, or of these `values`, with their `residuals`, without those that
        are none of the full problem; and how many these were. Left vectors if wanted."""
        if self._own(changes):
            found = settled(self, changes).roots if values is None else [(z, 1) for z in values]
            roots = vectors(self, changes, found)
        else:
            roots = self.roots(changes, left, values)
        errors = self.residuals(roots, changes)
        good = errors <= SPURIOUS
        return roots.select(good), errors[good], int(np.sum(~good))

    def values(self, changes: Changes) -> ComplexArray:
        """The values of these roots alone."""
        return self.modes(changes)[0].values


def reduce_system(scaled: ScaledSystem, region: Rectangle, values: Sequence[Changes]) -> Reduction:
    """A reduced system whose roots in a region meet `TOLERANCE` at all values of the parameters.

    Right and left modes of the full system at one of the `values` (changes of one to three
    parameters) start the basis, then those at the first and the last one; of the other values that
    where a root's residual in the full problem is worst adds its own, until all are below that (a
    backward error). Where the full problem was solved, what exceeds it by far is no root of it.
    `worst` exceeds the tolerance
    if 20 samples do not suffice. Of a region without a root the basis holds those around it.
    Raises ComputationError.
    """
    found, wide = Reduction(scaled, region), region.widened(0.04)
    samples: dict[int, bool] = {}  # by index of the value; whether its roots were counted
    where = len(values) // 2

    while True:
        named = ", ".join(f"{name} = {value:.6g}" for name, value in values[where].items())
        PROGRESS.get()(f"sample {len(samples) + 1} at {named or 'the parameters'}")
        counted = where in samples  # what the full problem has not stands in doubt
        found.sample(values[where], region if counted else wide, counted)
        samples[where] = counted
        around = wide
        while found.size == 0:  # what may enter the region at other values lies around it
            around = around.widened(1.0)
            if around.radius > scaled.at(values[where]).frequency_scale + abs(region.centre):
                if scaled.n > OPTIONS.columns:
                    raise ComputationError("no root lies in the region or around it")
                found.extend(np.eye(scaled.n, dtype=complex))
            else:
                found.sample(values[where], around)
        if waiting := [k for k in (0, len(values) - 1) if k not in samples]:
            where = waiting[0]
            continue
        errors = [found.residuals(found.roots(p), p) for p in values]
        spurious = {k: int(np.sum(errors[k] > SPURIOUS)) for k in samples}
        doubtful = [k for k, proved in samples.items() if spurious[k] and not proved]
        if doubtful:
            where = doubtful[0]
            continue
        genuine = [e[e <= SPURIOUS] if k in samples else e for k, e in enumerate(errors)]
        worst = [float(np.max(e, initial=0.0)) for e in genuine]
        left = [0.0 if k in samples else w for k, w in enumerate(worst)]
        where = int(np.argmax(left))
        if left[where] <= TOLERANCE or len(samples) == SAMPLES:
            break
    found.samples = tuple(values[k] for k in samples)
    found.worst, found.spurious = max(worst), sum(spurious.values())
    return found
