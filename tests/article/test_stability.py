"""Stability over friction: against literal equations, folds, and simulations."""

import dataclasses

import mpmath as mp
import numpy as np
import pytest

from squeal.article import outline
from squeal.article.figures import coupling, modes
from squeal.article.figures import quasi_static as quasi_static_figure
from squeal.article.records import Missing
from squeal.article.studies import angles as angle_study
from squeal.article.studies.quasi_static import quasi_static
from squeal.article.studies.stability import Branch, Stability, branch, examined
from squeal.equilibrium import Path, sliding_equilibrium
from squeal.io.scene import Damping, Scene
from squeal.linear import verdict
from squeal.plots.modes import LARGEST
from squeal.queries.pads.equilibrium import analyse, at_equilibrium
from squeal.queries.pads.maps import angle_axes
from squeal.queries.thresholds import critical_friction
from tests import naive
from tests.article.growth import fit
from tests.conftest import SCENES, random_pad, scene_of

STEMS = ("b1-a", "b2-c", "b2-d")


@pytest.fixture(scope="module")
def record():
    return Stability(tuple(examined(name, scene_of(name)) for name in STEMS))


def exact_stiffness(scene, mu, at):
    pad = scene.pad.replace(mu=mu)
    slopes = naive.jacobian(scene.model, pad, scene.formulation, at.q, at.state)
    return np.array([pad.m, pad.m, pad.I]), slopes


@pytest.mark.parametrize("share", [0.5, 0.95, 1.05, 2.0])
def test_growth_of_a_simulation_is_an_exact_eigenvalue(share):
    scene = scene_of("b1-a")
    mu = share * critical_friction(scene, 1.0).points[0].mu
    at = Path.of(scene.pad_model, 1.0).equilibrium(mu)
    predicted, fitted = fit(scene, at)
    masses, slopes = exact_stiffness(scene, mu, at)
    A = mp.matrix(3, 3)
    for i, m in enumerate(masses.tolist()):
        for j in range(3):
            A[i, j] = slopes[i][j] / m
    roots = [complex(mp.sqrt(v)) for v in mp.eig(A, left=False, right=False)]
    exact = np.concatenate([roots, np.negative(roots)])
    assert np.abs(exact - predicted).min() < 1e-9 * abs(fitted)
    # the motion is linear to its size of 1e-6
    assert np.abs(exact - fitted).min() < 1e-6 * abs(fitted)
    assert (fitted.real > 1.0) == (share > 1.0)


def test_branch_and_equilibrium_have_the_same_eigenvalues(record):
    for one in record.scenes:
        values = analyse(scene_of(one.name)).spectrum.values
        i = one.branch.mu.index(one.mu)
        swept = np.array(one.branch.real)[:, i] + 1j * np.array(one.branch.imag)[:, i]
        distance = np.abs(swept[:, None] - values[None, :]).min(axis=0)
        assert distance.max() < 1e-9 * np.abs(values).max()
        leaves_axis = np.abs(one.branch.real).max() > 1e-9 * np.abs(one.branch.imag).max()
        assert bool(one.branch.thresholds) == leaves_axis


def test_a_branch_is_followed_up_to_its_fold():
    one = branch(Scene("B2", random_pad(2, "B2")))
    assert isinstance(one, Branch)
    assert one.thresholds[-1].kind == "fold"
    assert one.fold * (1 - 2e-9) < one.mu[-1] < one.fold
    assert isinstance(branch(Scene("B2", random_pad(1, "B2", k1=0.0, k2=0.0))), Missing)


def test_mode_shapes_solve_the_eigenvalue_problem(record):
    for one in record.scenes:
        scene = scene_of(one.name)
        at, _ = sliding_equilibrium(scene.pad_model)
        masses, slopes = exact_stiffness(scene, scene.pad.mu, at)
        A = -np.array(slopes, dtype=float) / masses[:, None]
        assert len(one.equilibrium.modes) == 3
        for mode in one.equilibrium.modes:
            shape = np.array(mode.real) + 1j * np.array(mode.imag)
            assert np.abs(shape).max() == pytest.approx(1.0)
            v = shape / [1.0, 1.0, scene.pad.w]
            s = mode.growth_rate + 2j * np.pi * mode.frequency_hz
            assert np.abs(s * s * v + A @ v).max() < 1e-9 * np.abs(A).max() * np.abs(v).max()


