"""The referee: judges a printed answer by means that share nothing with the solvers.

It says `proved`, `open` or `refuted`. `docs/proof.md` derives the bounds.
"""

from squeal.proof.balls import AS_GIVEN, HALF_ULP, Balls, Quadratic
from squeal.proof.large import BandProof, prove_band
from squeal.proof.pieces import Piece
from squeal.proof.ranges import Term, Terms, prove_gap, prove_thresholds
from squeal.proof.referee import Count, Proof, RootList, judge, prove_roots, unstable_count

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
    "prove_gap",
    "prove_roots",
    "prove_thresholds",
    "unstable_count",
]
