"""Roots of a brake of solids in a band: certified here, by SLEPc and by SciPy's `eigs`.

`python -m benchmarks.large_peers [ROWS ...]` runs each way in a process of its own on one thread
and prints CPU seconds, peak memory and the number of roots in the band; a first look at seven
frictions and a loop of `eigs` print those of all values. SLEPc (complex build with MUMPS) is asked
where Debian's python3-slepc4py-complex is installed.
"""

from __future__ import annotations

import glob
import importlib
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

BAND = (500.0, 5000.0)  # Hz
NEAR = 20  # roots around the middle of the band
SWEPT = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
WAYS = ("squeal", "thresholds", "slepc", "eigs", "look", "loop")
DEBIAN = "/usr/bin/python3"
BUILD = "/usr/lib/{}dir/{}*/x86_64-linux-gnu-complex/lib/python3/dist-packages"
LOW, HIGH = (2 * math.pi * f for f in BAND)


def _slepc(parts: Any, shift: complex, near: int) -> tuple[float, Any]:
    """TOAR with shift-invert by MUMPS; Debian's Python has NumPy and no SciPy."""
    for name in ("slepc", "petsc"):
        sys.path[:0] = glob.glob(BUILD.format(name, name))
    from petsc4py import PETSc
    from slepc4py import SLEPc

    def matrix(name: str) -> Any:
        rows = parts[name + "p"].astype(np.int32), parts[name + "i"].astype(np.int32)
        n = len(rows[0]) - 1
        return PETSc.Mat().createAIJ((n, n), csr=(*rows, parts[name + "x"].astype(complex)))

    operators = [matrix(name) for name in "KCM"]
    start = time.process_time()
    solver = SLEPc.PEP().create()
    solver.setOperators(operators)
    solver.setType("toar")
    solver.setScale(SLEPc.PEP.Scale.SCALAR)
    solver.setWhichEigenpairs(SLEPc.PEP.Which.TARGET_MAGNITUDE)
    solver.setTarget(shift)
    solver.setDimensions(near)
    solver.setTolerances(1e-10, 200)
    inverse = solver.getST()
    inverse.setType("sinvert")
    inverse.getKSP().setType("preonly")
    inverse.getKSP().getPC().setType("lu")
    inverse.getKSP().getPC().setFactorSolverType("mumps")
    solver.solve()
    values = [solver.getEigenpair(k) for k in range(solver.getConverged())]
    return time.process_time() - start, np.array(values)


def _eigs(parts: Any, shift: complex = 0.5j * (LOW + HIGH), near: int = NEAR) -> tuple[float, Any]:
    """Shift-invert of the companion form by hand, factorised by SuperLU with its best ordering."""
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import LinearOperator, eigs, splu

    M = csr_array((parts["Mx"], parts["Mi"], parts["Mp"]))
    C = csr_array((parts["Cx"], parts["Ci"], parts["Cp"]))
    K = csr_array((parts["Kx"], parts["Ki"], parts["Kp"]))
    start = time.process_time()
    n = M.shape[0]
    P = (shift * (shift * M + C) + K).tocsc()
    order = {"permc_spec": "MMD_AT_PLUS_A", "options": {"SymmetricMode": True}}
    lu = splu(P, diag_pivot_thresh=0.01, **order)
    slope = 2 * shift * M + C
    size = abs(shift)

    def applied(x: Any) -> Any:
        top = lu.solve(-size * (slope @ x[:n]) - size**2 * (M @ x[n:]))
        return np.concatenate([top, x[:n]])

    theta = eigs(LinearOperator((2 * n, 2 * n), applied, dtype=complex), k=near, tol=1e-10)[0]
    return time.process_time() - start, shift + size / theta


def eigs_near(system: Any, band: tuple[float, float], near: int) -> Any:
    """The roots of a system nearest to the middle of a band (Hz) by `eigs`."""
    return _eigs(_parts(system), 1j * math.pi * sum(band), near)[1]


