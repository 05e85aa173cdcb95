"""Table and values of the section on stiff and extreme cases, from results/extreme.json."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from squeal.files import write_text
from squeal.report.latex import definitions, long_table, number, typeset
from squeal.report.layout import EXTREME_FILES


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


def main() -> int:
    """Write the section's generated files."""
    parser = argparse.ArgumentParser(description="Table and values of the extreme cases.")
    parser.add_argument("results", type=Path, metavar="JSON", help="of squeal.extreme")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    given = parser.parse_args()
    cases = json.loads(given.results.read_text(encoding="utf-8"))["cases"]
    given.out.mkdir(parents=True, exist_ok=True)
    texts = (definitions(values(cases)), extreme_table(cases))
    for name, text in zip(EXTREME_FILES, texts, strict=True):
        write_text(given.out / name, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
