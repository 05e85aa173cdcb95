"""What all commands share: the scene or system, options, output, warnings.

argparse is kept: typer and cyclopts would save some lines and cost 0.1 to 0.3 s of each start.
"""

from __future__ import annotations

import argparse
import difflib
import re
import sys
import textwrap
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, NoReturn

from squeal.cli.options import FILES, SYSTEMS, Once, changes, check_outputs
from squeal.cli.streams import printed, say
from squeal.errors import BEYOND, InputError, InputWarning, MatrixError
from squeal.io.provenance import InputFile, provenance
from squeal.io.scene import SCENE, Scene, is_system
from squeal.io.writing import Answer, to_json
from squeal.linear.moduli import FREQUENCY
from squeal.schema import (
    ANY,
    Group,
    Key,
    Named,
    Place,
    Several,
    parse_document,
    read_content,
    scalar,
)

_ARGUMENT = re.compile(r"(?:\w+: )?(\w+)[.\d]*: ")  # with which the library begins a refusal


class Source:
    """The document of a file, or of standard input for "-", as --set changes it (`changes`).

    inputs: the files behind what was read, which no output replaces; matrices: the files of
    --change by name and part. Raises InputError.
    """

    def __init__(self, given: argparse.Namespace) -> None:
        self.given, self.matrices = given, changes(given)
        self.path = None if given.scene == "-" else Path(given.scene)
        self.at = Place(given.scene if self.path else "standard input")
        self.folder, self.name = Path(given.scene).parent, Path(self.at.source).name
        content = read_content(self.path, self.at) if self.path else sys.stdin.buffer.read()
        self.document = parse_document(content, self.at)
        self.inputs: list[Path | InputFile] = [InputFile(self.name, sha256(content).hexdigest())]
        named = [vars(given).get(key) for key in ("scatter", "test")]
        named += [file for parts in (self.matrices or {}).values() for file in parts.values()]
        self.inputs += [Path(file) for file in named if file]
        check_outputs(given, [self.path, *self.inputs])
        self.changes: dict[str, Any] = {}
        for change in given.set:
            self._set(change)

    def _set(self, change: str) -> None:
        """Put NAME=VALUE into the document."""
        at = Place(f"--set {change}")
        name, _, text = change.partition("=")
        group: Any = _keys_of(self.document)
        words = "; another number is set by a parameter that the file names in its place"
        keys, key = group.find(name.strip(), at, words * (group is not SCENE))
        value, dotted = scalar(text), ".".join(keys)
        key.kind.read(value, at)
        if before := next((b for b in self.changes if f"{b}.".startswith(f"{dotted}.")), None):
            raise at.refuse(f"{before} is set already; a value is set by one --set only")
        self.changes[dotted] = value
        inner: Any = self.document
        for step in keys[:-1]:
            group = group.keys[step].kind
            inner[step] = group.mapping(inner.get(step, {}))
            inner = inner[step]
            if not isinstance(inner, dict):  # refused when the document is read
                return
        inner[keys[-1]] = value

    def scene(self) -> Scene:
        """The scene, validated. Raises InputError."""
        return Scene.from_dict(self.document, self.at, self.path or Path(self.at.source))

    def subject(self) -> Any:
        """The Scene or SystemFile that the file holds. Raises InputError."""
        if not is_system(self.document):
            return self.scene()
        from squeal.io.system_files import system_file  # formats, which no scene needs

        file = system_file(self.document, self.at, self.folder, vars(self.given).get("band"))
        self.inputs += file.inputs
        check_outputs(self.given, [self.path, *self.inputs])
        if self.matrices:  # refused before anything is solved
            from squeal.analysis.systems.sensitivity import with_matrices

            with_matrices(file, self.matrices)
        system = file.system
        for key, value in self.changes.items():
            name = key.removeprefix("parameters.")
            seated = file.assembly is not None  # and what presses it has been used
            if name != key and name not in system.names and not seated:
                words = f"no matrix of {self.name} depends on {name}"
                raise InputError(f"--set {name}={value:g}: {words}")
        return file


def _keys_of(document: dict[str, Any]) -> Group:
    """The keys that --set may name; those of a system's parameters are its own."""
    if not is_system(document):
        return SCENE
    from squeal.io.system import SYSTEM

    own = document.get("parameters")
    names = [*(own if isinstance(own, dict) else ()), document.get("parameter", "mu"), *FREQUENCY]
    group = SYSTEM
    if "components" in document:
        from squeal.io.components import ASSEMBLY  # which no other system needs
        from squeal.sparse.assembly import OWN

        group = ASSEMBLY
        names += OWN
    numbers = Group({str(name): Key("a parameter", ANY) for name in names})
    known = {k: v for k, v in group.keys.items() if type(v.kind) not in (Several, Named)}
    return Group(known | {"parameters": Key("named numbers", numbers)})


