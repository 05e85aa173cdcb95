"""Scene and system files: what they may say, and how they are read."""

from squeal.scene.read import read_scene
from squeal.scene.schema import OUTPUTS, Scene
from squeal.scene.system import PlainSystem, plain_system, read_plain

__all__ = ["OUTPUTS", "PlainSystem", "Scene", "plain_system", "read_plain", "read_scene"]
