"""Sources: the import list against what Python itself loads."""

import ast
import shutil
import subprocess
import sys

import pytest

from squeal.io import provenance as sources_module
from squeal.io.provenance import ROOT, digest, packages, sources

MODULES = ["squeal.cli.simulate", "squeal.article.commands.sliding", "squeal.cli.map"]


@pytest.mark.parametrize("module", MODULES)
def test_everything_that_python_loads_is_listed(module):
    code = (
        f"import {module}, sys; "
        "print('\\n'.join(m.__file__ for n, m in sys.modules.items() if n.startswith('squeal')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {str(line) for line in done.stdout.split()}
    listed = {str(ROOT.parent / path) for path in sources(module)}
    assert loaded <= listed
    # imports inside functions are listed too, whether or not they have run
    assert len(listed) == len(sources(module)) == len(set(sources(module)))


def test_queries_do_not_depend_on_what_they_do_not_import():
    listed = sources("squeal.article.commands.sliding")
    assert "squeal/model/equations.py" in listed
    assert not [path for path in listed if "/simulation/" in path or "/figures/" in path]
    assert not [path for path in sources("squeal.equilibrium") if "/simulation/" in path]


def test_imports_in_functions_are_seen():
    assert "squeal/simulation/taylor.py" in sources("squeal.cli.simulate")


def test_unknown_module_is_refused():
    with pytest.raises(ModuleNotFoundError):
        sources("squeal.nothing")


def parsed(text):
    """All that a text imports, by Python's own parser, without what type checkers alone see."""
    found, wanted = set(), [ast.parse(text)]
    while wanted:
        node = wanted.pop()
        if not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            wanted += ast.iter_child_nodes(node)
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def test_imports_are_those_that_python_parses():
    for path in ROOT.rglob("*.py"):
        assert sources_module._imports(path) == parsed(path.read_text(encoding="utf-8")), path


def test_imports_in_odd_places_are_those_that_python_parses(tmp_path):
    text = '''"""A text with code.

    import nothing
    from nowhere import nothing
"""
import os, re as regex
from a.b import (  # a remark, with commas
    c,
    d as e,
)
if TYPE_CHECKING:
    import never

    from never import seen
from f import g  # another

def h():
    """One line. import no"""
    try:
        import i.j
    except ImportError:
        from k import l
'''
    file = tmp_path / "odd.py"
    file.write_text(text, encoding="utf-8")
    found = sources_module._imports(file)
    assert found == parsed(text)
    assert {"os", "re", "a.b.d", "f.g", "i.j", "k.l"} <= found
    assert not {"nothing", "nowhere", "never", "no"} & found


def test_packages_are_those_that_are_imported():
    assert {"heyoka", "numpy", "scipy", "yaml"} <= set(packages("squeal.cli.simulate"))
    assert packages("squeal.errors") == []


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A copy of the package, looked at in place of the package itself."""
    shutil.copytree(ROOT, tmp_path / "squeal", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(sources_module, "ROOT", tmp_path / "squeal")
    cached = [f for f in vars(sources_module).values() if hasattr(f, "cache_clear")]
    for function in cached:
        function.cache_clear()
    yield tmp_path / "squeal"
    for function in cached:
        function.cache_clear()


@pytest.mark.parametrize(
    ("changed", "module", "follows"),
    [
        ("article/report/references.bib", "squeal.article.report.bibliography", True),
        ("article/report/references.bib", "squeal.cli.eigenvalues", False),
        ("linear/eigen.py", "squeal.cli.eigenvalues", True),
        ("analysis/maps.py", "squeal.cli.eigenvalues", True),
        ("analysis/of_systems.py", "squeal.cli.critical_friction", True),
        ("article/equations.py", "squeal.cli.eigenvalues", False),
    ],
)
def test_the_digest_follows_what_a_module_imports_or_reads(copy, changed, module, follows):
    before = digest(module)
    with (copy / changed).open("a") as file:
        file.write("# a change\n")
    assert (digest(module) != before) is follows
    assert (f"squeal/{changed}" in sources(module)) is follows
