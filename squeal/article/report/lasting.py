"""What lasts with damping: tables, and which cases hammer; the sentences ask the results first."""

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import NamedTuple

from squeal.article.cases import CASES
from squeal.article.report.latex import in_words, number, percent, tabular, typeset
from squeal.article.results.energy import LAWS, LineForce, motion_title
from squeal.article.results.onset import Late, Onset, Others, Settled
from squeal.article.results.records import Missing

Rule = Callable[[Settled], bool]


def by_side(one: Settled) -> bool:
    """By the model's own rule: where the reaction acts (B2), or which edge separates (B1)."""
    return one.hammers


def by_edges(one: Settled) -> bool:
    return one.edges


def titles(names: Iterable[str]) -> str:
    """Motions in a sentence, those under both laws together."""
    given = list(names)
    words: list[str] = []
    for name in given:
        stem, law = name[:4], name[5:]
        if not law or not {f"{stem}-{one}" for one in LAWS} <= set(given):
            words.append(motion_title(name))
        elif law == next(iter(LAWS)):
            words.append(f"{motion_title(stem)} under both laws")
    return in_words(words)


def dampings(ratios: Iterable[float]) -> str:
    return in_words([f"{100.0 * ratio:g}" for ratio in ratios] or ["no"]) + r"\,\%"


class Lasting(NamedTuple):
    """A motion that goes on losing contact; other: from another start than the scene's own."""

    name: str
    ratio: float
    one: Settled
    growth: float | None
    other: bool


def lasting(found: Onset) -> Iterator[Lasting]:
    """Own starts that go on losing contact, and where they do not the liveliest of others."""
    for name, row in found.late.items():
        for one, others in zip(row, found.others[name] or [None] * len(row), strict=True):
            if isinstance(one, Late) and one.goes_on:
                yield Lasting(name, one.ratio, one, one.growth, False)
            elif others and others.liveliest:
                yield Lasting(name, others.ratio, others.liveliest, others.growth, True)


def grouped(some: Iterable[Lasting]) -> str:
    """Motions in a sentence, those with like damping ratios together."""
    ratios: dict[str, list[float]] = {}
    for each in some:
        ratios.setdefault(each.name, []).append(each.ratio)
    names: dict[tuple[float, ...], list[str]] = {}
    for name, mine in ratios.items():
        names.setdefault(tuple(mine), []).append(name)
    return in_words(
        [rf"{titles(group)} at $\zeta =$ {dampings(rs)}" for rs, group in names.items()]
    )


def beside_rest(found: Onset) -> list[Lasting]:
    """Motions that go on losing contact beside a stable equilibrium."""
    return [each for each in lasting(found) if each.growth is not None and each.growth <= 0.0]


def lasting_table(found: Onset) -> str:
    """The motions that do not come to keep their contact with damping."""
    head = ["", r"$\zeta$", "start", "others", "lost", "peak", r"$\delta/w$", "turns"]
    head += [r"by $\delta$", "by edges", "speed", "growth, 1/ms"]
    groups: dict[str, list[list[str]]] = {}
    on = {(each.name, each.ratio): each for each in lasting(found)}
    for name, row in found.late.items():
        for i, (ratio, own) in enumerate(zip(found.ratios, row, strict=True)):
            cells: list[str] = []
            if each := on.get((name, ratio)):
                cells = _cells(each, found.others[name][i] if found.others[name] else None)
            elif isinstance(own, Missing):
                cells = ["own", rf"\multicolumn{{9}}{{l}}{{{typeset(own.reason)}}}"]
            elif own.off:
                cells = ["own", r"\multicolumn{9}{l}{off the surface}"]
            if cells:
                first = [motion_title(name), rf"{100.0 * ratio:g}\,\%"]
                groups.setdefault(name, []).append(first + cells)
    return tabular("lrlrrrrrllrr", head, list(groups.values()))


def _yes(verdict: bool) -> str:
    return "yes" if verdict else "no"


def _cells(each: Lasting, others: Others | None) -> list[str]:
    one = each.one
    span = "--" if one.low is None else f"${one.low:.2f}$ to ${one.high:.2f}$"
    return [
        "other" if each.other else "own",
        f"{others.lasting}/{others.starts}" if others else "--",
        percent(one.lost, 0),
        number(one.peak, 3),
        span,
        str(one.turns),
        "--" if one.low is None else _yes(one.hammers),
        _yes(one.edges),
        number(one.face, 2),
        number(each.growth, 2),
    ]


def _own_law(found: Onset, model: str, case: str) -> str | None:
    """The motion of a case under the scene's own law."""
    stem = f"{model}-{case}"
    return next((name for name in found.thresholds if name[: len(stem)] == stem), None)


