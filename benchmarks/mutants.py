"""Random mutants of rooms, each against the tests that run its line: which does no test notice?

`python -m benchmarks.mutants [--count 150] [--rooms linear ...] [--seed 0] [--seconds 90]` runs the
tests once under coverage (kept in .mutants_cache/, `--again` renews it), then changes one
comparison, sign, constant, boolean or return of a copy of the tree, runs the tests that reach that
line, the quickest first and no more than `--seconds` of them, with -x, and prints the mutants that
survive. A line that only set-up reaches is tried by the tests of its room; a run of three times
its usual CPU time has noticed. It needs the package `coverage`.

With `--judge` a survivor then meets the other tests of its line and what `LONG` names for its room:
closed forms, brute force, one question in two ways at new places. Where all answer as without the
change, the ratio of their CPU time tells what the change costs. Numbers of a module constant or an
options record are counted apart too, as settings: most say how much work is done.
"""

from __future__ import annotations

import argparse
import ast
import functools
import itertools
import os
import queue
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import xml.etree.ElementTree as ET
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parent.parent
ROOMS = ("linear", "sparse", "equilibrium", "simulation", "io")
SUITES = (
    *ROOMS,
    "model",
    "numerics",
    "analysis",
    "two_ways",
    "cli",
    "plots",
    "docs",
    "article",
    "test_doctests.py",
)
COMPARED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    **{ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq},
    **{ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn},
}
SIGNS: dict[type[ast.operator], type[ast.operator]] = {
    **{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult},
}
PLACES = {"TWO_WAYS": "150"}  # drawn anew
LONG = {
    "closed forms": ("linear", "benchmarks.known_thresholds 60 30"),
    "narrow windows": ("linear", "benchmarks.judge . . --only shafts windows factors"),
    "brute force": ("equilibrium", "benchmarks.brute_force --points 36 --pads 1"),
    "maps": ("equilibrium linear", "benchmarks.map_query --places 60"),
    "motions": ("simulation", "benchmarks.random_motions --motions 40 --workers 1"),
    "pads and matrices": ("linear io", "pytest tests/two_ways/test_matrices_and_pads.py"),
    "sweeps": ("linear equilibrium", "pytest tests/two_ways/test_sweep_and_thresholds.py"),
    "reduced and full": ("sparse io", "pytest tests/two_ways/test_reduced_and_full.py"),
    "two motions": ("simulation", "pytest tests/two_ways/test_forms_and_motions.py"),
}  # by rooms
FAR = 1000  # a tolerance that may be doubled unnoticed is as it should be
Change = tuple[ast.AST, str, Callable[[ast.AST], None]]


def _set(name: str, value: object) -> Callable[[ast.AST], None]:
    return lambda node: setattr(node, name, value)


def changes(tree: ast.AST) -> Iterator[Change]:
    """Every change of one node; annotations, docstrings, messages and `strict=` are left alone, and
    what no answer depends on: -1 as a length of `reshape`, where NumPy reads any negative number
    alike, seeds, and how often at most a `for _ in range(...)` repeats what has converged."""
    quiet: set[ast.AST] = set()
    for node in ast.walk(tree):
        roots = [getattr(node, "annotation", None), getattr(node, "returns", None)]
        roots += [node.exc] if isinstance(node, ast.Raise) else []
        roots += node.decorator_list if isinstance(node, ast.FunctionDef | ast.ClassDef) else []
        roots += [node] if isinstance(node, ast.JoinedStr) else []
        roots += [node.value] if isinstance(node, ast.keyword) and node.arg == "strict" else []
        if isinstance(node, ast.Call) and getattr(node.func, "attr", None) == "reshape":
            roots += [one.operand for one in node.args if isinstance(one, ast.UnaryOp)]
        if isinstance(node, ast.Call) and getattr(node.func, "attr", None) == "default_rng":
            roots += node.args
        if isinstance(node, ast.For) and getattr(node.target, "id", None) == "_":
            roots += [node.iter]
        quiet.update(inner for root in roots if root is not None for inner in ast.walk(root))
    for node in ast.walk(tree):
        if node in quiet:
            continue
        if isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARED:
            ops = [COMPARED[type(node.ops[0])](), *node.ops[1:]]
            yield node, "comparison", _set("ops", ops)
        elif isinstance(node, ast.BinOp) and type(node.op) in SIGNS:
            yield node, "sign", _set("op", SIGNS[type(node.op)]())
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            yield node, "sign", _set("op", ast.UAdd())
        elif isinstance(node, ast.BoolOp):
            yield (
                node,
                "boolean",
                _set("op", ast.Or() if isinstance(node.op, ast.And) else ast.And()),
            )
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
            yield node, "boolean", _set("value", not node.value)
        elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            value = node.value  # an index or power by one, what a number is tuned to by far
            moved = value + 1 if value in range(4) else value * FAR or 1.0
            yield node, "constant", _set("value", type(value)(moved))
        elif isinstance(node, ast.Return) and node.value is not None:
            none = isinstance(node.value, ast.Constant) and node.value.value is None
            yield node, "return", _set("value", ast.Constant(0.0 if none else None))


