"""Crossings of the imaginary axis along a parameter: seen on a reduced system, proved on the full.

At values of the parameter the reduced system gives roots in a region and their derivatives. They
are matched from one value to the next by where their slopes point; what is in doubt halves the
step, and where two roots are predicted to come close (`near_coalescences`), that value is looked
at. Newton's method on the full system has the last word: of right and left vectors x, y of a mode
y^H P(i omega, p) x = 0 is a complex equation for two real unknowns, whose error is of second order
in that of the vectors. Inverse iteration and residuals, by a factor of P, bring what these lack in
the reduced system.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputError
from squeal.linear.continuation import (
    Continuation,
    SpectrumAtParameter,
    hermite_cubic,
    zeros_between,
)
from squeal.linear.events import Event, locate_event
from squeal.linear.matrices import EPS, applied, inertia, norm_of
from squeal.linear.search import search
from squeal.linear.steps import Guess, near_coalescences
from squeal.linear.system import TermSystem
from squeal.linear.verdicts import assumed_rounding
from squeal.sparse.dispersive import NEAR, DispersiveReduction, frequencies
from squeal.sparse.eigensolver import enlarged
from squeal.sparse.factor import Factor, factorise, factorise_at
from squeal.sparse.quadratic import (
    Array,
    Bools,
    ComplexArray,
    Indices,
    Roots,
    ScaledSystem,
    multiply,
)
from squeal.sparse.reduced_basis import ReducedBasis
from squeal.sparse.reduction import Complement, Reduction

if TYPE_CHECKING:
    from scipy.sparse import csc_array


# When the roots of a reduced system are in doubt, and what following them may cost
SHORTEST_STEP = 2.0**-40  # of the range
SPECTRA = 600  # values at which roots are computed; beyond, no step is halved
MISSED_SHARE = 0.25  # of a root's path: a slope may miss it by so much to match it
MISSED = 1e-4  # of |lambda|: ... or by this
REAL = 1e-6  # of the highest imaginary part: below, a root of real matrices is real
SAME = 1e-7  # relative: crossings closer than this are one
NEWTON_STEPS = 20
EXACT = 1e-12  # of null vectors: what they add less is left out
FACTOR_SERVES = 3  # steps of Newton's method: the later ones correct vectors by residuals
CONVERGED = 1e-12  # step relative to p and omega; its error is the square
SHORTEST_PART = 2.0**-10  # singular K: of the range; shorter ones are not halved
CONTRACTS = 0.4  # ... below what a part contracts, by few powers that may tell too little
PARTS = 200  # ... and how many are looked at


class CrossingGuess(NamedTuple):
    """A crossing nearby: rad/s (0 for a real root), right and left vectors (n,), scaled."""

    value: float
    omega: float
    right: NDArray
    left: NDArray


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


class _FrozenPart(NamedTuple):
    """A reduced system frozen at one of some frequencies, in a region around it."""

    searched: ReducedBasis | Reduction
    omega: float  # rad/s
    spacing: float  # to the next of these frequencies


def _frozen_parts(reduction: DispersiveReduction) -> Iterator[_FrozenPart]:
    region = reduction.region
    grid = frequencies(reduction.system, region)
    spacing = float(np.diff(grid).max())
    reach = (NEAR + 0.5) * spacing
    for omega in grid.tolist():
        around = replace(
            region,
            low_imag=max(region.low_imag, omega - reach),
            high_imag=min(region.high_imag, omega + reach),
        )
        yield _FrozenPart(reduction.frozen(omega, around), omega, spacing)


def spectrum_with_slopes(
    system: TermSystem, name: str, value: float, roots: Roots, lifted: bool = False
) -> SpectrumAtParameter:
    """Some roots (rad/s) at a value of the parameter with their slopes, their vectors (n, m).

    Lifted, these are of first order (2n, m), so that left^H right of two roots vanishes.
    """
    z = roots.values
    right = roots.right
    left = roots.left
    at = {name: value}
    matrices = system.at(at)
    M, C, _ = matrices
    change = left.conj().T @ applied(system.derivative(name, at), z, right)
    weight = np.sum(left.conj() * inertia(matrices, z, right), axis=0)
    # a double root at zero leaves it as a square root, if at all
    damping = 0.0 if C is None else norm_of(C)
    is_single = (z != 0) | (np.abs(weight) > assumed_rounding(damping))
    coupling = -change / np.where(is_single, weight, np.inf)[:, None]
    if lifted:
        mass = M.conj().T @ left
        lowered = z.conj() * mass + (0.0 if C is None else C.conj().T @ left)
        right = np.vstack([right, z * right])
        left = np.vstack([lowered, mass])
    return SpectrumAtParameter(value, z, right, left, coupling, assumed_rounding(z))


class _Match(NamedTuple):
    """Which roots of two spectra are the same, and by how much their slopes miss."""

    before: Indices
    after: Indices
    misses: Array


def _match(before: SpectrumAtParameter, after: SpectrumAtParameter) -> _Match:
    from scipy.optimize import linear_sum_assignment

    span = after.value - before.value
    predicted = span / 2 * np.add.outer(before.slopes, after.slopes)
    misses = np.abs(np.subtract.outer(after.roots, before.roots).T - predicted)
    rows, columns = linear_sum_assignment(misses)
    return _Match(rows, columns, misses[rows, columns])


class CrossingSearch:
    """Where roots of a reduced system cross the imaginary axis along one parameter.

    Raises InputError for a region without a part of the upper axis.
    """

    def __init__(self, reduction: ReducedBasis | Reduction, name: str) -> None:
        self.reduction = reduction
        self.name = name
        self.scaled = ScaledSystem(reduction.system)
        region = reduction.region
        if not region.low_real < 0.0 < region.high_real or region.high_imag <= 0.0:
            raise InputError(f"region {region}: must hold a part of the upper imaginary axis")
        # a root of real matrices is real below this; complex ones mean what is above the axis
        self.real = REAL * region.high_imag if reduction.system.real else 0.0
        self.region = replace(region, low_imag=max(region.low_imag, -self.real))
        self._spectra: dict[float, SpectrumAtParameter] = {}

    def at(self, value: float) -> SpectrumAtParameter:
        """The roots (rad/s) at a value of the parameter, of pairs the upper ones."""
        if value not in self._spectra:
            roots = self.reduction.roots({self.name: value}, left=True)
            roots = roots.select(self.region.contains(roots.values))
            spectrum = spectrum_with_slopes(self.reduction.system, self.name, value, roots)
            self._spectra[value] = spectrum
        return self._spectra[value]

    def between(self, low: float, high: float, shortest: float) -> Iterator[CrossingGuess]:
        """Where a root crosses the axis from low to high; steps are divided down to `shortest`."""
        before = self.at(low)
        after = self.at(high)
        match = _match(before, after)
        division = self._division(before, after, match)
        guesses: list[CrossingGuess] = []
        if division is None:
            for i, j in zip(match.before, match.after, strict=True):
                of_root = self._guesses_of_root(before, after, i, j)
                if of_root is None:
                    division = (low + high) / 2
                    break
                guesses += of_root
        if division is None:
            yield from guesses
        elif high - low > shortest and len(self._spectra) < SPECTRA:
            yield from self.between(low, division, shortest)
            yield from self.between(division, high, shortest)
        else:  # as near as values of the parameter differ
            for i, j in zip(match.before, match.after, strict=True):
                if not _changes_sign(before.roots[i], after.roots[j]):
                    continue
                if abs(before.roots[i].real) < abs(after.roots[j].real):
                    yield self._guess(before, i, before.value, before.roots[i])
                else:
                    yield self._guess(after, j, after.value, after.roots[j])

    def _division(
        self, before: SpectrumAtParameter, after: SpectrumAtParameter, match: _Match
    ) -> float | None:
        """Where a step has to be divided, None if it has not.

        It has not where each root is matched or leaves the region for good, without crossing the
        axis, and no two may meet on the way.
        """
        span = after.value - before.value
        middle = (before.value + after.value) / 2
        start = before.roots[match.before]
        paths = np.abs(after.roots[match.after] - start)
        allowed = np.maximum(MISSED_SHARE * paths, MISSED * np.abs(start))
        if np.any(match.misses > allowed):
            return middle
        unmatched_before = np.delete(np.arange(len(before.roots)), match.before)
        unmatched_after = np.delete(np.arange(len(after.roots)), match.after)
        if self._may_not_be_gone(before, unmatched_before, span):
            return middle
        if self._may_not_be_gone(after, unmatched_after, -span):
            return middle
        for met in near_coalescences(before, after):
            width = max(met.width, 1e-9 * abs(met.value))
            # where a spectrum was computed within the window, it has been seen from its inside
            is_seen = min(abs(value - met.value) for value in self._spectra) <= width / 2
            is_inside = before.value < met.value < after.value
            if is_inside and width < abs(span) / 8 and not is_seen:
                return met.value
        return None

    def _may_not_be_gone(self, state: SpectrumAtParameter, unmatched: Indices, span: float) -> bool:
        """True if a root that leaves the region may cross the axis, meet its conjugate, or is
        predicted to stay."""
        z = state.roots[unmatched]
        change = span * state.slopes[unmatched]
        meets_conjugate = (z.imag > 0.0) & ((z + change).imag < 0.0) & (self.region.low_imag < 0.0)
        stays = self.region.contains(z + change)
        return bool(np.any(meets_conjugate | stays | _changes_sign(z, z + 2 * change)))

    def _guesses_of_root(
        self, before: SpectrumAtParameter, after: SpectrumAtParameter, i: int, j: int
    ) -> list[CrossingGuess] | None:
        """Where the cubic through the real parts of one root, and their derivatives, vanishes
        between two values, refined on the reduced system; None if a change of sign shows none."""
        span = after.value - before.value
        start = before.roots[i]
        end = after.roots[j]
        cubic = hermite_cubic(
            start.real, span * before.slopes[i].real, end.real, span * after.slopes[j].real
        )
        guesses = []
        for t in zeros_between(cubic):
            value = before.value + t * span
            root = complex(start + t * (end - start))
            with suppress(ComputationError):
                if t < 0.5:
                    guess = self._guess(before, i, value, root)
                else:
                    guess = self._guess(after, j, value, root)
                crossing = axis_crossing(self.scaled, self.name, guess)
                if abs(crossing.value - (before.value + after.value) / 2) <= 3 * span / 4:
                    guesses.append(_guess_of(crossing))
        if not guesses and _changes_sign(start, end):
            return None
        return guesses

    def _guess(
        self, state: SpectrumAtParameter, k: int, value: float, root: complex
    ) -> CrossingGuess:
        """The crossing at a value of the parameter by a root with the vectors of a spectrum."""
        omega = abs(root.imag)
        return CrossingGuess(
            value=value,
            omega=0.0 if omega <= self.real else omega,
            right=state.right[:, k] / self.scaled.scale,
            left=state.left[:, k] / self.scaled.scale,
        )


def _guess_of(crossing: AxisCrossing) -> CrossingGuess:
    return CrossingGuess(crossing.value, crossing.omega, crossing.vector, crossing.left)


def _changes_sign(one: NDArray, other: NDArray) -> Bools:
    """True where the real parts differ in sign by more than rounding."""
    return _growth_beyond_rounding(one) * _growth_beyond_rounding(other) < 0.0


def _growth_beyond_rounding(z: NDArray) -> NDArray:
    return np.where(np.abs(z.real) > assumed_rounding(z), z.real, 0)


def singular_stiffness(
    scaled: ScaledSystem, values: Sequence[float]
) -> tuple[list[CrossingGuess], list[str]]:
    """Where K of real matrices becomes singular between values of the parameter, and a sentence for
    each change of sign of its determinant where that was not located.

    A real root passes zero there, and may come from far above a band and leave it between two
    values. Parts of the range are halved, as far as the constants allow, until the determinant has
    the same sign at both ends and 1 - K(middle)^-1 K contracts there.
    """
    stiffness = _SweptStiffness(scaled, values)
    span = values[-1] - values[0]
    edge = 1e-6 * span
    found: list[CrossingGuess] = []
    unclear: list[str] = []
    parts = [(values[0], values[-1])]
    for a, b in parts:  # which grow
        close = [one for one in found if min(abs(one.value - a), abs(one.value - b)) <= 2 * edge]
        contracts = stiffness.contracts(a, b, close)
        if contracts and not close:  # no sign can have changed
            continue
        changes = stiffness.sign(a) * stiffness.sign(b) < 0.0
        if contracts and not changes:
            continue
        shortest = edge if changes else SHORTEST_PART * span
        is_last = b - a <= shortest or len(parts) >= PARTS
        one = None
        if changes or is_last:
            one = singular_between(scaled, stiffness.name, (a, b), edge)
        if one and all(abs(one.value - other.value) > edge for other in found):
            found.append(one)
            if a < one.value - edge:
                parts.append((a, one.value - edge))
            if one.value + edge < b:
                parts.append((one.value + edge, b))
        elif not is_last:
            middle = stiffness.middle(a, b)
            parts += [(a, middle), (middle, b)]
        elif changes:
            where = f"{stiffness.name} = {a:.6g} and {b:.6g}"
            unclear.append(f"a real root passes zero between {where} and was not located")
    return found, unclear


class _SweptStiffness:
    """K over the free parameter: signs of its determinant, and where it cannot be singular."""

    def __init__(self, scaled: ScaledSystem, values: Sequence[float]) -> None:
        self.scaled = scaled
        self.name = scaled.system.parameter
        self._signs: dict[float, float] = {}
        slopes = set()
        for value in values:
            p = scaled.system.values({self.name: value})
            slopes.add(tuple(term.factor.slope(p, self.name) for term in scaled.system.K))
        # a linear K is farthest at the ends of a part
        self._inner_values = values if len(slopes) > 1 else ()

    def at(self, value: float) -> csc_array:
        """K at a value of the parameter."""
        return self.scaled.at({self.name: value}).K

    @staticmethod
    def middle(a: float, b: float) -> float:
        """A value between two others where K hardly is singular by chance."""
        return a + 0.4871 * (b - a)

    def sign(self, value: float) -> float:
        """The sign of det K; 0 where it is singular, as that of rigid bodies."""
        if value not in self._signs:
            self._signs[value] = self._computed_sign(value)
        return self._signs[value]

    def _computed_sign(self, value: float) -> float:
        try:
            factor = Factor(self.at(value))
        except ZeroDivisionError:
            return 0.0
        pivots = np.abs(factor.lu.U.diagonal())
        if pivots.min() <= 2 * EPS * pivots.max():
            return 0.0
        return math.copysign(1.0, math.cos(factor.logarithm().imag))

    def contracts(self, a: float, b: float, close: Sequence[CrossingGuess]) -> bool:
        """True if K is regular from a to b, but for the null vectors of singular ones close by."""
        basis = np.zeros((self.scaled.n, 0))
        if close:
            columns = [vector for one in close for vector in (one.right, one.left)]
            basis = enlarged(basis, np.column_stack(columns), EXACT)
        K = self.at(self.middle(a, b))
        try:
            factor = factorise(K)
        except ZeroDivisionError:
            return False
        complement = Complement(basis, basis.T @ (K @ basis), K, factor)
        tried = [a, b, *(value for value in self._inner_values if a < value < b)]
        return all(complement.contraction(self.at(p)) < CONTRACTS for p in tried)


def singular_between(
    scaled: ScaledSystem, name: str, ends: tuple[float, float], near: float
) -> CrossingGuess | None:
    """Where K of real matrices is singular between two values, by Newton's method from their
    middle to far below `near`, with its unit null vectors; None if it does not converge there."""
    low, high = ends
    value = (low + high) / 2
    x, y = np.random.default_rng(1).standard_normal((2, scaled.n))
    for _ in range(NEWTON_STEPS):
        K = scaled.at({name: value}).K
        slope = scaled.slope(name, {name: value}, 0.0)
        with suppress(ZeroDivisionError), np.errstate(all="ignore"):
            factor = factorise(K)
            for _ in range(3):  # of K + m slope the null vectors of the least m
                x = factor.solve(slope @ x)
                y = factor.solve(slope.T @ y, transposed=True)
                x = x / np.linalg.norm(x)
                y = y / np.linalg.norm(y)
        with np.errstate(all="ignore"):
            move = -float(y @ (K @ x)) / float(y @ (slope @ x) or np.nan)
        value += move
        if not low < value < high:  # also of NaN
            return None
        if abs(move) <= 1e-3 * near:
            return CrossingGuess(value, 0.0, x, y)
    return None


def crossings_along(
    reduction: Reduction, name: str, values: Sequence[float], known: Sequence[CrossingGuess] = ()
) -> tuple[list[AxisCrossing], list[str]]:
    """All crossings of the imaginary axis inside the region between the first and last value.

    The reduced system must be good at the values (rising), which set the first steps. Each
    crossing is located on the full system; a sentence names each one that it does not confirm.
    Where matrices depend on the frequency of each root they are frozen at some, and what crosses
    near one of these is located with its own. `known` are guesses of the full system from
    elsewhere. Raises InputError for a region without the axis.
    """
    low = values[0]
    high = values[-1]
    crossings: list[AxisCrossing] = []
    unconfirmed: list[str] = []
    for guess in known:
        try:
            crossings.append(axis_crossing(reduction.scaled, name, guess))
        except ComputationError as error:
            unconfirmed.append(str(error))
    parts: Iterator[_FrozenPart] = iter([_FrozenPart(reduction.searched, 0.0, math.inf)])
    if isinstance(reduction, DispersiveReduction):
        parts = _frozen_parts(reduction)
    for part in parts:
        search_on_part = CrossingSearch(part.searched, name)
        scale = search_on_part.scaled.scale
        for a, b in itertools.pairwise(values):
            shortest = SHORTEST_STEP * (high - low)
            for guess in search_on_part.between(a, b, shortest):
                vectors = part.searched.in_projection(scale * guess.right, scale * guess.left)
                right, left = multiply(reduction.vectors, np.array(vectors, dtype=complex).T).T
                try:
                    full_guess = guess._replace(right=right, left=left)
                    one = axis_crossing(reduction.scaled, name, full_guess)
                except ComputationError as error:
                    # else it is another part's to find
                    if abs(guess.omega - part.omega) <= part.spacing / 2:
                        unconfirmed.append(str(error))
                    continue
                if not any(_is_same(one, other) for other in crossings):
                    crossings.append(one)
    inside: list[AxisCrossing] = []
    for one in crossings:
        inside += _in_range(one, low, high)
    inside.sort(key=lambda one: (one.value, -abs(one.slope)))
    return inside, unconfirmed


def coalescences(reduction: DispersiveReduction, name: str, values: Sequence[float]) -> list[Event]:
    """Where two roots of an undamped system meet on the axis whose matrices, real ones, depend on
    the frequency of each root.

    With matrices frozen at omega they meet at omega_c(omega), and with their own where both are
    one. The secant method goes there from each of the frequencies of the frozen parts.
    """
    low = values[0]
    high = values[-1]
    found: list[Event] = []
    for part in _frozen_parts(reduction):
        for event in itertools.chain(*search(part.searched.system, low, high).clusters):
            if not event.omega or abs(event.omega - part.omega) > part.spacing:
                continue
            one = _at_own_frequency(reduction.system, event, part.omega, low, high)
            if one and not any(_is_same_meeting(one, other) for other in found):
                found.append(replace(one, residual=reduction.worst))
    return sorted(found, key=lambda one: one.value)


def _is_same_meeting(one: Event, other: Event) -> bool:
    return (
        abs(one.value - other.value) <= SAME * abs(one.value)
        and abs(one.omega - other.omega) <= SAME * one.omega
    )


def _at_own_frequency(
    system: TermSystem, start: Event, frozen: float, low: float, high: float
) -> Event | None:
    """The coalescence next to one with matrices frozen at some omega; None if the secant method, or
    the search at one of its steps, does not find it."""
    event = start
    omega_before = frozen
    omega = event.omega
    excess_before = omega - omega_before
    for _ in range(NEWTON_STEPS):
        continuation = Continuation(system.frozen(omega), low, high)
        spectrum = continuation.at(event.value)
        pair = np.argsort(np.abs(spectrum.roots - event.omega**2))[:2]
        guess = Guess(
            value=event.value,
            root=complex(spectrum.roots[pair].mean()),
            right=spectrum.right[:, pair],
            left=spectrum.left[:, pair],
            coalesces=True,
            width=high - low,
        )
        one = locate_event(continuation, guess)
        if one is None or not one.omega:
            return None
        event = one
        excess = one.omega - omega
        if abs(excess) <= CONVERGED * omega:
            return event
        step = excess * (omega - omega_before) / (excess_before - excess)
        omega_before = omega
        excess_before = excess
        omega = omega + step
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


def _is_same(one: AxisCrossing, other: AxisCrossing) -> bool:
    distance = SAME * max(abs(one.value), abs(other.value)) + one.width + other.width
    return bool(
        abs(one.value - other.value) <= distance
        and abs(one.omega - other.omega) <= SAME * max(one.omega, other.omega)
        and abs(np.vdot(one.vector, other.vector)) > 0.5
    )


def axis_crossing(scaled: ScaledSystem, name: str, guess: CrossingGuess) -> AxisCrossing:
    """The crossing of the axis by the parameter `name` next to a guess.

    Raises ComputationError if Newton's method does not converge (no crossing is near, or two
    coincide).
    """
    value = guess.value
    omega = guess.omega
    x = guess.right / np.linalg.norm(guess.right)
    y = guess.left / np.linalg.norm(guess.left)
    for k in range(NEWTON_STEPS):
        problem = scaled.at({name: value, **scaled.system.frequency(omega)})
        if k % FACTOR_SERVES == 0:
            _, factor = factorise_at(problem, complex(0.0, omega))
            right = factor.solve(y)
            left = factor.solve(x.conj(), transposed=True).conj()
        else:
            P = problem.at(complex(0.0, omega))
            right = x - factor.solve(P @ x)
            left = y - factor.solve(P.T @ y.conj(), transposed=True).conj()
        x = right / np.linalg.norm(right)
        y = left / np.linalg.norm(left)
        step = _newton_step(scaled, name, CrossingGuess(value, omega, x, y))
        if step is None:
            break
        if step.is_converged:
            return step.crossing
        value = step.crossing.value
        omega = step.crossing.omega
    raise ComputationError(
        f"no crossing of the imaginary axis was found near {name} = {guess.value:.9g} at "
        f"{guess.omega / (2 * math.pi):.6g} Hz"
    )


class _NewtonStep(NamedTuple):
    """Where a step of Newton's method ends."""

    crossing: AxisCrossing
    is_converged: bool  # the step is rounding


