"""What moves between repeats is printed with its ends, and sentences hold at both."""

import json

import numpy as np
import pytest

from squeal.article.records import Moved, Record, Result, bound, to_dict
from squeal.article.report import printed, values
from squeal.article.report.latex import with_spread
from squeal.article.studies._spread import SIZE, at_ends, disturbed, moved
from squeal.errors import ComputationError


class Row(Record):
    count: int
    share: float
    name: str


class Rows(Result):
    rows: dict[str, tuple[Row, ...]]


FOUND = [Row(76, 0.25, "a"), Row(73, 0.25 + 1e-12, "b"), Row(79, 0.25, "a")]
SPREAD = moved("rows.x.1", FOUND)
ROWS = Rows({"x": (Row(5, 0.5, "c"), FOUND[0])}, spread=SPREAD)


def test_numbers_that_move_are_named_with_their_ends():
    assert (Moved("rows.x.1.count", 73, 79),) == SPREAD
    assert ROWS.ends("rows.x.1.count") == (73, 79)
    assert ROWS.ends("rows.x.1.share") is None
    assert moved("shares", [0.1, 0.3]) == (Moved("shares", 0.1, 0.3),)


def test_a_result_is_looked_at_where_it_stands_and_at_both_ends(tmp_path):
    file = tmp_path / "rows.json"
    file.write_text(json.dumps(to_dict(ROWS)))
    read = Rows.read(file)
    assert read == ROWS
    counts = [one.rows["x"][1].count for one in at_ends(read)]
    assert counts == [76, 73, 79]
    assert at_ends(Rows({})) == (Rows({}),)
    with pytest.raises(KeyError):
        at_ends(Rows({}, spread=SPREAD))


def test_a_sentence_that_fails_at_one_end_stops_the_build(monkeypatch):
    from squeal.article.report import __main__ as report

    class Study:
        least = 70

        @classmethod
        def sentences(cls, record):
            return {"most-last": record.rows["x"][1].count > cls.least}

    monkeypatch.setattr(report, "records", lambda files: [(Study, ROWS)])
    assert report.checked({}) == {"most-last": True}
    monkeypatch.setattr(Study, "least", 75)
    with pytest.raises(ComputationError, match="most-last"):
        report.checked({})


def test_texts_show_the_ends_where_digits_differ():
    results = {"a": to_dict(ROWS)}
    text = r"\val{a.rows.x.1.count} of \val{a.rows.x.0.count}, \val[p0]{a.rows.x.1.share}"
    assert values.filled(text, results) == r"$76$ ($73$--$79$) of $5$, $25$\,\%"
    assert with_spread(0.5, (0.4, 0.6), lambda v: rf"${100 * v:.0f}$\,\%") == (
        r"$50$ ($40$--$60$)\,\%"
    )
    assert with_spread(0.161, (0.159, 0.163), lambda v: f"{100 * v:.0f}") == "16"


@pytest.mark.parametrize(
    ("one", "other", "agree"),
    [
        ("$76$ ($73$--$79$) of 100", "$81$ ($79$--$83$) of 100", True),
        ("$76$ ($73$--$79$) of 100", "$81$ ($80$--$83$) of 100", False),
        ("$76$ ($73$--$79$) of 100", "$79$ of 100", True),
        ("$76$ ($73$--$79$) of 100", "$76$ ($73$--$79$) of 101", False),
        (r"17 (16--18)\,\% a", r"18\,\% a", True),
        (r"$1.5 \times 10^{-3}$", r"$1.5 \times 10^{-4}$", False),
        ("$-0.02$", "$0.02$", False),
        (r"less than $1 \times 10^{-15}$", r"less than $1 \times 10^{-16}$", True),
        ("hammers in c", "hammers in d", False),
    ],
)
def test_texts_agree_where_ranges_meet(one, other, agree):
    assert printed.same(one, other) is agree
    assert printed.same(other, one) is agree
    assert bool(printed.differences(f"x\n{one}\n", f"x\n{other}\n")) is not agree


def test_starts_are_disturbed_by_rounding_and_alike_each_time():
    states = np.array([[1.0, -2.0, 0.0], [3.0, 4.0, 5.0]])
    assert disturbed(states, 0) is states
    first = disturbed(states, 1)
    assert (first == disturbed(states, 1)).all()
    assert (first != disturbed(states, 2))[states != 0.0].all()
    assert 0.0 < np.abs(first - states).max() <= SIZE * 5.0


@pytest.mark.parametrize("residual", [3e-17, 1.2e-16, 4.9e-14, -7e-13])
def test_a_bound_of_rounding_is_a_power_of_ten_above_it(residual):
    assert 2.0 * abs(residual) <= float(bound(residual)) <= 20.0 * abs(residual)
    assert bound(0.0) == "1e-16"
