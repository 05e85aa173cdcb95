"""Ensembles: starts against the toolkit's statics, exact early rejection, a known volume."""

import dataclasses
import math
from dataclasses import fields, replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from squeal.article.claims import CLAIMS, judge_scenes
from squeal.article.claims.measures import friction_raises
from squeal.article.ensembles import balanced, beyond, choosing, distance, population
from squeal.article.ensembles.balance import flattest, mean_place
from squeal.article.ensembles.choice import read_choice
from squeal.article.ensembles.choosing import LAWS, MOST, RIVAL
from squeal.article.ensembles.comparison import corrected, distances, exchanged, keeping
from squeal.article.ensembles.distance import COUNTED, INDEX, NO_LEVELS, Judgement, judge, price
from squeal.article.ensembles.draw import SEEDS, main, name_of, read_stage, stage_file, write_stage
from squeal.article.ensembles.gather import FRONT, counts, gather, read_kept, undominated
from squeal.article.ensembles.gather import main as gather_main
from squeal.article.ensembles.population import Stage, advance
from squeal.article.ensembles.space import (
    DIMENSIONS,
    FORMULATIONS,
    decode,
    speed_limit,
    stacked,
    standing,
    starts,
)
from squeal.article.identify.objective import judge_one
from squeal.article.identify.space import LENGTH, MASS
from squeal.article.identify.write import write_scenes
from squeal.article.report.chapters import ENSEMBLES, PAD
from squeal.article.report.ensembles import _contrast, generated, half_by_chance
from squeal.article.results.ensembles import Contrast, Ensembles, Kept
from squeal.article.results.ensembles import Pad as Judged
from squeal.article.scenes import read_cases
from squeal.article.studies import ensembles as studied
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import InputError
from squeal.files.provenance import NOT_INSTALLED
from squeal.model.contact import CONSISTENT, Formulation
from squeal.model.equations import PadModel
from squeal.model.pad import Pad
from squeal.model.states import FULL
from squeal.scene import read_scene
from squeal.simulation import simulate
from tests.article import known
from tests.conftest import ROOT, needs_heyoka


@pytest.fixture(scope="module")
def numbers():
    return decode(np.random.default_rng(5).uniform(size=(48, len(DIMENSIONS))))


def one_of(pads, i):
    return Pad(**{name: float(v[i]) for name, v in pads.pad.given().items()})


def test_numbers_lie_in_their_ranges_which_have_reasons(numbers):
    assert len(FORMULATIONS) == len(set(FORMULATIONS)) == 8
    for d in DIMENSIONS:
        assert d.reason
        assert d.low <= numbers[d.name].min() < numbers[d.name].max() <= d.high
    ends = decode(np.array([np.zeros(len(DIMENSIONS)), np.ones(len(DIMENSIONS))]))
    assert all(ends[d.name] == pytest.approx([d.low, d.high], rel=1e-12) for d in DIMENSIONS)


def test_speed_limit_is_that_of_the_surface():
    few = {"F_n": np.array([1e-3])}
    k1 = 2000.0 / (1e-3 * LENGTH)  # the stiffness at which the load is 2 kN
    assert speed_limit(few)[0] * LENGTH * math.sqrt(k1 / MASS) == pytest.approx(5.0)


def test_standing_pads_rest_without_friction_and_released_ones_are_where_they_are_put(numbers):
    still = standing(numbers)
    seen = 0
    for case in "abcd":
        pads = stacked(numbers, "B2", case, CONSISTENT)
        first = starts(numbers, pads)
        assert np.all(first[~still, 1] == numbers["lift"][~still] * numbers["F_n"][~still])
        for i in np.flatnonzero(still & np.isfinite(first).all(axis=1))[:5]:
            model = PadModel("B2", one_of(pads, i).replace(mu=0.0), CONSISTENT)
            assert np.all(model.gaps(first[i, :3]) < 0.0)
            load = numbers["F_n"][i]
            assert model.loads(first[i, :3], FULL) == pytest.approx(0.0, abs=1e-10 * load)
            assert not first[i, 3:].any()
            found, _ = sliding_equilibrium(model)
            if found.state == FULL:  # else the pad has a second place to rest
                assert first[i, :3] == pytest.approx(found.q, rel=1e-9, abs=1e-12)
                seen += 1
    assert seen > 8


