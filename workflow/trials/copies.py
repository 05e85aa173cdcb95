"""Copies of the repository to build in, and what a build leaves there."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BIN = Path(sys.executable).parent


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
    return {
        name: hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
        for name in files
        for path in [folder / name]
    }


def differing(one: dict[str, str], other: dict[str, str]) -> list[str]:
    """Names whose digests differ."""
    return sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))
