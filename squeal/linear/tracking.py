"""Modes followed through a sweep, by the likeness of their shapes and not by their order."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from squeal.linear.eigen import ComplexArray, complex_eigenvalues
from squeal.linear.matrices import Array
from squeal.linear.system import Batched, Matrices, System, check_system, matrices_at, values_of

SURE = 0.9  # a likeness below this halves the step
KEEP = 0.7  # below this (shapes mixed, at a crossing) the reference shape stays as it was
DEPTH = 7


@dataclass(frozen=True, eq=False)
class TrackedModes:
    """Modes over a sweep: column k of `values` is one and the same mode throughout."""

    mus: Array = field(repr=False)  # (n_mu,)
    values: ComplexArray = field(repr=False)  # (n_mu, 2n) rad/s
    shapes: ComplexArray = field(repr=False)  # (n_mu, n, 2n) right vectors, x^H M x = 1
    likeness: Array = field(
        repr=False
    )  # (n_mu, 2n) modal assurance criterion against the step before, 0 to 1

    @property
    def frequencies_hz(self) -> Array:
        """|Im| / (2 pi), shape (n_mu, 2n)."""
        return np.asarray(np.abs(self.values.imag) / (2 * np.pi))


@dataclass(frozen=True, eq=False)
class _Place:
    """Modes at one mu: the states that the next are compared with, and which are of before."""

    mu: float
    values: ComplexArray
    shapes: ComplexArray
    states: ComplexArray
    mixed: np.ndarray


class _Tracker:
    def __init__(self, system: System, steps: list[float]) -> None:
        self.system = system
        several = system.many(steps) if isinstance(system, Batched) else ()
        self._known: dict[float, Matrices] = dict(zip(steps, several, strict=False))

    def states(self, mu: float) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Eigenvalues (2n,), shapes (n, 2n), and unit states (2n, 2n) that tell them apart.

        A state is the shape with its velocity, in mass-normalised coordinates and in units in
        which |lambda| = 1: a mode and its complex conjugate are then orthogonal.
        """
        matrices = self._known.get(mu) or matrices_at(self.system, mu)
        spectrum = complex_eigenvalues(*matrices)
        values = spectrum.values
        shapes = np.array([e.right for e in spectrum.eigenvalues]).T
        z = np.linalg.cholesky(np.asarray(matrices[0], dtype=float)).T @ shapes
        size = np.abs(values)
        phase = np.divide(values, size, out=np.zeros_like(values), where=size > 0)
        states = np.vstack([z, phase * z])
        return values, shapes, states / np.linalg.norm(states, axis=0)

    def advance(self, mu: float, before: _Place, depth: int) -> tuple[_Place, Array]:
        """The modes at mu in the order of `before`, and the likeness."""
        from scipy.optimize import linear_sum_assignment

        values, shapes, states = self.states(mu)
        mac = np.abs(before.states.conj().T @ states) ** 2
        radius = max(np.abs(values).max(), np.abs(before.values).max()) or 1.0
        distance = np.abs(before.values[:, None] - values[None, :]) / radius
        _, order = linear_sum_assignment(distance - mac)
        likeness = mac[np.arange(len(order)), order]
        # what is unlike since earlier steps, such as a mode that diverges, no halving makes alike
        if depth > 0 and np.any((likeness < SURE) & ~before.mixed):
            half, _ = self.advance((before.mu + mu) / 2, before, depth - 1)
            return self.advance(mu, half, depth - 1)
        mixed = likeness < KEEP
        states = np.where(mixed, before.states, states[:, order])
        return _Place(mu, values[order], shapes[:, order], states, mixed), likeness


def track(system: System, mus: Iterable[float], halvings: int = DEPTH) -> TrackedModes:
    """Modes of system(mu) -> (M, C, K) along the values `mus`, in the order they are given.

    Neighbouring values are matched one to one (assignment problem) by the modal assurance
    criterion of shape and velocity and by the distance of the eigenvalues. Where the match is
    not clear the step is halved, up to `halvings` times. Modes which cross keep their shapes;
    modes which veer keep their branch if the steps are no longer than the veering.
    Raises InputError for what is no sequence of numbers, and what `system` does.
    """
    check_system(system, "track")
    steps = values_of("track", mus)
    tracker = _Tracker(system, steps)
    first = tracker.states(steps[0])
    rows = [(_Place(steps[0], *first, np.zeros(len(first[0]), dtype=bool)), np.ones(len(first[0])))]
    for mu in steps[1:]:
        rows.append(tracker.advance(mu, rows[-1][0], halvings))
    places, likeness = zip(*rows, strict=True)
    values, shapes = (np.array([getattr(p, name) for p in places]) for name in ("values", "shapes"))
    return TrackedModes(np.array(steps), values, shapes, np.array(likeness))
