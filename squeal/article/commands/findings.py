"""`python -m commands.findings`: the findings on the article's equations, each measured."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from squeal.article.cases import CASES, STEMS
from squeal.article.commands.claims import options, scene_folder
from squeal.article.findings import Finding, Measured, measure_findings
from squeal.article.findings.motion import Study
from squeal.commands.base import Answer, Command
from squeal.files.provenance import provenance
from squeal.scene import read_scene


def data(measured: list[tuple[Finding, Measured]]) -> dict[str, Any]:
    """The findings as a JSON object."""
    return {
        "findings": [
            {
                "id": finding.id,
                "where": finding.where,
                "statement": finding.statement,
                "outcome": found.outcome,
                "measured": found.numbers,
            }
            for finding, found in measured
        ]
    }


def text(measured: list[tuple[Finding, Measured]]) -> str:
    """The same for people."""
    return "\n".join(
        f"{finding.id}, {finding.where}: {finding.statement}\n    {found.outcome}"
        for finding, found in measured
    )


def run(given: argparse.Namespace) -> Answer:
    """Measure the findings on the article's scenes."""
    folder = scene_folder(given.scenes)
    cases = {
        model: {case: read_scene(folder / f"{model}-{case}.yaml", "simulate") for case in CASES}
        for model in ("b1", "b2")
    }
    study = Study(cases["b1"], cases["b2"], read_scene(folder / "b3.yaml"))
    measured = measure_findings(study)
    read = [folder / f"{stem}.yaml" for stem in STEMS]
    made = provenance(read, "squeal.article.commands.findings")
    return Answer(lambda: data(measured) | {"provenance": made.to_dict()}, lambda: text(measured))


COMMAND = Command(
    "findings",
    "What the article's equations turned out to be, each finding measured.",
    run,
    options,
    scene=False,
)

if __name__ == "__main__":
    sys.exit(COMMAND.main())
