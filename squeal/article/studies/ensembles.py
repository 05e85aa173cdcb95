"""What the ensembles of pads say, from their stored form, a part of it judged afresh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy import stats

from squeal.article.claims import CLAIMS
from squeal.article.ensembles.choosing import (
    LAWS,
    RIVAL,
    WINDOWS,
    chosen,
    failing,
    law_of,
    names,
    over_windows,
    side_by_side,
)
from squeal.article.ensembles.distance import judge
from squeal.article.ensembles.gather import B2, FRONT, INFORMATIVE, LISTED, Kept, read_kept
from squeal.article.ensembles.space import (
    DIMENSIONS,
    FORMULATIONS,
    decode,
    standing,
)
from squeal.article.results.ensembles import (
    Check,
    Contrast,
    Ensemble,
    Ensembles,
    Front,
    Range,
    Seed,
)
from squeal.article.results.ensembles import Kept as Counts
from squeal.article.results.robustness import Share
from squeal.article.results.verify import Switches
from squeal.article.studies.robustness import CONFIDENCE, share
from squeal.files.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version
from squeal.model.contact import FORMULATION_CHOICES, Formulation

CHECKED = 3  # stored pads of each formulation that are judged afresh
TAIL = 0.05  # on either side of the range of a number


def _switches(f: Formulation) -> Switches:
    return Switches(**{name: getattr(f, name) for name in FORMULATION_CHOICES})


def _shares(holds: np.ndarray, pads: int) -> dict[str, Share]:
    return {c.id: share(int(n), pads) for c, n in zip(CLAIMS, holds, strict=True)}


def _median(histogram: np.ndarray) -> int:
    return int(np.searchsorted(histogram.cumsum(), histogram.sum() / 2.0))


def ensemble(kept: Kept, number: int, *, judging: bool) -> Ensemble:
    """The record of one formulation; without judging its horizons are empty."""
    f = FORMULATIONS[number]
    best = int(np.lexsort([-kept.best[number, :, 0], -kept.best[number, :, 2]])[0])
    horizons: dict[str, Counts | None] = {}
    if judging:
        horizons = over_windows(decode(kept.points[number][[best]].astype(float)), f)[0][0]
    pads, motions, steps, seconds = kept.effort[number].sum(axis=0).tolist()
    random, ran = kept.random[number].sum(axis=0).tolist()
    histograms = kept.random_counts[number]
    seeds = tuple(
        Seed(
            Counts(*map(int, kept.best[number, s])),
            float(kept.levels[number, s, -1]),
            float(kept.shares[number, s, -1] / math.log(10.0)),
            float(np.mean(standing(decode(kept.sample[number, s].astype(float))))),
            failing(kept.margins[number, s]),
        )
        for s in range(kept.best.shape[1])
    )
    return Ensemble(
        formulation=_switches(f),
        pads=int(pads),
        motions=int(motions),
        steps=int(steps),
        seconds=float(seconds),
        random=int(random),
        ran=int(ran),
        chance=_shares(kept.random_holds[number].sum(axis=0), int(random)),
        median=Counts(*map(_median, histograms)),
        best=Counts(*(int(np.flatnonzero(row)[-1]) for row in histograms)),
        seeds=seeds,
        best_pads=_shares((kept.margins[number] > 0.0).sum(axis=0), len(seeds)),
        horizons=horizons,
    )


def contrasts(kept: Kept) -> tuple[Contrast, ...]:
    """Whether the level that a search reaches differs between the choices of each switch."""
    level = kept.levels[:, :, -1]
    found = []
    for name, choices in FORMULATION_CHOICES.items():
        groups = {c: level[[getattr(f, name) == c for f in FORMULATIONS]].ravel() for c in choices}
        p = float(stats.mannwhitneyu(*groups.values()).pvalue)
        found.append((name, {c: float(g.mean()) for c, g in groups.items()}, p))
    order = sorted(range(len(found)), key=lambda i: found[i][2])
    corrected, most = [0.0] * len(found), 0.0
    for rank, i in enumerate(order):
        most = max(most, min(1.0, found[i][2] * (len(found) - rank)))
        corrected[i] = most
    return tuple(
        Contrast(name, levels, p) for (name, levels, _), p in zip(found, corrected, strict=True)
    )


def ranges(kept: Kept, number: int) -> dict[str, Range]:
    """Where the numbers of the last populations of a formulation lie."""
    points = kept.sample[number].astype(float)
    numbers = decode(points.reshape(-1, points.shape[-1]))
    found = {}
    for at, d in enumerate(DIMENSIONS):
        low, high = np.quantile(points[:, :, at], [TAIL, 1.0 - TAIL])
        medians = np.median(points[:, :, at], axis=1)
        ends = np.quantile(numbers[d.name], [TAIL, 1.0 - TAIL])
        found[d.name] = Range(
            (d.low, d.high),
            float(ends[0]),
            float(ends[1]),
            float(high - low),
            float(np.ptp(medians)),
        )
    return found


def check(kept: Kept) -> Check:
    """Judge a sample of the stored pads afresh."""
    random = np.random.default_rng(7)
    different = total = 0
    for number, f in enumerate(FORMULATIONS):
        flat = kept.sample[number].reshape(-1, len(DIMENSIONS)).astype(float)
        stored = kept.sampled[number].reshape(len(flat), -1)
        some = random.choice(len(flat), CHECKED, replace=False)
        again = judge(decode(flat[some]), f).margins
        known = np.isfinite(again)
        different += int(((again > 0.0) != (stored[some] > 0.0))[known].sum())
        total += int(known.sum())
    return Check(CHECKED * len(FORMULATIONS), total, different)


def study(files: Sequence[Path]) -> Ensembles:
    """The study of the stored ensembles; without heyoka no pad is judged afresh."""
    (file,) = files
    kept = read_kept(file)
    judging = version("heyoka") != NOT_INSTALLED
    numbered = {name: FORMULATIONS.index(f) for name, f in LAWS.items()}
    pads, origin, candidates = chosen(kept) if judging else ({}, "", 0)
    fronts = tuple(
        Front(
            _switches(FORMULATIONS[n]),
            int(kept.seen[n]),
            tuple(map(int, kept.together[n])),
            tuple(map(int, kept.most[n])),
            names(kept.lacks[n]),
            tuple(
                (float(a), float(b), float(c)) for a, b, c in kept.front_margins[kept.front_of == n]
            ),
        )
        for n in range(len(FORMULATIONS))
    )
    last = kept.levels[numbered["consistent"], :, -1]
    return Ensembles(
        ensembles=tuple(ensemble(kept, n, judging=judging) for n in range(len(FORMULATIONS))),
        stages=int(kept.stages),
        windows=WINDOWS,
        confidence=CONFIDENCE,
        total=Counts(len(CLAIMS), int(LISTED.sum()), int(INFORMATIVE.sum())),
        informative=names(INFORMATIVE),
        contrasts=contrasts(kept),
        ranges={name: ranges(kept, n) for name, n in numbered.items()},
        samples={
            name: tuple(
                tuple(round(float(u), 3) for u in point)
                for point in kept.sample[n].reshape(-1, len(DIMENSIONS))
            )
            for name, n in numbered.items()
        },
        names=FRONT,
        total_b2=int(B2.sum()),
        fronts=fronts,
        rival=side_by_side(dict(RIVAL)) if judging else {},
        rival_level=float(last.max()),
        chosen=pads,
        chosen_from=origin,
        taken=law_of(pads) if judging else "",
        candidates=candidates,
        check=check(kept) if judging else Check(0, 0, 0),
        left_out="" if judging else f"{WITHOUT_HEYOKA} nothing else judges pads by the hundred.",
    )
