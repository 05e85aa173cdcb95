"""Files that commands write: options, formats by name, and nothing lost."""

import argparse
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from squeal.errors import InputError
from squeal.io.writing import check_writable

# format by the end of the name, in the order of the help
FORMATS = {
    "table": (".csv", ".json", ".nc"),
    "curve": (".csv", ".json"),
    "figure": (".pdf", ".svg", ".png"),
    "animation": (".gif",),
    "sound": (".wav",),
}
_OTHER_NAMES = {
    "table": ("--csv", "--nc"),
    "curve": ("--threshold-curve",),
    "figure": ("--pdf", "--svg", "--png"),
    "animation": ("--gif",),
    "sound": ("--wav",),
}


class Once(argparse.Action):
    """Keeps the value and the option by which it was given, and refuses a second one.

    The last would win without a word, also of options of one meaning that have several names.
    """

    def __call__(self, parser: Any, namespace: Any, values: Any, option: str | None = None) -> None:
        before = getattr(namespace, f"{self.dest}_option", None)
        if before is not None:
            raise InputError(
                f"{option} {values}: {before} {getattr(namespace, self.dest)} is given already; "
                "one of them is allowed"
            )
        setattr(namespace, self.dest, values)
        setattr(namespace, f"{self.dest}_option", option)


def option_of(given: argparse.Namespace, name: str) -> str:
    """The option by which a value was given, such as --mu-max or --max."""
    used: str | None = getattr(given, f"{name}_option", None)
    return used or f"--{name.replace('_', '-')}"


def file_options(parser: argparse.ArgumentParser, **options: str) -> None:
    """Options `table`, `figure` and `sound` that name a file, such as table="write the verdicts to
    FILE"."""
    for name, words in options.items():
        parser.add_argument(
            f"--{name}",
            *_OTHER_NAMES[name],
            type=Path,
            metavar="FILE",
            help=f"{words}; whichever of these options, the format is what its name ends in, "
            f"{_listed(FORMATS[name])}",
        )


def check_outputs(given: argparse.Namespace, inputs: Iterable[Path]) -> None:
    """Refuse outputs that could not be written or would destroy something, before any work.

    Refused are a name without a known ending, an input, the same file twice, and an existing file
    that is not of the format its name says. Raises InputError.
    """
    taken = [(path, "an input") for path in inputs]
    for name, endings in FORMATS.items():
        path = getattr(given, name, None)
        if path is None:
            continue
        option = getattr(given, f"{name}_option")
        if path.suffix not in endings:
            raise InputError(f"{option} {path}: the name must end in {_listed(endings)}")
        check_writable(path, option)
        for other, words in taken:
            if _same(path, other):
                raise InputError(f"{option} {path}: is {words} too; another name is allowed")
        if path.is_file() and not _is_of(path):
            raise InputError(
                f"{option} {path}: exists and is no {path.suffix[1:].upper()} file; another name "
                "is allowed"
            )
        taken.append((path, "another output"))


def _listed(endings: Sequence[str]) -> str:
    return " or ".join(part for part in (", ".join(endings[:-1]), endings[-1]) if part)


def _same(one: Path, other: Path) -> bool:
    if one.exists() and other.exists():
        return os.path.samefile(one, other)
    return one.resolve() == other.resolve()


def _is_of(path: Path) -> bool:
    """True if a file is empty or begins as its ending says."""
    with path.open("rb") as stream:
        head = stream.read(1024)
    line = head.split(b"\n", 1)[0]
    begins = {
        ".pdf": head.startswith(b"%PDF"),
        ".png": head.startswith(b"\x89PNG"),
        ".svg": head.lstrip().startswith((b"<?xml", b"<svg")),
        ".gif": head.startswith(b"GIF8"),
        ".nc": head.startswith(b"CDF"),
        ".wav": head.startswith(b"RIFF"),
        ".json": head.lstrip().startswith((b"{", b"[")),
        ".csv": b"\0" not in head and b"," in line and not line.startswith((b"%PDF", b"{", b"<")),
    }
    return not head or begins[path.suffix]
