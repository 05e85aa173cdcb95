"""Which of the package's files a module imports, directly or not, read from the sources.

Snakemake does not see imports; its rules take this list as input, so that a change in a module
reruns what imports it and nothing else. The same list is digested into every result. Imports
inside functions count too; modules loaded by name only (the command line's) do not.
"""

from __future__ import annotations

import ast
import hashlib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT.name


@cache
def _file(module: str) -> Path | None:
    """The file of a module of this package, None if there is none of that name."""
    base = ROOT.parent.joinpath(*module.split("."))
    for candidate in (base.with_suffix(".py"), base / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


@cache
def _imports(path: Path) -> frozenset[str]:
    """Names of this package's modules that a file imports (absolute imports, the house style)."""
    found: set[str] = set()
    wanted: list[ast.AST] = [ast.parse(path.read_text(encoding="utf-8"))]
    while wanted:
        node = wanted.pop()
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue  # seen by type checkers alone
        wanted += ast.iter_child_nodes(node)
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module)
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(name for name in found if name.split(".")[0] == PACKAGE)


def sources(module: str) -> list[str]:
    """Files, relative to the folder that holds the package, that `module` needs to run.

    Raises ModuleNotFoundError if the package has no such module.
    """
    if _file(module) is None:
        raise ModuleNotFoundError(f"no module {module} in this package")
    wanted, seen = [module], set()
    while wanted:
        name = wanted.pop()
        path = _file(name)
        if path is None or path in seen:
            continue
        seen.add(path)
        parts = name.split(".")
        wanted += [".".join(parts[:i]) for i in range(1, len(parts))]
        wanted += _imports(path)
    return sorted(str(path.relative_to(ROOT.parent)) for path in seen)


def digest(module: str) -> str:
    """SHA-256 over the files of `sources(module)`, shortened to 16 digits."""
    total = hashlib.sha256()
    for path in sources(module):
        total.update(path.encode())
        total.update((ROOT.parent / path).read_bytes())
    return total.hexdigest()[:16]
