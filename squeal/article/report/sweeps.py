"""Sentences on sweeps of friction and the branch of cycles; they ask the results first."""

from collections.abc import Sequence

from squeal.article.report.lasting import beside_rest, by_edges, by_side, dampings, grouped
from squeal.article.report.latex import in_words, number, typeset
from squeal.article.results.energy import motion_title
from squeal.article.results.onset import Cycles, Onset, Step, Sweep
from squeal.article.results.records import Missing
from squeal.numerics.grouping import together


def _mu(value: float) -> str:
    return rf"$\mu = {value:.3g}$"


def _last(way: tuple[Step, ...]) -> float | None:
    """The least friction of a way at which contact goes on changing."""
    return min((step.mu for step in way if step.goes_on), default=None)


def _at(found: Onset, name: str) -> Sweep | None:
    return next((one for one in found.sweeps.get(name, ()) if one.ratio == found.ratio), None)


def _span(found: Onset, steps: Sequence[Step]) -> str:
    """The friction of some steps, those in a row together."""
    runs = together([step.mu for step in steps], 1.5 * found.step, float)
    each = [f"{r[0]:.3g} to {r[-1]:.3g}" if r[1:] else f"{r[0]:.3g}" for r in runs]
    return rf"$\mu =$ {in_words(each)}"


def _beside(one: Sweep) -> list[Step]:
    """The steps of the lively motion at which the kicked equilibrium comes to keep its contact."""
    rest = {step.mu for step in one.up if not step.goes_on}
    return [step for step in one.lively if step.goes_on and step.mu in rest]


def _followed(found: Onset, one: Sweep) -> str:
    """Where the lively motion goes on and hammers."""
    on = [step for step in one.lively if step.goes_on]
    words = f"goes on losing contact for {_span(found, on)}"
    sides, edges = ([s for s in on if rule(s)] for rule in (by_side, by_edges))
    if not sides and not edges:
        return f"{words} and hammers nowhere"
    if sides == edges:
        return f"{words} and hammers for {_span(found, sides)}"
    parts = [
        f"{_span(found, some)} {rule}"
        for some, rule in ((sides, r"by $\delta$"), (edges, "by the edges"))
        if some
    ]
    return f"{words} and hammers for {' and '.join(parts)}"


def _lowered(found: Onset, name: str, one: Sweep) -> str:
    title = motion_title(name)
    both = _beside(one)
    if not one.changing:
        text = f"In {title} no changes of contact last on the way up."
    else:
        begins, down = one.changing[0].mu, _last(one.down)
        text = f"In {title} changes of contact that last begin at {_mu(begins)}"
        if down is not None:
            apart = abs(begins - down) >= 0.5 * found.step
            which = "with" if apart else "without"
            text += f"; lowered from {_mu(one.down[0].mu)} they last to {down:.3g}"
            if apart or not both:
                text += f", {which} hysteresis in steps of that width"
        text += "."
    if one.lively:
        text += f" The liveliest motion of other starts {_followed(found, one)}"
        where = f"; from rest contact comes to be kept for {_span(found, both)}: hysteresis"
        text += f"{where if both else ''}."
    return text


def _beyond(found: Onset) -> str:
    """What the equations give where the pad would be faster than the surface."""
    parts = []
    for name, sweeps in found.sweeps.items():
        own = _at(found, name)
        fast = [step for step in own.changing if not step.slides] if own else []
        if own is None or not fast:
            continue
        times = max(step.face for step in (*fast, *own.beyond) if step.face is not None)
        least = {
            sweep.ratio: [step.mu for step in sweep.beyond if not step.slides] for sweep in sweeps
        }
        ends = [(ratio, min(mu)) for ratio, mu in least.items() if mu]
        words = in_words([rf"{mu:.3g} ($\zeta = {100 * ratio:g}\,\%$)" for ratio, mu in ends])
        limit = found.thresholds.get(name)
        below = limit is not None and any(mu < limit for _, mu in ends)
        words += (
            ", some of it below the flutter threshold: hysteresis of the equations, and of no pad "
            "that slides"
            if below
            else ""
        )
        still = [step for step in own.up if step.mu > fast[0].mu and not step.goes_on]
        kept = f" (contact comes to be kept for {_span(found, still)})" if still else ""
        parts.append(
            f"In {motion_title(name)} the face becomes faster than the surface for "
            f"{_span(found, fast)}{kept}, up to {times:.2g} times as fast, and the model ends, "
            "since friction would turn round. The equations as they stand, lowered from the "
            f"greatest $\\mu$ up to which motion so goes on, keep it to $\\mu =$ {words}."
        )
    return " ".join(parts)


