"""The report's LaTeX as text without marks: lines, formulas and tables."""

import re
from collections.abc import Sequence

# fmt: off
_SYMBOLS = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "theta": "θ", "mu": "μ", "pi": "π",
    "lambda": "λ", "pm": "±", "le": "≤", "ge": "≥", "times": "×", "cdot": "·", "infty": "∞",
    "cdots": "...", "dots": "...", "quad": " ", "checkmark": "yes", "sqrt": "√", "to": "→",
    "mathrm": "", "vec": "", "ldots": "...",
}
# fmt: on


_MACROS = {
    r"\\aeqsto\{([^}]*)\}\{([^}]*)\}": r"Eqs. (\1) to (\2)",
    r"\\aeqs\{([^}]*)\}\{([^}]*)\}": r"Eqs. (\1) and (\2)",
    r"\\aeq\{([^}]*)\}": r"Eq. (\1)",
    r"\\(?:says|label)\{[^}]*\}": "",
    r"\\val\{[^}]*\}": "...",
}
"""Macros of the preamble that are more than a mark, and the text that stands for them."""


def plain(tex: str) -> str:
    r"""TeX as text without marks; \val as dots."""
    text = tex
    for macro, replacement in _MACROS.items():
        text = re.sub(macro, replacement, text)
    text = re.sub(r"~?\\cite\w*\{[^}]*\}", "", text)
    text = re.sub(r"\$([^$]*)\$", lambda m: _formula(m[1]), text)
    text = text.replace("\\,", " ").replace("~", " ").replace("---", " - ").replace("--", "-")
    text = re.sub(r"\\(?:\w+(?={)|footnotesize\b|small\b)\s*", "", text)
    text = text.replace("\\textbar", "|").replace("``", '"').replace("''", '"')
    return re.sub(r"\\([%&#_$])", r"\1", text).replace("{", "").replace("}", "").strip()


def _formula(tex: str) -> str:
    """A formula as text: powers of ten as 1e3, symbols as letters."""
    text = re.sub(r"\s*\\times 10\^\{?(-?\d+)\}?", r"e\1", tex)
    text = re.sub(r"(?<![\d.])10\^\{(-?\d+)\}", r"1e\1", text)
    text = text.replace("\\,", " ").replace("\\{", "{").replace("^{\\mathsf T}", "'")
    return re.sub(r"\\([A-Za-z]+)(?: (?=[A-Za-z]))?", lambda m: _SYMBOLS.get(m[1], m[1]), text)


_RULE = re.compile(r"\\(?:top|mid|bottom)rule|\\end(?:firsthead|head|foot|lastfoot)\b")
_SPAN = re.compile(r"\\multicolumn\{(?P<columns>\d+)\}\{[^}]*\}\{(?P<text>.*)\}$", re.DOTALL)


def table_rows(tex: str) -> Sequence[list[str]]:
    """The rows of a generated table as text, its head first and once.

    A cell that spans several columns is followed by empty ones.
    """
    # without the end and the begin, whose columns may be in braces: \begin{tabular}{lr@{\,}l}
    inside = re.sub(r"\\begin\{tabular\}\{(?:[^{}]|\{[^{}]*\})*\}|\\end\{tabular\}", "", tex)
    rows: list[list[str]] = []
    for row in re.split(r"\\\\", _RULE.sub("", inside)):
        if not row.strip():
            continue
        cells: list[str] = []
        for cell in re.split(r"(?<!\\)&", row):
            span = _SPAN.match(cell.strip())
            if span is None:
                cells.append(plain(cell))
            else:
                cells.append(plain(span["text"]))
                cells += [""] * (int(span["columns"]) - 1)
        repeats_head = bool(rows) and cells == rows[0]
        if not repeats_head:
            rows.append(cells)
    return rows
