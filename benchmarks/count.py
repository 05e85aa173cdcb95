"""What the house counts: lines, files, constants, gauges of folded code, circles, modules that run.

`python -m benchmarks.count [CHECKOUT]` counts the folder `squeal` of a checkout (this one if left
out) and runs two queries in it to count the modules of the package whose functions they run.
"""

from __future__ import annotations

import argparse
import ast
import graphlib
import io
import json
import os
import subprocess
import sys
import tempfile
import tokenize
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
from scipy.io import mmwrite
from scipy.sparse import coo_array, diags_array, eye_array

# a module runs if one of its functions does; bodies of modules and classes do not count
TRACED = """
import contextlib, io, json, sys
from pathlib import Path
root, seen = str(Path("squeal").resolve()) + "/", set()
def profile(frame, event, _):
    code = frame.f_code
    if event == "call" and code.co_flags & 2 and code.co_filename.startswith(root):
        seen.add((code.co_filename[len(root):], code.co_qualname))
sys.setprofile(profile)
with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
    code = main(json.loads(sys.argv[1]))
sys.setprofile(None)
files = {}
for file, name in seen:
    files[file] = files.get(file, 0) + 1
print(json.dumps([code, files]))
"""
NAMES = {
    "finds thresholds": ("thresholds", "critical_friction", "first_losses"),
    "judges": ("judge", "judgement", "verdict", "decided", "decide", "verdict_of", "judged"),
    "rounding of roots": ("axis_noise", "noise_of", "noise_at", "standard_noise", "slow_noise"),
    "first-order form": ("first_order", "state_matrices", "companion", "linearised"),
    "follows a branch": ("follow", "branch_ends", "continued"),
    "Newton's method": ("newton", "newton_batch", "solve_balance", "solved"),
    "bisection": ("bisect", "bisected", "bisection", "halved"),
}


UPWARDS = ("squeal.io.writing", "squeal.plots.answers")
"""The one import upwards: `Answer.plot` draws, and a result loads no plot before."""
LAYOUT = {
    tokenize.COMMENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
    tokenize.INDENT,
    tokenize.NEWLINE,
    tokenize.NL,
}
COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


@dataclass
class Gauges:
    """What a reader of a file has to unfold; sums of several add.

    `tokens` and `code_lines` leave out comments, docstrings and empty lines. `paired_assignments`
    are those of several values to several names at once (a swap is none), `any_in_signatures`
    parameters and returns whose type is Any, `string_imports` modules of this package that are
    loaded by a name that no checker sees.
    """

    tokens: int = 0
    code_lines: int = 0
    paired_assignments: int = 0
    comprehensions: int = 0
    conditional_expressions: int = 0
    any_in_signatures: int = 0
    locals_calls: int = 0
    string_imports: int = 0

    def __add__(self, other: Gauges) -> Gauges:
        return Gauges(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))

    def table(self) -> dict[str, float]:
        """The gauges by what they are called: counts, and shares of the code lines."""
        thousands = self.code_lines / 1000
        return {
            "tokens": self.tokens,
            "tokens a code line": self.tokens / self.code_lines,
            "paired assignments per 1,000 code lines": self.paired_assignments / thousands,
            "comprehensions per 1,000 code lines": self.comprehensions / thousands,
            "conditional expressions per 1,000 code lines": (
                self.conditional_expressions / thousands
            ),
            "Any in signatures": self.any_in_signatures,
            "calls of locals()": self.locals_calls,
            "modules of our own loaded by a string": self.string_imports,
        }


def gauges(text: str) -> Gauges:
    """The gauges of a module's text."""
    tree = ast.parse(text)
    docstrings = _docstring_starts(tree)
    found = Gauges()
    lines = set[int]()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in LAYOUT and token.start not in docstrings:
            found.tokens += 1
            lines.update(range(token.start[0], token.end[0] + 1))
    found.code_lines = len(lines)
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            found.paired_assignments += _pairs(node)
        elif isinstance(node, COMPREHENSIONS):
            found.comprehensions += 1
        elif isinstance(node, ast.IfExp):
            found.conditional_expressions += 1
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            found.any_in_signatures += _any_in_signature(node)
        elif isinstance(node, ast.Call):
            name = (
                node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
            )
            found.locals_calls += name == "locals"
            found.string_imports += name in ("import_module", "__import__") and _own(node.args)
    return found


