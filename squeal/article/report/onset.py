"""Tables and sentences on onset and attractors; what interprets asks the results first."""

from __future__ import annotations

import math

from squeal.article.report.latex import (
    Generated,
    in_words,
    number,
    percent,
    tabular,
    typeset,
)
from squeal.article.results.energy import motion_title
from squeal.article.results.onset import Cycles, Exponent, Late, Onset
from squeal.article.results.spectra import Spectra
from squeal.files.records import Missing

CONFIDENCE = 0.95  # of the intervals, as `squeal.simulation.batch.neighbours` makes them
WORDS = {
    "chaotic": "chaotic",
    "no growth": "no exponential growth shown",
    "finite-time": "undecided: the rate has not settled",
    "ends": "the model ends: a rate of that time",
}
ACCURACY = 10.0  # decimal digits of the simulations: deviations that grow by more follow no motion


def lasting_table(found: Onset) -> str:
    """What the scenes' own starts come to with damping."""
    ratios = sorted({o.ratio for row in found.late.values() for o in row if isinstance(o, Late)})
    head = ["", *(rf"$\zeta = {percent(ratio)}$" for ratio in ratios)]
    groups: dict[str, list[list[str]]] = {}
    for name, row in found.late.items():
        cells = [
            typeset(one.reason)
            if isinstance(one, Missing)
            else "off"
            if one.off
            else f"{percent(one.lost, 0)}, {number(one.peak, 3)}"
            if one.lost
            else "kept"
            for one in row
        ]
        groups.setdefault(name[:2], []).append([motion_title(name), *cells])
    return tabular("l" + "r" * len(ratios), head, list(groups.values()))


def exponents_table(found: Onset) -> str:
    """Exponents with their intervals, damped ones first."""
    head = ["motion", "damping", "windows", "exponent, 1/ms", ""]
    damped: list[list[str]] = []
    undamped: list[list[str]] = []
    for name, one in found.exponents.items():
        stem, _, free = name.partition(", ")
        row = [motion_title(stem)]
        if isinstance(one, Missing):
            row += ["", "--", "--", typeset(one.reason)]
        else:
            value = rf"{number(one.rate, 2)} $\pm$ {number(one.half_width, 2)}"
            damping = percent(one.ratio) if one.ratio else "none"
            row += [damping, str(one.windows), value, WORDS[one.sign]]
        (undamped if free else damped).append(row)
    return tabular("llrrl", head, [damped, undamped])


def _lasting(found: Onset) -> dict[str, str]:
    """Which motions go on hammering, and what the law has to do with it."""

    def lasts(name: str) -> bool:
        row = found.late.get(name, ())
        at = [o for o in row if isinstance(o, Late) and o.ratio == found.ratio]
        return any(o.lost > 0.0 and not o.off for o in at)

    on = [name for name in found.late if lasts(name)]
    words = in_words([motion_title(name) for name in on])
    fed = [
        name.removesuffix("-mean")
        for name in on
        if name.endswith("mean") and not lasts(name.replace("mean", "integral"))
    ]
    law = (
        f"In {in_words([motion_title(name) for name in fed])} the printed law alone keeps it "
        "going: under the integral law the same start comes to rest in contact."
        if fed
        else "No motion goes on under the printed law that does not under the integral law too."
    )
    kept = [name for name in found.sweeps if found.thresholds[name] is None]
    beside = (
        f"In {in_words([motion_title(name) for name in kept])} the equilibrium does not flutter at "
        "any friction of the sweep: contact goes on changing beside an equilibrium that small "
        "disturbances do not leave, and linear analysis does not announce it."
        if kept
        else "In all of them the equilibrium flutters from some friction on."
    )
    return {
        "onset.lasts": f"contact goes on changing in {words}" if on else "no contact changes",
        "onset.law": law,
        "onset.beside": beside,
    }


