"""`python -m workflow.release.gather FOLDER`: what a release archive holds, in a new folder.

That are all files under version control, and what `make report`, `make site` and `make dist` build,
the live page within the site.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from squeal.article.contents import FIGURES, figure_files
from workflow.release import verify
from workflow.release.pack import repack

ROOT = Path(__file__).resolve().parents[2]
SITE = Path("docs/_build/html")


def tracked() -> list[Path]:
    """Files under version control, relative to the repository."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    files = []
    for name in filter(None, listed.stdout.split("\0")):
        # where a link leads to a folder (of scenes), the files there: archives hold no links
        for path in (ROOT / name, *(ROOT / name).rglob("*")):
            if path.is_file():
                files.append(path.relative_to(ROOT))
    return files


def built() -> Iterator[tuple[Path, Path]]:
    """Built files, relative to the repository, and their places in the archive.

    Raises FileNotFoundError with the target that builds what is missing.
    """
    names = verify.built()
    for figure in FIGURES:
        names += figure_files(figure)
    for file in map(Path, dict.fromkeys(names)):
        if not (ROOT / file).is_file():
            raise FileNotFoundError(f"{file} is missing: make report")
        yield file, file
    if not (ROOT / SITE / "index.html").is_file():
        raise FileNotFoundError(f"{SITE} is missing: make site")
    for path in sorted((ROOT / SITE).rglob("*")):
        file = path.relative_to(ROOT)
        inside = file.relative_to(SITE)
        if path.is_file() and not inside.parts[0].startswith("."):
            yield file, "site" / inside
    dist = ROOT / "dist"
    packages = sorted([*dist.glob("*.whl"), *dist.glob("*.tar.gz")])
    if len(packages) != 2:
        raise FileNotFoundError("the wheel or the sdist is missing: make dist")
    for path in packages:
        yield path.relative_to(ROOT), path.relative_to(ROOT)


def main() -> int:
    """Copy it all; 1 with the reason where something is missing."""
    folder = Path(sys.argv[1])
    try:
        files = [*((file, file) for file in tracked()), *built()]
    except FileNotFoundError as error:
        print(f"gather: {error}", file=sys.stderr)
        return 1
    shutil.rmtree(folder, ignore_errors=True)
    for source, place in files:
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / source, folder / place)
        if place.suffix == ".zip":  # of the gallery, with the times of its files
            repack(folder / place)
    return 0


if __name__ == "__main__":
    sys.exit(main())
