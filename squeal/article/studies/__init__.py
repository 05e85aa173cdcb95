"""One file a result: module X holds the record of results/X.json and `study`, which computes it.

`python -m squeal.article.studies X FILE ... > results/X.json` runs it; which files it reads says
the table of `squeal.article.contents`.
"""
