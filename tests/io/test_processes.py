"""Processes that work beside this one: what they give, and how they end."""

import os
import signal
import subprocess
import sys
import time
from functools import partial

import pytest

from squeal.io.processes import mapped
from tests.conftest import SCENES

SCRIPT = """
import os, sys, time
from importlib import import_module
from pathlib import Path
from squeal.io.processes import mapped

if __name__ == "__mp_main__":  # as a process of the pool imports this
    (Path(sys.argv[1]) / str(os.getpid())).touch()
    time.sleep(1.0)

def work(*_):
    (Path(sys.argv[1]) / f"works {os.getpid()}").touch()
    time.sleep(30.0)
    (Path(sys.argv[1]) / f"done {os.getpid()}").touch()

def tasks():
    try:
        list(mapped(work, range(4), 2))
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return 130

if __name__ == "__main__":
    where, working, *arguments = sys.argv[2:]
    if where == "tasks":
        sys.exit(tasks())
    module, _, name = working.rpartition(".")
    setattr(import_module(module), name, work)
    sys.exit(import_module(where).main(arguments))
"""
COMMANDS = {
    "tasks": ("", "", "stopped\n"),
    "squeal.cli.main": (
        "squeal.analysis.variations._work",
        f"critical-friction {SCENES / 'b3.yaml'} --scatter spreads.yaml --workers 2",
        "squeal: stopped\n",
    ),
}


def test_results_come_in_the_order_of_the_tasks():
    for workers in (1, 2):
        assert list(mapped(abs, range(-7, 0), workers)) == [7, 6, 5, 4, 3, 2, 1]
        with pytest.raises(ValueError, match="non-hexadecimal"):
            list(mapped(bytes.fromhex, ["word"], workers))
        assert list(mapped(abs, [-3], workers)) == [3]


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize(
    ("command", "begun", "meets"),  # processes that work already; else they import
    [
        ("tasks", 0, os.killpg),
        *((command, 2, os.killpg) for command in COMMANDS),
        ("tasks", 2, os.kill),  # the parent alone
    ],
)
def test_an_interrupt_is_said_once(tmp_path, command, begun, meets):
    script, marks = tmp_path / "script.py", tmp_path / "marks"
    script.write_text(SCRIPT)
    marks.mkdir()
    (tmp_path / "spreads.yaml").write_text("spreads: {h: {relative: 0.1}}\n")
    (tmp_path / "job.yaml").write_text(
        f"sweep: {{scene: {SCENES / 'b1-c.yaml'}, values: '0:0.9:13'}}\n"
    )
    working, arguments, words = COMMANDS[command]
    running = subprocess.Popen(
        [sys.executable, script, marks, command, working, *arguments.split()],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # what a shell runs in the background ignores interrupts
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
        cwd=tmp_path,
    )
    wanted = 2 + begun
    while len(list(marks.iterdir())) < wanted and running.poll() is None:
        time.sleep(0.01)
    meets(running.pid, signal.SIGINT)
    _, told = running.communicate()
    assert (running.returncode, told) == (130, words)
    assert not list(marks.glob("done *"))
