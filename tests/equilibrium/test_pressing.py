"""R_n above its own rounding: pads without a load, and pads with very little of it."""

import numpy as np
import pytest

from squeal.analysis.pads import analyse, critical_friction, judged_equilibria
from squeal.analysis.variations import advise
from squeal.equilibrium import find_all, rests, sliding_equilibrium
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.equations import PadModel
from squeal.model.pad import Pad

# Without a load the springs lift the pad off its preload along the direction that they leave free:
# there it hangs, whatever mu, at the border of contact, where R_n is zero.
STIFF = {"m": 0.31, "w": 0.033, "h": 0.011, "k1": 1.7e7, "k2": 2.2e7, "k_c": 1.9e7}
FREE = STIFF | {"L1": 0.4, "L2": 0.55, "alpha1": 0.47 * np.pi, "alpha2": 0.83 * np.pi}
AT_REST = "without friction the pad has no place of rest nearby"


def _pad(mu=0.37, **changes):
    return Pad(**(FREE | {"mu": mu, "F_n": 0.0, "y0": -2e-5} | changes))


def test_an_equilibrium_whose_reaction_is_rounding_is_none():
    scene = Scene("B2", _pad())
    found = find_all(scene.pad_model)
    assert min(e.R_n for e in found) > 1.0
    taken = analyse(scene)
    least = min(found, key=lambda e: e.potential)
    assert (taken.R_n, taken.on_branch) == (least.R_n, False)
    assert taken.R_n == pytest.approx(18.7, rel=0.3)
    assert taken.spectrum.rigid_body_roots == 0
    assert AT_REST in taken.warnings[0]
    assert [e.R_n for e, _ in judged_equilibria(scene)] == [e.R_n for e in found]


@pytest.mark.parametrize("ask", [critical_friction, advise])
def test_a_branch_that_would_start_without_a_reaction_is_none(ask):
    with pytest.raises(ComputationError, match=AT_REST):
        ask(Scene("B2", _pad()))


def test_many_pads_at_once_leave_the_same_ones_out():
    loads = np.array([0.0, 100.0, 0.0])
    heights = np.array([-2e-5, -2e-5, 1e-5])
    statics = Statics.of(PadModel("B2", _pad()))
    unit = statics.units
    pads = statics.model.replace(F_n=loads / unit.force, y0=heights / unit.length)
    assert rests(Statics(pads, unit), 3).there.tolist() == [False, True, False]
    alone = [
        sliding_equilibrium(PadModel("B2", _pad(0.0, F_n=load, y0=height)))[0]
        for load, height in zip(loads, heights, strict=True)
    ]
    assert [e is not None and e.on_branch for e in alone] == [False, True, False]
