"""Extreme pads over ten support periods: errors against a second method, more digits, closed forms.

The second method (`_independent`) has equations and an integrator of its own. Quad precision is the
same code with more digits, and shows the rounding alone. A case has passed if its errors are below
`LIMIT`, and is rejected as it must be if the message and the time are the expected ones; anything
else stops the build. Contact stiffness, which takes longer, is the study `horizon`.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from squeal.article.identify.space import MODELS
from squeal.article.records import Record, Result
from squeal.article.studies import _independent
from squeal.article.studies._heyoka import has_heyoka
from squeal.article.studies._reference import error_against, precision_in_words, reference
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.contact import contact_law
from squeal.model.pad import Model, Pad
from squeal.simulation.run import Simulation, in_natural_units, simulate

LIMIT = 1e-9  # greatest relative error of an answer that passes
PERIOD = 2.0 * math.pi  # of m on spring 1 of the suite's pad
PERIODS = 10  # of a run
LONG = 10_000  # periods of the long runs
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

    periods: time in support periods, None where the pad has none; independent, rounding: relative
    errors of the final place against the second method and against quad precision, None where
    `error` is measured, against what `against` says, or where it is the message; changes: of
    contact.
    """

    group: str
    name: str
    outcome: Literal["passed", "rejected", "failed"]
    periods: float | None
    independent: float | None
    rounding: float | None
    error: float | None
    steps: int
    changes: int
    against: str


class Extreme(Result):
    """All cases; limit: greatest relative error that passes; truth: what shows the rounding, in
    words; stand_in: SciPy stood in for heyoka, so that its failures stop no build."""

    cases: tuple[Outcome, ...]
    limit: float
    truth: str
    periods: int = PERIODS
    stand_in: bool = False

    @property
    def greatest(self) -> tuple[float, float]:
        """The greatest errors against the second method and against quad precision."""
        independent = [c.independent for c in self.cases if c.independent is not None]
        rounding = [c.rounding for c in self.cases if c.rounding is not None]
        return max(independent), max(rounding)

    @property
    def wrong(self) -> str:
        """The cases that failed."""
        wrong = [f"{c.group}: {c.name}" for c in self.cases if c.outcome == "failed"]
        return "" if self.stand_in else ", ".join(wrong)


class Errors(NamedTuple):
    """Relative errors of a run, infinite where contact changes differ; see `Outcome`."""

    against: str
    independent: float | None = None
    rounding: float | None = None
    error: float | None = None

    @property
    def greatest(self) -> float:
        """The greatest of those that were measured."""
        return max(e for e in (self.independent, self.rounding, self.error) if e is not None)


class Case(NamedTuple):
    """A scene and how its errors are computed, by a function of scene and simulation.

    refusal: a part of the message that must come instead, at the time `t` in s; empty where the
    simulation must succeed.
    """

    group: str
    name: str
    scene: Scene
    errors: Callable[[Scene, Simulation], Errors]
    refusal: str = ""
    t: float = 0.0


def compared(scene: Scene, motion: Simulation) -> Errors:
    """Errors of the final place; infinite if other contact changes are found."""
    units, *_ = in_natural_units(scene)
    final_state = np.array(motion.final[1:])  # after the time
    position = units.to_scaled(final_state)[:3]  # x, y and w theta
    exact = reference(scene)
    second = _independent.motion(
        scene.model, scene.pad, np.array(scene.initial), np.array([scene.stop])
    )
    second_position = units.to_scaled(second.states[0])[:3]

    def error(other: np.ndarray, changes: int) -> float:
        """Against another position (3,), reached through so many contact changes."""
        return error_against(position, other) if changes == motion.contact_changes else math.inf

    return Errors(
        f"second method; {precision_in_words()}",
        independent=error(second_position, len(second.times)),
        rounding=error(exact.position, len(exact.times)),
    )


def drift(scene: Scene, motion: Simulation) -> Errors:
    """Relative change of the energy, which is constant without friction."""
    model = scene.pad_model

    def energy(state: np.ndarray) -> float:
        return model.energy(state[:3], state[3:], model.state_at(state[:3]))

    ratio = energy(np.array(motion.final[1:])) / energy(np.array(scene.initial))
    return Errors("drift of energy", error=abs(float(ratio) - 1.0))


def in_units(scene: Scene, mass: float, length: float, time: float) -> Scene:
    """The same motion in other units, whose sizes are given in those of the scene."""
    displacements = np.array([length, length, 1.0])  # units of x, y and theta
    initial = np.array(scene.initial) / np.concatenate([displacements, displacements / time])
    pad = scene.pad.scaled(mass, length, time)
    stop = (scene.stop or 0.0) / time
    return replace(scene, pad=pad, initial=tuple(initial.tolist()), stop=stop)


