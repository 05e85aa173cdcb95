"""The pad of the report, chosen from the ensembles by what an engineer would ask of one.

`python -m squeal.article.ensembles.choosing workflow/ensembles.npz > workflow/pad.json` chooses it;
with `--scenes FOLDER` it also writes its scenes.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from squeal.article.cases import CASES
from squeal.article.claims import CLAIMS
from squeal.article.ensembles.choice import Choice
from squeal.article.ensembles.distance import Judgement, judge
from squeal.article.ensembles.gather import COUNTS, UNJUDGED, Kept, counts, read_kept
from squeal.article.ensembles.space import DIMENSIONS, FORMULATIONS, SPEED, decode, starts
from squeal.article.identify.space import MODELS, STOP, arrays, stacked
from squeal.article.identify.write import check_folder, write_scenes
from squeal.article.results.ensembles import ELSEWHERE, Pad
from squeal.article.results.ensembles import Kept as Counts
from squeal.article.results.robustness import Share
from squeal.article.results.verify import Switches
from squeal.cli.streams import exit_code
from squeal.io.writing import to_json
from squeal.model.contact import CONSISTENT, Formulation
from squeal.numerics.shares import wilson

WINDOWS = (1, 3, 10, 40)
LAWS = {"consistent": CONSISTENT, "printed force": Formulation("mean", "centre", "+")}
"""The two laws that a pad is judged under, side by side: the force of Eq. (13) with delta from the
mass centre and the sign that Eq. (10) needs, and the one that has a potential."""
RIVAL = {
    "h": 0.592499, "inertia": 1.08695, "k2": 0.77824, "k3": 0.269525, "k4": 0.780361,
    "k_c": 0.597405, "L": 1.0, "mu": 0.320313, "F_n": 2.00002e-4, "preload": 2.14671,
    "lift": 0.932908, "first_y": 0.0209567, "first_x": 0.0, "tilt": 0.0, "x0": 0.0, "start": 0.0,
}  # fmt: skip
"""A pad of the consistent law that was found apart from these searches."""
MOST = {
    "h": 0.17941, "inertia": 0.772309, "k2": 1.54689, "k3": 0.0741395, "k4": 0.823055,
    "k_c": 0.595987, "L": 8.26026, "mu": 0.595212, "F_n": 0.0126133, "preload": 3.09249,
    "lift": 3.99012, "first_y": 0.240283, "first_x": 0.76021, "tilt": 0.383822, "x0": -0.233703,
    "start": 0.116853,
}  # fmt: skip
"""A pad of the consistent law that keeps most of the listed statements: `balanced` found it."""
PLAUSIBLE = {"mu": (0.2, 0.5), "L": (0.5, 4.0), "F_n": (1e-4, 3e-3), "h": (0.1, 0.7)}
"""What an engineer would take: linings, supports of 20 to 160 mm, 2 kN on a stiff caliper, and a
pad longer than high."""
LONGER = 3  # candidates that are judged over longer times
SCATTER, SCATTERED = 0.01, 192  # relative, and how many pads
DIGITS = 6  # a pad that needs more to keep a claim would hold it by a hair


def names(chosen: np.ndarray) -> tuple[str, ...]:
    """Names of some claims (claims,) of the catalogue."""
    return tuple(c.id for c, there in zip(CLAIMS, chosen, strict=True) if there)


def failing(margins: np.ndarray) -> tuple[str, ...]:
    """The counted claims that margins (claims,) do not keep."""
    return names(COUNTS & ~(margins > 0.0))


def over_windows(
    numbers: dict[str, np.ndarray], formulation: Formulation
) -> tuple[list[dict[str, Counts | None]], dict[int, Judgement]]:
    """What each pad keeps over each of the windows, and the judgements, in each of which motions
    and steps are those of all windows."""
    # all windows at once: the long motions of few pads leave most lanes of the processor idle
    count = len(WINDOWS)
    every = {name: np.tile(values, count) for name, values in numbers.items()}
    stops = np.repeat(WINDOWS, len(numbers["h"])) * STOP
    one = judge(every, formulation, stop=stops)
    parts = zip(*(np.split(a, count) for a in (one.partial, one.whole, one.margins)), strict=True)
    found = {
        window: Judgement(partial, whole, margins, one.motions, one.steps)
        for window, (partial, whole, margins) in zip(WINDOWS, parts, strict=True)
    }
    rows: list[dict[str, Counts | None]] = [
        {
            str(w): Counts(*(int(n[0]) for n in counts(j.margins[i][None]))) if j.whole[i] else None
            for w, j in found.items()
        }
        for i in range(len(numbers["h"]))
    ]
    return rows, found


def _least_speed(margins: np.ndarray) -> float:
    """Speed of the surface in m/s at which sliding holds, on the scale of the pad's load."""
    at = next(i for i, c in enumerate(CLAIMS) if c.id == "B12-sliding")
    return float(SPEED * (1.0 - margins[at]))


def _around(numbers: dict[str, float]) -> dict[str, np.ndarray]:
    """Pads whose numbers are all off a little, in proportion, so that zeros stay; so does the kind
    of the start."""
    random = np.random.default_rng(1)
    return {
        d.name: numbers[d.name]
        * (1.0 + SCATTER * (d.name != "start") * random.standard_normal(SCATTERED))
        for d in DIMENSIONS
    }


