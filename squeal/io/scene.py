"""The scene: one validated, immutable request, and every key of its file in one table.

Those of the pad and the formulation stand in the model.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from squeal import schema
from squeal.model.contact import CONTACT_MODELS, FORMULATION, MODELS, Formulation, models_with
from squeal.model.equations import PadModel
from squeal.model.pad import PARAMETERS, Model, Pad
from squeal.schema import ANY, NOT_NEGATIVE, Group, Key, Number, Place, Several, Square, Word, row

OUTPUTS = ("events", "shares", "extrema", "response", "history")
DEFAULT_OUTPUTS = ("events", "shares", "extrema")
DEFAULT_TOLERANCE = 1e-15  # relative error of a step of a simulation
OF_SYSTEMS = ("M", "K", "K0", "components")  # one of these tells a file of matrices from a scene

# fmt: off
INITIAL = Group({
    "from": Key(
        "where the others count from: the origin, or the sliding equilibrium that "
        "`eigenvalues` takes, which they then kick",
        Word(("origin", "equilibrium")), default="origin"),
    "x": Key("displacement along the surface", ANY, "m", default="0"),
    "y": Key("displacement normal to the surface", ANY, "m", default="0"),
    "theta": Key("rotation", schema.Angle(), "rad", default="0"),
    "x_dot": Key("velocity along the surface", ANY, "m/s", default="0"),
    "y_dot": Key("velocity normal to the surface", ANY, "m/s", default="0"),
    "theta_dot": Key("rate of rotation", Number(), "rad/s", default="0"),
}, short="from")
COORDINATES = tuple(INITIAL.keys)[1:]
"""x, y, theta and their rates, as the keys of `initial` name them: all keys but the first, from."""

TIME = Group({
    "stop": Key("length of time", Number(low=0.0), "s", required=True),
    "samples": Key(
        "equally spaced times of the history, both ends included",
        schema.Whole(2, 10_000_000), required=True),
}, owner="time")

DAMPING = Group({
    "matrix": Key("3 x 3, in x, y and theta", Square(3), "SI units"),
    "ratios": Key(
        "3 modal damping ratios, of the modes without friction by rising frequency",
        row(3, NOT_NEGATIVE), "1"),
    "rayleigh": Key(
        "alpha (1/s) and beta (s) of C = alpha M + beta K, K without friction",
        row(2, NOT_NEGATIVE)),
}, only_one=True)

PAD = Group({
    name: dataclasses.replace(key, models=models_with(name)) for name, key in PARAMETERS.items()
})


def _models_that_choose(name: str) -> tuple[str, ...]:
    """The models whose equations have this choice."""
    return tuple(model for model, law in MODELS.items() if name in law.choices)


FORMULATIONS = Group({
    name: dataclasses.replace(key, models=_models_that_choose(name))
    for name, key in FORMULATION.keys.items()
})

SCENE = Group({
    "model": Key(
        "; ".join(f"{name} {model.words}" for name, model in MODELS.items()),
        Word(tuple(MODELS)), required=True),
    "parameters": Key("the pad and its load", PAD, required=True),
    "formulation": Key(
        "reading of the contact's equations", FORMULATIONS, default="the consistent one",
        models=tuple(name for name, model in MODELS.items() if model.choices)),
    "initial": Key(
        "first state; `equilibrium` alone starts at rest there",
        INITIAL, default="0", models=CONTACT_MODELS),
    "time": Key(
        "what is simulated; needed by `simulate` alone",
        TIME, default="no simulation", models=CONTACT_MODELS),
    "tolerance": Key(
        "relative error tolerance of a step",
        Number(low=0.0, high=1e-3), "1", default=f"{DEFAULT_TOLERANCE:g}"),
    "outputs": Key(
        "what a simulation computes and prints",
        Several(Word(OUTPUTS), f"a list of {', '.join(OUTPUTS)}", least=0),
        default=", ".join(DEFAULT_OUTPUTS)),
    "damping": Key(
        "linear damping -C q', in stability queries and simulations alike; ratios and rayleigh "
        "make C from the pad about its equilibrium without friction, and it is then the same "
        "in every contact state", DAMPING, default="none"),
}, owner="every scene")

# fmt: on


@dataclass(frozen=True)
class Damping:
    """Optional damping: one of a C matrix, three modal ratios and Rayleigh's two factors.

    matrix: rows of C (3, 3) in (x, y, theta), SI units; ratios: damping ratios of the three modes
    without friction, by rising frequency; rayleigh: alpha (1/s) and beta (s) of alpha M + beta K,
    K that without friction. Arrays become tuples. Raises InputError for anything else.

    Examples
    --------
    >>> Damping(ratios=[0.01, 0.01, 0.02]).ratios
    (0.01, 0.01, 0.02)
    """

    matrix: tuple[tuple[float, ...], ...] | None = None
    ratios: tuple[float, ...] | None = None
    rayleigh: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        for name, value in DAMPING.read(self.to_dict(), Place("Damping")).items():
            object.__setattr__(self, name, value)

    def to_dict(self) -> dict[str, Any]:
        """The damping as it stands in a scene file.

        Examples
        --------
        >>> Damping(rayleigh=(2.0, 1e-7)).to_dict()
        {'rayleigh': (2.0, 1e-07)}
        """
        return {name: value for name, value in vars(self).items() if value is not None}


@dataclass(frozen=True)
class Scene:
    """A pad, its contact model and what a simulation of it computes: the content of a scene file.

    `initial` is the first state (x, y, theta, x_dot, y_dot, theta_dot) in SI units. It counts from
    `start`: the origin, or the sliding equilibrium. `tolerance` is the relative error tolerance of
    a step; `stop` (s) and `samples` are None in a scene that names no time. Raises InputError, with
    the sentence that the same scene file would meet, for what is not allowed.

    Examples
    --------
    >>> import squeal
    >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
    ...                  alpha2=3.14, mu=0.3)
    >>> scene = squeal.Scene("B3", pad)
    >>> squeal.eigenvalues(scene).verdict
    'marginal'
    """

    model: Model
    pad: Pad
    formulation: Formulation = field(default_factory=Formulation)
    initial: tuple[float, ...] = (0.0,) * 6
    stop: float | None = None
    samples: int | None = None
    tolerance: float = DEFAULT_TOLERANCE
    outputs: tuple[str, ...] = DEFAULT_OUTPUTS
    damping: Damping | None = None
    start: str = "origin"
    source: Path | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        at = Place("Scene")
        schema.kind_of(Pad).read(self.pad, at / "pad")
        schema.kind_of(Formulation).read(self.formulation, at / "formulation")
        if self.damping is not None:
            schema.kind_of(Damping).read(self.damping, at / "damping")
        initial = row(len(COORDINATES)).read(self.initial, at / "initial")
        object.__setattr__(self, "initial", initial)
        _read(self.to_dict(), at)

    def to_dict(self) -> dict[str, Any]:
        """The scene as a mapping of a scene file's form, defaults left out.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
        ...                  alpha2=3.14, mu=0.3)
        >>> damping = squeal.Damping(ratios=(0.01, 0.01, 0.01))
        >>> document = squeal.Scene("B3", pad, damping=damping).to_dict()
        >>> sorted(document), document["damping"]
        (['damping', 'model', 'parameters'], {'ratios': (0.01, 0.01, 0.01)})
        """
        initial: dict[str, Any] = {}
        if self.start != "origin":
            initial["from"] = self.start
        for name, value in zip(COORDINATES, self.initial, strict=True):
            if value != 0.0:
                initial[name] = value
        time: dict[str, float] = {}
        if self.stop is not None:
            time["stop"] = self.stop
        if self.samples is not None:
            time["samples"] = self.samples
        groups = {
            "formulation": self.formulation.to_dict(),
            "initial": initial,
            "time": time,
            "damping": {} if self.damping is None else self.damping.to_dict(),
        }
        document: dict[str, Any] = {"model": self.model, "parameters": self.pad.to_dict()}
        for name, group in groups.items():
            if group:
                document[name] = group
        if self.tolerance != DEFAULT_TOLERANCE:
            document["tolerance"] = self.tolerance
        if self.outputs != DEFAULT_OUTPUTS:
            document["outputs"] = list(self.outputs)
        return document

    @staticmethod
    def from_dict(document: dict[str, Any], at: Place, source: Path | None = None) -> Scene:
        """The scene in a mapping of a scene file's form; `at` tells messages where it stands.

        Raises InputError with one sentence on the first thing that is wrong.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
        ...                  alpha2=3.14, mu=0.3)
        >>> scene = squeal.Scene("B3", pad)
        >>> from squeal.schema import Place
        >>> squeal.Scene.from_dict(scene.to_dict(), Place("my scene")) == scene
        True
        """
        keys = _read(document, at)
        for name, parameter in PARAMETERS.items():
            if parameter.angle and name in keys["parameters"]:
                schema.warn_of_degrees(document["parameters"][name], at / "parameters" / name)
        initial = keys.get("initial", {})
        time = keys.get("time", {})
        return Scene(
            model=keys["model"],
            pad=Pad(**keys["parameters"]),
            formulation=Formulation(**keys.get("formulation", {})),
            initial=tuple(initial.get(name, 0.0) for name in COORDINATES),
            stop=time.get("stop"),
            samples=time.get("samples"),
            tolerance=keys.get("tolerance", DEFAULT_TOLERANCE),
            outputs=keys.get("outputs", DEFAULT_OUTPUTS),
            damping=Damping(**keys["damping"]) if "damping" in keys else None,
            start=initial.get("from", "origin"),
            source=source,
        )

    def replace(self, **changes: Any) -> Scene:
        """A copy with some fields of the scene or parameters of the pad changed.

        A moment of inertia that was left out follows m, w and h. Raises InputError.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
        ...                  alpha2=3.14, mu=0.3)
        >>> scene = squeal.Scene("B3", pad).replace(mu=0.5, tolerance=1e-10)
        >>> scene.pad.mu, scene.tolerance
        (0.5, 1e-10)
        """
        pad = changes.pop("pad", self.pad)
        changes_of_scene = {}
        for name in vars(self):
            if name in changes:
                changes_of_scene[name] = changes.pop(name)
        if changes:  # what remains are parameters of the pad
            pad = pad.replace(**changes)
        return dataclasses.replace(self, pad=pad, **changes_of_scene)

    @property
    def pad_model(self) -> PadModel:
        """The pad under the contact model that the scene names."""
        return PadModel(self.model, self.pad, self.formulation)


def is_system(document: Mapping[str, Any]) -> bool:
    """Whether a document describes matrices, or components, rather than a pad."""
    return not document.keys().isdisjoint(OF_SYSTEMS)


def _read(document: object, at: Place) -> dict[str, Any]:
    """The values of a mapping of a scene file's form, converted. Raises InputError."""
    # "" if the model is unknown: `SCENE.read` then refuses the model, not a key that it lacks
    model = ""
    if isinstance(document, dict):  # `SCENE.read` refuses anything else
        if is_system(document) and "model" not in document:
            key = next(key for key in OF_SYSTEMS if key in document)
            raise (at / key).refuse("a system of matrices is not allowed here; it must be a scene")
        # looked up in a tuple, as a list or a mapping in place of the model has no hash
        if document.get("model") in tuple(MODELS):
            model = document["model"]
    keys = SCENE.read(document, at, model)
    initial = keys.get("initial", {})
    # counted from an equilibrium, theta adds to an angle that is not known here
    theta = 0.0
    if initial.get("from", "origin") == "origin":
        theta = initial.get("theta", 0.0)
    if abs(keys["parameters"].get("theta0", 0.0) + theta) >= math.pi / 2:
        words = f"such that theta0 + theta lies between -{math.pi / 2:.6g} and {math.pi / 2:.6g}"
        raise (at / "initial" / "theta").must_be(theta, words)
    return keys


