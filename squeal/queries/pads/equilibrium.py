"""Eigenvalues of a pad about its sliding equilibrium; its matrices along the branch from mu = 0."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from squeal.equilibrium import Equilibrium, Path, sliding_equilibrium
from squeal.equilibrium.damping import (
    damped_model,
    normalised_damping,
    normalised_damping_slope,
    without_friction,
)
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.linear import Judgement, Spectrum, SystemFunction
from squeal.linear.eigen import spectrum_of
from squeal.linear.matrices import EPS, Array, checked, normalised_system
from squeal.linear.roots import STIFF, hides_slow_roots, roots_of
from squeal.linear.verdicts import decide
from squeal.model.contact import State
from squeal.model.equations import Linearisation, PadModel, about_origin, linearise
from squeal.queries.pads.stack import PadStack, hangs_on_rounding, has_free_coordinate, normalised
from squeal.results.sources import Doubt, PadAnalysis

if TYPE_CHECKING:  # pads start without the referee
    from squeal.proof.balls import Balls
    from squeal.proof.equilibria import EnclosedEquilibrium

DIGITS = 12
MATRIX_DIGITS = f"{DIGITS} digits"
"""To which the entries of a pad's matrices are taken to be known, unless they are known worse."""
ROUNDING = 32.0 * EPS  # of modes and functions of a matrix (3, 3), as a share of its norm


def at_equilibrium(model: PadModel, equilibrium: Equilibrium) -> Linearisation:
    """The linearisation of a model about one of its equilibria."""
    return linearise(model, np.array(equilibrium.q), equilibrium.state)


class KnownLinearisation(NamedTuple):
    """The matrices about an equilibrium, and how well they are known.

    Attributes
    ----------
    matrices : Linearisation
        M, C and K.
    errors : tuple of 2 array (3, 3), or None
        How far the entries of C (of falling friction) and of K may be off; None if not known.
    moved : EnclosedEquilibrium or None
        The equilibrium that takes the place of the given one, where rounding has left the given one
        too few digits; None if it stays.
    doubt : Doubt
        Why no errors are known; `NONE` where they are.
    """

    matrices: Linearisation
    errors: tuple[Array, Array] | None = None
    moved: EnclosedEquilibrium | None = None
    doubt: Doubt = Doubt.NONE


def known_linearisation(model: PadModel, q: ArrayLike, state: State) -> KnownLinearisation:
    """Linearise about an equilibrium, and bound what its rounding makes of the matrices.

    The referee (`squeal.proof`) encloses the exact equilibrium near the given one q (3,), and C and
    K about it in balls. If the matrices about the given one have `MATRIX_DIGITS` digits, by their
    distance from these balls, and the contact state is the same, the given one stays. Else the
    enclosed one takes its place. Where none can be enclosed, the errors remain unknown.
    """
    from squeal.proof.balls import Balls
    from squeal.proof.equilibria import enclosed_equilibrium

    matrices = linearise(model, np.array(q), state)
    try:
        enclosed = enclosed_equilibrium(model, q, state)
    except ImportError:  # the balls need python-flint
        is_doubtful = _hangs_on_rounding(model, np.array(q), state, matrices)
        doubt = Doubt.ROUNDING if is_doubtful else Doubt.NO_BALLS
        return KnownLinearisation(matrices, doubt=doubt)
    if enclosed is None:
        return KnownLinearisation(matrices, doubt=Doubt.NOT_ENCLOSED)
    K = enclosed.K
    # C is the damping that the model has been given, exactly, plus what falling friction adds
    damping = np.zeros((3, 3))
    if model.damping is not None:
        damping = np.array(model.damping)
    C = Balls.exact(damping)
    if not enclosed.C.is_zero:  # friction falls with speed, which damps x' alone
        summed = C.plus(enclosed.C)
        # a sum of balls widens each entry by a rounding: those to which a zero is added stay exact
        C = Balls(summed.mid, summed.rad * (enclosed.C.mid != 0.0))
    # how far each entry about the given equilibrium may be from any number of its ball
    C_error = _farthest(matrices.C, C)
    K_error = _farthest(matrices.K, K)
    has_digits = is_known(C.mid, C_error) and is_known(K.mid, K_error)
    if enclosed.state == state and has_digits:  # the given equilibrium stays
        return KnownLinearisation(matrices, (C_error, K_error))
    # the matrices about the enclosed equilibrium, and the radii of their balls
    return KnownLinearisation(Linearisation(matrices.M, C.mid, K.mid), (C.rad, K.rad), enclosed)


