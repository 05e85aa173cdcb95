"""Complex eigenvalue analysis of a scene: equilibrium first, then matrices, roots and verdict."""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from squeal.equilibrium import Equilibrium, Path, find_all, sliding_equilibrium
from squeal.equilibrium.find import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Scene, takes_scene
from squeal.linear import (
    Batched,
    Judgement,
    Matrices,
    Spectrum,
    System,
    UnstableMode,
    judge,
    thresholds,
    unstable_modes,
)
from squeal.linear.eigen import STIFF, decide, hidden, ordered, spectrum_of
from squeal.linear.matrices import EPS, checked, reduce, scaled_rank
from squeal.model.contact import State, contact_law, contact_model
from squeal.model.equations import Linearisation, PadModel, about_origin, linearise
from squeal.schema.values import Number, Place, Several, takes

LOST = 0.03  # of an eigenvalue: rounding of K that leaves no digit of it
_AT_ORIGIN = "about the origin, full contact"


@dataclass(frozen=True)
class Analysis:
    """One equilibrium, the linearisation about it, its six eigenvalues and the verdict.

    q = (x, y, theta) in SI units; R_n is None for B3, which is linearised about the origin.
    on_branch: the equilibrium is reached from the one without friction; warnings: a sentence for
    each reason why it is none that the model means.
    """

    model: str
    q: tuple[float, float, float]
    R_n: float | None
    state: State
    how: str
    matrices: Linearisation = field(repr=False)
    spectrum: Spectrum = field(repr=False)
    judgement: Judgement
    on_branch: bool = True
    warnings: tuple[str, ...] = ()

    @property
    def admissible(self) -> bool:
        """True if nothing speaks against the equilibrium."""
        return not self.warnings

    @property
    def frequencies_hz(self) -> np.ndarray:
        """Frequencies of the three modes in Hz."""
        return self.spectrum.frequencies_hz

    @property
    def contact(self) -> str:
        """Name of the contact state."""
        return contact_law(self.model).state_name(self.state)


def at_equilibrium(model: PadModel, found: Equilibrium) -> Linearisation:
    """The linearisation of a model about one of its equilibria."""
    return linearise(model, np.array(found.q), found.state)


@takes_scene
def analyse(scene: Scene) -> Analysis:
    """Complex eigenvalue analysis of the scene's sliding equilibrium (B3: about the origin).

    Raises ComputationError, with the reason, if no steady sliding exists.
    """
    model = damped_model(scene)
    if model.linear:
        return _about_origin(model)
    found, how = sliding_equilibrium(model)
    if found is None:
        raise ComputationError(how)
    return _about(model, found, how)


@takes_scene
def article_linearisation(scene: Scene) -> Analysis:
    """What the article analyses instead of the equilibrium: full contact about the origin.

    For model B1, of which the article has no linearisation, both edges touch at the origin.
    """
    return _about_origin(damped_model(scene))


def _about_origin(model: PadModel) -> Analysis:
    at = about_origin(model)
    found = roots_and_verdict(*at)
    return Analysis(model.name, (0.0, 0.0, 0.0), None, model.full, _AT_ORIGIN, at, *found)


def _about(model: PadModel, e: Equilibrium, how: str) -> Analysis:
    at = at_equilibrium(model.replace(mu=e.mu), e)
    found = (*roots_and_verdict(*at), e.on_branch, e.warnings)
    return Analysis(model.name, e.q, e.R_n, e.state, how, at, *found)


def held_system(scene: Scene, at: Analysis | Equilibrium) -> System:
    """mu -> (M, C, K) of the scene's pad with the equilibrium held where it is."""
    own, q = damped_model(scene), np.array(at.q)
    return lambda mu: linearise(own.replace(mu=mu), q, at.state)


@takes_scene
@takes(mus=Several(Number(low=0.0, low_allowed=True), "a sequence of numbers of at least 0"))
def sweep_mu(scene: Scene, mus: Iterable[float]) -> list[tuple[float, Analysis | None]]:
    """The analysis at each mu along the branch from mu = 0; None where the branch does not reach.

    Raises InputError for no mu at all or one below 0, ComputationError if there is no equilibrium
    without friction.
    """
    mus = list(mus)
    model = damped_model(scene)
    if model.linear:
        return [(mu, _about_origin(model.replace(mu=mu))) for mu in mus]
    path = Path.of(model, max(mus))
    how = "on the branch continued from mu = 0"
    places = [(mu, path.equilibrium(mu)) for mu in mus]
    return [(mu, None if e is None else _about(model, e, how)) for mu, e in places]


