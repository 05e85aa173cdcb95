"""How many roots lie in a region: the argument principle on factorised determinants.

det P winds once around zero for each root inside. Divided by the factors of the roots that are
known, what is left has no roots inside if none is missing, and no fast changes along the outline.
At each node two independent things are computed: the phase of the determinant from the pivots of a
factorisation, exact but for whole turns, and its rate tr(P^-1 dP/dlambda), estimated with random
vectors (Hutchinson, on the complement of the nearest known modes). A step is accepted if the rates
at its ends and the phases agree within a quarter turn and the rate changes little enough for its
mean to be trusted, and halved otherwise. A number that agrees with the list is confirmed by it;
another one is taken again with finer steps and stricter bounds until two agree. Only logarithms of
pivots are used, so nothing can overflow.

Around a disc at zero of real matrices no rate is needed: where what is left has no root inside, its
phase is the harmonic conjugate of the logarithm of its size, which the pivots give as well.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from squeal.sparse.factor import Progress, factorise_at, quiet
from squeal.sparse.merge import Roots
from squeal.sparse.quadratic import ComplexArray, Quadratic
from squeal.sparse.region import Disc, Discs, Region, paced

QUARTER = math.pi / 2
FINEST = 12  # halvings of a step before the count is given up
NEAREST = 24  # known modes whose share of the trace is exact
PROBES = 16  # random vectors for the rest
BEND = 0.3  # of a step's change of rate: how far the mean of its two rates may be off
CLEAR = 0.3  # rad beyond the foreseen errors by which phases may differ from rates
SURE = 1.5  # standard errors of the foreseen phase below a quarter turn: a step that is wrong by a
# turn would need 4.5 of them
LOOKS = 4  # at an outline, each with half the steps, until two counts agree
ARCS = (4, 8, 16)  # of half a circle
AGREES = 0.75  # rad: what half the nodes may foresee otherwise; the error of all is its square


@dataclass(frozen=True)
class Count:
    """Roots inside a region, None if their number could not be settled."""

    inside: int | None
    evaluations: int  # factorisations


@dataclass(frozen=True)
class _Node:
    place: complex
    phase: float  # of det P without the known roots, rad, up to whole turns
    rate: complex  # d/dlambda log of the same
    error: float  # standard error of the rate


class _Outline:
    """The phase along a region's outline, each node computed once."""

    def __init__(
        self, problem: Quadratic, region: Region, known: Roots, progress: Progress
    ) -> None:
        self.problem, self.region, self.known = problem, region, known
        self.progress = progress
        self.strict = False  # a rate may differ midway and be the same at both ends
        # one set for all nodes: what it misjudges, it misjudges alike, and that cancels around
        rng = np.random.default_rng(20)
        self.probes = rng.choice([-1.0, 1.0], size=(problem.n, PROBES)).astype(complex)
        self.nodes: dict[float, _Node] = {}

    def node(self, t: float) -> _Node:
        if t not in self.nodes:
            self.nodes[t] = self._computed(self.region.point(t))
            self.progress(f"counting the roots: determinant {len(self.nodes)}")
        return self.nodes[t]

    def _computed(self, value: complex) -> _Node:
        place, factor = factorise_at(self.problem, value)
        away = place - self.known.values
        phase = factor.logarithm().imag - float(np.sum(np.angle(away)))
        nearest = np.argsort(np.abs(away))[:NEAREST]
        basis: ComplexArray = np.linalg.qr(self.known.right[:, nearest])[0]
        probes = self.probes - basis @ (basis.conj().T @ self.probes)
        both = np.hstack([basis, probes])
        image = factor.solve(self.problem.slope(place) @ both)
        diagonal = np.sum(both.conj() * image, axis=0)
        k = basis.shape[1]
        rate = np.sum(diagonal[:k]) + np.mean(diagonal[k:]) - np.sum(1.0 / away)
        error = float(np.std(diagonal[k:]) / math.sqrt(PROBES))
        return _Node(place, phase, complex(rate), error)

    def steps(self, a: float, b: float, depth: int = FINEST) -> list[float] | None:
        """Changes of the phase from a to b, or None."""
        first, last = self.node(a), self.node(b)
        way = last.place - first.place
        foreseen = float(((first.rate + last.rate) / 2 * way).imag)
        off = math.remainder(last.phase - first.phase - foreseen, 2 * math.pi)
        unsure = SURE * max(first.error, last.error) * abs(way)
        bend = (last.rate - first.rate) * way
        bent = BEND * (abs(bend) if self.strict else abs(bend.imag))
        most = CLEAR + unsure + bent if self.strict else QUARTER
        if max(unsure, bent) < QUARTER and abs(off) < min(QUARTER, most):
            return [foreseen + off]
        if depth == 0:
            return None
        middle = (a + b) / 2
        left = self.steps(a, middle, depth - 1)
        right = None if left is None else self.steps(middle, b, depth - 1)
        return None if left is None or right is None else left + right

    def along(self, nodes: list[float]) -> list[float] | None:
        """The same from each node to the next, or None."""
        changes: list[float] = []
        for a, b in itertools.pairwise(nodes):
            found = self.steps(a, b)
            if found is None:
                return None
            changes += found
        return changes


