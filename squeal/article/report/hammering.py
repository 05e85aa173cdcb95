"""Sentences on hammering: which cases of the report's pad do, by model and under load."""

from collections.abc import Sequence
from itertools import takewhile

from squeal.article.claims.rules import CALM, SWINGS, TRIED
from squeal.article.report.latex import counted, in_words, number, percent
from squeal.article.results.claims import Hammering, Loaded, Settled
from squeal.article.results.starts import SceneStarts, Starts


def _cases(names: Sequence[str]) -> str:
    return in_words([f"({name})" for name in names]) or "no case"


def by_model(found: Hammering) -> str:
    """Which cases hammer with either model from the scenes' starts, and which tells them apart."""
    one, two = (set(found.cases[model]) for model in ("B1", "B2"))
    words = f"from the scenes' starts B1 hammers in {_cases(found.cases['B1'])}, B2 in "
    words += _cases(found.cases["B2"])
    if one == two or not one or not two:
        return words
    if two < one:
        return f"{words}, so that B2 alone sets {_cases(found.both)} apart"
    if one < two:
        return f"{words}, so that B1 alone sets {_cases(found.both)} apart"
    return f"{words}, and so both in {_cases(found.both)}"


def by_edges(found: Hammering) -> str:
    """What the rule of B1 says of model B2."""
    if set(found.by_edges) == set(found.cases["B2"]):
        return f"by the rule of B1, losses in turn, B2 hammers in {_cases(found.by_edges)}, too"
    return f"by the rule of B1, losses in turn, B2 would hammer in {_cases(found.by_edges)}"


def touching(found: Starts) -> str:
    """How many starts of B2 hammer by the way of delta without a loss of contact."""
    many = {
        name: one.swinging
        for name, one in found.scenes.items()
        if isinstance(one, SceneStarts) and one.swinging is not None
    }
    if not many:
        return "How many other starts hammer without a loss of contact is not known here"
    beat, full, met = (
        in_words([str(getattr(one, key)) for one in many.values()])
        for key in ("hammer", "full", "touching")
    )
    starts = max(one.starts for one in many.values())
    cases = in_words([f"({name[-1]})" for name in many])
    windows = max(
        one.maps[0].windows for one in found.scenes.values() if isinstance(one, SceneStarts)
    )
    over = counted(windows, "window")
    of = (
        f"Of the {starts} starts of Fig.~\\ref{{fig:starts}} in each of {cases} of model B2, "
        f"undamped and over {over}"
    )
    if not any(one.touching for one in many.values()):
        return f"{of}, none hammers by the rule of B2 and touches all the time"
    return (
        f"{of}, {beat} hammer by the rule of B2, the way of $\\delta$; of these {full} never leave "
        f"full contact and {met} never separate, which the article, asking for impacts (its "
        "Sec.~5), does not call hammering"
    )


def settles(found: Settled | None) -> str:
    """A motion that settles without damping, if one was found."""
    if found is None:
        return "none was found that does"
    title = f"model {found.scene[:2].upper()} in case ({found.scene[-1]})"
    begun = (
        f"one was sought: begun on the mode of {title} that decays at "
        f"${found.real:.0f}$\\,s$^{{-1}}$, its late accelerations over {number(found.windows, 2)} "
        f"windows are {percent(found.calm, 2)} of the greatest"
    )
    return f"{begun}: it settles by this rule" if found.calm < CALM else f"{begun}, too much"


def _reached(rows: Sequence[Loaded], swing: float) -> list[Loaded]:
    """The loads, from the least on, under which delta goes so far to both sides repeatedly."""
    return list(takewhile(lambda one: one.swings[str(swing)] >= SWINGS, rows))


def under_load(found: Hammering) -> str:
    """How far delta goes in the cases of B2 that hammer while the reaction exceeds some shares."""
    parts = []
    for name in found.cases["B2"]:
        rows = found.loaded[name]
        reached = [one for one in rows if one.low is not None]
        ends = [
            f"{number(one.low, 2)} to {number(one.high, 2)}"
            for one in reached
            if one.high is not None
        ]
        shares = in_words([f"{number(one.share, 2)}\\,$F_n$" for one in reached])
        met = {swing: _reached(rows, swing) for swing in TRIED}
        at = [
            f"at {number(swing, 2)}\\,$w$ "
            + (
                "under each of them"
                if len(heavy) == len(rows)
                else f"up to {number(heavy[-1].share, 2)}\\,$F_n$"
                if heavy
                else "under none"
            )
            for swing, heavy in met.items()
        ]
        parts.append(
            f"In ({name}) $\\delta/w$ goes from {in_words(ends)} while $R_n$ exceeds {shares}; "
            + f"it goes to each side as often as the rule asks {in_words(at)}"
        )
    return ". ".join(parts) or "Model B2 hammers in no case"
