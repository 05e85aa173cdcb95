"""The documentation of the keys is current, and the JSON schemas judge as the reader does."""

import pytest
from jsonschema import Draft202012Validator as Validator

from squeal.errors import InputError
from squeal.io.document import read_document
from squeal.io.provenance import ROOT as PACKAGE
from squeal.io.scene import read_scene
from squeal.io.system import read_system
from squeal.model.contact import MODELS
from tests.conftest import ROOT, SCENES
from tests.io.test_scene import text
from tests.io.test_system import GOOD
from workflow.release.keys import documents, scene_schema, system_schema

COMMAND = "python -m workflow.release.keys docs"


@pytest.mark.parametrize(("name", "content"), list(documents()))
def test_the_committed_documentation_is_current(name, content):
    assert (ROOT / "docs" / name).read_text(encoding="utf-8") == content, f"run {COMMAND}"


@pytest.mark.parametrize(
    "path", [*SCENES.glob("*.yaml"), *(ROOT / "workflow" / "scenes").glob("*.yaml")], ids=str
)
def test_example_scenes_pass_the_schema(path):
    assert not list(Validator(scene_schema()).iter_errors(read_document(path)))


def test_example_systems_pass_the_schema():
    systems = list((PACKAGE / "article" / "literature" / "systems").glob("*.yaml"))
    assert systems
    for path in systems:
        assert not list(Validator(system_schema()).iter_errors(read_document(path)))


def judged(path, schema, read):
    """Whether the reader and the schema let a file pass."""
    try:
        read(path)
        ours = True
    except InputError:
        ours = False
    return ours, Validator(schema).is_valid(read_document(path))


CHANGES = [
    {"m": "0"},
    {"m": "1"},
    {"m": "word"},
    {"m": "true"},
    {"m": "[1]"},
    {"k1": "0"},
    {"k1": "-1"},
    {"alpha1": "3*pi/4"},
    {"alpha1": "0.75pi"},
    {"theta0": "1.6"},
    {"theta0": "-pi/8"},
    {"k3": "1"},
    {"k_c": "1"},
    {"drop": ["mu"]},
    {"mu_s": "0.5"},
    {"mu_s": "0.5", "mu_k": "0.3"},
    {"mu_s": "0.5", "mu_k": "0.3", "v_ref": "2"},
    {"mu_k": "0.3", "v_ref": "2"},
    {"mu_s": "0.5", "mu_k": "0.3", "v_ref": "2", "drop": ["mu"]},
    {"mu_s": "0.5", "mu_k": "0.3", "v_ref": "2", "drop": ["V"]},
    {"drop": ["I", "V"]},
    {"more": "tolerance: 1e-3\n"},
    {"more": "tolerance: 2e-3\n"},
    {"more": "outputs: []\n"},
    {"more": "outputs: [event]\n"},
    {"more": "outputs: events\n"},
    {"more": "damping: {ratios: [0, 0.1, 0]}\n"},
    {"more": "damping: {ratios: [0, -0.1, 0]}\n"},
    {"more": "damping: {ratios: [0, 0.1]}\n"},
    {"more": "damping: {matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}\n"},
    {"more": "damping: {ratios: [0, 0, 0], matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}\n"},
    {"more": "initial: {x: 1}\n"},
    {"more": "initial: {z: 1}\n"},
    {"more": "initial: equilibrium\n"},
    {"more": "initial: rest\n"},
    {"more": "initial: {from: equilibrium, y_dot: 0.1}\n"},
    {"more": "damping: {rayleigh: [0, 1e-7]}\n"},
    {"more": "damping: {rayleigh: [0]}\n"},
    {"more": "formulation: {line_force: mean}\n"},
    {"more": "formulation: {line_force: sum}\n"},
    {"more": "speed: 1\n"},
]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("change", CHANGES, ids=str)
def test_reader_and_schema_agree(tmp_path, model, change):
    path = tmp_path / "scene.yaml"
    path.write_text(text(model, **change))
    ours, theirs = judged(path, scene_schema(), read_scene)
    assert ours == theirs


@pytest.mark.parametrize(
    "more",
    ["", "K3: [[1, 2], [3, 4]]\n", "K3: 1\n", "K3: []\n", "K3: [[1, 2], [3, x]]\n", "K10: [[1]]\n"]
    + ["L0: [[1]]\n", "parameter: 3\n", "parameter: v\n"],
)
def test_reader_and_schema_of_systems_agree(tmp_path, more):
    path = tmp_path / "system.yaml"
    path.write_text(GOOD + more)
    ours, theirs = judged(path, system_schema(), read_system)
    assert ours == theirs
