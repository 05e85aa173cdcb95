"""Fig. 13: the study's sentences on both sides, its parameter sets, and what the figure shows."""

import dataclasses
import math

import numpy as np
import pytest

from squeal.article.cases import CASES
from squeal.article.contents import STUDIES
from squeal.article.equations import Readings, bounds
from squeal.article.figures import quasi_static as figure_of
from squeal.article.outline import Outline
from squeal.article.records import from_dict
from squeal.article.studies import quasi_static as study_of
from squeal.article.studies.angles import Angles, Shares
from squeal.io.scene import read_scene
from tests.conftest import ROOT


@pytest.fixture(scope="module")
def record():
    return study_of.study([ROOT / file for file in STUDIES["quasi_static"]])


def test_sentences_hold_and_the_record_comes_back(record):
    assert all(study_of.sentences(record).values())
    back = from_dict(study_of.QuasiStatic, record.to_dict())
    assert back.state == record.state
    assert back.cases == record.cases
    assert back.sets == record.sets


def test_sets_are_the_four_and_the_reference_is_the_map(record):
    assert list(record.sets) == ["reference", "set-2", "set-3", "set-4"]
    assert record.sets["reference"] == record.share
    region = record.complete.area[1] / math.pi**2
    assert region == pytest.approx(record.share.complete, abs=2e-3)


CHANGES = [
    ("printed-conditions-hold-on-a-small-part", {"share": Readings(0.11, 0.2)}),
    ("complete-conditions-hold-on-a-small-part", {"share": Readings(0.04, 0.26)}),
    (
        "complete-conditions-hold-on-more-than-a-quarter-with-other-sets",
        {"sets": {"reference": Readings(0.04, 0.17), "set-2": Readings(0.04, 0.2)}},
    ),
    ("printed-conditions-leave-out-a-part", {"share": Readings(0.17, 0.17)}),
]


@pytest.mark.parametrize(("name", "change"), CHANGES)
def test_a_sentence_fails_where_its_premise_does(record, name, change):
    assert not study_of.sentences(dataclasses.replace(record, **change))[name]


def test_a_case_on_the_curve_is_seen(record):
    """Equal springs and angles: K31 = h K11 where tan(alpha) = -2 h/w."""
    pad = read_scene(ROOT / "workflow/scenes/b2-c.yaml").pad.replace(k2=1.5e8)
    angle = math.pi - math.atan(2 * pad.h / pad.w)
    there = study_of.case_rows(pad.replace(alpha1=angle, alpha2=angle))
    assert there.exists
    assert there.mismatch == pytest.approx(0.0, abs=1e-12)
    assert pytest.approx(pad.F_n, rel=1e-12) == there.rows.R_12
    changed = dataclasses.replace(record, cases=record.cases | {"c": there})
    assert not study_of.sentences(changed)["no-case-is-on-the-curve"]
    beside = study_of.case_rows(pad.replace(alpha1=angle, alpha2=angle + 1e-6))
    assert not beside.exists


def test_the_curve_ends_where_the_reaction_changes_its_sign():
    """At much friction only a part of K31 = h K11 bears a positive reaction."""
    pad = read_scene(ROOT / "workflow/scenes/b3.yaml").pad
    length = {}
    for mu in (0.1, 0.9):
        curves = study_of.state_curves(pad.replace(mu=mu), 60)
        steps = [np.linalg.norm(np.diff(np.array(one), axis=0), axis=1) for one in curves]
        length[mu] = sum(one.sum() for one in steps)
        points = np.array([point for one in curves for point in one[1:-1]]).T
        assert np.all(bounds(pad.replace(mu=mu), (points[0], points[1])).complete)
    assert length[0.9] < length[0.1]


def test_four_panels_show_the_cases_at_their_places(record):
    square = np.array([[[0, 0], [np.pi, 0], [np.pi, np.pi], [0, np.pi]]])
    empty = Outline(np.empty((0, 2, 2)), np.empty((0, 2), int), square, np.array([3]))
    angles = Angles(record.mu, empty, Shares(1.0, 1.0, 1.0, 1.0))
    drawing = figure_of.draw(record, angles)
    axes = drawing.figure.axes
    assert [one.get_title()[:3] for one in axes] == ["(a)", "(b)", "(c)", "(d)"]
    for one in axes:
        dots = [line for line in one.lines if line.get_marker() == "o"]
        places = np.array([np.asarray(line.get_xydata())[0] for line in dots]) * np.pi
        assert np.allclose(places, list(CASES.values()))
        assert [text.get_text() for text in one.texts] == list(CASES)
    curves = [line for line in axes[2].lines if line.get_marker() != "o"]
    assert len(curves) == len(record.state)
    assert f"{100 * record.share.complete:.1f} % of the map" in drawing.alternative
    assert drawing.figure.get_figwidth() == pytest.approx(6.9)
