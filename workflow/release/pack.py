"""`python workflow/release/pack.py FOLDER`: FOLDER.zip, the same bytes for the same files.

Names are sorted, times and rights fixed; bytes depend on the files and the version of zlib alone.
"""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path

DATE = (2021, 1, 1, 0, 0, 0)


def _add(packed: zipfile.ZipFile, name: str, data: bytes) -> None:
    entry = zipfile.ZipInfo(name, DATE)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.create_system = 3  # Unix, wherever it is written
    entry.external_attr = 0o644 << 16
    packed.writestr(entry, data, compresslevel=9)


def pack(folder: Path, archive: Path) -> None:
    """Write all files of a folder into an archive, under the folder's own name."""
    with zipfile.ZipFile(archive, "w") as packed:
        for path in sorted(folder.rglob("*"), key=lambda path: path.as_posix()):
            if path.is_file():
                _add(packed, path.relative_to(folder.parent).as_posix(), path.read_bytes())


def repack(archive: Path) -> None:
    """Write another program's archive anew in this way, in its place."""
    with zipfile.ZipFile(archive) as given:
        files = {name: given.read(name) for name in sorted(given.namelist())}
    with zipfile.ZipFile(archive, "w") as packed:
        for name, data in files.items():
            _add(packed, name, data)


if __name__ == "__main__":
    given = Path(sys.argv[1])
    pack(given, given.with_name(f"{given.name}.zip"))
