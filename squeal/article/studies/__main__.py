"""`python -m squeal.article.studies NAME FILE ...`: a study's result as JSON.

FILEs are the scenes that the study reads.
"""

import argparse
import gc
import sys
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path

from squeal.article.contents import STUDIES
from squeal.cli.streams import exit_code, printed
from squeal.errors import ComputationError
from squeal.io.provenance import provenance
from squeal.io.writing import to_json


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a study and print its result. Returns 1 where it is wrong or fails, 2 for bad input."""
    parser = argparse.ArgumentParser(description="Run a study and print its result as JSON.")
    parser.add_argument("name", choices=STUDIES, metavar="NAME", help=", ".join(STUDIES))
    parser.add_argument("files", type=Path, nargs="*", metavar="FILE", help="what it reads")
    chosen = parser.parse_args(arguments)
    return exit_code(chosen.name, lambda: _run(chosen.name, chosen.files))


def _run(name: str, files: Sequence[Path]) -> int:
    """Compute a study from its files and print its result."""
    module = import_module(f"squeal.article.studies.{name}")
    # what is imported stays: else the garbage collector searches it again with each long motion
    gc.freeze()
    result = module.study(files)
    made = provenance(files, module.__name__)
    code = printed(to_json(replace(result, provenance=made).to_dict()))
    if result.wrong:
        raise ComputationError(f"wrong: {result.wrong}")
    return code


if __name__ == "__main__":
    sys.exit(main())
