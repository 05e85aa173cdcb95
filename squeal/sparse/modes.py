"""All roots of a large sparse system in a region, with a count that proves none is missing."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.eigen import Eigenvalue
from squeal.numerics.threads import one_thread
from squeal.sparse.count import Count, count_roots
from squeal.sparse.factor import Factor, Progress, factorise_at, quiet
from squeal.sparse.krylov import Krylov, Near
from squeal.sparse.merge import SAME, Roots, merged
from squeal.sparse.quadratic import ComplexArray, Quadratic
from squeal.sparse.region import Disc, Discs, Rectangle, Region
from squeal.sparse.zeros import FASTEST, place_of, settled

STEPS = 180  # of one subspace; what it does not reach is left to other shifts
BEYOND = 1.2  # reach wanted beyond the region, relative: the count then needs fewer determinants
AROUND = 1.5  # the same of the lowest modes
PIECES = 200  # shifts before a region is refused
FAST = 10 * FASTEST  # of the system's rate: what is slower may be a rigid body
TRIES = 3  # starts for a region whose count tells of missing roots


@dataclass(frozen=True, eq=False)
class Modes:
    """The roots in a region, by rising frequency, and what proves them complete."""

    eigenvalues: tuple[Eigenvalue, ...]
    region: Rectangle | Disc
    count: Count | None  # None if it was not asked for
    shifts: tuple[complex, ...]
    known: ComplexArray = field(repr=False)  # all roots that were found, also outside
    discs: Discs = field(repr=False)

    @property
    def certified(self) -> bool:
        """True if the count finds exactly as many roots in the region as are listed."""
        return self.count is not None and self.count.inside == len(self.eigenvalues)

    @property
    def values(self) -> ComplexArray:
        """The eigenvalues (m,), rad/s."""
        return np.array([e.value for e in self.eigenvalues], dtype=complex)


class _Search:
    """Roots and discs as they come in from one shift after the other."""

    def __init__(self, problem: Quadratic, left: bool, progress: Progress) -> None:
        none = np.zeros((problem.n, 0), dtype=complex)
        self.problem, self.left, self.progress = problem, left, progress
        self.roots = Roots(np.zeros(0, dtype=complex), none, none)
        self.discs: list[tuple[complex, float]] = []
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
        limit = min(STEPS, 2 * problem.n - 1)
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
        self.discs.append((shift, near.reach))
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
        most = min(steps + 24, 2 * self.problem.n - 1)
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

    def covered(self) -> Discs:
        discs = Discs(tuple(self.discs))
        return discs.mirrored() if self.problem.real else discs


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
    whole: Rectangle | None = None,
) -> Modes:
    """All roots in a rectangle, with left vectors if wanted, and the count that certifies them.

    Shifts are set until discs of converged roots cover the region. If the count tells of more
    roots than are listed, the search starts again from other vectors (a multiple root shows one
    vector for each start). Of a `whole` larger region the list and the count are; beyond the
    smaller one it is searched only if the count tells of roots there or is in doubt. Raises
    ComputationError if the region holds too many roots.
    """
    search = _Search(problem, left, progress)
    whole = whole or region
    with one_thread():
        for attempt in range(TRIES):
            _cover(search, whole if attempt else region, attempt)
            roots = search.complete()
            count = None
            if certify:
                count = count_roots(problem, whole, roots, search.covered(), progress)
            known = int(np.sum(whole.contains(roots.values)))
            if count is None or (count.inside is None and (attempt or whole == region)):
                break
            if count.inside is not None and count.inside <= known:
                break
    return _answer(search, roots, whole, count)


def _cover(search: _Search, region: Rectangle, seed: int) -> None:
    todo = [region]
    for _ in range(PIECES):
        if not todo:
            return
        piece = todo.pop()

        def enough(near: Near, piece: Rectangle = piece) -> bool:
            return near.reach >= BEYOND * piece.radius

        near = search.around(piece.centre, piece.radius, enough, seed)
        if near.reach < piece.radius:
            todo += piece.without_middle(near.reach)
    raise ComputationError(
        f"the region holds too many roots: {len(search.roots.values)} after {PIECES} shifts; a "
        "narrower band or region is required"
    )


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
    with one_thread():
        # a first look sets the scale, so that the discs end where roots do
        held = FAST * problem.rate  # roots of a rigid body tell no scale
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
                count = count_roots(problem, region, roots, search.covered(), progress)
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
        region,  # type: ignore[arg-type]
        count,
        tuple(search.shifts),
        roots.values,
        search.covered(),
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


def listed(problem: Quadratic, roots: Roots) -> tuple[Eigenvalue, ...]:
    """Roots with their backward errors and conditions, by rising frequency."""
    values, right, left = roots.values, roots.right, roots.left
    residuals = problem.backward_errors(values, right)
    image = problem.M @ (right * (2 * values)) + problem.C @ right
    across = np.abs(values) * np.abs(np.sum(left.conj() * image, axis=0))
    lengths = np.linalg.norm(right, axis=0) * np.linalg.norm(left, axis=0)
    condition = np.full(len(values), np.inf)
    np.divide(problem.size(values) * lengths, across, out=condition, where=across != 0)
    x, y = _physical(problem, right), _physical(problem, left)
    found = [
        Eigenvalue(complex(v), x[:, j], y[:, j], float(residuals[j]), float(condition[j]))
        for j, v in enumerate(values)
    ]
    return tuple(sorted(found, key=lambda e: (abs(e.value.imag), -e.value.real, -e.value.imag)))


def _physical(problem: Quadratic, z: ComplexArray) -> ComplexArray:
    """Columns (n, m) in the caller's coordinates: x^H M x = 1 if there is mass, largest part
    positive; NaN where a vector is unknown."""
    mass = np.abs(np.sum(z.conj() * (problem.M @ z), axis=0))
    size = np.where(mass == 0, np.linalg.norm(z, axis=0), np.sqrt(mass))
    largest = z[np.argmax(np.abs(z), axis=0), np.arange(z.shape[1])]
    with np.errstate(invalid="ignore"):
        vectors = problem.scale[:, None] * z * (np.abs(largest) / largest / size)
    vectors.setflags(write=False)
    return np.asarray(vectors)
