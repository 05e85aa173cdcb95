"""Roots of large sparse systems: all in a region, or the lowest, with the count that proves it.

With lambda = shift + radius / theta the problem reads
theta^2 P(shift) x + theta radius P'(shift) x + radius^2 M x = 0: the roots nearest the shift
become the largest theta. A block Krylov subspace of the companion form, in single precision, shows
roughly all roots within some distance. In the space of their vectors the full problem has Ritz
pairs; P(shift)^-1, applied to the residuals of all of them at once, brings the directions that they
lack (residual inverse iteration, Neumaier 1985), until right and left vectors solve the full
problem to rounding. One basis gives multiple roots and rigid bodies as the dense problem does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.eigen import STIFF, Eigenvalue
from squeal.linear.matrices import EPS, divisor
from squeal.sparse.argument_principle import Disc, Rectangle, Region, count_roots, disc_around
from squeal.sparse.dense import dense_values, roots_at
from squeal.sparse.quadratic import (
    PROGRESS,
    Array,
    ComplexArray,
    Factor,
    Quadratic,
    Roots,
    combined,
    factorise_at,
    listed,
)


@dataclass(frozen=True)
class SolverOptions:
    """What a search for roots may cost, and when it is content."""

    steps: int = 180  # columns of a subspace; what it does not reach is left to other shifts
    block: int = 3  # vectors of a step: roots of that multiplicity converge at once
    rough: float = 1e-4  # residual of a Ritz value that has converged
    exact: float = 1e-12  # backward error of right vectors with which corrections end
    accepted: float = 2e-9  # ... of left vectors, and of right ones where they gain no more
    rounds: int = 12  # corrections
    beyond: float = 1.6  # reach around a region, relative: the count then needs few determinants
    pieces: int = 200  # parts that are tried before a region is refused
    attempts: int = 3  # starts for a region whose count shows missing roots
    dense: int = 2000  # rows up to which all roots are computed where few do not suffice
    counted: float = 0.125  # part of a region that is halved no more for the sake of its count
    smallest: float = 1e-3  # part of a region that is halved no more
    wider: float = 1.5  # by which a region around zero grows until it holds the lowest roots
    growths: int = 12  # ... and how often


OPTIONS = SolverOptions()


class Near(NamedTuple):
    """Roots around a shift, roughly: all within `reach` of it, and some beyond."""

    values: ComplexArray  # (m,) by distance
    vectors: ComplexArray  # (n, m) of unit length
    reach: float
    shift: complex
    factor: Factor  # of P(shift)


def near_roots(
    problem: Quadratic,
    shift: complex,
    radius: float,
    enough: Callable[[ComplexArray, float], bool],
    seed: int,
    single: bool,
    options: SolverOptions,
) -> Near:
    """Roots near a shift until (values, reach) are `enough` or no more can be had, in `single`
    precision if so."""
    PROGRESS.get()(f"factorising {problem.n} rows at {shift:.6g}")
    shift, factor = factorise_at(problem, shift, single)
    n, block, most = problem.n, options.block, min(options.steps, 2 * problem.n)
    real = problem.real and shift.imag == 0.0
    kind = np.dtype(("f" if single else "d") if real else ("F" if single else "D"))
    slope, mass = (radius * problem.slope(shift)).astype(kind), (radius**2 * problem.M).astype(kind)

    def applied(x: NDArray) -> NDArray:
        """The companion form on vectors [theta x; x] (2n, m)."""
        return np.vstack([factor.solve(-(slope @ x[:n] + mass @ x[n:])), x[:n]])

    Q = np.zeros((2 * n, most + block), kind, order="F")
    H = np.zeros((most + block, most + block), kind)
    start = np.random.default_rng(seed).standard_normal((2 * n, block)).astype(kind)
    first, _ = orthogonal(Q[:, :0], applied(start))
    done, size = 0, first.shape[1]  # columns to which the operator has been applied, and all
    Q[:, :size] = first

    def ritz() -> tuple[ComplexArray, ComplexArray, float]:
        """Converged theta, the largest first, their vectors, and the distance of the next one."""
        theta, Y = np.linalg.eig(H[:done, :done].astype(np.result_type(kind, float)))
        sizes = np.maximum(np.abs(theta), np.finfo(float).tiny)
        good = np.linalg.norm(H[done:size, :done] @ Y, axis=0) <= options.rough * sizes
        order = np.flatnonzero(good)[np.argsort(-sizes[good])]
        reach = float(np.min(radius / sizes[~good], initial=np.inf))
        return theta[order].astype(complex), Y[:, order], reach

    look = 2 * block
    while done < size <= most:
        new, column = orthogonal(Q[:, :size], applied(Q[:, done:size]))
        H[: len(column), done:size] = column
        done, size = size, size + new.shape[1]
        Q[:, done:size] = new
        if done >= look:  # an eigenproblem of its own: not after every block
            look = done + max(2 * block, done // 8)
            theta, Y, reach = ritz()
            if len(theta) and enough(shift + radius / theta, reach):
                break
    else:
        theta, Y, reach = ritz()
    Y = Y.astype(np.result_type(kind, np.complex64))
    # the longer of theta x and x has the smaller error
    shapes = np.where(np.abs(theta) >= 1.0, Q[:n, :done] @ Y, Q[n:, :done] @ Y)
    shapes /= np.linalg.norm(shapes, axis=0)
    return Near(shift + radius / theta, shapes, reach, shift, factor)


def orthogonal(basis: NDArray, x: NDArray) -> tuple[NDArray, NDArray]:
    """What columns x add to an orthonormal basis, orthonormal, and their coordinates in both."""
    from scipy.linalg import qr

    before, inside = float(np.linalg.norm(x)), np.zeros((basis.shape[1], x.shape[1]), x.dtype)
    for _ in range(2):  # the second pass restores orthogonality to rounding
        part = (x.conj().T @ basis).conj().T
        x, inside = x - basis @ part, inside + part
    new, T, order = qr(x, mode="economic", pivoting=True, check_finite=False)
    sizes = np.abs(np.diag(T))
    wide = int(np.sum(sizes > 4 * np.finfo(x.dtype).eps * before))
    new, T = new[:, :wide], T[:wide, np.argsort(order)]
    if np.any(sizes[:wide] < 1e-3 * before):  # one that was small has lost it
        new = new - basis @ (new.conj().T @ basis).conj().T
        new /= np.linalg.norm(new, axis=0)
    return new, np.vstack([inside, T])


@dataclass(frozen=True, eq=False)
class Modes:
    """The roots in a region, by rising frequency, and how many a count finds there."""

    eigenvalues: tuple[Eigenvalue, ...]
    region: Region
    count: int | None  # None where none was made or settled
    roots: Roots = field(repr=False)  # the same in scaled coordinates
    near: Near | None = field(default=None, repr=False)  # of one shift that showed all, no count
    seen: tuple[complex, ...] = field(default=(), repr=False)  # roughly, also outside the region

    @property
    def certified(self) -> bool:
        """True if the count finds exactly as many roots in the region as are listed."""
        return self.count == len(self.eigenvalues)

    @property
    def values(self) -> ComplexArray:
        """The eigenvalues (m,), rad/s."""
        return np.array([e.value for e in self.eigenvalues], dtype=complex)


def corrected(
    problem: Quadratic, factor: Factor, V: Array, region: Region, options: SolverOptions
) -> Roots | None:
    """The roots in a region from an orthonormal basis (n, d) that nearly holds their right vectors,
    and a factor of P near them; None if they do not come to be good."""
    if not V.size:
        return Roots(np.zeros(0, dtype=complex), V.astype(complex), V.astype(complex))
    other, before = problem.transposed(), np.inf
    matrices = problem.M, problem.C, problem.K
    M, C, K = (V.T @ (A @ V) for A in matrices)
    for _ in range(options.rounds):
        values = dense_values(M, C, K, problem.norms[2])
        values = values[region.contains(values)]
        ritz = roots_at(M, C, K, values, left=True, stiffness=problem.norms[2])
        x, y = combined(V, ritz.right), combined(V, ritz.left.conj())
        rests = problem.apply(ritz.values, x), other.apply(ritz.values, y)
        errors = np.linalg.norm(rests, axis=1) / divisor(problem.size(ritz.values))
        errors[1] *= options.exact / options.accepted  # they enter conditions and derivatives
        worst = float(np.max(errors, initial=0.0))
        if worst <= options.exact or (before / 2 < worst <= options.accepted):
            return Roots(ritz.values, x, y.conj())
        before = worst
        steps = []
        for rest, error, transposed in zip(rests, errors, (False, True), strict=True):
            far = error > options.exact
            if np.any(far):
                steps.append(factor.solve(rest[:, far], transposed))
        old, V = V, enlarged(V, np.hstack(steps), 1e-4)
        new = np.ascontiguousarray(V[:, old.shape[1] :])
        M, C, K = (grown(*pair, old, new) for pair in zip((M, C, K), matrices, strict=True))
    return None


def grown(part: Array, A: Any, old: Array, new: Array) -> Array:
    """V' A V of a basis that has grown by columns."""
    image = A @ new
    return np.block([[part, old.T @ image], [(A.T @ new).T @ old, new.T @ image]])


