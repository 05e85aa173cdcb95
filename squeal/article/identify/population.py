"""Random parameter sets within physical bounds, and what each of them says of the verdicts.

`python -m squeal.article.identify.population workflow/stored/ensemble.csv` draws the sets and
stores what they say, a row a set; sets that the file holds already are not computed again.
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
from squeal.article.claims.measures import Linear, linear_measures, lost_share
from squeal.article.claims.motions import measures
from squeal.article.claims.rules import CALM, TOUCH, hammers
from squeal.article.identify.ensemble import DONE, Arrays, Measure, simulate_many
from squeal.article.identify.judging import MAP_POINTS
from squeal.article.identify.space import (
    DIMENSIONS,
    LENGTH,
    MODELS,
    STIFFNESS,
    STOP,
    TIME,
    Dimension,
    Numbers,
    decode,
    pad_of,
    stacked,
    starts,
)
from squeal.equilibrium.branch import BranchEnd, follow
from squeal.equilibrium.find import Equilibrium, record
from squeal.equilibrium.find import rests as rests_without_friction
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.io.writing import write_text
from squeal.linear.verdicts import verdict
from squeal.model.contact import CONSISTENT, FULL, NONE, STATES, Formulation, State
from squeal.model.equations import PadModel, Units
from squeal.model.pad import Pad, pose
from squeal.model.pad import gaps as edge_gaps
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
FINE = 16  # places in each step at which the edges beside springs are looked at

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


def drawn(count: int = SETS, seed: int = SEED) -> dict[str, np.ndarray]:
    """The numbers (count,) of random sets within `BOUNDS`."""
    points = np.random.default_rng(seed).uniform(size=(count, len(BOUNDS)))
    return decode(points, BOUNDS)


def some(numbers: Numbers, which: Any) -> dict[str, np.ndarray]:
    """Some of the sets, by a slice or by indices."""
    return {name: values[which] for name, values in numbers.items()}


class Motions(NamedTuple):
    """Motions of n sets: measured arrays, and where in them each repeat, case and set stands
    (repeats, cases, n), -1 for one that has no start."""

    arrays: Arrays
    row: np.ndarray

    def done(self, repeat: int, case: int, one: int) -> bool:
        """Whether a motion went to its end."""
        at = self.row[repeat, case, one]
        return at >= 0 and self.arrays["outcome"][at] == DONE

    def case(self, repeat: int, case: int, one: int) -> Case | None:
        """The measures of a motion; None where it did not go to its end."""
        at = int(self.row[repeat, case, one])
        return case_of(self.arrays, at, 1.0) if self.done(repeat, case, one) else None


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
    damping: np.ndarray | None = None,
    stop: float = STOP,
) -> Motions:
    """Motions of some pads (cases, each of n) from states (cases, n, 6), several times.

    damping: matrices (cases, n, 3, 3).
    """
    all_states = np.stack([disturbed(states, repeat) for repeat in range(repeats)])
    flat = all_states.reshape(-1, 6)
    able = np.flatnonzero(np.isfinite(flat).all(axis=1))
    row = np.full(len(flat), -1)
    row[able] = np.arange(len(able))
    shape = all_states.shape[:-1]
    if not able.size:
        return Motions({"outcome": np.empty(0, dtype=int)}, row.reshape(shape))
    given = [stack.pad.given() for stack in stacks]
    columns: dict[str, Any] = {
        name: np.tile(np.concatenate([one[name] for one in given]), repeats)[able]
        for name in given[0]
    }
    matrices = None
    if damping is not None:
        matrices = np.tile(damping.reshape(-1, 3, 3), (repeats, 1, 1))[able]
    first = stacks[0]
    arrays = simulate_many(
        first.name,
        Pad(**columns),
        flat[able],
        stop,
        TOLERANCE,
        first.formulation,
        measure=measure,
        damping=matrices,
    )
    return Motions(arrays, row.reshape(shape))


def edge_shares(segment: Segment, units: Units) -> Arrays:
    """Shares (n, 4) of the time in the states of the face's edges, in the order of `STATES`.

    Of springs that lie inside the edges and separate later. The time counts from the first place
    that is looked at in which a spring touches.
    """
    grid = Grid(segment, FINE)
    gaps = np.array(edge_gaps(grid.c, pose(np, grid.c.place(grid.states))))
    touching = gaps <= 0.0
    weights = grid.weights[:, None] * grid.steps.h
    n = len(segment.t0)
    spent = np.zeros((n, len(STATES)))
    on = np.asarray(grid.steps.on.any(axis=0))
    touched = np.zeros(on.shape)  # 1 from the first touch of each motion on
    for lane in range(n):
        end = grid.first[lane + 1] if lane + 1 < n else len(on)
        own = slice(grid.first[lane], end)
        touched[own] = np.logical_or.accumulate(on[own])
    for column, state in enumerate(STATES):
        here = (touching == np.array(state)[:, None, None]).all(axis=0)
        time = np.where(here, weights, 0.0).sum(axis=0) * touched
        spent[:, column] = np.bincount(grid.steps.lane, time, n)
    total = spent.sum(axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        return {"shares": spent / total}


class Rest(NamedTuple):
    """A sliding equilibrium, the state of its contact points, and whether it flutters."""

    equilibrium: Equilibrium
    state: State
    flutters: bool


def rest(model: PadModel) -> Rest | None:
    """The sliding equilibrium that a model of one pad means; None where there is none."""
    pad = {name: np.array([float(value)]) for name, value in model.pad.given().items()}
    return rests_of(dataclasses.replace(model, pad=Pad(**pad)))[0]  # type: ignore[arg-type]


def rests_of(stack: PadModel) -> list[Rest | None]:
    """The sliding equilibria of some pads, followed together from no friction up to their own."""
    mu = np.asarray(stack.pad.mu)
    n = mu.size
    statics = Statics.of(stack.replace(mu=np.zeros(n)))
    branches = follow(statics, rests_without_friction(statics, n), mu)
    places = branches.at(np.arange(n), mu)
    found: list[Rest | None] = []
    for one in range(n):
        reached = branches.end[one] == BranchEnd.REACHED and places.exists[one]
        state = State(*places.touching[:, one].tolist())
        found.append(_rest(single(stack, one), places.z[:, one], state) if reached else None)
    return found


def _rest(model: PadModel, z: np.ndarray, state: State) -> Rest | None:
    """The equilibrium of a pad at a place z (4,) of its branch; None beyond the model's limits."""
    try:
        found = record(Statics.of(model.replace(mu=0.0)), z, state, on_branch=True)
    except ComputationError:
        return None
    if found is None or not found.admissible:
        return None
    matrices = at_equilibrium(model, found)
    return Rest(found, model.state_at(np.array(found.q)), verdict(*matrices) == "flutter")


