"""The real modes behind growing ones, and what would stop all of these: separation, or damping.

Separation adds (w^2 - w_2^2) M x x' M to K, which raises the upper mode of two alone to w; damping
adds 2 zeta w M x x' M to C. Both leave all other real modes y of the structure as they are, since
y' M x = 0 and x' M x = 1. Real modes at which the modes of a chart that meet begin are tried first,
then pairs of the three that take part most in the growing mode: the first with which most is known
to stop all. A real mode behind several growing ones gets the largest of what these need.

What is just enough is the least at the present value of the parameter, of more than `DENSE_ROWS`
rows on a basis of modes. What is advised is a tenth more at least, and enough for a tenth more of
the parameter. It is confirmed as it is told: for all modes at once, with the full matrices, at
all values up to there. Where something grows at one of these that value is taken along.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear import UnstableMode
from squeal.linear.damping import bordered, structure_stiffness
from squeal.linear.functions import SystemFunction, matrices_of
from squeal.linear.matrices import MCK, Array, Matrix, dense, divisor, is_sparse
from squeal.linear.real_modes import real_modes
from squeal.linear.roots import ComplexArray
from squeal.linear.system import System, Term, TermSystem
from squeal.linear.verdicts import assumed_rounding, is_undamped
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.energy import pad_terms
from squeal.queries.mode_paths import Paths
from squeal.queries.options import Band
from squeal.queries.pads.equilibrium import analyse, branch_system
from squeal.queries.remedies import (
    IN_HAND,
    Effect,
    growing_within,
    loss_of,
    rounded,
    selected_roots,
    upper_growing,
)
from squeal.queries.systems.all_roots import in_band, is_small
from squeal.queries.thresholds import pad_thresholds, thresholds
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sources import PadSource, SystemSource
from squeal.results.thresholds import Thresholds
from squeal.sparse.dense import dense_values
from squeal.sparse.factor import factorise

DENSE_ROWS = 40  # up to which all roots are computed for each change
NEAR = 12  # real modes around a growing one
ROOTS = 16  # whose vectors make a basis
PARTNER = 0.02  # of the participation of the leading real mode: what a second one has at least
SAME = 1e-4  # of the frequency: real modes that a page does not tell apart
SAME_START = 1e-3  # of the frequency: so near is a mode of the chart to its real mode
NOTHING = 1e-7  # of a cosine, and of singular values: rounding
LEAST = 2.0**-17  # of the frequency, or of critical damping: the first change that is tried
MOST = 0.25  # and the last one
BISECTIONS = 8  # of a factor of two: amounts have two digits
RETRIES = 8  # of what is not confirmed: with one value more, or with 5 % more


class Cure(Enum):
    """What is done to the real modes behind a growing one."""

    APART = "further apart"
    BOTH = "all damped"
    LOWER = "the lower one damped"
    UPPER = "the upper one damped"


SIDES = (Cure.LOWER, Cure.UPPER)
DAMPED = {Cure.BOTH: (1.0, 1.0), Cure.LOWER: (1.0, 0.0), Cure.UPPER: (0.0, 1.0)}


@dataclass(frozen=True, eq=False)
class Meeting:
    """Two real modes that feed a growing one, or the one that grows alone, and what stops it.

    Attributes
    ----------
    omega : array (k,)
        Their angular frequencies without friction and damping, rising, rad/s; of one frequency,
        as printed, all real modes.
    is_upper : array (k,)
        Which are the upper one of two.
    indices : tuple of k int
        Which they are among the real modes behind all growing ones.
    cures : mapping
        What just stops all growing modes at the present value of the parameter, if each of them
        gets the same kind: of `APART` how much further apart the two must be, Hz, of the others how
        much more damping is needed, as a share of critical damping; 0 where the cures of other
        modes stop this one too. What is not enough up to `MOST` is missing.
    advised : mapping
        `IN_HAND` times as much or more of each kind that is confirmed for all values up to
        `IN_HAND` times the present one, else up to that one, else at that value.
    is_of_chart : bool
        Whether the modes of the chart that meet begin at these frequencies.
    """

    omega: Array
    is_upper: Array
    indices: tuple[int, ...]
    cures: Mapping[Cure, float]
    advised: Mapping[Cure, float]
    is_of_chart: bool = False

    @property
    def hertz(self) -> tuple[float, ...]:
        """Their frequencies without friction and damping."""
        hertz = [float(self.omega[0] / math.tau)]
        if self.is_pair:
            hertz.append(float(self.omega[-1] / math.tau))
        return tuple(hertz)

    @property
    def is_pair(self) -> bool:
        """Whether two real modes feed the growing one."""
        return bool(self.is_upper.any())

    @property
    def alone(self) -> Cure | None:
        """Which mode, damped alone, is known to stop growth; None if neither is. Of two that do it
        is the one that needs less."""
        sides = {}
        upper = int(np.sum(self.is_upper))
        for side, count in ((Cure.LOWER, len(self.omega) - upper), (Cure.UPPER, upper)):
            # of one frequency any direction in their plane is a mode
            if count == 1 and side in self.advised:
                sides[side] = self.advised[side]
        return min(sides, key=sides.__getitem__, default=None)

    def unit(self, cure: Cure) -> float:
        """What a share of a cure is a share of: the upper frequency in Hz, or critical damping."""
        return self.hertz[-1] if cure is Cure.APART else 1.0

    def added(self, cure: Cure, amount: float) -> Array:
        """The factors (k,) of M x x' M of the modes, by which K or C changes with a cure."""
        if cure is Cure.APART:
            raised = self.omega + math.tau * amount * self.is_upper
            return raised**2 - self.omega**2
        return 2.0 * amount * self.omega * np.array(DAMPED[cure])[self.is_upper.astype(int)]