def enlarged(V: Array, columns: ComplexArray, dropped: float) -> Array:
    """An orthonormal basis (n, d) and what the real and imaginary parts of columns add to it, of
    unit vectors what exceeds `dropped`."""
    columns = columns / divisor(np.linalg.norm(columns, axis=0))
    rest = np.hstack([columns.real, columns.imag]).astype(float)
    for _ in range(2):
        rest -= V @ (V.T @ rest)
    axes, sizes, _ = np.linalg.svd(rest, full_matrices=False)
    new = axes[:, sizes > dropped]
    new -= V @ (V.T @ new)  # once more, since it may have been a small part
    return np.hstack([V, np.linalg.qr(new)[0]])


def modes_in(
    problem: Quadratic,
    region: Rectangle,
    certify: bool = True,
    start: Array | None = None,
    exact: float | None = None,
    options: SolverOptions = OPTIONS,
) -> Modes:
    """All roots in a rectangle with left vectors, and the count that certifies them.

    The region is divided until one subspace each finds all roots around it. If the count shows
    more roots than are listed, the search starts again in double precision from more vectors.
    Orthonormal vectors `start` (n, d) that nearly hold the modes save corrections, whose backward
    error is `exact`, if not that of the options. Raises ComputationError if the region holds too
    many roots, or some that rounding hides.
    """
    options = options if exact is None else replace(options, exact=exact)
    V = np.zeros((problem.n, 0)) if start is None else start
    none = np.zeros((problem.n, 0), dtype=complex)
    every, missing = Roots(np.zeros(0, dtype=complex), none, none), 0 if certify else None
    todo, inner, seen = [region], region.widened(-1e-9), list[complex]()
    for _ in range(options.pieces):
        part = todo.pop()
        answer = _around(problem, part, certify, V, options)
        if answer is None:
            if part.radius <= options.smallest * region.radius:
                raise ComputationError(
                    f"the roots around {part.centre:.6g} were not found: {STIFF}"
                )
            todo += _halves(part)
            continue
        roots, lacking, near = answer
        if certify and lacking is None and part.radius > options.counted * region.radius:
            todo += _halves(part)  # of a smaller part the count may be settled
            continue
        seen += near.values.tolist()
        # a root on the border of two parts might be in both of them, or in none
        edge = part.widened(1e-9).contains(roots.values) & inner.contains(roots.values)
        if np.any(edge & ~part.widened(-1e-9).contains(roots.values)):
            missing = None
        missing = None if missing is None or lacking is None else missing + lacking
        every = every.joined(roots.picked(part.contains(roots.values)))
        if not todo:
            count = None if missing is None else len(every.values) + missing
            one = None if certify or part != region else near
            return Modes(listed(problem, every), region, count, every, one, tuple(seen))
    raise ComputationError(
        f"the region holds too many roots: {len(every.values)} after {options.pieces} parts; a "
        "narrower band or region is required"
    )


