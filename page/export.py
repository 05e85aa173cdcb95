"""The compiled code behind the page, as LLVM text.

Everything rests on the symbolic equations that the Taylor integrator compiles: steps with their
events, with and without damping, loads with K, C, their derivative by mu and the potential energy,
gaps, the plotted signals, coefficients.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any

import heyoka as hy

from squeal.io.scene import DEFAULT_TOLERANCE
from squeal.model.contact import (
    FORMULATION_CHOICES,
    NONE,
    NORMAL_REACTION,
    ContactLaw,
    Formulation,
    State,
    Touching,
    contact_law,
    contact_model,
    states,
)
from squeal.model.equations import term_count
from squeal.model.pad import PARAMETERS, Coefficients, coefficients, pose_of, spring_energy
from squeal.simulation.taylor import FAINT, NAMES, equations, rising, state_parameters

SHOWN = ("B1", "B2", "BN")  # models on the page
SPRINGS = (4, 8, 16, 32)  # of model BN; each number is code of its own
# Up to so many contact points each state has code of its own; with more one code serves all.
OWN_CODE = 2
DAMPED = ("damping",)
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
    """All contact laws by the name that exported functions carry: B1, B2_integral_centre_+, BN_4"""
    found = {}
    for model in SHOWN:
        allowed = offered(model)
        for choice in itertools.product(*allowed.values()):
            words: dict[str, Any] = dict(zip(allowed, choice, strict=True))
            law = contact_law(model, Formulation(**words))
            found["_".join((model, *map(str, choice)))] = law
    return found


def offered(model: str) -> dict[str, tuple[Any, ...]]:
    """What the page offers for each key of a model's formulation."""
    everything: dict[str, tuple[Any, ...]] = {**FORMULATION_CHOICES, "springs": SPRINGS}
    return {name: everything[name] for name in contact_model(model).choices}


def bits(contact: State) -> int:
    """A contact state as the page counts it: 1 if the first point touches, plus 2 for the next,
    and so on from the leading edge to the trailing."""
    return sum(touches << i for i, touches in enumerate(contact))


def own_states(law: ContactLaw) -> tuple[State | None, ...]:
    """The states that have code of their own, or None: one code serves all."""
    return states(law.points) if law.points <= OWN_CODE else (None,)


def _function(name: str, outputs: list[Any], inputs: list[Any]) -> Module:
    """A compiled function (out, in, coefficients, time) of heyoka."""
    made = hy.cfunc([hy.expression(0.0) + e for e in outputs], inputs, opt_level=0)
    return Module(name, "cfunc", (made.llvm_states[0].ir,))


def _gradient(of: list[Any], by: list[Any]) -> list[Any]:
    return [hy.diff(e, v) for e in of for v in by]


def _symbols() -> Coefficients:
    return Coefficients(**{n: hy.par[i] for i, n in enumerate(NAMES)})


@cache
def integrator(law: ContactLaw, contact: State | None, terms: tuple[str, ...] = ()) -> Any:
    """The integrator of one contact state, or of any (None) that its parameters then tell."""
    on = _touching(law, contact)
    system, heights, limits = equations(law, on, terms)
    upwards = hy.event_direction.positive
    downwards = hy.event_direction.negative
    changes = rising(heights, on)
    events = [hy.t_event(e, direction=upwards) for e in changes]
    events += [hy.t_event(limit, direction=downwards) for limit in limits]
    used = hy.get_params([*(rhs for _, rhs in system), *changes, *limits])
    most = len(NAMES) + law.points + term_count(terms)
    pars = [1.0] * (1 + max(i for i in range(most) if hy.par[i] in used))
    how: Any = {"tol": DEFAULT_TOLERANCE, "t_events": events} | PLAIN
    return hy.taylor_adaptive(system, [0.0] * 6, pars=pars, **how)


def _touching(law: ContactLaw, contact: State | None) -> Touching:
    return state_parameters(law) if contact is None else contact