def _docstring_starts(tree: ast.Module) -> set[tuple[int, int]]:
    """Where strings begin that stand as statements."""
    starts = set()
    for node in ast.walk(tree):
        if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Constant):
            continue
        if isinstance(node.value.value, str):
            starts.add((node.lineno, node.col_offset))
    return starts


def _pairs(node: ast.Assign) -> bool:
    """Are several values given to several names at once, other than to swap them?"""
    target = node.targets[0]
    if not isinstance(target, ast.Tuple) or not isinstance(node.value, ast.Tuple):
        return False
    names = sorted(ast.unparse(one) for one in target.elts)
    return names != sorted(ast.unparse(one) for one in node.value.elts)


def _any_in_signature(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """How many parameters and returns of a function are of the type Any."""
    own = node.args
    given = [*own.posonlyargs, *own.args, *own.kwonlyargs]
    given += [one for one in (own.vararg, own.kwarg) if one is not None]
    annotations = [one.annotation for one in given] + [node.returns]
    texts = [ast.unparse(one).split(" | ") for one in annotations if one is not None]
    return sum("Any" in types for types in texts)


def _own(arguments: list[ast.expr]) -> bool:
    """May the module with this name be one of this package?"""
    name = arguments[0] if arguments else None
    if isinstance(name, ast.Constant):
        return str(name.value).split(".")[0] == "squeal"
    return True


def module_of(file: Path, checkout: Path) -> str:
    """The name of the module in a file of a checkout."""
    parts = file.relative_to(checkout).with_suffix("").parts
    return ".".join(parts).removesuffix(".__init__")


def imported(text: str, modules: Collection[str]) -> set[str]:
    """Which of these modules a module's text imports, wherever the import stands."""
    found = set[str]()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, "a relative import"
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= (whole & set(modules)) or {node.module or ""}
    return found & set(modules)


def graph(checkout: Path) -> dict[str, set[str]]:
    """Which modules of the package `squeal` each of them imports."""
    files = {module_of(f, checkout): f for f in sorted((checkout / "squeal").rglob("*.py"))}
    return {name: imported(f.read_text(encoding="utf-8"), files) for name, f in files.items()}


def downwards(links: Mapping[str, set[str]]) -> dict[str, set[str]]:
    """The same without the one import upwards."""
    below = dict(links)
    if UPWARDS[0] in below:
        below[UPWARDS[0]] = links[UPWARDS[0]] - {UPWARDS[1]}
    return below


def circle(links: Mapping[str, Collection[str]]) -> list[str]:
    """Modules that lie on a circle of imports, sorted; none if there is no circle."""
    left = {name: set(others) for name, others in links.items()}
    while loose := {name for name, others in left.items() if not others & left.keys()}:
        left = {name: others for name, others in left.items() if name not in loose}
    while loose := left.keys() - set[str]().union(*left.values()):
        left = {name: others for name, others in left.items() if name not in loose}
    return sorted(left)


def numeric(node: ast.expr) -> bool:
    """Is this a number, or a sum or product of numbers?"""
    if isinstance(node, ast.UnaryOp):
        return numeric(node.operand)
    if isinstance(node, ast.BinOp):
        return numeric(node.left) and numeric(node.right)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float, complex)


def picture(links: Mapping[str, Collection[str]]) -> str:
    """The rooms of the package, a line each, the highest first, and the rooms that each stands on.

    A room that another one named stands on is left out. `links` are the imports of modules, without
    those upwards. Raises graphlib.CycleError.
    """
    below: dict[str, set[str]] = {}
    for name, others in links.items():
        room = room_of(name)
        below.setdefault(room, set()).update(room_of(other) for other in others)
    for room, others in below.items():
        others -= {room, "squeal"}
    below.pop("squeal", None)
    sorter = graphlib.TopologicalSorter(below)
    sorter.prepare()
    order: list[str] = []
    while sorter.is_active():
        ready = sorted(sorter.get_ready())
        order += ready
        sorter.done(*ready)
    reach: dict[str, set[str]] = {}
    for room in order:
        reach[room] = below[room].union(*(reach[other] for other in below[room]))
    lines = []
    for room in reversed(order):
        through_others = set[str]().union(*(reach[other] for other in below[room]))
        direct = below[room] - through_others
        lines.append(f"{room:12s} {' '.join(sorted(direct))}".rstrip())
    return "\n".join(lines)


