"""What lasts with damping: tables, and which cases hammer; the sentences ask the results first."""

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from squeal.article.cases import CASES
from squeal.article.report.latex import in_words, number, percent, tabular, typeset
from squeal.article.results.energy import LAWS, LineForce, motion_title
from squeal.article.results.onset import Late, Onset, Others, Settled
from squeal.files.records import Missing

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
    return in_words([f"{100.0 * ratio:g}" for ratio in ratios]) + r"\,\%"


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


class _Beats(NamedTuple):
    """Where a motion goes on hammering: damping ratios from the own start, and from others."""

    own: set[float]
    others: set[float]


def _beats(found: Onset, model: str, case: str, rule: Rule) -> _Beats:
    name = _own_law(found, model, case)
    if name is None:
        return _Beats(set(), set())
    late = {one.ratio for one in found.late[name] if isinstance(one, Late) and rule(one)}
    count = {one.ratio for one in found.others[name] if _count(one, rule)}
    return _Beats(late, count)


def _count(one: Others, rule: Rule) -> int:
    return one.edges if rule is by_edges else one.hammer


def _which(found: Onset, rule: Rule) -> str:
    """Which cases go on hammering, and with which models."""
    words = []
    for case in CASES:
        of = {model: _beats(found, model, case, rule) for model in ("b1", "b2")}
        at = {model: beats.own | beats.others for model, beats in of.items()}
        if not any(at.values()):
            continue
        own = any(beats.own for beats in of.values())
        start = f"({case})" if own else f"({case}), from other starts than its own,"
        both = sorted(at["b1"] & at["b2"])
        if both:
            words.append(rf"{start} with both models at $\zeta =$ {dampings(both)}")
        elif all(at.values()):
            words.append(f"{start} with each model, at no damping with both")
        else:
            words.append(f"{start} with {'B1' if at['b1'] else 'B2'} alone")
    if not words:
        return "no case goes on hammering"
    return f"these go on hammering: {'; '.join(words)}"


def hammer_table(found: Onset) -> str:
    """The cases that hammer, by damping, rule and time."""
    head = ["", r"$\zeta$", *(f"{n}" for n in found.early), "late", "late, other starts"]
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
            away = [f"{c} ({_count(o, rule)})" for c, o in others.items() if _count(o, rule)]
            words = [", ".join(cell) or "--" for cell in (*cells, away)]
            block.append([title if not i else "", rf"{100.0 * ratio:g}\,\%", *words])
        rows.append(block)
    return tabular("lr" + "l" * (len(head) - 2), head, rows)


def _any(early: Iterable[Settled | None]) -> bool:
    return any(one and (one.hammers or one.edges) for one in early)


def _early(found: Onset) -> str:
    """Which cases hammer with both models in their first windows."""
    both: dict[str, list[float]] = {}
    for i, ratio in enumerate(found.ratios):
        for case in CASES:
            names = [_own_law(found, model, case) for model in ("b1", "b2")]
            early = [found.others[n][i].early for n in names if n and found.others[n]]
            if len(early) == 2 and all(map(_any, early)):
                both.setdefault(case, []).append(ratio)
    words = [
        rf"({case}) hammers with both models at $\zeta =$ {dampings(ratios)}"
        for case, ratios in both.items()
    ]
    rest = [r for r in found.ratios if not any(r in ratios for ratios in both.values())]
    none = rf"; at $\zeta =$ {dampings(rest)} no case does" if rest and words else ""
    return f"{in_words(words)}{none}" if words else "no case hammers with both models"


def _hammering(found: Onset) -> dict[str, str]:
    which, edges = _which(found, by_side), _which(found, by_edges)
    rule = ", by either rule" if which == edges else f"; by the edges {edges}"
    on = list(lasting(found))
    own, others = [e for e in on if not e.other], [e for e in on if e.other]
    lasts = grouped(own) or "none of the own starts"
    away = f"; from other starts in {grouped(others)}" if others else ""
    parts = {
        "by both rules": [e for e in on if by_side(e.one) and by_edges(e.one)],
        "by the edges alone": [e for e in on if by_edges(e.one) and not by_side(e.one)],
        r"by $\delta$ alone": [e for e in on if by_side(e.one) and not by_edges(e.one)],
    }
    beats = "; ".join(f"{words} {grouped(some)}" for words, some in parts.items() if some)
    quiet = [e for e in on if not by_side(e.one) and not by_edges(e.one)]
    turns = [f"Of these hammer {beats}."] if beats else []
    if quiet:
        turns.append(f"Contact is lost on and on without hammering in {grouped(quiet)}.")
    return {
        "onset.hammer": which + (rule if on else ""),
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
        "What keeps a motion going is thus not decided by the printed law's lack of a potential "
        "(finding~E4)."
        if all(parts.values())
        else "Whether the printed law's lack of a potential (finding~E4) is the cause is not shown."
    )
    return f"Of the {starts} other starts more go on {', and '.join(words)}. {end}"


def sentences(found: Onset) -> dict[str, str]:
    """What lasts, hammers and stands beside a stable equilibrium."""
    stable = beside_rest(found)
    beside = (
        f"The equilibrium of {grouped(stable)} is stable: contact goes on changing beside it, and "
        "linear analysis does not announce it."
        if stable
        else "No motion goes on beside a stable equilibrium."
    )
    starts = max((one.starts for row in found.others.values() for one in row), default=0)
    return _hammering(found) | {
        "onset.law": _laws(found),
        "onset.beside": beside,
        "onset.others": str(starts),
        "onset.wider": number(found.wider),
        "onset.first": in_words([str(n) for n in found.early]),
    }
