"""Eqs. (1)-(20) written out once more for many pads at once, and their equilibria by Newton."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from squeal.io.scene import Scene
from squeal.model.contact import Formulation

STARTS = 60  # places from which the frictionless equilibrium is sought


@dataclass(frozen=True)
class Literal:
    """The equations of n pads: every number an array (n,) or a plain one."""

    model: str
    p: dict[str, Any]
    form: Formulation
    C: np.ndarray | None = None  # (n, 3, 3)

    def corners(self, q: np.ndarray) -> list[np.ndarray]:
        """r1, r2 and the lower corners, each (2, n), in the fixed frame; last the mass centre."""
        p = self.p
        t = self.p["theta0"] + q[2]
        centre = np.array([p["x0"] + q[0], p["y0"] + q[1]])
        c = np.cos(t)
        s = np.sin(t)
        body = [(-p["w"], p["h"]), (p["w"], p["h"]), (-p["w"], -p["h"]), (p["w"], -p["h"])]
        turned = [centre + np.array([c * a - s * b, s * a + c * b]) for a, b in body]
        return [*turned, centre]

    def depths(self, q: np.ndarray) -> np.ndarray:
        """Penetrations (2, n) of the leading and the trailing edge."""
        here = self.corners(q)
        if self.model == "B1":
            rest = self.corners(0.0 * q)
            return np.array([rest[i][1] - here[i][1] for i in (2, 3)])
        return np.array([-self.p["h"] - here[i][1] for i in (2, 3)])

    def spring_loads(self, q: np.ndarray) -> np.ndarray:
        """Forces and moment (3, n) of springs 1 and 2."""
        p = self.p
        here = self.corners(q)
        rest = self.corners(0.0 * q)
        a1 = np.broadcast_to(p["alpha1"], q.shape[1:])
        a2 = np.broadcast_to(p["alpha2"], q.shape[1:])
        fixed = (
            rest[0] + p["L1"] * np.array([np.cos(a1), np.sin(a1)]),
            rest[1] + p["L2"] * np.array([-np.cos(a2), np.sin(a2)]),
        )
        total = np.zeros((3, *q.shape[1:]), dtype=q.dtype)
        for i, (k, L) in enumerate(((p["k1"], p["L1"]), (p["k2"], p["L2"]))):
            v = here[i] - fixed[i]
            length = np.sqrt(v[0] ** 2 + v[1] ** 2)
            f = -k * (length - L) * v / length
            arm = here[i] - here[4]
            total = total + np.array([f[0], f[1], arm[0] * f[1] - arm[1] * f[0]])
        return total

    def loads(self, q: np.ndarray, mu: Any, touching: np.ndarray) -> np.ndarray:
        """Right-hand sides of Eqs. (4)-(6) or (8)-(10); touching (2, n) of booleans."""
        p = self.p
        here = self.corners(q)
        fx, fy, moment = self.spring_loads(q)
        depth = self.depths(q)
        if self.model == "B1":
            for edge, k in enumerate((p["k3"], p["k4"])):
                N = np.where(touching[edge], k * depth[edge], 0.0)
                arm = here[2 + edge] - here[4]
                fx = fx + mu * N
                fy = fy + N
                moment = moment + arm[0] * N - arm[1] * mu * N
            return np.array([fx, fy - p["F_n"], moment])
        # along the face, share s from the leading to the trailing edge: Gauss' rule, exact here
        pl, pt = depth
        with np.errstate(all="ignore"):
            cut = np.where(pl == pt, 0.5, pl / (pl - pt))
        low = np.where(touching[0], 0.0, cut)
        high = np.where(touching[1], 1.0, cut)
        area = first = 0.0
        for node in (-1 / math.sqrt(3), 1 / math.sqrt(3)):
            s = low + (high - low) * (1 + node) / 2
            pressure = (pl + s * (pt - pl)) * (high - low) / 2
            place = here[2][0] + s * (here[3][0] - here[2][0])
            area = area + pressure
            first = first + pressure * place
        some = touching.any(axis=0)
        Rn = p["k_c"] * area
        if self.form.line_force == "mean":
            Rn = Rn / np.where(some, high - low, 1.0)
        delta = first / np.where(some, area, 1.0)
        if self.form.delta_from == "centre":
            delta = delta - here[4][0]
        sign = 1.0 if self.form.delta_moment == "+" else -1.0
        Rn = np.where(some, Rn, 0.0)
        moment = moment + p["h"] * mu * Rn + sign * delta * Rn
        return np.array([fx + mu * Rn, fy + Rn - p["F_n"], moment])

    def slopes(self, q: np.ndarray, mu: Any) -> tuple[np.ndarray, np.ndarray]:
        """Loads (3, n) and their derivative (n, 3, 3) at q, in the contact that q tells."""
        touching = self.depths(q) > 0.0
        shifted = self.loads(q[:, None] + 1e-30j * np.eye(3)[:, :, None], mu, touching)
        return shifted[:, 0].real, shifted.imag.transpose(2, 0, 1) / 1e-30

    def newton(self, q: np.ndarray, mu: Any, rounds: int) -> tuple[np.ndarray, np.ndarray]:
        """Equilibria near q (3, n), and where they were found."""
        q = q.copy()
        w = self.p["w"]
        unit = np.array([np.ones_like(q[0]), np.ones_like(q[0]), np.ones_like(q[0]) / w])
        size = np.full(q.shape[1], np.inf)
        for _ in range(rounds):
            with np.errstate(all="ignore"):
                f, J = self.slopes(q, mu)
            good = np.isfinite(f).all(axis=0) & np.isfinite(J).all(axis=(1, 2))
            A = J * unit.T[:, :, None] * unit.T[:, None, :]
            good[good] &= np.linalg.cond(A[good]) < 1e14
            A[~good] = np.eye(3)
            step = np.linalg.solve(A, -(f * unit).T[..., None])[..., 0].T
            step[:, ~good] = np.inf
            size = np.abs(step).max(axis=0) / (1e-9 * w + np.abs(q / unit).max(axis=0))
            q = q + np.where(np.isfinite(step), step, 0.0) * unit
            if np.all(size < 1e-13):
                break
        upright = np.abs(self.p["theta0"] + q[2]) < np.pi / 2
        return q, (size < 1e-9) & upright & (self.depths(q) > 0.0).any(axis=0)

    def energy(self, q: np.ndarray) -> np.ndarray:
        """Potential of springs, load and contact (of the integral law)."""
        p = self.p
        here = self.corners(q)
        rest = self.corners(0.0 * q)
        total = p["F_n"] * q[1]
        for i, (k, L, side) in enumerate(((p["k1"], p["L1"], 1), (p["k2"], p["L2"], -1))):
            a = p["alpha1"] if i == 0 else p["alpha2"]
            fixed = rest[i] + L * np.array([side * np.cos(a), np.sin(a)])
            total = total + k / 2 * (np.hypot(*(here[i] - fixed)) - L) ** 2
        depth = np.maximum(self.depths(q), 0.0)
        if self.model == "B1":
            return total + p["k3"] / 2 * depth[0] ** 2 + p["k4"] / 2 * depth[1] ** 2
        s = (np.arange(400) + 0.5)[:, None] / 400
        pl, pt = self.depths(q)
        return total + p["k_c"] / 2 * (np.maximum(pl + s * (pt - pl), 0.0) ** 2).mean(axis=0)

    def reaction(self, q: np.ndarray) -> np.ndarray:
        """Rn (n,) at q (3, n)."""
        f = self.loads(q, 0.0, self.depths(q) > 0.0) - self.spring_loads(q)
        return np.asarray(f[1] + self.p["F_n"])

    def admissible(self, q: np.ndarray) -> np.ndarray:
        """Where q (3, n) tilts by 0.2 rad, travels by half of the shortest length and presses with
        ten times the load at most; the load is F_n, or what presses in the initial position."""
        p = self.p
        lengths = np.minimum(p["w"], np.minimum(p["L1"], p["L2"]))
        load = np.maximum(p["F_n"], self.reaction(0.0 * q))
        level = np.abs(p["theta0"] + q[2]) <= 0.2
        near = np.hypot(q[0], q[1]) <= 0.5 * lengths
        with np.errstate(invalid="ignore"):
            return np.asarray(level & near & (self.reaction(q) <= 10.0 * load))


def literal(scene: Scene, changes: dict[str, np.ndarray], n: int) -> Literal:
    """The equations of a scene with some parameters replaced."""
    values = {k: np.broadcast_to(v, n) for k, v in scene.pad.given().items()}
    C = None
    if scene.damping is not None:
        C = np.broadcast_to(np.array(scene.damping.matrix), (n, 3, 3))
    if "I" in scene.pad.derived:
        changed = values | changes
        m = changed["m"]
        w = changed["w"]
        h = changed["h"]
        values["I"] = m * (w**2 + h**2) / 3
    return Literal(scene.model, values | changes, scene.formulation, C)


def frictionless(eqs: Literal, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where n pads rest at mu = 0: places (3, n), where there are any, and where it is a choice.

    Of several places the admissible ones (`Literal.admissible`) go before others, then the least
    potential decides, as docs/trust.md has it. It is a choice where several are there of which
    none is admissible: which of them a search meets is then no property of the pad.
    """
    random = np.random.default_rng(0)
    p = eqs.p
    stiff = p["k1"] + p["k2"] + (p["k3"] + p["k4"] if eqs.model == "B1" else p["k_c"])
    size = p["F_n"] / stiff + abs(p["y0"]) + 1e-9 * p["w"]
    best = np.zeros((3, n))
    least = np.full(n, np.inf)
    most = np.full(n, -np.inf)
    meant = np.zeros(n, dtype=bool)
    for start in range(STARTS):
        q = random.normal(size=(3, n))
        if start == 0:
            q *= 0.0
        else:
            q *= 0.3 * p["w"] if start % 3 == 2 else 3.0 * size
        q[2] /= p["w"]
        found, good = eqs.newton(q, 0.0, 40)
        energy = np.where(good, eqs.energy(found), np.inf)
        most = np.maximum(most, np.where(good, energy, -np.inf))
        fits = good & eqs.admissible(found)
        lower = energy < least - 1e-9 * np.where(np.isfinite(least), np.abs(least), 0.0)
        better = (fits & ~meant) | ((fits == meant) & lower)
        best[:, better] = found[:, better]
        least[better] = energy[better]
        meant[better] = fits[better]
    there = np.isfinite(least)
    several = there & (most - np.where(there, least, 0.0) > 1e-6 * np.abs(most))
    return best, there, several & ~meant
