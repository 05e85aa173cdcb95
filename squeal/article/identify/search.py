"""Search for a parameter set that satisfies the most statements: model B2 first, then model B1.

The balances of force and moment say what a set needs for the statements on model B2; of random sets
hardly one in ten thousand has it. A start draws sets that have it. From the nearest of them CMA-ES
(Hansen 2016) goes to a set that satisfies the statements on B2, and then varies the numbers of B1
alone.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from squeal.article.cases import CASES
from squeal.article.claims import judge_scenes
from squeal.article.claims.judging import JudgedClaim
from squeal.article.identify.arrangement import PRINTED, Arrangement
from squeal.article.identify.judging import distance, margins
from squeal.article.identify.space import (
    DIMENSIONS,
    MODELS,
    NAMES,
    Dimension,
    Numbers,
    decode,
    scenes_of,
)
from squeal.article.records import Record, read_json
from squeal.errors import InputError
from squeal.io.writing import to_json, write_text
from squeal.model.contact import CONSISTENT, Formulation
from squeal.model.pad import Model

OWN = ("k3", "k4", "first_y")  # numbers that model B1 alone has
# random sets at once, and how often
DRAWN = 250_000
CHUNKS = 8
FIRST = 256  # sets that are judged before CMA-ES
TWICE = (1.65, 2.05)  # mean reaction of case (b) over that of case (a) in full contact
ROOM = (0.02, 0.9)  # of the half length, for the mean place in cases (a) and (b)
GENERATIONS = {"B2": 120, "B1": 30}
POPULATIONS = {"B2": 64, "B1": 24}  # sets a generation: on B2 all numbers vary, on B1 three
WIDTH = 0.05  # of the first generation, over the ranges
DIGITS = 6  # of the numbers: a claim that needs more of them holds by too small a margin


class SearchResult(Record):
    """A parameter set: its numbers, its distance from the statements, and the effort."""

    numbers: dict[str, float]
    distance: float
    seed: int
    starts: int = 0
    sets: int = 0


def allowed(n: Numbers) -> np.ndarray:
    """True (n,) for level, released pads whose equilibrium, taken in full contact, is as required.

    The balances of force and moment give the mean reactions R of cases (a) and (b) over F_n and
    where they act, over the half length: from the centre towards the leading and the trailing edge.
    In (a) spring 1 is upright and bears R - F_n = y - theta, spring 2 is level and balances
    friction at the height h, the contact has R = -k_c (y0 + y) and the moment -k_c theta/3:

        (R - F_n) - k_c theta/3 + 2 mu h R = 0

    With f = 6 mu h, depth = -y0/F_n and R in F_n the three equations give, without y and theta,
    (1 + (4 + f)/k_c) R = 1 + 3/k_c + depth, and R acts at k_c theta/(3 R) = 1 - 1/R + f/3.

    In (b) the springs change places: k2 (y + theta) = R - F_n, and the first term changes its sign.
    In (c) and (d) both inclined springs bear friction, and their vertical parts have the moment
    mu R tan(alpha): with the 2 mu h R from above the mean reaction acts on the trailing side for
    h/w < -tan(alpha)/2. The bound of (d) is the lesser one. Units are w = m = k1 = 1.
    """
    friction = 6.0 * n["mu"] * n["h"]  # f
    k2 = n["k2"]
    k_c = n["k_c"]
    # -y0/F_n of a released start: how deep it presses the contact in, and how far the springs have
    # moved down from their relaxed position, see `space.DIMENSIONS` for all numbers
    depth = n["preload"] / k_c + n["lift"]
    # reactions over F_n, positions over the half length
    reaction_a = (1.0 + 3.0 / k_c + depth) / (1.0 + (4.0 + friction) / k_c)
    reaction_b = (1.0 + (3.0 / k_c + depth) * k2) / (1.0 + (4.0 - friction) * k2 / k_c)
    position_a = 1.0 - 1.0 / reaction_a + friction / 3.0
    position_b = 1.0 - 1.0 / reaction_b - friction / 3.0
    inside_a = (position_a > ROOM[0]) & (position_a < ROOM[1])
    inside_b = (position_b > ROOM[0]) & (position_b < ROOM[1])
    ratio = reaction_b / reaction_a
    twice = (ratio > TWICE[0]) & (ratio < TWICE[1])
    flat = n["h"] < -math.tan(CASES["d"][0]) / 2.0
    level = np.abs(n["tilt"]) < 1.0  # beyond 1 and -1 the pad starts tilted
    released = n["start"] < 0.5  # the others start at rest on the disc
    return np.asarray(twice & flat & inside_a & inside_b & level & released)


class Start:
    """A start of a search, with random numbers of its own; `sets`: how many sets it has judged."""

    def __init__(
        self,
        formulation: Formulation,
        seed: Sequence[int],
        workers: int,
        screened: bool = True,
        arrangement: Arrangement = PRINTED,
        dimensions: Sequence[Dimension] = DIMENSIONS,
    ) -> None:
        """Prepare a start.

        Parameters
        ----------
        formulation : of the line contact
        seed : of the random numbers
        workers : processes that simulate
        screened : whether its first sets are those that the balances allow (`allowed`), which hold
            for the consistent law alone
        arrangement : of the statements
        dimensions : the numbers of a set with their ranges
        """
        self.formulation = formulation
        self.workers = workers
        self.screened = screened and formulation == CONSISTENT
        self.arrangement = arrangement
        self.dimensions = dimensions
        self.random = np.random.default_rng(seed)
        self.sets = 0  # judged so far

    def distances(self, points: np.ndarray, models: tuple[Model, ...]) -> np.ndarray:
        """Distance (n,) of points (n, dimensions) from the statements on some models."""
        numbers = decode(points, self.dimensions)
        self.sets += len(points)
        table, valid = margins(
            numbers, self.formulation, models, workers=self.workers, arrangement=self.arrangement
        )
        return distance(table, valid, numbers)

    def drawn(self) -> np.ndarray:
        """At most `FIRST` random points (n, dimensions), if screened such as the balances allow."""
        chunks: list[np.ndarray] = []
        for _ in range(CHUNKS):
            points = self.random.uniform(size=(DRAWN, len(DIMENSIONS)))
            if self.screened:
                points = points[allowed(decode(points, self.dimensions))]
            chunks.append(points[:FIRST])
            if sum(map(len, chunks)) >= FIRST:
                break
        return np.concatenate(chunks)[:FIRST]

    def near(self, middle: np.ndarray, names: Sequence[str], model: Model) -> np.ndarray:
        """The nearest point to the statements on a model that CMA-ES reaches from a first point.

        middle: that point (dimensions,); names: of the numbers that vary.
        """
        import cma

        free = [NAMES.index(name) for name in names]  # columns of points
        options = {
            "bounds": [0.0, 1.0],  # of the unit cube
            "popsize": POPULATIONS[model],
            "verbose": -9,  # nothing is printed
            "seed": int(self.random.integers(1, 2**31)),
        }
        strategy = cma.CMAEvolutionStrategy(middle[free], WIDTH, options)
        best = np.inf
        nearest = middle
        for _ in range(GENERATIONS[model]):
            candidates = np.array(strategy.ask())
            points = np.tile(middle, (len(candidates), 1))
            points[:, free] = candidates
            distances = self.distances(points, (model,))
            strategy.tell(list(candidates), distances.tolist())
            if distances.min() < best:
                best = float(distances.min())
                nearest = points[distances.argmin()]
            if best == 0.0 or strategy.stop():  # 0: all statements on the model are satisfied
                break
        return nearest

    def result(self) -> np.ndarray:
        """A point near to all statements: first to those on B2, then by the numbers of B1 alone."""
        points = self.drawn()
        nearest = points[self.distances(points, ("B2",)).argmin()]
        near_b2 = self.near(nearest, NAMES, "B2")
        points = np.tile(near_b2, (FIRST, 1))
        own = [NAMES.index(name) for name in OWN]
        points[:, own] = self.random.uniform(size=(FIRST, len(OWN)))
        nearest = points[self.distances(points, ("B1",)).argmin()]
        return self.near(nearest, OWN, "B1")


def rounded(point: np.ndarray, dimensions: Sequence[Dimension] = DIMENSIONS) -> dict[str, float]:
    """The numbers of a point (dimensions,), to `DIGITS`."""
    numbers = decode(point[None], dimensions)
    return {name: float(f"{v[0]:.{DIGITS}g}") for name, v in numbers.items()}


def arrays(numbers: dict[str, float]) -> dict[str, np.ndarray]:
    """The numbers of one parameter set as arrays (1,)."""
    return {name: np.array([value]) for name, value in numbers.items()}


def _resumed(file: Path | None, seed: int) -> SearchResult:
    """What an earlier search left in a file, or nothing. Raises InputError if it is another."""
    if file is None or not file.exists():
        return SearchResult({}, math.inf, seed)
    saved = read_json(SearchResult, file)
    if saved.seed != seed:
        raise InputError(f"--state {file}: holds the search of seed {saved.seed}, not of {seed}")
    return saved


def search(
    formulation: Formulation,
    seed: int = 1,
    seconds: float = 600.0,
    state: Path | None = None,
    workers: int = 1,
    tell: Callable[[str], None] = lambda _: None,
    starts: float = math.inf,
) -> SearchResult:
    """The nearest set to the statements of some starts, for about `seconds` or so many `starts`.

    Finished starts are written to the file `state`; a later call continues after them. An interrupt
    ends the search with the best set so far, if there is one. Repeatable from the seed for a given
    number of starts. workers: processes; tell: receives a line after each start. Raises InputError
    if the file is of another search, ComputationError without heyoka.
    """
    begin = time.monotonic()
    best = _resumed(state, seed)
    last = best.starts + starts
    # some set is always found, however little time there is
    while best.starts < last and (not best.numbers or time.monotonic() - begin < seconds):
        start = Start(formulation, [seed, best.starts], workers)
        try:
            numbers = rounded(start.result())
        except KeyboardInterrupt:
            if not best.numbers:
                raise
            tell("stopped; the best set so far follows")
            break
        table, valid = margins(arrays(numbers), formulation)
        far = distance(table, valid, arrays(numbers)).item()  # of this start from the statements
        if far < best.distance:
            best = replace(best, numbers=numbers, distance=far)
        best = replace(best, starts=best.starts + 1, sets=best.sets + start.sets)
        if state is not None:
            write_text(state, to_json(best.to_dict()))
        tell(f"start {best.starts}: distance {far:.3f}, best {best.distance:.3f}, {best.sets} sets")
    return best


def judged(best: SearchResult, formulation: Formulation) -> list[JudgedClaim]:
    """All claims on the set that was found, at a tight tolerance.

    Raises ComputationError where a motion leaves the model.
    """
    scenes = scenes_of(arrays(best.numbers), formulation)
    return judge_scenes(*(scenes[model] for model in MODELS))