def _hysteresis(found: Onset) -> str:
    """How far apart onset and end are on the way up and down, at the ratio of the study."""
    parts = []
    for name, sweeps in found.sweeps.items():
        (one,) = (sweep for sweep in sweeps if sweep.ratio == found.ratio)
        up, down = found.lasting[name].begins, found.lasting[name].ends
        first = min(one.up.changing, default=None)
        if up is None or down is None:
            way = in_words([w for w, mu in (("up", up), ("down", down)) if mu is None])
            passing = (
                f" (those that begin at $\\mu = {first:.3g}$ die out)"
                if first and up is None
                else ""
            )
            parts.append(
                f"in {motion_title(name)} no lasting changes are shown near the end of the way "
                f"{way}{passing}"
            )
            continue
        which = "with" if up - down > 1.5 * found.step else "without"
        caused = (
            ", brought about by the step or the kick, since the equilibrium does not flutter: with "
            "others they may begin elsewhere or not at all"
            if found.thresholds[name] is None
            else ""
        )
        parts.append(
            f"in {motion_title(name)} they begin at $\\mu = {up:.3g}$ on the way up{caused}, and "
            f"on the way down they last to ${down:.3g}$, {which} hysteresis beyond the steps"
        )
    return "; ".join(parts) if parts else "no motion changes its contact on both ways"


def _both(found: Onset) -> str:
    """Whether losing stability and losing contact go together in the scenes that were swept."""
    without = [n for n in found.sweeps if found.thresholds[n] is None and found.lasting[n].ends]
    before = [
        n
        for n in found.sweeps
        if (mu := found.thresholds[n]) is not None
        and (end := found.lasting[n].ends) is not None
        and end < mu - 1.5 * found.step
    ]
    parts = []
    if without:
        parts.append(
            f"{in_words([motion_title(n) for n in without])} goes on losing contact beside an "
            "equilibrium that does not flutter at all"
        )
    if before:
        parts.append(
            f"{in_words([motion_title(n) for n in before])} does so below the friction at which "
            "its equilibrium begins to flutter"
        )
    return in_words(parts) or "in the scenes that were followed both begin together"


def _cycles(found: Cycles, threshold: float | None) -> str:
    """Whether the branch of cycles leaves the threshold to smaller or to greater friction."""
    least = min(found.branch, key=lambda point: point.mu)
    unstable = any(not point.stable and point.changes for point in found.branch)
    if threshold is None:
        return f"The branch reaches down to $\\mu = {least.mu:.4f}$."
    if found.branch[-1].changes:
        return (
            f"The branch was followed to $\\mu = {found.branch[-1].mu:.4f}$ and not to the "
            f"threshold, $\\mu = {threshold:.4f}$."
        )
    if least.mu < threshold - 1e-3 and unstable:
        return (
            f"The branch leaves the flutter threshold, $\\mu = {threshold:.4f}$, towards smaller "
            f"$\\mu$ and unstable, turns near $\\mu = {least.mu:.3f}$ and is stable from there: "
            "the onset is subcritical, and between the two rest and the cycle coexist."
        )
    return (
        f"The branch leaves the flutter threshold, $\\mu = {threshold:.4f}$, towards greater "
        "$\\mu$: the onset is supercritical."
    )


def _shot(found: Onset) -> dict[str, str]:
    """The cycle at the scene's friction and its branch."""
    if isinstance(found.cycles, Missing):
        text = f"No cycle was followed: {typeset(found.cycles.reason).rstrip('.')}."
        return {"onset.cycle": text, "onset.branch": ""}
    one, own = found.cycles, found.cycles.own
    agree = abs(one.decay - own.multiplier) < 1e-3
    cycle = (
        f"The motion of {motion_title(one.name)} is a cycle of {number(own.period, 4)}\\,ms with "
        f"{own.changes} changes of contact, found by shooting; its greatest Floquet multiplier is "
        f"{number(own.multiplier, 6)} in size, and a disturbance decays by {number(one.decay, 6)} "
        f"a period in a simulation, {'which agrees' if agree else 'which does not agree'}."
    )
    return {
        "onset.cycle": cycle,
        "onset.branch": _cycles(one, found.thresholds.get(one.name)),
    }


