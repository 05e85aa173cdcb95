"""Adversarial systems whose answers are known by construction, asked of the public functions.

`python -m benchmarks.refute [--count 40] [--seed 0] [--rows 60] [--family NAME]` prints for each
family how many answers are right, left open, wrong, and wrong although certified, and the CPU
seconds; the exit status is 1 if some certified answer is wrong. `--show` names each wrong one.

Every entry is a multiple of 2^-30 and small, and what hides a structure (permutations of the rows,
integer shears) is exact in doubles. So the answer belongs to the very numbers that are asked, and
no rounding of the generator excuses a wrong one.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

import squeal
from squeal.errors import ComputationError
from squeal.linear.system import TermSystem

Array = NDArray[np.float64]
Rng = np.random.Generator
UNIT = 2.0**-30  # of every entry
CLOSE = 1e-9  # of a threshold, beside its interval
RANGE = 2.0  # thresholds are sought from 0 to here


@dataclass(frozen=True)
class Event:
    """A crossing of the imaginary axis that is known: up in mu unless it is a window's end."""

    value: float
    kind: str
    direction: str = "up"


@dataclass(frozen=True)
class Case:
    """M = 1, C and K = K0 + mu K1 of n rows, each (n, n), with what is known of them.

    `factor` is the formula that multiplies K1. Where `events` is None the verdict at mu = 0 is
    asked, else the crossings of the range.
    """

    C: Array | None
    K0: Array
    K1: Array
    verdict: str = ""
    events: tuple[Event, ...] | None = None
    factor: str = "mu"

    def system(self) -> TermSystem:
        """The same as a system."""
        return squeal.System(
            np.eye(len(self.K0)),
            self.C,
            {"1": self.K0, self.factor: self.K1},
            parameters={"mu": 0.0},
        )


def dyadic(value: float) -> float:
    """The nearest multiple of the unit."""
    return round(value / UNIT) * UNIT


def rows_of(rng: Rng, most: int, least: int = 3) -> int:
    """A number of rows, small ones more often."""
    return int(np.exp(rng.uniform(math.log(least), math.log(most + 1))))


# What hides a structure without rounding


def shuffled(matrices: Sequence[Array], rng: Rng) -> list[Array]:
    """The same with rows and columns in another order."""
    order = rng.permutation(len(matrices[0]))
    return [X[np.ix_(order, order)] for X in matrices]


def sheared(matrices: Sequence[Array], rng: Rng) -> list[Array]:
    """Similar matrices: some rows are added to others, which leaves M = 1 and every root."""
    mixed = [X.copy() for X in matrices]
    n = len(mixed[0])
    for _ in range(min(n, 8)):
        i, j = rng.choice(n, 2, replace=False)
        sign = rng.choice([-1.0, 1.0])
        for X in mixed:
            X[i] += sign * X[j]
            X[:, j] -= sign * X[:, i]
    return mixed


