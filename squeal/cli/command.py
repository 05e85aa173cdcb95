"""What all commands share: options, output as table or JSON, warnings, exit codes.

argparse is kept: typer and cyclopts would save some 60 lines here and cost 0.1 to 0.3 s of each
start.
"""

import argparse
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from squeal.cli.options import Once, check_outputs
from squeal.cli.source import STANDARD_INPUT, read_source
from squeal.cli.streams import printed, say
from squeal.errors import BEYOND, InputError, InputWarning, MatrixError
from squeal.io.provenance import InputFile, provenance
from squeal.io.writing import Answer, to_json

_OF_NUMBERS = re.compile("overflow|underflow|divide by zero|invalid value")  # of NumPy


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
    def of(*answers: Answer, inputs: Any = None, judged: bool = False, **more: Any) -> "Reply":
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
