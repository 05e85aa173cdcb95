"""What the ensembles of pads say, from their stored form, a part of it judged afresh."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from squeal.article.claims import CLAIMS
from squeal.article.claims.motions import PLACES
from squeal.article.ensembles import choosing, gather
from squeal.article.ensembles.comparison import (
    by_choice,
    corrected,
    exchanged,
    keeping,
    sampled_distances,
    together,
)
from squeal.article.ensembles.distance import FOLLOWING, INDEX, judge
from squeal.article.ensembles.space import DIMENSIONS, FORMULATIONS, LOAD, SPEED, decode, standing
from squeal.article.identify.space import STOP
from squeal.article.results import ensembles as results
from squeal.article.results.robustness import Share
from squeal.article.results.verify import Switches
from squeal.article.studies.robustness import CONFIDENCE, share
from squeal.io.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version
from squeal.model.contact import CONSISTENT, FORMULATION_CHOICES

PEAKS = "B1-b-ratio"  # rests on two peaks
CHECKED = 3  # stored pads of each formulation that are judged afresh
DENSER = 16  # times as many samples of the motions whose verdicts then differ
TAIL = 0.05  # on either side of the range of a number
TWINS = ("B2-b-trailing", "B2-b-tilt")
LASTING, TRIED = 10, 48  # windows over which pads that keep a conclusion are judged, and how many


def _shares(holds: np.ndarray, pads: int) -> dict[str, Share]:
    return {c.id: share(int(n), pads) for c, n in zip(CLAIMS, holds, strict=True)}


def _median(histogram: np.ndarray) -> int:
    return int(np.searchsorted(histogram.cumsum(), histogram.sum() / 2.0))


def ensemble(kept: gather.Kept, number: int, *, judging: bool) -> results.Ensemble:
    """The record of one formulation; without judging its horizons are empty."""
    f = FORMULATIONS[number]
    best = int(np.lexsort([-kept.best[number, :, 0], -kept.best[number, :, 2]])[0])
    horizons: dict[str, results.Kept | None] = {}
    if judging:
        horizons = choosing.over_windows(decode(kept.points[number][[best]].astype(float)), f)[0][0]
    pads, motions, steps, seconds = kept.effort[number].sum(axis=0).tolist()
    random, ran = kept.random[number].sum(axis=0).tolist()
    histograms = kept.random_counts[number]
    points = kept.sample[number].astype(float)
    acting = [f.delta_from != "centre" or d.name != results.IDLE for d in DIMENSIONS]
    ends = np.quantile(points[:, :, acting], [TAIL, 1.0 - TAIL], axis=1)
    spread = np.ptp(ends, axis=0).mean(axis=1)
    far, unslid = (sampled_distances(kept, number, out) for out in ((), (gather.SLIDING,)))
    seeds = tuple(
        results.Seed(
            results.Kept(*map(int, kept.best[number, s])),
            float(kept.levels[number, s, -1]),
            float(np.mean(standing(decode(kept.sample[number, s].astype(float))))),
            choosing.failing(kept.margins[number, s]),
            stored=points.shape[1],
            distinct=len(np.unique(points[s], axis=0)),
            width=float(spread[s]),
            nearest=float(far[s].min()),
            mean=float(far[s].mean()),
            unslid=float(unslid[s].mean()),
        )
        for s in range(kept.best.shape[1])
    )
    return results.Ensemble(
        formulation=Switches.of(f),
        pads=int(pads),
        motions=int(motions),
        steps=int(steps),
        seconds=float(seconds),
        random=int(random),
        ran=int(ran),
        chance=_shares(kept.random_holds[number].sum(axis=0), int(random)),
        median=results.Kept(*map(_median, histograms)),
        best=results.Kept(*(int(np.flatnonzero(row)[-1]) for row in histograms)),
        seeds=seeds,
        best_pads=_shares((kept.margins[number] > 0.0).sum(axis=0), len(seeds)),
        horizons=horizons,
        parting=tuple(kept.random_parting[number].tolist()),
    )


def contrasts(kept: gather.Kept) -> tuple[results.Contrast, ...]:
    """Whether the level that a search reaches differs between the choices of each switch.

    So do the distances of the last populations without the statement on sliding.
    """
    level = kept.levels[:, :, -1].astype(float)
    numbers = range(len(FORMULATIONS))
    unslid = np.array([sampled_distances(kept, n, (gather.SLIDING,)).mean(axis=1) for n in numbers])
    found = {
        name: (exchanged(level, name), exchanged(unslid, name)) for name in FORMULATION_CHOICES
    }
    p, other = (corrected([pair[i][1] for pair in found.values()]) for i in (0, 1))
    pairs = len(FORMULATIONS) // 2
    of_random = {name: by_choice(kept, name) for name in found}
    keys = [(name, conclusion) for name in found for conclusion in gather.CONCLUSIONS]
    p_keep = dict(zip(keys, corrected([of_random[name].p[c] for name, c in keys]), strict=True))
    return tuple(
        results.Contrast(
            *(name, one[0], p[i], one[2], pairs, two[0], other[i]),
            random=of_random[name].random,
            ran=of_random[name].ran,
            keep=of_random[name].keep,
            p_keep={c: p_keep[name, c] for c in gather.CONCLUSIONS},
        )
        for i, (name, (one, two)) in enumerate(found.items())
    )


def _random(kept: gather.Kept, number: int, keep: np.ndarray) -> dict[str, Share]:
    """Shares of random pads, by law, of which so many of each formulation (F,) keep something."""
    pads = kept.random[..., 0].sum(axis=1)
    return {
        "consistent": share(int(keep[number]), int(pads[number])),
        "every": share(int(keep.sum()), int(pads.sum())),
    }


class Longer(NamedTuple):
    """Stored pads of the consistent law: their searches (n,), and their margins (n, claims) as
    stored and over `LASTING` windows."""

    searches: np.ndarray
    stored: np.ndarray
    margins: np.ndarray


def longer(kept: gather.Kept) -> Longer | None:
    """Pads that keep a conclusion, from all searches as many and by h evenly, judged for longer."""
    number = FORMULATIONS.index(CONSISTENT)
    held = [together(kept, [number], s)[0] for s in gather.CONCLUSIONS.values()]
    keep = np.any(held, axis=0)
    searches = np.flatnonzero(keep.any(axis=1)).tolist()
    rows = []
    for search in searches:
        _, first = np.unique(kept.sample[number][search], axis=0, return_index=True)
        own = first[keep[search][first]]
        some = np.linspace(0, len(own) - 1, min(len(own), TRIED // len(searches)))
        rows += [(search, own[i]) for i in some.round().astype(int)]
    if not rows:
        return None
    at = tuple(np.transpose(rows))
    points, stored = (every[number][at].astype(float) for every in (kept.sample, kept.sampled))
    return Longer(at[0], stored, judge(decode(points), CONSISTENT, stop=LASTING * STOP).margins)


def conclusion(kept: gather.Kept, name: str, long: Longer | None) -> results.Conclusion:
    """How many of the stored pads keep a conclusion, and those judged for longer over these."""
    number, statements = FORMULATIONS.index(CONSISTENT), gather.CONCLUSIONS[name]
    lasting = []
    for search in sorted(set(long.searches.tolist())) if long else ():
        assert long is not None
        own = (long.searches == search) & gather.keep_all(long.stored, statements)
        last = own & gather.keep_all(long.margins, statements)
        if own.any():
            lasting.append(results.Lasted(search + 1, int(own.sum()), int(last.sum())))
    every = keeping(kept, range(len(FORMULATIONS)), statements)
    own = keeping(kept, [number], statements)
    worded = gather.WORDED[name]
    drawn = kept.random_together[:, list(gather.CONCLUSIONS).index(name)]
    alone = kept.random_holds[:, :, INDEX[worded]].sum(axis=1)
    shares, shares_alone = (_random(kept, number, keep) for keep in (drawn, alone))
    narrow = kept.sampled[gather.keep_all(kept.sampled, statements)][:, INDEX["B2-only-c"]]
    by_itself = results.Alone(
        worded,
        keeping(kept, [number], (worded,)),
        keeping(kept, range(len(FORMULATIONS)), (worded,)),
        shares_alone,
    )
    kept_to = (statements, by_itself, own, every, tuple(lasting), LASTING, shares)
    span = (float(narrow.min()), float(narrow.max())) if len(narrow) else None
    return results.Conclusion(*kept_to, span)


def twins(kept: gather.Kept) -> results.Twins:
    """How often two statements agree on the stored pads with delta from the mass centre."""
    numbers = [n for n, f in enumerate(FORMULATIONS) if f.delta_from == "centre"]
    agree = pads = 0
    for number in numbers:
        points = kept.sample[number].reshape(-1, len(DIMENSIONS))
        _, first = np.unique(points, axis=0, return_index=True)  # equal pads say the same
        margins = kept.sampled[number].reshape(len(points), -1)[first]
        one, two = (margins[:, INDEX[name]] > 0.0 for name in TWINS)
        agree, pads = agree + int((one == two).sum()), pads + len(first)
    return results.Twins(TWINS, agree, pads)


def ranges(kept: gather.Kept, number: int) -> dict[str, results.Range]:
    """Where the numbers of the last populations of a formulation lie."""
    points = kept.sample[number].astype(float)
    numbers = decode(points.reshape(-1, points.shape[-1]))
    found = {}
    for at, d in enumerate(DIMENSIONS):
        low, high = np.quantile(points[:, :, at], [TAIL, 1.0 - TAIL])
        medians = np.median(points[:, :, at], axis=1)
        ends = np.quantile(numbers[d.name], [TAIL, 1.0 - TAIL])
        own = (*map(float, ends), float(high - low), float(np.ptp(medians)))
        found[d.name] = results.Range((d.low, d.high), d.log, *own)
    return found


def check(kept: gather.Kept) -> results.Check:
    """Judge a sample of the stored pads afresh."""
    random = np.random.default_rng(7)
    different: list[str] = []
    total = as_now = 0
    judged = np.zeros(len(CLAIMS), dtype=bool)
    off = []
    for number, f in enumerate(FORMULATIONS):
        flat = kept.sample[number].reshape(-1, len(DIMENSIONS)).astype(float)
        stored = kept.sampled[number].reshape(len(flat), -1)
        _, first = np.unique(flat, axis=0, return_index=True)  # equal pads say the same
        some = random.choice(first, CHECKED, replace=False)
        again = judge(decode(flat[some]), f).margins
        known = np.isfinite(again)
        off += np.abs(again - stored[some])[:, INDEX[PEAKS]].tolist()
        other = known & ((again > 0.0) != (stored[some] > 0.0))
        if other.any():
            fine = np.full(again.shape, np.nan)
            pads = np.flatnonzero(other.any(axis=1))
            fine[pads] = judge(decode(flat[some[pads]]), f, places=DENSER * PLACES).margins
            as_now += int(((fine > 0.0) == (again > 0.0))[other].sum())
            different += [
                f"{CLAIMS[at].id} (margin {stored[some][pad, at]:.2g} stored, "
                f"{again[pad, at]:.2g} now)"
                for pad, at in np.argwhere(other)
            ]
        total += int(known.sum())
        judged |= known.any(axis=0)
    count, unjudged = CHECKED * len(FORMULATIONS), choosing.names(~judged)
    verdicts = count, total, len(different), tuple(different), DENSER, as_now
    return results.Check(*verdicts, (float(np.nanmedian(off)), float(np.nanmax(off))), unjudged)


def study(files: Sequence[Path]) -> results.Ensembles:
    """The study of the stored ensembles; without heyoka no pad is judged afresh."""
    (file,) = files
    kept = gather.read_kept(file)
    judging = version("heyoka") != NOT_INSTALLED
    numbered = {name: FORMULATIONS.index(f) for name, f in choosing.LAWS.items()}
    picked = choosing.chosen(kept) if judging else choosing.Chosen({}, "", 0, 0, 0, 0)
    rival = most = pads = picked.pads
    if judging:
        if next(iter(pads.values())).numbers != choosing.RIVAL:
            (rival,) = choosing.side_by_side([dict(choosing.RIVAL)])
        (most,) = choosing.side_by_side(
            [dict(choosing.MOST)], {"consistent": choosing.LAWS["consistent"]}
        )
    long = longer(kept) if judging else None
    fronts = tuple(
        results.Front(
            Switches.of(FORMULATIONS[n]),
            int(kept.seen[n]),
            tuple(map(int, kept.together[n])),
            tuple(map(int, kept.most[n])),
            choosing.names(kept.lacks[n]),
            tuple(
                (float(a), float(b), float(c)) for a, b, c in kept.front_margins[kept.front_of == n]
            ),
        )
        for n in range(len(FORMULATIONS))
    )
    return results.Ensembles(
        ensembles=tuple(ensemble(kept, n, judging=judging) for n in range(len(FORMULATIONS))),
        stages=int(kept.stages),
        windows=choosing.WINDOWS,
        confidence=CONFIDENCE,
        total=results.Kept(len(CLAIMS), int(gather.LISTED.sum()), int(gather.COUNTS.sum())),
        counted=choosing.names(gather.COUNTS),
        following=FOLLOWING,
        contrasts=contrasts(kept),
        ranges={name: ranges(kept, n) for name, n in numbered.items()},
        samples={
            name: tuple(
                tuple(round(float(u), 3) for u in point)
                for point in kept.sample[n].reshape(-1, len(DIMENSIONS))
            )
            for name, n in numbered.items()
        },
        names=gather.FRONT,
        total_b2=int(gather.B2.sum()),
        fronts=fronts,
        rival=rival,
        most=most,
        plausible=choosing.plausible(dict(choosing.MOST)),
        conclusions={name: conclusion(kept, name, long) for name in gather.CONCLUSIONS},
        twins=twins(kept),
        speed=SPEED,
        load=LOAD,
        chosen=pads,
        chosen_from=picked.origin,
        taken=choosing.law_of(pads) if judging else "",
        candidates=picked.candidates,
        compared=min(choosing.LONGER, picked.candidates),
        least=picked.least,
        equal=picked.equal,
        first_equal=picked.taken,
        scattered=choosing.SCATTERED,
        check=check(kept) if judging else results.Check(0, 0, 0, (), DENSER, 0, (0.0, 0.0), ()),
        left_out="" if judging else f"{WITHOUT_HEYOKA} nothing else judges pads by the hundred.",
    )