def _farthest(X: Array, ball: Balls) -> Array:
    """How far entries X (3, 3) may lie from the numbers that their balls enclose, at most."""
    from squeal.proof.balls import upper

    distance = upper(np.abs(X - ball.mid) + ball.rad, 2)  # rounded up, two operations
    return np.where(ball.mid == X, ball.rad, distance)


def is_known(X: Array, error: Array) -> bool:
    """Whether a matrix (3, 3) whose entries may be off by `error` is known to `MATRIX_DIGITS`."""
    from squeal.proof.balls import half_widths

    return bool(np.all(error <= half_widths(X, MATRIX_DIGITS)))


def _hangs_on_rounding(model: PadModel, q: Array, state: State, matrices: Linearisation) -> bool:
    """Whether rounding of an equilibrium q (3,) may change the verdict on the matrices about it.

    state: which points touch at q; matrices: M, C and K about q, SI units.
    """
    M, C, K = matrices
    mass_root = np.sqrt(np.outer(np.diag(M), np.diag(M)))  # M^-1/2 K M^-1/2 is K / mass_root
    # error of the entries of M^-1/2 K M^-1/2, SI units. The functions below take stacks of pads:
    # the leading axis is that of a stack, here of one pad
    error = np.zeros((1, 3, 3))
    if not model.linear:
        statics = Statics.of(dataclasses.replace(model, damping=None))
        units = statics.units
        # x, y and w theta in natural units, with w in SI units as the `lever`, and mu
        natural = q / units.length * (1.0, 1.0, units.lever)
        z = np.array([*natural, model.pad.mu])[:, None]  # (4, 1)
        of_entries = statics.stiffness_error(z, 1.0 * np.array(state)[:, None])
        error = normalised(statics.model.pad, of_entries) / units.time**2
    B = (C / mass_root)[None] if C.any() else None
    return bool(hangs_on_rounding((K / mass_root)[None], B, error)[0])


def damping_errors(scene: Scene) -> Array:
    """How far the entries (3, 3) of a scene's damping matrix may be off, to first order.

    Ratios and Rayleigh's factors make C = M^1/2 B M^1/2 with a function B, `normalised_damping`, of
    A = M^-1/2 K M^-1/2 without friction. The error of B is its rounding and, over the entries of A,
    the sum of |dB / dA_ij| times the error of A_ij. It is infinite where the error of A is not
    known, or where two modes of one frequency have different ratios.
    """
    damping = scene.damping
    if damping is None or damping.matrix is not None:
        return np.zeros((3, 3))
    model, q, state = without_friction(scene)
    M, _, K_given = linearise(model, q, state)
    linearisation = known_linearisation(model, q, state)
    moved = linearisation.moved
    contact_differs = moved is not None and moved.state != state
    if linearisation.errors is None or contact_differs:
        return np.full((3, 3), np.inf)
    mass_root = np.sqrt(np.outer(np.diag(M), np.diag(M)))
    A = K_given / mass_root
    B, _ = normalised_damping(damping, A)
    _, K_error = linearisation.errors
    # the damping was made of K_given, which may lie off the K about the enclosed equilibrium
    A_error = (np.abs(K_given - linearisation.matrices.K) + K_error) / mass_root
    A_error += ROUNDING * np.linalg.norm(A, 2)
    error = ROUNDING * np.linalg.norm(B, 2) * np.ones((3, 3))
    # A counts as symmetric in `normalised_damping`: two entries change together
    for i, j in zip(*np.triu_indices(3), strict=True):
        change = np.zeros((3, 3))
        change[i, j] = change[j, i] = 1.0
        slope = normalised_damping_slope(damping, A, change)
        error += np.abs(slope) * max(A_error[i, j], A_error[j, i])
    return np.where(np.isfinite(error), error * mass_root, np.inf)


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
    linearisation = known_linearisation(model, np.zeros(3), model.full)
    spectrum, judgement = roots_and_verdict(*linearisation.matrices)
    return PadAnalysis(
        model=model.name,
        q=(0.0, 0.0, 0.0),
        R_n=None,
        state=model.full,
        how="about the origin, full contact",
        matrices=linearisation.matrices,
        spectrum=spectrum,
        judgement=judgement,
        errors=linearisation.errors,
        doubt=linearisation.doubt,
    )


