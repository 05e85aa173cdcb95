"""How many statements random parameter sets satisfy, and which: what agreement is worth."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

from squeal.article.claims import CLAIMS
from squeal.article.identify.judging import INDEPENDENT, margins
from squeal.article.identify.space import DIMENSIONS, decode
from squeal.article.records import Record, Result
from squeal.article.studies._heyoka import without_heyoka
from squeal.model.contact import CONSISTENT, Formulation

SETS = 2000  # random ones, under each law
SEED = 1  # of their numbers
CONFIDENCE = 0.95  # of the intervals of shares
LAWS = {"consistent": CONSISTENT, "printed": Formulation("mean", "centre", "+")}
"""The contact law that has a potential, and that of Eq. (13), both with delta from the mass centre
and the sign that Eq. (10) needs."""


class Frequency(Record):
    """A share of random sets, and Wilson's interval."""

    share: float
    interval: tuple[float, float]


class Law(Record):
    """Random sets under one law: of so many, how many have valid motions; by claim the share of all
    that satisfies it; independent statements satisfied by the median set of valid motions, by the
    best, and by how many sets each number of them."""

    sets: int
    valid: int
    share: dict[str, Frequency]
    median: int
    best: int
    counts: tuple[int, ...]


class Baseline(Result):
    """By law; independent: how many statements are independent; confidence: of the intervals;
    left_out: why there is nothing, empty if there is."""

    laws: dict[str, Law]
    independent: int
    seed: int = SEED
    confidence: float = CONFIDENCE
    left_out: str = ""


def _interval(count: int, total: int) -> tuple[float, float]:
    interval = binomtest(count, total).proportion_ci(CONFIDENCE, "wilson")
    return float(interval.low), float(interval.high)


def judged(law: Formulation, sets: int) -> Law:
    """Judge so many random sets under a law: the share of each claim is of all sets, the numbers of
    satisfied statements are of the sets with valid motions alone."""
    points = np.random.default_rng(SEED).uniform(size=(sets, len(DIMENSIONS)))
    table, valid = margins(decode(points), law)
    satisfies = table > 0.0  # (set, claim); a margin that is NaN satisfies nothing
    share = {}
    for claim, count in zip(CLAIMS, satisfies.sum(axis=0).tolist(), strict=True):
        share[claim.id] = Frequency(count / sets, _interval(count, sets))
    # of each valid set how many statements it satisfies, of those that follow from no others
    satisfied = satisfies[valid][:, INDEPENDENT].sum(axis=1)
    counts = np.bincount(satisfied, minlength=int(INDEPENDENT.sum()) + 1)
    return Law(
        sets=sets,
        valid=int(valid.sum()),
        share=share,
        median=int(np.median(satisfied)),
        best=int(satisfied.max()),
        counts=tuple(counts.tolist()),
    )


def study(_: Sequence[Path]) -> Baseline:
    """Random sets under both laws, left out without batches."""
    independent = int(INDEPENDENT.sum())
    if why := without_heyoka("nothing else simulates thousands of pads."):
        return Baseline({}, independent, left_out=why)
    return Baseline({name: judged(law, SETS) for name, law in LAWS.items()}, independent)
