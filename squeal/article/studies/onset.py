"""Onset of hammering and what it settles to, with modal damping."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.eigenvalues import branch_system
from squeal.analysis.thresholds import critical_friction
from squeal.article.cases import HISTORY_FIGURES
from squeal.article.records import Missing
from squeal.article.results.onset import Cycles, Exponent, Late, Onset, Sweep
from squeal.article.studies._attractors import CONFIDENCE, Beginning, cycles, exponent, exponents
from squeal.article.studies._damped import RATIO, damped, window
from squeal.article.studies._late import (
    EARLY,
    LATE,
    LONGER,
    MOVING,
    RATIOS,
    SEED,
    SEEN,
    WIDER,
    Own,
    late,
)
from squeal.article.studies._scenes import alike, read_scenes
from squeal.article.studies._sweeps import MU, STEP, Begun, sweeps
from squeal.article.studies.energy import under_both_laws
from squeal.errors import ComputationError
from squeal.io.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version
from squeal.io.scene import Scene
from squeal.linear import verdict

SWEPT = (0.005, 0.01, 0.02)  # where the own start goes on losing contact; else RATIO
_SETTINGS: dict[str, Any] = {"ratio": RATIO, "ratios": RATIOS, "confidence": CONFIDENCE}
_SETTINGS |= {"windows": LATE, "longer": LONGER, "early": EARLY, "wider": WIDER, "moving": MOVING}
_SETTINGS |= {"seed": SEED, "seen": SEEN, "step_windows": STEP}


def threshold(scene: Scene) -> float | None:
    """The friction at which the equilibrium begins to flutter with damping, None if it does not at
    any of `MU`."""
    asked = damped(scene, RATIO)
    try:
        system, path = branch_system(asked, MU[-1])
        reached = [mu for mu in MU if path is None or mu <= path.mu_end]
        # to look first saves most searches
        if all(verdict(*system(mu)) == "stable" for mu in reached):
            return None
        points = critical_friction(asked, MU[-1]).points
    except ComputationError:
        return None
    return next((point.mu for point in points if point.kind == "flutter"), None)


def without(why: str) -> Onset:
    """The record of a study that had to be left out."""
    return Onset({}, {}, MU, {}, {}, {}, Missing(why), left_out=why, **_SETTINGS)


def study(files: Sequence[Path]) -> Onset:
    """Onset and attractors of the eight scenes of models B1 and B2."""
    scenes = read_scenes(files, HISTORY_FIGURES, "simulate")
    if version("heyoka") == NOT_INSTALLED:
        why = f"{WITHOUT_HEYOKA} nothing else simulates batches of pads."
        return without(why)
    motions = under_both_laws(scenes)
    came: dict[str, Own] = {}
    for some in alike(motions):
        came |= late(some)
    came = {name: came[name] for name in motions}
    own = {n: m for n, m in motions.items() if m.formulation == scenes[n[:4]].formulation}
    at = RATIOS.index(RATIO)
    lasts = {n for n in own if any(isinstance(o, Late) and o.goes_on for o in came[n].rows)}
    swept: dict[str, tuple[Sweep, ...]] = {}
    found: dict[str, Exponent | Missing] = {}
    last = {
        name: came[name].states[at]
        for name in own
        if isinstance(one := came[name].rows[at], Late) and one.goes_on
    }
    lively = {
        (name, one.ratio): Begun(scene.pad.mu, state, one.liveliest)
        for name, scene in own.items()
        for one, state in zip(came[name].others, came[name].liveliest, strict=False)
        if one.ratio in SWEPT and one.liveliest and one.beside
    }
    limits = {name: threshold(one) for name, one in own.items()}
    for some in alike(own):
        ratios = {
            name: [
                ratio
                for ratio in SWEPT
                if name in lasts or (name, ratio) in lively or (limits[name] and ratio == RATIO)
            ]
            for name in some
        }
        swept |= sweeps(some, ratios, lively)
        begin = {n: Beginning(m, RATIO, last[n]) for n, m in some.items() if n in last}
        begin |= {
            f"{n[:4]}, undamped": Beginning(m, 0.0, np.array(m.initial)) for n, m in some.items()
        }
        found |= {
            name: exponent(logs, window(some), begin[name].ratio)
            for name, logs in exponents(begin).items()
        }
    tried = (cycles(name, own[name], last[name]) for name in last)
    periodic = next(
        (one for one in tried if isinstance(one, Cycles)),
        Missing("no motion that lasts is periodic"),
    )
    late_rows = {name: one.rows for name, one in came.items()}
    others = {name: one.others for name, one in came.items()}
    return Onset(late_rows, others, MU, swept, limits, found, periodic, **_SETTINGS)
