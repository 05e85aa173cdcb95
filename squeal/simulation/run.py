"""A scene simulated: its motion in natural units, what is wanted of it in SI units."""

import math
import time as clock
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from squeal.errors import ComputationError
from squeal.io.scene import Scene, check_simulation, takes_scene
from squeal.model.equations import PadModel
from squeal.model.units import Units, natural_units
from squeal.schema.place import Place
from squeal.schema.values import Word
from squeal.simulation.answer import Motion
from squeal.simulation.hybrid import DEFAULT, Integrator, Options, integrate
from squeal.simulation.observers import observers_for
from squeal.simulation.response import Response, Watch

Backend = Literal["auto", "heyoka", "scipy"]
BACKENDS = Word(("auto", "heyoka", "scipy"))


@dataclass(frozen=True)
class Event:
    """A change of contact state at time t (s)."""

    t: float
    source: str
    target: str


@dataclass(frozen=True, repr=False)
class Simulation(Motion):
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


def make_integrator(
    model: PadModel, tolerance: float, backend: Backend, options: Options = DEFAULT
) -> Integrator:
    """The integrator of a scaled pad: heyoka where it is installed, else SciPy."""
    if backend != "scipy":
        try:
            from squeal.simulation.taylor import TaylorIntegrator
        except ImportError:
            if backend == "heyoka":
                raise ComputationError(
                    "heyoka is not installed on this machine; use the integrator scipy"
                ) from None
        else:
            return TaylorIntegrator(model, tolerance, options=options)
    from squeal.simulation.scipy_solver import SciPyIntegrator

    return SciPyIntegrator(model, tolerance, options)


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
def simulate(
    scene: Scene, backend: Backend = "auto", progress: Any = None, options: Options = DEFAULT
) -> Simulation:
    """Simulate a scene through its contact changes; only what its outputs name is computed.

    Parameters
    ----------
    scene : Scene
        A scene of a nonlinear model, with a time.
    backend : "auto", "heyoka" or "scipy"
        The integrator; "auto" takes heyoka where it is installed.
    progress : callable, optional
        Called with the share of the time that is done, now and then on long runs.
    options : Options
        How motions are integrated and looked at, beside the scene's tolerance.

    Returns
    -------
    Simulation
        In SI units.

    Raises
    ------
    ComputationError
        With the time where the model ends: rotation past 90 degrees, a spring collapsed.
    InputError
        For a scene that cannot be simulated or an unknown backend.

    Examples
    --------
    >>> import squeal
    >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8,
    ...                  L2=0.8, alpha1=1.57, alpha2=3.14, mu=0.4, F_n=4500.0)
    >>> scene = squeal.Scene("B1", pad, initial=(0.0, -1e-4, 0.0, 0.0, 0.0, 0.0), stop=1e-3,
    ...                      samples=2)
    >>> squeal.simulate(scene).shares["1"]
    1.0
    """
    BACKENDS.read(backend, Place("simulate") / "backend")
    check_simulation(scene, Place(str(scene.source or "Scene")))
    started = clock.process_time()
    units, model, start, stop = in_natural_units(scene)
    observers = observers_for(scene, model, units, stop, progress, options)
    if scene.wants("response"):
        observers.append(Watch(model, units, stop))
    integrator = make_integrator(model, scene.tolerance, backend, options)
    t, state, steps, changes = integrate(model, integrator, units, start, stop, observers, options)
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