@dataclass(frozen=True)
class Reply:
    """What a command answers: an object for --json and a text for people, made only when wanted.

    inputs: the files behind it, for its provenance, of a command without a scene.
    warnings: why the equilibria behind it are none that the model means, None without equilibria;
    the object gains the key `admissible`, unless it has one.
    """

    data: Callable[[], dict[str, Any]]
    text: Callable[[], str]
    inputs: Sequence[Path | InputFile] | None = None
    warnings: Sequence[str] | None = None

    @staticmethod
    def of(*answers: Answer, judged: bool = False, more: str = "") -> Reply:
        """One reply of several answers, whose objects and texts follow each other.

        judged: their warnings speak of equilibria; more: what else stands in the text.
        """

        def data() -> dict[str, Any]:
            joined: dict[str, Any] = {}
            for answer in answers:  # what an answer does not know another may have said
                own = answer.to_dict().items()
                joined |= {key: v for key, v in own if v is not None or key not in joined}
            return joined

        reasons = [words for answer in answers for words in answer.warnings]
        for words in [] if judged else reasons:
            warnings.warn(words, InputWarning, stacklevel=2)

        def text() -> str:
            return "\n\n".join(answer.text() for answer in answers) + more

        return Reply(data, text, warnings=reasons if judged else None)


class Parser(argparse.ArgumentParser):
    """The arguments of a command. Refusals read like all others, and values may be negative.

    An option that takes one value may be given once, by whichever of its names.
    """

    def __init__(self, name: str, module: Any, scene: bool) -> None:
        words = module.__doc__ or "`: see squeal --help"  # of python -OO
        about, _, shown = words.partition("`: ")[2].partition("\n\n")
        about = textwrap.fill(about[0].upper() + about[1:], 80)
        examples = f"examples:\n{textwrap.indent(shown.rstrip(), '  ')}"
        how: Any = {"formatter_class": argparse.RawDescriptionHelpFormatter, "allow_abbrev": False}
        super().__init__(prog=f"squeal {name}", description=about, epilog=examples, **how)
        self.color = False  # `printed` shows escapes
        self._negative_number_matcher = re.compile(r"-\.?\d")  # -50:1000:0:2e4 is a value too
        self.register("action", None, Once)
        self.groups: dict[str, Any] = {"": self}
        self.groups |= {title: self.add_argument_group(title) for title in (SYSTEMS, FILES)}
        add = self.add_argument
        if scene:
            add("scene", metavar="SCENE.yaml", help="the scene file; - reads standard input")
            words = "change one value of the file, such as mu=0.3 or time.stop=0.1 (repeatable)"
            add("--set", metavar="NAME=VALUE", action="append", default=[], help=words)
        module.options(self)
        add("--json", action="store_true", help="print one JSON object instead")

    def error(self, message: str) -> NoReturn:
        unknown = re.match(r"unrecognized arguments: (--[\w-]+)", message)
        close = unknown and difflib.get_close_matches(unknown[1], self._option_string_actions, 1)
        meant = f"did you mean {close[0]}? See" if close else "see"
        raise InputError(f"{message}; {meant} {self.prog} --help")

    def print_help(self, file: Any = None) -> None:
        """Print the options, and end."""
        raise SystemExit(printed(self.format_help().rstrip("\n")))


def _reply(module: Any, given: argparse.Namespace) -> Reply:
    """The answer of a command about a scene or system. Raises InputError."""
    given.source = Source(given)
    try:
        reply: Reply = module.run(given)
    except MatrixError as error:
        raise InputError(f"{given.source.name}: {error}") from None
    except InputError as error:
        match = _ARGUMENT.match(str(error))
        option = match and getattr(given, f"{match[1]}_said", None)
        if not match or not option:
            raise
        raise InputError(f"{option}: {str(error)[match.end() :]}") from None
    for words in reply.warnings or ():
        warnings.warn(words, InputWarning, stacklevel=2)
    return reply


def run(module: Any, parser: Parser, arguments: Sequence[str]) -> int:
    """Run a command; the exit code 0, or 1 where the answer cannot be printed.

    The module's docstring says what it does, its function `options` adds options to a parser, and
    `run` makes the reply from them, of a scene with its Source as `source`.
    Raises InputError and what the command raises.
    """
    given, shown = parser.parse_args(arguments), list[str]()
    scene = "scene" in given

    def show(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
        words = str(message)
        if issubclass(category, RuntimeWarning):  # NumPy's of overflow and the like
            words += f"; {BEYOND}"
        if words not in shown:
            shown.append(words)
            say(f"squeal: warning: {words}")

    with warnings.catch_warnings():
        for kind in (RuntimeWarning, InputWarning):
            warnings.simplefilter("always", kind)
        warnings.showwarning = show
        reply: Reply = _reply(module, given) if scene else module.run(given)
        if not given.json:
            return printed(reply.text())
        answer = reply.data()
    first = {} if reply.warnings is None else {"admissible": not reply.warnings}
    joined = first | answer | {"warnings": shown}
    inputs = given.source.inputs if scene else reply.inputs
    if scene and given.set:
        joined["set"] = given.source.changes
    if inputs is not None:
        joined["provenance"] = asdict(provenance(inputs, module.__name__))
    return printed(to_json(joined))
