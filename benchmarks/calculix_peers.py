"""The 24 lowest modes of a brake with friction: CalculiX beside SLEPc, `eigs`, real modes, squeal.

`python -m benchmarks.calculix_peers` makes the brake of docs/brake_from_mesh.md. CalculiX has its
own contact law, so that its modes are counted against its own longer list; the others share the
matrices of squeal, whose list is certified by a count. The recipe of real modes projects friction
on twice as many modes without it. CPU seconds of one thread; of CalculiX those of the step that
finds the modes, without the steps that press and slide.
"""

from __future__ import annotations

import importlib.util
import math
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path
from types import ModuleType

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

import squeal
from benchmarks.large_peers import has_slepc, run_way, write_parts
from squeal.errors import InputWarning
from squeal.linear.system import TermSystem

MODES = 24
FRICTION = 0.5
MARGIN = 4  # roots more that the peers are asked for
SCRIPT = Path(__file__).parents[1] / "docs" / "brake_from_mesh.py"
SAME = 1e-6  # relative difference of roots of the same matrices
ALIKE = 1e-2  # of roots on real modes
PRINTED = 1e-4  # of frequencies that CalculiX prints
Roots = NDArray[np.complex128]


def brake_script() -> ModuleType:
    """The script of the documentation."""
    found = importlib.util.spec_from_file_location("brake_from_mesh", SCRIPT)
    if found is None or found.loader is None:
        raise FileNotFoundError(SCRIPT)
    script = importlib.util.module_from_spec(found)
    found.loader.exec_module(script)
    return script


def calculix_seconds(folder: Path, name: str, lines: list[str]) -> float:
    """The CPU seconds that CalculiX takes for a deck, of one thread."""
    (folder / f"{name}.inp").write_text("\n".join(lines) + "\n", encoding="utf-8")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = ["env", "OMP_NUM_THREADS=1", "ccx", name]
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def by_calculix(folder: Path, script: ModuleType, brake: object) -> str:
    """What CalculiX takes and finds, held against a list of twice as many modes."""
    deck = script.contact_deck(brake, FRICTION, script.TURN)
    last = deck.index("*STEP,PERTURBATION")
    seconds = calculix_seconds(folder, "modes", deck)
    seconds -= calculix_seconds(folder, "loaded", deck[:last])
    doubled = [str(2 * MODES) if line == str(script.MODES) else line for line in deck[last:]]
    calculix_seconds(folder, "more", [*deck[:last], *doubled])
    found, more = (script.printed(folder, name) for name in ("modes", "more"))
    lowest = more[np.argsort(more[:, 0])][:MODES]
    same = 0
    for frequency, _ in lowest:
        same += bool(np.abs(found[:, 0] / frequency - 1.0).min() < PRINTED)
    growing = int(np.sum(found[:, 1] > 1.0))
    return f"{seconds:6.2f} s  {same} of its {MODES} lowest, {growing} growing"


def on_real_modes(system: TermSystem) -> tuple[float, Roots]:
    """CPU seconds, and the roots above the real axis of friction projected on real modes without
    it; the decks damp nothing."""
    from scipy.sparse import csc_array
    from scipy.sparse.linalg import eigsh

    M, _, K = system.at()
    start = time.process_time()
    still = system.at({"mu": 0.0})[2]
    _, modes = eigsh(csc_array(still), 2 * MODES, csc_array(M), sigma=0.0)
    squares = -scipy.linalg.eigvals(modes.T @ (K @ modes), modes.T @ (M @ modes))
    roots = np.sqrt(squares.astype(complex))
    roots = np.where(roots.imag < 0.0, -roots, roots)
    return time.process_time() - start, np.asarray(roots)


def compared(seconds: float, roots: Roots, wanted: Roots, close: float) -> str:
    """How many of the certified roots are among others, and how many of these grow rightly."""
    distances = np.abs(roots[:, None] - wanted) / np.abs(wanted)
    found = distances.min(axis=0) < close
    growing = int(np.sum(found & (wanted.real > 1.0)))
    return f"{seconds:6.2f} s  {int(found.sum())} of {len(wanted)}, {growing} growing"


def main() -> int:
    """A line for each way."""
    if not shutil.which("ccx"):
        print("left out: CalculiX beside its peers, since ccx is not installed")
        return 0
    script = brake_script()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        brake = script.Brake()
        script.write_files(folder, brake, mu=FRICTION)
        print(f"CalculiX   {by_calculix(folder, script, brake)}", flush=True)
        with warnings.catch_warnings():  # of nodes inside elements
            warnings.simplefilter("ignore", InputWarning)
            system = squeal.read_system(folder / "brake.yaml").system
        print(f"{system.n} rows of squeal's matrices", flush=True)
        seconds, projected = on_real_modes(system)
        lowest = np.sort(projected.imag[projected.imag > 1.0])
        end = 0.5 * (lowest[MODES - 1] + lowest[MODES]) / (2.0 * math.pi)
        start = time.process_time()
        answer = squeal.eigenvalues(system, band=(500.0, end), prove=False)
        counted = time.process_time() - start
        wanted = answer.values[answer.values.imag > 0.0]
        certified = "certified" if answer.certified else "not certified"
        print(f"squeal     {compared(counted, wanted, wanted, SAME)}, {certified}")
        print(f"real modes {compared(seconds, projected, wanted, ALIKE)}, to {ALIKE:g}")
        middle = 0.5j * (wanted.imag.min() + wanted.imag.max())
        write_parts(folder, system, middle, MODES + MARGIN)
        for way in ("slepc", "eigs"):
            if way == "slepc" and not has_slepc():
                print("left out: SLEPc, since python3-slepc4py-complex is not installed")
                continue
            took = float(run_way(way, folder).split()[0])
            roots = np.load(folder / f"{way}.npy")
            print(f"{way:10} {compared(took, roots, wanted, SAME)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
