"""Tables and sentences on the ensembles; what interprets asks the results first."""

import math
from collections.abc import Sequence

from squeal.article.ensembles import beyond
from squeal.article.ensembles.choosing import LAWS
from squeal.article.ensembles.space import DIMENSIONS
from squeal.article.report import pads
from squeal.article.report.contrasts import CHOICES, SURE, of_levels, of_random
from squeal.article.report.latex import Generated, in_words, number, percent, tabular, typeset
from squeal.article.results.ensembles import (
    CORNER,
    IDLE,
    SYMBOLS,
    Ensemble,
    Ensembles,
    Kept,
)
from squeal.article.results.findings import Findings
from squeal.article.results.robustness import Share
from squeal.article.results.verify import Switches
from squeal.model.contact import CONSISTENT

NARROW = 0.5  # of the searched range: a number that lies within is said to be confined
SWITCHED = ("tilt", "start")  # numbers of which only the side of a threshold matters much


def _name(e: Ensemble) -> list[str]:
    f = e.formulation
    return [f.line_force, f.delta_from, f"${f.delta_moment}$"]


def _span(values: Sequence[float], digits: int = 3) -> str:
    low, high = (number(v, digits) for v in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _over(kept: Kept | None) -> str:
    return pads.LEFT if kept is None else str(kept.counted)


def ensemble_table(found: Ensembles) -> str:
    """One row a formulation: effort, chance, what searches reach, and how long it holds."""
    rows = []
    for e in found.ensembles:
        reached = [(s.most.counted, s.most.listed, s.level) for s in e.seeds]
        row = [*_name(e), pads.thousands(e.pads), f"{e.median.counted}, {e.best.counted}"]
        row += [_span(column) for column in zip(*reached, strict=True)]
        rows.append([*row, ", ".join(_over(e.horizons.get(str(w))) for w in found.windows)])
    windows = ", ".join(map(str, found.windows))
    head = ["force", "delta", "sign", "pads", "chance", "best", f"first {found.total.listed}"]
    head += ["level", f"best over {windows}"]
    return tabular("lllrrrrrl", head, [rows])


def range_table(found: Ensembles) -> str:
    """Where the numbers of the last populations lie, by law."""
    rows = []
    for name, symbol in SYMBOLS.items():
        ranges = [law[name] for law in found.ranges.values()]
        row = [symbol, f"{number(ranges[0].searched[0])} to {number(ranges[0].searched[1])}"]
        for law, r in zip(found.ranges, ranges, strict=True):
            if name == IDLE and LAWS[law].delta_from == "centre":
                row += ["no effect", "--", "--"]
                continue
            row += [f"{number(r.low, 2)} to {number(r.high, 2)}", percent(r.width, 0)]
            row.append(percent(r.between, 0))
        rows.append(row)
    head = ["number", "searched", *(w for law in found.ranges for w in (law, "width", "searches"))]
    return tabular("llrrrrrr", head, [rows])


def _within(share: Share) -> str:
    """A share with its interval, in per cent."""
    low, high = (f"{100.0 * end:.0f}" for end in share.interval)
    return f"{percent(share.share, 0)} ({low}--{high})"


def pad_table(found: Ensembles, findings: Findings) -> str:
    """The chosen pad under both laws; the speed of the face is known under that of the scenes."""
    face = pads.face_speed(found.chosen[found.taken], findings) if found.chosen else None
    rubs = {} if face is None else {found.taken: rf"{number(face, 2)}\,m/s"}
    windows = ", ".join(map(str, found.windows))
    head = ["law", f"counted, over {windows}", "all", "not kept", r"least $V > \dot x$"]
    head[-1] += f" at {number(found.load)}\\,N"
    head += ["the same, face", "steady"]
    rows = [
        [
            law,
            ", ".join(_over(pad.horizons[str(w)]) for w in found.windows),
            str(kept.everything) if (kept := pad.horizons["1"]) is not None else "--",
            typeset(", ".join(n for n in pad.failing["1"] or () if n in found.counted)),
            rf"{number(pad.least_speed, 2)}\,m/s",
            rubs.get(law, pads.LEFT),
            pads.LEFT if pad.steady is None else _within(pad.steady),
        ]
        for law, pad in found.chosen.items()
    ]
    return tabular(r"@{}llr>{\raggedright}p{1.6in}rrr@{}", head, [rows])


def _long(found: Ensembles) -> str:
    first, last = (str(found.windows[i]) for i in (0, -1))
    lasting = 0
    for e in found.ensembles:
        short, long = e.horizons[first], e.horizons[last]
        lasting += short is not None and long is not None and long.counted >= short.counted
    count = len(found.ensembles)
    if lasting == count:
        return f"All best pads keep as many over {last} windows as over one."
    which = {0: "None", 1: "Only one"}.get(lasting, str(lasting))
    return (
        f"{which} of the {count} best pads keeps as many over {last} windows as over one, "
        "the only horizon that the distance knows: most are fitted to the window."
    )


def half_by_chance(count: int) -> float:
    """Probability that so many uniform points lie within half of their range."""
    return float(count * NARROW ** (count - 1) - (count - 1) * NARROW**count)


def at_least(count: int, of: int, p: float) -> float:
    """Probability that at least so many of some events occur, each with the probability p."""
    return sum(math.comb(of, k) * p**k * (1.0 - p) ** (of - k) for k in range(count, of + 1))


def _islands(found: Ensembles) -> str:
    """Of how many independent pads the last populations are worth."""
    seeds = [s for e in found.ensembles for s in e.seeds]
    count = len(found.ensembles[0].seeds)
    widths = [percent(f([s.width for s in seeds]), 0) for f in (min, max)]
    acting = [
        [r.width for n, r in law.items() if n != IDLE or LAWS[name].delta_from != "centre"]
        for name, law in found.ranges.items()
    ]
    pooled = [sum(some) / len(some) for some in acting]
    within = sum(s.width for s in seeds) / len(seeds)
    few = sum(s.distinct < s.stored for s in seeds)
    poorest = min(s.distinct for s in seeds)
    repeats = (
        f" In {few} of {len(seeds)} of them pads are repeated, until "
        f"{'one is' if poorest == 1 else f'{poorest} are'} left of {seeds[0].stored}."
        if few
        else ""
    )
    wide = in_words([percent(v, 0) for v in pooled])
    if within < NARROW * min(pooled):
        return (
            f"Each search ends on an island: the middle nine tenths of a number take "
            f"{widths[0]} to {widths[1]} of its range in the last population of one search (mean "
            f"over the numbers that have an effect), {wide} over the searches of the two laws of "
            f"Table~\\ref{{ensemble-ranges}}.{repeats} An ensemble is thus no fair sample of the "
            f"pads within its level: what counts are its {count} searches."
        )
    return (
        f"The last populations spread nearly as far within a search ({widths[0]} to {widths[1]} of "
        f"the range) as over the searches ({wide}).{repeats}"
    )


def _copies(found: Ensembles) -> str:
    """How many searches end in copies of one pad."""
    seeds = [s for e in found.ensembles for s in e.seeds]
    single = sum(s.distinct == 1 < s.stored for s in seeds)
    return f"{single or 'none'} of {len(seeds)}"


def _rival(found: Ensembles) -> str:
    pad = found.rival["consistent"]
    kept = pad.horizons[str(found.windows[0])]
    if kept is None:
        return "Its motion leaves the model."
    distance, seeds = number(pad.distance, 3), pads.consistent(found).seeds
    own = max(s.most.counted for s in seeds)
    near = _span([s.nearest for s in seeds])
    nearer = sum(s.nearest <= pad.distance for s in seeds)
    where = (
        f"Its distance, {distance}, is less than that of any pad stored of the {len(seeds)} "
        f"searches of its law (nearest of each: {near}): none of them found it or its like, so "
        "that they do not exhaust the ranges"
        if nearer == 0
        else f"Pads as near as it, at a distance of {distance}, are stored of {nearer} of the "
        f"{len(seeds)} searches of its law (nearest of each: {near})"
    )
    than = (
        "more than"
        if kept.counted > own
        else "as many as"
        if kept.counted == own
        else ("fewer than")
    )
    return (
        f"It keeps {kept.everything} of all {found.total.everything} and {kept.counted} of "
        f"the {found.total.counted} counted statements, of the latter {than} the best of "
        f"these searches ({own}). {where}."
    )


def _standing(found: Ensembles) -> str:
    shares = [s.standing for e in found.ensembles for s in e.seeds]
    left = sum(share > 0.0 for share in shares)
    if left == 0:
        return "No last population of a search has a standing start"
    return f"The last populations of {left} of {len(shares)} searches have standing starts"


def _narrow(found: Ensembles) -> tuple[list[str], list[str]]:
    """Numbers that have an effect and are no switches, and those of them that are confined."""
    laws = found.ranges.values()
    idle = [IDLE] if all(LAWS[name].delta_from == "centre" for name in found.ranges) else []
    kinds = [name for name in SYMBOLS if name not in (*SWITCHED, *idle)]
    return kinds, [n for n in kinds if all(law[n].width < NARROW for law in laws)]


def _corner(found: Ensembles) -> str:
    """Which numbers are shown pair by pair, and which of those that are confined are not."""
    left = [SYMBOLS[name] for name in _narrow(found)[1] if name not in CORNER]
    count = len(next(iter(found.ranges.values())))
    rest = f", of the confined not {in_words(left)}" if left else ""
    return f"{len(CORNER)} of {count}{rest}"


def _confined(found: Ensembles) -> str:
    laws = found.ranges
    kinds, names = _narrow(found)
    searches = len(pads.consistent(found).seeds)
    both = half_by_chance(searches) ** len(laws)
    words = in_words([SYMBOLS[n] for n in names]) or "None"
    p = at_least(len(names), len(kinds), both)
    told = (
        f"Of {len(kinds)} numbers that have an effect and are no switches {len(names)} lie within "
        f"half of the searched range, of logarithms where these are uniform, under both laws "
        f"({words}); of {searches} uniform points "
        f"{number(len(kinds) * both, 2)} would, and as many with a probability of {number(p, 2)}"
    )
    if p < SURE:
        return (
            f"{told}. The statements thus confine some numbers; with {len(kinds) - len(names)} "
            "left free they do not identify a pad"
            if len(names) < len(kinds)
            else f"{told}. The statements thus confine all numbers"
        )
    return f"{told}: that the statements confine any is not shown"


def _front(found: Ensembles) -> str:
    seen = sum(f.pads for f in found.fronts)
    all_three = sum(f.together[3] for f in found.fronts)
    names = in_words(list(found.names))
    if all_three == 0:
        return f"None of {pads.thousands(seen)} pads judged on {names} keeps all three."
    best = max((f for f in found.fronts if f.together[3]), key=lambda f: f.most[3])
    law = CHOICES[best.formulation.line_force]
    rest = (
        "so that all that is said of model B2 can hold together"
        if best.most[3] == found.total_b2
        else f"so that the three do not exclude each other; the best of them, with {law}, keeps "
        f"{best.most[3]} of the {found.total_b2} statements on model B2 and lacks "
        f"{in_words(best.lacks)}"
    )
    keeping = sorted((f for f in found.fronts if f.together[3]), key=lambda f: -f.together[3])
    own = [f"{pads.thousands(f.together[3])} of {_law(f.formulation)}" for f in keeping]
    others = [f.pads for f in found.fronts if not f.together[3]]
    none = (
        f", none of the {pads.thousands(sum(others))} of the other {len(others)}" if others else ""
    )
    return (
        f"Of {pads.thousands(seen)} pads judged on {names}, {pads.thousands(all_three)} keep all "
        f"three, {rest}. By formulation they are {in_words(own)}{none}. Among them are those "
        f"of a further search of {_law(Switches.of(beyond.LAW))} from pads that keep all three, "
        "and pads of one population descend from each other: such counts, of unequal effort, are "
        "no shares of what is possible."
    )


def _law(f: Switches) -> str:
    words = f"{f.line_force}, {f.delta_from}, ${f.delta_moment}$"
    return f"the consistent law ({words})" if f == Switches.of(CONSISTENT) else f"({words})"


def _enough(found: Ensembles) -> str:
    least = min(e.pads for e in found.ensembles)
    greatest = max(e.pads for e in found.ensembles)
    return (
        pads.thousands(least)
        if least == greatest
        else f"{pads.thousands(least)} to {pads.thousands(greatest)}"
    )


def _by_chance(ensembles: Sequence[Ensemble]) -> str:
    """Counted statements that the best random pad keeps."""
    return str(max(e.best.counted for e in ensembles))


def _by_search(ensembles: Sequence[Ensemble]) -> str:
    """Counted statements that the best pad of a search keeps."""
    return str(max(s.most.counted for e in ensembles for s in e.seeds))


def generated(found: Ensembles, findings: Findings) -> Generated:
    """Values and tables, from the study of the same name and the findings."""
    switches = {
        c.switch: f"{of_levels(c)} {of_random(c, found.conclusions)}" for c in found.contrasts
    }
    count = sum(e.pads for e in found.ensembles)
    centre = [e for e in found.ensembles if e.formulation.delta_from == "centre"]
    values = {
        "ensembles.pads": pads.thousands(count),
        "ensembles.each": _enough(found),
        "ensembles.motions": pads.thousands(sum(e.motions for e in found.ensembles)),
        "ensembles.hours": number(sum(e.seconds for e in found.ensembles) / 3600.0, 2),
        "ensembles.random": pads.thousands(min(e.random for e in found.ensembles)),
        "ensembles.seeds": str(min(len(e.seeds) for e in found.ensembles)),
        "ensembles.longest": str(found.windows[-1]),
        "ensembles.left-out": typeset(found.left_out),
        "ensembles.standing": _standing(found),
        "ensembles.confined": _confined(found),
        "ensembles.front": _front(found),
        "ensembles.counted": str(found.total.counted),
        "ensembles.chance": _by_chance(found.ensembles),
        "ensembles.chance-centre": _by_chance(centre),
        "ensembles.best": _by_search(found.ensembles),
        "ensembles.best-centre": _by_search(centre),
        "ensembles.ceiling": str(found.total.counted - 1),
        "ensembles.following": in_words(found.following),
        "ensembles.added": str(found.total.everything - found.total.listed),
        "ensembles.twins": pads.twins(found),
        "ensembles.islands": _islands(found),
        "ensembles.copies": _copies(found),
        "ensembles.corner": _corner(found),
        "ensembles.logarithmic": in_words([SYMBOLS[d.name] for d in DIMENSIONS if d.log]),
        **{f"ensembles.{name}.kept": pads.kept_by(found, name) for name in found.conclusions},
        **{f"ensembles.switch.{name}": words for name, words in switches.items()},
    }
    if not found.left_out:
        values |= {
            "ensembles.long": _long(found),
            "ensembles.rival": _rival(found),
            "ensembles.side": pads.steadier(found.chosen),
            "ensembles.outside": pads.outside(found, found.chosen[found.taken]),
            "ensembles.beside": pads.beside(found, found.chosen[found.taken], findings),
            "ensembles.differ": pads.differ(found),
            "ensembles.coarse": pads.coarse(found),
            "ensembles.balance": pads.balance(found),
            "ensembles.sought": pads.sought(found),
            "ensembles.together": pads.most(found),
            "ensembles.zero": pads.zero(found),
        }
    tables = {
        "ensemble-searches": ensemble_table(found),
        "ensemble-ranges": range_table(found),
        "ensemble-pad": pad_table(found, findings),
    }
    return values, tables
