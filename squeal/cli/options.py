"""Options of the commands: how their values are read, and what files they may write.

Each is declared once, in `OPTIONS`; a command takes those that it understands by their names.
"""

import argparse
import math
import os
import re
from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from squeal.errors import InputError
from squeal.io.writing import Answer
from squeal.schema import Angle, Place, scalar

MOST = 100_000  # values of a parameter
Read = Callable[[str], Any]
"""What makes a value of the text of an option, or raises InputError."""


class Range(NamedTuple):
    """A parameter and its range."""

    name: str
    low: float
    high: float


class AxisRange(NamedTuple):
    """A parameter of an axis, its range, and whether the axis is logarithmic."""

    name: str
    low: float
    high: float
    log: bool


def numbers(
    allowed: str, holds: Callable[..., bool], convert: Callable[..., Any] = lambda *values: values
) -> Read:
    """A reader of finite numbers between colons, such as those of 0:0.6:61.

    allowed: says in a refusal which numbers are allowed; holds: whether the numbers are allowed,
    called with one argument for each; convert: makes the option's value from the numbers, called
    alike; left out, the value is a tuple of them.
    """

    def read(text: str) -> Any:
        try:
            values = [float(part) for part in text.split(":")]
            if all(map(math.isfinite, values)) and holds(*values):
                return convert(*values)
        except (ValueError, TypeError):  # no numbers, or not as many as `holds` takes
            pass
        raise InputError(f"is not allowed; it must be {allowed}")

    return read


def whole(low: int, high: int = 10**9) -> Read:
    """What reads a whole number in a range."""
    allowed = f"a whole number from {low} to {high}"
    return numbers(allowed, lambda n: n == int(n) and low <= n <= high, int)


def named_range(text: str) -> Range:
    """The parameter and range that NAME:LOW:HIGH names. Raises InputError."""
    name, *ends = text.split(":")
    values = [Angle().convert(scalar(end)) for end in ends]  # a formula of pi is allowed
    match values:
        case [float(low), float(high)] if low < high:
            return Range(name, low, high)
    raise InputError("is not allowed; it must be NAME:LOW:HIGH with LOW < HIGH, such as mu:0.1:0.6")


def axis(text: str) -> AxisRange:
    """The axis that NAME:LOW:HIGH names, logarithmic if :log follows. Raises InputError."""
    name, low, high = named_range(text.removesuffix(":log"))
    return AxisRange(name, low, high, text.endswith(":log"))


SYSTEMS = "systems from matrices"
FILES = "files"
NUMBER = numbers("a finite number", lambda value: True, float)
MEMORY = numbers("a number above 0", lambda size: size > 0.0, lambda size: 1e9 * size)
SWEEP = numbers(
    f"A:B:N with A < B and a whole number N from 2 to {MOST}",
    lambda a, b, n: a < b and n == int(n) and 2 <= n <= MOST,
    lambda a, b, n: [a + (b - a) * i / (n - 1) for i in range(int(n))],
)


def sweep_values(text: str) -> list[float]:
    """The values that A:B:N names, those of the free parameter. Raises InputError."""
    named = re.match(r"(?!nan|inf)([a-z_]\w*)[=:]", text, re.IGNORECASE)
    if named:
        raise InputError(
            f"is not allowed; it must be A:B:N, of a pad values of mu; of a system --set "
            f"parameter={named[1]} beside it makes {named[1]} the free parameter"
        )
    return list(SWEEP(text))


BAND = numbers("LOW:HIGH in Hz with 0 <= LOW < HIGH", lambda low, high: 0.0 <= low < high)
REGION = numbers("RE0:RE1:IM0:IM1 with RE0 < RE1, IM0 < IM1", lambda a, b, c, d: a < b and c < d)


@dataclass(frozen=True)
class Option:
    """An option of several commands: its names, of which help shows the first, and what its value
    is called there; what reads the value, or the words that are allowed."""

    names: str
    metavar: str
    help: str
    read: Read | tuple[str, ...]
    of_systems: bool = False  # of those from matrices alone


