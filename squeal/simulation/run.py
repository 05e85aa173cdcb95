"""The hybrid run: legs of smooth motion joined at the contact changes (Table 1, Fig. 3, Fig. 8)."""

import math
import time as clock
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from squeal.errors import ComputationError
from squeal.io.scene import Scene, check_simulation, takes_scene
from squeal.model.equations import PadModel
from squeal.model.mechanics import pose
from squeal.model.states import State
from squeal.model.units import Units, natural_units
from squeal.numerics.newton import complex_step
from squeal.schema.place import Place
from squeal.schema.values import Word
from squeal.simulation.legs import Integrator, Leg
from squeal.simulation.observers import Observer, observers_for
from squeal.simulation.response import Response, Watch

Backend = Literal["auto", "heyoka", "scipy"]
LEAST_TURN = 1e-15  # rad
BACKENDS = Word(("auto", "heyoka", "scipy"))


@dataclass(frozen=True)
class Event:
    """A change of contact state at time t (s)."""

    t: float
    source: str
    target: str


@dataclass(frozen=True)
class Simulation:
    """Result of a run, in SI units.

    final: (t, x, y, theta, x_dot, y_dot, theta_dot); shares: share of time in each state;
    extrema: {signal: (min, max) or None}, forces over F_n, delta over w; response: see `Response`;
    history: column name to array. What the scene did not ask for is None. `steps` counts
    integration steps, `run_time` is the processor time in s.
    """

    model: str
    final: tuple[float, ...]
    method: str
    tolerance: float
    steps: int
    contact_changes: int
    run_time: float
    events: tuple[Event, ...] | None = field(default=None, repr=False)
    shares: dict[str, float] | None = None
    extrema: dict[str, tuple[float, float] | None] | None = None
    response: Response | None = None
    history: dict[str, np.ndarray] | None = field(default=None, repr=False)
    sliding_holds: bool | None = None
    sliding_lost_at: float | None = None


def make_integrator(model: PadModel, tolerance: float, backend: Backend) -> Integrator:
    """The integrator of a scaled pad: heyoka where it is installed, else SciPy."""
    if backend != "scipy":
        try:
            from squeal.simulation.integrators.taylor import TaylorIntegrator
        except ImportError:
            if backend == "heyoka":
                raise ComputationError(
                    "heyoka is not installed on this machine; use the integrator scipy"
                ) from None
        else:
            return TaylorIntegrator(model, tolerance)
    from squeal.simulation.integrators.with_scipy import SciPyIntegrator

    return SciPyIntegrator(model, tolerance)


