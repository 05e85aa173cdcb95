"""Tables and values of the section on accuracy, stiff and extreme cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from squeal.article.report.latex import Generated, long_table, number, tabular, typeset
from squeal.article.results.accuracy import Accuracy, SceneAccuracy
from squeal.article.results.extreme import Extreme, Outcome


def extreme_table(cases: Sequence[Outcome]) -> str:
    """One row a case: outcome, error, counts, run time, and what it was held against."""
    rows = []
    before = ""
    for case in cases:
        group = "" if case.group == before else case.group
        before = case.group
        error = "--" if case.error is None else number(case.error, 2)
        counts = [str(n) if case.steps else "--" for n in (case.steps, case.changes)]
        spent = number(1e3 * case.run_time, 2) if case.steps else "--"
        cells = [typeset(group), typeset(case.name), case.outcome, error, *counts, spent]
        rows.append([*cells, typeset(case.told)])
    head = ["what is extreme", "case", "outcome", "error", "steps", "changes", "ms"]
    return long_table([*head, "compared with, or message"], rows)


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
    """One row a simulated scene: error, effort, growth of errors, horizon."""
    rows = []
    for name, a in scenes.items():
        model, case = name.upper().split("-")
        horizon = "--" if a.horizon is None else number(1e3 * a.horizon, 3)
        rows.append(
            [
                f"{model} ({case.lower()})",
                number(a.error, 2),
                f"{a.steps}",
                f"{a.changes}",
                number(1e3 * a.run_time, 2),
                number(a.growth, 3),
                number(1e-3 * a.exponent, 2),
                horizon,
            ]
        )
    head = ["scene", "error", "steps", "changes", "CPU time, ms", "growth"]
    return tabular("lrrrrrrr", [*head, "exponent, 1/ms", "horizon, ms"], [rows[:4], rows[4:]])


def accuracy_values(scenes: Mapping[str, SceneAccuracy]) -> dict[str, str]:
    """Values that the text on accuracy refers to."""
    reach = [a.horizon / a.stop for a in scenes.values() if a.horizon is not None]
    worst = max(a.error for a in scenes.values())
    least = min([*reach, *(a.measured for a in scenes.values())])
    return {
        "accuracy.worst": number(worst, 2),
        "accuracy.reach": number(least, 3),
        "accuracy.longer": number(min(a.measured for a in scenes.values()), 3),
        "accuracy.within": "all are" if least >= 2.0 else "not all are",
        "accuracy.stop": number(1e3 * next(iter(scenes.values())).stop, 4),
    }


def generated(suite: Extreme, found: Accuracy) -> Generated:
    """Values and tables, from the files of these studies."""
    tables = {"extreme": extreme_table(suite.cases), "accuracy": accuracy_table(found.scenes)}
    words = {"accuracy.truth": typeset(found.truth), "extreme.truth": typeset(suite.truth)}
    return values(suite.cases) | accuracy_values(found.scenes) | words, tables
