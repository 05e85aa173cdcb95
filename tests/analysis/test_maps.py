"""Maps of damped scenes point by point against the verdict that `eigenvalues` gives there."""

import dataclasses
import math

import numpy as np
import pytest

from squeal.analysis.answers import Axis
from squeal.analysis.maps import NAMES, angle_axes, codes_at, stability_map
from squeal.analysis.pads import analyse, sweep_mu
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Damping, Scene, read_scene
from squeal.model.contact import Formulation
from squeal.model.pad import Pad
from squeal.schema.values import Place
from tests.conftest import ROOT, SCENES

MATRIX = Damping(matrix=((60.0, 10.0, 0.2), (10.0, 90.0, -0.1), (0.2, -0.1, 0.08)))
RATIOS = Damping(ratios=(0.004, 0.03, 0.001))


def scene_of(stem, damping):
    return dataclasses.replace(read_scene(SCENES / f"{stem}.yaml"), damping=damping)


def verdict_at(scene, pad):
    """What `eigenvalues --mu` tells of this pad, and 'beyond a fold' where its branch ends."""
    ((_, one),) = sweep_mu(dataclasses.replace(scene, pad=pad), [pad.mu])
    return "beyond a fold" if one is None else one.judgement.verdict


@pytest.mark.parametrize("damping", [MATRIX, RATIOS], ids=["matrix", "ratios"])
@pytest.mark.parametrize(("stem", "n"), [("b1-c", 4), ("b2-c", 4), ("b3", 16)])
def test_damped_maps_are_the_eigenvalues_point_by_point(stem, n, damping):
    scene, axes = scene_of(stem, damping), angle_axes(n)
    codes, met = stability_map(scene, axes).codes, set()
    for i, alpha1 in enumerate(axes[0].values):
        for j, alpha2 in enumerate(axes[1].values):
            pad = scene.pad.replace(alpha1=float(alpha1), alpha2=float(alpha2))
            expected = verdict_at(scene, pad)
            assert NAMES[codes[i, j]] == expected, (alpha1, alpha2)
            met.add(expected)
    assert met >= {"stable", "flutter"}


@pytest.mark.parametrize("damping", [MATRIX, RATIOS], ids=["matrix", "ratios"])
def test_masses_and_friction_that_vary(damping):
    # the damping ratios are those of each point's own pad
    scene = scene_of("b2-b", damping)
    axes = (Axis("mu", 0.0, 0.6, 6), Axis("m", 0.05, 0.5, 5))
    codes = stability_map(scene, axes).codes
    for i, mu in enumerate(axes[0].values):
        for j, m in enumerate(axes[1].values):
            pad = scene.pad.replace(mu=float(mu), m=float(m))
            assert NAMES[codes[i, j]] == verdict_at(scene, pad), (mu, m)


def test_a_branch_that_is_steep_beside_a_fold_does_not_turn_back():
    # beside these angles branches fold; here they come close to it and go on
    scene = read_scene(ROOT / "workflow" / "scenes" / "b2-d.yaml")
    places = [
        (1.4807, 1.0734),
        (1.4812, 1.1083),
        (1.4816, 1.1271),
        (1.4827, 1.213),
        (1.485, 1.3011),
    ]
    codes = codes_at(scene, ("alpha1", "alpha2"), np.array(places).T).codes
    for (alpha1, alpha2), code in zip(places, codes, strict=True):
        pad = scene.pad.replace(alpha1=alpha1, alpha2=alpha2)
        assert NAMES[code] == verdict_at(scene, pad) == "marginal", (alpha1, alpha2)


def test_a_branch_that_bends_where_a_stiff_face_tilts_does_not_turn_back():
    numbers = {"h": 0.2689816314417701, "I": 0.3026823240875288, "k2": 1.438826587096588}
    numbers |= {"k_c": 320045.6330011822, "L1": 7.468306790577523, "L2": 12.353271181464967}
    numbers |= {"alpha1": 1.4922565104551517, "alpha2": 2.149442007353456, "mu": 1.4625}
    numbers |= {"F_n": 0.0022663027845558946, "x0": 0.0725781542340169, "y0": -0.012209485629771793}
    pad = Pad(m=1.0, w=1.0, k1=1.0, theta0=0.004143949912545275, **numbers)
    scene = Scene("B2", pad, Formulation("mean", "frame", "-"))
    alone = analyse(scene)
    assert alone.on_branch
    code = codes_at(scene, ("mu", "alpha1"), np.array([[pad.mu], [pad.alpha1]])).codes[0]
    assert NAMES[code] == alone.judgement.verdict


