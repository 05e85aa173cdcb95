"""Result files as records: results/X.json is read and written by the class of module X.

Light on purpose: figures and tables that read a result do not depend on what computes it.
"""

from importlib import import_module
from importlib.util import find_spec

from squeal.article.results.records import Plain, Result


def record_of(study: str) -> type[Result]:
    """The class of a study's result: that of its name, `Plain` for a study without one."""
    module = f"{__name__}.{study}"
    if not find_spec(module):
        return Plain
    record: type[Result] = getattr(import_module(module), study.title().replace("_", ""))
    return record