def _exponents(found: Onset) -> str:
    """Which motions are chaotic and which have no exponent."""
    by: dict[str, list[str]] = {}
    for name, one in found.exponents.items():
        if isinstance(one, Exponent):
            stem, _, free = name.partition(", ")
            title = motion_title(stem) + (f" ({free})" if free else "")
            by.setdefault(one.sign, []).append(title)
    words = {
        "chaotic": "chaotic are",
        "no growth": "no exponential growth is shown in",
        "finite-time": "it is undecided, since the rate has not settled, in",
        "ends": "no exponent exists, since the motion leaves the model, in",
    }
    return "; ".join(f"{words[sign]} {in_words(names)}" for sign, names in by.items())


def _second(found: Onset) -> str:
    """How growth by neighbours compares with that by the variational equations."""
    both = {
        name.partition(",")[0]: (one.early, one.variational)
        for name, one in found.exponents.items()
        if isinstance(one, Exponent) and one.early is not None and one.variational is not None
    }
    if not both:
        return ""
    limit = ACCURACY * math.log(10.0)
    near = {name: pair for name, pair in both.items() if max(pair) < limit}
    lost = in_words([motion_title(name) for name in both if name not in near])
    parts = []
    if near:
        apart = number(max(abs(a - b) for a, b in near.values()), 2)
        least, most = (number(f(min(pair) for pair in near.values()), 2) for f in (min, max))
        parts.append(
            f"Over the first {found.early} times the logarithm of the growth, {least} to {most}, "
            f"differs by at most {apart} from that by the variational equations."
        )
    if lost:
        parts.append(
            f"In {lost} deviations outgrow the accuracy of the simulation before, so that two "
            "methods do not follow one motion."
        )
    return " ".join(parts)


def _zero(found: Onset) -> str:
    """What the exponent of a cycle, which is zero, says of the method's error."""
    if isinstance(found.cycles, Missing):
        return ""
    one = found.exponents.get(found.cycles.name)
    if not isinstance(one, Exponent):
        return ""
    told = (
        "The exponent of a stable cycle is zero; for that of "
        f"{motion_title(found.cycles.name)} the method gives {number(abs(one.rate), 2)}"
    )
    if abs(one.rate) <= one.half_width:
        return f"{told}, within its interval."
    return (
        f"{told}, beyond its own interval, which holds the scatter between parts of the time and "
        "not this error of a finite time."
    )


TONAL = 0.9  # of the power: more than that at multiples of one frequency is a tone
OFF = 0.01  # of a frequency: nearer are the same


def _sound(found: Spectra, cycles: Cycles | Missing) -> dict[str, str]:
    """What the spectra say of pitch and tone."""
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
        if isinstance(cycles, Cycles) and cycles.name == name:
            apart = abs(one.strongest * cycles.own.period - 1.0)
            word = "The cycle found by shooting has the same frequency"
            other = "The cycle found by shooting has another frequency"
            parts.append(f"{word if apart < OFF else other}, to {number(apart, 1)} of it.")
    return {"onset.pitch": " ".join(parts)}


def generated(found: Onset, spectra: Spectra) -> Generated:
    """Values and tables of the chapter."""
    values = _lasting(found) | _shot(found) | _sound(spectra, found.cycles)
    values["onset.hysteresis"] = _hysteresis(found)
    values["onset.both"] = _both(found)
    values["onset.zero"] = _zero(found)
    values["onset.confidence"] = percent(CONFIDENCE, 0)
    values["onset.signs"] = _exponents(found) or "none was measured"
    values["onset.second"] = _second(found)
    lasting = [one.windows for one in found.exponents.values() if isinstance(one, Exponent)]
    values["onset.longest"] = str(max(lasting, default=found.windows))
    tables = {"lasting": lasting_table(found), "exponents": exponents_table(found)}
    return values, tables
