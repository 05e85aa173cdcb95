"""The brake of solids with a turning disc and damping by friction, and what answers on it cost.

The disc's material moves through the mesh: with the speed Omega its acceleration has a gyroscopic
part 2 Omega G and a centrifugal part -Omega^2 H. Under the pressure p friction resists radial
sliding by mu p / (Omega r) for each area and speed of sliding: some modes are heavily damped.

`python -m benchmarks.turning_brake [ROWS] [--around N] [--only ANSWER ...]` prints the CPU seconds
of each answer, of one thread, and their ratio to one `eigs`; `--repeat` takes medians. Beside them
stand SLEPc, where Debian's python3-slepc4py-complex is installed, and the recipe of 100 real modes,
uncounted. `--check` holds sweeps, charts and samples of five brakes against a full solution of
each value instead.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import squeal
from benchmarks.large_peers import eigs_near, has_slepc, run_way, write_parts
from squeal.examples.brake import ROUND, VTK, Geometry, SolidBrake, solid_brake
from squeal.linear import GROWING
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula

BAND = (1000.0, 8000.0)  # Hz
NEAR = 20  # roots of `eigs` and of SLEPc
RECIPE_MODES = 100  # of the brake without friction, on which a recipe projects it
RANGE = (0.0, 0.7)  # of mu
LIGHT = 2.0e4  # Pa
HEAVY = 1.0e6
ROUNDING = 1e-10  # of |lambda|: of full solutions
SPREADS = {
    "mu": {"between": [0.2, 0.6]},
    "contact": {"between": [0.7, 1.4]},
    "speed": {"between": [8.0, 20.0]},
    "pressure": {"between": [2.0e5, 1.5e6]},
}


def turning_brake(
    rows: int = 3000, pressure: float = HEAVY, speed: float = 12.0, around: int = ROUND
) -> TermSystem:
    """The system in mu, contact (a factor of its stiffness), speed (rad/s) and pressure (Pa)."""
    brake = solid_brake(rows, around=around)
    system = brake.system
    gyroscopic, centrifugal = transport(brake)
    damping = _radial_friction(brake)
    C = (
        *system.C,
        Term(gyroscopic, Formula("2*speed")),
        Term(damping, Formula("mu*pressure/speed")),
    )
    K = (*system.K, Term(centrifugal, Formula("-speed**2")))
    own = {**system.parameters, "speed": speed, "pressure": pressure}
    return TermSystem(system.M, C, K, own, "mu", "turning brake")


def transport(brake: SolidBrake) -> tuple[Any, Any]:
    """What turning the disc by 1 rad/s adds: G of the gyroscopic term 2 G q' and H of -H q, both
    (n, n), from the derivative along the motion of a material that passes the mesh."""
    from scipy.sparse import block_diag, coo_array, csc_array, kron
    from skfem import Basis, ElementHex1, MeshHex

    density = Geometry().disc[2]
    of_disc = brake.cells[:, VTK].max(axis=1) < brake.pairs[0, 1]
    corners = brake.cells[of_disc][:, np.argsort(VTK)].T
    disc = int(corners.max()) + 1
    basis = Basis(MeshHex(brake.coordinates[:disc].T, corners), ElementHex1())
    x, y, _ = np.asarray(basis.global_coordinates())
    values = np.array([np.asarray(b[0]) for b in basis.basis])
    slopes = np.array([x * b[0].grad[1] - y * b[0].grad[0] for b in basis.basis])
    mass = density * basis.dx
    carried = np.einsum("iep,jep,ep->eij", values, slopes, mass)
    centrifugal = np.einsum("iep,jep,ep->eij", slopes, slopes, mass)
    gyroscopic = (carried - carried.transpose(0, 2, 1)) / 2  # skew, as over the closed ring
    nodes = basis.element_dofs.T
    where = np.repeat(nodes, 8, axis=1).ravel(), np.tile(nodes, 8).ravel()
    others = len(brake.coordinates) - disc
    found = []
    for entries in (gyroscopic, centrifugal):
        scalar = coo_array((entries.ravel(), where), shape=(disc, disc))
        whole = block_diag([scalar, coo_array((others, others))])
        vector = csc_array(kron(whole, np.eye(3)))
        rows = 3 * brake.nodes + brake.directions
        matrix = csc_array(vector[rows][:, rows])
        matrix.eliminate_zeros()
        found.append(matrix)
    return found[0], found[1]


def _radial_friction(brake: SolidBrake) -> Any:
    """The integral of (difference of the radial speeds)^2 / r over the contact."""
    from scipy.sparse import coo_array, csc_array, diags_array

    row_of = {
        (int(node), int(direction)): row
        for row, (node, direction) in enumerate(zip(brake.nodes, brake.directions, strict=True))
    }
    entries = []
    for pair, (below, above) in enumerate(brake.pairs.tolist()):
        x, y, _ = brake.coordinates[above]
        radius = math.hypot(x, y)
        for node, sign in ((above, 1.0), (below, -1.0)):
            for direction, share in ((0, x / radius), (1, y / radius)):
                row = row_of.get((node, direction))
                if row is not None:
                    entries.append((sign * share, pair, row))
    values, pairs, rows = zip(*entries, strict=True)
    shape = len(brake.pairs), brake.system.n
    slide = coo_array((values, (pairs, rows)), shape=shape).tocsc()
    radii = np.hypot(*brake.coordinates[brake.pairs[:, 1], :2].T)
    return csc_array(slide.T @ diags_array(brake.area / radii) @ slide)


def _chart(system: TermSystem) -> Any:
    axes = squeal.Axis("mu", *RANGE, 15), squeal.Axis("contact", 0.5, 2.0, 15)
    return squeal.map(system, axes, band=BAND)


def recipe(system: TermSystem, values: list[float]) -> list[NDArray[np.complex128]]:
    """The roots at values of mu on the lowest real modes without friction, as engineers script it.

    Nothing bounds what these modes leave out.
    """
    from scipy.linalg import eigvals
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import eigsh

    M, _, K = system.at({"mu": 0.0})
    symmetric = csc_array((K + K.T) / 2)
    _, modes = eigsh(symmetric, RECIPE_MODES, csc_array(M), sigma=0.0)
    found = []
    for mu in values:
        M, C, K = (modes.T @ (matrix @ modes) for matrix in system.at({"mu": mu}))
        zero = np.zeros_like(M)
        one = np.eye(len(M))
        left = np.block([[zero, one], [-K, -C]])
        right = np.block([[one, zero], [zero, M]])
        found.append(np.asarray(eigvals(left, right)))
    return found


def slepc_seconds(system: TermSystem) -> float:
    """CPU seconds of SLEPc, TOAR with MUMPS, for the same roots as those of `eigs`."""
    with tempfile.TemporaryDirectory() as folder:
        write_parts(Path(folder), system, 1j * math.pi * sum(BAND), NEAR)
        return float(run_way("slepc", Path(folder)).split()[0])


def _answers(system: TermSystem) -> dict[str, Callable[[], Any]]:
    def sweep(count: int) -> Any:
        return squeal.sweep(system, np.linspace(*RANGE, count).tolist(), BAND)

    return {
        "eigs": lambda: eigs_near(system, BAND, NEAR),
        "band, certified": lambda: squeal.eigenvalues(system, band=BAND),
        "recipe 7": lambda: recipe(system, np.linspace(*RANGE, 7).tolist()),
        "sweep 7": lambda: sweep(7),
        "sweep 21": lambda: sweep(21),
        "chart 225": lambda: _chart(system),
        "samples 128": lambda: squeal.scatter(system, SPREADS, samples=128, of="growth", band=BAND),
        "thresholds": lambda: squeal.thresholds(system, RANGE[1], band=BAND),
    }


class Check(NamedTuple):
    """Answers at some parameters against the roots of the full problem there."""

    values: int
    same_verdicts: int
    same_counts: int  # of roots, where these are listed
    growth_off: float  # the largest one, 1/s
    stated: float  # the largest error that is stated, 1/s
    held: bool  # whether each error is at most the one that is stated


def brakes(rows: int, around: int) -> dict[str, TermSystem]:
    """Light and heavy damping, turning or not."""
    return {
        "2e4 Pa, 12 rad/s": turning_brake(rows, LIGHT, around=around),
        "1e6 Pa, 12 rad/s": turning_brake(rows, HEAVY, around=around),
        "2e6 Pa, 5 rad/s": turning_brake(rows, 2 * HEAVY, speed=5.0, around=around),
        "1e6 Pa, 200 rad/s": turning_brake(rows, HEAVY, speed=200.0, around=around),
        "standing": solid_brake(rows, around=around).system,
    }


def _full_roots(system: TermSystem, changes: dict[str, float]) -> NDArray[np.complex128]:
    answer = squeal.eigenvalues(system.replace(changes), band=BAND)
    return np.array([root.value for root in answer.eigenvalues])


def _is_growing(verdict: str | None) -> bool:
    return verdict in GROWING


def check_sweep(system: TermSystem) -> Check:
    """All roots of a sweep of 21 values at every fourth of them."""
    steps = squeal.sweep(system, np.linspace(*RANGE, 21).tolist(), BAND, method="modal").steps[::4]
    same_verdicts = 0
    same_counts = 0
    stated = 0.0
    off = [0.0]
    beyond = [0.0]
    for step in steps:
        assert step.roots is not None
        assert step.rounding is not None
        full = _full_roots(system, {"mu": step.value})
        same_verdicts += _is_growing(step.verdict) == bool(np.any(full.real > 0.0))
        same_counts += len(full) == len(step.roots)
        distances = np.abs(full[:, None] - step.roots)
        nearest = full[np.argmin(distances, axis=0)]
        off += np.abs(nearest.real - step.roots.real).tolist()
        allowed = step.rounding + ROUNDING * np.abs(step.roots)
        beyond += (distances.min(axis=0) - allowed).tolist()
        stated = max(stated, float(step.rounding.max()))
    return Check(len(steps), same_verdicts, same_counts, max(off), stated, max(beyond) <= 0.0)


def check_chart(system: TermSystem) -> Check:
    """Verdict and growth at twelve points of a chart."""
    chart = _chart(system)
    points = np.random.default_rng(47).choice(chart.codes.size, 12, replace=False)
    same_verdicts = 0
    off = []
    for point in points.tolist():
        i, j = np.unravel_index(point, chart.codes.shape)
        changes = {"mu": chart.axes[0].values[i], "contact": chart.axes[1].values[j]}
        growth = float(_full_roots(system, changes).real.max())
        verdict = chart.verdicts[chart.codes[i, j]]
        same_verdicts += _is_growing(verdict) == (growth > 0.0)
        off.append(abs(chart.quantity[2][i, j] - growth))
    return Check(len(points), same_verdicts, len(points), max(off), math.nan, True)


def check_samples(system: TermSystem) -> Check:
    """Growth and number of growing modes of every tenth of 128 samples."""
    spreads = {name: spread for name, spread in SPREADS.items() if name in system.names}
    samples = squeal.scatter(system, spreads, samples=128, of="growth", band=BAND).rows[::10]
    same_verdicts = 0
    same_counts = 0
    off = []
    for sample in samples:
        full = _full_roots(system, dict(sample.parameters))
        same_verdicts += (sample.value > 0.0) == bool(np.any(full.real > 0.0))
        same_counts += sample.unstable == int(np.sum(full.real > 0.0))
        off.append(abs(sample.value - float(full.real.max())))
    return Check(len(samples), same_verdicts, same_counts, max(off), math.nan, True)


def check(rows: int, around: int) -> bool:
    """Print what differs from full solutions; True if nothing does beyond the stated errors."""
    passed = True
    print("brake               answer   verdicts  counts   growth off  stated, 1/s  held")
    for name, system in brakes(rows, around).items():
        for answer, compare in CHECKS.items():
            found = compare(system)
            counts = f"{found.same_counts}/{found.values}"
            verdicts = f"{found.same_verdicts}/{found.values}"
            print(
                f"{name:<20s}{answer:<9s}{verdicts:<10s}{counts:<9s}{found.growth_off:<12.2g}"
                f"{found.stated:<13.2g}{found.held}",
                flush=True,
            )
            is_same = found.same_verdicts == found.same_counts == found.values
            passed = passed and is_same and found.held
    return passed


CHECKS = {"sweep": check_sweep, "chart": check_chart, "samples": check_samples}


def _told(answer: Any) -> str:
    """What shows that the answer is one."""
    with suppress(AttributeError):
        certified = "" if answer.certified is None else f", certified {answer.certified}"
        crossings = getattr(answer, "crossings", None)
        return (
            f"{len(answer.eigenvalues)} roots"
            if crossings is None
            else f"{len(crossings)} crossings"
        ) + certified
    return ""


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.turning_brake", description=__doc__)
    parser.add_argument("rows", type=int, nargs="?", default=2500, help="at least so many (2500)")
    parser.add_argument("--around", type=int, default=36, help="elements around at each level (36)")
    parser.add_argument("--pressure", type=float, default=HEAVY, help=f"Pa ({HEAVY:g})")
    parser.add_argument("--repeat", type=int, default=1, help="runs, of which medians are printed")
    parser.add_argument("--only", nargs="+", help="answers by name, beside `eigs`")
    parser.add_argument("--check", action="store_true", help="against full solutions instead")
    given = parser.parse_args()
    if given.check:
        return 0 if check(given.rows, given.around) else 1
    system = turning_brake(given.rows, given.pressure, around=given.around)
    print(f"{system.n} rows, {given.pressure:g} Pa; CPU seconds of one thread")
    unit = math.nan
    for name, answer in _answers(system).items():
        if given.only and name not in ("eigs", *given.only):
            continue
        seconds = []
        for _ in range(given.repeat + (name == "eigs")):  # its first run imports
            start = time.process_time()
            told = answer()
            seconds.append(time.process_time() - start)
        took = statistics.median(seconds[name == "eigs" :])
        unit = took if name == "eigs" else unit
        print(f"{name:<18s}{took:8.2f}{took / unit:8.1f}  {_told(told)}", flush=True)
        if name == "eigs" and has_slepc():
            took = statistics.median(slepc_seconds(system) for _ in range(given.repeat))
            print(f"{'SLEPc':<18s}{took:8.2f}{took / unit:8.1f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
