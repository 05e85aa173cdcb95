"""The verdicts of page 1 on random parameter sets within physical bounds, and searches that fit
shuffled statements beside those that fit the article's.

Both are stored; a random part of the sets is computed again.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.stats import binomtest, mannwhitneyu

from squeal.article.identify import control, lasting, population
from squeal.article.identify.population import (
    BOUNDS,
    EQUAL,
    INDEPENDENT,
    LINE,
    LOADINGS,
    NO,
    NOT_APPLICABLE,
    POINTS,
    UNDECIDED,
    VERDICTS,
    YES,
    Row,
)
from squeal.article.records import Record, Result, read_json
from squeal.article.studies._heyoka import has_heyoka
from squeal.article.studies.sets import FLATTEST

CONFIDENCE = 0.95
SLOW = 5.0  # m/s, a slower surface
CLOSE = 7  # independent statements that a random set close to the article satisfies at least
KINDS = ("printed", "shuffled", "screened", "bounded")  # of searches
MODELS = {"points": (0,), "line": (1,), "either": (0, 1)}  # indices of parts of "points/line"
# sets that are computed again: how many, and the seed that chooses them
SAMPLE = 20
SAMPLE_SEED = 1
ROUNDED = 2.0  # per mille, differences of shares that the stored digits allow


class Share(Record):
    """How many of some sets have a property (`holds`), and how many more may have it (`undecided`).

    share: `holds` over `sets`; interval: from the lower end of Wilson's interval of `holds` to the
    upper end of that of `holds` and `undecided` together.
    """

    sets: int
    holds: int
    undecided: int
    share: float
    interval: tuple[float, float]


class Bound(Record):
    """A number that is drawn: between low and high, its logarithm where `log`."""

    name: str
    low: float
    high: float
    log: bool
    reason: str


class Sample(Record):
    """Sets that were computed again: how many agree, and the numbers of the others."""

    sets: int
    agree: int
    others: tuple[int, ...]


class Search(Record):
    """Searches of one kind: independent statements that each satisfies at its end, their least,
    median and greatest number; sets judged in all by these searches; valid: how many ended at a set
    that stays slower than the surface, None with shuffled statements."""

    satisfied: tuple[int, ...]
    least: int
    median: float
    best: int
    sets: int
    valid: int | None


class Ensemble(Result):
    """outcomes: how many sets were valid, outran the surface, left the model or had no standing
    start; groups: how many valid sets there are in all, that stay slower than `slow` (m/s), flatter
    than `flattest`, and that satisfy at least `close` statements; shares: by property and group;
    coexist: shares of the first `damped` valid sets in which contact goes on changing beside stable
    sliding, by model;
    statements: how many are independent; counts: how many valid sets satisfy each number of them;
    lost, apart: shares of time of each valid set, points and line, per mille; searches: by kind;
    reaching: how many searches with shuffled statements satisfy as many as the median of those with
    the article's; chance: that equal searches differ so, by a two-sided Mann-Whitney test; sample:
    None where nothing can simulate ensembles."""

    drawn: int
    seed: int
    bounds: tuple[Bound, ...]
    outcomes: dict[str, int]
    groups: dict[str, int]
    shares: dict[str, dict[str, Share]]
    coexist: dict[str, Share]
    statements: int
    counts: tuple[int, ...]
    median: int
    most: int
    lost: tuple[tuple[int, int], ...]
    apart: tuple[tuple[int, int], ...]
    searches: dict[str, Search]
    reaching: int
    chance: float
    sample: Sample | None
    damped: int
    speed: float = population.SPEED
    slow: float = SLOW
    flattest: float = FLATTEST
    close: int = CLOSE
    ratio: float = lasting.RATIO
    starts: int = lasting.STARTS
    reach: float = lasting.REACH
    off: float = population.OFF
    confidence: float = CONFIDENCE


Property = Callable[[Row], str]
"""What a row says of a property: YES, NO, UNDECIDED or NOT_APPLICABLE, letters of the table."""


def share(answers: Sequence[str]) -> Share | None:
    """The share of yes among the answers that apply; None where none does."""
    count = Counter(answers)
    holds = count[YES]
    undecided = count[UNDECIDED]
    total = holds + undecided + count[NO]
    if not total:
        return None
    low = binomtest(holds, total).proportion_ci(CONFIDENCE, "wilson").low
    high = binomtest(holds + undecided, total).proportion_ci(CONFIDENCE, "wilson").high
    return Share(total, holds, undecided, holds / total, (float(low), float(high)))


def verdict(row: Row, name: str) -> str:
    """What a row says of one of `VERDICTS`, a letter."""
    return row.verdicts[VERDICTS.index(name)]


def _is(name: str, wanted: str) -> Property:
    """Whether a verdict with more than two answers is the wanted one."""

    def answer(row: Row) -> str:
        letter = verdict(row, name)
        if letter in (UNDECIDED, NOT_APPLICABLE):
            return letter
        return YES if letter == wanted else NO

    return answer


def _cases_of(text: str, model: int) -> str:
    """The cases of a model (0 points, 1 line) in a text such as "cd/c"."""
    return text.split("/")[model]


def _where_hammering(row: Row) -> str:
    """`differ`, of the sets in which points hammer in some case."""
    if row.hammers == UNDECIDED:
        return UNDECIDED
    return verdict(row, "differ") if _cases_of(row.hammers, 0) else NOT_APPLICABLE


def _where_both(row: Row) -> str:
    """`c_only`, of the sets in which both models hammer in some case."""
    if row.hammers == UNDECIDED:
        return UNDECIDED
    points, line = row.hammers.split("/")
    return verdict(row, "c_only") if set(points) & set(line) else NOT_APPLICABLE


def _separates(flutters: bool) -> Property:
    """Whether the line separates in (c), of the sets whose equilibrium there flutters or not."""

    def answer(row: Row) -> str:
        if "c" in _cases_of(row.without, 1):
            return NOT_APPLICABLE
        if ("c" in _cases_of(row.flutters, 1)) != flutters:
            return NOT_APPLICABLE
        if row.separates == UNDECIDED:
            return UNDECIDED
        return YES if "c" in row.separates else NO

    return answer


def lasts(text: str, models: Sequence[int]) -> str:
    """Whether contact goes on changing beside stable sliding in some case of some models, from the
    cases that `lasting` names."""
    by_model = [_cases_of(text, model) for model in models]
    applicable = [cases for cases in by_model if cases != NOT_APPLICABLE]
    if not applicable:
        return NOT_APPLICABLE
    if any(cases not in ("", UNDECIDED) for cases in applicable):
        return YES
    return UNDECIDED if UNDECIDED in applicable else NO


def _longer_by_load() -> dict[str, Property]:
    """Which model loses contact longer, from each multiple of the load: points_longer_0_02."""
    properties = {}
    for load in LOADINGS:
        key = f"{load:g}".replace(".", "_")
        for name, wanted in (("points", POINTS), ("line", LINE), ("equally", EQUAL)):
            properties[f"{name}_longer_{key}"] = _is(f"load_{load:g}", wanted)
    return properties


PROPERTIES: dict[str, Property] = {
    "restless": _is("restless", YES),
    "differ": _is("differ", YES),
    "differ_where_hammering": _where_hammering,
    "c_only": _is("c_only", YES),
    "c_only_where_both": _where_both,
    "points_longer": _is("lost", POINTS),
    "line_longer_all_edges": _is("apart", LINE),
    "two_alike": _is("two", YES),
    "locked_line": _is("locked_line", YES),
    "locked_points": _is("locked_points", YES),
    "permanent_all": _is("permanent_all", YES),
    "permanent_some": _is("permanent_some", YES),
    "separates_fluttering": _separates(True),
    "separates_stable": _separates(False),
    **_longer_by_load(),
}


def satisfied(row: Row) -> int:
    """How many independent statements a set satisfies; undecided ones do not count.

    A row has a bit for each statement, in hexadecimal digits.
    """
    return (int(row.satisfied, 16) & ~int(row.undecided, 16)).bit_count()


def agrees(stored: Row, again: Row) -> bool:
    """Whether a set that is computed again says the same as far as it is decided."""
    if stored.outcome != again.outcome:
        return False
    if not stored.verdicts:  # a motion left the model, or there is no start
        return True
    # a bit for each statement, in hexadecimal
    undecided = int(stored.undecided, 16) | int(again.undecided, 16)
    differing = int(stored.satisfied, 16) ^ int(again.satisfied, 16)
    if differing & ~undecided:
        return False
    for old, new in zip(stored.verdicts, again.verdicts, strict=True):
        if old != new and UNDECIDED not in (old, new):
            return False
    allowed = ROUNDED + float(stored.spread) + float(again.spread)  # per mille, as the shares are
    for share_of_time in ("lost1", "lost2", "apart1", "apart2"):  # empty where there is none
        old = getattr(stored, share_of_time)
        new = getattr(again, share_of_time)
        if bool(old) != bool(new):
            return False
        if old and abs(float(old) - float(new)) > allowed:
            return False
    return True


def sampled(rows: Sequence[Row], count: int = SAMPLE, seed: int = SAMPLE_SEED) -> Sample:
    """Compute some of the sets again."""
    chosen = np.sort(np.random.default_rng(seed).choice(len(rows), count, replace=False))
    again = population.rows(population.some(population.drawn(), chosen))
    others = []
    for number, row in zip(chosen.tolist(), again, strict=True):
        if not agrees(rows[number], row):
            others.append(number)
    return Sample(sets=count, agree=count - len(others), others=tuple(others))


def _search(searches: Sequence[control.StoredSearch]) -> Search:
    """Searches of one kind together."""
    counts = [len(search.satisfied) for search in searches]
    ends = [search.row for search in searches if search.row is not None]
    return Search(
        satisfied=tuple(counts),
        least=min(counts),
        median=float(np.median(counts)),
        best=max(counts),
        sets=sum(search.sets for search in searches),
        valid=sum(row.outcome == "valid" for row in ends) if ends else None,
    )


def _shares(groups: Mapping[str, Sequence[Row]]) -> dict[str, dict[str, Share]]:
    """By property and group of sets, where any set of the group has an answer."""
    shares: dict[str, dict[str, Share]] = {}
    for name, answer in PROPERTIES.items():
        shares[name] = {}
        for group, rows in groups.items():
            share_of_group = share([answer(row) for row in rows])
            if share_of_group is not None:
                shares[name][group] = share_of_group
    return shares


def _coexist(damped: Sequence[lasting.Lasting]) -> dict[str, Share]:
    """By model the share of damped sets with sustained loss of contact beside stable sliding."""
    shares = {}
    for name, models in MODELS.items():
        share_of_models = share([lasts(of_set.cases, models) for of_set in damped])
        if share_of_models is not None:
            shares[name] = share_of_models
    return shares


def study(files: Sequence[Path]) -> Ensemble:
    """What the stored sets and searches say.

    files: the table of random sets, the cases of damped ones, and the searches.
    """
    table, damped_file, searches_file = files
    rows = population.read(table)
    heights = population.drawn()["h"][: len(rows)].tolist()  # h/w of each set
    valid = [row for row in rows if row.outcome == "valid"]
    flat = []
    for row, height in zip(rows, heights, strict=True):
        if row.outcome == "valid" and height < FLATTEST:
            flat.append(row)
    groups = {
        "all": valid,
        "slow": [row for row in valid if float(row.speed) < SLOW],
        "flat": flat,
        "close": [row for row in valid if satisfied(row) >= CLOSE],
    }
    counts = [satisfied(row) for row in valid]
    damped = lasting.read(damped_file)
    stored = read_json(control.Searches, searches_file).searches
    searches = {}
    for kind in KINDS:
        searches[kind] = _search([search for search in stored if search.kind == kind])
    printed = searches["printed"]
    shuffled = searches["shuffled"]
    return Ensemble(
        drawn=len(rows),
        seed=population.SEED,
        bounds=tuple(Bound.of(bound, None) for bound in BOUNDS),
        outcomes=dict(Counter(row.outcome for row in rows)),
        groups={name: len(group) for name, group in groups.items()},
        shares=_shares(groups),
        coexist=_coexist(damped),
        statements=len(INDEPENDENT),
        counts=tuple(np.bincount(counts, minlength=len(INDEPENDENT) + 1).tolist()),
        median=int(np.median(counts)),
        most=max(counts),
        # the table holds texts; a set whose shares are not known has empty ones
        lost=tuple((int(row.lost1), int(row.lost2)) for row in valid if row.lost1),
        apart=tuple((int(row.apart1), int(row.apart2)) for row in valid if row.apart1),
        searches=searches,
        reaching=sum(count >= printed.median for count in shuffled.satisfied),
        chance=float(mannwhitneyu(printed.satisfied, shuffled.satisfied).pvalue),
        sample=sampled(rows) if has_heyoka() else None,
        damped=len(damped),
    )


def sentences(record: Ensemble) -> Mapping[str, bool]:
    """What the paper says of random sets and of searches."""

    def low(name: str) -> float:
        """The lower end of the interval of a share of all valid sets."""
        return record.shares[name]["all"].interval[0]

    def high(name: str) -> float:
        """Its upper end."""
        return record.shares[name]["all"].interval[1]

    either = record.coexist["either"]
    shuffled = record.searches["shuffled"]
    printed = record.searches["printed"]
    return {
        "no-motion-of-a-random-set-settles": low("restless") > 0.99,
        "points-allow-permanent-contact-with-every-random-set": low("permanent_some") > 0.99,
        "two-points-are-like-the-line-in-nine-sets-of-ten": low("two_alike") > 0.9,
        "points-lose-longer-in-most-random-sets": 0.5 < low("points_longer") < 0.75,
        "line-loses-longer-in-fewer-than-half-counting-all-edges": high("line_longer_all_edges")
        < 0.5,
        "from-like-loads-the-order-depends-on-the-load": low("points_longer_2") > 0.5
        and low("points_longer_0_02") > 0.5
        and high("points_longer_1_2") < 0.5
        and low("line_longer_1_2") > high("points_longer_1_2"),
        "c-alone-hammers-in-few-random-sets": high("c_only") < 0.1,
        "directions-matter-in-most-sets-that-hammer": low("differ_where_hammering") > 0.6,
        "separation-in-c-goes-with-flutter": low("separates_fluttering") > high("separates_stable"),
        "most-lines-that-separate-in-c-do-not-flutter": (
            record.shares["separates_stable"]["all"].holds
            > record.shares["separates_fluttering"]["all"].holds
        ),
        "locked-rotation-stops-the-line-in-some-sets-only": low("locked_line") > 0.3
        and high("locked_line") < 0.8,
        "contact-is-lost-beside-stable-sliding-in-some-random-sets": either.interval[0] > 0.05,
        "shuffled-statements-are-fitted-too": shuffled.median > record.most
        and shuffled.best >= printed.median,
        "searches-show-no-difference-to-shuffled-statements": record.chance > 0.05,
        "random-sets-satisfy-fewer-than-half-of-the-searches": record.most < printed.median,
        "random-sets-say-the-same-again": record.sample is None
        or record.sample.agree >= record.sample.sets - 2,
    }
