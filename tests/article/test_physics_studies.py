"""Energy that closes, springs that become the line, accuracy, stiff and extreme pads."""

import dataclasses

import numpy as np
import pytest

from squeal.article.figures import accuracy as accuracy_figure
from squeal.article.figures import energy as energy_figure
from squeal.article.figures import line_springs as springs_figure
from squeal.article.studies import accuracy as accuracy_study
from squeal.article.studies import energy as energy_study
from squeal.article.studies import extreme as extreme_study
from squeal.article.studies import line_springs as springs_study
from squeal.article.studies.__main__ import main
from squeal.article.studies._reference import reference
from squeal.article.studies.accuracy import Accuracy, compare_times
from squeal.article.studies.energy import Episode
from squeal.article.studies.extreme import Case, Extreme, Outcome
from squeal.simulation.run import Simulation
from tests.conftest import HAMMERING as SCENES
from tests.conftest import hammering_scene, needs_heyoka


@pytest.fixture(scope="module")
def energy():
    return energy_study.study(sorted(SCENES.glob("b?-?.yaml")))


def test_energy_comes_from_somewhere(energy):
    assert energy.wrong == ""
    assert len(energy.motions) == 12
    for name, motion in energy.motions.items():
        assert bool(motion.curves) is (name in energy_study.SHOWN)
        law = pytest.approx(motion.law, abs=1e-12 * motion.kinetic)
        assert sum(s.fed for s in motion.episodes) == law
    text = energy_figure.draw(energy).alternative
    assert all(words in text for words in ("B1 (c)", "B2 (c), printed law", "integral law"))


def test_a_law_with_a_potential_that_feeds_energy_in_stops_the_build(energy):
    for name in ("b1-c", "b2-c-integral"):
        motion = energy.motions[name]
        fed = dataclasses.replace(motion, episodes=(Episode(0.0, 1.0, 1e-6 * motion.kinetic),))
        assert name in dataclasses.replace(energy, motions={name: fed}).wrong
    opened = dataclasses.replace(energy.motions["b1-c"], residue=1e-6)
    assert "open" in dataclasses.replace(energy, motions={"b1-c": opened}).wrong


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


def test_the_springs_figure_draws_every_number_of_springs(monkeypatch):
    monkeypatch.setattr(springs_study, "COUNTS", (2, 4))
    record = springs_study.LineSprings({"b": springs_study.case(hammering_scene("b2-b"))}, 1.0)
    lost = springs_figure.springs_figure(record).axes[0].get_lines()[0]
    springs = [one for one in record.cases["b"].springs if isinstance(one, springs_study.Contact)]
    assert np.array_equal(lost.get_ydata(), [one.lost for one in springs])


@pytest.mark.parametrize(
    ("times", "exact", "wrong"),
    [
        ([1.0, 2.0], [1.0, 2.0], (0, 0)),
        ([1.0], [1.0, 2.0], (1, 0)),
        ([1.0, 1.5, 2.0], [1.0, 2.001], (0, 1)),
        ([0.5, 2.0], [1.0, 2.0], (1, 1)),
    ],
)
def test_changes_that_are_missed_or_made_up_are_counted(times, exact, wrong):
    assert compare_times(np.array(times), np.array(exact)) == wrong


@needs_heyoka
def test_every_path_comes_near_the_reference(monkeypatch):
    monkeypatch.setattr(accuracy_study, "TOLERANCES", (1e-8,))
    own = hammering_scene("b2-c")
    scene = dataclasses.replace(own, stop=0.1 * own.stop, outputs=())
    exact = reference(scene)
    points = [
        point
        for name, way in accuracy_study.WAYS.items()
        for point in accuracy_study.points_of("c", scene, exact, name, way)
    ]
    assert [p.path for p in points] == list(accuracy_study.WAYS)
    assert all(p.error < 1e-5 for p in points)
    record = Accuracy(tuple(points), {"c": len(exact.times)}, "quad")
    assert "SciPy Radau" in accuracy_figure.draw(record).alternative


def test_extreme_pads_pass():
    some = [case for case in extreme_study.cases() if case.group not in ("long runs",)]
    chosen = [*some[::7], some[-1]]
    outcomes = [extreme_study.outcome(case) for case in chosen]
    assert [one.outcome for one in outcomes] == ["passed"] * (len(chosen) - 1) + ["rejected"]


def test_a_wrong_answer_and_a_missing_refusal_are_seen():
    case = next(extreme_study.cases())
    off = Case("g", "n", case.scene, lambda *_: (1e-8, "a reference"))
    assert extreme_study.outcome(off).outcome == "failed"
    missing = Case("g", "n", case.scene, lambda *_: (0.0, "a reference"), "past 90 degrees", 1.0)
    assert extreme_study.outcome(missing).outcome == "failed"


@pytest.mark.parametrize(("word", "code"), [("passed", 0), ("failed", 1)])
def test_a_wrong_outcome_is_printed_and_fails(word, code, monkeypatch, capsys):
    outcome = Outcome("group", "name", word, None, 1, 2, "said")
    monkeypatch.setattr(extreme_study, "study", lambda files: Extreme((outcome,), 1e-9, "exact"))
    assert main(["extreme"]) == code
    printed = capsys.readouterr()
    assert '"said"' in printed.out
    assert ("group: name" in printed.err) is bool(code)
    assert not Extreme((outcome,), 1e-9, "exact", stand_in=True).wrong
