"""How far parameter sets satisfy the article's statements, many sets at once."""

import math
from functools import partial

import numpy as np

from squeal.article.cases import CASES, stem
from squeal.article.claims import CLAIMS, Case, Claim, case_of
from squeal.article.claims.measures import Linear, friction_raises, linear_measures
from squeal.article.claims.motions import measures
from squeal.article.identify.arrangement import PRINTED, Arrangement
from squeal.article.identify.ensemble import simulate_stacks
from squeal.article.identify.space import (
    MODELS,
    STOP,
    Numbers,
    pad_of,
    speed_limit,
    stacked,
    starts,
)
from squeal.model.contact import Formulation
from squeal.model.pad import Model

TOLERANCE = 1e-8  # of the motions
MAP_POINTS = 40  # a side, for the share of the map
FAILED = 100.0  # distance of a set whose motion leaves the model
INDEPENDENT = np.array([claim.informative for claim in CLAIMS])
"""Which claims of the catalogue follow from no others."""


def margins(
    numbers: Numbers,
    formulation: Formulation,
    models: tuple[Model, ...] = MODELS,
    workers: int = 1,
    arrangement: Arrangement = PRINTED,
) -> tuple[np.ndarray, np.ndarray]:
    """Margins (n, claims) of all claims on n parameter sets, and which (n,) motions are valid.

    A margin is NaN where a motion leaves the model or has no initial state, and for a claim about a
    model left out. numbers: the parameters (n,) of the sets by name; arrangement: which scene each
    claim is about, if not the article's.
    """
    n = len(numbers["h"])
    measured: list[dict[str, Case | Linear]] = [{} for _ in range(n)]
    valid = np.ones(n, dtype=bool)
    for model in models:
        for i, cases in enumerate(_measured_cases(numbers, formulation, model, workers)):
            measured[i] |= cases
            valid[i] &= len(cases) == len(CASES)
    table = np.full((n, len(CLAIMS)), np.nan)
    for i in np.flatnonzero(valid).tolist():
        measures_by_scene = measured[i] | {"b3": linear_of_set(numbers, i)}
        for column, claim in enumerate(CLAIMS):
            outcome = arrangement.outcome(claim, measures_by_scene)
            if outcome is not None:
                table[i, column] = outcome.margin
    return table, valid


def linear_of_set(numbers: Numbers, i: int) -> Linear:
    """What the claims on model B3 need of parameter set i: rank of K and share of the map.

    The rank is that of case (c): K is singular in all cases alike.
    """
    of_set = {name: values[i] for name, values in numbers.items()}
    return linear_measures({"c": pad_of(of_set, "B2", CASES["c"])}, MAP_POINTS)


def _measured_cases(
    numbers: Numbers, formulation: Formulation, model: Model, workers: int
) -> list[dict[str, Case]]:
    """The measures of the cases of a model by name of the scene, for each of n parameter sets.

    Cases are left out whose motion leaves the model or has no initial state.
    """
    n = len(numbers["h"])
    measured: list[dict[str, Case]] = [{} for _ in range(n)]
    stacks = [stacked(numbers, model, case, formulation) for case in CASES]
    states = np.array([starts(numbers, stack) for stack in stacks])
    measure = partial(measures, calm=False)
    # rows (cases, n): of each motion in the arrays, -1 where it has no initial state
    arrays, rows = simulate_stacks(stacks, states, STOP, TOLERANCE, measure, workers)
    speed = speed_limit(numbers)
    for case, stack, rows_of_case in zip(CASES, stacks, rows.tolist(), strict=True):
        name = stem(model, case)
        raised = np.full(n, math.nan)
        if name == "b2-b":  # the only claim on the reaction at rest is about this scene
            raised = friction_raises(stack)
        for i, row in enumerate(rows_of_case):
            if row >= 0 and arrays["valid"][row]:
                measured[i][name] = case_of(arrays, row, float(speed[i]), float(raised[i]))
    return measured


def price(claim: Claim, margin: float, load: float) -> float:
    """0 for a statement that holds, else 1 to 2 by how far it fails.

    load: F_n / (k1 w), over which some margins count.
    """
    if margin > 0.0:
        return 0.0
    ample = claim.ample * load if claim.by_load else claim.ample
    failing = -margin / ample
    if not math.isfinite(failing):
        return 2.0
    return 1.0 + failing / (1.0 + failing)


def distance(table: np.ndarray, valid: np.ndarray, numbers: Numbers) -> np.ndarray:
    """Distance (n,) of sets from the independent statements, from what `margins` returns.

    The sum of their prices, those that were not judged aside.
    """
    loads = numbers["F_n"].tolist()
    total = np.zeros(len(table))
    for claim, column in zip(CLAIMS, table.T, strict=True):
        if not claim.informative:
            continue
        for i, margin in enumerate(column.tolist()):
            if not math.isnan(margin):
                total[i] += price(claim, margin, loads[i])
    return np.where(valid, total, FAILED)
