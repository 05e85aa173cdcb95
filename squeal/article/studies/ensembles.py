"""What the ensembles of pads say, from their stored form, a part of it judged afresh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy import stats

from squeal.article.claims import CLAIMS
from squeal.article.ensembles.distance import Judgement, judge
from squeal.article.ensembles.gather import B2, FRONT, INFORMATIVE, LISTED, Kept, counts, read_kept
from squeal.article.ensembles.space import (
    DIMENSIONS,
    FORMULATIONS,
    SPEED,
    decode,
    standing,
)
from squeal.article.identify.space import STOP
from squeal.article.results.ensembles import (
    Check,
    Contrast,
    Ensemble,
    Ensembles,
    Front,
    Pad,
    Range,
    Seed,
)
from squeal.article.results.ensembles import Kept as Counts
from squeal.article.results.robustness import Share
from squeal.article.results.verify import Switches
from squeal.article.studies.robustness import CONFIDENCE, share
from squeal.files.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version
from squeal.model.contact import CONSISTENT, FORMULATION_CHOICES, Formulation

WINDOWS = (1, 3, 10, 40)
CHECKED = 3  # stored pads of each formulation that are judged afresh
TAIL = 0.05  # on either side of the range of a number
LAWS = {"consistent": CONSISTENT, "printed force": Formulation("mean", "centre", "+")}
"""The two laws that a pad is judged under, side by side: the force of Eq. (13) with delta from the
mass centre and the sign that Eq. (10) needs, and the one that has a potential."""
RIVAL = {
    "h": 0.592499,
    "inertia": 1.08695,
    "k2": 0.77824,
    "k3": 0.269525,
    "k4": 0.780361,
    "k_c": 0.597405,
    "L": 1.0,
    "mu": 0.320313,
    "F_n": 2.00002e-4,
    "preload": 2.14671,
    "lift": 0.932908,
    "first_y": 0.0209567,
    "first_x": 0.0,
    "tilt": 0.0,
    "x0": 0.0,
    "start": 0.0,
}
"""A pad of the consistent law that was found apart from these searches."""
PLAUSIBLE = {"mu": (0.2, 0.5), "L": (0.5, 4.0), "F_n": (1e-4, 3e-3), "h": (0.1, 0.7)}
"""What an engineer would take: linings, supports of 20 to 160 mm, 2 kN on a stiff caliper, and a
pad longer than high."""
LONGER = 3  # candidates that are judged over longer times
SCATTER, SCATTERED = 0.01, 32  # relative, and how many pads


def _kept(margins: np.ndarray) -> Counts:
    return Counts(*(int(n[0]) for n in counts(margins[None])))


def _switches(f: Formulation) -> Switches:
    return Switches(**{name: getattr(f, name) for name in FORMULATION_CHOICES})


def _names(chosen: np.ndarray) -> tuple[str, ...]:
    return tuple(c.id for c, there in zip(CLAIMS, chosen, strict=True) if there)


def _failing(margins: np.ndarray) -> tuple[str, ...]:
    return _names(INFORMATIVE & ~(margins > 0.0))


def _shares(holds: np.ndarray, pads: int) -> dict[str, Share]:
    return {c.id: share(int(n), pads) for c, n in zip(CLAIMS, holds, strict=True)}


def _median(histogram: np.ndarray) -> int:
    return int(np.searchsorted(histogram.cumsum(), histogram.sum() / 2.0))


def over_windows(
    numbers: dict[str, np.ndarray], formulation: Formulation
) -> tuple[list[dict[str, Counts | None]], dict[int, Judgement]]:
    """What each pad keeps over each of the windows, and the judgements."""
    found = {w: judge(numbers, formulation, stop=w * STOP) for w in WINDOWS}
    rows: list[dict[str, Counts | None]] = [
        {str(w): _kept(j.margins[i]) if j.whole[i] else None for w, j in found.items()}
        for i in range(len(numbers["h"]))
    ]
    return rows, found


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
            _failing(kept.margins[number, s]),
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


def _least_speed(margins: np.ndarray) -> float:
    """Speed of the surface in m/s at which sliding holds, on the scale of the pad's load."""
    at = next(i for i, c in enumerate(CLAIMS) if c.id == "B12-sliding")
    return float(SPEED * (1.0 - margins[at]))


def _one(numbers: dict[str, float]) -> dict[str, np.ndarray]:
    return {name: np.array([value]) for name, value in numbers.items()}


def _around(numbers: dict[str, float]) -> dict[str, np.ndarray]:
    """Pads whose numbers are all off a little; the kind of the start stays."""
    random = np.random.default_rng(1)
    return {
        d.name: numbers[d.name]
        * (1.0 + SCATTER * (d.name != "start") * random.standard_normal(SCATTERED))
        for d in DIMENSIONS
    }


def side_by_side(numbers: dict[str, float]) -> dict[str, Pad]:
    """One pad under both laws."""
    found = {}
    for name, f in LAWS.items():
        rows, judged = over_windows(_one(numbers), f)
        first, near = judged[1], judge(_around(numbers), f)
        wanted = counts(first.margins)[2, 0]
        found[name] = Pad(
            numbers=numbers,
            horizons=rows[0],
            failing=_failing(first.margins[0]),
            distance=float(first.partial[0, -1]),
            least_speed=_least_speed(first.margins[0]),
            steady=float(np.mean(near.whole & (counts(near.margins)[2] >= wanted))),
        )
    return found


def _plausible(numbers: dict[str, float]) -> bool:
    return all(low <= numbers[n] <= high for n, (low, high) in PLAUSIBLE.items())


def chosen(kept: Kept) -> tuple[dict[str, Pad], str, int]:
    """The pad that an engineer would take, where it is from, and of how many candidates.

    Of plausible ones, and of these the few that keep most over one window, that which keeps the
    most informative statements over ten windows under the worse of the two laws, of equals the
    steadiest, then that with the least speed of the surface.
    """
    candidates = [(dict(RIVAL), "the search elsewhere")]
    for name, f in LAWS.items():
        for seed, point in enumerate(kept.points[FORMULATIONS.index(f)].astype(float), 1):
            numbers = {n: float(v[0]) for n, v in decode(point[None]).items()}
            candidates.append((numbers, f"search {seed} with the {name} law"))
    candidates = [(numbers, origin) for numbers, origin in candidates if _plausible(numbers)]
    together = {n: np.array([numbers[n] for numbers, _ in candidates]) for n in RIVAL}
    short = [counts(judge(together, f).margins)[2] for f in LAWS.values()]
    rows = []
    for at in np.argsort(-np.min(short, axis=0), kind="stable")[:LONGER].tolist():
        numbers, origin = candidates[at]
        pads = side_by_side(numbers)
        long = [pad.horizons["10"] for pad in pads.values()]
        worst = min(0 if k is None else k.informative for k in long)
        steady = min(pad.steady for pad in pads.values())
        speed = max(pad.least_speed for pad in pads.values())
        rows.append(((worst, steady, -speed), pads, origin))
    _, pads, origin = max(rows, key=lambda row: row[0])
    return pads, origin, len(candidates)


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
            _names(kept.lacks[n]),
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
        informative=_names(INFORMATIVE),
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
        candidates=candidates,
        check=check(kept) if judging else Check(0, 0, 0),
        left_out="" if judging else f"{WITHOUT_HEYOKA} nothing else judges pads by the hundred.",
    )
