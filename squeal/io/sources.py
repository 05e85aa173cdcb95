"""What a module runs on, read from the sources: files of this package, and other packages.

Snakemake does not see imports; its rules take `sources` as input, so that a change in a module
reruns what imports it and nothing else. The same list is digested into every result, and the
versions of `packages` are told there. Imports inside functions count too; modules loaded by name
only (the command line's) do not. A module that imports `importlib.resources` reads the files that
lie in its folder: they count among its sources.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT.name
_TEXT = re.compile(r'"""(?:[^"\\]|\\.|"(?!""))*"""', re.S)  # docstrings may hold lines of code
_TYPES = re.compile(r"^if TYPE_CHECKING:\n(?: +.*\n|\n)*", re.M)  # seen by type checkers alone
_LINE = re.compile(r"^ *(?:from ([\w.]+) import (\([^)]*\)|.+)|import (.+))$", re.M)


@cache
def _file(module: str) -> Path | None:
    """The file of a module of this package, None if there is none of that name."""
    base = ROOT.parent.joinpath(*module.split("."))
    for candidate in (base.with_suffix(".py"), base / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


def _names(listed: str) -> set[str]:
    words = (word.split() for word in re.sub(r"#.*", "", listed).strip("()\n").split(","))
    return {word[0] for word in words if word}


@cache
def _imports(path: Path) -> frozenset[str]:
    """Names of all modules that a file imports (absolute imports, the house style).

    Read from its lines: to parse hundreds of files would take longer than most of what runs them.
    """
    text = path.read_text(encoding="utf-8")
    found: set[str] = set()
    for module, some, others in _LINE.findall(_TYPES.sub("", _TEXT.sub("", text))):
        if module:
            found |= {module, *(f"{module}.{name}" for name in _names(some))}
        else:
            found |= _names(others)
    return frozenset(found)


def _top(name: str) -> str:
    return name.partition(".")[0]


@cache
def _own(name: str) -> frozenset[Path]:
    """The file of a module of this package, if it is one, and of the packages that it lies in."""
    parts = name.split(".") if _top(name) == PACKAGE else []
    files = (_file(".".join(parts[:end])) for end in range(1, len(parts) + 1))
    return frozenset(filter(None, files))


@cache
def _needed(path: Path) -> frozenset[Path]:
    """Files of this package that a file imports itself."""
    return frozenset().union(*map(_own, _imports(path)))


def _modules(modules: Sequence[str]) -> set[Path]:
    """Files of some modules and of all that they import from this package, directly or not."""
    for module in modules:
        if _file(module) is None:
            raise ModuleNotFoundError(f"no module {module} in this package")
    seen: set[Path] = set()
    wanted = set().union(*map(_own, modules))
    while wanted:
        seen |= wanted
        wanted = set().union(*map(_needed, wanted)) - seen
    return seen


@cache
def _shown(path: Path) -> str:
    return str(path.relative_to(ROOT.parent))


@cache
def _data(path: Path) -> frozenset[Path]:
    """Files that a module may read through `importlib.resources`."""
    if "importlib.resources" not in _imports(path):
        return frozenset()
    beside = (file for file in path.parent.rglob("*") if file.is_file())
    return frozenset(file for file in beside if not file.suffix.startswith(".py"))


def sources(*modules: str) -> list[str]:
    """Files, relative to the folder that holds the package, that the modules need to run.

    Raises ModuleNotFoundError if the package has no such module.
    """
    files = _modules(modules)
    files |= {data for path in files for data in _data(path)}
    return sorted(map(_shown, files))


def packages(module: str) -> list[str]:
    """Names of the packages beside this one and Python's own that `module` or its sources import.

    Raises ModuleNotFoundError if the package has no such module.
    """
    named = {_top(name) for path in _modules([module]) for name in _imports(path)}
    return sorted(named - {PACKAGE} - sys.stdlib_module_names)


def digest(module: str) -> str:
    """SHA-256 over the files of `sources(module)`, shortened to 16 digits."""
    total = hashlib.sha256()
    for path in sources(module):
        total.update(path.encode())
        total.update((ROOT.parent / path).read_bytes())
    return total.hexdigest()[:16]
