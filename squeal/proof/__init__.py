"""The referee: judges a printed answer by means that share nothing with the solvers.

It says `proved`, `open` or `refuted`. `docs/proof.md` derives the bounds. Names are
loaded when they are first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from squeal.proof.balls import AS_GIVEN, HALF_ULP, Balls, Quadratic
    from squeal.proof.large import BandProof, prove_band
    from squeal.proof.pieces import Piece
    from squeal.proof.ranges import Term, Terms, prove_gap, prove_thresholds
    from squeal.proof.referee import Count, Proof, RootList, judge, prove_roots, unstable_count

_HOMES = {
    "balls": "AS_GIVEN HALF_ULP Balls Quadratic",
    "large": "BandProof prove_band",
    "pieces": "Piece",
    "ranges": "Term Terms prove_gap prove_thresholds",
    "referee": "Count Proof RootList judge prove_roots unstable_count",
}
_HOME = {name: home for home, names in _HOMES.items() for name in names.split()}

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


def __getattr__(name: str) -> Any:
    """A name, loaded when it is first used: pads need no SciPy."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
