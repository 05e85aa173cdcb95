"""Tables and sentences of the physics chapter; what interprets asks the results first."""

from __future__ import annotations

from squeal.article.cases import title
from squeal.article.report.latex import Generated, in_words, number, percent, tabular, typeset
from squeal.article.results.energy import Energy, Motion, motion_title
from squeal.article.results.line_springs import LineSprings
from squeal.article.results.map_ranges import MapRanges
from squeal.article.results.starts import KINDS, SceneStarts, Starts
from squeal.files.records import Missing

MULTIPLE = 2.0  # times more is called a multiple


def energy_table(found: Energy) -> str:
    """Works of friction, brake force and contact law, and the stays in partial contact."""
    head = ["", "friction", "brake force", "law gives", "in stays", "law takes", "in stays"]
    head.append("kinetic energy")
    groups: dict[str, list[list[str]]] = {}
    for name, one in found.motions.items():
        row = [motion_title(name)]
        if isinstance(one, Missing):
            row.append(rf"\multicolumn{{7}}{{l}}{{{typeset(one.reason)}}}")
        else:
            row += [number(1e3 * one.friction, 3), number(1e3 * one.load, 3)]
            for part in (one.fed(1), one.fed(-1)):
                row += [number(1e3 * sum(part), 3) if part else "0", str(len(part))]
            row.append(number(1e3 * one.kinetic, 3))
        groups.setdefault(name[:2], []).append(row)
    return tabular("lrrrrrrr", head, list(groups.values()))


def _energy(found: Energy) -> dict[str, str]:
    """What the energies say."""
    whole = {name: one for name, one in found.motions.items() if isinstance(one, Motion)}
    printed = {
        motion_title(name.removesuffix("-mean")): (one, whole.get(name.replace("mean", "integral")))
        for name, one in whole.items()
        if name.endswith("mean")
    }
    gives, takes = ([n for n, (one, _) in printed.items() if one.fed(sign)] for sign in (1, -1))
    both = [name for name in gives if name in takes]
    if both:
        law = (
            "The printed law does work in partial contact, and with either sign: in "
            f"{in_words(both)} some stays give energy and others take it."
        )
    elif gives or takes:
        way = "gives" if gives else "takes"
        law = f"The printed law only {way} energy, in {in_words(gives or takes)}."
    else:
        law = "No motion shown here visits partial contact, so that the printed law does no work."
    beyond = [name for name, (one, _) in printed.items() if abs(one.law) > abs(one.friction)]
    source = (
        f"By the end the contact law has done more work than friction in {in_words(beyond)}."
        if beyond
        else "In no motion has the contact law done more work than friction by the end."
    )
    grows = {
        name: one.kinetic / other.kinetic
        for name, (one, other) in printed.items()
        if other is not None and one.law > 0.0 and one.kinetic > MULTIPLE * other.kinetic
    }
    start = (
        "From the same start the greatest kinetic energy under the printed law is a multiple of "
        "that under the integral law in "
        + in_words([f"{name} ({number(ratio, 2)} times)" for name, ratio in grows.items()])
        + (
            ": what the law feeds in, friction multiplies."
            if all(printed[name][0].friction > printed[name][0].law for name in grows)
            else "."
        )
        if grows
        else "From the same start no motion gains a multiple of kinetic energy by the printed law."
    )
    return {
        "physics.energy.law": law,
        "physics.energy.source": source,
        "physics.energy.start": start,
        "physics.energy.residue": number(max(one.residue for one in whole.values()), 1),
    }


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
    """Where the cases lie in the map of Fig. 13, and what its size depends on."""
    groups: dict[str, list[str]] = {}
    for case, member in found.members.items():
        groups.setdefault(PLACES[member.own], []).append(f"({case})")
    lie = in_words([f"{in_words(cases)} lie {place} the area" for place, cases in groups.items()])
    spread = {name: max(s.printed) - min(s.printed) for name, s in found.sweeps.items()}
    widest = max(spread, key=lambda name: spread[name])
    of = found.off_branch
    hammers = found.members[HAMMERS]
    angles = (
        "Where a case lies in the map is thus not a property of its angles."
        if hammers.inside > 0.0 and hammers.outside > 0.0
        else "Where this case lies in the map is the same for all these pads."
    )
    other = (
        "so that the equilibrium ceases there for the branch only"
        if of.kept
        else "so that the branch tells all there is to tell"
    )
    return {
        "physics.map.lie": f"With the pad of the scenes, cases {lie}",
        "physics.map.reading": READINGS[found.members[HAMMERS].own],
        "physics.map.widest": f"${_SYMBOLS[widest]}$",
        "physics.map.angles": angles,
        "physics.map.other": other,
    }


_SYMBOLS = {"h/w": "h/w", "k2/k1": "k_2/k_1", "mu": r"\mu"}


def members_table(found: MapRanges) -> str:
    """Where the four cases lie, for the scenes' pad and over all ranges."""
    head = ["case", "scenes' pad", "inside", "on the edge", "outside"]
    rows = [
        [f"({case})", one.own, *(percent(v) for v in (one.inside, one.edge, one.outside))]
        for case, one in found.members.items()
    ]
    return tabular("llrrr", head, [rows])


ALIKE = 0.005  # shares of time that differ by less are the same


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
    """In which cases something takes longer, or not as long, on the fewest springs."""
    words = ("longer", "for a shorter time", "as long")
    parts = [
        f"{word} in {in_words(cases)}" for word, cases in zip(words, groups, strict=True) if cases
    ]
    return in_words(parts)


