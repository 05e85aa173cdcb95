"""What a parameter set says of points and line, by a second method from beginning to end.

Equations of `tests.direct`, SciPy's integrator with forces that are clipped instead of contact
states, equilibria by a root finder, blows by sums over samples: nothing of the package but `Pad`.
"""

import itertools
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

from squeal.model.pad import Pad
from tests.direct import loads

STEP = 0.005  # of samples that blows are summed over, in sqrt(m / k1)
LEVEL = 0.05  # least impulse of a blow over F_n T_1
TURNS = 4  # changes of the edge struck


def gaps(name: str, p: Pad, q) -> np.ndarray:
    """Heights (2, ...) of the leading and the trailing edge above the surface."""
    x, y, theta = q
    del x
    tilt = p.theta0 + theta
    heights = np.array([y - p.w * np.sin(tilt), y + p.w * np.sin(tilt)]) - p.h * np.cos(tilt)
    if name == "B2":
        return heights + p.y0 + p.h
    rest = np.array([-p.w * np.sin(p.theta0), p.w * np.sin(p.theta0)]) - p.h * np.cos(p.theta0)
    return heights - rest.reshape(2, *[1] * (heights.ndim - 1))


def balanced(force, p: Pad, mu: float, q: np.ndarray) -> np.ndarray | None:
    """A place near q where the pad rests; None where none is found."""
    scale = np.array([1.0, 1.0, 1.0 / p.w]) * p.F_n / p.k1

    def balance(u):
        return np.array(force(u * scale, mu)) / p.F_n

    tries = [root(balance, q / scale, method=method) for method in ("hybr", "lm")]
    best = min(tries, key=lambda one: np.abs(one.fun).max())
    return best.x * scale if np.abs(best.fun).max() < 1e-6 else None


def potential(force, q: np.ndarray) -> float:
    """Work against the loads without friction on the straight way from the initial position."""
    points, weights = np.polynomial.legendre.leggauss(400)
    pairs = zip((points + 1) / 2, weights / 2, strict=True)
    return -sum(weight * float(np.dot(force(s * q, 0.0), q)) for s, weight in pairs)


def equilibrium(name: str, p: Pad) -> np.ndarray | None:
    """Where the pad slides steadily, followed from the place of least energy without friction; None
    where it is lost."""
    force = loads(name, p)
    stiffness = p.k3 + p.k4 if name == "B1" else p.k_c
    height = -(p.y0 if name == "B2" else 0.0) - p.F_n / stiffness
    rests = []
    for tilt in (0.0, -0.3, -0.1, -0.03, 0.03, 0.1, 0.3):
        q = balanced(force, p, 0.0, np.array([0.0, height, tilt]))
        if q is not None and gaps(name, p, q).min() < 0.0:
            rests.append(q)
    if not rests:
        return None
    q = min(rests, key=lambda place: potential(force, place))
    for mu in np.linspace(0.0, p.mu, 41)[1:]:
        moved = balanced(force, p, mu, q)
        if moved is None:
            return None
        q = moved
    return q


def motion(name: str, p: Pad, start, stop: float):
    """SciPy's solution with dense output, and times at which an edge touches or separates."""
    force = loads(name, p)
    mass = np.array([p.m, p.m, p.I])

    def rates(_t, state):
        return [*state[3:], *(np.array(force(state[:3].tolist(), p.mu)) / mass)]

    def leading(_t, state):
        return gaps(name, p, state[:3])[0]

    def trailing(_t, state):
        return gaps(name, p, state[:3])[1]

    unit = 1e-12 * p.F_n / p.k1
    solved = solve_ivp(
        rates,
        (0.0, stop),
        start,
        method="DOP853",
        dense_output=True,
        events=[leading, trailing],
        rtol=1e-9,
        atol=unit * 1e2,
        max_step=0.2,
    )
    return solved.sol, np.unique(np.concatenate([[0.0], *solved.t_events, [stop]]))


