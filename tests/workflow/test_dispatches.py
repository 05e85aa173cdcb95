"""Other instructions and another compilation: the numbers that the report prints stay the same.

`make dispatches` compares every study; here one motion that forgets its start, and one study.
"""

import json
import os
import subprocess
import sys

import pytest

from squeal.article.contents import STUDIES
from squeal.article.report.printed import meet
from tests.conftest import ROOT, needs_heyoka
from workflow.trials import dispatches

ROWS = """
import json, sys
from pathlib import Path
from squeal.article.cases import HISTORY_FIGURES
from squeal.article.records import to_dict
from squeal.article.studies._spread import moved, numbers
from squeal.article.studies import onset
from squeal.article.studies._scenes import read_scenes
if sys.argv[1] == "otherwise":
    from workflow.trials.dispatches import otherwise
    otherwise()
onset.STARTS = 20  # of 100, one of which lasts
onset.REPEATS = 1  # of 3
scenes = read_scenes([Path(file) for file in sys.argv[2:]], HISTORY_FIGURES)
scene = onset.under_both_laws(scenes)["b2-b-mean"]
row, _ = onset.after(scene, onset.RATIOS[0])
found = onset.repeats(scene, onset.RATIOS[0], row)
ends = {name: (value, value) for name, value in numbers(row)}
ends |= {one.key.strip("."): (one.low, one.high) for one in moved("", found)}
print(json.dumps([len(found), ends]))
"""


def rows(how, **variables):
    """How often the motions were run, and the ends of each number of the row."""
    run = subprocess.run(
        [sys.executable, "-c", ROWS, how, *STUDIES["onset"]],
        cwd=ROOT,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"} | variables,
        stdout=subprocess.PIPE,
        check=True,
    )
    return json.loads(run.stdout)


@needs_heyoka
def test_motions_that_forget_their_start_agree_within_their_spread():
    variables = dispatches.SURROUNDINGS["SSE"].variables
    count, here = rows("plain")
    _, there = rows("otherwise", **variables)
    assert count > 1
    assert here != there
    assert here.keys() == there.keys()
    for name, ends in here.items():
        if "face" not in name:  # of an edge at rest: rounding
            assert meet(ends, there[name]) or ends == pytest.approx(there[name], rel=1e-6), name


def test_numbers_of_scenes_are_changed_alike():
    text = "k1: 1.5e8  # 2.5\nL1: 0.04\nL2: 0.04\nalpha1: 0.75*pi\nmu: 0.32\nsamples: 4001\n"
    other = dispatches.changed(text)
    assert other != text
    values = dict(line.split(": ") for line in other.splitlines())
    assert values["L1"] == values["L2"] != "0.04"
    assert float(values["mu"]) == pytest.approx(0.32, rel=2 * dispatches.RELATIVE)
    assert values["samples"] == "4001"
    assert values["alpha1"].endswith("*pi")
