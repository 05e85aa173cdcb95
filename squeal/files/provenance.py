"""Where a result comes from: the scene, the sources and the versions that made it."""

from __future__ import annotations

import hashlib
import importlib.metadata
import platform
from pathlib import Path
from typing import Any

from squeal import __version__
from squeal.files.sources import digest


def provenance(scene: Path | None, module: str, packages: tuple[str, ...]) -> dict[str, Any]:
    """Digests of the scene file and of the sources that `module` runs on, and versions."""
    return {
        "scene": scene.name if scene else None,
        "scene_sha256": hashlib.sha256(scene.read_bytes()).hexdigest()[:16] if scene else None,
        "source_sha256": digest(module),
        "versions": {"squeal": __version__, "python": platform.python_version()}
        | {package: importlib.metadata.version(package) for package in packages},
    }
