"""A pad of a batch on the path of single simulations, with the same outcome as in a batch."""

from __future__ import annotations

import numpy as np

from squeal.errors import ComputationError
from squeal.model.equations import PadModel
from squeal.model.states import State
from squeal.model.units import Units
from squeal.simulation.batch.lanes import Motion
from squeal.simulation.legs import Leg
from squeal.simulation.observers import Observer
from squeal.simulation.run import integrate, make_integrator


class _Keep(Observer):
    """Samples and contact changes of one motion, at equal steps of time."""

    def __init__(self, stop: float, samples: int) -> None:
        self.dense = samples > 0
        self._t = np.linspace(0.0, stop, samples)
        self.samples = np.empty((samples, 6, 1))
        self._end = np.zeros(6)
        self.changes: list[tuple[int, float]] = []
        self.contacts: list[State] = []
        self.states: list[np.ndarray] = []

    def leg(self, leg: Leg) -> None:
        self._end = leg.end
        if leg.dense is not None:
            here = (self._t >= leg.t0) & (self._t <= leg.t1)
            self.samples[here, :, 0] = leg.dense(self._t[here])

    def change(self, t: float, source: State, target: State) -> None:
        point = next(i for i, touches in enumerate(source) if touches != target[i])
        self.changes.append((point, t))
        self.contacts.append(target)
        self.states.append(self._end)


def run_alone(
    model: PadModel,
    tolerance: float,
    units: Units,
    state: np.ndarray,
    touching: np.ndarray,
    stop: float,
    samples: int,
) -> Motion | None:
    """The motion (n = 1) of a scaled pad; None if it cannot be carried to the end."""
    keep = _Keep(stop, samples)
    try:
        integrator = make_integrator(model, tolerance, "heyoka")
        _, end, steps, _ = integrate(model, integrator, units, state, stop, [keep])
    except ComputationError:
        return None
    table = np.array(keep.changes, dtype=float).reshape(-1, 2).T
    return Motion(
        stop=np.array([stop]),
        touching=touching[:, None],
        end=end[:, None],
        samples=keep.samples,
        lane=np.zeros(table.shape[1], dtype=int),
        point=table[0].astype(int),
        t=table[1],
        on=np.array(keep.contacts, dtype=int).reshape(-1, len(touching)).T,
        state=np.array(keep.states).reshape(-1, 6).T,
        steps=np.array([steps]),
        limit=np.array([-1]),
        limit_t=np.array([np.nan]),
        whole=np.array([True]),
    )
