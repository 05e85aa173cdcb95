"""Eigenvalues over friction, the friction loop and mode shapes of scenes."""

from collections.abc import Sequence
from pathlib import Path as File
from typing import Any

import numpy as np

from squeal.analysis.critical import branch_system, critical_friction
from squeal.analysis.eigenvalues import analyse, held_system
from squeal.analysis.modes import shapes_of_pad, values_of_mu
from squeal.article.results.loci import (
    Branch,
    ContactChange,
    HeldThreshold,
    Loci,
    Loop,
    Modes,
    ModeShape,
    SceneLoci,
    SingleLoop,
    Threshold,
)
from squeal.equilibrium import Equilibrium, sliding_equilibrium
from squeal.errors import ComputationError
from squeal.files.records import Missing
from squeal.scene import Scene, read_scene
from squeal.stability import (
    Crossing,
    FrictionLoop,
    LoopThreshold,
    Matrices,
    System,
    crossings,
    friction_loop,
    track,
)
from squeal.stability import sweep as eigenvalues

MU_MAX = 1.0
MARGIN_MAX = 2.0  # the loop's critical friction may lie beyond the sweep
SWEEP = 101


def nested(values: np.ndarray) -> Any:
    """An array (n,) or (n, m) as tuples of floats, in tuples."""
    return tuple(map(nested, values)) if values.ndim > 1 else tuple(values.tolist())


def branch(scene: Scene) -> Branch | Missing:
    """Tracked eigenvalues along the equilibrium branch, or why there is no branch."""
    try:
        system, path = branch_system(scene, MU_MAX)
        critical = critical_friction(scene, MU_MAX)
    except ComputationError as error:
        return Missing(str(error))
    assert path is not None
    marked = [scene.pad.mu, *(point.mu for point in critical.points)]
    tracked = track(system, values_of_mu(path, 0.0, path.mu_end, marked, SWEEP))
    changes = [
        ContactChange(mu, scene.pad_model.state_name(path.at(mu)[1]))
        for mu in path.breakpoints
        if mu <= path.mu_end
    ]
    return Branch(
        mu=nested(tracked.mus),
        real=nested(tracked.values.real.T),
        imag=nested(tracked.values.imag.T),
        contact_changes=tuple(changes),
        fold=path.fold,
        end=path.end,
        verdict_at_zero=critical.at_zero,
        thresholds=tuple(
            Threshold(p.mu, p.kind, p.frequency_hz, p.interval, p.converged)
            for p in critical.points
        ),
    )


def loop(scene: Scene, at: Equilibrium) -> SingleLoop | Loop:
    """The pad as a control loop about one equilibrium, if friction closes a single loop.

    Thresholds of the eigenvalues and of the loop are both over 0 < mu <= MARGIN_MAX.
    """
    system = held_system(scene, at)
    answer = friction_loop(system, MU_MAX)
    held = _thresholds([one for one in crossings(system, MARGIN_MAX) if one.mu > 0.0])
    if answer.loop is None:
        return Loop(False, answer.reason, held)
    own = _thresholds(answer.loop.thresholds(MARGIN_MAX))
    start = answer.loop.verdict_at_start(MARGIN_MAX)
    grows = start in ("flutter", "divergence")
    margin = None if grows else answer.loop.critical_friction(MARGIN_MAX)
    apart = None
    if [(one.kind, one.direction) for one in own] == [(one.kind, one.direction) for one in held]:
        pairs = zip(own, held, strict=True)
        apart = max((abs(a.mu - b.mu) for a, b in pairs), default=0.0)
    gains, poles, distance = _root_locus(answer.loop, system)
    return SingleLoop(
        rank_one=True,
        reason=answer.reason,
        thresholds=held,
        loop_thresholds=own,
        critical_friction=None if margin is None else margin.mu,
        grows_from_zero=start if grows else None,
        apart=apart,
        gains=nested(gains),
        real=nested(poles.real),
        imag=nested(poles.imag),
        locus_apart=distance,
    )


def _thresholds(found: Sequence[Crossing | LoopThreshold]) -> tuple[HeldThreshold, ...]:
    return tuple(HeldThreshold(one.mu, one.kind, one.direction) for one in found)


def tilt_held(scene: Scene, at: Equilibrium) -> tuple[HeldThreshold, ...]:
    """Thresholds over 0 < mu <= MARGIN_MAX of a pad that may only translate."""
    free = held_system(scene, at)

    def system(mu: float) -> Matrices:
        M, C, K = (np.asarray(matrix)[:2, :2] for matrix in free(mu))
        return M, C, K

    return _thresholds([one for one in crossings(system, MARGIN_MAX) if one.mu > 0.0])


def _root_locus(found: FrictionLoop, system: System) -> tuple[np.ndarray, np.ndarray, float]:
    """Gains, poles (gains, 6), and their greatest distance from the eigenvalues, relative."""
    gains = np.linspace(0.0, MU_MAX, SWEEP)
    poles = np.asarray(found.root_locus(gains).loci)
    exact = eigenvalues(system, gains)
    distance = np.abs(poles[:, :, None] - exact[:, None, :])
    apart = np.maximum(distance.min(axis=1).max(axis=1), distance.min(axis=2).max(axis=1))
    return gains, poles, float((apart / np.abs(exact).max(axis=1)).max())


def modes(scene: Scene, at: Equilibrium) -> Modes:
    """Pose, eigenvalues and mode shapes at the scene's equilibrium."""
    found = analyse(scene)
    pad, lever = scene.pad, np.array([1.0, 1.0, scene.pad.w])
    shapes = [
        ModeShape(
            one.frequency_hz,
            one.growth_rate,
            nested((lever * one.shape).real),
            nested((lever * one.shape).imag),
        )
        for one in shapes_of_pad(found, pad.w)
    ]
    return Modes(
        on_branch=at.on_branch,
        how=found.how,
        contact=found.contact,
        verdict=found.judgement.verdict,
        q=tuple(found.q),
        pose=(pad.x0 + found.q[0], pad.y0 + found.q[1], pad.theta0 + found.q[2]),
        real=nested(found.spectrum.values.real),
        imag=nested(found.spectrum.values.imag),
        modes=tuple(shapes),
    )


def examined(file: File) -> SceneLoci:
    """All of one scene."""
    scene = read_scene(file)
    at, how = sliding_equilibrium(scene.pad_model)
    return SceneLoci(
        name=file.stem,
        model=scene.model,
        mu=scene.pad.mu,
        w=scene.pad.w,
        h=scene.pad.h,
        branch=branch(scene),
        loop=Missing(how) if at is None else loop(scene, at),
        tilt_held=Missing(how) if at is None else tilt_held(scene, at),
        equilibrium=Missing(how) if at is None else modes(scene, at),
    )


def study(files: Sequence[File]) -> Loci:
    """Examine the scenes given."""
    return Loci(tuple(examined(file) for file in files), MU_MAX, MARGIN_MAX)
