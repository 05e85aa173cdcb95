"""The stored pads and that of the scenes judged afresh: at other tolerances, over a longer time."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from squeal.article.claims import CLAIMS, judge_scenes
from squeal.article.identify.objective import CONFLICTS, judge_one
from squeal.article.identify.space import STOP
from squeal.article.identify.stored import Search, read_searches
from squeal.article.results.claims import JudgedClaim
from squeal.article.results.verify import (
    TOLERANCE,
    Changed,
    Failing,
    Switches,
    VerifiedPad,
    Verify,
)
from squeal.article.studies._scenes import read_cases
from squeal.errors import ComputationError

# a tolerance sets the order of the series alone, which one of 2e-12 leaves as it is at 1e-12
VARIATIONS = {
    "a tenth of the tolerance": (0.1 * TOLERANCE, STOP),
    "ten times the tolerance": (10.0 * TOLERANCE, STOP),
    "doubled horizon": (TOLERANCE, 2.0 * STOP),
}


def _verdicts(judged: list[JudgedClaim]) -> dict[str, str]:
    return {j.id: j.verdict for j in judged}


def changes(
    judge: Callable[[float, float], list[JudgedClaim]], judged: list[JudgedClaim]
) -> tuple[Changed, ...]:
    """What the variations change; judge: all claims at a tolerance over a horizon, `judged` so."""
    verdicts, changed = _verdicts(judged), []
    for words, (tolerance, stop) in VARIATIONS.items():
        try:
            other = _verdicts(judge(tolerance, stop))
        except ComputationError as error:
            changed.append(Changed(words, "", str(error)))
            continue
        changed += [
            Changed(words, name, verdict)
            for name, verdict in other.items()
            if verdict != verdicts[name]
        ]
    return tuple(changed)


def verified(search: Search) -> VerifiedPad:
    """How many claims a stored pad keeps, which not and why, and what the variations change."""
    judge = partial(judge_one, search.numbers, search.formulation)
    judged = judge(TOLERANCE, STOP)
    failing = [j for j in judged if not j.holds]
    return VerifiedPad.of(
        search,
        formulation=Switches.of(search.formulation),
        reproduced=len(judged) - len(failing),
        failing=tuple(map(Failing.of, failing)),
        changed=changes(judge, judged),
    )


def of_scenes(files: Sequence[Path]) -> tuple[Changed, ...]:
    """What the variations change for the pad of the scenes."""
    models = [read_cases(files, model, "simulate") for model in ("B1", "B2")]

    def judge(tolerance: float, stop: float) -> list[JudgedClaim]:
        return judge_scenes(
            *(
                {
                    case: replace(one, tolerance=tolerance, stop=one.stop * stop / STOP)
                    for case, one in scenes.items()
                    if one.stop is not None  # as a scene that is simulated has it
                }
                for scenes in models
            )
        )

    return changes(judge, judge(TOLERANCE, STOP))


def study(files: Sequence[Path]) -> Verify:
    """The outcome for every stored search, and for the pad of the scenes."""
    stored = [file for file in files if file.suffix == ".json"]
    found = tuple(verified(search) for search in read_searches(stored))
    own = of_scenes([file for file in files if file not in stored])
    return Verify(found, len(CLAIMS) - len(CONFLICTS), STOP, own)
