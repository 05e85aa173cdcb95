"""Friction that falls with speed: closed forms, equations written out again, differences."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from squeal.article.identify.ensemble import simulate_many
from squeal.errors import ComputationError, InputError
from squeal.io.scene import COORDINATES, Damping, Scene, read_scene
from squeal.model.contact import CONSISTENT
from squeal.model.pad import Pad
from squeal.queries.pads.equilibrium import analyse
from squeal.simulation.hybrid import Limit
from squeal.simulation.run import simulate
from tests.conftest import INSTALLED, SCENES, needs_heyoka
from tests.direct import motion
from tests.simulation.test_damping import DAMPED
from tests.simulation.test_damping import C as full

LAW = {"mu_s": 0.9, "mu_k": 0.3, "v_ref": 4.0}


def friction(v):
    return LAW["mu_k"] + (LAW["mu_s"] - LAW["mu_k"]) * np.exp(-v / LAW["v_ref"])


def scene(name, **more: Any) -> Scene:
    one = read_scene(SCENES / f"{name}.yaml")
    one = dataclasses.replace(one, **({"formulation": CONSISTENT} | more))
    return one.replace(mu=None, V=10.0, **LAW)


def test_mu_is_that_of_the_surface_and_follows_the_law():
    pad = scene("b2-c").pad
    assert pad.mu == pytest.approx(friction(10.0), rel=1e-15)
    assert pad.replace(V=3.0).mu == pytest.approx(friction(3.0), rel=1e-15)
    assert pad.replace(mu_s=0.3).mu == pytest.approx(0.3, rel=1e-15)
    assert "mu" not in pad.to_dict()
    share, rate = pad.fall or (math.nan, math.nan)
    for speed in (-20.0, 0.0, 4.0, 9.9):
        there = pad.mu * (1 + share * (math.exp(rate * speed) - 1))
        assert there == pytest.approx(friction(10.0 - speed), rel=1e-14)
    # mu of its own scales the law and stays
    scaled = pad.replace(mu=0.5)
    assert (scaled.fall, scaled.replace(V=3.0).mu) == (pad.fall, 0.5)
    assert [Pad(**one.to_dict()) for one in (pad, scaled)] == [pad, scaled]
    assert scaled.replace(mu=None) == pad


@pytest.mark.parametrize("left_out", [["mu_s"], ["mu_k"], ["v_ref"], ["V"], ["mu_s", "mu_k", "mu"]])
def test_the_law_is_whole_or_refused(left_out):
    whole = scene("b2-c").pad.to_dict()
    part = {name: value for name, value in whole.items() if name not in left_out}
    with pytest.raises(InputError, match=r"^Pad: \w+: missing; [\w ]+ needs it \(.*\)$"):
        Pad(**part)


@pytest.mark.parametrize("name", ["b1-c", "b2-c"])
def test_the_slope_enters_the_damping_matrix(name):
    one = scene(name)
    found = analyse(one)
    assert found.R_n is not None
    slope = -(LAW["mu_s"] - LAW["mu_k"]) / LAW["v_ref"] * math.exp(-10.0 / LAW["v_ref"])
    C = found.matrices.C
    assert C[0, 0] == pytest.approx(slope * found.R_n, rel=1e-12)
    assert not C[:, 1:].any()
    assert C[1, 0] == 0.0
    if name == "b2-c":  # friction acts at the arm h
        assert C[2, 0] == pytest.approx(one.pad.h * slope * found.R_n, rel=1e-12)
    # the sum of the eigenvalues is minus the trace of M^-1 C
    total = sum(e.value for e in found.spectrum.eigenvalues)
    assert total.real == pytest.approx(-slope * found.R_n / one.pad.m, rel=1e-8)
    # and damping of the scene comes on top
    rows = ((5.0, 1.0, 0.0), (0.0, 7.0, 0.0), (0.0, 0.2, 0.1))
    damped = dataclasses.replace(one, damping=Damping(matrix=rows))
    assert pytest.approx(C + np.array(rows), rel=1e-12) == analyse(damped).matrices.C


@pytest.mark.parametrize(("mu_s", "mu_k"), [(0.6, 0.3), (0.3, 0.6)])
def test_growth_of_one_degree_of_freedom_is_that_of_the_closed_form(mu_s, mu_k):
    """m x'' - mu' R_n x' + k x = 0 of a pad so stiff in contact that it only slides, on springs
    along x; mu' is the fall of friction at V. Friction that rises damps as much."""
    along = {"alpha1": 0.0, "alpha2": 0.0, "L1": 0.3, "L2": 0.3, "k1": 2e5, "k2": 2e5}
    law = {"V": 2.0, "mu_s": mu_s, "mu_k": mu_k, "v_ref": 1.5}
    found = analyse(Scene("B2", Pad(m=1.0, w=0.05, h=1e-4, k_c=1e10, F_n=300.0, **along, **law)))
    growth = (mu_s - mu_k) / 1.5 * math.exp(-2.0 / 1.5) * 300.0 / (2 * 1.0)
    assert found.matrices.C[0, 0] == pytest.approx(-2 * growth, rel=1e-6)
    mode = min((e.value for e in found.spectrum.eigenvalues), key=abs)
    assert mode.real == pytest.approx(growth, rel=1e-4)
    assert abs(mode.imag) == pytest.approx(math.sqrt(4e5 - growth**2), rel=1e-4)


@pytest.mark.parametrize(("name", "damped"), [("b1-c", True), ("b2-c", False)])
def test_motion_is_that_of_the_equations_written_out(name, damped):
    damping = DAMPED if damped else None
    one = scene(name, outputs=("history",), samples=6, tolerance=1e-13, damping=damping)
    one = dataclasses.replace(one, stop=0.2 * one.stop)
    times = np.linspace(0.0, one.stop, one.samples)
    C = full if damped else None
    given = one.model, one.pad, one.initial, times, C
    expected = motion(*given, mu=lambda u: friction(10.0 - u))
    constant = motion(*given)
    assert np.all(np.abs(constant - expected).max(axis=0) > 1e-4 * np.abs(expected).max(axis=0))
    for backend in INSTALLED:
        found = simulate(one, backend)
        columns = np.transpose([found.history[name] for name in COORDINATES])
        assert found.contact_changes > 0
        assert np.all(np.abs(columns - expected).max(axis=0) < 1e-8 * np.abs(expected).max(axis=0))


@needs_heyoka
def test_the_model_ends_where_the_pad_is_as_fast_as_the_surface():
    one = scene("b2-c", tolerance=1e-12).replace(V=2.0)
    ended = []
    for backend in ("heyoka", "scipy"):
        with pytest.raises(ComputationError, match="reached the speed V of the surface") as caught:
            simulate(one, backend)  # type: ignore[call-overload, unused-ignore]
        ended.append(float(str(caught.value).split("t = ")[1].split()[0]))
    assert ended[0] == pytest.approx(ended[1], rel=1e-6)
    # up to there it is the motion of the equations written out
    until = [0.0, ended[0]]

    def law(u):
        return friction(2.0 - u)

    assert motion(one.model, one.pad, one.initial, until, mu=law)[-1, 3] == pytest.approx(2.0)
    many = simulate_many("B2", one.pad, np.array([one.initial]), one.stop, 1e-8, one.formulation)
    assert many["limit"][0] == Limit.SURFACE_SPEED
    assert many["ended"][0] == pytest.approx(ended[0], rel=1e-6)
    fast = dataclasses.replace(one, initial=(0.0, 0.0, 0.0, 2.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"x_dot: 2.0 is not allowed; it must be below V = 2 "):
        simulate(fast)
