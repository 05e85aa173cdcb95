"""What all commands share: options, output as table or JSON, exit codes."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from squeal.errors import BEYOND, ComputationError, InputError
from squeal.files.writing import check_writable, to_json


@dataclass(frozen=True)
class Answer:
    """What a command found: an object for --json and a text for people, made only when wanted."""

    data: Callable[[], dict[str, Any]]
    text: Callable[[], str]


class Parser(argparse.ArgumentParser):
    """An argument parser whose refusals read like all others."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see {self.prog} --help")


@dataclass(frozen=True)
class Command:
    """A command: its name, what it does, its own options and the function that runs it."""

    name: str
    summary: str
    run: Callable[[argparse.Namespace], Answer]
    options: Callable[[Parser], None] = lambda parser: None
    scene: bool = True

    def parser(self) -> Parser:
        """The parser of this command's arguments."""
        parser = Parser(prog=f"squeal {self.name}", description=self.summary, allow_abbrev=False)
        if self.scene:
            parser.add_argument("scene", metavar="SCENE.yaml", type=Path, help="the scene file")
        self.options(parser)
        parser.add_argument("--json", action="store_true", help="print one JSON object instead")
        return parser

    def main(self, arguments: Sequence[str] | None = None) -> int:
        """Run from arguments; returns the exit code 0, 1 (not completed) or 2 (refused)."""
        try:
            options = self.parser().parse_args(arguments)
            with warnings.catch_warnings():
                warnings.simplefilter("default", RuntimeWarning)
                warnings.showwarning = _warn
                answer = self.run(options)
                text = to_json(answer.data()) if options.json else answer.text()
            print(text, flush=True)
        except InputError as error:
            print(f"squeal: {error}", file=sys.stderr)
            return 2
        except ComputationError as error:
            print(f"squeal: {error}", file=sys.stderr)
            return 1
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            print(f"squeal: {error.args[-1]}; {BEYOND}", file=sys.stderr)
            return 1
        except MemoryError:
            print("squeal: there is not enough memory for this scene", file=sys.stderr)
            return 1
        except BrokenPipeError:
            # the reader has gone (head, less); nothing is left to say
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0
        except OSError as error:
            print(
                f"squeal: {error.filename or 'output'}: {error.strerror}",
                file=sys.stderr,
            )
            return 1
        except KeyboardInterrupt:
            print("squeal: stopped", file=sys.stderr)
            return 130
        return 0


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"squeal: warning: {message}; {BEYOND}", file=sys.stderr)


def file_options(parser: Parser, **options: str) -> None:
    """Options that name a file to write, such as csv="write the verdicts to FILE"."""
    for name, words in options.items():
        parser.add_argument(f"--{name}", type=Path, metavar="FILE", help=words)


def check_files(given: argparse.Namespace) -> None:
    """Refuse files that could not be written, before anything is computed."""
    for name in ("csv", "pdf"):
        path = getattr(given, name, None)
        if path is not None:
            check_writable(path, f"--{name}")


def table(rows: Sequence[Sequence[str]], right: bool = True) -> str:
    """Rows of text as aligned columns; the first column is aligned to the left."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if right and i else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)
