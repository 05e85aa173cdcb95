"""What the search makes small: claims that fail, then thin margins, for many pads at once."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from squeal.article.cases import CASES, stem
from squeal.article.claims import CLAIMS, Case, case_of, judge_claims, judge_scenes
from squeal.article.claims.measures import Linear, friction_raises, linear_measures
from squeal.article.claims.motions import measures
from squeal.article.identify.space import (
    MODELS,
    SPEED_LIMIT,
    STOP,
    Numbers,
    arrays,
    first_heights,
    pad_of,
    scenes_of,
    stacked,
)
from squeal.article.results.claims import JudgedClaim
from squeal.model.contact import Formulation
from squeal.simulation.ensemble import DONE, simulate_many

SEARCH_TOLERANCE = 1e-8
MAP_POINTS = 40  # a side, for the share of the map in the search
FAILED = 100.0  # cost of a pad whose motion leaves the model
# Below this cost at the horizon the doubled one counts as well, and the dearer of the two rules.
PROMISING = 3.5
DEEPEST = 0.5  # of the half height: how far the line contact may be pressed in at the start
BY_ID = {claim.id: claim for claim in CLAIMS}
CONFLICTS = {tuple(sorted((c.id, c.conflicts))) for c in CLAIMS if c.conflicts}


class Outcome(NamedTuple):
    """A pad judged: its claims, and the greatest x_dot of its eight motions (w sqrt(k1/m))."""

    judged: list[JudgedClaim]
    fastest: float


def judge_many(
    many: Sequence[Numbers],
    formulation: Formulation,
    stop: float = STOP,
    workers: int = 1,
    speed: float = SPEED_LIMIT,
) -> list[Outcome | None]:
    """Judge all claims on each of the dimensionless pads; None where a motion leaves the model.

    speed: of the surface (w sqrt(k1/m)).
    """
    if not many:
        return []
    numbers = arrays(many)
    each = np.repeat(np.arange(len(many)), len(CASES))  # the cases of a pad in turn
    repeated = {name: values[each] for name, values in numbers.items()}
    alpha1, alpha2 = np.tile(np.transpose(list(CASES.values())), len(many))
    results = {}
    for model, heights in zip(MODELS, first_heights(repeated), strict=True):
        first = np.zeros((len(each), 6))
        first[:, 1] = heights
        given = (pad_of(repeated, model, (alpha1, alpha2)), first, stop, SEARCH_TOLERANCE)
        results[model] = simulate_many(
            model, *given, formulation, measure=measures, workers=workers
        )
    raised = friction_raises(stacked(numbers, "B2", "b", formulation))
    outcomes: list[Outcome | None] = []
    for i, one in enumerate(many):
        rows = range(len(CASES) * i, len(CASES) * (i + 1))
        if any(found["outcome"][row] != DONE for found in results.values() for row in rows):
            outcomes.append(None)
            continue
        measured: dict[str, Case | Linear] = {
            stem(model, case): case_of(found, row, speed, float(raised[i]))
            for model, found in results.items()
            for case, row in zip(CASES, rows, strict=True)
        }
        pads = {"c": pad_of(one, "B2", CASES["c"])}
        measured["b3"] = linear_measures(pads, MAP_POINTS)
        fastest = max(float(found["fastest"][row]) for found in results.values() for row in rows)
        outcomes.append(Outcome(judge_claims(measured), fastest))
    return outcomes


def judge_one(
    numbers: Numbers, formulation: Formulation, tolerance: float = 1e-12, stop: float = STOP
) -> list[JudgedClaim]:
    """All claims judged on one pad, at a tight tolerance and with dense samples.

    Raises ComputationError where a motion leaves the model.
    """
    scenes = scenes_of(numbers, formulation, tolerance, stop)
    return judge_scenes(scenes["B1"], scenes["B2"])


def _price(judged: JudgedClaim, numbers: Numbers) -> float:
    """1 to 2 for a failing claim, by how far it fails; up to 1/2 for a thin margin, 0 for room."""
    claim = BY_ID[judged.id]
    room = judged.margin / (claim.ample * (numbers["F_n"] if claim.by_load else 1.0))
    if not math.isfinite(room):
        return 2.0
    return 1.0 - room / (1.0 - room) if room <= 0.0 else 0.5 * max(0.0, 1.0 - room) ** 2


def cost_of(outcome: Outcome | None, numbers: Numbers) -> float:
    """Sum of the claims' prices; of two that conflict the cheaper one counts.

    A pad pressed in too deep, or faster than the surface, pays for it.
    """
    if outcome is None:
        return FAILED
    prices = {j.id: _price(j, numbers) for j in outcome.judged}
    total = sum(prices.values())
    total -= sum(max(prices[a], prices[b]) for a, b in CONFLICTS)
    depth = numbers["preload"] * numbers["F_n"] / (numbers["k_c"] * numbers["h"])
    implausible = max(0.0, depth / DEEPEST - 1.0) + max(0.0, outcome.fastest / SPEED_LIMIT - 1.0)
    return total + 2.0 * implausible


def costs(many: Sequence[Numbers], formulation: Formulation, workers: int = 1) -> np.ndarray:
    """Cost of each pad; promising ones must also pay at the doubled horizon."""
    found = np.array(
        [
            cost_of(outcome, numbers)
            for outcome, numbers in zip(
                judge_many(many, formulation, STOP, workers), many, strict=True
            )
        ]
    )
    promising = np.flatnonzero(found < PROMISING)
    chosen = [many[int(i)] for i in promising]
    if chosen:
        longer = judge_many(chosen, formulation, 2 * STOP, workers)
        again = [cost_of(o, n) for o, n in zip(longer, chosen, strict=True)]
        found[promising] = np.maximum(found[promising], again)
    return found
