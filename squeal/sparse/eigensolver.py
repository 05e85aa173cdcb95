"""Roots of large sparse systems nearest shifts, all in a region with the count that proves it.

With lambda = shift + radius / theta the problem reads
theta^2 P(shift) x + theta radius P'(shift) x + radius^2 M x = 0: the roots nearest the shift
become the largest theta, of size one at the distance `radius`. The companion vectors [theta x; x]
are kept as U [G1; G2] with one orthonormal U (two-level orthogonal Arnoldi: Lu, Su and Bai 2016),
which halves memory and work; of real matrices at a real shift all of it is real. The subspace grows
until it reaches what is wanted; a restarted one (ARPACK) takes four times its time at 24,000 rows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.eigen import Eigenvalue
from squeal.sparse.argument_principle import Count, Disc, Rectangle, Region, confirmed
from squeal.sparse.dense import ROUNDING, multiplicity
from squeal.sparse.factor import Factor, Progress, factorise, factorise_at, quiet
from squeal.sparse.quadratic import Array, ComplexArray, Quadratic, Roots, listed

CONVERGED = 1e-13  # residual of a Ritz value relative to theta
ROUGH = 1e-4  # the same of a subspace in single precision
EVERY = 6  # steps between looks at the Ritz values
BLOCK = 3  # vectors of a step in single precision
MANY = 5_000  # rows from which there are so many
STEPS = 180  # of one subspace; what it does not reach is left to other shifts
BEYOND = 1.6  # reach wanted beyond the region, relative: the count then needs fewer determinants
MORE = 0.3  # of that for each further start
AROUND = 1.5  # the same of the lowest modes
NARROW = 1.02  # ... that suffices for a count
PIECES = 200  # shifts before a region is refused
TRIES = 3  # starts for a region whose count tells of missing roots
SAME = 1e-6  # relative distance of values that may be one root
SPANNED = 1e-3  # part of a unit vector outside the space of the others that makes it a new one
FASTEST = math.sqrt(ROUNDING)  # of the system's rate: how far from zero roots of free motions are
HELD = 10 * FASTEST  # of the system's rate: what is slower may be a rigid body


@dataclass(frozen=True, eq=False)
class Near:
    """Converged roots around a shift: all within `reach` of it, and some beyond."""

    shift: complex
    values: ComplexArray  # (m,) by distance
    vectors: ComplexArray = field(repr=False)  # (n, m) of unit length, or (n, 0)
    reach: float


class Krylov:
    """A growing subspace at one shift; ask for more steps until what is found suffices.

    In single precision large problems take small blocks of vectors: a factor solves for three right
    sides in little more than the time of one, but a wider subspace needs more vectors, and the more
    digits are wanted, the more so.
    """

    def __init__(
        self,
        problem: Quadratic,
        shift: complex,
        factor: Factor,
        radius: float,
        rng: np.random.Generator,
        transposed: bool = False,
        single: bool = False,
    ) -> None:
        self.problem = problem.transposed() if transposed else problem
        self.shift, self.radius = shift, radius
        self._factor, self._transposed = factor, transposed
        self._slope, self._mass = radius * self.problem.slope(shift), radius**2 * self.problem.M
        self._type = float if problem.real and shift.imag == 0.0 else complex
        self._kept: Any = self._type  # precision of the long vectors
        if single:
            self._kept = np.float32 if self._type is float else np.complex64
            self._slope = self._slope.astype(self._kept)
            self._mass = self._mass.astype(self._kept)
        self._converged = ROUGH if single else CONVERGED
        self._U = np.zeros((problem.n, 0), dtype=self._kept, order="F")
        self._G = np.zeros((2, 0, 0), dtype=self._type)
        self._H = np.zeros((0, 0), dtype=self._type)
        self._used = self._columns = 0  # of U and of G
        self.steps = 0  # columns to which the operator has been applied
        block = BLOCK if single and problem.n >= MANY else 1
        start = rng.standard_normal((problem.n, block))
        if self._type is complex:
            start = start + 1j * rng.standard_normal((problem.n, block))
        first = _split(self._U, factor.solve(self._mass @ start, transposed))[1]
        self._room(block)
        self._used = self._columns = first.shape[1]
        self._U[:, : self._used] = first
        self._G[0, : self._used, : self._used] = np.eye(self._used)

    def _room(self, columns: int) -> None:
        """Enlarge the arrays for so many columns and some more."""
        if self._U.shape[1] >= columns:
            return
        columns += 4 * EVERY
        grown = np.zeros((self.problem.n, columns), dtype=self._kept, order="F")
        grown[:, : self._used] = self._U[:, : self._used]
        G = np.zeros((2, columns, columns), dtype=self._type)
        H = np.zeros((columns, columns), dtype=self._type)
        k = self._G.shape[1]
        G[:, :k, :k] = self._G
        H[:k, :k] = self._H
        self._U, self._G, self._H = grown, G, H

    def advance(self, most: int) -> bool:
        """Extend the subspace by EVERY steps, to `most` in all; False if it cannot grow more."""
        goal = min(self.steps + EVERY, most)
        while self.steps < goal and self._open(most):
            self._step()
        return self._open(most)

    def _open(self, most: int) -> bool:
        return 0 < self._columns - self.steps <= most - self.steps

    def _step(self) -> None:
        now, k = slice(self.steps, self._columns), self._used
        self._room(2 * self._columns - self.steps)
        U, (G1, G2) = self._U[:, :k], self._G
        first, second = (U @ G[:k, now].astype(self._kept) for G in (G1, G2))
        right = self._slope @ first + self._mass @ second
        upper, new, lower = _split(U, -self._factor.solve(right, self._transposed))
        q = k + new.shape[1]
        self._U[:, k:q] = new
        bottom = np.zeros((q, lower.shape[1]), dtype=self._type)
        bottom[:k] = G1[:k, now]
        m = self._columns
        known = np.vstack([G1[:q, :m], G2[:q, :m]])
        upper, new, lower = _split(known, np.vstack([upper, lower, bottom]))
        last = m + new.shape[1]
        self._H[:m, now], self._H[m:last, now] = upper, lower
        G1[:q, m:last], G2[:q, m:last] = new[:q], new[q:]
        self.steps, self._used, self._columns = m, q, last

    def found(self, vectors: bool = True) -> Near:
        """What has converged so far; without `vectors` (n, 0) it is less work."""
        m, k = self.steps, self._used
        theta, Y = np.linalg.eig(self._H[:m, :m])
        size = np.abs(theta)
        with np.errstate(divide="ignore", invalid="ignore"):
            rest = np.linalg.norm(self._H[m : self._columns, :m] @ Y, axis=0)
            residual = rest / size
            distance = self.radius / size
        good = residual <= self._converged
        reach = float(np.min(distance[~good], initial=np.inf))
        order = np.argsort(distance[good])
        theta, Y = theta[good][order], Y[:, good][:, order]
        values = self.shift + self.radius / theta
        if not vectors:
            return Near(self.shift, values, np.zeros((len(self._U), 0), dtype=complex), reach)
        # theta x = U G1 y and x = U G2 y: the longer of the two has the smaller error
        small = self._G[0, :k, :m] @ Y / theta if len(theta) else self._G[0, :k, :m] @ Y
        large = self._G[1, :k, :m] @ Y
        inner = np.where(np.abs(theta) >= 1.0, small, large)
        shapes = self._U[:, :k] @ inner.astype(np.result_type(self._kept, np.complex64))
        if shapes.size:
            shapes = shapes / np.linalg.norm(shapes, axis=0)
        return Near(self.shift, values, shapes, reach)


def _split(U: NDArray, R: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """S, Q and T with R = U S + Q T: Q is orthonormal beside the orthonormal U, and has fewer
    columns than R where R brings less that is new."""
    from scipy.linalg import qr

    before = float(np.linalg.norm(R))
    S = np.zeros((U.shape[1], R.shape[1]), dtype=R.dtype)
    for _ in range(2):  # the second pass restores orthogonality to rounding
        part = (R.conj().T @ U).conj().T
        R = R - U @ part
        S += part
    Q, T, order = qr(R, mode="economic", pivoting=True, check_finite=False)
    wide = int(np.sum(np.abs(np.diag(T)) > 4 * np.finfo(R.dtype).eps * before))
    Q, T = Q[:, :wide], T[:wide, np.argsort(order)]
    if wide > 1:  # a column that was small has lost its orthogonality to U
        Q = Q - U @ (Q.conj().T @ U).conj().T
        Q = Q / np.linalg.norm(Q, axis=0)
    return S, Q, T


@dataclass(frozen=True, eq=False)
class Modes:
    """The roots in a region, by rising frequency, and what proves them complete."""

    eigenvalues: tuple[Eigenvalue, ...]
    region: Region
    count: Count | None  # None if it was not asked for
    shifts: tuple[complex, ...]
    known: ComplexArray = field(repr=False)  # all roots that were found, also outside

    @property
    def certified(self) -> bool:
        """True if the count finds exactly as many roots in the region as are listed."""
        return self.count is not None and self.count.inside == len(self.eigenvalues)

    @property
    def values(self) -> ComplexArray:
        """The eigenvalues (m,), rad/s."""
        return np.array([e.value for e in self.eigenvalues], dtype=complex)


class _Search:
    """Roots as they come in from one shift after the other."""

    def __init__(self, problem: Quadratic, left: bool, progress: Progress) -> None:
        none = np.zeros((problem.n, 0), dtype=complex)
        self.problem, self.left, self.progress = problem, left, progress
        self.roots = Roots(np.zeros(0, dtype=complex), none, none)
        self.shifts: list[complex] = []

    def around(
        self,
        shift: complex,
        radius: float,
        enough: Callable[[Near], bool],
        seed: int,
        wanted: Callable[[Near], NDArray[np.bool_]] = lambda near: (
            np.abs(near.values - near.shift) < near.reach
        ),
    ) -> Near:
        """Roots near a shift until they are `enough` or the subspace is full; left vectors of
        those that are `wanted`, others come without effort or not at all."""
        problem = self.problem
        self.progress(f"factorising {problem.n} rows at {shift:.6g}")
        shift, factor = factorise_at(problem, shift)
        rng = np.random.default_rng(seed)
        krylov = Krylov(problem, shift, factor, radius, rng)
        limit = min(STEPS, 2 * problem.n)
        while True:
            more = krylov.advance(limit)
            if not more or enough(krylov.found(vectors=False)):
                break
        near = krylov.found()
        left = np.full(near.vectors.shape, np.nan, dtype=complex)
        if self.left and np.any(wanted(near)):
            left = self._left(factor, near, wanted(near), krylov.steps, radius, rng)
        same = np.maximum(SAME * (abs(shift) + radius), place_of(problem, near.values))
        self.roots = merged(self.roots, Roots(near.values, near.vectors, left), same)
        self.shifts.append(shift)
        return near

    def _left(
        self,
        factor: Factor,
        near: Near,
        wanted: NDArray[np.bool_],
        steps: int,
        radius: float,
        rng: np.random.Generator,
    ) -> ComplexArray:
        """Left vectors of the wanted roots, y^H P = 0; NaN where none converged."""
        krylov = Krylov(self.problem, near.shift, factor, radius, rng, transposed=True)
        scale = abs(near.shift) + radius
        most = min(steps + 24, 2 * self.problem.n)
        while True:
            more = krylov.advance(most)
            if more and krylov.steps < steps * 2 // 3:
                continue
            which = _paired(near.values, krylov.found(vectors=False).values, 1e-6 * scale)
            if not more or np.all(which[wanted] >= 0):
                break
        result = np.full(near.vectors.shape, np.nan, dtype=complex)
        result[:, which >= 0] = krylov.found().vectors[:, which[which >= 0]].conj()
        return result

    def complete(self) -> Roots:
        """All roots found, of real matrices with their conjugates, exact ones where they are zero
        or real."""
        roots = self.roots
        if self.problem.real:
            roots = merged(roots, roots.mirrored(), place_of(self.problem, roots.values))
        return settled(self.problem, roots)


def _paired(values: ComplexArray, others: ComplexArray, most: float) -> NDArray[np.intp]:
    """The index of the nearest other value no further than `most`, each used once; -1 without."""
    result = np.full(len(values), -1)
    free = np.ones(len(others), dtype=bool)
    for j, value in enumerate(values):
        distance = np.where(free, np.abs(others - value), np.inf)
        k = int(np.argmin(distance)) if len(distance) else -1
        if k >= 0 and distance[k] <= most:
            result[j], free[k] = k, False
    return result


def modes_in(
    problem: Quadratic,
    region: Rectangle,
    left: bool = True,
    certify: bool = True,
    progress: Progress = quiet,
) -> Modes:
    """All roots in a rectangle, with left vectors if wanted, and the count that certifies them.

    The region is halved until one subspace each finds all roots around it. If the count tells of
    more roots than are listed, the search starts again from other vectors (a multiple root shows
    one vector for each start).

    Raises
    ------
    ComputationError
        If the region holds too many roots.
    """
    search = _Search(problem, left, progress)
    for attempt in range(TRIES):
        pieces = list(_cover(search, region, attempt))
        roots = search.complete()
        count = _counted(problem, region, pieces, roots, progress) if certify else None
        if count is None or count.inside is not None:
            break
    return _answer(search, roots, region, count)


def _cover(search: _Search, region: Rectangle, seed: int) -> Iterator[tuple[Rectangle, float]]:
    """Parts of a region, and how far around the middle of each all roots are known."""
    todo = [region]
    for _ in range(PIECES):
        if not todo:
            return
        piece = todo.pop()

        def enough(near: Near, radius: float = piece.radius) -> bool:
            return near.reach >= (BEYOND + MORE * seed) * radius

        near = search.around(piece.centre, piece.radius, enough, seed)
        if near.reach < NARROW * piece.radius:
            todo += piece.halves()
        else:
            yield piece, near.reach
    raise ComputationError(
        f"the region holds too many roots: {len(search.roots.values)} after {PIECES} shifts; a "
        "narrower band or region is required"
    )


def _counted(
    problem: Quadratic,
    region: Rectangle,
    pieces: list[tuple[Rectangle, float]],
    roots: Roots,
    progress: Progress,
) -> Count:
    """The number of roots in a region if counts around all its parts confirm the list."""
    evaluations = 0
    for piece, reach in pieces:
        count = confirmed(problem, piece, roots, reach, progress)
        evaluations += count.evaluations
        if count.inside is None:
            return Count(None, evaluations)
    return Count(int(np.sum(region.contains(roots.values))), evaluations)


def lowest_modes(
    problem: Quadratic,
    modes: int,
    left: bool = True,
    certify: bool = True,
    progress: Progress = quiet,
) -> Modes:
    """The `modes` roots of least |lambda| with Im lambda >= 0, and their conjugates.

    The roots of a rigid body are two. The disc that the count certifies ends halfway to the next
    root beyond, so that equal ones are in it together.
    """
    search = _Search(problem, left, progress)
    shift = complex(1e-4 * problem.rate)
    # a first look sets the scale, so that the discs end where roots do
    held = HELD * problem.rate  # roots of a rigid body tell no scale
    search.around(
        shift, abs(shift), lambda near: int(np.sum(np.abs(near.values) > held)) >= 4, 0, _none
    )
    sizes = np.abs(search.roots.values)
    scale = float(np.median(sizes[sizes > held])) if np.any(sizes > held) else abs(shift)
    shift = complex(0.3 * scale)
    for attempt in range(TRIES):
        near = search.around(
            shift, scale, lambda near: int(np.sum(_within(near))) > 2 * modes, attempt, _within
        )
        roots = search.complete()
        radius = _end(roots.values, modes, near.reach - abs(shift))
        region = Disc(radius)
        count = None
        if certify:
            count = confirmed(problem, region, roots, radius, progress)
        known = int(np.sum(region.contains(roots.values)))
        if count is None or count.inside is None or count.inside <= known:
            break
    return _answer(search, roots, region, count)


def _within(near: Near) -> NDArray[np.bool_]:
    """Roots in a disc around zero beyond which there is as much known ground as the count needs."""
    return np.abs(near.values) < (near.reach - abs(near.shift)) / AROUND


def _none(near: Near) -> NDArray[np.bool_]:
    return np.zeros(len(near.values), dtype=bool)


def _end(values: ComplexArray, modes: int, sure: float) -> float:
    """A radius between the last wanted root and the next one, within the sure distance."""
    upper = values[(np.abs(values) < sure) & (values.imag >= -SAME * np.abs(values))]
    sizes = np.sort(np.abs(upper))
    if not len(sizes):
        raise ComputationError("no root was found near zero; a band or region is required")
    last = sizes[min(modes, len(sizes)) - 1]
    beyond = sizes[sizes > last * (1 + SAME)]
    return float(last + (beyond[0] if len(beyond) else sure)) / 2


def _answer(search: _Search, roots: Roots, region: Region, count: Count | None) -> Modes:
    inside = roots.picked(region.contains(roots.values))
    if search.left:
        inside = _with_left(search.problem, inside)
    eigenvalues = listed(search.problem, inside)
    return Modes(
        eigenvalues,
        region,
        count,
        tuple(search.shifts),
        roots.values,
    )


def _with_left(problem: Quadratic, roots: Roots) -> Roots:
    """Left vectors by inverse iteration where none have come with the right ones."""
    left = roots.left.copy()
    rng = np.random.default_rng(0)
    for j in np.flatnonzero(np.isnan(left[:1].sum(axis=0))):
        _, factor = factorise_at(problem, complex(roots.values[j]) * (1 + 1e-12))
        y = rng.standard_normal(problem.n) + 0j
        for _ in range(2):
            y = factor.solve(y / np.linalg.norm(y), transposed=True)
        left[:, j] = y.conj() / np.linalg.norm(y)
    return Roots(roots.values, roots.right, left)


def span(x: ComplexArray) -> ComplexArray:
    """An orthonormal basis (n, k) of what vectors (n, m) span but for small parts."""
    basis, singular, _ = np.linalg.svd(x, full_matrices=False)
    return np.asarray(basis[:, singular > SPANNED * singular[0]])


def _outside(x: ComplexArray, basis: ComplexArray) -> float:
    """The part of a unit vector outside a space."""
    return float(np.linalg.norm(x - basis @ (basis.conj().T @ x)))


def merged(old: Roots, new: Roots, near: Array) -> Roots:
    """`old` and what `new` adds to it.

    Roots at one place are the same if the vector of one lies in the span of the others there; each
    old one answers for at most one new one, so a defective root keeps its multiplicity and a
    multiple one gains the vectors that another start brings. `near` (m,) in rad/s: how far from
    each new one is its place.
    """
    left = old.left.copy()
    free = np.ones(len(old.values), dtype=bool)
    fresh: list[int] = []
    for j, value in enumerate(new.values):
        distance = np.abs(old.values - value)
        there = np.flatnonzero(distance <= near[j])
        if len(there):
            basis = span(old.right[:, there])
            x = new.right[:, j]
            outside = _outside(x, basis)
            open_ones = there[free[there]]
            # of two new vectors of a double root, one old may be a mixture of both
            beside = [k for k in fresh if abs(new.values[k] - value) <= near[j]]
            wider = span(np.hstack([old.right[:, there], new.right[:, beside]]))
            if _outside(x, wider) <= SPANNED and len(open_ones):
                k = open_ones[np.argmin(distance[open_ones])]
                free[k] = False
                if np.isnan(left[0, k]):
                    left[:, k] = new.left[:, j]
                continue
            if outside <= SPANNED and len(basis.T) == len(there):
                continue  # a multiple root whose space is known already
        fresh.append(j)
    return replace(old, left=left).joined(new.picked(np.array(fresh, dtype=int)))


def slow_noise(problem: Quadratic, size: Array) -> Array:
    """How far rounding of K moves roots of a size (m,), rad/s: their squares alike."""
    return np.asarray(ROUNDING * problem.rate**2 / np.maximum(size, FASTEST * problem.rate))


def place_of(problem: Quadratic, values: ComplexArray) -> Array:
    """How far from each value (m,) the same root may be computed a second time, rad/s."""
    size = np.abs(values)
    return np.maximum(SAME * size, slow_noise(problem, size))


def settled(problem: Quadratic, roots: Roots) -> Roots:
    """Roots whose motion nothing holds are exactly zero, as often as they are roots.

    However many copies of them several shifts brought; of real matrices a root without a partner
    lies on the real axis.
    """
    size = np.abs(roots.values)
    slow = size <= 3 * FASTEST * problem.rate
    null, conull = _null_spaces(problem, roots.right[:, slow])
    if null.shape[1]:
        zeros = multiplicity(problem.M, problem.C, ROUNDING * problem.norms[2], null, conull)
        rest = roots.right - null @ (null.conj().T @ roots.right)
        slow &= np.linalg.norm(rest, axis=0) <= SPANNED
        if zeros < 2 * null.shape[1]:  # one root of a motion decays
            slow &= size <= FASTEST * problem.rate
        pick = np.arange(zeros) % null.shape[1]
        exact = Roots(np.zeros(zeros, dtype=complex), null[:, pick], conull[:, pick])
        roots = roots.picked(~slow).joined(exact)
    if not problem.real:
        return roots
    values = roots.values
    partner = np.abs(values[:, None] - values.conj()) <= place_of(problem, values)
    alone = partner.sum(axis=1) == np.diag(partner)
    return Roots(np.where(alone, values.real + 0j, values), roots.right, roots.left)


def _null_spaces(problem: Quadratic, x: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Orthonormal right and left null vectors (n, k) of K from vectors (n, m) that span them but
    for what C adds, by inverse iteration."""
    if not x.shape[1]:
        return x, x
    held = problem.K + (1e-7 * problem.rate) ** 2 * problem.M
    try:
        factor = factorise(held.tocsc())
    except ZeroDivisionError:
        return x[:, :0], x[:, :0]
    spaces = []
    for transposed, K in ((False, problem.K), (True, problem.K.T)):
        z = span(x.conj() if transposed else x)
        for _ in range(2):
            z = np.linalg.qr(factor.solve(z, transposed))[0]
        _, singular, right = np.linalg.svd(K @ z, full_matrices=False)
        z = z @ right.conj().T[:, singular <= ROUNDING * problem.norms[2]]
        spaces.append(z.conj() if transposed else z)
    null, conull = spaces
    if null.shape != conull.shape:
        return x[:, :0], x[:, :0]
    return null, conull