def test_friction_raises_the_reaction_as_the_equilibria_say(numbers):
    pads = stacked(numbers, "B2", "b", CONSISTENT)
    seen = 0
    for i, raised in enumerate(friction_raises(pads)[:16]):
        pad = one_of(pads, i)
        at = [
            sliding_equilibrium(PadModel("B2", pad.replace(mu=mu), CONSISTENT))[0]
            for mu in (0.0, pad.mu)
        ]
        if all(e is not None and e.state == FULL for e in at):
            assert raised == pytest.approx(at[1].R_n / at[0].R_n - 1.0, rel=1e-8)
            seen += 1
    assert seen >= 4


def test_rejecting_early_rejects_no_other_pads(numbers):
    whole = judge(numbers, CONSISTENT)
    levels = np.nanmedian(np.where(np.isfinite(whole.partial), whole.partial, np.nan), axis=0)
    early = judge(numbers, CONSISTENT, levels)
    with np.errstate(invalid="ignore"):
        assert np.array_equal(early.whole, (whole.partial <= levels).all(axis=1))
    assert 0 < early.whole.sum() < whole.whole.sum()
    assert early.motions < whole.motions
    # samples lie elsewhere in another batch
    assert early.margins[early.whole] == pytest.approx(
        whole.margins[early.whole], rel=0.02, abs=0.02, nan_ok=True
    )


def test_price_is_nothing_for_what_holds_and_up_to_two_for_what_fails():
    claim = next(c for c in COUNTED if not c.by_load)
    assert price(claim, 1e-9, 1.0) == 0.0
    assert price(claim, -1e-9, 1.0) == pytest.approx(1.0)
    assert price(claim, -claim.ample, 1.0) == pytest.approx(1.5)
    assert price(claim, math.nan, 1.0) == 2.0
    tilt = next(c for c in COUNTED if c.by_load)
    assert price(tilt, -tilt.ample * 1e-3, 1e-3) == pytest.approx(1.5)


def test_stages_can_be_taken_up_again(tmp_path, monkeypatch):
    monkeypatch.setattr(population, "POPULATION", 24)
    monkeypatch.setattr("squeal.article.ensembles.draw.PARTS", 1)
    now = None
    for stage in range(3):
        now = advance(FORMULATIONS[0], 1, stage, now)
        write_stage(tmp_path / "kept.npz", now)
        again = read_stage(tmp_path / "kept.npz")
        for f in fields(Stage):
            wanted = np.asarray(getattr(now, f.name), dtype=float)
            exact = pytest.approx(wanted, rel=1e-6, nan_ok=True)
            assert np.asarray(getattr(again, f.name), dtype=float) == exact, f.name
        now = again
    few = ("--formulations", name_of(FORMULATIONS[0]))
    assert main([str(tmp_path), "--stages", "0", "--seeds", "1", "--workers", "1", *few]) == 0
    assert not stage_file(tmp_path, FORMULATIONS[0], 1, 0).exists()


def test_a_front_is_what_no_other_row_surpasses():
    rows = np.random.default_rng(2).integers(0, 4, (60, 3)).astype(float)
    front = {tuple(r) for r in rows[undominated(rows)]}
    for row in rows:
        beaten = any((o >= row).all() and (o > row).any() for o in rows)
        assert (tuple(row) in front) != beaten


def test_gathered_searches_count_what_their_stages_hold(tmp_path, monkeypatch):
    monkeypatch.setattr(population, "POPULATION", 16)
    for f, seed in product(FORMULATIONS, SEEDS):
        now = None
        for stage in range(3):
            now = pretended(f, seed, stage)
            write_stage(stage_file(tmp_path, f, seed, stage), now)
    kept = gather(tmp_path)
    np.savez_compressed(tmp_path / "kept.npz", **vars(kept))
    again = read_kept(tmp_path / "kept.npz")
    assert int(again.stages) == 3
    assert np.all(again.effort[:, :, 0] == 3 * 16)
    assert np.all(again.random == [2 * 16, 2 * 16])
    margins = np.array([s.margins for s in map(read_stage, sorted(tmp_path.glob("*/*.npz")))])
    whole = counts(margins.reshape(-1, 33))
    assert again.best.max(axis=(0, 1)) == pytest.approx(whole.max(axis=1))
    assert again.random_counts[:, 0].sum() == 8 * 5 * 2 * 16
    assert again.shares[0, 0, -1] == pytest.approx(math.log(0.5**2), rel=1e-6)
    with pytest.raises(InputError, match="make ensembles"):
        read_kept(tmp_path / "integral-centre-plus-1" / "stage-000.npz")
    np.savez_compressed(tmp_path / "old.npz", **vars(kept) | {"margins": kept.margins[..., 1:]})
    with pytest.raises(InputError, match="32 claims"):
        read_kept(tmp_path / "old.npz")
    (tmp_path / "mean-frame-minus-5" / "stage-002.npz").unlink()
    with pytest.raises(InputError, match="2 stages"):
        gather(tmp_path)


