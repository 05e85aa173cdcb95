"""Springs along the face: what points and a line do, and the sentences on it."""

import dataclasses

import numpy as np
import pytest

from squeal.article.report.physics import springs_table
from squeal.article.results.line_springs import Case, Compared, Contact, LineSprings, Threshold
from squeal.article.results.records import Missing
from squeal.article.studies import line_springs as springs_study
from squeal.equilibrium import sliding_equilibrium
from squeal.model.contact import Formulation
from squeal.model.equations import PadModel
from squeal.simulation import Simulation
from tests.article import known
from tests.conftest import hammering_scene, needs_heyoka, random_pad


def test_many_springs_move_as_the_line_does_ever_nearer():
    """A motion in partial contact: springs are a midpoint rule, whose error falls as 1/N^2."""
    own = hammering_scene("b2-b")
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
    values = known.physics(springs=none)
    assert values["physics.springs.lost"] == values["physics.springs.apart"] == ""
    assert "not compared" in values["physics.springs.against"]


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
        (0.8, 0.4, 0.001, 0.4, ("longer in (c)", "longer in (c)", "within", "no threshold")),
        (
            0.3,
            0.4,
            0.001,
            0.3,
            ("a shorter time in", "longer in (c)", "within", "$0.4$ on the line, $0.3$ on 2"),
        ),
        (0.3, 0.1, 0.2, 0.4, ("a shorter time in", "a shorter time in", "still", "no threshold")),
        (0.5, 0.2, 0.2, 0.4, ("as long in (c)", "as long in (c)", "still", "no threshold")),
    ],
)
def test_sentences_on_points_follow_the_shares(lost, apart, off, mu, words):
    values = known.physics(springs=springs(lost, apart, off, mu))
    keys = ("lost", "apart", "limit", "thresholds")
    for key, part in zip(keys, words, strict=True):
        assert part in values[f"physics.springs.{key}"]


@needs_heyoka
def test_on_two_springs_and_on_the_line_full_contact_is_the_same_motion():
    """Near the equilibrium nothing is lost on either, so that all starts are alike."""
    own = hammering_scene("b2-d")
    rest, _ = sliding_equilibrium(springs_study.on_springs(own, 0).pad_model)
    assert rest is not None
    q = np.array(rest.q)
    near = dataclasses.replace(own, initial=(*(q + 1e-3 * np.abs(q)).tolist(), 0.0, 0.0, 0.0))
    for found, windows in zip(springs_study.compared(near), springs_study.TIMES, strict=True):
        assert found.windows == windows
        assert sum(found.lost) == springs_study.SIDE**2
        assert found.apart == (0, 0, springs_study.SIDE**2)


def test_springs_inside_the_edges_part_sooner_and_lose_an_edge_later_in_the_same_motion():
    """What the report says of the geometry, pose by pose."""
    pad = random_pad(3, "B2", y0=0.0, theta0=0.0)
    line = PadModel("B2", pad)
    points = PadModel("BN", pad, Formulation(springs=2))
    off_line, off_points = [], []
    for y, theta in np.random.default_rng(2).uniform(-0.02, 0.02, (500, 2)):
        at = np.array([0.0, y, theta])
        off_line.append(line.gaps(at) > 0.0)
        off_points.append(points.gaps(at) > 0.0)
    edges, inner = np.array(off_line), np.array(off_points)
    assert np.all(inner.all(axis=1) >= edges.all(axis=1))
    assert np.all(inner.any(axis=1) <= edges.any(axis=1))
    assert np.any(inner.all(axis=1) != edges.all(axis=1))
    assert np.any(inner.any(axis=1) != edges.any(axis=1))


def test_over_starts_the_table_counts_and_the_sentence_says_what_geometry_does_not_give():
    rows: dict[str, tuple[Compared, ...]] = {
        "a": (Compared(1, (23, 30, 28), (30, 0, 51)), Compared(3, (33, 28, 20), (30, 2, 49))),
        "b": (Compared(1, (0, 34, 47), (0, 0, 81)), Compared(3, (0, 34, 47), (0, 0, 81))),
    }
    found = dataclasses.replace(springs(0.5, 0.2, 0.2, 0.4), starts=rows)
    values = known.physics(springs=found)
    assert values["physics.springs.starts"] == "81"
    assert "58 of 648 comparisons differ the other way" in values["physics.springs.against"]
    table = springs_table(found)
    assert r"surfaces apart, 3 times & 30 / 2 & 0 / 0 \\" in table
    assert r"some contact lost, one time & 23 / 30 & 0 / 34 \\" in table
    same: dict[str, tuple[Compared, ...]] = {"a": (Compared(1, (0, 30, 51), (30, 0, 51)),)}
    values = known.physics(springs=dataclasses.replace(found, starts=same))
    assert "no start differs the other way" in values["physics.springs.against"]
