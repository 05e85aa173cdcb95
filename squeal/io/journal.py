"""Rows or arrays of a long computation, kept as they come and read back when it is run again."""

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray


class _Beside:
    """A file that is kept beside an output until that is complete; `path` None keeps nothing."""

    def __init__(self, output: Path | None, ending: str) -> None:
        self.path = None if output is None else output.with_name(output.name + ending)

    def close(self) -> None:
        """Remove the file: the output is complete."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)


class Journal(_Beside):
    """A file beside an output, one JSON value a line: a head that says what it is of, then rows.

    A file with another head is of another computation and begins anew; a last line that was cut
    off is dropped, and so is what follows a row that `read` does not take. `path` None keeps
    nothing.
    """

    def __init__(
        self, path: Path | None, head: dict[str, Any], read: Callable[[Any], object] = id
    ) -> None:
        super().__init__(path, ".partial")
        self._read = read
        self._head = json.dumps(head, sort_keys=True)
        self.rows = list(self._kept())
        if self.path is not None:
            lines = [self._head, *(json.dumps(row) for row in self.rows)]
            self.path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")

    def _kept(self) -> Iterator[Any]:
        if self.path is None or not self.path.is_file():
            return
        head, *lines = self.path.read_text(encoding="utf-8").splitlines() or [""]
        if head != self._head:
            return
        for line in lines:
            try:
                row = json.loads(line)
                self._read(row)
            except (ValueError, KeyError, TypeError):
                return
            yield row

    def add(self, row: Any) -> None:
        """Append a row, on the disc before this returns."""
        self.rows.append(row)
        if self.path is None:
            return
        with self.path.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(row) + "\n")
            stream.flush()
            os.fsync(stream.fileno())


class Checkpoint(_Beside):
    """Arrays of a long computation in a file beside an output, the last ones that were saved.

    A file with another head is of another computation and does not count. `path` None keeps
    nothing, and the head is not asked for.
    """

    def __init__(self, path: Path | None, head: Callable[[], dict[str, Any]]) -> None:
        super().__init__(path, ".partial.npz")
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
