"""From a scene file to a validated `Scene`; everything is checked before anything runs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Literal

from squeal.files.document import read_document
from squeal.files.values import Keys, angle, choice, mapping, number, shown
from squeal.model.contact import FORMULATION_CHOICES, Formulation
from squeal.model.pad import MODELS, PARAMETERS, Model, Pad
from squeal.scene.schema import (
    COORDINATES,
    DEFAULT_OUTPUTS,
    DEFAULT_TOLERANCE,
    MAX_TOLERANCE,
    OUTPUTS,
    SAMPLES,
    Damping,
    Scene,
)

KEYS = [
    "model",
    "parameters",
    "formulation",
    "initial",
    "time",
    "tolerance",
    "outputs",
    "damping",
]
_NOT_B3 = {"initial", "time"}


def _parameters(given: Any, at: Keys, model: Model) -> Pad:
    mapping(given, at, list(PARAMETERS))
    values: dict[str, float] = {}
    for name, p in PARAMETERS.items():
        here = at / name
        if name not in given:
            if p.required and model in p.models:
                raise here.refuse(f"missing; model {model} needs it ({p.meaning}, {p.unit})")
            continue
        if model not in p.models:
            raise here.refuse(
                f"{shown(given[name])} is not allowed; model {model} does not use it, leave it out"
            )
        read = angle if p.angle else number
        values[name] = read(given[name], here, p.allowed())
        if not p.admits(values[name]):
            raise here.refuse(f"{shown(given[name])} is not allowed; it must be {p.allowed()}")
    return Pad(**values)


def _formulation(given: Any, at: Keys, model: Model) -> Formulation:
    if model == "B1":
        raise at.refuse(f"{shown(given)} is not allowed; model B1 has no formulation, leave it out")
    mapping(given, at, list(FORMULATION_CHOICES))
    words: dict[str, Any] = {
        key: choice(value, at / key, FORMULATION_CHOICES[key]) for key, value in given.items()
    }
    return Formulation(**words)


def _initial(given: Any, at: Keys) -> tuple[float, ...]:
    mapping(given, at, list(COORDINATES))
    return tuple(
        (angle if name == "theta" else number)(given[name], at / name) if name in given else 0.0
        for name in COORDINATES
    )


def _time(given: Any, at: Keys) -> tuple[float, int]:
    mapping(given, at, ["stop", "samples"])
    for key in ("stop", "samples"):
        if key not in given:
            raise (at / key).refuse("missing; time needs stop (s) and samples")
    stop = number(given["stop"], at / "stop", "a finite number above 0")
    if stop <= 0.0:
        raise (at / "stop").refuse(f"{shown(stop)} is not allowed; it must be above 0")
    samples = given["samples"]
    low, high = SAMPLES
    if isinstance(samples, bool) or not isinstance(samples, int) or not low <= samples <= high:
        raise (at / "samples").refuse(
            f"{shown(samples)} is not allowed; it must be a whole number from {low} to {high}"
        )
    return stop, samples


def _tolerance(given: Any, at: Keys) -> float:
    allowed = f"a number above 0 and at most {MAX_TOLERANCE:g}"
    value = number(given, at, allowed)
    if not 0.0 < value <= MAX_TOLERANCE:
        raise at.refuse(f"{shown(given)} is not allowed; it must be {allowed}")
    return value


def _outputs(given: Any, at: Keys) -> tuple[str, ...]:
    if not isinstance(given, list):
        raise at.refuse(f"{shown(given)} is not allowed; it must be a list of {', '.join(OUTPUTS)}")
    for entry in given:
        choice(entry, at, OUTPUTS)
    return tuple(name for name in OUTPUTS if name in given)


def _numbers(given: Any, at: Keys, low: float) -> tuple[float, ...]:
    allowed = "a list of 3 finite numbers" + (f" of at least {low:g}" if low > -math.inf else "")
    if not isinstance(given, list) or len(given) != 3:
        raise at.refuse(f"{shown(given)} is not allowed; it must be {allowed}")
    values = tuple(number(value, at, allowed) for value in given)
    if min(values) < low:
        raise at.refuse(f"{shown(given)} is not allowed; it must be {allowed}")
    return values


def _damping(given: Any, at: Keys) -> Damping:
    mapping(given, at, ["matrix", "ratios"])
    if len(given) != 1:
        raise at.refuse("it must hold one of matrix (3 x 3) and ratios (3 modal damping ratios)")
    if "ratios" in given:
        return Damping(ratios=_numbers(given["ratios"], at / "ratios", 0.0))
    rows, here = given["matrix"], at / "matrix"
    if not isinstance(rows, list) or len(rows) != 3:
        raise here.refuse(f"{shown(rows)} is not allowed; it must be a list of 3 rows")
    return Damping(
        matrix=tuple(_numbers(row, here / f"row {i}", -math.inf) for i, row in enumerate(rows, 1))
    )


def read_scene(path: str | Path, purpose: Literal["simulate", "query"] = "query") -> Scene:
    """Read and validate a scene file.

    `purpose` "simulate" asks for a nonlinear model and its time; queries need neither.
    Raises InputError with one sentence on the first thing that is wrong.
    """
    path = Path(path)
    document = read_document(path)
    at = Keys(str(path))
    mapping(document, at, KEYS)
    for key in ("model", "parameters"):
        if key not in document:
            raise (at / key).refuse("missing; every scene needs it")
    model: Any = choice(document["model"], at / "model", MODELS)
    pad = _parameters(document["parameters"], at / "parameters", model)
    if model == "B3":
        for key in sorted(_NOT_B3 & document.keys()):
            raise (at / key).refuse(
                f"{shown(document[key])} is not allowed; model B3 is a linearisation about the "
                "origin and does not use it, leave it out"
            )
        if purpose == "simulate":
            raise (at / "model").refuse(
                "B3 is not allowed; only B1 and B2 can be simulated, B3 is a linearisation"
            )
    if "damping" in document and purpose == "simulate":
        raise (at / "damping").refuse(
            f"{shown(document['damping'])} is not allowed in a simulation, whose equations have "
            "no damping; it belongs to the stability queries, leave it out"
        )
    stop, samples = None, None
    if "time" in document:
        stop, samples = _time(document["time"], at / "time")
    elif purpose == "simulate":
        raise (at / "time").refuse("missing; a simulation needs time.stop and time.samples")
    scene = Scene(
        model=model,
        pad=pad,
        formulation=_formulation(document["formulation"], at / "formulation", model)
        if "formulation" in document
        else Formulation(),
        initial=_initial(document["initial"], at / "initial")
        if "initial" in document
        else (0.0,) * 6,
        stop=stop,
        samples=samples,
        tolerance=_tolerance(document["tolerance"], at / "tolerance")
        if "tolerance" in document
        else DEFAULT_TOLERANCE,
        outputs=_outputs(document["outputs"], at / "outputs")
        if "outputs" in document
        else DEFAULT_OUTPUTS,
        damping=_damping(document["damping"], at / "damping") if "damping" in document else None,
        source=path,
    )
    _check_together(scene, at, purpose)
    return scene


def _check_together(scene: Scene, at: Keys, purpose: str) -> None:
    """What single values cannot tell: rotation within the model, forces over a zero F_n."""
    low_high = PARAMETERS["theta0"].high
    tilt = scene.pad.theta0 + scene.initial[2]
    if abs(tilt) >= low_high:
        raise (at / "initial" / "theta").refuse(
            f"{shown(scene.initial[2])} is not allowed; theta0 + theta must lie between "
            f"-{low_high:.6g} and {low_high:.6g} (the lower face faces the surface)"
        )
    if purpose == "simulate" and scene.pad.F_n == 0.0:
        for output in ("extrema", "history"):
            if scene.wants(output):
                raise (at / "parameters" / "F_n").refuse(
                    f"0 is not allowed with the output {output}, which gives forces over F_n; "
                    "it must be above 0, or leave that output out"
                )
