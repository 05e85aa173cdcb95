"""Eigenvalues over mu, friction loop and mode shapes of scenes, and their figures."""

import dataclasses
import json

import numpy as np
import pytest

from squeal.analysis.eigenvalues import analyse, held_system
from squeal.article.cases import title
from squeal.article.figures import coupling, loci, modes
from squeal.article.results.loci import Branch, Loci, Modes, SingleLoop
from squeal.article.results.records import Missing
from squeal.article.studies.__main__ import main
from squeal.article.studies.loci import branch, examined, loop
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import Scene, read_scene
from squeal.model.states import FULL
from squeal.plots.parts import LARGEST
from tests import naive
from tests.conftest import SCENES, random_pad

STEMS = ("b1-a", "b1-b", "b2-a", "b2-b")


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Results by way of the program and its JSON."""
    out = tmp_path_factory.mktemp("loci") / "loci.json"
    files = [str(SCENES / f"{stem}.yaml") for stem in STEMS]
    with out.open("w") as stream, pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdout", stream)
        assert main(["loci", *files]) == 0
    made = json.loads(out.read_text())["provenance"]["inputs"]
    assert [file["name"] for file in made] == [f"{stem}.yaml" for stem in STEMS]
    return Loci.read(out)


def at_rest(scene):
    return sliding_equilibrium(scene.pad_model)[0]


@pytest.mark.parametrize("seed", [2, 3, 4, 10])  # the fourth starts, ceases and starts again
def test_gain_margin_is_the_threshold_of_the_eigenvalues(seed):
    scene = Scene("B2", random_pad(seed, "B2"))
    one = loop(scene, at_rest(scene))
    assert isinstance(one, SingleLoop)
    assert len(one.thresholds) >= 1
    for own, held in zip(one.loop_thresholds, one.thresholds, strict=True):
        assert (own.kind, own.direction) == (held.kind, held.direction)
        assert own.mu == pytest.approx(held.mu, rel=1e-9)
    assert one.apart <= 1e-9 * max(held.mu for held in one.thresholds)
    first = one.thresholds[0]
    assert one.grows_from_zero == (first.kind if first.direction == "down" else None)
    margin = None if first.direction == "down" else pytest.approx(first.mu, rel=1e-9)
    assert one.critical_friction == margin


@pytest.mark.parametrize("seed", [2, 10])
def test_root_locus_is_the_eigenvalues_of_other_digits(seed):
    scene = Scene("B2", random_pad(seed, "B2"))
    at = at_rest(scene)
    one = loop(scene, at)
    assert isinstance(one, SingleLoop)
    assert one.locus_apart < 1e-8
    poles = np.array(one.real) + 1j * np.array(one.imag)
    for i in (0, 37, 100):
        pad = scene.pad.replace(mu=one.gains[i])
        K = -naive.jacobian("B2", pad, scene.formulation, at.q, at.state)
        M = np.array([pad.m, pad.m, pad.I])
        squares = np.linalg.eigvals(np.array(K.tolist(), dtype=float) / M[:, None])
        exact = np.concatenate([np.sqrt(-squares + 0j), -np.sqrt(-squares + 0j)])
        distance = np.abs(poles[i][:, None] - exact[None, :])
        assert distance.min(axis=0).max() < 1e-8 * np.abs(exact).max()
        assert distance.min(axis=1).max() < 1e-8 * np.abs(exact).max()


def test_rank_of_the_friction_term():
    full = Scene("B2", random_pad(2, "B2"))
    assert at_rest(full).state == FULL
    assert loop(full, at_rest(full)).rank_one
    scene = read_scene(SCENES / "b1-a.yaml")
    tilted = dataclasses.replace(scene, pad=scene.pad.replace(theta0=0.02))
    one = loop(tilted, at_rest(tilted))
    assert not one.rank_one
    assert "rank one" in one.reason
    assert not isinstance(one, SingleLoop)


def test_stiffness_of_a_held_equilibrium_is_linear_in_mu():
    pads = (
        Scene("B1", random_pad(5, "B1", theta0=0.01)),
        Scene("B2", random_pad(2, "B2", theta0=0.01)),
    )
    for scene in pads:
        system = held_system(scene, at_rest(scene))
        K0, K1, K2 = (np.asarray(system(mu)[2], dtype=float) for mu in (0.0, 0.5, 2.0))
        assert np.allclose(K2, K0 + 4.0 * (K1 - K0), rtol=1e-12, atol=1e-13)


def test_eigenvalues_at_the_scenes_friction(found):
    for one in found.scenes:
        values = analyse(read_scene(SCENES / f"{one.name}.yaml")).spectrum.values
        own = one.equilibrium
        assert np.array_equal(np.array(own.real) + 1j * np.array(own.imag), values)
        curve = one.branch
        i = curve.mu.index(one.mu)
        swept = np.array(curve.real)[:, i] + 1j * np.array(curve.imag)[:, i]
        distance = np.abs(swept[:, None] - values[None, :])
        assert own.on_branch
        assert distance.min(axis=0).max() < 1e-9 * np.abs(values).max()
        assert distance.min(axis=1).max() < 1e-9 * np.abs(values).max()


def test_rows_of_a_branch_are_modes_and_their_conjugates(found):
    for one in found.scenes:
        real, imag = np.array(one.branch.real), np.array(one.branch.imag)
        moving = np.all(imag != 0.0, axis=0)
        assert np.allclose(imag[0::2, moving], -imag[1::2, moving], rtol=1e-9)
        # undamped: with lambda also -lambda
        assert np.allclose(np.sort(real, axis=0), np.sort(-real, axis=0), atol=1e-6)
        assert np.all(np.diff(np.abs(imag[0::2, 0])) >= 0.0)


def test_a_branch_is_followed_up_to_its_fold():
    one = branch(Scene("B2", random_pad(2, "B2")))
    assert isinstance(one, Branch)
    assert one.fold is not None
    assert one.thresholds[-1].kind == "fold"
    assert one.fold * (1 - 2e-9) < one.mu[-1] < one.fold
    # the balance is singular at the fold: an eigenvalue goes to zero there as its fourth root
    size = np.abs(np.array(one.real) + 1j * np.array(one.imag))
    assert size[:, -1].min() < 0.05 * size[:, 0].min()
    for change in one.contact_changes:
        i = one.mu.index(change.mu)
        assert one.mu[i - 1] == np.nextafter(change.mu, 0.0)


def test_without_a_branch_there_is_the_reason():
    assert isinstance(branch(Scene("B2", random_pad(1, "B2", k1=0.0, k2=0.0))), Missing)


def test_mode_shapes_solve_the_eigenvalue_problem(found):
    for one in found.scenes:
        scene = read_scene(SCENES / f"{one.name}.yaml")
        at = at_rest(scene)
        M = np.array([scene.pad.m, scene.pad.m, scene.pad.I])
        K = -naive.jacobian(scene.model, scene.pad, scene.formulation, at.q, at.state)
        A = np.array(K.tolist(), dtype=float) / M[:, None]
        assert len(one.equilibrium.modes) == 3
        for mode in one.equilibrium.modes:
            shape = np.array(mode.real) + 1j * np.array(mode.imag)
            assert np.abs(shape).max() == pytest.approx(1.0)
            v = shape / [1.0, 1.0, scene.pad.w]
            s = mode.growth_rate + 2j * np.pi * mode.frequency_hz
            # of a pair the conjugate shape would belong to the conjugate eigenvalue
            rest = s * s * v + A @ v
            assert np.abs(rest).max() < 1e-9 * np.abs(A).max() * np.abs(v).max()


def drawn(figure, gid):
    return [line for axes in figure.axes for line in axes.get_lines() if line.get_gid() == gid]


def calm(found, loops=False):
    """Names of the scenes without a threshold, and without one of the loop."""
    return {
        s.name
        for s in found.scenes
        if not s.branch.thresholds and not (loops and getattr(s.loop, "loop_thresholds", ()))
    }


def test_scenes_without_a_threshold_stay_on_the_axis(found):
    assert {s.name for s in found.scenes if not s.leaves_axis} == calm(found)
    assert 0 < len(calm(found)) < len(found.scenes)


def test_loci_figure_draws_what_it_is_given(found):
    figure = loci.loci_figure(found)
    clouds = [c for axes in figure.axes for c in axes.collections if c.get_gid() == "mu"]
    assert {s.name for s in found.leaving} == {s.name for s in found.scenes} - calm(
        found, loops=True
    )
    for one, cloud in zip(found.leaving, clouds, strict=True):
        real, imag = np.array(one.branch.real), np.array(one.branch.imag)
        mu = np.broadcast_to(one.branch.mu, real.shape)
        given = np.array([real / 1e3, imag / (2e3 * np.pi)])[:, imag >= 0.0].T
        assert np.array_equal(np.asarray(cloud.get_offsets()), given)
        assert np.array_equal(cloud.get_array(), mu[imag >= 0.0])
    for one, ring in zip(found.leaving, drawn(figure, "scene"), strict=True):
        real, imag = (np.array(getattr(one.equilibrium, part)) for part in ("real", "imag"))
        assert np.array_equal(ring.get_xdata(), real[imag >= 0.0] / 1e3)


def test_coupling_figure_draws_what_it_is_given(found):
    figure = coupling.coupling_figure(found)
    for k in range(3):
        lines = drawn(figure, f"mode {k + 1}")
        frequencies = [line for line in lines if line.axes.get_ylabel() != "growth [1/ms]"]
        assert len(lines) == 3 * len(found.scenes) - 2 * len(calm(found))
        given = [np.abs(one.branch.imag[2 * k]) / (2e3 * np.pi) for one in found.scenes]
        for values in given:
            assert any(np.array_equal(line.get_ydata(), values) for line in frequencies)
        for one in (s for s in found.scenes if s.name not in calm(found)):
            for values in one.branch.real[2 * k : 2 * k + 2]:
                growth = np.array(values) / 1e3
                assert any(np.array_equal(line.get_ydata(), growth) for line in lines)
    labels = {text.get_text() for axes in figure.axes for text in axes.texts}
    thresholds = {p.kind for one in found.scenes for p in one.branch.thresholds}
    assert thresholds
    assert thresholds <= labels


def test_modes_figure_draws_rigid_pads_that_moved_by_the_shape(found):
    figure = modes.modes_figure(found)
    shown = [s for s in found.scenes if s.model == "B2"]
    lines = [drawn(figure, gid) for gid in ("rest", "first phase", "second phase")]
    # panels go row by row: a mode of each case in turn
    given = [(s, s.equilibrium.modes[k]) for k in range(3) for s in shown]
    for (scene, mode), *outlines in zip(given, *lines, strict=True):
        rest, first, second = (np.array(line.get_xydata())[:4] for line in outlines)
        moved = LARGEST * np.array(mode.real)
        assert np.allclose(first.mean(axis=0) - rest.mean(axis=0), moved[:2], atol=1e-12)
        sides = [one[1] - one[0] for one in (rest, first)]
        turn = np.angle(complex(*sides[1]) / complex(*sides[0]))
        assert turn == pytest.approx(moved[2], abs=1e-12)
        assert np.linalg.norm(second[1] - second[0]) == pytest.approx(2.0)
        assert np.linalg.norm(second[2] - second[1]) == pytest.approx(2 * scene.h / scene.w)


@pytest.mark.parametrize("figure", [loci, coupling, modes])
def test_texts_name_every_case_shown(found, figure):
    made = figure.draw(found)
    for one in found.scenes:
        if figure is coupling or (figure is modes and one.model == "B2"):
            assert title(one.name) in made.alternative
    assert "b2-a.yaml" in made.origin


def test_a_scene_off_its_branch_is_marked_otherwise():
    one = examined(SCENES / "b2-b.yaml")
    assert isinstance(one.equilibrium, Modes)
    assert loci.equilibrium_mark(one.equilibrium) == "o"
    off = dataclasses.replace(one.equilibrium, on_branch=False)
    figure = loci.loci_figure(Loci((dataclasses.replace(one, equilibrium=off),), 1.0, 2.0))
    assert [line.get_marker() for line in drawn(figure, "scene")] == ["^"]
