"""Scene and system files: what they may say, and how they are read."""

from squeal.scene.keys import COORDINATES, OUTPUTS
from squeal.scene.read import read_scene
from squeal.scene.schema import Damping, Scene, check_simulation, takes_scene
from squeal.scene.system import PlainSystem, plain_system, read_plain

# fmt: off
__all__ = [
    "COORDINATES", "OUTPUTS", "Damping", "PlainSystem", "Scene", "check_simulation", "plain_system",
    "read_plain", "read_scene", "takes_scene",
]
# fmt: on
