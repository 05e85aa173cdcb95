"""What the page shows and how it calls the compiled functions, as one JSON object."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from page.export import (
    DAMPED,
    OWN_CODE,
    SHOWN,
    bits,
    gaps_name,
    integrator,
    laws,
    offered,
    own_states,
    parameters,
)
from squeal.article.cases import CASES, stem
from squeal.equilibrium.damping import UNSTABLE
from squeal.io.scene import DAMPING, Scene, read_scene
from squeal.model.contact import (
    STATES,
    Formulation,
    Springs,
    contact_law,
    contact_model,
    models_with,
)
from squeal.model.equations import term_count
from squeal.model.pad import PARAMETERS
from squeal.schema import Number, Several
from squeal.simulation.hybrid import LIMITS
from squeal.simulation.taylor import NAMES

OF_PARAMETER = ("meaning", "unit", "dimension", "required", "angle")


def limits(kind: Number) -> dict[str, Any]:
    """What a number may be, as the page asks."""
    return {
        "low": max(kind.low, -1e300),
        "high": min(kind.high, 1e300),
        "lowAllowed": kind.low_allowed,
    }


def tables(scenes: Path) -> dict[str, Any]:
    """What the page shows and how it calls the functions; `scenes` holds the article's eight."""
    steps = [
        integrator(law, contact, terms)
        for law in laws().values()
        for contact in own_states(law)
        for terms in ((), DAMPED)
    ]
    order = steps[0].order
    ratios = DAMPING.keys["ratios"].kind
    assert isinstance(ratios, Several)
    assert isinstance(ratios.entry, Number)
    return {
        "order": order,
        "tape": max(len(step.decomposition) for step in steps) * (order + 1),
        "limits": list(LIMITS.values())[:-1],  # all but that of friction which falls with speed
        "laws": {
            key: {
                "points": law.points,
                "own": law.points <= OWN_CODE,
                "gaps": gaps_name(key, law),
                "coefficients": f"coefficients_{'B2' if law.absolute_gap else 'B1'}",
                "places": [s.position for s in law.springs] if isinstance(law, Springs) else [],
            }
            for key, law in laws().items()
        },
        "decay": term_count(DAMPED),
        "damping": {
            "unstable": UNSTABLE,
            **limits(ratios.entry),
        },
        "parameters": {
            n: {key: getattr(p, key) for key in OF_PARAMETER}
            | {
                "models": models_with(n),
            }
            | limits(p.kind)
            for n, p in PARAMETERS.items()
            if not p.needs
        },
        "inputs": parameters(),
        "coefficients": NAMES,
        "formulation": {model: offered(model) for model in SHOWN},
        "contacts": {
            model: {str(bits(state)): contact_law(model).state_name(state) for state in STATES}
            for model in SHOWN
        },
        "meanings": {model: contact_law(model).meanings for model in SHOWN},
        "signals": {key: [s.name for s in law.plotted] for key, law in laws().items()},
        "cases": {model: {case: _case(scenes, model, case) for case in CASES} for model in SHOWN},
    }


def choices(scene: Scene) -> dict[str, Any]:
    """The choices of a scene's formulation that name its law."""
    return {n: getattr(scene.formulation, n) for n in contact_model(scene.model).choices}


def _case(scenes: Path, model: str, case: str) -> dict[str, Any]:
    """A case of the article; BN, which it has not, takes the pads of B2."""
    scene = read_scene(scenes / f"{stem('B2' if model == 'BN' else model, case)}.yaml")
    if model == "BN":
        scene = replace(scene, model=model, formulation=Formulation())
    values = {n: getattr(scene.pad, n) for n in PARAMETERS if scene.model in models_with(n)}
    return {
        "parameters": {n: v for n, v in values.items() if v is not None},
        "formulation": choices(scene),
        "initial": scene.initial,
        "stop": scene.stop,
        "damping": 0.0,
    }
