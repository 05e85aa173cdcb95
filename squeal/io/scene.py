"""The scene: one validated, immutable request; `squeal.io.scene_keys` says what it may hold."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from typing import Any, Concatenate, Literal, ParamSpec, TypeVar, cast

import numpy as np

from squeal.io import scene_keys as keys
from squeal.io.document import read_document
from squeal.model.contact import CONSISTENT, CONTACT_MODELS, MODELS, Formulation
from squeal.model.equations import PadModel
from squeal.model.pad import PARAMETERS, Model, Pad
from squeal.schema.arguments import FILE, Instance, takes
from squeal.schema.place import Place, shown
from squeal.schema.values import Row, warn_of_degrees

P = ParamSpec("P")
Answer = TypeVar("Answer")
AT_REST = (0.0,) * 6


@dataclass(frozen=True)
class Damping:
    """Optional damping: one of a C matrix, three modal ratios and Rayleigh's two factors.

    matrix: rows of C (3, 3) in (x, y, theta), SI units; ratios: damping ratios of the three modes
    without friction, by rising frequency; rayleigh: alpha (1/s) and beta (s) of alpha M + beta K,
    K that without friction. Arrays become tuples. Raises InputError for anything else.
    """

    matrix: tuple[tuple[float, ...], ...] | None = None
    ratios: tuple[float, ...] | None = None
    rayleigh: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        given = {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in self.to_dict().items()
        }
        for name, value in keys.DAMPING.read(given, Place("Damping")).items():
            object.__setattr__(self, name, value)

    def to_dict(self) -> dict[str, Any]:
        """As it stands in a scene file."""
        return {name: value for name, value in vars(self).items() if value is not None}


# fields of a scene that are records
RECORDS = {
    "pad": Instance(Pad, "a Pad"),
    "formulation": Instance(Formulation, "a Formulation"),
    "damping": Instance((Damping, type(None)), "a Damping"),
}


@dataclass(frozen=True, repr=False)
class Scene:
    """What a scene file asks for; `initial` is (x, y, theta, x_dot, y_dot, theta_dot) in SI units.

    It counts from `start`: the origin, or the sliding equilibrium. `tolerance` is the relative
    error tolerance of a step; `stop` (s) and `samples` are None in a scene that names no time.
    Raises InputError, with the sentence that the same scene file would meet, for whatever is not
    allowed.
    """

    model: Model
    pad: Pad
    formulation: Formulation = CONSISTENT
    initial: tuple[float, ...] = AT_REST
    stop: float | None = None
    samples: int | None = None
    tolerance: float = keys.DEFAULT_TOLERANCE
    outputs: tuple[str, ...] = keys.DEFAULT_OUTPUTS
    damping: Damping | None = None
    start: str = "origin"
    source: Path | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        at = Place("Scene")
        for name, kind in RECORDS.items():
            kind.read(getattr(self, name), at / name)
        Row(len(keys.COORDINATES)).read(self.initial, at / "initial")
        check_document(self.to_dict(), at)

    def to_dict(self) -> dict[str, Any]:
        """The scene as a mapping of a scene file's form, defaults left out."""
        initial = zip(keys.COORDINATES, self.initial, strict=True)
        time = {"stop": self.stop, "samples": self.samples}
        found: dict[str, Any] = {
            "model": self.model,
            "parameters": self.pad.to_dict(),
            "formulation": self.formulation.to_dict(),
            "initial": {"from": self.start} if self.start != keys.STARTS[0] else {},
            "time": {name: value for name, value in time.items() if value is not None},
            "damping": {} if self.damping is None else self.damping.to_dict(),
        }
        found["initial"] |= {name: value for name, value in initial if value}
        found = {name: value for name, value in found.items() if value}
        if self.tolerance != keys.DEFAULT_TOLERANCE:
            found["tolerance"] = self.tolerance
        if self.outputs != keys.DEFAULT_OUTPUTS:
            found["outputs"] = list(self.outputs)
        return found

    @staticmethod
    def from_dict(document: Any, at: Place, source: Path | None = None) -> Scene:
        """The scene in a mapping of a scene file's form; `at` tells messages where it stands.

        Raises InputError with one sentence on the first thing that is wrong.
        """
        given = check_document(document, at)
        for name, parameter in PARAMETERS.items():
            if parameter.angle and name in given["parameters"]:
                warn_of_degrees(document["parameters"][name], at / "parameters" / name)
        more: dict[str, Any] = {n: v for n, v in given.items() if n in ("tolerance", "outputs")}
        if "damping" in given:
            more["damping"] = Damping(**given["damping"])
        first = given.get("initial", {})
        return Scene(
            given["model"],
            Pad(**given["parameters"]),
            Formulation(**given.get("formulation", {})),
            tuple(first.get(name, 0.0) for name in keys.COORDINATES),
            **given.get("time", {}),
            **more,
            start=first.get("from", keys.STARTS[0]),
            source=source,
        )

    def replace(self, **changes: Any) -> Scene:
        """A copy with some parameters of the pad or fields of the scene changed.

        A moment of inertia that was left out follows m, w and h. Raises InputError.
        """
        fields = {f.name for f in dataclasses.fields(self)}
        of_pad = {name: changes.pop(name) for name in list(changes) if name in PARAMETERS}
        for name in changes:
            if name not in fields:
                allowed = ", ".join([*PARAMETERS, *sorted(fields)])
                raise (Place("Scene") / name).refuse(f"unknown key; allowed are {allowed}")
        pad = RECORDS["pad"].read(changes.pop("pad", self.pad), Place("Scene") / "pad")
        return dataclasses.replace(self, pad=pad.replace(**of_pad), **changes)

    def __repr__(self) -> str:
        more = {k: v for k, v in self.to_dict().items() if k not in ("model", "parameters")}
        words = "".join(f", {name}={value}" for name, value in more.items())
        return f"Scene({self.model!r}, {self.pad!r}{words})"

    @property
    def pad_model(self) -> PadModel:
        """The pad under the contact model that the scene names."""
        return PadModel(self.model, self.pad, self.formulation)

    def wants(self, output: str) -> bool:
        """True if the scene names this output."""
        return output in self.outputs


