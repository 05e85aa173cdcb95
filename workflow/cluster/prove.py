"""`make cluster-test`: is a job in parts the same through Slurm, and after one of them was killed?

Runs a map of model B2 here and through profiles/slurm, in a copy of the repository, kills one part
of a third run, compares the three tables, and prints how long each took.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PARTS = 4
TABLE = "results/jobs/proof.csv"
JOB = """\
map:
  scene: workflow/scenes/b2-c.yaml
  axes:
    alpha1: {low: 0, high: pi, n: 160}
    alpha2: {low: 0, high: pi, n: 160}
"""


def command(folder: Path, *options: str) -> list[str]:
    """Snakemake in the copy."""
    scatter = ["--set-scatter", f"part={PARTS}", "--nolock", "--directory", str(folder)]
    return [sys.executable, "-m", "snakemake", *options, *scatter, "--", TABLE]


def digest(folder: Path) -> str:
    """Of the gathered table, which is then removed."""
    table = folder / TABLE
    found = hashlib.sha256(table.read_bytes()).hexdigest()
    table.unlink()
    return found


def run(folder: Path, *options: str) -> tuple[str, float]:
    """Digest of the table and seconds on the clock."""
    start = time.perf_counter()
    done = subprocess.run(command(folder, *options), cwd=folder, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stdout + done.stderr)
    return digest(folder), time.perf_counter() - start


def pid_of(part: str, folder: Path) -> int | None:
    """The process that computes a part in the copy."""
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            words = (entry / "cmdline").read_bytes().decode().split("\0")
            python = words[1:3] == ["-m", "squeal.cli.parts"] and part in words
            if python and (entry / "cwd").resolve() == folder:
                return int(entry.name)
        except OSError:  # it has ended
            continue
    return None


def run_and_kill(folder: Path, part: str) -> tuple[str, int]:
    """Digest of the table of a run in which a part is killed once, and how many were restarted."""
    log = folder / "killed.log"
    with log.open("w") as out:
        words = command(folder, "--workflow-profile", "profiles/slurm")
        running = subprocess.Popen(words, cwd=folder, stdout=out, stderr=out)
        while (found := pid_of(part, folder)) is None:
            if running.poll() is not None:
                sys.exit(f"the run ended before {part} was seen\n{log.read_text()}")
            time.sleep(0.05)
        os.kill(found, signal.SIGKILL)
        print(f"killed process {found}, part {part}")
        if running.wait():
            sys.exit(log.read_text())
    return digest(folder), len(re.findall(r"Trying to restart job", log.read_text()))


def spans(folder: Path) -> list[float]:
    """Seconds from start to end of the parts' jobs, as Slurm has them."""
    told = subprocess.run(["scontrol", "show", "jobs", "-o"], capture_output=True, text=True).stdout
    lines = [line for line in told.splitlines() if f"WorkDir={folder}" in line]
    return [
        60.0 * float(m[1]) + float(m[2])
        for line in lines
        if (m := re.search(r"RunTime=00:(\d\d):(\d\d) ", line))
    ]


def main() -> None:
    """Run it three times and compare."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name).resolve()
        for part in ("Snakefile", "profiles", "workflow", "squeal", "paper", "requirements"):
            path = ROOT / part
            ignored = shutil.ignore_patterns("__pycache__", "generated")
            if path.is_dir():
                shutil.copytree(path, folder / part, ignore=ignored)
            else:
                shutil.copy(path, folder / part)
        (folder / "workflow/jobs/proof.yaml").write_text(JOB)
        os.environ["PYTHONPATH"] = str(folder)
        here, seconds = run(folder, "--cores", "1")
        print(f"here, one core:       {seconds:6.1f} s  {here[:16]}")
        there, through = run(folder, "--workflow-profile", "profiles/slurm")
        print(f"through Slurm:        {through:6.1f} s  {there[:16]}")
        print(
            f"jobs took {', '.join(f'{s:.0f}' for s in sorted(spans(folder)))} s by Slurm's clock"
        )
        killed, restarts = run_and_kill(folder, f"2-of-{PARTS}")
        print(f"with a part killed:             {killed[:16]}, {restarts} restarted")
        if not here == there == killed or restarts != 1:
            sys.exit("not the same")
        print("the same bytes each time")


if __name__ == "__main__":
    main()
