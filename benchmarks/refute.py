"""Systems whose answers are known by construction, asked of the public functions and the referee.

`python -m benchmarks.refute [--count 1800] [--start 0] [--seed 0] [--rows 30] [--family NAME]`
prints for each family how many answers are proved, certified, right without either, open, wrong,
and wrong although certified or proved. Each system has a seed of its own, so that `--start 40000`
goes on where 40,000 systems were asked. Of wrong answers (a root dropped or doubled, another
verdict, a threshold dropped or added) it prints how many the referee refutes. The exit status is 1
for any contradiction: a wrong answer that is certified or proved, a right one that is refuted,
exact roots beside the enclosure or beside what is known. Needs python-flint.

Entries are short dyadic numbers, and what hides a structure (permutations, integer row operations)
is exact in doubles. So the answer belongs to the very numbers that are asked, and no rounding of
the generator excuses a wrong one.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

import squeal
from squeal.errors import ComputationError
from squeal.linear.events import Crossing
from squeal.linear.system import TermSystem
from squeal.proof import AS_GIVEN, HALF_ULP
from squeal.proof.balls import Quadratic
from squeal.proof.enclosure import components
from squeal.proof.exact import exact_roots
from squeal.proof.pieces import Piece, growing_counts
from squeal.proof.ranges import RangeProof
from squeal.proof.referee import Finding, enclosed, judge_finding, prove_roots
from squeal.proof.terms import Term, Terms
from tests.proof.families import FAMILIES as OF_VALUES
from tests.proof.families import Known, sample

Array = NDArray[np.float64]
Rng = np.random.Generator
UNIT = 2.0**-30  # of every entry
CLOSE = 1e-9  # of a threshold, beside its interval
RANGE = 2.0  # thresholds are sought from 0 to here
VERDICTS = ("stable", "marginal", "flutter", "divergence")
OUTCOMES = ("proved", "certified", "right", "open", "wrong", "contradiction")
SMALL = 8  # rows up to which wrong thresholds are asked of the referee


@dataclass(frozen=True)
class Event:
    """A crossing of the imaginary axis that is known."""

    value: float
    kind: str
    direction: str = "up"


@dataclass(frozen=True)
class Case:
    """M = 1, C and K = K0 + f(mu) K1 of n rows, each (n, n), with all crossings of the range."""

    C: Array | None
    K0: Array
    K1: Array
    events: tuple[Event, ...]
    factor: str = "mu"
    function: Callable[[Any], Any] = lambda mu: mu

    def system(self) -> TermSystem:
        """The same as a system."""
        return squeal.System(
            np.eye(len(self.K0)),
            self.C,
            {"1": self.K0, self.factor: self.K1},
            parameters={"mu": 0.0},
        )

    def terms(self) -> Terms:
        """The same for the referee."""
        damping = [] if self.C is None else [Term(self.C)]
        stiffness = [Term(self.K0), Term(self.K1, self.function)]
        return Terms([Term(np.eye(len(self.K0)))], damping, stiffness)


@dataclass
class Outcome:
    """One of `OUTCOMES`, what was said, the contradictions, and how wrong answers were judged."""

    name: str
    said: str = ""
    faults: list[str] = field(default_factory=list)
    mutants: Counter[str] = field(default_factory=Counter)


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


# Thresholds, undamped and damped


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
        k = rng.uniform(0.8, 1.6)
        h = rng.uniform(0.8, 1.6)
        each.append((k, h, rng.uniform(0.3, 1.0)))
    stiffness = list[Array]()
    friction = list[Array]()
    events = list[Event]()
    for index in range(count):
        k, h, g = each[index % families]
        k = dyadic(k * (1.0 + apart * (index // families)))
        h = dyadic(h)
        g = dyadic(g)
        if kind == "divergence":
            K0, K1, event = divergence_block(k, h, g)
        else:
            K0, K1, event = flutter_block(k, h, g, C)
        stiffness.append(K0)
        friction.append(K1)
        if event.value <= RANGE:
            events.append(event)
    if not C and rng.random() < 0.2:  # a free body
        stiffness.append(np.zeros((1, 1)))
        friction.append(np.zeros((1, 1)))
    hide = sheared if rng.random() < 0.5 else shuffled
    damping = C * np.eye(2 * count) if C else None
    K0, K1 = hide([direct_sum(stiffness), direct_sum(friction)], rng)
    return Case(damping, K0, K1, tuple(sorted(events, key=lambda e: e.value)))


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
    centre = rng.uniform(0.2, 1.8)
    inner = 10.0 ** rng.uniform(-8, -5)
    outer = inner * rng.uniform(2.0, 6.0)
    blunt = 10.0 ** rng.uniform(-5, -3)
    square = f"(mu - {centre!r})**2"
    factor = f"({square} - {inner!r}) * ({square} - {outer!r}) / ({square}**2 + {blunt!r})"

    def function(mu: Any) -> Any:
        x = (mu - centre) ** 2
        return (x - inner) * (x - outer) / (x**2 + blunt)

    n = rows_of(rng, min(most, 12))
    K0 = np.diag(2.0 + np.arange(n) * dyadic(rng.uniform(0.7, 1.4)))
    K1 = np.zeros((n, n))
    K0[1, 1] = 2.0
    K0[1, 0] = 1.0
    K1[0, 1] = 1.0
    ends = [-math.sqrt(outer), -math.sqrt(inner), math.sqrt(inner), math.sqrt(outer)]
    ways = ["up", "down", "up", "down"]
    events = [Event(centre + x, "flutter", way) for x, way in zip(ends, ways, strict=True)]
    K0, K1 = shuffled([K0, K1], rng)
    return Case(None, K0, K1, tuple(events), factor, function)


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
    return Case(case.C, K0, K1, case.events)


def shafts(rng: Rng, most: int) -> Case:
    """Gyroscopic shafts s^2 + k -+ i g s, whose stiffness falls through zero, where nothing grows
    yet, to -g^2/4, where both pairs leave the axis."""
    count = max(rows_of(rng, most) // 2, 2)
    spin = list[Array]()
    stiffness = list[Array]()
    slope = list[Array]()
    events = list[Event]()
    for _ in range(count):
        g = dyadic(rng.uniform(0.2, 2))
        k = dyadic(rng.uniform(0.3, 2))
        fall = dyadic(rng.uniform(0.5, 3))
        spin.append(np.array([[0.0, g], [-g, 0.0]]))
        stiffness.append(k * np.eye(2))
        slope.append(-fall * np.eye(2))
        at = (k + g * g / 4) / fall
        if at <= RANGE:
            events.append(Event(at, "flutter"))
    C, K0, K1 = shuffled([direct_sum(spin), direct_sum(stiffness), direct_sum(slope)], rng)
    return Case(C, K0, K1, tuple(sorted(events, key=lambda e: e.value)))


def determinant(rows: list[list[Any]]) -> Any:
    """By expansion along the first row, in any ring."""
    if len(rows) == 1:
        return rows[0][0]
    total = rows[0][0] * 0
    for j, entry in enumerate(rows[0]):
        rest = [row[:j] + row[j + 1 :] for row in rows[1:]]
        total = total + (-1) ** j * entry * determinant(rest)
    return total


def hurwitz(coefficients: list[Any], order: int) -> Any:
    """Hurwitz's determinant of an order, coefficients from the highest power on."""
    zero = coefficients[0] * 0
    padded = [zero] * order + coefficients + [zero] * order
    rows = [[padded[order + 2 * j - i + 1] for j in range(order)] for i in range(order)]
    return determinant(rows)