def single(stack: PadModel, one: int) -> PadModel:
    """One pad of a stack."""
    pad = {name: float(np.asarray(values)[one]) for name, values in stack.pad.given().items()}
    return dataclasses.replace(stack, pad=Pad(**pad))


def compression(pad: Pad) -> np.ndarray:
    """Static compression () or (n,) of the contact under the brake force."""
    names = ("k3", "k4") if pad.k_c is None else ("k_c",)
    stiffness = sum(np.asarray(getattr(pad, name)) for name in names)
    return np.asarray(pad.F_n / stiffness)


def released(
    stack: PadModel, rests: Sequence[Rest | None], height: float | None, load: float
) -> np.ndarray:
    """States (n, 6) at rest above the equilibrium by a height over the static compression, or where
    the contact would bear so many times the equilibrium's load; NaN where there is none."""
    states = np.full((len(rests), 6), math.nan)
    unit = compression(stack.pad)
    for one, at in enumerate(rests):
        if at is None:
            continue
        share = at.equilibrium.R_n / float(np.asarray(stack.pad.F_n)[one])
        lift = (1.0 - load) * share if height is None else height
        x, y, theta = at.equilibrium.q
        states[one] = (x, y + lift * unit[one], theta, 0.0, 0.0, 0.0)
    return states


