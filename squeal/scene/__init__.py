"""Scene files: what they may say, and how they are read."""

from squeal.scene.read import read_scene
from squeal.scene.schema import OUTPUTS, Scene

__all__ = ["OUTPUTS", "Scene", "read_scene"]
