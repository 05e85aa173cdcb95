"""`squeal article findings`: what the article's equations turned out to be, each finding measured.

squeal article findings
"""

import argparse

from squeal.article.cases import STEMS
from squeal.article.commands.claims import options as options
from squeal.article.commands.claims import scene_files
from squeal.article.studies.findings import study
from squeal.cli.command import Reply


def run(given: argparse.Namespace) -> Reply:
    """Measure the findings on the article's scenes."""
    files = scene_files(given.scenes, STEMS)
    record = study(files)
    lines = (
        f"{finding.id}, {finding.where} ({finding.worth}): {finding.statement}\n"
        f"    {finding.outcome}"
        for finding in record.findings
    )
    return Reply(record.to_dict, lambda: "\n".join(lines), files)
