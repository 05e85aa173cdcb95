"""Tables, sentences and values of the stability chapter, from its result files."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from squeal.article.cases import title
from squeal.article.report.latex import (
    alternative,
    definitions,
    long_table,
    number,
    percent,
    tabular,
    typeset,
)
from squeal.article.report.layout import CHAPTER_FILES
from squeal.files.writing import write_text


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


def threshold_table(scenes: list[dict[str, Any]], fluttering: dict[str, Any] | None) -> str:
    """Thresholds along the branch, with the equilibrium held, and as gain margins of the loop."""
    shown = [(title(scene["name"]), scene) for scene in scenes]
    if fluttering is not None:
        shown.append(("B2, fluttering angles", fluttering))
    head = ["", r"along the branch, $\mu \le 1$", "equilibrium held", "gain margin", "difference"]
    groups: dict[str, list[list[str]]] = {}
    for name, scene in shown:
        branch, loop = scene["branch"], scene["loop"]
        events = [f"{number(p['mu'], 6)} {p['kind']}" for p in branch.get("thresholds", [])]
        held, margins = (
            [number(mu, 10) for mu in loop.get(key, [])] for key in ("thresholds", "gain_margins")
        )
        cells = [", ".join(part) or "none" for part in (events, held, margins)]
        if "rank_one" not in loop:
            cells[1:] = ["no equilibrium", "--"]
        elif not loop["rank_one"]:
            cells[2] = "not of rank one"
        apart = loop.get("apart")
        cells.append("--" if apart is None or not margins else number(apart, 2))
        groups.setdefault(scene["model"], []).append([name, *cells])
    return tabular("lllll", head, list(groups.values()))


def advice_list(advice: dict[str, str]) -> str:
    """The sentences on each of the article's configurations."""
    lines = [r"\begin{description}"]
    for name, told in advice.items():
        text = typeset(told.replace("%", " %").replace("  %", " %"))
        lines.append(rf"\item[{title(name)}] {text}")
    return "\n".join([*lines, r"\end{description}", ""])


def values(
    found: dict[str, Any],
    scenes: list[dict[str, Any]],
    angles: dict[str, Any],
    printed: dict[str, Any],
) -> dict[str, str]:
    """Values that the chapter's text refers to."""
    told = {f"share.{k}": percent(v) for k, v in (angles["share"] | printed["share"]).items()}
    for model in ("b2", "b3"):
        for name, share in angles[f"share_{model}"].items():
            told[f"share.{model}.{name.replace(' ', '-')}"] = percent(share)
    told["growth.apart"] = number(max(g["apart"] for g in found["growth"]), 2)
    told["growth.simulations"] = str(sum(len(g["mu"]) for g in found["growth"]))
    loops = [scene["loop"] for scene in scenes if scene["loop"].get("rank_one")]
    told["loop.rank-one"] = str(len(loops))
    told["loop.scenes"] = str(len(scenes))
    told["loop.locus-apart"] = number(max((one["locus_apart"] for one in loops), default=0.0), 2)
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
    for name in ("stability_study", "loci", "angle_study", "quasi_static"):
        parser.add_argument(name, type=Path, metavar="JSON", help=f"of squeal.{name}")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--figures", type=Path, nargs="+", required=True, metavar="TXT")
    given = parser.parse_args()
    files = (given.stability_study, given.loci, given.angle_study, given.quasi_static)
    found, loci, angles, printed = (json.loads(f.read_text(encoding="utf-8")) for f in files)
    texts = (
        definitions(values(found, loci["scenes"], angles, printed) | alternatives(given.figures)),
        literature_table(found["literature"]),
        advice_list(found["advice"]),
        threshold_table(loci["scenes"], found["fluttering"]),
    )
    given.out.mkdir(parents=True, exist_ok=True)
    for name, text in zip(CHAPTER_FILES, texts, strict=True):
        write_text(given.out / name, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
