"""The spectrum of hammering: its tones, and the sentence on pitch."""

import dataclasses

import numpy as np
import pytest

from squeal.article.report.onset import generated
from squeal.article.results import onset as results
from squeal.article.results.spectra import Heard, Spectra
from squeal.article.studies import _attractors as attractors
from squeal.article.studies import _late, spectra
from squeal.article.studies._damped import RATIO, damped
from squeal.numerics.oscillation import line
from tests.article.onset import made
from tests.conftest import hammering_scene, needs_heyoka


def test_share_of_the_power_at_multiples_of_a_frequency():
    """Two harmonics and a line between them, whose share of the power is by hand."""
    t = 0.01 * np.arange(5000)  # ms
    signal = 2.0 * np.sin(2 * np.pi * 5.0 * t) + 1.0 * np.sin(2 * np.pi * 10.0 * t + 1.0)
    assert spectra.tonal(signal, 0.01, 5.0) == pytest.approx(1.0, abs=1e-6)
    both = signal + np.sqrt(5.0) * np.sin(2 * np.pi * 7.3 * t)
    assert spectra.tonal(both, 0.01, 5.0) == pytest.approx(0.5, abs=1e-3)


@needs_heyoka
def test_hammering_sounds_at_the_frequency_of_its_cycle_and_growth_at_that_of_its_mode():
    """Shooting and the linearisation against the spectrum of a simulation."""
    scene = damped(hammering_scene("b1-d"), RATIO)
    one = spectra.heard(scene)
    assert one is not None
    assert one.onset is not None
    t, force, _ = spectra.contact_force(scene)
    early = (t > 0.3 * one.onset) & (t < 0.9 * one.onset)
    first, _ = line(force[early, None], float(t[1]))
    assert first == pytest.approx(one.growing, rel=5e-3)
    assert one.tonal > 0.99
    pad = attractors.shooting(scene, RATIO)
    own = pad.units.to_scaled(np.array(scene.initial))
    state = pad.motion(own, _late.LATE * scene.stop / pad.units.time, scene.pad.mu)
    found = attractors.cycles("b1-d", scene, pad.units.to_si(state))
    assert isinstance(found, results.Cycles)
    assert one.strongest * found.own.period == pytest.approx(1.0, rel=1e-4)


def sounds(strongest: float, tonal: float) -> Spectra:
    heard = Heard((5.0,), 5.0, 0.1, 1.0, strongest, tonal, (), (), (), (), ())
    return Spectra(scenes={"b1-d": heard}, ratio=0.005)


@pytest.mark.parametrize(
    ("strongest", "tonal", "period", "words"),
    [
        (5.0, 0.99, 0.2, ("at that of its", "a tone", "has the same frequency")),
        (4.5, 0.5, 0.2, (r"10.0\,\% below", "no tone", "has another frequency")),
        (5.5, 0.5, 0.2, (r"10.0\,\% above", "no tone", "has another frequency")),
    ],
)
def test_the_sentence_on_pitch_follows_the_spectrum(strongest, tonal, period, words):
    found = made()
    assert isinstance(found.cycles, results.Cycles)
    own = dataclasses.replace(found.cycles.own, period=period)
    cycles = dataclasses.replace(found.cycles, name="b1-d", own=own)
    sweeps = {"b1-d": found.sweeps["b2-c-mean"]}
    found = dataclasses.replace(found, cycles=cycles, sweeps=sweeps, thresholds={"b1-d": 0.7})
    found = dataclasses.replace(
        found, late={"b1-d": found.late["b1-c"]}, others={"b1-d": found.others["b1-c"]}
    )
    values, _ = generated(found, sounds(strongest, tonal))
    for part in words:
        assert part in values["onset.pitch"]
