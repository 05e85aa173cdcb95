"""Sentences on single pads: what those of the ensembles and that of the report keep."""

from collections.abc import Sequence

from squeal.article.ensembles.balance import flattest
from squeal.article.report.latex import at_most, in_words, number, typeset
from squeal.article.results.ensembles import ELSEWHERE, SYMBOLS, Ensemble, Ensembles, Pad
from squeal.article.results.findings import Findings
from squeal.article.results.robustness import Share

LITTLE = 0.01  # of a ratio of peaks
LEFT = "--"  # where the motion of a pad leaves the model


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


def lasts(found: Ensembles, statements: Sequence[str]) -> list[str]:
    """Over how many windows the pad of the report keeps some statements at once."""
    if not found.chosen:
        return []
    failing = found.chosen[found.taken].failing
    wanted = set(statements)
    return [
        window
        for window in map(str, found.windows)
        if (lost := failing[window]) is not None and not wanted & set(lost)
    ]


def origin(words: str) -> str:
    """How the pad of the report was come by, to be put after it."""
    if words == ELSEWHERE:
        return "found by a search that began from pads in which case (c) alone separates"
    return f"chosen from the ensembles ({words})"


def kept_briefly(found: Ensembles, name: str) -> str:
    """Who keeps a conclusion as worded, and with the other statements of it: the pad of the report,
    searches and random pads."""
    one = found.conclusions[name]
    alone, over = one.alone, lasts(found, [one.alone.id])
    every, own = alone.every, alone.consistent
    who = f"by this pad over {_windows(found, over)} from the start, " if over else ""
    first = "one" if found.windows[0] == 1 else str(found.windows[0])  # all that others ran
    who += f"over {first} " if over else f"over {first} window{'s' if first != 'one' else ''} "
    but = "" if over or not found.chosen else ", not by this"
    others = len(one.statements) - 1
    return (
        f"Kept {who}by pads of {every.keeping} of {every.searches} searches "
        f"({own.keeping} of {own.searches}) and by {_both(alone.random)} of random pads{but}; with "
        rf"{others} related statements (Sec.~\ref{{sec:ensembles}}) by {one.every.keeping} "
        f"({one.consistent.keeping}) and {_both(one.random)}"
    )


def _windows(found: Ensembles, over: Sequence[str]) -> str:
    """Windows in a sentence; all of them by the first and the last."""
    every = [str(window) for window in found.windows]
    words = f"{over[0]} to {over[-1]}" if over[2:] and list(over) == every else in_words(over)
    return f"{words} window{'s' if over != ['1'] else ''}"


def _both(random: dict[str, Share]) -> str:
    """A share of random pads over all laws, and in brackets over those of the consistent one."""
    every, own = (rf"{100.0 * random[law].share:.2g}\,\%" for law in ("every", "consistent"))
    return f"{every} ({own})"


def _span(ends: Sequence[float]) -> str:
    return " to ".join(number(v, 2) for v in ends)


def kept_by(found: Ensembles, name: str) -> str:
    """How many stored pads keep a conclusion, and whether the pad of the report does."""
    one = found.conclusions[name]
    over = lasts(found, one.statements)
    own, every, count = one.consistent, one.every, len(one.statements)
    pad = (
        f"The pad of this report keeps all {count} together over {in_words(over)} "
        f"window{'s' if over != ['1'] else ''}"
        if over
        else f"The pad of this report does not keep all {count} together"
        if found.chosen
        else "No pad is judged afresh here"
    )
    each = [f"{some.keep} of {some.tried} of search {some.search}" for some in one.lasting]
    if all(some.keep == some.tried for some in one.lasting):
        each = [f"all {sum(some.tried for some in one.lasting)}"]
    lasting = f"; tried over {one.over} windows {in_words(each)}" if one.lasting else ""
    narrow = f", B2-only-c by {_span(one.only_c)}" if one.only_c else ""
    stored = f"{own.keep} of {own.pads} pads stored{lasting}"
    return (
        f"{pad}; pads of {own.keeping} of the {own.searches} searches of the consistent law keep "
        f"all {count} ({stored}) and of {every.keeping} of the "
        f"{every.searches} of all laws ({every.keep} of {thousands(every.pads)}{narrow}); "
        f"{one.alone.id} alone by pads of {one.alone.consistent.keeping} and "
        f"{one.alone.every.keeping} of them"
    )


