"""The article's cases against the scene files that hold them."""

import subprocess
import sys

import pytest

from squeal.article.cases import ANGLE_TEXTS, CASES, HISTORY_FIGURES, STEMS, stem, title
from squeal.io.scene import read_scene
from squeal.schema import Angle, Place
from tests.conftest import SCENES


@pytest.mark.parametrize("case", CASES)
def test_texts_and_scene_files_hold_the_same_angles(case):
    assert tuple(Angle().read(text, Place("text")) for text in ANGLE_TEXTS[case]) == CASES[case]
    for model in ("B1", "B2"):
        scene = read_scene(SCENES / f"{stem(model, case)}.yaml")
        assert scene.model == model
        assert (scene.pad.alpha1, scene.pad.alpha2) == CASES[case]


def test_history_figures_are_numbered_as_in_the_article():
    assert HISTORY_FIGURES == {
        "b1-a": 4, "b1-b": 5, "b1-c": 6, "b1-d": 7, "b2-a": 9, "b2-b": 10, "b2-c": 11, "b2-d": 12,
    }  # fmt: skip
    assert set(STEMS) == {file.stem for file in SCENES.glob("*.yaml")}


def test_titles_name_the_model_and_the_case():
    assert [title(s) for s in ("b1-a", "b3")] == ["B1, case (a)", "B3"]


def test_the_workflow_can_read_them_without_numpy():
    code = "import sys, squeal.article.cases; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
