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
from tests.conftest import random_pad

# Without a load the springs lift the pad off its preload along the direction that they leave free:
# there it hangs, whatever mu, at the border of contact, where R_n is zero.
STIFF = {"m": 0.31, "w": 0.033, "h": 0.011, "k1": 1.7e7, "k2": 2.2e7, "k_c": 1.9e7}
FREE = STIFF | {"L1": 0.4, "L2": 0.55, "alpha1": 0.47 * np.pi, "alpha2": 0.83 * np.pi}
LINE = ("B2", "BN")
AT_REST = "without friction the pad has no place of rest where the surfaces press on each other"


def _pad(mu=0.37, **changes):
    return Pad(**(FREE | {"mu": mu, "F_n": 0.0, "y0": -2e-5} | changes))


@pytest.mark.parametrize("model", LINE)
def test_an_equilibrium_whose_reaction_is_rounding_is_none(model):
    scene = Scene(model, _pad())
    found = find_all(scene.pad_model)
    assert min(e.R_n for e in found) > 1.0
    taken = analyse(scene)
    least = min(found, key=lambda e: e.potential)
    assert (taken.R_n, taken.on_branch) == (least.R_n, False)
    assert taken.R_n == pytest.approx(18.7, rel=0.3)  # N springs are nearly a line
    assert taken.spectrum.rigid_body_roots == 0
    assert AT_REST in taken.warnings[0]
    assert [e.R_n for e, _ in judged_equilibria(scene)] == [e.R_n for e in found]


@pytest.mark.parametrize("ask", [critical_friction, advise])
def test_a_branch_that_would_start_without_a_reaction_is_none(ask):
    with pytest.raises(ComputationError, match=AT_REST):
        ask(Scene("B2", _pad()))


@pytest.mark.parametrize("model", ["B1", "B2"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_no_reaction_of_a_pad_without_a_load_is_rounding(model, seed):
    found = find_all(PadModel(model, random_pad(seed, model, F_n=0.0)))
    assert all(e.R_n > 1e-6 for e in found)


@pytest.mark.parametrize("model", ["B1", *LINE])
def test_a_load_may_be_small(model):
    stiffness = {"k3": 1.1e7, "k4": 0.9e7} if model == "B1" else {"k_c": 1.9e7}
    plain = {name: v for name, v in FREE.items() if name != "k_c"} | stiffness

    def of(load):
        scene = Scene(model, Pad(**plain, mu=0.1, F_n=load))
        return analyse(scene), critical_friction(scene, 0.5)

    large, small = of(1e-3), of(1e-9)  # both far too small for the geometry to change
    for analysis, _ in (large, small):
        assert analysis.on_branch
        assert analysis.admissible
    assert small[0].R_n == pytest.approx(1e-6 * large[0].R_n, rel=1e-6)
    assert small[0].spectrum.values == pytest.approx(large[0].spectrum.values, rel=1e-6)
    assert [p.mu for p in small[1].points] == pytest.approx(
        [p.mu for p in large[1].points], rel=1e-6
    )


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
