"""A published brake (4669 degrees of freedom) under the three definitions that are in print.

`make brake DATA=folder` reads the eight matrices of Graebner, Mehrmann, Quraishi, Schroeder and von
Wagner (ZAMM 96, 2016, doi 10.1002/zamm.201500217) from a folder and tells which definition squeals,
which one the article's figures come from, the error of reduced systems against their dimension,
and what each way to the roots costs.
"""

from __future__ import annotations

import dataclasses
import functools
import multiprocessing
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.io.matrices import read_matrix
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.queries.systems.thresholds import system_thresholds
from squeal.results.sources import EigenvalueSelection
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.dense import dense_values
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import Reduction, reduce_system
from squeal.sparse.region_roots import Modes, modes_in

REGION = Rectangle(-50.0, 1000.0, -1.0, 20000.0)
SPEED = 4 * np.pi
SPEEDS = np.linspace(2 * np.pi, 8 * np.pi, 13)
FILES = ("BMLL", "BDLL", "BYLL", "BDIWLL", "BHLL", "BKLL", "BKQLL", "BWLL")
REFERENCE = "1/1600"
TWO_PI = "1/(2*3.141592653589793*1600)"
# factors of D1, DG, DR, D4 and of K1, KR, KGEO
DEFINITIONS = {
    "article": (("1", "W", "1/W", REFERENCE), ("1", "1", "W**2")),
    "program": (("1", "W", "1/W - 1", TWO_PI), ("1", "1", "W**2 - 1")),
    "mixed": (("1", "W", "1/W", TWO_PI), ("1", "1", "W**2")),
}
DIMENSIONS = (20, 40, 60, 80, 100, 150, 200, 250, 300)
SNAPSHOTS = (3, 5, 9)

ComplexArray = NDArray[np.complex128]


def read_definitions(folder: Path) -> dict[str, TermSystem]:
    """The three systems. Raises InputError if a matrix is missing."""
    M, *rest = (read_matrix(folder / f"{name}.mat").matrix for name in FILES)
    systems = {}
    for name, (damping, stiffness) in DEFINITIONS.items():
        C = tuple(Term(X, Formula(f)) for X, f in zip(rest[:4], damping, strict=True))
        K = tuple(Term(X, Formula(f)) for X, f in zip(rest[4:], stiffness, strict=True))
        systems[name] = TermSystem((Term(M),), C, K, {"W": SPEED}, "W", name)
    return systems


@dataclass(frozen=True)
class Timed:
    """What a call gave, and its CPU seconds."""

    value: Any
    seconds: float


def timed(call: Callable[[], Any]) -> Timed:
    """Run once on one thread."""
    start = time.process_time()
    value = call()
    return Timed(value, time.process_time() - start)


def errors(exact: ComplexArray, found: ComplexArray) -> float:
    """Largest relative distance of an exact root to the nearest one that was found."""
    if not len(found):
        return float("inf")
    distance = np.abs(exact[:, None] - found[None, :]).min(axis=1)
    return float((distance / np.abs(exact)).max())


def projected(scaled: ScaledSystem, vectors: NDArray[np.float64], speed: float) -> ComplexArray:
    """All roots of the system projected onto orthonormal columns, at one speed."""
    problem = scaled.at({"W": speed})
    M = vectors.T @ (problem.M @ vectors)
    C = vectors.T @ (problem.C @ vectors)
    K = vectors.T @ (problem.K @ vectors)
    return dense_values(M, C, K)


def real_modes(scaled: ScaledSystem, count: int) -> NDArray[np.float64]:
    """The lowest real modes of M and K1 by rising frequency, in the scaled coordinates."""
    from scipy.sparse.linalg import eigsh

    M, K = scaled.terms[0][0], scaled.terms[2][0]
    K = (K + K.T) / 2
    shift = -1e-6 * float(abs(K).max() / abs(M).max())
    squares, vectors = eigsh(K, k=count, M=M, sigma=shift)
    return np.asarray(vectors[:, np.argsort(squares)])


