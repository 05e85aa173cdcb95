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
from types import ModuleType
from typing import TYPE_CHECKING, Any, NoReturn

from squeal.cli.options import FILES, SYSTEMS, Once, changes, check_outputs
from squeal.cli.streams import printed, say
from squeal.errors import BEYOND, InputError, InputWarning, MatrixError
from squeal.io.provenance import InputFile, provenance
from squeal.io.scene import SCENE, Scene, is_system
from squeal.io.writing import Answer, JsonObject, to_json
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

if TYPE_CHECKING:
    from squeal.io.system import SystemFile

_ARGUMENT = re.compile(r"(?:\w+: )?(\w+)[.\d]*: ")
"""How the library begins a refusal, "sweep: values.3: " for example: with the argument's name."""


class Source:
    """The document of a file, or of standard input for "-", as --set changes it (`changes`).

    inputs: the files behind what was read, which no output replaces; matrices: the files of
    --change by name and part. Raises InputError.
    """

    def __init__(self, given: argparse.Namespace) -> None:
        self.given = given
        self.matrices = changes(given)  # those of --change; `self.changes` are those of --set
        self.path = None if given.scene == "-" else Path(given.scene)
        self.at = Place("standard input" if self.path is None else given.scene)
        self.folder = Path(given.scene).parent
        self.name = Path(self.at.source).name
        content = self._content()
        self.document = parse_document(content, self.at)
        self.inputs: list[Path | InputFile] = [InputFile(self.name, sha256(content).hexdigest())]
        self.inputs += self._files_of_options()
        check_outputs(given, [self.path, *self.inputs])
        self.changes: JsonObject = {}  # by dotted key; None where `null` leaves the key out
        for change in given.set:
            self._set(change)

    def _content(self) -> bytes:
        if self.path is None:
            return sys.stdin.buffer.read()
        return read_content(self.path, self.at)

    def _files_of_options(self) -> list[Path]:
        """The files that options name to be read."""
        files = []
        for option in ("scatter", "test", "parts"):
            file = vars(self.given).get(option)
            if file:
                files.append(Path(file))
        for parts in (self.matrices or {}).values():
            files += map(Path, parts.values())
        return files

    def _set(self, change: str) -> None:
        """Put NAME=VALUE into the document. Raises InputError."""
        at = Place(f"--set {change}")
        name, _, text = change.partition("=")
        group = _keys_of(self.document)
        hint = ""  # how to set what has no key
        if group is not SCENE:
            hint = "; another number is set by a parameter that the file names in its place"
        if "components" in self.document:
            hint += ", one of a component's file by a parameter of its name here"
        keys, key = group.find(name.strip(), at, hint)  # keys: one of each level, outermost first
        if not text.strip():
            raise at.refuse("has no value; NAME=VALUE is needed, such as mu=0.3")
        is_left_out = text.strip() == "null"
        value = scalar(text)
        if not is_left_out:
            key.kind.read(value, at)  # refuses a value that is not allowed
        dotted = ".".join(keys)
        for earlier in self.changes:
            # setting `initial` would undo an earlier `initial.x`
            if earlier == dotted or earlier.startswith(f"{dotted}."):
                raise at.refuse(f"{earlier} is set already; a value is set by one --set only")
        self.changes[dotted] = value
        if is_left_out:
            self._leave_out(keys)
        else:
            self._put(group, keys, value)

    def _leave_out(self, keys: Sequence[str]) -> None:
        """Remove the value under nested keys from the document, if it is there."""
        mapping: Any = self.document
        for key in keys[:-1]:
            mapping = mapping.get(key)
            if not isinstance(mapping, dict):
                return
        mapping.pop(keys[-1], None)

    def _put(self, group: Group, keys: Sequence[str], value: object) -> None:
        """Set the value under nested keys of the document, such as initial, then x.

        group: the keys of the document. A mapping that is missing on the way is made; a word that
        stands for one, see `Group.mapping`, is replaced by it. Nothing is set where any other value
        stands in the place of a mapping: the reader of the file refuses that value.
        """
        mapping: Any = self.document
        kind: Any = group
        for key in keys[:-1]:
            kind = kind.keys[key].kind  # the group of the mapping under this key
            mapping[key] = kind.mapping(mapping.get(key, {}))
            mapping = mapping[key]
            if not isinstance(mapping, dict):
                return
        mapping[keys[-1]] = value

    def scene(self) -> Scene:
        """The scene, validated. Raises InputError."""
        return Scene.from_dict(self.document, self.at, self.path or Path(self.at.source))

    def subject(self) -> Scene | SystemFile:
        """The Scene or SystemFile that the file holds. Raises InputError."""
        if not is_system(self.document):
            return self.scene()
        from squeal.io.system_files import system_file  # formats, which no scene needs

        file = system_file(self.document, self.at, self.folder, vars(self.given).get("band"))
        self.inputs += file.inputs
        check_outputs(self.given, [self.path, *self.inputs])
        if self.matrices:  # called for its refusals alone, before anything is solved
            from squeal.queries.systems.sensitivity import with_matrices

            with_matrices(file, self.matrices)
        # in an assembly a parameter that no matrix depends on, such as a pressure, has its use
        if file.assembly is None:
            from squeal.queries.systems.system_analysis import refuse_without_effect

            for key, value in self.changes.items():
                name = key.removeprefix("parameters.")
                # a parameter that is left out (None) needs no effect
                if name != key and value is not None:
                    refuse_without_effect(file, [name], Place(f"--set {name}={value:g}"))
        return file

    def system(self, allowed: str = "a system of matrices") -> SystemFile:
        """The SystemFile that the file holds. Raises InputError, also for a pad."""
        subject = self.subject()
        if isinstance(subject, Scene):
            raise InputError(f"{self.name}: is a pad; {allowed} is allowed")
        return subject


