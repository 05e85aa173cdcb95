"""Thresholds of a parametrised system: every change of verdict, every crossing of the axis.

The eigenvalues are followed along the parameter (`continuation`); where they cross the line between
growth and decay is located on the roots themselves, or on the pair that meets there (`events`), and
what grows is counted between these values (`search`). The verdict changes at events that
begin or end all growth, and where the faster growth passes from a pair to a real root or back.
"""

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from squeal.errors import InputError
from squeal.linear.continuation import (
    UNDAMPED,
    Continuation,
    SpectrumAtParameter,
    hermite_cubic,
)
from squeal.linear.events import EVENT_TOLERANCE, Crossing, Event, hertz_of, locate_event
from squeal.linear.functions import SystemFunction
from squeal.linear.search import SearchResult, fastest_first, hull, required_crossings, search
from squeal.linear.steps import EventGuess
from squeal.linear.verdicts import GROWING


@dataclass(frozen=True)
class CriticalPoint:
    """A change of verdict on the way up in mu.

    `converged`: the interval is no wider than 1e-9 of mu, and the root that makes the change was
    located. If not, the interval holds the change all the same. It is wide where growth hardly
    changes with mu, so that rounding hides where it begins, as at a window that almost closes.
    """

    mu: float
    kind: str  # flutter, divergence: what follows; restabilised: neither follows any more
    frequency_hz: float  # of the mode that makes the change, at mu; 0 of a real root
    interval: tuple[float, float]  # bracket of mu; the point itself at a breakpoint
    converged: bool
    residual: float | None = None  # backward error of the root there, if it is known

    def __str__(self) -> str:
        return f"{self.kind} at mu = {self.mu:.9g}{hertz_of(self.frequency_hz)}"


@dataclass(frozen=True)
class Thresholds:
    """What happens over a range of mu.

    Attributes
    ----------
    points : list of CriticalPoint
        Changes of verdict.
    crossings : list of Crossing
        All crossings of the imaginary axis, those that change the verdict among them.
    certified : bool or None
        True if the crossings add up to what grows between them, and the factors of all terms are
        resolved, which is no proof. None where nothing is known between the computed values, as of
        a plain function.
    searched : tuple of SearchResult
        The searches between jumps from which all this was read, with the eigenvalues along mu.
    """

    points: list[CriticalPoint]
    crossings: list[Crossing]
    certified: bool | None = None
    searched: tuple[SearchResult, ...] = field(default=(), repr=False, compare=False)


def thresholds(
    system: SystemFunction,
    mu_max: float,
    breakpoints: Iterable[float] = (),
    mu_min: float = 0.0,
    all_roots: bool = False,
) -> Thresholds:
    """All thresholds of system(mu) -> (M, C, K) for mu_min <= mu <= mu_max, sorted.

    A point at mu_min means that no root grows there and that one grows at once above it. An
    interval in which roots grow gives two points; one that opens and closes between two values at
    which eigenvalues are computed is predicted from how the roots are coupled there, to second
    order. The crossings of the imaginary axis list also what happens while other modes grow. A pair
    without damping crosses where two frequencies coalesce or separate. Divergent roots that join to
    a growing pair, or come from one, cross nothing.

    Parameters
    ----------
    system : SystemFunction
        Smooth between the `breakpoints`.
    mu_max, mu_min : float
        The range.
    breakpoints : iterable of float
        Values of mu where the system may jump, at a change of contact for instance; it is
        evaluated next to them, never at them.
    all_roots : bool
        Whether roots that are far faster than others are followed too, see `Continuation`.

    Returns
    -------
    Thresholds
        `certified` is None for a plain function, of which nothing is known between the values.

    Raises
    ------
    InputError
        For an empty range, a root that passes through infinity, and whatever
        `system` raises.

    Examples
    --------
    >>> import numpy as np
    >>> K = lambda mu: np.array([[2.0, -1.0 + 4 * mu / 3], [-1.0, 2.0]])
    >>> result = thresholds(lambda mu: (np.eye(2), None, K(mu)), 2.0)
    >>> print(*result.points)
    flutter at mu = 0.75, 0.225079 Hz
    """
    first = float(mu_min)
    last = float(mu_max)
    if not -math.inf < first < last < math.inf:
        raise InputError(
            f"thresholds: mu_min, mu_max = {first, last} is not allowed; it must be finite "
            "numbers, the first below the last"
        )
    jumps = {float(mu) for mu in breakpoints if first < mu < last}
    points: list[CriticalPoint] = []
    crossings: list[Crossing] = []
    results: list[SearchResult] = []
    for a, b in itertools.pairwise([first, *sorted(jumps), last]):
        # at a jump the doubles next to it, as the system is not evaluated there
        low = float(np.nextafter(a, b)) if a in jumps else a
        high = float(np.nextafter(b, a)) if b in jumps else b
        result = search(system, low, high, all_roots)
        if results:
            before = results[-1].continuation
            below = before.at(before.high)
            above = result.continuation.at(low)
            points += _points_at_jump(a, below, above)
            crossings += _crossings_at_jump(a, below, above)
        new_points, new_crossings = points_and_crossings(result)
        points += new_points
        crossings += new_crossings
        results.append(result)
    certified = None  # of a plain function, whose searches have None for doubts
    if all(result.doubts is not None for result in results):
        certified = not any(result.doubts for result in results)
    return Thresholds(points, crossings, certified, tuple(results))