# fmt: off
OPTIONS = {
    "values": Option(
        "--sweep --mu", "A:B:N", "values of mu or of the free parameter", sweep_values),
    "high": Option(
        "--max --mu-max", "VALUE",
        "upper end of the range (2 of mu or its value above that, else twice the value)", NUMBER),
    "n": Option("--n", "N", "points a side (200; of a system 41)", whole(2, 4000)),
    "first": Option(
        "--first", "NAME:LOW:HIGH[:log]", "first parameter and range (alpha1:0:pi)", axis),
    "second": Option(
        "--second", "NAME:LOW:HIGH[:log]", "second parameter and range (alpha2:0:pi)", axis),
    "workers": Option(
        "--workers", "N", "threads or processes; any number gives one answer (1)", whole(1, 256)),
    "band": Option("--band", "LOW:HIGH", "frequencies in Hz", BAND),
    "modes": Option(
        "--modes", "N", "the N modes of least |lambda|", whole(1, MOST), of_systems=True),
    "region": Option(
        "--region", "RE0:RE1:IM0:IM1", "roots, 1/s and rad/s", REGION, of_systems=True),
    "at": Option("--at", "VALUE", "of the free parameter", NUMBER, of_systems=True),
    "low": Option(
        "--min", "VALUE", "lower end of the range (0, beside a pole a hundredth of the upper)",
        NUMBER, of_systems=True),
    "method": Option(
        "--method", "NAME", "full, reduced (complex modes) or modal (a first look with errors)",
        ("full", "reduced", "modal"), of_systems=True),
    "memory": Option(
        "--memory", "GB", "memory that may be used (what is free)", MEMORY, of_systems=True),
    "test": Option(
        "--test", "FILE", "pair modes with a test (name, frequency_hz) or a --table", Path,
        of_systems=True),
    "parts": Option(
        "--parts", "FILE", "where energy is: a .csv file with part and node, or part and row",
        Path, of_systems=True),
    "width": Option(
        "--width", "NAME", "of the --chart: page or column (page)", ("page", "column")),
    "shape": Option(
        "--shape", "N", "draw this mode on the nodes", whole(1, MOST), of_systems=True),
}
# fmt: on

Heads = dict[str, bytes]
"""How a file of each format begins, a regular expression by the suffix of its name."""
_TABLE: Heads = {".csv": rb"(?!%PDF|[{<])[^\0\n]*,[^\0]*\Z", ".json": rb"\s*[{\[]"}
_FIGURE: Heads = {".pdf": rb"\s*%PDF", ".svg": rb"\s*<(\?xml|svg)", ".png": rb"\s*\x89PNG"}
FILE_OPTIONS: dict[str, tuple[str, Heads]] = {
    "table": ("--table --csv", _TABLE),
    "curves": ("--curve --threshold-curve", _TABLE),
    "figure": ("--figure --pdf --svg --png", _FIGURE),
    "chart": ("--chart", _FIGURE),
    "shapes": ("--shapes", {".vtk": rb"# vtk", ".unv": rb"\s*-1\s"}),
    "page": ("--output --html", {".html": rb"\s*<!doctype html>"}),
    "journal": ("--journal", {}),  # of any name; its reader refuses another file
}
"""Options that name a file to write: their names, and the formats that it may have."""


class Grouped(Protocol):
    """A parser whose options stand in groups by their titles, "" for those of all commands."""

    groups: dict[str, argparse._ActionsContainer]


class Once(argparse.Action):
    """Reads a value, keeps the option as typed, and refuses a second one, also under another name.

    `typed` of the namespace holds each option as typed, by its `dest` and by each of its names:
    "--max 0.5" stands under high and max. A refusal of the library names its argument, high.
    """

    def __init__(self, *arguments: Any, read: Read = lambda text: text, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._read = read
        self.spellings = list(self.option_strings)

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        given: argparse.Namespace,
        text: Any,
        option: str | None = None,
    ) -> None:
        """Read the value, and set it under `dest`; `option` is the name that was typed.

        Raises InputError if the option was given before, or its text is not allowed.
        """
        at = Place(f"{option} {text}")
        if self.dest in given.typed:
            before = given.typed[self.dest]
            raise at.refuse(f"{before} is given already; one of them is allowed")
        for name in (self.dest, *self.spellings):
            given.typed[name.lstrip("-").replace("-", "_")] = str(at)
        with at.prefixing_errors():
            setattr(given, self.dest, self._read(text))


def add_option(group: argparse._ActionsContainer, names: str, **settings: Any) -> None:
    """An option by its first name, which help shows; the others are taken too.

    They are entered where argparse looks options up, which is all that finds them.
    """
    first, *others = names.split()
    action = group.add_argument(first, **settings)
    assert isinstance(action, Once)
    action.spellings = [first, *others]
    for name in others:
        alias = copy(action)
        alias.option_strings = [name]  # which argparse names where the value lacks
        group._option_string_actions[name] = alias


