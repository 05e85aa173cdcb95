"""One file a result: module X holds the record of results/X.json and `study`, which computes it.

`python -m squeal.article.studies X FILE ... > results/X.json` runs it; which files it reads says
the table of `squeal.article.contents`.
"""

from importlib import import_module

from squeal.article.records import Result


def record_of(study: str) -> type[Result]:
    """The class of a study's result: that of its name in its module."""
    module = import_module(f"{__name__}.{study}")
    record: type[Result] = getattr(module, study.title().replace("_", ""))
    return record