def points_and_crossings(result: SearchResult) -> tuple[list[CriticalPoint], list[Crossing]]:
    """The changes of verdict and the crossings of a range without a jump.

    A crossing changes the verdict if it is the fastest of its cluster to begin or end growth of the
    kind that names the verdict. If no crossing of the cluster does that, all of them count.

    Of each change of the verdict the fastest events of its cluster are looked up first; then each
    event of each cluster becomes a crossing, and each change a critical point.
    """
    changes = [(change, _fastest_events(result, change)) for change in _verdict_changes(result)]
    crossings = []
    for k, cluster in enumerate(result.clusters):
        responsible = [fastest for change, fastest in changes if change.cluster == k]
        for event in cluster:
            changes_verdict = any(
                event in fastest or fastest.are_unknown for fastest in responsible
            )
            spectrum = result.continuation.at(event.value)
            members = 2 if event.coalesces else 1
            mode = _mode_number(spectrum, event.omega, members)
            crossings.append(event.crossing(mode, changes_verdict))
    points = [_critical_point(result, change, fastest) for change, fastest in changes]
    return points, crossings


def _points_at_jump(
    mu: float, below: SpectrumAtParameter, above: SpectrumAtParameter
) -> list[CriticalPoint]:
    """The change of verdict at a breakpoint mu, from the spectra on both sides; empty if none."""
    before = below.verdict
    after = above.verdict
    if before == after:
        return []
    kind = "restabilised"
    unstable = below
    if after in GROWING:
        kind = after
        unstable = above
    omega = _leading_omega(unstable) if unstable.verdict == "flutter" else 0.0
    hertz = omega / math.tau
    return [CriticalPoint(mu, kind, hertz, interval=(mu, mu), converged=True)]


def _crossings_at_jump(
    mu: float, below: SpectrumAtParameter, above: SpectrumAtParameter
) -> list[Crossing]:
    """The crossings of the axis at a breakpoint mu, from the spectra on both sides."""
    changes_verdict = below.verdict != above.verdict
    crossings = []
    for omega, direction in required_crossings(below, above):
        unstable = above if direction > 0 else below
        mode = _mode_number(unstable, omega)
        event = Event(mu, omega, direction, interval=(mu, mu))
        crossings.append(event.crossing(mode, changes_verdict))
    return crossings


