"""Roots of matrices that depend on the frequency of each root: a nonlinear eigenproblem.

With omega = |Im lambda|, P(lambda, omega) = lambda^2 M + lambda C(omega) + K(omega) is what moduli
measured at real frequencies define, and what finite-element programs solve; on the imaginary axis,
where verdicts change, it is exact for any modulus. The matrices are frozen at some frequencies of
the band. Each root there that lies near its frequency starts Newton's method with the derivative by
omega. All of it happens in a reduced system that serves all of these frequencies; residuals of the
full problem, times the inverse of one frozen P, then bring the directions that are missing.

Since omega = |Im lambda| is no analytic function of lambda, no argument principle counts the roots.
Newton's method should reach each root from the frozen frequencies on both sides of it. The number
of roots of which that is not so is reported as `unsure`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from squeal.errors import InputError
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import applied, inertia
from squeal.linear.moduli import FREQUENCY, Modulus
from squeal.linear.system import System
from squeal.numerics.differentiation import Parameters
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.corrections import (
    ACCEPTED_RESIDUAL,
    EXACT_RESIDUAL,
    MOST_CORRECTIONS,
    Residuals,
    residuals_of,
)
from squeal.sparse.dense import roots_at
from squeal.sparse.factor import factorise_at
from squeal.sparse.krylov import exact_roots_in
from squeal.sparse.quadratic import Array, ComplexArray, Roots, eigenvalues_of, report_progress
from squeal.sparse.reduction import ReducedProblem, Reduction

# Where matrices are frozen, and when a root is found
FROZEN_FREQUENCIES = 7  # frequencies of a band, its ends among them
MOST_FREQUENCIES = 60  # frequencies at all: where roots merge others join
NEAR_INTERVALS = 1.5  # intervals from a frozen frequency within which its roots start
NEWTON_STEPS = 30  # of Newton's method
CONVERGED_STEP = 1e-8  # last steps of z and omega, relative to the root; its error is the square
SAME_SHARE = 1e-7  # relative: nearer roots are one
KRYLOV_ROWS = 150  # of reduced systems whose roots near a frequency are computed without the others


@dataclass
class RepeatedRoot:
    """A root that Newton's method has reached, at its own frequency."""

    value: complex  # rad/s
    multiplicity: int = 1
    # True: it was reached from a frozen frequency above its own; False: from one below or equal
    from_above: set[bool] = field(default_factory=set)


class ModesAtOwnFrequencies(NamedTuple):
    """Roots of the full system, each at its own frequency."""

    eigenvalues: tuple[Eigenvalue, ...]
    unsure: int  # number of roots that were reached from frozen frequencies on one side alone


def frequencies(system: System, region: Rectangle) -> Array:
    """The frequencies (rad/s) at which matrices are frozen: evenly spaced over a region's band, its
    ends among them.

    The region reaches above the real axis. Raises InputError unless the tables of moduli cover its
    band.
    """
    low = max(region.low_imag, 0.0)
    high = region.high_imag
    least, most = system.covered
    low_hz = low / math.tau
    high_hz = high / math.tau
    # an end that differs from that of the tables by rounding alone, as of rad/s to Hz, is covered
    if low_hz < least * (1 - 1e-9) or high_hz > most * (1 + 1e-9):
        raise InputError(
            f"{', '.join(_tables(system))}: {least:g} to {most:g} Hz are covered; "
            f"{low_hz:g} to {high_hz:g} Hz are needed"
        )
    return np.clip(np.linspace(low, high, FROZEN_FREQUENCIES), math.tau * least, math.tau * most)


def around(omega: float, region: Rectangle, system: System, intervals: float) -> Rectangle:
    """The part of a region around a frequency (rad/s), some intervals of the frozen frequencies
    to either side."""
    reach = intervals * float(np.diff(frequencies(system, region)).max())
    return replace(
        region,
        low_imag=max(region.low_imag, omega - reach),
        high_imag=min(region.high_imag, omega + reach),
    )


def _tables(system: System) -> list[str]:
    """Names of the files of moduli over frequency, sorted."""
    names = set()
    for term in system.terms:
        if isinstance(term.factor, Modulus) and term.factor.table:
            names.add(term.factor.table.source)
    return sorted(names)


