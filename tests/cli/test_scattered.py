"""`squeal scatter`: file of tolerances, answer, table, picture, refusals."""

import numpy as np
import pytest
from scipy.stats import norm

from tests.cli.calls import answer

SYSTEM = """name: coupled
parameters: {a: 3.0, b: 2.0, k: 0.5, mu: 1.0}
parameter: mu
M: [[1, 0], [0, 1]]
K:
  - {matrix: [[1, 0], [0, 0]], factor: a}
  - {matrix: [[0, 0], [0, 1]], factor: b}
  - {matrix: [[0, -1], [-1, 0]], factor: k}
  - {matrix: [[0, 1], [0, 0]], factor: mu}
"""
SPREADS = "samples: 24\nseed: 7\nspreads:\n  a: {absolute: 0.2}\n"


def exact(level):
    """Flutter from k + (a - b)^2 / 4 k on, and a - b is normal, hardly ever below 0."""
    return 0.5 + norm.ppf(level, 1.0, 0.2) ** 2 / 2.0


def test_the_answer_is_that_of_the_closed_form(capsys, tmp_path):
    names = ("coupled.yaml", "spreads.yaml", "t.csv", "p.png")
    system, spreads, table, picture = (tmp_path / name for name in names)
    system.write_text(SYSTEM)
    spreads.write_text(SPREADS)
    files = ("--csv", table, "--png", picture)
    found = answer(capsys, "scatter", system, spreads, *files)
    assert {one["name"] for one in found["provenance"]["inputs"]} == {*names[:2]}
    found = found["scatter"]
    assert (found["samples"], found["seed"], found["failed"]) == (24, 7, 0)
    assert found["spreads"] == [{"name": "a", "kind": "absolute", "size": 0.2}]
    held = [(q["low"] or 0) <= exact(q["level"]) <= (q["high"] or 9) for q in found["quantiles"]]
    assert sum(held) >= len(held) - 1
    assert found["interval"][0] <= found["stable"] <= found["interval"][1]
    mus, share = np.loadtxt(table, skiprows=1, delimiter=",", usecols=(0, 1)).T
    assert np.allclose(share, np.arange(1, 25) / 24)
    assert np.mean(mus > 1.0) == pytest.approx(found["stable"])
    assert picture.read_bytes().startswith(b"\x89PNG")
