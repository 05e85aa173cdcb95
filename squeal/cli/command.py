"""What all commands share: the scene or system, options, output, warnings, exit codes.

argparse is kept: typer and cyclopts would save some 60 lines here and cost 0.1 to 0.3 s of each
start.
"""

from __future__ import annotations

import argparse
import importlib
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn

from squeal.cli.options import Once, check_outputs
from squeal.cli.streams import printed, say
from squeal.errors import BEYOND, InputError, InputWarning, MatrixError
from squeal.io.provenance import InputFile, provenance
from squeal.io.scene import SCENE, Scene, check_simulation
from squeal.io.writing import Answer, to_json
from squeal.schema import (
    Group,
    Key,
    Number,
    Place,
    named_files,
    parse_document,
    read_content,
    scalar,
)

if TYPE_CHECKING:
    from squeal.io.system import SystemFile

STANDARD_INPUT = "-"
_OF_NUMBERS = re.compile("overflow|underflow|divide by zero|invalid value")  # of NumPy


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
    at = Place("standard input" if path is None else given)
    if path is None and sys.stdin is None:
        raise at.refuse("is closed; a file or a pipe is allowed")
    content = sys.stdin.buffer.read() if path is None else read_content(path, at)
    document = parse_document(content, at)
    made: dict[str, Any] = {}
    for change in changes:
        key, value = _changed(document, change)
        if before := next((old for old in made if f"{old}.".startswith(f"{key}.")), None):
            words = f"{before} is set already; a value is set by one --set only"
            raise Place(f"--set {change}").refuse(words)
        made[key] = value
    name = at.source if path is None else path.name
    return Source(at, document, InputFile(name, sha256(content).hexdigest()), path, made)


def _changed(document: dict[str, Any], change: str) -> tuple[str, Any]:
    """Put NAME=VALUE into a document; the dotted key and the value."""
    at = Place(f"--set {change}")
    name, equals, text = change.partition("=")
    table = _keys_of(document)
    keys, key = table.find(name.strip(), at)
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


def _keys_of(document: dict[str, Any]) -> Group:
    """The keys that --set may name; those of a system's parameters are its own."""
    if "M" not in document:
        return SCENE
    room: Any = importlib.import_module("squeal.io.system")
    if not room.is_general(document):
        table: Group = room.SHORT
        return table
    own = document.get("parameters")
    names = [*(own if isinstance(own, dict) else ()), document.get("parameter", "mu")]
    numbers = Group({str(name): Key("a parameter", Number()) for name in names})
    single = {name: key for name, key in room.SYSTEM.keys.items() if name != "coordinates"}
    return Group({**single, "parameters": Key("named numbers", numbers)}, "every system")


@dataclass(frozen=True)
class Reply:
    """What a command answers: an object for --json and a text for people, made only when wanted.

    inputs: the files behind it, whose provenance joins the object; None: the scene's, if any.
    warnings: reasons why the equilibria behind it are none that the model means; None where there
    are no equilibria. They go to standard error and, with the key `admissible`, into the object,
    which may have such a key of its own.
    """

    data: Callable[[], dict[str, Any]]
    text: Callable[[], str]
    inputs: Sequence[Path | InputFile] | None = None
    warnings: Sequence[str] | None = None

    @staticmethod
    def of(*answers: Answer, inputs: Any = None, judged: bool = False, **more: Any) -> Reply:
        """One reply of several answers, whose objects and texts follow each other.

        judged: their warnings speak of equilibria; more: further keys of the object.
        """

        def data() -> dict[str, Any]:
            joined: dict[str, Any] = {}
            for answer in answers:  # what an answer does not know another may have said
                own = answer.to_dict().items()
                joined |= {key: v for key, v in own if v is not None or key not in joined}
            return joined | more

        reasons = [words for answer in answers for words in answer.warnings]
        for words in [] if judged else reasons:
            warnings.warn(words, InputWarning, stacklevel=2)

        def text() -> str:
            return "\n\n".join(answer.text() for answer in answers)

        return Reply(data, text, inputs, reasons if judged else None)


class Parser(argparse.ArgumentParser):
    """An argument parser whose refusals read like all others, and whose values may be negative.

    An option that takes one value may be given once, by whichever of its names.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._negative_number_matcher = re.compile(r"-\.?\d")  # -50:1000:0:2e4 is a value too
        self.register("action", None, Once)
        self._groups: dict[str, Any] = {"": self}

    def within(self, name: str) -> Any:
        """The group of options of that name."""
        if name not in self._groups:
            self._groups[name] = self.add_argument_group(name)
        return self._groups[name]

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see {self.prog} --help")

    def print_help(self, file: Any = None) -> None:
        """Print the options, and end."""
        raise SystemExit(printed(self.format_help().rstrip("\n")))


@dataclass(frozen=True)
class Command:
    """A command: its name and its module, whose docstring says what it does.

    The module's function `options` adds options to a parser, and `run` makes the reply from them.
    With `scene` it finds what the first argument names as `source` in them.
    """

    name: str
    module: Any
    scene: bool = True

    def parser(self) -> Parser:
        """The parser of this command's arguments."""
        summary = " ".join(self.module.__doc__.partition("`: ")[2].split())
        summary = summary[0].upper() + summary[1:]
        parser = Parser(prog=f"squeal {self.name}", description=summary, allow_abbrev=False)
        if self.scene:
            add = parser.add_argument
            add("scene", metavar="SCENE.yaml", help="the scene file; - reads standard input")
            words = "change one value of the file, such as mu=0.3 or time.stop=0.1 (repeatable)"
            add("--set", metavar="NAME=VALUE", action="append", default=[], help=words)
        self.module.options(parser)
        parser.add_argument("--json", action="store_true", help="print one JSON object instead")
        return parser

    def _reply(self, options: argparse.Namespace) -> Reply:
        if not self.scene:
            reply: Reply = self.module.run(options)
            return reply
        inputs = [] if options.scene == STANDARD_INPUT else [Path(options.scene)]
        if scatter := getattr(options, "scatter", None):
            inputs.append(scatter)
        check_outputs(options, inputs)
        options.source = read_source(options.scene, options.set)
        check_outputs(options, options.source.named_files())
        try:
            reply = self.module.run(options)
        except MatrixError as error:
            raise InputError(f"{options.source.name}: {error}") from None
        for words in reply.warnings or ():
            warnings.warn(words, InputWarning, stacklevel=2)
        return reply

    def main(self, arguments: Sequence[str] | None = None) -> int:
        """Run from arguments; the exit code 0, or 1 where the answer cannot be printed."""
        options, shown = self.parser().parse_args(arguments), list[str]()

        def show(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
            words = str(message)
            if issubclass(category, RuntimeWarning) and _OF_NUMBERS.search(words):
                words += f"; {BEYOND}"
            if words not in shown:
                shown.append(words)
                say(f"squeal: warning: {words}")

        with warnings.catch_warnings():
            for kind in (RuntimeWarning, InputWarning):
                warnings.simplefilter("always", kind)
            warnings.showwarning = show
            reply = self._reply(options)
            if not options.json:
                return printed(str(reply.text()))
            answer = reply.data()
        first: dict[str, Any] = {} if reply.warnings is None else {"admissible": not reply.warnings}
        joined = first | {"warnings": shown} | answer | {"warnings": shown}
        inputs = reply.inputs
        if self.scene and inputs is None:
            inputs = [options.source.file]
        if inputs is not None:
            joined["provenance"] = provenance(inputs, self.module.__name__).to_dict()
        if self.scene and options.set:
            joined["set"] = options.source.changes
        return printed(to_json(joined))
