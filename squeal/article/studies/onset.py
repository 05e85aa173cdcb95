"""Onset of hammering and what it settles to, with modal damping."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.critical import critical_friction
from squeal.article.cases import HISTORY_FIGURES
from squeal.article.results.onset import (
    CyclePoint,
    Cycles,
    Exponent,
    Lasting,
    Late,
    Onset,
    Section,
    Sign,
    Sweep,
    Way,
)
from squeal.article.scenes import read_scenes
from squeal.article.studies.energy import under_both_laws
from squeal.article.studies.starts import lever
from squeal.equilibrium import sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.files.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version
from squeal.files.records import Missing
from squeal.model.equations import PadModel
from squeal.model.states import State
from squeal.model.units import natural_units
from squeal.scene import Scene
from squeal.scene.schema import Damping
from squeal.simulation.batch.many import DONE, simulate_many, stack
from squeal.simulation.batch.neighbours import (
    SETTLING,
    damping_of,
    directions,
    growth,
    neighbours,
)
from squeal.simulation.cycles import Cycle, Shooting
from squeal.simulation.legs import Leg
from squeal.simulation.observers import Events, Extrema, Observer
from squeal.simulation.variations import variations

RATIOS = (0.001, 0.005, 0.01, 0.02)
RATIO = 0.005
MU = tuple(np.linspace(0.1, 1.0, 19).tolist())
LATE, SEEN = 40, 2  # windows until a motion is looked at, and for how long
STEP = 5  # windows of a step of a sweep before it is looked at
KICK = 0.05  # of the static compression
TOLERANCE = 1e-10
LASTING = 1000  # windows over which neighbours of undamped motions are compared
EARLY = 10  # windows over which they are compared with the variational equations
MEMBERS = 4  # motions from which an exponent is taken
MOST = 3  # motions that are swept
NEAREST = 4  # steps at the end of a sweep at which it is looked at for longer
BRANCH_STEP = 0.1  # of the branch of cycles, in natural units, periods and mu
NEAR = 1e-6  # of their size: returns that near are the same


def damped(scene: Scene, ratio: float) -> Scene:
    """The scene with all modal damping ratios alike."""
    return dataclasses.replace(scene, damping=Damping(ratios=(ratio,) * 3) if ratio else None)


def _many(models: Sequence[PadModel], states: np.ndarray, stop: float, measured: bool) -> Any:
    one = models[0]
    return simulate_many(
        one.name,
        stack([model.pad for model in models]),
        states,
        stop,
        TOLERANCE,
        one.formulation,
        measured=measured,
        damping=damping_of(models),
    )


def settled(
    models: Sequence[PadModel], states: np.ndarray, before: float, seen: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Motions after a time `before` (s), looked at for a time `seen`.

    Returns last states (n, 6), shares of the time in which contact is lost (0 where it does not
    change) and peaks over F_n (n,), all NaN where the model ends.
    """
    first = _many(models, states, before, False)
    good = first["outcome"] == DONE
    end, lost, peak = first["final"], np.full(len(good), np.nan), np.full(len(good), np.nan)
    if good.any():
        some = [model for model, here in zip(models, good, strict=True) if here]
        after = _many(some, end[good], seen, True)
        whole = after["outcome"] == DONE
        still = np.where(after["changes"] > 0, 1.0 - after["shares"][:, 0], 0.0)
        still[np.isnan(after["first"][:, 1])] = 1.0
        end[good] = np.where(whole[:, None], after["final"], np.nan)
        lost[good] = np.where(whole, still, np.nan)
        # a pad that is off the surface all the time has no peak
        peak[good] = np.where(whole, np.nan_to_num(after["first"][:, 1]), np.nan)
    return end, lost, peak


def late(scene: Scene, models: Sequence[PadModel]) -> tuple[tuple[Late | Missing, ...], np.ndarray]:
    """The scene's start after a long time, for each ratio, and the states (ratios, 6) then."""
    assert scene.stop is not None
    starts = np.tile(scene.initial, (len(RATIOS), 1))
    end, lost, peak = settled(models, starts, LATE * scene.stop, SEEN * scene.stop)
    found = [
        Missing("the model ends") if np.isnan(at) else Late(ratio, float(at), float(high))
        for ratio, at, high in zip(RATIOS, lost, peak, strict=True)
    ]
    return tuple(found), end


