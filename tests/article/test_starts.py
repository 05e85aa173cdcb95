"""Maps over starts: kinds of motion by hand, the plane of starts, sentences that follow."""

import dataclasses

import numpy as np
import pytest

from squeal.article.claims.rules import HAMMER, SWINGS
from squeal.article.figures import starts as starts_figure
from squeal.article.results.records import Missing
from squeal.article.results.starts import KINDS, Map, SceneStarts, Starts
from squeal.article.studies import starts as starts_study
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import read_scene
from squeal.model.linear import linearise
from squeal.model.states import FULL, LEAD, NONE
from squeal.simulation import simulate
from tests.article import known
from tests.conftest import ROOT, hammering_scene, needs_heyoka


@pytest.mark.parametrize(
    ("first", "points", "kind"),
    [
        (FULL, [], "no loss"),
        (NONE, [0, 1], "no loss"),  # lifted, then in full contact
        (LEAD, [], "never in full contact"),
        (NONE, [0], "never in full contact"),
        (NONE, [0, 0], "separation"),  # it leaves the edge on which it landed
        (LEAD, [1, 1], "loss at an edge"),
        (FULL, [0, 0, 0, 0], "loss at an edge"),
        (FULL, [0, 1, 0, 1], "separation"),
        (FULL, [0, 0, 1, 1, 0, 0, 1, 1], "loss at an edge"),  # three turns
        (FULL, [0, 0, 1, 1, 0, 0, 1, 1, 0], "alternate losses"),  # four
        (NONE, [0, 0, 0, 1], "no loss"),  # it bounces on an edge before full contact
    ],
)
def test_kinds_of_motion_by_hand(first, points, kind):
    assert KINDS[starts_study.kind(first, np.array(points, dtype=float))] == kind


@needs_heyoka
def test_no_contact_is_lost_where_the_modes_are_too_small_for_it():
    """Second method: in full contact motion is linear, and its modes' amplitudes add up to the most
    that an edge can rise."""
    own = hammering_scene("b2-b")
    rest, _ = sliding_equilibrium(own.pad_model)
    assert rest is not None
    assert all(rest.state)
    s, t = starts_study.grid(9)
    starts = starts_study.plane(own, np.array(rest.q), s, t)
    found = starts_study.kinds([starts_study.Asked(own, starts, [10])])[0][0]
    matrices = linearise(own.pad_model, rest.q, rest.state)
    squares, shapes = np.linalg.eig(np.linalg.solve(matrices.M, matrices.K))
    assert np.all(squares.real > 0.0)
    amplitudes = np.linalg.solve(shapes, (starts[:, :3] - rest.q).T)
    w = own.pad.w
    edges = np.array([[0.0, 1.0, -w], [0.0, 1.0, w]])  # rise by y and tilt
    most = np.abs((edges @ shapes)[:, :, None] * amplitudes).sum(axis=1)
    gap = -own.pad_model.gaps(np.array(rest.q))[:, None]
    safe = np.all(most < 0.98 * gap, axis=0)
    begins = np.all(own.pad_model.gaps(starts[:, :3].T) < 0.0, axis=0)
    assert safe.sum() > 5
    assert np.all(found[safe] == 0)
    # in ten windows the modes come near to their sum: the others in contact lose it
    assert np.mean(found[begins & np.any(most > 1.02 * gap, axis=0)] > 0) > 0.9


@needs_heyoka
def test_shares_of_a_map_leave_out_the_equilibrium():
    """It stands in the middle of the map and loses no contact; that of B2 (c) is alone in this."""
    own = hammering_scene("b2-c")
    found = starts_study.maps({"own": own}, {1: 3})["own"]
    assert isinstance(found, SceneStarts)
    (one,) = found.maps
    assert one.starts == 8
    around = "".join(one.rows)[:4] + "".join(one.rows)[5:]
    assert one.share == {name: around.count(str(i)) / 8 for i, name in enumerate(KINDS)}


