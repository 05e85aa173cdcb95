"""The physics chapter: its studies against independent truth, its sentences against their turn."""

import dataclasses
import inspect
import math
from typing import Any, TypeVar, get_type_hints

import numpy as np
import pytest

from squeal.analysis.maps import BEYOND_FOLD, angle_axes, on_grid
from squeal.article.cases import CASES
from squeal.article.equations import Bounds, bounds
from squeal.article.figures import starts as starts_figure
from squeal.article.report.physics import energy_table, generated
from squeal.article.results.energy import Energy, Motion, Stay
from squeal.article.results.line_springs import Case, Compared, Contact, LineSprings, Threshold
from squeal.article.results.map_ranges import MapRanges
from squeal.article.results.starts import KINDS, Map, SceneStarts, Starts
from squeal.article.studies import energy as energy_study
from squeal.article.studies import line_springs as springs_study
from squeal.article.studies import map_ranges as ranges_study
from squeal.article.studies import starts as starts_study
from squeal.equilibrium import sliding_equilibrium
from squeal.equilibrium.find import find_all
from squeal.files.records import Missing, Result
from squeal.model.linear import linearise
from squeal.model.states import FULL, LEAD, NONE, STATES
from squeal.scene import read_scene
from squeal.simulation import Simulation
from squeal.stability import verdict
from tests.article import known
from tests.conftest import HAMMERING as SCENES
from tests.conftest import needs_heyoka

R = TypeVar("R", bound=Result)


def known_of(kind: type[R]) -> R:
    """A result of the right form without any computation."""
    found = known.result(kind.__module__.rpartition(".")[2])
    assert isinstance(found, kind)
    return found


def chapter(**given: Result) -> dict[str, str]:
    """The chapter's values from some results and known ones in place of the others."""
    hints = get_type_hints(generated)
    names = inspect.signature(generated).parameters
    results: Any = [given.get(name) or known_of(hints[name]) for name in names]
    return generated(*results)[0]


@pytest.fixture(scope="module")
def energy() -> Energy:
    return energy_study.study(sorted(SCENES.glob("b?-?.yaml")))


def test_energy_comes_from_somewhere(energy):
    assert energy.wrong == ""
    assert len(energy.motions) == 12
    for name, motion in energy.motions.items():
        assert bool(motion.curves) is (name in energy_study.SHOWN)
        assert sum(s.fed for s in motion.stays) == pytest.approx(
            motion.law, abs=1e-12 * motion.kinetic
        )


def test_a_law_with_a_potential_that_feeds_energy_in_stops_the_build(energy):
    for name in ("b1-c", "b2-c-integral"):
        motion = energy.motions[name]
        fed = dataclasses.replace(motion, stays=(Stay(0.0, 1.0, 1e-6 * motion.kinetic),))
        assert name in dataclasses.replace(energy, motions={name: fed}).wrong
    opened = dataclasses.replace(energy.motions["b1-c"], residue=1e-6)
    assert "open" in dataclasses.replace(energy, motions={"b1-c": opened}).wrong


def made(fed: tuple[float, ...], friction: float, kinetic: float) -> Motion:
    stays = tuple(Stay(float(i), i + 0.5, one) for i, one in enumerate(fed))
    return Motion(friction, 0.0, sum(fed), kinetic, 1e-14, stays, {})


def test_the_law_gives_or_takes_kinetic_energy_and_both_are_told():
    motions: dict[str, Motion | Missing] = {
        "b2-c-mean": made((2.0,), 3.0, 9.0),
        "b2-c-integral": made((), 1.0, 1.0),
        "b2-a-mean": made((2.0,), 3.0, 1.0),
        "b2-a-integral": made((), 1.0, 4.0),
        "b2-d-mean": made((), 3.0, 9.0),  # the law does no work
        "b2-d-integral": made((), 1.0, 1.0),
    }
    text = chapter(energy=Energy(motions=motions))["physics.energy.start"]
    assert "far greater in B2 (c) ($9$ times) and far smaller in B2 (a) ($0.25$ times)" in text
    assert "either direction" in text
    assert "(d)" not in text


@pytest.mark.parametrize(
    ("fed", "friction", "kinetic", "words"),
    [
        (
            (2.0, -1.0),
            3.0,
            9.0,
            ("either sign", "no motion has the contact", "far greater in B2 (c)"),
        ),
        ((2.0,), 1.0, 9.0, ("only gives", "more work than friction in B2 (c)", "times).")),
        ((-2.0,), 3.0, 1.0, ("only takes", "no motion has the contact", "differs by less")),
        ((), 3.0, 1.0, ("visits partial contact", "no motion has", "differs by less")),
    ],
)
def test_sentences_on_energy_follow_the_numbers(fed, friction, kinetic, words):
    motions: dict[str, Motion | Missing] = {
        "b2-c-mean": made(fed, friction, kinetic),
        "b2-c-integral": made((), 1.0, 1.0),
        "b2-a-mean": Missing("the pad has turned past 90 degrees at t = 1 s"),
    }
    found = Energy(motions=motions)
    values = chapter(energy=found)
    told = [values[f"physics.energy.{key}"] for key in ("law", "source", "start")]
    for text, part in zip(told, words, strict=True):
        assert part.lower() in text.lower()
    assert "90 degrees" in energy_table(found)


