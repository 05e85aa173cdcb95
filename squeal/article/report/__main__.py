"""`python -m squeal.article.report CHAPTER FILE ... --out FOLDER`: what a chapter's text reads.

The function `generated` of the chapter's module takes the files that the table of chapters names
and gives the texts of the generated files; CHAPTER-values holds the values for \\val{key}.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from squeal.errors import InputError
from squeal.files.writing import write_text


def main(given: Sequence[str] | None = None) -> int:
    """Write the generated files of a chapter; 2 with a reason if a file is refused."""
    parser = argparse.ArgumentParser(description="Write what a chapter of the report reads.")
    parser.add_argument("chapter", metavar="CHAPTER")
    parser.add_argument("files", nargs="*", metavar="FILE")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    chosen = parser.parse_args(given)
    module = import_module(f"squeal.article.report.{chosen.chapter}")
    try:
        texts = {f"{name}.tex": text for name, text in module.generated(*chosen.files).items()}
    except InputError as error:
        print(f"{chosen.chapter}: {error}", file=sys.stderr)
        return 2
    chosen.out.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        write_text(chosen.out / name, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
