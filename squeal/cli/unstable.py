"""The table of growing modes that `squeal eigenvalues` prints."""

import argparse
import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from squeal.cli.base import Parser
from squeal.cli.numbers import band_of, numbers
from squeal.cli.tables import elided, number
from squeal.io.short_form import PlainSystem
from squeal.linear import UnstableMode, crossings, unstable_modes

ONSET_SIZE = 40  # degrees of freedom up to which a plain system's crossings are always sought


@dataclass(frozen=True)
class Filter:
    """Which growing modes are listed: frequencies (Hz) in a band, rates (1/s) from the least on."""

    band: tuple[float, float] | None = None
    least: float = 0.0

    def __call__(self, modes: Sequence[UnstableMode]) -> list[UnstableMode]:
        low, high = self.band or (0.0, math.inf)
        return [m for m in modes if low <= m.frequency_hz <= high and m.growth_rate >= self.least]

    def __str__(self) -> str:
        words = f" between {self.band[0]:g} and {self.band[1]:g} Hz" if self.band else ""
        return words + (f" at {self.least:g} 1/s or more" if self.least else "")


def filter_options(parser: Parser) -> None:
    """Options --band and --min-growth."""
    parser.add_argument(
        "--band", metavar="LOW:HIGH", help="list unstable modes of these frequencies only, in Hz"
    )
    parser.add_argument(
        "--min-growth", metavar="RATE", help="list unstable modes that grow so fast only, in 1/s"
    )


def filter_of(given: argparse.Namespace) -> Filter:
    """The filter that the options name. Raises InputError."""
    band, least = None, 0.0
    if given.band is not None:
        band = band_of(given.band)
    if given.min_growth is not None:
        words = "a finite number of at least 0, in 1/s"
        (least,) = numbers(given.min_growth, "--min-growth", 1, words, lambda rate: rate >= 0.0)
    return Filter(band, least)


def of_system(system: PlainSystem, at: float) -> tuple[UnstableMode, ...]:
    """What grows in a plain system; onsets only where the range from 0 to `at` is searched."""
    searched = at > 0.0 and system.n <= ONSET_SIZE
    grow = unstable_modes(system, at)
    return unstable_modes(system, at, crossings(system, at)) if grow and searched else grow


def unstable_rows(modes: Sequence[UnstableMode]) -> list[dict[str, Any]]:
    """Growing modes as JSON rows."""
    return [dataclasses.asdict(mode) for mode in modes]


def unstable_text(
    modes: Sequence[UnstableMode],
    chosen: Filter,
    all_of_them: int,
    parameter: str = "mu",
    where: str = "",
) -> str:
    """Growing modes for people; `all_of_them` is their number before the filter, `where` says
    which roots were looked at if not all of the band were."""
    if not modes:
        elsewhere = f" ({all_of_them} elsewhere)" if all_of_them else ""
        asked = f"{where}{dataclasses.replace(chosen, band=None)}" if where else chosen
        return f"no unstable mode{asked}{elsewhere}"
    rows = [("  unstable", "frequency, Hz", "growth, 1/s", "damping ratio", f"onset, {parameter}")]
    for m in modes:
        cells = map(number, (m.frequency_hz, m.growth_rate, m.damping_ratio))
        onset = "-" if m.onset is None else number(m.onset, 9)
        rows.append((f"  {m.kind}", *cells, onset))  # type: ignore[arg-type]
    left = all_of_them - len(modes)
    note = f"\n  {left} more unstable, not{chosen}" if left else ""
    return elided(rows, "--json") + note
