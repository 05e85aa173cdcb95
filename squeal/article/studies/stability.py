"""Stability over friction: along the branch of equilibria, with it frozen, with rotation locked.

Beside the thresholds stand the mode shapes at the scenes' friction, and growth rates fitted to
simulations.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from squeal import linear
from squeal.analysis.eigenvalues import analyse, at_equilibrium, branch_system, held_system
from squeal.analysis.modes import shapes_of_pad, values_of_mu
from squeal.analysis.thresholds import critical_friction
from squeal.article.cases import HISTORY_FIGURES
from squeal.article.records import Missing, Record, Result
from squeal.article.studies._scenes import read_scenes
from squeal.equilibrium import Equilibrium, sliding_equilibrium
from squeal.equilibrium import Path as Equilibria
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.simulation.hybrid import integrate
from squeal.simulation.observers import Samples
from squeal.simulation.run import in_natural_units, make_integrator

MU_MAX = 1.0
HELD_MAX = 2.0  # of thresholds about the frozen equilibrium
SWEEP = 101
FITTED = ("b1-a", "b2-c")  # a pad that never grows, and one that flutters
FITS = 12  # values of friction at which growth is fitted
DISPLACEMENT = 1e-6  # of a fitted motion's natural length: small enough to be linear
PERIODS, SAMPLES = 8, 400  # of a fitted motion
ROUNDING = 1e-9  # of the greatest imaginary part: real parts below are none

Row = tuple[float, ...]


class ContactChange(Record):
    """A change of contact along the branch: where, and into which state."""

    mu: float
    into: str


class Threshold(Record):
    """A change of verdict on the way up in mu, see `squeal.linear.CriticalPoint`."""

    mu: float
    kind: str
    frequency_hz: float


class Branch(Record):
    """Tracked eigenvalues along the equilibrium branch, and what happens on it.

    real, imag (1/s, rad/s): six rows over `mu`; rows 2k and 2k + 1 are a mode and its conjugate,
    by rising frequency at mu = 0. end: why the branch ends; fold: its mu, None if there is none.
    """

    mu: Row
    real: tuple[Row, ...]
    imag: tuple[Row, ...]
    contact_changes: tuple[ContactChange, ...]
    fold: float | None
    end: str
    thresholds: tuple[Threshold, ...]

    @property
    def leaves_axis(self) -> bool:
        """Whether some root leaves the imaginary axis."""
        return bool(np.abs(self.real).max() > ROUNDING * np.abs(self.imag).max())


class Crossing(Record):
    """Where a pair (flutter) or real root (divergence) starts (up) or ceases (down) to grow."""

    mu: float
    kind: str
    direction: str


class ModeShape(Record):
    """Shape (x, y, w theta), its largest part 1, of one pair of eigenvalues."""

    frequency_hz: float
    growth_rate: float
    real: Row
    imag: Row


class Modes(Record):
    """The scene's equilibrium: verdict, pose (m, m, rad) over the surface's origin, mode shapes.

    on_branch: whether it lies on the branch from mu = 0.
    """

    on_branch: bool
    contact: str
    verdict: str
    pose: Row
    modes: tuple[ModeShape, ...]


class SceneStability(Record):
    """All of one scene; w, h in m. What does not exist without steady sliding has the reason.

    frozen: thresholds of the equilibrium of the scene's friction; locked: with the rotation locked
    as well.
    """

    name: str
    model: str
    mu: float
    w: float
    h: float
    branch: Branch | Missing
    frozen: tuple[Crossing, ...] | Missing
    locked: tuple[Crossing, ...] | Missing
    equilibrium: Modes | Missing


class Growth(Record):
    """Eigenvalues fitted to simulations: at how many frictions, and their greatest relative
    difference from those predicted."""

    count: int
    apart: float


class Stability(Result):
    """The scenes; mu_max: where branches end; held_max: up to which thresholds of frozen equilibria
    are sought."""

    scenes: tuple[SceneStability, ...]
    growth: dict[str, Growth]
    mu_max: float = MU_MAX
    held_max: float = HELD_MAX


def _nested(values: np.ndarray) -> Any:
    """An array (n,) or (n, m) as tuples of floats, in tuples."""
    return tuple(map(_nested, values)) if values.ndim > 1 else tuple(values.tolist())


def branch(scene: Scene) -> Branch | Missing:
    """Tracked eigenvalues along the equilibrium branch, or why there is no branch."""
    try:
        system, path = branch_system(scene, MU_MAX)
        critical = critical_friction(scene, MU_MAX)
    except ComputationError as error:
        return Missing(str(error))
    assert path is not None
    marked = [scene.pad.mu, *(point.mu for point in critical.points)]
    tracked = linear.track(system, values_of_mu(path, 0.0, path.mu_end, marked, SWEEP))
    return Branch(
        mu=_nested(tracked.mus),
        real=_nested(tracked.values.real.T),
        imag=_nested(tracked.values.imag.T),
        contact_changes=tuple(
            ContactChange(mu, scene.pad_model.state_name(path.at(mu)[1]))
            for mu in path.breakpoints
            if mu <= path.mu_end
        ),
        fold=path.fold,
        end=path.end,
        thresholds=tuple(map(Threshold.of, critical.points)),
    )


def frozen(scene: Scene, at: Equilibrium, rows: int) -> tuple[Crossing, ...]:
    """Thresholds over 0 < mu <= HELD_MAX about one equilibrium; two rows: without rotation."""
    free = held_system(scene, at)

    def system(mu: float) -> linear.Matrices:
        M, C, K = (np.asarray(matrix)[:rows, :rows] for matrix in free(mu))
        return M, C, K

    found = linear.crossings(free if rows == 3 else system, HELD_MAX)
    return tuple(Crossing.of(one) for one in found if one.mu > 0.0)


def modes(scene: Scene, at: Equilibrium) -> Modes:
    """Pose and mode shapes at the scene's equilibrium."""
    found, pad = analyse(scene), scene.pad
    lever = np.array([1.0, 1.0, pad.w])
    shapes = []
    for one in shapes_of_pad(found, pad.w):
        shape = lever * one.shape
        shapes.append(ModeShape.of(one, real=_nested(shape.real), imag=_nested(shape.imag)))
    pose = (pad.x0 + found.q[0], pad.y0 + found.q[1], pad.theta0 + found.q[2])
    verdict = found.judgement.verdict
    return Modes.of(at, found, verdict=verdict, pose=pose, modes=tuple(shapes))


