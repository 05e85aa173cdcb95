"""What heyoka compiles of the balance against mpmath, and maps with it against maps without."""

import itertools

import mpmath as mp
import numpy as np
import pytest

from squeal.equilibrium.statics import Statics
from squeal.io.scene import read_scene
from squeal.model.equations import net_loads
from squeal.model.pad import Coefficients
from squeal.queries.pads import maps
from squeal.queries.pads.maps import stability_map
from squeal.queries.pads.stack import PadStack, compiled_statics
from squeal.results.map import Axis
from tests.conftest import SCENES, needs_heyoka

pytestmark = needs_heyoka
STATES = list(itertools.product(["b1-a", "b2-b"], [(1, 1), (1, 0), (0, 1)]))


def balance(statics, z, on):
    """The residual of a pad in 40 digits."""
    c = Coefficients(*(mp.mpf(float(value)) for value in statics.model.c))._replace(mu=z[3])
    loads = net_loads(mp, c, statics.model.law, c.xy_theta(z), on)
    return [loads.x, loads.y, loads.moment / c.w]


@pytest.mark.parametrize(("stem", "on"), STATES)
def test_a_step_is_that_of_40_digits(stem, on):
    statics = Statics.of(read_scene(SCENES / f"{stem}.yaml").pad_model)
    compiled = compiled_statics(statics, 1)
    z = np.array([-0.31, -0.72, 0.23, 0.4])
    normal = [0.3, -0.2, 0.5, 0.7]
    surface = np.array([0.0, 0.0, *normal, 0.1])
    step, exists, derivatives = compiled.surface_step(
        z[:, None], 1.0 * np.array(on)[:, None], surface[:, None]
    )
    with mp.workdps(40):
        at = [mp.mpf(float(value)) for value in z]
        J = mp.matrix(4, 4)
        for i in range(3):
            for k in range(4):

                def entry(x, i=i, k=k):
                    return balance(statics, [*at[:k], x, *at[k + 1 :]], on)[i]

                J[i, k] = mp.diff(entry, at[k])
        for k in range(4):
            J[3, k] = mp.mpf(normal[k])
        value = mp.fdot(map(mp.mpf, normal), at) - mp.mpf(0.1)
        known = mp.lu_solve(J, mp.matrix([*balance(statics, at, on), value]))
        null = mp.lu_solve(J, mp.matrix([0, 0, 0, 1]))
        side = mp.sign(mp.det(J[:3, :3]))
    assert exists.all()
    assert step[:, 0] == pytest.approx([float(x) for x in known], rel=1e-11, abs=1e-12)
    rows = np.array(normal)[:, None]
    along = compiled.null_vectors(derivatives, rows)
    assert along[:, 0] == pytest.approx([float(x) for x in null], rel=1e-11, abs=1e-12)
    assert compiled.determinant_sign(derivatives) == float(side)


@pytest.mark.parametrize(("stem", "on"), STATES)
def test_a_step_to_a_fold_is_that_of_40_digits(stem, on):
    statics = Statics.of(read_scene(SCENES / f"{stem}.yaml").pad_model)
    compiled = compiled_statics(statics, 1)
    z = np.array([-0.31, -0.72, 0.23, 0.4])
    step, exists, derivatives = compiled.fold_step(z[:, None], 1.0 * np.array(on)[:, None])

    def residual(*at):
        return balance(statics, at, on)

    def determinant(*at):
        def entry(i, k):
            return mp.diff(lambda x: residual(*at[:k], x, *at[k + 1 :])[i], at[k])

        return mp.det(mp.matrix([[entry(i, k) for k in range(3)] for i in range(3)]))

    with mp.workdps(40):
        at = [mp.mpf(float(value)) for value in z]
        conditions = [*(lambda *p, i=i: residual(*p)[i] for i in range(3)), determinant]
        J = mp.matrix(4, 4)
        for i, condition in enumerate(conditions):
            for k in range(4):
                J[i, k] = mp.diff(lambda x, k=k, f=condition: f(*at[:k], x, *at[k + 1 :]), at[k])
        known = mp.lu_solve(J, mp.matrix([condition(*at) for condition in conditions]))
        slope = [float(J[3, k]) for k in range(4)]
    assert exists.all()
    assert step[:, 0] == pytest.approx([float(x) for x in known], rel=1e-9, abs=1e-10)
    assert derivatives[-1, :, 0] == pytest.approx(slope, rel=1e-9, abs=1e-10)


@pytest.mark.parametrize(
    ("stem", "names"),
    [
        ("b1-d", ("mu", "k1")),
        ("b1-a", ("alpha1", "alpha2")),
        ("b2-c", ("mu", "k1")),
        ("b2-d", ("alpha1", "alpha2")),
    ],
)
def test_maps_decide_as_without_a_compiler(stem, names, monkeypatch):
    """In every point, of which some lie beyond folds, others in partial contact."""
    scene = read_scene(SCENES / f"{stem}.yaml")
    ends = {"mu": (0.0, 1.5), "k1": (1e6, 1e9), "alpha1": (0.0, np.pi), "alpha2": (0.0, np.pi)}
    axes = (Axis(names[0], *ends[names[0]], 16), Axis(names[1], *ends[names[1]], 16))
    without = stability_map(scene, axes)
    monkeypatch.setattr(maps, "COMPILED_FROM", 0)
    compiled = stability_map(scene, axes)
    assert np.array_equal(compiled.codes, without.codes)
    assert np.array_equal(compiled.admissible, without.admissible)
    grid = np.reshape(np.meshgrid(axes[0].values, axes[1].values), (2, -1))
    ours, _ = PadStack.of(scene, names, grid, compiled=True).at_mu()
    theirs, _ = PadStack.of(scene, names, grid).at_mu()
    assert np.array_equal(ours.touching, theirs.touching)
    scale = 1.0 + np.abs(theirs.z[:, theirs.exists])
    assert np.max(np.abs(ours.z - theirs.z)[:, theirs.exists] / scale) < 1e-9
