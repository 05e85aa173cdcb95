"""`python -m workflow.processes MODULE ARGUMENT ...`: runs a module as a job of Snakemake.

Snakemake can be killed without a chance to end its jobs and to remove its lock. Jobs therefore end
when it has ended, and the next Snakemake removes a lock that is provably nobody's.
"""

from __future__ import annotations

import fcntl
import os
import runpy
import signal
import sys
import threading
import time
from pathlib import Path
from typing import IO

BUILD = "SQUEAL_BUILD"
"""Names the process with which jobs end, and before it runs that with which Snakemake ends."""


def end_with(process: int, *signals: int) -> None:
    """Send this process signals, one each three seconds, when another one has ended."""

    def watch() -> None:
        while _lives(process):
            time.sleep(0.25)
        for one in signals:
            os.kill(os.getpid(), one)
            time.sleep(3.0)

    threading.Thread(target=watch, daemon=True).start()


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def begin(folder: Path = Path(".snakemake")) -> IO[str] | None:
    """Prepare a Snakemake: returns the open file `alive`, which must stay open while it runs.

    Every Snakemake holds a shared lock on `alive`, which the system releases when the Snakemake
    ends, even if it is killed. If this one gets an exclusive lock, no other runs: Snakemake's own
    locks in the folder are then of a Snakemake that was killed, and are removed. Returns None for a
    job of another Snakemake, which takes no lock.
    """
    parent = os.environ.get(BUILD)  # the process with which this Snakemake ends
    os.environ[BUILD] = str(os.getpid())
    if "--nolock" in sys.argv:  # a job of another Snakemake, on another computer perhaps
        return None
    if parent:
        end_with(int(parent), signal.SIGTERM, signal.SIGKILL)
    folder.mkdir(exist_ok=True)
    shared = (folder / "alive").open("a")
    try:
        fcntl.flock(shared, fcntl.LOCK_EX | fcntl.LOCK_NB)
        for lock in (folder / "locks").glob("*"):
            lock.unlink()
    except BlockingIOError:
        pass
    fcntl.flock(shared, fcntl.LOCK_SH)
    return shared


if __name__ == "__main__":
    end_with(int(os.environ[BUILD]), signal.SIGINT, signal.SIGKILL)
    sys.argv = sys.argv[1:]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
