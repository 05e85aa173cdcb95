"""Growth rates of the nonlinear models, fitted to a simulation, beside the linearisation's."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from squeal.analysis.eigenvalues import at_equilibrium
from squeal.equilibrium import Equilibrium, Path
from squeal.equilibrium.damping import damped_model
from squeal.io.scene import Scene
from squeal.linear import complex_eigenvalues
from squeal.simulation.hybrid import integrate
from squeal.simulation.observers import Samples
from squeal.simulation.run import in_natural_units, make_integrator

DISPLACEMENT = 1e-6  # of the motion's natural length: small enough to be linear
PERIODS = 8
SAMPLES = 400


@dataclass(frozen=True)
class Fit:
    """One eigenvalue (rad/s) at mu, and what the start of a simulation shows in its place."""

    mu: float
    predicted: complex
    fitted: complex

    @property
    def deviation(self) -> float:
        """|fitted - predicted| over |predicted|."""
        return abs(self.fitted - self.predicted) / abs(self.predicted)


class _Motion(Samples):
    """The motion at equally spaced natural times; `changed` tells that a contact changed."""

    changed = False

    def change(self, *_: object) -> None:
        self.changed = True


def fit(scene: Scene, at: Equilibrium) -> Fit | None:
    """Start a simulation beside an equilibrium in its fastest growing mode and fit the eigenvalue.

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
    motion = _Motion(np.linspace(0.0, stop, SAMPLES))
    integrator = make_integrator(scaled, 1e-15, "auto")
    integrate(scaled, integrator, units, start + size * shape, stop, [motion])
    if motion.changed:
        return None
    u = units.to_si(motion.states - start)
    lam, M, C, y = mode.value, matrices.M, matrices.C, mode.left
    a = (u[:, 3:] @ M.T + u[:, :3] @ (lam * M + C).T) @ y.conj()
    t = motion.times * units.time
    slopes = [np.polyfit(t, part, 1)[0] for part in (np.log(np.abs(a)), np.unwrap(np.angle(a)))]
    return Fit(at.mu, lam, complex(slopes[0], slopes[1]))


def fits(scene: Scene, mus: np.ndarray) -> list[Fit]:
    """Fits along the branch from mu = 0, where it reaches and no contact change interferes."""
    path = Path.of(scene.pad_model, float(np.max(mus)))
    found = []
    for mu in mus:
        at = path.equilibrium(float(mu))
        one = fit(scene, at) if at is not None else None
        if one is not None:
            found.append(one)
    return found