def _accelerations(model: PadModel, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Rates of the scaled velocities with the contact that the gaps tell."""
    loads = model.physical_loads(_place(model, q), _place(model, v))
    pad = model.pad
    return np.array([loads[0] / pad.m, loads[1] / pad.m, pad.w * loads[2] / pad.I])


def state_rates(model: PadModel, state: np.ndarray) -> np.ndarray:
    """Rates (6,) of a scaled state with the contact that the gaps tell."""
    return np.concatenate([state[3:], _accelerations(model, state[:3], state[3:])])


def _place(model: PadModel, state: np.ndarray) -> np.ndarray:
    return np.array(model.c.place(np.asarray(state[:3], dtype=float)))


def first_state(model: PadModel, state: np.ndarray) -> State:
    """Contact state of the first motion from a scaled state.

    A point that starts on the switching surface, to rounding, belongs to the side to which the
    first motion takes it; a short Runge-Kutta step tells which, since the loads are continuous.
    """
    heights = model.gaps(_place(model, state))
    pad = model.pad
    rounding = 8 * np.finfo(float).eps * (pad.h + pad.w + abs(pad.y0) + abs(state[1]))
    if np.all(np.abs(heights) > rounding):
        return State(*(bool(g < 0.0) for g in heights))
    step = 1e-3
    q, v = state[:3], state[3:]
    a1 = _accelerations(model, q, v)
    a2 = _accelerations(model, q + step / 2 * v, v + step / 2 * a1)
    a3 = _accelerations(model, q + step / 2 * v + step**2 / 4 * a1, v + step / 2 * a2)
    moved = q + step * v + step**2 / 6 * (a1 + a2 + a3)
    # the change of the gap, not the gap: an offset of rounding size must not decide
    change = model.gaps(_place(model, moved)) - heights
    told = np.where(np.abs(heights) > rounding, heights, change)
    return State(*(bool(g < 0.0) for g in told))


def off_level(model: PadModel, state: np.ndarray, contact: State) -> np.ndarray:
    """A scaled state from which partial contact can go on.

    A level pad exactly on the surface that turns leaves the contact length 0/0: it is turned by
    less than anything that is computed from it is rounded by.
    """
    if model.law.points > 2 or sum(contact) != 1:
        return state
    gaps = _heights(model, state)
    if abs(gaps[0] - gaps[1]) >= LEAST_TURN * model.pad.w:
        return state
    turned = [np.array(state), np.array(state)]
    for way, one in zip((1, -1), turned, strict=True):
        one[2] += way * LEAST_TURN
    touching = contact.index(True)
    first, second = (_heights(model, one)[touching] for one in turned)
    return turned[0] if first < second else turned[1]


def _heights(model: PadModel, state: np.ndarray) -> tuple[float, ...]:
    """Gaps of a scaled state as plain numbers: faster than arrays, and asked often."""
    y, turn = float(state[1]), float(state[2])  # the surface is level: x plays no part
    return model.law.gaps(model.c, pose(math, model.c.place((0.0, y, turn))))


def _late(
    model: PadModel, state: np.ndarray, contact: State, point: int, heights: tuple[float, ...]
) -> list[int]:
    """The other points that have passed their switching surface in the same instant as `point`.

    Such a crossing lies behind the located one by rounding and would not be seen again: its gap
    is as far beyond zero as that of the located point, which rounding may leave just before it.
    """
    beyond = [gap if touches else -gap for touches, gap in zip(contact, heights, strict=True)]
    limit = min(beyond[point], 0.0)
    near = [i for i, height in enumerate(beyond) if i != point and height >= limit]
    if not near:
        return []
    rates = complex_step(model.gaps, _place(model, state), along=_place(model, state[3:]))
    return [i for i in near if (rates[i] if contact[i] else -rates[i]) > 0.0]


def _check(leg: Leg, heights: tuple[float, ...], units: Units) -> None:
    """Refuse a leg that ends at a limit of the model or has missed a contact change."""
    margin = 1e-6
    for point, (touches, gap) in enumerate(zip(leg.contact, heights, strict=True)):
        if point != leg.point and (gap > margin if touches else gap < -margin):
            raise ComputationError(
                f"a contact change was missed before t = {float(leg.t1) * units.time:.9g} s; "
                "ask for a smaller tolerance"
            )
    if leg.limit is not None:
        raise ComputationError(
            f"{leg.limit} at t = {float(leg.t1) * units.time:.9g} s; the model ends there"
        )


def integrate(
    model: PadModel,
    integrator: Integrator,
    units: Units,
    state: np.ndarray,
    stop: float,
    observers: list[Observer],
) -> tuple[float, np.ndarray, int, int]:
    """Run a scaled pad to `stop` (natural units), showing each leg and change to the observers.

    Returns the final time and state, the number of steps and the number of contact changes.
    """
    dense = any(o.dense for o in observers)
    contact = first_state(model, np.asarray(state, dtype=float))
    state = off_level(model, state, contact)
    t, steps, changes = 0.0, 0, 0

    def change(point: int | None) -> None:
        nonlocal contact, changes
        assert point is not None
        target = contact.flip(point)
        for o in observers:
            o.change(t, contact, target)
        contact, changes = target, changes + 1

    while t < stop:
        legs, begun = integrator.legs(contact, t, state, stop, dense), t
        steps += sum(leg.steps for leg in legs)
        for leg in legs[:-1]:
            for o in observers:
                o.leg(leg)
            t = leg.t1
            change(leg.point)
        leg = legs[-1]
        heights = _heights(model, leg.end)
        _check(leg, heights, units)
        if leg.point is None and leg.t1 < stop and leg.t1 - begun < 1e-9 * stop:
            raise ComputationError(
                f"no progress beyond t = {float(leg.t1) * units.time:.9g} s; a spring may have "
                "collapsed to zero length there"
            )
        for o in observers:
            o.leg(leg)
        t, state = leg.t1, leg.end
        if leg.point is not None and t < stop:
            late = _late(model, state, contact, leg.point, heights)
            for point in (leg.point, *late):
                change(point)
            state = off_level(model, state, contact)
    return t, state, steps, changes


def first_place(scene: Scene) -> tuple[float, ...]:
    """(x, y, theta, x_dot, y_dot, theta_dot) in SI units from which a scene's motion starts.

    Raises ComputationError where there is no equilibrium to start from.
    """
    if scene.start != "equilibrium":
        return scene.initial
    from squeal.equilibrium import sliding_equilibrium

    found, how = sliding_equilibrium(scene.pad_model)
    if found is None:
        raise ComputationError(f"initial: {how}")
    x, y, theta = (a + b for a, b in zip(found.q, scene.initial[:3], strict=True))
    if abs(scene.pad.theta0 + theta) >= math.pi / 2:
        raise ComputationError(
            f"initial: theta: {scene.initial[2]:g} turns the pad past 90 degrees from the "
            f"equilibrium at {found.q[2]:g}"
        )
    return (x, y, theta, *scene.initial[3:])


def in_natural_units(scene: Scene) -> tuple[Units, PadModel, np.ndarray, float]:
    """Units of a scene's motion, and its pad, first state (6,) and length of time in them."""
    assert scene.stop is not None  # as a scene that is simulated has it
    first = first_place(scene)
    units = natural_units(scene.pad_model, first)
    model = scene.pad_model
    if scene.damping is not None:
        from squeal.equilibrium.damping import damped_model

        model = damped_model(scene)
    model = units.scaled(model)
    return units, model, units.to_scaled(np.array(first)), scene.stop / units.time


@takes_scene
def simulate(scene: Scene, backend: Backend = "auto", progress: Any = None) -> Simulation:
    """Simulate a scene; only what its outputs name is computed.

    `progress(share)` is called now and then on long runs. Raises ComputationError with the time
    where the model ends (rotation past 90 degrees, a spring collapsed), InputError for a scene that
    cannot be simulated or an unknown backend.
    """
    BACKENDS.read(backend, Place("simulate") / "backend")
    check_simulation(scene, Place(str(scene.source or "Scene")))
    started = clock.process_time()
    units, model, start, stop = in_natural_units(scene)
    observers = observers_for(scene, model, units, stop, progress)
    if scene.wants("response"):
        observers.append(Watch(model, units, stop))
    integrator = make_integrator(model, scene.tolerance, backend)
    t, state, steps, changes = integrate(model, integrator, units, start, stop, observers)
    results: dict[str, Any] = {}
    for o in observers:
        results |= o.result()
    if scene.wants("events"):
        results["events"] = tuple(
            Event(e.t * units.time, model.state_name(e.source), model.state_name(e.target))
            for e in results["events"]
        )
    final = (t * units.time, *(float(v) for v in units.to_si(state)))
    how = (integrator.method, integrator.tolerance, steps, changes, clock.process_time() - started)
    return Simulation(scene.model, final, *how, **results)
