"""Evolution strategy with restarts over the pads, that can be stopped and taken up again."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from squeal.article.identify.objective import costs, judge_one
from squeal.article.identify.space import BOUNDS, DIMENSIONS, STARTS, decode, encode
from squeal.article.results.claims import JudgedClaim
from squeal.article.results.records import Record, read_json
from squeal.errors import InputError
from squeal.io.writing import to_json, write_text
from squeal.model.contact import FORMULATION_CHOICES, Formulation

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
    judged: list[JudgedClaim]
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


class Best(Record):
    """A pad with its cost."""

    cost: float
    numbers: dict[str, float]


class SearchState(Record):
    """What a state file keeps: the search (formulation, seed and names of the numbers), its starts
    and pads so far, its best pads, and the best of a start that was interrupted.

    That one takes no part in later starts, which so remain those of a search without a break.
    """

    formulation: tuple[str, ...]
    seed: int
    names: tuple[str, ...]
    starts: int = 0
    pads: int = 0
    best: tuple[Best, ...] = ()
    unfinished: Best | None = None

    @property
    def least(self) -> Best | None:
        """The best pad of all, None before the first generation."""
        known = [*self.best[:1], *([self.unfinished] if self.unfinished else [])]
        return min(known, key=lambda entry: entry.cost, default=None)

    def during(self, found: Best) -> SearchState:
        """The state while a start goes on that has met this pad."""
        if self.unfinished is not None and self.unfinished.cost <= found.cost:
            return self
        return replace(self, unfinished=found)

    def after(self, pads: int, found: Best) -> SearchState:
        """The state after one more start over so many pads."""
        best = tuple(sorted((*self.best, found), key=lambda entry: entry.cost)[:KEPT])
        left = self.unfinished
        left = left if left is not None and left.cost < found.cost else None
        more = self.pads + pads
        return replace(self, starts=self.starts + 1, pads=more, best=best, unfinished=left)


def _resumed(file: Path | None, formulation: Formulation, seed: int) -> SearchState:
    """What an earlier run left in the state file. Raises InputError if it is of another search."""
    names = tuple(d.name for d in DIMENSIONS)
    choices = tuple(getattr(formulation, name) for name in FORMULATION_CHOICES)
    fresh = SearchState(choices, seed, names)
    if file is None or not file.exists():
        return fresh
    try:
        kept = read_json(SearchState, file)
    except InputError:
        kept = replace(fresh, names=())
    if replace(kept, starts=0, pads=0, best=(), unfinished=None) != fresh:
        raise InputError(
            f"--state {file}: does not hold this search (formulation, seed); name another file"
        )
    return kept


def _first(
    state: SearchState, formulation: Formulation, random: np.random.Generator
) -> tuple[np.ndarray, float]:
    """Middle and width of a start; what it does depends on its number and the seed alone."""
    kind = state.starts % len(WIDTHS)
    width = WIDTHS[kind]
    if kind == 1:
        return _to_point(STARTS[formulation.delta_moment]), width
    anywhere = random.uniform(size=len(BOUNDS))
    if kind == 0 or not state.best:
        return anywhere, WIDTHS[0]
    one, two = (state.best[i] for i in random.integers(0, len(state.best), 2))
    mixed = np.where(anywhere < 0.5, _to_point(one.numbers), _to_point(two.numbers))
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
    them, of at most so many `generations`. Finished starts and the best pad of an unfinished one
    are kept in `state`, and a later call goes on after them. An interrupt ends the search with the
    best pad so far, if there is one. Repeatable from the seed for a given number of starts, on
    machines with the same kind of processor. Raises InputError if the state is of another search,
    ComputationError without heyoka.
    """
    import cma

    begun = time.monotonic()
    kept = _resumed(state, formulation, seed)

    def keep(now: SearchState) -> None:
        nonlocal kept
        if now is not kept and state is not None:
            write_text(state, to_json(now.to_dict()))
        kept = now

    def one_start() -> None:
        random = np.random.default_rng([seed, kept.starts])
        middle, width = _first(kept, formulation, random)
        options = {"bounds": [0.0, 1.0], "popsize": POPULATION, "verbose": -9}
        options["seed"] = int(random.integers(1, 2**31))
        strategy = cma.CMAEvolutionStrategy(middle, width, options)
        best, best_numbers, gained, pads = np.inf, _to_numbers(middle), 0, 0
        for generation in range(1, generations + 1):
            points = strategy.ask()
            many = [_to_numbers(point) for point in points]
            found = costs(many, formulation, workers)
            strategy.tell(points, found.tolist())
            pads += len(many)
            least = int(found.argmin())
            if found[least] < best - GAIN:
                gained = generation
            if found[least] < best:
                best, best_numbers = float(found[least]), many[least]
                keep(kept.during(Best(best, best_numbers)))
            late = time.monotonic() - begun > seconds or generation == generations
            idle = generation - gained >= PATIENCE or strategy.sigma < POINT
            done = late or idle or bool(strategy.stop())
            if tell is not None and (done or generation % 10 == 0):
                before = f", best before {kept.best[0].cost:.4f}" if kept.best else ""
                tell(
                    f"start {kept.starts + 1}, generation {generation}: {kept.pads + pads} pads, "
                    f"cost {best:.4f}{before}, {time.monotonic() - begun:.0f} s"
                )
            if done:
                break
        keep(kept.after(pads, Best(best, best_numbers)))

    until = None if starts is None else kept.starts + starts
    try:
        while time.monotonic() - begun < seconds and kept.starts != until:
            one_start()
        if kept.least is None:
            one_start()
    except KeyboardInterrupt:
        if kept.least is None:
            raise
        if tell is not None:
            tell("stopped; the best pad so far follows")
    best = kept.least
    assert best is not None
    judged = judge_one(best.numbers, formulation)
    return Found(best.numbers, best.cost, judged, kept.starts, kept.pads)
