"""Where the continuation ends, and its settings."""

import math
from contextlib import contextmanager

import numpy as np
import pytest

from squeal.equilibrium import Path, branch, find_all, sliding_equilibrium
from squeal.equilibrium.branch import BranchEnd, NodeKind
from squeal.equilibrium.path import branch_of
from squeal.io.scene import read_scene
from squeal.model.contact import Formulation
from squeal.model.equations import PadModel
from squeal.model.pad import Pad
from squeal.queries.pads.maps import NAMES, stability_map
from squeal.queries.pads.stack import PadStack
from squeal.results.map import Axis
from tests.conftest import SCENES, random_pad

FINE = {"FIRST_STEP": 0.01, "LONGEST_STEP": 0.1}  # a hundredth of the displacement under the load
TURNS = 0.676775407  # mu at which the pad below has turned by 90 degrees


@contextmanager
def settings(values):
    """Other tolerances of the continuation."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in values.items():
            patch.setattr(branch, name, value)
        yield


@pytest.fixture
def turning():
    scene = read_scene(SCENES / "b2-c.yaml")
    return scene.replace(alpha1=0.6731984257692414, alpha2=0.8227980759401838)


@pytest.mark.parametrize("beyond", [-1e-5, 1e-5, 3e-3, 0.2])
def test_ninety_degrees_are_the_end_for_path_search_and_map(turning, beyond):
    mu = TURNS + beyond
    scene = turning.replace(mu=mu)
    path = Path.of(scene.pad_model, mu)
    e, _ = sliding_equilibrium(scene.pad_model)
    axes = Axis("mu", mu * (1 - 1e-12), mu, 2), Axis("h", 0.01401519, 0.01401521, 2)
    (code,) = np.unique(stability_map(scene, axes).codes)
    exists = beyond < 0
    assert (path.end == BranchEnd.REACHED) == exists
    assert (NAMES[code] != "beyond a fold") == exists
    there = [one for one in find_all(scene.pad_model) if abs(one.q[2]) > 1.4]
    assert bool(there) == exists
    if exists:
        assert e.on_branch
        assert abs(scene.pad.theta0 + e.q[2]) < math.pi / 2
    else:
        assert "turns past 90 degrees" in path.why_it_ends
        assert path.mu_end == pytest.approx(TURNS, abs=1e-8)
        assert e is None or not e.on_branch
        z = path.branch.z[:, -1]
        assert abs(path.statics.tilt(z)) == pytest.approx(math.pi / 2, rel=1e-12)


def test_a_branch_does_not_depend_on_its_steps(turning):
    model = read_scene(SCENES / "b2-a.yaml").pad_model
    coarse = Path.of(model, 1.0)
    with settings(FINE):
        close = Path.of(model, 1.0)
    assert close.branch.z.shape[1] > 2 * coarse.branch.z.shape[1]
    assert close.breakpoints == pytest.approx(coarse.breakpoints, rel=1e-12)
    for mu in (0.3, 0.9):
        assert close.equilibrium(mu).q == pytest.approx(coarse.equilibrium(mu).q, rel=1e-11)


@pytest.mark.parametrize(("seed", "model", "turn"), [(25, "B1", 0.02), (14, "B2", -0.06)])
def test_long_steps_pass_over_no_two_folds_and_no_two_contact_changes(seed, model, turn):
    pad = PadModel(model, random_pad(seed, model, F_n=0.05, theta0=turn))
    wild = {"FIRST_STEP": 3.0, "LONGEST_STEP": 30.0, "COSINE": 0.2, "CORRECTION": 3.0}

    def events():
        found = branch_of(pad, 2.0)
        return found.z[3, found.kind != NodeKind.POINT]

    close = events()
    assert len(close) > 0
    with settings(wild):
        assert events() == pytest.approx(close, rel=1e-12)


KNOWN = {"h": 0.014, "k2": 2.65e7, "k_c": 1.0e7, "L1": 0.81, "L2": 0.81, "F_n": 4525.0}
OTHER = {
    "h": 0.012644874054448023,
    "k2": 30909524.607527394,
    "k_c": 8166033.211748391,
    "L1": 0.6404112360019761,
    "L2": 0.9745889079871042,
    "F_n": 3689.4231061389637,
}


@pytest.mark.parametrize(
    ("pad", "y0", "alpha1", "alpha2", "fold"),
    [
        (KNOWN, -1e-3, 0.461149, 0.173044, 0.632138004),  # rates of mu unlike at both ends
        (KNOWN, -1e-3, 0.461149, 0.17309569043, 0.632089659),  # a step begins beside the fold
        (OTHER, -0.0008846221498366953, 0.5218318162789208, 0.24214048918557923, 0.609227865),
    ],  # and like ones, slower between
)
def test_a_step_passes_over_no_two_near_folds(pad, y0, alpha1, alpha2, fold):
    """Known from steps of a hundredth of the displacement under the load."""
    body = {"m": 0.2, "w": 0.04, "I": 1.709e-4, "k1": 2.0e7, "mu": 0.0, "y0": y0}
    model = PadModel("B2", Pad(**body, **pad, alpha1=alpha1, alpha2=alpha2))
    assert Path.of(model, 1.5).fold == pytest.approx(fold, rel=1e-8)
    with settings(FINE):
        assert Path.of(model, 1.5).fold == pytest.approx(fold, rel=1e-8)


def test_a_step_does_not_jump_over_the_two_folds_of_an_s():
    """Known from steps of a hundredth of the displacement under the load."""
    pad = Pad(
        m=1.0, w=1.0, h=0.7371987215978514, I=0.33837156353006165, k1=1.0, k2=2.410155686891303,
        k_c=2.241218587667189, L1=3.7190980212328526, L2=19.767794837306493,
        alpha1=0.33087804098691576, alpha2=1.6134547267433834, mu=0.0, F_n=9.398625233830667e-05,
        x0=-0.09987117132637723, y0=-0.012593199624475715, theta0=0.009149144228195556,
    )  # fmt: skip
    model = PadModel("B2", pad, Formulation("integral", "frame", "-"))
    for steps in ({}, FINE):
        with settings(steps):
            path = Path.of(model, 1.1098009630113637)
        assert path.fold == pytest.approx(0.751771513, rel=1e-8)
        assert not path.breakpoints


def test_a_step_does_not_jump_over_the_fold_of_two_springs():
    """Known from steps of a hundredth, and from a march by arc length on the literal equations."""
    pad = Pad(
        m=1.0, w=1.0, h=0.07842437453477459, I=0.4658606074960502, k1=0.3138315667346328,
        k2=0.053885260559723556, k_c=1.9548791169519786, L1=0.8234600802741626,
        L2=1.858014562193649, alpha1=-0.6844408434762816, alpha2=-2.651503290416303, mu=0.4,
        F_n=0.5159966934795438, x0=-0.083210632246922, y0=0.027408875885986103,
        theta0=-0.19945754479414202,
    )  # fmt: skip
    path = Path.of(PadModel("BN", pad, Formulation(springs=2)), 2.0)
    assert path.fold == pytest.approx(0.307146325, rel=1e-8)


def test_a_branch_does_not_end_at_a_smaller_friction_than_it_came_to():
    """It rises to the fold; a change of contact at mu = 1.06 lies on another branch."""
    pad = Pad(
        m=1.0, w=1.0, h=1.2437672250146183, I=0.7081701255099673, k1=0.4250916729241934,
        k2=0.4205090772647207, k_c=3.7325538006684016, L1=10.767115750722207,
        L2=15.315492819805549, alpha1=2.7515631928335655, alpha2=1.321943700949204, mu=0.0,
        F_n=1.3278607960439772e-06, x0=0.08913288220268889, y0=-0.02069833885231579, theta0=0.0,
    )  # fmt: skip
    model = PadModel("B2", pad, Formulation("mean", "frame", "-"))
    for steps in ({}, FINE):
        with settings(steps):
            assert Path.of(model, 2.0).fold == pytest.approx(1.43485891, rel=1e-8)


def test_a_branch_tells_that_its_steps_were_spent():
    model = read_scene(SCENES / "b2-a.yaml").pad_model
    with settings({"MOST_STEPS": 3}):
        path = Path.of(model, 1.0)
    assert path.mu_end < 1.0
    assert "is lost at mu" in path.why_it_ends


def test_a_friction_below_the_shortest_step_is_reached():
    """The only step is cut off at the end of the range: its branch is not lost."""
    mu = np.array([1e-14, 1e-12, 1e-11, 1e-10])
    stack = PadStack.of(read_scene(SCENES / "b2-d.yaml"), ("mu",), mu[None])
    branches = stack.branches(mu)
    assert np.all(branches.end == BranchEnd.REACHED)
    assert np.array_equal(branches.mu_end, mu)
