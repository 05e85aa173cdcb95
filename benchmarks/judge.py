"""An older checkout against a newer one, and both against closed forms, by the command line alone.

`python -m benchmarks.judge OLD NEW [--only PART ...] [--known N]` asks both the same questions and
prints for each part what is missed, invented, wrongly certified or differs, and CPU seconds:

- known: random systems with closed-form thresholds (`tests.known`)
- shafts: shafts of unequal stiffness in their rotating frame, undamped and damped
- windows: modes that cross and flutter in a window as narrow as 1e-8
- factors: damping that a factor makes negative in a sharp window
- pads: thresholds and verdicts of the pads of `benchmarks.random_pads`
- motions: contact changes and final states
- times: medians of whole commands, start-up included
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import mmwrite
from scipy.sparse import coo_array

from benchmarks.random_pads import scene_of
from squeal.examples.brake import solid_brake
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from tests.known import known_system

CLOSE = 1e-8  # relative distance of a threshold that counts as found
REPEATS = 5
WORKER = """
import contextlib, io, json, sys, time
for line in sys.stdin:
    out, said = io.StringIO(), io.StringIO()
    start = time.process_time()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
        code = main(json.loads(line))
    seconds = time.process_time() - start
    print(json.dumps([code, out.getvalue(), said.getvalue(), seconds]), flush=True)
