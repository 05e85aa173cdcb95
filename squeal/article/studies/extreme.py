"""`python -m extreme > results/extreme.json`: the suite of stiff and extreme cases."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict

from squeal.article.extreme.cases import CASES
from squeal.article.extreme.run import longer, run_case
from squeal.files.provenance import provenance
from squeal.files.writing import to_json


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all cases and print the outcomes as JSON; exit code 1 if one is wrong."""
    parser = argparse.ArgumentParser(description="Run the suite of stiff and extreme cases.")
    parser.add_argument("--long", action="store_true", help="the long runs over 1e6 periods")
    given = parser.parse_args(arguments)
    outcomes = [run_case(longer(case) if given.long else case) for case in CASES]
    where = provenance([], "squeal.article.studies.extreme")
    print(to_json({"cases": [asdict(o) for o in outcomes], "provenance": where.to_dict()}), end="")
    return 1 if any(o.outcome == "wrong" for o in outcomes) else 0


if __name__ == "__main__":
    sys.exit(main())
