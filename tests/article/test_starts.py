"""Maps of initial conditions: kinds, the plane, and what is known of their middle."""

import numpy as np
import pytest

from squeal.article.claims.motions import LEVELS
from squeal.article.identify.space import compression
from squeal.article.records import Missing
from squeal.article.studies import starts
from squeal.article.studies.starts import (
    KINDS,
    REACH,
    Starts,
    grid,
    kind,
    maps,
    plane,
)
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import read_scene
from tests.article.test_claims import BEATS, case
from tests.conftest import ROOT, needs_heyoka


@pytest.mark.parametrize(
    ("changes", "expected"),
    [({}, 0), ({"losses": (1, 1)}, 1), ({"losses": (0, 1)}, 2), (BEATS, 3)],
)
def test_a_case_has_the_kind_that_its_measures_say(changes, expected):
    assert kind(case(**changes)) == expected
    assert len(LEVELS) == 6


def test_heights_and_tilts_are_in_static_compressions():
    scene = read_scene(ROOT / "workflow/scenes/b2-c.yaml")
    rest = np.array(sliding_equilibrium(scene.pad_model)[0].q)
    middle, lifted, tilted = plane(
        scene, rest, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    )
    assert middle == pytest.approx([*rest, 0.0, 0.0, 0.0])
    # the load of full contact falls by F_n over one compression
    force = [scene.pad_model.loads(state[:3], (True, True))[1] for state in (middle, lifted)]
    spring = scene.pad_model.replace(k_c=1e-12)
    without = [spring.loads(state[:3], (True, True))[1] for state in (middle, lifted)]
    assert np.diff(force)[0] - np.diff(without)[0] == pytest.approx(-scene.pad.F_n, rel=1e-9)
    # the tilt of one lifts the trailing edge by as much, and lowers the leading one
    gaps = [scene.pad_model.gaps(state[:3]) for state in (middle, tilted)]
    lifts = compression(scene.pad) * np.array([-1.0, 1.0])
    assert gaps[1] - gaps[0] == pytest.approx(lifts, rel=1e-2)


@needs_heyoka
def test_the_middle_of_a_stable_map_keeps_contact(monkeypatch):
    side = 5
    monkeypatch.setattr(starts, "SIDE", side)
    scene = read_scene(ROOT / "workflow/scenes/b2-b.yaml")
    case = maps(scene)
    assert not isinstance(case, Missing)
    one, ten = case.maps
    middle = side // 2
    assert one.rows[middle][middle] == ten.rows[middle][middle] == "0"
    assert sum(one.share.values()) == pytest.approx(1.0)
    height, tilt = grid()
    assert (height[0], tilt[0]) == (-REACH * (side - 1) / side,) * 2
    record = Starts(cases={"b2-b": case})
    assert record.share("b2-b", KINDS[0], 10) <= record.share("b2-b", KINDS[0], 1)
    rest = sliding_equilibrium(scene.pad_model)[0].q
    back = plane(scene, np.array(rest), *np.array([case.reference[1:2], case.reference[2:]]))
    assert back[0, 1:3] == pytest.approx(scene.initial[1:3], abs=1e-12)
