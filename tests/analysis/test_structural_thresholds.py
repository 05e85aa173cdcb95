"""Thresholds with a structural loss factor against a closed form."""

from dataclasses import replace

import numpy as np
import pytest

from squeal.analysis.systems import thresholds as critical
from squeal.analysis.systems.roots import Wanted
from squeal.analysis.systems.thresholds import system_thresholds
from squeal.errors import InputError
from squeal.sparse import eigensolver
from squeal.sparse.argument_principle import Rectangle
from tests import large

REGION = Wanted(region=Rectangle(-60.0, 60.0, 350.0, 600.0))


def test_the_threshold_is_certified():
    system, mu, omega = large.with_loss_factor(np.random.default_rng(4))
    found = system_thresholds(system, 1.4, wanted=REGION)
    assert found.verdict == "stable"
    (point,) = found.points
    assert point.kind == "flutter"
    assert point.mu == pytest.approx(mu, rel=1e-10)
    assert point.frequency_hz == pytest.approx(omega / (2 * np.pi), rel=1e-10)
    assert found.certified
    assert not found.unconfirmed


def test_a_count_that_disagrees(monkeypatch):
    system, mu, _ = large.with_loss_factor(np.random.default_rng(4))
    whole = eigensolver.modes_in

    def doubtful(*given, **options):
        return replace(whole(*given, **options), count=None)

    monkeypatch.setattr(critical, "modes_in", doubtful)
    found = system_thresholds(system, 1.4, wanted=REGION)
    assert found.certified is False
    assert found.points[0].mu == pytest.approx(mu, rel=1e-10)


def test_without_a_region():
    system, _, _ = large.with_loss_factor(np.random.default_rng(4))
    with pytest.raises(InputError, match="band: is missing; thresholds with a structural"):
        system_thresholds(system, 1.4)