@takes_scene
def judged_equilibria(scene: Scene) -> list[tuple[Equilibrium, Judgement]]:
    """All sliding equilibria at the scene's mu with the verdict on each, least potential first.

    The one that `analyse` takes is that `on_branch`, or the first if the branch from mu = 0 does
    not reach the scene's mu; where it does not rise up to there, all of them lie beyond. Raises
    InputError for a linear model, which has none of its own.
    """
    if contact_model(scene.model).linear:
        raise Place("judged_equilibria").refuse(
            f"{scene.model} is not allowed; a linearisation has no equilibria of its own"
        )
    model = damped_model(scene)
    judged = []
    for found in _with_taken(find_all(model), sliding_equilibrium(model)[0], scene.pad.w):
        judged.append((found, judge(*at_equilibrium(model, found))))
    return judged


def _with_taken(
    others: list[Equilibrium], taken: Equilibrium | None, w: float
) -> list[Equilibrium]:
    """The equilibria with the one taken in its place among them, all marked alike."""
    if taken is None:
        return others

    def apart(other: Equilibrium) -> float:
        steps = np.subtract(other.q, taken.q) * (1.0, 1.0, w)
        size = np.abs(np.multiply(taken.q, (1.0, 1.0, w))).max()
        return float(np.abs(steps).max() - 1e-6 * size)

    rest = [dataclasses.replace(e, beyond=taken.beyond) for e in others if apart(e) > 0.0]
    return sorted([*rest, taken], key=lambda e: e.potential)


def roots_and_verdict(
    M: ArrayLike, C: ArrayLike | None, K: ArrayLike
) -> tuple[Spectrum, Judgement]:
    """All eigenvalues of matrices (n, n) and the verdict on them.

    Where the standard form hides slow roots they come from the pencil, each with the error that
    rounding of M, C and K may bring. Raises ComputationError if that leaves one no digit, and
    OverflowError where one is beyond double precision.
    """
    M, C, K = checked(M, C, K)
    reduced = reduce(M, C, K)
    squares = np.abs(np.diag(reduced.A))  # of the frequencies of each coordinate alone
    # upright springs hold nothing along the surface: (k cos^2) of a rounded angle is no slow mode
    free = squares.min() <= EPS**2 * squares.max()
    if free or not hidden(reduced, C, K):
        spectrum = spectrum_of(reduced)
        return spectrum, decide(spectrum.values, spectrum.rounding)
    from squeal.sparse.dense import dense_spectrum  # a tenth of a query's time
    from squeal.sparse.quadratic import ROUNDING

    found = dense_spectrum(M, C, K)
    if len(found) < 2 * len(M):  # a pad has no motion without mass
        raise OverflowError("the eigenvalues are beyond double precision")
    regular = scaled_rank(K) == len(K)  # else roots may be exactly zero
    errors = [max(e.residual, ROUNDING) * e.condition if e.value or regular else 0.0 for e in found]
    if not all(error <= LOST for error in errors):
        raise ComputationError(f"no eigenvalue can be given: {STIFF}")
    values = np.array([e.value for e in found])
    order = ordered(values)
    verdict = decide(values, np.abs(values) * np.array(errors))
    return Spectrum(tuple(found[k] for k in order)), verdict


def branch_system(scene: Scene, mu_max: float) -> tuple[System, Path | None]:
    """mu -> (M, C, K) about the equilibrium on the branch from mu = 0, and the branch's path.

    B3 is linearised about the origin at every mu and has no path. Raises ComputationError if
    there is no equilibrium without friction.
    """
    model = damped_model(scene)
    if model.linear:
        return lambda mu: about_origin(model.replace(mu=mu)), None
    path = Path.of(model, mu_max)
    return Batched(path.linearisation, path.linearisations), path


@takes_scene
def growing_modes(scene: Scene, analysis: Analysis) -> tuple[UnstableMode, ...]:
    """The modes of an analysed scene that grow, the fastest first.

    An onset is None where the mode grows without friction, or where the equilibrium does not lie
    on the branch that begins there, or lies beyond a fold of it.
    """
    own, mu = analysis.matrices, scene.pad.mu
    grow = unstable_modes(lambda _: own, mu)
    if not grow or mu == 0.0 or not analysis.on_branch:
        return grow
    system, path = branch_system(scene, mu)
    if path is not None and path.mu_end < mu:
        return grow

    def along(at: float) -> Matrices:
        return own if at == mu else system(at)

    return unstable_modes(along, mu, thresholds(along, mu, path.breakpoints if path else ()))
