"""Arrays of a long computation, kept as they come and read back when it is run again."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray


class Checkpoint:
    """Arrays of a long computation in a file beside an output, the last ones that were saved.

    A file with another head is of another computation and does not count. `path` None keeps
    nothing, and the head is not asked for.
    """

    def __init__(self, path: Path | None, head: Callable[[], dict[str, Any]]) -> None:
        self.path = None if path is None else path.with_name(f"{path.name}.partial.npz")
        self._head = "" if path is None else json.dumps(head(), sort_keys=True)

    def load(self) -> dict[str, NDArray]:
        """What was saved under this head, else nothing."""
        if self.path is None or not self.path.is_file():
            return {}
        try:
            # opened here: NumPy leaves a file open that is no archive
            with self.path.open("rb") as stream, np.load(stream) as kept:
                arrays = dict(kept)
        except (OSError, ValueError, EOFError, BadZipFile):
            return {}
        return arrays if str(arrays.pop("head", "")) == self._head else {}

    def save(self, **arrays: NDArray) -> None:
        """Keep arrays in place of those before."""
        if self.path is None:
            return
        new = self.path.with_name(self.path.name + ".new")
        with new.open("wb") as stream:
            np.savez(stream, head=np.array(self._head), **arrays)  # type: ignore[arg-type]
        new.replace(self.path)

    def close(self) -> None:
        """Remove the file: the output is complete."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
