"""The referee: judges a printed answer by means that share nothing with the solvers.

It says `proved`, `open` or `refuted`. `docs/proof.md` derives the bounds.
"""
