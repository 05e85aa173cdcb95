"""The stability chapter: growth rates, maps, advice and what reaches the report."""

import dataclasses

import mpmath as mp
import numpy as np
import pytest

from squeal.analysis.eigenvalues import at_equilibrium
from squeal.analysis.maps import NAMES, Axis, angle_axes, stability_map
from squeal.analysis.thresholds import critical_friction
from squeal.article.cases import HISTORY_FIGURES, STEMS
from squeal.article.figures import angle_maps, growth
from squeal.article.precision.maps import matrices, named
from squeal.article.report.stability import _left_out, literature_table, threshold_table, values
from squeal.article.results.loci import Loci
from squeal.article.studies import angles as angle_study
from squeal.article.studies import stability
from squeal.article.studies._advice_text import scene_in_words
from squeal.article.studies._growth import fit
from squeal.article.studies.loci import examined
from squeal.article.studies.quasi_static import quasi_static
from squeal.equilibrium import Path, sliding_equilibrium
from squeal.io.provenance import provenance
from squeal.io.scene import read_scene
from squeal.linear import verdict
from squeal.model.linear import about_origin
from tests import naive
from tests.article import known
from tests.conftest import SCENES, only_levers, scene_of


def result(study, stems):
    """A study's result with what made it, as the program writes it."""
    files = [SCENES / f"{stem}.yaml" for stem in stems]
    return dataclasses.replace(study(files), provenance=provenance(files, study.__module__))


@pytest.fixture(scope="module")
def found():
    """The study with few simulations and levers."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stability, "GROWTH_POINTS", 5)
        patch.setattr(stability, "POINTS", 45)
        only_levers(patch, "h", "k2")
        return result(stability.study, HISTORY_FIGURES)


@pytest.fixture(scope="module")
def maps():
    """Results of `studies.angles` and `studies.quasi_static`, on fewer points."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(angle_study, "FINE", 30)
        patch.setattr(angle_study, "COARSE", 15)
        angles = result(angle_study.study, STEMS)
    return angles, quasi_static(scene_of("b3").pad, 40)


@pytest.mark.parametrize("share", [0.5, 0.95, 1.05, 2.0])
def test_growth_of_a_simulation_is_an_exact_eigenvalue(share):
    scene = scene_of("b1-a")
    mu = share * critical_friction(scene, 1.0).points[0].mu
    at = Path.of(scene.pad_model, 1.0).equilibrium(mu)
    one = fit(scene, at)
    pad = scene.pad.replace(mu=mu)
    K = -naive.jacobian("B1", pad, scene.formulation, at.q, at.state)
    A = mp.matrix(3, 3)
    for i, m in enumerate((pad.m, pad.m, pad.I)):
        for j in range(3):
            A[i, j] = -K[i, j] / m
    roots = [complex(mp.sqrt(v)) for v in mp.eig(A, left=False, right=False)]
    exact = np.array([s * r for r in roots for s in (1, -1)])
    # the motion is linear to its size of 1e-6
    assert np.abs(exact - one.fitted).min() < 1e-6 * abs(one.fitted)
    assert (one.fitted.real > 1.0) == (share > 1.0)


def test_b3_map_agrees_with_single_matrices():
    scene = scene_of("b3")
    axes = angle_axes(14)
    codes = stability_map(scene, axes).codes
    for i, a in enumerate(axes[0].values):
        for j, b in enumerate(axes[1].values):
            one = about_origin(scene.pad_model.replace(alpha1=a, alpha2=b))
            assert NAMES[codes[i, j]] == verdict(*one)


def test_b3_map_agrees_with_numpy():
    scene, n = scene_of("b3"), 1000
    rows = matrices(scene, n)[::20]
    theirs, _ = named(np.linalg.eigvals(rows))
    codes = stability_map(scene, angle_axes(n)).codes
    assert np.array_equal(codes[::20], theirs)


def test_b2_map_agrees_with_single_equilibria():
    scene = scene_of("b2-c")
    axes = angle_axes(4)
    codes = stability_map(scene, axes).codes
    for i, a in enumerate(axes[0].values):
        for j, b in enumerate(axes[1].values):
            task = dataclasses.replace(scene, pad=scene.pad.replace(alpha1=a, alpha2=b))
            path = Path.of(task.pad_model, task.pad.mu)
            if path.mu_end < task.pad.mu:
                assert NAMES[codes[i, j]] == "beyond a fold"
                continue
            e, _ = sliding_equilibrium(task.pad_model)
            one = at_equilibrium(task.pad_model, e)
            assert NAMES[codes[i, j]] == verdict(*one)


def test_map_over_other_parameters():
    scene = scene_of("b3")
    axes = (Axis("mu", 0.0, 1.0, 5), Axis("k_c", 1e6, 1e8, 6))
    codes = stability_map(scene, axes).codes
    for i, mu in enumerate(axes[0].values):
        for j, k_c in enumerate(axes[1].values):
            one = about_origin(scene.pad_model.replace(mu=mu, k_c=k_c))
            assert NAMES[codes[i, j]] == verdict(*one)


def test_shares_are_areas():
    found = stability_map(scene_of("b3"), angle_axes(30))
    assert sum(found.share.values()) == pytest.approx(1.0)
    assert found.share["flutter"] == np.mean(found.codes == NAMES.index("flutter"))


def test_gain_margin_of_the_loop_is_the_threshold(found):
    # the chapter's fluttering pad; model B2 in full contact has a loop of rank one
    one = found.fluttering.loop
    assert one.rank_one
    assert one.thresholds[0].direction == "up"
    assert one.critical_friction == pytest.approx(one.thresholds[0].mu, rel=1e-9)


