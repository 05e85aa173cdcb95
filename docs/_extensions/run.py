"""```{run}: commands with what they print when the site is built.

The content is one command a line. Those of a page run one after the other in a folder that is empty
when the page begins, with the wheel alone, as `workflow.trials.pages` runs them: `squeal example
NAME` writes the files that a page starts from.
`:head: N` shows the first N lines of each output, 0 the commands alone; `:code: N` is the exit code
that is expected. What is wider than `WIDTH` columns is folded, tables between their columns.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from folding import WIDTH, folded_command, folded_output
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from workflow.trials.pages import Step, environment, install, run_step


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
        shown = []
        problems = []
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
