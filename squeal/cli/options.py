"""Options of the commands: how their values are read, and what files they may write.

Each is declared once, in `OPTIONS`; a command takes those that it understands by their names.
"""

import argparse
import math
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from squeal.errors import InputError

MOST = 100_000  # values of a parameter
WORKERS = 256
Read = Callable[[str, str], Any]
"""What makes a value of the text given, and of the option's name, for refusals."""


def not_allowed(given: str, words: str) -> InputError:
    """The InputError of an option, as it was given, that must be what `words` say."""
    return InputError(f"{given}: is not allowed; it must be {words}")


def numbers(
    given: str, option: str, count: int, words: str, holds: Callable[..., bool] | None = None
) -> tuple[float, ...]:
    """So many finite numbers of which `holds` is true, as `words` say. Raises InputError."""
    try:
        values = tuple(map(float, given.split(":")))
    except ValueError:
        values = ()
    right = len(values) == count and all(map(math.isfinite, values))
    if not right or not (holds is None or holds(*values)):
        raise not_allowed(f"{option} {given}", words)
    return values


def one(words: str, holds: Callable[[float], bool] | None = None, scale: float = 1.0) -> Read:
    """What reads a finite number of which `holds` is true."""
    return lambda given, option: scale * numbers(given, option, 1, words, holds)[0]


def whole(low: int, high: int = 10**9) -> Read:
    """What reads a whole number in a range."""
    words = f"a whole number from {low} to {high}"
    read = one(words, lambda n: n == int(n) and low <= n <= high)
    return lambda given, option: int(read(given, option))


def word(*allowed: str) -> Read:
    """What reads one of some words."""

    def read(given: str, option: str) -> str:
        if given not in allowed:
            raise not_allowed(f"{option} {given}", f"one of {', '.join(allowed)}")
        return given

    return read


def path(given: str, option: str) -> Path:
    """The file or folder of that name."""
    return Path(given)


def spaced(given: str, option: str) -> list[float]:
    """The N values from A to B that A:B:N names. Raises InputError."""

    def holds(a: float, b: float, n: float) -> bool:
        return a < b and n == int(n) and 2 <= n <= MOST

    words = f"A:B:N with A < B and a whole number N from 2 to {MOST}"
    a, b, n = numbers(given, option, 3, words, holds)
    return [a + (b - a) * i / (int(n) - 1) for i in range(int(n))]


def band(given: str, option: str) -> tuple[float, ...]:
    """The ends of a band of frequencies, LOW:HIGH. Raises InputError."""
    words = "LOW:HIGH in Hz with 0 <= LOW < HIGH, such as 500:8000"
    return numbers(given, option, 2, words, lambda low, high: 0.0 <= low < high)


def region(given: str, option: str) -> tuple[float, ...]:
    """A rectangle of the complex plane, RE0:RE1:IM0:IM1. Raises InputError."""
    words = "RE0:RE1:IM0:IM1 in 1/s and rad/s with RE0 < RE1 and IM0 < IM1"
    return numbers(given, option, 4, words, lambda a, b, c, d: a < b and c < d)


@dataclass(frozen=True)
class Option:
    """An option by its names, of which the first is shown in messages that name none."""

    names: str
    metavar: str
    help: str
    read: Read = lambda given, _: given
    group: str = ""


SYSTEMS = "systems from matrices"
FILES = "files"
OPTIONS = {
    "sweep": Option("--sweep --mu", "A:B:N", "values of mu or of the free parameter", spaced),
    "high": Option("--max --mu-max", "MU", "upper end of the range", one("a finite number")),
    "n": Option("--n", "N", "points a side (200; of a system 41)", whole(2, 4000)),
    "first": Option("--first", "NAME:LOW:HIGH[:log]", "first parameter and range (alpha1:0:pi)"),
    "second": Option("--second", "NAME:LOW:HIGH[:log]", "second parameter and range (alpha2:0:pi)"),
    "scatter": Option(
        "--scatter", "FILE", "distribution of the first loss over the tolerances that FILE names",
        path,
    ),
    "workers": Option("--workers", "N", "processes for --scatter (1)", whole(1, WORKERS)),
    "band": Option("--band", "LOW:HIGH", "frequencies in Hz", band),
    "modes": Option("--modes", "N", "the N lowest modes", whole(1, MOST), SYSTEMS),
    "region": Option("--region", "RE0:RE1:IM0:IM1", "roots, 1/s and rad/s", region, SYSTEMS),
    "at": Option("--at", "VALUE", "of the free parameter", one("a finite number"), SYSTEMS),
    "min": Option("--min", "VALUE", "lower end of the range (0)", one("a finite number"), SYSTEMS),
    "method": Option(
        "--method", "NAME", "full, reduced (complex modes, certified) or modal (real modes)",
        word("full", "reduced", "modal"), SYSTEMS,
    ),
    "memory": Option(
        "--memory", "GB", "memory that may be used (what is free)",
        one("a number above 0", lambda size: size > 0.0, 1e9), SYSTEMS,
    ),
    "shape": Option("--shape", "N", "draw this mode on the nodes", whole(1, MOST), SYSTEMS),
}  # fmt: skip

