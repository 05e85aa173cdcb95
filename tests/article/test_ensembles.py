"""Ensembles: starts against the toolkit's statics, exact early rejection, a known volume."""

import math
from dataclasses import fields
from itertools import product

import numpy as np
import pytest

from squeal.article.claims import CLAIMS
from squeal.article.claims.measures import friction_raises
from squeal.article.ensembles import beyond, distance, gather, population, space
from squeal.article.ensembles.distance import COUNTED, INDEX, NO_LEVELS, Judgement, judge, price
from squeal.article.ensembles.draw import SEEDS, main, name_of, read_stage, stage_file, write_stage
from squeal.article.ensembles.population import Stage, advance
from squeal.article.identify.space import LENGTH, MASS, stacked
from squeal.article.report.chapters import ENSEMBLES
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import InputError
from squeal.model.contact import CONSISTENT
from squeal.model.equations import PadModel
from squeal.model.states import FULL
from tests.article import known
from tests.conftest import ROOT, needs_heyoka


@pytest.fixture(scope="module")
def numbers():
    return space.decode(np.random.default_rng(5).uniform(size=(48, len(space.DIMENSIONS))))


def test_numbers_lie_in_their_ranges_which_have_reasons(numbers):
    assert len(space.FORMULATIONS) == len(set(space.FORMULATIONS)) == 8
    for d in space.DIMENSIONS:
        assert d.reason
        assert d.low <= numbers[d.name].min() < numbers[d.name].max() <= d.high
    ends = space.decode(np.array([np.zeros(len(space.DIMENSIONS)), np.ones(len(space.DIMENSIONS))]))
    assert all(ends[d.name] == pytest.approx([d.low, d.high], rel=1e-12) for d in space.DIMENSIONS)


def test_speed_limit_is_that_of_the_surface():
    few = {"F_n": np.array([1e-3])}
    k1 = 2000.0 / (1e-3 * LENGTH)  # the stiffness at which the load is 2 kN
    assert space.speed_limit(few)[0] * LENGTH * math.sqrt(k1 / MASS) == pytest.approx(5.0)


def test_standing_pads_rest_without_friction_and_released_ones_are_where_they_are_put(numbers):
    still = space.standing(numbers)
    seen = 0
    for case in "abcd":
        pads = stacked(numbers, "B2", case, CONSISTENT)
        first = space.starts(numbers, pads)
        assert np.all(first[~still, 1] == numbers["lift"][~still] * numbers["F_n"][~still])
        for i in np.flatnonzero(still & np.isfinite(first).all(axis=1))[:5]:
            model = PadModel("B2", known.one_of(pads, i).replace(mu=0.0), CONSISTENT)
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
        pad = known.one_of(pads, i)
        at = [
            sliding_equilibrium(PadModel("B2", pad.replace(mu=mu), CONSISTENT))[0]
            for mu in (0.0, pad.mu)
        ]
        if all(e is not None and e.state == FULL for e in at):
            assert raised == pytest.approx(at[1].R_n / at[0].R_n - 1.0, rel=1e-8)
            seen += 1
    assert seen >= 4


@needs_heyoka
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


@needs_heyoka
def test_stages_can_be_taken_up_again(tmp_path, monkeypatch):
    monkeypatch.setattr(population, "POPULATION", 24)
    monkeypatch.setattr("squeal.article.ensembles.draw.PARTS", 1)
    now = None
    for stage in range(3):
        now = advance(space.FORMULATIONS[0], 1, stage, now)
        write_stage(tmp_path / "kept.npz", now)
        again = read_stage(tmp_path / "kept.npz")
        for f in fields(Stage):
            wanted = np.asarray(getattr(now, f.name), dtype=float)
            exact = pytest.approx(wanted, rel=1e-6, nan_ok=True)
            assert np.asarray(getattr(again, f.name), dtype=float) == exact, f.name
        now = again
    few = ("--formulations", name_of(space.FORMULATIONS[0]))
    assert main([str(tmp_path), "--stages", "0", "--seeds", "1", "--workers", "1", *few]) == 0
    assert not stage_file(tmp_path, space.FORMULATIONS[0], 1, 0).exists()


def test_a_front_is_what_no_other_row_surpasses():
    rows = np.random.default_rng(2).integers(0, 4, (60, 3)).astype(float)
    front = {tuple(r) for r in rows[gather.undominated(rows)]}
    for row in rows:
        beaten = any((o >= row).all() and (o > row).any() for o in rows)
        assert (tuple(row) in front) != beaten


def test_the_cases_in_which_surfaces_part_are_bits():
    margins = np.ones((4, len(CLAIMS)))
    loss = [INDEX[name] for name in ("B2-a-contact", "B2-b-contact", "B2-d-contact")]
    margins[1, INDEX["B2-c-loss"]] = -1.0
    margins[2, loss] = -1.0
    margins[3, [INDEX["B2-c-loss"], INDEX["B2-b-contact"]]] = -1.0
    assert gather.parting(margins).tolist() == [0b0100, 0, 0b1111, 0b0010]
    assert gather.keep_all(margins, ("B2-a-contact", "B2-c-loss")).tolist() == [
        True,
        False,
        False,
        False,
    ]


