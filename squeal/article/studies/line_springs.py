"""Point against line contact at equal load.

N springs along the face (model BN) with the normal and rotational stiffness of the line, from the
start of the article's scenes of model B2; the line follows the integral law, which is their limit.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from squeal.article.records import Missing, Record, Result
from squeal.article.studies._scenes import read_cases
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.contact import Formulation
from squeal.simulation.run import Simulation, simulate

COUNTS = (2, 3, 4, 6, 8, 16, 32)  # of springs
SAMPLES = 401  # of a motion, at which places are compared


class Contact(Record):
    """A motion on some springs, or on the line (count 0).

    lost, apart: shares of the time in which some point is apart, and in which all are; losses: how
    often the surfaces separate; peak: the greatest reaction over F_n; off: greatest distance from
    the motion on the line, over the range of that motion.
    """

    count: int
    lost: float
    apart: float
    losses: int
    peak: float
    off: float


class Case(Record):
    """A case of the angles: the motion on the line, and on each number of springs."""

    line: Contact | Missing
    springs: tuple[Contact | Missing, ...]


class LineSprings(Result):
    """By case; stop: of the motions (ms)."""

    cases: dict[str, Case]
    stop: float


def on_springs(scene: Scene, count: int) -> Scene:
    """A scene of B2 on so many springs, on the line with the integral law for 0."""
    if not count:
        return dataclasses.replace(scene, formulation=Formulation())
    return dataclasses.replace(scene, model="BN", formulation=Formulation(springs=count))


def _run(scene: Scene, count: int) -> Simulation | Missing:
    """The motion on so many springs, or the reason where the model ends."""
    with_outputs = dataclasses.replace(
        on_springs(scene, count),
        pad=scene.pad.replace(V=None),  # sliding is not checked
        outputs=("events", "shares", "extrema", "history"),
        samples=SAMPLES,
    )
    try:
        return simulate(with_outputs)
    except ComputationError as error:
        return Missing(str(error))


def _positions(scene: Scene, run: Simulation) -> np.ndarray:
    """x, y and w theta over time, (3, n)."""
    assert run.history is not None
    return np.array([run.history["x"], run.history["y"], scene.pad.w * run.history["theta"]])


def _contact(scene: Scene, count: int, run: Simulation, line: Simulation) -> Contact:
    """What a motion on so many springs is like, and how far it is from that on the line."""
    assert run.shares is not None
    assert run.events is not None
    assert run.extrema is not None
    on_line = _positions(scene, line)
    difference = np.abs(_positions(scene, run) - on_line).max()
    reaction = run.extrema["Rn"]  # (least, greatest) over F_n; None without contact
    return Contact(
        count=count,
        lost=1.0 - run.shares["FC"],  # FC: full contact
        apart=run.shares["SS"],  # SS: surfaces separated
        losses=sum(event.target == "SS" for event in run.events),
        peak=reaction[1] if reaction else 0.0,
        # over the largest range of the motion on the line in x, y or w theta
        off=float(difference / np.ptp(on_line, axis=1).max()),
    )


def case(scene: Scene) -> Case:
    """Motions on springs and on the line; without the latter none is compared."""
    line = _run(scene, 0)
    springs: list[Contact | Missing] = []
    for count in COUNTS:
        run = _run(scene, count)
        if isinstance(run, Missing):
            springs.append(run)
        elif isinstance(line, Simulation):
            springs.append(_contact(scene, count, run, line))
    on_line = line if isinstance(line, Missing) else _contact(scene, 0, line, line)
    return Case(line=on_line, springs=tuple(springs))


def study(files: Sequence[Path]) -> LineSprings:
    """The four cases of model B2."""
    scenes = read_cases(files, "B2")
    stop = max(scene.stop or 0.0 for scene in scenes.values())
    return LineSprings(
        cases={name: case(scene) for name, scene in scenes.items()},
        stop=1e3 * stop,
    )