def _halves(region: Rectangle) -> list[Rectangle]:
    """Two parts of a region, cut across its longer side beside the middle: a root may lie there."""
    corner, size = complex(region.low_real, region.low_imag), region.size
    if size.real > size.imag:
        cut = corner.real + 0.4837 * size.real
        return [replace(region, high_real=cut), replace(region, low_real=cut)]
    cut = corner.imag + 0.4837 * size.imag
    return [replace(region, high_imag=cut), replace(region, low_imag=cut)]


def _around(
    problem: Quadratic, region: Rectangle, certify: bool, V: Array, options: SolverOptions
) -> tuple[Roots, int | None, Near] | None:
    """The roots in and around a part with how many are missing among them (None if that is not
    known) and what showed them, or None where one subspace does not reach around the part or its
    roots do not come to be good."""
    # beside the middle: a root exactly there would hide all others from single precision
    shift = region.centre + (0.03 + 0.04j) * region.radius
    aside, best = abs(shift - region.centre), None
    wide = aside + options.beyond * region.radius
    for attempt in range(options.attempts):
        near = near_roots(
            problem,
            shift,
            region.radius,
            lambda _, reach: reach >= wide,
            attempt,
            not attempt,
            options,
        )
        reach = near.reach - aside
        if reach < 1.02 * region.radius:
            if attempt or reach > 0.3 * region.radius:
                return None
            continue  # single precision may be what hides them
        V = enlarged(V, near.vectors, 1e-6)
        around = disc_around(region, near.values, reach) if certify else region.widened(1e-6)
        roots = corrected(problem, near.factor, V, around, options)
        if roots is None:
            continue
        best = roots, _missing(problem, around, roots, near), near
        # those close to the border may lie on its other side
        inner = np.sum(region.widened(-0.01).contains(near.values))
        if best[1] == 0 or (not certify and inner <= len(roots.values)):
            break
    return best