def test_gathered_searches_count_what_their_stages_hold(tmp_path, monkeypatch):
    monkeypatch.setattr(population, "POPULATION", 16)
    for f, seed in product(space.FORMULATIONS, SEEDS):
        now = None
        for stage in range(3):
            now = pretended(f, seed, stage)
            write_stage(stage_file(tmp_path, f, seed, stage), now)
    kept = gather.gather(tmp_path)
    np.savez_compressed(tmp_path / "kept.npz", **vars(kept))
    again = gather.read_kept(tmp_path / "kept.npz")
    assert int(again.stages) == 3
    assert np.all(again.effort[:, :, 0] == 3 * 16)
    assert np.all(again.random == [2 * 16, 2 * 16])
    margins = np.array([s.margins for s in map(read_stage, sorted(tmp_path.glob("*/*.npz")))])
    whole = gather.counts(margins.reshape(-1, 33))
    assert again.best.max(axis=(0, 1)) == pytest.approx(whole.max(axis=1))
    assert again.random_counts[:, 0].sum() == 8 * 5 * 2 * 16
    assert np.all(again.random_parting.sum(axis=1) == 5 * 2 * 16)
    assert np.all(again.random_together <= 5 * 2 * 16)
    assert again.shares[0, 0, -1] == pytest.approx(math.log(0.5**2), rel=1e-6)
    with pytest.raises(InputError, match="make ensembles"):
        gather.read_kept(tmp_path / "integral-centre-plus-1" / "stage-000.npz")
    np.savez_compressed(tmp_path / "old.npz", **vars(kept) | {"margins": kept.margins[..., 1:]})
    with pytest.raises(InputError, match="32 claims"):
        gather.read_kept(tmp_path / "old.npz")
    (tmp_path / "mean-frame-minus-5" / "stage-002.npz").unlink()
    with pytest.raises(InputError, match="2 stages"):
        gather.gather(tmp_path)


@needs_heyoka
def test_searches_in_parts_and_after_an_interruption_are_the_same(
    tmp_path, monkeypatch, capsysbinary
):
    laws, seeds = space.FORMULATIONS[:2], (1,)
    monkeypatch.setattr(population, "POPULATION", 8)
    monkeypatch.setattr("squeal.article.ensembles.draw.PARTS", 1)
    monkeypatch.setattr("squeal.article.ensembles.gather.FORMULATIONS", laws)
    monkeypatch.setattr("squeal.article.ensembles.gather.SEEDS", seeds)
    options = ["--stages", "3", "--workers", "1", "--seeds", *map(str, seeds)]
    options += ["--formulations", *map(name_of, laws)]

    def drawn(folder, *parts):
        for part in parts:
            assert main([str(folder), *options, "--part", part]) == 0
        assert gather.main([str(folder), "--untimed"]) == 0
        return capsysbinary.readouterr().out

    whole = drawn(tmp_path / "whole", "1-of-1")
    assert drawn(tmp_path / "parts", "2-of-2", "1-of-2") == whole
    # killed while it wrote a stage: that file is half there, the stages before it stand
    last = stage_file(tmp_path / "parts", laws[1], 1, 2)
    last.with_suffix(".part.npz").write_bytes(last.read_bytes()[:100])
    last.unlink()
    assert drawn(tmp_path / "parts", "1-of-2", "2-of-2") == whole
    assert main([str(tmp_path), "--part", "9-of-8"]) == 2


@needs_heyoka
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
    three = [INDEX[name] for name in gather.FRONT]
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
    random = np.random.default_rng([space.FORMULATIONS.index(formulation), seed, stage])
    points = random.uniform(size=(16, len(space.DIMENSIONS))).astype(np.float32).astype(float)
    partial = random.uniform(5.0, 9.0, (16, distance.STEPS)).cumsum(axis=1)
    yes = np.ones(16, dtype=bool)
    margins = random.normal(size=(16, 33)).astype(np.float32)
    share = 0.5 if stage else 1.0
    return Stage(points, yes, margins, yes, points, partial, NO_LEVELS, share, 1.0, 128, 9000, 0.5)


def test_stored_ensembles_are_of_equal_effort():
    kept = gather.read_kept(ROOT / ENSEMBLES)
    pads, random = kept.effort[:, :, 0], kept.random[:, :, 0]
    assert pads.shape == (8, 5)
    assert np.ptp(pads - random) == 0.0  # of the searches themselves, random pads apart
    assert np.all(np.isfinite(kept.levels[:, :, -1]))
    assert np.all(np.diff(kept.shares, axis=-1) <= 0.0)


def test_shares_multiply_to_a_known_volume(monkeypatch):
    """Distance: the largest offset of three numbers from the middle, in halves of the range."""
    level = 0.1

    def ball(numbers, formulation, levels=NO_LEVELS, models=()):
        points = np.array([numbers[d.name] for d in space.DIMENSIONS[-3:]]).T
        low, high = np.array([(d.low, d.high) for d in space.DIMENSIONS[-3:]]).T
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