def _beats(found: Onset, name: str | None, rule: Rule) -> tuple[set[float], set[float]]:
    """Damping ratios at which a motion goes on hammering, from the own start and from others."""
    if name is None:
        return set(), set()
    late = {one.ratio for one in found.late[name] if isinstance(one, Late) and rule(one)}
    return late, {one.ratio for one in found.others[name] if _count(one, rule)}


def _count(one: Others, rule: Rule) -> int:
    return one.edges if rule is by_edges else one.hammer


def _ways(found: Onset, case: str, rule: Rule) -> dict[str, list[float]]:
    """With which models a case goes on hammering, at which damping ratios."""
    one, two = (
        set().union(*_beats(found, _own_law(found, model, case), rule)) for model in ("b1", "b2")
    )
    ways = {"both models": one & two, "B1 alone": one - two, "B2 alone": two - one}
    return {way: sorted(ratios) for way, ratios in ways.items() if ratios}


def hammering_on(found: Onset) -> list[str]:
    """The scenes that go on hammering, from any start, by either rule and under either law."""
    rules = (by_side, by_edges)
    on = [name[:4] for name in found.late if any(any(_beats(found, name, r)) for r in rules)]
    return list(dict.fromkeys(on))


def _starts(found: Onset) -> int:
    """How many other starts each motion has."""
    return max((one.starts for row in found.others.values() for one in row), default=0)


def _other_law(found: Onset, case: str) -> str:
    """Where a case of B2 goes on hammering under the other law, if that differs."""
    own = _own_law(found, "b2", case)
    names = {n: law for law in LAWS if (n := f"b2-{case}-{law}") in found.others}
    if own not in names:
        return ""
    ratios = {
        n: [set().union(*_beats(found, n, rule)) for rule in (by_side, by_edges)] for n in names
    }
    parts = []
    for name, law in names.items():
        if name != own and ratios[name] != ratios[own]:
            every = sorted(set().union(*ratios[name]))
            at = f"at {dampings(every)}" if every else "from none"
            parts.append(f"B2 under the {LAWS[law]} {at}")
    return "".join(parts)


def _which(found: Onset) -> str:
    """Which cases go on hammering, with which models and by which rule."""
    words, starts = [], _starts(found)
    for case in CASES:
        sides, edges = (_ways(found, case, rule) for rule in (by_side, by_edges))
        told = []
        for way in dict.fromkeys((*sides, *edges)):
            rules = ((r"by $\delta$", sides.get(way)), ("by the edges", edges.get(way)))
            if sides.get(way) == edges.get(way):
                either = "" if way == "B1 alone" else ", by either rule of B2"
                told.append(f"with {way} at {dampings(sides[way])}{either}")
            else:
                each = [f"{rule} at {dampings(ratios)}" for rule, ratios in rules if ratios]
                told.append(f"with {way}, {', '.join(each)}")
        other = _other_law(found, case)
        if not told and not other:
            continue
        names = [_own_law(found, model, case) for model in ("b1", "b2")]
        if not told:
            names = [name for name in found.late if name.startswith(f"b2-{case}")]
        own = any(_beats(found, name, rule)[0] for name in names for rule in (by_side, by_edges))
        ways = ", ".join(told) or f"with {other} alone"
        if told and other:
            ways += f" ({other})"
        words.append(f"({case}){'' if own else '*'} {ways}")
    if not words:
        return "no case goes on hammering, by either rule"
    star = f" (* from some of {starts} other starts)" if any(")*" in one for one in words) else ""
    return f"these go on hammering{star}: {'; '.join(words)}"


def hammer_table(found: Onset) -> str:
    """The cases that hammer, by damping, rule and time."""
    head = ["", r"$\zeta$", *_spans(found), "late", "late, other starts"]
    rows: list[list[list[str]]] = []
    rules = (("b1", "B1", by_edges), ("b2", r"B2, by $\delta$", by_side))
    for model, title, rule in (*rules, ("b2", "B2, by edges", by_edges)):
        names = {case: name for case in CASES if (name := _own_law(found, model, case))}
        block = []
        for i, ratio in enumerate(found.ratios):
            others = {case: found.others[n][i] for case, n in names.items() if found.others[n]}
            cells = [
                [c for c, o in others.items() if (one := o.early[k]) and rule(one)]
                for k in range(len(found.early))
            ]
            late = {case: found.late[name][i] for case, name in names.items()}
            cells.append([c for c, one in late.items() if isinstance(one, Late) and rule(one)])
            away = [f"{c} ({n}/{o.starts})" for c, o in others.items() if (n := _count(o, rule))]
            words = [", ".join(cell) or "--" for cell in cells] + [", ".join(away) or "none"]
            block.append([title if not i else "", rf"{100.0 * ratio:g}\,\%", *words])
        rows.append(block)
    return tabular("lr" + "l" * (len(head) - 2), head, rows)


