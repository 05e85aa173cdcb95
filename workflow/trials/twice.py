"""`python -m workflow.trials.twice FOLDER`: do two builds in unlike surroundings give equal bytes?

Builds all in FOLDER/one and in "FOLDER/zwei, größer" with another locale, time zone, hash seed,
number of cores, home and, for root, another user; then compares every file and prints which differ.
What stands in FOLDER already is built on.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from workflow.release.verify import built
from workflow.trials.copies import copied, differing, digests, surroundings

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