def count_roots(
    problem: Quadratic,
    region: Region,
    known: Roots,
    discs: Discs,
    progress: Progress = quiet,
) -> Count:
    """The number of roots of P inside a region, multiple ones counted as often.

    `known` are roots in and around it (of real matrices with their conjugates), `discs` where
    others would be known: they save work and do not enter the number. A root on the outline itself
    makes the number depend on rounding. Raises ComputationError.
    """
    half = problem.real and isinstance(region, Disc)  # the lower half mirrors the upper one
    if half:
        settled = _conjugate(problem, region, known, progress)
        if settled is not None:
            return settled
    outline = _Outline(problem, region, known, progress)
    sides = region.sides // 2 if half else region.sides
    most = max(abs(region.point(k + 1.0) - region.point(k)) for k in range(region.sides))
    nodes = paced(region, sides, discs, most)
    if not half:
        outline.nodes[nodes[-1]] = outline.node(nodes[0])  # the outline is closed
    listed = int(np.sum(region.contains(known.values)))
    counts: list[int] = []
    for _ in range(LOOKS):
        changes = outline.along(nodes)
        evaluations = len(outline.nodes) - (not half)
        if changes is None:
            return Count(None, evaluations)
        winding = sum(changes) / (math.pi if half else 2 * math.pi)
        counts.append(round(winding) + listed)
        # what agrees with the list is confirmed by it; anything else by two
        # strict looks at steps of half the length
        if counts[-1] == listed or (counts[-1] >= 0 and counts[-1:] == counts[1:][-2:-1]):
            return Count(counts[-1], evaluations)
        outline.strict = True
        nodes = sorted({*nodes, *((a + b) / 2 for a, b in itertools.pairwise(nodes))})
    return Count(None, evaluations)


def _conjugate(
    problem: Quadratic, region: Region, known: Roots, progress: Progress
) -> Count | None:
    """The number of roots in a disc around zero of real matrices, None if it is left in doubt.

    On half the circle the logarithm of the determinant without the known roots has the real part
    sum c_k cos k t; where it is analytic inside, its imaginary part is sum c_k sin k t. Sizes at
    the nodes give c, and each phase is known to lie near that, or another root is inside. Accepted
    if half the nodes foresee nearly the same.
    """
    logs: dict[float, complex] = {}
    before: NDArray[np.float64] | None = None
    for pieces in ARCS:
        t = np.arange(pieces + 1) / pieces
        for x in map(float, t):
            if x not in logs:
                place, factor = factorise_at(problem, region.point(region.sides / 2 * x))
                logs[x] = factor.logarithm() - np.sum(np.log(place - known.values))
                progress(f"counting the roots: determinant {len(logs)}")
        found = np.array([logs[x] for x in map(float, t)])
        foreseen = _sines(found.real)
        if before is not None and np.max(np.abs(foreseen[::2] - before)) < AGREES:
            way = np.diff(foreseen)
            off = np.diff(found.imag) - way
            off -= 2 * math.pi * np.round(off / (2 * math.pi))
            if np.max(np.abs(off)) < QUARTER:
                inside = round(float(np.sum(way + off)) / math.pi)
                inside += int(np.sum(region.contains(known.values)))
                return Count(inside, len(logs))
        before = foreseen
    return None


def _sines(even: NDArray[np.float64]) -> NDArray[np.float64]:
    """sum c_k sin k t at equal steps from 0 to pi of an even function sum c_k cos k t."""
    n = len(even) - 1
    k = np.arange(1, n)
    weights = np.full(n + 1, 2.0 / n)
    weights[[0, -1]] /= 2
    t = np.pi * np.arange(n + 1) / n
    return np.asarray(np.sin(np.outer(t, k)) @ (np.cos(np.outer(k, t)) @ (weights * even)))
