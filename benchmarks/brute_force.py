"""Maps and thresholds against brute force from the equations alone, in plain double precision.

`python -m benchmarks.brute_force [--points 2304] [--pads 100]` writes out Eqs. (1)-(20) once more,
walks mu in small steps from the frictionless equilibrium, takes dense eigenvalues at every step and
prints each map point and each crossing of the imaginary axis in which the toolkit differs. Nothing
of the toolkit takes part in the brute force but the numbers of the scenes.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from squeal.analysis.critical import critical_friction
from squeal.analysis.maps import Axis, stability_map
from squeal.errors import ComputationError
from squeal.model.contact import Formulation
from squeal.scene import Scene
from tests.conftest import random_pad

STEPS = 400  # of mu from 0 to its end
STARTS = 60  # places from which the frictionless equilibrium is sought
NOISE = 3e-7  # of the spectral radius: real parts below are rounding near a double root
FINE = 40  # finer steps within a step of mu in which something changes


@dataclass(frozen=True)
class Literal:
    """The equations of n pads: every number an array (n,) or a plain one."""

    model: str
    p: dict[str, Any]
    form: Formulation

    def corners(self, q: np.ndarray) -> list[np.ndarray]:
        """r1, r2 and the lower corners, each (2, n), in the fixed frame; last the mass centre."""
        p, t = self.p, self.p["theta0"] + q[2]
        centre = np.array([p["x0"] + q[0], p["y0"] + q[1]])
        c, s = np.cos(t), np.sin(t)
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
        p, here, rest = self.p, self.corners(q), self.corners(0.0 * q)
        a1, a2 = p["alpha1"], p["alpha2"]
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
        p, here = self.p, self.corners(q)
        fx, fy, moment = self.spring_loads(q)
        depth = self.depths(q)
        if self.model == "B1":
            for edge, k in enumerate((p["k3"], p["k4"])):
                N = np.where(touching[edge], k * depth[edge], 0.0)
                arm = here[2 + edge] - here[4]
                fx, fy = fx + mu * N, fy + N
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
            area, first = area + pressure, first + pressure * place
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
        columns = [
            self.loads(q + 1e-30j * np.eye(3)[i][:, None], mu, touching).imag / 1e-30
            for i in range(3)
        ]
        return self.loads(q, mu, touching), np.moveaxis(np.array(columns), 0, -1).transpose(1, 0, 2)

    def newton(self, q: np.ndarray, mu: Any, rounds: int) -> tuple[np.ndarray, np.ndarray]:
        """Equilibria near q (3, n), and where they were found."""
        q, w = q.copy(), self.p["w"]
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
        upright = np.abs(self.p["theta0"] + q[2]) < np.pi / 2
        return q, (size < 1e-9) & upright & (self.depths(q) > 0.0).any(axis=0)

    def energy(self, q: np.ndarray) -> np.ndarray:
        """Potential of springs, load and contact (of the integral law)."""
        p, here, rest = self.p, self.corners(q), self.corners(0.0 * q)
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


def literal(scene: Scene, changes: dict[str, np.ndarray], n: int) -> Literal:
    """The equations of a scene with some parameters replaced."""
    values = {k: np.broadcast_to(v, n) for k, v in vars(scene.pad).items() if v is not None}
    return Literal(scene.model, values | changes, scene.formulation)


def part(eqs: Literal, chosen: np.ndarray) -> Literal:
    """Some of n pads."""
    return Literal(eqs.model, {k: v[chosen] for k, v in eqs.p.items()}, eqs.form)


def frictionless(eqs: Literal, n: int) -> tuple[np.ndarray, np.ndarray]:
    """The equilibrium (3, n) of least potential at mu = 0, and where there is one."""
    random = np.random.default_rng(0)
    p = eqs.p
    stiff = p["k1"] + p["k2"] + (p["k3"] + p["k4"] if eqs.model == "B1" else p["k_c"])
    size = p["F_n"] / stiff + abs(p["y0"]) + 1e-9 * p["w"]
    best, least = np.zeros((3, n)), np.full(n, np.inf)
    for start in range(STARTS):
        wide = start % 3 == 2
        q = random.normal(size=(3, n)) * (0.3 * p["w"] if wide else 3.0 * size) * (start > 0)
        q[2] /= p["w"]
        found, good = eqs.newton(q, 0.0, 40)
        energy = np.where(good, eqs.energy(found), np.inf)
        better = energy < least - 1e-9 * np.where(np.isfinite(least), np.abs(least), 0.0)
        best[:, better], least[better] = found[:, better], energy[better]
    return best, np.isfinite(least)


def squares(eqs: Literal, q: np.ndarray, mu: Any) -> np.ndarray:
    """The roots s = -lambda^2, (n, 3)."""
    _, J = eqs.slopes(q, mu)
    p, n = eqs.p, q.shape[1]
    mass = np.array([np.broadcast_to(v, n) for v in (p["m"], p["m"], p["I"])]).T
    return np.linalg.eigvals(-J / mass[:, :, None]).astype(complex)


def judged(s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Verdict names (n,), numbers of complex pairs and of negative roots in s (n, 3)."""
    size = np.abs(s).max(axis=-1, keepdims=True)
    pair = np.abs(s.imag) > math.sqrt(NOISE) * size * 0.02
    negative = ~pair & (s.real < -NOISE * size)
    growth = np.abs(np.sqrt(-s).real)
    flutter = np.where(pair, growth, 0.0).max(axis=-1)
    diverging = np.where(negative, growth, 0.0).max(axis=-1)
    names = np.where(
        flutter > diverging, "flutter", np.where(diverging > 0, "divergence", "marginal")
    )
    return names, pair.sum(axis=-1) // 2, negative.sum(axis=-1)


