"""Tables and values of the section on accuracy, stiff and extreme cases."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from squeal.article.cases import title
from squeal.article.ensembles.choosing import WINDOWS
from squeal.article.identify.objective import SEARCH_TOLERANCE
from squeal.article.report.latex import (
    Generated,
    at_most,
    cells,
    in_words,
    long_table,
    number,
    once,
    tabular,
    typeset,
)
from squeal.article.results.accuracy import Accuracy, SceneAccuracy
from squeal.article.results.extreme import Extreme, Outcome
from squeal.article.results.line_springs import TOLERANCE as OF_SPRINGS
from squeal.article.results.onset import TOLERANCE as OF_ONSET
from squeal.article.results.onset import Exponent, Onset
from squeal.article.results.starts import TOLERANCE
from squeal.article.results.verify import TOLERANCE as OF_VERIFY


def extreme_table(cases: Sequence[Outcome]) -> str:
    """One row a case: outcome, error, counts, run time, and what it was held against."""
    columns: Mapping[str, Callable[[Outcome], str]] = {
        "what is extreme": lambda case: typeset(case.group),
        "case": lambda case: typeset(case.name),
        "outcome": lambda case: case.outcome,
        "error": lambda case: number(case.error, 2),
        "steps": lambda case: str(case.steps) if case.steps else "--",
        "changes": lambda case: str(case.changes) if case.steps else "--",
        "ms": lambda case: number(1e3 * case.run_time, 2) if case.steps else "--",
        "compared with, or message": lambda case: typeset(case.told),
    }
    head, rows = cells(columns, cases)
    return long_table(head, once(rows))


def values(cases: Sequence[Outcome]) -> dict[str, str]:
    """Values that the section's text refers to."""
    told = {"extreme.cases": str(len(cases))}
    for outcome in ("right", "refused", "warned", "wrong"):
        told[f"extreme.{outcome}"] = str(sum(c.outcome == outcome for c in cases))
    error, worst = max(((c.error, c) for c in cases if c.error is not None), key=lambda e: e[0])
    told["extreme.worst"] = number(error, 2)
    told["extreme.worst-case"] = typeset(f"{worst.group}, {worst.name}")
    return told


def accuracy_table(scenes: Mapping[str, SceneAccuracy]) -> str:
    """One row a simulated scene: error, effort, growth of errors."""
    columns: dict[str, Callable[[tuple[str, SceneAccuracy]], str]] = {
        "scene": lambda one: title(one[0]).replace(", case", ""),
        "error": lambda one: number(one[1].error, 2),
        "steps": lambda one: str(one[1].steps),
        "changes": lambda one: str(one[1].changes),
        "CPU time, ms": lambda one: number(1e3 * one[1].run_time, 2),
        "growth": lambda one: number(one[1].growth, 3),
        "rate, 1/ms": lambda one: number(1e-3 * one[1].exponent, 2),
    }
    head, rows = cells(columns, scenes.items())
    return tabular("l" + "r" * (len(columns) - 1), head, [rows[:4], rows[4:]])


def _tolerance(scene: SceneAccuracy) -> float:
    """Of the scene's own motion, not below what doubles can tell."""
    return max(scene.tolerance, float(np.finfo(float).eps))


def _windows(found: Accuracy, scene: SceneAccuracy, one: Exponent, tolerance: float) -> list[float]:
    """The time in which a tolerance grows to the share that counts as lost, in windows of the
    scene: by the ends of the interval of the own motion's rate, or by the rates of other chaotic
    starts beyond them, since rounding too may set a motion on the way of these."""
    rate, half = one.rates[0], one.half_widths[0]
    chaotic = [r for r, sign in zip(one.rates, one.signs, strict=True) if sign == "chaotic"]
    grown = 1e-3 * math.log(found.lost / tolerance) / scene.stop
    return [grown / max(rate + half, *chaotic), grown / min(rate - half, *chaotic)]


def _words(ends: Iterable[float]) -> str:
    return " to ".join(f"{float(f'{end:.2g}'):g}" for end in ends)


def _beyond(found: Accuracy, onset: Onset) -> str:
    """Of which motions verdicts on the report's pad go beyond what can be predicted."""
    late = []
    for name, scene in found.scenes.items():
        one = onset.exponents.get(f"{name}, undamped")
        if isinstance(one, Exponent) and not one.ends and one.signs[0] == "chaotic":
            ends = _windows(found, scene, one, SEARCH_TOLERANCE)
            if ends[0] < WINDOWS[-1]:
                late.append(f"{title(name)} ({_words(ends)} windows)")
    return f"in {in_words(late)}" if late else "in no case that is seen to be chaotic"


def _horizons(found: Accuracy, onset: Onset) -> str:
    """The times in which the tolerance grows to the share that counts as lost, where the scene's
    own motion is chaotic."""
    words, longest = [], 0
    for name, scene in found.scenes.items():
        one = onset.exponents.get(f"{name}, undamped")
        if not isinstance(one, Exponent) or one.ends:
            continue
        longest = max(longest, one.windows)
        if one.signs[0] == "chaotic":
            ends = _windows(found, scene, one, _tolerance(scene))
            time, windows = _words(end * scene.stop for end in ends), _words(ends)
            words.append(f"{title(name)} {time}\\,s, {windows} times that of the scene")
    if not longest:
        return "no exponents were measured, so that none is given"
    seen = f"in {longest} times the time of the scenes no other own motion is seen to be chaotic"
    return f"for {'; '.join(words)}; {seen}" if words else seen


def batches() -> str:
    """The tolerances of motions that are not the scenes' own, and where they stand."""
    places = {
        TOLERANCE: r"Fig.~\ref{fig:starts}",
        SEARCH_TOLERANCE: r"Secs.~\ref{sec:identification} and~\ref{sec:ensembles}",
        OF_SPRINGS: r"Sec.~\ref{sec:physics} (springs)",
        OF_ONSET: r"Sec.~\ref{sec:onset}",
        OF_VERIFY: r"Table~\ref{formulations}",
    }
    return in_words([f"{number(one, 2)} in {place}" for one, place in places.items()])


def accuracy_values(found: Accuracy, onset: Onset) -> dict[str, str]:
    """Values that the text on accuracy refers to."""
    scenes = found.scenes.values()
    grown = max(a.tolerance * math.exp(a.exponent * a.measured * a.stop) for a in scenes)
    longer = min(a.measured for a in scenes)
    tolerances = sorted({_tolerance(a) for a in scenes})
    return {
        "accuracy.worst": at_most(max(a.error for a in scenes)),
        "accuracy.longer": number(longer, 3),
        "accuracy.horizons": _horizons(found, onset),
        "accuracy.tolerances": in_words([number(one, 2) for one in tolerances]),
        "accuracy.grown": at_most(grown),
        "accuracy.batches": batches(),
        "accuracy.beyond": _beyond(found, onset),
        "accuracy.search": number(SEARCH_TOLERANCE, 2),
        "accuracy.most-windows": str(WINDOWS[-1]),
        "accuracy.within": "all are" if grown < found.lost and longer >= 2.0 else "not all are",
    }


def generated(suite: Extreme, found: Accuracy, onset: Onset) -> Generated:
    """Values and tables, from the files of these studies."""
    tables = {"extreme": extreme_table(suite.cases), "accuracy": accuracy_table(found.scenes)}
    words = {"accuracy.truth": typeset(found.truth), "extreme.truth": typeset(suite.truth)}
    return values(suite.cases) | accuracy_values(found, onset) | words, tables
