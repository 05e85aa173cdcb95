"""Motions of case (d) with damping in the contact alone: `python -m benchmarks.contact_damping`.

Does the cycle beside stable sliding need a damping that acts in flight too? Two kinds without one:

- Hunt and Crossley's: each contact point bears with k p max(0, 1 + a dp/dt), p its penetration,
  and nothing else is damped;
- weighted: the modal damping matrix of the study `onset`, times the contact force over that of
  sliding. Sliding then has the same eigenvalues, and a motion in flight has no damping.

Printed are modal damping ratios, the growth rate of sliding, and of random initial conditions how
many still lose contact much later, with the lower face slower than the surface. The equations are
the article's, written out once more in C (contact_damping.c, needs gcc), with nothing of squeal.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import yaml
from scipy.optimize import brentq, root

HERE = Path(__file__).resolve().parent
SCENES = HERE.parent / "workflow" / "scenes"
CASES = {"b1-d": 2.2e-4, "b2-d": 3.54e-4}  # with the periods of their cycles, s
STARTS = 24
STEP = 5e-7
SIZES = np.array([1.0, 1.0, 25.0])  # of x, y in 1e-5 m, theta

NAMES = (
    *("model", "m", "w", "h", "I", "k1", "k2", "L1", "L2", "F_n", "alpha1", "alpha2", "y0"),
    *("k3", "k4", "mu", "V", "a"),
)
Place = np.ndarray


class Brake(ctypes.Structure):
    """The parameters, as in contact_damping.c."""

    _fields_ = (
        *((name, ctypes.c_double) for name in NAMES),
        ("C", ctypes.c_double * 9),
        ("reference", ctypes.c_double),
    )


def library(folder: str) -> ctypes.CDLL:
    """The compiled equations."""
    file = f"{folder}/contact_damping.so"
    options = ["-O3", "-march=native", "-ffast-math", "-shared", "-fPIC", "-o", file]
    subprocess.run(["gcc", *options, str(HERE / "contact_damping.c"), "-lm"], check=True)
    program = ctypes.CDLL(file)
    program.march.argtypes = [
        ctypes.c_void_p, ctypes.c_void_p, ctypes.c_long, ctypes.c_double, ctypes.c_void_p,
    ]  # fmt: skip
    return program


class Case:
    """A case at a friction with a kind and a size of damping."""

    def __init__(
        self, program: ctypes.CDLL, name: str, mu: float, a: float = 0.0, ratio: float = 0.0
    ) -> None:
        scene = yaml.safe_load((SCENES / f"{name}.yaml").read_text(encoding="utf-8"))
        given = {"y0": 0.0} | scene["parameters"]
        given["k3"] = given.pop("k_c", given.get("k3"))
        for angle in ("alpha1", "alpha2"):
            given[angle] = float(str(given[angle]).removesuffix("*pi")) * np.pi
        self.program = program
        self.period = CASES[name]
        self.brake = Brake(model=float(scene["model"][1]), **given)
        self.masses = np.array([self.brake.m, self.brake.m, self.brake.I])
        self.brake.a = a
        self.brake.mu = 0.0
        if ratio:  # of the modes without friction
            roots = np.sqrt(self.masses)
            stiffness = self.matrices(self.sliding())[0] / np.outer(roots, roots)
            squares, modes = np.linalg.eigh((stiffness + stiffness.T) / 2)
            C = (modes * 2 * ratio * np.sqrt(squares)) @ modes.T * np.outer(roots, roots)
            self.brake.C[:] = C.ravel().tolist()
        self.without_friction = self.eigenvalues()
        self.brake.mu = mu

    def loads(self, place: Place, speed: Place) -> tuple[np.ndarray, float]:
        """Loads (3,) and the contact force."""
        state = np.concatenate([place, speed])
        rates = np.empty(6)
        gaps = np.empty(2)
        force = np.empty(1)
        pointers = (one.ctypes.data_as(ctypes.c_void_p) for one in (state, rates, gaps, force))
        self.program.rates(ctypes.byref(self.brake), *pointers)
        return rates[3:] * self.masses, float(force[0])

    def sliding(self) -> Place:
        """The sliding equilibrium."""
        scale = 1e-5 * SIZES
        found = root(
            lambda u: self.loads(u * scale, np.zeros(3))[0] * SIZES / self.brake.F_n,
            [0.0, -1.0, 0.0],
            tol=1e-13,
        )
        return np.asarray(found.x * scale)

    def matrices(self, place: Place) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and damping (3, 3) about rest, by differences."""
        still = np.zeros(3)
        columns = []
        for e in np.diag(1e-9 * SIZES):
            by_place = self.loads(place - e, still)[0] - self.loads(place + e, still)[0]
            by_speed = self.loads(place, -1e5 * e)[0] - self.loads(place, 1e5 * e)[0]
            columns.append((by_place / (2 * e.max()), by_speed / (2e5 * e.max())))
        K, C = (np.transpose(each) for each in zip(*columns, strict=True))
        return K, C

    def eigenvalues(self) -> np.ndarray:
        """The three of the sliding equilibrium with positive imaginary parts."""
        K, C = self.matrices(self.sliding()) / self.masses[:, None]
        values = np.linalg.eigvals(np.block([[np.zeros((3, 3)), np.eye(3)], [-K, -C]]))
        return np.asarray(values[values.imag > 0.0])

    @property
    def growth(self) -> float:
        """The greatest growth rate about sliding, 1/s."""
        return float(self.eigenvalues().real.max())

    def lasting(self, time: float) -> tuple[int, int]:
        """How many motions still lose contact after a time, and how many are as fast as V."""
        b = self.brake
        rest = self.sliding()
        reach = 3.0 * b.F_n / (b.k3 + b.k4) * np.array([1.0, 1.0, 1.0 / b.w])
        reach = np.append(reach, reach * np.sqrt(b.k1 / b.m))
        drawn = np.random.default_rng(1).uniform(-1.0, 1.0, (STARTS, 6))
        lasting = fast = 0
        for state in np.append(rest, np.zeros(3)) + drawn * reach:
            seen = np.empty(3)
            for length in (time, 20 * self.period):
                pointers = (one.ctypes.data_as(ctypes.c_void_p) for one in (state, seen))
                z, out = pointers
                self.program.march(ctypes.byref(b), z, round(length / STEP), STEP, out)
            fast += int(not seen[2] < b.V)
            lasting += int(0.0 < seen[0] < 1.0 and seen[2] < b.V)
        return lasting, fast


