"""Tables and values of the section on accuracy, stiff and extreme cases."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from squeal.article.report.latex import definitions, long_table, number, tabular, typeset
from squeal.article.report.layout import EXTREME_FILES
from squeal.files.writing import write_text


def extreme_table(cases: list[dict[str, Any]]) -> str:
    """One row a case: outcome, error, counts, run time, and what it was held against."""
    rows = []
    before = ""
    for case in cases:
        group = "" if case["group"] == before else case["group"]
        before = case["group"]
        error = "--" if case["error"] is None else number(case["error"], 2)
        counts = [str(case[key]) if case["steps"] else "--" for key in ("steps", "changes")]
        spent = number(1e3 * case["run_time"], 2) if case["steps"] else "--"
        cells = [typeset(group), typeset(case["name"]), case["outcome"], error, *counts, spent]
        rows.append([*cells, typeset(case["told"])])
    head = ["what is extreme", "case", "outcome", "error", "steps", "changes", "ms"]
    return long_table([*head, "held against, or told"], rows)


def values(cases: list[dict[str, Any]]) -> dict[str, str]:
    """Values that the section's text refers to."""
    told = {"extreme.cases": str(len(cases))}
    for outcome in ("right", "refused", "warned", "wrong"):
        told[f"extreme.{outcome}"] = str(sum(c["outcome"] == outcome for c in cases))
    worst = max((c for c in cases if c["error"] is not None), key=lambda c: c["error"])
    told["extreme.worst"] = number(worst["error"], 2)
    told["extreme.worst-case"] = typeset(f"{worst['group']}, {worst['name']}")
    return told


def accuracy_table(scenes: dict[str, dict[str, Any]]) -> str:
    """One row a simulated scene: error, effort, growth of errors, horizon."""
    rows = []
    for name, a in scenes.items():
        model, case = name.upper().split("-")
        horizon = "--" if a["horizon"] is None else number(1e3 * a["horizon"], 3)
        rows.append(
            [
                f"{model} ({case.lower()})",
                number(a["error"], 2),
                f"{a['steps']}",
                f"{a['changes']}",
                number(1e3 * a["run_time"], 2),
                number(a["growth"], 3),
                number(1e-3 * a["exponent"], 2),
                horizon,
            ]
        )
    head = ["scene", "error", "steps", "changes", "run time, ms", "growth"]
    return tabular("lrrrrrrr", [*head, "exponent, 1/ms", "horizon, ms"], [rows[:4], rows[4:]])


def accuracy_values(scenes: dict[str, dict[str, Any]]) -> dict[str, str]:
    """Values that the text on accuracy refers to."""
    reach = [a["horizon"] / a["stop"] for a in scenes.values() if a["horizon"] is not None]
    worst = max(a["error"] for a in scenes.values())
    least = min([*reach, *(a["measured"] for a in scenes.values())])
    return {
        "accuracy.worst": number(worst, 2),
        "accuracy.reach": number(least, 3),
        "accuracy.within": "all are" if least >= 2.0 else "not all are",
        "accuracy.stop": number(1e3 * next(iter(scenes.values()))["stop"], 4),
    }


def main() -> int:
    """Write the section's generated files."""
    parser = argparse.ArgumentParser(description="Table and values of the extreme cases.")
    parser.add_argument("results", type=Path, metavar="JSON", help="of squeal.article.extreme")
    parser.add_argument(
        "accuracy", type=Path, metavar="JSON", help="of squeal.article.studies.accuracy"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    given = parser.parse_args()
    cases = json.loads(given.results.read_text(encoding="utf-8"))["cases"]
    given.out.mkdir(parents=True, exist_ok=True)
    scenes = json.loads(given.accuracy.read_text(encoding="utf-8"))["scenes"]
    texts = (
        definitions(values(cases) | accuracy_values(scenes)),
        extreme_table(cases),
        accuracy_table(scenes),
    )
    for name, text in zip(EXTREME_FILES, texts, strict=True):
        write_text(given.out / name, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
