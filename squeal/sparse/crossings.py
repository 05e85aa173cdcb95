"""Crossings of the imaginary axis along a parameter: seen on a reduced system, proved on the full.

At values of the parameter the reduced system gives roots in a region and their derivatives. They
are matched from one value to the next by where their slopes point; what is in doubt halves the
step, and where two roots are predicted to come close (`near_coalescences`), that place is looked
at. Newton's method on the full system has the last word: bordered by left and right vectors y, x of
a mode, P(lambda, p) stays regular where it is singular. In [[P, y], [x^H, 0]] [v; -g] = [0; 1] the
number g vanishes exactly at the roots; g(i omega, p) = 0 is a complex equation for two real
unknowns.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.continuation import State, hermite_cubic, near_coalescences, zeros_between
from squeal.linear.events import Event
from squeal.linear.matrices import EPS
from squeal.linear.system import TermSystem
from squeal.sparse.quadratic import ComplexArray, ScaledSystem, combined, factorise_at
from squeal.sparse.reduction import Reduction


@dataclass(frozen=True)
class AlongOptions:
    """When the roots of a reduced system are in doubt, and what following them may cost."""

    least: float = 2.0**-40  # shortest step, of the range
    states: int = 600  # values at which roots are computed; beyond, no step is halved
    doubt: float = 0.25  # of its way: how far the slopes may miss a root that counts as matched
    near: float = 1e-4  # of |lambda|: ... or this
    rounding: float = 1e-10  # of |lambda|: real parts of reduced roots that may be rounding
    real: float = 1e-6  # of the highest imaginary part: below, a root of real matrices is real
    same: float = 1e-7  # relative: crossings closer than this are one
    steps: int = 20  # of Newton's method
    converged: float = 1e-12  # step relative to p and omega; its error is the square


OPTIONS = AlongOptions()
Place = tuple[State, int]  # a state with the index of one of its roots


def motion_of(
    system: TermSystem,
    name: str,
    changes: Mapping[str, float] | None,
    z: ComplexArray,
    X: ComplexArray,
    Y: ComplexArray,
) -> tuple[ComplexArray, ComplexArray]:
    """Y dP X (m, m), dP(z) the derivative by a parameter, and the diagonal of Y (2 z M + C) X, of
    roots with right vectors X (n, m) and conjugate left ones Y (m, n): dz is minus their ratio."""
    M, C, _ = system.at(changes)
    slopes = zip(system.derivative(name, changes), (z**2, z, z**0), strict=True)
    change = sum((A @ X * f for A, f in slopes if A is not None), np.zeros_like(X))
    inertia = 2 * z * (M @ X) + (0.0 if C is None else C @ X)
    return Y @ change, np.sum(Y.T * inertia, axis=0)


class Along:
    """A reduced system along one parameter."""

    def __init__(self, reduction: Reduction, name: str) -> None:
        self.reduction, self.name, self.region = reduction, name, reduction.region
        if not self.region.low_real < 0.0 < self.region.high_real or self.region.high_imag <= 0.0:
            shown = ":".join(f"{x:g}" for x in astuple(self.region))
            raise InputError(f"region {shown}: must hold a part of the upper imaginary axis")
        # a root of real matrices is real below this; complex ones mean what is above the axis
        self.real = OPTIONS.real * self.region.high_imag if reduction.system.real else 0.0
        self.region = replace(self.region, low_imag=max(self.region.low_imag, -self.real))
        self._states: dict[float, State] = {}

    def at(self, value: float) -> State:
        """The roots (rad/s) at a value of the parameter, of pairs the upper ones."""
        if value not in self._states:
            system, at = self.reduction.system, {self.name: value}
            roots = self.reduction.roots(at, left=True)
            roots = roots.picked(self.region.contains(roots.values))
            z, X, Y = roots.values, roots.right, roots.left.conj().T
            change, inertia = motion_of(system, self.name, at, z, X, Y)
            # a double root at zero leaves it as a square root, if at all
            C = system.at(at)[1]
            damping = 0.0 if C is None else float(np.linalg.norm(C))
            single = (z != 0) | (np.abs(inertia) > OPTIONS.rounding * damping)
            coupling = np.asarray(-change / np.where(single, inertia, np.inf)[:, None])
            noise = OPTIONS.rounding / 10 * np.abs(z)
            self._states[value] = State(value, z, X, roots.left, coupling, noise)
        return self._states[value]

    def crossings(self, a: float, b: float, least: float) -> Iterator[Place]:
        """Where a root crosses the axis from a to b: the state next to that; steps are divided
        down to the width `least`."""
        before, after = self.at(a), self.at(b)
        pairs, misses = _matched(before, after)
        cut, each = self._doubt(before, after, pairs, misses), []
        if cut is None:
            each = [self._on_axis(before, after, i, j) for i, j in pairs]
            cut = (a + b) / 2 if None in each else None
        if cut is None:
            yield from (place for places in each for place in places or ())
        elif b - a > least and len(self._states) < OPTIONS.states:
            yield from self.crossings(a, cut, least)
            yield from self.crossings(cut, b, least)
        else:  # as near as values of the parameter differ
            for i, j in pairs:
                if _changes_sign(before.roots[i], after.roots[j]):
                    first = abs(before.roots[i].real) < abs(after.roots[j].real)
                    yield (before, i) if first else (after, j)

    def _doubt(
        self, before: State, after: State, pairs: list[tuple[int, int]], misses: np.ndarray
    ) -> float | None:
        """Where a step has to be divided, None if each root is matched or leaves the region for
        good, and no two may meet on the way."""
        h, middle = after.value - before.value, (before.value + after.value) / 2
        for i, j in pairs:
            way = abs(after.roots[j] - before.roots[i])
            if misses[i, j] > max(OPTIONS.doubt * way, OPTIONS.near * abs(before.roots[i])):
                return middle
        for state, own, ahead in ((before, 0, h), (after, 1, -h)):
            for k in set(range(len(state.roots))) - {pair[own] for pair in pairs}:
                # one that leaves the region may cross the axis before
                z, way = state.roots[k], ahead * state.slopes[k]
                if self.region.contains(z + way) or _changes_sign(z, z + 2 * way):
                    return middle
        for met in near_coalescences(before, after):
            place, half = met.value, max(met.half, 1e-9 * abs(met.value))
            # a window that is wider than this has been seen from its inside
            seen = min(abs(p - place) for p in self._states) <= half / 2
            if before.value < place < after.value and half < abs(h) / 8 and not seen:
                return place
        return None

    def _on_axis(self, before: State, after: State, i: int, j: int) -> list[Place] | None:
        """Where the cubic through the real parts of one root, and their derivatives, vanishes
        between two values, refined on the reduced system; None if a change of sign shows none."""
        h, a, b = after.value - before.value, before.roots[i], after.roots[j]
        slopes = h * before.slopes[i].real, h * after.slopes[j].real
        zeros = zeros_between(hermite_cubic(a.real, slopes[0], b.real, slopes[1]))
        refined = (
            self._refined(before.value + t * h, complex(a + t * (b - a)), before.value, h)
            for t in zeros
        )
        places = [place for place in refined if place]
        return None if not places and _changes_sign(a, b) else places

    def _refined(self, value: float, root: complex, low: float, width: float) -> Place | None:
        """The zero of the real part of the root next to a guess in a step; None without one."""
        for _ in range(5):
            state = self.at(value)
            if not len(state.roots):
                return None
            k = int(np.argmin(np.abs(state.roots - root)))
            slope = state.slopes[k]
            move = -state.roots[k].real / slope.real if slope.real else math.inf
            near = abs(move) <= width / 20  # rounding may move a weak crossing this far
            if abs(move) <= OPTIONS.same * width:
                break
            move = float(np.clip(move, -width / 2, width / 2))
            value, root = value + move, complex(state.roots[k] + move * slope)
            if not low - width / 4 <= value <= low + 5 * width / 4:
                return None
        return (state, k) if near else None


def _matched(before: State, after: State) -> tuple[list[tuple[int, int]], np.ndarray]:
    """Indices of the same roots at both values, and by how much slopes miss each of all pairs."""
    from scipy.optimize import linear_sum_assignment

    mean = (after.value - before.value) / 2 * (before.slopes[:, None] + after.slopes)
    misses = np.abs(after.roots - before.roots[:, None] - mean)
    rows, columns = linear_sum_assignment(misses)
    return list(zip(rows.tolist(), columns.tolist(), strict=True)), misses


def _changes_sign(one: complex, other: complex) -> bool:
    """True if the real parts differ in sign by more than rounding."""
    sure = all(abs(z.real) > OPTIONS.rounding * abs(z) for z in (one, other))
    return sure and one.real * other.real < 0


@dataclass(frozen=True, eq=False)
class AxisCrossing(Event):
    """A pair or a real root (omega 0) of the full system on the imaginary axis.

    `interval` holds the parameter's value with rounding taken into account, `residual` is the
    backward error there, `slope` is d Re lambda / dp (1/s per unit of p), `vector` (n,) the mode
    in the scaled coordinates, of unit length.
    """

    slope: float = math.nan
    vector: ComplexArray = field(default_factory=lambda: np.zeros(0, complex), repr=False)


def crossings_along(
    reduction: Reduction, name: str, values: Sequence[float]
) -> tuple[list[AxisCrossing], list[str]]:
    """All crossings of the imaginary axis inside the region between the first and last value.

    The reduced system must be good at the values (rising), which set the first steps. Each
    crossing is located on the full system; a sentence names each one that it does not confirm.
    Raises InputError for a region without the axis.
    """
    along, low, high = Along(reduction, name), values[0], values[-1]
    crossings: list[AxisCrossing] = []
    unconfirmed: list[str] = []
    for a, b in itertools.pairwise(values):
        for state, k in along.crossings(a, b, OPTIONS.least * (high - low)):
            omega = abs(state.roots[k].imag)
            omega = 0.0 if omega <= along.real else omega
            pair = np.stack([state.right[:, k], state.left[:, k]], axis=1)
            vectors = combined(reduction.vectors, pair).T
            try:
                one = axis_crossing(reduction.scaled, name, state.value, omega, *vectors)
            except ComputationError as error:
                unconfirmed.append(str(error))
                continue
            if not any(_same(one, other) for other in crossings):
                crossings.append(one)
    inside = [c for one in crossings for c in _in_range(one, low, high)]
    return sorted(inside, key=lambda c: (c.value, -abs(c.slope))), unconfirmed


def _in_range(one: AxisCrossing, low: float, high: float) -> list[AxisCrossing]:
    """A crossing, at an end of the range exactly if rounding leaves that; none if it lies outside,
    or if what does not grow at the start begins to decay."""
    first, last = one.interval
    if first <= low <= last:
        return [replace(one, value=low, interval=(low, last))] if one.direction > 0 else []
    if first <= high <= last:
        return [replace(one, value=high)]
    return [one] if low <= one.value <= high else []


def _same(one: AxisCrossing, other: AxisCrossing) -> bool:
    return bool(
        abs(one.value - other.value) <= OPTIONS.same * max(abs(one.value), abs(other.value))
        and abs(one.omega - other.omega) <= OPTIONS.same * max(one.omega, other.omega)
        and abs(np.vdot(one.vector, other.vector)) > 0.5
    )


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
    p, w, real = float(value), float(omega), omega == 0.0
    x, y = right / np.linalg.norm(right), left / np.linalg.norm(left)
    unit = abs(p) or 1.0
    for _ in range(OPTIONS.steps):
        problem, root = scaled.at({name: p}), complex(0.0, w)
        place, factor = factorise_at(problem, root)
        v, u = factor.solve(y), factor.solve(x.conj(), transposed=True)
        g = 1.0 / complex(x.conj() @ v)
        v, u = g * v, g * u
        g -= complex(u @ (problem.slope(place) @ v)) * (place - root)
        slope_root = u @ (problem.slope(root) @ v)
        slope_p = u @ (scaled.slope(name, {name: p}, root) @ v)
        columns, goal = [1j * slope_root, slope_p], g
        if real:  # omega stays zero
            columns, goal = [1.0, 1j * slope_p.real], complex(0.0, g.real)
        jacobian = np.array([np.real(columns), np.imag(columns)])
        sizes = np.abs(jacobian).max(axis=0)
        if not (sizes.all() and np.linalg.cond(jacobian / sizes) <= 1e12):
            break
        inverse = np.linalg.inv(jacobian / sizes) / sizes[:, None]
        turn, move = (-inverse @ [goal.real, goal.imag]).tolist()
        # by rounding of P x
        noise = 2 * EPS * problem.size(np.array(root)) * np.linalg.norm(u) * np.linalg.norm(v)
        uncertain = float(noise * np.abs(inverse[1]).sum())
        w, p = w + turn, p + move
        small = abs(move) <= OPTIONS.converged * max(abs(p), unit)
        small &= abs(turn) <= OPTIONS.converged * max(abs(w), 1.0)
        x, y = v / np.linalg.norm(v), u.conj() / np.linalg.norm(u)
        if small or abs(move) <= uncertain:
            slope = -float((slope_p / slope_root).real)
            residual = float(problem.backward_errors(np.array([root]), x[:, None])[0])
            half = uncertain + abs(move) + 2 * EPS * abs(p)
            way, ends = 1 if slope > 0 else -1, (p - half, p + half)
            return AxisCrossing(p, abs(w), way, ends, residual, slope=slope, vector=x)
    raise ComputationError(
        f"no crossing of the imaginary axis was found near {name} = {value:.9g} at "
        f"{omega / (2 * math.pi):.6g} Hz"
    )
