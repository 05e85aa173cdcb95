"""The motion of a pad from its equations written out once more, integrated by SciPy.

Plain doubles, forces from clipped penetrations, no contact states, no events: a second method for
what is not in the article, damping and friction that depends on speed.
"""

import numpy as np
from scipy.integrate import solve_ivp

from squeal.model.pad import Pad


def _turned(angle, x, y):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([x * c - y * s, x * s + y * c])


def loads(name: str, p: Pad, q, mu: float):
    """Net force and moment of models B1 and B2 (the consistent formulation)."""
    centre = np.array([p.x0 + q[0], p.y0 + q[1]])
    phi = p.theta0 + q[2]
    total = np.array([0.0, -p.F_n, 0.0])
    corners = ((-p.w, p.h), (p.w, p.h), (-p.w, -p.h), (p.w, -p.h))
    arms = [_turned(phi, *corner) for corner in corners]
    rest = [np.array([p.x0, p.y0]) + _turned(p.theta0, *corner) for corner in corners]
    feet = (
        rest[0] + p.L1 * np.array([np.cos(p.alpha1), np.sin(p.alpha1)]),
        rest[1] + p.L2 * np.array([-np.cos(p.alpha2), np.sin(p.alpha2)]),
    )
    for arm, foot, k, L in zip(arms[:2], feet, (p.k1, p.k2), (p.L1, p.L2), strict=True):
        v = centre + arm - foot
        f = -k * (np.hypot(*v) - L) / np.hypot(*v) * v
        total += [f[0], f[1], arm[0] * f[1] - arm[1] * f[0]]
    if name == "B1":
        for arm, at_rest, k in zip(arms[2:], rest[2:], (p.k3, p.k4), strict=True):
            N = k * max(at_rest[1] - (centre + arm)[1], 0.0)
            total += [mu * N, N, arm[0] * N - arm[1] * mu * N]
        return total
    depth = [-p.h - (centre + arm)[1] for arm in arms[2:]]
    if max(depth) <= 0.0:
        return total
    low, high = 0.0, 1.0
    if depth[0] < 0.0:
        low = depth[0] / (depth[0] - depth[1])
    elif depth[1] < 0.0:
        high = depth[0] / (depth[0] - depth[1])
    # two Gauss points integrate a quadratic exactly
    s = (low + high) / 2 + (high - low) / 2 * np.array([-1.0, 1.0]) / np.sqrt(3.0)
    pressure = p.k_c * (high - low) / 2 * (depth[0] + s * (depth[1] - depth[0]))
    N = pressure.sum()
    moment = (pressure * (arms[2][0] + s * (arms[3][0] - arms[2][0]))).sum()
    return total + [mu * N, N, p.h * mu * N + moment]


def motion(name, p, initial, times, C=None, mu=None, max_step=None):
    """States (n, 6) at the times; C (3, 3) damps, mu(x_dot) is the coefficient of friction."""
    C = np.zeros((3, 3)) if C is None else np.asarray(C)
    mass = np.array([p.m, p.m, p.I])

    def rates(_t, state):
        q, v = state[:3], state[3:]
        f = loads(name, p, q, p.mu if mu is None else mu(v[0]))
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