@pytest.fixture(scope="module")
def scene():
    return read_scene(SCENES / "b2-c.yaml")


def test_shares_of_the_printed_conditions_lie_where_they_are_known_to(scene):
    """Equal springs, level pad, h/w from 0.1 to 1 and mu from 0.1 to 0.7: 3 to 20 %, 89 to 99 %."""
    printed, signs = [], []
    angles = ranges_study._angles(90)
    for ratio in (0.1, 0.4, 1.0):
        for mu in (0.1, 0.4, 0.7):
            pad = ranges_study.with_values(scene.pad.replace(theta0=0.0), ratio, 1.0, mu)
            assert pad.k1 == pytest.approx(pad.k2)
            assert pad.k1 + pad.k2 == pytest.approx(scene.pad.k1 + scene.pad.k2)
            found = bounds(pad, angles)
            printed.append(found.as_printed.mean())
            signs.append(found.sign_aware.mean())
    assert 0.025 < min(printed) < 0.04
    assert 0.18 < max(printed) < 0.21
    assert 0.88 < min(signs) < 0.90
    assert max(signs) > 0.98


@pytest.mark.parametrize(
    ("angles", "place"),
    [((0.7, 0.5), "inside"), ((0.5, 0.5), "on the edge"), ((0.5, 0.7), "outside")],
)
def test_a_case_lies_inside_on_the_edge_or_outside(scene, monkeypatch, angles, place):
    """With a condition in place of (23a, b) whose edge is the diagonal."""

    def below(pad, at):
        return Bounds(0.0, 0.0, np.asarray(at[1] < at[0]), np.asarray(at[1] < at[0]))

    monkeypatch.setattr(ranges_study, "bounds", below)
    assert ranges_study.where(scene.pad, angles) == place


def test_without_friction_every_branch_is_whole(scene):
    smooth = dataclasses.replace(scene, pad=scene.pad.replace(mu=1e-3))
    found = ranges_study.off_branch(smooth, 4)
    assert (found.beyond, found.found, found.kept) == (0, 0, 0)


def test_equilibria_off_the_branch_are_those_of_a_thorough_search(scene):
    """A point of the map at a time, from some hundreds of places, in each contact state."""
    found = ranges_study.off_branch(scene, 4)
    axis = angle_axes(4)[0].values
    codes = on_grid(scene, ("alpha1", "alpha2"), axis, axis).codes
    beyond = axis[np.argwhere(codes == BEYOND_FOLD)]
    assert (found.points, found.beyond) == (16, len(beyond))
    others, kept = 0, 0
    for a1, a2 in beyond.tolist():
        model = scene.pad_model.replace(alpha1=a1, alpha2=a2)
        matrices = [linearise(model, e.q, e.state) for e in find_all(model)]
        verdicts = [verdict(one.M, one.C, one.K) for one in matrices]
        others += bool(verdicts)
        kept += bool({"stable", "marginal"} & set(verdicts))
    assert 0 < found.found <= others
    assert 0 < found.kept <= kept
    assert found.upright <= found.kept


@pytest.mark.parametrize(
    ("place", "words"),
    [("inside", "against the article"), ("on the edge", "neither"), ("outside", "as the article")],
)
def test_the_reading_of_the_map_follows_where_the_case_lies(place, words):
    known_ranges = known_of(MapRanges)
    members = {
        case: dataclasses.replace(one, own=place if case == "c" else "outside")
        for case, one in known_ranges.members.items()
    }
    values = chapter(ranges=dataclasses.replace(known_ranges, members=members))
    assert words in values["physics.map.reading"]
    assert f"(c) lie {place}" in values["physics.map.lie"] or place == "outside"


@pytest.mark.parametrize(
    ("outside", "words"), [(0.0, "the same for all"), (0.3, "depends on the pad")]
)
def test_where_a_case_lies_is_no_property_of_its_angles_if_it_moves(outside, words):
    found = known_of(MapRanges)
    case = dataclasses.replace(found.members["c"], inside=0.5, outside=outside)
    values = chapter(ranges=dataclasses.replace(found, members={"c": case}, flat=()))
    assert words in values["physics.map.angles"]
    assert "divide by zero" not in values["physics.map.angles"]


