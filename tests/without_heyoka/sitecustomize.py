"""Python as if heyoka were not installed: `make test-without-heyoka` puts this on PYTHONPATH."""

import importlib.abc
import importlib.metadata
import sys
from typing import Any


class Missing(importlib.abc.MetaPathFinder):
    """Finds no heyoka."""

    def find_spec(self, name: str, *_: Any) -> None:
        if name.partition(".")[0] == "heyoka":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def _without(name: str) -> str:
    if name.lower() == "heyoka":
        raise importlib.metadata.PackageNotFoundError(name)
    return _version(name)


def _others() -> Any:
    return {name: found for name, found in _distributions().items() if name != "heyoka"}


_version = importlib.metadata.version
_distributions = importlib.metadata.packages_distributions
sys.meta_path.insert(0, Missing())
importlib.metadata.version = _without  # type: ignore[assignment]
importlib.metadata.packages_distributions = _others
