"""Does the article hold? A verdict on each of its conclusions, from the results alone.

The text of the chapter gives the evidence; each verdict is a condition on results, so that it turns
where they do.
"""

from collections.abc import Sequence
from pathlib import Path

from squeal.article.cases import SMALL_REGION
from squeal.article.ensembles.choice import read_choice
from squeal.article.report.hammering import by_edges, by_model, settles, touching, under_load
from squeal.article.report.lasting import hammering_on
from squeal.article.report.latex import Generated, counted, in_words, number, percent
from squeal.article.report.pads import consistent, kept_briefly, origin, thousands
from squeal.article.report.physics import SYMBOLS
from squeal.article.results.angles import Angles
from squeal.article.results.claims import Claims, Hammering, JudgedClaim
from squeal.article.results.eigenvalues import Eigenvalues, EquilibriumPoles
from squeal.article.results.ensembles import Ensembles
from squeal.article.results.loci import HeldThreshold, Loci, SceneLoci
from squeal.article.results.map_ranges import MapRanges, Upright
from squeal.article.results.onset import Onset
from squeal.article.results.quasi_static import QuasiStatic
from squeal.article.results.records import Missing
from squeal.article.results.starts import KINDS, SceneStarts, Starts

MOST, FEW = 0.5, 0.1  # of random pads
NAMES = {
    "mu": "friction",
    "k_c/k1": "contact stiffness",
    "h/w": "height",
    "k2/k1": "springs",
    "preload": "preload",
}
CLOSED = 0.01  # how far a closed form for small tilts may be from what is measured


def of_pads(held: dict[str, bool], found: Ensembles, name: str) -> str:
    """A conclusion about motions: for which pads it holds as worded.

    The pad of the report and those stored of all searches were sought for the statements; random
    pads were not.
    """
    one = found.conclusions[name].alone
    own, others = held[one.id], one.every.keep
    share = one.random["every"].share
    many = "most" if share > MOST else "some" if share > FEW else "few"
    random = f"{many if share else 'no'} random ones"
    if own:
        return f"holds for {'pads' if others else 'one pad'} fitted to it, {random}"
    if others:
        return f"holds for other pads: some fitted to it, {random}"
    return f"holds for {random}" if share else "not reproduced by any pad"


def ran(found: Ensembles) -> str:
    """Of the random pads how many run, and in brackets of those of the consistent law."""
    every, own = found.ensembles, [consistent(found)]
    share, alone = (sum(e.ran for e in some) / sum(e.random for e in some) for some in (every, own))
    return f"{percent(share, 0)} ({percent(alone, 0)})"


def argued(held: dict[str, bool]) -> str:
    """How much of the exaggeration rests on the reading of it as a share of time."""
    if not (held["B1-all-separate"] and held["B2-only-c"]):
        return "The related two, the article's argument, this pad does not keep"
    if held["B12-more-loss"]:
        return "This pad keeps all three"
    return (
        "The related two, the article's argument, this pad keeps; the conclusion itself we "
        "read as a share of time"
    )


def region(full: Upright, printed: QuasiStatic) -> str:
    """Quasi-static sliding, kept and in full contact, is possible in a small region only."""
    if printed.share.as_printed >= SMALL_REGION:
        return "not reproduced"
    if full.small == 0:
        return "does not hold"
    if full.small == full.pads:
        return "holds"
    # which of the two comes first changes with the ranges and with what counts as small
    first, second = sorted(NAMES[name] for name in deciding(full)[:2])
    return f"by full contact, depends most on {first} and {second}"


def touching_at_rest(full: Upright) -> str:
    """The share of the map on which an equilibrium is kept in any contact, over many pads."""
    kept = full.touching
    words = f"{percent(kept.low, 0)} to {percent(kept.high, 0)} over {full.pads} pads"
    return f"{'never small' if kept.low >= SMALL_REGION else 'small for some'}: {words}"


def deciding(full: Upright) -> list[str]:
    """The parameters, first that over whose values the counts of pads with a small region differ
    most."""

    def apart(name: str) -> int:
        return max(full.small_at[name].values()) - min(full.small_at[name].values())

    return sorted(full.small_at, key=apart, reverse=True)


def small_counts(full: Upright) -> str:
    """Of how many pads with one value the region is small, by the two that matter most."""
    spans = {name: sorted(full.small_at[name].values()) for name in deciding(full)}
    parts = [f"{of[0]} to {of[-1]} by ${SYMBOLS[name]}$" for name, of in spans.items()]
    each = full.pads // len(full.small_at[deciding(full)[0]])
    return f"of {each} each {', '.join(parts[:2])}, by others less"


