"""Tables and values of the section on identification, from the stored searches verified afresh."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from squeal.article.figures.robustness import SYMBOLS
from squeal.article.identify.space import DIMENSIONS
from squeal.article.report.latex import (
    alternative,
    definitions,
    long_table,
    number,
    tabular,
    typeset,
)
from squeal.article.report.layout import IDENTIFICATION_FILES
from squeal.files.writing import write_text


def _words(formulation: dict[str, str]) -> list[str]:
    return [
        formulation["line_force"],
        formulation["delta_from"],
        f"${formulation['delta_moment']}$",
    ]


def formulation_table(found: list[dict[str, Any]]) -> str:
    """One row a formulation: pads tried, claims kept, which fail, what the variations change."""
    rows = []
    for entry in found:
        failing = ", ".join(claim["id"] for claim in entry["failing"])
        changed = "; ".join(
            f"{c['claim'] or 'motion'} {c['verdict']} at {c['variation']}" for c in entry["changed"]
        )
        rows.append(
            [
                *_words(entry["formulation"]),
                f"{entry['pads']:,}".replace(",", r"\,"),
                str(entry["reproduced"]),
                typeset(failing),
                typeset(changed) or "none",
            ]
        )
    head = ["line force", "delta from", "sign", "pads tried", "kept", "not kept"]
    return long_table([*head, "changed by half or double tolerance or a doubled horizon"], rows)


def range_table(numbers: dict[str, float]) -> str:
    """The searched ranges with their reasons, and the best pad's numbers."""
    rows = [
        [
            SYMBOLS[d.name],
            number(d.low),
            number(d.high),
            number(numbers[d.name], 6),
            typeset(d.reason),
        ]
        for d in DIMENSIONS
    ]
    head = ["number", "from", "to", "best pad", "meaning and reason of the range"]
    return tabular(r"lrrr>{\raggedright\arraybackslash}p{3.4in}", head, [rows])


def values(found: list[dict[str, Any]], robust: dict[str, Any]) -> dict[str, str]:
    """Values that the section's text refers to."""
    best = found[0]
    told = {
        "identified.kept": str(best["reproduced"]),
        "identified.pads": f"{sum(e['pads'] for e in found):,}".replace(",", r"\,"),
        "identified.best-pads": f"{best['pads']:,}".replace(",", r"\,"),
        "identified.seed": str(best["seed"]),
        "identified.changed": "no verdict" if not best["changed"] else f"{len(best['changed'])}",
        "identified.failing": "; ".join(
            typeset(f"{c['id']} ({c['measured']})") for c in best["failing"]
        ),
    }
    for entry in found:
        f = entry["formulation"]
        key = f"identified.{f['line_force']}-{f['delta_from']}-{f['delta_moment']}"
        told[key] = str(entry["reproduced"])
    ranges = robust["samples"][-1]["claims"]
    for claim, share in ranges.items():
        low, high = (f"{100 * v:.1f}" for v in share["interval"])
        told[f"ranges.{claim}"] = rf"{100 * share['share']:.1f}\,\% ({low} to {high})"
    told["ranges.pads"] = str(robust["samples"][-1]["pads"])
    return told


def main() -> int:
    """Write the section's generated files."""
    parser = argparse.ArgumentParser(description="Tables and values on the identification.")
    for name in ("formulations", "robustness", "caption"):
        parser.add_argument(f"--{name}", type=Path, required=True, metavar="FILE")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    given = parser.parse_args()
    found = json.loads(given.formulations.read_text(encoding="utf-8"))["formulations"]
    robust = json.loads(given.robustness.read_text(encoding="utf-8"))
    caption = given.caption.read_text(encoding="utf-8").strip()
    texts = (
        definitions(values(found, robust) | {"alternative.robustness": alternative(caption)}),
        formulation_table(found),
        range_table(found[0]["numbers"]),
    )
    given.out.mkdir(parents=True, exist_ok=True)
    for name, text in zip(IDENTIFICATION_FILES, texts, strict=True):
        write_text(given.out / name, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
