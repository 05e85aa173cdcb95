"""Table and values of the section on error against run time, from results/precision.json."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from squeal.files import write_text
from squeal.precision.measure import Point, time_at
from squeal.report.latex import alternative, definitions, number, tabular, typeset
from squeal.report.layout import PRECISION_FILES

ERROR = 1e-10  # at which the paths are compared
OURS, BATCH = "squeal", "squeal, batch"


def speed_table(points: list[Point]) -> str:
    """Time of each path for a final error of at most `ERROR`, and as a multiple of ours."""
    cases = list(dict.fromkeys(p.case for p in points))
    paths = list(dict.fromkeys(p.path for p in points))
    rows = []
    for path in paths:
        row = [typeset(path)]
        for case in cases:
            own, least = (time_at(points, case, name, ERROR) for name in (OURS, path))
            if least is None or own is None:
                row += ["--", "--"]
            else:
                row += [number(1e3 * least, 3), number(least / own, 3)]
        missed = sum(p.missed for p in points if p.path == path)
        rows.append([*row, str(missed)])
    head = ["path"] + [part for case in cases for part in (f"{typeset(case)}, ms", "ratio")]
    columns = "l" + r">{\raggedleft}p{0.72in}r" * len(cases) + "r"
    return tabular(columns, [*head, "missed"], [rows])


def linear_table(timings: list[dict[str, Any]]) -> str:
    """Error and time of a spectrum by program."""
    rows = [
        [
            rf"\texttt{{{typeset(t['program'])}}}",
            number(t["error"], 2),
            number(1e6 * t["seconds"], 3),
        ]
        for t in timings
    ]
    return tabular("lrr", ["program", "error", r"time of a matrix, $\mu$s"], [rows])


def values(points: list[Point]) -> dict[str, str]:
    """Values that the section's text refers to."""
    ratios, batches = [], []
    for case in dict.fromkeys(p.case for p in points):
        own, theirs, many = (
            time_at(points, case, name, ERROR) for name in (OURS, "SciPy DOP853", BATCH)
        )
        if own is not None and theirs is not None:
            ratios.append(theirs / own)
        if many is not None:
            batches.append(1.0 / many)
    lost = [p for p in points if p.missed and not p.path.startswith(OURS)]
    return {
        "precision.least-ratio": number(min(ratios), 3) if ratios else "--",
        "precision.greatest-ratio": number(max(ratios), 3) if ratios else "--",
        "precision.least-batch": number(min(batches), 3) if batches else "--",
        "precision.missing-runs": str(len(lost)),
        "precision.runs": str(sum(not p.path.startswith(OURS) for p in points)),
        "precision.loosest": number(max((p.tolerance for p in lost), default=0.0), 1),
    }


def main() -> int:
    """Write the section's generated files."""
    parser = argparse.ArgumentParser(description="Tables and values on error against run time.")
    parser.add_argument("results", type=Path, metavar="JSON", help="of squeal.precision")
    parser.add_argument("caption", type=Path, metavar="TXT", help="alternative text of the figure")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    given = parser.parse_args()
    found = json.loads(given.results.read_text(encoding="utf-8"))
    points = [Point(**p) for p in found["points"]]
    caption = given.caption.read_text(encoding="utf-8").strip()
    texts = (
        definitions(values(points) | {"alternative.precision": alternative(caption)}),
        speed_table(points),
        linear_table(found["linear"]),
    )
    given.out.mkdir(parents=True, exist_ok=True)
    for name, text in zip(PRECISION_FILES, texts, strict=True):
        write_text(given.out / name, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