Rests = dict[str, list[list[Rest | None]]]
"""Equilibria by model, case and set."""


class Computed(NamedTuple):
    """Everything that is computed of a block of sets, by model where it is a mapping."""

    stacks: dict[str, list[PadModel]]
    rests: Rests
    first: dict[str, Motions]
    locked: dict[str, Motions]
    two: Motions
    low: Motions
    loads: dict[str, list[Motions]]
    linear: list[Linear]


def computed(numbers: Numbers) -> Computed:
    """All motions and equilibria of some sets."""
    n = len(numbers["h"])
    stacks: dict[str, list[PadModel]] = {}
    equilibria: Rests = {}
    first: dict[str, Motions] = {}
    locked: dict[str, Motions] = {}
    loads: dict[str, list[Motions]] = {}
    for model in MODELS:
        own = [stacked(numbers, model, case, CONSISTENT) for case in CASES]
        states = np.array([starts(numbers, stack) for stack in own])
        stacks[model] = own
        equilibria[model] = [rests_of(stack) for stack in own]
        first[model] = motions(own, states, REPEATS)
        still = [stack.replace(I=LOCKED * np.asarray(stack.pad.I)) for stack in own]
        locked[model] = motions(still, states, ONCE_MORE)
        loads[model] = []
        for load in LOADINGS:
            pairs = zip(own, equilibria[model], strict=True)
            some_states = np.array([released(stack, there, None, load) for stack, there in pairs])
            loads[model].append(motions(own, some_states, ONCE_MORE))
    springs = [PadModel("BN", stack.pad, Formulation(springs=2)) for stack in stacks["B2"]]
    states = np.array([starts(numbers, stack) for stack in stacks["B2"]])
    two = motions(springs, states, ONCE_MORE, edge_shares)
    pairs = zip(stacks["B1"], equilibria["B1"], strict=True)
    low = motions(
        stacks["B1"],
        np.array([released(stack, there, LOW, 0.0) for stack, there in pairs]),
        ONCE_MORE,
    )
    linear = []
    for one in range(n):
        pad = pad_of({name: v[one] for name, v in numbers.items()}, "B2", CASES["c"])
        linear.append(linear_measures({"c": pad}, MAP_POINTS))
    return Computed(stacks, equilibria, first, locked, two, low, loads, linear)


class Said(NamedTuple):
    """What one repeat says of a set: satisfied independent statements, cases that hammer and that
    separate, shares of time by name, verdicts by name (one letter each)."""

    satisfied: tuple[bool, ...]
    hammers: str
    separates: str
    shares: dict[str, float]
    verdicts: dict[str, str]


def _word(value: bool) -> str:
    return YES if value else NO


def _longer(points: float, line: float) -> str:
    if abs(points - line) <= LEVEL:
        return EQUAL
    return POINTS if points > line else LINE


def _means(found: Computed, runs: Mapping[str, Motions], repeat: int, one: int) -> dict[str, float]:
    """Mean shares lost1, lost2, apart1, apart2 over the cases in which both models rest; empty
    where there is none, or a motion did not go to its end."""
    points, line = (found.rests[model] for model in MODELS)
    both = [k for k in range(len(CASES)) if points[k][one] and line[k][one]]
    means: dict[str, float] = {}
    for k in both:
        for digit, model in enumerate(MODELS, 1):
            case = runs[model].case(repeat, k, one)
            at = found.rests[model][k][one]
            if case is None or at is None:
                return {}
            lost = lost_share(case.shares, at.state) / len(both)
            apart = lost_share(case.shares, FULL) / len(both)
            means[f"lost{digit}"] = means.get(f"lost{digit}", 0.0) + lost
            means[f"apart{digit}"] = means.get(f"apart{digit}", 0.0) + apart
    return means


