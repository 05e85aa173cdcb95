"""The searched space: dimensionless pads (w = m = k1 = 1), with ranges and their reasons."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from squeal.article.cases import CASES
from squeal.io.scene import Scene
from squeal.model.contact import CONSISTENT, Formulation, contact_law, contact_model
from squeal.model.equations import PadModel
from squeal.model.pad import Model, Pad

MODELS: tuple[Model, ...] = ("B1", "B2")
STOP = 100.0  # time units sqrt(m/k1)
# Scale of the written scenes: a pad of 80 mm and 0.15 kg whose first spring alone would sound at
# 5 kHz, on a surface that moves at 25 m/s.
MASS, LENGTH, STIFFNESS, SPEED = 0.15, 0.04, 1.5e8, 25.0
TIME = math.sqrt(MASS / STIFFNESS)
SPEED_LIMIT = SPEED * TIME / LENGTH  # in the units of the search

Numbers = Mapping[str, float]


class Dimension(NamedTuple):
    """One searched number; `log`: its logarithm is searched."""

    name: str
    low: float
    high: float
    log: bool
    reason: str


DIMENSIONS = (
    Dimension("h", 0.1, 1.0, False, "half height over half length: from a flat pad to a square"),
    Dimension("inertia", 0.4, 2.5, False, "I over that of a uniform rectangle"),
    Dimension("k2", 0.4, 2.5, True, "over k1: the two supports are of one kind"),
    Dimension("k3", 0.05, 3.0, True, "over k1: contact softer or stiffer than the supports"),
    Dimension("k4", 0.05, 3.0, True, "over k1, as k3"),
    Dimension("k_c", 0.05, 3.0, True, "over k1, as k3"),
    Dimension("L", 1.0, 50.0, True, "free lengths over w: from a bushing to a long caliper arm"),
    Dimension("mu", 0.2, 0.8, False, "friction of brake linings"),
    Dimension(
        "F_n", 2e-4, 3e-2, True, "over k1 w: 0.5 to 10 kN on 30 to 80 mm half length at 1 to 16 kHz"
    ),
    Dimension("preload", 0.2, 5.0, False, "B2: reaction over F_n at the start"),
    Dimension("lift", 0.0, 3.0, False, "B2: y k1 / F_n at the start"),
    Dimension("tilt", -3.0, 3.0, False, "theta0 k1 w / F_n beyond 1 or -1; between them level"),
    Dimension("first_y", 0.0, 2.5, False, "B1: -y (k3 + k4) / F_n at the start"),
)
BOUNDS = [(math.log(d.low), math.log(d.high)) if d.log else (d.low, d.high) for d in DIMENSIONS]

# Pads that earlier searches found, by the sign of the reaction's moment; every third start of a
# search sets out from near one.
# fmt: off
START = {
    "h": 0.362824, "inertia": 0.988005, "k2": 1.12395, "k3": 0.440564, "k4": 0.462401,
    "k_c": 0.560735, "L": 23.6471, "mu": 0.743608, "F_n": 0.000316408, "preload": 3.52991,
    "lift": 1.39419, "tilt": 0.0, "first_y": 0.861211,
}
START_REVERSED = {
    "h": 0.21314, "inertia": 0.66764, "k2": 0.65464, "k3": 0.26385, "k4": 0.18361, "k_c": 0.1486,
    "L": 1.0908, "mu": 0.468, "F_n": 0.0097776, "preload": 1.872, "lift": 0.0, "tilt": -1.63,
    "first_y": 0.708,
}
# fmt: on
STARTS = {"+": START, "-": START_REVERSED}


def decode(point: np.ndarray) -> dict[str, float]:
    """The numbers that a point of the search stands for."""
    return {
        d.name: float(math.exp(v) if d.log else v) for d, v in zip(DIMENSIONS, point, strict=True)
    }


def encode(numbers: Numbers) -> np.ndarray:
    """The point of the search that stands for the numbers."""
    return np.array([math.log(numbers[d.name]) if d.log else numbers[d.name] for d in DIMENSIONS])


def tilt_of(numbers: Mapping[str, Any]) -> Any:
    """theta0 in rad. A level pad is a start of its own kind, so it has a range of its own."""
    tilt = numbers["tilt"]
    return np.copysign(np.maximum(0.0, np.abs(tilt) - 1.0), tilt) * numbers["F_n"]


def pad_of(numbers: Mapping[str, Any], model: str, angles: tuple[float, float]) -> Pad:
    """The dimensionless pad of a model and a case, or a stack of pads if the numbers are arrays."""
    n = numbers
    law = contact_law(model)
    common = dict.fromkeys(("m", "w", "k1"), 1.0) | dict.fromkeys(("L1", "L2"), n["L"])
    common |= {name: n[name] for name in ("h", "k2", "mu", "F_n", *law.parameters)}
    common |= {"I": n["inertia"] * (1.0 + n["h"] ** 2) / 3.0, "x0": n.get("x0", 0.0)}
    common |= {"alpha1": angles[0], "alpha2": angles[1], "theta0": tilt_of(n), "V": SPEED_LIMIT}
    if not law.absolute_gap:
        return Pad(**common)
    # lifted from where its springs are relaxed, and still pressed in by the preload
    y0 = -n["F_n"] * (n["preload"] / n["k_c"] + n["lift"])
    return Pad(**common, y0=y0)


def arrays(many: Sequence[Numbers]) -> dict[str, np.ndarray]:
    """The numbers of n pads as arrays (n,)."""
    return {name: np.array([numbers[name] for numbers in many]) for name in many[0]}


def stacked(
    numbers: Mapping[str, np.ndarray], model: Model, case: str, formulation: Formulation
) -> PadModel:
    """The dimensionless pads of a model and a case, all parameters as arrays (n,)."""
    count = len(numbers["h"])
    given = pad_of(numbers, model, CASES[case]).given()
    columns: dict[str, Any] = {
        name: np.full(count, value, dtype=float) for name, value in given.items()
    }
    return PadModel(model, Pad(**columns), formulation)


def first_heights(numbers: Mapping[str, Any]) -> tuple[Any, Any]:
    """Initial y of the B1 and of the B2 scenes, arrays if the numbers are."""
    n = numbers
    return -n["first_y"] * n["F_n"] / (n["k3"] + n["k4"]), n["lift"] * n["F_n"]


def scenes_of(
    numbers: Numbers, formulation: Formulation, tolerance: float = 1e-12, stop: float = STOP
) -> dict[Model, dict[str, Scene]]:
    """The eight dimensionless scenes of a pad: model, then case. They start from rest."""
    heights = dict(zip(MODELS, first_heights(numbers), strict=True))
    return {
        model: {
            case: Scene(
                model,
                pad_of(numbers, model, angles),
                formulation if contact_model(model).choices else CONSISTENT,
                initial=(0.0, heights[model], 0.0, 0.0, 0.0, 0.0),
                stop=stop,
                samples=2,
                tolerance=tolerance,
            )
            for case, angles in CASES.items()
        }
        for model in MODELS
    }
