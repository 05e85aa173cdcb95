"""Works and energies of the motions: their table, and sentences that ask the results first."""

from squeal.article.report.latex import at_most, in_words, number, percent, tabular, typeset
from squeal.article.results.energy import LAWS, Energy, Motion, motion_title
from squeal.article.results.records import Missing

MULTIPLE = 2.0  # times more or less is far
GROWS = 1.1  # times the peak over a longer time: the motion still grows
PAUSE = 0.5  # of the time of the scene: that long without a change between others is a pause


def energy_table(found: Energy) -> str:
    """Works of friction, brake force and contact law, and the stays in partial contact."""
    head = ["", "friction", "brake force", "law gives", "in stays", "law takes", "in stays"]
    head.append("kinetic energy")
    groups: dict[str, list[list[str]]] = {}
    for name, one in found.motions.items():
        row = [motion_title(name)]
        if isinstance(one, Missing):
            row.append(rf"\multicolumn{{7}}{{l}}{{{typeset(one.reason)}}}")
        else:
            row += [number(1e3 * one.friction, 3), number(1e3 * one.load, 3)]
            for part in (one.fed(1), one.fed(-1)):
                row += [number(1e3 * sum(part), 3) if part else "0", str(len(part))]
            row.append(number(1e3 * one.kinetic, 3))
        groups.setdefault(name[:2], []).append(row)
    return tabular("lrrrrrrr", head, list(groups.values()))


def values(found: Energy) -> dict[str, str]:
    """Values that the text refers to."""
    whole = {name: one for name, one in found.motions.items() if isinstance(one, Motion)}
    printed = {
        motion_title(name.removesuffix("-mean")): (one, whole.get(name.replace("mean", "integral")))
        for name, one in whole.items()
        if name.endswith("mean")
    }
    gives, takes = ([n for n, (one, _) in printed.items() if one.fed(sign)] for sign in (1, -1))
    both = [name for name in gives if name in takes]
    if both:
        law = (
            "The printed law does work in partial contact, and with either sign: in "
            f"{in_words(both)} some stays give energy and others take it."
        )
    elif gives or takes:
        way = "gives" if gives else "takes"
        law = f"The printed law only {way} energy, in {in_words(gives or takes)}."
    else:
        law = "No motion shown here visits partial contact, so that the printed law does no work."
    return {
        "physics.energy.law": law,
        "physics.energy.source": _source({name: one for name, (one, _) in printed.items()}),
        "physics.energy.start": _start(printed),
        "physics.energy.residue": at_most(max(one.residue for one in whole.values())),
        **_longer({name: whole[name] for name in found.own if name in whole}, whole),
    }


def _source(printed: dict[str, Motion]) -> str:
    """Where the printed law has done more work than friction, then and after longer."""
    beyond = {name: one for name, one in printed.items() if abs(one.law) > abs(one.friction)}
    if not beyond:
        return "In no motion has the printed law done more work than friction by the end."
    told = []
    for name, one in beyond.items():
        each = _against(one.law, one.friction)
        for later in one.spans[1:2]:
            turned = abs(later.law) <= abs(later.friction)
            each += f", {'but less' if turned else 'and'} after {later.windows} times its time, "
            each += _against(later.law, later.friction)
        told.append(f"{name} ({each})")
    return f"By the end the printed law has done more work than friction in {in_words(told)}."


def _against(law: float, friction: float) -> str:
    """Two works (J) beside each other."""
    return f"{number(1e3 * law, 3)} against {number(1e3 * friction, 3)}\\,mJ"


def _ratios(pairs: dict[str, tuple[float, float]]) -> tuple[list[str], list[str]]:
    """Where one of two energies is far greater, and where it is far smaller."""
    ratios = {name: one / other for name, (one, other) in pairs.items()}
    more = [f"{n} ({number(r, 3)} times)" for n, r in ratios.items() if r > MULTIPLE]
    less = [f"{n} ({number(r, 3)} times)" for n, r in ratios.items() if r * MULTIPLE < 1.0]
    return more, less


