"""Where a result comes from: the files, the sources and the versions that made it.

Rules of the workflow take `sources` as input, so that a change in a module reruns what imports it
and nothing else; their digest stands in every result. Imports inside functions count too, and
names that load when they are used. What shows an answer (`SHOWING`) is a source of pictures, files
and pages alone, not of the answer. A module that imports `importlib.resources` reads the files of
its folder: they are sources too.
"""

from __future__ import annotations

import ast
import hashlib
import platform
import re
import sys
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from squeal import __version__

NOT_INSTALLED = "not installed"
ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT.name
_TEXT = re.compile(r'"""(?:[^"\\]|\\.|"(?!""))*"""', re.S)  # docstrings may hold lines of code
_TYPES = re.compile(r"^if TYPE_CHECKING:.*\n(?: +.*\n|\n)*", re.M)  # seen by type checkers alone
SHOWING = ("squeal.plots", "squeal.io.shapes")
"""What draws answers, or writes shapes for other programs; these import each other as sources."""
_LINE = re.compile(r"^ *(?:from ([\w.]+) import (\([^)]*\)|.+)|import (.+))$", re.M)
"""A line of an import: the module and the names that are imported from it, else the modules."""


@cache
def _imports(path: Path) -> frozenset[str]:
    """Names of all modules that a file imports (absolutely, the house style).

    Read from its lines: Python's parser would take four times as long, longer than many queries. A
    test compares every file with the parser.
    """
    text = _TYPES.sub("", _TEXT.sub("", path.read_text(encoding="utf-8")))
    imported = set[str]()
    # `from module import names`, or `import modules`
    for module, names_of_module, modules in _LINE.findall(text):
        listed = re.sub(r"#.*", "", names_of_module or modules).strip("()\n")
        for entry in listed.split(","):
            if not entry.strip():
                continue
            name = entry.split()[0]  # without `as ...`
            # what a package imports by name may be a module of it
            imported.add(f"{module}.{name}" if module else name)
        if module:
            imported.add(module)
    # names of the package load when they are used: `squeal.report` imports the module of report
    if PACKAGE in imported:
        module_of_name = _modules_of_offers()
        for name in re.findall(r"\bsqueal\.(\w+)", text):
            if name in module_of_name:
                imported.add(module_of_name[name])
    return frozenset(imported)


@cache
def _modules_of_offers() -> dict[str, str]:
    """The module of each name that the package offers, as its own file imports them."""
    tree = ast.parse((ROOT / "__init__.py").read_text(encoding="utf-8"))
    module_of_name: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                module_of_name[alias.name] = node.module
    return module_of_name


def _shows(name: str) -> bool:
    """Does a module belong to what shows answers?"""
    return any(name == shown or name.startswith(f"{shown}.") for shown in SHOWING)


@cache
def _sources_by_import(path: Path) -> frozenset[str]:
    """Names of the modules that a file imports and that are sources of what it computes.

    A file of the toolkit that computes may know how its answers are shown, and is no source of it.
    """
    module = ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
    if _shows(module) or module.startswith(f"{PACKAGE}.article"):
        return _imports(path)
    return frozenset(name for name in _imports(path) if not _shows(name))


@cache
def _module_files(name: str) -> frozenset[Path]:
    """The file of a module of this package and the `__init__.py` of the packages that it lies in.

    Of a name that is no module only the `__init__.py`; no file of a module of other packages.
    """
    enclosing_package, _, _ = name.rpartition(".")
    if not name.startswith(f"{PACKAGE}."):
        return frozenset({ROOT / "__init__.py"} if name == PACKAGE else ())
    path = ROOT.parent.joinpath(*name.split("."))
    candidates = (path.with_suffix(".py"), path / "__init__.py")
    return _module_files(enclosing_package).union(file for file in candidates if file.is_file())


@cache
def _files_imported_by(path: Path) -> frozenset[Path]:
    """Files of the modules of this package that a file itself imports as its sources."""
    return frozenset[Path]().union(*map(_module_files, _sources_by_import(path)))


