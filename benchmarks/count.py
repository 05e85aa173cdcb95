"""What the house counts: lines, files, constants, imports inside functions, modules that run.

`python -m benchmarks.count [CHECKOUT]` counts the folder `squeal` of a checkout (this one if left
out) and runs two queries in it to count the modules of the package whose functions they run.
"""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
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
    "Newton's method": ("newton", "newton_batch", "settle", "solved"),
    "bisection": ("bisect", "bisected", "bisection", "halved"),
}


def numeric(node: ast.expr) -> bool:
    """Is this a number, or a sum or product of numbers?"""
    if isinstance(node, ast.UnaryOp):
        return numeric(node.operand)
    if isinstance(node, ast.BinOp):
        return numeric(node.left) and numeric(node.right)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float, complex)


def inner_imports(tree: ast.AST) -> int:
    """Imports of the package inside functions."""
    found = set()
    for outer in ast.walk(tree):
        if isinstance(outer, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            for node in ast.walk(outer):
                if isinstance(node, ast.ImportFrom):
                    names = [node.module or ""]
                else:
                    names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
                if any(name.split(".")[0] == "squeal" for name in names):
                    found.add(node)
    return len(found)


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
    n, folder = 500, Path(tempfile.mkdtemp())
    K = diags_array([-np.ones(n - 1), 2.1 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1]) * 1e6
    K1 = coo_array(([5e5, -5e5], ([200, 201], [201, 200])), shape=(n, n))
    for name, matrix in {"M": eye_array(n), "K": K, "K1": K1}.items():
        mmwrite(folder / f"{name}.mtx", coo_array(matrix))
    (folder / "chain.yaml").write_text(
        "parameters: {mu: 0.1}\nM: {file: M.mtx}\ndamping: {rayleigh: [1.0, 1.0e-6]}\n"
        "K: [{file: K.mtx}, {file: K1.mtx, factor: mu}]\n"
    )
    scene = str(checkout / "tests" / "scenes" / "b1-c.yaml")
    chain, band = str(folder / "chain.yaml"), ["--band", "100:110"]
    return {
        "critical-friction of a pad": ["critical-friction", scene],
        "eigenvalues of a band": ["eigenvalues", chain, *band],
        "critical-friction of a band": ["critical-friction", chain, *band, "--max", "1"],
    }


def main() -> int:
    """Print the counts."""
    checkout = Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    package = checkout / "squeal"
    lines, files, constants, imports, defined = (Counter[str]() for _ in range(5))
    for file in sorted(package.rglob("*.py")):
        parts = file.relative_to(package).parts
        room = parts[0] if len(parts) > 1 else "."
        text = file.read_text(encoding="utf-8")
        tree = ast.parse(text)
        lines[room] += text.count("\n")
        files[room] += 1
        for node in tree.body:
            value = node.value if isinstance(node, ast.Assign | ast.AnnAssign) else None
            constants[room] += value is not None and numeric(value)
        imports[room] += inner_imports(tree)
        if room != "article":
            names = [n.name for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]
            defined.update(name.lstrip("_") for name in names)
    print(f"{'room':14s}{'lines':>8s}{'files':>7s}{'constants':>11s}{'inner imports':>15s}")
    toolkit = [room for room in lines if room != "article"]
    for name, rooms in {**{room: [room] for room in sorted(lines)}, "toolkit": toolkit}.items():
        counts = (sum(c[room] for room in rooms) for c in (lines, files, constants, imports))
        print("{:14s}{:8d}{:7d}{:11d}{:15d}".format(name, *counts))
    for what, wanted in NAMES.items():
        found = {name: defined[name] for name in wanted if defined[name]}
        print(f"{what}: " + (", ".join(f"{n} {k}" for n, k in found.items()) or "none so named"))
    print("modules that run, without those of the command line:")
    for name, arguments in questions(checkout).items():
        ended, ran = modules_run(checkout, [*arguments, "--json"])
        assert ended == 0, name
        inner = [file for file in ran if file.split("/")[0] not in ("cli", "commands")]
        print(f"  {name}: {len(inner)} (with: {len(ran)}), {sum(ran.values())} functions")
    return 0


if __name__ == "__main__":
    sys.exit(main())
