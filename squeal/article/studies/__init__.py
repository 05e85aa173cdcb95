"""One file a result: the function `study` of module X computes what results/X.json holds.

`python -m squeal.article.studies X FILE ... > results/X.json` runs it; which files it reads says
the table of `squeal.article.report.chapters`.
"""