def _two(found: Computed, repeat: int, one: int) -> dict[str, float]:
    """Means of `lost` and `apart` of two points, over the same cases; empty as `_means`."""
    lost = []
    apart = []
    for k in range(len(CASES)):
        at = found.rests["B2"][k][one]
        if at is None or found.rests["B1"][k][one] is None:
            continue
        if not found.two.done(repeat, k, one):
            return {}
        row = found.two.row[repeat, k, one]
        shares = dict(zip(STATES, found.two.arrays["shares"][row], strict=True))
        lost.append(lost_share(shares, at.state))
        apart.append(lost_share(shares, FULL))
    if not lost:
        return {}
    return {"two_lost": sum(lost) / len(lost), "two_apart": sum(apart) / len(apart)}


def _letters(flags: Iterable[bool]) -> str:
    """The letters of the cases whose flag is set."""
    return "".join(itertools.compress(CASES, flags))


def _separated(case: Case) -> bool:
    """Whether both edges are separated for some time."""
    return case.shares.get(NONE, 0.0) > TOUCH


def _loses_force(case: Case) -> bool:
    """Whether the force at an edge vanishes for some time."""
    return max(case.vanishes) > TOUCH


def _locked(found: Computed, model: str, repeat: int, one: int) -> list[Case] | None:
    """The cases of a set with rotation locked; None where a motion did not go to its end."""
    cases = []
    for k in range(len(CASES)):
        case = found.locked[model].case(repeat, k, one)
        if case is None:
            return None
        cases.append(case)
    return cases


def _permanent(found: Computed, repeat: int, one: int) -> list[bool]:
    """Whether points stay in full contact after a small release, in each case with a rest."""
    permanent = []
    for k in range(len(CASES)):
        if found.rests["B1"][k][one] is not None:
            case = found.low.case(repeat, k, one)
            permanent.append(case is not None and lost_share(case.shares, FULL) == 0.0)
    return permanent


def said(found: Computed, repeat: int, one: int) -> Said | None:
    """What a repeat says of a set; None where one of its motions did not go to its end."""
    measured: dict[str, Case | Linear] = {"b3": found.linear[one]}
    cases: dict[str, list[Case]] = {model: [] for model in MODELS}
    for model in MODELS:
        for k, letter in enumerate(CASES):
            case = found.first[model].case(repeat, k, one)
            if case is None:
                return None
            measured[stem(model, letter)] = case
            cases[model].append(case)
    points = cases["B1"]
    line = cases["B2"]
    other = min(repeat, ONCE_MORE - 1)  # the motions beside these are repeated less often
    points_hammer = _letters(hammers(case).margin > 0.0 for case in points)
    line_hammers = _letters(hammers(case).margin > 0.0 for case in line)
    separates = _letters(map(_separated, line))
    shares = _means(found, found.first, repeat, one)
    verdicts: dict[str, str] = dict.fromkeys(VERDICTS, NOT_APPLICABLE)
    verdicts["restless"] = _word(all(case.calm > CALM for case in (*points, *line)))
    verdicts["differ"] = _word(0 < len(points_hammer) < len(CASES))
    verdicts["c_only"] = _word(set(points_hammer) & set(line_hammers) == {"c"})
    if shares:
        verdicts["lost"] = _longer(shares["lost1"], shares["lost2"])
        verdicts["apart"] = _longer(shares["apart1"], shares["apart2"])
        two = _two(found, other, one)
        if two:
            own = _means(found, found.first, other, one)
            shares["two_lost"] = two["two_lost"] - own["lost2"]
            shares["two_apart"] = two["two_apart"] - own["apart2"]
            alike = all(abs(shares[f"two_{key}"]) < least for key, least in ALIKE.items())
            verdicts["two"] = _word(alike)
    line_locked = _locked(found, "B2", other, one)
    if separates and line_locked is not None:
        still_separates = _letters(map(_separated, line_locked))
        verdicts["locked_line"] = _word(not set(still_separates) & set(separates))
    points_locked = _locked(found, "B1", other, one)
    if any(map(_loses_force, points)) and points_locked is not None:
        verdicts["locked_points"] = _word(any(map(_loses_force, points_locked)))
    permanent = _permanent(found, other, one)
    if permanent:
        verdicts["permanent_all"] = _word(all(permanent))
        verdicts["permanent_some"] = _word(any(permanent))
    for i, load in enumerate(LOADINGS):
        released_alike = {model: found.loads[model][i] for model in MODELS}
        means = _means(found, released_alike, other, one)
        if means:
            verdicts[f"load_{load:g}"] = _longer(means["lost1"], means["lost2"])
    satisfied = []
    for claim in INDEPENDENT:
        outcome = claim.rule(*(measured[scene] for scene in claim.scenes))
        satisfied.append(outcome.margin > 0.0)
    return Said(
        satisfied=tuple(satisfied),
        hammers=f"{points_hammer}/{line_hammers}",
        separates=separates,
        shares=shares,
        verdicts=verdicts,
    )


