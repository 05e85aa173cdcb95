"""Tables and sentences of the physics chapter; what interprets asks the results first."""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from squeal.article.cases import title
from squeal.article.report import works
from squeal.article.report.latex import (
    Generated,
    at_most,
    counted,
    in_words,
    number,
    percent,
    tabular,
    typeset,
)
from squeal.article.results.energy import Energy
from squeal.article.results.line_springs import ALIKE, Case, LineSprings
from squeal.article.results.map_ranges import MapRanges
from squeal.article.results.records import Missing
from squeal.article.results.starts import KINDS, TOLERANCE, TURNS, Map, SceneStarts, Starts
from squeal.numerics.shares import wilson

HAMMERS = "c"
"""The case that hammers severely with both models, as the article says."""
PLACES = {"inside": "inside", "on the edge": "on the edge of", "outside": "outside"}
READINGS = {
    "inside": "inside the black area, against the article's reading that hammering begins where "
    "sliding is not possible",
    "on the edge": "on the edge of the black area, which says neither",
    "outside": "outside the black area, as the article's reading asks",
}


def _ranges(found: MapRanges) -> dict[str, str]:
    groups: dict[str, list[str]] = {}
    for case, member in found.members.items():
        groups.setdefault(PLACES[member.own], []).append(f"({case})")
    lie = in_words([f"{in_words(cases)} lie {place} the area" for place, cases in groups.items()])
    spread = {name: max(s.printed) - min(s.printed) for name, s in found.sweeps.items()}
    widest = max(spread, key=lambda name: spread[name])
    of = found.off_branch
    moved = [n for n, one in found.members.items() if one.inside > 0.0 and one.outside > 0.0]
    parts = [
        f"Where {_cases(moved)} {'lies' if len(moved) == 1 else 'lie'} depends on the pad."
        if moved
        else "Where the cases lie is the same for all these pads."
    ]
    if found.flat:
        parts.append(
            f"For {_cases(found.flat)} $K_{{21}} = 0$ whatever the pad, since each spring "
            "is along an axis: \\aeqs{23a}{23b} divide by zero in these cases of the article, for "
            "which they say nothing, and that they are on the edge is an identity."
        )
    angles = " ".join(parts)
    other = (
        "so that shares of the map on which an equilibrium exists or is kept are at least these "
        "and count the branch only"
        if of.kept
        else "so that the branch tells all there is to tell"
    )
    by = [
        f"{small_by(name, at)}, each of {found.full.pads // len(at)} pads"
        for name, at in found.full.small_at.items()
    ]
    return {
        "physics.map.small": "; ".join(by),
        "physics.map.margin": number(100.0 * found.full.margin, 2),
        "physics.map.lie": f"With the pad of the scenes, cases {lie}",
        "physics.map.reading": READINGS[found.members[HAMMERS].own],
        "physics.map.widest": f"${SYMBOLS[widest]}$",
        "physics.map.angles": angles,
        "physics.map.other": other,
    }


def small_by(name: str, at: dict[str, int]) -> str:
    """On how many pads the region is small, by the values of one parameter."""
    values, counts = (in_words([str(v) for v in some]) for some in (at.keys(), at.values()))
    return f"{counts} at ${SYMBOLS[name]}$ of {values}"


SYMBOLS = {
    "h/w": "h/w",
    "k2/k1": "k_2/k_1",
    "mu": r"\mu",
    "k_c/k1": "k_c/k_1",
    "preload": "-y_0 k_1/F_n",
}


def _cases(names: Sequence[str]) -> str:
    return f"case{'s' if len(names) > 1 else ''} {in_words([f'({name})' for name in names])}"


def members_table(found: MapRanges) -> str:
    """Where the four cases lie, for the scenes' pad and over all ranges."""
    head = ["case", "scenes' pad", "inside", "on the edge", "outside"]
    rows = [
        [f"({case})", one.own, *(percent(v) for v in (one.inside, one.edge, one.outside))]
        for case, one in found.members.items()
    ]
    return tabular("llrrr", head, [rows])


def _compared(found: LineSprings, key: str) -> tuple[list[str], list[str], list[str]]:
    """Cases in which a share is greater on the fewest springs than on the line, smaller, alike."""
    groups: tuple[list[str], list[str], list[str]] = ([], [], [])
    for name, case in found.cases.items():
        few, line = case.springs[0], case.line
        if isinstance(few, Missing) or isinstance(line, Missing):
            continue
        more = getattr(few, key) - getattr(line, key)
        groups[0 if more > ALIKE else 1 if more < -ALIKE else 2].append(f"({name})")
    return groups


def _differs(groups: tuple[list[str], list[str], list[str]]) -> str:
    words = ("longer", "for a shorter time", "as long")
    parts = [
        f"{word} in {in_words(cases)}" for word, cases in zip(words, groups, strict=True) if cases
    ]
    return in_words(parts)


