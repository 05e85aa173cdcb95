"""Python as if heyoka were not installed: `make test-without-heyoka` puts this on PYTHONPATH."""

import importlib.metadata
import sys
from importlib.machinery import PathFinder
from typing import Any


class Without(PathFinder):
    """Finds all on the path but heyoka, of which it tells what is told of a missing package."""

    @classmethod
    def find_spec(cls, fullname: str, path: Any = None, target: Any = None) -> Any:
        if fullname.partition(".")[0] == "heyoka":
            return None
        return super().find_spec(fullname, path, target)


def _without(name: str) -> str:
    if name.lower() == "heyoka":
        raise importlib.metadata.PackageNotFoundError(name)
    return _version(name)


def _others() -> Any:
    return {name: found for name, found in _distributions().items() if name != "heyoka"}


_version = importlib.metadata.version
_distributions = importlib.metadata.packages_distributions
sys.meta_path[:] = [Without if finder is PathFinder else finder for finder in sys.meta_path]
importlib.metadata.version = _without  # type: ignore[assignment]
importlib.metadata.packages_distributions = _others
