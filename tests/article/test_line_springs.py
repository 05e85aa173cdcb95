"""Springs along the face: what points and a line do, and the sentences on it."""

import dataclasses

import numpy as np
import pytest

from squeal.article.results.line_springs import Case, Compared, Contact, LineSprings, Threshold
from squeal.article.studies import line_springs as springs_study
from squeal.equilibrium import sliding_equilibrium
from squeal.files.records import Missing
from squeal.scene import read_scene
from squeal.simulation import Simulation
from tests.article import known
from tests.conftest import HAMMERING as SCENES
from tests.conftest import needs_heyoka


def test_many_springs_move_as_the_line_does_ever_nearer():
    """A motion in partial contact: springs are a midpoint rule, whose error falls as 1/N^2."""
    own = read_scene(SCENES / "b2-b.yaml", "simulate")
    line = springs_study._run(own, 0)
    assert isinstance(line, Simulation)
    off = []
    for count in (8, 32):
        run = springs_study._run(own, count)
        assert isinstance(run, Simulation)
        off.append(springs_study._contact(own, count, run, line).off)
    assert 4.0 < off[0] / off[1] < 40.0


def test_nothing_is_compared_where_no_motion_reaches_its_end():
    why = Missing("the pad has turned past 90 degrees")
    points: dict[str, tuple[Threshold, ...]] = {"0": ()}
    none = LineSprings(
        cases={"c": Case(why, (why,), False, points)}, starts={}, stop=1.0, mu_max=2.0
    )
    assert "depends on the case" in known.physics(springs=none)["physics.springs.verdict"]


def springs(lost: float, apart: float, off: float, mu: float) -> LineSprings:
    """Two springs beside a line that loses contact for half of the time, and is apart for some."""
    few, many = Contact(2, lost, apart, 1, 2.0, 0.5), Contact(32, 0.5, 0.2, 1, 2.0, off)
    points: dict[str, tuple[Threshold, ...]] = {
        "0": (Threshold(0.4, "flutter"),),
        "2": (Threshold(mu, "flutter"),),
    }
    line = Contact(0, 0.5, 0.2, 1, 2.0, 0.0)
    return LineSprings(
        cases={"c": Case(line, (few, many), True, points)}, starts={}, stop=1.0, mu_max=2.0
    )


@pytest.mark.parametrize(
    ("lost", "apart", "off", "mu", "words"),
    [
        (0.8, 0.4, 0.001, 0.4, ("exaggerates partial contact and separation,", "within", "no thr")),
        (
            0.3,
            0.4,
            0.001,
            0.3,
            ("exaggerates separation and understates par", "within", "is $0.3$ on 2"),
        ),
        (0.3, 0.1, 0.2, 0.4, ("understates partial contact and separation,", "still", "no thres")),
        (0.5, 0.2, 0.2, 0.4, ("depends on the case", "still", "no threshold")),
    ],
)
def test_the_verdict_on_points_follows_the_shares(lost, apart, off, mu, words):
    found = springs(lost, apart, off, mu)
    values = known.physics(springs=found)
    keys = ("verdict", "limit", "thresholds")
    for key, part in zip(keys, words, strict=True):
        assert part in values[f"physics.springs.{key}"]


@needs_heyoka
def test_on_two_springs_and_on_the_line_full_contact_is_the_same_motion():
    """Near the equilibrium nothing is lost on either, so that all starts are alike."""
    own = read_scene(SCENES / "b2-d.yaml", "simulate")
    rest, _ = sliding_equilibrium(springs_study.on_springs(own, 0).pad_model)
    assert rest is not None
    q = np.array(rest.q)
    near = dataclasses.replace(own, initial=(*(q + 1e-3 * np.abs(q)).tolist(), 0.0, 0.0, 0.0))
    found = springs_study.compared(near, 1)
    assert sum(found.lost) == springs_study.SIDE**2
    assert found.apart == (0, 0, springs_study.SIDE**2)


def test_over_starts_both_directions_are_told_for_each_case():
    rows: dict[str, tuple[Compared, ...]] = {
        "a": (Compared(1, (23, 30, 28), (30, 0, 51)), Compared(3, (33, 28, 20), (30, 0, 51))),
        "b": (Compared(1, (0, 34, 47), (0, 0, 81)), Compared(3, (0, 34, 47), (0, 0, 81))),
    }
    found = dataclasses.replace(springs(0.5, 0.2, 0.2, 0.4), starts=rows)
    values = known.physics(springs=found)
    assert "line from 30 of 162 starts and shorter from 0" in values["physics.springs.verdict"]
    assert "line from 23 of 162 starts and shorter from 64" in values["physics.springs.verdict"]
    told = values["physics.springs.starts"]
    assert "of 81 starts in each case (a, b)" in told
    assert "from 23, 0 and for a shorter time from 30, 34, for longer from 33, 0" in told
    assert "28, 34 over 3 times that time" in told
    without = known.physics(springs=springs(0.5, 0.2, 0.2, 0.4))
    assert "from the scenes' own starts" in without["physics.springs.verdict"]