def _bits(flags: Iterable[bool]) -> str:
    """Flags as the bits of a hexadecimal number, the first the lowest."""
    return f"{sum(flag << i for i, flag in enumerate(flags)):x}"


def _agreed(answers: Sequence[str]) -> str:
    """What all repeats say, else that they do not agree."""
    return answers[0] if len(set(answers)) == 1 else UNDECIDED


def row(found: Computed, one: int) -> Row:
    """What a set says."""
    if any((found.first[model].row[0, :, one] < 0).any() for model in MODELS):
        return Row("start")
    repeats = []
    for repeat in range(REPEATS):
        answer = said(found, repeat, one)
        if answer is None:
            return Row("left")
        repeats.append(answer)
    faces: list[float] = []
    for model in MODELS:
        motions_of = found.first[model]
        faces += motions_of.arrays["face"][motions_of.row[0, :, one]].tolist()
    fastest = max(faces) * LENGTH / TIME
    first = repeats[0]
    undecided = []
    for answers in zip(*(each.satisfied for each in repeats), strict=True):
        undecided.append(len(set(answers)) > 1)
    spread = 0.0
    for key in first.shares:
        values = [each.shares.get(key, math.nan) for each in repeats]
        spread = max(spread, max(values) - min(values))

    def share(key: str) -> str:
        return str(round(1000.0 * first.shares[key])) if key in first.shares else ""

    flutters = []
    without = []
    for model in MODELS:
        rests = [found.rests[model][k][one] for k in range(len(CASES))]
        flutters.append(_letters(at is not None and at.flutters for at in rests))
        without.append(_letters(at is None for at in rests))
    return Row(
        outcome="valid" if fastest < SPEED else "outran",
        speed=f"{fastest:.3g}",
        satisfied=_bits(first.satisfied),
        undecided=_bits(undecided),
        hammers=_agreed([each.hammers for each in repeats]),
        separates=_agreed([each.separates for each in repeats]),
        flutters="/".join(flutters),
        without="/".join(without),
        lost1=share("lost1"),
        lost2=share("lost2"),
        apart1=share("apart1"),
        apart2=share("apart2"),
        two_lost=share("two_lost"),
        two_apart=share("two_apart"),
        spread=str(math.ceil(1000.0 * spread - 0.05)),
        verdicts="".join(_agreed([each.verdicts[name] for each in repeats]) for name in VERDICTS),
    )


def rows(numbers: Numbers) -> list[Row]:
    """What some sets say."""
    found = computed(numbers)
    return [row(found, one) for one in range(len(numbers["h"]))]


def read(file: Path) -> list[Row]:
    """The rows of a file. Raises OSError, and TypeError where a row does not fit."""
    return [Row(*line) for line in lines_of(file)]


def write(file: Path, stored: Sequence[Row]) -> None:
    """Write rows to a file."""
    write_lines(file, Row._fields, stored)


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
    stored = read(given.file) if given.file.exists() else []
    numbers = drawn()
    while len(stored) < given.sets:
        end = min(len(stored) + BLOCK, given.sets)
        stored += rows(some(numbers, slice(len(stored), end)))
        write(given.file, stored)
        valid = sum(one.outcome == "valid" for one in stored)
        print(f"{len(stored)} sets, {valid} valid", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