def _missing(problem: Quadratic, region: Region, roots: Roots, near: Near) -> int | None:
    """How many more roots lie in a disc than these, with others around it that are known; None if
    that is not settled, and for a rectangle."""
    if not isinstance(region, Disc):
        return None
    outside = near.values[~region.contains(near.values)]
    if problem.real and region.centre.imag:  # the conjugates of all that are not among them
        every = np.concatenate([roots.values, outside])
        other = every.conj()[~region.contains(every.conj())]
        apart = np.abs(other[:, None] - every).min(axis=1, initial=np.inf)
        outside = np.append(outside, other[apart > 1e-3 * np.abs(other)])
    count = count_roots(problem, region, np.append(roots.values, outside), near.factor)
    return None if count is None else count - len(roots.values)


def lowest_modes(
    problem: Quadratic, modes: int, certify: bool = True, options: SolverOptions = OPTIONS
) -> Modes:
    """The `modes` roots of least |lambda| with Im lambda >= 0, and their conjugates.

    The roots of a rigid body are two. The disc that the count certifies ends halfway to the next
    root beyond, so that equal ones are in it together. Raises ComputationError.
    """
    # a first look sets the scale, so that the discs end where roots do
    held = 10 * np.sqrt(64 * EPS) * problem.rate  # what is slower may be a rigid body
    shift = 1e-4 * problem.rate

    def several(values: ComplexArray, _: float) -> bool:
        return int(np.sum(np.abs(values) > held)) >= 4

    look = near_roots(problem, complex(shift), shift, several, 0, False, options)
    sizes = np.abs(look.values)
    scale = float(np.median(sizes[sizes > held])) if np.any(sizes > held) else shift
    shift, V = 0.3 * scale, np.zeros((problem.n, 0))

    def within(values: ComplexArray, reach: float) -> bool:
        return bool(np.sum(np.abs(values) < (reach - shift) / 1.5) > 2 * modes)

    start = scale
    for attempt in range(options.attempts):
        near = near_roots(problem, complex(shift), scale, within, attempt, False, options)
        V = enlarged(V, near.vectors, 1e-6)
        # the disc ends between the last wanted root and the next one; both of a pair that may be
        # zero count
        sizes = np.abs(near.values)
        upper = (near.values.imag >= -options.rough * sizes) | (sizes <= held)
        sure, sizes = near.reach - shift, np.sort(sizes[upper])
        start = max(start, float(np.max(sizes[:modes], initial=0.0)))
        sizes = sizes[sizes < sure]
        if len(sizes) < min(modes, problem.n):
            break  # the subspace does not reach so far
        region = _lowest(sizes, modes, sure, options)
        roots = corrected(problem, near.factor, V, region, options)
        if roots is None:
            continue
        missing = _missing(problem, region, roots, near) if certify else None
        if missing is None or missing <= 0:
            count = None if missing is None else len(roots.values) + missing
            return Modes(listed(problem, roots), region, count, roots)
    if problem.n <= options.dense:
        return _of_all(problem, modes, certify, options)
    return _upwards(problem, modes, start, certify, options)


