"""What a rule of the workflow depends on besides its data: one file instead of each source."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from pathlib import Path

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
    place = FOLDER / modules[-1]
    if not place.exists() or place.read_text(encoding="utf-8") != content:
        FOLDER.mkdir(parents=True, exist_ok=True)
        beside = place.with_name(f"{place.name}.{os.getpid()}")
        beside.write_text(content, encoding="utf-8")
        os.utime(beside, ns=(newest, newest))
        os.replace(beside, place)
    elif place.stat().st_mtime_ns != newest:
        os.utime(place, ns=(newest, newest))
    return str(place)
