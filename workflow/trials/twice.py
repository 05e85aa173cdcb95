"""`python -m workflow.trials.twice FOLDER`: do two builds in unlike surroundings give equal bytes?

Builds all in FOLDER/one and in "FOLDER/zwei, größer" with another locale, time zone, hash seed,
number of cores, home and, for root, another user; then compares every file and prints which differ.
What stands in FOLDER already is built on.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from workflow.release.verify import built

ROOT = Path(__file__).resolve().parents[2]
BIN = Path(sys.executable).parent
SECOND = {
    "LC_ALL": "C",
    "TZ": "Asia/Kathmandu",
    "PYTHONHASHSEED": "4711",
    "HOME": "/nonexistent",
    "USER": "somebody",
}
# another user, who may read the interpreter wherever it lies
NOBODY = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"]
NOBODY += ["--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search"]


def copied(folder: Path) -> Path:
    """All files under version control in a new folder, which must lie outside the repository."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    for name in filter(None, listed.stdout.split("\0")):
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, place, follow_symlinks=False)  # one leads to the scenes
    return folder.resolve()


def surroundings(folder: Path, **more: str) -> dict[str, str]:
    """Environment variables in which a copy runs its own sources with this Python."""
    kept = {name: os.environ[name] for name in ("HOME", "LANG", "TZ") if name in os.environ}
    path = os.pathsep.join([str(BIN), os.environ["PATH"]])
    return {**kept, "PATH": path, "PYTHONPATH": str(folder), **more}


def digests(folder: Path, files: Iterable[str]) -> dict[str, str]:
    """SHA-256 of files in a folder; empty text for one that is missing."""
    found = dict.fromkeys(files, "")
    for name in found:
        path = folder / name
        if path.is_file():
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def differing(one: dict[str, str], other: dict[str, str]) -> list[str]:
    """Names whose digests differ."""
    return sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))


def build(folder: Path, cores: int, before: list[str], **more: str) -> dict[str, str]:
    """Build a copy and give the digests of its files."""
    if not folder.exists():
        copied(folder)
    if before:
        subprocess.run(["chown", "-R", "65534:65534", str(folder)], check=True)
    command = [*before, "workflow/setup/report.sh", f"--cores={cores}", "--quiet=all"]
    subprocess.run(command, cwd=folder, env=surroundings(folder, **more), check=True)
    return digests(folder, built())


def main() -> int:
    """Build twice and compare; 1 where files differ."""
    place = Path(sys.argv[1]).resolve()
    place.mkdir(parents=True, exist_ok=True)
    one = build(place / "one", 2, [], PYTHONHASHSEED="0", LC_ALL="C.UTF-8", TZ="UTC")
    other = build(place / "zwei, größer", 1, NOBODY if os.geteuid() == 0 else [], **SECOND)
    unlike = differing(one, other)
    print(*(f"differs: {name}" for name in unlike), sep="\n" if unlike else "")
    print(f"{len(one) - len(unlike)} of {len(one)} files have the same bytes")
    return int(bool(unlike) or "" in one.values())


if __name__ == "__main__":
    sys.exit(main())