def _is_setting(tree: ast.Module, node: ast.AST) -> bool:
    """Whether it belongs to a number that a module constant or a field of options is set to."""
    given = list(tree.body)
    for one in tree.body:
        given += one.body if isinstance(one, ast.ClassDef) and one.name.endswith("Options") else []
    values = [x.value for x in given if isinstance(x, ast.Assign | ast.AnnAssign) and x.value]
    parts = [list(ast.walk(value)) for value in values]
    number = ast.Constant | ast.BinOp | ast.UnaryOp | ast.operator | ast.unaryop
    return any(node in own and all(isinstance(x, number) for x in own) for own in parts)


def mutant(file: Path, which: int) -> tuple[str, str, range]:
    """The text of a file with one change, what it is, and the lines of its statement."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    node, kind, apply = list(changes(tree))[which]
    line = getattr(node, "lineno", 0)
    holders = [
        one for one in ast.walk(tree)
        if isinstance(one, ast.stmt) and one.lineno <= line <= (one.end_lineno or 0)
    ]  # fmt: skip
    inner = max(holders, key=lambda one: one.lineno)
    end = getattr(inner, "body", [inner])[0]
    last = end.lineno if end is not inner else inner.end_lineno or line
    before, place = ast.unparse(node), f"{file.relative_to(ROOT)}:{line}"
    place += ": setting" if _is_setting(tree, node) else ""
    apply(node)
    lines = range(min(inner.lineno, line), max(last, line) + 1)
    return ast.unparse(tree), f"{place}: {kind}: {before}  ->  {ast.unparse(node)}", lines


def _node(test: str) -> str:
    """tests.linear.test_terms.test_sums as pytest takes it."""
    parts = test.split(".")
    depth = next(k for k, part in enumerate(parts) if k and part.startswith("test_"))
    return "/".join(parts[: depth + 1]) + ".py::" + "::".join(parts[depth + 1 :])


def _run(folder: Path, given: list[str], seconds: int) -> tuple[int, str, float]:
    """Run a module of a tree; its code, its output without run times and rounding, the seconds of
    CPU it took, at most `seconds`."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1", **PLACES}
    limit = functools.partial(resource.setrlimit, resource.RLIMIT_CPU, (seconds, seconds))
    with tempfile.TemporaryFile("w+") as out:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", *given],
            cwd=folder,
            env=environment,
            stdout=out,
            stderr=subprocess.DEVNULL,
            preexec_fn=limit,
            start_new_session=True,
        )
        endless = threading.Timer(60 + 20 * seconds, os.killpg, (process.pid, signal.SIGKILL))
        endless.start()  # what waits for ever takes no CPU time
        _, status, used = os.wait4(process.pid, 0)
        endless.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        said = re.sub(r"[\d.]+ (s CPU|CPU s)|[\d.]+e-\d+( \(seed \d+\))?", "", out.read())
        said = said.replace(folder.name, "")
    return process.returncode, said, used.ru_utime + used.ru_stime


def _pytest(folder: Path, tests: list[str], seconds: int) -> int:
    return _run(folder, ["pytest", "-x", "-n0", "-q", "-pno:cacheprovider", *tests], seconds)[0]


@functools.cache
def _unchanged(name: str) -> tuple[int, str, float]:
    return _run(ROOT, _long(name), 7200)


def _long(name: str) -> list[str]:
    given = LONG[name][1].split()
    return [*given, "-n0", "-q", "-pno:cacheprovider"] if given[0] == "pytest" else given


def judged(folder: Path, room: str, others: list[str]) -> str:
    """What notices a survivor in this tree, else the ratio of CPU time."""
    if others and _pytest(folder, others, 1800):
        return "KILLED by the other tests of its line"
    ratios = []
    for name, (rooms, _) in LONG.items():
        if room in rooms.split():
            code, said, seconds = _unchanged(name)
            found = _run(folder, _long(name), 60 + 4 * int(seconds))
            if found[0] != code or (said != found[1] and LONG[name][1].startswith("bench")):
                return f"KILLED by {name}"
            ratios.append(f"{name} {found[2] / seconds:.2f}")
    return f"answers as before; CPU: {', '.join(ratios)}"


