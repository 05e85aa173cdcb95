"""Crossings of the imaginary axis along a parameter: found on a reduced system, proved on the full.

At values of the parameter the reduced system gives roots and their derivatives, which are followed;
windows that open and close between two values are foreseen from how the roots are coupled. Newton's
method on the full system has the last word: bordered by the vectors of a mode, P(lambda, p) stays
regular where it is singular. In [[P, b], [c^H, 0]] [x; g] = [0; 1] the number g vanishes exactly at
the roots, with dg = -y^H dP x; g(i omega, p) = 0 is a complex equation for two real unknowns. Next
to a crossing one factorisation serves several steps: what it solves is refined until the residual
is rounding.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.continuation import Continuation, hermite_cubic, near_coalescences, zeros_between
from squeal.linear.continuation import State as LineState
from squeal.linear.events import located, windows
from squeal.linear.matrices import EPS
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.factor import Factor, factorise
from squeal.sparse.quadratic import ComplexArray, Quadratic, ScaledSystem, combined
from squeal.sparse.reduction import Reduction

DEPTH = 36  # halvings of a step
STATES = 600  # values at which roots are computed; beyond, no step is halved
DOUBT = 0.25  # of the change: error of the prediction from both ends that is accepted
SMALL = 1e-4  # of |lambda|: ... or this
ROOT_ROUNDING = 1e-11  # of a root
ZERO = 1e-10  # of |lambda|: real part that may be rounding; of |C| the same
INNER = 5  # steps on the reduced system; the full one goes on from there
NOISE = 0.05
REAL = 1e-6  # of the region's highest imaginary part
SAME = 1e-7  # relative: crossings closer than this are one
STEPS = 20
CONVERGED = 1e-12  # step relative to p and omega; Newton's error is its square
NEAR = 1e-3  # of p and omega: a step after which the factorisation serves once more, refined
REFINEMENTS = 8
REFINED = 4 * EPS  # residual of a refined solution, of the sizes of what it is the difference of
ROUNDING = 2 * EPS  # of the entries of the matrices and of a solution, for the interval


@dataclass(frozen=True, eq=False)
class State:
    """Roots (m,) of the reduced system at one value of the parameter, with their derivatives.

    `coupling` (m, m) is the derivative of the first-order form in its eigenvectors.
    """

    value: float
    roots: ComplexArray
    coupling: ComplexArray = field(repr=False)
    right: ComplexArray = field(repr=False)
    left: ComplexArray = field(repr=False)

    @property
    def slopes(self) -> ComplexArray:
        """Derivatives of the roots."""
        return np.asarray(self.coupling.diagonal())


def _zeros(before: State, after: State, i: int, j: int) -> Iterator[tuple[float, complex]]:
    """Where the cubic through the real parts of one root, and their derivatives, vanishes between
    two values, i and j being its index at both; and the root there."""
    h = after.value - before.value
    a, b = before.roots[i], after.roots[j]
    cubic = hermite_cubic(a.real, h * before.slopes[i].real, b.real, h * after.slopes[j].real)
    for t in zeros_between(cubic):
        yield before.value + t * h, complex(a + t * (b - a))


class Along:
    """A reduced system along one parameter."""

    def __init__(self, reduction: Reduction, region: Rectangle, name: str) -> None:
        if not region.low_real < 0.0 < region.high_real or region.high_imag <= 0.0:
            raise InputError(
                f"region {region.low_real:g}:{region.high_real:g}:{region.low_imag:g}:"
                f"{region.high_imag:g}: must hold a part of the upper imaginary axis"
            )
        self.reduction, self.name = reduction, name
        # a root of real matrices is real below this; complex ones mean what is above the axis
        self.real = REAL * region.high_imag if reduction.system.real else 0.0
        low = max(region.low_imag, -self.real)
        self.region = Rectangle(region.low_real, region.high_real, low, region.high_imag)
        self._states: dict[float, State] = {}

    def at(self, value: float) -> State:
        """The roots at a value of the parameter, of pairs the upper ones."""
        if value not in self._states:
            at = {self.name: value}
            M, C, _ = self.reduction.system.at(at)
            C = np.zeros_like(M) if C is None else C
            found = self.reduction.roots(self.region, at, left=True)
            moved = [
                np.zeros_like(M) if d is None else d
                for d in self.reduction.system.derivative(self.name, at)
            ]
            z, X, Y = found.values, found.right, found.left.conj().T
            change = moved[0] @ X * z**2 + moved[1] @ X * z + moved[2] @ X
            inertia = np.sum(Y.T * (2 * z * (M @ X) + C @ X), axis=0)
            # a double root at zero leaves it as a square root, if at all
            single = (z != 0) | (np.abs(inertia) > ZERO * np.linalg.norm(C))
            coupling = -(Y @ change) / np.where(single, inertia, np.inf)[:, None]
            self._states[value] = State(value, z, coupling, X, found.left)
        return self._states[value]

    def crossings(self, a: float, b: float, depth: int = DEPTH) -> Iterator[tuple[State, int]]:
        """States on the axis from a to b with the index of the root that is there; the step is
        halved where a match or a change of sign is in doubt."""
        before, after = self.at(a), self.at(b)
        pairs = self._matched(before, after)
        found = None if pairs is None else self._located(before, after, pairs)
        if found is None and depth > 0 and len(self._states) < STATES:
            middle = (a + b) / 2
            yield from self.crossings(a, middle, depth - 1)
            yield from self.crossings(middle, b, depth - 1)
        elif found is None:  # as near as values of the parameter are told apart
            for i, j in self._nearest(before, after):
                if _changes_sign(before.roots[i], after.roots[j]):
                    first = abs(before.roots[i].real) < abs(after.roots[j].real)
                    yield (before, i) if first else (after, j)
        else:
            yield from found

    def _located(
        self, before: State, after: State, pairs: Sequence[tuple[int, int]]
    ) -> list[tuple[State, int]] | None:
        """The zeros of the real parts of matched roots, None if a change of sign shows none."""
        result = []
        for i, j in pairs:
            ends = before.value, after.value
            zeros = [
                z
                for value, root in _zeros(before, after, i, j)
                if (z := self.refined(value, root, *ends))
            ]
            if not zeros and _changes_sign(before.roots[i], after.roots[j]):
                return None
            result += zeros
        return result

    def _costs(self, before: State, after: State) -> np.ndarray:
        h = after.value - before.value
        mean = h / 2 * (before.slopes[:, None] + after.slopes[None, :])
        return np.asarray(np.abs(after.roots[None, :] - before.roots[:, None] - mean))

    def _nearest(self, before: State, after: State) -> list[tuple[int, int]]:
        from scipy.optimize import linear_sum_assignment

        rows, columns = linear_sum_assignment(self._costs(before, after))
        return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True)]

    def _matched(self, before: State, after: State) -> list[tuple[int, int]] | None:
        """Pairs of indices, None if one is in doubt or comes from nowhere."""
        pairs = self._nearest(before, after)
        costs = self._costs(before, after)
        for i, j in pairs:
            way = abs(after.roots[j] - before.roots[i])
            if costs[i, j] > max(DOUBT * way, SMALL * abs(before.roots[i])):
                return None
        h = after.value - before.value
        lost = set(range(len(before.roots))) - {i for i, _ in pairs}
        new = set(range(len(after.roots))) - {j for _, j in pairs}
        gone = [(before.roots[i], h * before.slopes[i]) for i in lost]
        gone += [(after.roots[j], -h * after.slopes[j]) for j in new]
        # one that leaves the region may cross the axis before
        if any(self.region.contains(z + way) or _changes_sign(z, z + 2 * way) for z, way in gone):
            return None
        return pairs

    def windows(self) -> list[tuple[State, int]]:
        """The same for two roots that pass each other between the states so far.

        Of a real system with regular M.
        """
        states = [self._states[value] for value in sorted(self._states)]
        system = replace(self.reduction.system, parameter=self.name)
        found = []
        with suppress(InputError):  # complex matrices, M singular
            line = Continuation(system, states[0].value, states[-1].value)
            for a, b in itertools.pairwise(_on(line, state) for state in states):
                for guess in windows(line, near_coalescences(a, b), b.value - a.value):
                    one = located(line, guess)
                    state = None if one is None else self.at(one.value)
                    if one is not None and state is not None and len(state.roots):
                        k = int(np.argmin(np.abs(state.roots - 1j * one.omega)))
                        found.append((state, k))
        return found

    def refined(
        self, value: float, root: complex, low: float, high: float
    ) -> tuple[State, int] | None:
        """The zero of the reduced system's real part next to a guess between two values: the last
        state and the root; None if there is none."""
        width = high - low
        for _ in range(INNER):
            state = self.at(value)
            if not len(state.roots):
                return None
            k = int(np.argmin(np.abs(state.roots - root)))
            slope = state.slopes[k]
            move = -state.roots[k].real / slope.real if slope.real else np.inf
            near = abs(move) <= NOISE * width  # rounding may move a weak crossing this far
            move = float(np.clip(move, -width / 2, width / 2))
            value, root = value + move, state.roots[k] + move * slope
            if not low - width / 4 <= value <= high + width / 4:
                return None
        return (state, k) if near else None


def _on(line: Continuation, state: State) -> LineState:
    """A state in the line's units; pairs are iterated on from any vectors."""
    z, rng = state.roots / line.rate, np.random.default_rng(0)
    right, left = rng.normal(size=(2, 2 * line.n, len(z))).astype(complex)
    coupling = state.coupling / line.rate
    noise = ROOT_ROUNDING * np.abs(z)
    return LineState(state.value, z, right, left, coupling, noise, line.form)