def _start(printed: dict[str, tuple[Motion, Motion | None]]) -> str:
    """How the greatest kinetic energy under the printed law compares with the integral law's."""
    pairs = {
        name: (one, other)
        for name, (one, other) in printed.items()
        if other is not None and one.law != 0.0
    }
    more, less = _ratios({n: (one.kinetic, other.kinetic) for n, (one, other) in pairs.items()})
    longer = {
        name: (one.spans[1], other.spans[1])
        for name, (one, other) in pairs.items()
        if one.spans[1:] and other.spans[1:]
    }
    rise, fall = _ratios({n: (a.kinetic, b.kinetic) for n, (a, b) in longer.items()})
    later = rise + fall
    windows = next((a.windows for a, _ in longer.values()), 0)
    after = f" (over {windows} times its time by more in {in_words(later)})" if later else ""
    if not more and not less:
        return (
            "From the same start the greatest kinetic energy differs by less than "
            f"{number(MULTIPLE, 2)} times under both laws{after}."
        )
    parts = [f"far greater in {in_words(more)}"] if more else []
    parts += [f"far smaller in {in_words(less)}"] if less else []
    return (
        "From the same start the greatest kinetic energy under the printed law, over that under "
        f"the integral law, is {' and '.join(parts)}"
        + (": the law decides, and in either direction." if more and less else ".")
    )


SIGNAL = {"b1": "the force of the leading edge", "b2": "the reaction"}


def _other_law(name: str, whole: dict[str, Motion]) -> str:
    """What friction has given in a motion under the other law of line contact, in brackets."""
    stem, law = name[:4], name[5:]
    told = []
    for key, title in LAWS.items():
        one = whole.get(f"{stem}-{key}")
        if law and key != law and one and one.spans[1:]:
            later = one.spans[1]
            most, end = number(1e3 * later.most, 4), number(1e3 * later.friction, 2)
            told.append(f"{title}: up to {most}, by the end {end}\\,mJ")
    return f" ({'; '.join(told)})" if told else ""


def _longer(own: dict[str, Motion], whole: dict[str, Motion]) -> dict[str, str]:
    """What the scenes' motions do after the time that is shown, beside the other law."""
    grown, given, bursts, paused = [], [], [], []
    spans = {name: one.spans for name, one in own.items() if one.spans[1:]}
    for name, (first, later, *_) in spans.items():
        title, over = motion_title(name[:4]), f"{later.windows} times its time"
        if later.peak > GROWS * first.peak and first.calm == 1.0:
            grown.append(
                f"The motion of {title} still grows at the end: over {over} {SIGNAL[name[:2]]} "
                f"reaches {number(later.peak, 3)}\\,$F_n$ and the surfaces are apart for "
                f"{percent(later.apart)} of it (Sec.~\\ref{{sec:physics}})."
            )
            given.append(
                f"In {motion_title(name)}{',' if name[4:] else ''} friction has given up to "
                f"{number(1e3 * later.most, 4)}\\,mJ within {over}, and "
                f"{number(1e3 * later.friction, 2)}\\,mJ by the end of that"
                f"{_other_law(name, whole)}."
            )
        if (last := own[name].spans[-1]).pause > PAUSE:
            paused.append(title)
            bursts.append(
                f"{title} hammers in bursts, with up to {at_most(last.pause)} times its time "
                f"between them without a change of contact, over {last.windows} times it"
            )
    windows = next((later.windows for _, later, *_ in spans.values()), 0)
    calmest = min(spans, key=lambda name: spans[name][1].calm, default="")
    calm = f"{percent(spans[calmest][1].calm, 0)}, in {motion_title(calmest[:4])}" if spans else ""
    return {
        "physics.energy.grown": " ".join(grown),
        "physics.energy.given": " ".join(given),
        "physics.energy.bursts": f"Undamped {in_words(bursts)}." if bursts else "",
        "physics.energy.paused": f"; undamped {in_words(paused)} in bursts" if paused else "",
        "physics.energy.windows": str(windows),
        "physics.energy.calm": calm,
    }
