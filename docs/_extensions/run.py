"""```{run}: commands of squeal with what they print when the site is built.

The content is one command a line. They run in a folder that holds the examples, their pad.yaml, the
article's scenes, the systems of the literature, a table of a test, a brake of solids as Abaqus
writes it and in parts, changes of its matrices, and a rotor from ROSS.
`:head: N` shows the first N lines of each output, 0 the commands alone; `:code: N` is the exit code
that is expected.
"""

from __future__ import annotations

import contextlib
import io
import json
import shlex
import shutil
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from scipy.io import mmwrite
from scipy.sparse import coo_array
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from squeal.examples.brake import solid_brake, write_brake, write_parts
from squeal.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = """samples: 64
design: sobol
indices: true
spreads:
  mu: {between: [0.2, 0.5]}
  k1: {relative: 0.05}
"""
RANGES = "samples: 64\nspreads: {mu: {between: [0.2, 0.5]}, contact: {relative: 0.1}}\n"
TEST = """name,frequency_hz,damping_ratio
bending 3,3562,0.001
bending 4,4885,
bending 5,6710,0.002
lining,9000,
"""
LINING = """frequency,storage,loss
500,0.90,0.12
2000,1.00,0.10
8000,1.20,0.08
"""
SHIM = {"dK.mtx": 1.0e6, "dM.mtx": 1.0e-3}  # what it adds at three nodes of the pad's face
ROTOR = """\
name: rotor
parameters:
  speed: 0.0   # rad/s
  cross: 0.4   # share of the bearings' cross-coupled stiffness
parameter: speed
M: {file: M.mtx}
C: [{file: C.mtx}, {file: G.mtx, factor: speed}]
K: [{file: K.mtx}, {file: cross.mtx, factor: cross}]
"""
DAMPED = {  # a line of the brake's system file and what follows it in another one
    "damped": ("  factor: contact\n", "  structural: 0.1\n"),
    "lining": ("  factor: contact\n", "  modulus: {file: lining.csv}\n"),
}


def prepare(app: Sphinx) -> None:
    """Fill the folder in which the commands run."""
    folder = Path(app.srcdir) / "generated" / "commands"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shutil.copytree(ROOT / "squeal" / "examples", folder / "examples")
    shutil.copy(folder / "examples" / "pad.yaml", folder)
    (folder / "samples.yaml").write_text(SAMPLES, encoding="utf-8")
    (folder / "ranges.yaml").write_text(RANGES, encoding="utf-8")
    (folder / "test.csv").write_text(TEST, encoding="utf-8")
    write_brake(folder / "brake", solid_brake(500), "abaqus")
    write_parts(folder / "brake", solid_brake(500))
    for name, entry in SHIM.items():
        rows = (f"{node},3, {node},3, {entry}\n" for node in (721, 724, 727))
        (folder / name).write_text("".join(rows), encoding="utf-8")
    (folder / "brake" / "lining.csv").write_text(LINING, encoding="utf-8")
    system = (folder / "brake" / "system.yaml").read_text(encoding="utf-8")
    for name, (line, more) in DAMPED.items():
        text = system.replace(line, line + more) + "damping: {structural: 0.002}\n"
        (folder / "brake" / f"{name}.yaml").write_text(text, encoding="utf-8")
    write_rotor(folder / "rotor")
    systems = ROOT / "squeal" / "article" / "literature" / "systems"
    for scene in (*(ROOT / "workflow" / "scenes").glob("*.yaml"), *systems.glob("*.yaml")):
        shutil.copy(scene, folder)
    app.env.squeal_work = folder  # type: ignore[attr-defined]


def write_rotor(folder: Path) -> None:
    """A system file of the rotor in the tests, its skew stiffness as a matrix of its own."""
    data = json.loads((ROOT / "tests" / "data" / "rotor.json").read_text(encoding="utf-8"))
    found = {}
    for name, entries in data["matrices"].items():
        rows, columns, values = zip(*entries, strict=True)
        found[name] = coo_array((values, (rows, columns)), shape=(data["rows"],) * 2)
    found["cross"] = (found["K"] - found["K"].T) / 2
    found["K"] = found["K"] - found["cross"]
    folder.mkdir()
    for name, matrix in found.items():
        mmwrite(folder / f"{name}.mtx", matrix)
    (folder / "rotor.yaml").write_text(ROTOR, encoding="utf-8")


class Run(SphinxDirective):
    """The directive."""

    has_content = True
    option_spec: ClassVar = {
        "head": directives.nonnegative_int,
        "code": directives.nonnegative_int,
    }

    def run(self) -> list[nodes.Node]:
        """Run the commands and show them with their output."""
        shown, problems = [], []
        for command in self.content:
            out, errors = io.StringIO(), io.StringIO()
            with (
                contextlib.chdir(self.env.squeal_work),  # type: ignore[attr-defined]
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
