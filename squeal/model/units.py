"""Units in which a scene's motion is of order one, whatever the units of its file.

The state that is integrated is (x, y, w theta) and its rates, in the units below. Rounding apart,
the same pad in other units is then the same computation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from squeal.model.pad import Pad


@dataclass(frozen=True)
class Units:
    """Mass in kg, length in m, time in s, and the lever (m) that turns rotation into length."""

    mass: float
    length: float
    time: float
    lever: float

    def to_scaled(self, state: np.ndarray) -> np.ndarray:
        """(x, y, theta, rates) in SI units to the integrated state."""
        return np.asarray(state, dtype=float) / self._factors()

    def to_si(self, state: np.ndarray) -> np.ndarray:
        """The integrated state (..., 6) to SI units."""
        return np.asarray(state, dtype=float) * self._factors()

    def _factors(self) -> np.ndarray:
        turn = self.length / self.lever
        place = np.array([self.length, self.length, turn])
        return np.concatenate([place, place / self.time])


def natural_units(pad: Pad, initial: tuple[float, ...]) -> Units:
    """Units from the pad's stiffness and mass, and from the size of its load and first state.

    A zero stiffness all over leaves the time unit to the length of the pad and its mass alone, so
    that even a free pad can be integrated.
    """
    stiffness = math.fsum(k for k in (pad.k1, pad.k2, pad.k3, pad.k4, pad.k_c) if k)
    time = math.sqrt(pad.m / stiffness)
    x, y, theta, x_dot, y_dot, theta_dot = initial
    absolute = abs(pad.y0 + y) if pad.k_c else abs(y)
    length = max(
        abs(x),
        absolute,
        abs(pad.w * theta),
        time * math.hypot(x_dot, y_dot, pad.w * theta_dot),
        pad.F_n / stiffness,
    )
    return Units(pad.m, length or pad.w, time, pad.w)
