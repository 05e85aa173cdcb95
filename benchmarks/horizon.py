"""Stiff contacts over whole support periods: `python -m benchmarks.horizon [--write] [--sets]`.

Computes the runs of the study `horizon`, in quad precision, in doubles and by a second method, and
compares them with the stored ones; `--write` stores them. It takes about half an hour of one core.
`--sets`: the random parameter sets alone, a minute.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from squeal.article.identify.population import drawn, some
from squeal.article.identify.population import read as read_rows
from squeal.article.identify.space import MODELS, scenes_of
from squeal.article.records import read_json
from squeal.article.studies._independent import motion
from squeal.article.studies._reference import TOLERANCE, quad
from squeal.article.studies.extreme import PERIOD, scene_of
from squeal.article.studies.horizon import (
    LEVELS,
    START_ERROR,
    Errors,
    Horizon,
    RandomSets,
    Run,
    first_excess,
)
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.io.writing import to_json, write_text
from squeal.model.contact import CONSISTENT, contact_law
from squeal.model.pad import Model
from squeal.simulation.hybrid import integrate
from squeal.simulation.run import in_natural_units
from squeal.simulation.taylor import TaylorIntegrator

STORED = Path(__file__).resolve().parent.parent / "workflow/stored/horizon.json"
ENSEMBLE = STORED.with_name("ensemble.csv")
# beyond 1e8 rounding of the place, over a depth so small, hides contact changes from doubles
STIFFNESSES = tuple(10.0**n for n in range(9))
PERIODS = 10.0  # the longest window
CHANGES = 3_300  # contact changes of a window, up to the stiffness STIFFER
STIFFER_CHANGES = 2_000  # and beyond
SHORTENED = 1e3  # stiffness above which a window ends soon after the motion is lost
STIFFER = 1e6
LOST = 1e-3  # difference at which it is
AFTER = 1.5  # the window over the time until then
SAMPLES = 400  # times in a window at which motions are compared
SHOWN = 40  # of them, stored with their errors
RENORMALISED = 1e-5  # distance of a neighbour in natural units, those of the contact's depth
LONG_TOLERANCE = 1e-18  # of long doubles
LEGS = 300  # of a motion, after each of which it is set back
SETS = 100  # random sets beside the pad of the suite
SETS_STIFFNESS = 1e3
SETS_START_ERROR = 1e-14
TIGHT = 1e-15  # tolerance of their motions
BITS = (0, 1, -1, 2, -2)  # units in the last place by which the double run's start is changed
ONE_UP_TO = 1e8  # stiffness up to which one period is run in doubles
TEN_UP_TO = 1e6  # and ten


def stiff_scene(model: Model, stiffness: float, periods: float) -> Scene:
    """The suite's pad on contact springs so many times as stiff as a support."""
    contact: dict[str, Any] = dict.fromkeys(contact_law(model).parameters, stiffness)
    return scene_of(model, periods * PERIOD, **contact)


def places(
    scene: Scene, shares: np.ndarray, number: Any, tolerance: float, factor: Any = None
) -> tuple[np.ndarray, int]:
    """Places (n, 3) in natural units at shares (n,) of the time, and the contact changes.

    number: a type of heyoka; factor: what the first state is multiplied with.
    """
    units, model, first, stop = in_natural_units(scene)
    integrator = TaylorIntegrator(model, tolerance, number)
    state = np.array([number(float(v)) for v in first])
    if factor is not None:
        state = state * factor
    found = [state[:3]]
    changes = 0
    for span in np.diff(shares * stop).tolist():
        _, state, _, more = integrate(model, integrator, units, state, span)
        found.append(state[:3])
        changes += more
    return np.array(found), changes


def count_changes(scene: Scene) -> int:
    """Contact changes of a scene's motion in doubles."""
    units, model, first, stop = in_natural_units(scene)
    *_, changes = integrate(model, TaylorIntegrator(model, scene.tolerance), units, first, stop)
    return changes