def characteristic(C: Array, K0: Array, K1: Array) -> list[Any]:
    """Coefficients of det(s^2 + s C + K0 + mu K1) of three rows, from s^6 on, polynomials in mu."""

    def rational(x: float) -> Any:
        return flint.fmpq(*float(x).as_integer_ratio())

    values = []
    for s in range(7):
        rows = []
        for i in range(3):
            line = []
            for j in range(3):
                constant = rational(K0[i, j]) + s * rational(C[i, j]) + s * s * int(i == j)
                line.append(flint.fmpq_poly([constant, rational(K1[i, j])]))
            rows.append(line)
        values.append(determinant(rows))
    interpolation = flint.fmpq_mat([[s**k for k in range(7)] for s in range(7)]).inv()
    coefficients = []
    for power in range(6, -1, -1):
        coefficient = flint.fmpq_poly([0])
        for s in range(7):
            coefficient += interpolation[power, s] * values[s]
        coefficients.append(coefficient)
    return coefficients


def growing_at(coefficients: list[Any], mu: Any, damped: bool) -> int:
    """How many roots grow, by signs of exact numbers. Raises ValueError at a boundary."""
    at = [c(mu) for c in coefficients]
    if damped:
        minors = [hurwitz(at, k) for k in range(1, 7)]
        if 0 in minors:
            raise ValueError("a determinant is zero")
        column = [at[0], minors[0], *(b / a for a, b in itertools.pairwise(minors))]
        return sum(a * b < 0 for a, b in itertools.pairwise(column))
    cubic = at[::2]  # of s^2
    if cubic[3] == 0:
        raise ValueError("a root is zero")
    if discriminant(cubic) < 0:  # one square is real, the product of all is -cubic[3]
        return 2 + int(cubic[3] < 0)
    # all are real: Descartes' rule is exact
    signs = [c for c in cubic if c != 0]
    return sum(a * b < 0 for a, b in itertools.pairwise(signs))


