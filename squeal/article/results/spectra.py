"""Spectra of the contact force through the first losses of contact."""

from squeal.article.results.map_ranges import Share
from squeal.article.results.records import Record, Result


class Heard(Record):
    """The total contact force from the kicked equilibrium on.

    modes: frequencies of the equilibrium (kHz); growing: that of its growing mode; growth: its rate
    (1/ms); onset: when contact is first lost (ms), None if it is not; strongest: the strongest line
    of the second half (kHz); tonal: share of that half's power at its multiples. levels: rows over
    times (ms) of dB below the greatest, a column a frequency (kHz); late: the second half's levels
    over late_frequencies.
    """

    modes: tuple[float, ...]
    growing: float
    growth: float
    onset: float | None
    strongest: float
    tonal: Share
    times: tuple[float, ...]
    frequencies: tuple[float, ...]
    levels: tuple[tuple[int, ...], ...]
    late_frequencies: tuple[float, ...]
    late: tuple[float, ...]


class Spectra(Result):
    """By name of the scenes whose equilibrium flutters at the damping `ratio`."""

    scenes: dict[str, Heard]
    ratio: Share
