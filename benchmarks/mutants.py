"""Random mutants of rooms, each against the tests of its room: which does no test notice?

`python -m benchmarks.mutants [--count 150] [--rooms linear ...] [--seed 0] [--seconds 120]` changes
one comparison, sign, constant, boolean or return of a copy of the tree, runs tests/ROOM in it with
-x, then the folders of WIDER, and prints the mutants that survive all. A run that takes too much
CPU time has noticed.
"""

from __future__ import annotations

import argparse
import ast
import functools
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
ROOMS = ("linear", "sparse", "equilibrium", "simulation", "io")
WIDER = ("analysis", "two_ways", "cli")
COMPARED: dict[type[ast.cmpop], type[ast.cmpop]] = {
    **{ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq},
    **{ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn},
}
SIGNS: dict[type[ast.operator], type[ast.operator]] = {
    **{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult},
}
Change = tuple[ast.AST, str, Callable[[ast.AST], None]]


def _set(name: str, value: object) -> Callable[[ast.AST], None]:
    return lambda node: setattr(node, name, value)


def changes(tree: ast.AST) -> Iterator[Change]:
    """Every change of one node; annotations, docstrings and messages are left alone."""
    quiet: set[ast.AST] = set()
    for node in ast.walk(tree):
        roots = [getattr(node, "annotation", None), getattr(node, "returns", None)]
        roots += [node.exc] if isinstance(node, ast.Raise) else []
        roots += node.decorator_list if isinstance(node, ast.FunctionDef | ast.ClassDef) else []
        roots += [node] if isinstance(node, ast.JoinedStr) else []
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
            value = node.value
            yield (
                node,
                "constant",
                _set("value", value + 1 if isinstance(value, int) else 2 * value or 1.0),
            )
        elif isinstance(node, ast.Return) and node.value is not None:
            none = isinstance(node.value, ast.Constant) and node.value.value is None
            yield node, "return", _set("value", ast.Constant(0.0 if none else None))


def mutant(file: Path, which: int) -> tuple[str, str]:
    """The text of a file with one change, and what it is."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    node, kind, apply = list(changes(tree))[which]
    before, place = ast.unparse(node), f"{file.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}"
    apply(node)
    return ast.unparse(tree), f"{place}: {kind}: {before}  ->  {ast.unparse(node)}"


def noticed(folder: Path, tests: list[str], seconds: int) -> bool:
    """Does a test of the copy fail?"""
    command = [sys.executable, "-P", "-m", "pytest", "-n0", "-xq", "-pno:cacheprovider"]
    environment = {**os.environ, "PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1"}
    limit = functools.partial(resource.setrlimit, resource.RLIMIT_CPU, (seconds, seconds))
    done = subprocess.run(
        ["nice", "-n", "10", *command, *tests],
        cwd=folder,
        env=environment,
        capture_output=True,
        preexec_fn=limit,
        check=False,
    )
    return done.returncode != 0


def main() -> int:
    """Print survivors and the share that is noticed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mutants", description=__doc__)
    parser.add_argument("--count", type=int, default=150)
    parser.add_argument("--rooms", nargs="+", default=ROOMS)
    parser.add_argument(
        "--wider", nargs="*", default=WIDER, help="folders of tests after tests/ROOM"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=int, default=200, help="CPU of a run")
    given = parser.parse_args()
    choice, killed = random.Random(given.seed), Counter[str]()
    pools = {}
    for room in given.rooms:
        files = sorted((ROOT / "squeal" / room).rglob("*.py"))
        counts = [len(list(changes(ast.parse(f.read_text(encoding="utf-8"))))) for f in files]
        pools[room] = [(f, k) for f, n in zip(files, counts, strict=True) for k in range(n)]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "tree"
        skipped = shutil.ignore_patterns(
            ".git", ".venv", ".*_cache", "__pycache__", "results", "_build"
        )
        shutil.copytree(ROOT, folder, ignore=skipped)
        for i in range(given.count):
            room = given.rooms[i % len(given.rooms)]
            file, which = choice.choice(pools[room])
            text, what = mutant(file, which)
            copied = folder / file.relative_to(ROOT)
            copied.write_text(text, encoding="utf-8")
            suites = (f"tests/{name}" for name in dict.fromkeys([room, *given.wider]))
            seen = next((one for one in suites if noticed(folder, [one], given.seconds)), "")
            shutil.copy(file, copied)
            killed.update({room: int(bool(seen)), f"{room} of": 1})
            print(f"{i:4d} {seen or 'SURVIVED':18} {what}", flush=True)
    for room in given.rooms:
        print(f"{room}: {killed[room]} of {killed[room + ' of']}")
    total = sum(killed[room] for room in given.rooms)
    print(f"{total} of {given.count} killed, {total / given.count:.0%}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
