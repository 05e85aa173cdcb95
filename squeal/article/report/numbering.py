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
    found: dict[str, list[str]] = {"figure": [], "table": []}
    for macro, kind, name in _PLACED.findall(_COMMENT.sub("", text)):
        own_kind = kind or ("table" if macro == "tabled" else "figure")
        found[own_kind].append(name)
    return found


def own(names: Iterable[str]) -> list[str]:
    """The names that are not the article's."""
    return [name for name in names if not _ARTICLE.fullmatch(name)]


def check_order(text: str, file: str) -> None:
    """Refuse a text that cites own figures or tables in another order than they stand in.

    Raises InputError naming the file and the two orders, or what is not cited.
    """
    cited = list(dict.fromkeys(_CITED.findall(_COMMENT.sub("", text))))
    for kind, names in placed(text).items():
        standing = own(names)
        order = [name for name in cited if name in standing]
        missing = [name for name in standing if name not in order]
        if missing:
            raise InputError(f"{file}: {kind} {', '.join(missing)}: is nowhere cited")
        if order != standing:
            raise InputError(
                f"{file}: {kind}s stand in the order {', '.join(standing)} and are first cited in "
                f"the order {', '.join(order)}; these orders must be the same"
            )


def numbers(texts: Mapping[str, str]) -> dict[str, str]:
    """The number of each figure and table by name; texts by the name of the file.

    Raises InputError where a text names one by \\numberof that stands nowhere.
    """
    found: dict[str, str] = {}
    for file, text in texts.items():
        for names in placed(text).values():
            for name in names:
                if (article := _ARTICLE.fullmatch(name)) is not None:
                    found[name] = article[1]
            for count, name in enumerate(own(names), start=1):
                found[name] = f"{PREFIXES[file]}{count}"
    for file, text in texts.items():
        for name in _NUMBERED.findall(_COMMENT.sub("", text)):
            if name not in found:
                raise InputError(f"{file}: \\numberof{{{name}}}: no such figure or table is placed")
    return found
