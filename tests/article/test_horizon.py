"""The second method against closed forms and literal loads, stored horizons against new runs."""

import dataclasses
import random

import mpmath as mp
import numpy as np
import pytest

from benchmarks.horizon import STORED, compute, lyapunov_exponent
from squeal.article.figures import horizon as horizon_figure
from squeal.article.report.tables import horizons as horizon_table
from squeal.article.studies import _independent
from squeal.article.studies.extreme import UPRIGHT, bounce_times
from squeal.article.studies.horizon import first_excess, sentences, study
from squeal.errors import ComputationError
from squeal.io.scene import read_scene
from squeal.model.contact import CONSISTENT
from squeal.model.pad import Pad
from squeal.queries.pads.equilibrium import analyse
from squeal.simulation.run import in_natural_units
from tests import naive
from tests.conftest import ROOT, needs_heyoka, random_pad


@pytest.mark.parametrize("model", ["B1", "B2"])
@pytest.mark.parametrize("touching", [(True, True), (True, False), (False, True), (False, False)])
def test_accelerations_of_the_second_method_are_the_literal_ones(model, touching):
    random_numbers = np.random.default_rng(3)
    for seed in range(4):
        pad = random_pad(seed, model)
        equations = _independent._Equations(model, pad)
        q = 0.05 * random_numbers.uniform(-1.0, 1.0, 3) * [pad.w, pad.w, 1.0]
        leading, trailing = equations.gaps(complex(q[0], q[1]), q[2])
        if model == "B2" and (leading < 0.0, trailing < 0.0) != touching:
            continue  # the integral along the line is that of the parts below the surface
        exact = naive.loads(model, pad, CONSISTENT, [mp.mpf(v) for v in q], touching)
        force, turning = equations.acceleration(touching)(complex(q[0], q[1]), q[2])
        found = [force.real * pad.m, force.imag * pad.m, turning * pad.I]
        size = max(abs(float(v)) for v in exact)
        assert np.allclose(found, [float(v) for v in exact], rtol=0.0, atol=1e-11 * size)


def test_the_second_method_bounces_as_the_closed_form_says():
    pad = Pad(**UPRIGHT)
    height = 10.0 * pad.F_n / (pad.k1 + pad.k2)
    expected = bounce_times(pad, height, 3)
    start = np.array([0.0, height, 0.0, 0.0, 0.0, 0.0])
    found = _independent.motion("B1", pad, start, np.array([1.01 * expected[-1]]))
    assert np.abs(found.times[: len(expected)] - expected).max() < 1e-13 * expected[-1]


def test_the_second_method_stops_at_the_first_contact_change_too_many(monkeypatch):
    pad = Pad(**UPRIGHT)
    height = 10.0 * pad.F_n / (pad.k1 + pad.k2)
    expected = bounce_times(pad, height, 3)
    start = np.array([0.0, height, 0.0, 0.0, 0.0, 0.0])
    stop = np.array([1.01 * expected[-1]])
    changes = len(_independent.motion("B1", pad, start, stop).times)
    assert len(_independent.motion("B1", pad, start, stop, most=changes).times) == changes
    switched = []
    switch = _independent._Run._switch

    def counted(run, point):
        switched.append(point)
        switch(run, point)

    monkeypatch.setattr(_independent._Run, "_switch", counted)
    with pytest.raises(ComputationError, match="more than 1 contact changes"):
        _independent.motion("B1", pad, start, stop, most=1)
    assert len(switched) == 2


@needs_heyoka
def test_the_lyapunov_exponent_near_an_unstable_equilibrium_is_its_growth_rate():
    scene = read_scene(ROOT / "workflow/scenes/b2-c.yaml")
    analysis = analyse(scene)
    x, y, angle = analysis.q
    near = (x, y * (1.0 + 1e-9), angle, 0.0, 0.0, 0.0)
    growth = max(root.value.real for root in analysis.spectrum.eigenvalues)
    scene = dataclasses.replace(scene, initial=near, stop=15.0 / growth)
    units, *_ = in_natural_units(scene)
    assert lyapunov_exponent(scene) / units.time == pytest.approx(growth, rel=0.1)


def test_the_first_excess_is_the_first():
    times = np.array([0.0, 1.0, 2.0, 3.0])
    errors = np.array([0.0, 2e-9, 1e-10, 1.0])
    assert first_excess(times, errors, 1e-9) == 1.0
    assert first_excess(times, errors, 2.0) is None


@pytest.fixture(scope="module")
def stored():
    return study([STORED])


@needs_heyoka
def test_a_stored_run_chosen_at_random_comes_again(stored):
    cheap = [run for run in stored.runs if run.changes < 100]
    old = random.choice(cheap)
    new = compute(old.model, old.stiffness, old.window)
    assert new.changes == old.changes
    assert new.one == old.one
    # in quad precision nothing depends on the machine; doubles are rounded elsewise on others
    assert np.allclose(new.errors.start, old.errors.start, rtol=0.02)
    assert new.exponent == pytest.approx(old.exponent, rel=0.2, abs=0.1)
    if old.horizon is not None:
        assert new.horizon is not None
        assert new.horizon[0] == pytest.approx(old.horizon[0], rel=0.3)


def test_the_stored_runs_say_what_the_paper_says(stored):
    assert all(sentences(stored).values())
    for model in ("B1", "B2"):
        stiffnesses = [run.stiffness for run in stored.with_model(model)]
        assert stiffnesses == sorted(set(stiffnesses))
        assert {1e3, 1e4, 1e6} <= set(stiffnesses)


def test_the_error_grows_from_rounding_and_never_from_the_contact_changes(stored):
    for run in stored.runs:
        assert run.window <= 10.0
        lost = run.horizon
        if lost is None:
            assert run.changes == run.found[0] == run.found[1]


def test_figure_and_table_show_every_run(stored):
    text = horizon_figure.draw(stored).alternative
    table = horizon_table.table(stored)
    for model in ("B1", "B2"):
        runs = stored.with_model(model)
        assert text.count(f"{model} ") == table.count(f"{model}, ") == len(runs)
    assert r"\emph{beyond}" in table


def test_the_alternative_text_gives_the_predicted_horizon_and_not_as_the_exponent(stored):
    text = horizon_figure.draw(stored).alternative
    stiff = next(run for run in stored.runs if run.stiffness == 1e4)
    assert f"predicted by the exponent: {stiff.predicted:.2g}" in text
    regular = dataclasses.replace(stored.runs[0], exponent=0.0)
    drawn = horizon_figure.draw(dataclasses.replace(stored, runs=(regular, *stored.runs[1:])))
    assert "predicted by the exponent: none" in drawn.alternative


def test_a_sentence_falls_where_no_run_has_a_horizon(stored):
    runs = tuple(dataclasses.replace(run, double=((None, None),)) for run in stored.runs)
    checks = sentences(dataclasses.replace(stored, runs=runs))
    assert not checks["the-motion-amplifies-the-errors"]
    assert not checks["stiff-contact-has-a-horizon"]


def test_a_sentence_falls_where_the_second_method_disagrees(stored):
    runs = []
    for run in stored.runs:
        if run.horizon:
            runs.append(dataclasses.replace(run, independent=(0.1 * run.horizon[0], None)))
        else:
            runs.append(run)
    changed = dataclasses.replace(stored, runs=tuple(runs))
    assert not sentences(changed)["the-motion-amplifies-the-errors"]