def _keys_of(document: JsonObject) -> Group:
    """The keys that --set may name: of a scene, or of a system with its own parameters."""
    if not is_system(document):
        return SCENE
    from squeal.io.system_keys import SYSTEM

    group = SYSTEM
    parameters = document.get("parameters")
    names = list(parameters) if isinstance(parameters, dict) else []
    # the free parameter and the frequency may be set though no file has to name them
    names += [document.get("parameter", "mu"), *FREQUENCY]
    if "components" in document:
        from squeal.io.components import ASSEMBLY  # which no other system needs
        from squeal.sparse.assembly import ASSEMBLY_DEFAULTS

        group = ASSEMBLY
        names += ASSEMBLY_DEFAULTS  # which every assembly has, whatever its file names
    numbers = {str(name): Key("a parameter", ANY) for name in names}
    keys = {"parameters": Key("named numbers", Group(numbers))}  # listed first
    for name, key in group.keys.items():
        stands_in_file_alone = type(key.kind) in (Several, Named)  # such as components
        if not stands_in_file_alone:
            keys[name] = key
    return Group(keys)


@dataclass(frozen=True)
class Reply:
    """What a command answers: an object for --json and a text for people, made only when wanted.

    inputs: the files behind it, for its provenance, of a command without a scene.
    warnings: why the model does not admit the equilibria behind the answer, empty if it admits them
    and None without equilibria. Unless it is None, the object gains the key `admissible`, true for
    an empty one.
    """

    data: Callable[[], JsonObject]
    text: Callable[[], str]
    inputs: Sequence[Path | InputFile] | None = None
    warnings: Sequence[str] | None = None

    @staticmethod
    def of(*answers: Answer, subject: object = None, more: str = "") -> Reply:
        """One reply of several answers: the keys of all their objects, and their texts in a row.

        subject: the scene or system that was analysed. Answers about a scene warn of its equilibria
        alone, and the reply holds these warnings, see `Reply`; those about other subjects are given
        at once. more: a text that follows those of the answers.
        """

        def data() -> JsonObject:
            joined: JsonObject = {}
            for answer in answers:
                for key, value in answer.to_dict().items():
                    # a value that one answer does not know (None) another one may know
                    if value is not None or key not in joined:
                        joined[key] = value
            return joined

        def text() -> str:
            return "\n\n".join(answer.text() for answer in answers) + more

        reasons: list[str] = []
        for answer in answers:
            reasons += answer.warnings
        if isinstance(subject, Scene):
            return Reply(data, text, warnings=reasons)
        for reason in reasons:
            warnings.warn(reason, InputWarning, stacklevel=2)
        return Reply(data, text)