@cache
def _files_of_imports(*modules: str) -> frozenset[Path]:
    """Files of some modules and of all that they import from this package, directly or not.

    Raises ModuleNotFoundError for a name that is no module of this package.
    """
    unread = set[Path]()
    for name in modules:
        enclosing_package = name.rpartition(".")[0]
        # a module adds a file of its own to those of the packages around it
        if not _module_files(name) - _module_files(enclosing_package):
            raise ModuleNotFoundError(f"no module {name} in this package")
        unread |= _module_files(name)
    files = set(unread)
    while unread:
        new_files = _files_imported_by(unread.pop()) - files
        unread |= new_files
        files |= new_files
    return frozenset(files)


@cache
def sources(*modules: str) -> tuple[str, ...]:
    """Names of the files that modules need, from the folder of the package on, sorted.

    Raises ModuleNotFoundError.
    """
    files = set(_files_of_imports(*modules))
    for path in list(files):
        if "importlib.resources" in _imports(path):
            beside = path.parent.rglob("*")
            files |= {file for file in beside if file.is_file() and file.suffix[:3] != ".py"}
    return tuple(sorted(str(path.relative_to(ROOT.parent)) for path in files))


@cache
def packages(module: str) -> tuple[str, ...]:
    """Names of the packages beside this one and Python's own that a module's `sources` import."""
    names = set[str]()
    for path in _files_of_imports(module):
        names |= {name.partition(".")[0] for name in _sources_by_import(path)}
    return tuple(sorted(names - {PACKAGE} - sys.stdlib_module_names))


def digest(module: str) -> str:
    """SHA-256 over the files of `sources(module)`, shortened to 16 digits."""
    checksum = hashlib.sha256()
    for path in sources(module):
        checksum.update(path.encode())
        checksum.update((ROOT.parent / path).read_bytes())
    return checksum.hexdigest()[:16]


@dataclass(frozen=True)
class InputFile:
    """A file that was read: its name without the folder, and the SHA-256 of its bytes."""

    name: str
    sha256: str


@dataclass(frozen=True)
class Provenance:
    """What made a result.

    source_sha256: the `digest` of the module; versions: of this package, of Python and of every
    package that its sources import, `NOT_INSTALLED` for one that is missing; platform: system and
    processor; loaded: the packages that had been loaded when the result was made, since sources
    also import what a scene may need and this one did not.
    """

    inputs: tuple[InputFile, ...]
    module: str
    source_sha256: str
    versions: dict[str, str]
    platform: str
    loaded: tuple[str, ...]


def provenance(inputs: Iterable[Path | InputFile], module: str) -> Provenance:
    """The provenance of a result that `module` computed from some files, read here or before.

    Raises ModuleNotFoundError if this package has no such module.
    """
    files = []
    for file in inputs:
        if isinstance(file, InputFile):
            files.append(file)
        else:
            files.append(InputFile(file.name, hashlib.sha256(file.read_bytes()).hexdigest()))
    imported = packages(module)
    versions = {"squeal": __version__, "python": platform.python_version()}
    return Provenance(
        inputs=tuple(files),
        module=module,
        source_sha256=digest(module),
        versions=versions | {name: version(name) for name in imported},
        platform=f"{platform.system()} {platform.machine()}",
        loaded=tuple(name for name in imported if name in sys.modules),
    )


@cache
def version(package: str) -> str:
    """Version of a package by the name under which it is imported: as loaded, else as installed."""
    from importlib import metadata, util  # slow to load, and text for people needs none of it

    loaded = getattr(sys.modules.get(package), "__version__", None)
    if isinstance(loaded, str):
        return loaded
    with suppress(metadata.PackageNotFoundError):
        return metadata.version(package)
    if package in sys.modules or util.find_spec(package):  # else not all names need be read
        for name in metadata.packages_distributions().get(package, ()):
            return metadata.version(name)
    return NOT_INSTALLED
