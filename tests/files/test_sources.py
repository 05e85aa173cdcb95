"""Sources: the import list against what Python itself loads."""

import re
import shutil
import subprocess
import sys

import pytest

from squeal.files import sources as sources_module
from squeal.files.sources import ROOT, digest, packages, sources

MODULES = ["squeal.commands.simulate", "squeal.article.commands.sliding", "squeal.commands.map"]


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
    assert "squeal/model/linear.py" in listed
    assert not [path for path in listed if "/simulation/" in path or "/figures/" in path]
    assert not [path for path in sources("squeal.equilibrium") if "/simulation/" in path]


def test_imports_in_functions_are_seen():
    assert "squeal/simulation/integrators/taylor.py" in sources("squeal.commands.simulate")


def test_unknown_module_is_refused():
    with pytest.raises(ModuleNotFoundError):
        sources("squeal.nothing")


def test_other_packages_are_those_of_the_import_lines():
    """Against the text of the sources: a line that begins with import or from names a package."""
    for module in (*MODULES, "squeal.article.studies.precision"):
        named = set()
        for path in sources(module):
            if path.endswith(".py"):
                text = (ROOT.parent / path).read_text(encoding="utf-8")
                line = r"^ *(?:import|from) (\w+)[\w.]*(?: import| as|$)"
                named |= set(re.findall(line, text, re.M))
        assert set(packages(module)) == named - set(sys.stdlib_module_names) - {"squeal"}
    assert {"heyoka", "numpy", "scipy", "yaml"} <= set(packages("squeal.commands.simulate"))
    assert packages("squeal.errors") == []


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A copy of the package, looked at in place of the package itself."""
    shutil.copytree(ROOT, tmp_path / "squeal", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(sources_module, "ROOT", tmp_path / "squeal")
    cached = [sources_module._file, sources_module._imports, sources_module._data]
    for function in cached:
        function.cache_clear()
    yield tmp_path / "squeal"
    for function in cached:
        function.cache_clear()


@pytest.mark.parametrize(
    ("changed", "module", "follows"),
    [
        ("article/literature/systems/bicycle.yaml", "squeal.article.studies.stability", True),
        ("article/literature/systems/bicycle.yaml", "squeal.commands.eigenvalues", False),
        ("stability/cubic.py", "squeal.commands.eigenvalues", True),
        ("article/literature/comparison.py", "squeal.commands.eigenvalues", False),
    ],
)
def test_the_digest_follows_what_a_module_imports_or_reads(copy, changed, module, follows):
    before = digest(module)
    with (copy / changed).open("a") as file:
        file.write("# a change\n")
    assert (digest(module) != before) is follows
    assert (f"squeal/{changed}" in sources(module)) is follows
