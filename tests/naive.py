"""Eqs. (1)-(20) written out literally, in mpmath: an independent second form of the model.

Vectors, |r - r_f| - L and integrals over the contact line stand here as the article has them (with
the corrections that the scene's formulation names), without any of the package's rearrangements.
"""

import mpmath as mp

from squeal.model.contact import Formulation
from squeal.model.pad import Pad

mp.mp.dps = 50


def points(p: Pad, q):
    """Free ends r1, r2 and lower corners (leading, trailing), from the fixed frame's origin."""
    x, y, theta = (mp.mpf(v) for v in q)
    w = mp.mpf(p.w)
    h = mp.mpf(p.h)
    t0 = mp.mpf(p.theta0)
    d = mp.sqrt(w * w + h * h)
    beta = mp.asin(h / mp.sqrt(w * w + h * h))
    t = t0 + theta
    X = p.x0 + x
    Y = p.y0 + y
    r1 = (X - d * mp.cos(beta - t), Y + d * mp.sin(beta - t))
    r2 = (X + d * mp.cos(beta + t), Y + d * mp.sin(beta + t))
    leading = (X - d * mp.cos(beta + t), Y - d * mp.sin(beta + t))
    trailing = (X + d * mp.cos(beta - t), Y - d * mp.sin(beta - t))
    return r1, r2, leading, trailing, (X, Y)


def spring_loads(p: Pad, q):
    """Force and moment of springs 1 and 2, Eqs. (1)-(3) and their terms in Eq. (6)."""
    here = points(p, q)
    rest = points(p, (0, 0, 0))
    a1 = mp.mpf(p.alpha1)
    a2 = mp.mpf(p.alpha2)
    fixed = (
        (rest[0][0] + p.L1 * mp.cos(a1), rest[0][1] + p.L1 * mp.sin(a1)),
        (rest[1][0] - p.L2 * mp.cos(a2), rest[1][1] + p.L2 * mp.sin(a2)),
    )
    total = [mp.mpf(0)] * 3
    for r, rf, k, L in zip(here[:2], fixed, (p.k1, p.k2), (p.L1, p.L2), strict=True):
        v = (r[0] - rf[0], r[1] - rf[1])
        length = mp.sqrt(v[0] ** 2 + v[1] ** 2)
        f = [-k * (length - L) * c / length for c in v]
        arm = (r[0] - here[4][0], r[1] - here[4][1])
        total = [total[0] + f[0], total[1] + f[1], total[2] + arm[0] * f[1] - arm[1] * f[0]]
    return total


def b1_loads(p: Pad, q, state):
    """Right-hand sides of Eqs. (4)-(6)."""
    fx, fy, moment = spring_loads(p, q)
    here = points(p, q)
    rest = points(p, (0, 0, 0))
    for touches, k, i in zip(state, (p.k3, p.k4), (2, 3), strict=True):
        if touches:
            N = -k * (here[i][1] - rest[i][1])
            ax = here[i][0] - here[4][0]
            ay = here[i][1] - here[4][1]
            fx = fx + p.mu * N
            fy = fy + N
            moment += ax * N - ay * p.mu * N
    return [fx, fy - p.F_n, moment]


def line_reaction(p: Pad, form: Formulation, q, state):
    """R_n and delta by integration along the contact line, Eqs. (13) and (17) corrected."""
    _, _, leading, trailing, centre = points(p, q)
    x0, y0 = leading
    x1, y1 = trailing

    def depth(s):  # penetration of the point at share s of the lower face
        return -p.h - (y0 + s * (y1 - y0))

    def place(s):
        return x0 + s * (x1 - x0)

    low = mp.mpf(0)
    high = mp.mpf(1)
    if state != (True, True):
        crossing = (-p.h - y0) / (y1 - y0)
        low, high = (low, crossing) if state[0] else (crossing, high)

    def integral(f):  # Simpson's rule is exact for polynomials of degree three
        return (high - low) / 6 * (f(low) + 4 * f((low + high) / 2) + f(high))

    area = integral(depth)
    first = integral(lambda s: depth(s) * place(s))
    Rn = p.k_c * area  # (k_c / 2w) x integral along the face of length 2w
    if form.line_force == "mean":
        Rn /= high - low
    delta = first / area - (centre[0] if form.delta_from == "centre" else 0)
    return Rn, delta


def b2_loads(p: Pad, form: Formulation, q, state):
    """Right-hand sides of Eqs. (8)-(10) in the chosen formulation."""
    fx, fy, moment = spring_loads(p, q)
    if any(state):
        Rn, delta = line_reaction(p, form, q, state)
        sign = 1 if form.delta_moment == "+" else -1
        fx = fx + p.mu * Rn
        fy = fy + Rn
        moment = moment + p.h * p.mu * Rn + sign * delta * Rn
    return [fx, fy - p.F_n, moment]


def loads(name, p, form, q, state):
    """Loads of model B1 or B2."""
    return b1_loads(p, q, state) if name == "B1" else b2_loads(p, form, q, state)


def jacobian(name, p, form, q, state):
    """Rows of the loads' derivative by q, by central differences at 50 digits or more."""
    step = mp.mpf(10) ** -round(0.36 * mp.mp.dps)
    columns = []
    for i in range(3):
        up = [mp.mpf(v) for v in q]
        down = [mp.mpf(v) for v in q]
        up[i] += step
        down[i] -= step
        a = loads(name, p, form, up, state)
        b = loads(name, p, form, down, state)
        columns.append([(u - d) / (2 * step) for u, d in zip(a, b, strict=True)])
    return [list(row) for row in zip(*columns, strict=True)]
