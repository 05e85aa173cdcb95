"""Provenance: every file, the sources and all packages behind a result."""

import hashlib
import json
import os
import platform
import subprocess
import sys
from importlib import metadata

import pytest

from squeal.cli.main import command
from squeal.io.provenance import NOT_INSTALLED, Provenance, digest, packages, provenance, version
from tests.conftest import ROOT, SCENES

MODULE = "squeal.article.commands.sliding"


def test_every_input_is_named_with_the_digest_of_its_bytes():
    files = [SCENES / "b1-c.yaml", None, SCENES / "b2-a.yaml"]
    made = provenance(files, MODULE)
    assert [file.name for file in made.inputs] == ["b1-c.yaml", "b2-a.yaml"]
    for file in made.inputs:
        assert file.sha256 == hashlib.sha256((SCENES / file.name).read_bytes()).hexdigest()


def test_sources_versions_and_machine():
    made = provenance([], MODULE)
    assert made.source_sha256 == digest(MODULE) != digest("squeal.cli.simulate")
    assert set(made.versions) == {"squeal", "python", *packages(MODULE)}
    assert made.versions["numpy"] == metadata.version("numpy")
    assert made.versions["python"] == platform.python_version()
    assert platform.machine() in made.platform
    assert Provenance.from_dict(json.loads(json.dumps(made.to_dict()))) == made


def test_version_of_a_package_of_another_name_that_is_not_loaded(monkeypatch):
    monkeypatch.delitem(sys.modules, "yaml", raising=False)
    assert version("yaml") == metadata.version("PyYAML")


def test_a_missing_package_is_told():
    assert version("surely_no_such_package") == NOT_INSTALLED


@pytest.mark.parametrize(("name", "more"), [("claims", []), ("findings", ["b3.yaml"])])
def test_commands_of_several_scenes_name_them_all(name, more, capsys):
    scenes = ROOT / "workflow" / "scenes"
    assert command(name).main(["--scenes", str(scenes), "--json"]) == 0
    made = Provenance.from_dict(json.loads(capsys.readouterr().out)["provenance"])
    cases = [f"{model}-{case}.yaml" for model in ("b1", "b2") for case in "abcd"]
    assert [file.name for file in made.inputs] == [*cases, *more]


def test_without_heyoka_its_version_is_none():
    code = "from squeal.io.provenance import provenance; print(provenance([], 'squeal.simulation'))"
    hidden = os.pathsep.join([str(ROOT / "tests" / "without_heyoka"), str(ROOT)])
    made = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": hidden},
        capture_output=True,
        text=True,
        check=True,
    )
    assert f"'heyoka': '{NOT_INSTALLED}'" in made.stdout
