"""Sources: the import list against what Python itself loads."""

import subprocess
import sys

import pytest

from squeal.files.provenance import provenance
from squeal.files.sources import ROOT, digest, sources
from tests.conftest import SCENES

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
    assert not [path for path in sources("squeal.simulation") if "/equilibrium/" in path]


def test_imports_in_functions_are_seen():
    assert "squeal/simulation/integrators/taylor.py" in sources("squeal.commands.simulate")


def test_unknown_module_is_refused():
    with pytest.raises(ModuleNotFoundError):
        sources("squeal.nothing")


def test_provenance_follows_scene_and_sources():
    found = provenance(SCENES / "b1-c.yaml", "squeal.article.commands.sliding", ("numpy",))
    assert found["scene"] == "b1-c.yaml"
    assert found["source_sha256"] == digest("squeal.article.commands.sliding")
    other = provenance(SCENES / "b1-a.yaml", "squeal.commands.simulate", ())
    assert other["scene_sha256"] != found["scene_sha256"]
    assert other["source_sha256"] != found["source_sha256"]
    assert len(found["scene_sha256"]) == len(found["source_sha256"]) == 16
