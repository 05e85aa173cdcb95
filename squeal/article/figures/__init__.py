"""The figures of the report: functions that take results and return a matplotlib Figure.

Each module has a function `draw` of the files that it reads; `python -m squeal.article.figures
MODULE FILE ... --out FILE` runs it. Figures draw the records of `squeal.article.studies` and
compute no result.
"""