def walk(eqs: Literal, q: np.ndarray, good: np.ndarray, mus: np.ndarray) -> np.ndarray:
    """Equilibria along mus (m, n), shape (m, 3, n); NaN from where the branch is lost on."""
    path = np.full((len(mus), 3, q.shape[1]), np.nan)
    path[0][:, good] = q[:, good]
    w = eqs.p["w"]
    for i in range(1, len(mus)):
        on = np.flatnonzero(np.isfinite(path[i - 1]).all(axis=0))
        if not on.size:
            break
        own = part(eqs, on)
        before = path[i - 1][:, on]
        ahead = before
        if i > 1:
            ahead = 2 * before - path[i - 2][:, on]
        found, there = own.newton(ahead, mus[i, on], 12)
        jump = np.abs(found - before)
        jump[2] *= w[on]
        span = np.abs(before).max(axis=0) + np.abs(own.p["F_n"]) / own.p["k1"]
        there &= jump.max(axis=0) < span
        path[i][:, on[there]] = found[:, there]
    return path


def map_differences(scene: Scene, axes: tuple[Axis, Axis]) -> tuple[int, list[str]]:
    """How many points of a map were compared, and those in which brute force differs clearly."""
    found = stability_map(scene, axes)
    from squeal.analysis.maps import NAMES

    grid = np.meshgrid(axes[0].values, axes[1].values, indexing="ij")
    changes = {axis.name: values.ravel() for axis, values in zip(axes, grid, strict=True)}
    n = grid[0].size
    eqs = literal(scene, changes, n)
    q, good = frictionless(eqs, n)
    end = np.broadcast_to(eqs.p["mu"], n)
    path = walk(eqs, q, good, np.linspace(0.0, 1.0, STEPS + 1)[:, None] * end)
    there = np.isfinite(path[-1]).all(axis=0)
    names = np.full(n, "beyond a fold", dtype=object)
    s = squares(part(eqs, there), path[-1][:, there], end[there])
    names[there], _, _ = judged(s)
    ours = np.array(NAMES, dtype=object)[found.codes.ravel()]
    other = np.flatnonzero(ours != names)
    rows = [
        f"{axes[0].name} = {grid[0].flat[i]:.6g}, {axes[1].name} = {grid[1].flat[i]:.6g}: "
        f"map {ours[i]}, brute force {names[i]}"
        for i in other
    ]
    return n, rows


