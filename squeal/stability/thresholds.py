"""Thresholds of a family of systems: every change of verdict, every crossing of the axis.

Up to three degrees of freedom candidates are the roots of smooth functions of mu (`searches`), so
that neither real parts, which start like a square root at a coalescence, nor a verdict and its
rounding decide where a threshold lies. What grows between neighbouring candidates tells which of
them matter (`survey`). Eigenvalues of larger systems are followed (`following`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from squeal.errors import InputError
from squeal.stability.crossing import CriticalPoint, Crossing, Thresholds
from squeal.stability.family import GROWING, SMALL
from squeal.stability.following.answer import followed
from squeal.stability.matrices import System, check_system, reduce
from squeal.stability.survey import Candidate, Change, Survey


def thresholds(
    system: System, mu_max: float, breakpoints: Iterable[float] = (), mu_min: float = 0.0
) -> Thresholds:
    """All thresholds of system(mu) -> (M, C, K) for mu_min <= mu <= mu_max, sorted.

    `system` must be smooth between the `breakpoints` (values of mu where it may jump, a change of
    contact for instance); it is asked for values next to them, never at them. A point at mu_min
    means that the system is quiet there and grows at once above it. A window of growth gives two
    points, however narrow: the limit is where rounding fills it, 1e-6 of mu or less. Raises
    InputError for an empty range and whatever `system` raises.
    """
    check_system(system, "thresholds")
    if _large(system, mu_max, mu_min):
        return followed(system, mu_max, breakpoints, mu_min)
    survey = Survey(system, mu_max, breakpoints, mu_min)
    return Thresholds(_verdict_changes(survey), _axis_crossings(survey))


def critical_points(
    system: System, mu_max: float, breakpoints: Iterable[float] = (), mu_min: float = 0.0
) -> list[CriticalPoint]:
    """All changes of verdict in mu_min <= mu <= mu_max, as `thresholds` finds them."""
    check_system(system, "critical_points")
    return thresholds(system, mu_max, breakpoints, mu_min).points


def crossings(
    system: System, mu_max: float, breakpoints: Iterable[float] = (), mu_min: float = 0.0
) -> list[Crossing]:
    """All crossings of the imaginary axis by any pair or real root, as `thresholds` finds them.

    Unlike `critical_points` it lists what happens while other modes grow. A pair without damping
    crosses where two frequencies coalesce or part. Divergent roots that join to a growing pair, or
    come from one, cross nothing.
    """
    check_system(system, "crossings")
    return thresholds(system, mu_max, breakpoints, mu_min).crossings


def _large(system: System, mu_max: float, mu_min: float) -> bool:
    """True if a system has more rows than the invariants and groups of `searches` are for, or a
    mass matrix that they cannot be reduced by."""
    if not (math.isfinite(mu_min) and math.isfinite(mu_max) and mu_min < mu_max):
        return False  # refused by the survey
    M, C, K = system(mu_min + 0.53 * (mu_max - mu_min))
    if np.shape(M)[0] > SMALL:
        return True
    try:
        reduce(M, C, K)
    except InputError:
        return bool(np.linalg.matrix_rank(np.asarray(M, dtype=float)) == len(np.asarray(M)))
    return False


def _verdict_changes(survey: Survey) -> list[CriticalPoint]:
    """The changes of verdict of a range that has been searched."""
    found = []
    for change in survey.changes():
        below, above = change.below.verdict, change.above.verdict
        if below != above:
            kind = above if above in GROWING else "restabilised"
            grows = above in GROWING
            omega = survey.frequency(change, above if grows else below, grows)
            candidate = _first(change, "flutter" if omega else "divergence")
            interval, converged = candidate.root.interval, candidate.root.converged
            frequency = omega / (2 * math.pi)
            found.append(CriticalPoint(change.mu, kind, frequency, interval, converged))
    return found


def _axis_crossings(survey: Survey) -> list[Crossing]:
    """The crossings of the axis in a range that has been searched."""
    found = []
    for change in survey.changes():
        pairs = change.above.pairs - change.below.pairs
        reals = change.above.reals - change.below.reals
        # two divergent roots for a growing pair: nothing crosses
        joined = min(abs(pairs), abs(reals) // 2) if pairs * reals < 0 else 0
        pairs, reals = (
            pairs - joined * int(np.sign(pairs)),
            reals - 2 * joined * int(np.sign(reals)),
        )
        events = [("flutter", pairs, k) for k in range(abs(pairs))]
        events += [("divergence", reals, k) for k in range(abs(reals))]
        for kind, rise, k in events:
            omega = survey.frequency(change, kind, rise > 0, k)
            found.append(
                Crossing(
                    change.mu,
                    kind,
                    "up" if rise > 0 else "down",
                    omega / (2 * math.pi),
                    _interval(survey, _first(change, kind)),
                    _mode(survey, change.mu, omega),
                    change.below.verdict != change.above.verdict,
                )
            )
    return found


def _first(change: Change, kind: str) -> Candidate:
    """The candidate at a place that announces this kind of change, or any."""
    for candidate in change.candidates:
        if candidate.search and (candidate.search.source == "zero") == (kind == "divergence"):
            return candidate
    return change.candidates[0]


def _interval(survey: Survey, candidate: Candidate) -> tuple[float, float]:
    if candidate.search is None:
        return candidate.root.interval
    return candidate.search.interval(survey.family, candidate.root)


def _mode(survey: Survey, mu: float, omega: float) -> int:
    damped = survey.family.at(mu).B is not None
    size = np.abs(survey.family.roots(mu, damped))
    slower = size < omega * (1 - 1e-6) if damped else np.sqrt(size) < omega * (1 - 1e-6)
    return 1 + int(np.sum(slower)) // (2 if damped else 1)
