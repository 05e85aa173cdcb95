"""Eigenvalues of stacks of small systems against `numpy.linalg.eigvals` by hand, in one run.

`OPENBLAS_NUM_THREADS=1 python -m benchmarks.stacks` prints our processor time over that of a
batched companion matrix [[0, 1], [-M^-1 K, -M^-1 C]], which is neither sorted nor checked: medians
of runs by turns. M is one for all systems, diagonal of each its own, or full and each its own.
"""

import time
from collections.abc import Callable

import numpy as np

from squeal.linear import stack_eigenvalues

ROWS = (2, 3, 5, 10, 30)
COUNTS = (1, 2, 5, 20, 100, 1000)
LEAST, SECONDS = 7, 0.5  # runs, and seconds for which more are made

Array = np.ndarray


def by_hand(M: Array, C: Array | None, K: Array) -> Array:
    """What a user would write."""
    n = K.shape[-1]
    state = np.zeros((len(K), 2 * n, 2 * n))
    state[:, :n, n:] = np.eye(n)
    if C is None:
        state[:, n:, :n] = -np.linalg.solve(M, K)
    else:
        state[:, n:] = -np.linalg.solve(M, np.concatenate([K, C], axis=-1))
    return np.asarray(np.linalg.eigvals(state))


def stacks(n: int, count: int) -> tuple[dict[str, Array], Array, Array]:
    """Masses by kind, C and K of random systems with some friction."""
    rng = np.random.default_rng(n)
    F, G, H, friction = rng.normal(size=(4, count, n, n))
    full = F @ F.swapaxes(1, 2) / n + np.eye(n)
    masses = {"shared": full[0], "diagonal": full * np.eye(n), "full": full}
    K = 1e6 * (G @ G.swapaxes(1, 2) + n * np.eye(n) + 0.3 * friction)
    return masses, 5.0 * (H @ H.swapaxes(1, 2)), K


def ratio(ours: Callable[[], Array], theirs: Callable[[], Array]) -> float:
    """Median time of ours over that of theirs."""
    times: list[list[float]] = []
    begun = time.perf_counter()
    while len(times) < LEAST or time.perf_counter() - begun < SECONDS:
        stops = [time.process_time()]
        for task in (ours, theirs):
            task()
            stops.append(time.process_time())
        times.append(np.diff(stops).tolist())
    mine, other = np.median(times, axis=0)
    return float(mine / other)


def main() -> None:
    """Print a line for each size of system and stack."""
    kinds = ("shared", "diagonal", "full")
    print("rows systems  damped: " + " ".join(f"{k:>8}" for k in kinds) + "  undamped: shared")
    for n in ROWS:
        for count in COUNTS:
            masses, C, K = stacks(n, count)
            pairs = [(masses[kind], C) for kind in kinds] + [(masses["shared"], None)]
            found = [
                ratio(lambda: stack_eigenvalues(M, C, K), lambda: by_hand(M, C, K))  # noqa: B023
                for M, C in pairs
            ]
            shown = " ".join(f"{r:8.2f}" for r in found[:3])
            print(f"{n:4d} {count:7d}          {shown}           {found[3]:8.2f}", flush=True)


if __name__ == "__main__":
    main()
