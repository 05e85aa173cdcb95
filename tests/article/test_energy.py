"""Energy: works that close, the law that feeds it in, sentences that follow the numbers."""

import dataclasses

import pytest

from squeal.article.report.physics import energy_table
from squeal.article.results.energy import Energy, Motion, Stay
from squeal.article.studies import energy as energy_study
from squeal.files.records import Missing
from tests.article import known
from tests.conftest import HAMMERING as SCENES


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
    text = known.physics(energy=Energy(motions=motions))["physics.energy.start"]
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
    values = known.physics(energy=found)
    told = [values[f"physics.energy.{key}"] for key in ("law", "source", "start")]
    for text, part in zip(told, words, strict=True):
        assert part.lower() in text.lower()
    assert "90 degrees" in energy_table(found)