def singular(held: dict[str, bool], angles: Angles) -> str:
    """A singular matrix leaves no solution, or many."""
    if not held["B3-singular"]:
        return "not reproduced"
    return "does not follow" if angles.share.exists > 0.0 else "follows"


def influence(found: Ensembles) -> tuple[str, str]:
    """Whether the directions of the springs, in which alone the cases differ, influence parting:
    a verdict and the shares of random pads of the consistent law, as a sentence.

    A pad of which no case parts does not tell.
    """
    own = consistent(found)
    _, *some, every = own.parting
    ran = sum(own.parting)
    words = (
        f"Of {thousands(ran)} random pads that run (consistent law) "
        f"the surfaces of {percent(sum(some) / ran, 0)} part in some cases of B2, of "
        f"{percent(every / ran, 0)} in all"
    )
    parting = sum(some) + every
    if not sum(some):
        return "not supported", words
    shares = [sum(e.parting[1:-1]) / max(sum(e.parting[1:]), 1) for e in found.ensembles]
    most = sum(share > MOST for share in shares)
    told = (
        f"{words}: cases differ in {percent(sum(some) / parting, 0)} of those that part "
        f"({100 * min(shares):.0f} to {percent(max(shares), 0)} by formulation). Parting is not "
        "hammering"
    )
    by = "" if most in (0, len(shares)) else f", by {most} of {len(shares)} formulations"
    return f"{'mostly' if most else 'seldom'} holds{by}", told


def raised(claim: JudgedClaim, numbers: dict[str, float]) -> tuple[str, float]:
    """Whether friction raises the reaction at rest in case (b), and by what in closed form.

    The closed form is for a pad in full contact whose springs turn little, and above zero for every
    such pad up to divergence.
    """
    r = numbers["k2"] / numbers["k_c"]
    factor = (1.0 + 4.0 * r) / (1.0 + 4.0 * r - 6.0 * r * numbers["mu"] * numbers["h"])
    if not claim.holds:
        return "not reproduced", factor - 1.0
    near = abs(factor - 1.0 - claim.margin) <= CLOSED * factor
    return "an identity at rest" if near else "holds for this pad", factor - 1.0


def beside_a(found: Eigenvalues) -> str:
    """How many times the reaction of (a) at rest that of (b) is, with and without friction."""
    a, b = (found.scenes[name] for name in ("b2-a", "b2-b"))
    if isinstance(a, Missing) or isinstance(b, Missing):
        return "not both have a place of rest"
    with_friction, free = (number(p / q, 3) for p, q in ((b.R_n, a.R_n), (b.free, a.free)))
    return f"to {with_friction} times that of (a) ({free} without friction)"


def by_stiffness(found: Eigenvalues) -> str:
    """The friction at which the equilibria begin to flutter on softer and on stiffer contact."""
    cases = {n[-1]: o.flutter for n, o in found.scenes.items() if isinstance(o, EquilibriumPoles)}
    rows: dict[str, list[str]] = {}
    for case, one in cases.items():
        begins = [None if mu is None else number(mu, 3) for mu in one.values()]
        words = in_words([mu or "none" for mu in begins]) if any(begins) else "none"
        rows.setdefault(words, []).append(f"({case})")
    factors = in_words(list(next(iter(cases.values()), {})))
    told = ", ".join(f"{words} in {', '.join(some)}" for words, some in rows.items())
    return rf"with {factors} times ours flutter begins at $\mu$ of {told}"


def seen(hammering: Hammering) -> str:
    """Which models show the hammering that experiments saw."""
    models = [model for model, cases in hammering.cases.items() if cases]
    if len(models) == len(hammering.cases):
        return "both models show"
    return f"{models[0]} alone shows" if models else "no model shows"


def _first(found: Sequence[HeldThreshold]) -> float | None:
    return next((t.mu for t in found if t.kind == "flutter" and t.direction == "up"), None)


def _turned(one: SceneLoci) -> tuple[float | None, float | None]:
    """Friction from which the equilibrium flutters, free and with the rotation held."""
    free = None if isinstance(one.loop, Missing) else _first(one.loop.thresholds)
    return free, None if isinstance(one.tilt_held, Missing) else _first(one.tilt_held)


