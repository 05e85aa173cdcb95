"""Located events of a band compared with how many roots of the band grow at values between them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from squeal.linear.continuation import Continuation, ProblemClass, SpectrumAtParameter
from squeal.linear.events import Event
from squeal.linear.roots import ComplexArray
from squeal.linear.search import SearchResult, cluster_events
from squeal.linear.system import TermSystem
from squeal.numerics.differentiation import Parameters
from squeal.queries.systems.verdicts import rounding_of

SAME = 1e-9  # of the range: events no further apart are one cluster
MARGIN = 1e-6  # of the range: closer to an event the verdicts of both its sides count as right

Roots = Callable[[Parameters], ComplexArray]
"""The selected roots (m,), rad/s, of a system with some parameters changed."""
Clusters = Sequence[Sequence[Event]]
"""Coincident events together, by rising value; they cut the range into one interval more."""


class BandContinuation(Continuation):
    """A continuation that knows the roots of a band at each value, and nothing between values.

    A function gives the roots, without vectors, derivatives or couplings: it serves to compare what
    grows at some values with events that were located by other means.
    """

    def __init__(
        self, system: TermSystem, low: float, high: float, roots: Roots, is_exact: bool = False
    ) -> None:
        """is_exact: whether the real parts of the roots have the right signs, and 0 on the axis."""
        self.is_exact = is_exact
        self.system: TermSystem = system
        self.name = system.parameter
        self.low = low
        self.high = high
        self.roots = roots
        self.problem = ProblemClass.DAMPED
        self._spectra = {}

    def at(self, p: float) -> SpectrumAtParameter:
        """The roots at p, those above the real axis with their conjugates."""
        if p not in self._spectra:
            self.set_roots(p, self.roots({self.name: p}))
        return self._spectra[p]

    def set_roots(self, p: float, selected: ComplexArray) -> None:
        """Set the roots (m,) of the band at p: those with Im >= 0, and their exact conjugates."""
        upper = selected[selected.imag >= 0.0]
        roots = np.concatenate([upper, selected[selected.imag > 0.0].conj()])
        m = len(roots)
        rounding = np.zeros(m) if self.is_exact else rounding_of(self.system, roots)
        no_vectors = np.zeros((0, m), complex)
        self._spectra[p] = SpectrumAtParameter(
            value=p,
            z=roots,
            right=no_vectors,
            left=no_vectors,
            coupling=np.zeros((m, m), complex),
            rounding=rounding,
        )

    def lost_roots(self, first: float, second: float) -> int:
        """How many roots fewer the band has at a second value than at a first one."""
        return max(0, len(self.at(first).z) - len(self.at(second).z))


@dataclass(frozen=True, eq=False)
class Comparison:
    """Located events compared with what grows at computed values.

    Attributes
    ----------
    result : SearchResult
        The events by rising value, in clusters of coincident ones, and what grows between these.
    midpoints : list of float
        The middle of each interval between two clusters, or between one and an end of the range.
    unexplained : list of str
        A sentence for each value at which more roots grow than follows from the events, or, before
        the first event, than at a lower value.
    left_out : list of str
        A sentence for each interval between clusters in which fewer roots grow somewhere than
        follows from the events, if that changes the verdict: a growing root has left the band.
    """

    result: SearchResult
    midpoints: list[float]
    unexplained: list[str]
    left_out: list[str]


def compare(
    continuation: BandContinuation, events: Sequence[Event], values: Sequence[float], band: str
) -> Comparison:
    """Compare how many roots of a band grow at computed values with what located events explain.

    The clusters of events cut the range into intervals. In each interval as many roots must grow as
    in the middle of the first interval, plus those that begin to grow, less those that stop, at the
    events in between. Of each interval one value, called typical, stands for this number: see
    `_typical_values`. The typical values on both sides of each cluster are compared with what
    crosses there, and all values of an interval with its typical one.

    Parameters
    ----------
    continuation : BandContinuation
        The roots of the band over the parameter.
    events : sequence of Event
        Crossings that were located, by rising value.
    values : sequence of float
        The computed values of the parameter, from the first to the last of the range.
    band : str
        The band in words, for sentences.
    """
    low = continuation.low
    high = continuation.high
    margin = MARGIN * (high - low)
    clusters = cluster_events(events, SAME * (high - low))
    end = high
    # beyond an event at the end of the range an interval is added, to see what the event changes
    if clusters and high - clusters[-1][-1].value <= margin:
        end = high + 2 * margin
    edges = [low, *(cluster[0].value for cluster in clusters), end]
    intervals = list(itertools.pairwise(edges))
    midpoints = [(start + stop) / 2 for start, stop in intervals]
    computed = []  # without values next to an event, where the verdict of either side may be found
    for value in values:
        if all(abs(value - event.value) > margin for event in events):
            computed.append(value)
    typical = _typical_values(continuation, clusters, intervals, computed, margin)
    at_clusters = _unexplained_at_clusters(continuation, clusters, typical, margin, band)
    checked = sorted({*computed, *midpoints})
    between, left_out = _differences_within(continuation, clusters, typical, checked, band)
    return Comparison(
        result=SearchResult(
            clusters=tuple(map(tuple, clusters)),
            unstable_counts=tuple(continuation.at(value).unstable_count for value in typical),
            continuation=continuation,
        ),
        midpoints=midpoints,
        unexplained=list(dict.fromkeys(at_clusters + between)),
        left_out=left_out,
    )


def _typical_values(
    continuation: BandContinuation,
    clusters: Clusters,
    intervals: Sequence[tuple[float, float]],
    computed: Sequence[float],
    margin: float,
) -> list[float]:
    """Of each interval between clusters of events a value that shows what grows in the interval.

    That is a value with as many growing roots as are expected: those in the middle of the first
    interval, and what the events since then bring: if none grows there, and a pair begins to
    flutter at the first event, two are expected in the second interval. The middle is tried first,
    then the computed values, then values `margin` from both ends of the interval. Where no value
    has the expected number the middle stands for the interval.
    """
    typical = []
    expected = 0
    for k, (start, stop) in enumerate(intervals):
        middle = (start + stop) / 2
        if k == 0:
            expected = continuation.at(middle).growing_roots
        else:  # the events at the start of the interval
            expected += sum(event.rise for event in clusters[k - 1])
        typical_value = middle
        for value in (middle, *computed, start + margin, stop - margin):
            if start < value < stop and continuation.at(value).growing_roots == expected:
                typical_value = value
                break
        typical.append(typical_value)
    return typical


def _unexplained_at_clusters(
    continuation: BandContinuation,
    clusters: Clusters,
    typical: Sequence[float],
    margin: float,
    band: str,
) -> list[str]:
    """A sentence for each cluster whose events do not explain how the number of growing roots
    changes from the typical value below the cluster to the one above.

    typical: a value of the free parameter below the first cluster, one between each cluster and the
    next, and one above the last; margin: how far from a cluster the verdict of one side alone is
    found; band: the band in words.
    """
    unexplained = []
    for cluster, (below, above) in zip(clusters, itertools.pairwise(typical), strict=True):
        # at least and at most so many roots grow, as rounding may hide some
        least_below, most_below = continuation.at(below).count_bounds
        least_above, most_above = continuation.at(above).count_bounds
        rise = sum(event.rise for event in cluster)
        at_cluster = f"{continuation.name} = {cluster[0].value:.6g}"
        # more roots grow above than grew below and began at the cluster. A real root that ceases to
        # grow there may have come from beyond the region, where it grew faster: it is not among
        # those below
        ceasing = sum(event.omega == 0.0 and event.rise < 0 for event in cluster)
        if most_below + rise + ceasing < least_above:
            unexplained.append(
                f"what grows beside {at_cluster} does not follow from what crosses there; a "
                f"growing mode may have entered {band}"
            )
        # fewer roots grow above: between the cluster and the typical value some have stopped
        # growing, or have left the band. How many grow just above the cluster, where rounding may
        # hide them, follows from how many grow just below it, and from the events
        before = max(continuation.low, cluster[0].value - margin)
        after = cluster[-1].value + margin
        if least_below + rise > most_above and after < above:
            least_before, _ = continuation.at(before).count_bounds
            ended = least_before + rise - most_above
            if ended > continuation.lost_roots(after, above):
                unexplained.append(f"growth at {at_cluster} ends at no threshold")
    return unexplained


def _differences_within(
    continuation: BandContinuation,
    clusters: Clusters,
    typical: Sequence[float],
    checked: Sequence[float],
    band: str,
) -> tuple[list[str], list[str]]:
    """Compare how many roots grow at each checked value and at the typical value of its interval.

    - More roots grow at the checked value: an event is missing, and that value is unexplained.
    - Fewer grow there, even if every root that rounding leaves open is counted as growing. If as
      many roots have left the band, the growing ones did, and the interval is noted as left out.
      Else an event is missing, and the growth at the typical value is unexplained. So it is in the
      first interval if the checked value is the lower one: growth then begins without an event.
    - As many grow there, with another verdict. Nothing crosses the axis then: a pair became two
      real roots or the reverse, or another root grows fastest.

    Returns
    -------
    unexplained, left_out : list of str
        Sentences, as `Comparison` has them.
    """
    unexplained = []
    left_out: dict[int, str] = {}  # by the number of the interval, from 0
    for value in checked:
        interval = sum(cluster[0].value < value for cluster in clusters)
        typical_value = typical[interval]
        count = continuation.at(value).unstable_count
        typical_count = continuation.at(typical_value).unstable_count
        _, most_growing = continuation.at(value).count_bounds  # with those that rounding hides
        here = f"{continuation.name} = {value:.6g}"
        at_typical = f"{continuation.name} = {typical_value:.6g}"
        missing = typical_count.growing_roots - most_growing
        if count.growing_roots > typical_count.growing_roots:
            what = f"{count.verdict} of one more mode"
            if count.verdict != typical_count.verdict:
                what = count.verdict
            unexplained.append(f"{what} at {here} follows from no threshold that was located")
        elif missing > 0:
            # in the first interval growth that begins after `value` begins without an event; it is
            # not hidden by rounding, since the value is not next to an event
            begins_without_event = interval == 0 and value < typical_value
            if begins_without_event or missing > continuation.lost_roots(typical_value, value):
                unexplained.append(
                    f"{typical_count.verdict} at {at_typical} follows from no threshold that was "
                    "located"
                )
            else:
                left_out.setdefault(
                    interval,
                    f"fewer modes are found to grow in {band} at {here} than at {at_typical}, with "
                    "no threshold between; where they leave or enter is not listed",
                )
    return unexplained, list(left_out.values())
