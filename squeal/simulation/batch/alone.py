"""A single pad on the path of single simulations, kept and measured as pads of a batch are."""

from typing import Literal

import numpy as np

from squeal.io.scene import Scene
from squeal.model.equations import PadModel
from squeal.model.mechanics import Coefficients
from squeal.model.states import State
from squeal.model.units import Units
from squeal.simulation.batch.measures import Measures, measures
from squeal.simulation.batch.motion import Motion
from squeal.simulation.batch.seen import seen
from squeal.simulation.legs import Leg
from squeal.simulation.observers import Observer
from squeal.simulation.run import in_natural_units, integrate, make_integrator

PER_STEP = 24  # samples in each integration step; a step is a fraction of an oscillation


class _Keep(Observer):
    """Contact changes of one motion, and samples of it at equal parts of each step.

    The time at which two legs join belongs to the latter alone.
    """

    def __init__(self, dense: bool) -> None:
        self.dense = dense
        self._inner = np.linspace(0.0, 1.0, PER_STEP, endpoint=False)
        self.times: list[np.ndarray] = [np.empty(0)]
        self.samples: list[np.ndarray] = [np.empty((0, 6))]
        self.end = np.zeros(6)
        self.contacts: list[State] = []  # before the first change, and after each
        self.changes: list[tuple[int, float]] = []
        self.states: list[np.ndarray] = []

    def leg(self, leg: Leg) -> None:
        self.end = leg.end
        self.contacts = self.contacts or [leg.contact]
        if leg.dense is not None and leg.nodes is not None and leg.t1 > leg.t0:
            t = (leg.nodes[:-1, None] + np.diff(leg.nodes)[:, None] * self._inner).ravel()
            self.times.append(t)
            self.samples.append(leg.dense(t))

    def change(self, t: float, source: State, target: State) -> None:
        point = next(i for i, touches in enumerate(source) if touches != target[i])
        self.changes.append((point, t))
        self.contacts.append(target)
        self.states.append(self.end)

    def motion(self, stop: float, steps: int) -> Motion:
        """What was kept, after the run."""
        if self.dense:
            self.times.append(np.array([stop]))
            self.samples.append(self.end[None])
        changes = np.array(self.changes, dtype=float).reshape(-1, 2).T
        contacts = np.array(self.contacts, dtype=int).T
        return Motion(
            stop=np.array([stop]),
            touching=contacts[:, :1],
            end=self.end[:, None],
            times=np.concatenate(self.times)[:, None],
            samples=np.concatenate(self.samples)[:, :, None],
            lane=np.zeros(changes.shape[1], dtype=int),
            point=changes[0].astype(int),
            t=changes[1],
            on=contacts[:, 1:],
            state=np.array(self.states).reshape(-1, 6).T,
            steps=np.array([steps]),
            limit=np.array([-1]),
            limit_t=np.array([np.nan]),
            whole=np.array([True]),
        )


def run_alone(
    model: PadModel,
    tolerance: float,
    backend: Literal["auto", "heyoka"],
    units: Units,
    state: np.ndarray,
    stop: float,
    dense: bool,
) -> Motion:
    """The motion (n = 1) of a scaled pad, with samples if `dense`.

    Raises ComputationError if it cannot be carried to the end.
    """
    keep = _Keep(dense)
    integrator = make_integrator(model, tolerance, backend)
    _, _, steps, _ = integrate(model, integrator, units, state, stop, [keep])
    return keep.motion(stop, steps)


def measure_alone(scene: Scene) -> Measures:
    """The measures (n = 1) of a scene of B1 or B2, speed in the scene's units.

    Raises ComputationError where the model ends.
    """
    units, model, state, stop = in_natural_units(scene)
    motion = run_alone(model, scene.tolerance, "auto", units, state, stop, True)
    c = Coefficients(*(np.array([value]) for value in model.c))
    terms = model.term_values[:, None]
    found = measures(seen(model.law, c, motion, terms), np.array([scene.pad.theta0]))
    return found | {name: found[name] * units.velocity for name in ("fastest", "face")}
