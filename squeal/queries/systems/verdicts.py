"""Verdicts on roots of systems, of which some only may be known."""

from collections.abc import Sequence

import numpy as np

from squeal.linear import GROWING
from squeal.linear.eigen import Eigenvalue
from squeal.linear.matrices import Array
from squeal.linear.roots import ComplexArray
from squeal.linear.system import TermSystem
from squeal.linear.verdicts import assumed_rounding, decide
from squeal.results.columns import OPEN

NO_ROOT = "no root"  # the verdict on a band or region without one
UNCOUNTED = "open"  # where none of some roots grows, and nothing counts the others


def verdict_of(roots: ComplexArray, rounding: Array) -> str:
    """Verdict on roots (m,) that rounding (m,) may move so far, 1/s; `NO_ROOT` on none."""
    return decide(roots, rounding).verdict if rounding.size else NO_ROOT


def verdict_of_some(roots: ComplexArray, rounding: Array) -> str | None:
    """Verdict on some roots (m,) of a system, of which only growth is one; None if none grows."""
    verdict = verdict_of(roots, rounding)
    return verdict if verdict in GROWING else None


def rounding_of(system: TermSystem, roots: ComplexArray) -> Array:
    """How far (m,) rounding may move roots (m,) of a system, 1/s, as is assumed without vectors."""
    return assumed_rounding(roots, system.undamped)


def judge_roots(
    roots: Sequence[Eigenvalue], complete: bool = True, conservative: bool = False
) -> tuple[str | None, str]:
    """Decide the verdict on roots; returns it, None where it is open, and what decided it in words.

    Parameters
    ----------
    roots : sequence of Eigenvalue
        The roots with their rounding. One with a backward error above 1e-6 decides nothing unless a
        proof says that it grows.
    complete : bool
        Whether these are all roots. Of some roots only growth is a verdict.
    conservative : bool
        Whether the system is undamped or gyroscopic. Its roots lie on the imaginary axis or in
        fours about the axis, so that a root that is near the axis to rounding lies on it. Of other
        systems a root on either side of the axis within rounding leaves the verdict open.
    """
    solved = [root for root in roots if root.decides and root.rounding < np.inf]
    if not solved:
        return None, f"{NO_ROOT} was found that solves the equations"
    judgement = decide([root.value for root in solved], [root.rounding for root in solved])
    decided = (judgement.verdict, str(judgement))
    if judgement.verdict in GROWING:
        return decided
    if not complete or len(solved) < len(roots):
        rate = f"largest Re lambda = {judgement.value:.6g}"
        return None, f"none of {len(solved)} roots grows: {rate}; the others are not known"
    # rounding leaves the sign of their real parts open. A real part of exactly zero is known: that
    # of an undamped mode or a rigid body
    undecided = [root for root in solved if 0.0 < abs(root.value.real) <= root.rounding]
    if not undecided or conservative:
        return decided
    worst = max(undecided, key=lambda root: root.rounding)
    side = f"a root at {worst.frequency_hz:.6g} Hz on either side of the axis"
    return None, f"{OPEN}rounding ({worst.rounding:.2g} 1/s) leaves {side}"
