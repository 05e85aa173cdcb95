"""squeal: hammering brake squeal, simulated, linearised and judged.

    from squeal import read_scene, analyse, critical_friction
    scene = read_scene("pad.yaml")
    print(analyse(scene).judgement, critical_friction(scene).points)

The names below are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from squeal.analysis.critical import critical_friction
    from squeal.analysis.eigenvalues import analyse, article_linearisation, swept
    from squeal.analysis.maps import Axis, angle_axes, stability_map
    from squeal.analysis.sensitivity import eigenvalue_sensitivities, threshold_sensitivities
    from squeal.equilibrium import find_all, sliding_equilibrium
    from squeal.errors import ComputationError, InputError
    from squeal.model.linear import about_origin, linearise, spring_stiffness
    from squeal.scene import Scene, read_plain, read_scene
    from squeal.simulation import Simulation, simulate
    from squeal.stability import (
        complex_eigenvalues,
        critical_points,
        friction_loop,
        judge,
        track,
        verdict,
    )

_HOME = {
    "squeal.analysis.maps": ("Axis", "angle_axes", "stability_map"),
    "squeal.analysis.critical": ("critical_friction",),
    "squeal.equilibrium": ("find_all", "sliding_equilibrium"),
    "squeal.errors": ("ComputationError", "InputError"),
    "squeal.model.linear": ("about_origin", "linearise", "spring_stiffness"),
    "squeal.scene": ("Scene", "read_plain", "read_scene"),
    "squeal.analysis.sensitivity": ("eigenvalue_sensitivities", "threshold_sensitivities"),
    "squeal.simulation": ("Simulation", "simulate"),
    "squeal.analysis.eigenvalues": ("analyse", "article_linearisation", "swept"),
    "squeal.stability": (
        "complex_eigenvalues",
        "critical_points",
        "friction_loop",
        "judge",
        "track",
        "verdict",
    ),
}
_MODULE = {name: module for module, names in _HOME.items() for name in names}
__all__ = [
    "Axis",
    "ComputationError",
    "InputError",
    "Scene",
    "Simulation",
    "about_origin",
    "analyse",
    "angle_axes",
    "article_linearisation",
    "complex_eigenvalues",
    "critical_friction",
    "critical_points",
    "eigenvalue_sensitivities",
    "find_all",
    "friction_loop",
    "judge",
    "linearise",
    "read_plain",
    "read_scene",
    "simulate",
    "sliding_equilibrium",
    "spring_stiffness",
    "stability_map",
    "swept",
    "threshold_sensitivities",
    "track",
    "verdict",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE:
        raise AttributeError(f"module 'squeal' has no attribute {name!r}")
    return getattr(importlib.import_module(_MODULE[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_MODULE])
