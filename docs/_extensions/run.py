"""```{run}: commands of squeal with what they print when the site is built.

The content is one command a line. Those of a page run one after the other in a folder that is empty
when the page begins, as a reader's would be: `squeal example NAME` writes the files it starts from.
`:head: N` shows the first N lines of each output, 0 the commands alone; `:code: N` is the exit code
that is expected.
"""

from __future__ import annotations

import contextlib
import io
import shlex
import shutil
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from squeal.cli.main import main


def prepare(app: Sphinx) -> None:
    """Empty the folder of the pages' folders."""
    folder = Path(app.srcdir) / "generated" / "commands"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    app.env.squeal_work = folder  # type: ignore[attr-defined]


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
            out, errors = io.StringIO(), io.StringIO()
            with (
                contextlib.chdir(folder),
                contextlib.redirect_stdout(out),
                contextlib.redirect_stderr(errors),
            ):
                try:
                    code = main(shlex.split(command)[1:])
                except SystemExit as done:  # --help ends so
                    code = int(done.code or 0)
            if code != self.options.get("code", 0):
                problems.append(f"{command!r} ended with {code}: {errors.getvalue()}")
            lines = (out.getvalue() + errors.getvalue()).rstrip("\n").split("\n")
            head = self.options.get("head", len(lines))
            rest = ["..."] if 0 < head < len(lines) else []
            shown.append("\n".join([f"$ {command}", *lines[:head], *rest]))
        if problems:
            raise self.error("; ".join(problems))
        between = "\n\n" if self.options.get("head", 1) else "\n"
        block = nodes.literal_block("", between.join(shown))
        block["language"] = "console"
        self.set_source_info(block)
        return [block]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.connect("builder-inited", prepare)
    app.add_directive("run", Run)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