class DispersiveReduction(Reduction):
    """A reduction of matrices that depend on the frequency of each root.

    If `changes` name a frequency the matrices are frozen at that frequency, and roots are those
    near it; otherwise each root is one of the matrices at its own frequency.
    """

    def frozen(self, omega: float, region: Rectangle) -> DispersiveReduction:
        """The reduction frozen at one frequency (rad/s), in a region around that frequency."""
        other = copy(self)
        other.system = self.system.frozen(omega)
        other.region = region
        return other

    def _is_frozen(self, changes: Parameters) -> bool:
        """True if the changes name the frequency that the matrices depend on."""
        return changes.keys() >= set(self.system.follows)

    def roots(self, changes: Parameters, values: ComplexArray | None = None) -> Roots:
        """The roots in the region, each at its own frequency, or near the one that is named."""
        if self._is_frozen(changes):
            return super().roots(changes, values)
        assert values is None
        return vectors_of(self, changes, roots_at_own_frequencies(self, changes))

    def _values_in_region(self, problem: ReducedProblem) -> ComplexArray:
        """The roots in the region near the frequency at which the matrices are frozen."""
        near = self.region
        for name in self.system.follows:  # all of these names hold the same frequency
            omega = problem.parameters[name] / FREQUENCY[name]
            near = around(omega, self.region, self.system, NEAR_INTERVALS)
        key = frozenset(problem.parameters.items()), near
        if key not in self._values_at:
            M, C, K = problem.matrices
            values = None
            # roots of undamped systems lie exactly on the axis if all are computed
            if self.size >= KRYLOV_ROWS and (C is not None or np.iscomplexobj(K)):
                values = exact_roots_in(M, C, K, near)
            if values is None:
                values = super()._values_in_region(problem)
                values = values[near.contains(values)]
            self._values_at[key] = values
        return self._values_at[key]

    def residuals(self, roots: Roots, changes: Parameters) -> Array:
        """Backward errors (m,) in the full problem of roots of the reduced one, estimated."""
        if self._is_frozen(changes):
            return super().residuals(roots, changes)
        residuals = np.zeros(len(roots.values))
        for k, value in enumerate(roots.values):
            at_frequency = {**changes, **self.system.frequency(abs(value.imag))}
            residuals[k] = super().residuals(roots.select(np.array([k])), at_frequency).item()
        return residuals


def roots_at_own_frequencies(
    reduction: DispersiveReduction, changes: Parameters
) -> list[RepeatedRoot]:
    """The roots of a reduced system in its region, each at its own frequency, by Newton's method.

    At each frozen frequency the method starts from those roots of the frozen matrices that lie near
    that frequency. If several starts end at one root, its own frequency is added to the frozen
    ones, to learn its multiplicity: the matrices frozen there have the root itself, as often as its
    multiplicity, and as many starts end at it. Starts of several close roots end at different ones.

    changes: parameters that do not have the system's own values.
    """
    system = reduction.system
    grid = frequencies(system, reduction.region)
    pending = grid.tolist()  # frequencies at which matrices are still to be frozen
    tried: list[float] = []
    reached: list[RepeatedRoot] = []
    while pending and len(tried) < MOST_FREQUENCIES:
        omega = pending.pop(0)
        tried.append(omega)
        starts = reduction.modes({**changes, **system.frequency(omega)}).roots
        ends = []
        for k in range(len(starts.values)):
            end = _newton(reduction, changes, starts.select(np.array([k])), omega, grid)
            if end is not None:
                ends.append(end)
        for z in ends:
            coincident = sum(_is_same(z, other) for other in ends)  # starts that end at z
            root = next((other for other in reached if _is_same(z, other.value)), None)
            if root is None:
                root = RepeatedRoot(z)
                reached.append(root)
            root.from_above.add(omega > z.imag)  # from which side of its frequency it was reached
            distance = SAME_SHARE * abs(z)
            if abs(z.imag - omega) <= distance:  # the matrices are frozen at the root's frequency
                root.multiplicity = max(root.multiplicity, coincident)
            elif coincident > 1 and all(abs(z.imag - w) > distance for w in tried + pending):
                pending.append(z.imag)
    return [root for root in reached if reduction.region.contains(np.array(root.value))]


def _is_same(z: complex, other: complex) -> bool:
    return abs(z - other) <= SAME_SHARE * abs(z)


def vectors_of(
    reduction: DispersiveReduction, changes: Parameters, repeated: Sequence[RepeatedRoot]
) -> Roots:
    """Roots with right and left vectors of the reduced system, each at its own frequency; a
    repeated root stands as often as its multiplicity."""
    roots = Roots.none(reduction.size)
    for root in repeated:
        at_frequency = {**changes, **reduction.system.frequency(abs(root.value.imag))}
        values = np.full(root.multiplicity, root.value)
        roots = roots.joined(reduction.roots(at_frequency, values))
    return roots


