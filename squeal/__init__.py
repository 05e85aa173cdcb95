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
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from squeal.analysis.advice import Advice, Lever, Outcome, Tolerance, advise
    from squeal.analysis.critical import CriticalFriction, critical_friction
    from squeal.analysis.eigenvalues import (
        Analysis,
        analyse,
        article_linearisation,
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
    from squeal.analysis.unstable import growing_modes
    from squeal.equilibrium import Equilibrium
    from squeal.errors import ComputationError, InputError
    from squeal.model.contact import Formulation
    from squeal.model.linear import Linearisation
    from squeal.model.pad import Pad
    from squeal.scene import Damping, PlainSystem, Scene, read_plain, read_scene
    from squeal.scene.terms import SystemFile, read_system
    from squeal.simulation import Event, Response, Simulation, simulate
    from squeal.stability import (
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
    from squeal.stability.terms import Term, TermSystem

_HOME = {
    "squeal.analysis.advice": "Advice Lever Outcome Tolerance advise",
    "squeal.analysis.critical": "CriticalFriction critical_friction",
    "squeal.analysis.eigenvalues": (
        "Analysis analyse article_linearisation judged_equilibria sweep_mu"
    ),
    "squeal.analysis.maps": "Axis StabilityMap angle_axes stability_map",
    "squeal.analysis.modes": "ModeShape ModeSweep mode_shapes sweep_modes",
    "squeal.analysis.records": "to_dataframe to_records",
    "squeal.analysis.scatter": "Quantile Scatter Spread scatter",
    "squeal.analysis.sensitivity": "eigenvalue_sensitivities threshold_sensitivities",
    "squeal.analysis.spread_file": "SpreadFile read_spreads",
    "squeal.analysis.state_space": "friction_plant state_space",
    "squeal.analysis.systems.chart": "Chart Side system_chart",
    "squeal.analysis.systems.critical": "SystemThresholds system_thresholds",
    "squeal.analysis.systems.roots": "SystemRoots system_roots",
    "squeal.analysis.systems.state_space": "system_state_space",
    "squeal.analysis.systems.wanted": "Wanted",
    "squeal.analysis.unstable": "growing_modes",
    "squeal.equilibrium": "Equilibrium",
    "squeal.errors": "ComputationError InputError",
    "squeal.model.contact": "Formulation",
    "squeal.model.linear": "Linearisation",
    "squeal.model.pad": "Pad",
    "squeal.scene": "Damping PlainSystem Scene read_plain read_scene",
    "squeal.scene.terms": "SystemFile read_system",
    "squeal.simulation": "Event Response Simulation simulate",
    "squeal.stability.terms": "Term TermSystem",
    "squeal.stability": (
        "CriticalPoint Crossing Eigenvalue FrictionLoop Judgement LoopAnswer LoopThreshold "
        "Spectrum TrackedModes UnstableMode complex_eigenvalues critical_points crossings "
        "friction_loop judge track unstable_modes verdict"
    ),
}
_MODULE = {name: module for module, names in _HOME.items() for name in names.split()}
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


def __getattr__(name: str) -> Any:
    if name == "plots":
        return importlib.import_module("squeal.plots")
    if name not in _MODULE:
        raise AttributeError(f"module 'squeal' has no attribute {name!r}")
    return getattr(importlib.import_module(_MODULE[name]), name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
