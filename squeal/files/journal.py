"""Rows of a long computation, written as they come and read back when it is run again."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any


class Journal:
    """A file beside an output, one JSON value a line: a head that says what it is of, then rows.

    A file with another head is of another computation and begins anew; a last line that was cut
    off is dropped. `path` None keeps nothing.
    """

    def __init__(self, path: Path | None, head: dict[str, Any]) -> None:
        self.path = None if path is None else path.with_name(path.name + ".partial")
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
                yield json.loads(line)
            except ValueError:
                return

    def add(self, row: Any) -> None:
        """Append a row, on the disc before this returns."""
        self.rows.append(row)
        if self.path is None:
            return
        with self.path.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(row) + "\n")
            stream.flush()
            os.fsync(stream.fileno())

    def close(self) -> None:
        """Remove the file: the output is complete."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