def discriminant(cubic: list[Any]) -> Any:
    """Of a monic cubic."""
    _, b, c, d = cubic
    return b * b * c * c - 4 * c**3 - 4 * b**3 * d - 27 * d * d + 18 * b * c * d


def three_rows(rng: Rng, most: int) -> Case:
    """Pads of three rows, all coupled, whose crossings are roots of exact polynomials in mu."""
    while True:
        damped = bool(rng.integers(2))
        A = np.round(rng.uniform(-1, 1, (3, 3)) * 64) / 64
        K0 = (A + A.T) / 2 + np.diag(np.round(rng.uniform(2, 4, 3) * 64) / 64)
        K1 = np.round(rng.uniform(-1, 1, (3, 3)) * 64) / 64
        C = np.zeros((3, 3))
        if damped:
            C = np.diag(np.round(rng.uniform(1, 16, 3)) / 64)
        coefficients = characteristic(C, K0, K1)
        boundary = hurwitz(coefficients, 5) if damped else discriminant(coefficients[::2])
        places = []
        for root, multiplicity in (boundary * coefficients[6]).numer().complex_roots():
            if root.imag == 0 and 0 <= root.real.mid() <= RANGE:
                places += [float(root.real.mid())] * multiplicity
        edges = [0.0, *sorted(places), RANGE]
        if min(b - a for a, b in itertools.pairwise(edges)) < 1e-5:
            continue  # crossings that meet are no question here
        middles = [
            flint.fmpq(*((a + b) / 2).as_integer_ratio()) for a, b in itertools.pairwise(edges)
        ]
        try:
            counts = [growing_at(coefficients, mu, damped) for mu in middles]
        except ValueError:
            continue
        events = []
        for place, (before, after) in zip(edges[1:], itertools.pairwise(counts), strict=False):
            if before != after:
                kind = "flutter" if abs(after - before) == 2 else "divergence"
                events.append(Event(place, kind, "up" if after > before else "down"))
        return Case(C if damped else None, K0, K1, tuple(events))


OVER_MU: dict[str, Callable[[Rng, int], Case]] = {
    "near-twin divergences": near_divergences,
    "near-twin flutter": near_flutters,
    "repeated pads": repeated,
    "windows": windows,
    "cascades over mu": driven,
    "shafts over mu": shafts,
    "pads of three rows": three_rows,
}
FAMILIES = (*OF_VALUES, *OVER_MU)


# Judging an answer at a value


def exact_pieces(given: Quadratic) -> list[Piece] | None:
    """Exact roots of all components; None where one has too many rows."""
    pieces = []
    for rows in components(given.parts):
        part = exact_roots(given.block(rows))
        if not isinstance(part, list):
            return None
        pieces += part
    return pieces


def contradictions(system: Known, given: Quadratic) -> list[str]:
    """How the enclosure and the exact roots contradict each other or what is known."""
    found = []
    finding = enclosed(given)
    least, most = growing_counts(finding.pieces)
    if finding.failure is None and not least <= system.growing <= most:
        found.append("enclosed count")
    pieces = exact_pieces(given)
    if pieces is None:
        return found
    if growing_counts(pieces) != (system.growing, system.growing):
        found.append("exact count")
    centres = np.array([piece.centres[0] for piece in pieces])
    for data in (AS_GIVEN, HALF_ULP):
        ball = Quadratic.of(given.M.mid, given.C.mid, given.K.mid, data)
        if judge_finding(enclosed(ball), centres, system.verdict).status == "refuted":
            found.append(f"exact roots, {data}")
    of_exact = judge_finding(Finding([pieces], AS_GIVEN), system.roots, system.verdict)
    if of_exact.status == "refuted":
        found.append("known roots")
    return found


