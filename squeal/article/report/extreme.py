"""Tables and values of the section on accuracy, stiff and extreme cases."""

from collections.abc import Callable, Mapping, Sequence

from squeal.article.cases import title
from squeal.article.report.latex import Generated, cells, long_table, number, once, tabular, typeset
from squeal.article.results.accuracy import Accuracy, SceneAccuracy
from squeal.article.results.extreme import Extreme, Outcome


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
    """One row a simulated scene: error, effort, growth of errors, horizon if any has one."""
    columns: dict[str, Callable[[tuple[str, SceneAccuracy]], str]] = {
        "scene": lambda one: title(one[0]).replace(", case", ""),
        "error": lambda one: number(one[1].error, 2),
        "steps": lambda one: str(one[1].steps),
        "changes": lambda one: str(one[1].changes),
        "CPU time, ms": lambda one: number(1e3 * one[1].run_time, 2),
        "growth": lambda one: number(one[1].growth, 3),
        "rate, 1/ms": lambda one: number(1e-3 * one[1].exponent, 2),
    }
    if any(one.horizon is not None for one in scenes.values()):
        columns["horizon, ms"] = lambda one: number(one[1].horizon and 1e3 * one[1].horizon, 3)
    head, rows = cells(columns, scenes.items())
    return tabular("l" + "r" * (len(columns) - 1), head, [rows[:4], rows[4:]])


def accuracy_values(scenes: Mapping[str, SceneAccuracy]) -> dict[str, str]:
    """Values that the text on accuracy refers to."""
    reach = [a.horizon / a.stop for a in scenes.values() if a.horizon is not None]
    worst = max(a.error for a in scenes.values())
    longer = min(a.measured for a in scenes.values())
    least = min([*reach, longer])
    figures = rf"{number(1e3 * next(iter(scenes.values())).stop, 4)}\,ms of the figures"
    given = "so that no horizon is given: none ends within"
    if reach:
        given = (
            f"but for {len(reach)} of {len(scenes)} motions, whose horizon is at least "
            f"{number(min(reach), 3)} times the {figures}; the others have none within"
        )
    return {
        "accuracy.worst": number(worst, 2),
        "accuracy.longer": number(longer, 3),
        "accuracy.horizons": f"{given} {number(longer, 3)} times the {figures}",
        "accuracy.within": "all are" if least >= 2.0 else "not all are",
    }


def generated(suite: Extreme, found: Accuracy) -> Generated:
    """Values and tables, from the files of these studies."""
    tables = {"extreme": extreme_table(suite.cases), "accuracy": accuracy_table(found.scenes)}
    words = {"accuracy.truth": typeset(found.truth), "extreme.truth": typeset(suite.truth)}
    return values(suite.cases) | accuracy_values(found.scenes) | words, tables
