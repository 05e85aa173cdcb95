"""Eigenvalues of a pad about its sliding equilibrium; its matrices along the branch from mu = 0."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from squeal.equilibrium import Equilibrium, Path, sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.linear import Judgement, Spectrum, SystemFunction
from squeal.linear.eigen import spectrum_of
from squeal.linear.matrices import EPS, checked, reduce
from squeal.linear.roots import STIFF, hides_slow_roots
from squeal.linear.verdicts import decide
from squeal.model.equations import Linearisation, PadModel, about_origin, linearise
from squeal.results.sources import PadAnalysis


def at_equilibrium(model: PadModel, equilibrium: Equilibrium) -> Linearisation:
    """The linearisation of a model about one of its equilibria."""
    return linearise(model, np.array(equilibrium.q), equilibrium.state)


def analyse(scene: Scene) -> PadAnalysis:
    """Complex eigenvalue analysis of the scene's sliding equilibrium (B3: about the origin).

    Raises ComputationError, with the reason, if no steady sliding exists.
    """
    model = damped_model(scene)
    if model.linear:
        return analyse_about_origin(model)
    equilibrium, how = sliding_equilibrium(model)
    if equilibrium is None:
        raise ComputationError(how)
    return analyse_equilibrium(model, equilibrium, how)


def analyse_about_origin(model: PadModel) -> PadAnalysis:
    """Eigenvalues of a linear model, in full contact about the origin, and the verdict."""
    matrices = about_origin(model)
    spectrum, judgement = roots_and_verdict(*matrices)
    return PadAnalysis(
        model=model.name,
        q=(0.0, 0.0, 0.0),
        R_n=None,
        state=model.full,
        how="about the origin, full contact",
        matrices=matrices,
        spectrum=spectrum,
        judgement=judgement,
    )


def analyse_equilibrium(model: PadModel, equilibrium: Equilibrium, how: str) -> PadAnalysis:
    """Eigenvalues of a model about one of its equilibria, at the friction there, and the verdict.

    how: the way in which the equilibrium was found, in words.
    """
    matrices = at_equilibrium(model.replace(mu=equilibrium.mu), equilibrium)
    spectrum, judgement = roots_and_verdict(*matrices)
    return PadAnalysis(
        model=model.name,
        q=equilibrium.q,
        R_n=equilibrium.R_n,
        state=equilibrium.state,
        how=how,
        matrices=matrices,
        spectrum=spectrum,
        judgement=judgement,
        on_branch=equilibrium.on_branch,
        warnings=equilibrium.warnings,
    )


def roots_and_verdict(
    M: ArrayLike, C: ArrayLike | None, K: ArrayLike
) -> tuple[Spectrum, Judgement]:
    """Compute all eigenvalues of a pad's matrices (n, n), in SI units, and the verdict on them.

    Raises ComputationError where rounding of a large stiffness or damping hides the slow
    eigenvalues. The check is skipped if a coordinate is free: its eigenvalues are zero, not hidden.
    """
    mass, damping, stiffness = checked(M, C, K)
    reduced = reduce(mass, damping, stiffness)
    # squared frequencies of each coordinate with the others held
    squares = np.abs(np.diag(reduced.A))
    # a coordinate that no spring holds has a stiffness of zero to rounding: springs at right angles
    # to the surface, for instance, where k cos^2(90 degrees) is 1e-33 k in doubles. The check below
    # would take the zero eigenvalues of that coordinate for hidden ones
    has_free_coordinate = squares.min() <= EPS**2 * squares.max()
    if not has_free_coordinate and hides_slow_roots(reduced, damping, stiffness):
        raise ComputationError(f"no eigenvalue can be given: {STIFF}")
    spectrum = spectrum_of(reduced)
    return spectrum, decide(spectrum.values, spectrum.rounding)


def branch_system(scene: Scene, high: float) -> tuple[SystemFunction, Path | None]:
    """mu -> (M, C, K) about the equilibrium on the branch from mu = 0, and the branch's path.

    B3 is linearised about the origin at every mu and has no path. Raises ComputationError if
    there is no equilibrium without friction.
    """
    model = damped_model(scene)
    if model.linear:
        return lambda mu: about_origin(model.replace(mu=mu)), None
    path = Path.of(model, high)
    return path, path
