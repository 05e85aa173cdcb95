"""```{run}: commands with what they print when the site is built.

The content is one command a line. Those of a page run one after the other in a folder that is empty
when the page begins, with the wheel alone, as `workflow.trials.pages` runs them: `squeal example
NAME` writes the files that a page starts from.
`:head: N` shows the first N lines of each output, 0 the commands alone; `:code: N` is the exit code
that is expected. What is wider than `WIDTH` columns is folded, tables between their columns.
"""

from __future__ import annotations

import re
import shutil
import tempfile
import textwrap
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from workflow.trials.pages import Step, environment, install, run_step

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


def prepare(app: Sphinx) -> None:
    """Empty the folder of the pages' folders, and install the wheel."""
    folder = Path(app.srcdir) / "generated" / "commands"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    app.env.squeal_work = folder  # type: ignore[attr-defined]
    place = tempfile.mkdtemp()
    app.connect("build-finished", lambda *_: shutil.rmtree(place))
    app.env.squeal_variables = environment(install(Path(place)))  # type: ignore[attr-defined]


class Run(SphinxDirective):
    """The directive."""

    has_content = True
    option_spec: ClassVar = {
        "head": directives.nonnegative_int,
        "code": directives.nonnegative_int,
    }

    def run(self) -> list[nodes.Node]:
        """Run the commands and show them with their output."""
        folder: Path = self.env.squeal_work / self.env.docname  # type: ignore[attr-defined]
        folder.mkdir(parents=True, exist_ok=True)
        shown, problems = [], []
        for command in self.content:
            code = self.options.get("code", 0)
            step = Step(self.env.docname, self.lineno, command, code=code)
            done = run_step(step, folder, self.env.squeal_variables)  # type: ignore[attr-defined]
            if done.returncode != code:
                problems.append(f"{command!r} ended with {done.returncode}: {done.stdout}")
            lines = folded_output(done.stdout.rstrip("\n")).split("\n")
            head = self.options.get("head", len(lines))
            rest = ["..."] if 0 < head < len(lines) else []
            shown.append("\n".join([folded_command(command), *lines[:head], *rest]))
        if problems:
            raise self.error("; ".join(problems))
        between = "\n\n" if self.options.get("head", 1) else "\n"
        text = between.join(shown)
        if max(map(len, text.split("\n"))) > WIDTH:
            problems.append(f"{self.content[0]!r}: a line is wider than {WIDTH} columns")
            raise self.error("; ".join(problems))
        block = nodes.literal_block("", text)
        block["language"] = "console"
        self.set_source_info(block)
        return [block]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.connect("builder-inited", prepare)
    app.add_directive("run", Run)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
