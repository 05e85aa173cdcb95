"""Onset and attractors: what settles, and the sentences that follow it."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from squeal.article.figures import onset as figure
from squeal.article.report.onset import exponents_table, generated, lasting_table
from squeal.article.results.onset import (
    CyclePoint,
    Cycles,
    Exponent,
    Lasting,
    Late,
    Onset,
    Section,
    Sweep,
    Way,
)
from squeal.article.results.spectra import Heard, Spectra
from squeal.article.studies import onset as study
from squeal.article.studies import spectra
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.files.records import Missing
from squeal.numerics.oscillation import line
from squeal.scene import read_scene
from tests.conftest import HAMMERING as SCENES
from tests.conftest import needs_heyoka


@needs_heyoka
def test_a_cycle_s_multiplier_is_the_decay_of_a_disturbance():
    scene = read_scene(SCENES / "b1-d.yaml", "simulate")
    models = [damped_model(study.damped(scene, ratio)) for ratio in study.RATIOS]
    rows, states = study.late(scene, models)
    at = study.RATIOS.index(study.RATIO)
    row = rows[at]
    assert isinstance(row, Late)
    assert row.lost > 0.0
    found = study.cycles("b1-d", scene, states[at])
    assert isinstance(found, Cycles)
    assert found.decay == pytest.approx(found.own.multiplier, abs=1e-5)
    assert found.own.peak == pytest.approx(row.peak, rel=1e-3)
    assert not found.branch[-1].changes
    assert all(point.changes for point in found.branch[:-1])


@needs_heyoka
def test_strong_damping_brings_the_pad_to_rest():
    scene = read_scene(SCENES / "b2-b.yaml", "simulate")
    end, lost, _ = study.settled(
        [damped_model(study.damped(scene, 0.2))], np.array([scene.initial]), 0.02, 0.003
    )
    assert lost[0] == 0.0
    assert np.abs(end[0, 3:]).max() < 1e-9


@needs_heyoka
def test_a_motion_that_ends_is_missing_and_its_sweep_begins_with_the_own_start(monkeypatch):
    scene = read_scene(SCENES / "b1-d.yaml", "simulate")
    models = [damped_model(study.damped(scene, ratio)) for ratio in study.RATIOS]
    fast = np.tile(scene.initial, (4, 1))
    fast[0, 5] = 1e5  # rad/s: it turns over
    end, lost, peak = study.settled(models, fast, 0.003, 0.001)
    assert np.isnan(end[0]).all()
    assert np.isnan([lost[0], peak[0]]).all()
    assert np.isfinite(end[1:]).all()
    seen = []

    def looked_at(models, states, before, seen_for):
        seen.append(states)
        return states, np.zeros(len(states)), np.ones(len(states))

    monkeypatch.setattr(study, "settled", looked_at)
    (first, *_), last = study.sweeps(scene, models, end)
    assert (last.begins, last.ends) == (None, None)  # no contact changes
    assert np.array_equal(seen[0][4], scene.initial)
    assert np.array_equal(seen[0][5], end[1])
    assert first.down.mu[0] <= scene.pad.mu < first.up.mu[-1]


def test_no_equilibrium_means_no_threshold(monkeypatch):
    def none(*_):
        raise ComputationError("without friction no equilibrium in contact was found")

    monkeypatch.setattr(study, "critical_friction", none)
    assert study.threshold(read_scene(SCENES / "b1-d.yaml", "simulate")) is None


def made(
    lasts: bool = True,
    law: bool = True,
    threshold: float | None = 0.7,
    down: float = 0.5,
    least: float = 0.56,
    decay: float = 0.9,
    begins: float | None = 0.7,
    peak: float = 2.0,
    rate: float = 1.0,
) -> Onset:
    """A result with one motion under both laws."""
    late: dict[str, Any] = {
        "b2-c-mean": (Late(0.005, (0.4 if peak else 1.0) if lasts else 0.0, peak),),
        "b2-c-integral": (Late(0.005, 0.0 if law else 0.4, 2.0),),
    }
    up = Way((0.6, 0.7), (0.0, 0.4), (1.0, 2.0))
    sweep = Sweep(0.005, up, Way((0.7, down), (0.4, 0.3), (2.0, None)))
    points = tuple(
        CyclePoint(mu, 0.2, changes, 1.0, size)
        for mu, changes, size in ((0.8, 2, 0.9), (least, 2, 1.2), (0.7, 0, 1.0))
    )
    return Onset(
        late=late,
        step=0.05,
        sweeps={"b2-c-mean": (sweep,)},
        lasting={"b2-c-mean": Lasting(begins, down)},
        thresholds={"b2-c-mean": threshold},
        sections={"b2-c-mean": Section((0.0,), (1.0,))},
        exponents={"b2-c-mean": Exponent(0.005, rate, 0.1, 0.02, "chaotic", 40)},
        cycles=Cycles("b2-c-mean", 0.005, points[0], decay, 1e-6, points),
        ratio=0.005,
        windows=40,
        early=10,
    )


@pytest.mark.parametrize(
    ("late", "least"), [((0.0, 0.2, 0.2), 0.3), ((0.1, 0.0, 0.2), 0.2), ((0.0, np.nan, 0.0), None)]
)
def test_changes_of_contact_last_only_if_they_go_on_for_longer(monkeypatch, late, least):
    scene = read_scene(SCENES / "b1-d.yaml", "simulate")
    model = damped_model(study.damped(scene, study.RATIO))
    mu, lost = (0.5, 0.4, 0.3, 0.2, 0.1), np.array([0.5, 0.4, 0.3, 0.2, 0.0])
    ends = np.arange(30.0).reshape(5, 6)
    monkeypatch.setattr(study, "NEAREST", 3)

    def looked_at(models, states, before, seen_for):
        assert [one.pad.mu for one in models] == [0.2, 0.3, 0.4]
        assert np.array_equal(states, ends[[3, 2, 1]])
        assert before == study.LATE * scene.stop
        return states, np.array(late), np.ones(3)

    monkeypatch.setattr(study, "settled", looked_at)
    assert study.lasting(scene, model, mu, lost, ends) == least
    assert study.lasting(scene, model, mu, np.zeros(5), ends) is None


@pytest.mark.parametrize(
    ("given", "key", "words"),
    [
        ({}, "lasts", "B2 (c), printed law"),
        ({"lasts": False, "law": True}, "lasts", "no contact changes"),
        ({"peak": 0.0, "law": True}, "lasts", "no contact changes"),
        ({}, "law", "printed law alone"),
        ({"law": False}, "law", "No motion goes on"),
        ({}, "beside", "flutters from some friction"),
        ({"threshold": None}, "beside", "does not announce it"),
        ({}, "hysteresis", "with hysteresis"),
        ({"down": 0.65}, "hysteresis", "without hysteresis"),
        ({"threshold": None}, "hysteresis", "brought about by the step or the kick"),
        ({"begins": None}, "hysteresis", "no lasting changes are shown near the end of the way up"),
        ({"begins": None}, "hysteresis", "begin at $\\mu = 0.7$ die out"),
        ({}, "both", "below the friction at which"),
        ({"threshold": None}, "both", "does not flutter at all"),
        ({"down": 0.68}, "both", "both begin together"),
        ({}, "zero", "beyond its own interval"),
        ({"rate": 0.05}, "zero", "within its interval"),
        ({}, "branch", "subcritical"),
        ({"least": 0.71}, "branch", "supercritical"),
        ({"threshold": None}, "branch", "reaches down"),
        ({}, "cycle", "which agrees"),
        ({"decay": 0.8}, "cycle", "does not agree"),
        ({}, "signs", "chaotic are B2 (c)"),
    ],
)
def test_sentences_follow_the_numbers(given, key, words):
    values, _ = generated(made(**given), Spectra(scenes={}, ratio=0.005))
    assert words in values[f"onset.{key}"]


def test_tables_tell_what_is_kept_lost_and_not_settled():
    found = made()
    assert r"40\,\%, $2$" in lasting_table(found)
    assert "kept" in lasting_table(found)
    assert "& off" in lasting_table(made(peak=0.0))
    drifts = Exponent(0.0, 0.1, 0.1, 0.02, "finite-time", 40)
    others = dataclasses.replace(
        found, exponents={"b1-b, undamped": drifts, "b1-a, undamped": Missing("the model ends")}
    )
    assert "undecided" in exponents_table(others)
    assert "the model ends" in exponents_table(others)


def rows(*rates: float, left: int | None = None) -> np.ndarray:
    """Growth (40, 1) of deviations at some rates per window, NaN after `left` windows."""
    logs = np.resize(rates, 40)[:, None].astype(float)
    logs[left:] = np.nan if left else logs[left:]
    return logs


@pytest.mark.parametrize(
    ("logs", "sign", "windows"),
    [
        (rows(0.5, 0.6), "chaotic", 40),
        (rows(0.5, 0.6, left=30), "ends", 30),
        (rows(-0.1, 0.1), "no growth", 40),
        (np.linspace(0.1, 2.0, 40)[:, None], "finite-time", 40),
        # in proportion to time: ln t drifts for ever and is no growth
        (np.diff(np.log(np.arange(1.0, 42.0)))[:, None], "no growth", 40),
    ],
)
def test_what_rates_of_growth_tell(logs, sign, windows):
    scene = read_scene(SCENES / "b1-c.yaml", "simulate")
    found = study.exponent(scene, logs, np.ones(6), 1.0, study.RATIO)
    assert isinstance(found, Exponent)
    assert (found.sign, found.windows) == (sign, windows)


def test_what_ends_at_once_has_no_rate():
    scene = read_scene(SCENES / "b1-c.yaml", "simulate")
    found = study.exponent(scene, rows(0.5, left=5), np.ones(6), 1.0, study.RATIO)
    assert isinstance(found, Missing)


@pytest.mark.parametrize(
    ("pairs", "words", "without"),
    [
        ([(8.0, 9.0), (15.0, 15.5)], ("$8$ to $15$", "at most $1$"), "outgrow"),
        ([(60.0, 80.0)], ("In B1 (a) deviations outgrow",), "variational"),
        ([(60.0, 80.0), (8.0, 9.0)], ("In B1 (a) deviations outgrow", "at most $1$"), "nothing"),
    ],
)
def test_two_methods_are_compared_while_they_follow_one_motion(pairs, words, without):
    ended: dict[str, Exponent | Missing] = {
        f"b1-{case}, undamped": Exponent(0.0, 0.5, 0.1, 0.02, "ends", 90, *pair)
        for case, pair in zip("ab", pairs, strict=False)
    }
    values, _ = generated(
        dataclasses.replace(made(), exponents=ended), Spectra(scenes={}, ratio=0.005)
    )
    assert "no exponent exists" in values["onset.signs"]
    assert all(part in values["onset.second"] for part in words)
    assert without not in values["onset.second"]
    assert values["onset.longest"] == "90"


@needs_heyoka
def test_undamped_growth_is_that_of_the_variational_equations():
    scenes = {"b2-c": read_scene(SCENES / "b2-c.yaml", "simulate")}
    starts = {name: np.array(one.initial) for name, one in scenes.items()}
    found = study.exponents(scenes, starts, 0.0)["b2-c"]
    assert found.windows == study.LASTING
    assert found.sign == "chaotic"
    assert found.early == pytest.approx(found.variational, abs=0.05)


def test_without_a_cycle_the_reason_is_given():
    found = dataclasses.replace(made(), cycles=Missing("the motion does not return to itself"))
    values, _ = generated(found, Spectra(scenes={}, ratio=0.005))
    assert "does not return" in values["onset.cycle"]


def test_share_of_the_power_at_multiples_of_a_frequency():
    """Two harmonics and a line between them, whose share of the power is by hand."""
    t = 0.01 * np.arange(5000)  # ms
    signal = 2.0 * np.sin(2 * np.pi * 5.0 * t) + 1.0 * np.sin(2 * np.pi * 10.0 * t + 1.0)
    assert spectra.tonal(signal, 0.01, 5.0) == pytest.approx(1.0, abs=1e-6)
    both = signal + np.sqrt(5.0) * np.sin(2 * np.pi * 7.3 * t)
    assert spectra.tonal(both, 0.01, 5.0) == pytest.approx(0.5, abs=1e-3)


@needs_heyoka
def test_hammering_sounds_at_the_frequency_of_its_cycle_and_growth_at_that_of_its_mode():
    """Shooting and the linearisation against the spectrum of a simulation."""
    scene = study.damped(read_scene(SCENES / "b1-d.yaml", "simulate"), study.RATIO)
    one = spectra.heard(scene)
    assert one is not None
    assert one.onset is not None
    t, force, _ = spectra.contact_force(scene)
    early = (t > 0.3 * one.onset) & (t < 0.9 * one.onset)
    first, _ = line(force[early, None], float(t[1]))
    assert first == pytest.approx(one.growing, rel=5e-3)
    assert one.tonal > 0.99
    pad = study.shooting(scene, study.RATIO)
    own = pad.units.to_scaled(np.array(scene.initial))
    state = pad.motion(own, study.LATE * scene.stop / pad.units.time, scene.pad.mu)
    found = study.cycles("b1-d", scene, pad.units.to_si(state))
    assert isinstance(found, Cycles)
    assert one.strongest * found.own.period == pytest.approx(1.0, rel=1e-4)


def sounds(strongest: float, tonal: float) -> Spectra:
    heard = Heard((5.0,), 5.0, 0.1, 1.0, strongest, tonal, (), (), (), (), ())
    return Spectra(scenes={"b1-d": heard}, ratio=0.005)


@pytest.mark.parametrize(
    ("strongest", "tonal", "period", "words"),
    [
        (5.0, 0.99, 0.2, ("at that of its", "a tone", "has the same frequency")),
        (4.5, 0.5, 0.2, (r"10.0\,\% below", "no tone", "has another frequency")),
        (5.5, 0.5, 0.2, (r"10.0\,\% above", "no tone", "has another frequency")),
    ],
)
def test_the_sentence_on_pitch_follows_the_spectrum(strongest, tonal, period, words):
    found = made()
    assert isinstance(found.cycles, Cycles)
    own = dataclasses.replace(found.cycles.own, period=period)
    cycles = dataclasses.replace(found.cycles, name="b1-d", own=own)
    found = dataclasses.replace(found, cycles=cycles)
    values, _ = generated(found, sounds(strongest, tonal))
    for part in words:
        assert part in values["onset.pitch"]


def test_without_heyoka_the_reason_is_drawn_and_told():
    why = "No heyoka on this machine simulates no batches of pads."
    none = Onset({}, 0.05, {}, {}, {}, {}, {}, Missing(why), 0.005, 40, 10, why)
    values, tables = generated(none, Spectra(scenes={}, ratio=0.005))
    assert why.rstrip(".") in values["onset.cycle"]
    assert set(tables) == {"lasting", "exponents"}
    assert figure.draw(none).alternative == why
