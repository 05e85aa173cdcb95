"""Processes that work beside this one: what they give, and how they end."""

import os
import subprocess
import sys
import time

import pytest

from squeal.simulation.batch.processes import mapped

SCRIPT = """
import os, sys, time
from pathlib import Path
from squeal.simulation.batch.processes import mapped

if __name__ == "__mp_main__":  # as a process of the pool imports this
    (Path(sys.argv[1]) / str(os.getpid())).touch()
    time.sleep(1.0)

def work(i):
    (Path(sys.argv[1]) / f"works {os.getpid()}").touch()
    time.sleep(30.0)

if __name__ == "__main__":
    try:
        mapped(work, range(4), 2)
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        sys.exit(130)
"""


def test_results_come_in_the_order_of_the_tasks():
    assert mapped(abs, range(-7, 0), 2) == [7, 6, 5, 4, 3, 2, 1]
    with pytest.raises(ValueError, match="non-hexadecimal"):
        mapped(bytes.fromhex, ["word"], 2)
    assert mapped(abs, [-3], 2) == [3]


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("begun", [0, 2])  # processes that work already; else they import
def test_an_interrupt_is_said_once(tmp_path, begun):
    script, marks = tmp_path / "script.py", tmp_path / "marks"
    script.write_text(SCRIPT)
    marks.mkdir()
    running = subprocess.Popen(
        [sys.executable, script, marks], stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    wanted = 2 + begun
    while len(list(marks.iterdir())) < wanted and running.poll() is None:
        time.sleep(0.01)
    os.killpg(running.pid, 2)
    _, told = running.communicate()
    assert (running.returncode, told) == (130, "stopped\n")