def window(model: Model, stiffness: float) -> float:
    """Support periods with at most `CHANGES` contact changes.

    Where contact is very stiff they end soon after doubles and the second method have separated.
    """
    most = CHANGES if stiffness <= STIFFER else STIFFER_CHANGES
    periods = min(PERIODS, 20.0 * CHANGES / math.sqrt(stiffness))
    while True:
        try:
            changes = count_changes(stiff_scene(model, stiffness, periods))
        except ComputationError:  # rounding hides a contact change
            periods *= 0.5
            continue
        if changes <= most:
            break
        periods *= min(0.9, most / changes)
    if stiffness <= SHORTENED:
        return periods
    scene = stiff_scene(model, stiffness, periods)
    shares = np.linspace(0.0, 1.0, SAMPLES + 1)
    factors = (1.0, 1.0 + sys.float_info.epsilon)
    one, other = (places(scene, shares, float, scene.tolerance, f)[0] for f in factors)
    size = np.maximum.accumulate(np.abs(one).max(axis=1))
    apart = np.abs(one - other).max(axis=1) / size
    lost = first_excess(shares * periods, apart, LOST)
    return periods if lost is None else min(periods, AFTER * lost)


def lyapunov_exponent(scene: Scene) -> float:
    """Greatest Lyapunov exponent over a scene's motion, per natural unit of time.

    Benettin's method: a neighbour is set back near the motion again and again, and the exponent is
    the mean rate at which the distance grows in between. Long doubles, since the distance has to be
    small beside the depth of the contact and large beside the rounding of a place far away.
    """
    number = np.longdouble
    units, model, first, stop = in_natural_units(scene)
    integrator = TaylorIntegrator(model, LONG_TOLERANCE, number)
    span = stop / LEGS

    def carried(state: np.ndarray) -> np.ndarray:
        _, end, *_ = integrate(model, integrator, units, state, span)
        return end

    state = carried(first.astype(number))
    apart = np.ones(6, dtype=number)
    grown = 0.0
    for _ in range(LEGS - 1):
        near = state + RENORMALISED / np.sqrt(apart @ apart) * apart
        state = carried(state)
        near = carried(near)
        apart = near - state
        grown += math.log(float(np.sqrt(apart @ apart)) / RENORMALISED)
    return grown / (stop - span)


