"""The command line: finds the command's module by name and leaves the rest to it."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import TYPE_CHECKING

from squeal import __version__
from squeal.cli.streams import exit_code, open_closed, printed, say
from squeal.errors import InputError, suggestion

if TYPE_CHECKING:
    from squeal.cli.command import Parser

ARTICLE = "the article: squeal article COMMAND"
GROUPS = {
    "to begin with": {
        "example": "write a pad, a brake, components or a rotor to try this on",
    },
    "what is stable: of pads, and of systems from matrices": {
        "check": "what files of matrices hold: mass, real modes, what looks like wrong units",
        "eigenvalues": "complex eigenvalues and verdict",
        "thresholds": "every threshold of stability in a range of friction or of another parameter",
        "critical-speeds": "critical speeds of a rotor, with whirl directions",
        "conditions": "what grows at each combination of friction, pressure, temperature, ...",
        "map": "verdict over alpha1 and alpha2, or over any two parameters",
    },
    "what to change, what to show": {
        "advise": "which parameter moves the critical friction most",
        "optimise": "parameters within bounds at which growth is least",
        "scatter": "what tolerances or ranges of many parameters make of stability",
        "report": "one page to show: what grows, since when, moved by what, how sure",
        "export": "matrices of a pad or a reduced system as files with a system file",
    },
    "how a pad moves": {
        "simulate": "integrate a scene of B1, B2 or BN through its contact changes",
        "cycles": "periodic motions, their stability, and their branch over a parameter",
    },
    ARTICLE: {
        "sliding": "stiffness matrix of Eq. (22), bounds (23a, b) and all sliding equilibria",
        "claims": "the statements of the article, each with its measured verdict",
        "findings": "what is wrong in the article's equations, each measured",
        "identify": "search for the pad that reproduces most of the article's statements",
        "cite": "BibTeX for the article, this software and what a result was computed with",
        "take": "a figure, table or number of the report, with data, caption and references",
    },
}
COMMANDS: dict[str, str] = {}
for _group in GROUPS.values():
    COMMANDS |= _group
ALIASES = {"critical-friction": "thresholds"}
WITHOUT_SCENE = ("example", "claims", "findings", "identify", "cite", "take")
EXAMPLES = """
examples
  squeal example pad
  squeal eigenvalues pad.yaml --sweep 0:0.6:61 --figure roots.png
  squeal thresholds brake.yaml --max 1 --band 500:5000
  squeal article claims

squeal COMMAND --help lists options and more examples; --version the version"""


def parser_of(name: str) -> tuple[ModuleType, Parser]:
    """The module of a command and the parser of its arguments."""
    from squeal.cli.command import Parser  # a refused command needs nothing of it

    package = "squeal.cli"
    typed = name
    if name in GROUPS[ARTICLE]:
        package = "squeal.article.commands"
        typed = f"article {name}"
    module = importlib.import_module(f"{package}.{name.replace('-', '_')}")
    return module, Parser(typed, module, name not in WITHOUT_SCENE)


def _overview(words: str, groups: Sequence[str]) -> str:
    """What the commands of some groups do, a line each."""
    width = max(map(len, COMMANDS))
    lines = [f"usage: squeal {words} [OPTIONS] SCENE.yaml"]
    for title in groups:
        lines += ["", title]
        for name, about in GROUPS[title].items():
            lines.append(f"  {name.ljust(width)}  {about}")
    return "\n".join([*lines, EXAMPLES])


def _run(arguments: Sequence[str]) -> int:
    """Run the command that is named first. Raises InputError and what the command raises."""
    if arguments[:1] == ["help"]:
        return _run([*arguments[1:], "--help"])
    if arguments[:1] == ["article"]:
        return _run_one_of([ARTICLE], "article COMMAND", arguments[1:])
    return _run_one_of(list(GROUPS), "COMMAND", arguments)


def _run_one_of(groups: Sequence[str], usage: str, arguments: Sequence[str]) -> int:
    """Run a command of some groups, or tell which there are."""
    typed = arguments[0] if arguments else ""
    if typed in ("-h", "--help"):
        return printed(_overview(usage, groups))
    if not typed:
        say(_overview(usage, groups))
        return 2
    if typed == "--version":
        return printed(f"squeal {__version__}")
    known = [name for group in groups for name in GROUPS[group]]
    name = typed
    if len(groups) > 1:  # the commands of `squeal` itself, not those of `squeal article`
        known.append("article")
        name = ALIASES.get(typed, typed)
    if name not in known:
        raise InputError(f"{name!r} is no command; {suggestion(name, known)}")
    from squeal.cli.command import run

    module, parser = parser_of(name)
    return run(module, parser, arguments[1:])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code 0, 1 (not completed) or 2 (refused)."""
    open_closed()
    # read when NumPy is loaded: threads of BLAS wait for each other longer than they compute
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    typed = list(sys.argv[1:] if arguments is None else arguments)
    return exit_code("squeal", lambda: _run(typed))
