"""Where a result comes from: the files, the sources and the versions that made it."""

from __future__ import annotations

import hashlib
import platform
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from squeal import __version__
from squeal.io.sources import digest, packages

NOT_INSTALLED = "not installed"
WITHOUT_HEYOKA = "Left out here, since heyoka is not installed:"


@dataclass(frozen=True)
class InputFile:
    """A file that was read: its name without the folder, and the SHA-256 of its bytes."""

    name: str
    sha256: str


@dataclass(frozen=True)
class Provenance:
    """What made a result.

    inputs: every file that was read; source_sha256: over the module and all that it imports, see
    `squeal.io.sources.digest`; versions: of this package, of Python and of every other package
    that those sources import, `NOT_INSTALLED` for one that is missing; platform: system and
    processor; loaded: those of the packages that had been loaded when the result was made, since
    sources also import what a scene may need and this one did not.
    """

    inputs: tuple[InputFile, ...]
    module: str
    source_sha256: str
    versions: dict[str, str]
    platform: str
    loaded: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """As result files hold it."""
        return asdict(self)

    @staticmethod
    def from_dict(found: dict[str, Any]) -> Provenance:
        """Read back what `to_dict` gave."""
        inputs = tuple(InputFile(**entry) for entry in found["inputs"])
        return Provenance(**found | {"inputs": inputs, "loaded": tuple(found["loaded"])})


def provenance(inputs: Iterable[Path | InputFile | None], module: str) -> Provenance:
    """The provenance of a result that `module` computed from some files, read here or before.

    None stands for a scene that was not read from a file. Raises ModuleNotFoundError if this
    package has no such module.
    """
    read = [_read(file) for file in inputs if file is not None]
    versions = {"squeal": __version__, "python": platform.python_version()}
    imported = packages(module)
    return Provenance(
        tuple(read),
        module,
        digest(module),
        versions | {name: version(name) for name in imported},
        f"{platform.system()} {platform.machine()}",
        tuple(name for name in imported if name in sys.modules),
    )


def _read(file: Path | InputFile) -> InputFile:
    if isinstance(file, InputFile):
        return file
    return InputFile(file.name, hashlib.sha256(file.read_bytes()).hexdigest())


def version(package: str) -> str:
    """Version of a package by the name under which it is imported: as loaded, else as installed."""
    loaded = getattr(sys.modules.get(package), "__version__", None)
    if isinstance(loaded, str):
        return loaded
    return _installed(package)


@cache
def _installed(package: str) -> str:
    from importlib import metadata, util  # slow to load, and text for people needs none of it

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        pass
    if package not in sys.modules and util.find_spec(package) is None:
        return NOT_INSTALLED  # without reading the names of all that is installed
    names = metadata.packages_distributions().get(package, ())
    return metadata.version(names[0]) if names else NOT_INSTALLED
