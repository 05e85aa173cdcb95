"""Model B2 first, then model B1 on what it leaves: `python -m squeal.article.ensembles.balanced`.

The balances say what a pad needs that keeps all statements on model B2 (see `balance`); of random
pads hardly one in ten thousand has it. A search from those that do, with a population and then with
CMA-ES, looks for a pad that keeps all of them; another for the numbers that model B1 alone has.
"""

import argparse
import json
import sys
from collections.abc import Sequence

import numpy as np

from squeal.article.ensembles.balance import flattest
from squeal.article.ensembles.distance import judge
from squeal.article.ensembles.population import POPULATION, advance, first_stage
from squeal.article.ensembles.space import DIMENSIONS, NAMES, Numbers, decode
from squeal.model.contact import CONSISTENT
from squeal.model.pad import Model

DRAWN = 4_000_000
TWICE = (1.65, 2.05)  # mean reaction of case (b) over that of case (a) in full contact
ROOM = (0.02, 0.9)  # of the half length, for the mean place in cases (a) and (b)
FIRST = 200  # number of the first stage, apart from those of other searches
STAGES, GENERATIONS = 60, 150
OWN = ("k3", "k4", "first_y")  # numbers that model B1 alone has
POINTS, TRIED = 2500, 10
DIGITS = 6


def allowed(n: Numbers) -> np.ndarray:
    """True (n,) for level, released pads whose rest, taken in full contact, is as asked."""
    slope, k2, k_c = 6.0 * n["mu"] * n["h"], n["k2"], n["k_c"]
    depth = n["preload"] / k_c + n["lift"]
    a = (1.0 + 3.0 / k_c + depth) / (1.0 + (4.0 + slope) / k_c)
    b = (1.0 + (3.0 / k_c + depth) * k2) / (1.0 + (4.0 - slope) * k2 / k_c)
    places = np.array([1.0 - 1.0 / a + slope / 3.0, 1.0 - 1.0 / b - slope / 3.0])
    good = (TWICE[0] < b / a) & (b / a < TWICE[1]) & (n["h"] < flattest("d"))
    inside = (places > ROOM[0]) & (places < ROOM[1])
    return np.asarray(good & inside.all(axis=0) & (np.abs(n["tilt"]) < 1.0) & (n["start"] < 0.5))


def _distances(points: np.ndarray, model: Model) -> np.ndarray:
    far = judge(decode(points), CONSISTENT, models=(model,)).partial[:, -1]
    return np.where(np.isfinite(far), far, 99.0)


def _near(
    middle: np.ndarray, free: Sequence[int], model: Model, width: float, seed: int, turns: int
) -> tuple[float, np.ndarray]:
    """The nearest point by CMA-ES in some of the coordinates, and its distance."""
    import cma

    options = {"bounds": [0.0, 1.0], "popsize": 24 if len(free) < 5 else 64, "seed": seed}
    strategy = cma.CMAEvolutionStrategy(middle[list(free)], width, options | {"verbose": -9})
    best, nearest = np.inf, middle
    for _ in range(turns):
        some = np.array(strategy.ask())
        points = np.tile(middle, (len(some), 1))
        points[:, list(free)] = some
        far = _distances(points, model)
        strategy.tell(list(some), far.tolist())
        if far.min() < best:
            best, nearest = float(far.min()), points[far.argmin()]
        if best == 0.0:
            break
    return best, nearest


def line_contact(seed: int) -> tuple[float, np.ndarray]:
    """A point near to all statements on model B2, and its distance from them."""
    random = np.random.default_rng([seed, 77])
    points = random.uniform(size=(DRAWN, len(DIMENSIONS))).astype(np.float32).astype(float)
    points = points[allowed(decode(points))][: 6 * POPULATION]
    last = first_stage(points, CONSISTENT, ("B2",))
    for stage in range(STAGES):
        last = advance(CONSISTENT, seed, FIRST + stage, last, ("B2",))
    nearest = last.population[last.partial[:, -1].argmin()]
    return _near(nearest, range(len(DIMENSIONS)), "B2", 0.03, seed, GENERATIONS)


def point_contact(point: np.ndarray, seed: int) -> tuple[float, np.ndarray]:
    """The point with the numbers of model B1 that come nearest to the statements on it."""
    random, free = np.random.default_rng(seed + 50), [NAMES.index(name) for name in OWN]
    points = np.tile(point, (POINTS, 1))
    points[:, free] = random.uniform(size=(POINTS, len(free)))
    order = np.argsort(_distances(points, "B1"))[:TRIED]
    tries = (_near(points[i], free, "B1", 0.03, 10 * seed + 1, 25) for i in order)
    return min(tries, key=lambda one: one[0])


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the numbers of the pad that the search comes to, and how far it is."""
    parser = argparse.ArgumentParser(description="Search model B2 first, then model B1.")
    parser.add_argument("--seed", type=int, default=1)
    seed = parser.parse_args(arguments).seed
    line, point = line_contact(seed)
    edges, point = point_contact(point, seed)
    numbers = {name: float(f"{v[0]:.{DIGITS}g}") for name, v in decode(point[None]).items()}
    print(json.dumps({"B2": line, "B1": edges, "numbers": numbers}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
