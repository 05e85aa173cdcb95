"""The scene or system that a command is about: read once, from a file or standard input."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from squeal.cli.streams import all_input, name_of
from squeal.errors import InputError, InputWarning
from squeal.io.provenance import InputFile
from squeal.io.scene import SCENE, Scene, check_simulation
from squeal.schema.keys import Group, Key, named_files, parse_document, read_content, scalar
from squeal.schema.values import Number, Place

if TYPE_CHECKING:
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
        scene = Scene.from_dict(self.document, self.at, self.path)
        if purpose == "simulate":
            check_simulation(scene, self.at)
        return scene

    def subject(self) -> tuple[Scene | SystemFile, list[Path | InputFile]]:
        """The scene or system that the file holds, and all files behind it. Raises InputError."""
        if "M" not in self.document:
            return self.scene(), [self.file]
        system = self.system()
        return system, [self.file, *system.inputs]

    def named_files(self) -> list[Path]:
        """The files that the document names: matrices and coordinates of a system."""
        folder = Path() if self.path is None else self.path.parent
        return [folder / name for name in named_files(self.document)]

    def check_at(self, file: SystemFile, said: str) -> None:
        """Refuse a value of the parameter that --set gives too. Raises InputError."""
        name = file.system.parameter
        if f"parameters.{name}" in self.changes:
            raise InputError(f"{said}: --set gives {name} too; one of both is allowed")

    def warn_if_constant(self, file: SystemFile) -> None:
        """Warn where a range of the parameter is requested and nothing depends on it."""
        name = file.system.parameter
        if name not in file.system.names:
            warnings.warn(f"no matrix depends on {name}", InputWarning, stacklevel=2)

    def system(self) -> SystemFile:
        """The system that the file holds, in either form. Raises InputError."""
        room = importlib.import_module("squeal.io.system")  # formats, which no scene needs
        folder = Path() if self.path is None else self.path.parent
        file: SystemFile = room.system_file(self.document, self.at, folder)
        for key, value in self.changes.items():
            name = key.removeprefix("parameters.")
            if name != key and name not in file.system.names:
                raise InputError(
                    f"--set {name}={value:g}: no matrix of {self.name} depends on {name}"
                )
        return file


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
            words = f"{before} is set already; a value is set by one --set only"
            raise Place(f"--set {change}").refuse(words)
        made[key] = value
    name = at.source if path is None else name_of(path.name)
    return Source(at, document, InputFile(name, sha256(content).hexdigest()), path, made)


def _changed(document: dict[str, Any], change: str) -> tuple[str, Any]:
    """Put NAME=VALUE into a document; the dotted key and the value."""
    at = Place(f"--set {change}")
    name, equals, text = change.partition("=")
    rows = document.get("M")
    table, allowed = SCENE, list[str]()
    room: Any = importlib.import_module("squeal.io.system") if "M" in document else None
    if room and room.is_general(document):
        table = _with_parameters(document, room.SYSTEM)
        allowed = [keys[-1] for keys, _ in table.paths() if len(keys) == 1 or "parameters" in keys]
    elif rows:
        if name.strip() == document.get("parameter", "mu"):
            raise at.refuse(
                "is the parameter that thresholds are sought in; eigenvalues at one value of it "
                f"are found with --at {text or 'VALUE'}"
            )
        table = room.short_keys(len(rows) if isinstance(rows, list) else None)
    keys, key = table.find(name.strip(), at, allowed)
    if not equals:
        raise at.refuse("it must be NAME=VALUE")
    value = scalar(text)
    key.kind.read(value, at)
    inner: Any = document
    for step in keys[:-1]:
        group = table.keys[step].kind
        table = group if isinstance(group, Group) else table
        inner[step] = table.mapping(inner.get(step, {}))
        inner = inner[step]
        if not isinstance(inner, dict):  # refused when the document is read
            return ".".join(keys), value
    inner[keys[-1]] = value
    return ".".join(keys), value


def _with_parameters(document: dict[str, Any], table: Group) -> Group:
    """The table of a system's keys, with those of its own named numbers."""
    own = document.get("parameters")
    names = [*(own if isinstance(own, dict) else ()), document.get("parameter", "mu")]
    numbers = Group({str(name): Key("a parameter", Number()) for name in names})
    return Group({**table.keys, "parameters": Key("named numbers", numbers)}, table.owner)
