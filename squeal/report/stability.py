"""Tables, sentences and values of the stability chapter, from results/stability.json."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from squeal.angle_map import NAMES
from squeal.files import write_text
from squeal.report.latex import alternative, definitions, long_table, number, percent, typeset
from squeal.report.layout import CHAPTER_FILES


def literature_table(rows: list[dict[str, Any]]) -> str:
    """Expected and computed numbers of the literature systems, with their provenance."""
    head = ["system", "quantity", "expected", "computed", "known from"]
    lines = []
    before = ""
    for row in rows:
        name = row["name"] if row["name"] != before else ""
        before = row["name"]
        cells = [typeset(name), typeset(row["quantity"])]
        cells += [_plain(row[key]) for key in ("expected", "computed")]
        lines.append([*cells, typeset(row["provenance"])])
    return long_table(head, lines)


def _plain(text: str) -> str:
    """A printed number, complex ones included, in math mode."""
    number = text.replace("i", r"\mathrm{i}")
    return text if text == "none" else rf"\mbox{{${number}$}}"


def advice_list(cases: dict[str, Any]) -> str:
    """The sentences on each of the article's configurations."""
    lines = [r"\begin{description}"]
    for name, case in cases.items():
        model, letter = name.split("-")
        text = typeset(case["advice"].replace("%", " %").replace("  %", " %"))
        lines.append(rf"\item[{model.upper()}, case ({letter})] {text}")
    return "\n".join([*lines, r"\end{description}", ""])


def values(found: dict[str, Any]) -> dict[str, str]:
    """Values that the chapter's text refers to."""
    m = found["maps"]
    told = {
        f"share.{key}": percent(m[f"share_{key}"])
        for key in ("as_printed", "sign_aware", "exists", "quiet", "denied", "wrongly_allowed")
    }
    for model in ("b2", "b3"):
        for name in NAMES:
            told[f"share.{model}.{name.replace(' ', '-')}"] = percent(m[f"share_{model}"][name])
    told["growth.apart"] = number(max(g["apart"] for g in found["growth"]), 2)
    told["growth.simulations"] = str(sum(len(g["mu"]) for g in found["growth"]))
    rank_one = [name for name, case in found["cases"].items() if case["loop"]["rank_one"]]
    told["loop.rank-one"] = ", ".join(rank_one) or "none"
    loop = found["loop"] or {}
    for key in ("threshold", "gain_margin", "apart"):
        told[f"loop.{key}"] = number(loop[key], 6) if loop.get(key) is not None else "none"
    rows = found["literature"]
    told["literature.rows"] = str(len(rows))
    told["literature.agree"] = str(sum(row["agrees"] for row in rows))
    return told


def alternatives(files: list[Path]) -> dict[str, str]:
    """Alternative texts of the chapter's figures, by the name of their file."""
    return {
        f"alternative.{file.stem}": alternative(file.read_text(encoding="utf-8").strip())
        for file in files
    }


def main() -> int:
    """Write the chapter's generated files."""
    parser = argparse.ArgumentParser(description="Tables and values of the stability chapter.")
    parser.add_argument("results", type=Path, metavar="JSON", help="of squeal.stability_study")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--figures", type=Path, nargs="+", required=True, metavar="TXT")
    given = parser.parse_args()
    found = json.loads(given.results.read_text(encoding="utf-8"))
    texts = (
        definitions(values(found) | alternatives(given.figures)),
        literature_table(found["literature"]),
        advice_list(found["cases"]),
    )
    given.out.mkdir(parents=True, exist_ok=True)
    for name, text in zip(CHAPTER_FILES, texts, strict=True):
        write_text(given.out / name, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
