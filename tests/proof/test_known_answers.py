"""Answers that are known by construction contradict neither the toolkit nor the referee."""

import pytest

pytest.importorskip("flint")

from benchmarks.refute import FAMILIES, OVER_MU, ask


@pytest.mark.parametrize("family", FAMILIES)
def test_no_answer_contradicts_what_is_known_by_construction(family):
    # `make refute` asks thousands
    asked, rows = (1, 6) if family in OVER_MU else (2, 10)
    for number in range(asked):
        outcome = ask(family, [7, FAMILIES.index(family), number], rows)
        assert outcome.name in ("proved", "certified", "right", "open"), outcome.said
        assert not outcome.faults