def wrong_lists(system: Known, rng: Rng) -> dict[str, tuple[NDArray, str | None]]:
    """Wrong answers, roots and a verdict: a root dropped or doubled, another verdict."""
    roots = system.roots
    k = int(rng.integers(len(roots)))
    other = [verdict for verdict in VERDICTS if verdict != system.verdict]
    return {
        "root dropped": (np.delete(roots, k), system.verdict),
        "root doubled": (np.append(roots, roots[k]), None),
        "other verdict": (roots, str(rng.choice(other))),
    }


def has_roots(values: NDArray, errors: Array, roots: NDArray) -> bool:
    """True if each known root lies within the error of a listed value of its own."""
    if len(values) != len(roots):
        return False
    excess = np.abs(values[:, None] - roots) - errors[:, None] - 1e-13 * np.abs(roots) - 1e-13
    cost = np.maximum(np.nan_to_num(excess), 0.0)
    return float(cost[linear_sum_assignment(cost)].sum()) == 0.0


def at_a_value(system: Known, rng: Rng) -> Outcome:
    """What is answered of a list and its verdict, by the public function and by the referee."""
    given = Quadratic.of(system.M, system.C, system.K)
    faults = contradictions(system, given)
    right = prove_roots(given, system.roots, system.verdict)
    if right.status == "refuted":
        faults.append(f"right answer refuted: {right.reason}")
    mutants = Counter[str]()
    for name, (roots, verdict) in wrong_lists(system, rng).items():
        status = prove_roots(given, roots, verdict).status
        mutants[f"{name} {status}"] += 1
        if status == "proved":
            faults.append(f"wrong answer proved: {name}")
    try:
        answer = squeal.eigenvalues(squeal.System(system.M, system.C, system.K))
    except ComputationError as error:
        return Outcome("open", str(error), faults, mutants)
    values = np.array([root.value for root in answer.eigenvalues], complex)
    errors = np.array([math.inf if r.error is None else r.error for r in answer.eigenvalues], float)
    judged = prove_roots(given, values, answer.verdict).status
    listed = has_roots(values, errors, system.roots)
    said = f"{answer.verdict}, {system.verdict} is true; roots {'' if listed else 'not '}listed"
    if not listed or answer.verdict not in (None, system.verdict):
        claimed = answer.certified or judged == "proved"
        return Outcome("contradiction" if claimed else "wrong", said, faults, mutants)
    if judged == "refuted":
        faults.append("right printed answer refuted")
    if answer.verdict is None:
        return Outcome("open", said, faults, mutants)
    if judged == "proved":
        return Outcome("proved", said, faults, mutants)
    return Outcome("certified" if answer.certified else "right", said, faults, mutants)


# Judging thresholds


def stands_for(crossing: Crossing, event: Event) -> bool:
    """Whether a crossing is of the kind of an event, and it and its interval are where that is."""
    low, high = crossing.interval
    rounding = CLOSE * event.value
    return (
        (crossing.kind, crossing.direction) == (event.kind, event.direction)
        and low - rounding <= event.value <= high + rounding
        and abs(crossing.mu - event.value) <= high - low + rounding
    )


def matches(case: Case, crossings: Sequence[Crossing]) -> bool:
    """True if the crossings are those that are known, each one once."""
    left = list(crossings)
    for event in case.events:
        near = [crossing for crossing in left if stands_for(crossing, event)]
        if not near:
            return False
        left.remove(min(near, key=lambda c: abs(c.mu - event.value)))
    return not left