def changes_along(scene: Scene, mu_max: float) -> tuple[list[tuple[float, float, str, int]], float]:
    """Brackets (low, high, kind, up or down) of all crossings along the branch, and where it ends.

    A step of mu in which a count changes is walked again in FINE parts; changes that stay within
    one of these are brackets.
    """
    eqs = literal(scene, {}, 1)
    q, good = frictionless(eqs, 1)
    mus = np.linspace(0.0, mu_max, STEPS + 1)
    path = walk(eqs, q, good, mus[:, None])[:, :, 0]
    on = np.isfinite(path).all(axis=1)
    last = int(np.argmin(on)) - 1 if not on.all() else len(mus) - 1
    brackets = []

    def counts(q: np.ndarray, mu: float) -> tuple[int, int]:
        _, pairs, negative = judged(squares(eqs, q[:, None], mu))
        return int(pairs[0]), int(negative[0])

    before = counts(path[0], 0.0)
    for i in range(1, last + 1):
        now = counts(path[i], mus[i])
        if now != before:
            inner = np.linspace(mus[i - 1], mus[i], FINE + 1)
            places = walk(eqs, path[i - 1][:, None], np.array([True]), inner[:, None])[:, :, 0]
            at = before
            for low, high, place in zip(inner, inner[1:], places[1:], strict=False):
                if not np.isfinite(place).all():
                    break
                new = counts(place, high)
                for kind, a, b in zip(("flutter", "divergence"), at, new, strict=True):
                    brackets += [(low, high, kind, 1 if b > a else -1)] * abs(b - a)
                at = new
        before = now
    return brackets, float(mus[last])


def threshold_differences(scene: Scene, mu_max: float) -> tuple[int, list[str]]:
    """Crossings compared for one pad, and those that only one side has."""
    try:
        found = critical_friction(scene, mu_max)
    except ComputationError:
        return 0, []
    brackets, end = changes_along(scene, mu_max)
    rows = []
    left = [c for c in found.crossings if c.mu <= end]
    for low, high, kind, way in brackets:
        width = high - low
        near = [
            c
            for c in left
            if low - width <= c.mu <= high + width
            and c.kind == kind
            and (c.direction == "up") == (way > 0)
        ]
        if near:
            left.remove(near[0])
        else:
            rows.append(f"missed: {kind} {way:+d} between {low:.6g} and {high:.6g}")
    rows += [f"made up: {c.kind} {c.direction} at {c.mu:.9g}" for c in left if c.mu < end * 0.999]
    return len(brackets), rows


def scene_of(seed: int) -> Scene:
    """A random pad of B1, or of B2 in one of the formulations."""
    r = np.random.default_rng([seed, 7])
    if seed % 2:
        return Scene("B1", random_pad(1000 + seed, "B1"))
    forms = list(itertools.product(("integral", "mean"), ("centre", "frame"), ("+", "-")))
    form: Any = forms[0] if seed % 4 else forms[int(r.integers(8))]
    return Scene("B2", random_pad(1000 + seed, "B2"), Formulation(*form))


def main() -> None:
    """Print what differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=2304)
    parser.add_argument("--pads", type=int, default=100)
    given = parser.parse_args()
    n = math.ceil(math.sqrt(given.points / 4))
    total, rows = Counter[str](), []
    for seed in range(4):
        scene = scene_of(seed)
        free = (0.05, math.pi - 0.05)
        axes = (Axis("alpha1", *free, n), Axis("alpha2", *free, n))
        if seed >= 2:
            axes = (Axis("mu", 0.0, 1.0, n), Axis("h", 0.1, 1.0, n))
        count, differ = map_differences(scene, axes)
        total["points"] += count
        rows += [f"map {seed}, {scene.model}: {row}" for row in differ]
    for seed in range(given.pads):
        scene = scene_of(seed)
        count, differ = threshold_differences(scene, 1.0)
        total["crossings"] += count
        rows += [f"pad {seed}, {scene.model}: {row}" for row in differ]
    print(f"{total['points']} map points and {total['crossings']} crossings of {given.pads} pads")
    print("\n".join(rows) or "no difference")


if __name__ == "__main__":
    main()
