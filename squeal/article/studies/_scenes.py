"""The article's scenes read from their files."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from squeal.article.cases import CASES, stem
from squeal.errors import InputError
from squeal.io.scene import Scene, check_simulation, read_scene


def read_scenes(files: Sequence[Path], stems: Iterable[str]) -> dict[str, Scene]:
    """The scenes of some of the files, by their names. Raises InputError if a file is not given."""
    given = {file.stem: file for file in files}
    for name in stems:
        if name not in given:
            raise InputError(f"{name}.yaml: missing; the article's scenes must be given")
    return {name: read_scene(given[name]) for name in stems}


def read_cases(files: Sequence[Path], model: str) -> dict[str, Scene]:
    """The four scenes of model B1 or B2 by case. Raises InputError if one has no motion."""
    scenes = read_scenes(files, [stem(model, case) for case in CASES])
    for scene in scenes.values():
        check_simulation(scene)
    return dict(zip(CASES, scenes.values(), strict=True))


def alike(scenes: Mapping[str, Scene]) -> list[dict[str, Scene]]:
    """The scenes in groups of one model and formulation, whose motions go in one batch."""
    groups: dict[Any, dict[str, Scene]] = {}
    for name, scene in scenes.items():
        groups.setdefault((scene.model, scene.formulation), {})[name] = scene
    return list(groups.values())
