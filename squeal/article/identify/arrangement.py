"""Statements with shuffled cases and edges: what a search is tried on beside the article's own."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from squeal.article.cases import CASES
from squeal.article.claims import CLAIMS, Case, Claim
from squeal.article.claims.measures import Linear, Range
from squeal.article.claims.rules import Outcome
from squeal.article.records import Record
from squeal.model.contact import LEAD, LEADING, TRAIL, TRAILING, State

LETTERS = "".join(CASES)
OPPOSITE_STATE = {LEAD: TRAIL, TRAIL: LEAD}
OPPOSITE_EDGE = {LEADING: TRAILING, TRAILING: LEADING}


class Arrangement(Record):
    """Which case of a model stands for each case that the statements name, and whose edges change.

    b1, b2: letters of the cases that take the place of a, b, c, d; a statement on both models
    follows b2. mirrored: ids of the statements in which leading and trailing edge change places.
    """

    b1: str = LETTERS
    b2: str = LETTERS
    mirrored: tuple[str, ...] = ()

    def outcome(self, claim: Claim, measured: Mapping[str, Case | Linear]) -> Outcome | None:
        """The outcome of a claim in this arrangement; None where one of its scenes is not measured.

        measured: measures by name of the scene, such as b1-a.
        """
        models = {scene.partition("-")[0] for scene in claim.scenes}
        letters = self.b1 if models == {"b1"} else self.b2
        arguments: list[Case | Linear] = []
        for scene in claim.scenes:
            model, _, case = scene.partition("-")
            name = scene
            if case:  # b3 has none
                name = f"{model}-{letters[LETTERS.index(case)]}"
            if name not in measured:
                return None
            measures = measured[name]
            if claim.id in self.mirrored and isinstance(measures, Case):
                measures = mirrored(measures, line=model == "b2")
            arguments.append(measures)
        return claim.rule(*arguments)


PRINTED = Arrangement()
"""The statements as the article has them."""


def shuffled(seed: int) -> Arrangement:
    """Random cases for each model, none of both as printed, and edges changed at random."""
    random = np.random.default_rng(seed)
    independent = [claim.id for claim in CLAIMS if claim.informative]
    while True:
        b1 = "".join(random.permutation([*LETTERS]))
        b2 = "".join(random.permutation([*LETTERS]))
        changed = random.random(len(independent)) < 0.5
        if b1 != LETTERS and b2 != LETTERS:
            chosen = (name for name, one in zip(independent, changed, strict=True) if one)
            return Arrangement(b1, b2, tuple(chosen))


def mirrored(case: Case, line: bool) -> Case:
    """A case with leading and trailing edge in each other's place.

    NaN stands for what no measure of the case gives: the mean of F4 (B1), and the speeds.
    """
    first = case.first
    second = case.second
    if line:  # reaction, and its position
        second = _negative(second)
    else:  # forces at the two edges
        first, second = second, first
    return replace(
        case,
        first=first,
        second=second,
        tilt=_negative(case.tilt),
        down=1.0 - case.down,
        mean=case.mean if line else math.nan,
        slip=math.nan,
        face=math.nan,
        separated=case.separated[::-1],
        heaviest=case.heaviest[::-1],
        vanishes=case.vanishes[::-1],
        losses=tuple(OPPOSITE_EDGE[edge] for edge in case.losses),
        shares={_opposite(state): share for state, share in case.shares.items()},
    )


def _negative(span: Range) -> Range:
    return Range(-span.high, -span.low)


def _opposite(state: State) -> State:
    return OPPOSITE_STATE.get(state, state)