def as_typed(given: argparse.Namespace, name: str) -> str:
    """An option with its value as it was typed, such as --max 0.5."""
    return str(given.typed.get(name, f"--{name.replace('_', '-')}"))


def take(parser: Grouped, *keys: str, **defaults: Any) -> None:
    """Give a parser some of `OPTIONS`, by their keys."""
    for key in keys:
        option = OPTIONS[key]
        reading = "choices" if isinstance(option.read, tuple) else "read"
        add_option(
            parser.groups[SYSTEMS if option.of_systems else ""],
            option.names,
            dest=key,
            metavar=option.metavar,
            help=option.help,
            default=defaults.get(key),
            **{reading: option.read},
        )


def take_files(parser: Grouped, **contents: str) -> None:
    """Options that name a file to write, such as table="the verdicts"."""
    for key, content in contents.items():
        names, heads = FILE_OPTIONS[key]
        about = f"write {content} to FILE"
        if heads:
            about += f", whose name ends in {' or '.join(heads)}"
        add_option(parser.groups[FILES], names, dest=key, metavar="FILE", read=Path, help=about)


def take_changes(parser: Grouped) -> None:
    """The option that gives matrices whose influence is wanted."""
    parser.groups[SYSTEMS].add_argument(
        "--change",
        metavar="NAME.K=FILE",
        action="append",
        help="--sensitivity to a change that is no parameter too: what it adds to K, or to M or C "
        "(NAME.M, NAME.C; repeatable)",
    )


def changes(given: argparse.Namespace) -> dict[str, dict[str, str]] | None:
    """The files of these matrices by name and part, None without. Raises InputError."""
    matrices: dict[str, dict[str, str]] = {}
    for change in vars(given).get("change") or ():
        key, _, file = change.partition("=")
        name, _, part = key.strip().rpartition(".")
        if not (name and file) or part in matrices.setdefault(name, {}):
            raise InputError(
                f"--change {change}: is not allowed; it must be NAME.M, NAME.C or NAME.K=FILE, "
                "each given once"
            )
        matrices[name][part] = file
    return matrices or None


def refuse(given: argparse.Namespace, *names: str, beside: str) -> None:
    """Refuse options that do not go with what is given. Raises InputError."""
    for name in names:
        value = getattr(given, name)
        if value is not None and value is not False:
            raise InputError(f"{as_typed(given, name)}: is not allowed with {beside}")


def write_files(
    given: argparse.Namespace, answer: Answer, drawn: Answer | None = None, **settings: Any
) -> None:
    """Write the requested table of an answer, and the requested figure: that of `drawn`, if given,
    else of the answer."""
    if getattr(given, "figure", None) is not None:  # the first, since it may be refused
        (drawn or answer).save(given.figure, name=given.source.name, **settings)
    if given.table is not None:
        answer.save(given.table)


def check_outputs(given: argparse.Namespace, inputs: Iterable[object]) -> None:
    """Refuse outputs that could not be written, or would replace an input, another output or a file
    of another kind. Raises InputError."""
    taken: dict[Path, str] = {}  # what each file is already
    for input_path in inputs:
        if isinstance(input_path, Path):
            taken[Path(os.path.realpath(input_path))] = "an input"
    for name, (_, heads) in FILE_OPTIONS.items():  # `heads`: how files begin, by their suffix
        path = getattr(given, name, None)
        if path is None:
            continue
        at = Place(as_typed(given, name))
        if heads and path.suffix not in heads:
            raise at.refuse(f"the name must end in {' or '.join(heads)}")
        # `realpath` follows links, also one to a file that does not exist yet. Links in a circle
        # lead to no file: it returns one of them
        target = Path(os.path.realpath(path))
        if target.is_symlink() or (target.exists() and not target.is_file()):
            raise at.refuse("is no plain file; the name of a file is allowed")
        if not os.access(target.parent, os.W_OK):
            raise at.refuse(f"the folder {target.parent} does not exist or cannot be written to")
        if target in taken:
            raise at.refuse(f"is {taken[target]} too; another name is allowed")
        if target.is_file():
            _check_replaced(target, path.suffix, heads, at)
        taken[target] = "another output"


def _check_replaced(target: Path, suffix: str, heads: Heads, at: Place) -> None:
    """Refuse to replace a file that does not begin as the format does that its name says."""
    with target.open("rb") as stream:
        head = stream.read(1024)
    if head and not re.match(heads.get(suffix, b""), head):
        raise at.refuse(f"exists and is no {suffix[1:].upper()} file; another name is allowed")