def analyse_equilibrium(model: PadModel, equilibrium: Equilibrium, how: str) -> PadAnalysis:
    """Eigenvalues of a model about one of its equilibria, at the friction there, and the verdict.

    Another equilibrium may take the place of the given one, see `known_linearisation`.
    how: the way in which the equilibrium was found, in words.
    """
    at_friction = model.replace(mu=equilibrium.mu)
    linearisation = known_linearisation(at_friction, equilibrium.q, equilibrium.state)
    spectrum, judgement = roots_and_verdict(*linearisation.matrices)
    accepted = linearisation.moved or equilibrium  # `moved`: the other one, or None
    return PadAnalysis(
        model=model.name,
        q=accepted.q,
        R_n=accepted.R_n,
        state=accepted.state,
        how=how,
        matrices=linearisation.matrices,
        spectrum=spectrum,
        judgement=judgement,
        errors=linearisation.errors,
        doubt=linearisation.doubt,
        on_branch=equilibrium.on_branch,
        warnings=equilibrium.warnings,
    )


def spectra_of_pads(
    scene: Scene, changes: Sequence[Mapping[str, float]]
) -> list[Spectrum | InputError | ComputationError]:
    """The eigenvalues about the sliding equilibrium of a pad with each change of its parameters, or
    the reason why there are none.

    They are those of `analyse`, as doubles give them: no referee encloses the equilibrium. Pads
    whose equilibrium lies on the branch from mu = 0 are computed together.
    """
    spectra: dict[int, Spectrum | InputError | ComputationError] = {}  # by number of the change
    changed: dict[int, Scene] = {}
    for number, values in enumerate(changes):
        try:
            changed[number] = scene.replace(**values)
        except InputError as error:
            spectra[number] = error
    if changed:
        # by their index in the stack, the spectra of pads whose equilibrium lies on the branch
        on_branch = _spectra_of_stack(PadStack.of_scenes(scene, [*changed.values()]))
        for k, number in enumerate(changed):
            if k in on_branch:
                spectra[number] = on_branch[k]
    for number in changed.keys() - spectra:
        try:
            spectra[number] = analyse(changed[number]).spectrum
        except ComputationError as error:
            spectra[number] = error
    return [spectra[number] for number in range(len(changes))]


def _spectra_of_stack(stack: PadStack) -> dict[int, Spectrum]:
    """The eigenvalues of each pad that has an equilibrium on the branch from mu = 0, by number;
    none where a damping matrix or the eigenvalues of a pad cannot be computed."""
    equilibria, _ = stack.at_mu()
    existing = np.flatnonzero(equilibria.exists)
    spectra = {}
    time = stack.statics.units.time
    with suppress(ComputationError):
        A, B = stack.matrices(existing, equilibria.some(existing))
        for k, number in enumerate(existing.tolist()):
            damping = None if B is None else B[k] / time
            spectra[number], _ = roots_and_verdict(np.eye(3), damping, A[k] / time**2)
    return spectra


def roots_and_verdict(
    M: ArrayLike, C: ArrayLike | None, K: ArrayLike
) -> tuple[Spectrum, Judgement]:
    """Compute all eigenvalues of a pad's matrices (n, n), in SI units, and the verdict on them.

    Raises ComputationError where rounding of a large stiffness or damping hides the slow
    eigenvalues. The check is skipped if a coordinate is free: its eigenvalues are zero, not hidden.
    """
    mass, damping, stiffness = checked(M, C, K)
    normalised = normalised_system(mass, damping, stiffness)
    roots = roots_of(normalised)
    is_held = not has_free_coordinate(normalised.A[None])[0]
    if is_held and hides_slow_roots(normalised, damping, stiffness, roots):
        raise ComputationError(f"no eigenvalue can be given: {STIFF}")
    spectrum = spectrum_of(normalised, roots)
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
