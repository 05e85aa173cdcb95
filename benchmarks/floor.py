"""Single runs and batches against a Taylor integrator by hand in C++: `python -m benchmarks.floor`.

The B1 scenes of the report, one by one, and random pads about them, all at once, run over the
scenes' time to a final error of at most 1e-10 (the median of a sample of the random pads); the
truth is quad precision. Squeal and the programs by hand take turns on one core of the same machine,
and processor time is what counts; each has the order or the tolerance that suits it best. There
are three programs: plain loops over one pad (floor.cpp), and loops all unrolled (floor_lanes.cpp)
over one pad or over eight at once in vector registers. Needs g++.
"""

from __future__ import annotations

import dataclasses
import itertools
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from squeal.article.identify.ensemble import simulate_many, stack
from squeal.article.studies._reference import Reference, error_against, reference
from squeal.article.studies.accuracy import ours
from squeal.io.scene import Scene, read_scene
from squeal.model.equations import PadModel
from squeal.simulation.hybrid import first_contact
from squeal.simulation.run import in_natural_units

HERE = Path(__file__).resolve().parent
SCENES = HERE.parent / "workflow" / "scenes"
ORDERS = (12, 13, 14, 16)
TOLERANCES = (3e-9, 1e-9, 3e-10, 1e-10, 1e-11)
ERROR = 1e-10
ROUNDS = 15
REPEATS = 11
PADS = 4096
SPREAD = 0.05
SAMPLE = 24
BATCH_ROUNDS = 7
LANES = 8
OPTIONS = ("-std=c++17", "-O3", "-march=native", "-ffast-math", "-mprefer-vector-width=512")


class Program(NamedTuple):
    """A program by hand: the place of its executable, the order of its series, lanes (0: loops)."""

    path: Path
    order: int
    lanes: int


class Outcome(NamedTuple):
    """Processor time in s of a run, steps, and the places (n, 3) and changes (n,) of the pads."""

    seconds: float
    steps: int
    places: np.ndarray
    changes: np.ndarray


def compiled(folder: Path, lanes: int) -> list[Program]:
    """The programs of all orders."""
    found = []
    for order in ORDERS:
        program = folder / f"floor{lanes}_{order}"
        source = HERE / ("floor_lanes.cpp" if lanes else "floor.cpp")
        defined = [f"-DORDER={order}", f"-DLANES={lanes}"]
        command = ["g++", *OPTIONS, *defined, str(source), "-o", str(program)]
        subprocess.run(command, check=True)
        found.append(Program(program, order, lanes))
    return found


def numbers(model: PadModel, state: np.ndarray, stop: float) -> list[float]:
    """What the programs read of a scaled pad."""
    c = model.c
    pad = [c.m, c.I, c.mu, c.F_n, stop]
    springs = [c.k1, c.L1, c.D1x, c.D1y, c.r1x, c.r1y, c.k2, c.L2, c.D2x, c.D2y, c.r2x, c.r2y]
    edges = [c.k3, c.rlx, c.rly, c.k4, c.rtx, c.rty]
    place = state.copy()
    place[[2, 5]] /= c.w
    return [float(v) for v in [*pad, *springs, *edges, *place, *first_contact(model, state)]]


def by_hand(program: Program, scenes: Sequence[Scene], repeats: int) -> Outcome:
    """All pads by a program."""
    scaled = [in_natural_units(scene)[1:] for scene in scenes]
    rows = [numbers(*one) for one in scaled]
    text = " ".join(repr(v) for row in rows for v in row)
    out = subprocess.run(
        [str(program.path)], input=f"{len(rows)} {repeats} {text}", capture_output=True, text=True
    ).stdout.splitlines()
    seconds, steps = out[0].split()
    ends = np.array([[float(v) for v in line.split()] for line in out[1:]])
    places = ends[:, 1:] * [[1.0, 1.0, model.c.w] for model, *_ in scaled]
    return Outcome(float(seconds), int(steps), places, ends[:, 0])


Path_ = Callable[[Sequence[Scene], int], Outcome]


def alone(tolerance: float, scenes: Sequence[Scene], repeats: int) -> Outcome:
    """One scene by the default path."""
    spent = []
    for _ in range(repeats):
        begun = time.process_time()
        run = ours(scenes[0], tolerance)
        spent.append(time.process_time() - begun)
    changes = np.array([len(run.times)])
    return Outcome(statistics.median(spent), run.steps, run.position[None], changes)


