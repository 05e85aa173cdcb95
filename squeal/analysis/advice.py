"""Two or three sentences on a scene's stability that an engineer can act on, from its numbers."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from squeal.analysis.critical import CriticalFriction
from squeal.analysis.eigenvalues import Analysis, analyse
from squeal.analysis.sensitivity import first_loss, threshold_sensitivities
from squeal.errors import ComputationError
from squeal.model.pad import PARAMETERS
from squeal.scene import Scene

TRIED = ("k1", "k2", "k3", "k4", "k_c", "h", "I", "alpha1", "alpha2", "F_n")
STEP = 0.02  # of the parameter, of one radian for an angle


def _gap(analysis: Analysis) -> float:
    """The least relative distance of two frequencies: flutter needs it to close."""
    values = sorted(e.frequency_hz for e in analysis.spectrum.eigenvalues[::2])
    return min((b - a) / b if b else 1.0 for a, b in itertools.pairwise(values))


def _changed(scene: Scene, name: str, sign: float) -> Scene:
    value = getattr(scene.pad, name)
    step = STEP if PARAMETERS[name].angle else STEP * abs(value)
    return replace(scene, pad=scene.pad.replace(**{name: value + sign * step}))


def levers(scene: Scene, critical: CriticalFriction) -> list[tuple[str, float]]:
    """Parameters by what a rise of STEP does: to the first loss of stability, or, where there is
    none, to the least relative distance of two frequencies; the strongest first."""
    values = {name: getattr(scene.pad, name) for name in TRIED}
    names = [name for name, value in values.items() if value]
    loss = first_loss(critical)
    effects = []
    if loss is not None:
        try:
            slopes = threshold_sensitivities(scene, loss)
        except ComputationError:  # growth rates change places there, and no matrix turns singular
            return []
        for name in names:
            step = STEP if PARAMETERS[name].angle else STEP * abs(values[name])
            effects.append((name, step * slopes[name]))
    else:
        for name in names:
            try:
                up, down = (_gap(analyse(_changed(scene, name, sign))) for sign in (1.0, -1.0))
            except ComputationError:
                continue
            effects.append((name, (up - down) / 2))
    return sorted(effects, key=lambda pair: -abs(pair[1]))


def advise(scene: Scene, critical: CriticalFriction) -> str:
    """Verdict, distance to the nearest threshold, and the strongest lever, in plain sentences."""
    try:
        analysis = analyse(scene)
    except ComputationError as error:
        return f"{str(error)[0].upper()}{str(error)[1:]}."
    mu, loss = scene.pad.mu, first_loss(critical)
    found = levers(scene, critical)
    name, effect = found[0] if found else ("", 0.0)
    what = PARAMETERS[name].meaning if name else ""
    step = f"{STEP:g} rad" if name and PARAMETERS[name].angle else f"{100 * STEP:g} %"
    raised = f"raising {name} ({what}) by {step}"
    verdict = analysis.judgement.verdict
    dominant = analysis.spectrum.dominant
    if verdict == "flutter":
        first = (
            f"At mu = {mu:.3g} the pad flutters at {dominant.frequency_hz:.0f} Hz and its "
            f"amplitude grows e-fold in {1e3 / dominant.growth_rate:.2g} ms."
        )
    elif verdict == "divergence":
        first = f"At mu = {mu:.3g} the equilibrium diverges: the pad leaves it without vibrating."
    else:
        low = min(e.frequency_hz for e in analysis.spectrum.eigenvalues)
        first = f"At mu = {mu:.3g} no mode grows ({verdict}); the lowest frequency is {low:.0f} Hz."
    if loss is None:
        second = f"No threshold lies below mu = {critical.mu_end:.3g}."
        third = (
            f"The closest pair of frequencies is {100 * _gap(analysis):.0f} % apart; {raised} "
            f"{'widens' if effect > 0 else 'narrows'} that by {100 * abs(effect):.2g} points."
        )
    else:
        at = f" at {loss.frequency_hz:.0f} Hz" if loss.frequency_hz else ""
        side = "above" if loss.mu > mu else "below"
        fold = loss.kind == "fold"
        how = "the equilibrium ceases in a fold" if fold else f"{loss.kind}{at} sets in"
        second = f"Stability is first lost at mu = {loss.mu:.3g}, {side} the scene's, where {how}."
        third = f"Of the parameters tried, {raised} moves this threshold most: by {effect:+.2g}."
    return f"{first} {second} {third}" if np.isfinite(effect) and name else f"{first} {second}"
