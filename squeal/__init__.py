"""squeal: hammering brake squeal, simulated, linearised and judged.

    import squeal
    scene = squeal.read_scene("pad.yaml")
    print(squeal.eigenvalues(scene), squeal.thresholds(scene))

A pad is a `Scene`; matrices come from `read_system`, or from arrays by `System`. The verbs take
both, and answer with records that print, draw (`plot`) and save themselves. Names are loaded when
they are first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:
    from squeal.errors import ComputationError, InputError
    from squeal.io.scene import Damping, Scene, read_scene
    from squeal.io.system import SystemFile
    from squeal.io.system_files import read_system
    from squeal.io.writing import Answer, Column, Table
    from squeal.linear.system import System, TermSystem
    from squeal.linear.terms import Term
    from squeal.model.contact import Formulation
    from squeal.model.pad import Pad
    from squeal.queries.advise import Advice, advise
    from squeal.queries.check import Check, check
    from squeal.queries.compare import Pairs, compare, mac
    from squeal.queries.conditions import conditions
    from squeal.queries.critical_speeds import CriticalSpeeds, critical_speeds
    from squeal.queries.cycles import Cycles, cycles
    from squeal.queries.eigenvalues import eigenvalues
    from squeal.queries.energy import Energy, energy
    from squeal.queries.energy_sweep import EnergySweep, energy_sweep
    from squeal.queries.map import map
    from squeal.queries.optimise import Optimum, optimise
    from squeal.queries.reduce import reduce
    from squeal.queries.sampling import read_spreads
    from squeal.queries.scatter import scatter
    from squeal.queries.sensitivity import sensitivity
    from squeal.queries.state_space import state_space
    from squeal.queries.sweep import sweep
    from squeal.queries.thresholds import thresholds
    from squeal.reports.report import Report, report
    from squeal.results.conditions import Conditions
    from squeal.results.eigenvalues import Eigenvalues
    from squeal.results.map import Axis, Map
    from squeal.results.scatter import Scatter
    from squeal.results.sensitivity import Sensitivity
    from squeal.results.sweep import Sweep
    from squeal.results.thresholds import Thresholds
    from squeal.simulation.run import Simulation, simulate
    from squeal.sparse.assembly import Assembly, assemble
    from squeal.sparse.components import Component
    from squeal.sparse.contact_faces import Surface, contact_between_faces
    from squeal.sparse.contact_seat import Contact

_HOMES = {
    "queries.check": "Check check",
    "queries.conditions": "conditions",
    "queries.critical_speeds": "CriticalSpeeds critical_speeds",
    "queries.cycles": "Cycles cycles",
    "queries.energy": "Energy energy",
    "queries.energy_sweep": "EnergySweep energy_sweep",
    "results.map": "Axis Map",
    "queries.optimise": "Optimum optimise",
    "queries.state_space": "state_space",
    "queries.compare": "Pairs compare mac",
    "queries.sampling": "read_spreads",
    "queries.scatter": "scatter",
    "results.scatter": "Scatter",
    "results.sensitivity": "Sensitivity",
    "queries.advise": "Advice advise",
    "queries.eigenvalues": "eigenvalues",
    "queries.map": "map",
    "queries.reduce": "reduce",
    "queries.sensitivity": "sensitivity",
    "queries.sweep": "sweep",
    "queries.thresholds": "thresholds",
    "io.writing": "Answer Column Table",
    "results.conditions": "Conditions",
    "results.eigenvalues": "Eigenvalues",
    "results.sweep": "Sweep",
    "results.thresholds": "Thresholds",
    "errors": "ComputationError InputError",
    "io.scene": "Damping Scene read_scene",
    "io.system": "SystemFile",
    "io.system_files": "read_system",
    "linear.system": "System TermSystem",
    "linear.terms": "Term",
    "model.contact": "Formulation",
    "model.pad": "Pad",
    "reports.report": "Report report",
    "simulation.run": "Simulation simulate",
    "sparse.assembly": "Assembly assemble",
    "sparse.components": "Component",
    "sparse.contact_faces": "Surface contact_between_faces",
    "sparse.contact_seat": "Contact",
}
_HOME = {name: home for home, names in _HOMES.items() for name in names.split()}
# fmt: off
__all__ = [
    "Advice", "Answer", "Assembly", "Axis", "Check", "Column", "Component", "ComputationError",
    "Conditions", "Contact", "CriticalSpeeds", "Cycles", "Damping", "Eigenvalues", "Energy",
    "EnergySweep", "Formulation", "InputError", "Map", "Optimum", "Pad", "Pairs", "Report",
    "Scatter", "Scene", "Sensitivity", "Simulation", "Surface", "Sweep", "System", "SystemFile",
    "Table", "Term", "TermSystem", "Thresholds", "advise", "assemble", "check", "compare",
    "conditions", "contact_between_faces", "critical_speeds", "cycles", "eigenvalues", "energy",
    "energy_sweep", "mac", "map", "optimise", "read_scene", "read_spreads", "read_system",
    "reduce", "report", "scatter", "sensitivity", "simulate", "state_space", "sweep", "thresholds",
]
# fmt: on


if not TYPE_CHECKING:  # a type checker must refuse a name that there is not

    def __getattr__(name: str) -> object:
        if name == "plots":
            import squeal.plots

            return squeal.plots
        if name not in _HOME:
            raise AttributeError(f"module 'squeal' has no attribute {name!r}")
        value = getattr(importlib.import_module(f"squeal.{_HOME[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
