"""A motion computed more exactly: what a run in double precision is measured against."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.simulation.hybrid import Integrator, whole_motion
from squeal.simulation.run import heyoka, in_natural_units
from squeal.simulation.scipy_solver import LONGEST_STEP, SciPyIntegrator

TOLERANCE = 1e-20  # what is tighter changes no double


@dataclass(frozen=True)
class Reference:
    """State (6,) at the end and times (n,) of the contact changes, in natural units, as doubles."""

    state: np.ndarray
    times: np.ndarray

    @property
    def position(self) -> np.ndarray:
        """x, y and w theta at the end, (3,)."""
        return self.state[:3]


def reference(scene: Scene, tolerance: float = TOLERANCE) -> Reference:
    """The motion of a scene in quad precision (113 bits), or by SciPy with shorter steps where
    there is no heyoka.

    Raises ComputationError where the model ends.
    """
    units, model, initial, stop = in_natural_units(scene)
    quad_number = quad()  # the type, None without heyoka
    if quad_number is None:
        integrator: Integrator = SciPyIntegrator(model, tolerance, LONGEST_STEP / 4.0)
        start = np.array([float(value) for value in initial])
    else:
        integrator = heyoka().TaylorIntegrator(model, tolerance, quad_number)
        start = np.array([quad_number(float(value)) for value in initial])
    segment = whole_motion(model, integrator, units, start, stop)
    return Reference(
        state=np.array(segment.end[:, 0], dtype=float),
        times=np.array(segment.changes.t, dtype=float),
    )


def quad() -> Any:
    """Heyoka's numbers of quad precision, None where there are none."""
    try:
        return getattr(heyoka().hy, "real128", None)
    except ComputationError:
        return None


def precision_in_words() -> str:
    """What the references here are computed with, for the report."""
    return "quad precision" if quad() is not None else "SciPy with shorter steps"


def error_against(position: np.ndarray, exact: np.ndarray) -> float:
    """Greatest difference of two positions (3,), relative to the size of the exact one."""
    return float(np.abs(position - exact).max() / np.abs(exact).max())
