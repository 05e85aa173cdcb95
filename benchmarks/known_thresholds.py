"""1000 random systems of 2 to 200 degrees of freedom with known thresholds: all found, none more.

`python -m benchmarks.known_thresholds [COUNT [LARGEST]]` prints a line for each system that is not
met exactly, and at the end the numbers and the CPU seconds.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from squeal.linear import thresholds
from tests.known import known_system

CLOSE = 1e-8  # relative distance of a threshold that counts as found


def judged(seed: int, largest: int) -> tuple[int, int, int, int, bool, float]:
    """Rows, thresholds, missed, invented, whether it is certified, CPU seconds."""
    rng = np.random.default_rng([seed, largest])
    n = int(np.exp(rng.uniform(np.log(2), np.log(largest + 1))))
    system, expected = known_system(n, rng, damped=bool(seed % 2))
    start = time.process_time()
    found = thresholds(system, 2.0)
    seconds = time.process_time() - start
    left = list(found.crossings)
    missed = 0
    for mu, kind, direction, _ in expected:
        near = [c for c in left if (c.kind, c.direction) == (kind, direction)]
        near = [c for c in near if abs(c.mu - mu) <= CLOSE * mu]
        if near:
            left.remove(near[0])
        else:
            missed += 1
    return n, len(expected), missed, len(left), found.certified is not False, seconds


def main() -> int:
    """Judge all of them."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    largest = int(sys.argv[2]) if len(sys.argv) > 2 else 200
    total = np.zeros(3, dtype=int)
    seconds, uncertified = 0.0, 0
    for seed in range(count):
        n, known, missed, invented, certified, took = judged(seed, largest)
        total += (known, missed, invented)
        seconds += took
        uncertified += not certified
        if missed or invented or not certified:
            print(f"{seed}: {n} rows, {known} known, {missed} missed, {invented} invented")
    print(
        f"{count} systems, {total[0]} thresholds: {total[1]} missed, {total[2]} invented, "
        f"{uncertified} not certified; {seconds:.0f} s CPU"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