@dataclass(frozen=True)
class Found:
    """Crossings of the full system, sorted, and guesses that it did not confirm."""

    crossings: tuple[AxisCrossing, ...]
    unconfirmed: tuple[str, ...]


def crossings_along(
    reduction: Reduction, region: Rectangle, name: str, values: Sequence[float]
) -> Found:
    """All crossings of the imaginary axis inside a region between the first and last value.

    The reduced system must be good at the values (rising), which set the first steps. Each
    crossing is located on the full system; what it does not confirm is named. Raises InputError
    for a region without the axis.
    """
    along = Along(reduction, region, name)
    scaled, basis = reduction.basis.scaled, reduction.basis.vectors
    crossings: list[AxisCrossing] = []
    unconfirmed: list[str] = []
    on_axis = [x for a, b in itertools.pairwise(values) for x in along.crossings(a, b)]
    for state, k in [*on_axis, *along.windows()]:
        omega = abs(state.roots[k].imag)
        real = omega <= along.real
        pair = np.stack([state.right[:, k], state.left[:, k]], axis=1)
        right, left = combined(basis, pair).T
        try:
            found = axis_crossing(scaled, name, state.value, 0.0 if real else omega, right, left)
        except ComputationError as error:
            unconfirmed.append(str(error))
            continue
        if not any(_same(found, other) for other in crossings):
            crossings.append(found)
    placed = [_in_range(c, values[0], values[-1]) for c in crossings]
    inside = sorted(filter(None, placed), key=lambda c: (c.value, -abs(c.slope)))
    return Found(tuple(inside), tuple(unconfirmed))


