"""Poles by python-control and friction as a loop gain, against closed forms and more digits."""

import math

import mpmath as mp
import numpy as np
import pytest

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.figures import control as figure
from squeal.article.records import Missing
from squeal.article.studies import eigenvalues
from squeal.article.studies.eigenvalues import FrictionLoop, Loop
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import read_scene
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.thresholds import critical_friction
from tests import naive
from tests.conftest import ROOT

STEMS = ("b1-d", "b2-b", "b2-d")


def reference(name):
    return read_scene(ROOT / f"workflow/scenes/{name}.yaml")


@pytest.fixture(scope="module")
def loops():
    return {name: eigenvalues.loop_of(reference(name)) for name in STEMS}


def coalescing(damping, coupling=0.5):
    """Two oscillators of unit mass with K = [[2, c mu], [-c mu, 3]], and one that stands apart.

    Each entry of the coupling is a loop of gain mu, as in two-mode models of squeal. Damping is d
    times M.
    """
    K_0 = np.diag([2.0, 3.0, 50.0])
    loads = np.zeros((3, 3))
    loads[0, 1] = -coupling
    loads[1, 0] = coupling
    left, values, right = np.linalg.svd(loads)
    return FrictionLoop(
        rate=1.0,
        M=np.eye(3),
        C=damping * np.eye(3),
        K_0=K_0,
        inputs=left[:, :2],
        outputs=values[:2, None] * right[:2],
        second=1.0,
    )


@pytest.mark.parametrize("damping", [0.01, 0.1, 0.3])
def test_the_critical_gain_of_two_coalescing_modes_is_that_of_the_closed_form(damping):
    """s^2 + d s + k = 0 with k = 2.5 +- i kappa, kappa^2 = (c mu)^2 - 1/4, has a root on the axis
    where kappa^2 = 2.5 d^2."""
    loop = coalescing(damping)
    expected = math.sqrt(0.25 + 2.5 * damping**2) / 0.5
    gains = np.linspace(0.0, 2.0, 41)
    values = eigenvalues.closed_poles(loop, gains)
    found = eigenvalues.critical_gain(loop, gains, values)
    assert found == pytest.approx(expected, rel=1e-9)


def single(first, second, damping):
    """The load b r' q of one loop on the modes k = first, second of unit mass; b = (1, 1, 0),
    r = (1, -1, 0)."""
    return FrictionLoop(
        rate=1.0,
        M=np.eye(3),
        C=damping * np.eye(3),
        K_0=np.diag([first, second, 50.0]),
        inputs=np.array([[1.0], [1.0], [0.0]]),
        outputs=np.array([[1.0, -1.0, 0.0]]),
        second=0.0,
    )


def test_a_loop_that_is_unstable_without_gain_has_the_critical_gain_zero():
    loop = single(-1.0, 3.0, 0.1)
    gains = np.linspace(0.0, 2.0, 41)
    assert eigenvalues.critical_gain(loop, gains, eigenvalues.closed_poles(loop, gains)) == 0.0


def test_sentences_fall_where_cases_have_no_loop(loops):
    """A scene without steady sliding has a reason in place of its loop."""
    for names in (HISTORY_FIGURES, ("b2-a", "b2-c")):
        missing = dict.fromkeys(names, Missing("no steady sliding"))
        record = eigenvalues.Eigenvalues(scenes={}, loops=loops | missing, apart=0.0)
        checks = eigenvalues.sentences(record)
        assert not checks["python-control-agrees-with-own-eigenvalues"]
        assert not checks["frozen-and-followed-agree-in-c-and-d"]
        assert not checks["following-the-equilibrium-keeps-a-and-b-stable"]


def test_a_study_of_scenes_without_steady_sliding_has_the_reasons(monkeypatch):
    monkeypatch.setattr(eigenvalues, "examined", lambda _: Missing("none"))
    monkeypatch.setattr(eigenvalues, "loop_of", lambda _: Missing("none"))
    record = eigenvalues.study([ROOT / f"workflow/scenes/{name}.yaml" for name in HISTORY_FIGURES])
    assert record.apart == 0.0
    assert set(record.loops.values()) == {Missing("none")}


@pytest.mark.parametrize("damping", [0.02, 0.2])
def test_the_gain_margin_of_one_loop_is_that_of_the_closed_form(damping):
    """K = [[a - mu, mu], [-mu, b + mu]] has the roots m +- i kappa, m = (a + b)/2 and
    kappa^2 = mu^2 - (D + mu)^2 with D = (b - a)/2 < 0."""
    a = 3.0
    b = 2.0
    loop = single(a, b, damping)
    half = (b - a) / 2.0
    mean = (a + b) / 2.0
    # mu^2 - (half + mu)^2 = mean d^2 where a root reaches the axis
    expected = (mean * damping**2 + half**2) / (-2.0 * half)
    margins = eigenvalues.gain_margins(loop)
    assert margins[0] == pytest.approx(expected, rel=1e-9)
    gains = np.linspace(0.0, 1.0, 21)
    values = eigenvalues.closed_poles(loop, gains)
    assert eigenvalues.critical_gain(loop, gains, values) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("a", "b"), [(0.2, 0.5), (0.3, 0.7)])
def test_a_gain_at_which_a_pole_reaches_zero_is_listed_once(a, b):
    """det [[a - mu, mu], [-mu, b + mu]] = 0 at mu = a b / (b - a)."""
    margins = eigenvalues.gain_margins(single(a, b, 0.2))
    assert margins == [pytest.approx(a * b / (b - a), rel=1e-9)]


