"""Sliding equilibria and critical friction against the literal equations in mpmath."""

import dataclasses
import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from squeal.critical import critical_friction
from squeal.equilibrium import Path, find_all, sliding_equilibrium
from squeal.model import PadModel
from squeal.scene import read_scene
from squeal.scene.schema import Damping, Scene
from squeal.sliding import analyse
from tests import naive
from tests.conftest import SCENES, random_pad


def scene_of(stem, **changes):
    scene = read_scene(SCENES / f"{stem}.yaml")
    return dataclasses.replace(scene, pad=scene.pad.replace(**changes))


def exact(name, pad, form, guess, state):
    """The equilibrium near `guess` to 40 digits, by Newton's method on the literal equations."""
    q = mp.matrix([mp.mpf(v) for v in guess])
    for _ in range(6):
        f = mp.matrix(naive.loads(name, pad, form, list(q), state))
        q -= mp.lu_solve(naive.jacobian(name, pad, form, list(q), state), f)
    return q


@pytest.mark.parametrize("stem", ["b1-a", "b1-c", "b2-a", "b2-c", "b2-d"])
def test_every_equilibrium_is_one_of_the_literal_equations(stem):
    scene = scene_of(stem)
    model = scene.pad_model
    found = find_all(model)
    assert found
    for e in found:
        q = exact(scene.model, scene.pad, scene.formulation, e.q, e.state)
        assert max(abs(a - b) for a, b in zip(q, e.q, strict=True)) < 1e-11 * scene.pad.w
        assert model.state_at(e.q) == e.state
        assert e.R_n > 0


def test_static_balance_by_hand_of_case_b():
    # in case b spring 1 lies level and spring 2 stands upright: delta = w (1 - F_n/Rn) - 2 h mu
    pad = scene_of("b2-b", theta0=0.0, L1=1e6, L2=1e6).pad
    model = PadModel("B2", pad)
    e, _ = sliding_equilibrium(model)
    expected = pad.w * (1 - pad.F_n / e.R_n) - 2 * pad.h * pad.mu
    # small rotations shift the levers by some theta^2 and theta h
    assert e.delta == pytest.approx(expected, abs=5 * abs(e.q[2]) * pad.w)


def characteristic(name, pad, form, mu, guess, state):
    """Discriminant and constant term of det(s M - K) about the exact equilibrium at mu."""
    p = pad.replace(mu=mp.mpf(mu))
    q = exact(name, p, form, guess, state)
    K = -naive.jacobian(name, p, form, list(q), state)
    A = mp.matrix(3, 3)
    for i, m in enumerate((p.m, p.m, p.I)):
        for j in range(3):
            A[i, j] = K[i, j] / m
    a = A[0, 0] + A[1, 1] + A[2, 2]
    minors = ((0, 1), (0, 2), (1, 2))
    b = sum(A[i, i] * A[j, j] - A[i, j] * A[j, i] for i, j in minors)
    c = mp.det(A)
    return a * a * b * b - 4 * b**3 - 4 * a**3 * c + 18 * a * b * c - 27 * c * c, c


def test_threshold_of_b1_a_is_a_zero_of_the_exact_discriminant():
    scene = scene_of("b1-a")
    point = critical_friction(scene).points[0]
    assert point.kind == "flutter"
    path = Path.of(scene.pad_model, 1.0)
    e = path.equilibrium(point.mu)
    below, above = (
        characteristic("B1", scene.pad, scene.formulation, point.mu * f, e.q, e.state)[0]
        for f in (1 - mp.mpf(10) ** -9, 1 + mp.mpf(10) ** -9)
    )
    assert below > 0 > above  # real roots below, a complex pair above


def test_fold_is_a_zero_of_the_exact_determinant():
    scene = scene_of("b2-c")
    found = critical_friction(scene)
    assert [p.kind for p in found.points] == ["fold"]
    mu = found.points[0].mu
    path = Path.of(scene.pad_model, 2.0)
    values = []
    for share in (1e-4, 1e-6):
        e = path.equilibrium(mu * (1 - share))
        args = (scene.pad, scene.formulation, mu * (1 - share), e.q, e.state)
        values.append(characteristic("B2", *args)[1])
    # next to a fold the determinant goes to zero as the square root of the distance
    assert values[0] / values[1] == pytest.approx(10.0, rel=0.02)
    assert path.equilibrium(mu * (1 + 1e-9)) is None


def test_equilibrium_along_the_branch_is_exact_on_both_sides_of_a_contact_change():
    scene = scene_of("b2-a")
    path = Path.of(scene.pad_model, 1.0)
    (change,) = path.breakpoints
    for mu in (change * (1 - 1e-9), change * (1 + 1e-9)):
        e = path.equilibrium(mu)
        pad = scene.pad.replace(mu=mu)
        q = exact("B2", pad, scene.formulation, e.q, e.state)
        assert max(abs(a - b) for a, b in zip(q, e.q, strict=True)) < 1e-12 * scene.pad.w
    states = [path.equilibrium(change * (1 + s)).state for s in (-1e-6, 1e-6)]
    assert states[0] != states[1]


@pytest.mark.parametrize("seed", range(12))
def test_eigenvalues_of_random_pads(seed):
    angles = np.random.default_rng(seed).uniform(1.7, 2.6, 2)
    pad = random_pad(seed, alpha1=angles[0], alpha2=angles[1])
    name: Any = "B1" if seed % 2 else "B2"
    e, _ = sliding_equilibrium(PadModel(name, pad))
    if e is None:
        pytest.skip("no steady sliding")
    scene = Scene(name, pad)
    values = analyse(scene).spectrum.values
    q = exact(name, pad, scene.formulation, e.q, e.state)
    K = -naive.jacobian(name, pad, scene.formulation, list(q), e.state)
    A = mp.matrix(3, 3)
    for i, m in enumerate((pad.m, pad.m, pad.I)):
        for j in range(3):
            A[i, j] = -K[i, j] / m
    roots = [mp.sqrt(v) for v in mp.eig(A, left=False, right=False)]
    expected = np.array([complex(r) for root in roots for r in (root, -root)])
    radius = np.abs(expected).max()
    for value in expected:
        assert np.abs(values - value).min() < 1e-10 * radius


def test_damping_destabilises_no_pad_that_has_no_friction():
    scene = dataclasses.replace(
        scene_of("b1-a", mu=0.0), damping=Damping(ratios=(0.01, 0.02, 0.03))
    )
    found = analyse(scene)
    assert found.judgement.verdict == "stable"
    # modal ratios without friction are met by definition
    ratios = [e.damping_ratio for e in found.spectrum.eigenvalues[::2]]
    assert ratios == pytest.approx([0.01, 0.02, 0.03], rel=1e-9)


def test_a_damping_matrix_is_taken_as_it_is():
    rows = ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 0.5))
    scene = dataclasses.replace(scene_of("b2-d"), damping=Damping(matrix=rows))
    assert np.array_equal(analyse(scene).matrices.C, np.array(rows))


def test_range_of_mu_ends_where_it_is_told_to():
    scene = scene_of("b1-a")
    assert critical_friction(scene, 0.3).points == ()
    assert len(critical_friction(scene, 0.4).points) == 1
    assert math.isclose(critical_friction(scene, 0.3).mu_end, 0.3)
