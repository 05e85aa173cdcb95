"""The referee's proof that the modes of a band of a larger system are complete, on request."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from squeal.errors import InputError
from squeal.io.system import SystemFile
from squeal.linear import GROWING
from squeal.linear.eigen import values_of
from squeal.queries.systems.proofs import EigenvalueTuple, Statement, as_complex, with_proved_bounds
from squeal.queries.systems.roots import SystemRoots
from squeal.results.columns import OPEN
from squeal.results.sources import EigenvalueSelection

if TYPE_CHECKING:
    from squeal.proof.referee import Proof

ALLOWED = "above 400 rows the modes of a band of real matrices can be proved"


def with_band_proof(
    file: SystemFile, selection: EigenvalueSelection, roots: SystemRoots
) -> SystemRoots:
    """The computed modes of a band, judged by the referee.

    Before, the number of modes was counted by the argument principle. A list that is proved or
    refuted gets the referee's statement in place of that count. A list that is left open keeps the
    count, and a note says why nothing is proved. Its verdict, if it was growth, becomes open only
    if the referee proves of each mode listed as growing that it does not grow. Raises InputError
    for systems of which the referee proves nothing.
    """
    from squeal.proof.bands import prove_modes

    system = file.system
    if selection.band is None or not system.real or system.follows:
        raise InputError(f"prove: {ALLOWED}")
    if file.assembly is not None or file.assumptions:
        raise InputError(f"prove: components and guessed matrices have no proof; {ALLOWED}")
    low, high = (math.tau * hertz for hertz in selection.band)
    values = values_of(roots.computed)  # also those that --modes leaves out of the list
    # roots that grow or decay faster than the limit are not on the list. None: there is no limit
    growth_limit = math.inf if roots.growth_limit is None else roots.growth_limit
    proof = prove_modes(*system.at(), values, low, high, rate=growth_limit)
    if proof.status == "open":
        return _left_open(roots, proof)
    if proof.status == "refuted":
        reason = f"the referee disagrees: {proof.reason}"
        where = as_complex(proof.where)
        statement = Statement("open", proof.by, data=proof.data, reason=reason, where=where)
        return replace(roots, judged_by=statement)
    eigenvalues = _selected_with_bounds(roots, proof)
    statement = Statement("proved", proof.by, growth_below=proof.growth_below, data=proof.data)
    return replace(roots, eigenvalues=eigenvalues, judged_by=statement)


def _left_open(roots: SystemRoots, proof: Proof) -> SystemRoots:
    """The modes with a note why the referee leaves their list open.

    The verdict stays that of the count, with one exception: it becomes open where modes are listed
    as growing and the referee proves of each of them that it does not grow.
    """
    sides = set()  # what the referee proves of each mode listed as growing, see `Piece`
    bound = 0.0  # the greatest distance of such a mode from its root if its side is unknown, rad/s
    # each mode is matched with one piece; without enclosures there are no matches
    for root, (piece,) in zip(roots.computed, proof.matches, strict=False):
        if root.kind in GROWING:
            sides.add(piece.side)
            if piece.side == "unknown":
                bound = max(bound, piece.distance_bound(root.value))
    reason = proof.reason
    if bound:
        reason = f"the bound of this band ({bound:.3g} 1/s) exceeds the growth; "
        reason += "a narrower band may be proved"
    noted = replace(roots, notes=(*roots.notes, f"not proved: {reason}"))
    none_grows = sides.isdisjoint({"grows", "unknown"})
    if not sides or not none_grows:
        return noted
    decaying = _selected_with_bounds(roots, proof)
    return replace(noted, eigenvalues=decaying, verdict=None, criterion=f"{OPEN}{reason}")


def _selected_with_bounds(roots: SystemRoots, proof: Proof) -> EigenvalueTuple:
    """The selected roots with proved bounds; they come first among the computed ones, of which the
    proof holds the matches."""
    matches_of_selected = proof.matches[: len(roots.eigenvalues)]
    return with_proved_bounds(roots.eigenvalues, matches_of_selected)
