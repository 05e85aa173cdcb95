"""Tables and sentences on onset and attractors; what interprets asks the results first."""

from squeal.article.cases import CASES
from squeal.article.report.latex import Generated, in_words, number, percent, tabular, typeset
from squeal.article.report.sweeps import beside_rest, dampings, going_on, grouped, groups, swept
from squeal.article.results.energy import motion_title
from squeal.article.results.onset import Cycles, Exponent, Late, Onset
from squeal.article.results.spectra import Spectra
from squeal.files.records import Missing

WORDS = {
    "chaotic": "chaotic",
    "no growth": "no exponential growth shown",
    "undecided": "undecided",
    "ends": "the model ends: rates of that time",
}


def lasting_table(found: Onset) -> str:
    """The scenes' own starts that do not come to keep their contact with damping."""
    head = ["", r"$\zeta$", "lost", "peak", r"$\delta/w$", "turns", "hammers", "speed"]
    head.append("growth, 1/ms")
    groups: dict[str, list[list[str]]] = {}
    for name, row in found.late.items():
        for ratio, one in zip(found.ratios, row, strict=True):
            first = [motion_title(name), rf"{100.0 * ratio:g}\,\%"]
            if isinstance(one, Missing):
                cells = [rf"\multicolumn{{7}}{{l}}{{{typeset(one.reason)}}}"]
            elif one.off:
                cells = [r"\multicolumn{7}{l}{off the surface}"]
            elif one.goes_on:
                span = "--" if one.low is None else f"${one.low:.2f}$ to ${one.high:.2f}$"
                cells = [percent(one.lost, 0), number(one.peak, 3), span, str(one.turns)]
                cells.append("yes" if one.hammers else "no")
                cells += [number(one.face, 2), number(one.growth, 2)]
            else:
                continue
            groups.setdefault(name, []).append(first + cells)
    return tabular("lrrrrrlrr", head, list(groups.values()))


def exponents_table(found: Onset) -> str:
    """Exponents with their intervals, damped ones first."""
    head = ["motion", "damping", "windows", "each start, 1/ms", "mean, 1/ms", ""]
    damped: list[list[str]] = []
    undamped: list[list[str]] = []
    for name, one in found.exponents.items():
        stem, _, free = name.partition(", ")
        row = [motion_title(stem)]
        if isinstance(one, Missing):
            row += ["", "--", "--", "--", typeset(one.reason)]
        else:
            damping = percent(one.ratio) if one.ratio else "none"
            each = f"{number(min(one.rates), 2)} to {number(max(one.rates), 2)}"
            mean = rf"{number(one.rate, 2)} $\pm$ {number(one.half_width, 2)}"
            row += [damping, str(one.windows), each, mean, WORDS[one.sign]]
        (undamped if free else damped).append(row)
    return tabular("llrrrl", head, [damped, undamped])


def _hammering(found: Onset) -> dict[str, str]:
    on = list(going_on(found))
    places = {(name[:2], name[3], one.ratio) for name, one in on if one.hammers}
    both = {
        case: [r for r in found.ratios if {("b1", case, r), ("b2", case, r)} <= places]
        for case in CASES
    }
    which = [rf"({case}) at $\zeta =$ {dampings(rs)}" for case, rs in both.items() if rs]
    verb = "hammer" if which[1:] else "hammers"
    hammer = f"{in_words(which) or 'no case'} {verb} with both models"
    beating = [(name, one) for name, one in on if one.hammers]
    parts = [f"Of these hammer {grouped(beating)}."] if beating else []
    others = []
    for group in groups((name, one) for name, one in on if not one.hammers):
        low = min((o.low for o in group.rows if o.low is not None), default=None)
        high = max((o.high for o in group.rows if o.high is not None), default=None)
        span = "" if low is None else rf", with $\delta/w$ from ${low:.2f}$ to ${high:.2f}$"
        others.append(f"{group.words}{span}")
    if others:
        parts.append(f"Contact is lost on and on without hammering in {'; and in '.join(others)}.")
    return {
        "onset.hammer": hammer,
        "onset.lasts": f"contact goes on changing in {grouped(on)}" if on else "no contact changes",
        "onset.turns": " ".join(parts),
    }


def _laws(found: Onset) -> dict[str, str]:
    on = list(going_on(found))
    rest = {
        (name, one.ratio)
        for name, row in found.late.items()
        for one in row
        if isinstance(one, Late) and not one.goes_on and not one.off
    }
    fed = [
        (name, one)
        for name, one in on
        if name.endswith("mean") and (name.replace("mean", "integral"), one.ratio) in rest
    ]
    stable = beside_rest(found)
    law = (
        f"In {grouped(fed)} the printed law alone, which has no potential (finding~E4), keeps it "
        "going: under the integral law the same start comes to keep its contact."
        if fed
        else "No motion goes on under the printed law that does not under the integral law too."
    )
    beside = (
        f"The equilibrium of {grouped(stable)} is stable: contact goes on changing beside it, and "
        "linear analysis does not announce it."
        if stable
        else "No motion goes on beside a stable equilibrium."
    )
    return {"onset.law": law, "onset.beside": beside if on else ""}


def _exponents(found: Onset) -> str:
    by: dict[str, list[str]] = {}
    for name, one in found.exponents.items():
        if isinstance(one, Exponent):
            stem, _, free = name.partition(", ")
            title = motion_title(stem) + (f" ({free})" if free else "")
            by.setdefault(one.sign, []).append(title)
    words = {
        "chaotic": "chaotic are",
        "no growth": "no exponential growth is shown in",
        "undecided": "it is undecided in",
        "ends": "no exponent exists, since a motion leaves the model, in",
    }
    return "; ".join(f"{words[sign]} {in_words(by[sign])}" for sign in words if sign in by)


def _zero(found: Onset) -> str:
    """What the exponent of a cycle, which is zero, says of the method's error."""
    if isinstance(found.cycles, Missing):
        return ""
    one = found.exponents.get(found.cycles.name)
    if not isinstance(one, Exponent):
        return ""
    given = (
        "The exponent of a stable cycle is zero; for that of "
        f"{motion_title(found.cycles.name)} the method gives {number(one.rate, 2)}"
    )
    if abs(one.rate) <= one.half_width:
        return rf"{given} $\pm$ {number(one.half_width, 2)}."
    return (
        f"{given}, beyond its own interval, which holds the scatter between starts and "
        "not this error of a finite time."
    )


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
    values = _hammering(found) | _laws(found) | _sound(spectra, found.cycles)
    values |= swept(found)
    values["onset.zero"] = _zero(found)
    values["onset.signs"] = _exponents(found) or "none was measured"
    values["onset.dampings"] = dampings(found.ratios)
    values["onset.step"] = number(found.step, 2)
    values["onset.range"] = f"${found.mu[0]:g}$ to ${found.mu[-1]:g}$"
    measured = [one for one in found.exponents.values() if isinstance(one, Exponent)]
    longest = max(measured, key=lambda one: one.windows, default=None)
    values["onset.least"] = number(longest.least if longest else None, 2)
    values["onset.longest"] = str(longest.windows if longest else 0)
    values["onset.starts"] = str(max((len(one.rates) for one in measured), default=0))
    tables = {"lasting": lasting_table(found), "exponents": exponents_table(found)}
    return values, tables
