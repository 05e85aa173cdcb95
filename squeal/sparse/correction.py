"""Modes to nearly full precision from rough ones, right and left, by blocks of corrections.

In the space of what is known of some modes the full problem has Ritz pairs; P(shift)^-1, applied
to the residuals of all of them at once, brings the directions that they lack (residual inverse
iteration, Neumaier 1985, as a subspace method). What a factor in single precision solves is good
enough for that, since the residuals are those of the full problem in double precision.
"""

import numpy as np

from squeal.sparse.dense import dense_roots
from squeal.sparse.factor import Factor, Progress, factorise_at, quiet
from squeal.sparse.krylov import Krylov
from squeal.sparse.merge import Roots
from squeal.sparse.quadratic import Array, ComplexArray, Quadratic, combined
from squeal.sparse.region import Rectangle

CORRECTED = 2e-9  # backward error of right and left modes, with which this ends
ROUNDS = 10
STEPS = 180  # of the subspace
BORDER = 0.01  # of a side of the region: roots this close to it may come to lie on its other side
BESIDE = 1e-4  # of a unit vector: part outside the known space that is followed
DROPPED = 1e-6  # the same of what begins it


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
    progress(f"factorising {problem.n} rows at {region.centre:.6g}")
    shift, factor = factorise_at(problem, region.centre, single=True)
    krylov = Krylov(problem, shift, factor, region.radius, np.random.default_rng(0), single=True)
    start = np.zeros((problem.n, 0)) if start is None else start
    limit = min(STEPS, 2 * problem.n - 1)
    more = True
    while more:
        more = krylov.advance(limit)
        if krylov.found(vectors=False).reach >= region.radius:
            break
    else:
        return None
    near = krylov.found()
    del krylov  # its memory
    if not len(near.values):
        return Roots(near.values, near.vectors, near.vectors)
    inner = region.widened(-BORDER)
    found = _corrected(problem, factor, enlarged(start, near.vectors, DROPPED), region)
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