def springs_table(found: LineSprings) -> str:
    """From how many starts something takes longer on two springs than on the line, and shorter."""
    rows = {
        what: [
            [
                f"{words}, {counted(of_case[0].windows, 'time')}",
                *(f"{getattr(one, what)[0]} / {getattr(one, what)[1]}" for one in of_case),
            ]
            for of_case in zip(*found.starts.values(), strict=True)
        ]
        for what, words in (("apart", "surfaces apart"), ("lost", "some contact lost"))
    }
    head = ["share of the time", *(f"({name})" for name in found.starts)]
    return tabular("l" + "r" * len(found.starts), head, list(rows.values()))


def _against_geometry(found: LineSprings) -> str:
    """Whether any start differs other than springs inside the edges do in the same motion."""
    every = [one for rows in found.starts.values() for one in rows]
    if not every:
        return "other starts are not compared without batches of simulations"
    against = sum(one.apart[1] + one.lost[0] for one in every)
    count = sum(sum(one.apart) + sum(one.lost) for one in every)
    if against:
        return (
            f"{against} of {count} comparisons differ the other way, by other motions and not by "
            "where the springs stand"
        )
    return (
        "no start differs the other way, so that the counts show no more than where the springs "
        "stand"
    )


def _moved(name: str, case: Case) -> str:
    """The thresholds of a case that differ between the line and springs; none in most cases."""
    every = case.thresholds.values()
    apart, alike = [], []
    for kind in dict.fromkeys(p.kind for points in every for p in points):
        at = {n: [p.mu for p in points if p.kind == kind] for n, points in case.thresholds.items()}
        line = at["0"]
        if all(len(mu) == len(line) and np.allclose(mu, line, SAME, 0.0) for mu in at.values()):
            alike.append(kind)
            continue
        values = [
            f"{in_words([number(v, 4) for v in mu]) or 'nowhere'} on "
            f"{'the line' if n == '0' else f'{n} springs'}"
            for n, mu in at.items()
        ]
        apart.append(f"{kind.replace('restabilised', 'restabilisation')} is {', '.join(values)}")
    same = f" ({in_words(alike)} {'are' if alike[1:] else 'is'} the same)" if alike else ""
    return f"in case ({name}) {in_words(apart)}{same}" if apart else ""


def _springs(found: LineSprings) -> dict[str, str]:
    lost, apart = _compared(found, "lost"), _compared(found, "apart")
    begins = [c.springs[0] for c in found.cases.values() if not isinstance(c.springs[0], Missing)]
    ends = [c.springs[-1] for c in found.cases.values() if not isinstance(c.springs[-1], Missing)]
    off = max((one.off for one in ends), default=0.0)
    limit = (
        f"is within {at_most(100.0 * off)}\\,\\% of the range of the line's motion"
        if off < NEAR_LINE
        else f"is still {percent(off, 1)} of the range off the line's motion in one of the cases"
    )
    moved = [words for name, case in found.cases.items() if (words := _moved(name, case))]
    starts = next(iter(found.starts.values()), ())
    return {
        "physics.springs.against": _against_geometry(found),
        "physics.springs.starts": str(sum(starts[0].apart) if starts else 0),
        "physics.springs.alike": percent(ALIKE, 1),
        "physics.springs.lost": _differs(lost),
        "physics.springs.apart": _differs(apart),
        "physics.springs.limit": limit,
        "physics.springs.thresholds": in_words(moved) or "no threshold of the four cases differs",
        "physics.springs.few": str(min((one.count for one in begins), default=0)),
        "physics.springs.many": str(max((one.count for one in ends), default=0)),
    }


SAME = 1e-3  # relative: thresholds that near are one
NEAR_LINE = 0.01  # of the range: a motion that near follows the line's


LOSSLESS, ALTERNATE, NEVER = KINDS[0], KINDS[3], KINDS[4]
SHOWN = {"no loss": LOSSLESS, "alternate": ALTERNATE, "never full": NEVER}
MOST = 0.5  # of a map
CONFIDENCE = 0.95


def starts_table(found: Starts) -> str:
    """What becomes of each scene's own start, and shares of the maps."""
    times = sorted({part.windows for one in _scenes(found).values() for part in one.maps})
    head = ["", *(f"own start, {n}" for n in times), *(f"{one}, \\%" for one in SHOWN)]
    groups: dict[str, list[list[str]]] = {}
    for name, one in found.scenes.items():
        model, _, case = name.partition("-")
        row = [f"{model.upper()} ({case})"]
        if isinstance(one, Missing):
            row.append(rf"\multicolumn{{{len(head) - 1}}}{{l}}{{{typeset(one.reason)}}}")
        else:
            row += [KINDS[part.own] for part in one.maps]
            for kind in SHOWN.values():
                row.append(", ".join(f"{100 * part.share[kind]:.0f}" for part in one.maps))
        groups.setdefault(name[:2], []).append(row)
    return tabular("l" * (1 + len(times)) + "r" * len(SHOWN), head, list(groups.values()))


