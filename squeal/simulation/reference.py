"""The same motion in quad precision: what a run in double precision is measured against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from squeal.errors import ComputationError
from squeal.model.states import State
from squeal.scene.schema import Scene
from squeal.simulation.observers import Observer
from squeal.simulation.run import in_natural_units, integrate

TOLERANCE = 1e-30


@dataclass(frozen=True)
class Reference:
    """State (6,) at the end and times (n,) of the contact changes, in natural units, as doubles."""

    state: np.ndarray
    times: np.ndarray

    @property
    def place(self) -> np.ndarray:
        """x, y and w theta at the end, (3,)."""
        return self.state[:3]


class ChangeTimes(Observer):
    """Keeps when the contact changes, in natural units."""

    def __init__(self) -> None:
        self.times: list[float] = []

    def change(self, t: float, source: State, target: State) -> None:
        self.times.append(float(t))


def reference(scene: Scene, tolerance: float = TOLERANCE) -> Reference:
    """The motion of a scene from Taylor series in quad precision (113 bits).

    Raises ComputationError without heyoka's quad precision, or where the model ends.
    """
    try:
        import heyoka as hy

        number = hy.real128
    except (ImportError, AttributeError):
        raise ComputationError("quad precision needs heyoka on a machine that has it") from None
    from squeal.simulation.integrators.taylor import TaylorIntegrator

    units, model, first, stop = in_natural_units(scene)
    changes = ChangeTimes()
    start = np.array([number(float(v)) for v in first])
    integrator = TaylorIntegrator(model, tolerance, number)
    _, state, _, _ = integrate(model, integrator, units, start, stop, [changes])
    return Reference(np.array([float(v) for v in state]), np.array(changes.times))


def error_against(found: np.ndarray, exact: np.ndarray) -> float:
    """Greatest difference of two places (3,), relative to the size of the exact one."""
    return float(np.abs(found - exact).max() / np.abs(exact).max())
