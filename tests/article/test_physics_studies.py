"""Energy that closes, springs that become the line, accuracy, stiff and extreme pads."""

import dataclasses

import numpy as np
import pytest

from squeal.article.figures import energy as energy_figure
from squeal.article.figures import line_springs as springs_figure
from squeal.article.figures import work as work_figure
from squeal.article.report.tables import extreme as extreme_table
from squeal.article.report.tables import workloads as work_table
from squeal.article.studies import accuracy as accuracy_study
from squeal.article.studies import energy as energy_study
from squeal.article.studies import extreme as extreme_study
from squeal.article.studies import line_springs as springs_study
from squeal.article.studies.__main__ import main
from squeal.article.studies._reference import reference
from squeal.article.studies.accuracy import Accuracy, compare_times
from squeal.article.studies.energy import Episode
from squeal.article.studies.extreme import Case, Errors, Extreme, Outcome
from squeal.simulation.run import Simulation, in_natural_units
from tests.conftest import HAMMERING as SCENES
from tests.conftest import hammering_scene, needs_heyoka


@pytest.fixture(scope="module")
def energy():
    return energy_study.study(sorted(SCENES.glob("b?-?.yaml")))


def test_the_work_of_the_law_is_that_of_its_episodes(energy):
    assert energy.wrong == ""
    assert len(energy.motions) == 12
    for name, motion in energy.motions.items():
        assert bool(motion.curves) is (name in energy_study.SHOWN)
        law = pytest.approx(motion.law, abs=1e-12 * motion.kinetic)
        assert sum(s.fed for s in motion.episodes) == law
    text = energy_figure.draw(energy).alternative
    assert all(words in text for words in ("B1 (c)", "B2 (c), printed law", "consistent law"))


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


@pytest.fixture
def short():
    own = hammering_scene("b2-c")
    return dataclasses.replace(own, stop=0.1 * own.stop, outputs=())


@needs_heyoka
def test_every_integrator_comes_near_the_reference(short, monkeypatch):
    monkeypatch.setattr(accuracy_study, "TOLERANCES", (1e-8,))
    exact = reference(short)
    points = []
    for name, solver in accuracy_study.SOLVERS.items():
        points += accuracy_study.points_of("c", short, exact, name, solver)
    assert [p.path for p in points] == list(accuracy_study.SOLVERS)
    assert all(p.error < 1e-5 for p in points)
    assert all(p.evaluations > p.steps for p in points)
    record = Accuracy(tuple(points), {"c": len(exact.times)}, "quad")
    assert "c: " in work_figure.draw(record).alternative
    assert "SciPy Radau" in work_table.table(record)


@needs_heyoka
def test_a_taylor_step_counts_as_its_order(short):
    from squeal.simulation.taylor import TaylorIntegrator

    _, model, start, stop = in_natural_units(short)
    for tolerance in (1e-4, 1e-9, 1e-15):
        integrator = TaylorIntegrator(model, tolerance)
        integrator.run(np.array([1, 1]), 0.0, start, 0.01 * stop, dense=False)
        assert integrator.ready().ta.order == accuracy_study.order(tolerance)


@needs_heyoka
def test_the_classical_method_is_of_order_four_within_a_contact_state():
    scene = accuracy_study.smooth(hammering_scene("b2-d"))
    scene = dataclasses.replace(scene, stop=0.2 * scene.stop, outputs=())
    exact = reference(scene)
    assert not exact.times.size
    points = accuracy_study.points_of("d", scene, exact, "RK4", accuracy_study.with_fixed_step)
    ratio = points[0].error / points[1].error
    assert 50.0 < ratio < 200.0  # steps in the ratio of the fourth root of 100


def test_extreme_pads_pass():
    some = [case for case in extreme_study.cases() if case.group != "long runs"]
    chosen = [*some[::13], some[-1]]
    outcomes = [extreme_study.outcome(case) for case in chosen]
    assert [one.outcome for one in outcomes] == ["passed"] * (len(chosen) - 1) + ["rejected"]
    record = Extreme(tuple(outcomes), 1e-9, "quad precision")
    assert extreme_study.sentences(record)["extreme-pads-agree-with-second-method"]
    assert "past 90 degrees" in extreme_table.table(record)


def test_a_wrong_answer_and_a_missing_refusal_are_seen():
    case = next(extreme_study.cases())
    off = Case("g", "n", case.scene, lambda *_: Errors("a reference", error=1e-8))
    assert extreme_study.outcome(off).outcome == "failed"
    exact = Errors("a reference", error=0.0)
    missing = Case("g", "n", case.scene, lambda *_: exact, "past 90 degrees", 1.0)
    assert extreme_study.outcome(missing).outcome == "failed"


@pytest.mark.parametrize(("word", "code"), [("passed", 0), ("failed", 1)])
def test_a_wrong_outcome_is_printed_and_fails(word, code, monkeypatch, capsys):
    outcome = Outcome("group", "name", word, 10.0, None, None, None, 1, 2, "said")
    monkeypatch.setattr(extreme_study, "study", lambda files: Extreme((outcome,), 1e-9, "exact"))
    assert main(["extreme"]) == code
    printed = capsys.readouterr()
    assert '"said"' in printed.out
    assert ("group: name" in printed.err) is bool(code)
    assert not Extreme((outcome,), 1e-9, "exact", stand_in=True).wrong
