"""Which script draws or writes each figure and table, from which results, by which command."""

import inspect
from importlib import import_module

from squeal.article.contents import FIGURES, TABLES, report_file, result_file
from squeal.article.report.latex import escape, long_table

CAPTION = r"""What makes each figure and table: its script, the results that it shows, and the
command that makes it anew with all that it needs. Scripts are in \texttt{squeal/article}, but that
of the run times is in \texttt{benchmarks}. The result NAME is \texttt{results/NAME.json}, which
\texttt{studies/NAME.py} computes; those of a motion (b1-a) come from \texttt{squeal simulate}."""


def _row(kind: str, name: str, script: str, results: list[str], target: str) -> list[str]:
    shown = ", ".join(dict.fromkeys(results)) or "the code"
    number = rf"{kind}~\numberof{{{name}}}"
    return [number, rf"\texttt{{{escape(script)}}}", escape(shown), rf"\texttt{{{escape(target)}}}"]


def _stem(file: str) -> str:
    return file.rpartition("/")[2].partition(".")[0]


def table() -> str:
    """The table in LaTeX, a row per figure, then a row per table but for this one."""
    this_table = __name__.rpartition(".")[2]
    rows = []
    for name, figure in FIGURES.items():
        results = [_stem(file) for file in figure.reads]
        # run times are measured and drawn by `benchmarks/precision.py`
        script = "precision.py" if figure.measured else f"figures/{figure.module}.py"
        rows.append(_row("Fig.", name, script, results, f"snakemake {report_file(name)}"))
    for name in TABLES:
        if name == this_table:
            continue
        module = import_module(f"squeal.article.report.tables.{name}")
        # the parameters of `table` have the names of the results that it reads
        results = list(inspect.signature(module.table).parameters)
        needed = " ".join(map(result_file, results))
        target = f"snakemake {needed}" if needed else "make report"
        rows.append(_row("Table", name, f"report/tables/{name}.py", results, target))
    return long_table(["", "script", "results", "command"], rows)