class Parser(argparse.ArgumentParser):
    """The arguments of a command. Refusals read like all others, and values may be negative.

    An option that takes one value may be given once, by whichever of its names. `scene`: whether
    the command takes the file of a scene or system, and so --set.
    """

    def __init__(self, name: str, module: ModuleType, scene: bool) -> None:
        """Take the arguments of the command `name`, whose options and help `module` has."""
        # the first paragraph of its docstring reads "`squeal NAME`: what it does", the others are
        # examples; there is none under python -OO
        docstring = module.__doc__ or "`: see squeal --help"
        _, _, text = docstring.partition("`: ")
        about, _, examples = text.partition("\n\n")
        super().__init__(
            prog=f"squeal {name}",
            description=textwrap.fill(about[0].upper() + about[1:], 80),
            epilog=f"examples:\n{textwrap.indent(examples.rstrip(), '  ')}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        self.color = False  # Python 3.14 colours help by control characters, which `printed` shows
        self._negative_number_matcher = re.compile(r"-\.?\d")  # -50:1000:0:2e4 is a value too
        self.register("action", None, Once)
        self.set_defaults(typed={})  # options as they were typed, by name
        self.groups: dict[str, argparse._ActionsContainer] = {
            "": self,
            SYSTEMS: self.add_argument_group(SYSTEMS),
            FILES: self.add_argument_group(FILES),
        }
        add = self.add_argument
        if scene:
            add("scene", metavar="SCENE.yaml", help="the scene file; - reads standard input")
            add(
                "--set",
                metavar="NAME=VALUE",
                action="append",
                default=[],
                help="change one value of the file, such as mu=0.3 or time.stop=0.1; null leaves "
                "it out (repeatable)",
            )
        module.options(self)
        add("--json", action="store_true", help="print one JSON object instead")

    def error(self, message: str) -> NoReturn:
        """Refuse arguments, with the option that an unknown one was perhaps meant to be."""
        hint = "see"
        unknown = re.match(r"unrecognized arguments: --([\w-]+)", message)
        if unknown:
            options: dict[str, str] = {}  # the option to name, by what may be meant
            for action in self._actions:
                for option in action.option_strings:
                    options[option.lstrip("-")] = action.option_strings[0]
                    # also by its argument in Python, such as high of --max
                    options.setdefault(action.dest, action.option_strings[0])
            close = difflib.get_close_matches(unknown[1], options, 1)
            if close:
                hint = f"did you mean {options[close[0]]}? See"
        raise InputError(f"{message}; {hint} {self.prog} --help")

    def print_help(self, file: object = None) -> None:
        """Print the options, and end."""
        raise SystemExit(printed(self.format_help().rstrip("\n")))


def _reply(module: ModuleType, given: argparse.Namespace) -> Reply:
    """The answer of a command about a scene or system. Raises InputError.

    A refusal by the library names an argument of Python; where an option gave that argument, the
    option as it was typed stands in its place.
    """
    given.source = Source(given)
    try:
        reply: Reply = module.run(given)
    except MatrixError as error:
        raise InputError(f"{given.source.name}: {error}") from None
    except InputError as error:
        argument = _ARGUMENT.match(str(error))
        if argument is None or argument[1] not in given.typed:
            raise
        reason = str(error)[argument.end() :]
        raise InputError(f"{given.typed[argument[1]]}: {reason}") from None
    for warning in reply.warnings or ():
        warnings.warn(warning, InputWarning, stacklevel=2)
    return reply


def run(module: ModuleType, parser: Parser, arguments: Sequence[str]) -> int:
    """Run a command; the exit code 0, or 1 where the answer cannot be printed.

    module: that of the command, whose docstring describes it. Its function `options` has added the
    options to the parser; its function `run` makes the reply from the arguments. `_reply` adds the
    Source of a scene to them as `given.source`. Raises InputError and what the command raises.
    """
    given = parser.parse_args(arguments)
    has_scene = "scene" in given
    shown_warnings: list[str] = []  # each text once, those of the reply among them

    def warn_once(
        message: Warning | str, category: type[Warning], *_: object, **__: object
    ) -> None:
        text = str(message)
        if issubclass(category, RuntimeWarning):  # NumPy's of overflow and the like
            text += f"; {BEYOND}"
        if text not in shown_warnings:
            shown_warnings.append(text)
            say(f"squeal: warning: {text}")

    with warnings.catch_warnings():
        for kind in (RuntimeWarning, InputWarning):
            warnings.simplefilter("always", kind)
        warnings.showwarning = warn_once
        reply: Reply = _reply(module, given) if has_scene else module.run(given)
        if not given.json:
            return printed(reply.text())
        answer: JsonObject = {}
        if reply.warnings is not None:  # of equilibria, see `Reply`
            answer["admissible"] = not reply.warnings
        answer |= reply.data()
    answer["warnings"] = shown_warnings
    inputs = reply.inputs
    if has_scene:
        inputs = given.source.inputs
        if given.set:
            answer["set"] = given.source.changes
    if inputs is not None:
        answer["provenance"] = asdict(provenance(inputs, module.__name__))
    return printed(to_json(answer))