def bounce_times(pad: Pad, height: float, cycles: int) -> np.ndarray:
    """Times (4 cycles,) of the contact changes of the upright pad dropped from a height.

    Both edges change at once: in each cycle both touch, then both separate.

    In the air the supports k act alone, and y + F_n/k = (height + F_n/k) cos(omega_free t). The pad
    reaches y = 0 where cos(omega_free t) = 1/(1 + r), with r = k height / F_n. An arc cosine would
    lose digits at small heights: 1 - cos x = 2 sin(x/2)^2 gives the same time of the fall as
    2 asin(sqrt(r/(1+r)/2)) / omega_free. The pad arrives with `speed`, by the balance of energy.

    In contact, with K for k, y + F_n/K = A cos(omega_contact t + phi) goes down from y = 0 and back
    up to it, in the time 2 (pi - phi) / omega_contact with
    tan(phi) = (speed / omega_contact) / (F_n/K).
    """
    k = pad.k1 + pad.k2  # in the air; both supports of the upright pad are vertical
    K = k + (pad.k3 or 0.0) + (pad.k4 or 0.0)  # in contact
    omega_free = math.sqrt(k / pad.m)
    omega_contact = math.sqrt(K / pad.m)
    r = k * height / pad.F_n
    fall = 2 * math.asin(math.sqrt(r / (1 + r) / 2)) / omega_free
    speed = math.sqrt((2 * pad.F_n * height + k * height**2) / pad.m)
    half_phase = math.pi - math.atan2(speed / omega_contact, pad.F_n / K)
    in_contact = 2 * half_phase / omega_contact
    # both edges touch after the fall, and separate after the time in contact
    bounce = np.array([fall, fall, fall + in_contact, fall + in_contact])
    cycle = 2 * fall + in_contact  # the pad rises as long as it falls
    return np.concatenate([n * cycle + bounce for n in range(cycles)])


def bounce_error(scene: Scene, motion: Simulation) -> Errors:
    """Error of the contact changes of a dropped pad, relative to the time of the run."""
    stop = scene.stop or 0.0
    expected = bounce_times(scene.pad, scene.initial[1], 5)
    expected = expected[expected < stop]
    times = np.array([event.t for event in motion.events or ()])
    if len(times) != len(expected):
        return Errors("closed form", error=math.inf)
    return Errors("closed form", error=float(np.abs(times - expected).max() / stop))


def scene_of(
    model: Model, stop: float, start: Mapping[str, float] | None = None, **changes: Any
) -> Scene:
    """A scene of the suite's pad with some `changes`.

    It starts from the initial values of `start`, by name, the others zero; pressed in by twice the
    static depth where there is none.
    """
    pad = Pad(**(PAD | CONTACT[model] | changes))
    contact = sum(getattr(pad, name) or 0.0 for name in contact_law(model).parameters)
    values = {"y": -2.0 * pad.F_n / contact} if start is None else start
    names = ("x", "y", "theta", "x_dot", "y_dot", "theta_dot")
    initial = tuple(values.get(name, 0.0) for name in names)
    return Scene(model, pad, initial=initial, stop=stop, samples=2)


def dropped(share: float) -> Scene:
    """The upright pad dropped from a height in static depths, over four bounces and a half."""
    pad = Pad(**UPRIGHT)
    height = share * pad.F_n / (pad.k1 + pad.k2)
    times = bounce_times(pad, height, 2)
    start = (0.0, height, 0.0, 0.0, 0.0, 0.0)
    stop = 4.5 * float(times[4] - times[0])
    return Scene("B1", pad, initial=start, stop=stop, samples=2, outputs=("events",))


def pressed(share: float) -> Scene:
    """The upright pad pressed in by a share of twice its static depth.

    From 1 on it comes back to the surface, which it grazes without leaving it just below.
    """
    pad = Pad(**UPRIGHT)
    stiffness = sum(pad.given()[name] for name in ("k1", "k2", "k3", "k4"))
    start = (0.0, -2.0 * share * pad.F_n / stiffness, 0.0, 0.0, 0.0, 0.0)
    stop = PERIODS * PERIOD * math.sqrt(pad.m / pad.k1)
    return Scene("B1", pad, initial=start, stop=stop, samples=2)


