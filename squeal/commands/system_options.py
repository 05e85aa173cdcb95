"""Options of the queries that speak of systems from matrices, and how they are read."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence

from squeal.analysis.systems.wanted import Progress, Wanted, quiet
from squeal.errors import InputError
from squeal.scene import PlainSystem
from squeal.scene.terms import SystemFile
from squeal.stability.sparse.region import Rectangle

MOST = 100_000


def band_option(parser: argparse.ArgumentParser) -> None:
    """The option --band."""
    parser.add_argument("--band", metavar="LOW:HIGH", help="frequencies wanted, Hz")


def work_options(parser: argparse.ArgumentParser) -> None:
    """Options about how a large system is worked on."""
    parser.add_argument(
        "--memory", metavar="GB", help="memory that may be used (what is free if left out)"
    )
    parser.add_argument(
        "--progress", action="store_true", help="tell the steps on standard error, also to a file"
    )


def asked(given: argparse.Namespace) -> bool:
    """True if an option was given that only systems from matrices know."""
    return any(
        getattr(given, name, None) is not None for name in ("band", "modes", "region", "method")
    )


def system_of(given: argparse.Namespace) -> SystemFile | None:
    """The system that the file holds, if it is of the general form or options ask for its terms."""
    found: SystemFile | None = given.source.terms()
    if found is None and asked(given):
        plain: PlainSystem | None = given.source.system()
        if plain is not None:
            return SystemFile(plain.terms(), plain.reference)
    return found


def numbers(given: str, option: str, count: int, words: str) -> tuple[float, ...]:
    """Finite numbers between colons. Raises InputError."""
    try:
        found = tuple(float(part) for part in given.split(":"))
    except ValueError:
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        raise InputError(f"{option} {given}: is not allowed; it must be {words}")
    return found


def wanted_of(given: argparse.Namespace) -> Wanted:
    """Which roots the options ask for. Raises InputError."""
    band = region = modes = None
    if given.band is not None:
        low, high = numbers(
            given.band, "--band", 2, "LOW:HIGH in Hz with 0 <= LOW < HIGH, such as 500:8000"
        )
        band = (low, high)
    if getattr(given, "region", None) is not None:
        words = "RE0:RE1:IM0:IM1 in 1/s and rad/s with RE0 < RE1 and IM0 < IM1"
        region = Rectangle(*numbers(given.region, "--region", 4, words))
    if getattr(given, "modes", None) is not None:
        modes = whole(given.modes, "--modes", 1, MOST)
    return Wanted(band, region, modes)


def whole(given: str, option: str, low: int, high: int) -> int:
    """A whole number in a range. Raises InputError."""
    try:
        found = int(given)
    except ValueError:
        found = low - 1
    if not low <= found <= high:
        raise InputError(
            f"{option} {given}: is not allowed; it must be a whole number from {low} to {high}"
        )
    return found


def values_of(given: str) -> list[float]:
    """The values of a parameter that A:B:N names. Raises InputError."""
    words = f"A:B:N with A < B and a whole number N from 2 to {MOST}"
    low, high, number = numbers(given, "--sweep", 3, words)
    if not low < high or number != int(number) or not 2 <= number <= MOST:
        raise InputError(f"--sweep {given}: is not allowed; it must be {words}")
    count = int(number)
    return [low + (high - low) * i / (count - 1) for i in range(count)]


def value_in(given: str | None, option: str) -> float | None:
    """A finite number, None if it is left out. Raises InputError."""
    return None if given is None else numbers(given, option, 1, "a finite number")[0]


def memory_of(given: argparse.Namespace) -> float | None:
    """Bytes that --memory allows, None if it is left out. Raises InputError."""
    found = value_in(given.memory, "--memory")
    if found is not None and found <= 0.0:
        raise InputError(f"--memory {given.memory}: is not allowed; it must be a number above 0")
    return None if found is None else 1e9 * found


def progress_of(given: argparse.Namespace) -> Progress:
    """Where the steps of long work are told: on standard error if it is a terminal or on demand."""
    if not (given.progress or sys.stderr.isatty()):
        return quiet
    return lambda text: print(f"squeal: {text}", file=sys.stderr, flush=True)


def refuse_options(given: argparse.Namespace, names: Sequence[str]) -> None:
    """Refuse options of systems from matrices for a scene. Raises InputError."""
    for name in names:
        if getattr(given, name, None) is not None:
            raise InputError(
                f"--{name} {getattr(given, name)}: is not allowed with {given.source.name}, a "
                "scene with six roots; a system from matrices is allowed"
            )
