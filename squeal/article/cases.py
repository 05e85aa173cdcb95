"""The article's four cases of spring angles: names, angles, figures and scene files.

Light on purpose: the workflow reads it each time.
"""

import math

# alpha1 and alpha2 over pi
_OVER_PI = {"a": (0.5, 1.0), "b": (1.0, 0.5), "c": (0.75, 0.75), "d": (0.83, 0.83)}

CASES = {case: (a1 * math.pi, a2 * math.pi) for case, (a1, a2) in _OVER_PI.items()}
"""Angles (alpha1, alpha2) in rad of each case."""
ANGLE_TEXTS = {
    case: tuple("pi" if a == 1.0 else f"{a:g}*pi" for a in angles)
    for case, angles in _OVER_PI.items()
}
"""Angles (alpha1, alpha2) of each case, as scene files write them."""
HISTORY_FIGURES = {
    f"{model}-{case}": first + i
    for model, first in (("b1", 4), ("b2", 9))
    for i, case in enumerate(CASES)
}
"""Number of the article's figure that shows the motion of a scene, by the scene's name (b1-a)."""
STEMS = (*HISTORY_FIGURES, "b3")
"""Names of the article's nine scenes; STEM.yaml is the scene's file."""
SMALL_REGION = 0.25
"""Share of the map of the springs' angles below which a region counts as small."""


def stem(model: str, case: str = "") -> str:
    """Name of the scene of a model and a case: B1 and a become b1-a, B3 becomes b3."""
    return f"{model.lower()}-{case}" if case else model.lower()


def title(stem: str) -> str:
    """Model and case in words from a scene's name: b1-a becomes B1, case (a)."""
    model, _, case = stem.partition("-")
    return f"{model.upper()}, case ({case})" if case else model.upper()


def short_title(stem: str) -> str:
    """Model and case in short from a scene's name: b1-a becomes B1 (a)."""
    model, _, case = stem.partition("-")
    return f"{model.upper()} ({case})"