def examined(name: str, scene: Scene) -> SceneStability:
    """All of one scene."""
    at, how = sliding_equilibrium(scene.pad_model)
    held: Any = dict.fromkeys(("frozen", "locked", "equilibrium"), Missing(how))
    if at is not None:
        held = {"frozen": frozen(scene, at, 3), "locked": frozen(scene, at, 2)}
        held["equilibrium"] = modes(scene, at)
    return SceneStability.of(scene, scene.pad, name=name, branch=branch(scene), **held)


class _Motion(Samples):
    """The motion at equally spaced natural times; `changed` tells that a contact changed."""

    changed = False

    def change(self, *_: object) -> None:
        self.changed = True


def fit(scene: Scene, at: Equilibrium) -> tuple[complex, complex] | None:
    """The eigenvalue (rad/s) of the fastest growing mode about an equilibrium, and what the start
    of a simulation in this mode shows in its place.

    With y the left vector of lambda, a(t) = y' (M u' + (lambda M + C) u) obeys a' = lambda a for
    the linear motion u, so log a is fitted by a line. None if a contact change ends the motion
    too early or no mode vibrates.
    """
    model = damped_model(scene).replace(mu=at.mu)
    matrices = at_equilibrium(model, at)
    mode = linear.complex_eigenvalues(*matrices).dominant
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
    return lam, complex(slopes[0], slopes[1])


def growth(scene: Scene) -> Growth:
    """Fits along the branch from mu = 0, where it reaches and no contact change interferes."""
    path = Equilibria.of(scene.pad_model, MU_MAX)
    places = map(path.equilibrium, np.linspace(0.02, MU_MAX, FITS).tolist())
    fits = [one for at in places if at is not None and (one := fit(scene, at)) is not None]
    apart = [abs(fitted - predicted) / abs(predicted) for predicted, fitted in fits]
    return Growth(len(fits), max(apart, default=0.0))


def study(files: Sequence[Path]) -> Stability:
    """The eight scenes of models B1 and B2."""
    scenes = read_scenes(files, HISTORY_FIGURES)
    return Stability(
        scenes=tuple(examined(name, scene) for name, scene in scenes.items()),
        growth={name: growth(scenes[name]) for name in FITTED},
    )