def _apart(found: Ensembles) -> str:
    """On how many random pads two statements differ at least: by as many as keep only one."""
    one, two = found.twins.ids
    own = [e for e in found.ensembles if e.formulation.delta_from == "centre"]
    least = sum(round(abs(e.chance[one].share - e.chance[two].share) * e.random) for e in own)
    pads = sum(e.random for e in own)
    words = f"; of random ones at least {thousands(least)} of {thousands(pads)} differ"
    return words if least else ""


def twins(found: Ensembles) -> str:
    """Whether two statements are one."""
    one, two = found.twins.ids
    if found.twins.agree == found.twins.pads:
        left = [name for name in found.twins.ids if name not in found.counted]
        so = f"{left[0]} is not counted" if left else "one of them should not be counted"
        return (
            f"With $\\delta$ counted from the centre, {one} and {two} agree on all "
            f"{thousands(found.twins.pads)} different pads stored of the ensembles "
            f"(Sec.~\\ref{{sec:ensembles}}{_apart(found)}), so that {so}"
        )
    return (
        f"{one} and {two} agree on {thousands(found.twins.agree)} of the "
        f"{thousands(found.twins.pads)} different pads stored of the ensembles with $\\delta$ from "
        "the centre, and nearly are one statement"
        if found.twins.agree > 0.9 * found.twins.pads
        else f"{one} and {two} are told apart by the stored pads"
    )


def face_speed(pad: Pad, findings: Findings) -> float | None:
    """Least speed of the surface (m/s) that the lower face of the pad of the scenes stays below.

    The stored speed is for x_dot; the scenes' motions have the ratio of both (finding E16), which
    no scale of the speed changes. None where the scenes have no V.
    """
    (speeds,) = (f.measured for f in findings.findings if f.id == "E16")
    slip = speeds["greatest"]
    return pad.least_speed * speeds["face"] / slip if slip > 0.0 else None


