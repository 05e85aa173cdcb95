"""Sentences on single pads: what those of the ensembles and that of the report keep."""

from __future__ import annotations

from squeal.article.report.latex import in_words, number, typeset
from squeal.article.results.ensembles import SYMBOLS, Ensemble, Ensembles, Pad


def thousands(count: float) -> str:
    """A count in groups of three digits."""
    return f"{round(count):,}".replace(",", r"\,")


def consistent(found: Ensembles) -> Ensemble:
    """The ensemble of the consistent law."""
    return next(
        e
        for e in found.ensembles
        if (e.formulation.line_force, e.formulation.delta_from, e.formulation.delta_moment)
        == ("integral", "centre", "+")
    )


def lasts(found: Ensembles, name: str) -> list[str]:
    """Over how many windows the pad of the report keeps a conclusion."""
    if not found.chosen:
        return []
    failing = found.chosen[found.taken].failing
    wanted = set(found.conclusions[name].statements)
    return [
        window
        for window in map(str, found.windows)
        if (lost := failing[window]) is not None and not wanted & set(lost)
    ]


def kept_briefly(found: Ensembles, name: str) -> str:
    """Whether the pad of the report keeps a conclusion, and how many of those that are stored."""
    one, over = found.conclusions[name], lasts(found, name)
    stored = (
        f"{one.every.keep} of {thousands(one.every.pads)} pads of the ensembles (consistent law: "
        f"{one.consistent.keep} of {one.consistent.pads})"
    )
    if over:
        windows = f"{in_words(over)} window{'s' if over != ['1'] else ''}"
        return f"Kept by the pad of this report over {windows} and by {stored}"
    if not found.chosen:
        return f"Kept by {stored}"
    return f"Not kept by the pad of this report, but by {stored}"


def kept_by(found: Ensembles, name: str) -> str:
    """How many stored pads keep a conclusion, and whether the pad of the report does."""
    one, over = found.conclusions[name], lasts(found, name)
    own, every = one.consistent, one.every
    pad = (
        "The pad of this report keeps it over "
        f"{in_words(over)} window{'s' if over != ['1'] else ''}"
        if over
        else "The pad of this report does not keep it"
        if found.chosen
        else "No pad is judged afresh here"
    )
    lasting = (
        f", {one.lasting} of {one.tried} tried also over {one.over} windows" if one.tried else ""
    )
    also = "so do" if over else "but so do"
    return (
        f"{pad}; {also} {own.keep} of the {own.pads} pads stored of the ensemble of the consistent "
        f"law (from {own.keeping} of {own.searches} searches{lasting}) and {every.keep} of the "
        f"{thousands(every.pads)} of all laws"
    )


def twins(found: Ensembles) -> str:
    """Whether two statements are one."""
    one, two = found.twins.ids
    if found.twins.agree == found.twins.pads:
        return (
            f"With $\\delta$ counted from the centre, {one} and {two} are one statement (they "
            f"agree on all {thousands(found.twins.pads)} pads stored of the ensembles, "
            "Sec.~\\ref{sec:ensembles}), so that one of them should not be counted"
        )
    return (
        f"{one} and {two} agree on {thousands(found.twins.agree)} of the "
        f"{thousands(found.twins.pads)} pads stored of the ensembles with $\\delta$ from the "
        "centre, and nearly are one statement"
        if found.twins.agree > 0.9 * found.twins.pads
        else f"{one} and {two} are told apart by the stored pads"
    )


def beside(found: Ensembles, pad: Pad) -> str:
    """What the pad of the report keeps over longer times."""
    short = pad.horizons["1"]
    if short is None:
        return "By the rules of the ensembles the motions of the pad of this report end early."
    parts = []
    before = set(pad.failing["1"] or ())
    for window in map(str, found.windows[1:]):
        if (failing := pad.failing[window]) is None:
            parts.append(f"over {window} its motion leaves the model")
            break
        lost = [typeset(name) for name in failing if name not in before]
        kept = pad.horizons[window]
        assert kept is not None
        parts.append(
            f"over {window} it keeps {kept.everything}"
            + (f" and loses {in_words(lost)}" if lost else "")
        )
    speed = found.speed
    slid = "B12-sliding" in before
    told = (
        f"At the speed of the ensembles, {number(speed, 2)}\\,m/s at {number(found.load, 2)}\\,N, "
        f"its sliding {'stops' if slid else 'goes on'} (it would need "
        f"{number(pad.least_speed, 2)}\\,m/s at this load), so that it keeps {short.everything} "
        f"statements, {short.informative} of them informative"
    )
    return f"{told}; {'; '.join(parts)}."


def outside(found: Ensembles, pad: Pad) -> str:
    """Which numbers of the pad of the report lie outside the ranges of the ensembles."""
    searched = {name: r.searched for name, r in found.ranges["consistent"].items()}
    beyond = [
        f"{SYMBOLS[name]} ({number(value, 3)}, searched {number(low, 3)} to {number(high, 3)})"
        for name, (low, high) in searched.items()
        if not low <= (value := pad.numbers[name]) <= high
    ]
    if beyond:
        return f"The pad of this report lies outside them with {in_words(beyond)}."
    return "The pad of this report lies within them."
