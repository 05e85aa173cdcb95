"""Sound: spectra of the contact force from a kicked equilibrium through first losses of contact."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from squeal.analysis.eigenvalues import analyse
from squeal.article.cases import HISTORY_FIGURES
from squeal.article.results.spectra import Heard, Spectra
from squeal.article.studies._damped import RATIO, damped
from squeal.article.studies._scenes import read_scenes
from squeal.article.studies.starts import lever
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.numerics.oscillation import line, spectrum
from squeal.simulation import simulate

WINDOWS = 32  # times the scene's time
RATE = 64.0  # samples a ms
PIECE, HOP = 4.0, 2.0  # ms: of the signal in each row of the spectrogram, and from row to row
HIGHEST = 30.0  # kHz
KICK = 1e-3  # of the static compression
FAINT = -80  # dB
MOST = 2  # scenes


def _levels(amplitudes: np.ndarray, most: float) -> np.ndarray:
    return np.asarray(20.0 * np.log10(np.maximum(amplitudes / most, 10.0 ** (FAINT / 20.0))))


def tonal(signal: np.ndarray, step: float, base: float) -> float:
    """Share of a signal's power within two lines of the multiples of a frequency."""
    frequencies, amplitudes = spectrum(signal[:, None], step)
    power = amplitudes[:, 0] ** 2
    power[0] = 0.0
    off = np.abs(frequencies - base * np.maximum(np.round(frequencies / base), 1.0))
    return float(power[off <= 2.5 * frequencies[1]].sum() / power.sum())


def contact_force(scene: Scene) -> tuple[np.ndarray, np.ndarray, float | None]:
    """Times (ms), total contact force over F_n, and when contact is first lost (ms).

    Raises ComputationError where the model ends.
    """
    assert scene.stop is not None
    stop = WINDOWS * scene.stop
    asked = dataclasses.replace(
        scene,
        pad=scene.pad.replace(V=None),  # sliding is not asked for
        start="equilibrium",
        initial=(0.0, KICK * lever(scene), 0.0, 0.0, 0.0, 0.0),
        stop=stop,
        samples=int(1e3 * stop * RATE) + 1,
        outputs=("events", "history"),
    )
    run = simulate(asked)
    assert run.history is not None
    assert run.events is not None
    law = scene.pad_model.law
    force = np.sum([run.history[s.name] for s in law.plotted if s.is_force], axis=0)
    onset = 1e3 * run.events[0].t if run.events else None
    return 1e3 * run.history["t"], force, onset


def heard(scene: Scene) -> Heard | None:
    """What a scene's damped pad sounds like, None where its equilibrium does not flutter."""
    try:
        at = analyse(scene)
        grows = at.spectrum.dominant
        if grows.value.real <= 0.0 or grows.value.imag == 0.0:
            return None
        t, force, onset = contact_force(scene)
    except ComputationError:
        return None
    step, half = t[1] - t[0], len(t) // 2
    late, piece, hop = force[half:], int(PIECE * RATE), int(HOP * RATE)
    strongest, _ = line(late[:, None], step)
    if strongest == 0.0:  # off the surface
        return None
    starts = range(0, len(force) - piece + 1, hop)
    rows = [spectrum(force[i : i + piece, None], step)[1][:, 0] for i in starts]
    frequencies = spectrum(force[:piece, None], step)[0]
    kept = frequencies <= HIGHEST
    late_frequencies, amplitudes = spectrum(late[:, None], step)
    near = late_frequencies <= HIGHEST
    levels = _levels(np.array(rows)[:, kept], np.max(rows)).round().astype(int)
    return Heard(
        modes=tuple((at.spectrum.frequencies_hz / 1e3).tolist()),
        growing=grows.value.imag / (2e3 * np.pi),
        growth=grows.value.real / 1e3,
        onset=onset,
        strongest=strongest,
        tonal=tonal(late, step, strongest),
        times=tuple(t[i] + PIECE / 2 for i in starts),
        frequencies=tuple(frequencies[kept].tolist()),
        levels=tuple(map(tuple, levels.tolist())),
        late_frequencies=tuple(late_frequencies[near].round(4).tolist()),
        late=tuple(_levels(amplitudes[near, 0], amplitudes.max()).round(1).tolist()),
    )


def study(files: Sequence[Path]) -> Spectra:
    """The scenes whose equilibrium flutters with damping, those that grow fastest."""
    scenes = read_scenes(files, HISTORY_FIGURES, "simulate")
    found = {name: heard(damped(scene, RATIO)) for name, scene in scenes.items()}
    some = {name: one for name, one in found.items() if one is not None}
    fastest = sorted(some, key=lambda name: -some[name].growth)[:MOST]
    return Spectra(scenes={n: one for n, one in some.items() if n in fastest}, ratio=RATIO)
