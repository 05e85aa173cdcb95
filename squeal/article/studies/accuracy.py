"""Error, effort and predictability horizon of each simulated scene."""

from __future__ import annotations

import argparse
import dataclasses
import math
import statistics
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from squeal.files.provenance import provenance
from squeal.files.writing import to_json
from squeal.scene import Scene, read_scene
from squeal.simulation import simulate
from squeal.simulation.reference import error_against, reference
from squeal.simulation.run import in_natural_units
from squeal.simulation.variations import variations

LONGER = 5  # the exponent is measured over this many times the scene's time
LOST = 0.01  # a motion is foretold until its tolerance has grown to this share
REPEATS = 5


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
    where = provenance(given.scenes, "squeal.article.studies.accuracy")
    print(to_json({"scenes": found, "provenance": where.to_dict()}), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
