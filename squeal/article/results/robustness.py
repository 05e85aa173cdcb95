"""How the claims fare around the best pad and over the plausible ranges."""

from typing import Annotated

from squeal.article.results.records import Record, Result

# fmt: off
SYMBOLS = {
    "h": "$h/w$", "inertia": "$I$", "k2": "$k_2/k_1$", "k3": "$k_3/k_1$", "k4": "$k_4/k_1$",
    "k_c": "$k_c/k_1$", "L": "$L/w$", "mu": r"$\mu$", "F_n": "$F_n/(k_1 w)$",
    "preload": "B2 preload", "lift": "B2 lift", "tilt": r"$\theta_0$", "first_y": "B1 preload",
}
# fmt: on
"""Symbols of the searched numbers as LaTeX and figures set them."""


LEAST, STEPS = 1e-3, 17
"""Relative changes of one number that are tried: from this to one, so many."""


class Share(Record):
    """Share of pads that keep a claim, with its interval."""

    share: float
    interval: tuple[float, float]


class Sample(Record):
    """A sample of pads: the shares by claim, and how many claims the median pad keeps."""

    sample: str
    pads: int
    median_kept: float
    claims: dict[str, Share]


class Break(Record):
    """The least of the relative changes tried of one number, more or less, that breaks claims, and
    which.

    change: None where none breaks up to halving or doubling.
    """

    number: str
    way: str
    change: float | None
    claims: tuple[str, ...]


class Robustness(Result):
    """Samples of growing width, the last over the whole ranges; first breaks of each number.

    confidence: of the intervals; left_out: why there are neither, empty if there are.
    """

    samples: tuple[Sample, ...]
    breaks: tuple[Break, ...]
    confidence: Annotated[float, ".0%"]
    left_out: str = ""
