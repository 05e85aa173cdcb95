"""Roots of matrices that depend on the frequency of each root: a nonlinear eigenproblem.

With omega = |Im lambda|, P(lambda, omega) = lambda^2 M + lambda C(omega) + K(omega) is what moduli
measured at real frequencies define, and what finite-element programs solve; on the imaginary axis,
where verdicts change, it is exact for any modulus. The matrices are frozen at some frequencies of
the band. Each root there that lies near its frequency starts Newton's method with the derivative by
omega. All of it happens in a reduced system that serves all of these frequencies; residuals of the
full problem, times the inverse of one frozen P, then bring the directions that are missing.

Since omega = |Im lambda| is no analytic function of lambda, no argument principle counts the roots.
Each should be reached from the frozen frequencies on both its sides; those that are not are
counted as `unsure`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from squeal.errors import InputError
from squeal.linear.eigen import Eigenvalue
from squeal.linear.moduli import Modulus
from squeal.linear.system import TermSystem
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.eigensolver import OPTIONS as SOLVER
from squeal.sparse.factor import factorise_at
from squeal.sparse.quadratic import (
    PROGRESS,
    Array,
    Roots,
    eigenvalues_of,
    multiply,
)

Reduction = Any
"""A `Reduction` of squeal.sparse.reduction, whose roots are solved for here."""
Changes = Mapping[str, float]


@dataclass(frozen=True)
class DispersiveOptions:
    """Where matrices are frozen, and when a root is found."""

    frozen: int = 7  # frequencies of a band, its ends among them
    most: int = 60  # frequencies at all: where roots merge others join
    near: float = 1.5  # intervals from a frozen frequency within which its roots start
    steps: int = 30  # of Newton's method
    converged: float = 1e-10  # last step, relative to the root; its error is about the square
    same: float = 1e-7  # relative: nearer roots are one


OPTIONS = DispersiveOptions()


class Settled(NamedTuple):
    """Roots of the reduced system at their own frequencies."""

    roots: list[tuple[complex, int]]  # with how often each is one
    unsure: int  # roots that the frozen frequency on one side alone led to


def frequencies(system: TermSystem, region: Rectangle) -> Array:
    """Frequencies (rad/s) of a band at which matrices are frozen.

    Raises InputError unless the region lies above the real axis and the tables cover it.
    """
    low, high = max(region.low_imag, 0.0), region.high_imag
    if not low < high:
        raise InputError("region: lies below the real axis, where frequencies mean nothing")
    least, most = system.covered
    ends = low / (2 * np.pi), high / (2 * np.pi)
    moduli = (t.factor for t in system.terms if isinstance(t.factor, Modulus))
    names = {modulus.table.source for modulus in moduli if modulus.table}
    if ends[0] < least * (1 - 1e-9) or ends[1] > most * (1 + 1e-9):
        raise InputError(
            f"{', '.join(sorted(names))}: {least:g} to {most:g} Hz are covered; "
            f"{ends[0]:g} to {ends[1]:g} Hz are needed"
        )
    return np.clip(np.linspace(low, high, OPTIONS.frozen), 2 * np.pi * least, 2 * np.pi * most)


def frozen_parts(reduction: Reduction) -> Iterator[tuple[Reduction, float, float]]:
    """A reduced system frozen at each of some frequencies, in a region around it, with the
    frequency and the distance of the next."""
    region = reduction.region
    grid = frequencies(reduction.system, region)
    wide = float(np.diff(grid).max())
    reach = (OPTIONS.near + 0.5) * wide
    for omega in grid.tolist():
        low, high = max(region.low_imag, omega - reach), min(region.high_imag, omega + reach)
        around = replace(region, low_imag=low, high_imag=high)
        yield reduction.frozen(omega, around), omega, wide


def settled(reduction: Reduction, changes: Changes) -> Settled:
    """The roots of a reduced system in its region, each at its own frequency."""
    system, region = reduction.system, reduction.region
    grid = frequencies(system, region)
    wide, todo, tried = np.diff(grid).max(), grid.tolist(), list[float]()
    found: list[list[Any]] = []  # a root, how often it is one, whether met from below, from above
    while todo and len(tried) < OPTIONS.most:
        omega = todo.pop(0)
        tried.append(omega)
        starts = reduction.values({**changes, **system.frequency(omega)})
        starts = starts[np.abs(starts.imag - omega) <= OPTIONS.near * wide]
        ends = [_own(reduction, changes, z, omega, grid) for z in starts.tolist()]
        good = [z for z in ends if z is not None]
        for z in good:
            near, count = OPTIONS.same * abs(z), sum(_same(z, other) for other in good)
            one = next((f for f in found if _same(z, f[0])), None)
            if one is None:
                found.append(one := [z, 1, False, False])
            if abs(z.imag - omega) <= near:  # as often one as with these matrices
                one[1] = max(one[1], count)
            elif count > 1 and all(abs(z.imag - w) > near for w in tried + todo):
                todo.append(z.imag)  # two starts met: frozen there, they part
            one[2 if z.imag >= omega else 3] = True
    inside = [f for f in found if region.contains(np.array(f[0]))]
    sides = [f[2] and f[3] for f in inside]
    return Settled([(f[0], f[1]) for f in inside], len(sides) - sum(sides))


def _same(z: complex, other: complex) -> bool:
    return abs(z - other) <= OPTIONS.same * abs(z)


def vectors(reduction: Reduction, changes: Changes, found: list[tuple[complex, int]]) -> Roots:
    """Such roots with right and left vectors of the reduced system."""
    none = np.zeros((reduction.size, 0), dtype=complex)
    roots = Roots(np.zeros(0, dtype=complex), none, none)
    for z, count in found:
        at = {**changes, **reduction.system.frequency(abs(z.imag))}
        roots = roots.joined(reduction.roots(at, True, np.full(count, z)))
    return roots


def _own(
    reduction: Reduction, changes: Changes, z: complex, omega: float, grid: Array
) -> complex | None:
    """The root at its own frequency next to one of the system frozen at omega; None without one.

    With right and left vectors x, y of P, and all by first order in dz and domega,
    y P x + y P' x dz + y dP/domega x domega = 0 where z + dz has the imaginary part omega + domega.
    """
    system = reduction.system
    for _ in range(OPTIONS.steps):
        at = {**changes, **system.frequency(omega)}
        one = reduction.roots(at, True, np.array([z]))
        x, y = one.right[:, 0], one.left[:, 0].conj()
        M, C, K = system.at(at)
        slope = y @ (2 * z * (M @ x)) + (0.0 if C is None else y @ (C @ x))
        rest = z * z * (y @ (M @ x)) + y @ (K @ x) + (0.0 if C is None else z * (y @ (C @ x)))
        moved = 0j
        for name, share in system.frequency(1.0).items():
            parts = zip(system.derivative(name, at), (z * z, z, 1.0), strict=True)
            moved += share * sum(f * (y @ (A @ x)) for A, f in parts if A is not None)
        if slope == 0:
            return None
        step, turn = -rest / slope, moved / slope
        change = ((z + step).imag - omega) / (1 + turn.imag or 1.0)
        step -= turn * change
        z, omega = z + step, float(np.clip(omega + change, grid[0], grid[-1]))
        if abs(step) <= OPTIONS.converged * abs(z):
            return z if abs(z.imag - omega) <= OPTIONS.converged * abs(z) else None
    return None


def modes_at_own_frequencies(
    reduction: Reduction, changes: Changes
) -> tuple[tuple[Eigenvalue, ...], int]:
    """The roots of the full system in the region of a reduced one, each at its own frequency, with
    left vectors and backward errors there, and how many are `unsure`.

    The reduced system grows until they solve the full one.
    """
    scaled, region, system = reduction.scaled, reduction.region, reduction.scaled.system
    middle = system.frequency((max(region.low_imag, 0.0) + region.high_imag) / 2)
    _, factor = factorise_at(scaled.at({**changes, **middle}), region.centre)
    PROGRESS.get()("solving for the roots at their own frequencies")
    (found, unsure), before = settled(reduction, changes), np.inf
    grid = frequencies(system, region)
    for _ in range(SOLVER.corrections):
        roots = vectors(reduction, changes, found)
        x, y = (multiply(reduction.vectors, X) for X in (roots.right, roots.left.conj()))
        problems = [scaled.at({**changes, **system.frequency(z.imag)}) for z in roots.values]
        rests = np.zeros((2, *x.shape), dtype=complex)
        for k, (problem, z) in enumerate(zip(problems, roots.values, strict=True)):
            for rest, one, X in zip(rests, (problem, problem.transposed()), (x, y), strict=True):
                rest[:, [k]] = one.apply(np.array([z]), X[:, [k]]) / one.size(z)
        errors = np.linalg.norm(rests, axis=1)
        worst = float(np.max(errors, initial=0.0))
        if worst <= SOLVER.exact or before / 2 < worst <= SOLVER.accepted:
            break
        before, late = worst, np.any(errors > SOLVER.exact, axis=0)
        reduction.extend(np.hstack([factor.solve(rests[k][:, late], k == 1) for k in range(2)]))
        found = [(_own(reduction, changes, z, z.imag, grid) or z, count) for z, count in found]
    full = Roots(roots.values, x, y.conj())
    each = [eigenvalues_of(one, full.select(np.array([k])))[0] for k, one in enumerate(problems)]
    return tuple(sorted(each, key=lambda e: e.value.imag)), unsure
