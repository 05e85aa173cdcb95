"""Onset of hammering and what it settles to, with modal damping."""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from squeal.analysis.critical import branch_system, critical_friction
from squeal.analysis.eigenvalues import analyse
from squeal.article.cases import HISTORY_FIGURES
from squeal.article.results.onset import Cycles, Late, Onset, Step, Sweep
from squeal.article.scenes import read_scenes
from squeal.article.studies._attractors import CONFIDENCE, cycles, exponent, exponents
from squeal.article.studies._damped import RATIO, Motion, damped, settled, window
from squeal.article.studies.energy import under_both_laws
from squeal.article.studies.starts import lever
from squeal.equilibrium import sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.files.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version
from squeal.files.records import Missing
from squeal.model.equations import PadModel
from squeal.scene import Scene
from squeal.stability import verdict

RATIOS = (0.001, 0.005, 0.01, 0.02)
SWEPT = (0.005, 0.01, 0.02)  # where the own start goes on losing contact; else RATIO
MU = tuple(np.linspace(0.1, 0.7, 13).round(6).tolist())
LATE, SEEN = 40, 2  # windows until a motion is looked at, and for how long
LONGER = 150  # until it is looked at again if contact goes on changing
STEP = 20  # windows of a step down before it is looked at
KICK = 0.05  # of the static compression
_SETTINGS: dict[str, Any] = {"ratio": RATIO, "ratios": RATIOS, "confidence": CONFIDENCE}
_SETTINGS |= {"windows": LATE, "longer": LONGER, "seen": SEEN, "step_windows": STEP}


def _grown(scene: Scene, ratio: float) -> float | None:
    try:
        return analyse(damped(scene, ratio)).spectrum.dominant.value.real / 1e3
    except ComputationError:
        return None


Lates = tuple[Late | Missing, ...]


def late(scenes: Mapping[str, Scene]) -> dict[str, tuple[Lates, list[np.ndarray]]]:
    """The own starts of scenes of one model and formulation after a long time, for each ratio, and
    the states (6,) then."""
    made: dict[str, tuple[Lates, list[np.ndarray]]] = {}
    motions: dict[tuple[str, float], Motion] = {}
    for name, scene in scenes.items():
        try:
            for ratio in RATIOS:
                motions[name, ratio] = Motion(
                    damped_model(damped(scene, ratio)), np.array(scene.initial)
                )
        except ComputationError as error:
            made[name] = (Missing(str(error)),) * len(RATIOS), [np.full(6, np.nan)] * len(RATIOS)
    if not motions:
        return made
    stop = window(scenes)
    ends, found = settled(list(motions.values()), LATE * stop, SEEN * stop)
    going = [i for i, one in enumerate(found) if one and one.goes_on]
    if going:
        models = [one.model for one in motions.values()]
        still = [Motion(models[i], ends[i]) for i in going]
        later = settled(still, (LONGER - LATE - SEEN) * stop, SEEN * stop)
        for i, end, one in zip(going, *later, strict=True):
            ends[i], found[i] = end, one
    at = dict(zip(motions, zip(ends, found, strict=True), strict=True))
    for name in [name for name in scenes if name not in made]:
        rows: list[Late | Missing] = []
        for ratio in RATIOS:
            one = at[name, ratio][1]
            if one is None:
                rows.append(Missing("the model ends"))
            else:
                grows = _grown(scenes[name], ratio) if one.goes_on else None
                rows.append(Late(**vars(one), ratio=ratio, growth=grows))
        made[name] = tuple(rows), [at[name, ratio][0] for ratio in RATIOS]
    return made


class Lane(NamedTuple):
    """A scene at a damping ratio, and the place in `MU` from which it is lowered."""

    name: str
    ratio: float
    top: int


def sweeps(
    scenes: Mapping[str, Scene], ratios: Mapping[str, Sequence[float]]
) -> dict[str, tuple[Sweep, ...]]:
    """Friction raised and lowered, for scenes of one model and formulation and some ratios each."""
    stop = window(scenes)
    pads = {
        (name, ratio): damped_model(damped(scenes[name], ratio))
        for name in scenes
        for ratio in ratios.get(name, ())
    }
    rest = {
        (name, i): sliding_equilibrium(scenes[name].pad_model.replace(mu=mu))[0]
        for name in dict.fromkeys(name for name, _ in pads)
        for i, mu in enumerate(MU)
    }
    begun: dict[Lane, Motion] = {}
    for (name, ratio), model in pads.items():
        for i, mu in enumerate(MU):
            if (found := rest[name, i]) is not None:
                state = np.append(found.q, np.zeros(3))
                state[1] += KICK * lever(scenes[name])
                begun[Lane(name, ratio, i)] = Motion(model.replace(mu=mu), state)
    if not begun:
        return {}
    ends, came = settled(list(begun.values()), LATE * stop, SEEN * stop)
    up = {
        lane: (end, Step(**vars(one), mu=MU[lane.top]))
        for lane, end, one in zip(begun, ends, came, strict=True)
        if one
    }
    tops = {key: _tops({lane.top: up[lane][1] for lane in up if lane[:2] == key}) for key in pads}
    down = lowered(
        pads, {Lane(*key, top): up[Lane(*key, top)] for key in pads for top in tops[key]}, stop
    )
    made: dict[str, tuple[Sweep, ...]] = {name: () for name, _ in pads}
    for key in pads:
        ways = [down[Lane(*key, top)] for top in tops[key]]
        slow, fast = [w for w in ways if w[0].slides], [w for w in ways if not w[0].slides]
        rising = tuple(step for lane, (_, step) in up.items() if lane[:2] == key)
        falling = (slow[0] if slow else (), fast[0] if fast else ())
        made[key[0]] += (Sweep(key[1], rising, *falling),)
    return made


