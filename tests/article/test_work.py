"""Energies and works over time: they balance at every step, and excursions add up to the whole."""

import dataclasses

import numpy as np
import pytest

from squeal.article.findings.work import contact_work
from squeal.model.contact import Formulation
from tests.conftest import hammering_scene


@pytest.mark.parametrize("name", ["b1-a", "b2-a", "b2-c"])
def test_energy_changes_by_the_works_at_every_time(name):
    works = contact_work(hammering_scene(name))
    c = works.energies
    rest = c.kinetic + c.springs - c.load - c.normal - c.friction
    assert np.ptp(rest) < 1e-12 * works.kinetic
    assert np.all(np.diff(c.t) >= 0.0)
    assert c.t[0] == 0.0
    assert c.t[-1] == pytest.approx(hammering_scene(name).stop)
    assert c.kinetic.max() <= works.kinetic


@pytest.mark.parametrize("name", ["b2-a", "b2-b", "b2-c"])
def test_what_is_fed_in_is_fed_in_partial_contact(name):
    works = contact_work(hammering_scene(name))
    fed = [one.fed for one in works.excursions]
    assert sum(fed) == pytest.approx(works.fed, rel=1e-9)
    outside = np.ones(len(works.energies.t), dtype=bool)
    for one in works.excursions:
        outside &= (works.energies.t <= one.start) | (works.energies.t > one.stop)
    steps = np.diff(works.energies.fed)[outside[1:]]
    assert np.all(np.abs(steps) < 1e-12 * works.kinetic)


def test_the_printed_law_gives_and_takes_and_the_integral_law_does_neither():
    printed = contact_work(hammering_scene("b2-c"))
    assert {np.sign(one.fed) for one in printed.excursions} == {-1.0, 1.0}
    own = hammering_scene("b2-c")
    integral = contact_work(dataclasses.replace(own, formulation=Formulation("integral")))
    assert integral.excursions
    assert max(abs(one.fed) for one in integral.excursions) < 1e-11 * integral.kinetic


def test_partial_contact_that_moves_from_spring_to_spring_is_one_excursion():
    own = hammering_scene("b2-c")
    springs = dataclasses.replace(own, model="BN", formulation=Formulation(springs=6))
    works = contact_work(springs)
    for before, after in zip(works.excursions, works.excursions[1:], strict=False):
        assert before.stop < after.start