def test_pads_that_rest_far_from_where_they_are_put():
    # short springs turn this pad by 50 degrees: no place that the load reaches is an equilibrium
    pad = Pad(
        m=1.16, w=0.0249, h=0.0155, k1=2.93e7, k2=6.4e6, L1=0.0575, L2=0.0858, alpha1=1.7,
        alpha2=2.15, mu=0.67, F_n=164.0, x0=-0.05, y0=1.4e-5, k_c=1.37e8,
    )  # fmt: skip
    scene = Scene("B2", pad, Formulation("mean", "frame"))
    found = stability_map(scene, (Axis("mu", 0.0, 0.8, 3), Axis("k2", 6.3e6, 6.5e6, 2)))
    expected = [
        [verdict_at(scene, pad.replace(mu=float(mu), k2=float(k2))) for k2 in (6.35e6, 6.45e6)]
        for mu in found.axes[0].values
    ]
    assert [[NAMES[code] for code in row] for row in found.codes] == expected
    assert {name for row in expected for name in row} == {"flutter"}
    assert not found.admissible.any()


def test_without_a_matrix_or_ratio_above_zero_nothing_is_damped():
    scene, axes = scene_of("b3", None), angle_axes(9)
    plain = stability_map(scene, axes).codes
    for zero in (Damping(ratios=(0.0,) * 3), Damping(matrix=((0.0,) * 3,) * 3)):
        assert np.array_equal(stability_map(scene_of("b3", zero), axes).codes, plain)


def test_ratios_of_an_unstable_mode_are_refused_with_the_place():
    # Eq. (21) as printed turns the contact's moment round: rotation falls off without friction
    scene = dataclasses.replace(scene_of("b3", RATIOS), formulation=Formulation(delta_moment="-"))
    with pytest.raises(ComputationError, match="unstable without friction at k_c = "):
        stability_map(scene, (Axis("k_c", 1e5, 1e9, 4), Axis("mu", 0.0, 0.1, 2)))


@pytest.mark.parametrize(("stem", "n"), [("b1-c", 7), ("b3", 16)])
def test_a_moment_of_inertia_that_was_left_out_follows(stem, n):
    # against the scene file with the mapped numbers written into it
    scene = read_scene(SCENES / f"{stem}.yaml").replace(I=None)
    pad = scene.pad
    axes = (Axis("w", 0.3 * pad.w, 3 * pad.w, n), Axis("alpha1", 0.3, 2.9, n))
    codes = stability_map(scene, axes).codes
    for i, w in enumerate(axes[0].values.tolist()):
        for j, alpha1 in enumerate(axes[1].values.tolist()):
            document = scene.to_dict()
            document["parameters"] |= {"w": w, "alpha1": alpha1}
            edited = Scene.from_dict(document, Place("edited"))
            assert NAMES[codes[i, j]] == verdict_at(edited, edited.pad), (w, alpha1)
    held = stability_map(scene.replace(I=pad.I), axes).codes
    assert not np.array_equal(codes, held)


def test_a_logarithmic_axis_has_equal_ratios():
    scene = read_scene(SCENES / "b3.yaml")
    axis = Axis("k1", 1e6, 1e10, 40, log=True)
    assert axis.values[1:] / axis.values[:-1] == pytest.approx(1e4 ** (1 / 40))
    assert math.sqrt(axis.values[0] * axis.values[-1]) == pytest.approx(1e8)
    other = Axis("k_c", 1e6, 1e10, 40, log=True)
    found = stability_map(scene, (axis, other))
    for i, j in ((0, 0), (20, 20), (21, 30), (39, 5)):
        changed = scene.replace(k1=float(axis.values[i]), k_c=float(other.values[j]))
        assert NAMES[found.codes[i, j]] == analyse(changed).judgement.verdict
    assert found.share["flutter"] > 0.05


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-1.0, 1.0)])
def test_a_logarithmic_axis_lies_above_zero(low, high):
    Axis("x0", low, high, 10)
    with pytest.raises(InputError, match="above 0 on a logarithmic axis"):
        Axis("x0", low, high, 10, log=True)
