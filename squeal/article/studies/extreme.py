"""The suite of stiff and extreme cases, each held against the truth."""

from collections.abc import Sequence
from pathlib import Path

from squeal.article.extreme.cases import CASES
from squeal.article.extreme.run import RIGHT, longer, run_case
from squeal.article.results.extreme import Extreme
from squeal.errors import InputError
from squeal.io.provenance import NOT_INSTALLED, version
from squeal.simulation.reference import TOLERANCE, precision_in_words


def study(files: Sequence[Path] = (), *, long: bool = False) -> Extreme:
    """All outcomes; `long`: the long runs over 1e6 periods. The cases need no files."""
    if files:
        raise InputError(f"{files[0]}: is not allowed; the suite needs no files")
    outcomes = tuple(run_case(longer(case) if long else case) for case in CASES)
    how = (TOLERANCE, precision_in_words(), version("heyoka") == NOT_INSTALLED)
    return Extreme(outcomes, RIGHT, *how)
