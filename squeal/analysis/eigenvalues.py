"""Complex eigenvalue analysis of a scene: equilibrium first, then matrices, roots and verdict."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from squeal.analysis.damping import damping_matrix
from squeal.equilibrium import Equilibrium, Path, find_all, sliding_equilibrium
from squeal.errors import ComputationError
from squeal.files.place import Place
from squeal.model.contact import contact_law, contact_model
from squeal.model.equations import PadModel
from squeal.model.linear import Linearisation, about_origin, linearise
from squeal.model.states import State
from squeal.scene import Scene, takes_scene
from squeal.stability import Judgement, Spectrum, complex_eigenvalues, judge

_AT_ORIGIN = "about the origin, full contact"


@dataclass(frozen=True)
class Analysis:
    """One equilibrium, the linearisation about it, its six eigenvalues and the verdict.

    q = (x, y, theta) in SI units; R_n is None for B3, which is linearised about the origin.
    on_branch: the equilibrium is reached from the one without friction.
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

    @property
    def contact(self) -> str:
        """Name of the contact state."""
        return contact_law(self.model).state_name(self.state)


def at_equilibrium(model: PadModel, found: Equilibrium) -> Linearisation:
    """The linearisation of a model about one of its equilibria, undamped."""
    return linearise(model, np.array(found.q), found.state)


@takes_scene
def analyse(scene: Scene) -> Analysis:
    """Complex eigenvalue analysis of the scene's sliding equilibrium (B3: about the origin).

    Raises ComputationError, with the reason, if no steady sliding exists.
    """
    C = damping_matrix(scene)
    if scene.pad_model.linear:
        return _about_origin(scene, scene.pad.mu, C)
    found, how = sliding_equilibrium(scene.pad_model)
    if found is None:
        raise ComputationError(how)
    return dataclasses.replace(_about(scene, found, how, C), on_branch=found.on_branch)


@takes_scene
def article_linearisation(scene: Scene) -> Analysis:
    """What the article analyses instead of the equilibrium: full contact about the origin.

    For model B1, of which the article has no linearisation, both edges touch at the origin.
    """
    return _about_origin(scene, scene.pad.mu, damping_matrix(scene))


def _about_origin(scene: Scene, mu: float, C: np.ndarray) -> Analysis:
    model = scene.pad_model.replace(mu=mu)
    matrices = dataclasses.replace(about_origin(model), C=C)
    return _analysis(model.name, (0.0, 0.0, 0.0), None, model.full, _AT_ORIGIN, matrices)


def _about(scene: Scene, found: Equilibrium, how: str, C: np.ndarray) -> Analysis:
    model = scene.pad_model.replace(mu=found.mu)
    matrices = dataclasses.replace(at_equilibrium(model, found), C=C)
    return _analysis(scene.model, found.q, found.R_n, found.state, how, matrices)


def _analysis(
    model: str,
    q: tuple[float, float, float],
    R_n: float | None,
    state: State,
    how: str,
    matrices: Linearisation,
) -> Analysis:
    given = (matrices.M, matrices.C, matrices.K)
    return Analysis(model, q, R_n, state, how, matrices, complex_eigenvalues(*given), judge(*given))


@takes_scene
def sweep_mu(scene: Scene, mus: list[float]) -> list[tuple[float, Analysis | None]]:
    """The analysis at each mu along the branch from mu = 0; None where the branch does not reach.

    Raises ComputationError if there is no equilibrium without friction.
    """
    C = damping_matrix(scene)
    if scene.pad_model.linear:
        return [(mu, _about_origin(scene, mu, C)) for mu in mus]
    path = Path.of(scene.pad_model, max(mus))
    how = "on the branch continued from mu = 0"
    places = [(mu, path.equilibrium(mu)) for mu in mus]
    return [(mu, None if e is None else _about(scene, e, how, C)) for mu, e in places]


@takes_scene
def judged_equilibria(scene: Scene) -> list[tuple[Equilibrium, Judgement]]:
    """All sliding equilibria at the scene's mu with the verdict on each, least potential first.

    Raises InputError for a linear model, which has none of its own.
    """
    if contact_model(scene.model).linear:
        raise Place("judged_equilibria").refuse(
            f"{scene.model} is not allowed; a linearisation has no equilibria of its own"
        )
    C, model = damping_matrix(scene), scene.pad_model
    judged = []
    for found in find_all(model):
        matrices = at_equilibrium(model, found)
        judged.append((found, judge(matrices.M, C, matrices.K)))
    return judged
