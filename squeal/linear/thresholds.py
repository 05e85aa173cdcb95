"""Thresholds of a family of systems: every change of verdict, every crossing of the axis.

Up to three degrees of freedom and without damping candidates are the roots of smooth functions of
mu (`searches`), so that neither real parts, which start like a square root at a coalescence, nor a
verdict and its rounding decide where a threshold lies. What grows between neighbouring candidates
tells which of them matter (`survey`). Eigenvalues of all other systems are followed (`following`).
"""

import math
from collections.abc import Iterable

import numpy as np

from squeal.linear.crossing import CriticalPoint, Crossing, Thresholds
from squeal.linear.family import UnsuitedError
from squeal.linear.following.answer import TIGHT, followed
from squeal.linear.following.scale import divided
from squeal.linear.growth import GROWING, SMALL, rises
from squeal.linear.light import Slow
from squeal.linear.matrices import LightMassError
from squeal.linear.survey import Candidate, Change, Survey
from squeal.linear.system import Batched, System, check_range, check_system, matrices_at


def thresholds(
    system: System, mu_max: float, breakpoints: Iterable[float] = (), mu_min: float = 0.0
) -> Thresholds:
    """All thresholds of system(mu) -> (M, C, K) for mu_min <= mu <= mu_max, sorted.

    `system` must be smooth between the `breakpoints` (values of mu where it may jump, a change of
    contact for instance); it is asked for values next to them, never at them. A point at mu_min
    means that the system is quiet there and grows at once above it. A window of growth gives two
    points. Up to three degrees of freedom without damping that holds however narrow it is, down to
    where rounding fills it, 1e-6 of mu or less. Otherwise one that opens and closes between two
    values that are looked at is foreseen from how the roots are coupled there, to second order;
    that none is overlooked is not proved. Raises InputError for an empty range and whatever
    `system` raises.
    """
    return _found("thresholds", system, mu_max, breakpoints, mu_min)


def _found(
    asked: str, system: System, mu_max: float, breakpoints: Iterable[float], mu_min: float
) -> Thresholds:
    check_system(system, asked)
    check_range(asked, mu_min, mu_max)
    try:
        return _thresholds(system, mu_max, breakpoints, mu_min)
    except LightMassError:
        slow = Slow(system, mu_min)
        return slow.widened(_thresholds(slow, mu_max, breakpoints, mu_min))


def _thresholds(
    system: System, mu_max: float, breakpoints: Iterable[float], mu_min: float
) -> Thresholds:
    # larger ones are divided when they are followed
    small = np.shape(matrices_at(system, mu_min)[0])[0] <= SMALL
    if small and not isinstance(system, Batched) and len(divided(system, mu_min, mu_max)) > 2:
        return followed(system, mu_max, breakpoints, mu_min)
    try:
        survey = Survey(system, mu_max, breakpoints, mu_min)
        return Thresholds(_verdict_changes(survey), _axis_crossings(survey))
    except UnsuitedError:
        return followed(system, mu_max, breakpoints, mu_min)


def critical_points(
    system: System, mu_max: float, breakpoints: Iterable[float] = (), mu_min: float = 0.0
) -> list[CriticalPoint]:
    """All changes of verdict in mu_min <= mu <= mu_max, as `thresholds` finds them."""
    return _found("critical_points", system, mu_max, breakpoints, mu_min).points


def crossings(
    system: System, mu_max: float, breakpoints: Iterable[float] = (), mu_min: float = 0.0
) -> list[Crossing]:
    """All crossings of the imaginary axis by any pair or real root, as `thresholds` finds them.

    Unlike `critical_points` it lists what happens while other modes grow. A pair without damping
    crosses where two frequencies coalesce or part. Divergent roots that join to a growing pair, or
    come from one, cross nothing.
    """
    return _found("crossings", system, mu_max, breakpoints, mu_min).crossings


def _verdict_changes(survey: Survey) -> list[CriticalPoint]:
    """The changes of verdict of a range that has been searched."""
    found = []
    for change in survey.changes():
        width = TIGHT * max(abs(change.mu), 1e-3 * (survey.high - survey.low))
        below, above = change.below.verdict, change.above.verdict
        if below != above:
            kind = above if above in GROWING else "restabilised"
            grows = above in GROWING
            omega = survey.frequency(change, above if grows else below, grows)
            candidate = _first(change, "flutter" if omega else "divergence")
            interval = _interval(candidate)
            converged = candidate.root.converged and interval[1] - interval[0] <= width
            frequency = omega / (2 * math.pi)
            found.append(CriticalPoint(change.mu, kind, frequency, interval, converged))
    return found


def _axis_crossings(survey: Survey) -> list[Crossing]:
    """The crossings of the axis in a range that has been searched."""
    found = []
    for change in survey.changes():
        below, above = change.below, change.above
        for kind, rise in rises(above.pairs - below.pairs, above.reals - below.reals).items():
            if not rise:
                continue
            omega = survey.frequency(change, kind, rise > 0)
            one = Crossing(
                change.mu,
                kind,
                "up" if rise > 0 else "down",
                omega / (2 * math.pi),
                _interval(_first(change, kind)),
                _mode(survey, change.mu, omega),
                below.verdict != above.verdict,
            )
            found += [one] * abs(rise)
    return found


def _first(change: Change, kind: str) -> Candidate:
    """The candidate at a place that announces this kind of change, or any."""
    for candidate in change.candidates:
        if candidate.search and (candidate.search.source == "zero") == (kind == "divergence"):
            return candidate
    return change.candidates[0]


def _interval(candidate: Candidate) -> tuple[float, float]:
    root, search = candidate.root, candidate.search
    return root.interval if search is None else search.interval(root)


def _mode(survey: Survey, mu: float, omega: float) -> int:
    return 1 + int(np.sum(np.sqrt(np.abs(survey.family.roots(mu))) < omega * (1 - 1e-6)))
