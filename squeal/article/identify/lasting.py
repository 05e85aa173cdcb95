"""Changes of contact that last beside stable sliding, of random parameter sets with damping.

`python -m squeal.article.identify.lasting ensemble.csv lasting.csv` computes the first valid sets
of a table that `squeal.article.identify.population` has written, here those of workflow/stored.
"""

import argparse
import itertools
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from squeal.article.cases import CASES
from squeal.article.claims.motions import measures
from squeal.article.identify import population
from squeal.article.identify.ensemble import simulate_damped, single
from squeal.article.identify.population import (
    NOT_APPLICABLE,
    OFF,
    SPEED,
    UNDECIDED,
    assessed_equilibrium,
    drawn,
    lines_of,
    some,
    write_lines,
)
from squeal.article.identify.space import (
    LENGTH,
    MODELS,
    STOP,
    TIME,
    Numbers,
    stacked,
    states_in_box,
)
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.linear.verdicts import verdict
from squeal.model.contact import CONSISTENT
from squeal.model.equations import PadModel
from squeal.queries.pads.equilibrium import at_equilibrium

SETS = 100  # valid sets
RATIO = 0.01  # of all modes
# initial conditions, and their box in static compressions
STARTS = 12
SEED = 1
REACH = 3.0
# times, in observation times, from which on a motion is tested, and how long a test lasts
LATE = 40
LONGER = 150
TEST = 2
TOLERANCE = 1e-9
REPEATS = 2


class Lasting(NamedTuple):
    """The number of a set, and the cases in which contact goes on changing, as `lasting` gives
    them."""

    number: int
    cases: str


def damped_if_stable(model: PadModel) -> tuple[PadModel, np.ndarray] | None:
    """The damped pad and q (3,) of its stable sliding equilibrium; None without one."""
    scene = Scene(model.name, model.pad, model.formulation, damping=Damping(ratios=(RATIO,) * 3))
    assessed = assessed_equilibrium(model)
    if assessed is None:
        return None
    try:
        damped = damped_model(scene)
    except ComputationError:
        return None
    if verdict(*at_equilibrium(damped, assessed.equilibrium)) != "stable":
        return None
    return damped, np.array(assessed.equilibrium.q)


def initial_states(model: PadModel, q: np.ndarray) -> np.ndarray:
    """Random states (STARTS, 6) in the box of `REACH` static compressions about an equilibrium."""
    draws = np.random.default_rng(SEED).uniform(-1.0, 1.0, (STARTS, 6))
    return states_in_box(model.pad, q, REACH, draws)


def lasts(pads: Sequence[PadModel], states: np.ndarray) -> np.ndarray:
    """Whether (n,) contact still changes after a long time, while the lower face stays slower than
    the surface.

    A motion must change contact within `TEST` observation times from the time `LATE` on, and again
    from the time `LONGER` on. pads and states (n, 6): of the motions, in natural units.
    """
    lasting = np.arange(len(pads))  # numbers of the motions that have passed each test so far
    for duration in (LATE, LONGER - LATE):  # from the start, or the test before, to this test
        if not lasting.size:
            break
        lasting_pads = [pads[i] for i in lasting.tolist()]
        ends = simulate_damped(lasting_pads, states, duration * STOP, TOLERANCE)
        lasting = lasting[ends["valid"]]
        states = ends["final"][ends["valid"]]
        if not lasting.size:
            break
        # the test runs from `states` on, and so does the time up to the next test
        lasting_pads = [pads[i] for i in lasting.tolist()]
        late = simulate_damped(lasting_pads, states, TEST * STOP, TOLERANCE, measures)
        goes_on = np.zeros(len(lasting), dtype=bool)
        for k in np.flatnonzero(late["valid"] & (late["changes"] > 0)).tolist():
            speed = float(late["face"][k]) * LENGTH / TIME  # in m/s
            goes_on[k] = speed < SPEED
        lasting = lasting[goes_on]
        states = states[goes_on]
    answer = np.zeros(len(pads), dtype=bool)
    answer[lasting] = True
    return answer


def lasting(numbers: Numbers) -> str:
    """The letters of the cases in which, from at least one of `STARTS` initial states, contact goes
    on changing beside stable sliding: of B1, a slash, and of B2 ("d/a").

    Each model is simulated `REPEATS` times from states that are disturbed by rounding; where the
    letters differ it has `UNDECIDED`, without stable sliding `NOT_APPLICABLE`. numbers: of one set.
    """
    texts = []
    for model in MODELS:
        cases: list[str] = []  # of stable sliding
        pads: list[PadModel] = []
        starts = []
        for case in CASES:
            stable_sliding = damped_if_stable(single(stacked(numbers, model, case, CONSISTENT), 0))
            if stable_sliding is not None:
                damped, q = stable_sliding
                cases.append(case)
                pads += [damped] * STARTS
                starts.append(initial_states(damped, q))
        if not cases:
            texts.append(NOT_APPLICABLE)
            continue
        states = np.concatenate(starts)
        answers = []
        for repeat in range(REPEATS):
            disturbance = np.random.default_rng(repeat).uniform(-OFF, OFF, states.shape)
            disturbed = states * (1.0 + repeat * disturbance)  # the first repeat is undisturbed
            motions_last = lasts(pads, disturbed).reshape(len(cases), STARTS)
            some_last = np.asarray(motions_last.any(axis=1))
            answers.append("".join(itertools.compress(cases, some_last)))
        texts.append(answers[0] if len(set(answers)) == 1 else UNDECIDED)
    return "/".join(texts)


def read(file: Path) -> list[Lasting]:
    """The entries of a file. Raises OSError."""
    return [Lasting(int(number), cases) for number, cases in lines_of(file)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Store in which cases contact goes on changing, of the first valid sets of a table."""
    parser = argparse.ArgumentParser(description="Store in which cases contact goes on changing.")
    parser.add_argument("table", type=Path, metavar="TABLE", help="holds a row a set")
    parser.add_argument("file", type=Path, metavar="FILE", help="holds the cases of each set")
    given = parser.parse_args(arguments)
    stored: dict[int, Lasting] = {}
    if given.file.exists():
        stored = {entry.number: entry for entry in read(given.file)}
    numbers = drawn()
    rows = population.read(given.table)
    valid = [i for i, row in enumerate(rows) if row.outcome == "valid"][:SETS]
    for i in valid:
        if i in stored:
            continue
        stored[i] = Lasting(i, lasting(some(numbers, slice(i, i + 1))))
        # written after each set, so that an interrupted run goes on from there
        lines = [[str(k), stored[k].cases] for k in sorted(stored)]
        write_lines(given.file, Lasting._fields, lines)
        print(f"set {i}: {stored[i].cases}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