def _scenes(found: Starts) -> dict[str, SceneStarts]:
    return {name: one for name, one in found.scenes.items() if isinstance(one, SceneStarts)}


class _Count(NamedTuple):
    """From how many starts of a map losses alternate, with an interval as if drawn at random."""

    of: int
    starts: int
    low: float
    high: float

    @classmethod
    def on(cls, part: Map) -> Self:
        alternate = round(part.starts * part.share[ALTERNATE])
        return cls(alternate, part.starts, *wilson(alternate, part.starts, CONFIDENCE))

    def __str__(self) -> str:
        return f"{self.of} of {self.starts}, {percent(self.low, 0)} to {percent(self.high, 0)}"


def _starts(found: Starts) -> dict[str, str]:
    scenes = _scenes(found)
    if not scenes:
        why = next(one.reason for one in found.scenes.values() if isinstance(one, Missing))
        return {"starts.left-out": typeset(why)}
    maps = next(iter(scenes.values())).maps
    last = {name: one.maps[-1] for name, one in scenes.items()}
    calm = [
        name[-1]
        for name, part in last.items()
        if name.startswith("b1") and part.share[LOSSLESS] > 0.0 and part.own > 0
    ]
    keeps = (
        "That point contact cannot keep contact is a property of the start: nearer to the "
        f"equilibrium no contact is lost for as long in {_cases(calm)} of B1."
        if calm
        else "No start of the maps of model B1 keeps contact where the scene's own start loses it."
    )
    counts = {name: _Count.on(part) for name, part in last.items()}
    most = {
        model: [
            name[-1]
            for name, part in last.items()
            if name.startswith(model) and counts[name].low > MOST
        ]
        for model in ("b1", "b2")
    }
    both = [case for case in most["b1"] if case in most["b2"]]
    able = [name for name, each in counts.items() if each.high > MOST]
    some = [name[-1] for name in able if name.startswith("b1") and f"b2-{name[-1]}" in able]
    undecided = [case for case in some if case not in both]
    either = in_words([f"{_cases(most[m])} with {m.upper()}" for m in most if most[m]])
    early = {name: _Count.on(one.maps[0]) for name, one in scenes.items()}
    told = [
        f"{title(name)} {counts[name]} (over {counted(one.maps[0].windows, 'time')} {early[name]})"
        for name, one in scenes.items()
        if name[-1] in both
    ]
    hammers = (
        f"Losses alternate from most of these starts in {either}"
        if either
        else "In no case are losses shown to alternate from most of these starts"
    )
    hammers += (
        f", over {counted(max(one.windows for one in last.values()), 'time')} the time of the scene"
    )
    hammers += f", shown with both models in {_cases(both) if both else 'no case'}"
    hammers += f" and undecided in {_cases(undecided)}" if undecided else ""
    hammers += f": {'; '.join(told)}" if told else ""
    near = [
        f"{title(name)} ({each})" for name, each in counts.items() if each.low <= MOST < each.high
    ]
    if near:
        hammers += f". Whether it is most is not decided in {in_words(near)}"
    turned = [
        f"{title(name)} ({KINDS[one.maps[0].own]}, then {KINDS[one.maps[-1].own]})"
        for name, one in scenes.items()
        if one.maps[0].own != one.maps[-1].own
    ]
    later = (
        f"Given more time, the scene's own start comes to another end in {in_words(turned)}."
        if turned
        else "Given more time, the scene's own start comes to no other end."
    )
    return {
        "starts.left-out": "",
        "physics.starts.keeps": keeps,
        "physics.starts.hammers": hammers,
        "physics.starts.later": later,
        "physics.starts.times": in_words([str(part.windows) for part in maps]),
        "physics.starts.counts": in_words([str(part.starts) for part in maps]),
    }


def generated(energy: Energy, ranges: MapRanges, springs: LineSprings, starts: Starts) -> Generated:
    """Values and tables of the chapter."""
    values = works.values(energy) | _ranges(ranges) | _springs(springs) | _starts(starts)
    values["physics.starts.turns"] = str(TURNS)
    values["physics.starts.tolerance"] = number(TOLERANCE, 1)
    values["physics.starts.confidence"] = percent(CONFIDENCE, 0)
    friction = ranges.sweeps["mu"].values
    values["physics.map.mu"] = f"{number(min(friction), 2)} to {number(max(friction), 2)}"
    return values, {
        "works": works.energy_table(energy),
        "members": members_table(ranges),
        "own-starts": starts_table(starts),
        "springs-starts": springs_table(springs),
    }
