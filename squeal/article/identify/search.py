"""Evolution strategy with restarts over the pads, that can be stopped and taken up again."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from squeal.article.claims import Judged
from squeal.article.identify.objective import costs, judge_one
from squeal.article.identify.space import BOUNDS, DIMENSIONS, STARTS, decode, encode
from squeal.errors import InputError
from squeal.files.writing import to_json, write_text
from squeal.model.contact import Formulation

POPULATION = 32
KEPT = 8  # best pads that a search remembers
# A start ends when it has not gained this much in so many generations, or has come to a point.
GAIN, PATIENCE, POINT = 0.003, 60, 0.003
# Width of the first generation, in shares of the ranges: anywhere, near a known pad, between good
# ones.
WIDTHS = (0.3, 0.1, 0.1)

_LOW, _HIGH = np.array(BOUNDS).T


@dataclass(frozen=True)
class Found:
    """The best pad of a search: its numbers, cost, claims at tight tolerance, and the effort."""

    numbers: dict[str, float]
    cost: float
    judged: list[Judged]
    starts: int
    pads: int

    @property
    def reproduced(self) -> int:
        """How many claims hold."""
        return sum(j.holds for j in self.judged)


def _to_numbers(point: np.ndarray) -> dict[str, float]:
    return decode(_LOW + (_HIGH - _LOW) * np.clip(point, 0.0, 1.0))


def _to_point(numbers: dict[str, float]) -> np.ndarray:
    return np.clip((encode(numbers) - _LOW) / (_HIGH - _LOW), 0.0, 1.0)


@dataclass
class _Record:
    """What the state file keeps: starts and pads so far, the best pads with their costs."""

    starts: int
    pads: int
    best: list[dict[str, Any]]

    def add(self, cost: float, numbers: dict[str, float]) -> None:
        self.best.append({"cost": cost, "numbers": numbers})
        self.best.sort(key=lambda entry: entry["cost"])
        del self.best[KEPT:]


def _search_of(formulation: Formulation, seed: int) -> dict[str, Any]:
    words = [formulation.line_force, formulation.delta_from, formulation.delta_moment]
    return {"formulation": words, "seed": seed, "names": [d.name for d in DIMENSIONS]}


def _resumed(file: Path | None, wanted: dict[str, Any]) -> _Record:
    """What an earlier run left in the state file. Raises InputError if it is of another search."""
    if file is None or not file.exists():
        return _Record(0, 0, [])
    try:
        kept = json.loads(file.read_text(encoding="utf-8"))
        same = all(kept[key] == value for key, value in wanted.items())
        record = _Record(kept["starts"], kept["pads"], kept["best"])
    except (ValueError, KeyError, TypeError):
        same = False
    if not same:
        raise InputError(
            f"--state {file}: does not hold this search (formulation, seed); name another file"
        )
    return record


def _first(
    record: _Record, formulation: Formulation, random: np.random.Generator
) -> tuple[np.ndarray, float]:
    """Middle and width of a start; what it does depends on its number and the seed alone."""
    kind = record.starts % len(WIDTHS)
    width = WIDTHS[kind]
    if kind == 1:
        return _to_point(STARTS[formulation.delta_moment]), width
    anywhere = random.uniform(size=len(BOUNDS))
    if kind == 0 or not record.best:
        return anywhere, WIDTHS[0]
    one, two = (record.best[i] for i in random.integers(0, len(record.best), 2))
    mixed = np.where(anywhere < 0.5, _to_point(one["numbers"]), _to_point(two["numbers"]))
    return mixed, width


def search(
    formulation: Formulation,
    seed: int = 1,
    seconds: float = 600.0,
    state: Path | None = None,
    workers: int = 2,
    tell: Callable[[str], None] | None = None,
    starts: int | None = None,
    generations: int = 1000,
) -> Found:
    """Search for the pad that fails the fewest claims, with the widest margins.

    Runs CMA-ES (Hansen 2016) from one start after another for about `seconds`, or `starts` of
    them, of at most so many `generations`. Finished starts are kept in `state`, and a later call
    goes on after them. Repeatable from the seed for a given number of starts, on machines with
    the same number of lanes and the same `workers`. Raises InputError
    if the state is of another search, ComputationError without heyoka.
    """
    import cma

    begun = time.monotonic()
    wanted = _search_of(formulation, seed)
    record = _resumed(state, wanted)

    def one_start() -> None:
        random = np.random.default_rng([seed, record.starts])
        middle, width = _first(record, formulation, random)
        options = {
            "bounds": [0.0, 1.0],
            "popsize": POPULATION,
            "seed": int(random.integers(1, 2**31)),
            "verbose": -9,
        }
        strategy = cma.CMAEvolutionStrategy(middle, width, options)
        best, best_numbers, gained = np.inf, _to_numbers(middle), 0
        for generation in range(1, generations + 1):
            points = strategy.ask()
            many = [_to_numbers(point) for point in points]
            found = costs(many, formulation, workers)
            strategy.tell(points, found.tolist())
            record.pads += len(many)
            least = int(found.argmin())
            if found[least] < best - GAIN:
                gained = generation
            if found[least] < best:
                best, best_numbers = float(found[least]), many[least]
            late = time.monotonic() - begun > seconds or generation == generations
            idle = generation - gained >= PATIENCE or strategy.sigma < POINT
            done = late or idle or bool(strategy.stop())
            if tell is not None and (done or generation % 10 == 0):
                before = f", best before {record.best[0]['cost']:.4f}" if record.best else ""
                tell(
                    f"start {record.starts + 1}, generation {generation}: {record.pads} pads, "
                    f"cost {best:.4f}{before}, {time.monotonic() - begun:.0f} s"
                )
            if done:
                break
        record.add(best, best_numbers)
        record.starts += 1
        if state is not None:
            write_text(state, to_json(wanted | vars(record)))

    until = None if starts is None else record.starts + starts
    while time.monotonic() - begun < seconds and record.starts != until:
        one_start()
    if not record.best:
        one_start()
    best = record.best[0]
    judged = judge_one(best["numbers"], formulation)
    return Found(best["numbers"], best["cost"], judged, record.starts, record.pads)
