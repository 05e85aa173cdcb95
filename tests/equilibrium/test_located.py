"""Folds and changes of contact at 50 digits, and branches under stiff contact."""

import mpmath as mp
import numpy as np
import pytest

from squeal.equilibrium import Path
from squeal.equilibrium import path as one_pad
from squeal.io.scene import Damping, Scene, read_scene
from squeal.model.contact import State
from squeal.model.pad import Pad
from squeal.queries.thresholds import critical_friction
from tests.conftest import SCENES
from tests.exact import Exact, det

# contact 1e5 times as stiff as the spring that holds the pad along the surface
STIFF = Scene(
    "B2",
    Pad(m=0.5015833222758953, w=0.04486318693814687, h=0.03159919308785914,
        k1=21434356.247259565, k2=7290152.8553952975, k_c=2409281200309.7373,
        L1=0.6853822561585085, L2=0.07804284040813839, alpha1=1.7717671769753847,
        alpha2=1.3565194963948177, F_n=2247.510106006277, mu=0.3),
    damping=Damping(ratios=(0.023613308893435762, 0.02477240628083043, 0.028166930581404796)),
)  # fmt: skip
# springs 5e4 and 1e5 times as stiff as the contact
SOFT_EDGES = Scene(
    "B1",
    Pad(m=0.917, w=0.0347764, h=0.0337593, k1=2.71582e11, k2=1.96234e11, k3=5.24154e6,
        k4=5.12994e6, L1=0.496926, L2=0.0639265, alpha1=1.2340975, alpha2=1.6165766, F_n=425.34,
        mu=0.3),
)  # fmt: skip
SOFT_FACE = Scene(
    "B2",
    Pad(m=0.3244, w=0.0319675, h=0.0148122, k1=9.61356e11, k2=5.02172e11, k_c=1.05291e7,
        L1=0.571579, L2=0.480506, alpha1=1.09, alpha2=1.69493, F_n=4627.74, mu=0.3),
)  # fmt: skip


def exact_places(scene, path):
    """Each fold and change of contact with its mu at 50 digits."""
    found = []
    for node in np.flatnonzero(path.branch.kind):
        before, state = path.branch.touching[:, node - 1 : node + 1].T.tolist()
        z = path.branch.z[:, node]
        exact = Exact(scene, State(*before))

        def singular(q, mu, exact=exact):
            return det(exact.stiffness(q, mu)) / mp.mpf(scene.pad.k1) ** 3

        def touching(q, mu, exact=exact, edge=int(before[0] == state[0])):
            return exact.gaps(q)[edge]

        condition = singular if before == state else touching
        place = path.statics.to_si(z)
        mu = float(z[3])
        found.append((mu, exact.critical(condition, place, mu)[1]))
    return found


@pytest.mark.parametrize(
    ("scene", "kinds"),
    [
        (SOFT_EDGES, ["change"]),  # the branch turns back where contact changes
        (SOFT_FACE, ["fold"]),
        (STIFF, ["change"]),
        (read_scene(SCENES / "b2-c.yaml"), ["change", "fold"]),
        (read_scene(SCENES / "b2-a.yaml"), ["change"]),
    ],
)
def test_folds_and_changes_of_contact_lie_in_their_intervals(scene, kinds):
    path = Path.of(scene.pad_model, 2.0 if scene is not STIFF else 0.5)
    places = exact_places(scene, path)
    assert ["change" if mu in path.breakpoints else "fold" for mu, _ in places] == kinds
    for mu, exact in places:
        assert abs(exact - mu) <= path.error(mu) <= 1e-12
    assert path.error(0.1) == 0.0
    assert (path.fold == path.mu_end) == ("fold" in kinds or scene is SOFT_EDGES)
    assert path.equilibrium(path.mu_end * (1 + 1e-9)) is None


@pytest.mark.parametrize(("units", "converged"), [(1.0, True), (1e9, False)])
def test_an_interval_is_as_wide_as_rounding_makes_it(monkeypatch, units, converged):
    monkeypatch.setattr(one_pad, "COEFFICIENT_ERROR", units * one_pad.COEFFICIENT_ERROR)
    for scene in (SOFT_FACE, read_scene(SCENES / "b2-c.yaml")):
        fold = critical_friction(scene).points[-1]
        assert (fold.kind, fold.converged) == ("fold", converged)
        low, high = fold.interval
        assert low < fold.mu < high
        assert (high - low > 1e-9 * fold.mu) != converged


@pytest.mark.parametrize("k_c", [2409281200309.7373, 1e11])
def test_stiff_contact_is_followed_to_where_it_is_asked_for(k_c):
    scene = STIFF.replace(k_c=k_c)
    for mu_max in (1.0, 1.3):
        path = Path.of(scene.pad_model, mu_max)
        assert (path.fold, path.mu_end) == (None, mu_max)
        for mu in (mu for mu in (0.3, 0.97, 1.0, 1.15447674, 1.3) if mu <= mu_max):
            e = path.equilibrium(mu)
            exact = Exact(scene, e.state)
            q = exact.equilibrium(e.q, mu)
            assert exact.gaps(q)[0] > 0.0 or mu < path.breakpoints[0]
            assert max(abs(a / b - 1) for a, b in zip(q, e.q, strict=True)) < 1e-10


def test_no_threshold_depends_on_how_far_was_asked():
    near = critical_friction(STIFF, 1.0)
    far = critical_friction(STIFF, 1.3)
    assert near.points == ()
    assert [point.kind for point in far.points] == ["flutter"]
    assert far.points[0].mu == pytest.approx(1.009492867, abs=1e-9)  # at 50 digits


def test_a_range_may_end_at_the_fold_itself():
    scene = read_scene(SCENES / "b2-c.yaml")
    fold = critical_friction(scene).points[-1].mu
    for mu_max in (fold, fold * (1 + 1e-12)):
        assert critical_friction(scene, mu_max).points[-1].kind == "fold"
    for less in (1e-12, 1e-9, 1e-3):
        path = Path.of(scene.pad_model, fold * (1 - less))
        assert path.fold is None
        assert path.mu_end == fold * (1 - less)
