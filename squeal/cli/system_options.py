"""Options of the queries that speak of systems from matrices, and how they are read."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from squeal.cli.numbers import band_of, numbers, whole
from squeal.cli.outputs import Once, option_of
from squeal.cli.streams import say
from squeal.errors import InputError, InputWarning
from squeal.io.short_form import PlainSystem

if TYPE_CHECKING:
    from squeal.analysis.systems.wanted import Wanted
    from squeal.io.system import SystemFile
    from squeal.linear.system import TermSystem
    from squeal.sparse.factor import Progress

MOST = 100_000


class _Memory(Once):
    """Keeps bytes; what is no number is refused also where no large system is worked on."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option: str | None = None) -> None:
        size = numbers(values, "--memory", 1, "a number above 0", lambda gb: gb > 0.0)[0]
        super().__call__(parser, namespace, 1e9 * size, option)


def band_option(parser: argparse.ArgumentParser) -> None:
    """The option --band."""
    parser.add_argument("--band", metavar="LOW:HIGH", help="systems only: frequencies wanted, Hz")


def work_options(parser: argparse.ArgumentParser) -> None:
    """Options about how a large system is worked on."""
    parser.add_argument(
        "--memory",
        action=_Memory,
        metavar="GB",
        help="memory that may be used (what is free if left out)",
    )
    parser.add_argument(
        "--progress", action="store_true", help="tell the steps on standard error, also to a file"
    )


def asked(given: argparse.Namespace) -> bool:
    """True if an option was given that only systems from matrices know."""
    return any(
        getattr(given, name, None) is not None
        for name in ("band", "modes", "region", "method", "min", "shape", "animation")
    )


def system_of(given: argparse.Namespace, short: bool = False) -> SystemFile | None:
    """The system that the file holds, if it is of the general form or options ask for its terms.

    Also of the short form, whatever the options are, with `short`.
    """
    found: SystemFile | None = given.source.terms()
    if found is None and (short or asked(given)):
        plain: PlainSystem | None = given.source.system()
        if plain is not None:
            from squeal.io.system import SystemFile

            return SystemFile(plain.terms(), plain.reference)
    return found


def wanted_of(given: argparse.Namespace) -> Wanted:
    """Which roots the options ask for. Raises InputError."""
    from squeal.analysis.systems.wanted import Wanted
    from squeal.sparse.argument_principle import Rectangle

    band = region = modes = None
    if given.band is not None:
        band = band_of(given.band)
    if getattr(given, "region", None) is not None:
        words = "RE0:RE1:IM0:IM1 in 1/s and rad/s with RE0 < RE1 and IM0 < IM1"
        region = Rectangle(*numbers(given.region, "--region", 4, words))
    if getattr(given, "modes", None) is not None:
        modes = whole(given.modes, "--modes", 1, MOST)
    return Wanted(band, region, modes)


def value_in(given: str | None, option: str) -> float | None:
    """A finite number, None if it is left out. Raises InputError."""
    return None if given is None else numbers(given, option, 1, "a finite number")[0]


def warn_if_constant(system: TermSystem) -> None:
    """Warn where a range of the parameter was asked for and nothing depends on it."""
    if system.parameter not in system.names:
        warnings.warn(f"no matrix depends on {system.parameter}", InputWarning, stacklevel=2)


def check_work(given: argparse.Namespace, system: TermSystem) -> None:
    """Refuse a large system that does not fit into --memory, or what is free."""
    from squeal.analysis.systems.wanted import check_memory, is_small

    if not is_small(system):
        check_memory(system, given.memory)


def progress_of(given: argparse.Namespace) -> Progress:
    """Where the steps of long work are told: on standard error if it is a terminal or on demand."""
    from squeal.sparse.factor import quiet

    if not (given.progress or sys.stderr.isatty()):
        return quiet
    return lambda text: say(f"squeal: {text}")


def refuse_options(given: argparse.Namespace, names: Sequence[str]) -> None:
    """Refuse options of systems from matrices for a scene. Raises InputError."""
    for name in names:
        if getattr(given, name, None) is not None:
            raise InputError(
                f"{option_of(given, name)} {getattr(given, name)}: is not allowed with "
                f"{given.source.name}, a scene with six roots; a system from matrices is allowed"
            )