def _mode_number(spectrum: SpectrumAtParameter, omega: float, members: int = 1) -> int:
    """Number by rising frequency, from 1, of the mode of angular frequency omega (rad/s).

    Where two modes meet (`members` = 2) it is the number of the first.
    """
    # undamped, one z = -lambda^2 stands for a pair
    roots_per_mode = 1 if spectrum.problem is UNDAMPED else 2
    nearest_first = np.argsort(np.abs(spectrum.omegas - omega))
    # the nearest roots are the mode, or those that meet, itself
    others = spectrum.omegas[nearest_first][roots_per_mode * members :]
    tolerance = 1e-6 if members > 1 else 1e-9  # frequencies that coalesce are known to fewer digits
    slower = int(np.sum(others < omega * (1 - tolerance)))
    return 1 + math.ceil(slower / roots_per_mode)  # an odd real root is a mode of its own


def _leading_omega(spectrum: SpectrumAtParameter) -> float:
    """Angular frequency of the pair that grows fastest (rad/s), 0 if none does."""
    if not spectrum.unstable_pairs:
        return 0.0
    return float(spectrum.omegas[spectrum.unstable_pairs[0]])


# Changes of verdict, from what grows and what crosses


class VerdictChange(NamedTuple):
    """A change of verdict from `below` to `above` with rising parameter, at value +- half_width.

    cluster: the index of the cluster of events that makes it; None where a pair begins to outgrow
    the fastest real root, or the reverse, and nothing crosses the axis.
    """

    value: float
    half_width: float
    below: str
    above: str
    cluster: int | None


class _VerdictAt(NamedTuple):
    """The verdict at a value of the parameter, or on one side of a cluster of events there."""

    value: float
    verdict: str
    cluster: int | None = None


def _verdict_changes(result: SearchResult) -> Iterator[VerdictChange]:
    """All changes of verdict by rising value.

    Where all growth begins or ends, the cluster that crosses there changes the verdict. Everywhere
    else it changes only where a pair begins to outgrow the fastest real root, or the reverse; if a
    cluster of crossings lies there, it makes the change.
    """
    for a, b in itertools.pairwise(_verdicts_along(result)):
        if a.cluster is not None and a.cluster == b.cluster:
            yield VerdictChange(a.value, 0.0, a.verdict, b.verdict, a.cluster)
        elif a.value < b.value and "quiet" not in (a.verdict, b.verdict):
            for change in _exchanges(result.continuation, a, b):
                yield _moved_to_cluster(result, change)


def _verdicts_along(result: SearchResult) -> list[_VerdictAt]:
    """Verdicts by rising parameter: at computed spectra, and on both sides of the clusters that
    begin or end all growth.

    Between two clusters these are the spectra at which as many roots grow as in the middle of the
    interval. If there is no such spectrum, or if no root grows, it is the middle alone.
    """
    edges = result.edges
    spectra = result.continuation.spectra
    verdicts: list[_VerdictAt] = []
    for k, count in enumerate(result.unstable_counts):
        low = edges[k]
        high = edges[k + 1]
        inner = []
        for spectrum in spectra:
            is_inside = low <= spectrum.value <= high
            if count.growing_roots and is_inside and spectrum.growing_roots == count.growing_roots:
                inner.append(_VerdictAt(spectrum.value, spectrum.verdict))
        if not inner:
            inner = [_VerdictAt((low + high) / 2, count.verdict)]
        if k:  # cluster k - 1 lies below this interval
            verdicts += _verdicts_around(result, k - 1, verdicts[-1], inner[0])
        verdicts += inner
    return verdicts


def _verdicts_around(
    result: SearchResult, cluster: int, before: _VerdictAt, after: _VerdictAt
) -> list[_VerdictAt]:
    """The verdicts just below and above a cluster that begins or ends all growth.

    On the side on which roots grow the verdict is the kind of the roots that cross, if all of them
    are of one kind; else that of the nearest spectrum.

    Parameters
    ----------
    result : SearchResult
        The search.
    cluster : int
        The index of the cluster.
    before, after : _VerdictAt
        The nearest computed verdicts below and above it.

    Returns
    -------
    list of _VerdictAt
        Empty if roots grow on both sides, or on neither.
    """
    begins = before.verdict == "quiet"
    ends = after.verdict == "quiet"
    if begins == ends:
        return []
    events = result.clusters[cluster]
    direction = 1 if begins else -1  # 1: of roots that begin to grow as the parameter rises
    kind = after.verdict if begins else before.verdict
    kinds = {event.kind for event in events if event.direction == direction}
    if len(kinds) == 1:
        kind = kinds.pop()
    quiet = _VerdictAt(events[0].value, "quiet", cluster)
    growing = _VerdictAt(events[0].value, kind, cluster)
    return [quiet, growing] if begins else [growing, quiet]


