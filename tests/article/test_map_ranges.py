"""The map of existence over pads: against known shares and a thorough search."""

import dataclasses

import numpy as np
import pytest

from squeal.article.equations import bounds
from squeal.article.studies import map_ranges as ranges_study
from squeal.io.scene import read_scene
from squeal.model.contact import FULL, STATES
from squeal.queries.pads.maps import BEYOND_FOLD, on_grid
from tests.conftest import HAMMERING as SCENES


@pytest.fixture(scope="module")
def scene():
    return read_scene(SCENES / "b2-c.yaml")


def test_shares_of_the_printed_conditions_lie_where_they_are_known_to(scene):
    """Equal springs, level pad, h/w from 0.1 to 1 and mu from 0.1 to 0.7: 3 to 20 %."""
    printed = []
    angles = ranges_study._angles(90)
    for ratio in (0.1, 0.4, 1.0):
        for mu in (0.1, 0.4, 0.7):
            pad = ranges_study.with_values(scene.pad.replace(theta0=0.0), ratio, 1.0, mu)
            assert pad.k1 == pytest.approx(pad.k2)
            assert pad.k1 + pad.k2 == pytest.approx(scene.pad.k1 + scene.pad.k2)
            holds = bounds(pad, angles)
            printed.append(holds.as_printed.mean())
            # as printed they require K21 > 0, where the complete ones are the same
            assert np.all(holds.complete[holds.as_printed])
            assert holds.complete.mean() > 1.5 * printed[-1]
    assert 0.025 < min(printed) < 0.04
    assert 0.18 < max(printed) < 0.21


def test_sliding_in_full_contact_is_counted_pad_by_pad(scene):
    """Without friction every branch reaches its end; the shares against the maps of one pad."""
    one = ranges_study.with_values(scene.pad, 0.3, 1.0, 0.5)
    pads = ranges_study.with_values(scene.pad, *(np.array([v, v]) for v in (0.3, 1.0, 0.5)))
    reached, stable, full = ranges_study.equilibria(scene, pads, 7)
    alone = dataclasses.replace(scene, pad=one)
    a1, a2 = ranges_study._axes(7)
    computed = on_grid(alone, ("alpha1", "alpha2"), a1, a2)
    assert reached == pytest.approx(np.mean(computed.codes != BEYOND_FOLD))
    good = np.isin(computed.codes, ranges_study.STABLE)
    assert stable == pytest.approx(np.mean(good))
    assert full == pytest.approx(np.mean(good & (computed.contact == STATES.index(FULL))))
    assert 0.0 < full[0] < stable[0] < reached[0]


def test_spans_are_those_of_the_shares(scene, monkeypatch):
    spread = np.linspace(0.0, 1.0, 243) ** 2
    seen = []

    def shares(_, pads, cells):
        pressed = -pads.y0 * pads.k1 / pads.F_n  # by an upright spring at touch
        seen.extend(np.unique(pressed.round(9)).tolist())
        return ranges_study.EquilibriumShares(
            reached=spread, stable=0.5 * spread, stable_full=0.1 + 0.3 * spread
        )

    monkeypatch.setattr(ranges_study, "equilibria", shares)
    ranges = ranges_study.full(scene)
    assert seen == [0.0, 4.0, 8.0]
    assert (ranges.pads, ranges.low, ranges.high) == (243, 0.1, 0.4)
    assert (ranges.touching.low, ranges.touching.high) == (0.0, 0.5)
