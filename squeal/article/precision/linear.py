"""Error against run time on the linear side: eigenvalues of a sweep of mu, and its threshold.

The truth has more digits. Other libraries find a threshold as their user would: they look for
growth at equal steps of mu and then halve the interval, each time with the eigenvalues of one
matrix.
"""

import itertools
from collections.abc import Callable
from functools import partial

import numpy as np

from squeal.article.literature.comparison import literature_system
from squeal.article.precision.measure import timed
from squeal.article.results.precision import Timing
from squeal.io.scene import Scene
from squeal.io.short_form import PlainSystem
from squeal.linear import complex_eigenvalues, critical_points
from squeal.model.linear import about_origin

POINTS = 100
DIGITS = 30  # of the truth
HALVINGS = (0, 8, 16, 24, 32, 40)
GROWING = 1e-7  # real part over spectral radius; a double root has some sqrt(eps)

Program = Callable[[np.ndarray, np.ndarray], np.ndarray]


def _with_vectors(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    return np.array([complex_eigenvalues(M, None, one).values for one in K])


def _with_numpy(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    n = len(M)
    A = np.zeros((len(K), 2 * n, 2 * n))
    A[:, :n, n:] = np.eye(n)
    A[:, n:, :n] = -np.linalg.solve(M, K)
    return np.asarray(np.linalg.eigvals(A))


def _with_control(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    import control

    n = len(M)
    zero, unit = np.zeros((n, n)), np.eye(n)
    found = []
    for one in K:
        A = np.block([[zero, unit], [-np.linalg.solve(M, one), zero]])
        found.append(control.ss(A, np.zeros((2 * n, 1)), np.zeros((1, 2 * n)), 0).poles())
    return np.array(found)


PEERS: dict[str, Program] = {
    "numpy.linalg.eigvals": _with_numpy,
    "control.ss().poles()": _with_control,
}
PROGRAMS: dict[str, Program] = {
    "squeal.complex_eigenvalues": _with_vectors,
    **PEERS,
}


def exact_values(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Eigenvalues (n, 6) from `DIGITS` digits, as doubles."""
    import mpmath as mp

    rows = []
    with mp.workdps(DIGITS):
        inverse = mp.matrix(M.tolist()) ** -1
        for one in K:
            squares = mp.eig(inverse * mp.matrix(one.tolist()), left=False, right=False)
            roots = [mp.sqrt(-s) for s in squares]
            rows.append([complex(sign * r) for r in roots for sign in (1, -1)])
    return np.array(rows)


def exact_coalescence(system: PlainSystem, near: float) -> float:
    """The mu near a guess at which two frequencies coalesce: the discriminant's root."""
    import mpmath as mp

    with mp.workdps(DIGITS):
        inverse = mp.matrix(system.M.tolist()) ** -1
        A0, A1 = (inverse * mp.matrix(K.tolist()) for K in system.K)

        def discriminant(mu: object) -> object:
            s = mp.eig(A0 + mu * A1, left=False, right=False)
            return mp.re(mp.fprod((a - b) ** 2 for a, b in itertools.combinations(s, 2)))

        return float(mp.findroot(discriminant, (near * (1 - 1e-6), near * (1 + 1e-6))))


def distance(found: np.ndarray, exact: np.ndarray) -> float:
    """Greatest distance of paired eigenvalues over all rows, relative to the spectral radius."""
    from scipy.optimize import linear_sum_assignment

    worst = 0.0
    for a, b in zip(found, exact, strict=True):
        apart = np.abs(a[:, None] - b[None, :])
        worst = max(worst, float(apart[linear_sum_assignment(apart)].max() / np.abs(b).max()))
    return worst


def by_halving(system: PlainSystem, program: Program, halvings: int) -> float:
    """The first mu in (0, 1) with growth, seen on a grid and then halved; NaN if there is none."""

    def grows(mus: np.ndarray) -> np.ndarray:
        values = program(system.M, system.K[0] + mus[:, None, None] * system.K[1])
        return np.asarray(values.real.max(axis=1) > GROWING * np.abs(values).max(axis=1))

    mus = np.linspace(0.0, 1.0, POINTS + 1)
    seen = np.flatnonzero(grows(mus))
    if not len(seen) or seen[0] == 0:
        return np.nan
    low, high = mus[seen[0] - 1], mus[seen[0]]
    for _ in range(halvings):
        middle = (low + high) / 2
        low, high = (low, middle) if grows(np.array([middle]))[0] else (middle, high)
    return float(low + high) / 2


def sweep_timings(scene: Scene) -> list[Timing]:
    """The programs on the matrices of a B3 scene for mu from 0 to 1; time of one matrix."""
    found = [
        about_origin(scene.pad_model.replace(mu=mu))
        for mu in np.linspace(0.0, 1.0, POINTS).tolist()
    ]
    M, K = found[0].M, np.array([one.K for one in found])
    exact = exact_values(M, K)
    timings = []
    for name, program in PROGRAMS.items():
        program(M, K[:1])  # imports
        values, seconds = timed(partial(program, M, K))
        timings.append(Timing("sweep", name, POINTS, distance(values, exact), seconds / POINTS))
    return timings


def threshold_timings() -> list[Timing]:
    """The threshold of the literature's two coupled modes by our search and by halving."""
    system = literature_system("mode_coupling")
    mu, seconds = timed(lambda: critical_points(system, 1.0)[0].mu)
    exact = exact_coalescence(system, mu)
    timings = [Timing("threshold", "squeal", 0, abs(mu - exact), seconds)]
    for name, program in PEERS.items():
        for halvings in HALVINGS:
            mu, seconds = timed(partial(by_halving, system, program, halvings))
            timings.append(Timing("threshold", name, halvings, abs(mu - exact), seconds))
    return timings
