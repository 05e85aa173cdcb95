"""Units of order one: by hand, for many pads at once, and refused without a spring."""

import dataclasses

import numpy as np
import pytest

from squeal.model.equations import PadModel, natural_units
from squeal.simulation.ensemble import stack
from tests.conftest import random_pad


def test_units_follow_stiffness_mass_and_size():
    pad = random_pad(1, m=2.0, w=0.1, k1=3.0, k2=4.0, k3=5.0, k4=6.0, k_c=11.0, F_n=0.9, y0=-0.3)
    for name, y, rest in (("B1", 0.2, 0.05), ("B2", 0.1, 0.3), ("BN", 0.1, 0.3)):
        model = PadModel(name, pad)
        units = natural_units(model, (0.01, 0.2, 0.5, 0, 0, 0))
        assert dataclasses.astuple(units) == pytest.approx((2.0, y, 1.0 / 3.0, 0.1))
        assert natural_units(model, (0.0,) * 6).length == pytest.approx(rest)
        assert natural_units(model, (0, 0, 0, 3.0, 4.0, 0)).length == pytest.approx(5.0 / 3.0)
    assert natural_units(PadModel("B1", pad.replace(F_n=0.0)), (0.0,) * 6).length == 0.1


@pytest.mark.parametrize("name", ["B1", "B2"])
def test_many_pads_have_the_units_of_each(name):
    pads = [random_pad(seed, name) for seed in range(9)]
    pads[1] = pads[1].replace(F_n=0.0)
    initial = np.random.default_rng(0).normal(size=(9, 6)) * 1e-2
    initial[:2] = 0.0
    many = dataclasses.astuple(natural_units(PadModel(name, stack(pads)), initial.T))
    for i, pad in enumerate(pads):
        one = dataclasses.astuple(natural_units(PadModel(name, pad), tuple(initial[i])))
        assert [v[i] for v in many] == pytest.approx(one, rel=1e-15)
