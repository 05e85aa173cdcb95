"""Sentences on hammering: which cases of the report's pad do, by model and under load."""

from collections.abc import Sequence

from squeal.article.claims.rules import HAMMER, SWINGS
from squeal.article.report.latex import in_words, number
from squeal.article.results.claims import Hammering, Loaded


def _cases(names: Sequence[str]) -> str:
    return in_words([f"({name})" for name in names]) or "no case"


def by_model(found: Hammering) -> str:
    """Which cases hammer with either model, and which model tells them apart."""
    one, two = (set(found.cases[model]) for model in ("B1", "B2"))
    words = f"model B1 hammers in {_cases(found.cases['B1'])}, model B2 in "
    words += _cases(found.cases["B2"])
    if one == two or not one or not two:
        return words
    if two < one:
        return f"{words}, so that B2 alone sets {_cases(found.both)} apart"
    if one < two:
        return f"{words}, so that B1 alone sets {_cases(found.both)} apart"
    return f"{words}, and so both in {_cases(found.both)}"


def _goes_on(one: Loaded) -> bool:
    """Whether delta goes to both sides repeatedly, counted under this load only."""
    if one.low is None or one.high is None:
        return False
    return min(one.high, -one.low) > HAMMER and one.swings >= SWINGS


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
        heavy = [one for one in rows if _goes_on(one)]
        met = (
            f"the rule is met under each of these loads, from {number(HAMMER, 2)}\\,$w$ on"
            if len(heavy) == len(rows)
            else f"the rule is met up to {number(heavy[-1].share, 2)}\\,$F_n$"
            if heavy
            else "the rule is met by a light touch only"
        )
        parts.append(
            f"In ({name}) $\\delta/w$ goes from {in_words(ends)} while $R_n$ exceeds {shares}; "
            + met
        )
    return ". ".join(parts) or "Model B2 hammers in no case"
