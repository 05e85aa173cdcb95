"""`squeal completion`: print a script that completes commands, options and names of files.

source <(squeal completion bash)
squeal completion zsh > ~/.zfunc/_squeal
squeal completion fish > ~/.config/fish/completions/squeal.fish
"""

import argparse
import importlib
from typing import Any

from squeal.cli.command import Parser, Reply
from squeal.cli.main import ARTICLE, COMMANDS, GROUPS, parser_of


def options(parser: Parser) -> None:
    """Options of `squeal completion`."""
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help="bash, zsh or fish")


def _tree(prog: str, names: list[str], shtab: Any) -> argparse.ArgumentParser:
    """One parser of some commands, whose arguments that name files are marked."""
    root = argparse.ArgumentParser(prog=prog)
    commands: Any = root.add_subparsers()
    for name in names:
        commands._parser_class = lambda of=name, **_: parser_of(of)[1]
        for action in commands.add_parser(name, help=COMMANDS[name])._actions:
            if any(word in (action.metavar or "") for word in ("FILE", "FOLDER", ".yaml", ".json")):
                action.complete = shtab.DIRECTORY if action.metavar == "FOLDER" else shtab.FILE
    if names[0] not in GROUPS[ARTICLE]:
        article = _tree("squeal article", list(GROUPS[ARTICLE]), shtab)
        commands._parser_class = lambda **_: article
        commands.add_parser("article", help="what the article says, and what is wrong in it")
    return root


def run(given: argparse.Namespace) -> Reply:
    """Print the script."""
    shtab = importlib.import_module("shtab")
    names = [name for name in COMMANDS if name not in GROUPS[ARTICLE]]
    script = shtab.complete(_tree("squeal", names, shtab), given.shell)
    return Reply(lambda: {"shell": given.shell, "script": script}, lambda: script, inputs=[])
