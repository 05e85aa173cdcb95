"""The referee: judges a printed answer by means that share nothing with the solvers.

It says `proved`, `open` or `refuted`. `docs/proof.md` derives the bounds.
"""

AS_GIVEN = "as given"
"""The entries of matrices are taken for exact."""
HALF_ULP = "half an ulp"
"""The entries of matrices may be off by half a unit in the last place of a double: what is assumed
of arrays, and of files with all digits."""