def _both(found: Onset) -> str:
    flutter = {name: mu for name, mu in found.thresholds.items() if mu is not None}
    range_ = rf"$\mu$ from {found.mu[0]:g} to {found.mu[-1]:g}"
    if not flutter:
        return f"no equilibrium of the scenes flutters for {range_}"
    groups: dict[str, list[str]] = {}
    for name, mu in flutter.items():
        one = _at(found, name)
        changing = [step for step in one.changing if step.slides] if one else []
        begins = changing[0].mu if changing else None
        hammers, edges = (
            next((step.mu for step in changing if rule(step)), None) for rule in (by_side, by_edges)
        )
        if begins is None:
            loss = "lasting losses of contact do not begin with it"
        elif abs(begins - mu) <= found.step:
            loss = "lasting losses of contact begin with it, to a step"
        else:
            loss = f"lasting losses of contact begin at {_mu(begins)}"
        if hammers is None:
            beat = "hammering does not begin while the pad slides"
        elif hammers == begins:
            beat = "hammering begins with them"
        else:
            beat = f"hammering begins at {_mu(hammers)} only"
        if edges is not None and edges != hammers:
            beat += f" (by the edges at {_mu(edges)})"
        where = f"{motion_title(name)} flutters from {_mu(mu)}"
        groups.setdefault(f"from rest {loss}, and {beat}", []).append(where)
    parts = "; ".join(f"{in_words(names)}: {words}" for words, names in groups.items())
    lively = [
        f"{motion_title(name)} {_followed(found, one)}"
        for name in found.sweeps
        if (one := _at(found, name)) and one.lively
    ]
    away = rf"; from other starts, tried at the scene's $\mu$, {in_words(lively)}" if lively else ""
    stable = grouped(each for each in beside_rest(found) if not each.other)
    beside = f"; {stable} goes on losing contact beside a stable equilibrium" if stable else ""
    return rf"at $\zeta = {100.0 * found.ratio:g}\,\%$ and {range_}, {parts}{away}{beside}"


def _cycles(found: Cycles, threshold: float | None) -> str:
    least = min(found.branch, key=lambda point: point.mu)
    end = found.branch[-1]
    unstable = any(not point.stable and point.changes for point in found.branch)
    if threshold is None:
        return f"The branch reaches down to $\\mu = {least.mu:.4f}$."
    if end.changes:
        return (
            f"The branch was followed to $\\mu = {end.mu:.4f}$ and not to the "
            f"threshold, $\\mu = {threshold:.4f}$."
        )
    begins = (
        f"Where no contact is lost the motion is nearly linear: the branch ends at the flutter "
        f"threshold, $\\mu = {threshold:.4f}$, with a cycle without changes of contact, a peak of "
        f"{end.peak:.2g} and a multiplier of {end.multiplier:.3g}. The cycle that loses contact "
        "begins at this amplitude, which is not small, and"
    )
    if least.mu < threshold - 1e-3 and unstable:
        return (
            f"{begins} goes towards smaller $\\mu$, unstable; it turns near "
            f"$\\mu = {least.mu:.3f}$ and is stable from there: between the two rest and the cycle "
            "coexist."
        )
    return f"{begins} goes towards greater $\\mu${'' if unstable else ' and is stable'}."


def _shot(found: Onset) -> dict[str, str]:
    if isinstance(found.cycles, Missing):
        text = f"No cycle was followed: {typeset(found.cycles.reason).rstrip('.')}."
        return {"onset.cycle": text, "onset.branch": ""}
    one, own = found.cycles, found.cycles.own
    agree = abs(one.decay - own.multiplier) < 1e-3
    cycle = (
        f"The motion of {motion_title(one.name)} is a cycle of {number(own.period, 4)}\\,ms with "
        f"{own.changes} changes of contact, found by shooting; its greatest Floquet multiplier is "
        f"{number(own.multiplier, 6)} in size, and a small disturbance decays to "
        f"{number(one.decay, 6)} of itself a period in a simulation, "
        f"{'which agrees' if agree else 'which does not agree'}."
    )
    return {"onset.cycle": cycle, "onset.branch": _cycles(one, found.thresholds.get(one.name))}


def _caption(found: Onset) -> str:
    names = list(found.sweeps)
    if not names:
        return "No motion goes on losing contact with damping."
    letters = in_words([f"({letter})" for letter, _ in zip("abcdefgh", names, strict=False)])
    text = (
        f"{letters}: peak force over friction, raised from the equilibrium of each $\\mu$ and "
        "lowered; crosses: from the liveliest of other starts, raised and lowered; pale: the face "
        "is faster than the surface, outside of the model"
    )
    if any(found.thresholds[name] is not None for name in names):
        text += rf"; dashed: flutter begins at $\zeta = {100.0 * found.ratio:g}\,\%$"
    if isinstance(found.cycles, Cycles):
        own = found.cycles.name
        letter = "abcdefghi"[len(names)]
        text += (
            rf". ({letter}): cycles of {motion_title(own)} at $\zeta =$ {dampings([found.ratio])} "
            f"by shooting, with the marks of ({'abcdefgh'[names.index(own)]})"
        )
    return text + "."


def swept(found: Onset) -> dict[str, str]:
    """The sentences on sweeps and cycles."""
    sweeps = [(name, one) for name in found.sweeps if (one := _at(found, name))]
    begin = " ".join(_lowered(found, name, one) for name, one in sweeps)
    return _shot(found) | {
        "onset.hysteresis": begin or "No motion changes its contact.",
        "onset.beyond": _beyond(found),
        "onset.both": _both(found),
        "onset.swept": dampings(sorted({o.ratio for row in found.sweeps.values() for o in row})),
        "onset.caption": _caption(found),
    }
