"""Friction raised and lowered beside damped motions."""

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from squeal.article.results.onset import Settled, Step, Sweep
from squeal.article.studies._damped import Motion, damped, settled, window
from squeal.article.studies._late import LATE, SEEN
from squeal.article.studies.starts import lever
from squeal.equilibrium import sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.io.scene import Scene
from squeal.model.equations import PadModel

MU = tuple(np.linspace(0.1, 0.7, 13).round(6).tolist())
STEP = 20  # windows of a step before it is looked at
KICK = 0.05  # of the static compression

Key = tuple[str, float]
"""A scene at a damping ratio."""


class Begun(NamedTuple):
    """A motion that goes on: the state (6,) it is in at a friction, and what it does."""

    mu: float
    state: np.ndarray
    does: Settled


class Way(NamedTuple):
    """A motion, and the frictions at which it goes on from there, one after the other."""

    model: PadModel
    begun: Begun
    mus: Sequence[float]


def sweeps(
    scenes: Mapping[str, Scene],
    ratios: Mapping[str, Sequence[float]],
    lively: Mapping[Key, Begun],
) -> dict[str, tuple[Sweep, ...]]:
    """For scenes of one model and formulation, and some ratios each; lively: motions beside stable
    equilibria that are followed both ways."""
    stop = window(scenes)
    pads = {
        (name, ratio): damped_model(damped(scenes[name], ratio))
        for name in scenes
        for ratio in ratios.get(name, ())
    }
    up = _raised(scenes, pads, stop)
    ways: dict[tuple[Key, str], Way] = {}
    for key, model in pads.items():
        for top in _tops(up[key]):
            one = up[key][top]
            word = "down" if one.does.slides else "beyond"
            ways[key, word] = Way(model, one, [mu for mu in reversed(MU) if mu < one.mu])
        if key in lively:
            one = lively[key]
            ways[key, "risen"] = Way(model, one, [mu for mu in MU if mu > one.mu])
            ways[key, "fallen"] = Way(model, one, [mu for mu in reversed(MU) if mu < one.mu])
    steps = followed(ways, stop)
    made: dict[str, tuple[Sweep, ...]] = {}
    for key in pads:
        fallen, risen = (steps.get((key, word), ()) for word in ("fallen", "risen"))
        sweep = Sweep(
            ratio=key[1],
            up=tuple(Step.of(one.does, mu=one.mu) for one in up[key]),
            down=steps.get((key, "down"), ()),
            beyond=steps.get((key, "beyond"), ()),
            lively=(*reversed(fallen), *risen[1:]),
        )
        made[key[0]] = (*made.get(key[0], ()), sweep)
    return made


def _raised(
    scenes: Mapping[str, Scene], pads: Mapping[Key, PadModel], stop: float
) -> dict[Key, list[Begun]]:
    """What motions come to from the equilibrium of each friction, kicked."""
    rest = {
        (name, mu): sliding_equilibrium(scenes[name].pad_model.replace(mu=mu))[0]
        for name in dict.fromkeys(name for name, _ in pads)
        for mu in MU
    }
    begun: dict[tuple[Key, float], Motion] = {}
    for key, model in pads.items():
        for mu in MU:
            if (found := rest[key[0], mu]) is not None:
                state = np.append(found.q, np.zeros(3))
                state[1] += KICK * lever(scenes[key[0]])
                begun[key, mu] = Motion(model.replace(mu=mu), state)
    came = settled(list(begun.values()), LATE * stop, SEEN * stop)
    up: dict[Key, list[Begun]] = {key: [] for key in pads}
    for (key, mu), end, one in zip(begun, *came, strict=True):
        if one:
            up[key].append(Begun(mu, end, one))
    return up


def _tops(up: Sequence[Begun]) -> list[int]:
    """Places in `up` from which a motion is lowered: of the greatest friction up to which it goes
    on with a pad slower than the surface, and of the greatest up to which it goes on at all, if it
    is faster there.

    Only an unbroken run of steps counts: beyond a gap what goes on is a matter of chance.
    """
    run: list[int] = []
    for i, one in enumerate(up):
        if one.does.goes_on and (not run or MU.index(one.mu) == MU.index(up[run[-1]].mu) + 1):
            run.append(i)
    slow = list(itertools.takewhile(lambda i: up[i].does.slides, run))
    return [places[-1] for places in (slow, run[len(slow) :]) if places]


def followed(
    ways: Mapping[tuple[Key, str], Way], stop: float
) -> dict[tuple[Key, str], tuple[Step, ...]]:
    """The steps of ways, the first one where they begin, until contact does not change any more or
    the model ends."""
    made = {lane: [Step.of(way.begun.does, mu=way.begun.mu)] for lane, way in ways.items()}
    states = {lane: way.begun.state for lane, way in ways.items()}
    for i in range(max((len(way.mus) for way in ways.values()), default=0)):
        here = {lane: ways[lane].mus[i] for lane in states if len(ways[lane].mus) > i}
        if not here:
            break
        motions = [
            Motion(ways[lane].model.replace(mu=mu), states[lane]) for lane, mu in here.items()
        ]
        after = settled(motions, STEP * stop, SEEN * stop)
        for (lane, mu), end, one in zip(here.items(), *after, strict=True):
            states[lane] = end
            if one:
                made[lane].append(Step.of(one, mu=mu))
            if one is None or not one.goes_on:
                del states[lane]
    return {lane: tuple(way) for lane, way in made.items()}
