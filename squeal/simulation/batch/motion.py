"""What is kept of the motion of one or several pads."""

from dataclasses import dataclass, fields

import numpy as np


@dataclass(frozen=True)
class Passage:
    """Motion of n pads in natural units but for its samples.

    stop (n,): wanted time; touching (points, n): contact (0 or 1) of each contact point at the
    start; end (6, n); lane, point, t (e,), on (points, e), state (6, e): contact changes, in order
    within a pad, with the contact afterwards; steps (n,); limit (n,): the entry of `LIMITS` that
    ended the motion, else -1, and limit_t (n,) when; whole (n,): False where the integrator gave
    up.
    """

    stop: np.ndarray
    touching: np.ndarray
    end: np.ndarray
    lane: np.ndarray
    point: np.ndarray
    t: np.ndarray
    on: np.ndarray
    state: np.ndarray
    steps: np.ndarray
    limit: np.ndarray
    limit_t: np.ndarray
    whole: np.ndarray


@dataclass(frozen=True)
class Motion(Passage):
    """With times (k, n), rising from 0 to stop, and samples (k, 6, n): states then, k = 0 if none
    were wanted."""

    times: np.ndarray
    samples: np.ndarray


@dataclass(frozen=True)
class Course(Passage):
    """Motions of many pads, in order, each with samples of its own number.

    Changes are in the order of the pads, without `on` and `state` where there are no samples;
    states (m, 6): the samples of one pad after the other, those of pad i from first[i] to
    first[i + 1].
    """

    first: np.ndarray
    states: np.ndarray

    def part(self, begin: int, end: int) -> Motion:
        """Some pads in a row, which have equally many samples."""
        changes = slice(*np.searchsorted(self.lane, [begin, end]).tolist())
        pads = slice(begin, end)
        kept = {
            f.name: getattr(self, f.name)[..., changes if f.name in _OF_CHANGES else pads]
            for f in fields(Passage)
        }
        samples = self.states[self.first[begin] : self.first[end]].reshape(end - begin, -1, 6)
        stop, count = self.stop[pads], samples.shape[1]
        return Motion(
            **kept | {"lane": kept["lane"] - begin},
            times=np.linspace(0.0, 1.0, count)[:, None] * stop,
            samples=np.ascontiguousarray(samples.transpose(1, 2, 0)),
        )


_OF_CHANGES = ("lane", "point", "t", "on", "state")
