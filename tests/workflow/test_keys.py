"""The documentation of the keys is current, and the JSON schemas judge as the reader does."""

import pytest
from jsonschema import Draft202012Validator as Validator

from squeal.errors import InputError
from squeal.io.provenance import ROOT as PACKAGE
from squeal.io.scene import read_scene
from squeal.io.system import read_system
from squeal.model.contact import MODELS
from squeal.schema.keys import read_document
from tests.conftest import ROOT, SCENES
from tests.io.test_scene import text
from tests.io.test_systems import GENERAL, SHORT, put
from workflow.release.keys import documents, scene_schema, system_schema

COMMAND = "python -m workflow.release.keys docs"
EXAMPLES = [
    *((path, scene_schema()) for path in SCENES.glob("*.yaml")),
    *((path, scene_schema()) for path in (ROOT / "workflow" / "scenes").glob("*.yaml")),
    *((p, system_schema()) for p in (PACKAGE / "article/literature/systems").glob("*.yaml")),
]


@pytest.mark.parametrize(("name", "content"), list(documents()))
def test_the_committed_documentation_is_current(name, content):
    assert (ROOT / "docs" / name).read_text(encoding="utf-8") == content, f"run {COMMAND}"


@pytest.mark.parametrize(("path", "schema"), EXAMPLES, ids=lambda one: getattr(one, "stem", ""))
def test_examples_pass_the_schema(path, schema):
    assert not list(Validator(schema).iter_errors(read_document(path)))


def judged(path, schema, read):
    """Whether the reader and the schema let a file pass."""
    try:
        read(path)
        ours = True
    except InputError:
        ours = False
    return ours, Validator(schema).is_valid(read_document(path))


CHANGES: list[dict] = [
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


MORE = ["", "K3: [[1, 2], [3, 4]]", "K3: 1", "K3: []", "K3: [[1, 2], [3, x]]", "K10: [[1]]"]
MORE += ["L0: [[1]]", "parameter: 3", "parameter: v", "damping: {rayleigh: [1, 0]}", "speed: 1"]
MORE += [
    "damping: {rayleigh: [1]}",
    "damping: {ratios: 0.1}",
    "reference: 3",
    "C0: [[1, 0], [0, 1]]",
]
MORE += ["C0: [[1, 0], [0, 1]]", "damping: {structural: -1}"]


@pytest.mark.parametrize("more", MORE)
@pytest.mark.parametrize("form", [SHORT, GENERAL])
def test_reader_and_schema_of_systems_agree(tmp_path, form, more):
    put(tmp_path)
    path = tmp_path / "system.yaml"
    path.write_text(f"{form}{more}\n".replace("parameter: Omega\n" * ("parameter:" in more), ""))
    ours, theirs = judged(path, system_schema(), read_system)
    assert ours == theirs