def growth_at(program: ctypes.CDLL, name: str, a: float, mu: float) -> float:
    """The growth rate about sliding over friction, 1/s."""
    return Case(program, name, mu, a).growth


def main() -> None:
    """Compile, run and print."""
    with tempfile.TemporaryDirectory() as folder:
        program = library(folder)
        for name in CASES:
            print(f"{name}: Hunt and Crossley's contact, a in s/m")
            for a in (0.01, 0.1, 0.3):
                case = Case(program, name, 0.320313, a)
                ratios = np.sort(-case.without_friction.real / np.abs(case.without_friction))
                onset = brentq(partial(growth_at, program, name, a), 0.05, 0.2)
                print(f"  a = {a:g}: damping ratios {np.round(100 * ratios, 3)} %")
                print(f"    sliding flutters from mu = {onset:.4f}; growth {case.growth:.1f}/s")
                print("    lasting, as fast as V:", *case.lasting(0.15), "of", STARTS, flush=True)
            print(f"{name}: modal damping everywhere, and weighted by the contact force")
            for ratio in (0.001, 0.005, 0.01, 0.02, 0.03):
                case = Case(program, name, 0.320313, ratio=ratio)
                time = max(0.1, 1e-3 / ratio)
                row = [case.lasting(time)]
                case.brake.reference = case.loads(case.sliding(), np.zeros(3))[1]
                row.append(case.lasting(time))
                print(
                    f"  {100 * ratio:g} %: growth {case.growth:.1f}/s; lasting, fast:",
                    *row,
                    flush=True,
                )


if __name__ == "__main__":
    main()