def cases() -> Iterator[Case]:
    """The cases of the suite, group by group.

    Each has its group, name and scene, and the function that computes its error: `compared` with
    the second method, `drift` and `bounce_error` with closed forms. A case that must be rejected
    also has a part of the message and the time in s.
    """
    near = 1e-6
    right_angle = math.pi / 2
    changed: list[tuple[str, str, dict[str, Any]]] = [
        ("free length", "L/w = 0.1", {"L1": 0.1, "L2": 0.1}),
        ("free length", "L/w = 1e+08", {"L1": 1e8, "L2": 1e8}),
        ("friction", "mu = 0", {"mu": 0.0}),
        ("friction", "mu = 1", {"mu": 1.0}),
        ("springs", "k1 = 0", {"k1": 0.0}),
        ("springs", "k2 = 0", {"k2": 0.0}),
        ("springs", "k2 = 100 k1", {"k2": 1e2}),
        ("springs", "nearly flat", {"alpha1": near, "alpha2": math.pi - near}),
        (
            "springs",
            "nearly vertical",
            {"alpha1": right_angle - near, "alpha2": right_angle + near},
        ),
        ("load", "F_n = 1e-12 k1 w", {"F_n": 1e-12}),
        ("shape", "h/w = 1e-06", {"h": 1e-6}),
        ("shape", "h/w = 1000", {"h": 1e3}),
        ("inertia", "I = 1e-2 m w^2", {"I": 1e-2}),
        ("inertia", "I = 1e4 m w^2", {"I": 1e4}),
    ]
    for model in MODELS:
        for group, name, changes in changed:
            scene = scene_of(model, PERIODS * PERIOD, **changes)
            yield Case(group, f"{model}, {name}", scene, compared)
        for speed in (0.0, 0.01, -0.01):
            scene = scene_of(model, PERIODS * PERIOD, {"y_dot": speed})
            yield Case("start at first touch", f"{model}, y_dot = {speed:g}", scene, compared)
        scene = replace(scene_of(model, PERIOD * LONG, mu=0.0), outputs=())
        yield Case("long runs", f"{model}, mu = 0", scene, drift)
    for share in (1.0 - 1e-9, 1.0 + 1e-9, 1.0 + 1e-6):
        name = f"B1, from {share:.10g} of twice the static depth"
        yield Case("grazing, both edges at once", name, pressed(share), compared)
    for tilt in (0.0, 1e-15, 1e-9):
        changes = {"alpha1": right_angle, "alpha2": right_angle, "k2": 1.0, "mu": 0.0}
        scene = scene_of("B2", PERIODS * PERIOD, **changes, theta0=tilt)
        yield Case("level face", f"B2, held at {tilt:g} rad", scene, compared)
    for share in (1e-9, 1e-6, 10.0):  # below 1e-11 rounding may hide a bounce
        name = f"B1, from {share:g} static depths"
        yield Case("bounces, both edges at once", name, dropped(share), bounce_error)
    # sizes of the units of mass, length and time in those of the scene (kg, m, s)
    units: dict[str, tuple[Model, tuple[float, float, float]]] = {
        "mass 1e-6": ("B1", (1e-6, 1.0, 1e-3)),
        "tonne, mm, s": ("B2", (1e3, 1e-3, 1.0)),
        "g, km, h": ("B2", (1e-3, 1e3, 3600.0)),
    }
    for name, (model, scales) in units.items():
        scene = in_units(scene_of(model, PERIODS * PERIOD), *scales)
        yield Case("units", f"{model}, {name}", scene, compared)
    flying = Pad(**(UPRIGHT | {"k1": 0.0, "k2": 0.0, "F_n": 1.0}))
    scene = Scene("B1", flying, initial=(0, 5.0, 0, 0, 0, 40.0), stop=1.0, samples=2)
    turned = right_angle / 40.0  # s, until it has turned by 90 degrees at 40 rad/s
    yield Case("limits", "B1, overturns", scene, compared, "past 90 degrees", turned)


def periods_of(scene: Scene) -> float | None:
    """The time of a scene in support periods."""
    stiffness = scene.pad.k1
    stop = scene.stop or 0.0
    return stop / PERIOD * math.sqrt(stiffness / scene.pad.m) if stiffness else None


def outcome(case: Case) -> Outcome:
    """Run a case and compare its outcome with the reference solutions."""
    periods = periods_of(case.scene)
    try:
        motion = simulate(case.scene)
    except ComputationError as failure:
        message = str(failure)
        expected = bool(case.refusal) and case.refusal in message
        in_time = f"t = {case.t:.9g} s" in message
        return Outcome(
            group=case.group,
            name=case.name,
            outcome="rejected" if expected and in_time else "failed",
            periods=periods,
            independent=None,
            rounding=None,
            error=None,
            steps=0,
            changes=0,
            against=message,
        )
    errors = case.errors(case.scene, motion)
    return Outcome(
        group=case.group,
        name=case.name,
        outcome="passed" if errors.greatest <= LIMIT and not case.refusal else "failed",
        periods=periods,
        independent=_finite(errors.independent),
        rounding=_finite(errors.rounding),
        error=_finite(errors.error),
        steps=motion.steps,
        changes=motion.contact_changes,
        against=errors.against,
    )


def _finite(error: float | None) -> float | None:
    """The error as JSON can hold it: an infinite one is None."""
    return error if error is not None and math.isfinite(error) else None


def study(_: Sequence[Path]) -> Extreme:
    """Run all cases."""
    stand_in = not has_heyoka()
    return Extreme(tuple(map(outcome, cases())), LIMIT, precision_in_words(), stand_in=stand_in)


def sentences(record: Extreme) -> dict[str, bool]:
    """What the paper says of extreme pads."""
    if record.stand_in:
        return {}
    over_ten = [c for c in record.cases if c.independent is not None]
    return {
        "extreme-pads-agree-with-second-method": max(record.greatest) <= 1e-10
        and all(c.outcome == "passed" for c in over_ten),
        "extreme-energy-kept-over-long-runs": all(
            c.error is not None and c.error < 1e-12 for c in record.cases if c.group == "long runs"
        ),
        "end-of-the-model-is-reported": any(c.outcome == "rejected" for c in record.cases),
    }
