"""Crossings of the imaginary axis along a parameter: seen on a reduced system, proved on the full.

At values of the parameter the reduced system gives roots in a region and their derivatives. They
are matched from one value to the next by where their slopes point; what is in doubt halves the
step, and where two roots are predicted to come close (`near_coalescences`), that place is looked
at. Newton's method on the full system has the last word: of right and left vectors x, y of a mode
y^H P(i omega, p) x = 0 is a complex equation for two real unknowns, whose error is of second order
in that of the vectors. Corrections by the factor of P at the first sample bring what these lack in
the reduced system.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import astuple, dataclass, field, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputError
from squeal.linear.continuation import (
    Continuation,
    State,
    hermite_cubic,
    near_coalescences,
    zeros_between,
)
from squeal.linear.continuation import Guess as Coalescing
from squeal.linear.eigen import assumed_rounding
from squeal.linear.events import Event, located
from squeal.linear.matrices import EPS, applied, inertia, norm_of
from squeal.linear.search import search
from squeal.linear.system import TermSystem
from squeal.sparse.dispersive import frozen_parts
from squeal.sparse.eigensolver import enlarged
from squeal.sparse.quadratic import (
    ComplexArray,
    Factor,
    Roots,
    ScaledSystem,
    combined,
    factorise,
    factorise_at,
)
from squeal.sparse.reduction import Reduction, contraction


@dataclass(frozen=True)
class AlongOptions:
    """When the roots of a reduced system are in doubt, and what following them may cost."""

    least: float = 2.0**-40  # shortest step, of the range
    states: int = 600  # values at which roots are computed; beyond, no step is halved
    doubt: float = 0.25  # of its way: how far the slopes may miss a root that counts as matched
    near: float = 1e-4  # of |lambda|: ... or this
    real: float = 1e-6  # of the highest imaginary part: below, a root of real matrices is real
    same: float = 1e-7  # relative: crossings closer than this are one
    steps: int = 20  # of Newton's method
    rounds: int = 8  # of corrections of a crossing
    exact: float = 1e-12  # backward error of its vectors
    converged: float = 1e-12  # step relative to p and omega; its error is the square
    apart: float = 2.0**-10  # singular K: shortest part of the range that is halved
    holds: float = 0.4  # ... below what a part contracts, by few powers that may tell too little
    parts: int = 200  # ... and how many parts are looked at


OPTIONS = AlongOptions()


class Guess(NamedTuple):
    """A crossing nearby: rad/s (0 for a real root), right and left vectors (n,), scaled."""

    value: float
    omega: float
    vector: NDArray
    left: NDArray


def state_of(
    system: TermSystem, name: str, value: float, roots: Roots, lifted: bool = False
) -> State:
    """The state of some roots (rad/s) at a value of the parameter, their vectors (n, m); lifted:
    these are of first order (2n, m), so that left^H right of two roots vanishes."""
    z, X, Y, at = roots.values, roots.right, roots.left, {name: value}
    M, C, _ = matrices = system.at(at)
    change = Y.conj().T @ applied(system.derivative(name, at), z, X)
    weight = np.sum(Y.conj() * inertia(matrices, z, X), axis=0)
    # a double root at zero leaves it as a square root, if at all
    single = (z != 0) | (np.abs(weight) > assumed_rounding(0.0 if C is None else norm_of(C)))
    coupling = np.asarray(-change / np.where(single, weight, np.inf)[:, None])
    if lifted:
        mass, damping = M.conj().T @ Y, 0.0 if C is None else C.conj().T @ Y
        X, Y = np.vstack([X, z * X]), np.vstack([z.conj() * mass + damping, mass])
    return State(value, z, X, Y, coupling, assumed_rounding(z))


class Along:
    """A reduced system along one parameter."""

    def __init__(self, reduction: Reduction, name: str) -> None:
        self.reduction, self.name, self.region = reduction, name, reduction.region
        self.scaled = ScaledSystem(reduction.system)
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
            roots = self.reduction.roots({self.name: value}, left=True)
            roots = roots.picked(self.region.contains(roots.values))
            self._states[value] = state_of(self.reduction.system, self.name, value, roots)
        return self._states[value]

    def crossings(self, a: float, b: float, least: float) -> Iterator[Guess]:
        """Where a root crosses the axis from a to b; steps are divided down to `least`."""
        from scipy.optimize import linear_sum_assignment

        before, after = self.at(a), self.at(b)
        mean = (b - a) / 2 * np.add.outer(before.slopes, after.slopes)
        misses = np.abs(np.subtract.outer(after.roots, before.roots).T - mean)
        i, j = linear_sum_assignment(misses)  # the same roots at both values
        cut, each = self._doubt(before, after, i, j, misses[i, j]), []
        if cut is None:
            each = [self._on_axis(before, after, *pair) for pair in zip(i, j, strict=True)]
            cut = (a + b) / 2 if None in each else None
        if cut is None:
            yield from (guess for guesses in each for guess in guesses or ())
        elif b - a > least and len(self._states) < OPTIONS.states:
            yield from self.crossings(a, cut, least)
            yield from self.crossings(cut, b, least)
        else:  # as near as values of the parameter differ
            for k, l in zip(i, j, strict=True):
                if _changes_sign(before.roots[k], after.roots[l]):
                    first = abs(before.roots[k].real) < abs(after.roots[l].real)
                    yield self._guess(*((before, k) if first else (after, l)))

    def _doubt(
        self, before: State, after: State, i: NDArray, j: NDArray, missed: NDArray
    ) -> float | None:
        """Where a step has to be divided, None if each root is matched or leaves the region for
        good, and no two may meet on the way."""
        h, middle = after.value - before.value, (before.value + after.value) / 2
        x, y = before.roots[i], after.roots[j]
        most = np.maximum(OPTIONS.doubt * np.abs(y - x), OPTIONS.near * np.abs(x))
        doubtful = bool(np.any(missed > most))
        for state, matched, ahead in ((before, i, h), (after, j, -h)):
            # one that leaves the region may cross the axis before, or meet its conjugate
            z, way = (np.delete(v, matched) for v in (state.roots, ahead * state.slopes))
            meets = (z.imag > 0.0) & ((z + way).imag < 0.0) & (self.region.low_imag < 0.0)
            meets |= self.region.contains(z + way) | _changes_sign(z, z + 2 * way)
            doubtful |= bool(np.any(meets))
        if doubtful:
            return middle
        for met in near_coalescences(before, after):
            place, half = met.value, max(met.width, 1e-9 * abs(met.value))
            # a window that is wider than this has been seen from its inside
            seen = min(abs(p - place) for p in self._states) <= half / 2
            if before.value < place < after.value and half < abs(h) / 8 and not seen:
                return place
        return None

    def _on_axis(self, before: State, after: State, i: int, j: int) -> list[Guess] | None:
        """Where the cubic through the real parts of one root, and their derivatives, vanishes
        between two values, refined on the reduced system; None if a change of sign shows none."""
        h, a, b = after.value - before.value, before.roots[i], after.roots[j]
        slopes = h * before.slopes[i].real, h * after.slopes[j].real
        guesses = []
        for t in zeros_between(hermite_cubic(a.real, slopes[0], b.real, slopes[1])):
            value, root = before.value + t * h, complex(a + t * (b - a))
            with suppress(ComputationError):
                guess = self._guess(*((before, i) if t < 0.5 else (after, j)), value, root)
                one = axis_crossing(self.scaled, self.name, *guess)
                if abs(one.value - (before.value + after.value) / 2) <= 3 * h / 4:
                    guesses.append(Guess(one.value, one.omega, one.vector, one.left))
        return None if not guesses and _changes_sign(a, b) else guesses

    def _guess(
        self, state: State, k: int, value: float | None = None, root: complex | None = None
    ) -> Guess:
        """The crossing of a root of a state, or of where it goes from there."""
        omega = abs((state.roots[k] if root is None else root).imag)
        right, left = (X[:, k] / self.scaled.scale for X in (state.right, state.left))
        value = state.value if value is None else value
        return Guess(value, 0.0 if omega <= self.real else omega, right, left)


def _changes_sign(one: Any, other: Any) -> Any:
    """True where the real parts differ in sign by more than rounding."""
    one, other = (np.where(np.abs(z.real) > assumed_rounding(z), z.real, 0) for z in (one, other))
    return one * other < 0.0


@dataclass(frozen=True, eq=False)
class AxisCrossing(Event):
    """A pair or a real root (omega 0) of the full system on the imaginary axis.

    `interval` holds the parameter's value with rounding taken into account, `residual` is the
    backward error there, `slope` is d Re lambda / dp (1/s per unit of p), `vector` (n,) the mode
    and `left` (n,) its left vector in the scaled coordinates, of unit length.
    """

    slope: float = math.nan
    vector: ComplexArray = field(default_factory=lambda: np.zeros(0, complex), repr=False)
    left: ComplexArray = field(default_factory=lambda: np.zeros(0, complex), repr=False)


def singular_stiffness(
    scaled: ScaledSystem, values: Sequence[float]
) -> tuple[list[Guess], list[str]]:
    """Where K of real matrices becomes singular between values of the parameter, and a sentence for
    each change of sign of its determinant where that was not located.

    A real root passes zero there, and may come from far above a band and leave it between two
    values. Parts of the range are halved, as far as `OPTIONS` allows, until the determinant has
    the same sign at both ends and 1 - K(middle)^-1 K contracts there.
    """
    found, unclear = list[Guess](), list[str]()
    system, name, wide = scaled.system, scaled.system.parameter, values[-1] - values[0]
    each = (tuple(t.factor.slope(system.values({name: p}), name) for t in system.K) for p in values)
    looked = values if len({*each}) > 1 else ()  # a linear K is farthest at the ends of a part
    parts, none, edge = [(values[0], values[-1])], np.zeros((scaled.n, 0)), 1e-6 * wide

    def stiffness(p: float) -> Any:
        return scaled.at({name: p}).K

    @cache
    def sign(p: float) -> float:
        with suppress(ZeroDivisionError):
            factor = Factor(stiffness(p))
            pivots = np.abs(factor.lu.U.diagonal())
            if pivots.min() > 2 * EPS * pivots.max():  # not of rigid bodies
                return math.copysign(1.0, math.cos(factor.logarithm().imag))
        return 0.0

    for a, b in parts:
        middle = a + 0.4871 * (b - a)  # where K hardly is singular by chance
        close = [g for g in found if min(abs(g.value - a), abs(g.value - b)) <= 2 * edge]
        columns = [x for g in close for x in (g.vector, g.left)]
        V, holds = enlarged(none, np.column_stack(columns), OPTIONS.exact) if close else none, False
        with suppress(ZeroDivisionError):
            given = V, V.T @ ((K := stiffness(middle)) @ V), K, factorise(K)
            tried = (a, b, *(v for v in looked if a < v < b))
            holds = all(contraction(*given, stiffness(p)) < OPTIONS.holds for p in tried)
        if holds and not close:  # no sign can have changed
            continue
        changes = sign(a) * sign(b) < 0.0
        if holds and not changes:
            continue
        least = edge if changes else OPTIONS.apart * wide
        whole = b - a <= least or len(parts) >= OPTIONS.parts
        one = singular(scaled, name, (a, b), edge) if changes or whole else None
        if one and all(abs(one.value - g.value) > edge for g in found):
            found.append(one)
            ends = [(a, one.value - edge), (one.value + edge, b)]
            parts += [(low, high) for low, high in ends if low < high]
        elif not whole:
            parts += [(a, middle), (middle, b)]
        elif changes:
            where = f"{name} = {a:.6g} and {b:.6g}"
            unclear.append(f"a real root passes zero between {where} and was not located")
    return found, unclear


def singular(
    scaled: ScaledSystem, name: str, between: tuple[float, float], near: float
) -> Guess | None:
    """Where K of real matrices is singular between two values, by Newton's method from their
    middle to far below `near`, with its unit null vectors; None if it does not converge there."""
    p, (x, y) = sum(between) / 2, np.random.default_rng(1).standard_normal((2, scaled.n))
    for _ in range(OPTIONS.steps):
        K, slope = scaled.at({name: p}).K, scaled.slope(name, {name: p}, 0.0)
        with suppress(ZeroDivisionError), np.errstate(all="ignore"):
            factor = factorise(K)
            for _ in range(3):  # of K + m slope the null vectors of the least m
                x, y = factor.solve(slope @ x), factor.solve(slope.T @ y, True)
                x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
        with np.errstate(all="ignore"):
            move = -float(y @ (K @ x)) / float(y @ (slope @ x) or np.nan)
        p += move
        if not between[0] < p < between[1]:  # also of NaN
            return None
        if abs(move) <= 1e-3 * near:
            return Guess(p, 0.0, x, y)
    return None


def crossings_along(
    reduction: Reduction, name: str, values: Sequence[float], known: Sequence[Guess] = ()
) -> tuple[list[AxisCrossing], list[str]]:
    """All crossings of the imaginary axis inside the region between the first and last value.

    The reduced system must be good at the values (rising), which set the first steps. Each
    crossing is located on the full system; a sentence names each one that it does not confirm.
    Where matrices depend on the frequency of each root they are frozen at some, and what crosses
    near one of these is located with its own. `known` are guesses of the full system from
    elsewhere. Raises InputError for a region without the axis.
    """
    low, high = values[0], values[-1]
    crossings: list[AxisCrossing] = []
    unconfirmed: list[str] = []
    finer = copy(reduction)  # which grows by what each crossing lacks
    for each in known:
        try:
            crossings.append(axis_crossing(reduction.scaled, name, *each))
        except ComputationError as error:
            unconfirmed.append(str(error))
    whole = [(reduction, 0.0, math.inf)]
    for part, middle, wide in frozen_parts(reduction) if reduction.system.follows else whole:
        along = Along(part, name)
        for a, b in itertools.pairwise(values):
            for value, omega, *vectors in along.crossings(a, b, OPTIONS.least * (high - low)):
                guess = along.scaled.scale * np.array(vectors, dtype=complex)
                both = combined(reduction.vectors, guess.T)
                try:
                    one = confirmed(finer, name, value, omega, *both.T)
                except ComputationError as error:
                    if abs(omega - middle) <= wide / 2:  # else it is another part's to find
                        unconfirmed.append(str(error))
                    continue
                if not any(_same(one, other) for other in crossings):
                    crossings.append(one)
    inside = [c for one in crossings for c in _in_range(one, low, high)]
    return sorted(inside, key=lambda c: (c.value, -abs(c.slope))), unconfirmed


def coalescences(reduction: Reduction, name: str, values: Sequence[float]) -> list[Event]:
    """Where two roots of an undamped system meet on the axis whose matrices, real ones, depend on
    the frequency of each root.

    With matrices frozen at omega they meet at omega_c(omega), and with their own where both are
    one. The secant method goes there from each of the frequencies of `frozen_parts`.
    """
    low, high = values[0], values[-1]
    found: list[Event] = []
    for part, middle, wide in frozen_parts(reduction):
        for place in search(part.system, low, high).clusters:
            for event in place:
                near = event.omega and abs(event.omega - middle) <= wide
                one = (
                    _at_own_frequency(reduction.system, event, middle, low, high) if near else None
                )
                if one and not any(
                    abs(one.value - other.value) <= OPTIONS.same * abs(one.value)
                    and abs(one.omega - other.omega) <= OPTIONS.same * one.omega
                    for other in found
                ):
                    found.append(replace(one, residual=reduction.worst))
    return sorted(found, key=lambda one: one.value)


def _at_own_frequency(
    system: TermSystem, event: Event, omega: float, low: float, high: float
) -> Event | None:
    """The coalescence next to one with matrices frozen at omega; None if the secant method, or the
    search at one of its steps, does not find it."""
    before, off = omega, event.omega - omega
    omega = event.omega
    for _ in range(OPTIONS.steps):
        along = Continuation(system.frozen(omega), low, high)
        state = along.at(event.value)
        both = np.argsort(np.abs(state.roots - event.omega**2))[:2]
        vectors = state.right[:, both], state.left[:, both]
        mean = complex(state.roots[both].mean())
        guess = Coalescing(event.value, mean, *vectors, True, high - low)
        one = located(along, guess)
        if one is None or not one.omega:
            return None
        event, left = one, one.omega - omega
        if abs(left) <= OPTIONS.converged * omega:
            return event
        change = off - left
        before, omega, off = omega, omega + left * (omega - before) / change, left
    return None


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
        abs(one.value - other.value)
        <= OPTIONS.same * max(abs(one.value), abs(other.value)) + one.width + other.width
        and abs(one.omega - other.omega) <= OPTIONS.same * max(one.omega, other.omega)
        and abs(np.vdot(one.vector, other.vector)) > 0.5
    )


def axis_crossing(
    scaled: ScaledSystem, name: str, value: float, omega: float, right: NDArray, left: NDArray
) -> AxisCrossing:
    """The crossing of the axis next to a guess: parameter `name` at `value`, omega (rad/s; 0 for a
    real root), right and left vectors (n,) in the scaled coordinates.

    Raises ComputationError if Newton's method does not converge (no crossing is near, or two
    coincide).
    """
    one: AxisCrossing | None = AxisCrossing(value, omega, 1, (-math.inf, math.inf), math.inf)
    x, y = right / np.linalg.norm(right), left / np.linalg.norm(left)
    for _ in range(OPTIONS.steps):
        if one is None:
            break
        problem = scaled.at({name: one.value, **scaled.system.frequency(one.omega)})
        _, factor = factorise_at(problem, complex(0.0, one.omega))
        x, y = factor.solve(y), factor.solve(x.conj(), transposed=True).conj()
        x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
        one, settled = _newton(scaled, name, one.value, one.omega, x, y)
        if one is not None and settled:
            return one
    raise ComputationError(
        f"no crossing of the imaginary axis was found near {name} = {value:.9g} at "
        f"{omega / (2 * math.pi):.6g} Hz"
    )


def _newton(
    scaled: ScaledSystem, name: str, p: float, w: float, x: ComplexArray, y: ComplexArray
) -> tuple[AxisCrossing | None, bool]:
    """The zero of y^H P(i omega, p) x by one step from p, omega with unit vectors (n,), and whether
    that step is rounding; None where y^H dP x is singular."""
    system, unit, root, real = scaled.system, abs(p) or 1.0, complex(0.0, w), w == 0.0
    at = {name: p, **system.frequency(w)}
    problem, u = scaled.at(at), y.conj()
    image = problem.apply(np.array([root]), x[:, None])[:, 0]
    g = complex(u @ image)
    slope_root = u @ (problem.slope(root) @ x)
    slope_p = u @ (scaled.slope(name, at, root) @ x)
    shares = system.frequency(1.0).items()
    slope_w = sum(z * (u @ (scaled.slope(own, at, root) @ x)) for own, z in shares)
    columns = [1j * slope_root + slope_w, slope_p]
    if real:  # omega stays zero
        columns, g = [1.0, 1j * slope_p.real], complex(0.0, g.real)
    jacobian = np.array([np.real(columns), np.imag(columns)])
    sizes = np.abs(jacobian).max(axis=0)
    if not (sizes.all() and np.linalg.cond(jacobian / sizes) <= 1e12):
        return None, False
    inverse = np.linalg.inv(jacobian / sizes) / sizes[:, None]
    turn, move = (-inverse @ [g.real, g.imag]).tolist()
    size = float(problem.size(np.array(root)))
    uncertain = 2 * EPS * size * float(np.abs(inverse[1]).sum())  # by rounding of P x
    least, most = -math.inf, math.inf
    if system.follows:
        least, most = (2 * math.pi * hertz for hertz in system.covered)
    small = abs(move) <= OPTIONS.converged * max(abs(p + move), unit)
    small &= abs(turn) <= OPTIONS.converged * max(abs(w + turn), 1.0)
    w, p = min(max(w + turn, least), most), p + move
    rate, turned = -slope_p / slope_root, slope_w / slope_root
    slope = float((rate - turned * (rate.imag / (1.0 + turned.imag))).real)
    half, way = uncertain + abs(move) + 2 * EPS * abs(p), 1 if slope > 0 else -1
    residual = float(np.linalg.norm(image) / size)
    one = AxisCrossing(
        p, abs(w), way, (p - half, p + half), residual, slope=slope, vector=x, left=y
    )
    return one, bool(small or abs(move) <= uncertain)


def confirmed(
    reduction: Reduction, name: str, value: float, omega: float, right: NDArray, left: NDArray
) -> AxisCrossing:
    """The crossing of the full system next to one of the reduced system, vectors (n,).

    The reduced system grows by corrections until the crossing that it has solves the full problem.
    Where it does not come to be good, the full problem is factorised. Raises ComputationError.
    """
    scaled, factor = reduction.scaled, reduction.factor
    for _ in range(OPTIONS.rounds):
        if factor is None:
            break
        small = ScaledSystem(reduction.system)
        both = combined(reduction.vectors.T, np.array([right, left]).T)
        one = axis_crossing(small, name, value, omega, *(both / small.scale[:, None]).T)
        value, omega = one.value, one.omega
        both = combined(reduction.vectors, (small.scale * np.array([one.vector, one.left])).T)
        right, left = np.hsplit(both / np.linalg.norm(both, axis=0), 2)
        problem = scaled.at({name: value, **scaled.system.frequency(omega)})
        root = np.array([complex(0.0, omega)])
        rests = problem.apply(root, right), problem.transposed().apply(root, left.conj())
        errors = np.array([np.linalg.norm(r) for r in rests]) / problem.size(root)
        right, left = right[:, 0], left[:, 0]
        if max(errors) <= OPTIONS.exact:
            exact, settled = _newton(scaled, name, value, omega, right, left)
            if exact is not None and settled:
                return exact
            break
        steps = [factor.solve(r, bool(k)) for k, r in enumerate(rests)]
        reduction.extend(np.hstack(steps), 1e-4)
    return axis_crossing(scaled, name, value, omega, right, left)