class MeetingSearch(NamedTuple):
    """The real modes behind growing modes, by the numbers of these; what separation and damping do
    where they are known to stop all, as advised; and with which kinds of cure something grows at
    lower values of the parameter."""

    meetings: Mapping[int, Meeting]
    treatments: Mapping[Cure, Effect]
    with_window: Sequence[Cure] = ()


def find_meetings(
    spectrum: Eigenvalues,
    options: Mapping[str, object],
    low: float = 0.0,
    high: float = 0.0,
    paths: Paths | None = None,
    options_of_losses: Mapping[str, object] | None = None,
) -> MeetingSearch:
    """The real modes behind each growing mode, with what stops all growing modes.

    Empty where matrices follow the frequency, or the mass is complex. A growing mode of which no
    real mode is known, such as one that does not oscillate, is left out, and the others have no
    cures then; nor have they where a computation fails.

    Parameters
    ----------
    spectrum : Eigenvalues
        Roots with vectors.
    options : mapping
        Of `eigenvalues`: band, memory, progress.
    low, high : float
        The range of the parameter: nothing may grow from its lower end to the present value, and
        beyond that the next loss of stability is searched up to its upper end.
    paths : Paths, optional
        The modes of a chart, with the numbers of those of `spectrum`: which of them meet.
    options_of_losses : mapping, optional
        Of `thresholds` with a cure; those of `eigenvalues` if left out.
    """
    meetings: dict[int, Meeting] = {}
    treatments: dict[Cure, Effect] = {}
    with_window: list[Cure] = []
    with suppress(InputError, ComputationError):
        of_losses = options_of_losses or options
        problem = _Problem(spectrum, options, of_losses, low, max(high, spectrum.value))
        candidates: dict[int, list[Meeting]] = {}
        for mode in spectrum.unstable:
            number_of_mode = spectrum.mode_of(mode)
            starts: list[float] = []
            if paths is not None:
                starts = paths.starts(paths.group_of(number_of_mode))
            of_mode = problem.candidates(mode, starts)
            if of_mode and number_of_mode is not None:
                candidates[number_of_mode] = of_mode
                meetings[number_of_mode] = of_mode[0]
        if candidates and len(candidates) == len(spectrum.unstable):
            meetings = problem.cured(candidates)
            with_window = problem.cures_with_window()
            for cure in (Cure.APART, Cure.BOTH):
                if cure in problem.searched:
                    with suppress(InputError, ComputationError):  # the other kind may be known
                        treatments[cure] = problem.effect(cure)
    return MeetingSearch(meetings, treatments, with_window)


Cures = Mapping[int, Cure]
"""What is done for each growing mode, by its number."""
Amounts = Mapping[int, float]
"""How much of that, in Hz or as a share of critical damping."""


