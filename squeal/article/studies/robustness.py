"""How the claims fare around the pad of the report and over the plausible ranges."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from squeal.article.claims import CLAIMS
from squeal.article.ensembles.choice import read_choice
from squeal.article.ensembles.space import SPEED
from squeal.article.identify.objective import judge_many
from squeal.article.identify.space import BOUNDS, DIMENSIONS, LENGTH, TIME, Numbers, decode
from squeal.article.results.robustness import LEAST, STEPS, Break, Robustness, Sample, Share
from squeal.io.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version
from squeal.model.contact import Formulation
from squeal.numerics.shares import wilson

SPREADS = (0.01, 0.05, 0.2)  # standard deviations of the logarithms of all numbers together
PADS = 192  # in each sample
CONFIDENCE = 0.95


def holding(many: list[dict[str, float]], formulation: Formulation) -> np.ndarray:
    """Which claims hold on which pad, (pads, claims), V being that of the report's scenes; none
    where a motion leaves the model."""
    held = np.zeros((len(many), len(CLAIMS)), dtype=bool)
    speed = SPEED * TIME / LENGTH
    for i, outcome in enumerate(judge_many(many, formulation, speed=speed)):
        if outcome is not None:
            held[i] = [j.holds for j in outcome.judged]
    return held


def around(numbers: Numbers, spread: float, random: np.random.Generator) -> list[dict[str, float]]:
    """Pads whose numbers all scatter about the given ones (log-normal)."""
    factors = np.exp(spread * random.standard_normal((PADS, len(DIMENSIONS))))
    return [
        {d.name: numbers[d.name] * float(f) for d, f in zip(DIMENSIONS, row, strict=True)}
        for row in factors
    ]


def everywhere(random: np.random.Generator) -> list[dict[str, float]]:
    """Pads from all over the searched ranges."""
    low, high = np.array(BOUNDS).T
    points = random.uniform(size=(PADS, len(BOUNDS)))
    return [decode(low + (high - low) * point) for point in points]


def first_breaks(numbers: Numbers, formulation: Formulation) -> tuple[Break, ...]:
    """For each number and each way: the least relative change tried that breaks a claim, and which.

    `change` is None where none breaks up to halving or doubling.
    """
    sizes = np.geomspace(LEAST, 1.0, STEPS)
    factors = np.concatenate([1.0 + sizes, 1.0 / (1.0 + sizes)])
    many = [dict(numbers)]
    many += [{**numbers, d.name: numbers[d.name] * float(f)} for d in DIMENSIONS for f in factors]
    held = holding(many, formulation)
    kept = held[0]
    lost = (kept & ~held[1:]).reshape(len(DIMENSIONS), 2, STEPS, len(CLAIMS))
    found = []
    for d, ways in zip(DIMENSIONS, lost, strict=True):
        for way, table in zip(("more", "less"), ways, strict=True):
            broken = np.flatnonzero(table.any(axis=1))
            at = int(broken[0]) if broken.size else None
            change = None if at is None else float(sizes[at])
            gone = np.zeros(len(CLAIMS), dtype=bool) if at is None else table[at]
            names = tuple(c.id for c, lost in zip(CLAIMS, gone, strict=True) if lost)
            found.append(Break(d.name, way, change, names))
    return tuple(found)


def share(count: int, pads: int) -> Share:
    """A share of which `count` of so many pads were seen, with Wilson's interval."""
    return Share(count / pads, wilson(count, pads, CONFIDENCE))


def robustness(numbers: Numbers, formulation: Formulation, seed: int = 1) -> Robustness:
    """Shares of pads that keep each claim, in samples of growing width, and the first breaks."""
    random = np.random.default_rng(seed)
    samples = {f"{100 * s:g} %": around(numbers, s, random) for s in SPREADS}
    samples["ranges"] = everywhere(random)
    found = []
    for name, many in samples.items():
        held = holding(many, formulation)
        counts = zip(CLAIMS, held.sum(axis=0), strict=True)
        shares = {claim.id: share(int(n), len(many)) for claim, n in counts}
        found.append(Sample(name, len(many), float(np.median(held.sum(axis=1))), shares))
    return Robustness(tuple(found), first_breaks(numbers, formulation), CONFIDENCE)


def study(files: Sequence[Path]) -> Robustness:
    """The study of the pad of the report, left out without batches."""
    (file,) = files
    pad = read_choice(file)
    if version("heyoka") == NOT_INSTALLED:
        return Robustness(
            (), (), CONFIDENCE, f"{WITHOUT_HEYOKA} nothing else simulates batches of pads."
        )
    return robustness(pad.numbers, pad.law)