def compute(model: Model, stiffness: float, periods: float) -> Run:
    """All motions of one model and stiffness over a window."""
    scene = stiff_scene(model, stiffness, periods)
    units, *_ = in_natural_units(scene)
    shares = np.linspace(0.0, 1.0, SAMPLES + 1)
    number = quad()
    exact, changes = places(scene, shares, number, TOLERANCE)
    size = np.maximum.accumulate(np.abs(exact.astype(float)).max(axis=1))

    def errors(found: np.ndarray) -> np.ndarray:
        return np.asarray(np.abs((found - exact).astype(float)).max(axis=1) / size)

    moved, _ = places(scene, shares, number, TOLERANCE, number(1) + number(START_ERROR))
    second = motion(model, scene.pad, np.array(scene.initial), shares * periods * PERIOD)
    by_second = errors(units.to_scaled(second.states)[:, :3].astype(exact.dtype))
    by_start = errors(moved)
    times = shares * periods
    double = []
    counts = []
    curves = []
    for bits in BITS:
        factor = 1.0 + bits * sys.float_info.epsilon
        found, count = places(scene, shares, float, scene.tolerance, factor)
        curves.append(errors(found.astype(exact.dtype)))
        counts.append(count)
        double.append(tuple(first_excess(times, curves[-1], level) for level in LEVELS))
    shown = slice(SAMPLES // SHOWN, None, SAMPLES // SHOWN)

    def stored(curve: np.ndarray) -> tuple[float, ...]:
        return tuple(float(f"{value:.3g}") for value in curve[shown])

    exponent = lyapunov_exponent(scene) / units.time * PERIOD
    one = None
    ten = None
    if stiffness <= ONE_UP_TO:
        one = count_changes(stiff_scene(model, stiffness, 1.0))
    if stiffness <= TEN_UP_TO:
        ten = count_changes(stiff_scene(model, stiffness, 10.0))
    return Run(
        model=model,
        stiffness=stiffness,
        window=periods,
        changes=changes,
        found=(counts[0], len(second.times)),
        double=tuple(double),
        independent=tuple(first_excess(times, by_second, level) for level in LEVELS),
        start=tuple(first_excess(times, by_start, level) for level in LEVELS),
        exponent=exponent,
        one=one,
        ten=ten,
        times=tuple(np.round(times[shown], 9).tolist()),
        errors=Errors(stored(curves[0]), stored(by_second), stored(by_start)),
    )


def is_lost(model: Model, scene: Scene) -> bool:
    """Whether a scene's pad on stiff contact loses a motion in doubles within ten periods."""
    k1 = scene.pad.k1
    law = contact_law(model)
    level = {"theta0": 0.0, "x0": 0.0} | ({"y0": 0.0} if law.absolute_gap else {})
    pad = scene.pad.replace(**level, **dict.fromkeys(law.parameters, SETS_STIFFNESS * k1))
    depth = 2.0 * pad.F_n / (SETS_STIFFNESS * k1 * len(law.parameters))
    stop = PERIODS * PERIOD * math.sqrt(pad.m / k1)
    first = (0.0, -depth, 0.0, 0.0, 0.0, 0.0)
    stiff = dataclasses.replace(scene, pad=pad, initial=first, stop=stop, outputs=())
    shares = np.linspace(0.0, 1.0, SAMPLES + 1)
    factors = (1.0, 1.0 + SETS_START_ERROR)
    one, other = (places(stiff, shares, float, stiff.tolerance, f)[0] for f in factors)
    size = np.maximum.accumulate(np.abs(one).max(axis=1))
    apart = np.abs(one - other).max(axis=1) / size
    return first_excess(shares, apart, LEVELS[0]) is not None


def random_sets() -> RandomSets:
    """How many of the first valid random sets lose their motion."""
    rows = read_rows(ENSEMBLE)
    valid = [number for number, row in enumerate(rows) if row.outcome == "valid"][:SETS]
    numbers = drawn()
    lost = dict.fromkeys(MODELS, 0)
    for number in valid:
        scenes = scenes_of(some(numbers, slice(number, number + 1)), CONSISTENT, TIGHT)
        for model in MODELS:
            lost[model] += is_lost(model, scenes[model]["c"])
    return RandomSets(len(valid), SETS_STIFFNESS, SETS_START_ERROR, dict(lost))


def _computed(case: tuple[Model, float]) -> Run:
    model, stiffness = case
    run = compute(model, stiffness, window(model, stiffness))
    print(model, stiffness, run.window, run.changes, run.horizon, run.predicted, file=sys.stderr)
    return run


def main() -> None:
    """Compute; store, or name the runs that differ."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.horizon", description=__doc__)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--sets", action="store_true")
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    others = random_sets()
    if given.sets:
        stored = read_json(Horizon, STORED)
        if given.write:
            write_text(STORED, to_json(dataclasses.replace(stored, random=others).to_dict()))
        elif stored.random != others:
            print(f"random sets: {others}, stored {stored.random}")
        return
    cases = [(model, stiffness) for model in MODELS for stiffness in STIFFNESSES]
    with ProcessPoolExecutor(given.workers, mp_context=get_context("spawn")) as pool:
        runs = tuple(pool.map(_computed, cases))
    if given.write:
        write_text(STORED, to_json(Horizon(runs, others).to_dict()))
        return
    stored = read_json(Horizon, STORED)
    for old, new in zip(stored.runs, runs, strict=True):
        if dataclasses.asdict(old) != dataclasses.asdict(new):
            print(f"{old.model}, {old.stiffness:g} k1: other values")


if __name__ == "__main__":
    main()
