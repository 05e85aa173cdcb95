"""A map and a query at the same random places: verdict and critical friction.

`python -m benchmarks.map_query [--places 1000] [--seed 0]` takes three pads (point contacts, a
face, springs), with and without damping, and prints every place in which both differ.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import time

import numpy as np

import squeal
from squeal.analysis.maps import NAMES, codes_at
from squeal.analysis.stack import PadStack
from squeal.analysis.variations import critical
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.model.contact import Formulation
from squeal.model.pad import Pad

MU_MAX = 2.0
APART = 1e-8  # of mu: more is another answer
COMMON = {
    "m": 0.2, "w": 0.04, "h": 0.014, "k1": 2.0e7, "k2": 2.6e7, "L1": 0.8, "L2": 0.8,
    "alpha1": math.pi / 2, "alpha2": math.pi, "mu": 0.4, "F_n": 4500.0,
}  # fmt: skip
PADS = (
    Scene("B1", Pad(**COMMON, k3=8.7e6, k4=8.7e6)),
    Scene("B2", Pad(**COMMON, k_c=1.74e7)),
    Scene("BN", Pad(**COMMON, k_c=1.74e7), Formulation(springs=7)),
)
DAMPED = Damping(ratios=(0.01, 0.02, 0.005))
NAMES_OF = ("alpha1", "alpha2", "mu")


def differences(scene: Scene, places: np.ndarray) -> list[str]:
    """What differs at places (3, n) = (alpha1, alpha2, mu)."""
    codes = codes_at(scene, NAMES_OF, places).codes
    losses = PadStack.of(scene, NAMES_OF[:2], places[:2]).first_losses(MU_MAX)
    rows = []
    for i, place in enumerate(places.T.tolist()):
        one = scene.replace(**dict(zip(NAMES_OF, place, strict=True)))
        at = f"{scene.model}{', damped' if scene.damping else ''} {place}"
        try:
            found = squeal.sweep(one, [place[2]]).steps[0]
            first = critical(one, MU_MAX).critical
        except ComputationError as error:
            rows.append(f"{at}: {error}")
            continue
        expected = "beyond a fold" if found.roots is None else found.verdict
        mapped = NAMES[codes[i]]
        if mapped not in (expected, "unknown"):
            rows.append(f"{at}: map {mapped}, query {expected}")
        mu = math.nan if first is None else first
        apart = abs(losses.mu[i] - mu) > APART * mu or math.isnan(losses.mu[i]) != math.isnan(mu)
        if apart and not losses.unknown[i]:
            rows.append(f"{at}: contour {losses.mu[i]:.12g}, query {mu:.12g}")
    return rows


def main() -> None:
    """Print what differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    r, count, start = np.random.default_rng(given.seed), 0, time.process_time()
    for scene in PADS:
        for damping in (None, DAMPED):
            n = math.ceil(given.places / (2 * len(PADS)))
            places = r.uniform(0.02, math.pi - 0.02, (3, n))
            places[2] = r.uniform(0.0, MU_MAX, n)
            rows = differences(dataclasses.replace(scene, damping=damping), places)
            count += len(rows)
            print("\n".join([f"{scene.model}, {damping}: {len(rows)} of {n} differ", *rows]))
    print(f"{count} differences; {time.process_time() - start:.0f} CPU s")


if __name__ == "__main__":
    main()