def beside(found: Ensembles, pad: Pad, findings: Findings) -> str:
    """What the pad of the report keeps over longer times."""
    short = pad.horizons["1"]
    if short is None:
        return "By the rules of the ensembles the motions of the pad of this report end early."
    later: dict[str, list[str]] = {}
    before = set(pad.failing["1"] or ())
    for window in map(str, found.windows[1:]):
        if (failing := pad.failing[window]) is None:
            later["its motion leaves the model"] = [window]
            break
        lost = [typeset(name) for name in failing if name not in before]
        kept = pad.horizons[window]
        assert kept is not None
        words = f"it keeps {kept.everything}" + (f" and loses {in_words(lost)}" if lost else "")
        later.setdefault(words, []).append(window)
    parts = [f"over {in_words(windows)} {words}" for words, windows in later.items()]
    speed = found.speed
    slid = "B12-sliding" in before
    face = face_speed(pad, findings)
    rubs = "" if face is None else f"; its lower face, which rubs, {number(face, 2)}\\,m/s"
    told = (
        f"At the speed of the ensembles, {number(speed, 2)}\\,m/s at {number(found.load)}\\,N, "
        f"its sliding {'stops' if slid else 'goes on'}, judged by $\\dot x$ (it would need "
        f"{number(pad.least_speed, 2)}\\,m/s at this load{rubs}), so that it keeps "
        f"{short.everything} statements, {short.counted} of them counted"
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


def zero(found: Ensembles) -> str:
    """Which numbers of the pad of the report are zero, so that no factor changes them."""
    numbers = found.chosen[found.taken].numbers
    still = [SYMBOLS[name] for name in SYMBOLS if name != "start" and numbers[name] == 0.0]
    return f"{in_words(still)} stay zero" if still else "none is zero"


def balance(found: Ensembles) -> str:
    """Whether the balances let the pad of the report keep that delta is positive in case (d)."""
    limit, own = flattest("d"), found.chosen[found.taken].numbers["h"]
    needs = f"That $\\delta$ is positive throughout case (d) needs $h/w < {limit:.3f}$"
    if own < limit:
        return f"{needs}, which the pad of this report is."
    return (
        f"{needs}; the pad of this report, with {number(own, 3)}, cannot keep it, and a pad that "
        "does must be flatter."
    )


def most(found: Ensembles) -> str:
    """What the pad with most of the listed statements keeps, and for how long."""
    pad = found.most["consistent"]
    first = pad.horizons[str(found.windows[0])]
    if first is None:
        return "The motion of its pad leaves the model."
    ceiling = found.total.listed - 1
    whole = "all that can hold together" if first.listed == ceiling else "not all"
    lost = typeset(in_words(pad.failing[str(found.windows[0])] or ()))
    later = {w: pad.horizons[str(w)] for w in found.windows[1:]}
    long = [f"{kept.listed} over {w}" for w, kept in later.items() if kept is not None]
    gone = [str(w) for w, kept in later.items() if kept is None]
    long += [f"its motion leaves the model within {gone[0]}"] if gone else []
    like = "such as" if found.plausible else "not one that"
    return (
        f"One keeps {first.listed} of the {found.total.listed} listed statements, {whole}, "
        f"over one window ({', '.join(long)}), with $h/w$ {number(pad.numbers['h'], 3)} and $\\mu$ "
        f"{number(pad.numbers['mu'], 3)}; of the counted ones it does not keep "
        f"{lost}. It is {like} an engineer would take."
    )


def steadier(pads: dict[str, Pad]) -> str:
    counts = {n: k.counted for n, p in pads.items() if (k := p.horizons["10"]) is not None}
    if len(counts) < len(pads):
        return "Under one of the laws its motion leaves the model within ten windows."
    best = max(counts, key=lambda name: counts[name])
    if len(set(counts.values())) == 1:
        return f"Over ten windows it keeps {counts[best]} counted statements under either law."
    return (
        f"Over ten windows it keeps more counted statements under the {best} law "
        f"({', '.join(f'{name}: {n}' for name, n in counts.items())})."
    )


def sought(found: Ensembles) -> str:
    """How the pad of the report was come by, and with how many others it was compared."""
    begun = (
        "A search of unequal effort gave it, which began from pads in which case (c) alone "
        "separates: that (c) alone hammers was sought"
        if found.chosen_from == ELSEWHERE
        else f"It is that of {found.chosen_from}, and like all pads of the searches was fitted to "
        "the statements"
    )
    ties = ""
    if found.equal > found.first_equal:
        kept = [one.horizons[str(found.windows[0])] for one in found.chosen.values()]
        own = min(0 if k is None else k.counted for k in kept) == found.least
        places = "place" if found.first_equal == 1 else f"{found.first_equal} places"
        which = "this pad, listed first" if own and found.first_equal == 1 else "those listed first"
        ties = f" (of {found.equal} that tie for the last {places}, {which})"
    return (
        f"{begun}. Of {found.candidates} plausible pads (friction of linings, supports of a few "
        "centimetres, a load that a stiff caliper bears, longer than high), it and the best of "
        f"searches of two laws, the {found.compared} that keep most over one window under the "
        f"worse of two laws were compared{ties}: it keeps most over ten under the worse; of equals "
        "the steadiest in numbers that are off by one per cent would be taken, then the one with "
        "the least speed of the surface that exceeds its $\\dot x$"
    )


def differ(found: Ensembles) -> str:
    """How many verdicts on stored pads are others today, and which."""
    one = found.check
    left = f" ({in_words(one.unjudged)} is not judged in a batch)" if one.unjudged else ""
    if not one.different:
        return f"none differs from the stored one{left}"
    which = "; ".join(typeset(name) for name in one.which)
    others = "one differs" if one.different == 1 else f"{one.different} differ"
    again = (
        "It stays" if one.different == 1 == one.as_now else f"{one.as_now} of {one.different} stay"
    )
    return (
        f"{others} from the stored one{left}: {which}. {again} as now with {one.denser} times as "
        "many samples of the motion"
        + (
            ", so that the coarser samples of the stored ones decided"
            if 2 * one.as_now > one.different
            else ""
        )
    )


def coarse(found: Ensembles) -> str:
    """What the stored margins carry of the sampling of peaks."""
    median, most = found.check.peaks
    return (
        f"The margin of B1-b-ratio, which rests on two peaks, differs from the stored one by "
        f"{number(median, 2)} (median) to {at_most(most)} at most"
        + (
            ": its counts in Fig.~\\ref{fig:ensembles} and those of the searches carry that"
            if most > LITTLE
            else ", which changes little"
        )
    )