def _tops(up: Mapping[int, Step]) -> list[int]:
    """Places in `MU` from which a motion is lowered: the greatest up to which it goes on with a pad
    slower than the surface, and the greatest up to which it goes on at all, if it is faster there.

    Only an unbroken run of steps counts: beyond a gap what goes on is a matter of chance.
    """
    run: list[int] = []
    for i in sorted(up):
        if up[i].goes_on and (not run or run[-1] == i - 1):
            run.append(i)
    slow = list(itertools.takewhile(lambda i: up[i].slides, run))
    return [places[-1] for places in (slow, run[len(slow) :]) if places]


def lowered(
    pads: Mapping[tuple[str, float], PadModel],
    begun: Mapping[Lane, tuple[np.ndarray, Step]],
    stop: float,
) -> dict[Lane, tuple[Step, ...]]:
    """Friction lowered step by step from states (6,) until contact does not change any more."""
    ways = {lane: [step] for lane, (_, step) in begun.items()}
    states = {lane: state for lane, (state, _) in begun.items()}
    for i in reversed(range(len(MU))):
        here = [lane for lane in begun if lane.top > i and lane in states]
        if not here:
            continue
        motions = [Motion(pads[lane[:2]].replace(mu=MU[i]), states[lane]) for lane in here]
        for lane, end, one in zip(here, *settled(motions, STEP * stop, SEEN * stop), strict=True):
            states[lane] = end
            if one:
                ways[lane].append(Step(**vars(one), mu=MU[i]))
            if one is None or not one.goes_on:
                del states[lane]
    return {lane: tuple(way) for lane, way in ways.items()}


def threshold(scene: Scene) -> float | None:
    """The friction at which the equilibrium begins to flutter with damping, None if it does not at
    any of `MU`."""
    asked = damped(scene, RATIO)
    try:
        system, path = branch_system(asked, MU[-1])
        reached = [mu for mu in MU if path is None or mu <= path.mu_end]
        # to look first saves most searches
        if all(verdict(*system(mu)) == "stable" for mu in reached):
            return None
        points = critical_friction(asked, MU[-1]).points
    except ComputationError:
        return None
    return next((point.mu for point in points if point.kind == "flutter"), None)


def without(why: str) -> Onset:
    """The record of a study that had to be left out."""
    return Onset({}, MU, {}, {}, {}, Missing(why), left_out=why, **_SETTINGS)


def study(files: Sequence[Path]) -> Onset:
    """Onset and attractors of the eight scenes of models B1 and B2."""
    scenes = read_scenes(files, HISTORY_FIGURES, "simulate")
    if version("heyoka") == NOT_INSTALLED:
        why = f"{WITHOUT_HEYOKA} nothing else simulates batches of pads."
        return without(why)
    motions = under_both_laws(scenes)
    ends: dict[str, tuple[Lates, list[np.ndarray]]] = {}
    for some in _alike(motions):
        ends |= late(some)
    ends = {name: ends[name] for name in motions}
    own = {n: m for n, m in motions.items() if m.formulation == scenes[n[:4]].formulation}
    at = RATIOS.index(RATIO)
    lasts = {n for n in own if any(isinstance(o, Late) and o.goes_on for o in ends[n][0])}
    swept: dict[str, tuple[Sweep, ...]] = {}
    logs: dict[str, np.ndarray] = {}
    last = {
        name: ends[name][1][at]
        for name in own
        if isinstance(one := ends[name][0][at], Late) and one.goes_on
    }
    limits = {name: threshold(one) for name, one in own.items()}
    for some in _alike(own):
        ratios = {n: SWEPT if n in lasts else (RATIO,) for n in some if n in lasts or limits[n]}
        swept |= sweeps(some, ratios)
        going = {n: m for n, m in some.items() if n in last}
        logs |= exponents(going, last, RATIO) if going else {}
        starts = {n: np.array(m.initial) for n, m in some.items()}
        free = exponents(some, starts, 0.0)
        logs |= {f"{name[:4]}, undamped": one for name, one in free.items()}
    found = {
        name: exponent(one, window(scenes), RATIO if name in own else 0.0, len(logs))
        for name, one in logs.items()
    }
    tried = (cycles(name, own[name], last[name]) for name in last)
    periodic = next(
        (one for one in tried if isinstance(one, Cycles)),
        Missing("no motion that lasts is periodic"),
    )
    rows = {name: own_rows for name, (own_rows, _) in ends.items()}
    return Onset(rows, MU, swept, limits, found, periodic, **_SETTINGS)


def _alike(scenes: Mapping[str, Scene]) -> list[dict[str, Scene]]:
    groups: dict[Any, dict[str, Scene]] = {}
    for name, scene in scenes.items():
        groups.setdefault((scene.model, scene.formulation), {})[name] = scene
    return list(groups.values())
