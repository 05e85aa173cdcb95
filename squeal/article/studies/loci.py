"""Eigenvalues over friction, the friction loop and mode shapes of scenes."""

from collections.abc import Sequence
from pathlib import Path as File
from typing import Any

import numpy as np

from squeal import linear
from squeal.analysis.eigenvalues import analyse, branch_system, held_system
from squeal.analysis.modes import shapes_of_pad, values_of_mu
from squeal.analysis.thresholds import critical_friction
from squeal.article.results import loci as results
from squeal.article.results.records import Missing
from squeal.equilibrium import Equilibrium, sliding_equilibrium
from squeal.errors import ComputationError
from squeal.io.scene import Scene, read_scene

MU_MAX = 1.0
MARGIN_MAX = 2.0  # the loop's critical friction may lie beyond the sweep
SWEEP = 101


def nested(values: np.ndarray) -> Any:
    """An array (n,) or (n, m) as tuples of floats, in tuples."""
    return tuple(map(nested, values)) if values.ndim > 1 else tuple(values.tolist())


def branch(scene: Scene) -> results.Branch | Missing:
    """Tracked eigenvalues along the equilibrium branch, or why there is no branch."""
    try:
        system, path = branch_system(scene, MU_MAX)
        critical = critical_friction(scene, MU_MAX)
    except ComputationError as error:
        return Missing(str(error))
    assert path is not None
    marked = [scene.pad.mu, *(point.mu for point in critical.points)]
    tracked = linear.track(system, values_of_mu(path, 0.0, path.mu_end, marked, SWEEP))
    changes = [
        results.ContactChange(mu, scene.pad_model.state_name(path.at(mu)[1]))
        for mu in path.breakpoints
        if mu <= path.mu_end
    ]
    points = tuple(map(results.Threshold.of, critical.points))
    about = (tuple(changes), path.fold, path.end, critical.at_zero, points)
    mu, real, imag = map(nested, (tracked.mus, tracked.values.real.T, tracked.values.imag.T))
    return results.Branch(mu, real, imag, *about)


def loop(scene: Scene, at: Equilibrium) -> results.SingleLoop | results.Loop:
    """The pad as a control loop about one equilibrium, if friction closes a single loop.

    Thresholds of the eigenvalues and of the loop are both over 0 < mu <= MARGIN_MAX.
    """
    system = held_system(scene, at)
    answer = linear.friction_loop(system, MU_MAX)
    held = _thresholds([one for one in linear.crossings(system, MARGIN_MAX) if one.mu > 0.0])
    if answer.loop is None:
        return results.Loop(False, answer.reason, held)
    own = _thresholds(answer.loop.thresholds(MARGIN_MAX))
    start = answer.loop.verdict_at_start(MARGIN_MAX)
    grows = start in ("flutter", "divergence")
    margin = None if grows else answer.loop.critical_friction(MARGIN_MAX)
    apart = None
    if [(one.kind, one.direction) for one in own] == [(one.kind, one.direction) for one in held]:
        pairs = zip(own, held, strict=True)
        apart = max((abs(a.mu - b.mu) for a, b in pairs), default=0.0)
    gains, poles, distance = _root_locus(answer.loop, system)
    first, grown = None if margin is None else margin.mu, start if grows else None
    locus = (*map(nested, (gains, poles.real, poles.imag)), distance)
    return results.SingleLoop(True, answer.reason, held, own, first, grown, apart, *locus)


def _thresholds(
    found: Sequence[linear.Crossing],
) -> tuple[results.HeldThreshold, ...]:
    return tuple(map(results.HeldThreshold.of, found))


def tilt_held(scene: Scene, at: Equilibrium) -> tuple[results.HeldThreshold, ...]:
    """Thresholds over 0 < mu <= MARGIN_MAX of a pad that may only translate."""
    free = held_system(scene, at)

    def system(mu: float) -> linear.Matrices:
        M, C, K = (np.asarray(matrix)[:2, :2] for matrix in free(mu))
        return M, C, K

    return _thresholds([one for one in linear.crossings(system, MARGIN_MAX) if one.mu > 0.0])


def _root_locus(
    found: linear.FrictionLoop, system: linear.System
) -> tuple[np.ndarray, np.ndarray, float]:
    """Gains, poles (gains, 6), and their greatest distance from the eigenvalues, relative."""
    gains = np.linspace(0.0, MU_MAX, SWEEP)
    poles = np.asarray(found.root_locus(gains).loci)
    exact = np.array([linear.complex_eigenvalues(*system(mu)).values for mu in gains])
    distance = np.abs(poles[:, :, None] - exact[:, None, :])
    apart = np.maximum(distance.min(axis=1).max(axis=1), distance.min(axis=2).max(axis=1))
    return gains, poles, float((apart / np.abs(exact).max(axis=1)).max())


def modes(scene: Scene, at: Equilibrium) -> results.Modes:
    """Pose, eigenvalues and mode shapes at the scene's equilibrium."""
    found = analyse(scene)
    pad, lever = scene.pad, np.array([1.0, 1.0, scene.pad.w])
    shapes = []
    for one in shapes_of_pad(found, pad.w):
        shape = lever * one.shape
        shapes.append(results.ModeShape.of(one, real=nested(shape.real), imag=nested(shape.imag)))
    return results.Modes.of(
        at,
        found,
        verdict=found.judgement.verdict,
        q=tuple(found.q),
        pose=(pad.x0 + found.q[0], pad.y0 + found.q[1], pad.theta0 + found.q[2]),
        real=nested(found.spectrum.values.real),
        imag=nested(found.spectrum.values.imag),
        modes=tuple(shapes),
    )


def examined(file: File) -> results.SceneLoci:
    """All of one scene."""
    scene = read_scene(file)
    at, how = sliding_equilibrium(scene.pad_model)
    held: Any = dict.fromkeys(("loop", "tilt_held", "equilibrium"), Missing(how))
    if at is not None:
        held = {"loop": loop(scene, at), "tilt_held": tilt_held(scene, at)}
        held["equilibrium"] = modes(scene, at)
    return results.SceneLoci.of(scene, scene.pad, name=file.stem, branch=branch(scene), **held)


def study(files: Sequence[File]) -> results.Loci:
    """Examine the scenes given."""
    return results.Loci(tuple(examined(file) for file in files), MU_MAX, MARGIN_MAX)
