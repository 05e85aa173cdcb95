"""LaTeX text: escaping, symbols, numbers and tables."""

import math
import re
from collections.abc import Callable, Sequence

# fmt: off
_SYMBOLS = {
    "theta0": r"\theta_0", "theta": r"\theta", "delta": r"\delta", "alpha1": r"\alpha_1",
    "alpha2": r"\alpha_2", "mu": r"\mu", "Rn": "R_n", "F3": "F_{s,3}",
    "F4": "F_{s,4}", "K11": "K_{11}", "K21": "K_{21}", "K31": "K_{31}", "K33": "K_{33}",
    "y0": "y_0", "x0": "x_0", "pi": r"\pi", "x_dot": r"\dot x",
    "y_dot": r"\dot y", "k1": "k_1", "k2": "k_2", "k3": "k_3", "k4": "k_4", "L1": "L_1",
    "L2": "L_2", "L3": "L_3", "L4": "L_4",
}
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
        """LaTeX of a token, by the name of the group in `_TOKEN` that it matches."""
        word = match.group()
        kind = match.lastgroup
        if kind == "id":  # of a claim, such as B2-c
            return escape(word)
        if kind == "number":  # with a power of ten, such as 1.2e-05
            return f"${number_text(word)}$"
        if kind == "signed":  # such as +0.3
            return f"${word}$"
        if kind == "percent":
            return r"\,\%"
        if kind == "times":
            return r" $\times$ "
        if kind == "mark":  # one that LaTeX would read as a command
            return _MARKS[word]
        # a word
        if word in _SYMBOLS or word in _LETTERS:
            return f"${_SYMBOLS.get(word, word)}$"
        base, _, index = word.partition("_")
        if len(index) == 1 and (len(base) == 1 or base in _SYMBOLS):  # such as F_n and theta_0
            return f"${_SYMBOLS.get(base, base)}_{index}$"
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


ALL = 1.0 - 1e-9  # what is nearer to one is one but for rounding


def percent(share: float, digits: int = 1) -> str:
    """A share as a percentage with its sign; more digits where less than all would read 100 %."""
    text = f"{100 * share:.{digits}f}"
    if share < ALL and float(text) >= 100.0:
        return percent(share, digits + 1)
    return rf"{text}\,\%"


PERCENT = r"\,\%"


def with_spread(
    value: float, ends: tuple[float, float] | None, show: Callable[[float], str]
) -> str:
    """A number, behind it in brackets the ends (least, greatest) of its spread where these are
    shown otherwise."""
    text = show(value)
    if ends is None:
        return text
    low, high = map(show, ends)
    if low == high == text:
        return text
    unit = PERCENT if text.endswith(PERCENT) else ""
    spread = f"{low.removesuffix(unit)}--{high.removesuffix(unit)}"
    return f"{text.removesuffix(unit)} ({spread}){unit}"


def tabular(columns: str, head: Sequence[str], groups: Sequence[Sequence[Sequence[str]]]) -> str:
    """A booktabs table; a thin rule separates the groups of rows."""
    lines = [rf"\begin{{tabular}}{{{columns}}}", r"\toprule", " & ".join(head) + r" \\"]
    for group in groups:
        if group:
            lines.append(r"\midrule")
            lines += [" & ".join(row) + r" \\" for row in group]
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def long_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The inside of a longtable, to follow its caption: head on every page, then the rows.

    The first three rows stand on one page, and so do the last two.
    """
    line = "\\toprule\n" + " & ".join(head) + " \\\\\n\\midrule\n"
    ends = [r" \\"] * len(rows)
    for row_kept_with_next in (0, 1, -2):
        if -len(rows) <= row_kept_with_next < len(rows):
            ends[row_kept_with_next] = r" \\*"
    body = "\n".join(" & ".join(row) + end for row, end in zip(rows, ends, strict=True))
    return f"{line}\\endfirsthead\n{line}\\endhead\n\\bottomrule\n\\endfoot\n{body}\n"
