"""`make cluster-test`: is a result the same here and through profiles/slurm, and after a kill?"""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RESULT = "results/angles.json"
SLURM = ("--workflow-profile", "profiles/slurm")


def command(folder: Path, *options: str) -> list[str]:
    """Snakemake in the copy."""
    own = ("--nolock", "--directory", str(folder))
    return [sys.executable, "-m", "snakemake", *options, *own, "--", RESULT]


def digest(folder: Path) -> str:
    """Of the result, which is then removed."""
    file = folder / RESULT
    found = hashlib.sha256(file.read_bytes()).hexdigest()
    file.unlink()
    return found


def job_in(folder: Path) -> int | None:
    """The process that computes the result in the copy."""
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            words = (entry / "cmdline").read_bytes().decode().split("\0")
            study = words[1:4] == ["-m", "workflow.processes", "squeal.article.studies"]
            if study and (entry / "cwd").resolve() == folder:
                return int(entry.name)
        except OSError:  # it has ended
            continue
    return None


def run(folder: Path, *options: str, kill: bool = False) -> str:
    """Digest of the result, if asked for with its job killed once."""
    log = folder / "run.log"
    with log.open("w") as out:
        running = subprocess.Popen(command(folder, *options), cwd=folder, stdout=out, stderr=out)
        while kill and running.poll() is None:
            if (found := job_in(folder)) is not None:
                os.kill(found, signal.SIGKILL)
                break
            time.sleep(0.05)
        if running.wait():
            sys.exit(log.read_text())
    return digest(folder)


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
        os.environ["PYTHONPATH"] = str(folder)
        found = [run(folder, "--cores", "1"), run(folder, *SLURM), run(folder, *SLURM, kill=True)]
        print(*(f"{one[:16]}" for one in found), sep="\n")
        if len(set(found)) != 1:
            sys.exit("not the same")
        print("the same bytes here, through Slurm, and with a job killed")


if __name__ == "__main__":
    main()