def _way(mu: Sequence[float], lost: np.ndarray, peak: np.ndarray) -> Way:
    some = ([None if np.isnan(v) else float(v) for v in values] for values in (lost, peak))
    return Way(tuple(mu), *map(tuple, some))


def sweeps(
    scene: Scene, models: Sequence[PadModel], last: np.ndarray
) -> tuple[tuple[Sweep, ...], Lasting]:
    """Friction raised from the equilibrium and lowered from the states `last`, for each ratio.

    And where changes of contact last, at the ratio of the study. Nothing is swept without an
    equilibrium at the least friction.
    """
    assert scene.stop is not None
    n = len(RATIOS)
    rest, _ = sliding_equilibrium(scene.pad_model.replace(mu=MU[0]))
    if rest is None:
        return (), Lasting(None, None)
    down = np.where(np.isnan(last), scene.initial, last)  # the own start, where its model ends
    begin = np.concatenate([np.tile(np.append(rest.q, np.zeros(3)), (n, 1)), down])
    states = begin.copy()
    falling = [mu for mu in reversed(MU) if mu <= scene.pad.mu]
    seen = np.full((2, len(MU), 2 * n), np.nan)
    ends = np.full((len(MU), 2 * n, 6), np.nan)
    for i, up in enumerate(MU):
        states[:n, 1] += KICK * lever(scene)
        both = (up, falling[i]) if i < len(falling) else (up,)
        now = slice(0, n * len(both))
        pads = [one.replace(mu=mu) for mu in both for one in models]
        end, *found = settled(pads, states[now], STEP * scene.stop, SEEN * scene.stop)
        seen[:, i, now], ends[i, now] = found, end
        # where the model ends, each way begins anew
        states[now] = np.where(np.isnan(end), begin[now], end)
    lost, peak = seen[:, : len(MU)]
    at = RATIOS.index(RATIO)
    last_of = [
        lasting(scene, models[at], values, lost[: len(values), column], ends[:, column])
        for values, column in ((MU, at), (falling, n + at))
    ]
    found_sweeps = tuple(
        Sweep(
            ratio,
            _way(MU, lost[:, i], peak[:, i]),
            _way(falling, lost[: len(falling), n + i], peak[: len(falling), n + i]),
        )
        for i, ratio in enumerate(RATIOS)
    )
    return found_sweeps, Lasting(*last_of)


def lasting(
    scene: Scene, model: PadModel, mu: Sequence[float], lost: np.ndarray, ends: np.ndarray
) -> float | None:
    """The least friction of a sweep, of the four least at which contact changes, at which it goes
    on to do so; None at none. mu, lost (n,), ends (n, 6): the steps of the sweep."""
    assert scene.stop is not None
    changing = sorted(np.flatnonzero(lost > 0.0).tolist(), key=lambda i: mu[i])[:NEAREST]
    if not changing:
        return None
    models = [model.replace(mu=mu[i]) for i in changing]
    _, still, _ = settled(models, ends[changing], LATE * scene.stop, SEEN * scene.stop)
    return next((mu[i] for i, at in zip(changing, still, strict=True) if at > 0.0), None)


def threshold(scene: Scene) -> float | None:
    """The friction at which the equilibrium begins to flutter with damping, None without."""
    try:
        points = critical_friction(damped(scene, RATIO), MU[-1]).points
    except ComputationError:
        return None
    return next((point.mu for point in points if point.kind == "flutter"), None)


class Returns(Observer):
    """States (6,) and times at which the leading edge separates."""

    def __init__(self) -> None:
        self.states: list[np.ndarray] = []
        self.times: list[float] = []
        self._end = np.zeros(6)

    def leg(self, leg: Leg) -> None:
        self._end = leg.end

    def change(self, t: float, source: State, target: State) -> None:
        if source.leading and not target.leading:
            self.states.append(np.array(self._end))
            self.times.append(t)


