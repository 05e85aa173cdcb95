"""The compiled code behind the page, as LLVM text, and the tables that describe it.

Everything rests on the symbolic equations that the Taylor integrator compiles: steps with their
events, loads with K, C and their derivative by mu, gaps, the plotted signals, coefficients.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import heyoka as hy

from squeal.article.cases import CASES, stem
from squeal.model.contact import (
    FORMULATION_CHOICES,
    Formulation,
    contact_law,
    contact_model,
    models_with,
)
from squeal.model.law import ContactLaw
from squeal.model.mechanics import Coefficients, coefficients, pose
from squeal.model.pad import PARAMETERS
from squeal.model.states import NONE, STATES, State
from squeal.scene import Scene, read_scene
from squeal.scene.keys import DEFAULT_TOLERANCE
from squeal.simulation.integrators.taylor import FAINT, coefficient_names, compiled, equations
from squeal.simulation.legs import LIMITS

OF_PARAMETER = ("meaning", "unit", "dimension", "required", "angle")
SHOWN = ("B1", "B2")  # models on the page
VARIABLES = hy.make_vars("x", "y", "s", "u", "v", "r")  # those of `equations`
# The steps of a law are small in heyoka's compact mode: 15 kB instead of 60 kB; clang optimises.
PLAIN: dict[str, Any] = {"opt_level": 0, "compact_mode": True}


@dataclass(frozen=True)
class Module:
    """LLVM text of one exported function; `entry` is what heyoka calls it, `name` its new name."""

    name: str
    entry: str
    texts: tuple[str, ...]


def laws() -> dict[str, ContactLaw]:
    """All contact laws by the name that exported functions carry: B1, B2_integral_centre_+..."""
    formulations = [
        dict(zip(FORMULATION_CHOICES, choice, strict=True))
        for choice in itertools.product(*FORMULATION_CHOICES.values())
    ]
    return {"B1": contact_law("B1")} | {
        "_".join(("B2", *words.values())): contact_law("B2", Formulation(**words))  # type: ignore[arg-type]
        for words in formulations
    }


def bits(contact: State) -> int:
    """A contact state as the page counts it: 1 if the leading edge touches, plus 2 for trailing."""
    return int(contact.leading) + 2 * int(contact.trailing)


def _function(name: str, outputs: list[Any], inputs: list[Any]) -> Module:
    """A compiled function (out, in, coefficients, time) of heyoka."""
    made = hy.cfunc([hy.expression(0.0) + e for e in outputs], inputs, opt_level=0)
    return Module(name, "cfunc", (made.llvm_states[0].ir,))


def _gradient(of: list[Any], by: list[Any]) -> list[Any]:
    return [hy.diff(e, v) for e in of for v in by]


def _symbols() -> Coefficients:
    return Coefficients(**{n: hy.par[i] for i, n in enumerate(coefficient_names())})


def _integrator(law: ContactLaw, contact: State) -> Any:
    return compiled(law, contact, DEFAULT_TOLERANCE, float, **PLAIN)


def _step(name: str, law: ContactLaw, contact: State) -> Module:
    """One Taylor step: (jet of state and events, state, coefficients, time, step, size, tape)."""
    text = _integrator(law, contact).llvm_state.ir
    return Module(name, "step_e", (text,) if isinstance(text, str) else tuple(text))


def _loads(name: str, law: ContactLaw, contact: State) -> Module:
    """Net Fx, Fy and moment, K (3 x 3), C (3 x 3), and the loads' derivative by mu."""
    c, rhs = _symbols(), [e for _, e in equations(law, contact)[0][3:]]
    loads = [c.m * rhs[0], c.m * rhs[1], c.I / c.w * rhs[2]]
    turn = [1.0, 1.0, c.w] * 3  # from w theta to theta
    K = [-t * e for t, e in zip(turn, _gradient(loads, VARIABLES[:3]), strict=True)]
    C = [-t * e for t, e in zip(turn, _gradient(loads, VARIABLES[3:]), strict=True)]
    return _function(name, [*loads, *K, *C, *_gradient(loads, [c.mu])], VARIABLES)


