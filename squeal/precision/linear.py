"""Error against run time of eigenvalues: a sweep of mu by three programs, against 30 digits."""

from __future__ import annotations

import statistics
import time as clock
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from squeal.linear import about_origin
from squeal.scene import Scene
from squeal.stability import complex_eigenvalues

POINTS = 100
REPEATS = 5


@dataclass(frozen=True)
class Timing:
    """Greatest error of a program, relative to the spectral radius, and its time for a matrix."""

    program: str
    error: float
    seconds: float


def _with_squeal(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    return np.array([complex_eigenvalues(M, None, one).values for one in K])


def _with_numpy(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    n = len(K)
    A = np.zeros((n, 6, 6))
    A[:, :3, 3:] = np.eye(3)
    A[:, 3:, :3] = -np.linalg.solve(M, K)
    return np.asarray(np.linalg.eigvals(A))


def _with_control(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    import control

    zero, unit = np.zeros((3, 3)), np.eye(3)
    found = []
    for one in K:
        A = np.block([[zero, unit], [-np.linalg.solve(M, one), zero]])
        found.append(control.ss(A, np.zeros((6, 1)), np.zeros((1, 6)), 0).poles())
    return np.array(found)


PROGRAMS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "squeal": _with_squeal,
    "numpy.linalg.eigvals": _with_numpy,
    "control.ss().poles()": _with_control,
}


def exact_values(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Eigenvalues (n, 6) from 30 digits, as doubles."""
    import mpmath as mp

    rows = []
    with mp.workdps(30):
        inverse = mp.matrix(M.tolist()) ** -1
        for one in K:
            squares = mp.eig(inverse * mp.matrix(one.tolist()), left=False, right=False)
            roots = [mp.sqrt(-s) for s in squares]
            rows.append([complex(sign * r) for r in roots for sign in (1, -1)])
    return np.array(rows)


def distance(found: np.ndarray, exact: np.ndarray) -> float:
    """Greatest distance of paired eigenvalues over all rows, relative to the spectral radius."""
    from scipy.optimize import linear_sum_assignment

    worst = 0.0
    for a, b in zip(found, exact, strict=True):
        apart = np.abs(a[:, None] - b[None, :])
        worst = max(worst, float(apart[linear_sum_assignment(apart)].max() / np.abs(b).max()))
    return worst


def sweep_timings(scene: Scene) -> list[Timing]:
    """The programs on the matrices of a B3 scene for mu from 0 to 1."""
    found = [
        about_origin(scene.pad.replace(mu=mu), scene.formulation)
        for mu in np.linspace(0.0, 1.0, POINTS).tolist()
    ]
    M, K = found[0].M, np.array([one.K for one in found])
    exact = exact_values(M, K)
    timings = []
    for name, program in PROGRAMS.items():
        spent = []
        for _ in range(REPEATS):
            begun = clock.perf_counter()
            values = program(M, K)
            spent.append((clock.perf_counter() - begun) / POINTS)
        timings.append(Timing(name, distance(values, exact), statistics.median(spent)))
    return timings
