"""The page, built once for all tests; what a machine lacks skips them with its name."""

import json
import shutil
import subprocess
from dataclasses import asdict
from pathlib import Path

import pytest

from page.wasm import ADVICE, compilers
from squeal.io.scene import Scene

HERE = Path(__file__).parent


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """Folder with the built page, its module and its tables."""
    pytest.importorskip("heyoka", reason="the page needs heyoka's compiled code")
    if compilers() is None:
        pytest.skip(ADVICE)
    from page.build import build

    folder = tmp_path_factory.mktemp("page")
    build(folder)
    return folder


@pytest.fixture(scope="session")
def node(built):
    """`node(program, data)`: the answer of a program in page/tests to JSON data."""
    if shutil.which("node") is None:
        pytest.skip("these tests run the page's JavaScript with node, which is not installed")

    def ask(program, data):
        command = ["node", str(HERE / program), str(built)]
        done = subprocess.run(command, input=json.dumps(data), capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return ask


def as_json(scene: Scene) -> dict:
    """A scene as the page takes it."""
    from page.tables import choices  # needs heyoka

    return {
        "model": scene.model,
        "formulation": choices(scene),
        "parameters": {n: v for n, v in asdict(scene.pad).items() if v is not None},
        "initial": list(scene.initial),
        "stop": scene.stop,
        "damping": scene.damping.ratios[0] if scene.damping else 0.0,
    }
