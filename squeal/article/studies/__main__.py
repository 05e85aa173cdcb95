"""`python -m squeal.article.studies NAME FILE ...`: a study's result as JSON.

FILEs are what the study reads: scenes, or stored searches. Its own switches are flags.
"""

import argparse
import inspect
import pkgutil
import sys
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path

from squeal.article import studies
from squeal.cli.streams import exit_code, printed
from squeal.errors import ComputationError
from squeal.io.provenance import provenance
from squeal.io.writing import to_json

NAMES = tuple(m.name for m in pkgutil.iter_modules(studies.__path__) if m.name[0] != "_")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a study and print its result. Returns 1 where it is wrong or fails, 2 for bad input."""
    first = argparse.ArgumentParser(description="Run a study and print its result as JSON.")
    first.add_argument("name", choices=NAMES, metavar="NAME", help=", ".join(NAMES))
    first.add_argument("rest", nargs=argparse.REMAINDER, metavar="FILE", help="what it reads")
    chosen = first.parse_args(arguments)
    return exit_code(chosen.name, lambda: _run(chosen.name, chosen.rest))


def _run(name: str, rest: Sequence[str]) -> int:
    module = import_module(f"squeal.article.studies.{name}")
    parser = argparse.ArgumentParser(prog=name, description=module.__doc__)
    parser.add_argument("files", type=Path, nargs="*", metavar="FILE")
    for option in inspect.signature(module.study).parameters.values():
        if option.kind is option.KEYWORD_ONLY:
            parser.add_argument(f"--{option.name}", action="store_true")
    given = vars(parser.parse_args(rest))
    files = given.pop("files")
    result = module.study(files, **given)
    made = provenance(files, module.__name__)
    code = printed(to_json(replace(result, provenance=made).to_dict()))
    if result.wrong:
        raise ComputationError(f"wrong: {result.wrong}")
    return code


if __name__ == "__main__":
    sys.exit(main())