def by_hand(scaled: ScaledSystem, modes: int = 60) -> ComplexArray:
    """SciPy's eigs on the companion form, as one would write it: one shift, nothing certified."""
    from scipy.sparse import block_array, eye_array
    from scipy.sparse.linalg import eigs

    problem = scaled.at({"W": SPEED})
    rate = 1e4
    eye = eye_array(scaled.n)
    A = block_array([[None, eye], [-problem.K / rate**2, -problem.C / rate]], format="csc")
    B = block_array([[eye, None], [None, problem.M]], format="csc")
    shift = REGION.centre / rate  # with real matrices eigs would take the shift's real part alone
    values = eigs(
        A.astype(complex), k=modes, M=B.astype(complex), sigma=shift, return_eigenvectors=False
    )
    return np.asarray(values * rate)


def modal_table(systems: dict[str, TermSystem]) -> None:
    """Error of real modes over their number, under each definition."""
    print("\nerror of the region's roots with d real modes (relative, largest), W = 4 pi")
    print("d         " + "".join(f"{d:10d}" for d in DIMENSIONS))
    for name, system in systems.items():
        scaled = ScaledSystem(system)
        exact = modes_in(scaled.at(), REGION, certify=False).values
        vectors = real_modes(scaled, DIMENSIONS[-1])
        row = []
        for d in DIMENSIONS:
            basis = np.linalg.qr(vectors[:, :d])[0]
            row.append(errors(exact, projected(scaled, basis, SPEED)))
        print(f"{name:10s}" + "".join(f"{e:10.2g}" for e in row))


EXPECTED = {"article": [817], "program": [785, 817, 2769], "mixed": [2775]}  # Hz of what grows
CROSSED = [817, 1607, 561]  # Hz of the crossings of "program" over W, by rising W


def judgement_table(systems: dict[str, TermSystem]) -> bool:
    """Growing roots at W = 4 pi under each definition, certified; True if they are as expected."""
    print("roots of -50 < Re < 1000, -1 < Im < 20000 at W = 4 pi")
    right = True
    for name, system in systems.items():
        problem = ScaledSystem(system).at()
        run = timed(functools.partial(modes_in, problem, REGION))
        modes: Modes = run.value
        growing = [e for e in modes.eigenvalues if e.value.real > 0.0]
        right &= modes.certified and [round(e.frequency_hz) for e in growing] == EXPECTED[name]
        listed = ", ".join(f"{e.frequency_hz:.1f} Hz ({e.value.real:+.3g} 1/s)" for e in growing)
        proof = "certified" if modes.certified else "NOT certified"
        print(f"  {name:8s} {len(modes.eigenvalues)} roots, {proof}, {run.seconds:.1f} s CPU")
        print(f"           growing: {listed or 'none'}")
    found = system_thresholds(
        systems["program"], SPEEDS[-1], SPEEDS[0], EigenvalueSelection(region=REGION)
    ).answer
    crossed = [round(c.frequency_hz) for c in found.crossings]
    print(f"  program: crossings at {crossed} Hz, certified {found.certified}")
    return right and bool(found.certified) and crossed == CROSSED


def snapshot_basis(scaled: ScaledSystem, count: int) -> Reduction:
    """Right modes at so many speeds, as in proper orthogonal decomposition."""
    basis = Reduction(scaled, REGION)
    for speed in np.linspace(SPEEDS[0], SPEEDS[-1], count):
        modes = modes_in(scaled.at({"W": float(speed)}), REGION, certify=False)
        columns = [e.right / scaled.scale for e in modes.eigenvalues]
        basis.extend(np.array([c / np.linalg.norm(c) for c in columns]).T)
    return basis


@dataclass(frozen=True)
class Cost:
    """Vectors, CPU seconds once and for each speed, largest error, roots missed; memory in GB."""

    size: int
    once: float
    each: float
    error: float
    missed: int
    memory: float = 0.0


