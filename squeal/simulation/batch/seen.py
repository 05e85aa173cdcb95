"""A motion with what all measures need, and signals of it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from squeal.model.law import ContactLaw
from squeal.model.mechanics import Coefficients, Pose, pose
from squeal.simulation.batch.motion import Motion

Read = Callable[[Coefficients, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""A signal (p,) of pads from their coefficients (p,), places x, y, w theta (3, p), contact
(points, p), and which pads they are (p,)."""


class Signal(NamedTuple):
    """A signal at the samples (k, n) and at the contact changes (e,), and how it is read."""

    inner: np.ndarray
    change: np.ndarray
    read: Read


class Seen(NamedTuple):
    """A motion with what all measures need.

    row (e,): the first sample at or after each contact change; on (points, k, n) of 0 or 1:
    contact at the samples; changes (k, n): how many so far; same (k - 1, n): none until the
    next sample; at: poses of the samples (k, n);
    there: coefficients of the pad of each change (e,); there_at: poses there; terms (m, n): numbers
    of the terms with velocities, m = 0 without.
    """

    law: ContactLaw
    motion: Motion
    c: Coefficients
    row: np.ndarray
    on: np.ndarray
    changes: np.ndarray
    same: np.ndarray
    at: Pose
    there: Coefficients
    there_at: Pose
    terms: np.ndarray


def seen(law: ContactLaw, c: Coefficients, motion: Motion, terms: np.ndarray) -> Seen:
    """Prepare n motions for `measures`; all coefficients are arrays (n,)."""
    count = len(motion.samples)
    row = np.empty(len(motion.t), dtype=int)
    for lane, times in enumerate(motion.times.T):
        mine = motion.lane == lane
        row[mine] = np.searchsorted(times, motion.t[mine])
    row = np.minimum(row, max(count - 1, 0))
    passed = np.zeros((count, *motion.touching.shape), dtype=np.int32)
    if count:
        np.add.at(passed, (row, motion.point, motion.lane), 1)
        np.cumsum(passed, axis=0, out=passed)
    changes = passed.sum(axis=1)
    there = Coefficients(*(value[motion.lane] for value in c))
    return Seen(
        law,
        motion,
        c,
        row,
        ((motion.touching + passed) & 1).swapaxes(0, 1),
        changes,
        changes[1:] == changes[:-1],
        pose(np, c.place(motion.samples.swapaxes(0, 1))),
        there,
        pose(np, there.place(motion.state)),
        terms,
    )