def test_advice_tells_flutter_its_threshold_and_a_lever(monkeypatch):
    only_levers(monkeypatch, "h", "k2")
    scene = scene_of("b1-a")
    mu = critical_friction(scene).points[0].mu
    told = scene_in_words(scene.replace(mu=1.5 * mu))
    assert "flutters" in told
    assert f"first lost at mu = {mu:.3g}, below the present" in told
    calm = scene_in_words(scene.replace(mu=0.5 * mu))
    assert "no mode grows (marginal)" in calm
    assert "above the present" in calm


def test_advice_without_an_equilibrium_gives_the_reason():
    scene = scene_of("b1-a", k1=0.0, k2=0.0)
    told = scene_in_words(scene)
    assert told.startswith("No steady sliding exists")


def test_each_figure_is_drawn_with_a_text(found, maps):
    for made in (growth.draw(found), angle_maps.draw(*maps)):
        assert len(made.alternative) > 60
        assert made.figure.get_axes()


def test_scenes_without_a_panel_are_named():
    scenes = [dataclasses.replace(s, model=s.name[:2].upper()) for s in known.of(Loci).scenes]
    told = _left_out([scenes[0], scenes[2], scenes[4]], "panel")
    assert told.startswith(" Without a panel, since all")
    assert told.endswith("axis: B1 (a) and (c); B2 (a).")
    assert _left_out([], "panel") == ""


def test_simulations_of_a_pad_that_does_not_grow_are_counted_apart(found):
    grows = dataclasses.replace(found.growth[0], predicted=((1.0, 2.0), (-1.0, 2.0)))
    told = values(dataclasses.replace(found, growth=(grows,)), known.of(Loci))
    assert (told["growth.growing"], told["growth.calm"]) == ("1", "")
    calm = dataclasses.replace(found.growth[0], name="b1-a", predicted=((0.0, 2.0), (-1.0, 2.0)))
    told = values(dataclasses.replace(found, growth=(calm,)), known.of(Loci))
    assert told["growth.growing"] == "0"
    assert "of B1, case (a) none" in told["growth.calm"]


def test_growth_figure_shows_the_fits(found):
    axes = growth.draw(found).figure.get_axes()[0]
    drawn = [line.get_ydata() for line in axes.get_lines() if line.get_marker() != "+"]
    given = [np.array(g.fitted)[:, 0] / 1e3 for g in found.growth]
    assert all(np.array_equal(a, b) for a, b in zip(drawn, given, strict=True))


def test_shares_of_traced_maps(maps):
    angles, printed = maps
    for model in ("b2", "b3"):
        assert sum(getattr(angles, f"share_{model}").values()) == pytest.approx(1.0)
    share = angles.share
    assert share.full + share.partial == pytest.approx(share.exists)
    assert 1.0 - share.exists == pytest.approx(angles.share_b2["beyond a fold"])
    assert share.quiet_full - printed.share.as_printed - 0.01 < share.denied_full
    assert share.denied_full <= min(share.quiet_full, share.denied)
    # allowed where nothing is kept + allowed where it is = allowed
    allowed = share.wrongly_allowed + share.quiet - share.denied
    assert allowed == pytest.approx(printed.share.as_printed, abs=0.01)


def test_what_reaches_the_report(found):
    told = values(found, Loci((), 1.0, 2.0))
    assert told["literature.rows"] == told["literature.agree"] == str(len(found.literature))
    assert literature_table(found.literature).count(r"\\") == len(found.literature) + 2


def test_threshold_table_tells_each_way_to_find_them(found):
    scenes = Loci(tuple(examined(SCENES / f"{name}.yaml") for name in ("b1-a", "b2-a")), 1.0, 2.0)
    table = threshold_table(scenes, found.fluttering)
    rows = [line.split(" & ") for line in table.splitlines() if line.endswith(r"\\")][1:]
    mu = critical_friction(scene_of("b1-a")).points[0].mu
    assert rows[0][:2] == ["B1, case (a)", f"${mu:.6g}$ flutter"]
    assert rows[0][3] == "not of rank one"
    assert [row[0] for row in rows[1:]] == ["B2, case (a)", "B2, fluttering angles"]
    margin = found.fluttering.loop.critical_friction
    assert rows[2][3].startswith(f"${margin:.10g}$")
    told = values(found, scenes)
    assert (told["loop.rank-one"], told["loop.scenes"]) == ("1", "2")


def test_a_scene_that_flutters_needs_no_other_angles(monkeypatch):
    monkeypatch.setattr(stability, "POINTS", 30)
    other = stability.fluttering(read_scene(SCENES / "b2-c.yaml"))
    assert other is not None
    assert stability.fluttering(other) is None


@pytest.mark.parametrize("first", [3, 400])
def test_angles_that_flutter_are_the_nearest_of_the_whole_map(first, monkeypatch):
    # of this scene none of the three nearest flutter
    monkeypatch.setattr(stability, "POINTS", 20)
    monkeypatch.setattr(stability, "FIRST", first)
    scene = read_scene(SCENES / "b2-a.yaml")
    axes = angle_axes(20)
    places = np.argwhere(stability_map(scene, axes).codes == NAMES.index("flutter"))
    angles = axes[0].values[places]
    own = scene.pad.alpha1, scene.pad.alpha2
    nearest = angles[np.argmin(np.hypot(*(angles - own).T))]
    found = stability.fluttering(scene)
    assert found is not None
    assert [found.pad.alpha1, found.pad.alpha2] == nearest.tolist()
