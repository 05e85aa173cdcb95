"""The scene: one validated, immutable request. Parameters are described in `squeal.model.pad`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from squeal.model.contact import CONSISTENT, Formulation
from squeal.model.equations import PadModel
from squeal.model.pad import Model, Pad

OUTPUTS = ("events", "shares", "extrema", "history")
DEFAULT_OUTPUTS = ("events", "shares", "extrema")
DEFAULT_TOLERANCE = 1e-15
MAX_TOLERANCE = 1e-3
SAMPLES = (2, 10_000_000)
COORDINATES = ("x", "y", "theta", "x_dot", "y_dot", "theta_dot")


@dataclass(frozen=True)
class Damping:
    """Optional damping of the stability queries: one of a C matrix and three modal ratios.

    matrix: rows of C (3, 3) in (x, y, theta), SI units; ratios: damping ratios of the three modes
    without friction, by rising frequency.
    """

    matrix: tuple[tuple[float, ...], ...] | None = None
    ratios: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Scene:
    """What a scene file asks for; `initial` is (x, y, theta, x_dot, y_dot, theta_dot) in SI units.

    `tolerance` is the relative error tolerance of a step; `stop` and `samples` are None in a scene
    that names no time.
    """

    model: Model
    pad: Pad
    formulation: Formulation = CONSISTENT
    initial: tuple[float, ...] = (0.0,) * 6
    stop: float | None = None
    samples: int | None = None
    tolerance: float = DEFAULT_TOLERANCE
    outputs: tuple[str, ...] = DEFAULT_OUTPUTS
    damping: Damping | None = None
    source: Path | None = field(default=None, compare=False)

    @property
    def pad_model(self) -> PadModel:
        """The pad under the contact model that the scene names."""
        return PadModel(self.model, self.pad, self.formulation)

    def wants(self, output: str) -> bool:
        """True if the scene names this output."""
        return output in self.outputs
