"""Ensembles of pads for all formulations: what their pads keep, and what that tells."""

from typing import Annotated

from squeal.article.results.records import Record, Result
from squeal.article.results.robustness import SYMBOLS as ROBUSTNESS
from squeal.article.results.robustness import Share
from squeal.article.results.verify import Switches

SYMBOLS = {**ROBUSTNESS, "first_x": r"$x(0)$", "x0": "$x_0/w$", "start": "start"}
"""Symbols of the numbers as LaTeX and figures set them."""


class Kept(Record):
    """How many statements a pad keeps: of all, of those first listed, of the counted ones:
    the informative ones and that on sliding, which is free but counted in the stored ensembles."""

    everything: int
    listed: int
    counted: int


class Seed(Record):
    """One search: the most kept by one pad of it in each way of counting, the distance level that
    it reached, and the counted statements that its best pad does not keep; standing: share of
    its last population that starts at rest on a disc that begins to slide.

    Of the pads stored of that population: stored, distinct: how many, and how many that differ;
    width: of the middle nine tenths of a number over its range, mean of the numbers that have an
    effect; nearest: the
    least distance; mean, unslid: their mean distance, and that without the statement on sliding.
    """

    most: Kept
    level: float
    standing: float
    failing: tuple[str, ...]
    stored: int
    distinct: int
    width: float
    nearest: float
    mean: float
    unslid: float


class Ensemble(Record):
    """The ensemble of one formulation.

    pads, motions, steps, seconds: effort of its searches, the last in CPU time; random: pads drawn
    at random, ran: those whose motions reach the end; chance: the shares of random pads that keep
    each statement; median, best: kept by the median random pad that ran, and the most by one;
    seeds: its searches; best_pads: shares of their best pads that keep each statement; horizons:
    what the best of them keeps over so many windows, None where a motion leaves the model; parting:
    of the random pads that ran, in how many the surfaces of B2 part in which cases, a to d as bits
    from the lowest.
    """

    formulation: Switches
    pads: int
    motions: int
    steps: int
    seconds: float
    random: int
    ran: int
    chance: dict[str, Share]
    median: Kept
    best: Kept
    seeds: tuple[Seed, ...]
    best_pads: dict[str, Share]
    horizons: dict[str, Kept | None]
    parting: tuple[int, ...]


class Contrast(Record):
    """One switch of the formulation: the mean level reached with either choice, and the
    probability of a difference as large by chance, from exchanging the searches of formulations
    that differ in this switch alone, with Holm's correction.

    better: in how many of the `pairs` of formulations that differ in it alone the second choice
    comes nearer. unslid, p_unslid: the mean distances of the last populations without the
    statement on sliding, which rests on an assumed speed, and their probability. random, ran:
    random pads drawn with either choice, and those of them that run; keep: how many keep each
    conclusion, by name; p_keep: Fisher's probability of that among those that run, with Holm's
    correction over all conclusions and switches.
    """

    switch: str
    levels: dict[str, float]
    p: float
    better: int
    pairs: int
    unslid: dict[str, float]
    p_unslid: float
    random: dict[str, int]
    ran: dict[str, int]
    keep: dict[str, dict[str, int]]
    p_keep: dict[str, float]


class Range(Record):
    """Where one number of the pads of the last populations lies: the ends between which it was
    searched, whether in its logarithm, 5 and 95 % quantiles, their distance over the searched
    range, and the spread of the searches' medians over it."""

    searched: tuple[float, float]
    log: bool
    low: float
    high: float
    width: float
    between: float


class Pad(Record):
    """One pad under one law: its numbers, what it keeps over so many windows, all statements that
    it does not keep over these, the least speed of the surface (m/s) at which sliding holds, and
    the share of pads with all numbers that are not zero off by one per cent that keep as many
    counted statements, None where that was not asked.

    horizons, failing: None where a motion leaves the model. distance: of the statements, as the
    ensembles have it.
    """

    numbers: dict[str, float]
    horizons: dict[str, Kept | None]
    failing: dict[str, tuple[str, ...] | None]
    distance: float
    least_speed: float
    steady: Share | None = None


class Front(Record):
    """Three statements on model B2 that hinder each other.

    pads: judged on all three; together: how many keep none to all of them; most: the most of the
    statements on B2 that one of those keeps; lacks: those on B2 that the best pad with all three
    does not keep; points: margins over ample ones of the
    pads that no other surpasses.
    """

    formulation: Switches
    pads: int
    together: tuple[int, ...]
    most: tuple[int, ...]
    lacks: tuple[str, ...]
    points: tuple[tuple[float, float, float], ...]