def takes_scene(
    function: Callable[Concatenate[Scene, P], Answer],
) -> Callable[Concatenate[Scene, P], Answer]:
    """The same function, refusing with a sentence what is no scene in its first place."""

    @wraps(function)
    def checked(scene: Scene, *args: P.args, **more: P.kwargs) -> Answer:
        if not isinstance(scene, Scene):
            raise Place(function.__name__).must_be(scene, "a Scene, from read_scene or Scene(...)")
        return function(scene, *args, **more)

    return cast(Any, checked)  # a scene may also be given by its name


def check_document(document: Any, at: Place) -> dict[str, Any]:
    """The values of a mapping of a scene file's form, converted. Raises InputError."""
    if isinstance(document, dict) and "M" in document and "model" not in document:
        raise (at / "M").refuse("a system of matrices is not allowed here; it must be a scene")
    model = document.get("model", "") if isinstance(document, dict) else ""
    given = keys.SCENE.read(
        document, at, model if isinstance(model, str) and model in MODELS else ""
    )
    tilt = given["parameters"].get("theta0", 0.0)
    first = given.get("initial", {})
    turn = first.get("theta", 0.0) if first.get("from") in (None, keys.STARTS[0]) else 0.0
    if abs(tilt + turn) >= math.pi / 2:
        raise (at / "initial" / "theta").refuse(
            f"{shown(turn)} is not allowed; theta0 + theta must lie between "
            f"-{math.pi / 2:.6g} and {math.pi / 2:.6g} (the lower face faces the surface)"
        )
    return given


def check_simulation(scene: Scene, at: Place) -> None:
    """Refuse a scene that cannot be simulated. Raises InputError."""
    if scene.model not in CONTACT_MODELS:
        raise (at / "model").refuse(
            f"{scene.model} is not allowed; only {', '.join(CONTACT_MODELS)} can be simulated, "
            f"{scene.model} is a linearisation"
        )
    if scene.stop is None:
        raise (at / "time").refuse("missing; a simulation needs time.stop and time.samples")
    if scene.pad.fall is not None and scene.initial[3] >= cast(float, scene.pad.V):
        raise (at / "initial" / "x_dot").refuse(
            f"{shown(scene.initial[3])} is not allowed with friction that falls with speed; it "
            f"must be below V = {scene.pad.V:g}"
        )
    if scene.pad.F_n == 0.0:
        for output in ("extrema", "history"):
            if scene.wants(output):
                raise (at / "parameters" / "F_n").refuse(
                    f"0 is not allowed with the output {output}, which gives forces over F_n; "
                    "it must be above 0, or leave that output out"
                )


@takes(path=FILE)
def read_scene(path: str | Path, purpose: Literal["simulate", "query"] = "query") -> Scene:
    """Read and validate a scene file.

    `purpose` "simulate" asks for a nonlinear model and its time; queries need neither.
    Raises InputError with one sentence on the first thing that is wrong.
    """
    path = Path(path)
    at = Place(str(path))
    scene = Scene.from_dict(read_document(path), at, path)
    if purpose == "simulate":
        check_simulation(scene, at)
    return scene
