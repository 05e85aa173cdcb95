"""Stiff and extreme pads: the error of the default path against quad precision, or closed forms.

A case has passed if its error is below `LIMIT`, and is rejected as it must be if the message and
the time are the expected ones; anything else stops the build.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from squeal.article.records import Record, Result
from squeal.article.studies._reference import error_against, precision_in_words, reference
from squeal.errors import ComputationError
from squeal.io.provenance import NOT_INSTALLED, version
from squeal.io.scene import Scene
from squeal.model.contact import contact_law
from squeal.model.pad import Model, Pad
from squeal.simulation.run import Simulation, in_natural_units, simulate

LIMIT = 1e-9  # greatest relative error of an answer that passes
PERIODS = 10_000  # of the long runs
BOTH: tuple[Model, ...] = ("B1", "B2")
CONTACT: dict[Model, dict[str, float]] = {"B1": {"k3": 0.43, "k4": 0.43}, "B2": {"k_c": 0.5}}
# fmt: off
PAD: dict[str, Any] = {
    "m": 1.0, "w": 1.0, "h": 0.35, "k1": 1.0, "k2": 1.3, "L1": 20.0, "L2": 20.0,
    "alpha1": 0.75 * math.pi, "alpha2": 0.75 * math.pi, "mu": 0.6, "F_n": 0.0057,
}
UPRIGHT: dict[str, Any] = {
    "m": 2.0, "w": 0.05, "h": 0.02, "k1": 3e5, "k2": 3e5, "k3": 5e5, "k4": 5e5, "L1": 0.4,
    "L2": 0.4, "alpha1": math.pi / 2, "alpha2": math.pi / 2, "mu": 0.0, "F_n": 400.0,
}
# fmt: on
"""The pad of the suite (w = m = k1 = 1), and one with upright springs that moves up and down."""


class Outcome(Record):
    """The outcome of a case: `passed`, `rejected` as it must be, else `failed`.

    error: relative, None where there is no number to compare; changes: of contact; against:
    the reference of the error, or the message.
    """

    group: str
    name: str
    outcome: Literal["passed", "rejected", "failed"]
    error: float | None
    steps: int
    changes: int
    against: str


class Extreme(Result):
    """All cases; limit: greatest relative error that passes; truth: the reference solution in
    words; stand_in: SciPy stood in for heyoka, so that its failures stop no build."""

    cases: tuple[Outcome, ...]
    limit: float
    truth: str
    stand_in: bool = False

    @property
    def wrong(self) -> str:
        """The cases that failed."""
        wrong = [f"{c.group}: {c.name}" for c in self.cases if c.outcome == "failed"]
        return "" if self.stand_in else ", ".join(wrong)


class Case(NamedTuple):
    """A scene and how its error is found: a function of scene and simulation gives it and what it
    is measured against. refusal: a part of the message that must come instead, at time `t`."""

    group: str
    name: str
    scene: Scene
    error: Callable[[Scene, Simulation], tuple[float, str]]
    refusal: str = ""
    t: float = 0.0


def _place(scene: Scene, motion: Simulation) -> np.ndarray:
    units, *_ = in_natural_units(scene)
    return units.to_scaled(np.array(motion.final[1:]))[:3]


def against_quad(scene: Scene, motion: Simulation) -> tuple[float, str]:
    """Relative error of the final place; infinite if other contact changes are found."""
    exact = reference(scene)
    if len(exact.times) != motion.contact_changes:
        return math.inf, f"{len(exact.times)} contact changes in {precision_in_words()}"
    return error_against(_place(scene, motion), exact.place), precision_in_words()


def drift(scene: Scene, motion: Simulation) -> tuple[float, str]:
    """Relative change of the energy, which a pad without friction keeps."""
    model = scene.pad_model
    states = np.array([scene.initial, motion.final[1:]])
    begin, end = (model.energy(s[:3], s[3:], model.state_at(s[:3])) for s in states)
    return abs(float(end / begin) - 1.0), "drift of energy"


def in_units(scene: Scene, mass: float, length: float, time: float) -> Scene:
    """The same motion in other units."""
    place = np.array([length, length, 1.0])
    initial = np.array(scene.initial) / np.concatenate([place, place / time])
    pad, stop = scene.pad.scaled(mass, length, time), (scene.stop or 0.0) / time
    return replace(scene, pad=pad, initial=tuple(initial.tolist()), stop=stop)


def bounce_times(pad: Pad, height: float, cycles: int) -> np.ndarray:
    """Times (4 cycles,) of the contact changes of the upright pad dropped from a height, both edges
    each; the fall takes 2 asin(sqrt(r/(1+r)/2)) / omega with r = k height / F_n."""
    k = pad.k1 + pad.k2
    K = k + (pad.k3 or 0.0) + (pad.k4 or 0.0)
    free, pressed, r = math.sqrt(k / pad.m), math.sqrt(K / pad.m), k * height / pad.F_n
    fall = 2 * math.asin(math.sqrt(r / (1 + r) / 2)) / free
    speed = math.sqrt((2 * pad.F_n * height + k * height**2) / pad.m)
    back = 2 * (math.pi - math.atan2(speed / pressed, pad.F_n / K)) / pressed
    one = np.array([fall, fall, fall + back, fall + back])
    return np.concatenate([n * (2 * fall + back) + one for n in range(cycles)])


def bounce_error(scene: Scene, motion: Simulation) -> tuple[float, str]:
    """Error of the contact changes of a dropped pad, relative to the time of the run."""
    stop = scene.stop or 0.0
    expected = bounce_times(scene.pad, scene.initial[1], 5)
    expected = expected[expected < stop]
    times = np.array([event.t for event in motion.events or ()])
    alike = len(times) == len(expected)
    return float(np.abs(times - expected).max() / stop) if alike else math.inf, "closed form"


def scene_of(model: Model, stop: float, start: Any = None, **changes: Any) -> Scene:
    """A scene that starts pressed in by twice the static depth, or as `start` says."""
    pad = Pad(**(PAD | CONTACT[model] | changes))
    contact = sum(getattr(pad, name) or 0.0 for name in contact_law(model).parameters)
    first = {"y": -2.0 * pad.F_n / contact} if start is None else start
    names = ("x", "y", "theta", "x_dot", "y_dot", "theta_dot")
    initial = tuple(first.get(name, 0.0) for name in names)
    return Scene(model, pad, initial=initial, stop=stop, samples=2)


def dropped(share: float) -> Scene:
    """The upright pad dropped from a height in static depths, over four bounces and a half."""
    pad = Pad(**UPRIGHT)
    height = share * pad.F_n / (pad.k1 + pad.k2)
    times = bounce_times(pad, height, 2)
    start = (0.0, height, 0.0, 0.0, 0.0, 0.0)
    stop = 4.5 * float(times[4] - times[0])
    return Scene("B1", pad, initial=start, stop=stop, samples=2, outputs=("events",))


def cases() -> Iterator[Case]:
    """The suite."""
    changed: list[tuple[str, str, float, dict[str, Any]]] = [
        ("free length", "L/w = 0.01", 20.0, {"L1": 1e-2, "L2": 1e-2}),
        ("free length", "L/w = 1e+08", 20.0, {"L1": 1e8, "L2": 1e8}),
        ("friction", "mu = 0", 15.0, {"mu": 0.0}),
        ("friction", "mu = 1", 15.0, {"mu": 1.0}),
        ("springs", "k1 = 0", 20.0, {"k1": 0.0}),
        ("springs", "k2 = 0", 20.0, {"k2": 0.0}),
        ("load", "F_n = 1e-12 k1 w", 20.0, {"F_n": 1e-12}),
        ("shape", "h/w = 1e-06", 20.0, {"h": 1e-6}),
        ("shape", "h/w = 1000", 20.0, {"h": 1e3}),
    ]
    for model in BOTH:
        for k in (1e3, 1e6, 1e9, 1e12):
            stiff = dict.fromkeys(contact_law(model).parameters, k)
            scene = scene_of(model, 60.0 / math.sqrt(k), **stiff)
            yield Case("contact stiffness", f"{model}, {k:g} k1", scene, against_quad)
        for group, name, stop, changes in changed:
            yield Case(group, f"{model}, {name}", scene_of(model, stop, **changes), against_quad)
        for speed in (0.0, 0.01, -0.01):
            scene = scene_of(model, 20.0, {"y_dot": speed})
            yield Case("start at first touch", f"{model}, y_dot = {speed:g}", scene, against_quad)
        scene = replace(scene_of(model, 2 * math.pi * PERIODS, mu=0.0), outputs=())
        yield Case("long runs", f"{model}, {PERIODS} periods, mu = 0", scene, drift)
    level = {"alpha1": math.pi / 2, "alpha2": math.pi / 2, "k2": 1.0, "mu": 0.0}
    for tilt in (0.0, 1e-15, 1e-9):
        scene = scene_of("B2", 20.0, theta0=tilt, **level)
        yield Case("level face", f"B2, held at {tilt:g} rad", scene, against_quad)
    for share in (1e-12, 1e-6, 10.0):
        name = f"B1, from {share:g} static depths"
        yield Case("bounces, both edges at once", name, dropped(share), bounce_error)
    units: dict[str, tuple[Model, tuple[float, float, float]]] = {
        "mass 1e-6": ("B1", (1e-6, 1.0, 1e-3)),
        "tonne, mm, s": ("B2", (1e3, 1e-3, 1.0)),
        "g, km, h": ("B2", (1e-3, 1e3, 3600.0)),
    }
    for name, (model, scales) in units.items():
        scene = in_units(scene_of(model, 50.0), *scales)
        yield Case("units", f"{model}, {name}", scene, against_quad)
    flying = Pad(**(UPRIGHT | {"k1": 0.0, "k2": 0.0, "F_n": 1.0}))
    scene = Scene("B1", flying, initial=(0, 5.0, 0, 0, 0, 40.0), stop=1.0, samples=2)
    turned = math.pi / 2 / 40.0
    yield Case("limits", "B1, overturns", scene, against_quad, "past 90 degrees", turned)


def outcome(case: Case) -> Outcome:
    """Run a case and compare its outcome with the reference solution."""
    try:
        motion = simulate(case.scene)
    except ComputationError as failure:
        message = str(failure)
        expected = bool(case.refusal) and case.refusal in message
        passed = expected and f"t = {case.t:.9g} s" in message
        word: Any = "rejected" if passed else "failed"
        return Outcome(case.group, case.name, word, None, 0, 0, message)
    error, against = case.error(case.scene, motion)
    word = "passed" if error <= LIMIT and not case.refusal else "failed"
    shown = error if math.isfinite(error) else None
    counts = (motion.steps, motion.contact_changes)
    return Outcome(case.group, case.name, word, shown, *counts, against)


def study(_: Sequence[Path]) -> Extreme:
    """Run all cases."""
    stand_in = version("heyoka") == NOT_INSTALLED
    return Extreme(tuple(map(outcome, cases())), LIMIT, precision_in_words(), stand_in)