class Keeping(Record):
    """How many of the stored pads that differ keep some statements at once, from how many of so
    many searches these are."""

    pads: int
    keep: int
    searches: int
    keeping: int


class Alone(Record):
    """The statement that says a conclusion by itself, with the pads that keep it as in
    `Conclusion`."""

    id: str
    consistent: Keeping
    every: Keeping
    random: dict[str, Share]


class Lasted(Record):
    """How many of so many pads of a search, numbered from one, keep a conclusion longer, too."""

    search: int
    tried: int
    keep: int


class Conclusion(Record):
    """A conclusion of the article as statements that must hold together.

    consistent, every: pads of the consistent law and of all formulations; lasting: of those of the
    consistent law some of each search, over `over` windows; random: of random pads, by
    law ("consistent", "every"), one whose motion leaves the model keeping none; only_c: least and
    greatest margin of B2-only-c of the stored pads that keep it; alone: its statement as worded.
    """

    statements: tuple[str, ...]
    alone: Alone
    consistent: Keeping
    every: Keeping
    lasting: tuple[Lasted, ...]
    over: int
    random: dict[str, Share]
    only_c: tuple[float, float] | None


class Twins(Record):
    """Two statements on whose verdict so many of the stored pads that differ agree, with delta
    counted from the mass centre."""

    ids: tuple[str, str]
    agree: int
    pads: int


class Check(Record):
    """Stored pads judged afresh: how many, how many verdicts, how many differ, and which.

    as_now: of these stay with `denser` times as many samples; peaks: median and greatest
    difference of the margin of a statement on two peaks from the stored one; unjudged: statements
    that a batch does not judge.
    """

    pads: int
    statements: int
    different: int
    which: tuple[str, ...]
    denser: int
    as_now: int
    peaks: tuple[float, float]
    unjudged: tuple[str, ...]


IDLE = "x0"
"""The number that has no effect with delta from the mass centre."""

CORNER = ("h", "k2", "k3", "k4", "k_c", "mu", "preload", "lift")
"""The numbers that are shown pair by pair."""

ELSEWHERE = "the search elsewhere"
"""Origin of a pad that was found apart from the ensembles, where case c alone separates."""


class Ensembles(Result):
    """All ensembles; the windows of the horizons; what distinguishes formulations.

    counted: the statements that are counted, see `Kept`; following: those that
    the distance counts although they follow; names: of the three
    statements of the fronts; total_b2: statements on model B2 alone; rival: the pad found
    elsewhere, by law; ranges: of the numbers, by law; conclusions: of the article, by name; twins:
    statements that say the same; most: the pad with most of the listed statements, by law, and
    whether it is plausible; speed, load: of the surface (m/s) at that brake force (N), by
    which sliding is judged; chosen: the pad of the report under both laws, taken: that of its
    scenes; candidates: plausible pads, of which `compared` over longer times, see
    `ensembles.choosing.Chosen` for least, equal and first_equal; scattered: pads around each, of
    which `Pad.steady` is a share; left_out: why no pad
    is judged afresh, empty if they are: horizons, rival and chosen are then empty too, and taken.
    """

    ensembles: tuple[Ensemble, ...]
    stages: int
    windows: tuple[int, ...]
    confidence: Annotated[float, ".0%"]
    total: Kept
    counted: tuple[str, ...]
    following: tuple[str, ...]
    contrasts: tuple[Contrast, ...]
    ranges: dict[str, dict[str, Range]]
    samples: dict[str, tuple[tuple[float, ...], ...]]
    names: tuple[str, ...]
    total_b2: int
    fronts: tuple[Front, ...]
    rival: dict[str, Pad]
    most: dict[str, Pad]
    plausible: bool
    conclusions: dict[str, Conclusion]
    twins: Twins
    speed: float
    load: float
    chosen: dict[str, Pad]
    chosen_from: str
    taken: str
    candidates: int
    compared: int
    least: int
    equal: int
    first_equal: int
    scattered: int
    check: Check
    left_out: str = ""

    @property
    def wrong(self) -> str:
        """Stored pads that are judged otherwise today."""
        many = self.check.different > 0.02 * self.check.statements
        return f"{self.check.different} verdicts on stored pads differ" if many else ""
