"""What all commands share: options, output as table or JSON, exit codes."""

import argparse
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from squeal.cli.outputs import Once, check_outputs
from squeal.cli.source import STANDARD_INPUT, read_source
from squeal.cli.streams import printed, say
from squeal.errors import BEYOND, InputError, InputWarning, MatrixError
from squeal.io.provenance import InputFile, provenance
from squeal.io.writing import to_json


@dataclass(frozen=True)
class Answer:
    """What a command found: an object for --json and a text for people, made only when wanted.

    inputs: the files behind it, whose provenance joins the object; None: the scene's, if any.
    warnings: reasons why the equilibria behind it are none that the model means; None where there
    are no equilibria. They go to standard error and, with the key `admissible`, into the object,
    which may have such a key of its own.
    """

    data: Callable[[], dict[str, Any]]
    text: Callable[[], str]
    inputs: Sequence[Path | InputFile] | None = None
    warnings: Sequence[str] | None = None

    def judged(self) -> dict[str, Any]:
        """The object, which says whether all that it tells of is admissible."""
        if self.warnings is None:
            return self.data()
        return {"admissible": not self.warnings, "warnings": list(self.warnings)} | self.data()


class Parser(argparse.ArgumentParser):
    """An argument parser whose refusals read like all others, and whose values may be negative.

    An option that takes one value may be given once, by whichever of its names.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._negative_number_matcher = re.compile(r"-\.?\d")  # -50:1000:0:2e4 is a value too
        self.register("action", None, Once)

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see {self.prog} --help")

    def print_help(self, file: Any = None) -> None:
        """Print the options, and end."""
        raise SystemExit(printed(self.format_help().rstrip("\n")))


@dataclass(frozen=True)
class Command:
    """A command: its name and its module, whose docstring says what it does.

    The module's function `options` adds options to a parser, and `run` makes the Answer from them.
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

    def _answer(self, options: argparse.Namespace) -> str:
        changes = {}
        if self.scene:
            named = [] if options.scene == STANDARD_INPUT else [Path(options.scene)]
            scatter = getattr(options, "scatter", None)
            check_outputs(options, named if scatter is None else [*named, scatter])
            options.source = read_source(options.scene, options.set)
            check_outputs(options, options.source.named_files())
            changes = {"set": options.source.changes} if options.set else {}
        try:
            answer = self.module.run(options)
        except MatrixError as error:
            if not self.scene:
                raise
            raise InputError(f"{options.source.name}: {error}") from None
        for words in answer.warnings or ():
            warnings.warn(words, InputWarning, stacklevel=2)
        if not options.json:
            return str(answer.text())
        inputs = answer.inputs
        if self.scene and inputs is None:
            inputs = [options.source.file]
        made = {}
        if inputs is not None:
            made = {"provenance": provenance(inputs, self.module.__name__).to_dict()}
        return to_json(answer.judged() | made | changes)

    def main(self, arguments: Sequence[str] | None = None) -> int:
        """Run from arguments; the exit code 0, or 1 where the answer cannot be printed."""
        options = self.parser().parse_args(arguments)
        with warnings.catch_warnings():
            for kind in (RuntimeWarning, InputWarning):
                warnings.simplefilter("default", kind)
            warnings.showwarning = _warn
            text = self._answer(options)
        return printed(text)


def _warn(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
    why = "" if issubclass(category, InputWarning) else f"; {BEYOND}"
    say(f"squeal: warning: {message}{why}")