def _newton_step(scaled: ScaledSystem, name: str, guess: CrossingGuess) -> _NewtonStep | None:
    """The zero of y^H P(i omega, p) x by one step from a guess with unit vectors (n,); None where
    y^H dP x is singular."""
    system = scaled.system
    p = guess.value
    omega = guess.omega
    x = guess.right
    y = guess.left.conj()
    root = complex(0.0, omega)
    at = {name: p, **system.frequency(omega)}
    problem = scaled.at(at)
    image = problem.apply(np.array([root]), x[:, None])[:, 0]
    product = complex(y @ image)
    by_root = y @ (problem.slope(root) @ x)
    by_parameter = y @ (scaled.slope(name, at, root) @ x)
    by_frequency = 0.0
    for frequency, share in system.frequency(1.0).items():
        by_frequency = by_frequency + share * (y @ (scaled.slope(frequency, at, root) @ x))
    columns = [1j * by_root + by_frequency, by_parameter]
    if omega == 0.0:  # it stays zero
        columns = [1.0, 1j * by_parameter.real]
        product = complex(0.0, product.real)
    jacobian = np.array([np.real(columns), np.imag(columns)])
    sizes = np.abs(jacobian).max(axis=0)
    if not (sizes.all() and np.linalg.cond(jacobian / sizes) <= 1e12):
        return None
    inverse = np.linalg.inv(jacobian / sizes) / sizes[:, None]
    omega_step, step = (-inverse @ [product.real, product.imag]).tolist()
    size = float(problem.size(np.array(root)))
    uncertain = 2 * EPS * size * float(np.abs(inverse[1]).sum())  # by rounding of P x
    is_small = abs(step) <= CONVERGED * max(abs(p + step), abs(p) or 1.0)
    is_small &= abs(omega_step) <= CONVERGED * max(abs(omega + omega_step), 1.0)
    new_omega = omega + omega_step
    if system.follows:
        least, most = system.covered
        new_omega = min(max(new_omega, 2 * math.pi * least), 2 * math.pi * most)
    new_p = p + step
    # the root follows the parameter, and the matrices its frequency
    direct = -by_parameter / by_root
    turn = by_frequency / by_root
    slope = float((direct - turn * (direct.imag / (1.0 + turn.imag))).real)
    half_width = uncertain + abs(step) + 2 * EPS * abs(new_p)
    crossing = AxisCrossing(
        value=new_p,
        omega=abs(new_omega),
        direction=1 if slope > 0 else -1,
        interval=(new_p - half_width, new_p + half_width),
        residual=float(np.linalg.norm(image) / size),
        slope=slope,
        vector=x,
        left=guess.left,
    )
    return _NewtonStep(crossing, bool(is_small or abs(step) <= uncertain))
