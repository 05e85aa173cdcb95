"""The figures of the report: functions that take results and return a matplotlib Figure.

Each module has a function `draw` of the files that it reads; `python -m squeal.article.figures
MODULE FILE ... --out FILE` runs it. Figures depend on the records of `squeal.article.results` and
on style, never on what computes a result.
"""
