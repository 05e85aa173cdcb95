"""LaTeX text: escaping, symbols, numbers, tables, and values that the report refers to by key."""

import dataclasses
import math
import re
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

from squeal.article.records import rounded_up

T = TypeVar("T")

# fmt: off
_SYMBOLS = {
    "theta0": r"\theta_0", "theta": r"\theta", "delta": r"\delta", "alpha1": r"\alpha_1",
    "alpha2": r"\alpha_2", "mu": r"\mu", "F_n": "F_n", "Rn": "R_n", "F3": "F_{s,3}",
    "F4": "F_{s,4}", "K11": "K_{11}", "K21": "K_{21}", "K31": "K_{31}", "K33": "K_{33}",
    "k_c": "k_c", "y0": "y_0", "x0": "x_0", "pi": r"\pi", "T_1": "T_1", "x_dot": r"\dot x",
    "y_dot": r"\dot y",
} | {f"{s}{i}": f"{s}_{i}" for s in "kL" for i in "1234"}
# fmt: on
_LETTERS = {"w", "h", "m", "I", "V", "K"}  # single letters that are always symbols
# fmt: off
_MARKS = {
    "%": r"\%", "&": r"\&", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}", "$": r"\$",
    "^": r"\^{}", "~": r"\~{}", "\\": r"\textbackslash{}", "<": "$<$", ">": "$>$",
    "|": r"\textbar{}",
}
# fmt: on
_TOKEN = re.compile(
    r"(?P<id>B[123]-[\w-]+)"
    r"|(?P<number>(?<![\w.])[-+]?\d+(?:\.\d+)?e[-+]?\d+)"
    r"|(?P<signed>(?<![\w.)])[-+]\d+(?:\.\d+)?)"
    r"|(?P<word>[A-Za-z_]+\d*)"
    r"|(?P<percent>(?<=\d) %)"
    r"|(?P<times>(?<=\d) x (?=\d))"
    r"|(?P<mark>[%&#_{}$^~\\<>|])"
)


def escape(text: str) -> str:
    """Plain text with LaTeX's special characters made literal."""
    return "".join(_MARKS.get(letter, letter) for letter in text)


def typeset(text: str) -> str:
    """Plain text as results hold it ("delta/w = +0.3, 1.2e-05") with symbols and numbers set."""

    def token(match: re.Match[str]) -> str:
        word = match.group()
        if match.lastgroup == "id":  # of a claim
            return escape(word)
        if match.lastgroup == "number":
            return f"${number_text(word)}$"
        if match.lastgroup == "signed":
            return f"${word}$"
        if match.lastgroup == "percent":
            return r"\,\%"
        if match.lastgroup == "times":
            return r" $\times$ "
        if match.lastgroup == "mark":
            return _MARKS[word]
        if word in _SYMBOLS or word in _LETTERS:
            return f"${_SYMBOLS.get(word, word)}$"
        return escape(word)

    return _TOKEN.sub(token, text)


def number_text(text: str) -> str:
    """A printed float such as 1.2e-05 in math: 1.2 \\times 10^{-5}."""
    if "e" not in text:
        return text
    digits, exponent = text.split("e")
    return rf"{digits} \times 10^{{{int(exponent)}}}"


def number(value: float | None, digits: int = 4) -> str:
    """A number in math mode with so many significant digits; a dash for None and NaN."""
    if value is None or math.isnan(value):
        return "--"
    return f"${number_text(f'{value:.{digits}g}')}$"


def at_most(value: float, digits: int = 2) -> str:
    """An upper bound with so many significant digits: rounded up, so that it is one as printed."""
    return number(rounded_up(value, digits), digits)


def at_least(value: float, digits: int = 2) -> str:
    """A lower bound with so many significant digits: rounded down."""
    return number(-rounded_up(-value, digits), digits)


def power(value: float) -> str:
    """A power of ten in math mode, of the nearest whole exponent."""
    return f"$10^{{{round(math.log10(value))}}}$"


ALL = 1.0 - 1e-9  # what is nearer to one is one but for rounding


