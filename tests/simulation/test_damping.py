"""Damping matrices against ratios and formulas, and damped motion on many springs."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from squeal.equilibrium.damping import damping_matrix
from squeal.errors import ComputationError
from squeal.io.scene import Damping, read_scene
from squeal.model.contact import CONSISTENT, Formulation
from squeal.queries.pads.equilibrium import analyse
from squeal.simulation.run import simulate
from tests.conftest import SCENES, needs_heyoka

# every entry its own, not symmetric: nothing may be mixed up
C = np.array([[40.0, 6.0, 0.3], [-9.0, 55.0, -0.4], [0.2, 0.5, 0.05]])
DAMPED = Damping(matrix=tuple(map(tuple, C.tolist())))


def scene(name, **more):
    one = read_scene(SCENES / f"{name}.yaml")
    plain: dict[str, Any] = {"formulation": CONSISTENT, "damping": DAMPED}
    return dataclasses.replace(one, **(plain | more))


@pytest.mark.parametrize(
    ("damping", "ratio"),
    [
        (Damping(ratios=(0.01, 0.03, 0.02)), lambda w: [0.01, 0.03, 0.02]),
        (Damping(rayleigh=(50.0, 3e-7)), lambda w: (50.0 / w + 3e-7 * w) / 2),
    ],
)
def test_ratios_are_those_of_the_modes_without_friction(damping, ratio):
    one = scene("b2-d", damping=None).replace(mu=0.0)
    w = np.array([abs(e.value.imag) for e in analyse(one).spectrum.eigenvalues[::2]])
    found = analyse(dataclasses.replace(one, damping=damping))
    ratios = [e.damping_ratio for e in found.spectrum.eigenvalues[::2]]
    assert ratios == pytest.approx(ratio(w), rel=1e-9)
    # and the matrix is the same with friction, in every contact state
    rubbing = scene("b2-d", damping=damping)
    assert pytest.approx(found.matrices.C, rel=1e-12) == analyse(rubbing).matrices.C
    assert damping_matrix(rubbing) == pytest.approx(found.matrices.C, rel=1e-12)


def test_damping_that_has_no_modes_to_refer_to_is_refused():
    ratios = Damping(ratios=(0.01, 0.02, 0.03))
    scene = dataclasses.replace(read_scene(SCENES / "b3.yaml"), damping=ratios).replace(k_c=1e9)
    # Eq. (10) as printed turns the contact's moment round: rotation falls off without friction
    turned = dataclasses.replace(scene, formulation=Formulation(delta_moment="-"))
    assert damping_matrix(scene).any()
    with pytest.raises(ComputationError, match="unstable without friction"):
        damping_matrix(turned)
    scene = dataclasses.replace(read_scene(SCENES / "b2-c.yaml"), damping=ratios)
    assert damping_matrix(scene).any()
    with pytest.raises(ComputationError, match="without friction the pad has no place of rest"):
        damping_matrix(scene.replace(y0=scene.pad.w))  # held far off the surface


@needs_heyoka
@pytest.mark.parametrize("falling", [False, True])
def test_springs_along_the_face_are_damped_alike(falling):
    # one code serves all contact states there, with its own places for the numbers of the terms
    one = scene("b2-c", model="BN", formulation=Formulation(springs=5), tolerance=1e-12)
    one = dataclasses.replace(one, stop=0.3 * one.stop, outputs=("shares",))
    if falling:
        one = one.replace(mu=None, V=40.0, mu_s=0.9, mu_k=0.3, v_ref=30.0)
    ours = simulate(one, "heyoka")
    theirs = simulate(one, "scipy")
    undamped = simulate(dataclasses.replace(one, damping=None), "heyoka")
    assert ours.contact_changes == theirs.contact_changes > 0
    scale = np.abs(theirs.final[1:]).max()
    assert ours.final[1:] == pytest.approx(theirs.final[1:], abs=1e-7 * scale)
    assert np.abs(np.subtract(undamped.final, ours.final)).max() > 1e-3 * scale