def _spans(found: Onset) -> list[str]:
    """The spans in which own starts are looked at first, in windows."""
    return [f"{begin} to {end}" for begin, end in pairwise((0, *found.early))]


def _both(found: Onset, span: int) -> str:
    """Which cases hammer with both models, by one rule, in a span."""
    both: dict[str, list[float]] = {}
    for i, ratio in enumerate(found.ratios):
        for case in CASES:
            names = [_own_law(found, model, case) for model in ("b1", "b2")]
            some = [found.others[n][i].early[span] for n in names if n and found.others[n]]
            if len(some) == 2 and any(
                all(one and rule(one) for one in some) for rule in (by_side, by_edges)
            ):
                both.setdefault(case, []).append(ratio)
    words = [
        rf"({case}) hammers with both models at $\zeta =$ {dampings(ratios)}"
        + (" only" if len(ratios) < len(found.ratios) else "")
        for case, ratios in both.items()
    ]
    return in_words(words) or "no case hammers with both models"


def _early(found: Onset) -> str:
    """Which cases hammer with both models in each of the first spans."""
    spans: dict[str, list[str]] = {}
    for i, span in enumerate(_spans(found)):
        spans.setdefault(_both(found, i), []).append(span)
    return ", ".join(f"in windows {in_words(some)} {words}" for words, some in spans.items())


def _hammering(found: Onset) -> dict[str, str]:
    on = list(lasting(found))
    own, others = [e for e in on if not e.other], [e for e in on if e.other]
    lasts = grouped(own) or "none of the own starts"
    away = f"; from other starts in {grouped(others)}" if others else ""
    line = [e for e in on if not e.name.startswith("b1")]
    parts = {
        "by the one rule of B1": [e for e in on if e not in line and by_side(e.one)],
        "by both rules of B2": [e for e in line if by_side(e.one) and by_edges(e.one)],
        "by the edges alone": [e for e in line if by_edges(e.one) and not by_side(e.one)],
        r"by $\delta$ alone": [e for e in line if by_side(e.one) and not by_edges(e.one)],
    }
    beats = "; ".join(f"{words} in {grouped(some)}" for words, some in parts.items() if some)
    quiet = [e for e in on if not by_side(e.one) and not by_edges(e.one)]
    turns = [f"Hammering lasts {beats}."] if beats else []
    if quiet:
        turns.append(f"Contact is lost on and on without hammering in {grouped(quiet)}.")
    return {
        "onset.hammer": _which(found),
        "onset.early": _early(found),
        "onset.lasts": f"contact goes on changing in {lasts}{away}" if on else "no contact changes",
        "onset.turns": " ".join(turns),
    }


def _laws(found: Onset) -> str:
    """Under which law of line contact more of the same starts go on losing contact."""
    parts: dict[LineForce, list[str]] = {law: [] for law in LAWS}
    ways: tuple[tuple[LineForce, int], ...] = (("mean", 1), ("integral", -1))
    starts = 0
    for name, row in found.others.items():
        pairs = list(zip(row, found.others.get(f"{name[:4]}-integral", ()), strict=False))
        for law, sign in ways if name.endswith("mean") else ():
            more = [pair for pair in pairs if sign * (pair[0].lasting - pair[1].lasting) > 0]
            if more:
                counts = [
                    " against ".join(str(one.lasting) for one in pair[::sign]) for pair in more
                ]
                starts = more[0][0].starts
                at = rf"at $\zeta =$ {dampings([a.ratio for a, _ in more])}"
                parts[law].append(f"{motion_title(name[:4])} {at} ({in_words(counts)})")
    words = [f"under the {LAWS[law]} in {in_words(some)}" for law, some in parts.items() if some]
    if not words:
        return "As many starts go on under the printed law as under the integral law."
    end = (
        "In the latter the printed law's lack of a potential (finding~E4) is thus not what keeps "
        "motions going; whether it is the cause in the former is not shown."
        if all(parts.values())
        else "Whether the printed law's lack of a potential (finding~E4) is the cause is not shown."
    )
    return f"Of the {starts} other starts more go on {', and '.join(words)}. {end}"


def sentences(found: Onset) -> dict[str, str]:
    """What lasts, hammers and stands beside a stable equilibrium."""
    stable = beside_rest(found)
    still = _starts(found) - found.moving
    beside = (
        f"The equilibrium of {grouped(stable)} is stable: contact goes on changing beside it, and "
        "linear analysis does not announce it."
        if stable
        else "No motion goes on beside a stable equilibrium."
    )
    return _hammering(found) | {
        "onset.law": _laws(found),
        "onset.beside": beside,
        "onset.still": str(still),
        "onset.moving": str(found.moving),
        "onset.among": ", the equilibrium among them" if still % 2 else "",
        "onset.wider": number(found.wider),
        "onset.first": in_words(_spans(found)),
    }
