"""The article's motions by a program of their own: literal loads, SciPy, no located restarts.

Shares nothing with the package but the pad's numbers: vectors, |u| - L and penetrations as the
article writes them, Newton's method by differences, LSODA straight through the contact changes,
where the loads are continuous.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import odeint
from scipy.linalg import eigh


def corners(p, q):
    """Free ends of springs 1 and 2, leading and trailing lower corner, each (x, y)."""
    x = q[0] + (p.x0 or 0.0)
    y = q[1] + (p.y0 or 0.0)
    angle = q[2] + (p.theta0 or 0.0)
    cosine = math.cos(angle)
    sine = math.sin(angle)

    def turned(a, b):
        return (x + cosine * a - sine * b, y + sine * a + cosine * b)

    return [turned(-p.w, p.h), turned(p.w, p.h), turned(-p.w, -p.h), turned(p.w, -p.h)]


class Plain:
    """Loads of a pad of B1, or of B2 with the energy-consistent law."""

    def __init__(self, pad, line):
        self.p = pad
        self.line = line
        rest = corners(pad, (0.0, 0.0, 0.0))
        self.grounds = [
            (
                rest[0][0] + pad.L1 * math.cos(pad.alpha1),
                rest[0][1] + pad.L1 * math.sin(pad.alpha1),
            ),
            (
                rest[1][0] - pad.L2 * math.cos(pad.alpha2),
                rest[1][1] + pad.L2 * math.sin(pad.alpha2),
            ),
        ]
        self.level = -pad.h if line else rest[2][1]
        self.damping = np.zeros((3, 3))

    def gaps(self, q):
        return [corner[1] - self.level for corner in corners(self.p, q)[2:]]

    def contact(self, q):
        """Reaction and its moment about the centre, without friction; forces at the edges."""
        p = self.p
        leading, trailing = corners(self.p, q)[2:]
        x = q[0] + (p.x0 or 0.0)
        deep = [max(self.level - corner[1], 0.0) for corner in (leading, trailing)]
        if not self.line:
            forces = [p.k3 * deep[0], p.k4 * deep[1]]
            return sum(forces), forces[0] * (leading[0] - x) + forces[1] * (trailing[0] - x)
        leading_depth = self.level - leading[1]  # negative off the disc
        trailing_depth = self.level - trailing[1]
        if leading_depth <= 0.0 and trailing_depth <= 0.0:
            return 0.0, 0.0
        # the part of the face in the disc, in shares of its length from the leading edge
        low = 0.0 if leading_depth > 0.0 else leading_depth / (leading_depth - trailing_depth)
        high = 1.0 if trailing_depth > 0.0 else leading_depth / (leading_depth - trailing_depth)
        reaction = moment = 0.0
        for node, weight in ((-math.sqrt(0.6), 5 / 9), (0.0, 8 / 9), (math.sqrt(0.6), 5 / 9)):
            s = (low + high) / 2 + node * (high - low) / 2
            depth = leading_depth + s * (trailing_depth - leading_depth)
            force = p.k_c * weight * (high - low) / 2 * depth
            reaction += force
            moment += force * (leading[0] + s * (trailing[0] - leading[0]) - x)
        return reaction, moment

    def loads(self, q, mu):
        p = self.p
        points = corners(self.p, q)
        x = q[0] + (p.x0 or 0.0)
        y = q[1] + (p.y0 or 0.0)
        fx = 0.0
        fy = -p.F_n
        moment = 0.0
        springs = zip(points[:2], self.grounds, (p.k1, p.k2), (p.L1, p.L2), strict=True)
        for end, ground, k, length in springs:
            vx = end[0] - ground[0]
            vy = end[1] - ground[1]
            size = math.sqrt(vx * vx + vy * vy)
            gx = -k * (size - length) * vx / size
            gy = -k * (size - length) * vy / size
            fx = fx + gx
            fy = fy + gy
            moment += (end[0] - x) * gy - (end[1] - y) * gx
        reaction, turning = self.contact(q)
        fx = fx + mu * reaction
        fy = fy + reaction
        moment = moment + turning
        if self.line:
            return [fx, fy, moment + mu * p.h * reaction]
        for corner, k in zip(points[2:], (p.k3, p.k4), strict=True):
            moment -= mu * k * max(self.level - corner[1], 0.0) * (corner[1] - y)
        return [fx, fy, moment]

    def stiffness(self, q, mu):
        steps = np.array([1e-9, 1e-9, 1e-9 / self.p.w])
        columns = []
        for d in np.diag(steps):
            change = np.subtract(self.loads(q + d, mu), self.loads(q - d, mu))
            columns.append(change / (2 * d.sum()))
        return -np.array(columns).T

    def equilibrium(self, mu):
        """By Newton's method along friction from rest on the disc."""
        q = np.array([0.0, -(self.p.y0 or 0.0) - 1e-7, 0.0])
        for share in np.linspace(0.0, 1.0, 21):
            for _ in range(60):
                step = np.linalg.solve(self.stiffness(q, share * mu), self.loads(q, share * mu))
                longest = np.abs(step * [1.0, 1.0, self.p.w]).max()
                q = q + step * min(1.0, 2e-5 / longest)
                if longest < 1e-15:
                    break
        return q

    def damp(self, ratio):
        """All modes about the frictionless equilibrium with one damping ratio."""
        M = np.diag([self.p.m, self.p.m, self.p.I])
        K = self.stiffness(self.equilibrium(0.0), 0.0)
        squares, modes = eigh((K + K.T) / 2, M)
        self.damping = M @ modes @ np.diag(2 * ratio * np.sqrt(squares)) @ modes.T @ M


@dataclass
class Motion:
    """Times (n,), states (n, 6), gaps (2, n) and contact force (2, n): reaction and moment."""

    t: np.ndarray
    states: np.ndarray
    gaps: np.ndarray
    contact: np.ndarray

    def lost(self, wanted=(True, True)):
        """Share of time in which one of the wanted edges is off."""
        off = self.gaps > 0.0
        return float(np.mean(np.any(off & np.array(wanted)[:, None], axis=0)))


def move(model, state, stop, samples, tolerance=1e-10):
    """A motion from a state (6,), sampled evenly."""
    p = model.p
    C = model.damping.tolist()
    masses = (p.m, p.m, p.I)

    def rates(z, _t):
        z = z.tolist()
        force = model.loads(z[:3], p.mu)
        v = z[3:]
        accelerations = []
        for f, c, m in zip(force, C, masses, strict=True):
            accelerations.append((f - c[0] * v[0] - c[1] * v[1] - c[2] * v[2]) / m)
        return v + accelerations

    size = p.F_n / p.k1 * np.array([1.0, 1.0, 1.0 / p.w])
    scale = np.append(size, size * math.sqrt(p.k1 / p.m))
    t = np.linspace(0.0, stop, samples)
    # its errors accumulate: a tenth of the tolerance gives what DOP853 has at the whole
    error = 0.1 * tolerance
    states = odeint(rates, state, t, rtol=error, atol=error * scale, mxstep=1_000_000)
    gaps = np.array([model.gaps(z) for z in states.tolist()]).T
    contact = np.array([model.contact(z) for z in states.tolist()]).T
    return Motion(t, states, gaps, contact)
