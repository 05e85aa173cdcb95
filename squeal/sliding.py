"""Complex eigenvalue analysis of a scene: equilibrium first, then matrices, roots and verdict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from squeal.equilibrium import Equilibrium, find_all, sliding_equilibrium
from squeal.errors import ComputationError
from squeal.linear import Linearisation, about_origin, linearise
from squeal.model import PadModel
from squeal.scene import Scene
from squeal.stability.eigen import Spectrum, complex_eigenvalues
from squeal.stability.verdict import Judgement, judge
from squeal.states import FULL, name


@dataclass(frozen=True)
class Analysis:
    """One equilibrium, the linearisation about it, its six eigenvalues and the verdict.

    q = (x, y, theta) in SI units; R_n is None for B3, which is linearised about the origin.
    """

    model: str
    q: tuple[float, float, float]
    R_n: float | None
    contact: str
    how: str
    matrices: Linearisation
    spectrum: Spectrum
    judgement: Judgement


def at_equilibrium(model: PadModel, found: Equilibrium) -> Linearisation:
    """The linearisation of a model about one of its equilibria."""
    return linearise(model, np.array(found.q), found.state)


def analyse(scene: Scene) -> Analysis:
    """Complex eigenvalue analysis of the scene's sliding equilibrium (B3: about the origin).

    Raises ComputationError, with the reason, if no steady sliding exists.
    """
    if scene.model == "B3":
        matrices = about_origin(scene.pad, scene.formulation)
        q, R_n, how, state = (0.0, 0.0, 0.0), None, "about the origin, full contact", FULL
        contact = name("B2", state)
    else:
        model = scene.pad_model
        found, how = sliding_equilibrium(model)
        if found is None:
            raise ComputationError(how)
        matrices = at_equilibrium(model, found)
        q, R_n, contact = found.q, found.R_n, name(scene.model, found.state)
    return Analysis(
        scene.model,
        q,
        R_n,
        contact,
        how,
        matrices,
        complex_eigenvalues(matrices.M, matrices.C, matrices.K),
        judge(matrices.M, matrices.C, matrices.K),
    )


def judged_equilibria(model: PadModel) -> list[tuple[Equilibrium, Judgement]]:
    """All sliding equilibria at the pad's mu with the verdict on each."""
    judged = []
    for found in find_all(model):
        matrices = at_equilibrium(model, found)
        judged.append((found, judge(matrices.M, matrices.C, matrices.K)))
    return judged
