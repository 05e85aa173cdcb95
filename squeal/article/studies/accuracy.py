"""Error, effort and growth of small deviations of each simulated scene."""

import math
import statistics
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from squeal.article.results.accuracy import Accuracy, SceneAccuracy
from squeal.io.scene import Scene, read_scene
from squeal.simulation import simulate
from squeal.simulation.cycles import variations
from squeal.simulation.reference import error_against, precision_in_words, reference
from squeal.simulation.run import in_natural_units

LONGER = 5  # the exponent is measured over this many times the scene's time
LOST = 0.01  # a motion is predictable until its tolerance has grown to this share
REPEATS = 3


def accuracy(scene: Scene) -> SceneAccuracy:
    """Error, growth of errors and effort of a scene of B1 or B2.

    Raises ComputationError without quad precision, or where the model ends.
    """
    runs = [simulate(scene) for _ in range(REPEATS)]
    units, _, _, stop = in_natural_units(scene)
    final = units.to_scaled(np.array(runs[0].final[1:]))[:3]
    over_scene, over_longer = variations(scene), variations(scene, LONGER)
    return SceneAccuracy(
        error=error_against(final, reference(scene).place),
        growth=math.exp(over_scene.logarithm),
        exponent=over_longer.exponent / units.time,
        measured=over_longer.t / stop,
        steps=runs[0].steps,
        changes=runs[0].contact_changes,
        run_time=statistics.median(run.run_time for run in runs),
        tolerance=scene.tolerance,
        stop=scene.stop or 0.0,
    )


def study(files: Sequence[Path]) -> Accuracy:
    """The accuracy of each scene given."""
    found = {file.stem: accuracy(read_scene(file, "simulate")) for file in files}
    return Accuracy(found, LOST, precision_in_words())
