"""Onset and attractors: what settles, and the sentences that follow it."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from squeal.article.report.onset import exponents_table, generated, lasting_table
from squeal.article.results.onset import (
    CyclePoint,
    Cycles,
    Exponent,
    Late,
    Onset,
    Section,
    Sweep,
    Way,
)
from squeal.article.studies import onset as study
from squeal.equilibrium.damping import damped_model
from squeal.files.records import Missing
from squeal.scene import read_scene
from tests.conftest import ROOT, needs_heyoka

SCENES = ROOT / "workflow" / "scenes"


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


def made(
    lasts: bool = True,
    law: bool = True,
    threshold: float | None = 0.7,
    down: float = 0.5,
    least: float = 0.56,
    decay: float = 0.9,
) -> Onset:
    """A result with one motion under both laws."""
    late: dict[str, Any] = {
        "b2-c-mean": (Late(0.005, 0.4 if lasts else 0.0, 2.0),),
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
        thresholds={"b2-c-mean": threshold},
        sections={"b2-c-mean": Section((0.0,), (1.0,))},
        exponents={"b2-c-mean": Exponent(0.005, 1.0, 0.1, 0.02, "chaotic", 40)},
        cycles=Cycles("b2-c-mean", 0.005, points[0], decay, 1e-6, points),
        ratio=0.005,
        windows=40,
    )


@pytest.mark.parametrize(
    ("given", "key", "words"),
    [
        ({}, "lasts", "B2 (c), printed law"),
        ({"lasts": False, "law": True}, "lasts", "no contact changes"),
        ({}, "law", "printed law alone"),
        ({"law": False}, "law", "No motion goes on"),
        ({}, "beside", "flutters from some friction"),
        ({"threshold": None}, "beside", "does not announce it"),
        ({}, "hysteresis", "with hysteresis"),
        ({"down": 0.65}, "hysteresis", "without hysteresis"),
        ({}, "branch", "subcritical"),
        ({"least": 0.71}, "branch", "supercritical"),
        ({"threshold": None}, "branch", "reaches down"),
        ({}, "cycle", "which agrees"),
        ({"decay": 0.8}, "cycle", "does not agree"),
        ({}, "signs", "chaotic are B2 (c)"),
    ],
)
def test_sentences_follow_the_numbers(given, key, words):
    values, _ = generated(made(**given))
    assert words in values[f"onset.{key}"]


def test_tables_tell_what_is_kept_lost_and_not_settled():
    found = made()
    assert r"40\,\%, $2$" in lasting_table(found)
    assert "kept" in lasting_table(found)
    drifts = Exponent(0.0, 0.1, 0.1, 0.02, "finite-time", 40)
    others = dataclasses.replace(
        found, exponents={"b1-b, undamped": drifts, "b1-a, undamped": Missing("the model ends")}
    )
    assert "finite-time" in exponents_table(others)
    assert "the model ends" in exponents_table(others)


def test_without_a_cycle_the_reason_is_given():
    found = dataclasses.replace(made(), cycles=Missing("the motion does not return to itself"))
    values, _ = generated(found)
    assert "does not return" in values["onset.cycle"]