def _parts(system: Any, changes: Any = None) -> dict[str, Any]:
    """Arrays of M, C and K by rows."""
    parts: dict[str, Any] = {}
    M, C, K = system.at(changes)
    if C is None:
        C = 0.0 * M
    for key, matrix in zip("MCK", (M, C, K), strict=True):
        A = matrix.tocsr()
        parts |= {key + "p": A.indptr, key + "i": A.indices, key + "x": A.data}
    return parts


def _squeal(folder: Path, way: str) -> tuple[float, Any]:
    import squeal
    from squeal.io.system_files import read_system
    from squeal.queries.systems.roots import system_roots
    from squeal.queries.systems.thresholds import system_thresholds
    from squeal.results.sources import EigenvalueSelection

    for name in ("scipy.linalg", "scipy.optimize", "scipy.sparse.linalg"):  # as of the peers
        importlib.import_module(name)
    system = read_system(folder / "system.yaml").system
    wanted = EigenvalueSelection(band=BAND)
    start = time.process_time()
    if way == "thresholds":
        found = system_thresholds(system, 1.0, selection=wanted).answer
        return time.process_time() - start, np.full(len(found.crossings), 0.5j * (LOW + HIGH))
    if way == "look":
        steps = squeal.sweep(system, SWEPT, band=BAND, method="modal").steps
        return time.process_time() - start, np.concatenate([step.roots for step in steps])
    if way == "loop":
        each = [_eigs(_parts(system, {"mu": mu})) for mu in SWEPT]
        return sum(seconds for seconds, _ in each), np.concatenate([z for _, z in each])
    roots = system_roots(system, wanted)
    if not roots.certified:
        raise SystemExit(f"{system.n} rows: the roots are not certified")
    return time.process_time() - start, np.array([e.value for e in roots.eigenvalues])


def one(way: str, folder: Path) -> str:
    """What one way takes: CPU seconds, GB, number of roots in the band (of thresholds all). Writes
    the roots beside the matrices."""
    if way not in ("slepc", "eigs"):
        seconds, values = _squeal(folder, way)
    else:
        parts = np.load(folder / "parts.npz")
        solver = _slepc if way == "slepc" else _eigs
        seconds, values = solver(parts, complex(parts["shift"]), int(parts["near"]))
    np.save(folder / f"{way}.npy", values)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    inside = int(np.sum((values.imag > LOW) & (values.imag < HIGH)))
    return f"{seconds:.2f} s, {memory:.2f} GB, {inside}"


def write_parts(folder: Path, system: Any, shift: complex, near: int) -> None:
    """Write the matrices for the peers, and how many roots they find around a shift (rad/s)."""
    np.savez(folder / "parts.npz", shift=shift, near=near, **_parts(system))


def run_way(way: str, folder: Path) -> str:
    """Run a way in a process of its own on one thread; what it prints, "" without an answer."""
    program = [sys.executable, "-m", "benchmarks.large_peers"]
    if way == "slepc":
        program = [DEBIAN, str(Path(__file__))]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    command = [*program, "--one", way, str(folder)]
    run = subprocess.run(command, stdout=subprocess.PIPE, env=environment, text=True)
    return run.stdout.strip()


def has_slepc() -> bool:
    """Whether Debian's complex build of SLEPc is installed."""
    return bool(glob.glob(BUILD.format("slepc", "slepc")))


def main() -> int:
    """A line for each size and way."""
    if sys.argv[1:2] == ["--one"]:
        print(one(sys.argv[2], Path(sys.argv[3])))
        return 0
    from squeal.examples.brake import solid_brake, write_brake

    for rows in map(int, sys.argv[1:] or ["5000", "20000"]):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name) / "brake"
            brake = solid_brake(rows)
            write_brake(folder, brake)
            write_parts(folder, brake.system, 0.5j * (LOW + HIGH), NEAR)
            for way in WAYS:
                if way == "slepc" and not has_slepc():
                    continue
                answer = run_way(way, folder) or "no answer"
                print(f"{brake.system.n:>7d} rows  {way:<10s}  {answer}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
