"""Advice in plain sentences that an engineer can act on."""

from squeal.analysis.advice import Advice, Lever, advise
from squeal.analysis.eigenvalues import Analysis, analyse
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.linear import GROWING
from squeal.model.pad import PARAMETERS


def change_in_words(lever: Lever) -> str:
    """By how much a lever is moved: 2 %, or 0.02 rad."""
    if lever.tolerance.relative:
        return f"{100 * lever.tolerance.size:g} %"
    return f"{lever.tolerance.size:g} {lever.unit}".strip()


def _hertz(frequency: float) -> str:
    return f"{frequency:.0f} Hz" if frequency >= 100.0 else f"{frequency:.3g} Hz"


def _move(lever: Lever, word: str) -> str:
    meaning = PARAMETERS[lever.parameter].meaning if lever.parameter in PARAMETERS else ""
    what = f" ({meaning})" if meaning and lever.unit else ""
    return f"{word} {lever.parameter}{what} by {change_in_words(lever)}"


def advice_in_words(advice: Advice) -> str:
    """Where stability is lost and what helps most, in two or three sentences."""
    return " ".join([_where(advice), *_what_helps(advice)])


def _where(advice: Advice) -> str:
    nominal, name = advice.nominal, advice.name
    if nominal.critical is None:
        return f"No threshold lies below {name} = {advice.mu_max:.3g}."
    if nominal.critical == 0.0:
        return f"It grows from {name} = 0 on ({nominal.kind})."
    side = "above" if nominal.critical > advice.mu else "below"
    hertz = f" at {_hertz(nominal.frequency_hz)}" if nominal.frequency_hz else ""
    grows = nominal.kind in GROWING
    how = f"{nominal.kind}{hertz} sets in" if grows else "the equilibrium ceases"
    return (
        f"Stability is first lost at {name} = {nominal.critical:.3g}, {side} the present "
        f"{advice.mu:.3g}, where {how}."
    )


def _what_helps(advice: Advice) -> list[str]:
    nominal, found = advice.nominal, []
    if advice.best is not None:
        lever, word, change = advice.best
        after = lever.lowered if word == "lowering" else lever.raised
        if nominal.critical is None:
            found.append(
                f"The closest two frequencies are {100 * (nominal.gap or 0.0):.0f} % apart; of "
                f"the changes tried, {_move(lever, word)} parts them most, by "
                f"{100 * change:.2g} points."
            )
        else:
            beyond = f"beyond {advice.mu_max:.3g}"
            to = beyond if after.critical is None else f"by {change:+.2g} to {after.critical:.3g}"
            found.append(f"Of the changes tried, {_move(lever, word)} raises this most, {to}.")
    if advice.worst is not None:
        lever, word, _ = advice.worst
        after = lever.lowered if word == "lowering" else lever.raised
        move = _move(lever, word)
        how = "brings a threshold to" if nominal.critical is None else "lowers it most, to"
        found.append(f"{move[0].upper()}{move[1:]} {how} {advice.name} = {after.critical:.3g}.")
    return found or ["No change tried moves that."]


def scene_in_words(scene: Scene) -> str:
    """Verdict at the scene's friction, distance to the threshold, and the strongest lever."""
    try:
        analysis = analyse(scene)
    except ComputationError as error:
        return f"{str(error)[0].upper()}{str(error)[1:]}."
    try:
        rest = advice_in_words(advise(scene))
    except ComputationError as error:
        rest = f"{str(error)[0].upper()}{str(error)[1:]}."
    return f"{_verdict_sentence(scene.pad.mu, analysis)} {rest}"


def _verdict_sentence(mu: float, analysis: Analysis) -> str:
    verdict, dominant = analysis.judgement.verdict, analysis.spectrum.dominant
    if verdict == "flutter":
        return (
            f"At mu = {mu:.3g} the pad flutters at {_hertz(dominant.frequency_hz)} and its "
            f"amplitude grows e-fold in {1e3 / dominant.growth_rate:.2g} ms."
        )
    if verdict == "divergence":
        return f"At mu = {mu:.3g} the equilibrium diverges: the pad leaves it without vibrating."
    low = min(e.frequency_hz for e in analysis.spectrum.eigenvalues)
    return f"At mu = {mu:.3g} no mode grows ({verdict}); the lowest frequency is {_hertz(low)}."