def _springs(found: LineSprings) -> dict[str, str]:
    """Whether points exaggerate what the line does."""
    lost, apart = _compared(found, "lost"), _compared(found, "apart")
    more = [
        what
        for what, groups in (("partial contact", lost), ("separation", apart))
        if groups[0] and not groups[1]
    ]
    less = [
        what
        for what, groups in (("partial contact", lost), ("separation", apart))
        if groups[1] and not groups[0]
    ]
    if more and less:
        verdict = f"point contact exaggerates {in_words(more)} and understates {in_words(less)}"
    elif more:
        verdict = f"point contact exaggerates {in_words(more)}, as the article concludes"
    elif less:
        verdict = f"point contact understates {in_words(less)}, against the article's conclusion"
    else:
        verdict = "whether point contact exaggerates the loss of contact depends on the case"
    begins = [c.springs[0] for c in found.cases.values() if not isinstance(c.springs[0], Missing)]
    ends = [c.springs[-1] for c in found.cases.values() if not isinstance(c.springs[-1], Missing)]
    off = max((one.off for one in ends), default=0.0)
    limit = (
        f"is within {percent(off, 2)} of the range of the line's motion"
        if off < NEAR_LINE
        else f"is still {percent(off, 1)} of the range off the line's motion in one of the cases"
    )
    moved = []
    for name, case in found.cases.items():
        line = case.thresholds["0"]
        others = {n: points for n, points in case.thresholds.items() if n != "0"}
        if any([p.kind for p in points] != [p.kind for p in line] for points in others.values()):
            moved.append(f"case ({name}) has other thresholds on springs")
        elif any(
            abs(p.mu - q.mu) > SAME * q.mu
            for points in others.values()
            for p, q in zip(points, line, strict=True)
        ):
            values = [f"{number(points[0].mu, 4)} on {n} springs" for n, points in others.items()]
            moved.append(
                f"the first threshold of case ({name}), {number(line[0].mu, 4)} on the line "
                f"({line[0].kind}), is {in_words(values)}"
            )
    return {
        "physics.springs.lost": _differs(lost),
        "physics.springs.apart": _differs(apart),
        "physics.springs.verdict": verdict,
        "physics.springs.limit": limit,
        "physics.springs.thresholds": in_words(moved) or "no threshold of the four cases differs",
        "physics.springs.few": str(min((one.count for one in begins), default=0)),
        "physics.springs.many": str(max((one.count for one in ends), default=0)),
    }


SAME = 1e-3  # relative: thresholds that near are one
NEAR_LINE = 0.01  # of the range: a motion that near follows the line's


LOSSLESS, HAMMERING = KINDS[0], KINDS[3]
MOST = 0.5  # of a map


def starts_table(found: Starts) -> str:
    """What becomes of each scene's own start, and shares of the maps."""
    times = sorted({part.windows for one in _scenes(found).values() for part in one.maps})
    head = ["", *(f"own start, {n}" for n in times), "no loss, \\%", "hammering, \\%"]
    groups: dict[str, list[list[str]]] = {}
    for name, one in found.scenes.items():
        model, _, case = name.partition("-")
        row = [f"{model.upper()} ({case})"]
        if isinstance(one, Missing):
            row.append(rf"\multicolumn{{{len(head) - 1}}}{{l}}{{{typeset(one.reason)}}}")
        else:
            row += [KINDS[part.own] for part in one.maps]
            for kind in (LOSSLESS, HAMMERING):
                row.append(", ".join(f"{100 * part.share[kind]:.0f}" for part in one.maps))
        groups.setdefault(name[:2], []).append(row)
    return tabular("l" * (1 + len(times)) + "rr", head, list(groups.values()))


def _scenes(found: Starts) -> dict[str, SceneStarts]:
    return {name: one for name, one in found.scenes.items() if isinstance(one, SceneStarts)}


def _starts(found: Starts) -> dict[str, str]:
    """What the start decides, in sentences."""
    scenes = _scenes(found)
    if not scenes:
        why = next(one.reason for one in found.scenes.values() if isinstance(one, Missing))
        keys = ("keeps", "hammers", "later", "times")
        return {f"physics.starts.{key}": typeset(why) for key in keys}
    times = [str(part.windows) for part in next(iter(scenes.values())).maps]
    last = {name: one.maps[-1] for name, one in scenes.items()}
    calm = [
        title(name)
        for name, part in last.items()
        if name.startswith("b1") and part.share[LOSSLESS] > 0.0 and part.own > 0
    ]
    keeps = (
        "That point contact cannot keep contact is a property of the start: nearer to the "
        f"equilibrium no contact is lost for as long in {in_words(calm)}."
        if calm
        else "No start of the maps of model B1 keeps contact where the scene's own start loses it."
    )
    most = {
        model: [
            name[-1]
            for name, part in last.items()
            if name.startswith(model) and part.share[HAMMERING] > MOST
        ]
        for model in ("b1", "b2")
    }
    both = [case for case in most["b1"] if case in most["b2"]]
    hammers = (
        f"Most starts hammer with both models in case {in_words([f'({case})' for case in both])} "
        + ("alone, as the article finds" if both == [HAMMERS] else "")
        if both
        else "In no case do most starts hammer with both models"
    ).strip()
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
        "physics.starts.keeps": keeps,
        "physics.starts.hammers": f"{hammers}.",
        "physics.starts.later": later,
        "physics.starts.times": in_words(times),
    }


def generated(energy: Energy, ranges: MapRanges, springs: LineSprings, starts: Starts) -> Generated:
    """Values and tables of the chapter."""
    values = _energy(energy) | _ranges(ranges) | _springs(springs) | _starts(starts)
    return values, {
        "works": energy_table(energy),
        "members": members_table(ranges),
        "own-starts": starts_table(starts),
    }
