"""`python -m workflow.trials.damage FOLDER`: is each damaged file of the build in FOLDER noticed?

Each file of a whole build is truncated, emptied, changed in a byte and swapped with another of its
kind, one at a time, and put back. `make verify` must name it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from workflow.release.verify import built, compared, manifest


def damages(name: str, folder: Path) -> Iterator[tuple[str, bytes]]:
    """What may stand in a file instead of its content."""
    content = (folder / name).read_bytes()
    middle = len(content) // 2
    yield "truncated", content[:middle]
    yield "emptied", b""
    yield "changed", content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]
    for other in built():
        if other != name and Path(other).suffix == Path(name).suffix:
            yield "swapped", (folder / other).read_bytes()
            break


def main() -> int:
    """Damage, look, put back; 1 where something is not noticed on the same machine."""
    folder = Path(sys.argv[1])
    known = manifest(folder)
    tried, missed = 0, {True: list[str](), False: list[str]()}
    for name in known["files"]:
        content = (folder / name).read_bytes()
        own = {"files": {name: known["files"][name]}, "numbers": known["numbers"]}
        for kind, damaged in damages(name, folder):
            (folder / name).write_bytes(damaged)
            tried += 1
            for alike, names in missed.items():
                if not compared(own, folder, alike)[1]:
                    names.append(f"{name}, {kind}")
        (folder / name).write_bytes(content)
    print(f"{tried} damages of {len(known['files'])} files, {len(missed[True])} not noticed")
    print(*missed[True], sep="\n", end="\n" if missed[True] else "")
    print(f"{len(missed[False])} not noticed where bytes may differ, as on another machine")
    return int(bool(missed[True]))


if __name__ == "__main__":
    sys.exit(main())
