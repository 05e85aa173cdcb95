"""What a rule of the workflow depends on besides its data: one file instead of each source."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from pathlib import Path

from squeal.article.report.source import source
from squeal.io.provenance import sources

FOLDER = Path(".snakemake/sources")


def sources_file(*modules: str, more: Iterable[str] = ()) -> str:
    """A file that lists the sources that modules need, and more files, with their digests.

    It is as old as the newest of these, so that a rule that takes it as input runs again where it
    would with all of them as inputs. Named after the last module.
    """
    listed = sorted({*sources(*modules), *more})
    lines = (f"{hashlib.sha256(Path(file).read_bytes()).hexdigest()}  {file}\n" for file in listed)
    content = "".join(lines)
    newest = max(os.stat(file).st_mtime_ns for file in listed)
    return _kept(modules[-1], content, newest)


def commit_file() -> str:
    """A file that names the version, commit and date of the sources, as old as the commit."""
    made = source(Path())
    return _kept("commit", f"{made.version}\n{made.commit}\n{made.date}\n", made.time * 10**9)


def _kept(name: str, content: str, time: int) -> str:
    """The path of a file with a content and a time (ns), written where they are not there."""
    place = FOLDER / name
    if not place.exists() or place.read_text(encoding="utf-8") != content:
        FOLDER.mkdir(parents=True, exist_ok=True)
        beside = place.with_name(f"{name}.{os.getpid()}")
        beside.write_text(content, encoding="utf-8")
        os.utime(beside, ns=(time, time))
        os.replace(beside, place)
    elif place.stat().st_mtime_ns != time:
        os.utime(place, ns=(time, time))
    return str(place)