def test_conditions_that_divide_by_zero_whatever_the_pad_are_found_and_told(scene):
    """K21 = k1 s1 c1 - k2 s2 c2 in closed form: zero for all k1 and k2 if both products are."""
    closed = [
        case
        for case, angles in CASES.items()
        if max(abs(math.sin(a) * math.cos(a)) for a in angles) < 1e-15
    ]
    assert ranges_study._flat(scene.pad) == tuple(closed) == ("a", "b")
    found = dataclasses.replace(known_of(MapRanges), flat=("a", "b"))
    assert "For cases (a) and (b) $K_{21} = 0$" in chapter(ranges=found)["physics.map.angles"]


def test_sliding_in_full_contact_is_counted_pad_by_pad(scene):
    """Without friction every branch reaches its end; the shares against the maps of one pad."""
    one = ranges_study.with_values(scene.pad, 0.3, 1.0, 0.5)
    pads = ranges_study.with_values(scene.pad, *(np.array([v, v]) for v in (0.3, 1.0, 0.5)))
    reached, kept, full = ranges_study._equilibria(scene, pads, 7)
    alone = dataclasses.replace(scene, pad=one)
    a1, a2 = ranges_study._axes(7)
    found = on_grid(alone, ("alpha1", "alpha2"), a1, a2)
    assert reached == pytest.approx(np.mean(found.codes != BEYOND_FOLD))
    good = np.isin(found.codes, ranges_study.KEPT)
    assert kept == pytest.approx(np.mean(good))
    assert full == pytest.approx(np.mean(good & (found.contact == STATES.index(FULL))))
    assert 0.0 < full[0] < kept[0] < reached[0]


@pytest.mark.parametrize(("kept", "words"), [(0, "all there is"), (3, "branch only")])
def test_the_branch_is_not_all_there_is_if_others_are_kept(kept, words):
    ranges = known_of(MapRanges)
    changed = dataclasses.replace(ranges.off_branch, kept=kept)
    values = chapter(ranges=dataclasses.replace(ranges, off_branch=changed))
    assert words in values["physics.map.other"]


def test_many_springs_move_as_the_line_does_ever_nearer():
    """A motion in partial contact: springs are a midpoint rule, whose error falls as 1/N^2."""
    own = read_scene(SCENES / "b2-b.yaml", "simulate")
    line = springs_study._run(own, 0)
    assert isinstance(line, Simulation)
    off = []
    for count in (8, 32):
        run = springs_study._run(own, count)
        assert isinstance(run, Simulation)
        off.append(springs_study._contact(own, count, run, line).off)
    assert 4.0 < off[0] / off[1] < 40.0


def test_nothing_is_compared_where_no_motion_reaches_its_end():
    why = Missing("the pad has turned past 90 degrees")
    points: dict[str, tuple[Threshold, ...]] = {"0": ()}
    none = LineSprings(
        cases={"c": Case(why, (why,), False, points)}, starts={}, stop=1.0, mu_max=2.0
    )
    assert "depends on the case" in chapter(springs=none)["physics.springs.verdict"]


def springs(lost: float, apart: float, off: float, mu: float) -> LineSprings:
    """Two springs beside a line that loses contact for half of the time, and is apart for some."""
    few, many = Contact(2, lost, apart, 1, 2.0, 0.5), Contact(32, 0.5, 0.2, 1, 2.0, off)
    points: dict[str, tuple[Threshold, ...]] = {
        "0": (Threshold(0.4, "flutter"),),
        "2": (Threshold(mu, "flutter"),),
    }
    line = Contact(0, 0.5, 0.2, 1, 2.0, 0.0)
    return LineSprings(
        cases={"c": Case(line, (few, many), True, points)}, starts={}, stop=1.0, mu_max=2.0
    )


@pytest.mark.parametrize(
    ("lost", "apart", "off", "mu", "words"),
    [
        (0.8, 0.4, 0.001, 0.4, ("exaggerates partial contact and separation,", "within", "no thr")),
        (
            0.3,
            0.4,
            0.001,
            0.3,
            ("exaggerates separation and understates par", "within", "is $0.3$ on 2"),
        ),
        (0.3, 0.1, 0.2, 0.4, ("understates partial contact and separation,", "still", "no thres")),
        (0.5, 0.2, 0.2, 0.4, ("depends on the case", "still", "no threshold")),
    ],
)
def test_the_verdict_on_points_follows_the_shares(lost, apart, off, mu, words):
    found = springs(lost, apart, off, mu)
    values = chapter(springs=found)
    keys = ("verdict", "limit", "thresholds")
    for key, part in zip(keys, words, strict=True):
        assert part in values[f"physics.springs.{key}"]