def _newton(
    reduction: DispersiveReduction, changes: Parameters, start: Roots, frozen: float, grid: Array
) -> complex | None:
    """The root at its own frequency next to `start`, one root of the system frozen at `frozen`.

    None if Newton's method does not converge, if y^H P' x vanishes, or if the method converges to a
    root whose frequency lies beyond the ends of the `grid` (frequencies in rad/s).

    With right and left vectors x, y of P(z, omega) the unknowns of a step are dz and domega, the
    equations y^H (P + P' dz + dP/domega domega) x = 0 and Im(z + dz) = omega + domega; P' is dP/dz.
    The first equation is dz = step + root_by_omega domega, from which the second one gives domega.
    omega is kept within the ends of the `grid`.
    """
    system = reduction.system
    root = start
    z = root.values.item()
    omega = frozen
    at_omega = {**changes, **system.frequency(omega)}
    matrices = system.at(at_omega)
    for _ in range(NEWTON_STEPS):
        x = root.right[:, 0]
        y = root.left[:, 0].conj()
        residual = y @ applied(matrices, z, x)
        by_root = y @ inertia(matrices, z, x)
        by_omega = 0j
        # parameters that hold the frequency are proportional to omega, so that their values at
        # 1 rad/s are their derivatives by omega
        for name, d_by_omega in system.frequency(1.0).items():
            by_omega += d_by_omega * (y @ applied(system.derivative(name, at_omega), z, x))
        if by_root == 0:
            return None
        step = -residual / by_root
        root_by_omega = -by_omega / by_root
        excess = (z + step).imag - omega
        # the slope of the excess by omega is Im root_by_omega - 1; any step serves where it is zero
        omega_step = excess / ((1 - root_by_omega.imag) or 1.0)
        step += root_by_omega * omega_step
        z = z + step
        omega = float(np.clip(omega + omega_step, grid[0], grid[-1]))
        # both steps count: the first one of z may be zero if moduli are constant there, and that of
        # omega does not shrink where omega is kept at an end of the grid
        if max(abs(step), abs(omega_step)) <= CONVERGED_STEP * abs(z):
            return z
        at_omega = {**changes, **system.frequency(omega)}
        matrices = system.at(at_omega)
        root = roots_at(*matrices, np.array([z]))  # for its vectors; z stays as it is
    return None


def modes_at_own_frequencies(
    reduction: DispersiveReduction, changes: Parameters
) -> ModesAtOwnFrequencies:
    """The roots of the full system in the region of a reduced one, each at its own frequency.

    By residual inverse iteration (Neumaier 1985): roots of the reduced system leave residuals in
    the full one; P^-1 of one frozen frequency times these residuals enlarges the basis of
    `reduction`, which changes it, until the roots solve the full system to rounding or no longer
    improve.
    """
    scaled = reduction.scaled
    system = scaled.system
    region = reduction.region
    middle = system.frequency((max(region.low_imag, 0.0) + region.high_imag) / 2)
    # at the centre or next to it: any value near the roots serves
    _, factor = factorise_at(scaled.at({**changes, **middle}), region.centre)
    report_progress("solving for the roots at their own frequencies")
    repeated = roots_at_own_frequencies(reduction, changes)
    grid = frequencies(system, region)
    worst_before = np.inf
    for _ in range(MOST_CORRECTIONS):
        full = vectors_of(reduction, changes, repeated).expanded(reduction.vectors)
        # each root has a problem of its own: the matrices at its frequency
        single_roots = [full.select(np.array([k])) for k in range(len(full.values))]
        problems = [scaled.at({**changes, **system.frequency(z.imag)}) for z in full.values]
        residuals = Residuals(np.zeros_like(full.right), np.zeros_like(full.right))
        for k, problem in enumerate(problems):
            of_root = residuals_of(problem, single_roots[k])
            residuals.right[:, [k]] = of_root.right
            residuals.left[:, [k]] = of_root.left
        errors = np.linalg.norm(residuals.right, axis=0)
        errors = np.maximum(errors, np.linalg.norm(residuals.left, axis=0))
        worst = float(np.max(errors, initial=0.0))
        is_halved = worst <= worst_before / 2
        if worst <= EXACT_RESIDUAL or (not is_halved and worst <= ACCEPTED_RESIDUAL):
            break
        worst_before = worst
        is_unsolved = errors > EXACT_RESIDUAL
        reduction.extend(residuals.corrections(factor, is_unsolved, is_unsolved))
        for root in repeated:
            omega = root.value.imag
            at_root = {**changes, **system.frequency(omega)}
            start = reduction.roots(at_root, np.array([root.value]))
            # Newton's method in the enlarged basis; where it fails the root stays as it was
            root.value = _newton(reduction, changes, start, omega, grid) or root.value
    eigenvalues: list[Eigenvalue] = []
    for problem, single_root in zip(problems, single_roots, strict=True):
        eigenvalues += eigenvalues_of(problem, single_root)
    eigenvalues.sort(key=lambda e: e.value.imag)
    unsure = sum(len(root.from_above) == 1 for root in repeated)
    return ModesAtOwnFrequencies(tuple(eigenvalues), unsure)
