"""What is kept of the motion of one or several pads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np


@dataclass(frozen=True)
class Motion:
    """Motion of n pads in natural units, as far as it is kept.

    stop (n,): wanted time; touching (points, n): contact (0 or 1) of each contact point at the
    start; end (6, n); times (k, n): rising, from 0 to stop, and samples (k, 6, n): states then,
    k = 0 if none were wanted; lane, point, t (e,), on (points, e), state (6, e): contact changes,
    in order within a pad, with the contact afterwards; steps (n,); limit (n,): the entry of
    `LIMITS` that ended the motion, else -1, and limit_t (n,) when; whole (n,): False where heyoka
    gave up.
    """

    stop: np.ndarray
    touching: np.ndarray
    end: np.ndarray
    times: np.ndarray
    samples: np.ndarray
    lane: np.ndarray
    point: np.ndarray
    t: np.ndarray
    on: np.ndarray
    state: np.ndarray
    steps: np.ndarray
    limit: np.ndarray
    limit_t: np.ndarray
    whole: np.ndarray


def together(motions: Sequence[Motion]) -> Motion:
    """Several motions, sampled equally often, as one of all their pads in the same order."""
    first = np.cumsum([0, *(len(motion.stop) for motion in motions)])
    # pads, or their contact changes, run along the last axis of every array
    parts = {
        f.name: np.concatenate([getattr(motion, f.name) for motion in motions], axis=-1)
        for f in fields(Motion)
    }
    parts["lane"] = np.concatenate([m.lane + i for m, i in zip(motions, first, strict=False)])
    return Motion(**parts)