def check_simulation(scene: Scene) -> None:
    """Refuse a scene that cannot be simulated. Raises InputError."""
    pad = scene.pad
    at = Place(str(scene.source or "Scene"))
    if scene.model not in CONTACT_MODELS:
        words = f"one of {', '.join(CONTACT_MODELS)}; {scene.model} is a linearisation"
        raise (at / "model").must_be(scene.model, words)
    if scene.stop is None:
        raise (at / "time").refuse(
            "missing; a simulation needs it, such as {stop: 0.05, samples: 5001}"
        )
    x_dot = scene.initial[3]
    # the law of friction that falls with speed holds for a sliding speed V - x_dot above 0
    if pad.fall is not None and x_dot >= cast(float, pad.V):
        words = f"below V = {pad.V:g} where friction falls with speed"
        raise (at / "initial" / "x_dot").must_be(x_dot, words)
    forces = [output for output in ("extrema", "history") if output in scene.outputs]
    if forces and pad.F_n == 0.0:
        words = f"above 0 for the output {forces[0]}, which gives forces over F_n"
        raise (at / "parameters" / "F_n").must_be(pad.F_n, words)


def read_scene(path: str | Path) -> Scene:
    """Read a scene file. Raises InputError with one sentence on the first thing that is wrong.

    Examples
    --------
    >>> import squeal
    >>> from pathlib import Path
    >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
    ...                  alpha2=3.14, mu=0.3)
    >>> _ = Path("pad.yaml").write_text(str(squeal.Scene("B3", pad).to_dict()))
    >>> squeal.read_scene("pad.yaml").pad.mu
    0.3
    """
    document, at = schema.read_document(path)
    return Scene.from_dict(document, at, Path(path))
