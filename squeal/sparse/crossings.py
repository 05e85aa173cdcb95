"""Crossings of the imaginary axis along a parameter: seen on a reduced system, located on the full.

At values of the parameter the reduced system gives roots in a region and their derivatives. They
are matched from one value to the next by where their slopes point. A doubtful match halves the
step; where two roots are predicted to come close (`near_coalescences`), the step is divided at that
value. Newton's method on the full system has the last word: with right and left vectors x, y of a
mode y^H P(i omega, p) x = 0 is a complex equation for two real unknowns, whose error is of second
order in that of the vectors. The vectors of the reduced system are corrected to those of the full
one by inverse iteration and by residuals, with a factor of P.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import NamedTuple

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
from squeal.linear.steps import meeting_at, near_coalescences
from squeal.linear.system import System
from squeal.linear.verdicts import assumed_rounding
from squeal.sparse.dispersive import NEAR_INTERVALS, DispersiveReduction, frequencies
from squeal.sparse.factor import factorise_at
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
from squeal.sparse.reduction import Reduction

# When the roots of a reduced system are in doubt, and what following them may cost
SHORTEST_STEP = 2.0**-40  # of the range
MOST_SPECTRA = 600  # values at which roots are computed; beyond, no step is halved
MISSED_SHARE = 0.25  # of a root's path: two roots match if their slopes miss it by at most this
MISSED = 1e-4  # of |lambda|: ... or by this
REAL_SHARE = 1e-6  # of the highest imaginary part: below, a root of real matrices is real
SAME_SHARE = 1e-7  # relative: crossings closer than this are one
NEWTON_STEPS = 20
STEPS_PER_FACTOR = 3  # steps of Newton's method: the later ones correct vectors by residuals
CONVERGED_STEP = 1e-12  # step relative to p and omega; its error is the square


class CrossingGuess(NamedTuple):
    """A crossing of the imaginary axis nearby."""

    value: float  # of the parameter
    omega: float  # rad/s, 0 of a real root
    right: NDArray  # vector (n,) in the scaled coordinates
    left: NDArray  # as `right`


@dataclass(frozen=True, eq=False)
class AxisCrossing(Event):
    """A pair or a real root (omega 0) of the full system on the imaginary axis.

    `interval` holds the parameter's value with rounding taken into account, `residual` is the
    backward error there, `slope` is d Re lambda / dp (1/s per unit of p), `right` and
    `left` (n,) are its vectors in the scaled coordinates, of unit length.
    """

    slope: float = math.nan
    right: ComplexArray = field(default_factory=lambda: np.zeros(0, complex), repr=False)
    left: ComplexArray = field(default_factory=lambda: np.zeros(0, complex), repr=False)


class _FrozenPart(NamedTuple):
    """A reduced system frozen at one of some frequencies, in a region around it."""

    path_reduction: ReducedBasis | Reduction
    omega: float  # rad/s
    spacing: float  # to the next one of the frozen frequencies


def _frozen_parts(reduction: DispersiveReduction) -> Iterator[_FrozenPart]:
    """The reduced system frozen at each of some frequencies of its band, overlapping."""
    region = reduction.region
    grid = frequencies(reduction.system, region)
    spacing = float(np.diff(grid).max())
    # roots start within NEAR_INTERVALS of a frozen frequency, and move
    reach = (NEAR_INTERVALS + 0.5) * spacing
    for omega in grid.tolist():
        around = replace(
            region,
            low_imag=max(region.low_imag, omega - reach),
            high_imag=min(region.high_imag, omega + reach),
        )
        yield _FrozenPart(reduction.frozen(omega, around), omega, spacing)


def spectrum_with_slopes(
    system: System, name: str, value: float, roots: Roots, lifted: bool = False
) -> SpectrumAtParameter:
    """Roots (m,) at a value of the parameter p, their vectors (n, m) and how p moves both.

    The couplings (m, m) of the spectrum are -y_i^H dP/dp x_j / y_i^H P' x_i, of first-order
    perturbation theory: on the diagonal the slope dz/dp of each root, beside it how p mixes the
    modes. `lifted` vectors (2n, m) are those of the first-order form [x, z x] and
    [(z M + C)^H y, M^H y], for which left^H right of two different roots vanishes.
    """
    z = roots.values
    right = roots.right
    left = roots.left
    at = {name: value}
    matrices = system.at(at)
    M, C, _ = matrices
    change = left.conj().T @ applied(system.derivative(name, at), z, right)
    weight = np.sum(left.conj() * inertia(matrices, z, right), axis=0)
    # y^H P' x vanishes at the double root zero of a free motion, which has no slope
    damping = 0.0 if C is None else norm_of(C)  # the size of y^H C x for unit vectors
    is_single = (z != 0) | (np.abs(weight) > assumed_rounding(damping))
    coupling = -change / np.where(is_single, weight, np.inf)[:, None]
    if lifted:
        of_velocities = M.conj().T @ left
        of_displacements = z.conj() * of_velocities
        if C is not None:
            of_displacements = of_displacements + C.conj().T @ left
        right = np.vstack([right, z * right])
        left = np.vstack([of_displacements, of_velocities])
    return SpectrumAtParameter(value, z, right, left, coupling, assumed_rounding(z))


class _Match(NamedTuple):
    """Pairs (k,) of roots of two spectra that are taken for the same root."""

    before: Indices
    after: Indices
    misses: Array  # distance of the later root from where the slopes of both predict it, rad/s


def _match(before: SpectrumAtParameter, after: SpectrumAtParameter) -> _Match:
    """The assignment of roots that minimises the sum of `misses` (Hungarian method)."""
    from scipy.optimize import linear_sum_assignment

    span = after.value - before.value
    predicted = span / 2 * np.add.outer(before.slopes, after.slopes)
    misses = np.abs(np.subtract.outer(after.z, before.z).T - predicted)
    rows, columns = linear_sum_assignment(misses)
    return _Match(rows, columns, misses[rows, columns])


class CrossingSearch:
    """The search for crossings of the imaginary axis on a reduced system along one parameter.

    It keeps the spectra that it has computed. Raises InputError for a region without a part of the
    upper imaginary axis.
    """

    def __init__(self, reduction: ReducedBasis | Reduction, name: str) -> None:
        self.reduction = reduction
        self.name = name
        self.scaled = ScaledSystem(reduction.system)
        region = reduction.region
        if not region.low_real < 0.0 < region.high_real or region.high_imag <= 0.0:
            raise InputError(f"region {region}: must hold a part of the upper imaginary axis")
        # roots of real matrices come in pairs: the upper ones serve, and below this (rad/s) their
        # imaginary part is taken for zero
        self.imag_rounding = REAL_SHARE * region.high_imag if reduction.system.real else 0.0
        self.region = replace(region, low_imag=max(region.low_imag, -self.imag_rounding))
        self._spectra: dict[float, SpectrumAtParameter] = {}

    def at(self, value: float) -> SpectrumAtParameter:
        """The roots (rad/s) at a value of the parameter, of pairs the upper ones."""
        if value not in self._spectra:
            roots = self.reduction.roots({self.name: value})
            roots = roots.select(self.region.contains(roots.values))
            spectrum = spectrum_with_slopes(self.reduction.system, self.name, value, roots)
            self._spectra[value] = spectrum
        return self._spectra[value]

    def between(self, low: float, high: float, shortest: float) -> Iterator[CrossingGuess]:
        """The crossings between two values of the parameter.

        Each is located on the reduced system. The step is divided where its two spectra leave a
        doubt, down to the length `shortest` or until `MOST_SPECTRA` are computed: there the end
        nearer to a crossing stands for it.
        """
        before = self.at(low)
        after = self.at(high)
        match = _match(before, after)
        division = self._division(before, after, match)
        guesses: list[CrossingGuess] = []
        if division is None:
            for i, j in zip(match.before, match.after, strict=True):
                guesses_of_root = self._guesses_of_root(before, after, i, j)
                if guesses_of_root is None:  # it crosses, and no crossing was located: halve
                    division = (low + high) / 2
                    break
                guesses += guesses_of_root
        if division is None:
            yield from guesses
        elif high - low > shortest and len(self._spectra) < MOST_SPECTRA:
            yield from self.between(low, division, shortest)
            yield from self.between(division, high, shortest)
        else:  # the shortest step: the end nearer to the crossing is the guess
            for i, j in zip(match.before, match.after, strict=True):
                if not _changes_sign(before.z[i], after.z[j]):
                    continue
                if abs(before.z[i].real) < abs(after.z[j].real):
                    yield self._guess(before, i, before.value, before.z[i])
                else:
                    yield self._guess(after, j, after.value, after.z[j])

    def _division(
        self, before: SpectrumAtParameter, after: SpectrumAtParameter, match: _Match
    ) -> float | None:
        """The value at which a step has to be divided, None if it has not.

        It need not be divided if each root is matched, or leaves the region without crossing the
        axis, and no two roots may meet on the way.
        """
        span = after.value - before.value
        middle = (before.value + after.value) / 2
        start = before.z[match.before]
        paths = np.abs(after.z[match.after] - start)
        allowed = np.maximum(MISSED_SHARE * paths, MISSED * np.abs(start))
        if np.any(match.misses > allowed):
            return middle
        unmatched_before = np.delete(np.arange(len(before.z)), match.before)
        unmatched_after = np.delete(np.arange(len(after.z)), match.after)
        if self._exit_is_doubtful(before, unmatched_before, span):
            return middle
        if self._exit_is_doubtful(after, unmatched_after, -span):
            return middle
        for meeting in near_coalescences(before, after):
            if not before.value < meeting.value < after.value:
                continue
            width = max(meeting.width, 1e-9 * abs(meeting.value))  # wider than rounding
            is_narrow = width < abs(span) / 8  # a wider one shows in the slopes at both ends
            # a spectrum within the width, which reaches to both sides of the meeting, shows it
            distance = min(abs(value - meeting.value) for value in self._spectra)
            if is_narrow and distance > width / 2:
                return meeting.value
        return None

    def _exit_is_doubtful(self, spectrum: SpectrumAtParameter, which: Indices, span: float) -> bool:
        """True if a root of a spectrum may not have left the region on the step of length `span`,
        though it has no partner at the other end: its slope predicts that it stays, or it may cross
        the axis or meet its conjugate on the way.

        which: indices of the roots without a partner. `span` is negative from the later spectrum
        back.
        """
        z = spectrum.z[which]
        change = span * spectrum.slopes[which]
        predicted = z + change
        stays = self.region.contains(predicted)
        meets_conjugate = (z.imag > 0.0) & (predicted.imag < 0.0) & (self.region.low_imag < 0.0)
        may_cross = _changes_sign(z, z + 2 * change)  # the slope may double on the way
        return bool(np.any(stays | meets_conjugate | may_cross))

    def _guesses_of_root(
        self, before: SpectrumAtParameter, after: SpectrumAtParameter, i: int, j: int
    ) -> list[CrossingGuess] | None:
        """The crossings of one root, number i before and j after, by the zeros of the Hermite cubic
        of its real part, refined by Newton's method on the reduced system.

        None if the real part changes its sign and no crossing was located.
        """
        span = after.value - before.value
        middle = (before.value + after.value) / 2
        start = before.z[i]
        end = after.z[j]
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
                # Newton's method may have gone to a crossing outside of the step, by more than a
                # quarter of it
                if abs(crossing.value - middle) <= 3 * span / 4:
                    vectors = crossing.right, crossing.left
                    guesses.append(CrossingGuess(crossing.value, crossing.omega, *vectors))
        if not guesses and _changes_sign(start, end):
            return None
        return guesses

    def _guess(
        self, spectrum: SpectrumAtParameter, k: int, value: float, root: complex
    ) -> CrossingGuess:
        """A crossing of a root at a value of the parameter, with the vectors of root k nearby."""
        omega = abs(root.imag)
        return CrossingGuess(
            value=value,
            omega=0.0 if omega <= self.imag_rounding else omega,
            right=spectrum.right[:, k] / self.scaled.scale,
            left=spectrum.left[:, k] / self.scaled.scale,
        )


def _changes_sign(before: NDArray, after: NDArray) -> Bools:
    """True where the growth rates of roots differ in sign by more than rounding."""
    return _growth_beyond_rounding(before) * _growth_beyond_rounding(after) < 0.0


def _growth_beyond_rounding(z: NDArray) -> NDArray:
    """Real parts, 0 where they are rounding."""
    return np.where(np.abs(z.real) > assumed_rounding(z), z.real, 0)


def crossings_along(
    reduction: Reduction, name: str, values: Sequence[float], known: Sequence[CrossingGuess] = ()
) -> tuple[list[AxisCrossing], list[str]]:
    """All crossings of the imaginary axis inside the region between the first and last value.

    Crossings of the reduced system are located on the full one. Where matrices depend on the
    frequency of each root they are frozen at some frequencies, and a crossing near a frozen one is
    located with matrices at its own frequency.

    Parameters
    ----------
    reduction : Reduction
        The reduced system, good at all values.
    name : str
        The parameter.
    values : sequence of float
        Its values, rising: the ends of the first steps.
    known : sequence of CrossingGuess
        Guesses in the coordinates of the full system, from elsewhere.

    Returns
    -------
    crossings : list of AxisCrossing
        By rising value of the parameter.
    unconfirmed : list of str
        A sentence for each crossing of the reduced system that was not located on the full one.

    Raises
    ------
    InputError
        For a region without a part of the upper imaginary axis.
    """
    low = values[0]
    high = values[-1]
    shortest = SHORTEST_STEP * (high - low)
    crossings: list[AxisCrossing] = []  # none twice
    unconfirmed: list[str] = []

    def locate(guess: CrossingGuess) -> None:
        crossing = axis_crossing(reduction.scaled, name, guess)
        if not any(_is_same(crossing, other) for other in crossings):
            crossings.append(crossing)

    for guess in known:
        try:
            locate(guess)
        except ComputationError as error:
            unconfirmed.append(str(error))
    # if matrices do not depend on the frequency, one part serves the whole band
    parts: Iterator[_FrozenPart] = iter([_FrozenPart(reduction.path_reduction, 0.0, math.inf)])
    if isinstance(reduction, DispersiveReduction):
        parts = _frozen_parts(reduction)
    for part in parts:
        reduced = part.path_reduction
        search_on_part = CrossingSearch(reduced, name)
        scale = search_on_part.scaled.scale
        for a, b in itertools.pairwise(values):
            for guess in search_on_part.between(a, b, shortest):
                # vectors from scaled coordinates of the reduced system to those of the projection,
                # then to those of the full system
                vectors = reduced.in_projection(scale * guess.right, scale * guess.left)
                right, left = multiply(reduction.vectors, np.array(vectors, dtype=complex).T).T
                try:
                    locate(guess._replace(right=right, left=left))
                except ComputationError as error:
                    # farther from the part's frequency the neighbouring part has to locate it
                    if abs(guess.omega - part.omega) <= part.spacing / 2:
                        unconfirmed.append(str(error))
    inside: list[AxisCrossing] = []
    for crossing in crossings:
        in_range = _in_range(crossing, low, high)
        if in_range is not None:
            inside.append(in_range)
    inside.sort(key=lambda crossing: (crossing.value, -abs(crossing.slope)))
    return inside, unconfirmed


def coalescences(reduction: DispersiveReduction, name: str, values: Sequence[float]) -> list[Event]:
    """Where two roots meet on the axis, of an undamped system whose real matrices depend on the
    frequency of each root.

    With matrices frozen at omega they meet at a frequency omega_c(omega), and with matrices at
    their own frequency where omega_c(omega) = omega. The secant method solves this from each of the
    frequencies of the frozen parts. Meetings at the frequency 0 are static and left out.
    """
    low = values[0]
    high = values[-1]
    meetings: list[Event] = []
    for part in _frozen_parts(reduction):
        for event in itertools.chain(*search(part.path_reduction.system, low, high).clusters):
            is_near_part = abs(event.omega - part.omega) <= part.spacing
            if not event.omega or not is_near_part:
                continue
            meeting = _at_own_frequency(reduction.system, event, part.omega, low, high)
            if meeting and not any(_is_same_meeting(meeting, other) for other in meetings):
                meetings.append(replace(meeting, residual=reduction.worst_residual))
    return sorted(meetings, key=lambda meeting: meeting.value)


def _is_same_meeting(one: Event, other: Event) -> bool:
    return (
        abs(one.value - other.value) <= SAME_SHARE * abs(one.value)
        and abs(one.omega - other.omega) <= SAME_SHARE * one.omega
    )


def _at_own_frequency(
    system: System, start: Event, frozen: float, low: float, high: float
) -> Event | None:
    """The coalescence with matrices at its own frequency, from one with matrices frozen at another.

    By the secant method on the excess omega_c(omega) - omega; None if it does not converge, or if
    no coalescence is located at one of its steps. `start` was located with matrices at `frozen`
    (rad/s), in the range from `low` to `high` of the parameter.
    """
    event = start
    omega_before = frozen
    excess_before = event.omega - frozen
    omega = event.omega  # where the matrices are frozen next
    for _ in range(NEWTON_STEPS):
        continuation = Continuation(system.frozen(omega), low, high)
        spectrum = continuation.at(event.value)  # its roots are omega^2, of the undamped system
        pair = np.argsort(np.abs(spectrum.z - event.omega**2))[:2]
        guess = meeting_at(spectrum, pair, width=high - low)
        meeting = locate_event(continuation, guess)
        if meeting is None or not meeting.omega:
            return None
        event = meeting
        excess = event.omega - omega
        if abs(excess) <= CONVERGED_STEP * omega:
            return event
        # to the zero of the line through the last two excesses
        step = excess * (omega - omega_before) / (excess_before - excess)
        omega_before = omega
        excess_before = excess
        omega = omega + step
    return None


def _in_range(crossing: AxisCrossing, low: float, high: float) -> AxisCrossing | None:
    """A crossing within a range of the parameter, None if it lies outside.

    It is placed at an end of the range if its interval holds that.
    """
    first, last = crossing.interval
    if first <= low <= last:
        if crossing.direction <= 0:  # it grows nowhere in the range
            return None
        return replace(crossing, value=low, interval=(low, last))
    if first <= high <= last:
        return replace(crossing, value=high)
    if low <= crossing.value <= high:
        return crossing
    return None


def _is_same(one: AxisCrossing, other: AxisCrossing) -> bool:
    """Whether two crossings agree in parameter, frequency and mode."""
    distance = SAME_SHARE * max(abs(one.value), abs(other.value)) + one.width + other.width
    return bool(
        abs(one.value - other.value) <= distance
        and abs(one.omega - other.omega) <= SAME_SHARE * max(one.omega, other.omega)
        and abs(np.vdot(one.right, other.right)) > 0.5
    )


def axis_crossing(scaled: ScaledSystem, name: str, guess: CrossingGuess) -> AxisCrossing:
    """The crossing of the imaginary axis next to a guess, along the parameter `name`.

    Newton's method for the parameter and omega with y^H P x = 0 alternates with inverse iteration
    for the vectors x, y; its factor serves several steps by residual inverse iteration (Neumaier
    1985). Raises ComputationError if it does not converge (no crossing is near, or
    two coincide).
    """
    value = guess.value
    omega = guess.omega
    x = guess.right / np.linalg.norm(guess.right)
    y = guess.left / np.linalg.norm(guess.left)
    for k in range(NEWTON_STEPS):
        problem = scaled.at({name: value, **scaled.system.frequency(omega)})
        if k % STEPS_PER_FACTOR == 0:
            _, factor = factorise_at(problem, complex(0.0, omega))
            right = factor.solve(y)
            left = factor.solve(x.conj(), transposed=True).conj()
        else:  # with the factor of an earlier step
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
    is_converged: bool  # True if the step is rounding


def _newton_step(scaled: ScaledSystem, name: str, guess: CrossingGuess) -> _NewtonStep | None:
    """One step of Newton's method on y^H P(i omega, p) x = 0 for p and omega.

    Its real and imaginary part are two equations, the derivatives by omega and p the columns of
    their Jacobian (2, 2). The guess has unit vectors x, y (n,). The crossing has its value, omega
    and interval after the step; its residual, slope and vectors are of the guess. None where the
    Jacobian is singular.
    """
    system = scaled.system
    p = guess.value
    omega = guess.omega
    x = guess.right
    y = guess.left.conj()
    root = complex(0.0, omega)
    parameters = {name: p, **system.frequency(omega)}
    problem = scaled.at(parameters)
    image = problem.apply(np.array([root]), x[:, None])[:, 0]
    product = complex(y @ image)
    by_root = y @ (problem.slope(root) @ x)
    by_parameter = y @ (scaled.slope(name, parameters, root) @ x)
    # y^H dP/domega x of matrices that depend on the frequency of the root: the parameters that hold
    # the frequency are proportional to omega, so that their values at 1 rad/s are their derivatives
    by_frequency = 0j
    for frequency, d_by_omega in system.frequency(1.0).items():
        derivative = scaled.slope(frequency, parameters, root)
        by_frequency = by_frequency + d_by_omega * (y @ (derivative @ x))
    columns = [1j * by_root + by_frequency, by_parameter]
    if omega == 0.0:
        # a real root stays real, and y^H P x is real. The first row becomes domega = 0, the second
        # one that real equation for dp
        columns = [1.0, 1j * by_parameter.real]
        product = complex(0.0, product.real)
    jacobian = np.array([np.real(columns), np.imag(columns)])
    sizes = np.abs(jacobian).max(axis=0)  # of the columns, whose units differ
    if not (sizes.all() and np.linalg.cond(jacobian / sizes) <= 1e12):
        return None
    inverse = np.linalg.inv(jacobian / sizes) / sizes[:, None]
    omega_step, step = (-inverse @ [product.real, product.imag]).tolist()
    size = float(problem.size(np.array(root)))
    # how far rounding of P x, in either equation, may move p, the second unknown
    uncertain = 2 * EPS * size * float(np.abs(inverse[1]).sum())
    new_p = p + step
    new_omega = omega + omega_step
    is_small = abs(step) <= CONVERGED_STEP * max(abs(new_p), abs(p) or 1.0)
    is_small &= abs(omega_step) <= CONVERGED_STEP * max(abs(new_omega), 1.0)
    if system.follows:  # tables of moduli end
        least, most = system.covered  # Hz
        new_omega = min(max(new_omega, 2 * math.pi * least), 2 * math.pi * most)
    slope = _growth_slope(by_root, by_parameter, by_frequency)
    half_width = uncertain + abs(step) + 2 * EPS * abs(new_p)
    crossing = AxisCrossing(
        value=new_p,
        omega=abs(new_omega),
        direction=1 if slope > 0 else -1,
        interval=(new_p - half_width, new_p + half_width),
        residual=float(np.linalg.norm(image) / size),
        slope=slope,
        right=x,
        left=guess.left,
    )
    return _NewtonStep(crossing, bool(is_small or abs(step) <= uncertain))


def _growth_slope(by_root: complex, by_parameter: complex, by_frequency: complex) -> float:
    """d Re z/dp of a root z, from the derivatives of y^H P x by z, by p and by omega = Im z.

    by_root dz + by_parameter dp + by_frequency domega = 0: the parameter moves the root, and its
    frequency the matrices, which move it again.
    """
    direct = -by_parameter / by_root
    by_own_frequency = -by_frequency / by_root
    frequency_slope = direct.imag / (1.0 - by_own_frequency.imag)  # domega/dp
    return float((direct + by_own_frequency * frequency_slope).real)