def _signals(name: str, law: ContactLaw, contact: State) -> Module:
    """The two plotted signals, then the reaction and its place from the mass centre."""
    c, (x, y, s, *_) = _symbols(), VARIABLES
    at = pose(hy, c.place((x, y, s)))
    both = [*law.signals(c, at, contact), *law.resultant(c, at, contact)]
    return _function(name, both, VARIABLES)


def _gaps(name: str) -> Module:
    """Both gaps, their rates, and the limits that are positive while the model holds."""
    _, heights, limits = equations(laws()["B1"], NONE)
    x, y, s, u, v, r = VARIABLES
    rates = [hy.diff(g, x) * u + hy.diff(g, y) * v + hy.diff(g, s) * r for g in heights]
    return _function(name, [*heights, *rates, *(limit / FAINT for limit in limits)], VARIABLES)


def _coefficients(name: str, law: ContactLaw) -> Module:
    """The coefficients of a scaled pad from its parameters, in the order of `parameters`."""
    symbols = dict(zip(parameters(), hy.make_vars(*parameters()), strict=True))
    c = coefficients(hy, SimpleNamespace(**symbols), law.absolute_gap)  # type: ignore[arg-type]
    values = [getattr(c, n) for n in coefficient_names()]
    return _function(name, values, list(symbols.values()))


def parameters() -> list[str]:
    """Parameters of a pad that enter its motion."""
    return [n for n, p in PARAMETERS.items() if n != "V" and not p.needs]


def modules() -> list[Module]:
    """Everything that the page calls."""
    found = [_gaps("gaps")]
    for key, law in laws().items():
        model = key[:2]
        if key in ("B1", "B2_integral_centre_+"):
            found.append(_coefficients(f"coefficients_{model}", law))
        for contact in STATES:
            tail = f"{key}_{bits(contact)}"
            if contact == NONE:  # no contact, no law: one for all
                if key == "B1":
                    found += [_step("step_0", law, contact), _loads("loads_0", law, contact)]
            else:
                found += [
                    _step(f"step_{tail}", law, contact),
                    _loads(f"loads_{tail}", law, contact),
                    _signals(f"signals_{tail}", law, contact),
                ]
    return found


def tables(scenes: Path) -> dict[str, Any]:
    """What the page shows and how it calls the functions; `scenes` holds the article's eight."""
    steps = [_integrator(law, contact) for law in laws().values() for contact in STATES]
    order = steps[0].order
    return {
        "order": order,
        "tape": max(len(step.decomposition) for step in steps) * (order + 1),
        "limits": LIMITS,
        "parameters": {
            n: {key: getattr(p, key) for key in OF_PARAMETER}
            | {
                "models": models_with(n),
                "low": max(p.kind.low, -1e300),
                "high": min(p.kind.high, 1e300),
                "lowAllowed": p.kind.low_allowed,
                "allowed": f"a finite number{p.kind.range()}",
            }
            for n, p in PARAMETERS.items()
            if not p.needs
        },
        "inputs": parameters(),
        "coefficients": coefficient_names(),
        "formulation": FORMULATION_CHOICES,
        "contacts": {
            model: {str(bits(state)): contact_law(model).state_name(state) for state in STATES}
            for model in SHOWN
        },
        "meanings": {model: contact_law(model).meanings for model in SHOWN},
        "signals": {key: [s.name for s in law.plotted] for key, law in laws().items()},
        "cases": {
            model: {case: _case(scenes / f"{stem(model, case)}.yaml") for case in CASES}
            for model in SHOWN
        },
    }


def choices(scene: Scene) -> dict[str, str]:
    """The choices of a scene's formulation that name its law."""
    has = contact_model(scene.model).choices
    return {n: getattr(scene.formulation, n) for n in FORMULATION_CHOICES if n in has}


def _case(path: Path) -> dict[str, Any]:
    scene = read_scene(path)
    values = {n: getattr(scene.pad, n) for n in PARAMETERS if scene.model in models_with(n)}
    return {
        "parameters": {n: v for n, v in values.items() if v is not None},
        "formulation": choices(scene),
        "initial": scene.initial,
        "stop": scene.stop,
    }
