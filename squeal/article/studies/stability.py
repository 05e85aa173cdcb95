"""Eigenvalues along the branch of equilibria, and mode shapes at the scenes' friction."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.records import Missing, Record, Result
from squeal.article.studies._modes import sweep_modes
from squeal.article.studies._scenes import read_scenes
from squeal.equilibrium import Equilibrium, sliding_equilibrium
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.thresholds import critical_friction
from squeal.results.eigenvalues import mode_shapes

MU_MAX = 1.0

Row = tuple[float, ...]


class ContactChange(Record):
    """A change of contact along the branch: where, and into which state."""

    mu: float
    into: str


class Threshold(Record):
    """A change of verdict on the way up in mu, see `squeal.linear.CriticalPoint`."""

    mu: float
    kind: str
    frequency_hz: float


class Branch(Record):
    """Tracked eigenvalues along the equilibrium branch, and what happens on it.

    real, imag (1/s, rad/s): six rows over `mu`; rows 2k and 2k + 1 are a mode and its conjugate,
    by rising frequency at mu = 0. end: why the branch ends; fold: its mu, None if there is none.
    """

    mu: Row
    real: tuple[Row, ...]
    imag: tuple[Row, ...]
    contact_changes: tuple[ContactChange, ...]
    fold: float | None
    end: str
    thresholds: tuple[Threshold, ...]


class ModeShape(Record):
    """Shape (x, y, w theta), its largest part 1, of one pair of eigenvalues."""

    frequency_hz: float
    growth_rate: float
    real: Row
    imag: Row


class Modes(Record):
    """The scene's equilibrium: verdict, pose (m, m, rad) over the surface's origin, mode shapes.

    on_branch: whether it lies on the branch from mu = 0.
    """

    on_branch: bool
    contact: str
    verdict: str
    pose: Row
    modes: tuple[ModeShape, ...]


class SceneStability(Record):
    """All of one scene; w, h in m. What does not exist without steady sliding has the reason."""

    name: str
    model: str
    mu: float
    w: float
    h: float
    branch: Branch | Missing
    equilibrium: Modes | Missing


class Stability(Result):
    """The scenes; mu_max: where branches end."""

    scenes: tuple[SceneStability, ...]
    mu_max: float = MU_MAX


def _nested(values: np.ndarray) -> Any:
    """An array (n,) or (n, m) as tuples of floats, in tuples."""
    return tuple(map(_nested, values)) if values.ndim > 1 else tuple(values.tolist())


def branch(scene: Scene) -> Branch | Missing:
    """Tracked eigenvalues along the equilibrium branch, or why there is no branch."""
    try:
        swept = sweep_modes(scene, 0.0, MU_MAX)
        critical = critical_friction(scene, MU_MAX)
    except ComputationError as error:
        return Missing(str(error))
    folds = [point.mu for point in critical.points if point.kind == "fold"]
    return Branch(
        mu=_nested(swept.mus),
        real=_nested(swept.values.real.T),
        imag=_nested(swept.values.imag.T),
        contact_changes=tuple(ContactChange(*change) for change in swept.contacts),
        fold=folds[0] if folds else None,
        end=critical.end,
        thresholds=tuple(map(Threshold.of, critical.points)),
    )


def modes(scene: Scene, equilibrium: Equilibrium) -> Modes:
    """Pose and mode shapes at the scene's equilibrium."""
    analysis = analyse(scene)
    pad = scene.pad
    # makes lengths (x, y, w theta) of (x, y, theta), whose sizes can be compared
    lever = np.array([1.0, 1.0, pad.w])
    shapes = []
    for mode in mode_shapes(analysis.spectrum, lever):
        shape = lever * mode.shape
        shapes.append(
            ModeShape(
                frequency_hz=mode.frequency_hz,
                growth_rate=mode.growth_rate,
                real=_nested(shape.real),
                imag=_nested(shape.imag),
            )
        )
    x, y, theta = analysis.q
    return Modes(
        on_branch=equilibrium.on_branch,
        contact=analysis.contact,
        verdict=analysis.judgement.verdict,
        pose=(pad.x0 + x, pad.y0 + y, pad.theta0 + theta),
        modes=tuple(shapes),
    )


def examined(name: str, scene: Scene) -> SceneStability:
    """All of one scene."""
    equilibrium, reason = sliding_equilibrium(scene.pad_model)
    return SceneStability.of(
        scene.pad,
        name=name,
        model=scene.model,
        branch=branch(scene),
        equilibrium=Missing(reason) if equilibrium is None else modes(scene, equilibrium),
    )


def study(files: Sequence[Path]) -> Stability:
    """The eight scenes of models B1 and B2."""
    scenes = read_scenes(files, HISTORY_FIGURES)
    return Stability(tuple(examined(name, scene) for name, scene in scenes.items()))