class _Confirmed(NamedTuple):
    """How much of a kind of cure is just enough at the present value, and how much is advised; the
    thresholds with that, None where none were searched; whether it is advised at that value alone,
    else up to which value.
    """

    enough: Amounts
    advised: Amounts
    answer: Thresholds | None
    is_alone: bool
    end: float

    def holds_as_far_as(self, other: _Confirmed) -> bool:
        """Whether it is advised for as many values as another."""
        return other.is_alone or (self.end >= other.end and not self.is_alone)


class _Problem:
    """Matrices over the own parameter, the structure without friction and its modes."""

    def __init__(
        self,
        spectrum: Eigenvalues,
        options: Mapping[str, object],
        options_of_losses: Mapping[str, object],
        low: float,
        high: float,
    ) -> None:
        self.spectrum = spectrum
        self.options = options
        self.options_of_losses = options_of_losses
        self.high = high
        source = spectrum.source
        assert source is not None
        self.band: Band | None = None
        self.matrices = self._matrices_at(spectrum.value)
        if isinstance(source, PadSource):
            assert source.analysis is not None
            terms = pad_terms(source.scene, source.analysis)
            self.structure: Matrix = sum(term.matrix for term in terms if term.role == "stiffness")
        else:
            system = source.file.system
            self.band = source.selection.band
            if np.iscomplexobj(self.matrices[0]):
                raise InputError("the mass is complex")
            self.structure, _ = structure_stiffness(system)
        self.is_reduced = self.structure.shape[0] > DENSE_ROWS
        self.searches_thresholds = low < spectrum.value and spectrum.depends
        self.meetings: dict[int, Meeting] = {}
        self.searched: dict[Cure, _Confirmed] = {}
        self.forces: list[Array] = []  # of each real mode behind a growing one
        self.basis: Array | None = None
        self.shapes: list[Array] = []  # columns (n, k) of real modes around growing ones
        self.projected: dict[float, MCK] = {}
        self.is_undamped: dict[float, bool] = {}  # by the value of the parameter
        self.outside: dict[float, int] = {}  # how many modes grow outside of the band

    def candidates(self, mode: UnstableMode, starts: Sequence[float]) -> list[Meeting]:
        """The real modes that may be behind a growing one, the likeliest first; empty if it does
        not vibrate.

        First come those at which the chart's modes that meet begin (`starts`, rad/s), then the two
        with the largest shares, then either of these and the third.
        """
        M = self.matrices[0]
        if not mode.frequency_hz:
            return []
        omega, shapes = _modes_near(self.structure, M, mode.root.imag)
        self.shapes.append(shapes[:, np.argsort(abs(omega - mode.root.imag))[:NEAR]])
        forces = M @ shapes
        nearest = int(abs(self.spectrum.values - mode.root).argmin())
        root = self.spectrum.eigenvalues[nearest]
        # participation factors: of a real mode in the right vector times in the left one
        left = root.left if len(root.left) else root.right
        shares = abs(forces.T @ root.right) * abs(forces.T @ left)
        largest = np.argsort(-shares)[:3]
        largest = largest[shares[largest] >= PARTNER * shares[largest[0]]]
        choices = list(itertools.combinations(largest.tolist(), min(2, len(largest))))
        chart = tuple(int(abs(omega - start).argmin()) for start in starts)
        if not np.allclose(omega[list(chart)], starts, SAME_START):
            chart = ()
        # first of all growing modes alike: a choice is one for all of them
        choices.insert(0, chart if len(chart) == 2 else choices[0])
        meetings = []
        for choice in choices:
            meeting = self._meeting(omega, forces, sorted(choice))
            if meeting.omega.all():  # a free motion has no frequency to separate or damp
                is_of_chart = set(choice) == set(chart)
                meetings.append(replace(meeting, is_of_chart=is_of_chart))
        return meetings

    def _meeting(self, omega: Array, forces: Array, leading: Sequence[int]) -> Meeting:
        """The meeting of one or two real modes, by their indices in rising order, and of all others
        of the same frequencies."""
        lower = omega[leading[0]]
        upper = omega[leading[-1]]
        is_upper = abs(omega - upper) <= SAME * upper
        is_lower = abs(omega - lower) <= SAME * lower
        behind = np.flatnonzero(is_lower | is_upper)
        if is_upper[leading[0]]:  # of one frequency, where no direction of motion is one mode's own
            is_upper = np.zeros(len(omega), dtype=bool)
        indices = tuple(self._index(forces[:, k]) for k in behind.tolist())
        return Meeting(omega[behind], is_upper[behind], indices, {}, {})

    def _index(self, force: Array) -> int:
        """The number of a real mode, which another growing mode may have too."""
        for k, known in enumerate(self.forces):
            cosine = known @ force / (np.linalg.norm(known) * np.linalg.norm(force))
            if abs(cosine) > 1.0 - NOTHING:
                return k
        self.forces.append(force)
        return len(self.forces) - 1

    def cured(self, candidates: Mapping[int, Sequence[Meeting]]) -> dict[int, Meeting]:
        """Growing modes with the confirmed cures, one kind for all of them; of damping one of two
        modes alone, where several grow, that which needs less.

        Of the candidates the first are taken with which most cures are known: one up to the present
        value counts twice as much as one at that value alone.
        """
        best: dict[int, Meeting] = {}
        searched: dict[Cure, _Confirmed] = {}
        most = -1
        tried: set[tuple[tuple[int, ...], ...]] = set()
        for choice in range(max(map(len, candidates.values()))):
            for mode, meetings in candidates.items():
                self.meetings[mode] = meetings[min(choice, len(meetings) - 1)]
            indices = tuple(meeting.indices for meeting in self.meetings.values())
            if indices in tried:
                continue
            tried.add(indices)
            self._start_anew()
            are_pairs = all(meeting.is_pair for meeting in self.meetings.values())
            self._take(dict.fromkeys(candidates, Cure.BOTH))
            if are_pairs:
                self._take(dict.fromkeys(candidates, Cure.APART))
            known = sum(2 - confirmed.is_alone for confirmed in self.searched.values())
            if known > most:
                most = known
                best = dict(self.meetings)
                searched = self.searched
            if known == 4:
                break
        self.meetings = best
        self._start_anew()
        self.searched = searched
        if all(meeting.is_pair for meeting in best.values()) and Cure.BOTH in searched:
            if len(best) == 1:
                for side in SIDES:
                    self._take(dict.fromkeys(best, side))
            else:
                self._take(self._sides())
        return self.meetings

    def _start_anew(self) -> None:
        """Make the basis of the present meetings, with nothing known on it."""
        self.basis = self._basis()
        self.projected = {}
        self.outside = {}
        self.searched = {}

    def cures_with_window(self) -> list[Cure]:
        """The kinds of cure with which something grows at a value up to the present one."""
        cures = []
        for cure, confirmed in self.searched.items():
            answer = confirmed.answer
            if answer is not None and loss_of(answer, answer.high).limit() <= self.spectrum.value:
                cures.append(cure)
        return cures

    def effect(self, cure: Cure) -> Effect:
        """What as much of a cure as is advised does."""
        confirmed = self.searched[cure]
        answer = confirmed.answer
        added = self._added(dict.fromkeys(confirmed.advised, cure), confirmed.advised)
        changed = self._changed(self._columns(added), cure is Cure.APART)
        present = self.spectrum.value
        roots = selected_roots(answer, changed, present, self.options)
        loss = None if answer is None else loss_of(answer, answer.high)
        return Effect(self.spectrum, present, roots, loss)

    def _take(self, cures: Cures) -> None:
        """Take cures into the meetings, where they are confirmed: of one mode of each pair if they
        stop growth at as many values as damping of both does."""
        confirmed = self._confirmed(cures)
        if confirmed is None:
            return
        of_both = self.searched.get(Cure.BOTH, confirmed)
        if Cure.APART not in cures.values() and not confirmed.holds_as_far_as(of_both):
            return
        for mode, cure in cures.items():
            self.searched[cure] = confirmed
            meeting = self.meetings[mode]
            self.meetings[mode] = replace(
                meeting,
                cures={**meeting.cures, cure: confirmed.enough[mode]},
                advised={**meeting.advised, cure: confirmed.advised[mode]},
            )

    def _sides(self) -> dict[int, Cure]:
        """Which of two modes is damped alone: for one growing mode after another that which needs
        less, while the others have what they need; empty where neither is enough."""
        chosen = dict.fromkeys(self.meetings, Cure.BOTH)
        shares = {mode: meeting.cures[Cure.BOTH] for mode, meeting in self.meetings.items()}
        for mode in self.meetings:
            needed = {}
            for side in SIDES:
                sides = {**chosen, mode: side}
                needed[side] = self._least_of(mode, sides, shares, [self.spectrum.value], MOST)
            chosen[mode] = min(SIDES, key=needed.__getitem__)
            shares[mode] = needed[chosen[mode]]
            if shares[mode] == math.inf:
                return {}
        return chosen

    def _confirmed(self, cures: Cures) -> _Confirmed | None:
        """How much of cures is just enough at the present value, and how much is confirmed, up to
        as many values as possible; None if nothing is known to be enough."""
        present = self.spectrum.value
        shares = self._least(cures, [present])
        # by rounding nothing may grow on the basis even without cures: no share says enough
        if math.inf in shares.values() or not any(shares.values()):
            return None
        enough = self._rounded(cures, shares)
        ends = [present]
        if self.searches_thresholds and present > 0.0:
            ends.insert(0, IN_HAND * present)
        at_present: _Confirmed | None = None
        for end in ends:
            with suppress(InputError, ComputationError, ArithmeticError):  # no brake at the end
                confirmed = self._confirmed_up_to(end, cures, enough)
                if confirmed is not None and not confirmed.is_alone:
                    return confirmed
                at_present = at_present or confirmed
        return at_present

    def _confirmed_up_to(self, end: float, cures: Cures, enough: Amounts) -> _Confirmed | None:
        """How much of cures is confirmed at all values up to an end, the present one or above, else
        at the present one alone.

        Amounts are the least at `values`, and `IN_HAND` times what is just `enough`. If something
        still grows at a value not among them, that value is added; if at one of them (by rounding,
        or because the basis misses it), the factor on all amounts rises by 0.05. None if neither is
        confirmed in `RETRIES` tries.
        """
        present = self.spectrum.value
        values = list(dict.fromkeys((present, end)))
        at_present: _Confirmed | None = None
        more = 1.0
        for _ in range(RETRIES):
            shares = self._least(cures, values)
            if math.inf in shares.values():
                break
            for mode, amount in enough.items():
                least = IN_HAND * amount / self.meetings[mode].unit(cures[mode])
                shares[mode] = max(shares[mode], least)
            advised = self._rounded(cures, shares, more)
            refuted_at, answer = self._refuted(cures, advised, values)
            confirmed = _Confirmed(enough, advised, answer, refuted_at is not None, end)
            if refuted_at is None:
                return confirmed
            if refuted_at in values:
                more += 0.05
                continue
            values.append(refuted_at)
            if at_present is None and not self._grows_in_full(cures, advised):
                at_present = confirmed
        return at_present

    def _rounded(self, cures: Cures, shares: Amounts, more: float = 1.0) -> dict[int, float]:
        """The amounts of `more` times so many shares, rounded up to two digits."""
        amounts = {}
        for mode, share in shares.items():
            amount = more * share * self.meetings[mode].unit(cures[mode])
            amounts[mode] = float(rounded(amount, 2, math.ceil))
        return amounts

    def _least(self, cures: Cures, values: Sequence[float]) -> dict[int, float]:
        """The least share of each cure with which nothing grows at some values: the same share of
        all, then less for one after another, that of the fastest mode last."""

        def stops_all(share: float) -> bool:
            return self._stops(cures, dict.fromkeys(cures, share), values)

        shares = dict.fromkeys(cures, _least_share(stops_all, MOST))
        if len(shares) > 1 and math.inf not in shares.values():
            for mode in reversed(shares):
                shares[mode] = self._least_of(mode, cures, shares, values, shares[mode])
        return shares

    def _least_of(
        self, mode: int, cures: Cures, shares: Amounts, values: Sequence[float], most: float
    ) -> float:
        """The least share of the cure of one mode, while the others have theirs."""

        def stops_all(share: float) -> bool:
            return self._stops(cures, {**shares, mode: share}, values)

        return _least_share(stops_all, most)

    def _stops(self, cures: Cures, shares: Amounts, values: Sequence[float]) -> bool:
        """Whether nothing grows with so much of cures at some values, on the basis."""
        amounts = {}
        for mode, cure in cures.items():
            amounts[mode] = shares[mode] * self.meetings[mode].unit(cure)
        added = self._added(cures, amounts)
        of_stiffness = Cure.APART in cures.values()
        return not any(self._grows(value, of_stiffness, added) for value in values)

    def _added(self, cures: Cures, amounts: Amounts) -> Array:
        """The factors of M x x' M of all real modes, by which K or C changes with cures: of a real
        mode in several the largest."""
        largest = np.zeros(len(self.forces))
        for mode, cure in cures.items():
            meeting = self.meetings[mode]
            indices = list(meeting.indices)
            largest[indices] = np.maximum(largest[indices], meeting.added(cure, amounts[mode]))
        return largest

    def _grows(self, value: float, of_stiffness: bool, added: Array) -> bool:
        """Whether something of the band grows at a value, or was but moved out of the band: then
        more grows outside of it than without the change."""
        roots = self._growing(value, of_stiffness, added)
        if value not in self.outside:
            unchanged = self._growing(value, of_stiffness, np.zeros_like(added))
            self.outside[value] = len(unchanged) - len(in_band(unchanged, self.band))
        return len(in_band(roots, self.band)) > 0 or len(roots) > self.outside[value]

    def _growing(self, value: float, of_stiffness: bool, added: Array) -> ComplexArray:
        """The growing roots with Im >= 0 on the basis, with factors (k,) of M x x' M added to K or
        to C."""
        M, C, K = self._matrices_on_basis(value)
        U = np.array(self.forces).T  # columns M x
        if self.basis is not None:
            U = self.basis.T @ U
        change = (U * added) @ U.T
        if of_stiffness:
            K = K + change
        elif added.any():
            C = _sum(C, change)
        nothing_damps = self.is_undamped[value] and (of_stiffness or not added.any())
        roots = dense_values(M, C, K)
        return upper_growing(roots, assumed_rounding(roots, nothing_damps))

    def _matrices_on_basis(self, value: float) -> MCK:
        """The matrices at a value of the parameter, of many rows projected onto the basis."""
        if value not in self.projected:
            M, C, K = self._matrices_at(value)
            self.is_undamped[value] = is_undamped(M, C, K)
            if C is not None:
                C = self._on_basis(C)
            self.projected[value] = (self._on_basis(M), C, self._on_basis(K))
        return self.projected[value]

    def _on_basis(self, matrix: Matrix) -> Array:
        """A matrix (n, n) projected onto the basis; itself without one."""
        if self.basis is None:
            return dense(matrix)
        return np.asarray(self.basis.T @ (matrix @ self.basis))

    def _matrices_at(self, value: float) -> MCK:
        """The matrices at a value of the parameter."""
        source = self.spectrum.source
        if isinstance(source, PadSource):
            M, C, K = analyse(source.scene.replace(mu=value)).matrices
            return M, C, K
        assert source is not None
        return source.file.system.at({self.spectrum.parameter: value})

    def _refuted(
        self, cures: Cures, amounts: Amounts, values: Sequence[float]
    ) -> tuple[float | None, Thresholds | None]:
        """A value at which something grows with cures, with the full matrices: one of some values,
        or one below; None if nothing does. Then the thresholds, None where none were searched."""
        of_stiffness = Cure.APART in cures.values()
        added = self._added(cures, amounts)
        for value in values:
            if self._grows(value, of_stiffness, added):
                return value, None
        if not self.searches_thresholds:
            grows = self._grows_in_full(cures, amounts)
            return (self.spectrum.value if grows else None), None
        answer = self._thresholds(self._columns(added), of_stiffness, max(self.high, *values))
        refuted_at: float | None = None
        for middle in growing_within(answer, max(values)):
            # so little growth as rounding could make of undamped modes is none
            if self.is_reduced or self._grows(middle, of_stiffness, added):
                refuted_at = middle
        return refuted_at, answer

    def _grows_in_full(self, cures: Cures, amounts: Amounts) -> bool:
        """Whether something grows at the present value with cures in a system of many rows."""
        if not self.is_reduced:
            return False
        columns = self._columns(self._added(cures, amounts))
        changed = self._changed(columns, Cure.APART in cures.values())
        return bool(eigenvalues(changed, prove=False, **self.options).unstable)  # type: ignore[arg-type]

    def _columns(self, added: Array) -> Array:
        """U (n, k) of the change U U' with the factors (k,) of M x x' M of all real modes."""
        return np.array(self.forces).T * np.sqrt(added)

    def _changed(self, columns: Array, of_stiffness: bool) -> TermSystem:
        """The system with U U' added to C, or to K; a pad at the present value."""
        if isinstance(self.spectrum.source, SystemSource):
            system: System = self.spectrum.source.file.system
        else:
            system = System(*self.matrices)
        if not is_small(system):
            return bordered(system, columns[:, columns.any(axis=0)], of_stiffness)
        term = Term(columns @ columns.T)
        if of_stiffness:
            return replace(system, K=(*system.K, term))
        return replace(system, C=(*system.C, term))

    def _thresholds(self, columns: Array, of_stiffness: bool, high: float) -> Thresholds:
        """The changes of verdict up to a value, of the system or pad with U U' added."""
        source = self.spectrum.source
        if not isinstance(source, PadSource):
            changed = self._changed(columns, of_stiffness)
            return thresholds(changed, high, prove=False, **self.options_of_losses)  # type: ignore[arg-type]
        change = columns @ columns.T
        unchanged, path = branch_system(source.scene, high)
        changed_pad = _ChangedPad(unchanged, change, of_stiffness)
        return pad_thresholds(source.scene, high, changed_pad, path, step_ends=())

    def _basis(self) -> Array | None:
        """Real orthonormal columns (n, k); None where nothing is reduced, as of few rows.

        They span the real modes that were looked at, and the vectors of the `ROOTS` complex roots
        nearest to each meeting.
        """
        if not self.is_reduced:
            return None
        blocks = list(self.shapes)  # of columns
        chosen = set()
        for meeting in self.meetings.values():
            omega = float(meeting.omega.mean())
            chosen.update(np.argsort(abs(self.spectrum.values - 1j * omega))[:ROOTS].tolist())
        for k in sorted(chosen):
            root = self.spectrum.eigenvalues[k]
            for vector in (root.right, root.left):
                if len(vector):
                    blocks.append(np.array([vector.real, vector.imag]).T)
        together = np.hstack(blocks)
        left, sizes, _ = np.linalg.svd(
            together / divisor(np.linalg.norm(together, axis=0)), full_matrices=False
        )
        return left[:, sizes > NOTHING * sizes[0]]


