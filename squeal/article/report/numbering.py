r"""Numbers of figures and tables: the article's keep theirs, ours are counted as they are placed.

A text places a figure by \drawn{name} or \wide{name}, a table by \tabled{name}, and what has no
macro of its own by \numbered{figure}{name} or \numbered{table}{name}. Ours are R1, R2 ... in the
report and S1, S2 ... in the supplement, and must be cited in the order in which they stand.
"""

import re
from collections.abc import Iterable, Mapping

from squeal.errors import InputError

PREFIXES = {"report.tex": "R", "supplement.tex": "S"}
_PLACED = re.compile(r"\\(?:(drawn|wide|tabled)|numbered\{(figure|table)\})\{([\w-]+)\}")
_CITED = re.compile(r"\\ref\{([\w-]+)\}")
_NUMBERED = re.compile(r"\\numberof\{([\w-]+)\}")
_ARTICLE = re.compile(r"(?:fig|table)0*(\d+)")
_COMMENT = re.compile(r"(?<!\\)%.*")


def placed(text: str) -> dict[str, list[str]]:
    """Names of the figures and of the tables of a text in the order in which they stand."""
    names: dict[str, list[str]] = {"figure": [], "table": []}
    for macro, kind, name in _PLACED.findall(_COMMENT.sub("", text)):
        kind_of_macro = "table" if macro == "tabled" else "figure"
        names[kind or kind_of_macro].append(name)
    return names


def not_of_article(names: Iterable[str]) -> list[str]:
    """The names of figures and tables that the article does not have, such as coexistence."""
    return [name for name in names if not _ARTICLE.fullmatch(name)]


def check_order(text: str, file: str) -> None:
    """Refuse a text that cites figures or tables, but the article's, in another order than theirs.

    Raises InputError naming the file and the two orders, or what is not cited.
    """
    # names in the order in which they are first cited
    cited = list(dict.fromkeys(_CITED.findall(_COMMENT.sub("", text))))
    for kind, names in placed(text).items():  # "figure" and "table"
        as_placed = not_of_article(names)
        as_cited = [name for name in cited if name in as_placed]
        missing = [name for name in as_placed if name not in as_cited]
        if missing:
            raise InputError(f"{file}: {kind} {', '.join(missing)}: is nowhere cited")
        if as_cited != as_placed:
            raise InputError(
                f"{file}: {kind}s stand in the order {', '.join(as_placed)} and are first cited in "
                f"the order {', '.join(as_cited)}; these orders must be the same"
            )


def numbers(texts: Mapping[str, str]) -> dict[str, str]:
    """The number of each figure and table by name; texts by the name of the file.

    Raises InputError where a text names one by \\numberof that stands nowhere.
    """
    number_of: dict[str, str] = {}
    for file, text in texts.items():
        for names in placed(text).values():  # of figures, then of tables
            for name in names:
                if (article := _ARTICLE.fullmatch(name)) is not None:
                    number_of[name] = article[1]  # fig04 keeps the 4
            for count, name in enumerate(not_of_article(names), start=1):
                number_of[name] = f"{PREFIXES[file]}{count}"  # R1, or S1 in the supplement
    for file, text in texts.items():
        for name in _NUMBERED.findall(_COMMENT.sub("", text)):
            if name not in number_of:
                raise InputError(f"{file}: \\numberof{{{name}}}: no such figure or table is placed")
    return number_of
