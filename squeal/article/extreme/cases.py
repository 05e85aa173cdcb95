"""The suite: what is extreme about each case, its scene, and what its outcome must be."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

from squeal.article.extreme import closed_forms as known
from squeal.io.scene import Scene
from squeal.model.contact import contact_law
from squeal.model.pad import Model, Pad
from squeal.simulation import Simulation
from squeal.simulation.hybrid import COLLAPSED

Truth = Literal["quad", "scaled", "energy", "closed form", "refusal", "warning"]
PERIODS = 10_000  # of the long run in each build; `--long` takes a hundred times as many


@dataclass(frozen=True)
class Case:
    """A scene with what its outcome is held against.

    error: for a closed form, the relative error of a result; time: for a refusal or a warning,
    when it must come (None: before anything runs); units: for `scaled`, mass, length and time of
    the other units in which the same pad must move alike; text: a scene file that must be refused.
    """

    group: str
    name: str
    scene: Scene
    truth: Truth = "quad"
    error: Callable[[Scene, Simulation], float] | None = None
    time: float | None = None
    words: str = ""
    units: tuple[float, float, float] = (1.0, 1.0, 1.0)
    text: str = ""


# fmt: off
_PAD: dict[str, Any] = {
    "m": 1.0, "w": 1.0, "h": 0.35, "k1": 1.0, "k2": 1.3, "L1": 20.0, "L2": 20.0,
    "alpha1": 0.75 * math.pi, "alpha2": 0.75 * math.pi, "mu": 0.6, "F_n": 0.0057,
}
# fmt: on
_CONTACT: dict[Model, dict[str, float]] = {"B1": {"k3": 0.43, "k4": 0.43}, "B2": {"k_c": 0.5}}
BOTH: tuple[Model, ...] = ("B1", "B2")


def pad_of(model: Model, **changes: Any) -> Pad:
    """The dimensionless pad of the suite (w = m = k1 = 1) with some changes."""
    return Pad(**(_PAD | _CONTACT[model] | changes))


def scene_of(model: Model, stop: float, start: Any = None, **changes: Any) -> Scene:
    """A scene that starts pressed in by twice the static depth, or as `start` says."""
    pad = pad_of(model, **changes)
    contact = sum(getattr(pad, name) or 0.0 for name in contact_law(model).parameters)
    first = {"y": -2.0 * pad.F_n / (contact or 1.0)} if start is None else start
    names = ("x", "y", "theta", "x_dot", "y_dot", "theta_dot")
    initial = tuple(first.get(n, 0.0) for n in names)
    return Scene(model, pad, initial=initial, stop=stop, samples=2)


def _stiff() -> Iterator[Case]:
    for power in (3, 6, 9, 12):
        k = 10.0**power
        for model in BOTH:
            stiff = dict.fromkeys(contact_law(model).parameters, k)
            scene = scene_of(model, 60.0 / math.sqrt(k), **stiff)
            yield Case("contact stiffness", f"{model}, 1e{power} k1", scene)


def _lengths() -> Iterator[Case]:
    for model in BOTH:
        for L in (1e-2, 1.0, 1e4, 1e8):
            scene = scene_of(model, 20.0, L1=L, L2=L)
            yield Case("free length", f"{model}, L/w = {L:g}", scene)


def _tilts() -> Iterator[Case]:
    level = {"alpha1": math.pi / 2, "alpha2": math.pi / 2, "k2": 1.0, "mu": 0.0}
    yield Case("level face (pole of Eq. 12)", "tilt swings through 0", scene_of("B2", 30.0))
    for tilt in (0.0, 1e-15, -1e-15, 1e-9):
        scene = scene_of("B2", 20.0, theta0=tilt, **level)
        yield Case("level face (pole of Eq. 12)", f"held at {tilt:g} rad", scene)


def _touching() -> Iterator[Case]:
    pad = known.upright()
    rate = math.sqrt((pad.k1 + pad.k2 + pad.k3 + pad.k4) / pad.m)
    wanted = {"outputs": ("events", "shares", "history"), "samples": 1001}
    graze = Scene("B1", pad, initial=(0.0,) * 6, stop=200.0 / rate, **wanted)  # type: ignore[arg-type]
    form: dict[str, Any] = {"truth": "closed form"}
    yield Case("grazing", "B1, zero each cycle", graze, error=known.grazing_error, **form)
    sag = pad.F_n / (pad.k1 + pad.k2)
    for share in (1e-12, 1e-9, 1e-6, 1e-3, 10.0):
        height = share * sag
        stop = 4.5 * known.bounce_period(pad, height)
        scene = replace(graze, initial=(0.0, height, 0.0, 0.0, 0.0, 0.0), stop=stop)
        group = "both edges at once" if share > 1.0 else "separations shorter than a step"
        words = f"mu = 0, dropped from {share:g} static depths"
        yield Case(group, words, scene, error=known.bounce_error, **form)
    for model in BOTH:
        at_rest = scene_of(model, 20.0, {"y": 0.0})
        yield Case("start on the switching surface", f"{model}, at rest", at_rest)
        for speed in (0.01, -0.01):
            scene = scene_of(model, 20.0, {"y": 0.0, "y_dot": speed})
            yield Case("start on the switching surface", f"{model}, y_dot = {speed:g}", scene)


def _parameters() -> Iterator[Case]:
    for model in BOTH:
        for mu in (0.0, 1.0, 10.0):
            yield Case("friction", f"{model}, mu = {mu:g}", scene_of(model, 15.0, mu=mu))
        for F_n, start in ((1e-12, None), (0.0, {"y": -0.01})):
            scene = scene_of(model, 20.0, start, F_n=F_n)
            yield Case("load", f"{model}, F_n = {F_n:g} k1 w", replace(scene, outputs=("events",)))
        for missing in ("k1", "k2"):
            scene = scene_of(model, 20.0, **{missing: 0.0})
            yield Case("springs", f"{model}, {missing} = 0", scene)
        for shape, ratio in (("flat", 1e-6), ("tower", 1e3)):
            yield Case(
                "shape", f"{model}, {shape}, h/w = {ratio:g}", scene_of(model, 20.0, h=ratio)
            )
    pulled = _PAD | _CONTACT["B1"] | {"F_n": -1.0}
    text = f"model: B1\nparameters: {pulled}\ntime: {{stop: 1.0, samples: 2}}\n".replace("'", "")
    scene = scene_of("B1", 1.0, {"y": 0.0})
    yield Case("load", "F_n < 0", scene, "refusal", words="F_n", text=text)
    yield Case("springs", "B1, k1 = k2 = 0", scene_of("B1", 10.0, k1=0.0, k2=0.0))
    for a1, a2 in ((0.0, math.pi), (0.0, 0.0), (math.pi, math.pi), (math.pi / 2, math.pi / 2)):
        words = f"alpha1, alpha2 = {a1 / math.pi:g} pi, {a2 / math.pi:g} pi"
        yield Case("angles", words, scene_of("B1", 15.0, alpha1=a1, alpha2=a2))


def _units() -> Iterator[Case]:
    scaled: tuple[tuple[Model, str, tuple[float, float, float]], ...] = (
        ("B1", "mass 1e-6", (1e-6, 1.0, 1e-3)),
        ("B1", "mass 1e6", (1e6, 1.0, 1e3)),
        ("B2", "tonne, mm, s", (1e3, 1e-3, 1.0)),
        ("B2", "g, km, h", (1e-3, 1e3, 3600.0)),
    )
    for model, words, units in scaled:
        name = f"{model}, {words}"
        yield Case("masses and units", name, scene_of(model, 50.0), "scaled", units=units)


def _ends() -> Iterator[Case]:
    flying = known.upright(k1=0.0, k2=0.0, F_n=1.0)
    for tilt in (0.0, 0.4):
        scene = Scene(
            "B1", flying.replace(theta0=tilt), initial=(0, 5.0, 0, 0, 0, 40.0), stop=1.0, samples=2
        )
        time = known.overturn_time(scene)
        words = "past 90 degrees"
        yield Case(
            "limits", f"free flight from {tilt:g} rad", scene, "refusal", time=time, words=words
        )
    thrown = Scene("B1", known.upright(), initial=(0, 1e-3, 0, 0, 400.0, 0), stop=0.01, samples=2)
    time = known.collapse_time(thrown, COLLAPSED)
    yield Case("limits", "springs collapse", thrown, "refusal", time=time, words="collapsed")
    level = known.upright(h=1e-9, alpha1=math.pi, alpha2=math.pi, F_n=1e-6, V=1.0)
    rate = math.sqrt((level.k1 + level.k2) / level.m)
    for excess in (-1e-6, 1e-6, 0.5):
        start = (-(1.0 + excess) / rate, 0.0, 0.0, 0.0, 0.0, 0.0)
        scene = Scene("B1", level, initial=start, stop=20.0 / rate, samples=2)
        time = known.outrun_time(scene)
        words = f"fastest at {1.0 + excess:.7g} V"
        yield Case("speed of the surface", words, scene, "warning", time=time)


def _long() -> Iterator[Case]:
    for model in BOTH:
        scene = replace(scene_of(model, 2 * math.pi * PERIODS, mu=0.0), outputs=())
        yield Case("long runs", f"{model}, {PERIODS} periods, mu = 0", scene, "energy")


CASES: tuple[Case, ...] = tuple(
    case
    for family in (_stiff, _lengths, _tilts, _touching, _parameters, _units, _ends, _long)
    for case in family()
)
