"""Reduced systems: projections of a large one that have its roots in a band or region, over a range
of the parameters. `FirstLook` is the modal one, on real modes; `Reduction` the one on full
solutions; `DispersiveReduction` that for matrices that follow the frequency."""

import math
import warnings
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from squeal.errors import InputError, InputWarning
from squeal.io.writing import JsonObject, copied_attributes
from squeal.linear.continuation import ProblemClass, problem_class_of
from squeal.linear.eigen import Eigenvalue
from squeal.linear.roots import ordered
from squeal.linear.system import TermSystem
from squeal.numerics.differentiation import Parameters
from squeal.queries.systems.all_roots import NO_BAND, is_small, roots_of_all
from squeal.queries.systems.verdicts import rounding_of, verdict_of_some
from squeal.results.eigenvalues import eigenvalues_of_arrays
from squeal.results.sources import EigenvalueSelection
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.dispersive import DispersiveReduction, frequencies
from squeal.sparse.first_look import FirstLook
from squeal.sparse.lowest_roots import lowest_modes
from squeal.sparse.quadratic import Array, Bools, ComplexArray, Roots, ScaledSystem
from squeal.sparse.reduction import RESIDUAL_TOLERANCE, Reduction, reduce_system


def _region_of(
    scaled: ScaledSystem, selection: EigenvalueSelection, changes: Parameters
) -> Rectangle:
    """The selected region, else a rectangle around the lowest modes at some parameters, in rad/s.

    Modes that are damped so much that their real part is more than a quarter of the largest
    |lambda| lie outside. Raises InputError without a region where no number of modes is selected,
    or matrices follow the frequency.
    """
    if selection.rectangle is not None:
        return selection.rectangle
    if scaled.system.follows or selection.modes is None:
        raise InputError(NO_BAND)
    if is_small(scaled.system):
        roots = roots_of_all(scaled.system, EigenvalueSelection(), changes)
        sizes = np.sort(np.abs(roots[roots.imag >= 0.0]))
        radius = float(sizes[: selection.modes][-1])  # of the highest of the lowest modes
    else:
        radius = lowest_modes(scaled.at(changes), selection.modes, certify=False).region.radius
    radius *= 1.2  # rad/s: at other parameters the modes may lie higher
    if radius == 0.0:  # all of the modes are rigid-body motions, and give no scale
        radius = 1.0
    # a little below the real axis, so that real roots lie inside
    return Rectangle(
        low_real=-radius / 4, high_real=radius / 4, low_imag=-1e-6 * radius, high_imag=radius
    )


