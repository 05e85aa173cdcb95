"""Random parameter sets within physical bounds, and what each of them says of the verdicts.

`python -m squeal.article.identify.population workflow/stored/ensemble.csv` draws the sets and
stores what they say, a row per set; sets that the file holds already are not computed again.
"""

import argparse
import csv
import dataclasses
import io
import itertools
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from squeal.article.cases import CASES, stem
from squeal.article.claims import CLAIMS, Case, case_of
from squeal.article.claims.measures import Linear, lost_share
from squeal.article.claims.motions import measures
from squeal.article.claims.rules import CALM, TOUCH, hammers
from squeal.article.identify.ensemble import Arrays, Measure, simulate_stacks, single, stack
from squeal.article.identify.judging import linear_of_set
from squeal.article.identify.space import (
    DIMENSIONS,
    LENGTH,
    MODELS,
    STIFFNESS,
    STOP,
    TIME,
    Dimension,
    Numbers,
    compression,
    decode,
    stacked,
    starts,
)
from squeal.equilibrium.branch import BranchEnd, follow
from squeal.equilibrium.find import (
    Equilibrium,
    equilibrium_in_si,
    frictionless_equilibria,
)
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.io.writing import write_text
from squeal.linear.verdicts import verdict
from squeal.model.contact import CONSISTENT, FULL, NONE, STATES, Formulation, State
from squeal.model.equations import PadModel, Units
from squeal.model.pad import gaps as edge_gaps
from squeal.model.pad import pose_of
from squeal.queries.pads.equilibrium import at_equilibrium
from squeal.simulation.hybrid import Segment
from squeal.simulation.observers import Grid

# sets drawn, and the seed of the draw
SETS = 1620
SEED = 44
SPEED = 25.0  # m/s, of the surface
FRICTION = 0.45  # the greatest of brake linings
LOADS = (500.0, 20_000.0)  # N, of a brake pad, for w = 40 mm and k1 = 150 MN/m
TOLERANCE = 1e-10  # of the motions
# relative disturbance of the start, and how often a motion is computed
OFF = 1e-10
REPEATS = 3
ONCE_MORE = 2  # repeats of the motions beside the reference ones
LOCKED = 1e8  # factor on the moment of inertia that stops rotation
LOW = 0.02  # height of a small release above the equilibrium, over the static compression
LOADINGS = (0.02, 0.5, 1.2, 2.0)  # contact load of a release over that of the equilibrium
ALIKE = {"lost": 0.05, "apart": 0.06}  # differences of line and two points that count as none
LEVEL = 1e-9  # differences of shares of time below this are none
BLOCK = 40  # sets at once
FINE = 16  # samples in each step at which the gaps of the edges are computed, beside the springs

INDEPENDENT = tuple(claim for claim in CLAIMS if claim.informative)
YES = "y"
NO = "n"
UNDECIDED = "?"
NOT_APPLICABLE = "-"
# which of the models loses contact longer
POINTS = "p"
LINE = "l"
EQUAL = "="


def _bounded(d: Dimension) -> Dimension:
    """A dimension within the bounds of brake pads, for friction and load."""
    unit = STIFFNESS * LENGTH
    if d.name == "mu":
        return d._replace(high=FRICTION, reason="brake linings")
    if d.name == "F_n":
        low, high = (load / unit for load in LOADS)
        return d._replace(low=low, high=high, reason="over k1 w: 0.5 to 20 kN")
    return d


BOUNDS = tuple(map(_bounded, DIMENSIONS))
"""The searched ranges, with friction and load of brake pads."""


class Row(NamedTuple):
    """What a parameter set says, as text of a table.

    outcome: valid, outran (the lower face was as fast as the surface), left (a motion left the
    model), start (no standing start exists); speed: of the fastest lower face, m/s; satisfied,
    undecided: independent statements as bits of a hexadecimal number; hammers, flutters, without:
    letters of cases that hammer, whose equilibrium flutters, that have none, of points and line
    ("cd/c"); separates: cases in which the line separates; lost1, lost2, apart1, apart2: shares of
    time as in `studies.sets`, per mille, of points (1) and line (2); two_lost, two_apart: of two
    points with the stiffness of the line, less the line; spread: greatest difference of these
    shares between repeats, per mille; verdicts: a letter for each of `VERDICTS`.
    """

    outcome: str
    speed: str = ""
    satisfied: str = ""
    undecided: str = ""
    hammers: str = ""
    separates: str = ""
    flutters: str = ""
    without: str = ""
    lost1: str = ""
    lost2: str = ""
    apart1: str = ""
    apart2: str = ""
    two_lost: str = ""
    two_apart: str = ""
    spread: str = ""
    verdicts: str = ""


