"""Values and the table of parameters: value, unit and origin, from the article's scenes."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from squeal.article.cases import CASES
from squeal.article.report.latex import Generated, escape, in_words, long_table, number, typeset
from squeal.io.scene import Scene, read_scene
from squeal.io.scene_keys import COORDINATES
from squeal.model.contact import models_with
from squeal.model.pad import PARAMETERS

_SEARCH = "by search"
ORIGIN = {
    "m": "assumed: pad and back plate; unit of mass",
    "w": "assumed: a car's pad; unit of length",
    "h": "by search",
    "I": "by search; {I_ratio} times a rectangle's",
    "k1": "assumed: sets the unit of time for squeal",
    "alpha1": "printed: one value for each case",
    "alpha2": "printed: one value for each case",
    "V": "assumed: faster than the pad",
    "x0": "default; no force depends on it",
    "y0": "by search; B2 starts pressed in and lifted",
    "y": "by search; B1 starts pressed in",
}
"""Where a value comes from; what is not named here was found by search or is zero by default."""

SYMBOL = {"F_n": "$F_n$", "k_c": "$k_c$", "V": "$V$", "I": "$I$", "m": "$m$"}


def _common(values: Iterable[float | None]) -> str:
    """The value that some scenes have in common, or that it goes by case."""
    one, *others = set(values)
    return "by case" if others else number(one, 6)


def _origin(key: str, shown: Sequence[str], inertia_ratio: float) -> str:
    text = ORIGIN.get(key, "default" if set(shown) <= {"$0$", "--"} else _SEARCH)
    return text.replace("{I_ratio}", number(inertia_ratio, 4))


def parameter_rows(b1: Sequence[Scene], b2: Sequence[Scene]) -> list[list[str]]:
    """Rows symbol, meaning, unit, value in B1, value in B2, origin; initial values at the end."""
    pad = b1[0].pad
    ratio = pad.I / (pad.m * (pad.w**2 + pad.h**2) / 3.0)
    rows = []
    for key, parameter in PARAMETERS.items():
        shown = [
            _common(getattr(scene.pad, key) for scene in scenes)
            if model in models_with(key)
            else "--"
            for model, scenes in (("B1", b1), ("B2", b2))
        ]
        if set(shown) == {"--"}:  # nothing that the article has
            continue
        symbol = SYMBOL.get(key, typeset(key))
        unit = parameter.unit.replace("kg m^2", r"kg\,m$^2$")
        rows.append([symbol, parameter.meaning, unit, *shown, _origin(key, shown, ratio)])
    units = ("m", "m", "rad", "m/s", "m/s", "rad/s")
    for index, (key, unit) in enumerate(zip(COORDINATES, units, strict=True)):
        shown = [_common(scene.initial[index] for scene in scenes) for scenes in (b1, b2)]
        if set(shown) != {"$0$"}:
            rows.append([_initial(key), "initial value", unit, *shown, _origin(key, shown, ratio)])
    return rows


def _initial(key: str) -> str:
    symbol = typeset(key.removesuffix("_dot")).strip("$")
    return rf"$\dot {symbol}(0)$" if key.endswith("_dot") else f"${symbol}(0)$"


def start(scenes: Sequence[Scene]) -> str:
    """Which initial values are zero in all scenes, so that no row has them, and how long these
    last."""
    places, rates = COORDINATES[:3], COORDINATES[3:]
    zero = [key for i, key in enumerate(COORDINATES) if not any(one.initial[i] for one in scenes)]
    still = [_initial(key) for key in places if key in zero]
    rest = "at rest" if set(rates) <= set(zero) else "as given"
    at = rf", with {in_words(still)} zero" if still else ""
    stops = sorted({one.stop or 0.0 for one in scenes})
    spans = in_words([rf"{number(1e3 * stop)}\,ms" for stop in stops])
    return f"All scenes start {rest}{at}, and last {spans}."


def angle(value: float) -> str:
    """An angle as a multiple of pi, for use in math mode."""
    factor = f"{value / math.pi:.6g}"
    return r"\pi" if factor == "1" else rf"{factor}\,\pi"


def values(b1: Sequence[Scene], b2: Sequence[Scene]) -> dict[str, str]:
    """Angles of the cases, and what the scenes have in common."""
    formulation = b2[0].formulation
    told = {
        "formulation": escape(
            f"line force {formulation.line_force}, delta from the {formulation.delta_from}, "
            f"moment of the reaction with the sign {formulation.delta_moment}"
        )
    }
    for case, scene in zip(CASES, b1, strict=True):
        told[f"case.{case}.alpha1"] = angle(scene.pad.alpha1)
        told[f"case.{case}.alpha2"] = angle(scene.pad.alpha2)
    return told


def generated(*files: Path) -> Generated:
    """Values and the table, from the four scenes of B1 and the four of B2."""
    scenes = [read_scene(file) for file in files]
    b1, b2 = scenes[: len(CASES)], scenes[len(CASES) :]
    head = ["symbol", "meaning", "unit", "B1", "B2", "origin"]
    told = values(b1, b2) | {"parameters.start": start(scenes)}
    return told, {"parameters": long_table(head, parameter_rows(b1, b2))}