def test_modulus_margin_is_the_least_distance_on_a_dense_grid():
    loop = single(3.0, 2.0, 0.2)
    omega = np.linspace(0.01, 10.0, 200001)
    a = 1.0 / (3.0 - omega**2 + 0.2j * omega)
    b = 1.0 / (2.0 - omega**2 + 0.2j * omega)
    mu = 0.3
    assert eigenvalues.modulus_margin(loop, mu) == pytest.approx(
        np.abs(1.0 - mu * (a - b)).min(), rel=1e-3
    )


def test_static_margin_of_b_is_the_divergence_in_closed_form(loops):
    """For small displacements in full contact det K = 0 at mu = (1 + 4r)/(6 r h/w), r = k2/k_c."""
    pad = reference("b2-b").pad
    r = pad.k2 / pad.k_c
    expected = (1.0 + 4.0 * r) / (6.0 * r * pad.h / pad.w)
    loop = loops["b2-b"]
    assert loop.frozen == pytest.approx(expected, rel=2e-3)
    assert loop.frequency_hz == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("name", ["b1-d", "b2-d"])
def test_poles_are_roots_of_the_characteristic_polynomial_in_50_digits(name, loops):
    """From the article's equations by differences in mpmath; damping from their modes."""
    scene = reference(name)
    at, _ = sliding_equilibrium(scene.pad_model)
    still, _ = sliding_equilibrium(scene.pad_model.replace(mu=0.0))
    masses = [scene.pad.m, scene.pad.m, scene.pad.I]

    def stiffness(mu, where):
        slopes = naive.jacobian(
            scene.model, scene.pad.replace(mu=mu), scene.formulation, where.q, where.state
        )
        return -mp.matrix(slopes)

    root = [mp.sqrt(mass) for mass in masses]
    K_still = stiffness(0.0, still)
    scaled = mp.matrix(3, 3)
    for i in range(3):
        for j in range(3):
            scaled[i, j] = (K_still[i, j] + K_still[j, i]) / 2 / (root[i] * root[j])
    squares, modes = mp.eigsy(scaled)
    ratio = mp.mpf(eigenvalues.RATIO)
    rates = mp.diag([2 * ratio * mp.sqrt(square) for square in squares])
    B = modes * rates * modes.T
    C = mp.matrix(3, 3)
    for i in range(3):
        for j in range(3):
            C[i, j] = root[i] * B[i, j] * root[j]
    K = stiffness(scene.pad.mu, at)
    for pole in loops[name].poles:
        s = mp.mpc(pole.real, pole.imag)

        def determinant(s):
            return mp.det(mp.diag(masses) * s**2 + C * s + K)

        root_near = mp.findroot(determinant, s)
        assert abs(root_near - s) < 1e-8 * abs(s)


def test_the_frozen_loop_at_the_reference_friction_is_the_linearisation(loops):
    """K_0 - mu b r' is the stiffness about the equilibrium, friction included."""
    for name in STEMS:
        scene = reference(name)
        loop = eigenvalues.friction_loop(scene)
        pad = scene.pad
        lengths = np.diag([1.0, 1.0, 1.0 / pad.w])
        K = lengths @ analyse(scene).matrices.K @ lengths / pad.k1
        assert np.abs(loop.matrices(pad.mu).K - K).max() < 1e-14 * np.abs(K).max()
        # the line has one arm of friction, h
        if name.startswith("b2"):
            force, none, moment = loop.inputs[:, 0]
            assert loop.inputs.shape == (3, 1)
            assert none == pytest.approx(0.0, abs=1e-15)
            assert moment / force == pytest.approx(pad.h / pad.w, rel=1e-12)


def test_frozen_and_followed_part_where_friction_moves_the_equilibrium(loops):
    assert isinstance(loops["b2-d"], Loop)
    at = loops["b2-d"]
    mu = reference("b2-d").pad.mu
    index = int(np.argmin(np.abs(np.array(at.locus.mu) - mu)))
    frozen = np.array(at.locus.imag)[:, index]
    followed = np.array(at.path.imag)[:, index]
    # near the reference friction both are alike
    assert np.sort(frozen) == pytest.approx(np.sort(followed), rel=1e-2, abs=1.0)
    assert at.ends.startswith("the branch from mu = 0 turns back")
    fold = critical_friction(reference("b2-d")).points[-1]
    assert fold.kind == "fold"
    assert at.path.mu[-1] <= fold.mu < at.path.mu[-1] + 0.01


def test_tracked_poles_are_the_same_poles():
    values = np.array([[1.0 + 1j, 1.0 - 1j], [1.1 - 1.1j, 1.1 + 1.1j], [1.2 + 1.2j, 1.2 - 1.2j]])
    rows = eigenvalues.tracked(values)
    assert (rows.imag[:, 0] < 0.0).all()
    assert np.sort_complex(rows[1]) == pytest.approx(np.sort_complex(values[1]))


def test_the_figure_draws_each_locus_and_marks_the_critical_gain(loops):
    drawn = figure.control_figure(loops)
    first, second, third = drawn.axes[:3]
    assert first.get_title() == "B1 (d): no critical gain"
    for axes, name in ((second, "b2-b"), (third, "b2-d")):
        lines = [line for line in axes.get_lines() if line.get_gid() == "frozen"]
        assert len(lines) == 6
        real = np.array(loops[name].locus.real) / 1e3
        assert all(np.array_equal(a.get_xdata(), b) for a, b in zip(lines, real, strict=True))
        (mark,) = (line for line in axes.get_lines() if line.get_gid() == "critical gain")
        assert mark.get_xdata() == pytest.approx(0.0)
        assert mark.get_ydata() == pytest.approx(loops[name].frequency_hz / 1e3)