# names of an option and ends of a file's name, each of a format, in the order of the help
FILE_OPTIONS = {
    "table": ("--table --csv", (".csv", ".json")),
    "curve": ("--curve --threshold-curve", (".csv", ".json")),
    "figure": ("--figure --pdf --svg --png", (".pdf", ".svg", ".png")),
}


_BEGINS = {
    ".pdf": (b"%PDF",), ".png": (b"\x89PNG",), ".svg": (b"<?xml", b"<svg"), ".json": (b"{", b"["),
}  # fmt: skip


class Once(argparse.Action):
    """Reads the value, keeps it with the option and text, and refuses a second one.

    The last would win without a word, also of options of one meaning that have several names.
    """

    def __init__(self, *arguments: Any, read: Read | None = None, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._read = read

    def __call__(self, parser: Any, namespace: Any, values: Any, option: str | None = None) -> None:
        before = getattr(namespace, f"{self.dest}_said", None)
        if before is not None:
            words = f"{option} {values}: {before} is given already; one of them is allowed"
            raise InputError(words)
        setattr(namespace, f"{self.dest}_said", f"{option} {values}")
        value = values if self._read is None else self._read(values, option or "")
        setattr(namespace, self.dest, value)


def said(given: argparse.Namespace, name: str) -> str:
    """An option with its value as it was given, such as --max 0.5."""
    return str(getattr(given, f"{name}_said", None) or f"--{name.replace('_', '-')}")


def take(parser: Any, names: str, **defaults: Any) -> None:
    """Give a parser some of `OPTIONS`, by their keys."""
    for key in names.split():
        option = OPTIONS[key]
        parser.within(option.group).add_argument(
            *option.names.split(),
            dest=key,
            metavar=option.metavar,
            help=option.help,
            read=option.read,
            default=defaults.get(key),
        )


def take_files(parser: Any, **options: str) -> None:
    """Options that name a file to write, such as table="the verdicts"."""
    for key, words in options.items():
        names, endings = FILE_OPTIONS[key]
        words = f"write {words} to FILE, whose name ends in {_listed(endings)}"
        parser.within(FILES).add_argument(
            *names.split(), dest=key, metavar="FILE", read=path, help=words
        )


def refuse(given: argparse.Namespace, names: str, why: str) -> None:
    """Refuse options that do not go with what is given. Raises InputError."""
    for name in names.split():
        value = getattr(given, name, None)
        if value is not None and value is not False:
            raise InputError(f"{said(given, name)}: is not allowed with {why}")


def write_files(given: argparse.Namespace, answer: Any, **drawn: Any) -> None:
    """Write the table and the figure of an answer that are requested."""
    if given.table is not None:
        answer.save(given.table)
    if getattr(given, "figure", None) is not None:
        answer.plot(given.figure, name=given.source.name, **drawn)


def check_outputs(given: argparse.Namespace, inputs: Iterable[Path]) -> None:
    """Refuse outputs that could not be written or would destroy something, before any work.

    Refused are a name without a known ending, an input, the same file twice, a link to itself, what
    is no plain file in a writable folder, and an existing file that is not of the format its name
    says. Raises InputError.
    """
    taken = {Path(os.path.realpath(path)): "an input" for path in inputs}
    for name, (_, endings) in FILE_OPTIONS.items():
        path = getattr(given, name, None)
        if path is None:
            continue
        option = said(given, name)
        if path.suffix not in endings:
            raise InputError(f"{option}: the name must end in {_listed(endings)}")
        place = Path(os.path.realpath(path))  # of a link, also one to no file yet, where it leads
        if place.is_symlink() or (place.exists() and not place.is_file()):
            raise InputError(f"{option}: is no plain file; the name of a file is allowed")
        if not os.access(place.parent, os.W_OK):
            raise InputError(f"{option}: the folder {place.parent} does not exist, or not to write")
        if place in taken:
            raise InputError(f"{option}: is {taken[place]} too; another name is allowed")
        if place.is_file() and not _is_of(path):
            kind = path.suffix[1:].upper()
            raise InputError(f"{option}: exists and is no {kind} file; another name is allowed")
        taken[place] = "another output"


def _listed(endings: Sequence[str]) -> str:
    return " or ".join(part for part in (", ".join(endings[:-1]), endings[-1]) if part)


def _is_of(path: Path) -> bool:
    """True if a file is empty or begins as its ending says."""
    with path.open("rb") as stream:
        head = stream.read(1024)
    if path.suffix == ".csv":
        line = head.split(b"\n", 1)[0]
        text = b"\0" not in head and b"," in line and not line.startswith((b"%PDF", b"{", b"<"))
        return text or not head
    return not head or head.lstrip().startswith(_BEGINS[path.suffix])
