"""Sequential Monte Carlo over pads: subset simulation with the statements' distance.

Approximate Bayesian computation after Del Moral, Doucet and Jasra (2012), with the levels of subset
simulation (Au and Beck 2001): from pads drawn at random the half with the smaller distance goes on,
each moves once by a symmetric step, and a step is taken if it stays within the level. The prior is
uniform, so this leaves it, restricted to the level, unchanged; the product of the shares that go on
estimates the share of the ranges within the level. A population keeps several kinds of pads at
once, which a search for one best pad does not, and a step is rejected as soon as a partial sum of
the distance exceeds its own level, so that few of the eight motions are simulated.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from squeal.article.ensembles.distance import NO_LEVELS, judge
from squeal.article.ensembles.space import DIMENSIONS, FORMULATIONS, decode
from squeal.model.contact import Formulation
from squeal.model.pad import Model

POPULATION = 512
RANDOM_STAGES = 2  # stages of pads drawn at random, from which a search sets out
JOINT = (0.2, 0.5, 1.0)  # shares of the numbers that move at once
ACCEPTED = (0.15, 0.25)  # share of steps taken below which they shrink, above which they grow
USUAL = 0.97  # quantile of the partial sums of those nearest that is their level
SCATTER = 0.02  # of the ranges, besides the difference of two other pads


@dataclass(frozen=True)
class Stage:
    """What one stage proposed, and the population after it.

    points (n, dimensions), whole (n,), margins (n, claims): the proposed pads as judged; taken
    (n,): which entered the population; population (N, dimensions) and its partial sums (N, STEPS),
    whose last is the distance; levels (STEPS,): that the proposals had to meet; share: of the
    population that went on; width: of the next steps, against the usual one; motions, steps,
    seconds: effort, the last in CPU time.
    """

    points: np.ndarray
    whole: np.ndarray
    margins: np.ndarray
    taken: np.ndarray
    population: np.ndarray
    partial: np.ndarray
    levels: np.ndarray
    share: float
    width: float
    motions: int
    steps: int
    seconds: float


def _short(points: np.ndarray) -> np.ndarray:
    """Points as they are stored: single precision, so that a stored pad is the judged one."""
    return points.astype(np.float32).astype(float)


def _moved(
    points: np.ndarray, others: np.ndarray, width: float, random: np.random.Generator
) -> np.ndarray:
    """A symmetric step of each point: the difference of two other pads (ter Braak 2006)."""
    n, size = points.shape
    one, two = random.integers(0, len(others), (2, n))
    chosen = random.uniform(size=(n, size)) < random.choice(JOINT, n)[:, None]
    chosen[np.arange(n), random.integers(0, size, n)] = True
    reach = 2.38 / np.sqrt(2.0 * chosen.sum(axis=1)) * random.uniform(0.2, 1.0, n)
    reach[random.uniform(size=n) < 0.1] = 1.0
    scatter = SCATTER * random.standard_normal((n, size))
    step = reach[:, None] * (others[one] - others[two]) + scatter
    moved = np.where(chosen, points + width * step, points)
    moved = np.abs(np.mod(moved, 2.0))  # reflected at the ends of the ranges
    return np.asarray(np.where(moved > 1.0, 2.0 - moved, moved))


def chance(formulation: Formulation, seed: int, part: int) -> Stage:
    """More pads drawn at random, which no search uses: they tell the chance level."""
    random = np.random.default_rng([FORMULATIONS.index(formulation), seed, part, 1])
    return _anywhere(formulation, random, ("B1", "B2"))


def _anywhere(
    formulation: Formulation, random: np.random.Generator, models: tuple[Model, ...]
) -> Stage:
    """A stage of random pads, all of which enter the population."""
    points = _short(random.uniform(size=(POPULATION, len(DIMENSIONS))))
    return first_stage(points, formulation, models)


def first_stage(points: np.ndarray, formulation: Formulation, models: tuple[Model, ...]) -> Stage:
    """A stage of given points, all of whose pads that run enter the population."""
    begun = time.process_time()
    found = judge(decode(points), formulation, models=models)
    whole = found.whole
    population, effort = (points[whole], found.partial[whole]), (found.motions, found.steps)
    seconds = time.process_time() - begun
    return Stage(
        points, whole, found.margins, whole, *population, NO_LEVELS, 1.0, 1.0, *effort, seconds
    )


def _lower(before: Stage) -> tuple[np.ndarray, np.ndarray]:
    """The next levels, and which of the population keep all of them."""
    distance = before.partial[:, -1]
    near = before.partial[distance <= np.median(np.unique(distance))]
    levels = np.minimum(np.quantile(near, USUAL, axis=0), before.levels)
    levels[-1] = np.minimum(near[:, -1].max(), before.levels[-1])
    good = np.flatnonzero((before.partial <= levels).all(axis=1))
    if not good.size:  # of a few pads each may be the farthest in some sum
        levels = np.minimum(near.max(axis=0), before.levels)
        good = np.flatnonzero((before.partial <= levels).all(axis=1))
    return levels, good


def advance(
    formulation: Formulation,
    seed: int,
    stage: int,
    before: Stage | None,
    models: tuple[Model, ...] = ("B1", "B2"),
) -> Stage:
    """The next stage; it depends on its arguments alone. `before` is the stage before it."""
    begun = time.process_time()
    random = np.random.default_rng([FORMULATIONS.index(formulation), seed, stage])
    if stage < RANDOM_STAGES:
        drawn = _anywhere(formulation, random, models)
        if before is None:
            return drawn
        population = np.concatenate([before.population, drawn.population])
        partial = np.concatenate([before.partial, drawn.partial])
        best = np.argsort(partial[:, -1], kind="stable")[:POPULATION]
        share = len(best) / (RANDOM_STAGES * POPULATION)
        return replace(drawn, population=population[best], partial=partial[best], share=share)
    assert before is not None
    levels, good = _lower(before)
    width = before.width
    share = len(good) / len(before.population)
    # those that go on are repeated equally often, up to one
    again = np.resize(random.permutation(good), POPULATION)
    population, partial = before.population[again], before.partial[again]
    points = _short(_moved(population, before.population[good], width, random))
    found = judge(decode(points), formulation, levels, models)
    taken = found.whole
    if not ACCEPTED[0] <= taken.mean() <= ACCEPTED[1]:
        grown = width * (1.25 if taken.mean() > ACCEPTED[1] else 0.8)
        width = min(1.0, max(0.1, grown))
    population[taken], partial[taken] = points[taken], found.partial[taken]
    moved, effort = (points, taken, found.margins, taken), (found.motions, found.steps)
    seconds = time.process_time() - begun
    return Stage(*moved, population, partial, levels, share, width, *effort, seconds)
