"""How far parameter sets satisfy the article's statements, many sets at once."""

import math
from functools import partial

import numpy as np

from squeal.article.cases import CASES, stem
from squeal.article.claims import CLAIMS, Case, Claim, case_of
from squeal.article.claims.measures import Linear, friction_raises, linear_measures
from squeal.article.claims.motions import measures
from squeal.article.identify.arrangement import PRINTED, Arrangement
from squeal.article.identify.ensemble import DONE, simulate_many
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
    stop: float = STOP,
    workers: int = 1,
    arrangement: Arrangement = PRINTED,
) -> tuple[np.ndarray, np.ndarray]:
    """Margins (n, claims) of all claims on n parameter sets, and which (n,) motions are valid.

    A margin is NaN where a motion leaves the model, and for a claim about a model left out. The
    claims may be arranged in another way than the article's.
    """
    n = len(numbers["h"])
    measured: list[dict[str, Case | Linear]] = [{} for _ in range(n)]
    whole = np.ones(n, dtype=bool)
    speed = speed_limit(numbers)
    for model in models:
        stacks = [stacked(numbers, model, case, formulation) for case in CASES]
        first = np.concatenate([starts(numbers, stack) for stack in stacks])
        able = np.flatnonzero(np.isfinite(first).all(axis=1))
        given = [stack.pad.given() for stack in stacks]
        columns = {name: np.concatenate([one[name] for one in given])[able] for name in given[0]}
        motions = (stacks[0].pad.replace(**columns), first[able], stop, TOLERANCE, formulation)
        how = partial(measures, calm=False)
        arrays = simulate_many(model, *motions, measure=how, workers=workers)
        raised = np.full(n, np.nan)
        if model == "B2":
            raised = friction_raises(stacks[list(CASES).index("b")])
        done = np.zeros(len(first), dtype=bool)
        done[able] = arrays["outcome"] == DONE
        whole &= done.reshape(len(CASES), n).all(axis=0)
        for row, (at, done_) in enumerate(zip(able.tolist(), done[able].tolist(), strict=True)):
            case, i = divmod(at, n)
            if done_:
                name = stem(model, list(CASES)[case])
                last = float(raised[i]) if name == "b2-b" else math.nan
                measured[i][name] = case_of(arrays, row, float(speed[i]), last)
    table = np.full((n, len(CLAIMS)), np.nan)
    for i in np.flatnonzero(whole).tolist():
        one = {name: v[i] for name, v in numbers.items()}
        pads = {"c": pad_of(one, "B2", CASES["c"])}
        judged = measured[i] | {"b3": linear_measures(pads, MAP_POINTS)}
        for column, claim in enumerate(CLAIMS):
            outcome = arrangement.outcome(claim, judged)
            if outcome is not None:
                table[i, column] = outcome.margin
    return table, whole


def price(claim: Claim, margin: float, load: float) -> float:
    """0 for a statement that holds, else 1 to 2 by how far it fails."""
    if margin > 0.0:
        return 0.0
    room = -margin / (claim.ample * (load if claim.by_load else 1.0))
    return 2.0 if not math.isfinite(room) else 1.0 + room / (1.0 + room)


def distance(table: np.ndarray, whole: np.ndarray, numbers: Numbers) -> np.ndarray:
    """Distance (n,) of sets from the independent statements, those that were not judged aside."""
    total = np.zeros(len(table))
    for claim, column in zip(CLAIMS, table.T, strict=True):
        if claim.informative:
            pairs = zip(column.tolist(), numbers["F_n"].tolist(), strict=True)
            total += [0.0 if math.isnan(m) else price(claim, m, load) for m, load in pairs]
    return np.where(whole, total, FAILED)
