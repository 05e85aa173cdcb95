"""Comparing searches and formulations by what is stored of them: distances, exchanges, counts."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from squeal.article.ensembles.distance import COUNTED, INDEX, PAIR, price
from squeal.article.ensembles.gather import CONCLUSIONS, Kept, keep_all
from squeal.article.ensembles.space import DIMENSIONS, FORMULATIONS, decode
from squeal.article.results.ensembles import Keeping
from squeal.model.contact import FORMULATION_CHOICES

EXCHANGES = 20_000  # of searches between two choices


def distances(margins: np.ndarray, loads: np.ndarray, left_out: Sequence[str] = ()) -> np.ndarray:
    """Distances (n,) of pads from the statements by their margins (n, claims).

    loads (n,): F_n / (k1 w); left_out: statements that do not count.
    """
    prices = np.zeros(margins.shape)
    for claim in COUNTED:
        if claim.id not in left_out:
            at = INDEX[claim.id]
            prices[:, at] = [
                price(claim, float(m), float(f)) for m, f in zip(margins[:, at], loads, strict=True)
            ]
    return np.asarray(prices.sum(axis=1) - prices[:, [INDEX[n] for n in PAIR]].max(axis=1))


def sampled_distances(kept: Kept, number: int, left_out: Sequence[str] = ()) -> np.ndarray:
    """Distances (searches, pads) of the pads stored of the last populations of a formulation."""
    margins = kept.sampled[number].astype(float)
    loads = decode(kept.sample[number].reshape(-1, len(DIMENSIONS)).astype(float))["F_n"]
    flat = distances(margins.reshape(len(loads), -1), loads, left_out)
    return flat.reshape(margins.shape[:2])


def exchanged(values: np.ndarray, name: str) -> tuple[dict[str, float], float, int]:
    """Means of values (formulations, searches) by the choices of a switch, their probability.

    The probability of a difference of the means as large, if the searches of two formulations that
    differ in this switch alone could be exchanged; and in how many such pairs the second choice has
    the smaller mean.
    """
    choices = FORMULATION_CHOICES[name]
    one, two = (values[[getattr(f, name) == c for f in FORMULATIONS]] for c in choices)
    random = np.random.default_rng(3)
    both = np.concatenate([one, two], axis=1)
    mixed = random.permuted(np.broadcast_to(both, (EXCHANGES, *both.shape)), axis=2)
    half = one.shape[1]
    differences = mixed[:, :, half:].mean(axis=(1, 2)) - mixed[:, :, :half].mean(axis=(1, 2))
    own = float(two.mean() - one.mean())
    beyond = int((np.abs(differences) >= abs(own) - 1e-12).sum())
    means = {c: float(g.mean()) for c, g in zip(choices, (one, two), strict=True)}
    return means, (beyond + 1) / (EXCHANGES + 1), int((two.mean(1) < one.mean(1)).sum())


class ByChoice(NamedTuple):
    """Random pads by the choice of a switch: random: drawn; ran: those that run; keep: those that
    keep each conclusion, by name; p: that shares as far apart of those that run keep it by chance
    (Fisher)."""

    random: dict[str, int]
    ran: dict[str, int]
    keep: dict[str, dict[str, int]]
    p: dict[str, float]


def by_choice(kept: Kept, name: str) -> ByChoice:
    """What random pads keep with either choice of a switch."""
    from scipy.stats import fisher_exact  # half a second, which forks would all pay

    one, other = FORMULATION_CHOICES[name]
    first = np.array([getattr(f, name) == one for f in FORMULATIONS])

    def split(counts: np.ndarray) -> dict[str, int]:
        return {one: int(counts[first].sum()), other: int(counts[~first].sum())}

    random, ran = (split(column) for column in kept.random.sum(axis=1).T)
    keep = {c: split(kept.random_together[:, at]) for at, c in enumerate(CONCLUSIONS)}
    p = {}
    for c, n in keep.items():
        table = [[n[k], ran[k] - n[k]] for k in (one, other)]
        p[c] = float(fisher_exact(table).pvalue)
    return ByChoice(random, ran, keep, p)


def corrected(p: Sequence[float]) -> list[float]:
    """Probabilities after Holm's correction for their number."""
    corrected, most = [0.0] * len(p), 0.0
    for rank, i in enumerate(sorted(range(len(p)), key=lambda i: p[i])):
        most = max(most, min(1.0, p[i] * (len(p) - rank)))
        corrected[i] = most
    return corrected


def together(kept: Kept, numbers: Sequence[int], statements: Sequence[str]) -> np.ndarray:
    """Which stored pads (formulations, searches, pads) keep some statements at once."""
    return keep_all(kept.sampled[list(numbers)], statements)


def keeping(kept: Kept, numbers: Sequence[int], statements: Sequence[str]) -> Keeping:
    """How many pads of some formulations keep statements at once; equal pads count once."""
    held = together(kept, numbers, statements)
    pads = keep = searches = some = 0
    for row, number in enumerate(numbers):
        for points, holds in zip(kept.sample[number], held[row], strict=True):
            _, first = np.unique(points, axis=0, return_index=True)
            pads, keep = pads + len(first), keep + int(holds[first].sum())
            searches, some = searches + 1, some + bool(holds.any())
    return Keeping(pads, keep, searches, some)
