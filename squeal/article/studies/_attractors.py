"""Attractors of damped motions, and undamped motions: exponents, and a branch of cycles."""

import contextlib
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from squeal.article.records import Missing
from squeal.article.results.onset import CyclePoint, Cycles, Exponent
from squeal.article.studies._damped import RATIO, damped, window
from squeal.article.studies._neighbours import SETTLING, growth, neighbours
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.units import natural_units
from squeal.simulation.cycles import Cycle, Shooting
from squeal.simulation.observers import Change, Events, Extrema

LASTING = 600  # windows over which neighbours are compared
STRETCH = 5  # windows from one comparison to the next
EARLY = 10  # least windows for an exponent
MEMBERS = 5  # motions from which one is taken
APART = 1e-3  # of their size: how far apart these motions start
CONFIDENCE = 0.95  # of the interval of each start's rate
BLOCKS = 12  # of late stretches, between whose means a rate scatters
# Student's quantile at CONFIDENCE with BLOCKS - 2 degrees of freedom: SciPy takes long to load
STUDENT = 2.2281388519649385
POWER = 2  # deviations that grow by this power of time show no exponential growth
GREATEST = 1.0  # mu on the branch of cycles
BRANCH_STEP = 0.2  # of it, in natural units, periods and mu
NEAR = 1e-6  # of their size: returns that near are the same


def shooting(scene: Scene, ratio: float) -> Shooting:
    """The scene's damped pad in units of its own start."""
    units = natural_units(scene.pad_model, scene.initial)
    return Shooting(units.scaled(damped_model(damped(scene, ratio))), units)


def returns(scene: Scene, state: np.ndarray, windows: float) -> list[Change]:
    """The separations of the leading edge of a motion from a state (SI), while it lasts."""
    assert scene.stop is not None
    pad = shooting(scene, RATIO)
    watch = Events()
    start, stop = pad.units.to_scaled(state), windows * scene.stop / pad.units.time
    with contextlib.suppress(ComputationError):
        pad.motion(start, stop, scene.pad.mu, [watch])
    return [c for c in watch.changes if c.source.leading and not c.target.leading]


def _point(pad: Shooting, cycle: Cycle) -> CyclePoint:
    watch, changes = Extrema(pad.model.replace(mu=cycle.mu)), Events()
    pad.motion(cycle.state, cycle.period, cycle.mu, [watch, changes])
    peak = watch.result()["extrema"][pad.model.law.plotted[0].name]
    period, multiplier = 1e3 * cycle.period * pad.units.time, np.abs(cycle.multipliers[0])
    told = (len(changes.changes), peak[1] if peak else 0.0)
    return CyclePoint(float(cycle.mu), float(period), *told, float(multiplier))


def decay(pad: Shooting, cycle: Cycle, turns: int = 24) -> float:
    """The greatest multiplier of a stable cycle, from the decay of a small disturbance.

    The linear map that takes the disturbance of each period to that of the next, by least squares
    from a simulation; without its multiplier 1, of a shift in time.
    """
    random = np.random.default_rng(0).normal(size=6)
    state = cycle.state + 1e-6 * np.abs(cycle.state).max() * random
    off = [state - cycle.state]
    for _ in range(turns):
        state = pad.motion(state, cycle.period, cycle.mu)
        off.append(state - cycle.state)
    values = np.linalg.eigvals(np.linalg.lstsq(off[:-1], off[1:])[0])
    return float(np.abs(np.delete(values, np.argmin(np.abs(values - 1.0)))).max())


def cycles(name: str, scene: Scene, state: np.ndarray) -> Cycles | Missing:
    """The periodic motion that a state (SI) has settled to, followed in mu."""
    passed, pad = returns(scene, state, 2), shooting(scene, RATIO)
    states = np.array([change.state for change in passed])
    size = np.abs(states).max() if len(states) else 0.0
    for turn in range(1, min(9, len(states))):
        if np.abs(states[turn] - states[0]).max() < NEAR * size:
            break
    else:
        return Missing("the motion does not return to itself")
    period = passed[turn].t - passed[0].t
    try:
        # from between two changes, so that none falls on an end
        begin = pad.motion(states[0], 0.01 * period, scene.pad.mu)
        own, _ = pad.solve(np.concatenate([begin, [period, scene.pad.mu]]))
        first, decays = _point(pad, own), decay(pad, own)
        branch = (*reversed(_followed(pad, own, 1.0, 10)), first, *_followed(pad, own, -1.0, 40))
    except ComputationError as error:
        return Missing(str(error))
    return Cycles(name, RATIO, first, decays, abs(own.trivial - 1.0), branch)


def _followed(pad: Shooting, own: Cycle, towards: float, most: int) -> list[CyclePoint]:
    points: list[CyclePoint] = []
    for one in pad.branch(own, towards, BRANCH_STEP, most):
        if one.mu > GREATEST:
            break
        points.append(_point(pad, one))
        if not points[-1].changes:
            break
    return points


class Beginning(NamedTuple):
    """A scene, its damping ratio, and the state (6,) in SI units about which motions start."""

    scene: Scene
    ratio: float
    state: np.ndarray


def exponents(motions: Mapping[str, Beginning]) -> dict[str, np.ndarray]:
    """Growth (stretches, starts) of deviations from motions of one model and formulation, by
    name."""
    models, starts = [], []
    random = np.random.default_rng(1).normal(size=(MEMBERS, 6))
    random[0] = 0.0
    for scene, ratio, state in motions.values():
        model = damped_model(damped(scene, ratio))
        size = natural_units(model, state).to_si(np.ones(6))
        starts += list(state + APART * random * size)
        models += [model] * MEMBERS
    stretch = STRETCH * window({name: one.scene for name, one in motions.items()})
    logs = neighbours(models, np.array(starts), stretch, LASTING // STRETCH)
    return dict(zip(motions, np.split(logs, len(motions), axis=1), strict=True))


def own_error(logs: np.ndarray, stretch: float) -> np.ndarray:
    """Half widths (starts,) in 1/s of the intervals of the rates of `growth`, each from its own
    late stretches: the scatter of the rates between the means of their blocks, by Student's
    distribution; infinite where stretches are too few."""
    grown = np.cumsum(logs, axis=0)[int(SETTLING * len(logs)) :]
    size = len(grown) // BLOCKS
    if not size:
        return np.full(logs.shape[1], np.inf)
    means = grown[-size * BLOCKS :].reshape(BLOCKS, size, -1).mean(axis=1)
    rates = np.diff(means, axis=0) / (size * stretch)
    # of a random walk the variance between means of blocks is 2/3 of that of its steps, and that
    # of the slope of a line 6/5 of that of its ends
    walk = np.sqrt(6.0 / 5.0 / (2.0 / 3.0))
    return np.asarray(walk * STUDENT * rates.std(axis=0, ddof=1) / np.sqrt(BLOCKS - 1))


def exponent(logs: np.ndarray, unit: float, ratio: float) -> Exponent | Missing:
    """Exponents from the growth (stretches, starts) of `neighbours`; unit: of the windows (s)."""
    count = int(np.isfinite(logs).all(axis=1).sum())
    if count * STRETCH < EARLY:
        return Missing("the model ends")
    rates, least = growth(logs[:count], STRETCH * unit)
    errors = own_error(logs[:count], STRETCH * unit)
    return Exponent(
        ratio=ratio,
        rates=tuple((rates / 1e3).tolist()),
        half_widths=tuple((errors / 1e3).tolist()),
        least=POWER * least / 1e3,
        windows=count * STRETCH,
        ends=count < len(logs),
    )