def shooting(scene: Scene, ratio: float) -> Shooting:
    """The scene's damped pad in units of its own start."""
    units = natural_units(scene.pad_model, scene.initial)
    return Shooting(units.scaled(damped_model(damped(scene, ratio))), units)


def returns(scene: Scene, state: np.ndarray, windows: float) -> Returns:
    """Where a motion from a state (SI) passes the section of its leading edge, while it lasts."""
    assert scene.stop is not None
    pad = shooting(scene, RATIO)
    watch = Returns()
    start, stop = pad.units.to_scaled(state), windows * scene.stop / pad.units.time
    with contextlib.suppress(ComputationError):
        pad.motion(start, stop, scene.pad.mu, [watch])
    return watch


def section(scene: Scene, state: np.ndarray) -> Section:
    """The section of the motion from a state (SI)."""
    units = shooting(scene, RATIO).units
    places = units.to_si(np.array(returns(scene, state, LATE / 2).states).reshape(-1, 6))
    height = places[:, 1] / lever(scene)
    return Section(tuple(height.round(5).tolist()), tuple(places[:, 4].round(6).tolist()))


def _point(pad: Shooting, cycle: Cycle) -> CyclePoint:
    watch, changes = Extrema(pad.model.replace(mu=cycle.mu)), Events()
    pad.motion(cycle.state, cycle.period, cycle.mu, [watch, changes])
    peak = watch.result()["extrema"][pad.model.law.plotted[0].name]
    return CyclePoint(
        float(cycle.mu),
        float(1e3 * cycle.period * pad.units.time),
        len(changes.result()["events"]),
        peak[1] if peak else 0.0,
        float(np.abs(cycle.multipliers[0])),
    )


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
    watch, pad = returns(scene, state, 2), shooting(scene, RATIO)
    states = np.array(watch.states)
    size = np.abs(states).max() if len(states) else 0.0
    for turn in range(1, min(9, len(states))):
        if np.abs(states[turn] - states[0]).max() < NEAR * size:
            break
    else:
        return Missing("the motion does not return to itself")
    guess = np.concatenate([states[0], [watch.times[turn] - watch.times[0], scene.pad.mu]])
    try:
        own, _ = pad.solve(guess)
        first, decays = _point(pad, own), decay(pad, own)
        branch = (*reversed(_followed(pad, own, 1.0, 10)), first, *_followed(pad, own, -1.0, 40))
    except ComputationError as error:
        return Missing(str(error))
    return Cycles(name, RATIO, first, decays, abs(own.trivial - 1.0), branch)


def _followed(pad: Shooting, own: Cycle, towards: float, most: int) -> list[CyclePoint]:
    """Cycles along the branch, to where contact does not change any more."""
    points: list[CyclePoint] = []
    for one in pad.branch(own, towards, BRANCH_STEP, most):
        if one.mu > MU[-1]:
            break
        points.append(_point(pad, one))
        if not points[-1].changes:
            break
    return points


def exponents(scenes: dict[str, Scene], states: dict[str, np.ndarray], ratio: float) -> Any:
    """Exponents of scenes of one model and formulation, by name, from states (SI) on."""
    models, starts = [], []
    stretch = max(scene.stop or 0.0 for scene in scenes.values())
    random = np.random.default_rng(1).normal(size=(MEMBERS if ratio else 1, 6))
    random[0] = 0.0
    for name, scene in scenes.items():
        model = damped_model(damped(scene, ratio))
        size = natural_units(model, states[name]).to_si(np.ones(6))
        # motions of one attractor from several states; without damping each state has its own
        starts += list(states[name] + 1e-2 * random * size)
        models += [model] * len(random)
    logs = neighbours(models, np.array(starts), stretch, LATE if ratio else LASTING)
    parts = np.split(logs, len(scenes), axis=1), directions(len(models))[:: len(random)]
    return {
        name: exponent(scene, columns, away, stretch, ratio)
        for (name, scene), columns, away in zip(scenes.items(), *parts, strict=True)
    }