def _moved_to_cluster(result: SearchResult, change: VerdictChange) -> VerdictChange:
    """A change of verdict, moved to the cluster of events that makes it, if there is one.

    Such a cluster lies there, ends growth of the kind below and begins growth of the kind above.
    """
    continuation = result.continuation
    near = 4 * EVENT_TOLERANCE * (continuation.high - continuation.low)
    required = {(change.below, -1), (change.above, 1)}
    for k, cluster in enumerate(result.clusters):
        value = cluster[0].value
        kinds = {(event.kind, event.direction) for event in cluster}
        if abs(value - change.value) <= near and required <= kinds:
            return change._replace(value=value, cluster=k)
    return change


def _exchanges(
    continuation: Continuation, a: _VerdictAt, b: _VerdictAt, depth: int = 5
) -> Iterator[VerdictChange]:
    """Changes between flutter and divergence from a to b, at both of which roots grow.

    If the verdicts at a and b differ, one change is located. If they are equal, two changes may lie
    between a and b; where that is possible the interval is halved, up to `depth` times.
    """
    if a.verdict != b.verdict:
        value, half_width = _located_exchange(continuation, a, b)
        yield VerdictChange(value, half_width, a.verdict, b.verdict, cluster=None)
    elif depth and _may_exchange_twice(
        continuation.at(a.value), continuation.at(b.value), a.verdict
    ):
        middle = (a.value + b.value) / 2
        between = _VerdictAt(middle, continuation.at(middle).verdict)
        # nothing between a and b ends all growth: if the middle seems quiet, rounding hides its
        # growth, and the kinds cannot be compared
        if between.verdict != "quiet":
            yield from _exchanges(continuation, a, between, depth - 1)
            yield from _exchanges(continuation, between, b, depth - 1)


def _may_exchange_twice(a: SpectrumAtParameter, b: SpectrumAtParameter, verdict: str) -> bool:
    """True if between two spectra of one verdict there may be two changes to the other and back.

    The lead, the growth rate of the fastest pair less that of the fastest real root, is predicted
    by the cubic through its values and slopes at both ends. There may be two changes if the lead of
    the kind that names the verdict may vanish, up to the error of that cubic.
    """
    has_pair = a.unstable_count.pairs or b.unstable_count.pairs
    has_real_root = a.unstable_count.reals or b.unstable_count.reals
    if not has_pair or not has_real_root:
        return False
    length = b.value - a.value
    first = _lead_of_pair(a)
    last = _lead_of_pair(b)
    first_change = first.slope * length
    last_change = last.slope * length
    cubic = hermite_cubic(first.value, first_change, last.value, last_change)
    # `polyval` takes the coefficients from the highest power on; shares of the step
    lead = np.polyval(cubic[::-1], np.linspace(0.0, 1.0, 17))
    if verdict != "flutter":
        lead = -lead
    # how far the change of the lead is from the mean of what both slopes predict: 0 if the lead is
    # a parabola. The cubic may be wrong by about as much
    error = abs(last.value - first.value - (first_change + last_change) / 2)
    return bool(lead.min() <= error)