def reduced_for(
    system: TermSystem,
    selection: EigenvalueSelection,
    values: Sequence[Parameters],
    method: str = "reduced",
) -> Reduction:
    """Reduce a system to the selected roots, to be good at some values of its parameters.

    Warns if the roots do not solve the full problem to the tolerance, or if real modes may lose
    roots, so that the full problem is solved at each value.

    Parameters
    ----------
    system : TermSystem
        The full system.
    selection : EigenvalueSelection
        The band, region or number of modes that the reduced system has to have.
    values : sequence of mapping
        The parameters at which it has to be good, each by name; others have the system's values.
    method : {"reduced", "modal"}
        Projection onto full solutions, or onto real modes and their corrections. Where matrices
        follow the frequency it is "reduced", whatever is requested.
    """
    scaled = ScaledSystem(system)
    middle = values[len(values) // 2]
    region = _region_of(scaled, selection, middle)
    if method == "modal" and not system.follows:
        first_look = FirstLook(scaled, region, values).build()
        if not first_look.is_complete:
            warnings.warn(
                f"real modes up to {first_look.reach / math.tau:.4g} Hz and their corrections may "
                f"lose roots of the band (what they lack contracts by "
                f"{first_look.contraction:.2g} only); each value is solved on the full system",
                InputWarning,
                stacklevel=3,
            )
        return first_look
    reduction_class = Reduction
    if system.follows:  # the reduced system has to be good at each frequency of the band, too
        reduction_class = DispersiveReduction
        at_frequencies: list[Parameters] = []
        for changes in values:
            for omega in frequencies(system, region).tolist():
                at_frequencies.append({**changes, **system.frequency(omega)})
        values = at_frequencies
    reduction = reduce_system(scaled, region, values, reduction_class)
    if not reduction.converged:
        warnings.warn(
            f"{len(reduction.samples)} full solutions do not suffice for the reduced system: a "
            f"root has a residual of {reduction.worst_residual:.2g} in the full problem, "
            f"{RESIDUAL_TOLERANCE:g} is wanted; a narrower band or range is required",
            InputWarning,
            stacklevel=3,
        )
    return reduction


def first_look_for_thresholds(
    system: TermSystem, selection: EigenvalueSelection, values: Sequence[Parameters]
) -> FirstLook | None:
    """A first look: a projection onto real modes, small and good enough to search thresholds.

    It is much cheaper than `reduced_for`. values: the parameters at which it has to be good.

    There is none (None is returned)

    - without a region, and for one that reaches the real axis;
    - without damping or mass;
    - for complex matrices, and for those that follow the frequency;
    - where the projection fails or does not converge, or has no trained basis of few modes.
    """
    region = selection.rectangle
    is_suited = system.real and bool(system.C) and not system.follows
    if region is None or region.low_imag <= 0.0 or not is_suited:
        return None
    # the first look fails where the matrices have no value without friction or no mass (InputError)
    # or are singular there (ZeroDivisionError), and for a motion without mass (LinAlgError)
    with suppress(InputError, ZeroDivisionError, np.linalg.LinAlgError):
        first_look = FirstLook(ScaledSystem(system), region, values).build()
        matrices = [first_look.system.arrays(changes) for changes in values]
        is_damped = problem_class_of(matrices) is ProblemClass.DAMPED
        has_trained_basis = bool(first_look.reduced_basis)  # of few modes, which makes it cheap
        if is_damped and first_look.converged and has_trained_basis:
            return first_look
    return None


class ComputedRoots(NamedTuple):
    """Roots (m,) at some parameters, in no order.

    Attributes
    ----------
    values, residuals, rounding : array (m,)
        The roots in rad/s, their backward errors in the full problem, and how far rounding, or what
        a first look leaves out, may move them, 1/s.
    with_vectors : Roots
        The roots with their vectors, of a reduced system in its coordinates; of a first look those
        without an estimate are left out.
    verdict : str or None
        On the roots; None where they do not decide.
    spurious : int
        Number of roots of the reduced system that the full one has not; they are left out.
    corrected : array (m,) of bool, or None
        Of a first look: which roots solve the full problem; the others are estimated.
    certified : bool or None
        Whether it is certified that no root is missing; None where nothing was counted.
    """

    values: ComplexArray
    residuals: Array
    rounding: Array
    with_vectors: Roots
    verdict: str | None
    spurious: int = 0
    corrected: Bools | None = None
    certified: bool | None = None


def roots_of_reduction(reduction: Reduction, changes: Parameters) -> ComputedRoots:
    """Compute the roots of a reduced system at some parameters.

    Each has a residual in the full problem. A first look also knows how far its estimates may be
    off (1/s), and which of them it has corrected in the full problem.
    """
    corrected = None
    errors: Array | float = 0.0
    if isinstance(reduction, FirstLook):
        estimate = reduction.estimate(changes)
        values = estimate.values
        residuals = estimate.residuals
        errors = estimate.errors
        with_vectors = estimate.projected
        spurious = estimate.spurious
        corrected = estimate.corrected
    else:
        with_vectors, residuals, spurious = reduction.modes(changes)
        values = with_vectors.values
    # rounding of the full matrices, or what a first look leaves out
    rounding = np.maximum(errors, rounding_of(reduction.scaled.system, values))
    verdict = verdict_of_some(values, rounding)
    return ComputedRoots(values, residuals, rounding, with_vectors, verdict, spurious, corrected)


def estimated_roots(reduction: Reduction, changes: Parameters) -> tuple[Eigenvalue, ...]:
    """The roots of a reduced system at some parameters, by rising frequency.

    Their right vectors are in its coordinates. Zero roots of rigid bodies, which have none in a
    first look, get that of the nearest other root, or zeros if there is no other root.
    """
    roots = roots_of_reduction(reduction, changes)
    right = roots.with_vectors.right
    if not right.size:
        right = np.full((len(right), len(roots.values)), 0j)
    elif roots.corrected is not None:
        distances = np.abs(roots.with_vectors.values[:, None] - roots.values)
        right = right[:, np.argmin(distances, axis=0)]
    order = ordered(roots.values)
    return eigenvalues_of_arrays(
        roots.values[order], roots.residuals[order], roots.rounding[order], right[:, order]
    )


def growth_limit(selection: EigenvalueSelection, region: Rectangle) -> float | None:
    """The growth rate, 1/s, up to which roots were searched, of a band or of the lowest modes.

    None of a region, whose bounds the user states.
    """
    return None if selection.region is not None else region.high_real


def basis_of(reduction: Reduction | None, selection: EigenvalueSelection) -> JsonObject | None:
    """A reduced system as JSON holds it; None where the system itself was solved."""
    if reduction is None:
        return None
    entry = copied_attributes(reduction, "method size converged spurious")
    entry |= {
        "rows": reduction.scaled.n,
        "samples": [dict(changes) for changes in reduction.samples],
        "residual": reduction.worst_residual,
        "contraction": None,
        "real_modes_hz": None,
        "growth_limit": growth_limit(selection, reduction.region),
    }
    if isinstance(reduction, FirstLook):
        entry["contraction"] = reduction.contraction
        entry["real_modes_hz"] = reduction.reach / math.tau
    return entry
