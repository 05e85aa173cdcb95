"""Captions of the report's figures and tables, read from its LaTeX text for use elsewhere."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from squeal.article.report.chapters import CHAPTERS
from squeal.article.report.plain import plain

Kind = Literal["figure", "table"]
_SPECIAL = {"setval", "rows", "figurefile"}  # macros that are no text
_FLOAT = re.compile(r"\\begin\{(figure|table|minipage|longtable)\}.*?\\end\{\1\}", re.DOTALL)
_SHOWN = re.compile(r"\\(?:figurefile|rows)\{([\w-]+)\}|\\input\{generated/([\w-]+)\}")
_LABEL = re.compile(r"\\label\{([\w:-]+)\}")
_RESULT = re.compile(r"(?:,? both)?(?: for| at| of| on|,)(?:(?![,:;]| for\b).)*\\val")


@dataclass(frozen=True)
class Caption:
    """What stands under a figure or over a table: its number in the report, and its text in TeX.

    name: of the figure's or the table's file; label: by which the text refers to it.
    """

    name: str
    kind: Kind
    number: int
    label: str
    chapter: str
    tex: str

    @property
    def title(self) -> str:
        """The first sentence, up to the phrase with the first result in it."""
        first = re.split(r"(?<=[\w)$}])\.(?=\s|$)", self.tex, maxsplit=1)[0]
        if (cut := _RESULT.search(first)) is not None:
            first = re.sub(r":? *\(a\)[^(]*$", "", first[: cut.start()])
        return plain(first) + "."

    @property
    def place(self) -> str:
        """As the report refers to it: Fig. 4, Table 1."""
        return f"{'Fig.' if self.kind == 'figure' else 'Table'} {self.number}"


def _argument(text: str, start: int) -> tuple[str, int]:
    """What stands between the brace at `start` and its partner, and where the text goes on."""
    depth = 0
    for i in range(start, len(text)):
        depth += (text[i] == "{") - (text[i] == "}")
        if depth == 0 and text[i] == "}":
            return text[start + 1 : i], i + 1
    raise ValueError(f"unbalanced braces: {text[start : start + 40]!r}")


def _macros(preamble: str) -> dict[str, tuple[int, str]]:
    found = {}
    for match in re.finditer(r"\\newcommand\{\\(\w+)\}\[(\d)\](?=\{)", preamble):
        if match[1] not in _SPECIAL:
            found[match[1]] = int(match[2]), _argument(preamble, match.end())[0]
    return found


def _expanded(text: str, macros: Mapping[str, tuple[int, str]]) -> str:
    pattern = re.compile(rf"\\({'|'.join(macros)})(?=\{{)")
    while match := pattern.search(text):
        count, body = macros[match[1]]
        end = match.end()
        for i in range(count):
            argument, end = _argument(text, end)
            body = body.replace(f"#{i + 1}", argument)
        text = text[: match.start()] + body + text[end:]
    return text


def captions(paper: Path) -> dict[str, Caption]:
    """All captions by the name of their file, in the report's order, from the folder paper/."""
    macros = _macros((paper / "report.tex").read_text(encoding="utf-8"))
    found: dict[str, Caption] = {}
    number: dict[str, str] = {}
    count: dict[Kind, int] = {"figure": 0, "table": 0}
    for chapter in CHAPTERS:
        raw = (paper / f"{chapter.name}.tex").read_text(encoding="utf-8")
        text = _expanded(re.sub(r"(?<!\\)%.*", "", raw), macros)
        for block in (match[0] for match in _FLOAT.finditer(text)):
            start = re.search(r"\\caption(?:of\{table\})?(?=\{)", block)
            shown, label = _SHOWN.search(block), _LABEL.search(block)
            if start is None or label is None:
                continue
            kind: Kind = "figure" if "\\figurefile" in block else "table"
            count[kind] += 1
            number[label[1]] = str(count[kind])
            if shown is None:  # a table whose rows stand in the text
                continue
            tex = " ".join(_argument(block, start.end())[0].split())
            name = shown[1] or shown[2]
            found[name] = Caption(name, kind, count[kind], label[1], chapter.name, tex)
    for name, one in found.items():
        tex = re.sub(r"\\ref\{([^}]*)\}", lambda m: number.get(m[1], "..."), one.tex)
        found[name] = replace(one, tex=tex)
    return found


def sections(paper: Path, chapter: str) -> list[str]:
    """Titles of a chapter's sections."""
    text = (paper / f"{chapter}.tex").read_text(encoding="utf-8")
    return [plain(title) for title in re.findall(r"\\section\{([^}]*)\}", text)]


def values(generated: Path) -> dict[str, str]:
    r"""What \val{key} stands for, from the files of a build; empty before the first."""
    found: dict[str, str] = {}
    for file in sorted(generated.glob("*-values.tex")):
        text = file.read_text(encoding="utf-8")
        found |= dict(re.findall(r"^\\setval\{(.*?)\}\{(.*)\}$", text, re.MULTILINE))
    return found