def test_the_plane_of_starts_holds_equilibrium_and_own_start():
    own = hammering_scene("b2-c")
    rest = np.array([1e-5, 2e-5, -3e-5])
    made = starts_study.plane(own, rest, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    assert made[0, :3] == pytest.approx(rest)
    assert made[1] == pytest.approx(np.array(own.initial), abs=1e-20)
    lift = own.pad.w * (made[2, 2] - rest[2])
    assert lift == pytest.approx(own.pad.F_n / own.pad.k_c)


@needs_heyoka
def test_starts_that_hammer_are_those_whose_history_does():
    """Second method: delta and contact of dense histories, for some starts of B2 (b)."""
    own = read_scene(ROOT / "workflow" / "scenes" / "b2-b.yaml", "simulate")
    rest, _ = sliding_equilibrium(own.pad_model)
    assert rest is not None
    s, t = starts_study.grid(4)
    starts = starts_study.plane(own, np.array(rest.q), s, t)
    found = starts_study.swinging(own, starts)
    hammer = full = touching = 0
    for start in starts:
        dense = dataclasses.replace(
            own, initial=tuple(start), start="origin", samples=20_001, outputs=("history",)
        )
        history = simulate(dense).history
        assert history is not None
        state = history["state"]
        begun = np.argmax(state != "SS")
        delta, state = np.array(history["delta"], dtype=float)[begun:], state[begun:]
        side = np.sign(delta[np.isfinite(delta)])
        swings = np.count_nonzero(np.diff(side[side != 0.0]))
        if min(np.nanmax(delta), -np.nanmin(delta)) > HAMMER and swings >= SWINGS:
            hammer += 1
            full += bool(np.all(state == "FC"))
            touching += bool(np.all(state != "SS"))
    assert (found.starts, found.hammer, found.full, found.touching) == (16, hammer, full, touching)
    assert hammer >= 3
    assert full >= 1


def scene_starts(own: int, lossless: float, hammering: float) -> SceneStarts:
    share = dict.fromkeys(KINDS, 0.0) | {KINDS[0]: lossless, KINDS[3]: hammering}
    return SceneStarts(
        1.0, 1.0, (Map(1, ("0" * 100,), 1, 100, share), Map(10, ("0" * 100,), own, 100, share))
    )


@pytest.mark.parametrize(
    ("one", "other", "words"),
    [
        (
            (3, 0.1, 0.6),
            (3, 0.1, 0.6),
            ("nearer to the equ", "both models in case (c)", "another end"),
        ),
        ((1, 0.0, 0.6), (1, 0.0, 0.1), ("No start", "both models in no case", "no other end")),
        # 55 of 100 may be less than half
        (
            (1, 0.0, 0.6),
            (1, 0.0, 0.55),
            (
                "No start",
                "in no case and undecided in case (c). Whether it is most is not decided in B2, "
                "case (c) (55 of",
                "no",
            ),
        ),
        ((0, 0.5, 0.1), (1, 0.0, 0.6), ("No start", "both models in no case", "another end")),
    ],
)
def test_sentences_on_starts_follow_the_maps(one, other, words):
    found = Starts(scenes={"b1-c": scene_starts(*one), "b2-c": scene_starts(*other)}, reach=1.0)
    values = known.physics(starts=found)
    assert values["starts.left-out"] == ""
    for key, part in zip(("keeps", "hammers", "later"), words, strict=True):
        assert part in values[f"physics.starts.{key}"]


def test_without_heyoka_the_reason_stands_in_place_of_the_maps():
    why = Missing("No heyoka on this machine simulates no batches of pads.")
    none = Starts(scenes={"b1-c": why, "b2-c": why}, reach=1.0)
    values = known.physics(starts=none)
    assert "simulates no batches" in values["starts.left-out"]
    assert "physics.starts.keeps" not in values
    assert starts_figure.draw(none).alternative == why.reason
