"""`squeal findings`: the findings on the article's equations, each measured."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

from squeal.article.cases import STEMS
from squeal.article.commands.claims import options, scene_files
from squeal.article.studies.findings import study
from squeal.commands.base import Answer, Command
from squeal.files.provenance import provenance


def run(given: argparse.Namespace) -> Answer:
    """Measure the findings on the article's scenes."""
    files = scene_files(given.scenes, STEMS)
    found, made = study(files), provenance(files, "squeal.article.commands.findings")
    return Answer(
        lambda: replace(found, provenance=made).to_dict(),
        lambda: "\n".join(
            f"{one.id}, {one.where}: {one.statement}\n    {one.outcome}" for one in found.findings
        ),
    )


COMMAND = Command(
    "findings",
    "What the article's equations turned out to be, each finding measured.",
    run,
    options,
    scene=False,
)

if __name__ == "__main__":
    sys.exit(COMMAND.main())
