"""What a parameter set is: sixteen numbers with ranges and reasons, and its initial states.

Units: w = m = k1 = 1. A point is a row of the unit cube, and random sets are uniform in it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from squeal.article.cases import CASES
from squeal.article.claims.measures import equilibria
from squeal.article.identify.ensemble import single, some_pads
from squeal.io.scene import Scene
from squeal.model.contact import CONSISTENT, Formulation, contact_law, contact_model
from squeal.model.equations import PadModel
from squeal.model.pad import Model, Number, Pad

MODELS: tuple[Model, ...] = ("B1", "B2")
STOP = 100.0  # time units sqrt(m/k1)
# Scale of the written scenes: a pad of 80 mm and 0.15 kg whose first spring alone would sound at
# 5 kHz.
MASS = 0.15
LENGTH = 0.04
STIFFNESS = 1.5e8
TIME = math.sqrt(MASS / STIFFNESS)
LOAD = 2000.0  # N, brake force on a pad of this mass and half length; both set the scale
SPEED = 5.0  # m/s, of the surface at the pad: a car at some 45 km/h, above most squeal

Numbers = Mapping[str, np.ndarray]
"""The numbers of n parameter sets by name, arrays (n,)."""


class Dimension(NamedTuple):
    """One searched number; `log`: its logarithm is searched."""

    name: str
    low: float
    high: float
    log: bool
    reason: str


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
NAMES = tuple(d.name for d in DIMENSIONS)


def decode(
    points: np.ndarray, dimensions: Sequence[Dimension] = DIMENSIONS
) -> dict[str, np.ndarray]:
    """The numbers that points (n, dimensions) of the unit cube stand for."""
    numbers = {}
    for dimension, share in zip(dimensions, points.T, strict=True):
        if dimension.log:
            low = math.log(dimension.low)
            high = math.log(dimension.high)
            numbers[dimension.name] = np.exp(low + (high - low) * share)
        else:
            width = dimension.high - dimension.low
            numbers[dimension.name] = dimension.low + width * share
    return numbers


def pad_of(n: Numbers, model: str, angles: tuple[Any, Any]) -> Pad:
    """The dimensionless pads of a model and some angles; parameters are arrays if the numbers are.

    angles: (alpha1, alpha2), rad. All values of `tilt` from -1 to 1 stand for a level pad, so that
    random sets are level with a probability above 0.
    """
    law = contact_law(model)
    beyond_level = np.maximum(0.0, np.abs(n["tilt"]) - 1.0)
    parameters: dict[str, Any] = {"m": 1.0, "w": 1.0, "k1": 1.0, "L1": n["L"], "L2": n["L"]}
    for name in ("h", "k2", "mu", "F_n", "x0", *law.parameters):
        parameters[name] = n[name]
    # `inertia` is relative to that of a homogeneous rectangle, m (w^2 + h^2) / 3
    parameters["I"] = n["inertia"] * (1.0 + n["h"] ** 2) / 3.0
    # `tilt` counts in F_n / (k1 w), which with k1 = w = 1 is F_n
    parameters["theta0"] = np.copysign(beyond_level, n["tilt"]) * n["F_n"]
    parameters["alpha1"], parameters["alpha2"] = angles
    if law.absolute_gap:
        # a released start, at y = lift F_n, then has the gap y0 + y = -preload F_n / k_c
        parameters["y0"] = -n["F_n"] * (n["preload"] / n["k_c"] + n["lift"])
    return Pad(**parameters)


def stacked(n: Numbers, model: Model, case: str, formulation: Formulation) -> PadModel:
    """The dimensionless pads of a model and a case, all parameters as arrays (n,)."""
    given = pad_of(n, model, CASES[case]).given()
    count = len(n["h"])
    columns: Any = {name: np.full(count, value, dtype=float) for name, value in given.items()}
    return PadModel(model, Pad(**columns), formulation)


def starts(n: Numbers, pads: PadModel) -> np.ndarray:
    """First states (sets, 6) of pads, all at rest, from the numbers `n` of the parameter sets.

    Released pads are where their numbers say, the same in all four cases. Standing pads are in the
    equilibrium, without friction, of their own case on a disc that does not move yet; NaN where
    that equilibrium is not in full contact.
    """
    state = np.zeros((len(n["h"]), 6))
    state[:, 0] = n["first_x"] * n["F_n"]
    # y counts from relaxed springs, in B2 up to the lift, in B1 down into the contact
    height = n["lift"] if pads.law.absolute_gap else -n["first_y"] / (n["k3"] + n["k4"])
    state[:, 1] = height * n["F_n"]
    standing = np.flatnonzero(n["start"] >= 0.5)  # the others are released, see `DIMENSIONS`
    if standing.size:
        at_rest = equilibria(some_pads(pads, standing), np.zeros(standing.size))
        full_contact = (at_rest.gaps < 0.0).all(axis=0)
        state[standing, :3] = np.where(full_contact, at_rest.q, math.nan).T
    return state


def contact_stiffness(pad: Pad) -> Number:
    """Normal stiffness of full contact, a number or (n,) as the parameters are."""
    return pad.k3 + pad.k4 if pad.k_c is None else pad.k_c


def compression(pad: Pad) -> Number:
    """Static compression of the contact under the brake force, a number or (n,)."""
    return pad.F_n / contact_stiffness(pad)


def states_in_box(pad: Pad, q: np.ndarray, half_width: float, draws: np.ndarray) -> np.ndarray:
    """States (n, 6) of a pad in a box about q (3,) at rest; draws (n, 6): from -1 to 1.

    The box reaches `half_width` static compressions to both sides in x, in y and, as the lift of an
    edge, in w theta. Velocities reach what a mass on spring 1 has that swings as far: the
    half-width of each displacement times (k1/m)^(1/2).
    """
    displacement = half_width * compression(pad) * np.array([1.0, 1.0, 1.0 / pad.w])
    velocity = displacement * np.sqrt(pad.k1 / pad.m)
    return np.append(q, np.zeros(3)) + np.append(displacement, velocity) * draws


def speed_limit(n: Numbers) -> np.ndarray:
    """The surface's speed (n,) over w sqrt(k1 / m), on the scale of each set's load."""
    return np.asarray(SPEED * np.sqrt(n["F_n"] * MASS / (LENGTH * LOAD)))


def scenes_of(
    n: Numbers, formulation: Formulation, tolerance: float = 1e-12
) -> dict[Model, dict[str, Scene]]:
    """The eight dimensionless scenes of one parameter set, whose numbers are `n`: by model, then by
    case. tolerance: of the integration; other ones than this are for the study of accuracy."""
    speed = float(speed_limit(n)[0])

    def scene(model: Model, case: str) -> Scene:
        """The scene of a model and a case."""
        pads = stacked(n, model, case, formulation)
        # a model without choices gets the default, as a scene refuses any other formulation of it
        return Scene(
            model,
            single(pads, 0).pad.replace(V=speed),
            formulation if contact_model(model).choices else CONSISTENT,
            initial=tuple(starts(n, pads)[0].tolist()),
            stop=STOP,
            samples=2,
            tolerance=tolerance,
        )

    return {model: {case: scene(model, case) for case in CASES} for model in MODELS}
