"""Everything that LaTeX reads beside report.tex: tables, values, alternative texts."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from squeal.article.cases import CASES, HISTORY_FIGURES
from squeal.article.report import tables
from squeal.article.report.latex import alternative, definitions, escape, number, percent, typeset
from squeal.article.report.layout import FIGURES, RESULTS, TABLES
from squeal.article.report.parameters import parameter_table
from squeal.files.provenance import Provenance
from squeal.files.writing import write_text
from squeal.scene import Scene, read_scene


def angle(value: float) -> str:
    """An angle as a multiple of pi, for use in math mode."""
    factor = f"{value / math.pi:.6g}"
    return r"\pi" if factor == "1" else rf"{factor}\,\pi"


def simulated(stem: str, result: dict[str, Any]) -> dict[str, str]:
    """Values of one simulated scene."""
    values = {
        f"{stem}.changes": str(len(result["events"])),
        f"{stem}.steps": str(result["steps"]),
        f"{stem}.stop": number(1e3 * result["final"]["t"]),
        f"{stem}.scene": escape(result["provenance"]["inputs"][0]["name"]),
    }
    for state, share in result["shares"].items():
        values[f"{stem}.share.{state}"] = percent(share)
    for signal, limits in result["extrema"].items():
        low, high = limits or (float("nan"), float("nan"))
        values[f"{stem}.min.{signal}"] = number(low, 3)
        values[f"{stem}.max.{signal}"] = number(high, 3)
    return values


def agreement(claims: list[dict[str, Any]], model: str, case: str) -> str:
    """How far one case agrees with the article, told from the claims about that case alone."""
    own = [c for c in claims if c["id"].startswith(f"{model}-") and c["case"] == case]
    missed = [c for c in own if c["verdict"] != "reproduced"]
    if not own:
        return ""
    if not missed:
        all_of = {1: "The one statement", 2: "Both statements"}
        subject = all_of.get(len(own), f"All {len(own)} statements")
        return (
            f"{subject} of the article on this case {'is' if len(own) == 1 else 'are'} reproduced."
        )
    told = "; ".join(f"{c['id']} ({c['measured']})" for c in missed)
    count = len(own) - len(missed)
    return typeset(
        f"Of {len(own)} statements of the article on this case {count} "
        f"{'is' if count == 1 else 'are'} reproduced; not so {told}."
    )


def judged(claims: list[dict[str, Any]]) -> dict[str, str]:
    """Values told by the claims: counts, each verdict and measure, agreement by figure."""
    values = {"claims.total": str(len(claims))}
    for verdict in ("reproduced", "not reproduced", "contradicted"):
        count = sum(c["verdict"] == verdict for c in claims)
        values[f"claims.{verdict.replace(' ', '-')}"] = str(count)
    for c in claims:
        values[f"claim.{c['id']}.verdict"] = c["verdict"]
        values[f"claim.{c['id']}.measured"] = typeset(c["measured"])
    for stem in HISTORY_FIGURES:
        values[f"agreement.{stem}"] = agreement(claims, stem[:2].upper(), stem[-1])
    return values


def versions(made: Iterable[Provenance]) -> dict[str, str]:
    """Versions of the packages that computed the results: several where results differ."""
    found: dict[str, dict[str, None]] = {}
    for one in made:
        for package, version in one.versions.items():
            found.setdefault(f"version.{package}", {})[version] = None
    return {key: ", ".join(several) for key, several in found.items()}


def all_values(
    results: dict[str, dict[str, Any]], scenes: dict[str, list[Scene]]
) -> dict[str, str]:
    """Every value that the report may refer to."""
    values = versions(provenances(results).values()) | judged(results["claims"]["claims"])
    for stem in HISTORY_FIGURES:
        values |= simulated(stem, results[stem])
    values["method"] = escape(results["b1-a"]["method"])
    values["tolerance"] = number(results["b1-a"]["tolerance"], 3)
    for key, share in results["quasi_static"]["share"].items():
        values[f"map.{key}"] = percent(share)
    values["map.mu"] = number(results["quasi_static"]["mu"], 4)
    values["map.n"] = str(results["quasi_static"]["n"])
    cases = results["eigenvalues"]["scenes"]
    for stem, found in cases.items():
        values[f"eigenvalues.{stem}.verdict"] = found.get("verdict", "no sliding equilibrium")
    values["eigenvalues.apart"] = number(max([f.get("apart", 0.0) for f in cases.values()]), 2)
    values["findings.total"] = str(len(results["findings"]["findings"]))
    for case, scene in zip(CASES, scenes["b1"], strict=True):
        values[f"case.{case}.alpha1"] = angle(scene.pad.alpha1)
        values[f"case.{case}.alpha2"] = angle(scene.pad.alpha2)
    pad = scenes["b1"][0].pad
    values["pad.w"], values["pad.mu"] = number(1e3 * pad.w), number(pad.mu)
    values["pad.F_n"] = number(pad.F_n)
    formulation = scenes["b2"][0].formulation
    values["formulation"] = escape(
        f"line force {formulation.line_force}, delta from the {formulation.delta_from}, "
        f"moment of the reaction with the sign {formulation.delta_moment}"
    )
    return values


def provenances(results: dict[str, dict[str, Any]]) -> dict[str, Provenance]:
    """What made each result, by the result's name."""
    return {name: Provenance.from_dict(found["provenance"]) for name, found in results.items()}


def load(folder: Path) -> dict[str, dict[str, Any]]:
    """The JSON results of a folder by name, without their sampled histories."""
    found = {n: json.loads((folder / f"{n}.json").read_text(encoding="utf-8")) for n in RESULTS}
    for result in found.values():
        result.pop("history", None)
    return found


def build(results_folder: Path, scene_folder: Path, figures: Path, out: Path) -> None:
    """Write tables and values for the report into `out`."""
    results = load(results_folder)
    scenes = {
        model: [read_scene(scene_folder / f"{model}-{case}.yaml") for case in CASES]
        for model in ("b1", "b2")
    }
    texts = {
        f"alternative.fig{i:02}": alternative(
            (figures / f"fig{i:02}.txt").read_text(encoding="utf-8").strip()
        )
        for i in FIGURES
    }
    files = {
        "values.tex": definitions(all_values(results, scenes) | texts),
        "table-1.tex": tables.table_1(),
        "table-2.tex": tables.table_2(),
        "parameters.tex": parameter_table(scenes),
        "eigenvalues.tex": tables.eigenvalue_table(results["eigenvalues"]["scenes"]),
        "claims.tex": tables.claims_table(results["claims"]["claims"]),
        "findings.tex": tables.findings_table(results["findings"]["findings"]),
        "origin.tex": tables.origin_table(provenances(results)),
    }
    assert tuple(files) == TABLES
    out.mkdir(parents=True, exist_ok=True)
    for file, text in files.items():
        write_text(out / file, text)


def main() -> int:
    """Build from the folders given on the command line."""
    parser = argparse.ArgumentParser(description="Write the report's tables and values.")
    for folder in ("results", "scenes", "figures", "out"):
        parser.add_argument(f"--{folder}", type=Path, required=True, metavar="FOLDER")
    given = parser.parse_args()
    build(given.results, given.scenes, given.figures, given.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
