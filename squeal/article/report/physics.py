"""Tables and sentences of the physics chapter; what interprets asks the results first."""

from __future__ import annotations

from squeal.article.report.latex import Generated, number, percent, tabular, typeset
from squeal.article.results.energy import Energy, Motion, motion_title
from squeal.article.results.map_ranges import MapRanges
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


def _listed(names: list[str]) -> str:
    """Names in a sentence."""
    return " and ".join([", ".join(names[:-1]), names[-1]]) if names[1:] else "".join(names)


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
            f"{_listed(both)} some stays give energy and others take it."
        )
    elif gives or takes:
        way = "gives" if gives else "takes"
        law = f"The printed law only {way} energy, in {_listed(gives or takes)}."
    else:
        law = "No motion shown here visits partial contact, so that the printed law does no work."
    beyond = [name for name, (one, _) in printed.items() if abs(one.law) > abs(one.friction)]
    source = (
        f"By the end the contact law has done more work than friction in {_listed(beyond)}."
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
        + _listed([f"{name} ({number(ratio, 2)} times)" for name, ratio in grows.items()])
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
        groups.setdefault(member.own, []).append(f"({case})")
    lie = _listed([f"{_listed(cases)} {place}" for place, cases in groups.items()])
    spread = {name: max(s.printed) - min(s.printed) for name, s in found.sweeps.items()}
    widest = max(spread, key=lambda name: spread[name])
    of = found.off_branch
    other = (
        "so that the equilibrium ceases there for the branch only"
        if of.kept
        else "so that the branch tells all there is to tell"
    )
    return {
        "physics.map.lie": f"With the pad of the scenes {lie} of the area",
        "physics.map.reading": READINGS[found.members[HAMMERS].own],
        "physics.map.widest": f"${_SYMBOLS[widest]}$",
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


def generated(energy: Energy, ranges: MapRanges) -> Generated:
    """Values and tables of the chapter."""
    tables = {"works": energy_table(energy), "members": members_table(ranges)}
    return _energy(energy) | _ranges(ranges), tables
