"""Releases, shares over a box and the grazing of case (c) against a program of their own."""

import dataclasses

import numpy as np
import pytest

from squeal.article.claims.measures import measure
from squeal.article.studies import _heyoka, basin, grazing, onset, releases
from squeal.article.studies.basin import sampled_share
from squeal.article.studies.hammering import (
    admissible_equilibrium,
    equilibrium_contact,
    heights_between,
    motion,
)
from squeal.equilibrium.damping import damped_model
from squeal.io.provenance import NOT_INSTALLED
from squeal.io.scene import read_scene
from squeal.io.writing import to_json
from tests.article.plain import Plain, move
from tests.conftest import ROOT, needs_heyoka


def reference(name):
    return read_scene(ROOT / f"workflow/scenes/{name}.yaml")


@pytest.mark.parametrize(("name", "load"), [("b1-b", 0.5), ("b2-c", 0.5), ("b2-d", 2.0)])
def test_losses_after_a_release_are_those_of_another_program(name, load):
    scene = reference(name)
    model = Plain(scene.pad, line=name.startswith("b2"))
    place = model.equilibrium(scene.pad.mu)
    reaction, _ = model.contact(place)
    stiffness = scene.pad.k_c or scene.pad.k3 + scene.pad.k4
    state = np.append(place, np.zeros(3))
    state[1] += (1.0 - load) * reaction / stiffness
    touching = np.array(model.gaps(place)) < 0.0
    rest = admissible_equilibrium(scene)
    start = releases.released(scene, rest, load)
    assert start.initial == pytest.approx(tuple(state), rel=1e-6, abs=1e-12)
    if load > 1.0:  # in full contact the force is that multiple
        assert model.contact(state[:3])[0] == pytest.approx(load * reaction, rel=1e-3)
    ours = motion(measure(start), equilibrium_contact(scene)).lost
    other = move(model, state, scene.stop, 8001).lost(touching)
    assert ours == pytest.approx(other, abs=1e-3)


def test_forces_at_the_start_in_closed_form():
    points = reference("b1-a")
    line = reference("b2-a")
    force = -(points.pad.k3 + points.pad.k4) * points.initial[1] / points.pad.F_n
    assert releases.start_force(points) == pytest.approx(force, rel=1e-9)
    depth = -(line.pad.y0 + line.initial[1])
    assert releases.start_force(line) == pytest.approx(
        line.pad.k_c * depth / line.pad.F_n, rel=1e-9
    )


def test_the_longer_loss_is_named_only_beyond_the_least_difference():
    one = releases.Release(points=0.2, line=0.195, points_any=0.2, line_any=0.3)
    assert releases.longer(one) == "neither"
    assert releases.longer(dataclasses.replace(one, line=0.1)) == "points"
    assert releases.longer(dataclasses.replace(one, line=0.3)) == "line"


def test_a_case_that_loses_no_contact_is_not_the_one_with_the_greatest_height():
    assert heights_between({"b1-a": 2.0, "b1-b": 0.2, "b1-c": 1.0}, "b1-b", "b1-a")
    assert not heights_between({"b1-a": None, "b1-b": 0.2, "b1-c": 1.0}, "b1-b", "b1-a")
    assert heights_between({"b1-a": None, "b1-b": None}, "b1-b", "b1-a")  # without ensembles


def test_intervals_of_shares_are_those_of_the_closed_form():
    """Clopper and Pearson's interval of no success in n is 1 - (alpha/2)^(1/n)."""
    none = sampled_share(0.5, 0, 100)
    assert (none.share, none.low) == (0.0, 0.0)
    assert none.high == pytest.approx(1.0 - 0.025**0.01, rel=1e-9)
    every = sampled_share(0.5, 100, 100)
    assert every.low == pytest.approx(0.025**0.01, rel=1e-9)