def _in_range(one: AxisCrossing, low: float, high: float) -> AxisCrossing | None:
    """A crossing, at an end of the range exactly if rounding leaves that; None for one outside it
    and for what does not grow at the start and begins to decay."""
    first, last = one.interval
    if first <= low <= last:
        return replace(one, value=low, interval=(low, last)) if one.direction == "up" else None
    if first <= high <= last:
        return replace(one, value=high)
    return one if low <= one.value <= high else None


def _changes_sign(one: complex, other: complex) -> bool:
    """True if the real parts differ in sign by more than rounding."""
    return one.real * other.real < 0 and all(abs(z.real) > ZERO * abs(z) for z in (one, other))


def _same(one: AxisCrossing, other: AxisCrossing) -> bool:
    return bool(
        abs(one.value - other.value) <= SAME * max(abs(one.value), abs(other.value))
        and abs(one.omega - other.omega) <= SAME * max(one.omega, other.omega)
        and abs(np.vdot(one.vector, other.vector)) > 0.5
    )


@dataclass(frozen=True, eq=False)
class AxisCrossing:
    """A pair or a real root of the full system on the imaginary axis.

    `interval` holds the parameter's value with rounding taken into account, `residual` is the
    backward error there, `slope` is d Re lambda / dp (1/s per unit of p).
    """

    value: float
    omega: float  # rad/s, 0 for a real root
    direction: str  # up: growth begins with rising p; down: it ends
    slope: float
    interval: tuple[float, float]
    residual: float
    vector: ComplexArray = field(repr=False)  # (n,) in the scaled coordinates, of unit length

    @property
    def kind(self) -> str:
        """flutter for a pair, divergence for a real root."""
        return "flutter" if self.omega else "divergence"

    @property
    def frequency_hz(self) -> float:
        """omega / (2 pi)."""
        return self.omega / (2 * math.pi)


class _Bordered:
    """P(lambda) with its border; g and the vectors that its derivatives need.

    `other` lends its border and factorisation if what they solve can be refined.
    """

    def __init__(
        self,
        problem: Quadratic,
        value: complex,
        b: ComplexArray,
        c: ComplexArray,
        other: _Bordered | None = None,
    ):
        self.problem, self.value, n = problem, value, problem.n
        self.size = sum(s * abs(value) ** k for s, k in zip(problem.norms, (2, 1, 0), strict=True))
        scale = 2.0 ** round(math.log2(self.size)) if other is None else other.scale
        self.scale: float = scale
        whole = _with_border(problem.at(value), scale * b, scale * c.conj())
        end = np.zeros(n + 1, dtype=complex)
        end[n] = scale
        right: ComplexArray | None = None
        left: ComplexArray | None = None
        if other is not None:
            self.factor: Factor = other.factor
            right, left = (_refined(self.factor, whole, end, t) for t in (False, True))
        if right is None or left is None:
            self.factor = factorise(whole)
            right, left = (self.factor.solve(end, t) for t in (False, True))
        self.x, self.g, self.w = right[:n], right[n] * scale, left[:n]
        self.noise = ROUNDING * self.size * float(np.linalg.norm(self.x) * np.linalg.norm(self.w))

    def slope(self, matrix: Any) -> complex:
        """dg for a change `matrix` of P."""
        return complex(-(self.w @ (matrix @ self.x)))


