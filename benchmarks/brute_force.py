"""Maps and thresholds against brute force from the equations alone, in plain double precision.

`python -m benchmarks.brute_force [--points 2304] [--pads 100]` writes out Eqs. (1)-(20) once more,
walks mu in small steps from the frictionless equilibrium, takes dense eigenvalues at every step and
prints each map point and each crossing of the imaginary axis in which the toolkit differs. Model B1
and B2 in all formulations take part, half of them damped, in maps over the angles and over two
other parameters, and pads that have crossings. Nothing of the toolkit takes part in the brute force
but the numbers of the scenes.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections import Counter
from typing import Any

import numpy as np

from benchmarks.literal import Literal, frictionless, literal, part, together
from squeal.analysis.maps import NAMES, Axis, stability_map
from squeal.analysis.pads import critical_friction
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.model.contact import Formulation
from tests.conftest import random_pad

STEPS = 400  # of mu from 0 to its end
NOISE = 3e-7  # of the spectral radius: real parts below are rounding near a double root
MU_MAX = 1.5
CANDIDATES = 6  # pads tried for each that is wanted, since not all have crossings
FINE = 40  # finer steps within a step of mu in which something changes


def spectra(eqs: Literal, q: np.ndarray, mu: Any) -> np.ndarray:
    """The six eigenvalues (n, 6) about q (3, n)."""
    _, J = eqs.slopes(q, mu)
    p, n = eqs.p, q.shape[1]
    mass = np.array([np.broadcast_to(v, n) for v in (p["m"], p["m"], p["I"])]).T
    if eqs.C is None:
        roots = np.sqrt(np.linalg.eigvals(J / mass[:, :, None]).astype(complex))
        return np.concatenate([roots, -roots], axis=1)
    A = np.zeros((n, 6, 6))
    A[:, :3, 3:] = np.eye(3)
    A[:, 3:, :3], A[:, 3:, 3:] = J / mass[:, :, None], -eqs.C / mass[:, :, None]
    return np.linalg.eigvals(A)


def judged(values: np.ndarray, damped: bool) -> tuple[np.ndarray, np.ndarray]:
    """Verdict names (n,), and the numbers (2, n) of growing pairs and growing real eigenvalues."""
    size = np.abs(values).max(axis=-1, keepdims=True)
    # without damping a real part next to a double root is the square root of rounding
    grows = values.real > (1e-10 if damped else NOISE) * size
    real = np.abs(values.imag) <= 1e-7 * size
    rate = np.where(grows, values.real, 0.0)
    flutter, diverging = (np.where(which, rate, 0.0).max(axis=-1) for which in (~real, real))
    quiet = "stable" if damped else "marginal"
    names = np.where(flutter > diverging, "flutter", np.where(diverging > 0, "divergence", quiet))
    counts = np.array([(grows & ~real).sum(axis=-1) // 2, (grows & real).sum(axis=-1)])
    return names, counts


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


def map_differences(scene: Scene, axes: tuple[Axis, Axis]) -> tuple[int, int, list[str]]:
    """How many points of a map were compared, and those in which brute force differs.

    Between them: how many others differ where no place of rest without friction is admissible, so
    that the branch to follow is a choice (the sign of Eq. 21 only), and the map warns of the point.
    """
    found = stability_map(scene, axes)
    grid = np.meshgrid(axes[0].values, axes[1].values, indexing="ij")
    changes = {axis.name: values.ravel() for axis, values in zip(axes, grid, strict=True)}
    n = grid[0].size
    eqs = literal(scene, changes, n)
    q, good, choice = frictionless(eqs, n)
    end = np.broadcast_to(eqs.p["mu"], n)
    path = walk(eqs, q, good, np.linspace(0.0, 1.0, STEPS + 1)[:, None] * end)
    there = np.isfinite(path[-1]).all(axis=0)
    names = np.full(n, "beyond a fold", dtype=object)
    values = spectra(part(eqs, there), path[-1][:, there], end[there])
    names[there], _ = judged(values, scene.damping is not None)
    ours = np.array(NAMES, dtype=object)[found.codes.ravel()]
    warned = choice & (found.admissible is not None and ~found.admissible.ravel())
    rows = [
        f"{axes[0].name} = {grid[0].flat[i]:.6g}, {axes[1].name} = {grid[1].flat[i]:.6g}: "
        f"map {ours[i]}, brute force {names[i]}"
        for i in np.flatnonzero((ours != names) & ~warned)
    ]
    return n, int(((ours != names) & warned).sum()), rows


Bracket = tuple[float, float, str, int]


def changes_along(scenes: list[Scene], mu_max: float) -> tuple[list[list[Bracket]], np.ndarray]:
    """Brackets (low, high, kind, up or down) of all crossings of each pad, and where it ends.

    A step of mu in which a count changes is walked again in FINE parts; changes that stay within
    one of these are brackets.
    """
    eqs, n = together(scenes), len(scenes)
    q, good, _ = frictionless(eqs, n)
    mus = np.linspace(0.0, mu_max, STEPS + 1)
    path = walk(eqs, q, good, np.broadcast_to(mus[:, None], (len(mus), n)))

    def counts(places: np.ndarray, mu: np.ndarray, who: np.ndarray) -> np.ndarray:
        """(2, m, n) along places (m, 3, n), -1 where there is none."""
        found = np.full((2, *mu.shape), -1)
        for i, place in enumerate(places):
            on = np.flatnonzero(np.isfinite(place).all(axis=0))
            if on.size:
                values = spectra(part(eqs, who[on]), place[:, on], mu[i, on])
                found[:, i, on] = judged(values, eqs.C is not None)[1]
        return found

    every = np.arange(n)
    coarse = counts(path, np.broadcast_to(mus[:, None], (len(mus), n)), every)
    both = (coarse[:, 1:] >= 0).all(axis=0)
    steps, pads = np.nonzero((coarse[:, 1:] != coarse[:, :-1]).any(axis=0) & both)
    inner = mus[steps] + (mus[1] - mus[0]) * np.linspace(0.0, 1.0, FINE + 1)[:, None]
    start = path[steps, :, pads].T
    places = walk(part(eqs, pads), start, np.ones(len(pads), dtype=bool), inner)
    fine = counts(places, inner, pads)
    brackets: list[list[Bracket]] = [[] for _ in scenes]
    for k, pad in enumerate(pads):
        for j in range(FINE):
            pairs, reals = fine[:, j + 1, k] - fine[:, j, k]
            if 2 * pairs + reals == 0:  # a growing pair becomes two real ones: not at the axis
                continue
            for kind, a, b in zip(("flutter", "divergence"), *fine[:, j : j + 2, k].T, strict=True):
                if min(fine[:, j : j + 2, k].ravel()) >= 0:
                    one = (float(inner[j, k]), float(inner[j + 1, k]), kind, 1 if b > a else -1)
                    brackets[pad] += [one] * abs(int(b) - int(a))
    on = np.isfinite(path).all(axis=1)
    last = np.where(on.all(axis=0), len(mus) - 1, np.argmin(on, axis=0) - 1)
    return brackets, mus[np.maximum(last, 0)]


def threshold_differences(
    scene: Scene, mu_max: float, brackets: list[Bracket], end: float
) -> list[str]:
    """The crossings of one pad that only brute force or only the toolkit has."""
    found = critical_friction(scene, mu_max)
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
    return rows


FORMS: list[tuple[str, Formulation]] = [
    ("B1", Formulation()),
    *(
        ("B2", Formulation(*choice))  # type: ignore[arg-type]
        for choice in itertools.product(("integral", "mean"), ("centre", "frame"), ("+", "-"))
    ),
]


def scene_of(kind: int, seed: int, damped: bool) -> Scene:
    """A random pad of one of `FORMS`; damping in proportion to mass and to a stiffness of one."""
    model, form = FORMS[kind]
    pad = random_pad(1000 + seed, model)
    a, b = np.random.default_rng([seed, 7]).uniform(1e-3, 2e-2, 2)
    C = np.diag([a * pad.m + b, a * pad.m + b, a * pad.I + b])
    damping = Damping(matrix=tuple(map(tuple, C.tolist()))) if damped else None
    return Scene(model, pad, form, damping=damping)


def maps(points: int) -> list[tuple[Scene, tuple[Axis, Axis]]]:
    """Maps of all formulations, over the angles and over two other parameters, damped or not."""
    n = math.ceil(math.sqrt(points / (2 * len(FORMS))))
    pairs = [("mu", 0.0, 1.0), ("h", 0.1, 1.0), ("k2", 0.2, 3.0), ("F_n", 1e-4, 1e-2)]
    found = []
    for kind in range(len(FORMS)):
        free = (0.05, math.pi - 0.05)
        angles = Axis("alpha1", *free, n), Axis("alpha2", *free, n)
        found.append((scene_of(kind, kind, bool(kind % 2)), angles))
        first, second = pairs[kind % 4], pairs[(kind + 1) % 4]
        others = Axis(*first, n), Axis(*second, n)
        found.append((scene_of(kind, 20 + kind, not kind % 2), others))
    return found


def main() -> None:
    """Print what differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=2304)
    parser.add_argument("--pads", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    total, rows = Counter[str](), []
    for scene, axes in maps(given.points):
        count, chosen, differ = map_differences(scene, axes)
        total.update({"points": count, "chosen": chosen})
        name = f"map {axes[0].name} x {axes[1].name}, {scene.model} {scene.formulation}"
        rows += [f"{name}, {'damped' if scene.damping else 'undamped'}: {row}" for row in differ]
        print(f"{name}: {len(differ)} of {count} differ", file=sys.stderr, flush=True)
    for kind, damped in itertools.product(range(len(FORMS)), (False, True)):
        wanted = math.ceil(given.pads / (2 * len(FORMS)))
        seeds = range(100 * given.seed, 100 * given.seed + CANDIDATES * wanted)
        scenes = [scene_of(kind, seed, damped) for seed in seeds]
        brackets, ends = changes_along(scenes, MU_MAX)
        crossing = [i for i, found in enumerate(brackets) if found][:wanted]
        for i in crossing:
            try:
                differ = threshold_differences(scenes[i], MU_MAX, brackets[i], float(ends[i]))
            except ComputationError as error:
                differ = [str(error)]
            ways = Counter(way for *_, way in brackets[i])
            total.update({"pads": 1, "up": ways[1], "down": ways[-1]})
            name = f"pad {seeds[i]}, {scenes[i].model} {scenes[i].formulation}"
            rows += [f"{name}, {'damped' if damped else 'undamped'}: {row}" for row in differ]
        print(f"{FORMS[kind]}: {len(crossing)} pads", file=sys.stderr, flush=True)
    print(
        f"{total['points']} map points ({total['chosen']} differ where the map warns that no place "
        f"of rest is admissible); {total['pads']} pads with {total['up']} crossings upwards "
        f"and {total['down']} downwards"
    )
    print("\n".join(rows) or "no difference")


if __name__ == "__main__":
    main()
