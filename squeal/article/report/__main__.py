r"""`python -m squeal.article.report RESULT ... --out FOLDER`: what the texts of the paper read.

values.tex: each \val that a text asks for; NAME.tex: each table of `report.tables`; captions.tex:
each caption of a figure or table, and its number. Where the study of a result says that a sentence
does not hold, nothing is written and the sentence is named.
"""

import argparse
import inspect
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from squeal.article.report import values
from squeal.article.report.captions import captions, modules
from squeal.article.report.numbering import check_order, numbers
from squeal.article.report.source import where
from squeal.article.studies._spread import at_ends
from squeal.cli.streams import exit_code
from squeal.errors import ComputationError, InputError
from squeal.io.writing import write_text

SAYS = re.compile(r"\\says\{([^{}]+)\}")  # the name of a sentence that a study checks
TEXTS = ("report.tex", "supplement.tex")


def records(files: Mapping[str, Path]) -> Iterator[tuple[Any, Any]]:
    """The modules of the studies whose `sentences` the paper states, and their results."""
    for name, file in files.items():
        path = Path(__file__).parent.parent / "studies" / f"{name}.py"
        if path.exists():
            module = import_module(f"squeal.article.studies.{name}")
            if hasattr(module, "sentences"):
                kind = inspect.signature(module.study, eval_str=True).return_annotation
                yield module, kind.read(file)


def checked(files: Mapping[str, Path]) -> dict[str, bool]:
    """The sentences that the studies check, by name, each at both ends of what has a spread.

    Raises ComputationError if one is wrong.
    """
    checks: dict[str, bool] = {}
    for module, record in records(files):
        for variant in at_ends(record):
            for name, holds in module.sentences(variant).items():
                checks[name] = holds and checks.get(name, True)  # a sentence must hold in all
    wrong = [name for name, holds in checks.items() if not holds]
    if wrong:
        raise ComputationError(
            f"sentences of the paper that no longer hold: {', '.join(wrong)}; each stands in "
            r"paper/*.tex as \says{name} and must be rewritten"
        )
    return checks


def table(module: Any, files: Mapping[str, Path]) -> str:
    """A table from the results that its parameters name."""
    parameters = inspect.signature(module.table, eval_str=True).parameters
    results = []
    for name, parameter in parameters.items():
        results.append(parameter.annotation.read(files[name]))
    return str(module.table(*results))


def written(files: Mapping[str, Path], texts: Mapping[str, str]) -> dict[str, str]:
    """The text of each generated file by its name without .tex.

    These are a file for each table, "captions" with the captions and numbers of figures and tables,
    and "values" with what the macros of values print. files: results by the name of their study;
    texts: of the paper, by the name of the file. Raises InputError where a text states a sentence
    that no study checks; a study that was left out on this machine checks none.
    """
    sentences = checked(files)
    legends = captions()  # by the name of the figure or table
    source = where(Path())
    results = values.read(files.values()) | {"where": source}
    # not if a study was left out on this machine, whose sentences are not checked then
    complete = not any(values.left_out(result) for result in results.values())
    for name, text in texts.items():
        check_order(text, name)
        for sentence in SAYS.findall(text):
            if complete and sentence not in sentences:
                raise InputError(f"{name}: \\says{{{sentence}}}: no study checks this sentence")
    made = {}
    for name, module in modules("squeal.article.report.tables").items():
        made[name] = table(module, files)
    lines = [f"\\setcaption{{{name}}}{{{text}}}\n" for name, text in legends.items()]
    lines += [f"\\setnumber{{{name}}}{{{number}}}\n" for name, number in numbers(texts).items()]
    made["captions"] = "".join(lines)
    # the preamble, which is not among the texts, prints all that `source` holds
    values_of_preamble = "".join(f"\\val{{where.{key}}}" for key in source)
    sources = {**texts, **legends, "preamble.tex": values_of_preamble}
    made["values"] = values.definitions(sources, results)
    return made


def main(given: Sequence[str] | None = None) -> int:
    """Write the generated files; 1 where a sentence does not hold, 2 for bad input."""
    parser = argparse.ArgumentParser(description="Write what the texts of the paper read.")
    parser.add_argument("results", nargs="+", type=Path, metavar="RESULT")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--texts", type=Path, default=Path("paper"), metavar="FOLDER")
    chosen = parser.parse_args(given)
    return exit_code("report", lambda: _run(chosen))


def _run(chosen: argparse.Namespace) -> int:
    """Write the files that the texts read."""
    texts = {name: (chosen.texts / name).read_text(encoding="utf-8") for name in TEXTS}
    made = written({file.stem: file for file in chosen.results}, texts)
    chosen.out.mkdir(parents=True, exist_ok=True)
    for name, text in made.items():
        write_text(chosen.out / f"{name}.tex", text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