def shares(name: str, p: Pad, solution, times) -> dict[tuple[bool, bool], float]:
    """Share of the time since first contact in each state (leading, trailing touches)."""
    spent: dict[tuple[bool, bool], float] = {}
    for a, b in itertools.pairwise(times.tolist()):
        low = gaps(name, p, solution((a + b) / 2)[:3])
        state = (bool(low[0] < 0.0), bool(low[1] < 0.0))
        if spent or any(state):
            spent[state] = spent.get(state, 0.0) + b - a
    total = sum(spent.values())
    return {state: time / total for state, time in spent.items()}


def hammers(name: str, p: Pad, solution, stop: float, spent) -> bool:
    """Whether successive blows fall on different edges, and the force at each edge vanishes."""
    t = np.arange(0.0, stop, STEP) + STEP / 2
    depth = np.maximum(-gaps(name, p, solution(t)[:3]), 0.0)
    raw = -gaps(name, p, solution(t)[:3])
    if name == "B1":
        load = p.k3 * depth[0] + p.k4 * depth[1]
        moment = p.k4 * depth[1] - p.k3 * depth[0]
    else:
        points, weights = np.polynomial.legendre.leggauss(64)
        load = 0.0
        moment = 0.0
        for s, weight in zip(points, weights, strict=True):
            pressure = np.maximum((raw[0] * (1 - s) + raw[1] * (1 + s)) / 2, 0.0)
            load = load + p.k_c * weight / 2 * pressure
            moment = moment + p.k_c * weight / 2 * pressure * s
    period = 2 * np.pi * np.sqrt(p.m / p.k1)
    blows: list[int] = []
    side = 0
    impulse = 0.0
    for force, turn in zip(load.tolist(), moment.tolist(), strict=True):
        here = int(np.sign(turn)) or side
        if here != side:
            if side and impulse > LEVEL * p.F_n * period:
                blows.append(side)
            side = here
            impulse = 0.0
        impulse += force * STEP
    if side and impulse > LEVEL * p.F_n * period:
        blows.append(side)
    turns = sum(a != b for a, b in itertools.pairwise(blows))
    if name == "B2":
        off = spent.get((False, False), 0.0)
    else:
        off = min(lost(spent, (True, False)), lost(spent, (False, True)))
    return turns >= TURNS and off > 1e-9


def lost(spent, watched) -> float:
    """Share of time in which a watched edge is off."""
    total = 0.0
    for (leading, trailing), share in spent.items():
        if (watched[0] and not leading) or (watched[1] and not trailing):
            total += share
    return total


def says(
    pads: dict[str, list[Pad]], starts: dict[str, list[np.ndarray]], stop: float
) -> dict[str, Any]:
    """Of the four cases of each model: mean shares lost and apart over the cases in which both
    models have an equilibrium, and the cases that hammer."""
    spent = {}
    rests = {}
    hammering = {}
    for name, four in pads.items():
        hammering[name] = ""
        for letter, p, start in zip("abcd", four, starts[name], strict=True):
            solution, times = motion(name, p, start, stop)
            spent[name, letter] = shares(name, p, solution, times)
            rests[name, letter] = equilibrium(name, p)
            if hammers(name, p, solution, stop, spent[name, letter]):
                hammering[name] += letter
    without = {letter for (_, letter), rest in rests.items() if rest is None}
    both = [letter for letter in "abcd" if letter not in without]
    answer: dict[str, Any] = {"hammers": f"{hammering['B1']}/{hammering['B2']}"}
    for digit, name in enumerate(pads, 1):
        lost_shares = []
        apart_shares = []
        for k in both:
            p = pads[name]["abcd".index(k)]
            touching = gaps(name, p, rests[name, k]) < 0.0
            lost_shares.append(lost(spent[name, k], touching))
            apart_shares.append(lost(spent[name, k], (True, True)))
        answer[f"lost{digit}"] = 1e3 * float(np.mean(lost_shares))
        answer[f"apart{digit}"] = 1e3 * float(np.mean(apart_shares))
    return answer
