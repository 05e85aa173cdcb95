"""How long a motion can be foretold: growth of small errors by the variational equations.

The loads are continuous where the contact changes, since an edge's force starts from zero. The jump
(saltation) matrix there, I + (f_after - f_before) n' / (n' f_before) with the normal n of the
switching surface, is therefore the identity, and the variational equations run on through it.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import statistics
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from squeal.errors import ComputationError
from squeal.files import to_json
from squeal.model import PadModel
from squeal.provenance import provenance
from squeal.scene import Scene, read_scene
from squeal.simulation import simulate
from squeal.simulation.legs import Leg
from squeal.simulation.observers import Observer
from squeal.simulation.reference import error_against, reference
from squeal.simulation.run import in_natural_units, integrate, make_integrator

PARTS = 8  # Runge-Kutta steps of the variational equations in a step of the motion
LONGER = 5  # the exponent is measured over this many times the scene's time
LOST = 0.01  # a motion is foretold until its tolerance has grown to this share
REPEATS = 5


class Variations(Observer):
    """The matrix of small deviations (6, 6) along a motion, in natural units, kept in size."""

    dense = True

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self.matrix = np.eye(6)
        self.logarithm = 0.0  # of the factor taken out of the matrix
        self.t = 0.0

    def _rates(self, leg: Leg, t: np.ndarray) -> np.ndarray:
        """The matrices A (n, 6, 6) of the linear equations at some times."""
        assert leg.dense is not None
        pad, step = self._model.pad, 1e-200
        lever = np.array([1.0, 1.0, pad.w])
        q = leg.dense(t)[:, :3].T / lever[:, None]
        points = q[:, None] + 1j * step * np.eye(3)[:, :, None]
        slopes = np.moveaxis(self._model.loads(points, leg.contact).imag / step, -1, 0)
        mass = np.array([pad.m, pad.m, pad.I])
        A = np.zeros((len(t), 6, 6))
        A[:, :3, 3:] = np.eye(3)
        A[:, 3:, :3] = slopes * (lever / mass)[:, None] / lever
        return A

    def leg(self, leg: Leg) -> None:
        assert leg.nodes is not None
        size = np.repeat(np.diff(leg.nodes) / PARTS, PARTS)
        begin = leg.nodes[0] + np.concatenate([[0.0], np.cumsum(size)])
        A = self._rates(leg, np.append(begin, begin[:-1] + size / 2))
        at, between = A[: len(begin)], A[len(begin) :]
        for h, a, b, c in zip(size, at[:-1], between, at[1:], strict=True):
            X = self.matrix
            k1 = a @ X
            k2 = b @ (X + h / 2 * k1)
            k3 = b @ (X + h / 2 * k2)
            k4 = c @ (X + h * k3)
            self.matrix = X + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        factor = float(np.linalg.norm(self.matrix, 2))
        self.matrix /= factor
        self.logarithm += math.log(factor)
        self.t = leg.t1

    @property
    def exponent(self) -> float:
        """Largest Lyapunov exponent over the motion so far, per unit of time."""
        return self.logarithm / self.t


def variations(scene: Scene, longer: float = 1.0) -> Variations:
    """Small deviations along a scene's motion, over `longer` times its time or till its model ends.

    Raises ComputationError if that is at once.
    """
    units, model, start, stop = in_natural_units(scene)
    watch = Variations(model)
    integrator = make_integrator(model, scene.tolerance, "auto")
    try:
        integrate(model, integrator, units, start, longer * stop, [watch])
    except ComputationError:
        if watch.t == 0.0:
            raise
    return watch


@dataclass(frozen=True)
class Accuracy:
    """What a simulated scene is worth.

    error: of the final place against quad precision, relative; growth: of small deviations over
    the scene's time; exponent in 1/s, `measured` over how many times the scene's time; horizon in
    s: when the tolerance has grown to `LOST`, None where deviations do not grow exponentially;
    run_time in s, median.
    """

    error: float
    growth: float
    exponent: float
    measured: float
    horizon: float | None
    steps: int
    changes: int
    run_time: float
    tolerance: float
    stop: float


def accuracy(scene: Scene) -> Accuracy:
    """Error, growth of errors, effort and predictability horizon of a scene of B1 or B2.

    Raises ComputationError without quad precision, or where the model ends.
    """
    runs = [simulate(scene) for _ in range(REPEATS)]
    units, _, _, stop = in_natural_units(scene)
    final = units.to_scaled(np.array(runs[0].final[1:]))[:3]
    over_scene, over_longer = variations(scene), variations(scene, LONGER)
    exponent = over_longer.exponent
    # growth by a power of t is no loss of foresight: it leaves ln(t)/t in the measured exponent
    grows = exponent * over_longer.t > 3.0 * math.log(over_longer.t)
    tolerance = max(scene.tolerance, float(np.finfo(float).eps))
    return Accuracy(
        error=error_against(final, reference(scene).place),
        growth=math.exp(over_scene.logarithm),
        exponent=exponent / units.time,
        measured=over_longer.t / stop,
        horizon=math.log(LOST / tolerance) / exponent * units.time if grows else None,
        steps=runs[0].steps,
        changes=runs[0].contact_changes,
        run_time=statistics.median(run.run_time for run in runs),
        tolerance=scene.tolerance,
        stop=scene.stop or 0.0,
    )


def main() -> int:
    """Print the accuracy of each scene given as JSON."""
    parser = argparse.ArgumentParser(description="Error, effort and horizon of simulated scenes.")
    parser.add_argument("scenes", type=Path, nargs="+", metavar="SCENE.yaml")
    given = parser.parse_args()
    found = {
        file.stem: dataclasses.asdict(accuracy(read_scene(file, "simulate")))
        for file in given.scenes
    }
    where = provenance(None, "squeal.predictability", ("numpy", "heyoka"))
    print(to_json({"scenes": found, "provenance": where}), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