@dataclass(frozen=True, eq=False)
class _ChangedPad:
    """M, C, K of a pad over mu, with a change (3, 3) of C, or of K."""

    unchanged: SystemFunction
    change: Array
    of_stiffness: bool

    def __call__(self, mu: float) -> MCK:
        return self.many([mu])[0]

    def many(self, mus: Sequence[float]) -> list[MCK]:
        """The matrices at each mu, which together take hardly longer than one."""
        changed: list[MCK] = []
        for M, C, K in matrices_of(self.unchanged, mus):
            if self.of_stiffness:
                changed.append((M, C, K + self.change))
            else:
                changed.append((M, C + self.change, K))
        return changed


def _sum(matrix: Matrix | None, change: Array) -> Matrix:
    """A matrix, None where it is zero, and its change."""
    return change if matrix is None else matrix + change


def _least_share(holds: Callable[[float], bool], most: float) -> float:
    """The least share up to `most` for which a condition holds, infinite if none is seen.

    0 is tried first, then `LEAST` and each time the double; the first step that holds is bisected.
    """
    low = high = 0.0
    while not holds(high):
        if high >= most:
            return math.inf
        low = high
        high = min(max(2.0 * high, LEAST), most)
    if high == 0.0:
        return high
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        if holds(middle):
            high = middle
        else:
            low = middle
    return high


def _modes_near(K: Matrix, M: Matrix, omega: float) -> tuple[Array, Array]:
    """The real modes nearest to an angular frequency: omega (k,) rising, and shapes (n, k)."""
    n = K.shape[0]
    if n <= NEAR or not is_sparse(K):  # of few rows: all modes
        return real_modes(dense(K), dense(M), n, None)
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

    shift = omega**2
    try:
        inverse = LinearOperator(
            (n, n), matvec=factorise((K - shift * M).tocsc()).solve, dtype=float
        )
        start = np.random.default_rng(0).standard_normal(n)
        squares, shapes = eigsh(K, NEAR, M, shift, OPinv=inverse, v0=start)
    except (ArpackError, ArithmeticError, RuntimeError) as error:
        raise ComputationError(f"real modes near {omega / math.tau:g} Hz: {error}") from None
    order = np.argsort(squares)
    return np.sqrt(np.maximum(squares[order], 0.0)), shapes[:, order]
