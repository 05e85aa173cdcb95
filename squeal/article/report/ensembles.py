"""Tables and sentences on the ensembles; what interprets asks the results first."""

from __future__ import annotations

from collections.abc import Sequence

from squeal.article.report.latex import Generated, number, percent, tabular, typeset
from squeal.article.results.ensembles import SYMBOLS, Contrast, Ensemble, Ensembles, Kept, Pad

SURE = 0.05  # probability by chance below which a switch is said to matter
NARROW = 0.5  # of the searched range: a number that lies within is said to be confined
SWITCHES = {
    "line_force": "the line force (as printed or consistent)",
    "delta_from": r"the point from which $\delta$ is counted",
    "delta_moment": "the sign of the reaction's moment",
}
CHOICES = {
    "integral": "the consistent force",
    "mean": r"the printed force",
    "centre": r"$\delta$ from the mass centre",
    "frame": r"$\delta$ in the fixed frame",
    "+": "the sign of \\aeq{10}",
    "-": "the sign of \\aeq{21}",
}


def thousands(count: float) -> str:
    """A count in groups of three digits."""
    return f"{round(count):,}".replace(",", r"\,")


def listed(words: Sequence[str]) -> str:
    """Words in a sentence."""
    return " and ".join([", ".join(words[:-1]), words[-1]]) if words[1:] else "".join(words)


def _name(e: Ensemble) -> list[str]:
    f = e.formulation
    return [f.line_force, f.delta_from, f"${f.delta_moment}$"]


