"""Works of friction, brake force and contact law along the article's motions.

Those of line contact run under both laws, the printed one and the energy-consistent one.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.findings.work import contact_work
from squeal.article.records import Missing, Record, Result
from squeal.article.studies._scenes import read_scenes
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.contact import LineForce

SHOWN = ("b1-c", "b2-c-mean", "b2-c-integral")  # motions that are drawn
MOST = 800  # points of a curve
ROUNDING = 1e-9  # of the greatest kinetic energy: less than that is no work
LAWS: dict[LineForce, str] = {"mean": "printed law", "integral": "consistent law"}
"""The two laws of line contact and what the report calls them."""


def motion_title(name: str) -> str:
    """Model, case and law of a motion from its name: b2-c-mean becomes B2 (c), printed law."""
    model, case, *law_in_name = name.split("-")  # points have no law in their name
    title = f"{model.upper()} ({case})"
    for law, law_title in LAWS.items():
        if law_in_name == [law]:
            title += f", {law_title}"
    return title


class Episode(Record):
    """An episode of partial contact from start to stop (ms).

    fed: work (J) of the contact law during it, beyond what its potential gives back.
    """

    start: float
    stop: float
    fed: float


class Motion(Record):
    """A motion under one contact law.

    friction, load, law: works at the end, that of the law beyond what its potential gives back;
    kinetic: the greatest kinetic energy; residue: how far the balance of all works is from closing,
    over it; episodes: all of partial contact; curves: t (ms) and kinetic and elastic energy (of
    springs and contact) and works so far, for the motions that are drawn.
    """

    friction: float
    load: float
    law: float
    kinetic: float
    residue: float
    episodes: tuple[Episode, ...]
    curves: dict[str, tuple[float, ...]]

    def working_episodes(self, sign: int) -> list[Episode]:
        """The episodes in which the law does positive (sign 1) or negative (-1) work.

        Work of a size that rounding may have made, by `ROUNDING`, is neither.
        """
        least = ROUNDING * self.kinetic
        return [episode for episode in self.episodes if sign * episode.fed > least]


class Energy(Result):
    """By name of the scene, that of line contact with its law: b1-c, b2-c-mean, b2-c-integral."""

    motions: dict[str, Motion | Missing]

    @property
    def wrong(self) -> str:
        """Energy that comes from nowhere, or from a law that has a potential."""
        for name, motion in self.motions.items():
            if isinstance(motion, Missing):
                continue
            if motion.residue > ROUNDING:
                return f"the energy balance of {name} is open by {motion.residue:.1g}"
            works = motion.working_episodes(1) or motion.working_episodes(-1)
            if works and not name.endswith("mean"):
                return f"the law of {name} has a potential but feeds energy in"
        return ""


def _thinned(curves: dict[str, np.ndarray]) -> dict[str, tuple[float, ...]]:
    """At most `MOST` points of curves over the same times, evenly chosen."""
    count = len(curves["t"])
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST)).astype(int))
    return {key: tuple(values[chosen].tolist()) for key, values in curves.items()}


def motion(scene: Scene, with_curves: bool = False) -> Motion | Missing:
    """The energies of a scene's motion; the reason where the model ends.

    with_curves: whether the energies over time are returned too, for a figure.
    """
    try:
        works = contact_work(scene)
    except ComputationError as error:
        return Missing(str(error))
    e = works.energies
    # what the motion holds less all work that was done on it: constant if the balance closes
    balance = e.kinetic + e.springs - e.load - e.normal - e.friction - e.damping
    # over t in ms, energies and works in J; `law` is what the contact law has fed in so far
    curves = {
        "t": 1e3 * e.t,
        "kinetic": e.kinetic,
        "elastic": e.springs + e.contact,
        "friction": e.friction,
        "load": e.load,
        "law": e.fed,
    }
    return Motion(
        friction=works.friction,
        load=float(e.load[-1]),
        law=works.fed,
        kinetic=works.kinetic,
        residue=float(np.ptp(balance)) / works.kinetic,
        episodes=tuple(Episode(1e3 * x.start, 1e3 * x.stop, x.fed) for x in works.excursions),
        curves=_thinned(curves) if with_curves else {},
    )


def under_both_laws(scenes: Mapping[str, Scene]) -> dict[str, Scene]:
    """The scenes by name; each of B2 under both laws, as b2-c-mean and b2-c-integral."""
    variants: dict[str, Scene] = {}
    for name, scene in scenes.items():
        if scene.model == "B1":
            variants[name] = scene
            continue
        for law in LAWS:
            form = dataclasses.replace(scene.formulation, line_force=law)
            variants[f"{name}-{law}"] = dataclasses.replace(scene, formulation=form)
    return variants


def study(files: Sequence[Path]) -> Energy:
    """The motions of the eight scenes of models B1 and B2."""
    scenes = under_both_laws(read_scenes(files, HISTORY_FIGURES))
    return Energy({name: motion(scene, name in SHOWN) for name, scene in scenes.items()})
