"""`squeal example`: write a pad, a brake, a rotor or another example, to begin from.

squeal example pad
squeal example brake --to tried
squeal example brake --rows 5000 --format nastran --to large
"""

import argparse
from pathlib import Path

from squeal.cli.command import Parser, Reply
from squeal.cli.options import whole
from squeal.errors import InputError
from squeal.examples.files import ABOUT, EXAMPLES, FORMS, Size, write_example
from squeal.io.writing import aligned_text


def options(parser: Parser) -> None:
    """Options of `squeal example`."""
    names = ", ".join(EXAMPLES)
    parser.add_argument("name", nargs="?", metavar="NAME", help=f"{names}; left out: list them")
    parser.add_argument(
        "--rows",
        metavar="N",
        read=whole(500, 1_000_000),
        default=Size.rows,
        help="of a brake of solids, at least so many degrees of freedom (500)",
    )
    parser.add_argument(
        "--format",
        choices=FORMS,
        default=Size.form,
        help="whose program's files a brake of solids has (abaqus)",
    )
    parser.add_argument(
        "--to",
        type=Path,
        metavar="FOLDER",
        default=Path(),
        help="a folder (this one); nothing in it is overwritten",
    )


def run(given: argparse.Namespace) -> Reply:
    """List the examples, or write one."""
    if given.name is None:
        lines = [(name, example.about) for name, example in EXAMPLES.items()]
        return Reply(lambda: {"names": list(EXAMPLES)}, lambda: aligned_text(lines, right=False))
    if given.format != Size.form and given.name != "brake":
        raise InputError(f"--format {given.format}: is not allowed with {given.name}; brake has it")
    files = write_example(given.name, given.to, Size(given.rows, given.format))
    first = EXAMPLES[given.name].first
    answer = {"name": given.name, "files": files, "first": first}
    listed = aligned_text([(file, ABOUT.get(file, "")) for file in files], right=False)
    return Reply(lambda: answer, lambda: f"{listed}\n\nbegin with: {first}")