def percent(share: float, digits: int = 1) -> str:
    """A share as a percentage with its sign; more digits where less than all would read 100 %."""
    text = f"{100 * share:.{digits}f}"
    if share < ALL and float(text) >= 100.0:
        return percent(share, digits + 1)
    return rf"{text}\,\%"


def plain_values(key: str, value: Any, kind: Any = None) -> dict[str, str]:
    """The numbers and words of a result by dotted name, those of records and mappings in it too.

    Numbers have four digits; Annotated[float, ".1%"] asks for a percentage, ".2g" for other digits
    and "power" for a power of ten. Lists are left to tables, lengths of them to the text's module.
    """
    inner: dict[str, tuple[Any, Any]] = {}
    if dataclasses.is_dataclass(value):
        hints = typing.get_type_hints(type(value), include_extras=True)
        names = [f.name for f in dataclasses.fields(value) if f.name != "provenance"]
        inner = {name: (getattr(value, name), hints[name]) for name in names}
    elif isinstance(value, Mapping):
        each = typing.get_args(kind)[1]
        inner = {name.replace(" ", "-"): (entry, each) for name, entry in value.items()}
    elif isinstance(value, float):
        form = getattr(kind, "__metadata__", [".4g"])[0]
        if form == "power":
            return {key: power(value)}
        if form.endswith("%"):
            return {key: percent(value, int(form[1:-1]))}
        return {key: number(value, int(form[1:-1]))}
    elif isinstance(value, (int, str)):
        return {key: typeset(str(value))}
    texts: dict[str, str] = {}
    for name, (entry, hint) in inner.items():
        texts |= plain_values(f"{key}.{name}", entry, hint)
    return texts


def counted(n: int, noun: str) -> str:
    """A number of things with the word for them: no change, one change, 14 changes."""
    return f"{({0: 'no', 1: 'one'}).get(n, n)} {noun}{'' if n < 2 else 's'}"


def in_words(names: Sequence[str]) -> str:
    """Names in a sentence: a, b and c."""
    return " and ".join([", ".join(names[:-1]), names[-1]]) if names[1:] else "".join(names)


def tabular(columns: str, head: Sequence[str], groups: Sequence[Sequence[Sequence[str]]]) -> str:
    """A booktabs table; a thin rule separates the groups of rows."""
    blocks = ["\n".join(" & ".join(row) + r" \\" for row in group) for group in groups if group]
    lines = [
        rf"\begin{{tabular}}{{{columns}}}",
        r"\toprule",
        " & ".join(head) + r" \\",
        r"\midrule",
    ]
    return "\n".join([*lines, "\n\\midrule\n".join(blocks), r"\bottomrule", r"\end{tabular}", ""])


def long_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The inside of a longtable, to follow its caption: head on every page, then the rows.

    The last row does not stand alone on a page.
    """
    line = "\\toprule\n" + " & ".join(head) + " \\\\\n\\midrule\n"
    ends = [*[r" \\"] * (len(rows) - 2), r" \\*", r" \\"][-len(rows) :]
    body = "\n".join(" & ".join(row) + end for row, end in zip(rows, ends, strict=True))
    return f"{line}\\endfirsthead\n{line}\\endhead\n\\bottomrule\n\\endfoot\n{body}\n"


def cells(
    columns: Mapping[str, Callable[[T], str]], entries: Iterable[T]
) -> tuple[list[str], list[list[str]]]:
    """Head and rows of a table: for each column what it shows of an entry."""
    return list(columns), [[show(entry) for show in columns.values()] for entry in entries]


def once(rows: Sequence[list[str]]) -> list[list[str]]:
    """The same rows without a first cell that repeats that of the row before."""
    before = ["", *(row[0] for row in rows)]
    return [["" if row[0] == b else row[0], *row[1:]] for b, row in zip(before, rows, strict=False)]


Generated = tuple[dict[str, str], dict[str, str]]
"""What a chapter's module gives: texts of values by key, and of tables by the file's name."""


def definitions(values: Mapping[str, str]) -> str:
    r"""Lines that make \val{key} stand for a text; an unknown key is an error in the report."""
    return "".join(f"\\setval{{{key}}}{{{text}}}\n" for key, text in sorted(values.items()))
