"""Eigenvalues over friction, the friction loop and mode shapes of scenes, for the report's figures.

`python -m squeal.article.studies.loci SCENE.yaml ... > loci.json`
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path as File
from typing import Any

import numpy as np

from squeal.analysis.critical import critical_friction
from squeal.analysis.damping import damping_matrix
from squeal.analysis.eigenvalues import analyse
from squeal.equilibrium import Equilibrium, Path, sliding_equilibrium
from squeal.errors import ComputationError
from squeal.files.provenance import provenance
from squeal.files.writing import to_json
from squeal.model.equations import PadModel
from squeal.model.states import name
from squeal.scene import Scene, read_scene
from squeal.stability import FrictionLoop, Matrices, System, critical_points, friction_loop, track
from squeal.stability import sweep as eigenvalues

MU_MAX = 1.0
MARGIN_MAX = 2.0  # the loop's critical friction may lie beyond the sweep
SWEEP = 101


def values_of_mu(path: Path, marked: list[float]) -> np.ndarray:
    """Where the branch is looked at: SWEEP values from 0 to its end, and marked values among them.

    Towards a fold the values crowd, since a frequency falls there as a fourth root; the fold
    itself, where the linearisation is singular, is left out by 1e-9. A contact change is looked at
    from both sides.
    """
    share = np.linspace(0.0, 1.0, SWEEP)
    if path.fold is not None:
        share = (1.0 - (1.0 - share) ** 2) * (1.0 - 1e-9)
    grid = path.mu_end * share
    before = [float(np.nextafter(mu, 0.0)) for mu in path.breakpoints]
    extra = [mu for mu in [*marked, *path.breakpoints, *before] if mu <= grid[-1]]
    return np.unique(np.concatenate([grid, extra]))


def branch(scene: Scene) -> dict[str, Any]:
    """Tracked eigenvalues along the equilibrium branch, and what happens on it.

    `real`, `imag` (1/s, rad/s): six rows over `mu`; rows 2k and 2k + 1 are a mode and its
    conjugate, by rising frequency at mu = 0. Where there is no branch only `reason` is given.
    """
    try:
        path = Path.of(scene.pad_model, MU_MAX)
        critical = critical_friction(scene, MU_MAX)
    except ComputationError as error:
        return {"reason": str(error)}
    C = damping_matrix(scene)

    def system(mu: float) -> Matrices:
        matrices = path.linearisation(mu)
        return matrices.M, C, matrices.K

    marked = [scene.pad.mu, *(point.mu for point in critical.points)]
    tracked = track(system, values_of_mu(path, marked))
    changes = [
        {"mu": mu, "into": name(scene.model, path.at(mu)[1])}
        for mu in path.breakpoints
        if mu <= path.mu_end
    ]
    return {
        "mu": tracked.mus.tolist(),
        "real": tracked.values.real.T.tolist(),
        "imag": tracked.values.imag.T.tolist(),
        "contact_changes": changes,
        "fold": path.fold,
        "end": path.end,
        "verdict_at_zero": critical.at_zero,
        "thresholds": [asdict(point) for point in critical.points],
    }


def frozen(scene: Scene, at: Equilibrium) -> System:
    """M, C, K(mu) of the scene's pad with the equilibrium held where it is."""
    C, q = damping_matrix(scene), np.array(at.q)

    def system(mu: float) -> Matrices:
        model = PadModel(scene.model, scene.pad.replace(mu=mu), scene.formulation)
        return model.mass_matrix, C, -model.jacobian(q, at.state)

    return system


def loop(scene: Scene, at: Equilibrium) -> dict[str, Any]:
    """The pad as a control loop about one equilibrium, if friction closes a single loop.

    `thresholds` are those of the eigenvalues, `gain_margins` those of the loop, both over
    0 < mu <= MARGIN_MAX; `apart` is the largest difference of the two lists (None if they are not
    of one length). `real`, `imag` (gains x poles) are the root locus by python-control and
    `locus_apart` its largest distance from the eigenvalues, over the spectral radius.
    """
    system = frozen(scene, at)
    answer = friction_loop(system, MU_MAX)
    thresholds = [point.mu for point in critical_points(system, MARGIN_MAX) if point.mu > 0.0]
    told = {"reason": answer.reason, "thresholds": thresholds}
    if answer.loop is None:
        return {"rank_one": False, **told}
    margins = answer.loop.thresholds(MARGIN_MAX)
    same = len(margins) == len(thresholds)
    apart = [abs(a - b) for a, b in zip(margins, thresholds, strict=True)] if same else None
    return {
        "rank_one": True,
        **told,
        "gain_margins": margins,
        "apart": None if apart is None else max(apart, default=0.0),
        **_root_locus(answer.loop, system),
    }


def _root_locus(found: FrictionLoop, system: System) -> dict[str, Any]:
    gains = np.linspace(0.0, MU_MAX, SWEEP)
    poles = np.asarray(found.root_locus(gains).loci)
    exact = eigenvalues(system, gains)
    distance = np.abs(poles[:, :, None] - exact[:, None, :])
    apart = np.maximum(distance.min(axis=1).max(axis=1), distance.min(axis=2).max(axis=1))
    return {
        "gains": gains.tolist(),
        "real": poles.real.tolist(),
        "imag": poles.imag.tolist(),
        "locus_apart": float((apart / np.abs(exact).max(axis=1)).max()),
    }


def modes(scene: Scene, at: Equilibrium) -> dict[str, Any]:
    """Pose, eigenvalues and mode shapes at the scene's equilibrium.

    `pose`: mass centre over the surface's origin (m) and rotation; a shape is (x, y, w theta) with
    its largest part 1, one for each pair of eigenvalues.
    """
    found = analyse(scene)
    pad, lever = scene.pad, np.array([1.0, 1.0, scene.pad.w])
    shapes = []
    for e in found.spectrum.eigenvalues[::2]:
        shape = lever * e.right
        shape = shape / shape[np.argmax(np.abs(shape))]
        shapes.append(
            {
                "frequency_hz": e.frequency_hz,
                "growth_rate": e.growth_rate,
                "real": shape.real.tolist(),
                "imag": shape.imag.tolist(),
            }
        )
    return {
        "on_branch": at.on_branch,
        "how": found.how,
        "contact": found.contact,
        "verdict": found.judgement.verdict,
        "q": list(found.q),
        "pose": [pad.x0 + found.q[0], pad.y0 + found.q[1], pad.theta0 + found.q[2]],
        "real": found.spectrum.values.real.tolist(),
        "imag": found.spectrum.values.imag.tolist(),
        "modes": shapes,
    }


def examined(file: File) -> dict[str, Any]:
    """All of one scene; `equilibrium` and `loop` hold only a reason if no steady sliding exists."""
    scene = read_scene(file)
    at, how = sliding_equilibrium(scene.pad_model)
    none = {"reason": how}
    return {
        "name": file.stem,
        "model": scene.model,
        "mu": scene.pad.mu,
        "w": scene.pad.w,
        "h": scene.pad.h,
        "branch": branch(scene),
        "loop": none if at is None else loop(scene, at),
        "equilibrium": none if at is None else modes(scene, at),
    }


def main() -> int:
    """Examine scenes and print one JSON object with a list of them."""
    parser = argparse.ArgumentParser(description="Eigenvalues over friction, loop and mode shapes.")
    parser.add_argument("scenes", type=File, nargs="+", metavar="SCENE.yaml")
    files = parser.parse_args().scenes
    made = provenance(files, "squeal.article.studies.loci")
    found = [examined(file) for file in files]
    print(to_json({"scenes": found, "provenance": made.to_dict()}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