def apart(call: Callable[[], Cost]) -> Cost:
    """A cost in a process of its own, with the memory that it took beyond what was there."""
    context = multiprocessing.get_context("fork")
    receive, send = context.Pipe(duplex=False)

    def work() -> None:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        cost = call()
        after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        send.send(dataclasses.replace(cost, memory=(after - before) / 1e6))

    child = context.Process(target=work)
    child.start()
    send.close()
    try:
        return cast("Cost", receive.recv())
    finally:
        child.join()


def cost_table(system: TermSystem) -> None:
    """Size, seconds, memory, error over all speeds and roots missed for each way to the roots."""
    scaled = ScaledSystem(system)
    exact = {
        float(w): modes_in(scaled.at({"W": float(w)}), REGION, certify=False).values for w in SPEEDS
    }

    def missed(w: float, found: ComplexArray) -> int:
        distance = np.abs(exact[w][:, None] - found[None, :]).min(axis=1)
        return int(np.sum(distance > 1e-3 * np.abs(exact[w])))

    def judged(size: int, once: float, values: Callable[[float], ComplexArray]) -> Cost:
        run = timed(lambda: {w: values(w) for w in exact})
        worst = max(errors(e, run.value[w]) for w, e in exact.items())
        lost = sum(missed(w, run.value[w]) for w in exact)
        return Cost(size, once, run.seconds / len(exact), worst, lost)

    def direct() -> Cost:
        return Cost(scaled.n, 0.0, timed(lambda: modes_in(scaled.at(), REGION)).seconds, 0.0, 0)

    def hand() -> Cost:
        run = timed(lambda: by_hand(scaled))
        at = min(exact, key=lambda w: abs(w - SPEED))
        return Cost(scaled.n, 0.0, run.seconds, errors(exact[at], run.value), missed(at, run.value))

    def modal() -> Cost:
        run = timed(lambda: np.linalg.qr(real_modes(scaled, DIMENSIONS[-1]))[0])
        return judged(DIMENSIONS[-1], run.seconds, lambda w: projected(scaled, run.value, w))

    def right(count: int) -> Cost:
        run = timed(lambda: snapshot_basis(scaled, count))
        reduced = run.value.system
        return judged(run.value.size, run.seconds, lambda w: dense_values(*reduced.at({"W": w})))

    def own() -> Cost:
        run = timed(lambda: reduce_system(scaled, REGION, [{"W": float(w)} for w in SPEEDS]))
        return judged(run.value.size, run.seconds, lambda w: run.value.values({"W": w}))

    ways: dict[str, Callable[[], Cost]] = {
        "region, certified": direct,
        "eigs by hand, 60 roots, one shift": hand,
        "real modes": modal,
        **{f"right modes at {k} speeds": functools.partial(right, k) for k in SNAPSHOTS},
        "right and left, where worst": own,
    }
    print("\ncost, CPU seconds on one thread and GB, 13 speeds from 2 pi to 8 pi")
    print(
        f"{'way':34s}{'size':>6s}{'once':>8s}{'each':>8s}{'memory':>8s}{'error':>10s}{'missed':>8s}"
    )
    for way, call in ways.items():
        c = apart(call)
        print(
            f"{way:34s}{c.size:6d}{c.once:8.2f}{c.each:8.3f}{c.memory:8.2f}{c.error:10.1g}"
            f"{c.missed:8d}",
            flush=True,
        )


def main() -> int:
    """Read the folder that is named and print the tables."""
    if len(sys.argv) != 2:
        print("usage: python -m benchmarks.published_brake FOLDER", file=sys.stderr)
        return 2
    try:
        systems = read_definitions(Path(sys.argv[1]))
    except InputError as error:
        print(f"published_brake: {error}", file=sys.stderr)
        return 2
    right = judgement_table(systems)
    modal_table(systems)
    cost_table(systems["program"])
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
