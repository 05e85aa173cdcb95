"""Growth rates fitted to simulations, beside the eigenvalues of the linearisation."""

import dataclasses
from typing import Any

import numpy as np

from squeal.equilibrium import Equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.io.scene import Scene
from squeal.linear import complex_eigenvalues
from squeal.queries.pads.equilibrium import at_equilibrium
from squeal.simulation.hybrid import integrate
from squeal.simulation.observers import Samples
from squeal.simulation.run import in_natural_units, make_integrator

DISPLACEMENT = 1e-6  # of the motion's natural length: small enough to be linear
PERIODS = 8
SAMPLES = 400


def fit(scene: Scene, at: Equilibrium) -> tuple[complex, complex] | None:
    """The eigenvalue (rad/s) of the fastest growing mode about an equilibrium, and what the start
    of a simulation in this mode shows in its place.

    With y the left vector of lambda, a(t) = y' (M u' + (lambda M + C) u) obeys a' = lambda a for
    the linear motion u, so log a is fitted by a line. None if a contact change ends the motion
    too early or no mode vibrates.
    """
    model = damped_model(scene).replace(mu=at.mu)
    matrices = at_equilibrium(model, at)
    mode = complex_eigenvalues(*matrices).dominant
    if mode.value.imag == 0.0:
        return None
    period = 2 * np.pi / abs(mode.value.imag)
    way: Any = {"initial": (*at.q, 0.0, 0.0, 0.0), "start": "origin"}
    way |= {"stop": PERIODS * period, "samples": 2}
    task = dataclasses.replace(scene, pad=model.pad, **way)
    units, scaled, start, stop = in_natural_units(task)
    shape = units.to_scaled(np.append(mode.right.real, (mode.value * mode.right).real))
    size = DISPLACEMENT * np.max(np.abs(start[:3])) / np.max(np.abs(shape[:3]))
    motion = Samples(scaled, np.linspace(0.0, stop, SAMPLES))
    integrator = make_integrator(scaled, 1e-15, "auto")
    *_, changes = integrate(
        scaled, integrator, units, start + size * shape, stop, [motion.observe], True
    )
    if changes:
        return None
    u = units.to_si(motion.states - start)
    lam = mode.value
    M = matrices.M
    C = matrices.C
    y = mode.left
    a = (u[:, 3:] @ M.T + u[:, :3] @ (lam * M + C).T) @ y.conj()
    t = motion.times * units.time
    slopes = [np.polyfit(t, part, 1)[0] for part in (np.log(np.abs(a)), np.unwrap(np.angle(a)))]
    return lam, complex(slopes[0], slopes[1])