def side_by_side(
    pads: Sequence[dict[str, float]], laws: Mapping[str, Formulation] = LAWS
) -> list[dict[str, Pad]]:
    """Each pad under both laws, or under some in which its motions do not leave the model."""
    found: list[dict[str, Pad]] = [{} for _ in pads]
    for name, f in laws.items():
        rows, judged = over_windows(arrays(pads), f)
        for i, numbers in enumerate(pads):
            first = judged[1]
            found[i][name] = Pad(
                numbers=numbers,
                horizons=rows[i],
                failing={
                    str(w): names(~((j.margins[i] > 0.0) | UNJUDGED)) if j.whole[i] else None
                    for w, j in judged.items()
                },
                distance=float(first.partial[i, -1]),
                least_speed=_least_speed(first.margins[i]),
            )
    return found


def steadied(pads: Mapping[str, Pad]) -> dict[str, Pad]:
    """A pad by law with the share of those around it that keep as many counted statements."""
    found = {}
    for name, pad in pads.items():
        near = judge(_around(pad.numbers), LAWS[name])
        counted = np.where(near.whole, counts(near.margins)[2], -1)
        first = pad.horizons[str(WINDOWS[0])]
        count = 0 if first is None else int(np.count_nonzero(counted >= first.counted))
        found[name] = replace(pad, steady=Share(count / SCATTERED, wilson(count, SCATTERED)))
    return found


def plausible(numbers: dict[str, float]) -> bool:
    """Whether all numbers are such as an engineer would take."""
    return all(low <= numbers[n] <= high for n, (low, high) in PLAUSIBLE.items())


class Chosen(NamedTuple):
    """A pad by law, where it is from, and of how many candidates.

    least: counted statements that the last of those compared over longer times keeps over one
    window under the worse law; equal, taken: how many candidates keep so many, and how many of
    these, the first ones, were compared.
    """

    pads: dict[str, Pad]
    origin: str
    candidates: int
    least: int
    equal: int
    taken: int


def chosen(kept: Kept) -> Chosen:
    """The pad that an engineer would take.

    Of plausible ones, and of these the few that keep most over one window under the worse of the
    two laws, that which keeps the most counted statements over ten windows under the worse of the
    two laws, of equals the steadiest, then that with the least speed of the surface.
    """
    candidates = [(dict(RIVAL), ELSEWHERE)]
    for name, f in LAWS.items():
        for seed, point in enumerate(kept.points[FORMULATIONS.index(f)].astype(float), 1):
            numbers = {n: float(f"{v[0]:.{DIGITS}g}") for n, v in decode(point[None]).items()}
            candidates.append((numbers, f"search {seed} with the {name} law"))
    candidates = [(numbers, origin) for numbers, origin in candidates if plausible(numbers)]
    every = arrays([numbers for numbers, _ in candidates])
    short = [counts(judge(every, f).margins)[2] for f in LAWS.values()]
    worse = np.min(short, axis=0)
    order = np.argsort(-worse, kind="stable")[:LONGER]
    rows = list(zip(side_by_side([candidates[i][0] for i in order]), order, strict=True))
    longest = max(_worse_long(pads) for pads, _ in rows)
    rows = [(steadied(pads), i) for pads, i in rows if _worse_long(pads) == longest]
    pads, i = max(rows, key=lambda row: _steadiness(row[0]))
    least = worse[order[-1]]
    equal, taken = (int(np.count_nonzero(some == least)) for some in (worse, worse[order]))
    return Chosen(pads, candidates[i][1], len(candidates), int(least), equal, taken)


def _worse_long(pads: Mapping[str, Pad]) -> int:
    """Counted statements that a pad keeps over ten windows under the worse law."""
    long = [pad.horizons["10"] for pad in pads.values()]
    return min(0 if kept is None else kept.counted for kept in long)


def _steadiness(pads: Mapping[str, Pad]) -> tuple[float, float]:
    steady = min(pad.steady.share if pad.steady else 0.0 for pad in pads.values())
    return steady, -max(pad.least_speed for pad in pads.values())


def law_of(pads: dict[str, Pad]) -> str:
    """The law under which a pad keeps more over ten windows, the consistent one of equals."""
    long = {name: pad.horizons["10"] for name, pad in pads.items()}
    return max(LAWS, key=lambda name: 0 if (k := long[name]) is None else k.counted)


def choice(pads: dict[str, Pad], origin: str) -> Choice:
    """The pad of the report, under the law with which it keeps more."""
    law = law_of(pads)
    return Choice(Switches.of(LAWS[law]), pads[law].numbers, origin)


def first_states(found: Choice) -> dict[str, tuple[float, ...]]:
    """The dimensionless state at the start of each scene, by its name: `b1-a` to `b2-d`."""
    states, numbers = {}, arrays([found.numbers])
    for model in MODELS:
        for case in CASES:
            pads = stacked(numbers, model, case, found.law)
            first = starts(numbers, pads)[0]
            states[f"{model.lower()}-{case}"] = tuple(float(v) for v in first)
    return states


def main(arguments: list[str] | None = None) -> int:
    """Print the choice, and write its scenes."""
    parser = argparse.ArgumentParser(description="Choose the pad of the report.")
    parser.add_argument("ensembles", type=Path)
    parser.add_argument("--scenes", type=Path, help="folder whose scenes are replaced")
    given = parser.parse_args(arguments)
    return exit_code("choosing", lambda: _choose(given))


def _choose(given: argparse.Namespace) -> int:
    picked = chosen(read_kept(given.ensembles))
    found = choice(picked.pads, picked.origin)
    if given.scenes is not None:
        check_folder(given.scenes, overwrite=True)
        states = first_states(found)
        write_scenes(found.numbers, found.law, given.scenes, states, SPEED)
    sys.stdout.write(to_json(found.to_dict()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
