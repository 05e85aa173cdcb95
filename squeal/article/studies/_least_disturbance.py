"""The least disturbance of steady sliding that leads to a lasting loss of contact, by search.

A disturbance is measured by one of two norms: displacements (x, y, w theta) at rest, in static
compressions; or the energy of displacements and velocities together, over that of the static
compression, F_n^2/(2 k). The search draws directions and goes outwards along them until a motion
lasts. It then changes the shortest disturbance that lasts in random steps that shrink. The result
is an upper bound of the least disturbance; searches from other random numbers show how sharp it is.
"""

from __future__ import annotations

import dataclasses
from typing import Literal, NamedTuple

import numpy as np

from squeal.article.studies._damped_contact import DampedContact, ensemble
from squeal.model.contact import LineContact
from squeal.numerics.differentiation import complex_step

Norm = Literal["displacement", "energy"]
DIRECTIONS = 32  # drawn for the search outwards
RADII = np.geomspace(0.25, 6.0, 15)  # norms of its disturbances
CANDIDATES = 8  # of each round of the search for shorter ones
SHORTER = np.array([0.002, 0.01, 0.03, 0.1] * 2)
"""By which share each candidate is shorter than the best, less so at widths below 1/6."""
# the width says how far the direction of a candidate is moved; factors after a round
FIRST_WIDTH = 0.5
LAST_WIDTH = 0.004
WIDER = 1.25
NARROWER = 0.8
ROUNDS = 60
LONGEST = 1200.0  # units of time after which a motion that changes contact lasts
LONGEST_PRINTED = 12000.0  # motions stay near the weakly unstable cycle of the printed law
DECAYS = 4.0  # times in which a motion about sliding decays by e


class Least(NamedTuple):
    """The shortest disturbance found: its norm and the disturbance (6,) of the state."""

    norm: float
    disturbance: np.ndarray


def unit_disturbances(pad: DampedContact, norm: Norm) -> np.ndarray:
    """Columns (6, k): disturbances of the state; that with the coefficients z has the norm |z|.

    For displacements these are the unit vectors. For the energy, with E that of the static
    compression, displacements q = L z have q'Kq/2 = |z|^2 E if L L' = 2 E K^-1, and velocities
    v = D z have v'Mv/2 = |z|^2 E if D = (2 E M^-1)^(1/2).
    """
    if norm == "displacement":
        return np.eye(6)[:, :3]  # x, y and w theta
    undamped = dataclasses.replace(pad, a=0.0, zeta=0.0, mu=0.0)
    mass = np.array([1.0, 1.0, pad.c.I / (pad.c.m * pad.c.w**2)])  # of x, y and w theta
    # the accelerations of small displacements q are -M^-1 K q
    stiffness = -mass[:, None] * complex_step(undamped.rates, pad.sliding)[3:, :3]
    static_energy = 0.5 * pad.c.F_n  # E: the static compression is the unit of length
    flexibility = np.linalg.inv(0.5 * (stiffness + stiffness.T))
    columns = np.zeros((6, 6))
    columns[:3, :3] = np.linalg.cholesky(2.0 * static_energy * flexibility)
    columns[3:, 3:] = np.diag(np.sqrt(2.0 * static_energy / mass))
    return columns


def longest(pad: DampedContact) -> float:
    """After this time a motion that still changes contact lasts; sliding is stable."""
    printed = isinstance(pad.law, LineContact) and pad.law.line_force == "mean"
    least = LONGEST_PRINTED if printed else LONGEST
    return max(least, DECAYS / (-pad.growth * pad.time))


def lasts(pad: DampedContact, disturbances: np.ndarray) -> np.ndarray:
    """Which motions from sliding disturbed by these (n, 6) lose contact for ever, (n,) bools.

    They do so within the equations: without tension, the lower face slower than the surface.
    """
    fate = ensemble(pad.law).fate(pad, pad.sliding + disturbances, longest(pad))
    return np.asarray(fate.lasts & ~fate.invalid)


def _first_lasting(
    pad: DampedContact, columns: np.ndarray, random: np.random.Generator
) -> np.ndarray | None:
    """Coefficients (k,) of a disturbance that lasts, at the least of `RADII` at which one does."""
    directions = random.normal(size=(DIRECTIONS, columns.shape[1]))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for radius in RADII:
        lasting = lasts(pad, radius * directions @ columns.T)
        if lasting.any():
            return np.asarray(radius * directions[np.argmax(lasting)])
    return None


def least_disturbance(pad: DampedContact, norm: Norm, seed: int) -> Least | None:
    """The shortest disturbance found from one seed of random numbers, None where none lasts."""
    random = np.random.default_rng(seed)
    columns = unit_disturbances(pad, norm)  # (6, k)
    best = _first_lasting(pad, columns, random)
    if best is None:
        return None
    # of the random change of a direction; wider after a round in which several candidates last,
    # narrower after one in which none does
    width = FIRST_WIDTH
    for _ in range(ROUNDS):
        length = np.linalg.norm(best)
        # coefficients (candidate, k) of unit length: directions near that of the best, and its own
        candidates = best / length + width * random.normal(size=(CANDIDATES, len(best)))
        candidates[0] = best
        candidates /= np.linalg.norm(candidates, axis=1)[:, None]
        # each is shorter than the best by its share in `SHORTER`; at widths below 1/6, where
        # directions hardly change, by less in proportion
        length_factors = 1.0 - min(1.0, 6.0 * width) * SHORTER
        candidates *= length * length_factors[:, None]
        lasting = lasts(pad, candidates @ columns.T)
        if lasting.any():
            lengths = np.where(lasting, np.linalg.norm(candidates, axis=1), np.inf)
            best = candidates[np.argmin(lengths)]  # shorter than the best before
            if np.count_nonzero(lasting) > 1:
                width = min(1.0, WIDER * width)
        else:
            width *= NARROWER
        if width < LAST_WIDTH:
            break
    return Least(float(np.linalg.norm(best)), columns @ best)