def _span(values: Sequence[float], digits: int = 3) -> str:
    low, high = (number(v, digits) for v in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _over(kept: Kept | None) -> str:
    return "--" if kept is None else str(kept.informative)


def ensemble_table(found: Ensembles) -> str:
    """One row a formulation: effort, chance, what searches reach, and how long it holds."""
    rows = [
        [
            *_name(e),
            thousands(e.pads),
            f"{e.median.informative}, {e.best.informative}",
            _span([s.most.informative for s in e.seeds]),
            _span([s.most.listed for s in e.seeds]),
            _span([s.level for s in e.seeds]),
            _span([s.log_share for s in e.seeds], 2),
            ", ".join(_over(e.horizons.get(str(w))) for w in found.windows),
        ]
        for e in found.ensembles
    ]
    windows = ", ".join(map(str, found.windows))
    head = ["force", "delta", "sign", "pads", "chance", "best", f"of {found.total.listed}"]
    head += ["level", "share", f"best over {windows}"]
    return tabular("lllrrrrrrl", head, [rows])


def range_table(found: Ensembles) -> str:
    """Where the numbers of the last populations lie, by law."""
    rows = []
    for name, symbol in SYMBOLS.items():
        ranges = [law[name] for law in found.ranges.values()]
        row = [symbol, f"{number(ranges[0].searched[0])} to {number(ranges[0].searched[1])}"]
        for r in ranges:
            row += [f"{number(r.low, 2)} to {number(r.high, 2)}", percent(r.width, 0)]
            row.append(percent(r.between, 0))
        rows.append(row)
    head = ["number", "searched", *(w for law in found.ranges for w in (law, "width", "searches"))]
    return tabular("llrrrrrr", head, [rows])


def pad_table(found: Ensembles) -> str:
    """The chosen pad under both laws."""
    windows = ", ".join(map(str, found.windows))
    head = ["law", f"informative over {windows}", "listed", "not kept", "least $V$", "steady"]
    rows = [
        [
            law,
            ", ".join(_over(pad.horizons[str(w)]) for w in found.windows),
            str(kept.listed) if (kept := pad.horizons["1"]) is not None else "--",
            typeset(", ".join(pad.failing)),
            rf"{number(pad.least_speed, 2)}\,m/s",
            percent(pad.steady, 0),
        ]
        for law, pad in found.chosen.items()
    ]
    return tabular(r"llr>{\raggedright}p{2.3in}rr", head, [rows])


def _contrast(c: Contrast) -> str:
    levels = listed([f"{number(v, 3)} with {CHOICES[name]}" for name, v in c.levels.items()])
    probability = number(c.p, 2)
    if c.p < SURE:
        better = CHOICES[min(c.levels, key=lambda name: c.levels[name])]
        return (
            f"{SWITCHES[c.switch].capitalize()} matters: searches come nearer with {better} "
            f"(mean distance {levels}, $p = {probability.strip('$')}$)."
        )
    return (
        f"{SWITCHES[c.switch].capitalize()} cannot be told from the statements: searches come "
        f"equally near (mean distance {levels}, $p = {probability.strip('$')}$)."
    )


def _long(found: Ensembles) -> str:
    first, last = (str(found.windows[i]) for i in (0, -1))
    lasting = 0
    for e in found.ensembles:
        short, long = e.horizons[first], e.horizons[last]
        lasting += short is not None and long is not None and long.informative >= short.informative
    count = len(found.ensembles)
    if lasting == count:
        return f"All best pads keep as many over {last} windows as over one."
    which = {0: "None", 1: "Only one"}.get(lasting, str(lasting))
    return (
        f"{which} of the {count} best pads keeps as many over {last} windows as over one, "
        "the only horizon that the distance knows: most are fitted to the window."
    )


def _rival(found: Ensembles) -> str:
    pad = found.rival["consistent"]
    kept = pad.horizons[str(found.windows[0])]
    if kept is None:
        return "Its motion leaves the model."
    level, distance = number(found.rival_level, 3), number(pad.distance, 3)
    own = max(
        s.most.informative
        for e in found.ensembles
        if (e.formulation.line_force, e.formulation.delta_from, e.formulation.delta_moment)
        == ("integral", "centre", "+")
        for s in e.seeds
    )
    where = (
        f"Its distance, {distance}, is within the level {level} that each search of its law "
        "reached: it belongs to the ensemble"
        if pad.distance <= found.rival_level
        else f"Its distance, {distance}, is beyond the level {level} that each search reached"
    )
    than = (
        "more than"
        if kept.informative > own
        else "as many as"
        if kept.informative == own
        else ("fewer than")
    )
    return (
        f"It keeps {kept.listed} of the {found.total.listed} listed and {kept.informative} of the "
        f"{found.total.informative} informative statements, {than} the best of these searches "
        f"({own}). {where}."
    )


def _standing(found: Ensembles) -> str:
    shares = [s.standing for e in found.ensembles for s in e.seeds]
    left = sum(share > 0.0 for share in shares)
    if left == 0:
        return "No search has any of them left at its end"
    return f"{left} of {len(shares)} searches have some of them left at their end"


def _confined(found: Ensembles) -> str:
    laws = list(found.ranges.values())
    kinds = [n for n in SYMBOLS if n != "start"]  # standing starts are treated apart
    names = [n for n in kinds if all(law[n].width < NARROW for law in laws)]
    if not names:
        return (
            "No number is confined to half of its range under both laws: the statements do not "
            "identify a pad"
        )
    return (
        f"Only {listed([SYMBOLS[n] for n in names])} lie within half of the searched range under "
        "both laws: the statements do not identify a pad"
        if len(names) < len(kinds) / 2
        else f"{listed([SYMBOLS[n] for n in names])} lie within half of the searched range"
    )


def _front(found: Ensembles) -> str:
    seen = sum(f.pads for f in found.fronts)
    all_three = sum(f.together[3] for f in found.fronts)
    names = listed(list(found.names))
    if all_three == 0:
        return f"None of {thousands(seen)} pads judged on {names} keeps all three."
    best = max((f for f in found.fronts if f.together[3]), key=lambda f: f.most[3])
    law = CHOICES[best.formulation.line_force]
    rest = (
        "so that all that is said of model B2 can hold together"
        if best.most[3] == found.total_b2
        else f"so that the three do not exclude each other; the best of them, with {law}, keeps "
        f"{best.most[3]} of the {found.total_b2} statements on model B2 and lacks "
        f"{listed(best.lacks)}"
    )
    return (
        f"Of {thousands(seen)} pads judged on {names}, {thousands(all_three)} keep all three, "
        f"{rest}."
    )


def _enough(found: Ensembles) -> str:
    least = min(e.pads for e in found.ensembles)
    most = max(e.pads for e in found.ensembles)
    return thousands(least) if least == most else f"{thousands(least)} to {thousands(most)}"


def _steadier(pads: dict[str, Pad]) -> str:
    counts = {n: k.informative for n, p in pads.items() if (k := p.horizons["10"]) is not None}
    if len(counts) < len(pads):
        return "Under one of the laws its motion leaves the model within ten windows."
    best = max(counts, key=lambda name: counts[name])
    if len(set(counts.values())) == 1:
        return f"Over ten windows it keeps {counts[best]} informative statements under either law."
    return (
        f"Over ten windows it keeps more informative statements under the {best} law "
        f"({', '.join(f'{name}: {n}' for name, n in counts.items())})."
    )


def generated(found: Ensembles) -> Generated:
    """Values and tables, from the study of the same name."""
    switches = {c.switch: _contrast(c) for c in found.contrasts}
    pads = sum(e.pads for e in found.ensembles)
    values = {
        "ensembles.pads": thousands(pads),
        "ensembles.each": _enough(found),
        "ensembles.motions": thousands(sum(e.motions for e in found.ensembles)),
        "ensembles.hours": number(sum(e.seconds for e in found.ensembles) / 3600.0, 2),
        "ensembles.random": thousands(min(e.random for e in found.ensembles)),
        "ensembles.seeds": str(min(len(e.seeds) for e in found.ensembles)),
        "ensembles.longest": str(found.windows[-1]),
        "ensembles.left-out": typeset(found.left_out),
        "ensembles.standing": _standing(found),
        "ensembles.confined": _confined(found),
        "ensembles.front": _front(found),
        "ensembles.chance": str(max(e.best.informative for e in found.ensembles)),
        "ensembles.best": str(max(s.most.informative for e in found.ensembles for s in e.seeds)),
        "ensembles.ceiling": str(found.total.informative - 1),
        **{f"ensembles.switch.{name}": words for name, words in switches.items()},
    }
    if not found.left_out:
        values["ensembles.long"] = _long(found)
        values["ensembles.rival"] = _rival(found)
        values["ensembles.side"] = _steadier(found.chosen)
    tables = {
        "ensemble-searches": ensemble_table(found),
        "ensemble-ranges": range_table(found),
        "ensemble-pad": pad_table(found),
    }
    return values, tables
