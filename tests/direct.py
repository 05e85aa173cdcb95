"""The motion of a pad from its equations written out once more, integrated by SciPy.

Plain doubles, forces from clipped penetrations, no contact states, no events: a second method for
what is not in the article, damping and friction that depends on speed.
"""

import cmath

import numpy as np
from scipy.integrate import solve_ivp

from squeal.model.pad import Pad


def loads(name: str, p: Pad):
    """Net force and moment over q and mu of models B1 and B2 (the consistent formulation).

    Points of the plane are complex numbers x + i y.
    """
    corners = [complex(*at) for at in ((-p.w, p.h), (p.w, p.h), (-p.w, -p.h), (p.w, -p.h))]
    start = complex(p.x0, p.y0)
    rest = [start + cmath.exp(1j * p.theta0) * corner for corner in corners]
    feet = (rest[0] + p.L1 * cmath.exp(1j * p.alpha1), rest[1] - p.L2 * cmath.exp(-1j * p.alpha2))

    def at(q, mu: float):
        centre = start + complex(q[0], q[1])
        turn = cmath.exp(1j * (p.theta0 + q[2]))
        arms = [turn * corner for corner in corners]
        force = -1j * p.F_n
        moment = 0.0
        for arm, foot, k, L in zip(arms[:2], feet, (p.k1, p.k2), (p.L1, p.L2), strict=True):
            v = centre + arm - foot
            f = -k * (abs(v) - L) / abs(v) * v
            force = force + f
            moment = moment + (arm.conjugate() * f).imag
        if name == "B1":
            for arm, at_rest, k in zip(arms[2:], rest[2:], (p.k3, p.k4), strict=True):
                f = k * max((at_rest - centre - arm).imag, 0.0) * complex(mu, 1.0)
                force = force + f
                moment = moment + (arm.conjugate() * f).imag
            return force.real, force.imag, moment
        depth = [-p.h - (centre + arm).imag for arm in arms[2:]]
        if max(depth) <= 0.0:
            return force.real, force.imag, moment
        low = 0.0
        high = 1.0
        if depth[0] < 0.0:
            low = depth[0] / (depth[0] - depth[1])
        elif depth[1] < 0.0:
            high = depth[0] / (depth[0] - depth[1])
        for side in (-1.0, 1.0):  # two Gauss points integrate a quadratic exactly
            s = (low + high) / 2 + (high - low) / 2 * side / 3.0**0.5
            N = p.k_c * (high - low) / 2 * (depth[0] + s * (depth[1] - depth[0]))
            force += N * complex(mu, 1.0)
            moment += N * (arms[2] + s * (arms[3] - arms[2])).real + p.h * mu * N
        return force.real, force.imag, moment

    return at


def motion(name, p, initial, times, C=None, mu=None, max_step=None):
    """States (n, 6) at the times; C (3, 3) damps, mu(x_dot) is the coefficient of friction."""
    C = np.zeros((3, 3)) if C is None else np.asarray(C)
    mass = np.array([p.m, p.m, p.I])
    force = loads(name, p)

    def rates(_t, state):
        q = state[:3].tolist()
        v = state[3:]
        f = force(q, p.mu if mu is None else mu(v[0]))
        return np.concatenate([v, (f - C @ v) / mass])

    stiffness = sum(k for k in (p.k1, p.k2, p.k3, p.k4, p.k_c) if k)
    step = 0.05 * np.sqrt(p.m / stiffness) if max_step is None else max_step
    solved = solve_ivp(
        rates,
        (times[0], times[-1]),
        initial,
        method="DOP853",
        t_eval=times,
        rtol=1e-12,
        atol=1e-15,
        max_step=step,
    )
    return solved.y.T
