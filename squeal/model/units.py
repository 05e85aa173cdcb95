"""Units in which a scene's motion is of order one, whatever the units of its file.

The state that is integrated is (x, y, w theta) and its rates, in the units below. Rounding apart,
the same pad in other units is then the same computation.
"""

import dataclasses
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from squeal.errors import InputError
from squeal.model.equations import PadModel


@dataclass(frozen=True)
class Units:
    """Mass in kg, length in m, time in s, and the lever (m) that turns rotation into length.

    Of many pads each may be an array (n,).
    """

    mass: float
    length: float
    time: float
    lever: float

    @property
    def velocity(self) -> float:
        """In m/s."""
        return self.length / self.time

    @property
    def force(self) -> float:
        """In N."""
        return self.mass * self.length / self.time**2

    @property
    def energy(self) -> float:
        """In J."""
        return self.force * self.length

    def scaled(self, model: PadModel) -> PadModel:
        """A model in SI units measured in these."""
        pad = model.pad.scaled(self.mass, self.length, self.time)
        if model.damping is None:
            return dataclasses.replace(model, pad=pad)
        turn, rate = (1.0, 1.0, self.length), self.time / self.mass
        C = tuple(
            tuple(c * rate / (turn[i] * turn[j]) for j, c in enumerate(row))
            for i, row in enumerate(model.damping)
        )
        return dataclasses.replace(model, pad=pad, damping=C)

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


def natural_units(model: PadModel, initial: Any) -> Units:
    """Units from the pad's stiffness and mass, and from the size of its load and first state.

    initial: (x, y, theta, rates) in SI units, each a number or, like the parameters of many pads,
    an array (n,). Raises InputError for a pad without any stiffness, which has no time of its own.
    """
    pad = model.pad
    stiffness = sum(getattr(pad, name) for name in ("k1", "k2", *model.law.parameters))
    if not np.all(stiffness > 0.0):
        raise InputError("Pad: no stiffness above 0; motion without any spring has no unit of time")
    time = np.sqrt(pad.m / stiffness)
    x, y, theta, x_dot, y_dot, theta_dot = initial
    sizes = (
        np.abs(x),
        np.abs(pad.y0 + y if model.law.absolute_gap else y),
        np.abs(pad.w * theta),
        time * np.hypot(np.hypot(x_dot, y_dot), pad.w * theta_dot),
        pad.F_n / stiffness,
    )
    length = reduce(np.maximum, sizes)
    length = np.where(length > 0.0, length, pad.w)
    each = (np.asarray(v) for v in (pad.m, length, time, pad.w))
    # plain numbers are faster than numpy's
    return Units(*(v.item() if v.ndim == 0 else v for v in each))  # type: ignore[arg-type]
