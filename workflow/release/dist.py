"""`python -m workflow.release.dist FOLDER [URL]`: wheel and sdist of what is tracked by git.

URL is the address of the repository at its host. With it the links of README.md lead there, since
the page of a registry holds no other file, and the metadata names it.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import sys
import tempfile
from pathlib import Path

from flit_core import buildapi

from workflow.release.gather import ROOT, tracked

LINK = re.compile(r"\]\((?![a-z]+:|#)([^)]*)\)")


def absolute(text: str, url: str) -> str:
    """The text with its relative links at the host."""
    return LINK.sub(
        lambda m: f"]({url}/{'raw' if m[1].endswith('.png') else 'blob'}/main/{m[1]})", text
    )


def main() -> int:
    """Build both in the folder."""
    folder = Path(sys.argv[1]).resolve()
    url = "".join(sys.argv[2:]).rstrip("/")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        for file in tracked():
            place = Path(name) / file
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / file, place)
        if url:
            readme = Path(name) / "README.md"
            project = Path(name) / "pyproject.toml"
            readme.write_text(absolute(readme.read_text(encoding="utf-8"), url), encoding="utf-8")
            table = f'\n[project.urls]\nSource = "{url}"\nIssues = "{url}/issues"\n'
            table += f'Changelog = "{url}/blob/main/CHANGELOG.md"\n'
            with project.open("a", encoding="utf-8") as end:
                end.write(table)
        with contextlib.chdir(name):
            buildapi.build_wheel(str(folder))
            buildapi.build_sdist(str(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