def _lowest(sizes: Array, modes: int, sure: float, options: SolverOptions) -> Disc:
    """The disc of the lowest modes, of sorted |lambda| (m,) up to `sure`: it ends halfway to the
    next root. Raises ComputationError if there is none."""
    if not len(sizes):
        raise ComputationError("no root was found near zero; a band or region is required")
    last = sizes[min(modes, len(sizes)) - 1]
    beyond = np.min(sizes[sizes > last * (1 + options.rough)], initial=sure)
    return Disc(float(last + beyond) / 2)


def _of_all(problem: Quadratic, modes: int, certify: bool, options: SolverOptions) -> Modes:
    """The lowest modes of few rows, of which all roots are computed."""
    M, C, K = (X.toarray() for X in (problem.M, problem.C, problem.K))
    every = dense_values(M, C, K)
    upper = every[every.imag >= 0.0] if problem.real else every
    sizes = np.sort(np.abs(upper))
    region = _lowest(sizes, modes, 2 * float(sizes[-1]), options)
    roots = roots_at(M, C, K, upper[region.contains(upper)], left=True)
    if problem.real:
        roots = roots.with_conjugates()
    count = count_roots(problem, region, every) if certify else None
    return Modes(listed(problem, roots), region, count, roots)


def _upwards(
    problem: Quadratic, modes: int, start: float, certify: bool, options: SolverOptions
) -> Modes:
    """The lowest modes from squares around zero, the first of half width about `start`, that grow
    until the disc in one of them holds so many; else those of the last one."""
    half = 1.02 * start
    for _ in range(options.growths):
        low = -1e-6 * half if problem.real else -half
        found = modes_in(problem, Rectangle(-half, half, low, half), certify, options=options)
        roots = found.roots
        if problem.real:
            roots = roots.picked(roots.values.imag >= 0.0)
        sizes = np.sort(np.abs(roots.values))
        sizes = sizes[sizes < half]
        if len(sizes) >= min(modes, problem.n):
            break
        half *= options.wider
    region = _lowest(sizes, modes, half, options)
    roots = roots.picked(region.contains(roots.values))
    if problem.real:
        roots = roots.with_conjugates()
    count = len(roots.values) if found.certified else None
    return Modes(listed(problem, roots), region, count, roots)
