"""The report's LaTeX as text without marks: lines, formulas and tables."""

import re
from collections.abc import Mapping, Sequence

_SYMBOLS = {
    **{"alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ"},
    **{"theta": "θ", "mu": "μ", "pi": "π", "lambda": "λ", "pm": "±", "le": "≤", "ge": "≥"},
    **{"times": "×", "cdot": "·", "infty": "∞", "cdots": "...", "dots": "...", "quad": " "},
    **{"checkmark": "yes", "sqrt": "√", "to": "→", "mathrm": "", "vec": "", "ldots": "..."},
}


_PLACES = {
    r"\\aeqsto\{([^}]*)\}\{([^}]*)\}": r"Eqs. (\1) to (\2)",
    r"\\aeqs\{([^}]*)\}\{([^}]*)\}": r"Eqs. (\1) and (\2)",
    r"\\aeq\{([^}]*)\}": r"Eq. (\1)",
    r"\\(?:says|label)\{[^}]*\}": "",
}
"""Macros of the preamble that are more than a mark."""


def plain(tex: str, values: Mapping[str, str] | None = None) -> str:
    r"""TeX as text without marks; \val by what is given, else as dots."""
    known = values or {}
    for macro, text in _PLACES.items():
        tex = re.sub(macro, text, tex)
    tex = re.sub(r"\\val\{([^}]*)\}", lambda m: known.get(m[1], "..."), tex)
    tex = re.sub(r"~?\\cite\w*\{[^}]*\}", "", tex)
    tex = re.sub(r"\$([^$]*)\$", lambda m: _formula(m[1]), tex)
    tex = tex.replace("\\,", " ").replace("~", " ").replace("---", " - ").replace("--", "-")
    tex = re.sub(r"\\(?:\w+(?={)|footnotesize\b|small\b)\s*", "", tex)
    tex = tex.replace("\\textbar", "|").replace("``", '"').replace("''", '"')
    return re.sub(r"\\([%&#_$])", r"\1", tex).replace("{", "").replace("}", "").strip()


def _formula(tex: str) -> str:
    tex = re.sub(r"\s*\\times 10\^\{?(-?\d+)\}?", r"e\1", tex)
    tex = re.sub(r"(?<![\d.])10\^\{(-?\d+)\}", r"1e\1", tex)
    tex = tex.replace("\\,", " ").replace("\\{", "{").replace("^{\\mathsf T}", "'")
    return re.sub(r"\\([A-Za-z]+)(?: (?=[A-Za-z]))?", lambda m: _SYMBOLS.get(m[1], m[1]), tex)


_RULE = re.compile(r"\\(?:top|mid|bottom)rule|\\end(?:firsthead|head|foot|lastfoot)\b")
_SPAN = re.compile(r"\\multicolumn\{(\d+)\}\{[^}]*\}\{(.*)\}$", re.DOTALL)


def table_rows(tex: str) -> Sequence[list[str]]:
    """The rows of a generated table as text, its head first and once."""
    inside = re.sub(r"\\begin\{tabular\}\{(?:[^{}]|\{[^{}]*\})*\}|\\end\{tabular\}", "", tex)
    rows: list[list[str]] = []
    for row in re.split(r"\\\\", _RULE.sub("", inside)):
        if not row.strip():
            continue
        cells: list[str] = []
        for cell in re.split(r"(?<!\\)&", row):
            span = _SPAN.match(cell.strip())
            cells += [plain(span[2]), *[""] * (int(span[1]) - 1)] if span else [plain(cell)]
        if not (rows and cells == rows[0]):
            rows.append(cells)
    return rows
