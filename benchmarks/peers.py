"""Other libraries' integrators, where the benchmark group is installed: CVODE and diffrax."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np

from squeal.article.studies.accuracy import Leg, Run, Solver, hybrid
from squeal.io.scene import Scene
from squeal.model.contact import State
from squeal.model.equations import PadModel, net_loads
from squeal.model.pad import pose_of
from squeal.simulation.hybrid import first_contact, state_of
from squeal.simulation.run import in_natural_units

MOST_STEPS = 100_000


def with_cvode(scene: Scene, tolerance: float) -> Run:
    from sksundae.cvode import CVODE

    def advance(
        rhs: Any, gaps: Any, contact: State, t: float, state: np.ndarray, stop: float
    ) -> Leg:
        def derivative(_t: float, s: np.ndarray, out: np.ndarray) -> None:
            out[:] = rhs(s)

        def heights(_t: float, s: np.ndarray, out: np.ndarray) -> None:
            out[:] = gaps(s)

        heights.terminal = [True, True]  # type: ignore[attr-defined]
        heights.direction = [1 if touches else -1 for touches in contact]  # type: ignore[attr-defined]
        solver = CVODE(
            derivative,
            method="Adams",
            rtol=tolerance,
            atol=tolerance,
            eventsfn=heights,
            num_events=2,
            max_num_steps=10**7,
        )
        found = solver.solve(np.array([t, stop]), np.asarray(state, dtype=float))
        if found.i_events is not None and len(found.i_events):
            edge = int(np.flatnonzero(found.i_events[-1])[0])
            end = float(found.t_events[-1])
            return Leg(end, np.array(found.y_events[-1]), edge, int(found.nfev))
        return Leg(float(found.t[-1]), np.array(found.y[-1]), None, int(found.nfev))

    return hybrid(advance, scene)


@lru_cache(maxsize=64)
def _diffrax_leg(model: PadModel, contact: State) -> Any:
    """A compiled solve (t, state, stop, tolerance) -> solution within one contact state."""
    import diffrax
    import jax
    import jax.numpy as jnp
    import optimistix

    jax.config.update("jax_enable_x64", True)
    c, law = model.c, model.law

    def derivative(_t: Any, s: Any, _args: Any) -> Any:
        load = net_loads(jnp, c, law, c.xy_theta(s), contact)
        return jnp.array([s[3], s[4], s[5], load.x / c.m, load.y / c.m, c.w * load.moment / c.I])

    onward = [1.0 if touches else -1.0 for touches in contact]

    def passed(t: Any, y: Any, args: Any, **_: Any) -> Any:  # called by these names
        leading, trailing = law.gaps(c, pose_of(jnp, c.xy_theta(y)))
        return jnp.maximum(onward[0] * leading, onward[1] * trailing)

    def solve(t: Any, state: Any, stop: Any, tolerance: Any) -> Any:
        root = optimistix.Bisection(1e-14, 1e-14, flip="detect")
        event = diffrax.Event(passed, root, direction=True)
        return diffrax.diffeqsolve(
            diffrax.ODETerm(derivative),
            diffrax.Dopri8(),
            t0=t,
            t1=stop,
            dt0=None,
            y0=state,
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
            event=event,
            max_steps=MOST_STEPS,
        )

    return jax.jit(solve)


def with_diffrax(scene: Scene, tolerance: float) -> Run:
    """Dopri8 of diffrax with events; the equations go through JAX's arithmetic."""
    _, model, state, stop = in_natural_units(scene)
    contact = state_of(first_contact(model, state))
    t = 0.0
    steps = 0
    times: list[float] = []
    while t < stop and len(times) < MOST_STEPS:
        found = _diffrax_leg(model, contact)(t, state, stop, tolerance)
        t = float(found.ts[-1])
        state = np.asarray(found.ys[-1])
        steps += int(found.stats["num_steps"])
        if bool(found.event_mask):
            times.append(t)
            heights = model.gaps(model.c.xy_theta(state))
            beyond = [h if touches else -h for h, touches in zip(heights, contact, strict=True)]
            contact = contact.flip(int(np.argmax(beyond)))
    # 13 stages of Dormand and Prince's method of order eight
    return Run(state[:3], np.array(times), steps, 13 * steps)


def peers() -> Iterator[tuple[str, Solver]]:
    """Paths of those libraries that are installed."""
    try:
        import sksundae.cvode  # noqa: F401
    except ImportError:
        pass
    else:
        yield "CVODE Adams", with_cvode
    try:
        import diffrax  # noqa: F401
    except ImportError:
        return
    yield "diffrax Dopri8", with_diffrax
