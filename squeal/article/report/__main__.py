"""`python -m squeal.article.report CHAPTER FILE ... --out FOLDER`: what a chapter's text reads.

CHAPTER-values holds what \\val{key} stands for: all plain numbers and words in the results of the
chapter's own studies. The function `generated` of the chapter's module, if there is one, takes what
the table of chapters names, read as its annotations say, and gives more values, and the tables.
"""

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from squeal.article.report.chapters import CHAPTERS
from squeal.article.report.latex import definitions, plain_values
from squeal.article.results import record_of
from squeal.article.results.records import Plain, call
from squeal.cli.streams import exit_code
from squeal.io.writing import write_text


def written(name: str, files: Sequence[str]) -> dict[str, str]:
    """Texts of a chapter's generated files by name, from the files that it reads."""
    (chapter,) = (one for one in CHAPTERS if one.name == name)
    values: dict[str, str] = {}
    tables: dict[str, str] = {}
    for study in chapter.studies:
        (file,) = (Path(file) for file in files if Path(file).stem == study.name)
        result = record_of(study.name).read(file)
        own = result.values if isinstance(result, Plain) else result
        values |= plain_values(study.name, own, dict[str, Any])
    module = f"squeal.article.report.{name}"
    if module in chapter.modules:
        more, tables = call(import_module(module).generated, files)
        values |= more
    return {f"{name}-values": definitions(values), **tables}


def main(given: Sequence[str] | None = None) -> int:
    """Write the generated files of a chapter; 2 with a reason if a file is refused."""
    parser = argparse.ArgumentParser(description="Write what a chapter of the report reads.")
    parser.add_argument("chapter", metavar="CHAPTER")
    parser.add_argument("files", nargs="*", metavar="FILE")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    chosen = parser.parse_args(given)
    return exit_code(chosen.chapter, lambda: _run(chosen))


def _run(chosen: argparse.Namespace) -> int:
    texts = written(chosen.chapter, chosen.files)
    chosen.out.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        write_text(chosen.out / f"{name}.tex", text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