def wrong_thresholds(case: Case, rng: Rng) -> Counter[str]:
    """How the referee judges lists without one threshold, or with one too many."""
    values = np.unique([event.value for event in case.events])
    intervals = [(x - 1e-9, x + 1e-9) for x in values.tolist()]
    lists = {}
    edges = np.concatenate([[0.0], values, [RANGE]])
    room = np.minimum(np.diff(edges)[:-1], np.diff(edges)[1:])
    # between near twins nothing grows faster than the rate that the statement leaves out
    alone = np.flatnonzero(room > 1e-3)
    if alone.size:
        k = int(rng.choice(alone))
        lists["threshold dropped"] = intervals[:k] + intervals[k + 1 :]
    widest = int(np.argmax(np.diff(edges)))
    middle = float(edges[widest] + edges[widest + 1]) / 2.0
    lists["threshold added"] = sorted([*intervals, (middle - 1e-9, middle + 1e-9)])
    found = Counter[str]()
    range_proof = RangeProof(case.terms(), 0.0, RANGE, most_intervals=4000)
    for name, wrong in lists.items():
        found[f"{name} {range_proof.prove(wrong, 1e-7).status}"] += 1
    return found


def over_mu(case: Case, rng: Rng, wrong_too: bool) -> Outcome:
    """What is answered of the thresholds of a range."""
    mutants = wrong_thresholds(case, rng) if wrong_too else Counter[str]()
    faults = [f"wrong answer proved: {name}" for name in mutants if name.endswith("proved")]
    try:
        found = squeal.thresholds(case.system(), RANGE)
    except ComputationError as error:
        return Outcome("open", str(error), faults, mutants)
    texts = [f"{c.kind} {c.direction} {c.mu!r}" for c in found.crossings]
    truth = [f"{e.kind} {e.direction} {e.value!r}" for e in case.events]
    said = f"{texts}, true are {truth}"
    if matches(case, found.crossings):
        return Outcome("certified" if found.certified else "right", said, faults, mutants)
    return Outcome("contradiction" if found.certified else "wrong", said, faults, mutants)


def ask(family: str, seed: Sequence[int], most: int) -> Outcome:
    """The outcome of the system that a seed makes."""
    rng = np.random.default_rng(seed)
    if family in OVER_MU:
        case = OVER_MU[family](rng, most)
        return over_mu(case, rng, len(case.K0) <= SMALL and rng.random() < 0.1)
    while True:
        try:
            system = sample(family, rows_of(rng, most), bool(rng.integers(2)), rng)
        except ValueError:
            continue  # an entry would be rounded, or two roots meet
        return at_a_value(system, rng)


def table(counts: dict[str, Counter[str]], mutants: Counter[str], faults: int) -> str:
    """The counts of each family and of all, and how wrong answers were judged."""
    lines = [f"{'family':24}{'asked':>9}" + "".join(f"{name:>15}" for name in OUTCOMES)]
    for family, row in [*counts.items(), ("all", sum(counts.values(), Counter[str]()))]:
        numbers = "".join(f"{row[name]:15}" for name in OUTCOMES)
        lines.append(f"{family:24}{row.total():9}{numbers}")
    lines.append("wrong answers: " + ", ".join(f"{k} {n}" for k, n in sorted(mutants.items())))
    lines.append(f"{faults} contradictions")
    return "\n".join(lines)


def main() -> int:
    """Ask, print the table, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=1800, help="systems in all")
    parser.add_argument("--start", type=int, default=0, help="number of the first")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rows", type=int, default=30, help="of the largest system")
    parser.add_argument("--family", choices=FAMILIES)
    given = parser.parse_args()
    families = [given.family] if given.family else FAMILIES
    counts = {family: Counter[str]() for family in families}
    mutants = Counter[str]()
    faults = 0
    for number in range(given.start, given.start + given.count):
        family = families[number % len(families)]
        outcome = ask(family, [given.seed, FAMILIES.index(family), number], given.rows)
        counts[family][outcome.name] += 1
        mutants += outcome.mutants
        if outcome.name == "contradiction":
            outcome.faults.append(outcome.said)
        for fault in outcome.faults:
            faults += 1
            print(f"{family} {number}, contradiction: {fault}", flush=True)
        if outcome.name == "wrong":
            print(f"{family} {number}, wrong: {outcome.said}", flush=True)
        asked = number + 1 - given.start
        if asked % 1000 == 0 or asked == given.count:
            print(f"seed {given.seed}, systems {given.start} to {number}")
            print(table(counts, mutants, faults), flush=True)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
