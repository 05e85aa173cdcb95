"""What files and components leave open of the roots of a system, and of what proves them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from squeal.io.system import SystemFile
from squeal.io.writing import number
from squeal.linear.digits import data_errors, has_digits, known_to_digits, rounding_of_sums
from squeal.linear.matrices import dense
from squeal.linear.system import TermSystem
from squeal.queries.systems.all_roots import is_small
from squeal.queries.systems.proofs import Data
from squeal.queries.systems.roots import Known, system_roots
from squeal.results.columns import OPEN
from squeal.results.sources import EigenvalueSelection
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds


def error_bounds(file: SystemFile, system: TermSystem) -> Callable[[Known], Known] | None:
    """What gives roots of a system the error of the reduction of its components, or of the digits
    of its files; None where nothing but rounding moves them."""
    if file.assembly is not None and file.assembly.reduction:
        return partial(file.assembly.bounded, system)
    if has_digits(system) and not system.follows:
        return partial(known_to_digits, system)
    return None


def data_of(file: SystemFile, system: TermSystem) -> Data | None:
    """What the referee assumes of the entries of a system at its parameters; None of the roots of
    joined components, which it is not asked of, since nobody gave their matrices."""
    if file.assembly is not None and file.assembly.reduction:
        return None
    if system.follows:
        return Data()
    if not has_digits(system):
        radii = rounding_of_sums(system) if is_small(system) else None
        if radii is None or not any(radius.any() for radius in radii):
            return Data()  # each entry is one given number
        return Data(radii=radii, keeps_structure=_has_structure(system))
    fewest = min(term.digits for term in system.terms if term.digits is not None)
    errors = (X.toarray() for X in data_errors(system))
    return Data(f"{fewest} digits", tuple(errors))


def _has_structure(system: TermSystem) -> bool:
    """Whether each term of M and K is symmetric, and each of C skew, at all parameters."""
    for term in system.C:
        C = dense(term.matrix)
        if not np.array_equal(C, -C.T):
            return False
    for term in (*system.M, *system.K):
        X = dense(term.matrix)
        if not np.array_equal(X, X.T):
            return False
    return True


def digits_of_files(file: SystemFile) -> str:
    """The digits of the files of a system in words."""
    known = {one.file: one.digits for one in file.origins if one.digits is not None}
    each = [f"the {digits} digits of {name}" for name, digits in known.items()]
    return " and ".join(each) or "the digits of the matrices"


def open_by_digits(file: SystemFile, roots: Known) -> str:
    """Why the verdict is open where it hangs on the digits of files; empty if it does not."""
    unsure = [root for root in roots if root.open]
    if not unsure or not has_digits(file.system):
        return ""
    farthest = max(root.error or 0.0 for root in unsure)
    count = "1 root is" if len(unsure) == 1 else f"{len(unsure)} roots are"
    return (
        f"{OPEN}{count} known to {number(farthest, 2)} 1/s by {digits_of_files(file)}, and neither "
        "grow nor decay as far as these say"
    )


def accuracy_by_digits(file: SystemFile, roots: Known) -> str:
    """To what share of their size the digits of files give the roots that are not open."""
    known = [root for root in roots if root.error is not None and not root.open]
    if not known or not has_digits(file.system):
        return ""
    share = max((root.error or 0.0) / abs(root.value) for root in known if root.value)
    return f"roots that are not open are known to {number(share, 2)} by {digits_of_files(file)}"


def _open_at(file: SystemFile, selection: EigenvalueSelection, value: float) -> str:
    """Why the verdict at a value of the parameter is open by the digits of files; empty if not."""
    system = file.system.replace({file.system.parameter: value})
    bounded = error_bounds(file, system)
    if bounded is None or not has_digits(system) or not is_small(system):
        return ""
    roots = system_roots(system, selection, bounded=bounded)
    reason = open_by_digits(file, roots.every) if roots.verdict is None else ""
    return reason.removeprefix(OPEN)


def thresholds_as_known(
    file: SystemFile, selection: EigenvalueSelection, answer: Thresholds
) -> Thresholds:
    """Thresholds that are not certified where something was assumed or the digits of files leave
    growth open at the lower end, where there is then no verdict."""
    reason = _open_at(file, selection, answer.low)
    doubts = list(file.assumptions)
    if reason:
        doubts.append(reason)
    if not doubts:
        return answer
    doubted = with_doubts(answer, doubts)
    return replace(doubted, verdict=None if reason else answer.verdict)


def with_doubts(answer: Thresholds, doubts: Sequence[str]) -> Thresholds:
    """Thresholds that some doubts keep from being certified or proved."""
    known_doubts = answer.details.get("doubts") or []
    proof = None
    proof_line = ""
    if answer.proof is not None:
        reason = "; ".join(doubts)
        proof = {**answer.proof, "status": "open", "growth_below": None, "reason": reason}
        proof_line = f"{OPEN}{reason}"
    return replace(
        answer,
        certified=False,
        details={**answer.details, "doubts": [*known_doubts, *doubts]},
        proof=proof,
        proof_line=proof_line,
    )


def sweep_as_known(file: SystemFile, selection: EigenvalueSelection, answer: Sweep) -> Sweep:
    """A sweep none of whose values is certified where something was assumed, and of a reduced
    system without a verdict where the digits of files leave growth open."""
    rows = []
    for step in answer.steps:
        certified = step.certified
        verdict = step.verdict
        if certified is None and _open_at(file, selection, step.value):
            verdict = None
        if file.assumptions and certified is not None:
            certified = False
        rows.append(replace(step, certified=certified, verdict=verdict))
    return replace(answer, steps=tuple(rows))
