"""The article's scenes read from their files."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from squeal.article.cases import CASES, stem
from squeal.errors import InputError
from squeal.io.scene import Scene, check_simulation, read_scene
from squeal.schema import Place

REFERENCE = "reference"
"""Name of the parameter set of the figures; the others are named as their folders."""


def read_scenes(files: Sequence[Path], stems: Iterable[str]) -> dict[str, Scene]:
    """The scenes of some of the files, by their names. Raises InputError if a file is not given."""
    given = {file.stem: file for file in files}
    for name in stems:
        if name not in given:
            raise InputError(f"{name}.yaml: missing; the article's scenes must be given")
    return {name: read_scene(given[name]) for name in stems}


def by_set(files: Sequence[Path]) -> dict[str, list[Path]]:
    """The files by parameter set: the reference first, then the folders beside its scenes.

    The reference is in the outermost folder, the others are named as theirs.
    """
    folders = sorted(
        {file.parent for file in files}, key=lambda folder: (len(folder.parts), folder)
    )
    sets = {}
    for folder in folders:
        name = REFERENCE if folder == folders[0] else folder.name
        sets[name] = [file for file in files if file.parent == folder]
    return sets


def read_cases(files: Sequence[Path], model: str) -> dict[str, Scene]:
    """The four scenes of model B1 or B2 by case.

    Raises InputError if one has no motion, or is of another model.
    """
    scenes = read_scenes(files, [stem(model, case) for case in CASES])
    for name, scene in scenes.items():
        if scene.model != model:
            raise Place(f"{name}.yaml", "model").must_be(scene.model, model)
        check_simulation(scene)
    return dict(zip(CASES, scenes.values(), strict=True))


def alike(scenes: Mapping[str, Scene]) -> list[dict[str, Scene]]:
    """The scenes in groups of one model and formulation, whose motions go in one batch."""
    groups: dict[Any, dict[str, Scene]] = {}
    for name, scene in scenes.items():
        groups.setdefault((scene.model, scene.formulation), {})[name] = scene
    return list(groups.values())