def _with_border(P: Any, column: ComplexArray, row: ComplexArray) -> Any:
    """[[P, column], [row, 0]] of a CSC array P (n, n)."""
    from scipy.sparse import csc_array

    n, counts = P.shape[0], np.diff(P.indptr)
    starts = P.indptr + np.arange(n + 1)  # each column has one entry more
    inside = np.arange(P.nnz) + np.repeat(np.arange(n), counts)
    data = np.empty(P.nnz + 2 * n, dtype=complex)
    rows = np.empty(P.nnz + 2 * n, dtype=P.indices.dtype)
    data[inside], rows[inside] = P.data, P.indices
    data[starts[1:] - 1], rows[starts[1:] - 1] = row, n
    data[starts[n] :], rows[starts[n] :] = column, np.arange(n)
    return csc_array((data, rows, np.append(starts, P.nnz + 2 * n)), shape=(n + 1, n + 1))


def _refined(
    factor: Factor, matrix: Any, end: ComplexArray, transposed: bool
) -> ComplexArray | None:
    """The solution of matrix (or matrix') x = end by the factor of one nearby; None if it does
    not converge."""
    matrix = matrix.T if transposed else matrix
    size = float(abs(matrix).sum(axis=1).max())
    x = factor.solve(end, transposed)
    for _ in range(REFINEMENTS):
        rest = end - matrix @ x
        if np.abs(rest).max() <= REFINED * (size * np.abs(x).max() + np.abs(end).max()):
            return x
        x = x + factor.solve(rest, transposed)
    return None


def axis_crossing(
    scaled: ScaledSystem,
    name: str,
    value: float,
    omega: float,
    right: ComplexArray,
    left: ComplexArray,
) -> AxisCrossing:
    """The crossing of the axis next to a guess: parameter `name` at `value`, omega (rad/s; 0 for a
    real root), right and left vectors (n,) in the scaled coordinates.

    Raises ComputationError if Newton's method does not converge (no crossing is near, or two
    coincide).
    """
    c, b = right / np.linalg.norm(right), left / np.linalg.norm(left)
    p, w, real = float(value), float(omega), omega == 0.0
    scale_p = abs(p) or 1.0
    last: _Bordered | None = None
    for _ in range(STEPS):
        at = {name: p}
        problem = scaled.at(at)
        root = complex(0.0, w)
        try:
            bordered = _Bordered(problem, root, b, c, last)
        except ZeroDivisionError:
            break
        g_lambda = bordered.slope(problem.slope(root))
        g_p = bordered.slope(scaled.slope(name, at, root))
        if real:
            jacobian = np.array([[1.0, g_p.real], [0.0, g_p.imag]])
            step = -bordered.g.real / g_p.real if g_p.real else math.inf
            moves = np.array([0.0, step])
            amplification = 1.0 / abs(g_p.real) if g_p.real else math.inf
        else:
            along = 1j * g_lambda
            jacobian = np.array([[along.real, g_p.real], [along.imag, g_p.imag]])
            sizes = np.abs(jacobian).max(axis=0)
            if not sizes.all() or np.linalg.cond(jacobian / sizes) > 1e12:
                break
            moves = np.linalg.solve(jacobian, [-bordered.g.real, -bordered.g.imag])
            amplification = float(np.abs(np.linalg.inv(jacobian)[1]).sum())
        if not np.all(np.isfinite(moves)):
            break
        near = abs(moves[1]) <= NEAR * max(abs(p), scale_p) and abs(moves[0]) <= NEAR * abs(w)
        last = bordered if near else None
        shape = bordered.x / np.linalg.norm(bordered.x)
        if last is None:
            c, b = shape, bordered.w.conj() / np.linalg.norm(bordered.w)
        small = abs(moves[1]) <= CONVERGED * max(abs(p), scale_p)
        small &= abs(moves[0]) <= CONVERGED * max(abs(w), 1.0)
        w, p = w + float(moves[0]), p + float(moves[1])
        uncertain = bordered.noise * amplification
        if small or abs(moves[1]) <= uncertain:
            slope = -(g_p / g_lambda).real
            residual = problem.backward_errors(np.array([root]), shape[:, None])[0]
            half = uncertain + abs(float(moves[1])) + 2 * EPS * abs(p)
            return AxisCrossing(
                p,
                abs(w),
                "up" if slope > 0 else "down",
                float(slope),
                (p - half, p + half),
                float(residual),
                shape,
            )
    raise ComputationError(
        f"no crossing of the imaginary axis was found near {name} = {value:.9g} at "
        f"{omega / (2 * math.pi):.6g} Hz"
    )
