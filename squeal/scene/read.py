"""From a scene file to a validated `Scene`; everything is checked before anything runs."""

from pathlib import Path
from typing import Literal

from squeal.files.arguments import FILE, takes
from squeal.files.document import read_document
from squeal.files.place import Place
from squeal.scene.schema import Scene, check_simulation


@takes(path=FILE)
def read_scene(path: str | Path, purpose: Literal["simulate", "query"] = "query") -> Scene:
    """Read and validate a scene file.

    `purpose` "simulate" asks for a nonlinear model and its time; queries need neither.
    Raises InputError with one sentence on the first thing that is wrong.
    """
    path = Path(path)
    at = Place(str(path))
    scene = Scene.from_dict(read_document(path), at, path)
    if purpose == "simulate":
        check_simulation(scene, at)
    return scene
