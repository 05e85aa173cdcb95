"""Provenance: every file, the sources and all packages behind a result, as Python loads them."""

import ast
import hashlib
import json
import platform
import subprocess
import sys
from dataclasses import asdict
from importlib import metadata
from pathlib import Path

import pytest

from squeal.article.records import from_dict
from squeal.io import provenance as room
from squeal.io.provenance import Provenance, digest, packages, provenance, sources
from tests.conftest import ROOT, SCENES

SLIDING = "squeal.article.commands.sliding"
MODULES = ["squeal.cli.simulate", SLIDING, "squeal.cli.map"]


def test_the_version_of_a_package_that_nothing_imported():
    package = next(name for name in ("pulp", "snakemake", "numpydoc") if name not in sys.modules)
    assert room.version(package) == metadata.version(package)


def test_a_provenance_names_inputs_sources_versions_and_machine():
    made = provenance([SCENES / "b1-c.yaml", SCENES / "b2-a.yaml"], SLIDING)
    assert [file.name for file in made.inputs] == ["b1-c.yaml", "b2-a.yaml"]
    for file in made.inputs:
        assert file.sha256 == hashlib.sha256((SCENES / file.name).read_bytes()).hexdigest()
    assert made.source_sha256 == digest(SLIDING) != digest("squeal.cli.simulate")
    assert set(made.versions) == {"squeal", "python", *packages(SLIDING)}
    assert made.versions["numpy"] == metadata.version("numpy")
    assert made.versions["python"] == platform.python_version()
    assert platform.machine() in made.platform
    assert from_dict(Provenance, json.loads(json.dumps(asdict(made)))) == made


@pytest.mark.parametrize("module", MODULES)
def test_everything_that_python_loads_is_listed(module):
    code = f"import {module}, sys; print([m.__file__ for n, m in sys.modules.items() if "
    run = [sys.executable, "-c", f"{code}n.startswith('squeal')])"]
    loaded = ast.literal_eval(subprocess.run(run, capture_output=True, check=True).stdout.decode())
    assert set(loaded) <= {str(ROOT / path) for path in sources(module)}


def test_sources_are_those_of_the_imports_in_functions_too_and_no_others():
    assert "squeal/simulation/taylor.py" in sources("squeal.cli.simulate")
    listed = sources("squeal.equilibrium") + sources("squeal.linear.thresholds")
    assert "squeal/model/equations.py" in listed
    assert not [path for path in listed if "/simulation/" in path or "/figures/" in path]
    assert "squeal/article/figures/quasi_static.py" in sources(SLIDING)
    bibliography = "squeal/article/report/references.bib"  # read, not imported
    assert bibliography in sources("squeal.article.report.bibliography")
    assert bibliography not in sources("squeal.cli.eigenvalues")
    assert {"heyoka", "numpy", "scipy", "yaml"} <= set(packages("squeal.cli.simulate"))
    assert packages("squeal.errors") == ()
    with pytest.raises(ModuleNotFoundError):
        sources("squeal.nothing")


def parsed(text):
    """All that a text imports, by Python's own parser, without what type checkers alone see."""
    names = set()
    wanted = [ast.parse(text)]
    while wanted:
        node = wanted.pop()
        if not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            wanted += ast.iter_child_nodes(node)
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def test_imports_are_those_that_python_parses():
    for path in room.ROOT.rglob("*.py"):
        found = room._imports(path)
        expected = parsed(path.read_text(encoding="utf-8"))
        assert found >= expected, path
        homes = set(
            room._modules_of_offers().values()
        )  # of names that the package loads when they are used
        assert found - expected <= homes, path


def test_a_changed_comment_where_answers_are_shown_changes_no_simulation(monkeypatch):
    """A comment in the VTK writer reruns no simulation; a change of pictures does what draws."""
    module = "squeal.cli.simulate"
    before = digest(module)
    drawn = digest("squeal.plots.modes")
    read = Path.read_bytes
    shown = ("shapes.py", "plots")
    monkeypatch.setattr(
        Path,
        "read_bytes",
        lambda path: read(path) + b"# more\n" * any(part in str(path) for part in shown),
    )
    assert digest(module) == before
    assert digest("squeal.plots.modes") != drawn


def test_the_digest_follows_the_sources(monkeypatch):
    before = digest("squeal.errors")
    monkeypatch.setattr(Path, "read_bytes", lambda path: b"changed")
    assert digest("squeal.errors") != before
