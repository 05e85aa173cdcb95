"""What would stop all growing modes: separation of the real modes behind them, or their damping.

Separation adds (w_2^2 - w^2) M x x' M to K, which raises the upper mode of two from w to w_2 alone;
damping adds 2 zeta w M x x' M to C. Two eigenvalue paths over the free parameter meet where flutter
begins: the real modes at which these paths begin are tried first, then pairs of the three that take
part most in the growing mode. The first choice with which most cures are confirmed is taken. A real
mode behind several growing ones gets the largest amount that these need.

What is just enough is the least at the present value of the free parameter, of many rows on a
basis of modes. What is advised is a tenth more at least, and enough for a tenth more of the
parameter. It is confirmed as it is advised: for all modes at once, with the full matrices, at all
values up to there. If something grows at one of these, that value joins those at which amounts are
searched.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.queries.mode_paths import Paths
from squeal.queries.remedies.changes import IN_HAND, Brake, Effect, loss_of, rounded
from squeal.queries.remedies.meetings import SIDES, Cure, Meeting
from squeal.queries.remedies.treated import TreatedBrake, Treatment
from squeal.results.thresholds import Thresholds

LEAST = 2.0**-17  # of the frequency, or of critical damping: the first change that is tried
MOST = 0.25  # and the last one
BISECTIONS = 8  # of a factor of two: amounts have two digits
RETRIES = 8  # of what is not confirmed: with one value more, or with 5 % more

Cures: TypeAlias = Mapping[int, Cure]
"""The kind of cure for each growing mode, by its number."""
Shares: TypeAlias = Mapping[int, float]
"""For each growing mode how much of its cure, as a share of the upper frequency or of critical
damping."""
Amounts: TypeAlias = Mapping[int, float]
"""The same in Hz, or as a share of critical damping."""


class MeetingSearch(NamedTuple):
    """The real modes behind growing modes, and what stops all growth.

    meetings: by the number of the growing mode; treatments: what separation and damping do as
    advised, of the kind that is known to stop all; growing_below: the kinds of cure with which
    something grows at lower values of the free parameter.
    """

    meetings: Mapping[int, Meeting]
    treatments: Mapping[Cure, Effect]
    growing_below: Sequence[Cure]


def find_meetings(
    brake: Brake,
    paths: Paths,
) -> MeetingSearch:
    """The real modes behind each growing mode, with what stops all growing modes.

    Empty where matrices follow the frequency, or the mass is complex. A growing mode of which no
    real mode is known, such as one that does not oscillate, is left out, and the others have no
    cures then; nor have they where a computation fails.

    Parameters
    ----------
    brake : Brake
        As it is. With a cure nothing may grow from the lower end of the range of its thresholds to
        the present value; beyond, the next loss of stability is searched.
    paths : Paths
        The eigenvalue paths over the free parameter, which say which modes meet. Modes have the
        numbers that they have in the spectrum of the brake.
    """
    spectrum = brake.spectrum
    meetings: dict[int, Meeting] = {}
    treatments: dict[Cure, Effect] = {}
    growing_below: list[Cure] = []
    with suppress(InputError, ComputationError):
        treated = TreatedBrake(brake)
        candidates: dict[int, list[Meeting]] = {}
        for mode in spectrum.unstable:
            number_of_mode = spectrum.mode_of(mode)
            starts = paths.starts(paths.group_of(number_of_mode))
            of_mode = treated.modes.behind(mode, starts)
            if of_mode and number_of_mode is not None:
                candidates[number_of_mode] = of_mode
                meetings[number_of_mode] = of_mode[0]
        if candidates and len(candidates) == len(spectrum.unstable):
            search = _Search(treated)
            # which of the candidates is treated with how much of a cure, then with damping of one
            # mode each
            search.choose(candidates)
            search.damp_one_of_each()
            meetings = search.meetings
            growing_below = search.cures_that_grow_below()
            for cure in (Cure.APART, Cure.BOTH):
                if cure in search.confirmed:
                    # where the effect of one kind cannot be computed that of the other may be
                    with suppress(InputError, ComputationError):
                        treatments[cure] = search.effect(cure)
    return MeetingSearch(meetings, treatments, growing_below)


class _Confirmed(NamedTuple):
    """Amounts of a kind of cure, and up to where they stop all that grows.

    enough: the amounts that just stop it at the present value; advised: larger ones, confirmed at
    that value with the full matrices; thresholds: with those advised, None where none were
    searched; at_present_alone: whether they are confirmed at the present value of the free
    parameter alone, else at all values up to `end`.
    """

    enough: Amounts
    advised: Amounts
    thresholds: Thresholds | None
    at_present_alone: bool
    end: float


class _Search:
    """The search of `find_meetings` for amounts of cures.

    Attributes
    ----------
    brake : TreatedBrake
        With the real modes behind growing modes.
    meetings : dict
        By the number of each growing mode its real modes, with the cures that are confirmed.
    confirmed : dict
        What is confirmed of each kind of cure.
    """

    def __init__(self, brake: TreatedBrake) -> None:
        self.brake = brake
        self.present = brake.brake.present
        self.meetings: dict[int, Meeting] = {}
        self.confirmed: dict[Cure, _Confirmed] = {}

    def choose(self, candidates: Mapping[int, Sequence[Meeting]]) -> None:
        """Choose the real modes behind each growing mode with which most cures are confirmed.

        The k-th candidates of all growing modes are tried together, of a mode with fewer its last.
        Separation and damping count a point each if they are confirmed at the present value, and a
        second one if they are for a range of values; the first choice with most points is taken.

        candidates: by the number of each growing mode its meetings, the likeliest first.
        """
        best_meetings = self.meetings
        best_confirmed = self.confirmed
        most_points = -1
        tried = []  # real modes of earlier choices, by their numbers
        for k in range(max(map(len, candidates.values()))):
            for mode, meetings in candidates.items():
                self.meetings[mode] = meetings[min(k, len(meetings) - 1)]
            indices = tuple(meeting.indices for meeting in self.meetings.values())
            if indices in tried:
                continue
            tried.append(indices)
            self.brake.use_basis_of(self.meetings.values())
            self.confirmed = {}
            self._add_if_confirmed(dict.fromkeys(candidates, Cure.BOTH))
            if self._are_pairs():
                self._add_if_confirmed(dict.fromkeys(candidates, Cure.APART))
            points = 0
            for confirmed in self.confirmed.values():
                points += 1 if confirmed.at_present_alone else 2
            if points > most_points:
                most_points = points
                best_meetings = dict(self.meetings)
                best_confirmed = self.confirmed
            if points == 4:  # no choice has more: both cures for a range of values
                break
        self.meetings = best_meetings
        self.confirmed = best_confirmed
        self.brake.use_basis_of(best_meetings.values())

    def damp_one_of_each(self) -> None:
        """Add damping of one mode of each pair to the meetings, if damping both is confirmed.

        Of one growing mode each of the two sides is tried, of several the side that needs less.
        """
        if not self._are_pairs() or Cure.BOTH not in self.confirmed:
            return
        if len(self.meetings) == 1:
            for side in SIDES:
                self._add_if_confirmed(dict.fromkeys(self.meetings, side))
        else:
            self._add_if_confirmed(self._cheaper_sides())

    def cures_that_grow_below(self) -> list[Cure]:
        """The kinds of cure with which something grows at a value up to the present one."""
        cures = []
        for cure, confirmed in self.confirmed.items():
            thresholds = confirmed.thresholds
            if thresholds is None:
                continue
            if loss_of(thresholds, thresholds.high).limit() <= self.present:
                cures.append(cure)
        return cures

    def effect(self, cure: Cure) -> Effect:
        """What a kind of cure does in the amounts that are advised."""
        confirmed = self.confirmed[cure]
        cures = dict.fromkeys(confirmed.advised, cure)
        return self.brake.effect(self._treatment(cures, confirmed.advised), confirmed.thresholds)

    def _are_pairs(self) -> bool:
        """Whether two real modes are behind each growing one."""
        return all(meeting.is_pair for meeting in self.meetings.values())

    def _add_if_confirmed(self, cures: Cures) -> None:
        """Search amounts of cures, and add them to `confirmed` and to the meetings if they stop all
        that grows.

        Damping of both modes of each pair may stop growth up to some value of the free parameter.
        Damping of one of them is then added only if it stops growth up to that value too.
        """
        confirmed = self._confirm(cures)
        if confirmed is None:
            return
        # None while damping of both itself is added
        of_both = self.confirmed.get(Cure.BOTH)
        is_damping = Cure.APART not in cures.values()
        if is_damping and of_both is not None and not of_both.at_present_alone:
            holds_as_far = not confirmed.at_present_alone and confirmed.end >= of_both.end
            if not holds_as_far:
                return
        for mode, cure in cures.items():
            self.confirmed[cure] = confirmed
            meeting = self.meetings[mode]
            self.meetings[mode] = replace(
                meeting,
                cures={**meeting.cures, cure: confirmed.enough[mode]},
                advised={**meeting.advised, cure: confirmed.advised[mode]},
            )

    def _cheaper_sides(self) -> dict[int, Cure]:
        """The mode of each pair that needs less damping, if it is damped alone, by growing mode.

        Empty where neither is enough for a growing mode. The growing modes are treated one after
        another, at the present value of the free parameter: those before have one mode of their
        pair damped as was chosen, those after it both.
        """
        chosen = dict.fromkeys(self.meetings, Cure.BOTH)
        # an amount of damping is a share itself, see `Meeting.unit`
        shares = {mode: meeting.cures[Cure.BOTH] for mode, meeting in self.meetings.items()}
        for mode in self.meetings:
            needed = {}
            for side in SIDES:
                cures = {**chosen, mode: side}
                # infinite if no share up to `MOST` is enough
                needed[side] = self._least_share([mode], cures, shares, [self.present], MOST)
            chosen[mode] = min(SIDES, key=needed.__getitem__)
            shares[mode] = needed[chosen[mode]]
            if shares[mode] == math.inf:
                return {}
        return chosen

    def _confirm(self, cures: Cures) -> _Confirmed | None:
        """The amounts of cures that are just enough at the present value, and those confirmed.

        They are confirmed up to `IN_HAND` times the present value, else up to that value, else at
        it alone. None if no amounts are known to be enough.
        """
        shares = self._least_shares(cures, [self.present])
        # growth close to zero may be missing on the basis: then it needs no cure, and nothing is
        # known of the cures that the full brake needs
        no_cure_is_needed = not any(shares.values())
        if math.inf in shares.values() or no_cure_is_needed:
            return None
        enough = self._rounded_up(cures, shares)
        ends = [self.present]
        if self.brake.searches_thresholds and self.present > 0.0:
            ends.insert(0, IN_HAND * self.present)
        at_present: _Confirmed | None = None
        for end in ends:
            # there may be no brake at the end: an equilibrium ends, a formula divides by zero
            with suppress(InputError, ComputationError, ArithmeticError):
                confirmed = self._confirm_up_to(end, cures, enough)
                if confirmed is not None and not confirmed.at_present_alone:
                    return confirmed
                at_present = at_present or confirmed
        return at_present

    def _confirm_up_to(self, end: float, cures: Cures, enough: Amounts) -> _Confirmed | None:
        """Search amounts of cures with which nothing grows at all values of the parameter up to
        `end`, else at the present value alone.

        In each try the amounts are the least with which nothing grows at some `values`, at first
        the present one and `end`, but not below `IN_HAND` times what is just `enough`. They are
        then tried with the full matrices at all values up to `end`. If something grows at another
        value, that value joins `values`. If something grows at one of `values` (by rounding, or
        because the basis misses it), all amounts get 5 % more in the next try. None if nothing is
        confirmed in `RETRIES` tries, or if no amounts are enough at all `values`.

        end: the present value of the free parameter, or above.
        """
        values = list(dict.fromkeys((self.present, end)))
        at_present: _Confirmed | None = None  # the first amounts that serve at the present value
        factor = 1.0
        for _ in range(RETRIES):
            shares = self._least_shares(cures, values)
            if math.inf in shares.values():
                break
            for mode, amount in enough.items():
                with_margin = IN_HAND * amount / self.meetings[mode].unit(cures[mode])
                shares[mode] = max(shares[mode], with_margin)
            advised = self._rounded_up(cures, shares, factor)
            treatment = self._treatment(cures, advised)
            grows_at, thresholds = self.brake.refuted(treatment, values)
            confirmed = _Confirmed(
                enough, advised, thresholds, at_present_alone=grows_at is not None, end=end
            )
            if grows_at is None:
                return confirmed
            if grows_at in values:
                factor += 0.05
                continue
            values.append(grows_at)
            if at_present is None and not self.brake.grows_in_full(treatment):
                at_present = confirmed
        return at_present

    def _rounded_up(self, cures: Cures, shares: Shares, factor: float = 1.0) -> dict[int, float]:
        """The amounts of `factor` times some shares, rounded up to two digits."""
        amounts = {}
        for mode, share in shares.items():
            amount = factor * share * self.meetings[mode].unit(cures[mode])
            amounts[mode] = float(rounded(amount, 2, math.ceil))
        return amounts

    def _least_shares(self, cures: Cures, values: Sequence[float]) -> dict[int, float]:
        """The least share of each cure with which nothing grows at some values.

        First the least share that is the same for all is searched. Then the share of one growing
        mode after another is lowered, that of the fastest last. All are infinite if no share up to
        `MOST` is enough.
        """
        same_share = self._least_share(cures, cures, {}, values, MOST)
        shares = dict.fromkeys(cures, same_share)
        if len(shares) > 1 and same_share < math.inf:
            for mode in reversed(shares):
                shares[mode] = self._least_share([mode], cures, shares, values, shares[mode])
        return shares

    def _least_share(
        self,
        modes: Iterable[int],
        cures: Cures,
        shares: Shares,
        values: Sequence[float],
        most: float,
    ) -> float:
        """The least share up to `most` for the cures of some growing modes, the same of each, with
        which nothing grows at some values while the other modes have `shares`.

        A share 0.1 raises the upper real mode of two by a tenth of its frequency, or damps modes by
        a tenth of critical damping. values: of the free parameter.
        """

        def stops_all(share: float) -> bool:
            amounts = {}  # by mode: Hz, or a damping ratio
            for mode, other_share in {**shares, **dict.fromkeys(modes, share)}.items():
                amounts[mode] = other_share * self.meetings[mode].unit(cures[mode])
            treatment = self._treatment(cures, amounts)
            return not any(self.brake.grows(value, treatment) for value in values)

        return _least_for(stops_all, most)

    def _treatment(self, cures: Cures, amounts: Amounts) -> Treatment:
        """The change of K or C by cures: a real mode in several gets the largest factor."""
        factors = np.zeros(len(self.brake.modes.forces))
        for mode, cure in cures.items():
            meeting = self.meetings[mode]
            indices = list(meeting.indices)
            factors[indices] = np.maximum(factors[indices], meeting.added(cure, amounts[mode]))
        return Treatment(Cure.APART in cures.values(), factors)


def _least_for(holds: Callable[[float], bool], most: float) -> float:
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
