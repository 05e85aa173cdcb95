"""How many random pads have a proved first loss of stability, and at what cost.

`python -m benchmarks.random_pads [--pads 200] [--seed 0]` draws pads of both contact models within
physical bounds, prints what stays open and why, the median and the largest CPU time of an answer.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from typing import Any

import numpy as np

import squeal
from squeal.schema import Place

FRICTION = 1.0  # the end of the range


def draw(rng: np.random.Generator) -> dict[str, Any]:
    """A scene: stiffness ratios over three decades, springs at any angle."""
    w = float(rng.uniform(0.02, 0.1))
    stiffness = 10.0 ** rng.uniform(5.0, 8.0, size=5)
    parameters = {
        "m": float(10.0 ** rng.uniform(-1.0, 0.5)),
        "w": w,
        "h": w * float(rng.uniform(0.1, 1.0)),
        "k1": float(stiffness[0]),
        "k2": float(stiffness[1]),
        "L1": float(rng.uniform(0.2, 1.0)),
        "L2": float(rng.uniform(0.2, 1.0)),
        "alpha1": float(rng.uniform(0.0, np.pi)),
        "alpha2": float(rng.uniform(0.0, np.pi)),
        "mu": 0.3,
        "F_n": float(10.0 ** rng.uniform(2.0, 3.7)),
    }
    if rng.integers(2):
        edges = {"k3": float(stiffness[2]), "k4": float(stiffness[3])}
        return {"model": "B1", "parameters": parameters | edges}
    return {"model": "B2", "parameters": parameters | {"k_c": float(stiffness[4])}}


def main() -> int:
    """Draw, ask, print; the exit code is 1 below 90 %."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pads", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    seconds = []
    said: Counter[str] = Counter()
    while len(seconds) < asked.pads:
        data = draw(rng)
        start = time.process_time()
        try:
            answer = squeal.thresholds(squeal.Scene.from_dict(data, Place("pad")), FRICTION)
        except squeal.ComputationError:
            continue  # no equilibrium without friction
        seconds.append(time.process_time() - start)
        status = answer.proof["status"]
        said[status] += 1
        if status != "proved" or seconds[-1] > 2.0:
            print(f"pad {len(seconds)}, {seconds[-1]:.2f} s: {answer.proof_line}", flush=True)
    print(f"{dict(said)}; median {np.median(seconds):.2f} s, largest {max(seconds):.2f} s")
    return int(said["proved"] < 0.9 * asked.pads)


if __name__ == "__main__":
    sys.exit(main())
