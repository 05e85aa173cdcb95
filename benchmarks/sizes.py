"""A brake of solids of rising size: CPU seconds and memory for modes, a sweep and all thresholds.

`python -m benchmarks.sizes [ROWS ...]` runs each size in a process of its own on one thread, so
that peak memory is that of the size, and prints a row for each and the power laws through them.
`--figure FILE` draws them. `--components` prints instead what a cut-off of disc and pad costs: the
roots of the joined brake against those of the whole one.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

import squeal
from squeal.examples.brake import solid_brake
from squeal.sparse.argument_principle import band
from squeal.sparse.crossings import crossings_along
from squeal.sparse.factor import factorise
from squeal.sparse.lowest_roots import lowest_modes
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import reduce_system
from squeal.sparse.region_roots import modes_in

ROWS = (1000, 5000, 11000, 36000, 82000)
BAND = (500.0, 8000.0)  # Hz
VALUES = 50  # of mu from 0 to 1
CHECKED = (0.37, 0.83)  # values at which the sweep is held against the full problem
ESTIMATED = 1e6
CUTOFFS = (1e4, 2e4, 4e4)  # Hz, of components, whose roots are those of LOW_BAND
LOW_BAND = (500.0, 5000.0)


@dataclass(frozen=True)
class Size:
    """What a size took: rows, CPU seconds of each step, peak memory (GB), how good it is.

    `growth` and `value` are the largest errors of the sweep's growth rates (of |lambda|) and roots.
    """

    rows: int
    factor: float
    certified: float  # 20 lowest modes with left vectors and count
    basis: float
    sweep: float
    thresholds: float
    memory: float
    basis_size: int
    samples: int
    crossings: int
    value: float
    growth: float

    @property
    def answer(self) -> float:
        """Seconds for 50 values and every threshold."""
        return self.basis + self.sweep + self.thresholds


def measured(rows: int, certify: bool, check: bool) -> Size:
    """One size; steps are told on the error stream as they end."""
    clock = time.process_time

    def ended(step: str, start: float) -> float:
        seconds = clock() - start
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(f"{problem.n} rows: {step} {seconds:.1f} s, {memory:.2f} GB", file=sys.stderr)
        return seconds

    brake = solid_brake(rows)
    scaled = ScaledSystem(brake.system)
    problem = scaled.at()
    region = band(*BAND)
    mu = [float(x) for x in np.linspace(0.0, 1.0, VALUES)]
    start = clock()
    factorise(problem.at(region.centre))
    factored = ended("factor", start)
    start = clock()
    if certify and not lowest_modes(problem, 20).certified:
        raise SystemExit(f"{problem.n} rows: the modes are not certified")
    certified = ended("certified", start) if certify else float("nan")
    start = clock()
    reduction = reduce_system(scaled, region, [{"mu": x} for x in mu[::2] + mu[-1:]])
    basis = ended("basis", start)
    start = clock()
    for x in mu:
        reduction.modes({"mu": x})
    sweep = ended("sweep", start)
    start = clock()
    crossings, _ = crossings_along(reduction, "mu", mu[::7] + mu[-1:])
    thresholds = ended("thresholds", start)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    value, growth = (0.0, 0.0) if check else (float("nan"), float("nan"))
    for x in CHECKED if check else ():
        full = modes_in(scaled.at({"mu": x}), region, certify=False).values
        near = reduction.values({"mu": x})
        off = near[np.argmin(np.abs(full[:, None] - near), axis=1)] - full
        value = max(value, float(np.max(np.abs(off / full))))
        growth = max(growth, float(np.max(np.abs(off.real / full))))
    return Size(
        problem.n,
        factored,
        certified,
        basis,
        sweep,
        thresholds,
        memory,
        reduction.size,
        len(reduction.samples),
        len(crossings),
        value,
        growth,
    )


def power(sizes: list[Size], name: str) -> tuple[float, float]:
    """Exponent of the power law through the three largest sizes, and what it gives at 10^6."""
    last = [s for s in sizes if getattr(s, name) > 0][-3:]
    slope, offset = np.polyfit(
        np.log([s.rows for s in last]), np.log([getattr(s, name) for s in last]), 1
    )
    return float(slope), float(np.exp(offset + slope * np.log(ESTIMATED)))


def draw(sizes: list[Size], file: Path) -> None:
    """Seconds and memory over size."""
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogLocator

    figure, (left, right) = plt.subplots(1, 2, figsize=(6.9, 2.8), layout="constrained")
    rows = [s.rows for s in sizes]
    shown = {"factor": "a factorisation", "certified": "20 modes, certified"}
    shown["answer"] = "50 values and all thresholds"
    for name, label in shown.items():
        if not any(getattr(s, name) > 0 for s in sizes):
            continue
        left.loglog(rows, [getattr(s, name) for s in sizes], "o-", label=label)
    right.loglog(rows, [s.memory for s in sizes], "o-")
    left.set(xlabel="degrees of freedom", ylabel="CPU time, s")
    right.set(xlabel="degrees of freedom", ylabel="peak memory, GB")
    figure.legend(loc="outside upper center", ncols=len(shown), fontsize=8)
    for axis in (right.yaxis, left.yaxis):
        axis.set_major_formatter("{x:g}")
    right.yaxis.set_minor_locator(LogLocator(subs=(2, 5)))
    right.yaxis.set_minor_formatter("{x:g}")
    figure.savefig(file)


def components(rows: int) -> None:
    """Print errors of the roots of disc and pad, joined, over the cut-off of their modes."""
    brake = solid_brake(rows)
    bodies = brake.bodies
    contact = brake.contact
    exact = squeal.eigenvalues(brake.system, band=LOW_BAND).values
    band = "{:g} to {:g} Hz".format(*LOW_BAND)
    print(f"{len(exact)} roots from {band} of {brake.system.n} rows; largest errors")
    print(f"{'cut-off, Hz':>11s}{'rows':>7s}{'root, relative':>16s}{'growth rate, 1/s':>18s}")
    for cutoff in CUTOFFS:
        joints = [replace(contact, bonded=True)]
        small = squeal.assemble(bodies, joints, {"mu": 0.4}, cutoff=cutoff).system
        near = squeal.eigenvalues(small, band=LOW_BAND).values
        off = near[np.abs(near[:, None] - exact).argmin(axis=0)] - exact
        errors = np.abs(off / exact).max(), np.abs(off.real).max()
        print(f"{cutoff:11g}{small.n:7d}{errors[0]:16.1e}{errors[1]:18.2g}", flush=True)


def main() -> int:
    """Measure the sizes that are named."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sizes", description=__doc__)
    parser.add_argument("rows", type=int, nargs="*", default=ROWS)
    parser.add_argument("--no-count", action="store_true", help="leave the certified modes out")
    parser.add_argument("--no-check", action="store_true", help="... the full problem's roots too")
    parser.add_argument("--figure", type=Path, help="draw them")
    parser.add_argument("--components", action="store_true", help="errors over the cut-off instead")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(asdict(measured(given.rows[0], not given.no_count, not given.no_check))))
        return 0
    if given.components:
        for rows in given.rows if given.rows is not ROWS else (2000,):
            components(rows)
        return 0
    sizes: list[Size] = []
    names = list(Size.__dataclass_fields__)
    print("".join(f"{name:>11s}" for name in names), flush=True)
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    for rows in given.rows:
        command = [sys.executable, "-m", "benchmarks.sizes", str(rows), "--one"]
        command += ["--no-count"] * given.no_count + ["--no-check"] * given.no_check
        run = subprocess.run(command, stdout=subprocess.PIPE, env=environment, check=True)
        sizes.append(Size(**json.loads(run.stdout)))
        print("".join(f"{x:11.3g}" for x in asdict(sizes[-1]).values()), flush=True)
    if len(sizes) > 2:
        for name in ("factor", "certified", "answer", "memory"):
            if sum(getattr(s, name) > 0 for s in sizes) < 2:
                continue
            slope, there = power(sizes, name)
            print(f"{name}: n^{slope:.2f}, {there:.3g} at {ESTIMATED:.0e} rows")
    if given.figure is not None:
        draw(sizes, given.figure)
    return 0


if __name__ == "__main__":
    sys.exit(main())
