"""A motion as a sound: what the pad's normal velocity would be to the ear."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from squeal.io.scene import Scene
from squeal.io.writing import write_whole
from squeal.simulation.hybrid import ModelEnd, integrate
from squeal.simulation.observers import Samples
from squeal.simulation.run import Backend, in_natural_units, make_integrator

RATE = 44_100  # samples a second
LENGTH = 1.0  # s
PEAK = 0.9  # of the full scale


@dataclass(frozen=True, eq=False)
class Sound:
    """One second at most of y_dot, from `start` (s), without its mean, `RATE` samples a second.

    samples: 16-bit numbers; a sample of 32767 stands for `full_scale` (m/s), 0 for silence.
    """

    start: float
    full_scale: float
    samples: np.ndarray

    def write(self, path: Path) -> None:
        """Write a WAV file."""
        from scipy.io import wavfile

        write_whole(path, lambda stream: wavfile.write(stream, RATE, self.samples), binary=True)

    def to_dict(self) -> dict[str, Any]:
        """All but the samples."""
        return {
            "signal": "y_dot",
            "rate_hz": RATE,
            "start": self.start,
            "duration": len(self.samples) / RATE,
            "full_scale": self.full_scale,
        }


def sound(scene: Scene, backend: Backend = "auto") -> Sound:
    """The last second of a scene's motion; of a shorter one the first, carried on to a second.

    Where the model ends after the scene's time but within the second, the sound ends there. Raises
    ComputationError if the model ends before that time.
    """
    from scipy.signal import decimate

    stop = max(LENGTH, scene.stop or 0.0)
    units, model, first, _ = in_natural_units(dataclasses.replace(scene, stop=stop))
    finer = 4  # times as many samples: what is too high to hear is filtered out
    count = finer * RATE
    watch = Samples((stop - LENGTH + np.arange(count) / count * LENGTH) / units.time)
    integrator = make_integrator(model, scene.tolerance, backend)
    try:
        integrate(model, integrator, units, first, stop / units.time, [watch])
    except ModelEnd as end:
        if end.time < (scene.stop or LENGTH):
            raise
    velocity = watch.states[np.isfinite(watch.states[:, 4]), 4] * units.velocity
    heard = decimate(velocity - velocity.mean(), finer, ftype="fir")
    full_scale = float(np.abs(heard).max()) / PEAK
    scale = 32767.0 / full_scale if full_scale > 0.0 else 0.0
    return Sound(stop - LENGTH, full_scale, np.round(heard * scale).astype(np.int16))
