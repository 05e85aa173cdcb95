"""The version of the program, commit and date that a build comes from, as its PDF names them."""

import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from squeal import __version__

ANNOUNCED = "to be announced"


class Source(NamedTuple):
    """version: of the program; commit: of the sources, and whether they were changed since; date:
    of the commit, of the release where there is no repository; time: the same in seconds."""

    version: str
    commit: str
    date: str
    time: int


def _git(folder: Path, *words: str) -> str | None:
    """What a command of git prints in a folder, None where it fails or there is no git."""
    command = ["git", "-C", str(folder), *words]
    try:
        run = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return run.stdout.strip()


def citation(folder: Path) -> dict[str, str]:
    """The plain entries of the citation file in a folder, none where there is no such file."""
    file = folder / "CITATION.cff"
    lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    pairs = (line.split(": ", 1) for line in lines if ": " in line and line[0].isalpha())
    return {key: value.strip('"') for key, value in pairs}


def source(folder: Path) -> Source:
    """The source of a build in a folder: its commit, or its release if it is no repository."""
    top = _git(folder, "rev-parse", "--show-toplevel")
    last = _git(folder, "log", "-1", "--format=%h %ct", "--abbrev=10")
    if top is None or last is None or Path(top).resolve() != folder.resolve():
        released = citation(folder).get("date-released", "")
        time = int(datetime.fromisoformat(f"{released}T00:00Z").timestamp()) if released else 0
        return Source(__version__, "of the release", released or ANNOUNCED, time)
    commit, seconds = last.split()
    changes = _git(folder, "status", "--porcelain", "--untracked-files=no")
    state = " with uncommitted changes" if changes else ""
    date = datetime.fromtimestamp(int(seconds), UTC).strftime("%Y-%m-%d")
    return Source(__version__, f"{commit}{state}", date, int(seconds))


def where(folder: Path) -> dict[str, str]:
    """Version, commit and date of a build, and repository and archive as the citation file names
    them, or that it does not."""
    made = source(folder)
    known = citation(folder)
    return {
        "version": made.version,
        "commit": made.commit,
        "date": made.date,
        "repository": known.get("repository-code", ANNOUNCED),
        "archive": known.get("doi", ANNOUNCED),
    }
