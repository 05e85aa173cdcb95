"""Maps of initial conditions: kinds, the plane, and what is known of their middle."""

import numpy as np
import pytest

from squeal.article.claims.motions import LEVELS
from squeal.article.records import Missing
from squeal.article.studies.starts import KINDS, SIDE, Starts, compression, grid, kind, maps, plane
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import read_scene
from tests.article.test_claims import BEATS, case
from tests.conftest import ROOT, needs_heyoka


@pytest.mark.parametrize(
    ("changes", "expected"),
    [({}, 0), ({"losses": (1, 1)}, 1), ({"losses": (0, 1)}, 2), (BEATS, 3)],
)
def test_kinds(changes, expected):
    assert kind(case(**changes)) == expected
    assert len(LEVELS) == 6


def test_the_plane_holds_the_equilibrium_and_the_own_start():
    scene = read_scene(ROOT / "workflow/scenes/b2-c.yaml")
    rest = np.array(sliding_equilibrium(scene.pad_model)[0].q)
    one = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    middle, own, tilted = plane(scene, rest, *one)
    assert middle[:3] == pytest.approx(rest)
    assert own == pytest.approx(scene.initial)
    # the tilt of one lifts an edge by the static compression
    assert (tilted - middle)[2] * scene.pad.w == pytest.approx(compression(scene))
    assert compression(scene) == scene.pad.F_n / scene.pad.k_c


@needs_heyoka
def test_the_middle_of_a_stable_map_keeps_contact_and_symmetry_is_not_assumed():
    both = maps(read_scene(ROOT / "workflow/scenes/b2-b.yaml"))
    assert not isinstance(both, Missing)
    one, ten = both
    middle = SIDE // 2
    assert one.rows[middle][middle] == ten.rows[middle][middle] == "0"
    assert sum(one.share.values()) == pytest.approx(1.0)
    s, t = grid()
    assert (s[0], t[0]) == (s.min(), t.min())
    record = Starts(cases={"b2-b": (one, ten)})
    assert record.share("b2-b", KINDS[0], 10) <= record.share("b2-b", KINDS[0], 1)
