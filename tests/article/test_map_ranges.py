"""The map of existence over pads: against known shares and a thorough search."""

import dataclasses
import math

import numpy as np
import pytest

from squeal.analysis.maps import BEYOND_FOLD, angle_axes, on_grid
from squeal.article.cases import CASES
from squeal.article.equations import Bounds, bounds
from squeal.article.studies import map_ranges as ranges_study
from squeal.equilibrium.find import find_all
from squeal.io.scene import read_scene
from squeal.linear import verdict
from squeal.model.equations import linearise
from squeal.model.states import FULL, STATES
from tests.conftest import HAMMERING as SCENES


@pytest.fixture(scope="module")
def scene():
    return read_scene(SCENES / "b2-c.yaml")


def test_shares_of_the_printed_conditions_lie_where_they_are_known_to(scene):
    """Equal springs, level pad, h/w from 0.1 to 1 and mu from 0.1 to 0.7: 3 to 20 %, 89 to 99 %."""
    printed, signs = [], []
    angles = ranges_study._angles(90)
    for ratio in (0.1, 0.4, 1.0):
        for mu in (0.1, 0.4, 0.7):
            pad = ranges_study.with_values(scene.pad.replace(theta0=0.0), ratio, 1.0, mu)
            assert pad.k1 == pytest.approx(pad.k2)
            assert pad.k1 + pad.k2 == pytest.approx(scene.pad.k1 + scene.pad.k2)
            found = bounds(pad, angles)
            printed.append(found.as_printed.mean())
            signs.append(found.sign_aware.mean())
    assert 0.025 < min(printed) < 0.04
    assert 0.18 < max(printed) < 0.21
    assert 0.88 < min(signs) < 0.90
    assert max(signs) > 0.98


@pytest.mark.parametrize(
    ("angles", "place"),
    [((0.7, 0.5), "inside"), ((0.5, 0.5), "on the edge"), ((0.5, 0.7), "outside")],
)
def test_a_case_lies_inside_on_the_edge_or_outside(scene, monkeypatch, angles, place):
    """With a condition in place of (23a, b) whose edge is the diagonal."""

    def below(pad, at):
        return Bounds(0.0, 0.0, np.asarray(at[1] < at[0]), np.asarray(at[1] < at[0]))

    monkeypatch.setattr(ranges_study, "bounds", below)
    assert ranges_study.where(scene.pad, angles) == place


def test_without_friction_every_branch_is_whole(scene):
    smooth = dataclasses.replace(scene, pad=scene.pad.replace(mu=1e-3))
    found = ranges_study.off_branch(smooth, 4)
    assert (found.beyond, found.found, found.kept) == (0, 0, 0)


def test_equilibria_off_the_branch_are_those_of_a_thorough_search(scene):
    """A point of the map at a time, from some hundreds of places, in each contact state."""
    found = ranges_study.off_branch(scene, 4)
    axis = angle_axes(4)[0].values
    codes = on_grid(scene, ("alpha1", "alpha2"), axis, axis).codes
    beyond = axis[np.argwhere(codes == BEYOND_FOLD)]
    assert (found.points, found.beyond) == (16, len(beyond))
    others, kept = 0, 0
    for a1, a2 in beyond.tolist():
        model = scene.pad_model.replace(alpha1=a1, alpha2=a2)
        matrices = [linearise(model, e.q, e.state) for e in find_all(model)]
        verdicts = [verdict(*one) for one in matrices]
        others += bool(verdicts)
        kept += bool({"stable", "marginal"} & set(verdicts))
    assert 0 < found.found <= others
    assert 0 < found.kept <= kept
    assert found.upright <= found.kept


def test_conditions_that_divide_by_zero_whatever_the_pad_are_found_and_told(scene):
    """K21 = k1 s1 c1 - k2 s2 c2 in closed form: zero for all k1 and k2 if both products are."""
    closed = [
        case
        for case, angles in CASES.items()
        if max(abs(math.sin(a) * math.cos(a)) for a in angles) < 1e-15
    ]
    assert ranges_study._flat(scene.pad) == tuple(closed) == ("a", "b")


def test_small_regions_are_counted_by_parameter(scene, monkeypatch):
    """Of made-up shares that are small where mu exceeds 0.6, or 0.2 on the stiffest contact."""

    def shares(_, pads, cells):
        small = pads.mu > np.where(pads.k_c / pads.k1 > 2.0, 0.2, 0.6)
        pressed = -pads.y0 * pads.k1 / pads.F_n  # by an upright spring at touch
        assert np.unique(pressed.round(9)).tolist() == [0.0, 4.0, 8.0]
        return (np.where(small, 0.1, 0.5),) * 3

    monkeypatch.setattr(ranges_study, "_equilibria", shares)
    found = ranges_study._full(scene)
    assert (found.pads, found.small, found.cells) == (243, 81 + 27, 90)
    assert list(found.small_at["mu"].values()) == [0, 27, 81]
    assert list(found.small_at["k_c/k1"].values()) == [27, 27, 54]
    assert all(list(found.small_at[n].values()) == [36] * 3 for n in ("h/w", "k2/k1", "preload"))
    assert found.near == found.near_others == 0
    spread = np.linspace(0.0, 1.0, 243) ** 2
    monkeypatch.setattr(ranges_study, "_equilibria", lambda *_: (spread, 1 - spread, spread))
    below, above = spread[spread < 0.25], spread[spread >= 0.25]
    near = sum(0.25 - below <= 0.06), sum(above - 0.25 <= 0.06)
    other = ranges_study._full(scene)
    assert (other.near, other.near_others) == near
    assert near[0] != near[1]
    assert (other.touching.low, other.touching.high) == (0.0, 1.0)


def test_sliding_in_full_contact_is_counted_pad_by_pad(scene):
    """Without friction every branch reaches its end; the shares against the maps of one pad."""
    one = ranges_study.with_values(scene.pad, 0.3, 1.0, 0.5)
    pads = ranges_study.with_values(scene.pad, *(np.array([v, v]) for v in (0.3, 1.0, 0.5)))
    reached, kept, full = ranges_study._equilibria(scene, pads, 7)
    alone = dataclasses.replace(scene, pad=one)
    a1, a2 = ranges_study._axes(7)
    found = on_grid(alone, ("alpha1", "alpha2"), a1, a2)
    assert reached == pytest.approx(np.mean(found.codes != BEYOND_FOLD))
    good = np.isin(found.codes, ranges_study.KEPT)
    assert kept == pytest.approx(np.mean(good))
    assert full == pytest.approx(np.mean(good & (found.contact == STATES.index(FULL))))
    assert 0.0 < full[0] < kept[0] < reached[0]
