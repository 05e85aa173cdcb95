"""What a member of an ensemble is: seventeen numbers with ranges and reasons, and its eight starts.

Units: w = m = k1 = 1. A point is a row of the unit cube; the prior is uniform in it.
"""

import math
from collections.abc import Mapping
from itertools import product

import numpy as np

from squeal.article.claims.measures import rest
from squeal.article.identify.space import LENGTH, MASS, Dimension
from squeal.model.contact import Formulation
from squeal.model.equations import PadModel

LOAD = 2000.0  # N, brake force on a pad of this mass and half length; both set the scale
SPEED = 5.0  # m/s, of the surface at the pad: a car at some 45 km/h, above most squeal

DIMENSIONS = (
    Dimension("h", 0.1, 1.0, False, "half height over half length: from a flat pad to a square"),
    Dimension(
        "inertia", 0.4, 2.5, True, "I over a uniform rectangle's: mass in the middle, at ends"
    ),
    Dimension("k2", 0.4, 2.5, True, "over k1: the two supports are of one kind"),
    Dimension("k3", 0.02, 5.0, True, "over k1: contact much softer or stiffer than the supports"),
    Dimension("k4", 0.02, 5.0, True, "over k1, as k3"),
    Dimension("k_c", 0.02, 5.0, True, "over k1, as k3"),
    Dimension("L", 0.5, 10.0, True, "free lengths over w: a 20 mm bushing to a 0.4 m caliper"),
    Dimension("mu", 0.1, 0.6, False, "brake linings, from wet or faded to the grippiest"),
    Dimension("F_n", 1e-4, 3e-2, True, "over k1 w: 0.5 to 10 kN, 30 to 80 mm, 1 to 16 kHz"),
    Dimension("preload", 0.0, 5.0, False, "B2: k_c times the depth of a released start, over F_n"),
    Dimension("lift", -1.0, 4.0, False, "B2: height of that start over relaxed springs, F_n / k1"),
    Dimension("first_y", 0.0, 2.5, False, "B1: depth of a released start times k3 + k4, over F_n"),
    Dimension("first_x", -3.0, 3.0, False, "x of a released start, over F_n / k1"),
    Dimension("tilt", -3.0, 3.0, False, "theta0 k1 w / F_n beyond 1 or -1; between them level"),
    Dimension("x0", -0.5, 0.5, False, "over w; moves the pad in the frame that measures delta"),
    Dimension("start", 0.0, 1.0, False, "below 0.5 released from rest, above at rest on the disc"),
)
FORMULATIONS = tuple(
    Formulation(*choice)  # type: ignore[arg-type]
    for choice in product(("integral", "mean"), ("centre", "frame"), ("+", "-"))
)
NAMES = tuple(d.name for d in DIMENSIONS)

Numbers = Mapping[str, np.ndarray]
"""The numbers of n pads by name, arrays (n,)."""


def decode(points: np.ndarray) -> dict[str, np.ndarray]:
    """The numbers that points (n, dimensions) of the unit cube stand for."""
    found = {}
    for d, u in zip(DIMENSIONS, points.T, strict=True):
        low, high = (math.log(d.low), math.log(d.high)) if d.log else (d.low, d.high)
        value = low + (high - low) * u
        found[d.name] = np.exp(value) if d.log else value
    return found


def standing(numbers: Numbers) -> np.ndarray:
    """True (n,) for pads that start at rest on a disc that then begins to slide."""
    return np.asarray(numbers["start"] >= 0.5)


def starts(numbers: Numbers, pads: PadModel) -> np.ndarray:
    """First states (n, 6) of pads, all at rest.

    Released pads are where their numbers say, the same in all four cases. Standing ones are where
    this case rests on a disc that does not move yet, without friction; NaN where full contact does
    not hold them in balance.
    """
    n = numbers
    state = np.zeros((len(n["h"]), 6))
    state[:, 0] = n["first_x"] * n["F_n"]
    line = pads.law.absolute_gap
    state[:, 1] = (n["lift"] if line else -n["first_y"] / (n["k3"] + n["k4"])) * n["F_n"]
    still = np.flatnonzero(standing(n))
    if still.size:
        few = pads.replace(**{name: v[still] for name, v in pads.pad.given().items()})
        found = rest(few, np.zeros(still.size))
        held = (found.gaps < 0.0).all(axis=0)
        state[still, :3] = np.where(held, found.place, math.nan).T
    return state


def speed_limit(numbers: Numbers) -> np.ndarray:
    """The surface's speed (n,) over w sqrt(k1 / m), on the scale of each pad's load."""
    return np.asarray(SPEED * np.sqrt(numbers["F_n"] * MASS / (LENGTH * LOAD)))
