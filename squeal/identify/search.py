"""Differential evolution over the pads, on all cores, that can be stopped and taken up again."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from squeal.claims import Judged
from squeal.contact import Formulation
from squeal.errors import InputError
from squeal.files import to_json, write_text
from squeal.identify.objective import cost, judge_numbers
from squeal.identify.space import BOUNDS, DIMENSIONS, START, decode, encode


@dataclass(frozen=True)
class Found:
    """The best pad of a search: its numbers, cost, claims at tight tolerance, and the effort."""

    numbers: dict[str, float]
    cost: float
    judged: list[Judged]
    generations: int
    pads: int

    @property
    def reproduced(self) -> int:
        """How many claims hold."""
        return sum(j.verdict == "reproduced" for j in self.judged)


class _Objective:
    """Cost as a picklable function of the point alone."""

    def __init__(self, formulation: Formulation) -> None:
        self.formulation = formulation

    def __call__(self, point: np.ndarray) -> float:
        return cost(point, self.formulation)


def _state(formulation: Formulation, seed: int) -> dict[str, Any]:
    words = [formulation.line_force, formulation.delta_from, formulation.delta_moment]
    return {"formulation": words, "seed": seed, "names": [d.name for d in DIMENSIONS]}


def _resumed(file: Path | None, formulation: Formulation, seed: int) -> dict[str, Any] | None:
    """What an earlier run left in the state file. Raises InputError if it is of another search."""
    if file is None or not file.exists():
        return None
    try:
        kept = json.loads(file.read_text(encoding="utf-8"))
        same = all(kept[key] == value for key, value in _state(formulation, seed).items())
    except (ValueError, KeyError, TypeError):
        same = False
    if not same:
        raise InputError(
            f"--state {file}: does not hold this search (formulation, seed); name another file"
        )
    return kept


def search(
    formulation: Formulation,
    seed: int = 1,
    seconds: float = 600.0,
    state: Path | None = None,
    workers: int = 2,
    tell: Callable[[str], None] | None = None,
    population: int = 8,
) -> Found:
    """Search for the pad that fails the fewest claims, with the widest margins.

    Runs for about `seconds` with `population` pads a dimension; the population is written to
    `state` after each generation and a later call goes on from there. Repeatable from the seed for
    a given number of generations.
    """
    from scipy.optimize import differential_evolution

    started = time.monotonic()
    kept = _resumed(state, formulation, seed)
    generation = kept["generation"] if kept else 0
    effort = {"generations": generation, "pads": kept["pads"] if kept else 0}

    def watch(intermediate_result: Any) -> None:
        r = intermediate_result
        effort["generations"] += 1
        effort["pads"] += len(r.population)
        if state is not None:
            record = _state(formulation, seed) | {
                "generation": effort["generations"],
                "pads": effort["pads"],
                "population": r.population.tolist(),
            }
            write_text(state, to_json(record))
        if tell is not None:
            tell(
                f"generation {effort['generations']}: {effort['pads']} pads, "
                f"cost {r.fun:.4f}, {time.monotonic() - started:.0f} s"
            )
        if time.monotonic() - started > seconds:
            raise StopIteration

    result = differential_evolution(
        _Objective(formulation),
        BOUNDS,
        init=np.array(kept["population"]) if kept else "sobol",
        x0=None if kept else encode(START),
        popsize=population,
        maxiter=100_000,
        tol=1e-8,
        rng=np.random.default_rng([seed, generation]),
        mutation=(0.4, 0.9),
        recombination=0.8,
        updating="deferred",
        workers=workers,
        polish=False,
        callback=watch,
    )
    numbers = decode(result.x)
    judged = judge_numbers(numbers, formulation, tolerance=1e-12, per_step=24)
    return Found(numbers, float(result.fun), judged, effort["generations"], effort["pads"])