def direct_sum(blocks: Sequence[Array]) -> Array:
    """The blocks along the diagonal."""
    whole = np.zeros((sum(map(len, blocks)),) * 2)
    at = 0
    for block in blocks:
        whole[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    return whole


# Verdicts at one value


def damping_of(rng: Rng) -> float:
    """A damping that every row has: none in a third of all cases."""
    return 0.0 if rng.random() < 1 / 3 else dyadic(10.0 ** rng.uniform(-6, -1))


def of_squares(C: float, K: Array, squares: Sequence[float]) -> Case:
    """A system with C times one, of which the eigenvalues of K are real and known."""
    verdict = "stable" if C else "marginal"
    if min(squares) < 0.0:
        verdict = "divergence"
    damping = C * np.eye(len(K)) if C else None
    return Case(damping, K, np.zeros_like(K), verdict)


def triangle(rng: Rng, most: int) -> Case:
    """One-way coupled rows, the eigenvalues of K close to each other, in any order."""
    n = rows_of(rng, most)
    squares = [dyadic(1.0 + rng.uniform(0.0, 10.0 ** rng.uniform(-4, 0))) for _ in range(n)]
    if rng.random() < 0.2:
        squares[0] = -squares[0]
    K = np.diag(squares) + np.triu(np.round(rng.uniform(-4, 4, (n, n)), 2), 1)
    return of_squares(damping_of(rng), shuffled([K], rng)[0], squares)


def bidiagonal(rng: Rng, most: int) -> Case:
    """One Jordan block of K, in any order of the rows."""
    n = rows_of(rng, most)
    K = dyadic(rng.uniform(0.5, 2.0)) * np.eye(n) + np.eye(n, k=1)
    return of_squares(damping_of(rng), shuffled([K], rng)[0], [float(K[0, 0])])


def rotated(rng: Rng, most: int) -> Case:
    """Jordan blocks of K of two or three rows, hidden by shears."""
    n = rows_of(rng, min(most, 12))
    size = int(rng.integers(2, 4))
    squares = [dyadic(rng.uniform(0.5, 2.0)) for _ in range(n)]
    squares = [squares[size * (k // size)] for k in range(n)]
    ones = [float(a == b) for a, b in itertools.pairwise(squares)]
    K = np.diag(squares) + np.diag(ones, 1)
    return of_squares(damping_of(rng), sheared([K], rng)[0], squares)


def cascade(rng: Rng, most: int) -> Case:
    """Friction contacts in a row, each of which acts on the next ones alone."""
    count = max(rows_of(rng, most) // 2, 2)
    C = dyadic(10.0 ** rng.uniform(-5, -1))
    grows, blocks = [], list[Array]()
    for _ in range(count):
        k, h = (dyadic(1.0 + rng.uniform(-0.01, 0.01)) for _ in range(2))
        # a pair of squares a +- i b decays if b^2 < C^2 a, here with a factor of 0.9 or 1.1
        limit = C * math.sqrt((k + h) / 2)
        share = 1.1 if rng.random() < 0.3 / count else rng.uniform(0.0, 0.9)
        m = dyadic(math.hypot((k - h) / 2, share * limit))
        b = Fraction(m) ** 2 - (Fraction(k) - Fraction(h)) ** 2 / 4
        grows.append(b > Fraction(C) ** 2 * (Fraction(k) + Fraction(h)) / 2)
        blocks.append(np.array([[k, m], [-m, h]]))
    K = direct_sum(blocks)
    for at in range(0, 2 * count - 2, 2):
        K[at : at + 2, at + 2 : at + 4] = np.round(rng.uniform(-2, 2, (2, 2)), 2)
    (K,) = shuffled([K], rng)
    verdict = "flutter" if any(grows) else "stable"
    return Case(C * np.eye(2 * count), K, np.zeros_like(K), verdict)


# Thresholds


def divergence_block(k: float, h: float, g: float) -> tuple[Array, Array, Event]:
    """Rows that lose their stiffness where g mu reaches sqrt(k h)."""
    event = Event(math.sqrt(k * h) / g, "divergence")
    return np.diag([k, h]), np.array([[0.0, g], [g, 0.0]]), event


def flutter_block(k: float, h: float, g: float, C: float) -> tuple[Array, Array, Event]:
    """Rows that friction makes flutter: undamped where 2 g mu reaches |k - h|; damped by C, of
    k = h, where g mu reaches C sqrt(k)."""
    at = C * math.sqrt(k) / g if C else abs(k - h) / (2 * g)
    return np.diag([k, k if C else h]), np.array([[0.0, g], [-g, 0.0]]), Event(at, "flutter")


def twins(rng: Rng, most: int, apart: float, kind: str) -> Case:
    """Blocks of which some differ by a relative `apart`, and some not at all."""
    count = max(rows_of(rng, most) // 2, 2)
    C = dyadic(10.0 ** rng.uniform(-2, -0.3)) if rng.random() < 0.5 else 0.0
    families = max(count // 3, 1)
    each = []
    for _ in range(families):
        k, h = (rng.uniform(0.8, 1.6) for _ in range(2))
        each.append((k, h, rng.uniform(0.3, 1.0)))
    stiffness, friction, events = list[Array](), list[Array](), list[Event]()
    for index in range(count):
        k, h, g = each[index % families]
        k = dyadic(k * (1.0 + apart * (index // families)))
        h, g = dyadic(h), dyadic(g)
        if kind == "divergence":
            K0, K1, event = divergence_block(k, h, g)
        else:
            K0, K1, event = flutter_block(k, h, g, C)
        stiffness.append(K0)
        friction.append(K1)
        if event.value <= RANGE:
            events.append(event)
    hide = sheared if rng.random() < 0.5 else shuffled
    damping = C * np.eye(2 * count) if C else None
    K0, K1 = hide([direct_sum(stiffness), direct_sum(friction)], rng)
    return Case(damping, K0, K1, events=tuple(sorted(events, key=lambda e: e.value)))


def near_divergences(rng: Rng, most: int) -> Case:
    """Divergences of nearly equal pads."""
    return twins(rng, most, 10.0 ** rng.uniform(-8, -3), "divergence")


def near_flutters(rng: Rng, most: int) -> Case:
    """Flutter of nearly equal pads."""
    return twins(rng, most, 10.0 ** rng.uniform(-8, -3), "flutter")


def repeated(rng: Rng, most: int) -> Case:
    """Equal pads, which lose stability together."""
    return twins(rng, most, 0.0, str(rng.choice(["divergence", "flutter"])))


def windows(rng: Rng, most: int) -> Case:
    """Two narrow windows of flutter beside each other, of a factor that bends within a step."""
    centre, inner = rng.uniform(0.2, 1.8), 10.0 ** rng.uniform(-8, -5)
    outer, blunt = inner * rng.uniform(2.0, 6.0), 10.0 ** rng.uniform(-5, -3)
    square = f"(mu - {centre!r})**2"
    factor = f"({square} - {inner!r}) * ({square} - {outer!r}) / ({square}**2 + {blunt!r})"
    n = rows_of(rng, min(most, 12))
    K0, K1 = np.diag(2.0 + np.arange(n) * dyadic(rng.uniform(0.7, 1.4))), np.zeros((n, n))
    K0[1, 1], K0[1, 0], K1[0, 1] = 2.0, 1.0, 1.0
    ends = [-math.sqrt(outer), -math.sqrt(inner), math.sqrt(inner), math.sqrt(outer)]
    ways = ["up", "down", "up", "down"]
    events = [Event(centre + x, "flutter", way) for x, way in zip(ends, ways, strict=True)]
    K0, K1 = shuffled([K0, K1], rng)
    return Case(None, K0, K1, events=tuple(events), factor=factor)


def driven(rng: Rng, most: int) -> Case:
    """Pads each of which acts on the next ones alone, with thresholds of their own."""
    case = twins(rng, most, 10.0 ** rng.uniform(-3, -1), str(rng.choice(["divergence", "flutter"])))
    K0 = case.K0.copy()
    pairs = np.argwhere(np.triu(np.ones_like(K0), 1))
    linked = np.abs(case.K0) + np.abs(case.K1) + np.eye(len(K0)) > 0
    while (wider := linked.astype(float) @ linked > 0).sum() > linked.sum():
        linked = wider
    group = linked.argmax(axis=1)  # of each row the first one that it is coupled with
    for i, j in pairs:
        if group[i] < group[j] and rng.random() < 0.5:
            K0[i, j] = np.round(rng.uniform(-2, 2), 2)
    K0, K1 = shuffled([K0, case.K1], rng)
    return Case(case.C, K0, K1, events=case.events)


FAMILIES: dict[str, Callable[[Rng, int], Case]] = {
    "shuffled triangles": triangle,
    "bidiagonals": bidiagonal,
    "rotated Jordan blocks": rotated,
    "cascades": cascade,
    "near-twin divergences": near_divergences,
    "near-twin flutter": near_flutters,
    "repeated pads": repeated,
    "windows": windows,
    "cascades over mu": driven,
}


# Judging an answer


def matches(case: Case, crossings: Sequence[squeal.Crossing]) -> bool:
    """True if the crossings are those that are known, each one once."""
    left = list(crossings)
    for event in case.events or ():
        near = [
            c
            for c in left
            if (c.kind, c.direction) == (event.kind, event.direction)
            and c.interval[0] - CLOSE * event.value <= event.value
            and event.value <= c.interval[1] + CLOSE * event.value
            and abs(c.mu - event.value) <= c.interval[1] - c.interval[0] + CLOSE * event.value
        ]
        if not near:
            return False
        left.remove(min(near, key=lambda c: abs(c.mu - event.value)))
    return not left


def judged(case: Case) -> tuple[str, str]:
    """right, open, wrong or certified (and wrong), and what was said."""
    try:
        if case.events is None:
            answer = squeal.eigenvalues(case.system())
            said = f"{answer.verdict}, {case.verdict} is true"
            known, right = answer.verdict is not None, answer.verdict == case.verdict
            certified = answer.certified
        else:
            found = squeal.thresholds(case.system(), RANGE)
            texts = [f"{c.kind} {c.direction} {c.mu!r}" for c in found.crossings]
            truth = [f"{e.kind} {e.direction} {e.value!r}" for e in case.events]
            said = f"{texts}, true are {truth}"
            known, right = True, matches(case, found.crossings)
            certified = bool(found.certified)
    except ComputationError as error:
        return "open", str(error)
    if not known:
        return "open", said
    return "right" if right else "certified" if certified else "wrong", said


def main() -> int:
    """Ask all families and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=40, help="systems of each family")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rows", type=int, default=60, help="of the largest system")
    parser.add_argument("--family", choices=FAMILIES)
    parser.add_argument("--show", action="store_true", help="name each wrong answer")
    given = parser.parse_args()
    print(f"{'family':24}{'right':>8}{'open':>8}{'wrong':>8}{'wrong, certified':>18}{'s':>8}")
    total = Counter[str]()
    for number, (name, make) in enumerate(FAMILIES.items()):
        if given.family not in (None, name):
            continue
        counts, start = Counter[str](), time.process_time()
        for k in range(given.count):
            case = make(np.random.default_rng([given.seed, number, k]), given.rows)
            outcome, said = judged(case)
            counts[outcome] += 1
            if given.show and outcome in ("wrong", "certified"):
                print(f"  {name} {k}, {len(case.K0)} rows, {outcome}: {said}", flush=True)
        total += counts
        numbers = [counts["right"], counts["open"], counts["wrong"] + counts["certified"]]
        seconds = time.process_time() - start
        row = "".join(f"{x:8}" for x in numbers)
        print(f"{name:24}{row}{counts['certified']:18}{seconds:8.1f}", flush=True)
    return 1 if total["certified"] else 0


if __name__ == "__main__":
    sys.exit(main())