@needs_heyoka
@pytest.mark.parametrize(("name", "starts"), [("b1-d", 1), ("b2-d", 4)])
def test_a_sample_of_starts_lasts_or_rests_by_another_program(name, starts):
    """Ten observation times decide between the cycle and rest."""
    scene = reference(name)
    states = onset.sampled_states(scene, 1.5, 4)[:starts]
    model = damped_model(onset.damped(scene, onset.RATIO))
    begun = [onset.DampedStart(model, state) for state in states]
    found = onset.settle(begun, 10.0 * scene.stop, 0.2 * scene.stop).settled
    other = Plain(scene.pad, line=name.startswith("b2"))
    other.damp(onset.RATIO)
    assert np.abs(other.damping - model.damping).max() < 1e-6 * np.abs(other.damping).max()
    for state, one in zip(states, found, strict=True):
        late = move(other, state, 10.0 * scene.stop, 2, 1e-8).states[-1]
        lost = move(other, late, 0.2 * scene.stop, 2001).lost()
        assert one.goes_on is (0.0 < lost < 1.0)


@needs_heyoka
def test_the_trailing_blow_of_c_is_that_of_another_program():
    """The impulse of the force while its resultant lies on the trailing half of the face."""
    ratio = 0.006
    scene = reference("b2-c")
    late = grazing.settled(scene, [ratio])
    model = Plain(scene.pad, line=True)
    model.damp(ratio)
    begun = onset.DampedStart(damped_model(onset.damped(scene, ratio)), np.array(scene.initial))
    state = onset.run([begun], onset.LONGER * scene.stop)["final"][0]
    moved = move(model, state, 0.15 * scene.stop, 20001)
    reaction, moment = moved.contact
    trailing = np.append(False, moment > 0.0)
    begin = np.flatnonzero(trailing[1:] & ~trailing[:-1])
    period = 2.0 * np.pi * np.sqrt(scene.pad.m / scene.pad.k1)
    unit = scene.pad.F_n * period / moved.t[1]
    load = np.where(moment > 0.0, reaction, 0.0) / unit
    # the first may have begun before the motion does, the last may not have ended
    blows = np.add.reduceat(load, begin)[:-1]
    assert blows.max() == pytest.approx(0.0029, rel=0.03)
    assert late["heaviest"][0, 1] == pytest.approx(blows.max(), rel=0.02, abs=2e-4)


def test_checks_of_the_box_know_their_interval():
    """With so few starts nothing can be said of most of them."""
    few = tuple(sampled_share(h, n, 4) for h, n in zip(basin.HALF_WIDTHS, range(5), strict=True))
    record = basin.Basin(shares={"b1-d": few, "b2-d-integral": few}, compression={})
    assert not basin.sentences(record)["most-last-within-two-compressions"]


def test_blows_that_neither_begin_nor_pass_the_level_have_no_ratio():
    def blows(alone, trailing):
        ratios = (0.001, 0.002, 0.003, 0.004)
        pairs = zip(ratios, alone, trailing, strict=True)
        return [grazing.Blow(ratio=r, trailing=t, alone=a, full=1.0) for r, a, t in pairs]

    begins = blows((0.0, 0.0, 0.1, 0.3), (0.0, 0.01, 0.04, 0.08))
    assert grazing.ratio_of_grazing(begins) == pytest.approx(0.0025)
    assert grazing.ratio_of_hammering(begins) == pytest.approx(0.00325)
    for other in (blows((0.0,) * 4, (0.0,) * 4), blows((0.1,) * 4, (1.0,) * 4)):
        assert grazing.ratio_of_grazing(other) is None
        assert grazing.ratio_of_hammering(other) is None
        record = grazing.Grazing(blows=tuple(other), grazes=None, crosses=None)
        assert set(grazing.sentences(record).values()) == {False}


def test_studies_that_need_heyoka_say_so_without_it(monkeypatch, tmp_path):
    scenes = [ROOT / f"workflow/scenes/{name}.yaml" for name in ("b1-d", "b2-d", "b2-c")]
    for study, kind in ((basin, basin.Basin), (grazing, grazing.Grazing)):
        monkeypatch.setattr(_heyoka, "version", lambda _: NOT_INSTALLED)
        record = study.study(scenes)
        file = tmp_path / "result.json"
        file.write_text(to_json(record.to_dict()))
        assert kind.read(file) == record
        assert record.left_out
        assert not study.sentences(record)
