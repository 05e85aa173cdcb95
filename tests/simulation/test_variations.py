"""Growth of small deviations: closed forms, and neighbouring motions in quad precision."""

import dataclasses
import math

import numpy as np
import pytest

from squeal.io.scene import Scene, read_scene
from squeal.simulation.cycles import variations
from squeal.simulation.hybrid import integrate
from squeal.simulation.run import in_natural_units
from tests.conftest import HEYOKA, SCENES, needs_heyoka
from tests.simulation.closed import upright

if HEYOKA:
    import heyoka as hy

    from squeal.simulation.taylor import TaylorIntegrator


def test_linear_motion_in_closed_form():
    # upright springs, no friction, always pressed: the vertical part is a harmonic oscillator
    pad = upright()
    rate = math.sqrt((pad.k1 + pad.k2 + pad.k3 + pad.k4) / pad.m)
    sag = pad.F_n / (pad.m * rate**2)
    scene = Scene("B1", pad, initial=(0, -0.9 * sag, 0, 0, 0, 0), stop=7.3 / rate, samples=2)
    found = variations(scene)
    units, *_ = in_natural_units(scene)
    matrix = found.matrix * math.exp(found.logarithm)
    w, t = rate * units.time, found.t
    expected = [[math.cos(w * t), math.sin(w * t) / w], [-w * math.sin(w * t), math.cos(w * t)]]
    assert matrix[np.ix_([1, 4], [1, 4])] == pytest.approx(np.array(expected), abs=1e-4)


@pytest.mark.parametrize("name", ["b1-a", "b1-c", "b2-a", "b2-c"])
@needs_heyoka
def test_deviations_against_neighbouring_motions_in_quad_precision(name):
    # through all contact changes: the jump matrices are the identity
    scene = read_scene(SCENES / f"{name}.yaml", "simulate")
    scene = dataclasses.replace(scene, stop=0.3 * scene.stop)
    found = variations(scene)
    units, model, first, stop = in_natural_units(scene)
    exact = TaylorIntegrator(model, 1e-28, hy.real128)
    small = hy.real128(1e-16)

    def end(direction: np.ndarray, way: int) -> np.ndarray:
        start = np.array(
            [
                hy.real128(float(v)) + way * small * hy.real128(float(d))
                for v, d in zip(first, direction, strict=True)
            ]
        )
        _, state, _, changes = integrate(model, exact, units, start, stop, [])
        assert changes > 0
        return state

    rng = np.random.default_rng(3)
    for _ in range(2):
        direction = rng.standard_normal(6)
        pair = end(direction, 1), end(direction, -1)
        difference = np.array([float((a - b) / (2 * small)) for a, b in zip(*pair, strict=True)])
        told = found.matrix @ direction * math.exp(found.logarithm)
        assert np.abs(told - difference).max() < 1e-3 * np.abs(difference).max()


def test_phase_space_keeps_its_volume():
    # no damping: the trace of the linear equations is zero, friction or not
    scene = read_scene(SCENES / "b1-a.yaml", "simulate")
    found = variations(dataclasses.replace(scene, stop=0.2 * scene.stop))
    sign, logarithm = np.linalg.slogdet(found.matrix)
    assert sign == 1.0
    assert logarithm + 6 * found.logarithm == pytest.approx(0.0, abs=1e-3)
