"""A map and a query are one answer where they once differed; `tests/two_ways` has random places."""

import math

import numpy as np
import pytest

from squeal.analysis.maps import NAMES, codes_at
from squeal.analysis.pads import critical_friction, sweep_mu
from squeal.analysis.stack import PadStack
from squeal.equilibrium import Path
from squeal.io.scene import Scene
from squeal.model.pad import Pad

POINTS = Scene(
    "B1",
    Pad(m=0.2, w=0.04, h=0.014, k1=2.0e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8, L2=0.8,
        alpha1=math.pi / 2, alpha2=math.pi, mu=0.4, F_n=4500.0),
)  # fmt: skip
ANGLES = ("alpha1", "alpha2")


def test_a_contour_takes_the_fold_that_the_query_finds():
    """Once a grid value, 1.34375; and around it the map changed between marginal and beyond."""
    place = np.array([[0.32798], [0.42706]])
    scene = POINTS.replace(alpha1=0.32798, alpha2=0.42706)
    fold = critical_friction(scene).points[-1]
    assert fold.kind == "fold"
    loss = PadStack.of(POINTS, ANGLES, place).first_losses(2.0).mu[0]
    assert loss == pytest.approx(fold.mu, rel=1e-9)
    mus = np.linspace(1.33, 1.36, 61)
    names = [NAMES[code] for code in codes_at(scene, ("mu",), mus[None]).codes]
    expected = ["marginal" if mu < fold.mu else "beyond a fold" for mu in mus]
    assert names == expected


def test_a_change_of_contact_that_makes_the_pad_soft_is_no_fold():
    """An edge parts, det K falls by decades; once steps over mu became too short there."""
    scene = POINTS.replace(alpha1=1.557509108607938, alpha2=1.5448663685984143)
    path = Path.of(scene.pad_model, 0.9)
    assert path.breakpoints
    assert path.mu_end == 0.9
    ((_, found),) = sweep_mu(scene, [0.9])
    code = codes_at(scene, ("mu",), np.array([[0.9]])).codes[0]
    assert NAMES[code] == found.judgement.verdict