def exponent(
    scene: Scene, logs: np.ndarray, away: np.ndarray, stretch: float, ratio: float
) -> Exponent | Missing:
    """The exponent of a scene from the growth (count, members) of `neighbours`.

    Undamped motions that diverge are compared with the variational equations over their beginning;
    away (6,): the direction of the first neighbour.
    """
    count = int(np.isfinite(logs).all(axis=1).sum())
    if count < EARLY:
        return Missing("the model ends")
    rate = growth(logs[:count], stretch)
    least = float(np.log(1.0 / SETTLING) / ((1.0 - SETTLING) * count * stretch))
    sign: Sign = "chaotic" if rate.rate - rate.half_width > least else "no growth"
    if count < len(logs):
        sign = "ends"
    elif not rate.settled and rate.rate > least:
        sign = "finite-time"
    found = Exponent(ratio, rate.rate / 1e3, rate.half_width / 1e3, least / 1e3, sign, count)
    if ratio or sign == "no growth":
        return found
    other = variations(scene, EARLY)
    grown = other.logarithm + float(np.log(np.linalg.norm(other.matrix @ away)))
    return dataclasses.replace(found, early=float(logs[:EARLY, 0].sum()), variational=grown)


def study(files: Sequence[Path]) -> Onset:
    """Onset and attractors of the eight scenes of models B1 and B2."""
    scenes = read_scenes(files, HISTORY_FIGURES, "simulate")
    if version("heyoka") == NOT_INSTALLED:
        why = f"{WITHOUT_HEYOKA} nothing else simulates batches of pads."
        return Onset({}, MU[1] - MU[0], {}, {}, {}, {}, {}, Missing(why), RATIO, LATE, EARLY, why)
    own = {name: scene.formulation for name, scene in scenes.items()}
    motions = under_both_laws(scenes)
    models, ends = {}, {}
    for name, scene in motions.items():
        try:
            models[name] = [damped_model(damped(scene, ratio)) for ratio in RATIOS]
            ends[name] = late(scene, models[name])
        except ComputationError as error:
            reason = Missing(str(error))
            ends[name] = (reason,) * len(RATIOS), np.full((len(RATIOS), 6), np.nan)
    at = RATIOS.index(RATIO)
    lasting = {
        name: one.lost
        for name, (rows, _) in ends.items()
        if isinstance(one := rows[at], Late) and motions[name].formulation == own[name[:4]]
    }
    most = sorted(lasting, key=lambda name: -lasting[name])[:MOST]
    chosen = [name for name in motions if name in most and lasting[name] > 0.0]
    swept = {name: sweeps(motions[name], models[name], ends[name][1]) for name in chosen}
    chosen = [name for name in chosen if swept[name][0]]
    last = {name: ends[name][1][at] for name in chosen}
    found: dict[str, Exponent | Missing] = {}
    for scene in {(one.model, one.formulation): one for one in scenes.values()}.values():
        alike = (scene.model, scene.formulation)
        some = {n: m for n in chosen if ((m := motions[n]).model, m.formulation) == alike}
        found |= exponents(some, last, RATIO) if some else {}
        free = {n: m for n, m in scenes.items() if (m.model, m.formulation) == alike}
        starts = {n: np.array(m.initial) for n, m in free.items()}
        undamped = exponents(free, starts, 0.0)
        found |= {f"{name}, undamped": one for name, one in undamped.items()}
    tried = (cycles(name, motions[name], last[name]) for name in chosen)
    return Onset(
        late={name: rows for name, (rows, _) in ends.items()},
        step=MU[1] - MU[0],
        sweeps={name: swept[name][0] for name in chosen},
        lasting={name: swept[name][1] for name in chosen},
        thresholds={name: threshold(motions[name]) for name in chosen},
        sections={name: section(motions[name], last[name]) for name in chosen},
        exponents=found,
        cycles=next(
            (one for one in tried if isinstance(one, Cycles)),
            Missing("no motion that lasts is periodic"),
        ),
        ratio=RATIO,
        windows=LATE,
        early=EARLY,
    )