def test_over_starts_both_directions_are_told_for_each_case():
    rows: dict[str, tuple[Compared, ...]] = {
        "a": (Compared(1, (23, 30, 28), (30, 0, 51)), Compared(3, (33, 28, 20), (30, 0, 51))),
        "b": (Compared(1, (0, 34, 47), (0, 0, 81)), Compared(3, (0, 34, 47), (0, 0, 81))),
    }
    found = dataclasses.replace(springs(0.5, 0.2, 0.2, 0.4), starts=rows)
    values = chapter(springs=found)
    assert "line from 30 of 162 starts and shorter from 0" in values["physics.springs.verdict"]
    assert "line from 23 of 162 starts and shorter from 64" in values["physics.springs.verdict"]
    told = values["physics.springs.starts"]
    assert "of 81 starts in each case (a, b)" in told
    assert "from 23, 0 and for a shorter time from 30, 34, for longer from 33, 0" in told
    assert "28, 34 over 3 times that time" in told
    without = chapter(springs=springs(0.5, 0.2, 0.2, 0.4))
    assert "from the scenes' own starts" in without["physics.springs.verdict"]


@needs_heyoka
def test_on_two_springs_and_on_the_line_full_contact_is_the_same_motion():
    """Near the equilibrium nothing is lost on either, so that all starts are alike."""
    own = read_scene(SCENES / "b2-d.yaml", "simulate")
    rest, _ = sliding_equilibrium(springs_study.on_springs(own, 0).pad_model)
    assert rest is not None
    q = np.array(rest.q)
    near = dataclasses.replace(own, initial=(*(q + 1e-3 * np.abs(q)).tolist(), 0.0, 0.0, 0.0))
    found = springs_study.compared(near, 1)
    assert sum(found.lost) == springs_study.SIDE**2
    assert found.apart == (0, 0, springs_study.SIDE**2)


@pytest.mark.parametrize(
    ("first", "points", "kind"),
    [
        (FULL, [], "no loss"),
        (NONE, [0, 1], "no loss"),  # lifted, then in full contact
        (LEAD, [], "no loss"),  # never in full contact, but nothing is lost
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
    own = read_scene(SCENES / "b2-b.yaml", "simulate")
    rest, _ = sliding_equilibrium(own.pad_model)
    assert rest is not None
    assert all(rest.state)
    s, t = starts_study.grid(9)
    starts = starts_study.plane(own, np.array(rest.q), s, t)
    found = starts_study.kinds(own, starts, [10])[0]
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


def test_the_plane_of_starts_holds_equilibrium_and_own_start():
    own = read_scene(SCENES / "b2-c.yaml", "simulate")
    rest = np.array([1e-5, 2e-5, -3e-5])
    made = starts_study.plane(own, rest, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    assert made[0, :3] == pytest.approx(rest)
    assert made[1] == pytest.approx(np.array(own.initial), abs=1e-20)
    lift = own.pad.w * (made[2, 2] - rest[2])
    assert lift == pytest.approx(own.pad.F_n / own.pad.k_c)


def scene_starts(own: int, lossless: float, hammering: float) -> SceneStarts:
    share = dict.fromkeys(KINDS, 0.0) | {KINDS[0]: lossless, KINDS[3]: hammering}
    return SceneStarts(1.0, 1.0, (Map(1, ("0",), 1, share), Map(10, ("0",), own, share)))


@pytest.mark.parametrize(
    ("one", "other", "words"),
    [
        ((3, 0.1, 0.6), (3, 0.1, 0.6), ("nearer to the equ", "case (c) alone: ", "another end")),
        ((1, 0.0, 0.6), (1, 0.0, 0.1), ("No start", "In no case", "no other end")),
        ((0, 0.5, 0.1), (1, 0.0, 0.6), ("No start", "In no case", "another end")),
    ],
)
def test_sentences_on_starts_follow_the_maps(one, other, words):
    found = Starts(scenes={"b1-c": scene_starts(*one), "b2-c": scene_starts(*other)}, reach=1.0)
    values = chapter(starts=found)
    assert values["starts.left-out"] == ""
    for key, part in zip(("keeps", "hammers", "later"), words, strict=True):
        assert part in values[f"physics.starts.{key}"]


def test_without_heyoka_the_reason_stands_in_place_of_the_maps():
    why = Missing("No heyoka on this machine simulates no batches of pads.")
    none = Starts(scenes={"b1-c": why, "b2-c": why}, reach=1.0)
    values = chapter(starts=none)
    assert "simulates no batches" in values["starts.left-out"]
    assert "physics.starts.keeps" not in values
    assert starts_figure.draw(none).alternative == why.reason