VERDICTS = (
    "restless",  # no motion settles
    "differ",  # on points some cases hammer and others do not
    "c_only",  # with both models (c) alone hammers
    "lost",  # which model loses longer edges that touch in the equilibrium
    "apart",  # which model loses longer any edge
    "two",  # two points with the stiffness of the line lose contact for as long
    "locked_line",  # no case in which the line separates does so with rotation locked
    "locked_points",  # points lose contact also with rotation locked
    "permanent_all",  # points stay in full contact after a small release, in each case
    "permanent_some",  # in some case
    *(f"load_{load:g}" for load in LOADINGS),  # `lost` of releases from like loads
)


def drawn() -> dict[str, np.ndarray]:
    """The numbers (`SETS`,) of random sets within `BOUNDS`."""
    points = np.random.default_rng(SEED).uniform(size=(SETS, len(BOUNDS)))
    return decode(points, BOUNDS)


def some(numbers: Numbers, which: Any) -> dict[str, np.ndarray]:
    """Some of the sets, by a slice or by indices."""
    return {name: values[which] for name, values in numbers.items()}


class Motions(NamedTuple):
    """Motions of n sets: measured arrays, and the row in them of each repeat, case and set
    (repeats, cases, n), -1 for a motion that has no start."""

    arrays: Arrays
    row: np.ndarray

    def done(self, repeat: int, case: int, index: int) -> bool:
        """Whether the motion of a repeat, a case and a set, by their indices, went to its end."""
        row = self.row[repeat, case, index]
        return row >= 0 and self.arrays["valid"][row]

    def case(self, repeat: int, case: int, index: int) -> Case | None:
        """The measures of a motion; None where it did not go to its end."""
        row = self.row[repeat, case, index]
        return case_of(self.arrays, row, 1.0) if self.done(repeat, case, index) else None


def disturbed(states: np.ndarray, repeat: int) -> np.ndarray:
    """States (..., n, 6) off by `OFF`, those of repeat 0 as they are."""
    if repeat == 0:
        return states
    random = np.random.default_rng(repeat).uniform(-1.0, 1.0, (*states.shape[:-2], 1, 6))
    return states * (1.0 + OFF * random)


def motions(
    stacks: Sequence[PadModel],
    states: np.ndarray,
    repeats: int,
    measure: Measure = measures,
) -> Motions:
    """Motions of some pads (cases, each of n) from states (cases, n, 6), several times.

    Those of repeat 0 start as given, others slightly off, see `disturbed`.
    """
    all_states = np.concatenate([disturbed(states, repeat) for repeat in range(repeats)])
    arrays, row = simulate_stacks([*stacks] * repeats, all_states, STOP, TOLERANCE, measure)
    return Motions(arrays, row.reshape(repeats, len(stacks), -1))


