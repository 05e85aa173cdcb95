"""squeal: hammering brake squeal, simulated, linearised and judged.

    from squeal import read_scene, analyse, critical_friction
    scene = read_scene("pad.yaml")
    print(analyse(scene).judgement, critical_friction(scene).points)

What takes a scene takes a `Scene`, made by `read_scene` or in Python; what takes a system takes a
function of one parameter that gives M, C and K. Figures are in `squeal.plots`. The names below
are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
import re
from functools import cache
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from squeal.analysis.advice import Advice, Lever, Outcome, Tolerance, advise
    from squeal.analysis.eigenvalues import (
        Analysis,
        analyse,
        article_linearisation,
        growing_modes,
        judged_equilibria,
        sweep_mu,
    )
    from squeal.analysis.maps import Axis, StabilityMap, angle_axes, stability_map
    from squeal.analysis.modes import ModeShape, ModeSweep, mode_shapes, sweep_modes
    from squeal.analysis.records import to_dataframe, to_records
    from squeal.analysis.scatter import Quantile, Scatter, Spread, scatter
    from squeal.analysis.sensitivity import eigenvalue_sensitivities, threshold_sensitivities
    from squeal.analysis.spread_file import SpreadFile, read_spreads
    from squeal.analysis.state_space import friction_plant, state_space
    from squeal.analysis.systems.chart import Chart, Side, system_chart
    from squeal.analysis.systems.critical import SystemThresholds, system_thresholds
    from squeal.analysis.systems.roots import SystemRoots, system_roots
    from squeal.analysis.systems.state_space import system_state_space
    from squeal.analysis.systems.wanted import Wanted
    from squeal.analysis.thresholds import CriticalFriction, critical_friction
    from squeal.equilibrium import Equilibrium
    from squeal.errors import ComputationError, InputError
    from squeal.io.scene import Damping, Scene, read_scene
    from squeal.io.short_form import PlainSystem, read_plain
    from squeal.io.system import SystemFile, read_system
    from squeal.linear import (
        CriticalPoint,
        Crossing,
        Eigenvalue,
        FrictionLoop,
        Judgement,
        LoopAnswer,
        LoopThreshold,
        Spectrum,
        TrackedModes,
        UnstableMode,
        complex_eigenvalues,
        critical_points,
        crossings,
        friction_loop,
        judge,
        track,
        unstable_modes,
        verdict,
    )
    from squeal.linear.system import Term, TermSystem
    from squeal.model.contact import Formulation
    from squeal.model.linear import Linearisation
    from squeal.model.pad import Pad
    from squeal.simulation import Event, Response, Simulation, simulate

# fmt: off
__all__ = [
    "Advice", "Analysis", "Axis", "Chart", "ComputationError", "CriticalFriction",
    "CriticalPoint", "Crossing", "Damping", "Eigenvalue", "Equilibrium", "Event", "Formulation",
    "FrictionLoop", "InputError", "Judgement", "Lever", "Linearisation", "LoopAnswer",
    "LoopThreshold", "ModeShape", "ModeSweep", "Outcome", "Pad", "PlainSystem", "Quantile",
    "Response", "Scatter", "Scene", "Side", "Simulation", "Spectrum", "Spread", "SpreadFile",
    "StabilityMap", "SystemFile", "SystemRoots", "SystemThresholds", "Term", "TermSystem",
    "Tolerance", "TrackedModes", "UnstableMode", "Wanted", "advise", "analyse", "angle_axes",
    "article_linearisation", "complex_eigenvalues", "critical_friction", "critical_points",
    "crossings", "eigenvalue_sensitivities", "friction_loop", "friction_plant", "growing_modes",
    "judge", "judged_equilibria", "mode_shapes", "read_plain", "read_scene", "read_spreads",
    "read_system", "scatter", "simulate", "stability_map", "state_space", "sweep_modes",
    "sweep_mu", "system_chart", "system_roots", "system_state_space", "system_thresholds",
    "threshold_sensitivities", "to_dataframe", "to_records", "track", "unstable_modes",
    "verdict",
]
# fmt: on


@cache
def _modules() -> dict[str, str]:
    """The module of each name, read from the imports above, which are for type checkers alone."""
    text = __spec__.loader.get_source(__name__)  # type: ignore[union-attr]
    found = re.findall(r"^    from (squeal\.[\w.]+) import (\([^)]*\)|.+)$", text, re.M)
    return {name: module for module, names in found for name in re.findall(r"\w+", names)}


def __getattr__(name: str) -> Any:
    if name == "plots":
        return importlib.import_module("squeal.plots")
    if name not in __all__:
        raise AttributeError(f"module 'squeal' has no attribute {name!r}")
    return getattr(importlib.import_module(_modules()[name]), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