def room_of(module: str) -> str:
    """The folder or file directly under the package that holds a module."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 and parts[1] != "__main__" else "squeal"


def modules_run(checkout: Path, arguments: list[str]) -> tuple[int, Counter[str]]:
    """Exit code of a command, and how many functions of each module it ran."""
    entry = (checkout / "squeal" / "__main__.py").read_text(encoding="utf-8")
    imported = next(line for line in entry.splitlines() if line.endswith("import main"))
    run = subprocess.run(
        [sys.executable, "-P", "-c", imported + TRACED, json.dumps(arguments)],
        stdout=subprocess.PIPE,
        check=True,
        cwd=checkout,
        env={**os.environ, "PYTHONPATH": str(checkout)},
    )
    ended, files = json.loads(run.stdout)
    return ended, Counter(files)


def questions(checkout: Path) -> dict[str, list[str]]:
    """A pad's critical friction, and a band of a chain of 500 masses."""
    n = 500
    folder = Path(tempfile.mkdtemp())
    K = diags_array([-np.ones(n - 1), 2.1 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1]) * 1e6
    K1 = coo_array(([5e5, -5e5], ([200, 201], [201, 200])), shape=(n, n))
    for name, matrix in {"M": eye_array(n), "K": K, "K1": K1}.items():
        mmwrite(folder / f"{name}.mtx", coo_array(matrix))
    (folder / "chain.yaml").write_text(
        "parameters: {mu: 0.1}\nM: {file: M.mtx}\ndamping: {rayleigh: [1.0, 1.0e-6]}\n"
        "K: [{file: K.mtx}, {file: K1.mtx, factor: mu}]\n"
    )
    scene = str(checkout / "tests" / "scenes" / "b1-c.yaml")
    chain = str(folder / "chain.yaml")
    band = ["--band", "100:110"]
    return {
        "critical-friction of a pad": ["critical-friction", scene],
        "eigenvalues of a band": ["eigenvalues", chain, *band],
        "critical-friction of a band": ["critical-friction", chain, *band, "--max", "1"],
    }


def main() -> int:
    """Print the counts."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("checkout", nargs="?", type=Path, default=Path("."))
    checkout: Path = parser.parse_args().checkout.resolve()
    package = checkout / "squeal"
    if not package.is_dir():
        parser.error(f"{checkout} is no checkout: it has no folder squeal")
    lines = Counter[str]()
    files = Counter[str]()
    constants = Counter[str]()
    defined = Counter[str]()
    measured: dict[str, Gauges] = {}
    for file in sorted(package.rglob("*.py")):
        parts = file.relative_to(package).parts
        room = parts[0] if len(parts) > 1 else "."
        text = file.read_text(encoding="utf-8")
        tree = ast.parse(text)
        lines[room] += text.count("\n")
        files[room] += 1
        measured[room] = measured.get(room, Gauges()) + gauges(text)
        for node in tree.body:
            value = node.value if isinstance(node, ast.Assign | ast.AnnAssign) else None
            constants[room] += value is not None and numeric(value)
        if room != "article":
            names = [n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]
            defined.update(name.lstrip("_") for name in names)
    heads = "lines", "files", "constants", "tokens", "a line", "paired", "loops", "a if b", "Any"
    print(f"{'room':14s}" + "".join(f"{head:>10s}" for head in heads))
    listed = {room: [room] for room in sorted(lines)}
    listed["toolkit"] = [room for room in lines if room != "article"]
    for name, rooms in listed.items():
        row = f"{name:14s}"
        for counted in (lines, files, constants):
            row += f"{sum(counted[room] for room in rooms):10d}"
        total = Gauges()
        for room in rooms:
            total += measured[room]
        tokens, *shares = total.table().values()
        row += f"{tokens:10d}"
        print(row + "".join(f"{share:10.1f}" for share in shares[:5]))
    links = downwards(graph(checkout))
    tied = circle({n: o - {"squeal"} for n, o in links.items() if n != "squeal"})
    print(f"on a circle of imports: {', '.join(tied) or 'no module'}")
    if not tied:
        print(f"the house, each room with those that it stands on:\n{picture(links)}")
    for what, wanted in NAMES.items():
        found = [f"{name} {defined[name]}" for name in wanted if defined[name]]
        print(f"{what}: {', '.join(found) or 'none so named'}")
    print("modules that run, without those of the command line:")
    for name, arguments in questions(checkout).items():
        ended, ran = modules_run(checkout, [*arguments, "--json"])
        assert ended == 0, name
        inner = [file for file in ran if file.split("/")[0] not in ("cli", "commands")]
        print(f"  {name}: {len(inner)} (with: {len(ran)}), {sum(ran.values())} functions")
    return 0


if __name__ == "__main__":
    sys.exit(main())