def reached(again: bool) -> tuple[dict[tuple[str, int], set[str]], dict[str, float]]:
    """The tests that run each line of the toolkit, and the seconds of each test."""
    kept = ROOT / ".mutants_cache"
    data, times = kept / "coverage", kept / "times.xml"
    if again or not times.exists():
        kept.mkdir(exist_ok=True)
        (kept / "rc").write_text(
            f"[run]\ndynamic_context = test_function\nsource = {ROOT / 'squeal'}\n"
            f"data_file = {data}\nomit = */article/*\n"
        )
        run = ["coverage", "run", f"--rcfile={kept / 'rc'}", "-m", "pytest", f"--junitxml={times}"]
        run += ["-n0", "-q", "-pno:cacheprovider", *(f"tests/{name}" for name in SUITES)]
        _run(ROOT, run, 7200)
    seconds: dict[str, float] = defaultdict(float)
    cases = list(ET.parse(times).iter("testcase"))
    for case in cases:
        seconds[f"{case.get('classname')}.{str(case.get('name')).split('[')[0]}"] += float(
            case.get("time", 0)
        )
    for case in cases:  # what fails here without a change notices none
        if {part.tag for part in case} & {"failure", "error"}:
            seconds.pop(f"{case.get('classname')}.{str(case.get('name')).split('[')[0]}", None)
    tests = defaultdict(set)
    from coverage import CoverageData

    with_lines = CoverageData(str(data))
    with_lines.read()
    for file in with_lines.measured_files():
        for line, names in with_lines.contexts_by_lineno(file).items():
            tests[str(Path(file).relative_to(ROOT)), line] = set(names) & set(seconds)
    return tests, seconds


def main() -> int:
    """Print survivors and the share that is noticed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mutants", description=__doc__)
    parser.add_argument("--count", type=int, default=150)
    parser.add_argument("--rooms", nargs="+", default=ROOMS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=90, help="of tests for one mutant")
    parser.add_argument("--again", action="store_true", help="ask anew which test runs which line")
    parser.add_argument("--judge", action="store_true", help="try survivors at length")
    parser.add_argument("--workers", type=int, default=1)
    given = parser.parse_args()
    choice, killed = random.Random(given.seed), Counter[str]()
    tests, cost = reached(given.again)
    pools, of_room = {}, {}
    for room in given.rooms:
        own = [one for one in cost if one.startswith(f"tests.{room}.")]
        of_room[room] = [_node(one) for one in sorted(own, key=cost.__getitem__)]
        files = sorted((ROOT / "squeal" / room).rglob("*.py"))
        counts = [len(list(changes(ast.parse(f.read_text(encoding="utf-8"))))) for f in files]
        pools[room] = [(f, k) for f, n in zip(files, counts, strict=True) for k in range(n)]
    drawn = [
        (i, room, *choice.choice(pools[room]))
        for i, room in zip(range(given.count), itertools.cycle(given.rooms), strict=False)
    ]

    def tried(longer: bool, i: int, room: str, file: Path, which: int) -> bool:
        """Whether the tests of a mutant notice it; the long ones say so themselves."""
        text, what, lines = mutant(file, which)
        of_file = file.relative_to(ROOT)
        ordered = sorted(
            {one for line in lines for one in tests.get((str(of_file), line), ())},
            key=cost.__getitem__,
        )
        total = list(itertools.accumulate(cost[one] for one in ordered))
        chosen = [
            _node(x) for x, sofar in zip(ordered, total, strict=True) if sofar < given.seconds
        ]
        folder = free.get()
        (folder / of_file).write_text(text, encoding="utf-8")
        if longer:
            seen = judged(folder, room, [_node(one) for one in ordered[len(chosen) :]])
            noticed = seen.startswith("KILLED")
        else:
            limit = 30 + 3 * int(min(total[-1], given.seconds) if total else given.seconds)
            noticed = bool(_pytest(folder, chosen or of_room[room], limit))
            seen = f"{'killed' if noticed else 'SURVIVED':8} of {len(chosen):3d}"
            parts = room, "settings" if ": setting: " in what else "the rest", "all"
            killed.update(dict.fromkeys(parts, int(noticed)))
            killed.update(f"{part} of" for part in parts)
        shutil.copy(file, folder / of_file)
        free.put(folder)
        print(f"{i:4d} {seen} {what}", flush=True)
        return noticed

    free = queue.Queue[Path]()
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(given.workers) as pool:
        skipped = shutil.ignore_patterns(
            ".git", ".venv", ".*_cache", "__pycache__", "results", "_build"
        )
        for k in range(given.workers):
            free.put(Path(shutil.copytree(ROOT, Path(name) / str(k) / "tree", ignore=skipped)))
        noticed = pool.map(lambda each: tried(False, *each), drawn)
        left = [each for each, seen in zip(drawn, noticed, strict=True) if not seen]
        for part in (*given.rooms, "settings", "the rest", "all"):
            count = killed[f"{part} of"]
            print(f"{part}: {killed[part]} of {count} killed, {killed[part] / max(count, 1):.0%}")
        if given.judge:
            longer = sum(pool.map(lambda each: tried(True, *each), left))
            print(f"{longer} of the {len(left)} that survive killed at length")
    return 0


if __name__ == "__main__":
    sys.exit(main())
