"""Distance of pads from the article's statements, case by case and only as far as it matters."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from squeal.article.cases import CASES, stem
from squeal.article.claims import CLAIMS, Case, Claim, case_of
from squeal.article.claims.measures import Linear, friction_raises, linear_measures
from squeal.article.claims.motions import PLACES, measures
from squeal.article.ensembles.space import Numbers, speed_limit, starts
from squeal.article.identify.objective import MAP_POINTS, SEARCH_TOLERANCE
from squeal.article.identify.space import STOP, pad_of, stacked
from squeal.model.contact import Formulation
from squeal.model.pad import Model
from squeal.simulation.ensemble import DONE, Arrays, simulate_many

ORDER: tuple[tuple[Model, str], ...] = (
    ("B2", "c"), ("B2", "d"), ("B2", "a"), ("B2", "b"),
    ("B1", "d"), ("B1", "b"), ("B1", "a"), ("B1", "c"),
)  # fmt: skip
"""The scenes from the one that rejects most pads to the one that rejects fewest."""
STEPS = len(ORDER) + 1  # of the judging: each scene, and model B3
LEFT_OUT = ("B2-only-c", "B3-singular", "B3-none")
PARTS = ("B2-a-contact", "B2-b-contact", "B2-c-loss", "B2-d-contact")
FOLLOWING = ("B2-b-tilt", "B2-c-hammer", "B2-b-raised", "B12-sliding")
"""Statements that follow from others or from algebra or are free, seen so after the searches."""
COUNTED = tuple(
    c for c in CLAIMS if (c.informative or c.id in (*PARTS, *FOLLOWING)) and c.id not in LEFT_OUT
)
"""The statements in the distance: the informative ones, B2-only-c by its four parts, and those of
`FOLLOWING`, because the stored searches went by them."""
Counted = tuple[Claim, ...]
PAIR = ("B2-b-tilt", "B2-b-theta")  # exclude each other: the nearer one counts
INDEX = {claim.id: i for i, claim in enumerate(CLAIMS)}


NO_LEVELS = np.full(STEPS, math.inf)


@dataclass(frozen=True)
class Judgement:
    """What n pads came to.

    partial (n, STEPS): sum over the statements that are judged after each step, inf where a motion
    leaves the model, NaN after an early rejection; whole (n,): judged on all scenes; margins
    (n, claims): of all claims of the catalogue, NaN where not judged; motions, steps: simulated
    motions and integration steps.
    """

    partial: np.ndarray
    whole: np.ndarray
    margins: np.ndarray
    motions: int
    steps: int


def price(claim: Claim, margin: float, load: float) -> float:
    """0 for a statement that holds, else 1 to 2 by how far it fails."""
    if margin > 0.0:
        return 0.0
    room = -margin / (claim.ample * (load if claim.by_load else 1.0))
    return 2.0 if not math.isfinite(room) else 1.0 + room / (1.0 + room)


class _Judging:
    """The judging of n pads while their scenes come in."""

    def __init__(
        self,
        numbers: Numbers,
        formulation: Formulation,
        counted: Counted,
        stop: float | np.ndarray,
        places: int,
    ) -> None:
        self.numbers, self.formulation, self.counted = numbers, formulation, counted
        count = len(numbers["h"])
        self.stop = np.broadcast_to(stop, count)
        self.measure = partial(measures, places=places, calm=False)
        self.margins = np.full((count, len(CLAIMS)), np.nan)
        self.prices = np.zeros((count, len(CLAIMS)))
        self.measured: list[dict[str, Case | Linear]] = [{} for _ in range(count)]
        self.failed = np.zeros(count, dtype=bool)
        self.motions = self.steps = 0
        self._simulated: dict[tuple[Model, str], tuple[np.ndarray, Arrays]] = {}

    def distance(self) -> np.ndarray:
        """Lower bound of the distance from what is known, (n,)."""
        a, b = (self.prices[:, INDEX[name]] for name in PAIR)
        pair = all(CLAIMS[INDEX[name]] in self.counted for name in PAIR)
        total = self.prices.sum(axis=1) - (np.maximum(a, b) if pair else 0.0)
        return np.where(self.failed, np.inf, total)

    def _settle(self, pads: np.ndarray, arrived: str) -> None:
        """Judge all claims whose last scene has arrived."""
        for claim in CLAIMS:
            if arrived not in claim.scenes:
                continue
            at, counted = INDEX[claim.id], claim in self.counted
            for i in pads.tolist():
                measured = self.measured[i]
                if all(scene in measured for scene in claim.scenes):
                    margin = claim.rule(*(measured[scene] for scene in claim.scenes)).margin
                    self.margins[i, at] = margin
                    if counted:
                        self.prices[i, at] = price(claim, margin, float(self.numbers["F_n"][i]))

    def _simulate(self, pads: np.ndarray, model: Model, cases: Sequence[str]) -> None:
        """Simulate some cases of some pads (indices), all at once: wide batches cost less."""
        numbers = {name: v[pads] for name, v in self.numbers.items()}
        stacks = [stacked(numbers, model, case, self.formulation) for case in cases]
        first = np.concatenate([starts(numbers, stack) for stack in stacks])
        able = np.isfinite(first).all(axis=1)
        given = [stack.pad.given() for stack in stacks]
        columns = {n: np.concatenate([one[n] for one in given])[able] for n in given[0]}
        self._simulated |= {(model, case): (pads[:0], {}) for case in cases}
        if not able.any():
            return
        stop = np.tile(self.stop[pads], len(cases))[able]
        motions = (stacks[0].pad.replace(**columns), first[able], stop, SEARCH_TOLERANCE)
        found = simulate_many(model, *motions, self.formulation, measure=self.measure)
        of, ids = np.divmod(np.flatnonzero(able), len(pads))
        for i, case in enumerate(cases):
            own = {name: values[of == i] for name, values in found.items()}
            self._simulated[model, case] = pads[ids[of == i]], own

    def scene(self, pads: np.ndarray, model: Model, case: str, cases: Sequence[str]) -> None:
        """Judge what can be judged of some pads (indices) once this scene is there.

        The scenes of `cases` are simulated with it, if they are not there yet.
        """
        if (model, case) not in self._simulated:
            self._simulate(pads, model, cases)
        there, found = self._simulated.pop((model, case))
        self.failed[np.setdiff1d(pads, there)] = True
        rows = np.flatnonzero(np.isin(there, pads))
        pads = there[rows]
        if not pads.size:
            return
        raised = np.full(pads.size, np.nan)
        if (model, case) == ("B2", "b"):
            numbers = {name: v[pads] for name, v in self.numbers.items()}
            raised = friction_raises(stacked(numbers, model, case, self.formulation))
        self.motions += pads.size
        self.steps += int(found["steps"][rows].sum())
        speed = speed_limit(self.numbers)[pads]
        ended = found["outcome"][rows] == DONE
        self.failed[pads[~ended]] = True
        for i in np.flatnonzero(ended).tolist():
            self.measured[int(pads[i])][stem(model, case)] = case_of(
                found, int(rows[i]), float(speed[i]), float(raised[i])
            )
        self._settle(pads[ended], stem(model, case))

    def linear(self, pads: np.ndarray) -> None:
        """Judge the claims on model B3."""
        for i in pads.tolist():
            one = {name: float(v[i]) for name, v in self.numbers.items()}
            pad = {"c": pad_of(one, "B2", CASES["c"])}
            self.measured[i]["b3"] = linear_measures(pad, MAP_POINTS)
        self._settle(pads, "b3")


def judge(
    numbers: Numbers,
    formulation: Formulation,
    levels: np.ndarray = NO_LEVELS,
    models: tuple[Model, ...] = ("B1", "B2"),
    stop: float | np.ndarray = STOP,
    places: int = PLACES,
) -> Judgement:
    """Judge n pads over a horizon; a pad is left as soon as a partial sum exceeds its level.

    levels (STEPS,): for the partial sums; stop: the horizon, of all or of each (n,); places: those
    in each step at which signals are read. With one model only, its scenes alone are simulated and
    its claims counted.
    """
    names = {stem(*pair) for pair in ORDER if pair[0] in models}
    counted = tuple(c for c in COUNTED if names.issuperset({*c.scenes} - {"b3"}))
    judging = _Judging(numbers, formulation, counted, stop, places)
    early = bool(np.isfinite(levels).any())
    alive = np.arange(len(numbers["h"]))
    partial = np.full((len(alive), STEPS), np.nan)
    for step, pair in enumerate((*ORDER, None)):
        if pair is None:
            judging.linear(alive)
        elif pair[0] in models:
            judging.scene(alive, *pair, [pair[1]] if early else list(CASES))
        partial[alive, step] = judging.distance()[alive]
        alive = alive[partial[alive, step] <= levels[step]]
        alive = alive[np.isfinite(partial[alive, step])]
    whole = np.zeros(len(partial), dtype=bool)
    whole[alive] = True
    return Judgement(partial, whole, judging.margins, judging.motions, judging.steps)