def test_searches_in_parts_and_after_an_interruption_are_the_same(
    tmp_path, monkeypatch, capsysbinary
):
    laws, seeds = FORMULATIONS[:2], (1, 2)
    monkeypatch.setattr(population, "POPULATION", 8)
    monkeypatch.setattr("squeal.article.ensembles.draw.PARTS", 1)
    monkeypatch.setattr("squeal.article.ensembles.gather.FORMULATIONS", laws)
    monkeypatch.setattr("squeal.article.ensembles.gather.SEEDS", seeds)
    options = ["--stages", "3", "--workers", "1", "--seeds", *map(str, seeds)]
    options += ["--formulations", *map(name_of, laws)]

    def drawn(folder, *parts):
        for part in parts:
            assert main([str(folder), *options, "--part", part]) == 0
        assert gather_main([str(folder), "--untimed"]) == 0
        return capsysbinary.readouterr().out

    whole = drawn(tmp_path / "whole", "1-of-1")
    assert drawn(tmp_path / "parts", "3-of-3", "1-of-3", "2-of-3") == whole
    # killed while it wrote a stage: that file is half there, the stages before it stand
    last = stage_file(tmp_path / "parts", laws[1], 1, 2)
    last.with_suffix(".part.npz").write_bytes(last.read_bytes()[:100])
    last.unlink()
    assert drawn(tmp_path / "parts", "1-of-2", "2-of-2") == whole
    assert main([str(tmp_path), "--part", "9-of-8"]) == 2