def edge_shares(segment: Segment, units: Units) -> Arrays:
    """Shares (n, 4) of the time in the contact states of the face's edges, in the order of
    `STATES`, of n pads on springs.

    The edges are read from the motion, since the springs lie inside of them and separate later
    than they do. The time counts from the first step in which a spring touches. `units`, which
    every `Measure` takes, do not matter to shares.
    """
    grid = Grid(segment, FINE)
    gaps = np.array(edge_gaps(grid.c, pose_of(np, grid.c.xy_theta(grid.states))))
    touching = gaps <= 0.0  # (edge, sample, step)
    weights = grid.weights[:, None] * grid.steps.h  # the time that each sample stands for
    n = len(segment.t0)
    spent = np.zeros((n, len(STATES)))
    some_spring_touches = np.asarray(grid.steps.on.any(axis=0))  # in each step
    # in each step: 1 from the first touch of its motion on, 0 before
    has_touched = np.zeros(some_spring_touches.shape)
    ends = np.append(grid.first_steps[1:], len(has_touched))
    for begin, end in zip(grid.first_steps.tolist(), ends.tolist(), strict=True):
        has_touched[begin:end] = np.logical_or.accumulate(some_spring_touches[begin:end])
    for column, state in enumerate(STATES):
        is_in_state = (touching == np.array(state)[:, None, None]).all(axis=0)  # (sample, step)
        time = np.where(is_in_state, weights, 0.0).sum(axis=0) * has_touched
        spent[:, column] = np.bincount(grid.steps.motion, time, n)
    total = spent.sum(axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        return {"shares": spent / total}


class AssessedEquilibrium(NamedTuple):
    """A sliding equilibrium, the state of its contact points, and whether it flutters."""

    equilibrium: Equilibrium
    state: State
    flutters: bool


def assessed_equilibrium(model: PadModel) -> AssessedEquilibrium | None:
    """The sliding equilibrium that a model of one pad means; None where there is none."""
    return assessed_equilibria(dataclasses.replace(model, pad=stack([model.pad])))[0]


def assessed_equilibria(stack: PadModel) -> list[AssessedEquilibrium | None]:
    """The sliding equilibria of n pads, followed together from no friction up to their own.

    None for a pad whose branch ends at a lower friction, or whose equilibrium lies beyond the
    limits of the model.
    """
    mu = np.asarray(stack.pad.mu)
    n = mu.size
    statics = Statics.of(stack.replace(mu=np.zeros(n)))
    branches = follow(statics, frictionless_equilibria(statics, n), mu)
    points = branches.at(np.arange(n), mu)  # of the branches, at the friction of each pad
    assessed: list[AssessedEquilibrium | None] = []
    for i in range(n):
        equilibrium = None
        if branches.end[i] == BranchEnd.REACHED and points.exists[i]:
            state = State(*points.touching[:, i].tolist())
            # None if it lies beyond the limits of the model
            equilibrium = _assessed(single(stack, i), points.z[:, i], state)
        assessed.append(equilibrium)
    return assessed


def _assessed(model: PadModel, z: np.ndarray, state: State) -> AssessedEquilibrium | None:
    """The equilibrium of a pad at a point z (4,) of its branch; None beyond the model's limits."""
    try:
        equilibrium = equilibrium_in_si(Statics.of(model.replace(mu=0.0)), z, state, on_branch=True)
    except ComputationError:
        return None
    if equilibrium is None or not equilibrium.admissible:
        return None
    flutters = verdict(*at_equilibrium(model, equilibrium)) == "flutter"
    return AssessedEquilibrium(equilibrium, model.state_at(np.array(equilibrium.q)), flutters)


def heights_of_load(
    stack: PadModel, equilibria: Sequence[AssessedEquilibrium | None], load: float
) -> np.ndarray:
    """Heights (n,) above the equilibria, in static compressions, at which contact bears `load` R_n.

    The whole face is taken to touch: over the height e the reaction is R_n - e F_n, since it falls
    by F_n over a static compression. NaN for a pad without an equilibrium.
    """
    heights = np.full(len(equilibria), math.nan)
    for i, assessed in enumerate(equilibria):
        if assessed is not None:
            reaction_over_force = assessed.equilibrium.R_n / float(np.asarray(stack.pad.F_n)[i])
            heights[i] = (1.0 - load) * reaction_over_force
    return heights


def released(
    stack: PadModel, equilibria: Sequence[AssessedEquilibrium | None], heights: np.ndarray
) -> np.ndarray:
    """States (n, 6) at rest above the equilibria of n pads; NaN for a pad without an equilibrium.

    heights (n,): above the equilibrium, in static compressions.
    """
    states = np.full((len(equilibria), 6), math.nan)
    lift = heights * compression(stack.pad)
    for i, assessed in enumerate(equilibria):
        if assessed is not None:
            x, y, theta = assessed.equilibrium.q
            states[i] = (x, y + lift[i], theta, 0.0, 0.0, 0.0)
    return states


EquilibriaByModel = dict[str, list[list[AssessedEquilibrium | None]]]
"""Equilibria by model, case and set."""


class Computed(NamedTuple):
    """Everything that is computed of a block of sets, by model where it is a mapping.

    first: motions from the sets' own initial conditions; locked: the same with rotation stopped;
    two_springs: of the line's pads on two springs; small_release: of points from `LOW` above the
    equilibrium; loads: releases from each of `LOADINGS`; linear: what B3 says of each set.
    """

    stacks: dict[str, list[PadModel]]
    equilibria: EquilibriaByModel
    first: dict[str, Motions]
    locked: dict[str, Motions]
    two_springs: Motions
    small_release: Motions
    loads: dict[str, list[Motions]]
    linear: list[Linear]


def computed(numbers: Numbers) -> Computed:
    """Compute all motions and equilibria of some sets, see `Computed`."""
    n = len(numbers["h"])
    # by model: of each case the pads (n,) and their own first states (n, 6)
    stacks: dict[str, list[PadModel]] = {}
    own_starts: dict[str, np.ndarray] = {}
    equilibria: EquilibriaByModel = {}
    first: dict[str, Motions] = {}
    locked: dict[str, Motions] = {}
    loads: dict[str, list[Motions]] = {}
    for model in MODELS:
        pads_of_cases = [stacked(numbers, model, case, CONSISTENT) for case in CASES]
        stacks[model] = pads_of_cases
        own_starts[model] = np.array([starts(numbers, pads) for pads in pads_of_cases])
        equilibria[model] = [assessed_equilibria(pads) for pads in pads_of_cases]
        first[model] = motions(pads_of_cases, own_starts[model], REPEATS)
        # a huge moment of inertia stops rotation
        not_turning = [pads.replace(I=LOCKED * np.asarray(pads.pad.I)) for pads in pads_of_cases]
        locked[model] = motions(not_turning, own_starts[model], ONCE_MORE)
        loads[model] = []
        for load in LOADINGS:
            releases = []  # first states (n, 6) of each case
            for pads, equilibria_of_case in zip(pads_of_cases, equilibria[model], strict=True):
                heights = heights_of_load(pads, equilibria_of_case, load)
                releases.append(released(pads, equilibria_of_case, heights))
            loads[model].append(motions(pads_of_cases, np.array(releases), ONCE_MORE))
    # the pads of the line on two springs that have its stiffness together
    springs = [PadModel("BN", pads.pad, Formulation(springs=2)) for pads in stacks["B2"]]
    two_springs = motions(springs, own_starts["B2"], ONCE_MORE, edge_shares)
    small_releases = []  # first states (n, 6) of each case
    for pads, equilibria_of_case in zip(stacks["B1"], equilibria["B1"], strict=True):
        small_releases.append(released(pads, equilibria_of_case, np.full(n, LOW)))
    small_release = motions(stacks["B1"], np.array(small_releases), ONCE_MORE)
    return Computed(
        stacks=stacks,
        equilibria=equilibria,
        first=first,
        locked=locked,
        two_springs=two_springs,
        small_release=small_release,
        loads=loads,
        linear=[linear_of_set(numbers, i) for i in range(n)],
    )


class RepeatVerdicts(NamedTuple):
    """What one repeat says of a set: satisfied independent statements, cases that hammer and that
    separate, shares of time by name, verdicts by name (one letter each)."""

    satisfied: tuple[bool, ...]
    hammers: str
    separates: str
    shares: dict[str, float]
    verdicts: dict[str, str]


def _yes_or_no(value: bool) -> str:
    return YES if value else NO


def _longer(points: float, line: float) -> str:
    if abs(points - line) <= LEVEL:
        return EQUAL
    return POINTS if points > line else LINE


def _mean_shares(
    block: Computed, runs: Mapping[str, Motions], repeat: int, index: int
) -> dict[str, float]:
    """Mean shares lost1, lost2, apart1, apart2, of points (1) and line (2), over the cases in which
    both models have an equilibrium; empty without such a case, or where a motion did not go to its
    end.

    lost: shares of time in which an edge is separated that touches in the equilibrium; apart: in
    which any edge is separated. runs: by model; repeat: which of the repeats of each motion; index:
    of the set in the block.
    """
    points = block.equilibria["B1"]
    line = block.equilibria["B2"]
    with_equilibria = [k for k in range(len(CASES)) if points[k][index] and line[k][index]]
    means: dict[str, float] = {}
    for k in with_equilibria:
        for digit, model in enumerate(MODELS, 1):
            case = runs[model].case(repeat, k, index)
            equilibrium = block.equilibria[model][k][index]
            if case is None or equilibrium is None:  # the motion did not go to its end
                return {}
            lost = lost_share(case.shares, equilibrium.state) / len(with_equilibria)
            apart = lost_share(case.shares, FULL) / len(with_equilibria)
            means[f"lost{digit}"] = means.get(f"lost{digit}", 0.0) + lost
            means[f"apart{digit}"] = means.get(f"apart{digit}", 0.0) + apart
    return means


def _means_of_two_springs(block: Computed, repeat: int, index: int) -> dict[str, float]:
    """Mean shares two_lost and two_apart of the line's pads on two springs.

    The shares are those of `_mean_shares`, over the same cases: those in which both models have an
    equilibrium. Empty without such a case, or where a motion did not go to its end. index: of the
    set in the block; repeat: of the motions, of which number 0 starts from the states as given.
    """
    # the shares of each case
    lost = []
    apart = []
    for k in range(len(CASES)):
        equilibrium = block.equilibria["B2"][k][index]
        if equilibrium is None or block.equilibria["B1"][k][index] is None:
            continue
        if not block.two_springs.done(repeat, k, index):
            return {}
        row = block.two_springs.row[repeat, k, index]
        # by contact state the share of time in it
        shares = dict(zip(STATES, block.two_springs.arrays["shares"][row], strict=True))
        lost.append(lost_share(shares, equilibrium.state))
        apart.append(lost_share(shares, FULL))
    if not lost:
        return {}
    return {"two_lost": sum(lost) / len(lost), "two_apart": sum(apart) / len(apart)}


def _two_springs_less_line(block: Computed, repeat: int, index: int) -> dict[str, float]:
    """Shares two_lost and two_apart of a set as a `Row` has them: two springs less the line.

    Empty where `_means_of_two_springs` is.
    """
    two_springs = _means_of_two_springs(block, repeat, index)
    if not two_springs:
        return {}
    line = _mean_shares(block, block.first, repeat, index)
    return {
        "two_lost": two_springs["two_lost"] - line["lost2"],
        "two_apart": two_springs["two_apart"] - line["apart2"],
    }


def _letters(flags: Iterable[bool]) -> str:
    """The letters of the cases whose flag is set."""
    return "".join(itertools.compress(CASES, flags))


def _separated(case: Case) -> bool:
    """Whether both edges are separated for some time."""
    return case.shares.get(NONE, 0.0) > TOUCH


def _loses_force(case: Case) -> bool:
    """Whether the force at an edge vanishes for some time."""
    return max(case.vanishes) > TOUCH


def _locked(block: Computed, model: str, repeat: int, index: int) -> list[Case] | None:
    """The cases of a set with rotation locked; None where a motion did not go to its end."""
    cases = []
    for k in range(len(CASES)):
        case = block.locked[model].case(repeat, k, index)
        if case is None:
            return None
        cases.append(case)
    return cases


def _permanent(block: Computed, repeat: int, index: int) -> list[bool]:
    """Whether points stay in full contact after a small release, by case with an equilibrium."""
    permanent = []
    for k in range(len(CASES)):
        if block.equilibria["B1"][k][index] is not None:
            case = block.small_release.case(repeat, k, index)
            permanent.append(case is not None and lost_share(case.shares, FULL) == 0.0)
    return permanent


def _verdicts_when_locked(
    block: Computed, points: Sequence[Case], line: Sequence[Case], repeat: int, index: int
) -> dict[str, str]:
    """The verdicts locked_line and locked_points of a set, see `VERDICTS`.

    points, line: the motions with free rotation, a measured case each; repeat, index: which repeat
    of the motions, and which set of the block. A verdict is left out where
    in none of them the line separates or an edge of the points loses its force, or where a motion
    with locked rotation did not go to its end.
    """
    verdicts = {}
    line_locked = _locked(block, "B2", repeat, index)
    # letters of the cases in which the line separates
    free = {*_letters(map(_separated, line))}
    if free and line_locked is not None:
        locked = {*_letters(map(_separated, line_locked))}
        verdicts["locked_line"] = _yes_or_no(free.isdisjoint(locked))
    points_locked = _locked(block, "B1", repeat, index)
    if any(map(_loses_force, points)) and points_locked is not None:
        verdicts["locked_points"] = _yes_or_no(any(map(_loses_force, points_locked)))
    return verdicts


def _verdicts_when_released(block: Computed, repeat: int, index: int) -> dict[str, str]:
    """Verdicts on the motions of a set that are released from rest above the equilibrium."""
    verdicts = {}
    permanent = _permanent(block, repeat, index)
    if permanent:
        verdicts["permanent_all"] = _yes_or_no(all(permanent))
        verdicts["permanent_some"] = _yes_or_no(any(permanent))
    for i, load in enumerate(LOADINGS):
        released_alike = {model: block.loads[model][i] for model in MODELS}
        means = _mean_shares(block, released_alike, repeat, index)
        if means:
            verdicts[f"load_{load:g}"] = _longer(means["lost1"], means["lost2"])
    return verdicts


def verdicts_of_repeat(block: Computed, repeat: int, index: int) -> RepeatVerdicts | None:
    """What a repeat says of the set `index`, see `RepeatVerdicts`.

    A verdict is `NOT_APPLICABLE` where no motion or equilibrium bears on it. None where a motion
    from the set's own initial conditions did not go to its end.
    """
    measured: dict[str, Case | Linear] = {"b3": block.linear[index]}
    cases: dict[str, list[Case]] = {model: [] for model in MODELS}
    for model in MODELS:
        for k, letter in enumerate(CASES):
            case = block.first[model].case(repeat, k, index)
            if case is None:
                return None
            measured[stem(model, letter)] = case
            cases[model].append(case)
    points = cases["B1"]
    line = cases["B2"]
    # all but the `first` motions have `ONCE_MORE` repeats: a later repeat takes the last of them
    repeat_of_others = min(repeat, ONCE_MORE - 1)
    points_hammer = _letters(hammers(case).margin > 0.0 for case in points)
    line_hammers = _letters(hammers(case).margin > 0.0 for case in line)
    shares = _mean_shares(block, block.first, repeat, index)
    verdicts: dict[str, str] = dict.fromkeys(VERDICTS, NOT_APPLICABLE)
    verdicts["restless"] = _yes_or_no(all(case.calm > CALM for case in (*points, *line)))
    verdicts["differ"] = _yes_or_no(0 < len(points_hammer) < len(CASES))
    verdicts["c_only"] = _yes_or_no(set(points_hammer) & set(line_hammers) == {"c"})
    if shares:
        # shares of the points end in 1, those of the line in 2
        verdicts["lost"] = _longer(shares["lost1"], shares["lost2"])
        verdicts["apart"] = _longer(shares["apart1"], shares["apart2"])
        two_springs = _two_springs_less_line(block, repeat_of_others, index)
        if two_springs:
            shares |= two_springs
            alike = all(abs(shares[f"two_{key}"]) < most for key, most in ALIKE.items())
            verdicts["two"] = _yes_or_no(alike)
    verdicts |= _verdicts_when_locked(block, points, line, repeat_of_others, index)
    verdicts |= _verdicts_when_released(block, repeat_of_others, index)
    satisfied = []
    for claim in INDEPENDENT:
        outcome = claim.rule(*(measured[scene] for scene in claim.scenes))
        satisfied.append(outcome.margin > 0.0)
    return RepeatVerdicts(
        satisfied=tuple(satisfied),
        hammers=f"{points_hammer}/{line_hammers}",
        separates=_letters(map(_separated, line)),
        shares=shares,
        verdicts=verdicts,
    )


def _bits(flags: Iterable[bool]) -> str:
    """Flags as the bits of a hexadecimal number, the first the lowest."""
    return f"{sum(flag << i for i, flag in enumerate(flags)):x}"


def _agreed(answers: Sequence[str]) -> str:
    """What all repeats say, else that they do not agree."""
    return answers[0] if len(set(answers)) == 1 else UNDECIDED


def _fastest_face(block: Computed, index: int) -> float:
    """Greatest speed of the lower face (m/s) in the undisturbed motions of a set."""
    faces: list[float] = []
    for model in MODELS:
        motions_of = block.first[model]
        faces += motions_of.arrays["face"][motions_of.row[0, :, index]].tolist()
    return max(faces) * LENGTH / TIME


def _spread(repeats: Sequence[RepeatVerdicts]) -> float:
    """The greatest difference between repeats of any share of time."""
    spread = 0.0
    for key in repeats[0].shares:
        values = [repeat.shares.get(key, math.nan) for repeat in repeats]
        spread = max(spread, max(values) - min(values))
    return spread


def row(block: Computed, index: int) -> Row:
    """The row of the table for the set `index`, from the verdicts of all repeats.

    What the repeats do not agree on is undecided.
    """
    # `row` (repeats, cases, n) is -1 for a motion without an initial state
    if any((block.first[model].row[0, :, index] < 0).any() for model in MODELS):
        return Row("start")  # in some case there is none
    repeats = []
    for number in range(REPEATS):
        verdicts = verdicts_of_repeat(block, number, index)
        if verdicts is None:
            return Row("left")  # a motion left the model
        repeats.append(verdicts)
    fastest = _fastest_face(block, index)
    first = repeats[0]  # of the undisturbed motions
    undecided = []  # of each independent claim
    for answers in zip(*(repeat.satisfied for repeat in repeats), strict=True):
        undecided.append(len(set(answers)) > 1)

    def share(key: str) -> str:
        """A share per mille, empty where the set has none."""
        return str(round(1000.0 * first.shares[key])) if key in first.shares else ""

    flutters = []
    without = []
    for model in MODELS:
        equilibria_of_cases = [block.equilibria[model][k][index] for k in range(len(CASES))]
        flutters.append(_letters(e is not None and e.flutters for e in equilibria_of_cases))
        without.append(_letters(e is None for e in equilibria_of_cases))
    return Row(
        outcome="valid" if fastest < SPEED else "outran",
        speed=f"{fastest:.3g}",
        satisfied=_bits(first.satisfied),
        undecided=_bits(undecided),
        hammers=_agreed([repeat.hammers for repeat in repeats]),
        separates=_agreed([repeat.separates for repeat in repeats]),
        flutters="/".join(flutters),
        without="/".join(without),
        lost1=share("lost1"),
        lost2=share("lost2"),
        apart1=share("apart1"),
        apart2=share("apart2"),
        two_lost=share("two_lost"),
        two_apart=share("two_apart"),
        # rounded up; a difference below 0.05 per mille counts as none
        spread=str(math.ceil(1000.0 * _spread(repeats) - 0.05)),
        verdicts="".join(_agreed([r.verdicts[name] for r in repeats]) for name in VERDICTS),
    )


def rows(numbers: Numbers) -> list[Row]:
    """What some sets say."""
    block = computed(numbers)
    return [row(block, index) for index in range(len(numbers["h"]))]


def read(file: Path) -> list[Row]:
    """The rows of a file. Raises OSError, and TypeError where a row does not fit."""
    return [Row(*line) for line in lines_of(file)]


def lines_of(file: Path) -> list[list[str]]:
    """The lines of a table below its head."""
    with file.open(newline="", encoding="utf-8") as stream:
        return [*csv.reader(stream)][1:]


def write_lines(file: Path, head: Sequence[str], lines: Iterable[Sequence[str]]) -> None:
    """Write a table."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(lines)
    write_text(file, stream.getvalue())


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the sets and store what they say."""
    parser = argparse.ArgumentParser(description="Draw parameter sets and store what they say.")
    parser.add_argument("file", type=Path, metavar="FILE", help="holds a row a set")
    parser.add_argument("--sets", type=int, default=SETS, metavar="N", help="so many in all")
    given = parser.parse_args(arguments)
    if given.sets > SETS:  # `drawn` makes no more
        parser.error(f"--sets: {given.sets} is not allowed; there are {SETS} sets")
    stored = read(given.file) if given.file.exists() else []
    numbers = drawn()
    while len(stored) < given.sets:
        end = min(len(stored) + BLOCK, given.sets)
        stored += rows(some(numbers, slice(len(stored), end)))
        write_lines(given.file, Row._fields, stored)
        valid = sum(row.outcome == "valid" for row in stored)
        print(f"{len(stored)} sets, {valid} valid", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
