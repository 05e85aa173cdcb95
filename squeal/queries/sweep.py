"""The verb `sweep`: eigenvalues at values of the friction or of the free parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.linear.paths import Loss, continued
from squeal.queries.mode_numbers import assign_mode_numbers
from squeal.queries.options import (
    Band,
    Modes,
    Progress,
    Region,
    Subject,
    Values,
    Workers,
    refuse_options,
)
from squeal.queries.pads.equilibrium import analyse_about_origin, analyse_equilibrium, branch_system
from squeal.results.sources import PadAnalysis, PadSource, SystemSource
from squeal.results.sweep import Step, Sweep
from squeal.results.thresholds import Thresholds
from squeal.schema import NOT_NEGATIVE, Place, Positive, Several, public

if TYPE_CHECKING:  # pads start without the solvers of systems
    from squeal.queries.systems.system_analysis import SystemAnalysis

MUS = Several(NOT_NEGATIVE, "a sequence of numbers of at least 0")
BASIS_VALUES = 25  # of a sweep at most, at which its reduced system is made
DRAWN_OF_PADS = 201  # values of mu at which modes are drawn
DRAWN_OF_SYSTEMS = 121  # values of the parameter in a figure of thresholds
DRAWN_AT_OWN_FREQUENCIES = (
    31  # of systems whose roots are each computed at a frequency of their own
)


@public
def sweep(
    subject: Subject,
    values: Values,
    band: Band | None = None,
    region: Region | None = None,
    modes: Modes | None = None,
    method: Literal["full", "reduced", "modal"] | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,  # `public` reads it
) -> Sweep:
    """Compute eigenvalues at values of the friction or of the free parameter.

    Parameters
    ----------
    subject, band, region, modes, memory, progress
        As `eigenvalues` takes them; a scene is followed along its branch from mu = 0.
    values : sequence of float
        The values.
    method : {"full", "reduced", "modal"}, optional
        Of systems. full: each value is solved on the system itself; reduced: on a reduced system
        whose roots solve the full problem; modal: a first look, by real modes with corrections, and
        with an error of each root. Left out, full up to 400 rows, else modal.
    workers : int, optional
        Threads for systems of more than 400 rows, else processes, 1 if left out; any number gives
        the same answer. Processes start by import: a script must guard its main part.

    Returns
    -------
    Sweep
        A step for each value, in their order.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> sweep = squeal.sweep(squeal.System([[1, 0], [0, 1]], K=K), [0.5, 1.0])
    >>> [step.verdict for step in sweep.steps]
    ['marginal', 'flutter']
    """
    if isinstance(subject, Scene):
        refuse_options(
            "a scene",
            band=band,
            region=region,
            modes=modes,
            memory=memory,
            method=method,
            workers=workers,
        )
        return pad_sweep(subject, list(values))
    from squeal.queries.systems.system_analysis import SystemAnalysis

    analysis = SystemAnalysis.of(subject, band, region, modes, memory, progress)
    return _system_sweep(analysis, list(values), method)


def pad_sweep(scene: Scene, values: Sequence[float], numbered_at: float | None = None) -> Sweep:
    """Compute the eigenvalues of a pad at each mu along the branch of equilibria from mu = 0.

    Modes are numbered by rising frequency at `numbered_at`, or at the pad's own mu if it is left
    out. Where this is none of the values, or the branch does not reach it, they are numbered at the
    lowest value that it reaches. A step that the branch does not reach has no roots. B3 is
    linearised about the origin and has no branch.
    """
    values = MUS.read(values, Place("sweep", "values"))
    model = damped_model(scene)
    matrices_of_branch, path = branch_system(scene, max(values))
    reached: dict[float, Step] = {}  # by mu the steps that the branch reaches
    if path is None:
        for mu in values:
            reached[mu] = _step(mu, analyse_about_origin(model.replace(mu=mu)))
    else:
        for equilibrium in path.equilibria_in_si(values):
            if equilibrium is not None:
                analysis = analyse_equilibrium(
                    model, equilibrium, "on the branch continued from mu = 0"
                )
                reached[equilibrium.mu] = _step(equilibrium.mu, analysis)
    losses: tuple[Loss, ...] = ()  # intervals of mu in which it is lost which mode is which
    reference = None
    if reached:
        rising = sorted(reached)
        # the spectrum at any mu, to follow the modes between the steps; a single step needs none
        spectrum_at = None
        if len(rising) > 1:
            spectrum_at = continued(matrices_of_branch, rising).at
        steps_by_mu = [reached[mu] for mu in rising]
        reference_mu = scene.pad.mu if numbered_at is None else numbered_at
        numbered = assign_mode_numbers(steps_by_mu, spectrum_at, numbered_at=reference_mu)
        reached = dict(zip(rising, numbered.steps, strict=True))
        losses = numbered.losses
        reference = numbered.reference
    steps = []
    for mu in values:
        not_reached = Step(value=mu, roots=None, residuals=None, verdict=None, admissible=False)
        steps.append(reached.get(mu, not_reached))
    return Sweep(scene.model, "mu", tuple(steps), losses, reference, source=PadSource(scene))


def _step(mu: float, analysis: PadAnalysis) -> Step:
    """The step of a sweep at mu, from the analysis of the equilibrium there."""
    spectrum = analysis.spectrum
    return Step(
        value=mu,
        roots=spectrum.values,
        residuals=np.array([root.residual for root in spectrum.eigenvalues]),
        verdict=analysis.verdict,
        contact=analysis.contact,
        admissible=analysis.admissible,
        rounding=spectrum.rounding,
    )


def _system_sweep(analysis: SystemAnalysis, values: Sequence[float], method: str | None) -> Sweep:
    """Compute the roots of a system at values of the parameter, and number the modes.

    method: full, reduced or modal, see `sweep`; None: full up to 400 rows, else modal.
    """
    from squeal.queries.systems.all_roots import is_small
    from squeal.queries.systems.reduced import basis_of
    from squeal.queries.systems.seat import seat_note
    from squeal.queries.systems.sweeps import qualified_by_data, track_modes
    from squeal.sparse.first_look import FirstLook

    analysis.warn_of_unused_parameter()
    system = analysis.system
    if method is None:
        method = "full" if is_small(system) else "modal"
    reduction = None
    if method != "full":
        reduction = analysis.reduced(values, method, most=BASIS_VALUES)
        if isinstance(reduction, FirstLook) and not reduction.is_complete:
            reduction = None  # a basis may lack roots: the system itself is solved
    steps, losses, reference = track_modes(analysis.file, analysis.selection, values, reduction)
    return Sweep(
        name=system.name,
        parameter=system.parameter,
        steps=tuple(qualified_by_data(analysis.file, analysis.selection, step) for step in steps),
        losses=losses,
        reference=reference,
        basis=basis_of(reduction, analysis.selection) or analysis.component_reduction,
        source=SystemSource(analysis.file, analysis.selection, reduction),
        note=seat_note(analysis.file),
    )


def eigenvalue_paths(answer: Thresholds, low: float, high: float) -> Sweep:
    """The eigenvalues at the values of the parameter that a figure of thresholds needs.

    The subject's own value is among them if it lies in the range. Modes are numbered at `low`. The
    referee does not judge the roots of a system: the thresholds say what is proved over the range.

    Raises ComputationError if the branch of a pad's equilibria ends before `low`.
    """
    source = answer.source
    if isinstance(source, PadSource):
        return _pad_paths(source.scene, answer, low, high)
    assert source is not None
    from squeal.queries.systems.sweeps import track_modes

    system = source.file.system
    drawn = DRAWN_AT_OWN_FREQUENCIES if system.follows else DRAWN_OF_SYSTEMS
    values = np.linspace(low, high, drawn)
    own_value = system.parameters[answer.parameter]
    if low < own_value < high:
        values = np.union1d(values, own_value)
    steps, losses, reference = track_modes(
        source.file,
        source.selection,
        values.tolist(),
        source.reduction,
        numbered_at=low,
        is_judged=False,
    )
    return Sweep(answer.name, answer.parameter, steps, losses, reference, source=source)


def _pad_paths(scene: Scene, answer: Thresholds, low: float, high: float) -> Sweep:
    """The eigenvalues of a pad at values of mu from `low` to `high` that a figure needs, among them
    the thresholds of the answer.

    Raises ComputationError if the branch of equilibria ends before `low`.
    """
    if answer.high <= low:
        raise ComputationError(f"no equilibrium at mu = {low:.9g}: {answer.end}")
    shares = np.linspace(0.0, 1.0, DRAWN_OF_PADS)
    stop = min(answer.high, high)
    if any(point.kind == "fold" for point in answer.points):
        # towards a fold a frequency falls as the fourth root of the distance (its square as the
        # square root), so that values are crowded there
        shares = 1.0 - (1.0 - shares) ** 2
        stop = stop * (1.0 - 1e-9)  # at the fold itself the tangent stiffness is singular
    values = [*(low + (stop - low) * shares), *(point.mu for point in answer.points)]
    values.append(scene.pad.mu)
    return pad_sweep(scene, np.unique(np.clip(values, low, stop)).tolist(), low)