def drawn(figure, gid):
    lines = []
    for axes in figure.axes:
        lines += [line for line in axes.get_lines() if line.get_gid() == gid]
    return lines


def test_the_coupling_figure_draws_what_it_is_given(record):
    figure = coupling.coupling_figure(record)
    lines = drawn(figure, "mode 1") + drawn(figure, "mode 2") + drawn(figure, "mode 3")
    for one in record.scenes[1:]:
        for k in range(3):
            frequency = np.abs(one.branch.imag[2 * k]) / (2e3 * np.pi)
            growth = np.array(one.branch.real[2 * k]) / 1e3
            for values in (frequency, growth):
                assert any(np.array_equal(line.get_ydata(), values) for line in lines)
    assert "B2, case (c)" in coupling.draw(record).alternative


def test_the_modes_figure_draws_rigid_pads_that_moved_by_the_shape(record):
    figure = modes.modes_figure(record)
    shown = [s for s in record.scenes if s.model == "B2"]
    given = []
    for k in range(3):
        given += [(scene, scene.equilibrium.modes[k]) for scene in shown]
    at_rest = drawn(figure, "rest")
    in_first_phase = drawn(figure, "first phase")
    for (scene, mode), line, moved_line in zip(given, at_rest, in_first_phase, strict=True):
        rest = np.array(line.get_xydata())[:4]
        first = np.array(moved_line.get_xydata())[:4]
        moved = LARGEST * np.array(mode.real)
        assert np.allclose(first.mean(axis=0) - rest.mean(axis=0), moved[:2], atol=1e-12)
        side = complex(*(rest[1] - rest[0]))
        moved_side = complex(*(first[1] - first[0]))
        assert np.angle(moved_side / side) == pytest.approx(moved[2])
        assert np.linalg.norm(first[2] - first[1]) == pytest.approx(2 * scene.h / scene.w)


def test_the_map_of_equilibria_is_that_of_single_ones(monkeypatch):
    cells = 4
    monkeypatch.setattr(angle_study, "CELLS", cells)
    monkeypatch.setattr(angle_study, "COARSE", 2)  # of the damped share, which the next test checks
    monkeypatch.setattr(outline, "HALVINGS", 5)
    record = angle_study.study([SCENES / "b2-c.yaml"])
    scene = scene_of("b2-c")
    codes = []
    for a in angle_axes(cells)[0].values.tolist():
        for b in angle_axes(cells)[1].values.tolist():
            one = scene.replace(alpha1=a, alpha2=b)
            path = Path.of(one.pad_model, one.pad.mu)
            if path.mu_end < one.pad.mu:
                codes.append(angle_study.NONE)
                continue
            at = path.equilibrium(one.pad.mu)
            quiet = verdict(*at_equilibrium(one.pad_model, at)) in ("stable", "marginal")
            full = angle_study.STABLE if all(at.state) else angle_study.PARTIAL
            codes.append(full if quiet else angle_study.UNSTABLE)
    shares = np.bincount(codes, minlength=4) / cells**2
    assert record.share.exists == pytest.approx(shares[1:].sum(), abs=0.08)
    assert record.share.quiet == pytest.approx(shares[2:].sum(), abs=0.08)
    assert record.share.quiet_full == pytest.approx(shares[3], abs=0.08)
    # of the places where it exists some 5 % are unstable
    assert record.share.exists > record.share.quiet > record.share.quiet_full
    printed = quasi_static(scene_of("b3").pad, 40)
    assert len(quasi_static_figure.draw(printed, record).figure.axes) == 4


def test_the_damped_share_is_that_of_single_equilibria(monkeypatch):
    cells = 4
    monkeypatch.setattr(angle_study, "COARSE", cells)
    scene = scene_of("b2-c")
    damping = Damping(ratios=(0.001, 0.02, 0.001))
    quiet = 0
    for a in angle_axes(cells)[0].values.tolist():
        for b in angle_axes(cells)[1].values.tolist():
            one = dataclasses.replace(scene.replace(alpha1=a, alpha2=b), damping=damping)
            if Path.of(one.pad_model, one.pad.mu).mu_end >= one.pad.mu:
                quiet += analyse(one).judgement.verdict == "stable"
    assert angle_study.damped(scene, 1) == quiet / cells**2
