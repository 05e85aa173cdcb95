"""How the claims fare around the best pad and over the plausible ranges."""

from __future__ import annotations

from dataclasses import dataclass

from squeal.files.records import Record, Result


@dataclass(frozen=True)
class Share(Record):
    """Share of pads that keep a claim, with its 95 % interval."""

    share: float
    interval: tuple[float, float]


@dataclass(frozen=True)
class Sample(Record):
    """A sample of pads: the shares by claim, and how many claims the median pad keeps."""

    sample: str
    pads: int
    median_kept: float
    claims: dict[str, Share]


@dataclass(frozen=True)
class Break(Record):
    """The least relative change of one number, more or less, that breaks claims, and which.

    change: None where none breaks up to halving or doubling.
    """

    number: str
    way: str
    change: float | None
    claims: tuple[str, ...]


@dataclass(frozen=True)
class Robustness(Result):
    """Samples of growing width, the last over the whole ranges; first breaks of each number."""

    samples: tuple[Sample, ...]
    breaks: tuple[Break, ...]