def test_a_search_goes_on_from_pads_that_keep_three_statements(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(population, "POPULATION", 16)
    monkeypatch.setattr(beyond, "MOST", 0)
    folder, more = tmp_path / "searched", tmp_path / "more"
    told = [str(folder), str(more), "--stages"]
    assert beyond.main([*told, "1"]) == 2
    assert "draw more stages" in capsys.readouterr().err
    stages = [pretended(beyond.LAW, seed, stage) for seed in SEEDS for stage in range(2)]
    for i, stage in enumerate(stages):
        write_stage(stage_file(folder, beyond.LAW, SEEDS[i // 2], i % 2), stage)
    three = [INDEX[name] for name in FRONT]
    wanted = sum(int((s.margins[:, three] > 0.0).all(axis=1).sum()) for s in stages)
    assert len(beyond.beginning(folder).points) == wanted > 0
    assert beyond.main([*told, "1"]) == 0
    kept = read_stage(stage_file(more, beyond.LAW, 1, 0))
    assert beyond.main([*told, "2"]) == 0  # goes on after the first
    assert np.array_equal(read_stage(stage_file(more, beyond.LAW, 1, 0)).points, kept.points)
    assert "stage 1" in capsys.readouterr().err
    b1 = [INDEX[c.id] for c in CLAIMS if c.scenes[0] == "b1-a" and len(c.scenes) == 1]
    assert np.isnan(kept.margins[:, b1]).all()


def pretended(formulation, seed, stage):
    """A stage of 16 pads of which no motion was simulated."""
    random = np.random.default_rng([FORMULATIONS.index(formulation), seed, stage])
    points = random.uniform(size=(16, len(DIMENSIONS))).astype(np.float32).astype(float)
    partial = random.uniform(5.0, 9.0, (16, distance.STEPS)).cumsum(axis=1)
    yes = np.ones(16, dtype=bool)
    margins = random.normal(size=(16, 33)).astype(np.float32)
    share = 0.5 if stage else 1.0
    return Stage(points, yes, margins, yes, points, partial, NO_LEVELS, share, 1.0, 128, 9000, 0.5)


def test_a_pad_of_the_consistent_law_keeps_27_listed_statements_by_both_paths():
    alone = {j.id: j.holds for j in judge_one(RIVAL, CONSISTENT)}
    margins = judge({name: np.array([value]) for name, value in RIVAL.items()}, CONSISTENT).margins
    for claim, margin in zip(CLAIMS, margins[0], strict=True):
        if np.isfinite(margin):
            assert (margin > 0.0) == alone[claim.id], claim.id
    listed = {c.id for c in CLAIMS if c.listed}
    assert sum(alone[name] for name in listed) == 27
    assert alone["B2-c-hammer"]
    assert counts(margins)[1, 0] == 27


def counted(informative: int) -> Kept:
    return Kept(33, 29, informative)


@pytest.mark.parametrize(
    ("consistent", "printed", "law"),
    [(18, 16, "consistent"), (16, 16, "consistent"), (15, 16, "printed force")],
)
def test_the_report_takes_the_law_under_which_its_pad_keeps_more(consistent, printed, law):
    pads = {
        name: Judged(dict(RIVAL), {"10": counted(n)}, {}, 1.0, 2.0, 0.5)
        for name, n in zip(LAWS, (consistent, printed), strict=True)
    }
    assert choosing.choice(pads, "here").law == LAWS[law]
    pads[law] = dataclasses.replace(pads[law], horizons={"10": None})
    assert choosing.choice(pads, "here").law != LAWS[law]


@needs_heyoka
def test_the_pad_of_the_report_is_the_chosen_one_and_its_scenes_are_written_by_it(tmp_path, capsys):
    assert choosing.main([str(ROOT / ENSEMBLES), "--scenes", str(tmp_path)]) == 0
    assert capsys.readouterr().out == (ROOT / PAD).read_text(encoding="utf-8")
    for file in (ROOT / "workflow" / "scenes").glob("*.yaml"):
        assert (tmp_path / file.name).read_text() == file.read_text(), file.name
    assert choosing.main([str(tmp_path / "none"), "--scenes", str(tmp_path)]) == 2


def test_scenes_of_a_standing_and_displaced_pad_start_where_it_does(tmp_path):
    own = read_choice(ROOT / PAD)
    found = dataclasses.replace(own, numbers=own.numbers | {"first_x": 0.5, "x0": 0.2, "tilt": 2.0})
    first = choosing.first_states(found)
    write_scenes(found.numbers, found.law, tmp_path, first, 5.0)
    scene = read_scene(tmp_path / "b2-a.yaml", "simulate")
    load = found.numbers["F_n"]
    assert scene.pad.V == 5.0
    assert scene.pad.x0 == pytest.approx(0.2 * LENGTH)
    assert scene.pad.theta0 == pytest.approx(load)
    assert scene.initial[0] == pytest.approx(0.5 * load * LENGTH)
    standing = dataclasses.replace(own, numbers=own.numbers | {"start": 0.9})
    first = choosing.first_states(standing)
    write_scenes(standing.numbers, standing.law, tmp_path, first, 5.0)
    # at rest on a disc that stands still: nothing is pushed along
    for name in ("b1-b", "b2-b"):
        scene = read_scene(tmp_path / f"{name}.yaml", "simulate")
        rest, _ = sliding_equilibrium(scene.pad_model.replace(mu=0.0))
        assert rest is not None
        assert scene.initial[:3] == pytest.approx(rest.q, rel=1e-5, abs=1e-12)


def test_stored_ensembles_are_of_equal_effort():
    kept = read_kept(ROOT / ENSEMBLES)
    pads, random = kept.effort[:, :, 0], kept.random[:, :, 0]
    assert pads.shape == (8, 5)
    assert np.ptp(pads - random) == 0.0  # of the searches themselves, random pads apart
    assert np.all(np.isfinite(kept.levels[:, :, -1]))
    assert np.all(np.diff(kept.shares, axis=-1) <= 0.0)


def test_shares_multiply_to_a_known_volume(monkeypatch):
    """Distance: the largest offset of three numbers from the middle, in halves of the range."""
    level = 0.1

    def ball(numbers, formulation, levels=NO_LEVELS, models=()):
        points = np.array([numbers[d.name] for d in DIMENSIONS[-3:]]).T
        low, high = np.array([(d.low, d.high) for d in DIMENSIONS[-3:]]).T
        far = np.abs(2.0 * (points - low) / (high - low) - 1.0).max(axis=1)
        partial = np.repeat(far[:, None], distance.STEPS, axis=1)
        margins = np.zeros((len(far), 33))
        return Judgement(partial, (partial <= levels).all(axis=1), margins, 0, 0)

    monkeypatch.setattr(population, "judge", ball)
    found = []
    for seed in range(8):
        before: Stage | None
        now: Stage | None
        before, now, share = None, None, 1.0
        for stage in range(30):
            before, now = now, advance(CONSISTENT, seed, stage, now)
            if stage == 1:
                share = now.share
            elif stage > 1:
                share *= now.share
                if now.levels[-1] < level:
                    break
        assert before is not None
        assert now is not None
        share *= (before.partial[:, -1] <= level).mean() / now.share
        found.append(share)
    # the volume of the cube is 1e-3; the spread of the seeds gives the accuracy of the mean
    error = float(np.std(np.log(found))) / math.sqrt(len(found))
    assert np.log(found).mean() == pytest.approx(math.log(level**3), abs=4.0 * error)
    assert error < 0.3


def test_without_heyoka_the_chapter_stands_on_what_is_stored(monkeypatch):
    monkeypatch.setattr(studied, "version", lambda _: NOT_INSTALLED)
    for module in (studied, choosing):
        monkeypatch.setattr(module, "judge", None)  # would simulate
    found = studied.study([ROOT / ENSEMBLES])
    assert "heyoka is not installed" in found.left_out
    assert not found.wrong
    values, tables = generated(found)
    assert values["ensembles.left-out"].startswith("Left out here")
    assert "ensembles.rival" not in values
    assert values["ensembles.hammering"].startswith("Kept by ")
    assert "No pad is judged afresh" in values["ensembles.hammering.kept"]
    assert tables["ensemble-searches"].count("--, --, --, --") == 8


def test_distances_from_stored_margins_are_those_of_the_judging(numbers):
    whole = judge(numbers, CONSISTENT)
    margins, loads = whole.margins[whole.whole], numbers["F_n"][whole.whole]
    assert distances(margins, loads) == pytest.approx(whole.partial[whole.whole, -1])
    without = distances(margins, loads, ("B12-sliding",))
    slid = margins[:, INDEX["B12-sliding"]] > 0.0
    assert without[slid] == pytest.approx(distances(margins[slid], loads[slid]))
    assert np.all(distances(margins, loads)[~slid] - without[~slid] >= 1.0)


@pytest.mark.parametrize(("shift", "least", "most"), [(0.0, 0.05, 1.0), (3.0, 0.0, 1e-3)])
def test_searches_are_exchanged_between_formulations_that_differ_in_one_switch(shift, least, most):
    """Other switches shift the values by ten: unstratified, a shift of three would be lost."""
    random = np.random.default_rng(2)
    values = random.normal(size=(8, 5))
    for i, f in enumerate(FORMULATIONS):
        values[i] += 10.0 * (f.delta_moment == "+") + 5.0 * (f.line_force == "mean")
        values[i] += shift * (f.delta_from == "frame")
    means, p, better = exchanged(values, "delta_from")
    assert least <= p <= most
    assert means["frame"] - means["centre"] == pytest.approx(shift, abs=1.0)
    assert better == 0 or not shift


def test_the_chance_of_an_exchange_is_that_of_all_exchanges():
    """One pair of formulations tells: 2 of the C(4, 2) = 6 halvings are as far apart."""
    values = np.zeros((8, 2))
    one, two = (
        next(i for i, f in enumerate(FORMULATIONS) if f == Formulation("integral", d, "+"))
        for d in ("centre", "frame")
    )
    values[one], values[two] = (0.0, 1.0), (2.0, 3.0)
    _, p, better = exchanged(values, "delta_from")
    assert p == pytest.approx(2 / 6, abs=0.02)
    assert better == 0


def test_holms_correction_by_hand():
    assert corrected([0.04, 0.01, 0.03]) == pytest.approx([0.06, 0.03, 0.06])
    assert corrected([0.9, 0.5, 0.4]) == pytest.approx([1.0, 1.0, 1.0])


def test_equal_pads_count_once_and_searches_are_counted(tmp_path):
    kept = read_kept(ROOT / ENSEMBLES)
    sample, sampled = kept.sample.copy(), np.full_like(kept.sampled, -1.0)
    sample[0, 0] = sample[0, 0, 0]  # one pad forty times
    sampled[0, 0] = 1.0
    made = replace(kept, sample=sample, sampled=sampled)
    found = keeping(made, [0], ("B2-only-c", "B2-c-hammer"))
    others = sum(len(np.unique(points, axis=0)) for points in sample[0, 1:])
    assert (found.pads, found.keep) == (1 + others, 1)
    assert (found.searches, found.keeping) == (sample.shape[1], 1)


def judged_contrast(p: float, p_unslid: float, other: bool = False) -> str:
    unslid = {"centre": 9.0, "frame": 8.0} if other else {"centre": 8.0, "frame": 9.0}
    levels = {"centre": 8.0, "frame": 9.0}
    return _contrast(Contrast("delta_from", levels, p, 1, 4, unslid, p_unslid))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((0.01, 0.01), "also without the statement on sliding"),
        ((0.01, 0.01, True), "with the assumed speed of the surface only"),
        ((0.01, 0.4), "with the assumed speed of the surface only"),
        ((0.4, 0.4), "no difference is shown"),
        ((0.4, 0.01, True), r"without the statement on sliding one is, $\delta$ in the fixed"),
    ],
)
def test_what_a_switch_does_is_told_with_and_without_sliding(given, words):
    assert words in judged_contrast(*given)
    assert "nearer in 3 of the 4 pairs" in judged_contrast(*given)


def stored(**given: Any) -> Ensembles:
    found = known.result("ensembles")
    assert isinstance(found, Ensembles)
    return replace(found, **given)


def with_seeds(**given: Any) -> Ensembles:
    found = stored()
    return stored(
        ensembles=tuple(
            replace(e, seeds=tuple(replace(s, **given) for s in e.seeds)) for e in found.ensembles
        )
    )


def test_sentences_on_ensembles_follow_the_file():
    def told(found: Ensembles, name: str) -> str:
        return generated(found)[0][f"ensembles.{name}"]

    assert "Each search ends on an island" in told(with_seeds(width=0.1), "islands")
    assert "spread nearly as far" in told(with_seeds(width=0.8), "islands")
    assert "repeated, down to 3" in told(with_seeds(distinct=3), "islands")
    assert "repeated" not in told(stored(), "islands")
    assert "none of them found it" in told(with_seeds(nearest=3.5), "rival")
    assert "stored of 5 of the 5 searches" in told(with_seeds(nearest=2.5), "rival")
    two = stored().twins
    assert "are one statement" in told(stored(), "twins")
    assert "nearly are" in told(stored(twins=replace(two, agree=79)), "twins")
    assert "told apart" in told(stored(twins=replace(two, agree=40)), "twins")
    pads = stored().chosen
    pad = pads["consistent"]

    def taken(**given: Any) -> Ensembles:
        return stored(chosen={**pads, "consistent": replace(pad, **given)})

    assert "lies within them" in told(stored(), "outside")
    far = taken(numbers={**pad.numbers, "mu": 0.9})
    assert r"outside them with $\mu$ ($0.9$, searched" in told(far, "outside")
    slid = taken(failing={**pad.failing, "1": ("B12-sliding",), "40": None})
    assert "its sliding stops" in told(slid, "beside")
    assert "loses B2-d-trailing" in told(slid, "beside")
    assert "over 40 its motion leaves" in told(slid, "beside")
    assert "its sliding goes on" in told(stored(), "beside")
    one = stored().check
    for which in ((), ("B2-d-trailing (margin 1 stored, -1 now)",), ("a", "b")):
        text = told(stored(check=replace(one, different=len(which), which=which)), "differ")
        assert ("none is", "one is another", "2 are others")[len(which)] in text


def test_points_within_half_of_a_range_by_chance():
    points = np.random.default_rng(4).uniform(size=(40_000, 5))
    seen = (np.ptp(points, axis=1) < 0.5).mean()
    assert half_by_chance(5) == pytest.approx(seen, abs=0.01)


@needs_heyoka
@pytest.mark.parametrize("case", "abcd")
def test_the_mean_place_of_the_reaction_follows_from_the_balances(case):
    """By a simulation over 20 windows, with partial contact and, in case (c), separation."""
    scene = read_scene(ROOT / "workflow" / "scenes" / f"b2-{case}.yaml", "simulate")
    assert scene.stop is not None
    longer = dataclasses.replace(scene, stop=20 * scene.stop, samples=100_001, outputs=("history",))
    history = simulate(longer).history
    force, place = (np.nan_to_num(np.array(history[name])) for name in ("Rn", "delta"))
    pad = scene.pad
    wanted = mean_place(case, pad.mu, pad.h / pad.w, force.mean())
    assert (force * place).mean() / force.mean() == pytest.approx(wanted, abs=3e-3)


def test_a_flat_pad_alone_keeps_the_reaction_on_the_trailing_side():
    limit = flattest("d")
    assert limit == pytest.approx(math.tan(0.17 * math.pi) / 2.0, rel=1e-12)
    assert mean_place("d", 0.3, limit - 0.01, 2.0) > 0.0 > mean_place("d", 0.3, limit + 0.01, 2.0)
    found = known.result("ensembles")
    assert isinstance(found, Ensembles)
    for own, words in ((limit + 0.1, "must be flatter"), (limit - 0.1, "which the pad")):
        pads = {
            law: dataclasses.replace(pad, numbers=pad.numbers | {"h": own})
            for law, pad in found.chosen.items()
        }
        values, _ = generated(dataclasses.replace(found, chosen=pads))
        assert words in values["ensembles.balance"]


@needs_heyoka
def test_one_pad_keeps_all_listed_statements_that_can_hold_together(tmp_path):
    """Each scene simulated by itself, at full accuracy, over one and two windows."""
    own = read_choice(ROOT / PAD)
    most = dataclasses.replace(own, numbers=MOST)
    assert most.law == CONSISTENT
    write_scenes(most.numbers, most.law, tmp_path, choosing.first_states(most))
    files = list(tmp_path.glob("*.yaml"))
    models = [read_cases(files, model, "simulate") for model in ("B1", "B2")]
    listed = {c.id for c in CLAIMS if c.listed}
    for windows in (1, 2):
        longer = (
            {case: dataclasses.replace(one, stop=windows * one.stop) for case, one in four.items()}
            for four in models
        )
        lost = {j.id for j in judge_scenes(*longer) if not j.holds}
        assert lost & listed == {"B2-b-theta"}


def test_pads_that_the_balances_allow_rest_on_the_trailing_side_in_case_b():
    numbers = decode(np.random.default_rng(3).uniform(size=(1_000_000, len(DIMENSIONS))))
    few = np.flatnonzero(balanced.allowed(numbers))
    assert 0 < len(few) < 200
    some = {name: v[few] for name, v in numbers.items()}
    pads = stacked(some, "B2", "b", CONSISTENT)
    for i, slender in enumerate(some["h"].tolist()):
        pad = one_of(pads, i)
        rest, _ = sliding_equilibrium(PadModel("B2", pad, CONSISTENT))
        assert rest is not None
        if pad.F_n > 4e-4:  # the springs turn with the pad
            continue
        assert rest.state == FULL
        assert rest.delta > 0.0
        wanted = mean_place("b", pad.mu, slender, rest.R_n / pad.F_n)
        assert rest.delta == pytest.approx(wanted, abs=0.1)


@pytest.mark.parametrize(("listed", "words"), [(28, "all that can hold together"), (27, "not all")])
def test_the_sentence_on_the_most_follows_the_count(listed, words):
    found = known.result("ensembles")
    assert isinstance(found, Ensembles)
    pads = {
        law: dataclasses.replace(pad, horizons=pad.horizons | {"1": Kept(30, listed, 18)})
        for law, pad in found.most.items()
    }
    for plausible, like in ((True, "such as an"), (False, "not one that an")):
        values, _ = generated(dataclasses.replace(found, most=pads, plausible=plausible))
        assert words in values["ensembles.together"]
        assert like in values["ensembles.together"]
