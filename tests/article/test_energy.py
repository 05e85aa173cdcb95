"""Energy: works that close, the law that feeds it in, sentences that follow the numbers."""

import dataclasses

import numpy as np
import pytest

from squeal.article.findings.work import contact_work
from squeal.article.report.works import energy_table
from squeal.article.results.energy import Energy, Motion, Span, Stay
from squeal.article.results.records import Missing
from squeal.article.studies import energy as energy_study
from squeal.simulation import simulate
from tests.article import known
from tests.conftest import HAMMERING as SCENES
from tests.conftest import hammering_scene


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
    return Motion(friction, 0.0, sum(fed), kinetic, 1e-14, stays, {}, ())


def test_the_law_gives_or_takes_kinetic_energy_and_both_are_told():
    motions: dict[str, Motion | Missing] = {
        "b2-c-mean": made((2.0,), 3.0, 9.0),
        "b2-c-integral": made((), 1.0, 1.0),
        "b2-a-mean": made((2.0,), 3.0, 1.0),
        "b2-a-integral": made((), 1.0, 4.0),
        "b2-d-mean": made((), 3.0, 9.0),  # the law does no work
        "b2-d-integral": made((), 1.0, 1.0),
    }
    text = known.physics(energy=Energy(motions=motions, own=()))["physics.energy.start"]
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
            ("either sign", "no motion has the printed", "far greater in B2 (c)"),
        ),
        ((2.0,), 1.0, 9.0, ("only gives", "more work than friction in B2 (c)", "times).")),
        ((-2.0,), 3.0, 1.0, ("only takes", "no motion has the printed", "differs by less")),
        ((), 3.0, 1.0, ("visits partial contact", "no motion has", "differs by less")),
    ],
)
def test_sentences_on_energy_follow_the_numbers(fed, friction, kinetic, words):
    motions: dict[str, Motion | Missing] = {
        "b2-c-mean": made(fed, friction, kinetic),
        "b2-c-integral": made((), 1.0, 1.0),
        "b2-a-mean": Missing("the pad has turned past 90 degrees at t = 1 s"),
    }
    found = Energy(motions=motions, own=())
    values = known.physics(energy=found)
    told = [values[f"physics.energy.{key}"] for key in ("law", "source", "start")]
    for text, part in zip(told, words, strict=True):
        assert part.lower() in text.lower()
    assert "90 degrees" in energy_table(found)


def spans(*rows: tuple[float, ...]) -> tuple[Span, ...]:
    """friction, most, law, kinetic, peak, calm and pause over 1, 3 and 10 windows."""
    return tuple(
        Span(n, friction, most, law, kinetic, peak, 0.2, calm, pause)
        for n, (friction, most, law, kinetic, peak, calm, pause) in zip(
            (1, 3, 10), rows, strict=False
        )
    )


def longer(own: tuple[Span, ...], printed: tuple[Span, ...] = ()) -> dict[str, str]:
    one = dataclasses.replace(made((), 1.0, 1.0), spans=own)
    other = dataclasses.replace(made((0.002,), 0.001, 1.5), spans=printed)
    motions: dict[str, Motion | Missing] = {"b2-c-integral": one, "b2-c-mean": other}
    found = Energy(motions=motions, own=("b2-c-integral",))
    return {
        k.rpartition(".")[2]: v for k, v in known.physics(energy=found).items() if "energy" in k
    }


def test_what_a_motion_does_later_is_told_where_it_grows_and_rests():
    short = (1.8, 1.8, 0.0, 1.0, 10.7, 1.0, 0.04)
    told = longer(spans(short, (0.0017, 3.5, 0.0, 1.0, 15.1, 0.05, 0.04), (*short[:6], 0.741)))
    assert "over 3 times its time the reaction reaches $15.1$\\,$F_n$" in told["grown"]
    assert "up to $3500$\\,mJ within 3 times its time, and $1.7$\\,mJ by the end" in told["given"]
    assert "bursts, with up to $0.75$ times its time" in told["bursts"]  # an upper bound
    assert "over 10 times it" in told["bursts"]
    assert told["paused"] == "; undamped B2 (c) in bursts"
    assert told["calm"] == r"5\,\%, in B2 (c)"
    assert told["given"].startswith("In B2 (c), integral law, friction")
    assert told["given"].endswith("by the end of that.")
    grown = (0.0017, 3.5, 0.0, 1.0, 15.1, 0.05, 0.04)
    both = longer(spans(short, grown), spans(short, (0.053, 3.9, *short[2:])))["given"]
    assert r"of that (printed law: up to $3900$, by the end $53$\,mJ)." in both
    for later in ((1.0, 1.8, 0.0, 1.0, 11.0, 1.0, 0.4),):
        told = longer(spans(short, later))
        assert (told["grown"], told["given"], told["bursts"], told["paused"]) == ("",) * 4
    early = (*short[:5], 0.9, 0.04)  # the greatest acceleration was before
    assert longer(spans(early, (1.0, 1.8, 0.0, 1.0, 15.0, 1.0, 0.4)))["grown"] == ""


def test_works_are_told_after_longer_too():
    same = (1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0)
    short = (0.001, 0.001, 0.002, 1.5, 1.0, 1.0, 0.0)

    def told(kinetic: float, friction: float = 0.004) -> dict[str, str]:
        later = (friction, 0.004, 0.003, kinetic, 1.0, 1.0, 0.0)
        return longer(spans(same, same), spans(short, later))

    more = told(2.1)
    less = r"($2$ against $1$\,mJ, but less after 3 times its time, $3$ against $4$\,mJ)"
    assert less in more["source"]
    still = told(2.1, friction=0.002)["source"]
    assert r"($2$ against $1$\,mJ, and after 3 times its time, $3$ against $2$\,mJ)" in still
    assert "(over 3 times its time by more in B2 (c) ($2.1$ times))" in more["start"]
    assert told(1.9)["start"].endswith("under both laws.")


def test_spans_are_those_of_a_simulation():
    """Second method: peak, changes of contact and time apart from the run of the longer scene."""
    own = hammering_scene("b2-c")
    assert own.stop is not None
    (one,) = energy_study.spans(own, contact_work(own), (3,))
    run = simulate(
        dataclasses.replace(own, stop=3 * own.stop, outputs=("events", "shares", "extrema"))
    )
    assert run.events is not None
    changes = np.array([event.t for event in run.events])
    assert one.pause * own.stop == pytest.approx(np.diff(changes).max(), rel=1e-6)
    assert one.apart == pytest.approx(run.shares["SS"], rel=1e-6)
    assert one.peak == pytest.approx(run.extrema["Rn"][1], rel=1e-6)
    assert one.most >= one.friction
