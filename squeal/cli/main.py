"""The command line: finds the command's module by name and leaves the rest to it."""

from __future__ import annotations

import difflib
import importlib
import sys
from collections.abc import Sequence

from squeal import __version__
from squeal.cli.streams import exit_code, open_closed, printed, say
from squeal.errors import InputError

GROUPS = {
    "pads and systems from matrices": {
        "check": "what files of matrices hold: mass, real modes, what looks like wrong units",
        "eigenvalues": "complex eigenvalues and verdict",
        "critical-friction": "every threshold of stability in a range of mu",
        "map": "verdict over alpha1 and alpha2, or over any two parameters",
        "advise": "which parameter moves the critical friction most",
        "optimise": "parameters within bounds at which growth is least",
        "scatter": "what tolerances or ranges of many parameters make of stability",
        "report": "one page to show: what grows, since when, moved by what, how sure",
        "export": "matrices of a pad or a reduced system as files with a system file",
    },
    "motions": {
        "simulate": "integrate a scene of B1, B2 or BN through its contact changes",
        "cycles": "periodic motions, their stability, and their branch over a parameter",
    },
    "the article": {
        "sliding": "stiffness matrix of Eq. (22), bounds (23a, b) and all sliding equilibria",
        "claims": "the statements of the article, each with its measured verdict",
        "findings": "what is wrong in the article's equations, each measured",
        "identify": "search for the pad that reproduces most of the article's statements",
        "cite": "BibTeX for the article, this software and what a result was computed with",
        "take": "a figure, table or number of the report, with data, caption and references",
    },
}
COMMANDS = {name: about for group in GROUPS.values() for name, about in group.items()}
WITHOUT_SCENE = ("claims", "findings", "identify", "cite", "take")


def _run(name: str = "", *arguments: str) -> int:
    if name in ("", "-h", "--help"):
        width = max(map(len, COMMANDS))
        lines = ["usage: squeal COMMAND [OPTIONS] SCENE.yaml"]
        for title, commands in GROUPS.items():
            lines += ["", title]
            lines += [f"  {one.ljust(width)}  {about}" for one, about in commands.items()]
        lines += ["", "squeal COMMAND --help lists its options; --version the version"]
        if name:
            return printed("\n".join(lines))
        say("\n".join(lines))
        return 2
    if name == "--version":
        return printed(f"squeal {__version__}")
    if name not in COMMANDS:
        close = difflib.get_close_matches(name, COMMANDS, 1)
        meant = f"did you mean {close[0]}?" if close else f"allowed are {', '.join(COMMANDS)}"
        raise InputError(f"{name!r} is no command; {meant}")
    from squeal.cli.command import run  # what is said above needs nothing of it

    home = "squeal.article.commands" if name in GROUPS["the article"] else "squeal.cli"
    module = importlib.import_module(f"{home}.{name.replace('-', '_')}")
    return run(name, module, name not in WITHOUT_SCENE, arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code 0, 1 (not completed) or 2 (refused)."""
    open_closed()
    given = sys.argv[1:] if arguments is None else arguments
    return exit_code("squeal", lambda: _run(*given))
