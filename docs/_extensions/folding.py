"""Commands and their outputs folded to what a page shows at once."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from itertools import groupby

WIDTH = 88  # columns that a page shows at once
IN_TABLE = "  "  # how each line of a table begins
OMITTED = "  ... "  # how the line that stands for others begins


def folded_command(command: str) -> str:
    """A command as somebody would type it, no line longer than `WIDTH`."""
    with_values = re.sub(r"(--[\w-]+) (?!-)", "\\1\0", f"$ {command}")  # which stay together
    lines = textwrap.wrap(with_values, WIDTH - 6, break_long_words=False, break_on_hyphens=False)
    return " \\\n    ".join(lines).replace("\0", " ")


def folded_output(text: str) -> str:
    """An output with its lines folded, of tables their columns."""
    lines: list[str] = []
    for in_table, group in groupby(text.split("\n"), lambda line: line.startswith(IN_TABLE)):
        block = list(group)
        if in_table and max(map(len, block)) > WIDTH:
            block = folded_table(block)
        for line in block:
            indent = " " * (len(line) - len(line.lstrip()) + 4)
            lines += textwrap.wrap(line, WIDTH, subsequent_indent=indent) or [""]
    return "\n".join(lines)


def folded_table(lines: Sequence[str]) -> list[str]:
    """Lines of a table as groups of its columns, each after the first column."""
    width = max(map(len, lines))
    rows = [line.ljust(width) for line in lines if not line.startswith(OMITTED)]
    filled = "".join("x" if any(row[k] != " " for row in rows) else " " for k in range(width))
    columns = [match.span() for match in re.finditer(r"x+(?: x+)*", filled)]
    starts = [0, *(end for _, end in columns[:-1])]
    cells = [slice(start, end) for start, (_, end) in zip(starts, columns, strict=True)]
    folded: list[str] = []
    shown = cells[:1]

    def show() -> None:
        for line in lines:
            if line.startswith(OMITTED):
                folded.append(line)
            else:
                folded.append("".join(line.ljust(width)[cell] for cell in shown).rstrip())

    for cell in cells[1:]:
        used = sum(each.stop - each.start for each in (*shown, cell))
        if used > WIDTH and len(shown) > 1:
            show()
            folded.append("")
            shown = cells[:1]
        shown.append(cell)
    show()
    return folded
