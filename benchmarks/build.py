"""Where the time of a full build goes: `python -m benchmarks.build`.

Rebuilds all, one job at a time, and prints the seconds of each rule, told from the moments at
which Snakemake writes that jobs begin and end.
"""

from __future__ import annotations

import re
import subprocess
import time
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def main() -> None:
    """Build and print."""
    command = ["snakemake", "--cores", "1", "--forceall"]
    spent: dict[str, float] = defaultdict(float)
    jobs: dict[str, int] = defaultdict(int)
    rule, begun = "start of Snakemake", time.perf_counter()
    first = begun
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            named = re.match(r"(?:local)?rule (\w+):", line)
            if named or line.startswith("Finished jobid"):
                now = time.perf_counter()
                spent[rule] += now - begun
                begun = now
                rule = named.group(1) if named else "between jobs"
                jobs[rule] += bool(named)
            study = re.match(r"    wildcards: study=(\w+)", line)
            if study:  # each is a program of its own
                jobs[rule] -= 1
                rule = f"study {study.group(1)}"
                jobs[rule] += 1
    if process.returncode:
        raise SystemExit("the build failed; run snakemake --cores 1 to see why")
    for name, seconds in sorted(spent.items(), key=lambda item: -item[1]):
        count = f"{jobs[name]} jobs" if jobs[name] else ""
        print(f"{name:24} {seconds:7.1f} s  {count}")
    print(f"{'in all':24} {time.perf_counter() - first:7.1f} s")


if __name__ == "__main__":
    main()