def batch(tolerance: float, scenes: Sequence[Scene], repeats: int) -> Outcome:
    """All pads by the batch path."""
    pads = stack([s.pad for s in scenes])
    stops = np.array([s.stop for s in scenes])
    initial = np.array([s.initial for s in scenes])
    spent = []
    for _ in range(repeats):
        begun = time.process_time()
        found = simulate_many("B1", pads, initial, stops, tolerance)
        spent.append(time.process_time() - begun)
    units = [in_natural_units(s)[0] for s in scenes]
    places = np.array([u.to_scaled(f) for u, f in zip(units, found["final"], strict=True)])[:, :3]
    return Outcome(statistics.median(spent), int(found["steps"].sum()), places, found["changes"])


def fitting(
    paths: Sequence[Path_], scenes: Sequence[Scene], exact: dict[int, Reference]
) -> list[Path_]:
    """The paths with no change missed and an error (the median over pads) that is small enough."""
    found = []
    for path in paths:
        once = path(scenes, 1)
        right = all(once.changes[i] == len(one.times) for i, one in exact.items())
        errors = [error_against(once.places[i], one.position) for i, one in exact.items()]
        if right and statistics.median(errors) <= ERROR:
            found.append(path)
    return found


def fastest(
    kinds: dict[str, list[Path_]], scenes: Sequence[Scene], rounds: int, repeats: int
) -> dict[str, tuple[float, int]]:
    """Median processor time and steps of the fastest path of each kind, all taking turns."""
    spent: dict[tuple[str, int], list[Outcome]] = {}
    for _ in range(rounds):
        for kind, paths in kinds.items():
            for i, path in enumerate(paths):
                spent.setdefault((kind, i), []).append(path(scenes, repeats))
    found: dict[str, tuple[float, int]] = {}
    for (kind, _), outcomes in spent.items():
        one = statistics.median(o.seconds for o in outcomes), outcomes[0].steps
        found[kind] = min(one, found.get(kind, one))
    return found


def spread(scenes: Sequence[Scene], count: int) -> list[Scene]:
    """Random pads about the scenes that reach the end of their time."""
    random = np.random.default_rng(0)
    names = ("m", "I", "k1", "k2", "k3", "k4", "h", "mu", "F_n", "alpha1", "alpha2")
    found: list[Scene] = []
    while len(found) < count:
        some = []
        for scene in itertools.islice(itertools.cycle(scenes), count):
            factors = random.uniform(1.0 - SPREAD, 1.0 + SPREAD, len(names))
            changed = {n: getattr(scene.pad, n) * f for n, f in zip(names, factors, strict=True)}
            some.append(dataclasses.replace(scene, pad=scene.pad.replace(**changed)))
        stops = np.array([s.stop for s in some])
        initial = np.array([s.initial for s in some])
        run = simulate_many("B1", stack([s.pad for s in some]), initial, stops, ERROR)
        found += [s for s, valid in zip(some, run["valid"], strict=True) if valid]
    return found[:count]


def printed(what: str, pads: int, times: dict[str, tuple[float, int]]) -> None:
    """A line: times a pad, steps, ratios of squeal's time."""
    own, steps = times["squeal"]
    line = f"{what}: squeal {1e6 * own / pads:.0f} us a pad ({steps / pads:.0f} steps)"
    for kind, (seconds, steps) in times.items():
        if kind != "squeal":
            line += f"; {kind} {1e6 * seconds / pads:.0f} us ({steps / pads:.0f} steps), "
            line += f"ratio {own / seconds:.2f}"
    print(line, flush=True)


def main() -> None:
    """Compile, run all, print."""
    scenes = {}
    for case in "abcd":
        scenes[case] = dataclasses.replace(read_scene(SCENES / f"b1-{case}.yaml"), outputs=())
    with tempfile.TemporaryDirectory() as folder:
        programs = {n: compiled(Path(folder), n) for n in (0, 1, LANES)}
        hands = {n: [partial(by_hand, one) for one in programs[n]] for n in programs}
        for case, scene in scenes.items():
            kinds = {
                "squeal": [partial(alone, tolerance) for tolerance in TOLERANCES],
                "by hand": hands[0],
                "unrolled": hands[1],
            }
            exact = {0: reference(scene)}
            good = {kind: fitting(paths, [scene], exact) for kind, paths in kinds.items()}
            times = fastest(good, [scene], ROUNDS, REPEATS)
            printed(f"B1, case ({case}), {len(exact[0].times)} contact changes", 1, times)
        pads = spread(list(scenes.values()), PADS)
        exact = {i: reference(pads[i]) for i in range(0, PADS, PADS // SAMPLE)}
        kinds = {
            "squeal": [partial(batch, tolerance) for tolerance in TOLERANCES],
            f"{LANES} lanes by hand": hands[LANES],
        }
        good = {kind: fitting(paths, pads, exact) for kind, paths in kinds.items()}
        printed(f"B1, {PADS} random pads", PADS, fastest(good, pads, BATCH_ROUNDS, 1))


if __name__ == "__main__":
    main()