def rotation(loci: Loci, hammering: Hammering, onset: Onset) -> str:
    """Which of the cases that hammer flutter sooner with the rotation free, and which with it held.

    The latter speak against rotation being crucial.
    """
    own = {f"{model}-{case}".lower() for model, cases in hammering.cases.items() for case in cases}
    names = own.union(hammering_on(onset))
    if not names:
        return "no case hammers here"
    free: list[str] = []
    held: list[str] = []
    quiet: list[str] = []
    for one in loci.scenes:
        if one.name not in names:
            continue
        turns, stays = _turned(one)
        if turns is not None and (stays is None or turns < stays):
            free.append(f"{_short(one.name)} at {number(turns, 3)} (held: {_or_nowhere(stays)})")
        elif stays is not None:
            held.append(f"{_short(one.name)} at {number(stays, 3)} (free: {_or_nowhere(turns)})")
        else:
            quiet.append(_short(one.name))
    words = (
        f"of the cases that hammer (first row) {in_words(free) or 'none'} "
        f"flutter{'' if free[1:] else 's'} sooner with the rotation free"
    )
    words += f"; against: with it held {in_words(held)}" if held else ""
    return f"{words}; {in_words(quiet)} nowhere" if quiet else words


def _or_nowhere(mu: float | None) -> str:
    return "nowhere" if mu is None else number(mu, 3)


def _short(name: str) -> str:
    return f"{name[:2].upper()} ({name[-1]})"


def perpetual(starts: Starts) -> tuple[str, str]:
    """Whether model B1 cannot keep contact: a verdict and the starts of each case that do."""
    first = {
        name: one.maps[0]
        for name, one in starts.scenes.items()
        if isinstance(one, SceneStarts) and name.startswith("b1")
    }
    kept = {name: part.share[KINDS[0]] for name, part in first.items()}
    if not kept:
        return "not judged", "No other starts were simulated"
    words = in_words([f"{percent(share, 0)} in ({name[-1]})" for name, share in kept.items()])
    verdict = "does not hold" if any(kept.values()) else "supported"
    over = counted(max(part.windows for part in first.values()), "window")
    return (
        verdict,
        f"Over {over} B1 loses no contact from {words} of the other starts of "
        "Fig.~\\ref{fig:starts}",
    )


def generated(
    claims: Claims,
    angles: Angles,
    printed: QuasiStatic,
    poles: Eigenvalues,
    loci: Loci,
    ensembles: Ensembles,
    ranges: MapRanges,
    starts: Starts,
    onset: Onset,
    pad: Path,
) -> Generated:
    """The verdicts, and what the evidence counts."""
    held = {c.id: c.verdict == "reproduced" for c in claims.claims}
    own = read_choice(pad)
    of_directions, parting = influence(ensembles)
    (friction,) = (c for c in claims.claims if c.id == "B2-b-raised")
    of_raised, factor = raised(friction, own.numbers)
    of_perpetual, keeping = perpetual(starts)
    full = ranges.full
    return {
        "verdict.origin": origin(own.origin),
        "verdict.ran": ran(ensembles),
        "verdict.hammering": of_pads(held, ensembles, "hammering"),
        "verdict.hammering.kept": kept_briefly(ensembles, "hammering"),
        "verdict.by-model": by_model(claims.hammering),
        "verdict.by-edges": by_edges(claims.hammering),
        "verdict.touching": touching(starts),
        "verdict.settled": settles(claims.settled),
        "verdict.under-load": under_load(claims.hammering),
        "verdict.exaggeration": of_pads(held, ensembles, "exaggeration"),
        "verdict.exaggeration.kept": kept_briefly(ensembles, "exaggeration"),
        "verdict.argued": argued(held),
        "verdict.region": region(full, printed),
        "verdict.region.touching": touching_at_rest(full),
        "verdict.region.small": small_counts(full),
        "verdict.singular": singular(held, angles),
        "verdict.raised": of_raised,
        "verdict.raised.closed": percent(factor),
        "verdict.raised.measured": percent(friction.margin),
        "verdict.raised.beside": beside_a(poles),
        "verdict.stiffness": by_stiffness(poles),
        "verdict.seen": seen(claims.hammering),
        "verdict.settles": "all but cannot fail" if held["B3-none"] else "not reproduced",
        "verdict.directions": of_directions,
        "verdict.directions.parting": parting,
        "verdict.rotation": "by definition",
        "verdict.rotation.thresholds": rotation(loci, claims.hammering, onset),
        "verdict.perpetual": of_perpetual,
        "verdict.perpetual.kept": keeping,
    }, {}