def _located_exchange(
    continuation: Continuation, a: _VerdictAt, b: _VerdictAt
) -> tuple[float, float]:
    """Where flutter turns into divergence or the reverse, and half the width of its interval.

    The verdict is the one at a and the other at b, where a lies below b. The zero of the lead, the
    growth rate of the fastest pair less that of the fastest real root, is found by Ridders's method
    (1979), or, where a pair becomes two real roots, as the value at which these meet.
    """
    low = a.value
    high = b.value
    largest_half_width = 1e-7 * (high - low)
    resolution = 4 * np.spacing(max(abs(low), abs(high)))
    zero = math.inf  # of the lead: the latest estimate
    for k in range(100):
        zero_before = zero
        middle = (low + high) / 2
        counts = [continuation.at(value).unstable_count for value in (low, middle, high)]
        at_low, _, at_high = counts
        # the lead is smooth unless a pair becomes two real roots in between, where it jumps
        is_smooth = (at_low.pairs, at_low.reals) == (at_high.pairs, at_high.reals)
        if k == 6 and not is_smooth:  # after a few halvings, near enough for Newton's method
            meeting = _meeting_on_real_axis(continuation, low, high)
            if meeting is not None:
                return meeting
        lead_low, lead_middle, lead_high = (count.pair_rate - count.real_rate for count in counts)
        zero = middle
        if lead_low * lead_high < 0.0:  # Ridders's step from the middle
            root = math.sqrt(lead_middle**2 - lead_low * lead_high)
            zero += (middle - low) * np.sign(lead_low) * lead_middle / root
        if high - low <= resolution or abs(zero - zero_before) <= resolution:
            break
        # of low, middle, zero and high, sorted, the first value with the verdict of b is the new
        # high, and the one before it the new low
        for value in sorted({middle, zero}):
            if continuation.at(value).verdict == b.verdict:
                high = value
                break
            low = value
    if not is_smooth:  # the lead jumps: its slope does not bound the error
        return zero, largest_half_width
    lead = _lead_of_pair(continuation.at(zero))
    error = lead.rounding / abs(lead.slope) if lead.slope != 0.0 else math.inf
    # the last term is the rounding of the value itself
    return zero, min(error, largest_half_width) + 1e-12 * abs(zero)


def _meeting_on_real_axis(
    continuation: Continuation, low: float, high: float
) -> tuple[float, float] | None:
    """Where from low to high the fastest growing pair becomes two real roots, or comes from two.

    Returns the value and half the width of its interval; None if another root grows faster there,
    or the two do not meet.
    """
    spectra = [continuation.at(p) for p in (low, high)]
    flutter = [spectrum for spectrum in spectra if spectrum.verdict == "flutter"]
    if not flutter:
        return None
    spectrum = flutter[0]  # at the end where the pair is complex
    if not len(spectrum.right):  # roots without vectors
        return None
    k = spectrum.unstable_pairs[0]  # the fastest
    z = spectrum.z  # lambda over the scale, or -lambda^2: real where two real lambda meet
    conjugate = int(np.argmin(np.abs(z - z[k].conj())))
    both = [k, conjugate]
    guess = EventGuess(
        value=(low + high) / 2,
        z=complex(z[k].real),
        right=spectrum.right[:, both],
        left=spectrum.left[:, both],
        coalesces=True,
        width=high - low,
    )
    event = locate_event(continuation, guess, crosses=False)
    if event is None or not low - event.width <= event.value <= high + event.width:
        return None
    met = continuation.at(float(np.clip(event.value, low, high)))
    fastest = int(np.argmax(met.exponents.real))
    fastest_is_real = abs(met.z[fastest].imag) <= 2 * met.rounding[fastest]
    if not fastest_is_real:
        return None  # this pair meets while another one grows faster
    return event.value, event.width / 2


class _Lead(NamedTuple):
    """A growth rate, or a difference of two (1/s), its derivative and its rounding."""

    value: float
    slope: float
    rounding: float


def _lead_of_pair(spectrum: SpectrumAtParameter) -> _Lead:
    """The growth rate of the fastest growing pair less that of the fastest growing real root.

    A growth rate is 0 where there is no such pair or root.
    """
    pair = _growth_rate(spectrum, spectrum.unstable_pairs)
    real = _growth_rate(spectrum, spectrum.unstable_reals)
    return _Lead(pair.value - real.value, pair.slope - real.slope, pair.rounding + real.rounding)


