"""The referee: judges a printed answer by means that share nothing with the solvers.

It says `proved`, `open` or `refuted`. `docs/proof.md` derives the bounds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from squeal.proof.balls import AS_GIVEN, HALF_ULP, Balls, Quadratic
from squeal.proof.pieces import Piece
from squeal.proof.referee import Count, Proof, RootList, judge, prove_roots, unstable_count

if TYPE_CHECKING:
    from squeal.proof.large import BandProof, prove_band
    from squeal.proof.ranges import Term, Terms, prove_thresholds

__all__ = [
    "AS_GIVEN",
    "HALF_ULP",
    "Balls",
    "BandProof",
    "Count",
    "Piece",
    "Proof",
    "Quadratic",
    "RootList",
    "Term",
    "Terms",
    "judge",
    "prove_band",
    "prove_roots",
    "prove_thresholds",
    "unstable_count",
]


def __getattr__(name: str) -> Any:
    """What needs sparse solvers or python-flint is loaded when it is first asked for."""
    if name in ("BandProof", "prove_band"):
        from squeal.proof import large

        return getattr(large, name)
    if name in ("Term", "Terms", "prove_thresholds"):
        from squeal.proof import ranges

        return getattr(ranges, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
