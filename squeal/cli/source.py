"""The scene or system that a command is about: read once, from a file or standard input."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from squeal.cli.streams import all_input, name_of
from squeal.errors import InputError
from squeal.io.document import named_files, parse_document, read_content, scalar
from squeal.io.provenance import InputFile
from squeal.io.scene import Scene, check_simulation
from squeal.io.scene_keys import SCENE
from squeal.io.short_form import PlainSystem, plain_system, system_keys
from squeal.schema.keys import Group, Key
from squeal.schema.place import Place
from squeal.schema.values import Number

if TYPE_CHECKING:
    from squeal.analysis.subject import Subject
    from squeal.io.system import SystemFile

STANDARD_INPUT = "-"


@dataclass(frozen=True)
class Source:
    """A document and where it is from; `changes` are the values that --set has put into it."""

    at: Place
    document: dict[str, Any]
    file: InputFile
    path: Path | None
    changes: dict[str, Any]

    @property
    def name(self) -> str:
        """The name of the file, without its folder."""
        return self.file.name

    def scene(self, purpose: Literal["simulate", "query"] = "query") -> Scene:
        """The scene, validated, for a simulation or a query. Raises InputError."""
        found = Scene.from_dict(self.document, self.at, self.path)
        if purpose == "simulate":
            check_simulation(found, self.at)
        return found

    def system(self) -> PlainSystem | None:
        """The system of the short form that the file holds, else None. Raises InputError."""
        short = "M" in self.document and not _is_general(self.document)
        return plain_system(self.document, self.at) if short else None

    def subject(self, asked: str) -> Subject:
        """The scene, or the system with named parameters, whose parameters are varied.

        Raises InputError.
        """
        terms = self.terms()
        if terms is not None:
            return terms.system
        if self.system() is not None:
            raise InputError(
                f"{asked}: is not allowed with {self.name}, a plain system without named "
                "parameters; a scene or a system with parameters is allowed"
            )
        return self.scene()

    def named_files(self) -> list[Path]:
        """The files that the document names: matrices and coordinates of a system."""
        folder = Path() if self.path is None else self.path.parent
        return [folder / name for name in named_files(self.document)]

    def terms(self) -> SystemFile | None:
        """The system of the general form that the file holds, else None. Raises InputError."""
        if not _is_general(self.document):
            return None
        from squeal.io.system import system_file

        folder = Path() if self.path is None else self.path.parent
        found = system_file(self.document, self.at, folder)
        for key, value in self.changes.items():
            name = key.removeprefix("parameters.")
            if name != key and name not in found.system.names:
                raise InputError(
                    f"--set {name}={value:g}: no matrix of {self.name} depends on {name}"
                )
        return found


def read_source(given: str, changes: Sequence[str]) -> Source:
    """Read a file, or standard input for "-", and change what `changes` (NAME=VALUE) name.

    Raises InputError.
    """
    path = None if given == STANDARD_INPUT else Path(given)
    at = Place("standard input" if path is None else name_of(given))
    content = all_input() if path is None else read_content(path, at)
    document = parse_document(content, at)
    made: dict[str, Any] = {}
    for change in changes:
        key, value = _changed(document, change)
        if before := next((old for old in made if f"{old}.".startswith(f"{key}.")), None):
            raise Place(f"--set {change}").refuse(
                f"{before} is set already; a value is set by one --set only"
            )
        made[key] = value
    name = at.source if path is None else name_of(path.name)
    file = InputFile(name, hashlib.sha256(content).hexdigest())
    return Source(at, document, file, path, made)


def _changed(document: dict[str, Any], change: str) -> tuple[str, Any]:
    """Put NAME=VALUE into a document; the dotted key and the value."""
    at = Place(f"--set {change}")
    name, equals, text = change.partition("=")
    rows = document.get("M")
    table = system_keys(len(rows) if isinstance(rows, list) else None) if rows else SCENE
    allowed: list[str] = []
    if _is_general(document):
        table = _with_parameters(document)
        allowed = [keys[-1] for keys, _ in table.paths() if len(keys) == 1 or "parameters" in keys]
    elif rows and name.strip() == document.get("parameter", "mu"):
        raise at.refuse(
            "is the parameter that thresholds are sought in; eigenvalues at one value of it are "
            f"found with --at {text or 'VALUE'}"
        )
    keys, key = table.find(name.strip(), at, allowed)
    if not equals:
        raise at.refuse("it must be NAME=VALUE")
    value = scalar(text)
    key.kind.read(value, at)
    inner, within = document, table
    for step in keys[:-1]:
        group = within.keys[step].kind
        within = group if isinstance(group, Group) else within
        deeper = inner[step] = within.mapping(inner.get(step, {}))
        if not isinstance(deeper, dict):  # refused when the document is read
            return ".".join(keys), value
        inner = deeper
    inner[keys[-1]] = value
    return ".".join(keys), value


def _is_general(document: dict[str, Any]) -> bool:
    """True for a system of the general form, without loading what reads it for a scene."""
    if "M" not in document:
        return False
    from squeal.io.system import is_general

    return is_general(document)


def _with_parameters(document: dict[str, Any]) -> Group:
    """The table of a system's keys, with those of its own named numbers."""
    from squeal.io.system import SYSTEM

    own = document.get("parameters")
    names = [*(own if isinstance(own, dict) else ()), document.get("parameter", "mu")]
    numbers = Group({str(name): Key("a parameter", Number()) for name in names})
    return Group({**SYSTEM.keys, "parameters": Key("named numbers", numbers)}, SYSTEM.owner)