def _growth_rate(spectrum: SpectrumAtParameter, fastest_first: list[int]) -> _Lead:
    """The growth rate (1/s) of the first of some roots, given by their indices, with its derivative
    by the parameter and its rounding; all are 0 without a root."""
    if not fastest_first:
        return _Lead(0.0, 0.0, 0.0)
    k = fastest_first[0]
    exponent = spectrum.exponents[k]  # lambda
    if spectrum.problem is UNDAMPED:  # z = -lambda^2
        derivative = -0.5 / exponent  # d lambda / dz
    else:  # lambda is a constant times z
        derivative = exponent / spectrum.z[k]
    return _Lead(
        value=float(exponent.real),
        slope=float((derivative * spectrum.slopes[k]).real),
        rounding=float(abs(derivative) * spectrum.rounding[k]),
    )


class _FastestEvents(NamedTuple):
    """The two events of a cluster that make a change of verdict; None where there is no such event.

    ending: where the fastest root of the kind that names the verdict below ceases to grow;
    beginning: where the fastest root of the kind that names the verdict above begins to grow.
    """

    ending: Event | None
    beginning: Event | None

    @property
    def are_unknown(self) -> bool:
        """True if nothing tells which events of the cluster make the change."""
        return self == (None, None)


def _fastest_events(result: SearchResult, change: VerdictChange) -> _FastestEvents:
    """The fastest events of a change of verdict; none of a change without a cluster."""
    if change.cluster is None:
        return _FastestEvents(None, None)
    cluster = result.clusters[change.cluster]

    def fastest(kind: str, direction: int) -> Event | None:
        events = [event for event in cluster if (event.kind, event.direction) == (kind, direction)]
        return fastest_first(result.continuation, events)[0] if events else None

    return _FastestEvents(fastest(change.below, -1), fastest(change.above, 1))


def _critical_point(
    result: SearchResult, change: VerdictChange, fastest: _FastestEvents
) -> CriticalPoint:
    """A change of verdict for callers; `fastest` are the events of its cluster that make it.

    Where the verdict above the change is one of growth, that growth is the kind of the point.
    """
    if change.above in GROWING:
        kind = change.above
        event = fastest.beginning
    else:
        kind = "restabilised"
        event = fastest.ending
    low = change.value - change.half_width
    high = change.value + change.half_width
    converged = True
    if change.cluster is not None:
        events = result.clusters[change.cluster]
        low, high = hull(events)
        # 1e-300: at the value 0 only an interval without any width is narrow
        is_narrow = high - low <= EVENT_TOLERANCE * max(abs(change.value), 1e-300)
        converged = is_narrow and all(member.converged for member in events)
    if event is None:
        omega = _omega_without_event(result, change, (low, high))
        residual = None
    else:
        omega = event.omega
        residual = event.residual
    return CriticalPoint(
        mu=float(change.value),
        kind=kind,
        frequency_hz=omega / math.tau,
        interval=(float(low), float(high)),
        converged=converged,
        residual=residual,
    )


def _omega_without_event(
    result: SearchResult, change: VerdictChange, interval: tuple[float, float]
) -> float:
    """The angular frequency (rad/s) of the mode that changes the verdict, where no event has it.

    It is that of the fastest pair at the nearest spectrum on the side on which this pair grows, and
    0 of a real root. interval: the values between which the change lies.
    """
    continuation = result.continuation
    grows_above = change.above in GROWING
    kind = change.above if grows_above else change.below
    if kind != "flutter":
        return 0.0
    if change.cluster is None:
        # no root crosses: either a pair and a real root grow at one rate here, to a millionth, or a
        # pair becomes two real roots, and its frequency falls to 0
        spectrum = continuation.at(change.value)
        growth = spectrum.unstable_count
        rates_are_equal = abs(growth.pair_rate - growth.real_rate) <= 1e-6 * growth.real_rate
        return _leading_omega(spectrum) if rates_are_equal else 0.0
    low, high = interval
    spectra = continuation.spectra
    if grows_above:
        candidates = [spectrum for spectrum in spectra if spectrum.value > high]
    else:
        candidates = [spectrum for spectrum in spectra if spectrum.value < low]
    nearest = min(candidates or spectra, key=lambda spectrum: abs(spectrum.value - change.value))
    return _leading_omega(nearest)
