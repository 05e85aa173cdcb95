"""Tables and sentences on onset and attractors; what interprets asks the results first."""

import math
from collections.abc import Iterable

from squeal.article.report.lasting import dampings, hammer_table, lasting_table, sentences
from squeal.article.report.latex import Generated, in_words, number, percent, tabular, typeset
from squeal.article.report.sweeps import swept
from squeal.article.results.energy import motion_title
from squeal.article.results.onset import Cycles, Exponent, Onset, Sign
from squeal.article.results.records import Missing
from squeal.article.results.spectra import Spectra

SIGNS: dict[Sign, str] = {
    "chaotic": "chaotic",
    "no growth": "without exponential growth",
    "undecided": "undecided",
}


def exponents_table(found: Onset) -> str:
    """Rates, and how many starts of each motion are chaotic, damped ones first."""
    head = ["motion", "damping", "windows", "own start, 1/ms", "all starts, 1/ms", *SIGNS]
    damped: list[list[str]] = []
    undamped: list[list[str]] = []
    for name, one in found.exponents.items():
        stem, _, free = name.partition(", ")
        row = [motion_title(stem)]
        if isinstance(one, Missing):
            row += ["", "--", "--", "--", rf"\multicolumn{{3}}{{l}}{{{typeset(one.reason)}}}"]
        else:
            each = f"{number(min(one.rates), 2)} to {number(max(one.rates), 2)}"
            half = one.half_widths[0]
            error = number(half, 2) if math.isfinite(half) else r"$\infty$"
            own = rf"{number(one.rates[0], 2)} $\pm$ {error}"
            row += [percent(one.ratio) if one.ratio else "none", str(one.windows), own, each]
            if one.ends:
                row.append(r"\multicolumn{3}{l}{the model ends: rates of that time}")
            else:
                row += [str(one.signs.count(sign)) for sign in SIGNS]
        (undamped if free else damped).append(row)
    return tabular("llrrrrrr", head, [damped, undamped])


def _exponents(found: Onset) -> str:
    """Motions by how many of their starts are chaotic."""
    by: dict[str, list[str]] = {}
    for name, one in found.exponents.items():
        if isinstance(one, Exponent):
            stem, _, free = name.partition(", ")
            title = motion_title(stem) + (f" ({free})" if free else "")
            by.setdefault(_signs(one), []).append(title)
    return "; ".join(words.format(in_words(names)) for words, names in by.items())


def _signs(one: Exponent) -> str:
    if one.ends:
        return "no exponent exists in {}, since a motion leaves the model"
    counts = {words: one.signs.count(sign) for sign, words in SIGNS.items()}
    some = [f"{n} are {words}" if n > 1 else f"{n} is {words}" for words, n in counts.items() if n]
    if some[1:]:
        return f"in {{}} {in_words(some)}"
    return f"all starts of {{}} are {next(words for words, n in counts.items() if n)}"


def _unseen(measured: Iterable[Exponent]) -> str:
    """Up to which rates a start that is not seen to be chaotic may still grow."""
    limits = [limit for one in measured if not one.ends for limit in one.unseen]
    if not limits:
        return "every start is seen to be chaotic"
    if not math.isfinite(max(limits)):
        return "for some starts the time is too short to see any"
    low, high = number(min(limits), 2), number(max(limits), 2)
    below = low if low == high else f"limits of {low} to {high}"
    return f"in the starts that are not chaotic rates below {below}\\,/ms cannot be seen"


def _zero(found: Onset) -> str:
    """What the exponent of a cycle, which is zero, says of the method's error."""
    if isinstance(found.cycles, Missing):
        return ""
    one = found.exponents.get(found.cycles.name)
    if not isinstance(one, Exponent) or one.ends:
        return ""
    rate, half = one.rates[0], one.half_widths[0]
    given = (
        "The exponent of a stable cycle is zero; for that of "
        f"{motion_title(found.cycles.name)} the method gives {number(rate, 2)} $\\pm$ "
        f"{number(half, 2)}\\,/ms"
    )
    return f"{given}." if abs(rate) <= half else f"{given}, beyond its own interval."


TONAL = 0.9  # of the power: more than that at multiples of one frequency is a tone
OFF = 0.01  # of a frequency: nearer are the same


def _sound(found: Spectra, cycles: Cycles | Missing) -> dict[str, str]:
    if not found.scenes:
        return {"onset.pitch": "No equilibrium of the scenes flutters with damping."}
    parts = []
    for name, one in found.scenes.items():
        model, _, case = name.partition("-")
        own = f"{model.upper()} ({case})"
        lower = one.strongest / one.growing - 1.0
        pitch = (
            f"at that of its growing mode, {number(one.growing, 4)}\\,kHz"
            if abs(lower) < OFF
            else f"{percent(abs(lower))} {'below' if lower < 0 else 'above'} that of its growing "
            f"mode, {number(one.growing, 4)}\\,kHz"
        )
        tone = "a tone" if one.tonal > TONAL else "no tone"
        parts.append(
            f"The strongest line of {own} lies at {number(one.strongest, 4)}\\,kHz, {pitch}; "
            f"{percent(one.tonal, 0)} of the power lies at its multiples: {tone}."
        )
        if isinstance(cycles, Cycles) and cycles.name[: len(name)] == name:
            apart = abs(one.strongest * cycles.own.period - 1.0)
            word = "The cycle found by shooting has the same frequency"
            other = "The cycle found by shooting has another frequency"
            parts.append(f"{word if apart < OFF else other}, to {number(apart, 1)} of it.")
    return {"onset.pitch": " ".join(parts)}


def generated(found: Onset, spectra: Spectra) -> Generated:
    """Values and tables of the chapter."""
    values = sentences(found) | _sound(spectra, found.cycles)
    values |= swept(found)
    values["onset.zero"] = _zero(found)
    values["onset.signs"] = _exponents(found) or "none was measured"
    values["onset.dampings"] = dampings(found.ratios)
    values["onset.step"] = number(found.step, 2)
    values["onset.range"] = f"${found.mu[0]:g}$ to ${found.mu[-1]:g}$"
    measured = [one for one in found.exponents.values() if isinstance(one, Exponent)]
    longest = max(measured, key=lambda one: one.windows, default=None)
    values["onset.least"] = number(longest.least if longest else None, 2)
    values["onset.unseen"] = _unseen(measured)
    values["onset.longest"] = str(longest.windows if longest else 0)
    values["onset.starts"] = str(max((len(one.rates) for one in measured), default=0))
    tables = {"lasting": lasting_table(found), "hammering": hammer_table(found)}
    return values, tables | {"exponents": exponents_table(found)}
