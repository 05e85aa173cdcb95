"""Modes followed through a sweep, by the likeness of their shapes and not by their order."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from squeal.stability.eigen import ComplexArray, complex_eigenvalues
from squeal.stability.matrices import Array, System, check_system

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


class _Tracker:
    def __init__(self, system: System) -> None:
        self.system = system

    def states(self, mu: float) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Eigenvalues (2n,), shapes (n, 2n), and unit states (2n, 2n) that tell them apart.

        A state is the shape with its velocity, in mass-normalised coordinates and in units in
        which |lambda| = 1: a mode and its complex conjugate are then orthogonal.
        """
        matrices = self.system(mu)
        spectrum = complex_eigenvalues(*matrices)
        values = spectrum.values
        shapes = np.array([e.right for e in spectrum.eigenvalues]).T
        z = np.linalg.cholesky(np.asarray(matrices[0], dtype=float)).T @ shapes
        size = np.abs(values)
        phase = np.divide(values, size, out=np.zeros_like(values), where=size > 0)
        states = np.vstack([z, phase * z])
        return values, shapes, states / np.linalg.norm(states, axis=0)

    def advance(
        self, mu: float, before: tuple[float, ComplexArray, ComplexArray], depth: int
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, Array]:
        """Values, shapes, reference states at mu in the order of `before`, and the likeness."""
        from scipy.optimize import linear_sum_assignment

        mu0, values0, states0 = before
        values, shapes, states = self.states(mu)
        mac = np.abs(states0.conj().T @ states) ** 2
        radius = max(np.abs(values).max(), np.abs(values0).max()) or 1.0
        distance = np.abs(values0[:, None] - values[None, :]) / radius
        _, order = linear_sum_assignment(distance - mac)
        likeness = mac[np.arange(len(order)), order]
        if likeness.min() < SURE and depth > 0:
            middle = (mu0 + mu) / 2
            half = self.advance(middle, before, depth - 1)
            return self.advance(mu, (middle, half[0], half[2]), depth - 1)
        values, shapes, states = values[order], shapes[:, order], states[:, order]
        mixed = likeness < KEEP
        states[:, mixed] = states0[:, mixed]
        return values, shapes, states, likeness


def track(system: System, mus: Iterable[float], halvings: int = DEPTH) -> TrackedModes:
    """Modes of system(mu) -> (M, C, K) along the values `mus`, in the order they are given.

    Neighbouring values are matched one to one (assignment problem) by the modal assurance
    criterion of shape and velocity and by the distance of the eigenvalues. Where the match is
    not clear the step is halved, up to `halvings` times. Modes which cross keep their shapes;
    modes which veer keep their branch if the steps are no longer than the veering.
    Raises what `system` does.
    """
    check_system(system, "track")
    steps = [float(mu) for mu in mus]
    if not steps:
        raise ValueError("mus: at least one value is required")
    tracker = _Tracker(system)
    values, shapes, states = tracker.states(steps[0])
    rows = [(values, shapes, np.ones(len(values)))]
    for mu0, mu in itertools.pairwise(steps):
        values, shapes, states, likeness = tracker.advance(mu, (mu0, values, states), halvings)
        rows.append((values, shapes, likeness))
    parts = [np.array(part) for part in zip(*rows, strict=True)]
    return TrackedModes(np.array(steps), parts[0], parts[1], parts[2])
