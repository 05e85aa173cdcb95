"""Ways to integrate a scene through its contact changes, ours and those of a good user of SciPy.

The peers get the same equations compiled by heyoka, and locate contact changes with the means of
their own library; nothing but the sign of a gap at their steps tells them of one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from squeal.io.scene import Scene
from squeal.model.equations import PadModel
from squeal.model.law import ContactLaw
from squeal.model.states import State
from squeal.simulation.hybrid import first_state, integrate
from squeal.simulation.observers import Events
from squeal.simulation.run import in_natural_units

SEVERAL = 256  # pads of a batch, whose time is given for each


@dataclass(frozen=True)
class Run:
    """Place (x, y, w theta) at the end and times of the contact changes, in natural units."""

    place: np.ndarray
    times: np.ndarray
    steps: int


Path = Callable[[Scene, float], Run]


def ours(scene: Scene, tolerance: float) -> Run:
    """The default path."""
    from squeal.simulation.taylor import TaylorIntegrator

    units, model, start, stop = in_natural_units(scene)
    changes = Events()
    integrator = TaylorIntegrator(model, tolerance)
    _, state, steps, _ = integrate(model, integrator, units, start, stop, [changes])
    return Run(state[:3], changes.times, steps)


def batch(scene: Scene, tolerance: float) -> Run:
    """`SEVERAL` equal pads in the lanes of the processor; one of them is returned."""
    from squeal.simulation.ensemble import simulate_starts

    starts = np.tile(scene.initial, (SEVERAL, 1))
    found = simulate_starts(scene, starts, scene.stop or 0.0, tolerance, events=True)
    units, *_ = in_natural_units(scene)
    place = units.to_scaled(found["final"][0])[:3]
    return Run(place, found["events"][0][:, 0] / units.time, int(found["steps"][0]))


@lru_cache(maxsize=64)
def compiled(law: ContactLaw, contact: State) -> tuple[tuple[Any, int], ...]:
    """Compiled rates and gaps of a contact state, each with its number of runtime parameters."""
    import heyoka as hy

    from squeal.simulation.taylor import NAMES, equations

    system, heights, _ = equations(law, contact)
    variables = [variable for variable, _ in system]

    def function(outputs: list[Any]) -> tuple[Any, int]:
        read = hy.get_params(outputs)
        highest = max(i for i in range(-1, len(NAMES)) if i < 0 or hy.par[i] in read)
        return hy.cfunc(outputs, variables), highest + 1

    return function([f for _, f in system]), function(heights)


def functions(model: PadModel, contact: State) -> tuple[Any, Any]:
    """rhs(state) -> (6,) and gaps(state) -> (2,) of a scaled pad within a contact state."""
    from squeal.simulation.taylor import NAMES

    numbers = np.array([float(getattr(model.c, name)) for name in NAMES])
    rates, gaps = compiled(model.law, contact)
    return _given(rates, numbers), _given(gaps, numbers)


def _given(function: tuple[Any, int], numbers: np.ndarray) -> Callable[[np.ndarray], Any]:
    call, used = function
    pars = numbers[:used]
    return lambda state: call(np.ascontiguousarray(state), pars=pars)


Advance = Callable[[Any, Any, State, float, np.ndarray, float], tuple[float, np.ndarray, Any, int]]


def hybrid(advance: Advance, scene: Scene, tolerance: float) -> Run:
    """Legs of one contact state joined at the changes that `advance` reports.

    advance(rhs, gaps, contact, t, state, stop) -> time, state, edge or None, steps.
    """
    _, model, state, stop = in_natural_units(scene)
    contact, t, steps = first_state(model, state), 0.0, 0
    times: list[float] = []
    while t < stop and len(times) < 100_000:
        rhs, gaps = functions(model, contact)
        t, state, edge, taken = advance(rhs, gaps, contact, t, state, stop)
        steps += taken
        if edge is not None:
            times.append(t)
            contact = contact.flip(edge)
    return Run(np.asarray(state)[:3], np.array(times), steps)


def with_scipy(method: str, scene: Scene, tolerance: float) -> Run:
    """A method of `solve_ivp` with terminal events, started anew after each."""
    from scipy.integrate import solve_ivp

    def advance(
        rhs: Any, gaps: Any, contact: State, t: float, state: np.ndarray, stop: float
    ) -> tuple[float, np.ndarray, Any, int]:
        events = []
        both = lru_cache(maxsize=1)(lambda _t, place: gaps(np.frombuffer(place)))
        for edge in (0, 1):

            def gap(t: float, s: np.ndarray, edge: int = edge) -> float:
                return float(both(t, s.tobytes())[edge])

            gap.terminal = True  # type: ignore[attr-defined]
            gap.direction = 1.0 if contact[edge] else -1.0  # type: ignore[attr-defined]
            events.append(gap)
        given: Any = {"rtol": max(tolerance, 3e-14), "atol": tolerance, "events": events}
        found = solve_ivp(lambda _t, s: rhs(s), (t, stop), state, method=method, **given)
        met = next((e for e in (0, 1) if len(found.t_events[e])), None)
        return float(found.t[-1]), found.y[:, -1], met, len(found.t) - 1

    return hybrid(advance, scene, tolerance)


SCIPY = ("DOP853", "RK45", "Radau", "LSODA")
DEFAULT: dict[str, Path] = {
    "squeal": ours,
    "squeal, batch": batch,
    **{f"SciPy {method}": partial(with_scipy, method) for method in SCIPY},
}
