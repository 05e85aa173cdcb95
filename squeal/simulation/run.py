"""A scene simulated: its motion in natural units, and as an answer in SI units."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene, check_simulation
from squeal.io.writing import Answer, Mark, Panel, Table, copied_attributes, in_order, number, plain
from squeal.model.contact import contact_law
from squeal.model.equations import PadModel, Units, natural_units
from squeal.schema import public
from squeal.simulation.hybrid import Integrator, Observe, Segment, integrate
from squeal.simulation.observers import (
    UNITS,
    Event,
    Events,
    Extrema,
    History,
    Response,
    ResponseObserver,
    Shares,
    Sliding,
)
from squeal.simulation.scipy_solver import SciPyIntegrator

Backend = Literal["auto", "heyoka", "scipy"]


class Observer(Protocol):
    """What sees the segments of a motion as they come, and makes a result of them."""

    def observe(self, segment: Segment) -> None: ...

    def result(self) -> object: ...


@dataclass(frozen=True, repr=False)
class Simulation(Answer):
    """Result of a run, in SI units.

    final: (t, x, y, theta, x_dot, y_dot, theta_dot); shares: share of time in each state;
    extrema: {signal: (min, max) or None}, forces over F_n, delta over w; response: see `Response`;
    history: column name to array, in the units of `table`. What the scene did not ask for is None.
    `steps` counts integration steps.

    Examples
    --------
    >>> import squeal
    >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8,
    ...                  L2=0.8, alpha1=1.57, alpha2=3.14, mu=0.4, F_n=4500.0)
    >>> scene = squeal.Scene("B1", pad, stop=1e-3, samples=3, outputs=("history",))
    >>> squeal.simulate(scene).to_dataframe()["t"].tolist()
    [0.0, 0.0005, 0.001]
    """

    panel = Panel("t", "y", Mark.LINES)
    grid = ("t",)

    model: str
    final: tuple[float, ...]
    method: str
    tolerance: float
    steps: int
    contact_changes: int
    events: tuple[Event, ...] | None = field(default=None, repr=False)
    shares: dict[str, float] | None = None
    extrema: dict[str, tuple[float, float] | None] | None = None
    response: Response | None = None
    history: dict[str, np.ndarray] | None = field(default=None, repr=False)
    sliding_holds: bool | None = None
    sliding_lost_at: float | None = None

    def table(self) -> Table:
        """A row for each sample of the history: t, places and velocities in SI units; forces over
        F_n, delta over w.

        Raises InputError where the scene's outputs do not name it.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8,
        ...                  L2=0.8, alpha1=1.57, alpha2=3.14, mu=0.4, F_n=4500.0)
        >>> scene = squeal.Scene("B1", pad, stop=1e-3, samples=3, outputs=("history", "shares"))
        >>> found = squeal.simulate(scene)
        >>> len(found.table().rows)
        3
        """
        if self.history is None:
            raise InputError("history: missing; the scene's outputs must name it")
        units = UNITS | {signal.name: signal.over for signal in contact_law(self.model).plotted}
        heads = [(name, units.get(name, "")) for name in self.history]
        values = (column.tolist() for column in self.history.values())
        return Table(in_order(heads), list(zip(*values, strict=True)))

    def parts(self) -> Sequence[str | Table]:
        """Final state, shares, extrema, response, contact changes, and whether sliding holds.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8,
        ...                  L2=0.8, alpha1=1.57, alpha2=3.14, mu=0.4, F_n=4500.0)
        >>> scene = squeal.Scene("B1", pad, stop=1e-3, samples=3, outputs=("history", "shares"))
        >>> found = squeal.simulate(scene)
        >>> len(found.parts()) > 1
        True
        """
        head = (
            f"model {self.model}, {self.method}, tolerance {self.tolerance:g}: {self.steps} steps, "
            f"{self.contact_changes} contact changes"
        )
        final = []
        for (name, unit), value in zip(UNITS.items(), self.final, strict=True):
            final.append((name, f"{number(value, 9)} {unit}"))
        parts: list[str | Table] = [head, _section("final state", "at", final)]
        if self.shares is not None:
            shares = [(state, f"{100 * share:.3f} %") for state, share in self.shares.items()]
            parts.append(_section("share of time", "state", shares))
        if self.extrema is not None:
            parts.append(_section("extrema", "signal", self._extrema_rows()))
        if self.response is not None:
            parts.append(_section("response", "", self.response.rows()))
        if self.events is not None:
            events = [(f"{e.t:.9g} s", f"{e.source} -> {e.target}") for e in self.events]
            parts.append(_section("contact changes", "t", events))
        if self.sliding_lost_at is not None:
            parts.append(
                "WARNING: the pad reaches the speed V of the surface at t = "
                f"{self.sliding_lost_at:.9g} s; the equations do not hold from there on"
            )
        elif self.sliding_holds is not None:
            parts.append("sliding: the surface stays faster than the pad")
        return parts

    def _extrema_rows(self) -> list[tuple[str, str]]:
        """Each signal over its scale, and its least and greatest value."""
        rows = []
        plotted = contact_law(self.model).plotted
        for signal, (name, ends) in zip(plotted, (self.extrema or {}).items(), strict=True):
            span = f"{number(ends[0])} to {number(ends[1])}" if ends else "none"
            rows.append((f"{name}/{signal.over}", span))
        return rows

    def to_dict(self) -> dict[str, Any]:
        """The JSON object of `squeal simulate`: only what the scene asked for.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8,
        ...                  L2=0.8, alpha1=1.57, alpha2=3.14, mu=0.4, F_n=4500.0)
        >>> scene = squeal.Scene("B1", pad, stop=1e-3, samples=3, outputs=("history", "shares"))
        >>> found = squeal.simulate(scene)
        >>> round(sum(found.to_dict()["shares"].values()), 9)  # of the time in each contact state
        1.0
        """
        result: dict[str, Any] = {
            "model": self.model,
            "final": dict(zip(UNITS, self.final, strict=True)),
        }
        if self.events is not None:
            result["events"] = [
                {"t": event.t, "from": event.source, "to": event.target} for event in self.events
            ]
        if self.shares is not None:
            result["shares"] = self.shares
        if self.extrema is not None:
            result["extrema"] = self.extrema
        if self.response is not None:
            result["response"] = dataclasses.asdict(self.response)
        if self.history is not None:
            result["history"] = {
                name: [plain(value) for value in column.tolist()]
                for name, column in self.history.items()
            }
        if self.sliding_lost_at is not None:
            result["sliding_lost_at"] = self.sliding_lost_at
        result |= copied_attributes(self, "sliding_holds method tolerance steps contact_changes")
        return result


def _section(title: str, head: str, rows: Sequence[tuple[str, str]]) -> Table:
    """A table of names and values, or "title: none"."""
    return Table(in_order([(head, ""), ("", "")]), rows, title, f"{title}: none")


def heyoka() -> ModuleType:
    """`squeal.simulation.taylor`; raises ComputationError where heyoka is not installed."""
    try:
        import squeal.simulation.taylor as taylor
    except ImportError:
        raise ComputationError("heyoka is not installed; a single motion can use scipy") from None
    return taylor


def make_integrator(model: PadModel, tolerance: float, backend: Backend) -> Integrator:
    """The integrator of a scaled pad: heyoka where it is installed, else SciPy."""
    if backend != "scipy":
        try:
            return heyoka().TaylorIntegrator(model, tolerance)
        except ComputationError:
            if backend == "heyoka":
                raise
    return SciPyIntegrator(model, tolerance)


def initial_state(scene: Scene) -> tuple[float, ...]:
    """(x, y, theta, x_dot, y_dot, theta_dot) in SI units from which a scene's motion starts.

    Raises ComputationError where there is no equilibrium to start from.
    """
    if scene.start != "equilibrium":
        return scene.initial
    from squeal.equilibrium import sliding_equilibrium  # a motion from elsewhere needs none

    equilibrium, message = sliding_equilibrium(scene.pad_model)
    if equilibrium is None:
        raise ComputationError(f"initial: {message}")
    x, y, theta = np.add(equilibrium.q, scene.initial[:3]).tolist()
    if abs(scene.pad.theta0 + theta) >= math.pi / 2:
        raise ComputationError(
            f"initial: theta: {scene.initial[2]:g} turns the pad past 90 degrees from the "
            f"equilibrium at {equilibrium.q[2]:g}"
        )
    return (x, y, theta, *scene.initial[3:])


class InitialValues(NamedTuple):
    """What a motion is integrated from, in natural units."""

    units: Units
    model: PadModel
    state: np.ndarray  # (6,), the first one
    stop: float  # length of time


def in_natural_units(scene: Scene) -> InitialValues:
    """The pad, first state and length of time of a scene's motion in its natural units.

    Raises ComputationError where there is no equilibrium to start from, or where the scene's
    damping cannot be computed.
    """
    assert scene.stop is not None  # as a scene that is simulated has it
    initial = initial_state(scene)
    model = scene.pad_model
    units = natural_units(model, initial)
    if scene.damping is not None:
        from squeal.equilibrium.damping import damped_model

        model = damped_model(scene)
    return InitialValues(
        units=units,
        model=units.scaled(model),
        state=units.to_scaled(np.array(initial)),
        stop=scene.stop / units.time,
    )


def _observers(scene: Scene, model: PadModel, units: Units, stop: float) -> dict[str, Observer]:
    """An observer for each output of a scene, by name; `model` and `stop` in natural units."""
    observers: dict[str, Observer] = {}
    if "events" in scene.outputs:
        observers["events"] = Events(model, units)
    if "shares" in scene.outputs:
        observers["shares"] = Shares(model, stop)
    if "extrema" in scene.outputs:
        observers["extrema"] = Extrema(model)
    if "history" in scene.outputs:
        observers["history"] = History(model, units, scene.stop or 0.0, scene.samples or 0)
    if "response" in scene.outputs:
        observers["response"] = ResponseObserver(model, units, stop)
    return observers


@public
def simulate(
    scene: Scene,
    integrator: Backend = "auto",
    progress: Callable[[float], object] | None = None,
) -> Simulation:
    """Simulate a scene through its contact changes; only what its outputs name is computed.

    Parameters
    ----------
    scene : Scene
        A scene of a nonlinear model, with a time.
    integrator : "auto", "heyoka" or "scipy"
        "auto" takes heyoka if installed, else :class:`~scipy.integrate.DOP853`.
    progress : callable, optional
        Called with the share of the time that is done, now and then on long runs.

    Returns
    -------
    Simulation
        In SI units.

    Raises
    ------
    ComputationError
        With the time where the model ends: rotation past 90 degrees, a spring collapsed.
    InputError
        For a scene that cannot be simulated or an unknown integrator.

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
    check_simulation(scene)
    units, model, start, stop = in_natural_units(scene)
    observers = _observers(scene, model, units, stop)
    observe: list[Observe] = [observer.observe for observer in observers.values()]
    sliding = None
    if scene.pad.V is not None:
        sliding = Sliding(scene.pad.V / units.velocity)
        observe.append(sliding.observe)
    if progress is not None:
        # `t1` holds the end of the segment for each motion; here there is one
        observe.append(lambda segment: progress(float(segment.t1[0]) / stop))
    # events and shares need no states between the changes of contact
    dense = sliding is not None or bool(observers.keys() - {"events", "shares"})
    solver = make_integrator(model, scene.tolerance, integrator)
    end = integrate(model, solver, units, start, stop, observe, dense)
    results: dict[str, Any] = {name: observer.result() for name, observer in observers.items()}
    if sliding is not None:
        results["sliding_holds"] = sliding.lost_at is None
        if sliding.lost_at is not None:
            results["sliding_lost_at"] = sliding.lost_at * units.time
    return Simulation(
        model=scene.model,
        final=(end.t * units.time, *units.to_si(end.state).tolist()),
        method=solver.method,
        tolerance=solver.tolerance,
        steps=end.steps,
        contact_changes=end.changes,
        **results,
    )