def _steps(tail: str, law: ContactLaw, contact: State | None) -> list[Module]:
    """One Taylor step, with and without damping.

    (jet of state and events, state, parameters, time, step, size, tape)
    """
    found = []
    for what, terms in (("step", ()), ("damped", DAMPED)):
        text = integrator(law, contact, terms).llvm_state.ir
        texts = (text,) if isinstance(text, str) else tuple(text)
        found.append(Module(f"{what}_{tail}", "step_e", texts))
    return found


def _loads(name: str, law: ContactLaw, contact: State | None) -> Module:
    """Net Fx, Fy and moment, K (3 x 3), C (3 x 3), the loads' derivative by mu, the potential."""
    c = _symbols()
    on = _touching(law, contact)
    rhs = [e for _, e in equations(law, on, DAMPED)[0][3:]]
    loads = [c.m * rhs[0], c.m * rhs[1], c.I / c.w * rhs[2]]
    turn = [1.0, 1.0, c.w] * 3  # from w theta to theta
    K = [-t * e for t, e in zip(turn, _gradient(loads, VARIABLES[:3]), strict=True)]
    C = [-t * e for t, e in zip(turn, _gradient(loads, VARIABLES[3:]), strict=True)]
    at = pose_of(hy, c.xy_theta(VARIABLES[:3]))
    potential = spring_energy(hy, c, at) + law.energy(c, at, on) + c.F_n * at.y
    outputs = [*loads, *K, *C, *_gradient(loads, [c.mu]), potential]
    return _function(name, outputs, VARIABLES)


def _signals(name: str, law: ContactLaw, contact: State | None) -> Module:
    """The two plotted signals, then the reaction and its place from the mass centre."""
    c, (x, y, s, *_), on = _symbols(), VARIABLES, _touching(law, contact)
    at = pose_of(hy, c.xy_theta((x, y, s)))
    reaction = law.resultant(c, at, on)
    # of a row of springs the signals look at the size of the force, which no expression can
    shown = reaction if law.plotted is NORMAL_REACTION else law.signals(c, at, on)
    return _function(name, [*shown, *reaction], VARIABLES)


def _gaps(name: str, law: ContactLaw) -> Module:
    """All gaps, their rates, and the limits that are positive while the model holds."""
    _, heights, limits = equations(law, states(law.points)[1])
    x, y, s, u, v, r = VARIABLES
    rates = [hy.diff(g, x) * u + hy.diff(g, y) * v + hy.diff(g, s) * r for g in heights]
    return _function(name, [*heights, *rates, *(limit / FAINT for limit in limits)], VARIABLES)


def _coefficients(name: str, law: ContactLaw) -> Module:
    """The coefficients of a scaled pad from its parameters, in the order of `parameters`."""
    symbols = dict(zip(parameters(), hy.make_vars(*parameters()), strict=True))
    c = coefficients(hy, SimpleNamespace(**symbols), law.absolute_gap)  # type: ignore[arg-type]
    values = [getattr(c, n) for n in NAMES]
    return _function(name, values, list(symbols.values()))


def parameters() -> list[str]:
    """Parameters of a pad that enter its motion."""
    return [n for n, p in PARAMETERS.items() if n != "V" and not p.needs]


def modules() -> list[Module]:
    """Everything that the page calls."""
    found = []
    for key, law in laws().items():
        if key in ("B1", "B2_integral_centre_+"):
            found.append(_coefficients(f"coefficients_{key[:2]}", law))
        if key == "B1" or law.points > OWN_CODE:
            found.append(_gaps(gaps_name(key, law), law))
        for contact in own_states(law):
            if contact == NONE:  # no contact, no law: one for all
                if key == "B1":
                    found += [*_steps("0", law, contact), _loads("loads_0", law, contact)]
                continue
            tail = key if contact is None else f"{key}_{bits(contact)}"
            found += _steps(tail, law, contact)
            found += [_loads(f"loads_{tail}", law, contact)]
            found += [_signals(f"signals_{tail}", law, contact)]
    return found


def gaps_name(key: str, law: ContactLaw) -> str:
    """Name of the function of the gaps, of which laws with the edges alone have one."""
    return f"gaps_{key}" if law.points > OWN_CODE else "gaps"
