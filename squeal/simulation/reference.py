"""The same motion with more digits: what a run in double precision is measured against."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.equations import PadModel
from squeal.model.states import State
from squeal.simulation.legs import Integrator
from squeal.simulation.observers import Observer
from squeal.simulation.run import in_natural_units, integrate

TOLERANCE = 1e-20  # what is tighter changes no double


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
    """The motion of a scene in quad precision (113 bits) where heyoka has it, else in mpmath.

    Raises ComputationError where the model ends, or without both.
    """
    units, model, first, stop = in_natural_units(scene)
    changes = ChangeTimes()
    integrator, number = _integrator(model, tolerance)
    start = np.array([number(float(v)) for v in first])
    try:
        _, state, _, _ = integrate(model, integrator, units, start, stop, [changes])
    except ZeroDivisionError:  # the line law in partial contact, exactly level
        raise ComputationError("more digits meet a pole of the contact law") from None
    return Reference(np.array([float(v) for v in state]), np.array(changes.times))


def _integrator(model: PadModel, tolerance: float) -> tuple[Integrator, Any]:
    """An integrator with more digits than a double has, and its kind of numbers."""
    number = quad()
    if number is not None:
        from squeal.simulation.integrators.taylor import TaylorIntegrator

        return TaylorIntegrator(model, tolerance, number), number
    from squeal.simulation.integrators.with_mpmath import MpmathIntegrator

    try:
        other = MpmathIntegrator(model, tolerance)
    except ImportError:
        raise ComputationError(
            "more digits need heyoka's quad precision or mpmath, and neither is installed"
        ) from None
    return other, other.number


def quad() -> Any:
    """Heyoka's numbers of quad precision, None where there are none."""
    try:
        import heyoka as hy
    except ImportError:
        return None
    return getattr(hy, "real128", None)


def precision_in_words() -> str:
    """What the references here are computed with, for the report."""
    return "quad precision" if quad() is not None else "extended precision (mpmath)"


def error_against(found: np.ndarray, exact: np.ndarray) -> float:
    """Greatest difference of two places (3,), relative to the size of the exact one."""
    return float(np.abs(found - exact).max() / np.abs(exact).max())