"""
Truth = tuple[float, str, str]  # value of the parameter, kind, direction


class Checkout:
    """Commands of one checkout, in one process of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        set_up = {"PYTHONPATH": str(self.folder), "OPENBLAS_NUM_THREADS": "1"}
        self.environment: dict[str, str] = os.environ | set_up
        entry = (self.folder / "squeal" / "__main__.py").read_text(encoding="utf-8")
        imported = next(line for line in entry.splitlines() if line.endswith("import main"))
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", imported + WORKER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=self.environment,
            cwd=self.folder,
        )
        self.seconds = 0.0

    def ask(self, *arguments: object) -> dict[str, Any]:
        """The JSON answer; of a command that ended badly its code and message."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        print(json.dumps([*map(str, arguments), "--json"]), file=self.process.stdin, flush=True)
        code, out, said, seconds = json.loads(self.process.stdout.readline())
        self.seconds += seconds
        return json.loads(out) if code == 0 else {"code": code, "said": said}

    def timed(self, *arguments: object) -> tuple[float, float]:
        """CPU and wall seconds of a command in a process of its own."""
        command = [sys.executable, "-P", "-m", "squeal", *map(str, arguments)]
        before = os.times()
        start = time.perf_counter()
        subprocess.run(
            command, capture_output=True, env=self.environment, check=True, cwd=self.folder
        )
        wall = time.perf_counter() - start
        after = os.times()
        return sum(after[2:4]) - sum(before[2:4]), wall


@dataclass
class Score:
    """What one checkout made of a part; certified answers that miss or invent some are wrong."""

    known: int = 0
    missed: int = 0
    invented: int = 0
    outside: int = 0
    wrong: int = 0
    failed: int = 0
    certified: int = 0
    rows: list[str] = field(default_factory=list)

    def judge(self, name: str, truth: list[Truth], found: dict[str, Any]) -> None:
        """Compare the crossings of an answer."""
        self.known += len(truth)
        if "crossings" not in found:
            self.failed += 1
            self.rows.append(f"{name}: {found['said'].strip()}")
            return
        left = list(found["crossings"])
        missed = []
        outside = 0
        for value, kind, direction in truth:
            near = [c for c in left if abs(c["mu"] - value) <= CLOSE * abs(value)]
            near = [c for c in near if (c["kind"], c["direction"]) == (kind, direction)]
            if not near:
                missed.append(f"{kind} {direction} at {value:.13g}")
                continue
            left.remove(near[0])
            low, high = near[0]["interval"]
            outside += not low <= value * (1 + 4e-16) or not high >= value * (1 - 4e-16)
        certified = found.get("certified") is True
        self.missed += len(missed)
        self.invented += len(left)
        self.outside += outside
        self.certified += certified
        self.wrong += certified and bool(missed or left)
        if missed or left or outside:
            more = [f"{c['kind']} {c['direction']} at {c['mu']:.13g}" for c in left]
            row = f"{name}: missed {missed}, invented {more}, {outside} intervals wrong"
            self.rows.append(row + ", certified" * certified)

    def __str__(self) -> str:
        judged = f"{self.missed} missed, {self.invented} invented, {self.outside} intervals wrong"
        proven = f"{self.certified} certified, {self.wrong} of them wrongly, {self.failed} failed"
        return f"{self.known} thresholds: {judged}; {proven}"


def write(folder: Path, name: str, parameter: str, **parts: list[tuple[Any, str]]) -> Path:
    """A system file with the terms (matrix, factor) of M, C and K."""
    document: dict[str, Any] = {"parameters": {parameter: 0.0}, "parameter": parameter}
    for part, terms in parts.items():
        document[part] = []
        for i, (matrix, factor) in enumerate(terms):
            mmwrite(folder / f"{name}-{part}{i}.mtx", coo_array(matrix), precision=17)
            document[part].append({"file": f"{name}-{part}{i}.mtx", "factor": factor})
        if not terms:
            del document[part]
    file = folder / f"{name}.yaml"
    file.write_text(json.dumps(document))
    return file


def terms_of(system: TermSystem) -> dict[str, list[tuple[Any, str]]]:
    """Matrices and factors of M, C and K."""

    def listed(terms: tuple[Term, ...]) -> list[tuple[Any, str]]:
        return [(term.matrix, getattr(term.factor, "text", "1")) for term in terms]

    return {"M": listed(system.M), "C": listed(system.C), "K": listed(system.K)}


Case = tuple[str, Path, list[Truth], float]


def known(folder: Path, count: int, largest: int) -> Iterator[Case]:
    """Systems of `tests.known`, of 2 to `largest` degrees of freedom."""
    for seed in range(count):
        rng = np.random.default_rng([seed, largest])
        n = int(np.exp(rng.uniform(np.log(2), np.log(largest + 1))))
        system, truth = known_system(n, rng, damped=bool(seed % 2))
        file = write(folder, f"known-{seed}", "mu", **terms_of(system))
        yield f"known {seed} ({n} rows)", file, [t[:3] for t in truth], 2.0


MIXED = 0.3 * np.random.default_rng(0).uniform(-1.0, 1.0, (4, 4)) + np.eye(4)  # of congruences


def shafts(folder: Path, count: int) -> Iterator[Case]:
    """M = I, C = 2 W J + d I, K = diag(k1, k2) - W^2 I, two of them in other coordinates.

    det K vanishes at W = sqrt(k1) and sqrt(k2). Undamped a real pair grows between them; with
    damping another real root grows from the second on, and no pair ever crosses the axis: the
    Hurwitz determinant vanishes where k1 + k2 < 2 W^2 alone.
    """
    for seed in range(count):
        rng = np.random.default_rng([seed, 15])
        k = np.sort(rng.uniform(1.0, 9.0, 4)).reshape(2, 2)
        d = 0.0 if seed % 2 == 0 else 0.02
        T = MIXED
        J = np.kron(np.eye(2), [[0.0, -1.0], [1.0, 0.0]])
        M = T.T @ np.eye(4) @ T
        G = T.T @ (2 * J) @ T
        K = T.T @ np.diag(k.ravel()) @ T
        C = [(G, "W")] + ([(d * M, "1")] if d else [])
        file = write(folder, f"shaft-{seed}", "W", M=[(M, "1")], C=C, K=[(K, "1"), (-M, "W**2")])
        ways = ("up", "up" if d else "down") * 2
        ends = np.sqrt(k.ravel()).tolist()
        truth = [(w, "divergence", way) for w, way in zip(ends, ways, strict=True)]
        yield f"shaft {seed} (k = {k.ravel().round(3)}, d = {d})", file, truth, 4.0


def windows(folder: Path, count: int) -> Iterator[Case]:
    """Two modes cross with slope s at p0 and flutter while |s (p - p0)| < 2 e; damped by c too."""
    for seed in range(count):
        rng = np.random.default_rng([seed, 16])
        e = 10.0 ** -(2 + 6 * seed / max(1, count - 1)) / 4
        p0 = rng.uniform(0.2, 1.8)
        k = rng.uniform(4.0, 6.0)
        s = rng.uniform(0.5, 2.0)
        c = e / 4 * (seed % 2)
        K0 = np.diag([k - s * p0, k, 7.0, 9.5])
        K1 = np.zeros((4, 4))
        T = MIXED
        K0[0, 1] = e
        K0[1, 0] = -e
        K1[0, 0] = s
        M = T.T @ np.eye(4) @ T
        C = [(c * M, "1")] if c else []
        K = [(T.T @ K0 @ T, "1"), (T.T @ K1 @ T, "p")]
        file = write(folder, f"window-{seed}", "p", M=[(M, "1")], C=C, K=K)
        half = np.sqrt(4 * e * e - 4 * c * c * k + c**4)
        low = p0 - (c * c + half) / s
        high = p0 + (half - c * c) / s
        truth = [(low, "flutter", "up"), (high, "flutter", "down")]
        yield f"window {seed} (2 e/s = {2 * e / s:.1e}, c = {c:.1e})", file, truth, 2.0


def factors(folder: Path, count: int) -> Iterator[Case]:
    """The damping 0.1 - 0.2/(1 + ((p - p0)/w)^2) is negative for |p - p0| < w."""
    for seed in range(count):
        rng = np.random.default_rng([seed, 17])
        p0 = round(rng.uniform(0.2, 1.8), 4)
        w = round(10.0 ** rng.uniform(-4, -1), 7)
        T = MIXED[:3, :3]
        diagonals = ([1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [2.0, 5.0, 8.0], [0.0, 0.2, 0.2])
        M, D, K, B = (T.T @ np.diag(d) @ T for d in diagonals)
        formula = f"0.1 - 0.2/(1 + ((p - {p0!r})/{w!r})**2)"
        C = [(B, "1"), (D, formula)]
        file = write(folder, f"factor-{seed}", "p", M=[(M, "1")], C=C, K=[(K, "1")])
        truth = [(p0 - w, "flutter", "up"), (p0 + w, "flutter", "down")]
        yield f"factor {seed} ({formula})", file, truth, 2.0


def closed_forms(cases: Iterator[Case], sides: list[Checkout]) -> None:
    """Both checkouts against the truth."""
    scores = [Score() for _ in sides]
    for name, file, truth, most in cases:
        for side, score in zip(sides, scores, strict=True):
            score.judge(name, truth, side.ask("critical-friction", file, "--max", most))
    for side, score in zip(sides, scores, strict=True):
        print(f"  {side.folder.name}: {score}; {side.seconds:.1f} s CPU")
    print("\n".join(f"    {row}" for row in scores[-1].rows))


def difference(one: dict[str, Any], other: dict[str, Any]) -> str:
    """What differs between two lists of thresholds, or nothing."""
    if "said" in one or "said" in other:
        failed = "said" in one and "said" in other
        return "" if failed else f"{one.get('said')!r}, now {other.get('said')!r}"
    before = [(point["kind"], point["mu"]) for point in one["critical"]]
    after = [(point["kind"], point["mu"]) for point in other["critical"]]
    end_before = one["mu_end"]
    end_after = other["mu_end"]
    same_kinds = [kind for kind, _ in before] == [kind for kind, _ in after]
    if not same_kinds or abs(end_before - end_after) > 1e-6:
        return f"{before} to {end_before:.9g}, now {after} to {end_after:.9g}"
    for (_, mu_before), (kind, mu) in zip(before, after, strict=True):
        close = 1e-6 if kind == "fold" else CLOSE
        if abs(mu_before - mu) > close * mu:
            return f"{before}, now {after}"
    return ""


def pads(folder: Path, count: int, sides: list[Checkout]) -> None:
    """Thresholds and verdicts of random pads."""
    rows = []
    for seed in range(count):
        file = folder / f"pad-{seed}.yaml"
        file.write_text(json.dumps(scene_of(seed).to_dict(), default=float))
        row = difference(*(s.ask("critical-friction", file, "--mu-max", 1) for s in sides))
        verdicts = [s.ask("eigenvalues", file).get("verdict", "none") for s in sides]
        if row or verdicts[0] != verdicts[1]:
            rows.append(f"    pad {seed}: {row} {verdicts}")
    cpu = ", ".join(f"{s.folder.name} {s.seconds:.1f} s" for s in sides)
    print("\n".join([f"  {count} pads, {len(rows)} differ; CPU {cpu}", *rows]))


def motions(folder: Path, count: int, sides: list[Checkout]) -> None:
    """Contact changes and final states of pads that are kicked."""
    rows = []
    changes = 0
    for seed in range(count):
        scene = scene_of(seed)
        document = scene.to_dict()
        period = float(np.sqrt(scene.pad.m / scene.pad.k1))
        kick = 0.3 * scene.pad.F_n / scene.pad.k1 / period * np.random.default_rng(seed).uniform()
        document["initial"] = {"from": "equilibrium", "y_dot": float(kick)}
        document["time"] = {"stop": 60 * period, "samples": 11}
        document["outputs"] = ["events", "shares"]
        file = folder / f"motion-{seed}.yaml"
        file.write_text(json.dumps(document, default=float))
        one, other = (s.ask("simulate", file) for s in sides)
        if "said" in one or "said" in other:
            if ("said" in one) != ("said" in other):
                rows.append(f"    motion {seed}: {one.get('said')!r}, now {other.get('said')!r}")
            continue
        changes += len(one["events"])
        a = [one["final"][n] for n in ("x", "y", "theta")]
        b = [other["final"][n] for n in ("x", "y", "theta")]
        s = [e["t"] / period for e in one["events"]]
        t = [e["t"] / period for e in other["events"]]
        names = [(e["from"], e["to"]) for e in one["events"]]
        names_now = [(e["from"], e["to"]) for e in other["events"]]
        if names != names_now:
            rows.append(f"    motion {seed}: {len(names)} changes, now {len(names_now)}")
        elif not np.allclose(s, t, atol=1e-7, rtol=0) or not np.allclose(a, b, rtol=1e-6, atol=0):
            rows.append(f"    motion {seed}: final {a}, now {b}")
    print("\n".join([f"  {count} motions, {changes} changes, {len(rows)} differ", *rows]))


def brake(folder: Path, rows: int) -> Path:
    """The files of a brake of solids."""
    system = solid_brake(rows).system
    file = write(folder, f"brake-{rows}", "mu", **terms_of(system))
    document = json.loads(file.read_text()) | {"parameters": dict(system.parameters)}
    file.write_text(json.dumps(document))
    return file


def times(folder: Path, rows: int, sides: list[Checkout]) -> None:
    """Medians of whole commands."""
    scenes = Path(__file__).parent.parent / "tests" / "scenes"
    b1 = scenes / "b1-c.yaml"
    b2 = scenes / "b2-c.yaml"
    b3 = scenes / "b3.yaml"
    questions: dict[str, tuple[object, ...]] = {
        **{f"{name}, B1": (name, b1) for name in ("critical-friction", "eigenvalues", "simulate")},
        **{f"{name}, B2": (name, b2) for name in ("critical-friction", "simulate")},
        "map 40 x 40, B2": ("map", b2, "--n", 40),
        "map 300 x 300, B3": ("map", b3, "--n", 300),
        "map 1000 x 1000, B3": ("map", b3, "--n", 1000),
    }
    if rows:
        file = brake(folder, rows)
        band = ["--band", "500:5000"]
        questions[f"eigenvalues, {rows} rows"] = ("eigenvalues", file, *band)
        thresholds = ("critical-friction", file, *band, "--max", 1)
        questions[f"critical-friction, {rows} rows"] = thresholds
    print(f"  {'CPU and wall, s':28s}" + "".join(f"{s.folder.name:>18s}" for s in sides))
    for name, question in questions.items():
        taken: list[list[tuple[float, float]]] = [[] for _ in sides]
        for _ in range(1 if "rows" in name else REPEATS):
            for side, row in zip(sides, taken, strict=True):
                row.append(side.timed(*question))
        medians = [[statistics.median(column) for column in zip(*row)] for row in taken]  # noqa: B905
        cells = "".join(f"{cpu:10.2f}{wall:8.2f}" for cpu, wall in medians)
        print(f"  {name:28s}{cells}  x {medians[-1][0] / medians[0][0]:.2f}", flush=True)


def main() -> int:
    """Judge."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.judge", description=__doc__)
    parser.add_argument("checkouts", type=Path, nargs=2, metavar="OLD NEW")
    parser.add_argument("--only", nargs="+", help="these parts alone")
    parser.add_argument("--known", type=int, default=1000, help="systems of the first part")
    parser.add_argument("--largest", type=int, default=200, help="rows of the largest")
    parser.add_argument("--rows", type=int, default=6000, help="of the brake of solids; 0: none")
    given = parser.parse_args()
    sides = [Checkout(folder) for folder in given.checkouts]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts: dict[str, Callable[[], None]] = {
            "known": lambda: closed_forms(known(folder, given.known, given.largest), sides),
            "shafts": lambda: closed_forms(shafts(folder, 16), sides),
            "windows": lambda: closed_forms(windows(folder, 24), sides),
            "factors": lambda: closed_forms(factors(folder, 36), sides),
            "pads": lambda: pads(folder, 140, sides),
            "motions": lambda: motions(folder, 40, sides),
            "times": lambda: times(folder, given.rows, sides),
        }
        for part in given.only or parts:
            for side in sides:
                side.seconds = 0.0
            print(part, flush=True)
            parts[part]()
    for side in sides:
        side.process.communicate()
    return 0


if __name__ == "__main__":
    sys.exit(main())
