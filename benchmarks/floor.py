"""The default path against a Taylor integrator by hand in C++: `python -m benchmarks.floor`.

Both run the B1 scenes of the report over their time to a final error of at most 1e-10, in turn and
on the same machine; the truth is quad precision. Needs g++.
"""

from __future__ import annotations

import dataclasses
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from squeal.article.precision.paths import ours
from squeal.scene import Scene, read_scene
from squeal.simulation.reference import error_against, reference
from squeal.simulation.run import first_state, in_natural_units

HERE = Path(__file__).resolve().parent
SCENES = HERE.parent / "workflow" / "scenes"
ORDERS = (12, 14, 16, 18, 20)
ERROR, REPEATS = 1e-10, 51


def numbers(scene: Scene) -> str:
    """What the program reads: the scaled pad, its first state, how often to run."""
    _, model, state, stop = in_natural_units(scene)
    c = model.c
    pad = [c.m, c.I, c.mu, c.F_n, stop, 0.0]
    springs = [c.k1, c.L1, c.D1x, c.D1y, c.r1x, c.r1y, c.k2, c.L2, c.D2x, c.D2y, c.r2x, c.r2y]
    edges = [c.k3, c.rlx, c.rly, c.k4, c.rtx, c.rty]
    place = state.copy()
    place[[2, 5]] /= c.w
    on = first_state(model, state)
    values = [*pad, *springs, *edges, *place.tolist()]
    return " ".join([*(repr(float(v)) for v in values), *(str(int(o)) for o in on), str(REPEATS)])


def main() -> None:
    """Compile, run both, print."""
    with tempfile.TemporaryDirectory() as folder:
        programs = {}
        for order in ORDERS:
            programs[order] = Path(folder) / f"floor{order}"
            options = ["-O3", "-march=native", "-ffast-math", f"-DORDER={order}"]
            command = ["g++", *options, str(HERE / "floor.cpp"), "-o", str(programs[order])]
            subprocess.run(command, check=True)
        for case in "abcd":
            scene = read_scene(SCENES / f"b1-{case}.yaml", "simulate")
            scene = dataclasses.replace(scene, outputs=())
            exact = reference(scene)
            _, model, _, _ = in_natural_units(scene)
            best: tuple[float, int, int] | None = None
            for order, program in programs.items():
                out = subprocess.run(
                    [str(program)], input=numbers(scene), capture_output=True, text=True, check=True
                ).stdout.split()
                place = np.array([float(v) for v in out[3:]]) * [1.0, 1.0, model.c.w]
                right = int(out[2]) == len(exact.times)
                if right and error_against(place, exact.place) <= ERROR:
                    best = min(best or (np.inf, 0, 0), (float(out[0]), order, int(out[1])))
            own = np.inf
            for tolerance in (1e-9, 1e-10, 1e-11, 1e-12):
                if error_against(ours(scene, tolerance).place, exact.place) > ERROR:
                    continue
                spent = []
                for _ in range(REPEATS):
                    begun = time.perf_counter()
                    ours(scene, tolerance)
                    spent.append(time.perf_counter() - begun)
                own = min(own, statistics.median(spent))
            told = "no right answer"
            if best is not None:
                spent_by_hand, order, steps = best
                told = (
                    f"{1e3 * spent_by_hand:.3f} ms (order {order}, {steps} steps), "
                    f"ratio {own / spent_by_hand:.2f}"
                )
            print(
                f"B1, case ({case}), {len(exact.times)} contact changes, error <= {ERROR:g}: "
                f"squeal {1e3 * own:.3f} ms; by hand {told}"
            )


if __name__ == "__main__":
    main()
