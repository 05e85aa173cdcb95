"""Processes that work beside this one: what they give, and how they end."""

import os
import signal
import subprocess
import sys
import time
from functools import partial

import pytest

from squeal.cli.main import main
from squeal.errors import ComputationError
from squeal.io.processes import mapped
from squeal.numerics.threads import threads_of_a_verb
from tests.cli.calls import words
from tests.conftest import SCENES

# what a shell runs in the background ignores interrupts
INTERRUPTED = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
SCRIPT = """
import os, signal, sys, threading, time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

MARKS = Path("marks")
submit = ProcessPoolExecutor.submit

if __name__ == "__mp_main__":  # as a process of the pool imports this
    (MARKS / str(os.getpid())).touch()
    if Path("stuck").exists():
        time.sleep(100.0)

def work(*_):
    (MARKS / f"works {os.getpid()}").touch()
    time.sleep(100.0)
    (MARKS / f"done {os.getpid()}").touch()
    os._exit(0)

def interrupt(send, marks):
    while len(list(MARKS.iterdir())) < marks:
        time.sleep(0.01)
    send(os.getpid(), signal.SIGINT)

def interrupted_submit(*task):
    signal.raise_signal(signal.SIGINT)
    return submit(*task)

if __name__ == "__main__":
    from squeal.queries import scatter
    from squeal.cli.main import main
    scatter.samples_of = work
    INTERRUPTS
    sys.exit(main(sys.argv[1:]))
"""
INTERRUPTED_AT_THE_FIFTH_CHUNK = """
import signal, sys

if __name__ == "__main__":
    from squeal.cli.main import main
    from squeal.queries import sample_journal
    append = sample_journal.append

    def append_four(path, number, samples):
        if number == 4:
            signal.raise_signal(signal.SIGINT)
        append(path, number, samples)

    sample_journal.append = append_four
    sys.exit(main(sys.argv[1:]))
"""


def test_results_come_in_the_order_of_the_tasks():
    """And an exception where its task stands."""
    for workers, in_threads in [(1, False), (2, False), (3, True)]:
        with threads_of_a_verb(workers):
            results = mapped(bytes.fromhex, ["01", "02", "03", "04", "word"], in_threads)
            assert [next(results)[0] for _ in range(4)] == [1, 2, 3, 4]
            with pytest.raises(ValueError, match="non-hexadecimal"):
                next(results)
            assert list(mapped(partial(pow, 2), range(3), in_threads)) == [1, 2, 4]


class Deadly:
    """Ends the process that it is sent to."""

    def __reduce__(self):
        return os._exit, (9,)


@pytest.mark.parametrize("work", [partial(pow, Deadly()), os._exit])
def test_a_process_that_is_killed_is_said(work):
    with threads_of_a_verb(2), pytest.raises(ComputationError, match="was killed"):
        list(mapped(work, range(9)))


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize(
    ("processes", "interrupts"),
    [
        ("start", "ProcessPoolExecutor.submit = interrupted_submit"),
        ("import", "threading.Thread(target=interrupt, args=(os.killpg, 2), daemon=True).start()"),
        ("work", "threading.Thread(target=interrupt, args=(os.kill, 4), daemon=True).start()"),
    ],
)
def test_an_interrupt_is_said_once(tmp_path, processes, interrupts):
    """Sent to all processes, or to the parent alone."""
    (tmp_path / "script.py").write_text(SCRIPT.replace("INTERRUPTS", interrupts))
    (tmp_path / "marks").mkdir()
    if processes == "import":
        (tmp_path / "stuck").touch()
    (tmp_path / "spreads.yaml").write_text("spreads: {h: {relative: 0.1}}\n")
    command = f"scatter {SCENES / 'b3.yaml'} spreads.yaml --workers 2"
    done = subprocess.run(
        [sys.executable, "script.py", *words(command)],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=INTERRUPTED,
        cwd=tmp_path,
    )
    assert (done.returncode, done.stderr) == (130, "squeal: stopped\n")
    assert not list((tmp_path / "marks").glob("done *"))


def ended(capsys, *arguments):
    """Exit code and standard output of a command in this process."""
    code = main(list(arguments))
    return code, capsys.readouterr().out


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("workers", ["1", "2"])
def test_an_interrupted_run_goes_on_to_the_same_bytes(tmp_path, monkeypatch, capsys, workers):
    monkeypatch.chdir(tmp_path)
    system = "K: [{matrix: [[1]], factor: a}, {matrix: [[-1]], factor: mu}]\n"
    (tmp_path / "one.yaml").write_text("parameters: {a: 1.0}\nM: [[1]]\n" + system)
    (tmp_path / "spreads.yaml").write_text("samples: 120\nspreads: {a: {within: 0.5}}\n")
    (tmp_path / "script.py").write_text(INTERRUPTED_AT_THE_FIFTH_CHUNK)
    journal = tmp_path / "run.jsonl"
    table = tmp_path / "table.csv"
    command = ["scatter", "one.yaml", "spreads.yaml", "--of", "growth", "--csv", table.name]
    interrupted = subprocess.run(
        [sys.executable, "script.py", *command, "--workers", workers, "--journal", journal.name],
        preexec_fn=INTERRUPTED,
        stderr=subprocess.DEVNULL,
    )
    assert interrupted.returncode == 130
    assert journal.read_text().count("\n") == 1 + 4
    resumed = ended(capsys, *command, "--journal", journal.name), table.read_bytes()
    at_once = ended(capsys, *command), table.read_bytes()
    assert resumed == at_once
    assert resumed[0][0] == 0


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_no_process_outlives_its_parent(tmp_path):
    (tmp_path / "marks").mkdir()
    (tmp_path / "script.py").write_text(SCRIPT.replace("INTERRUPTS", ""))
    (tmp_path / "spreads.yaml").write_text("spreads: {h: {relative: 0.1}}\n")
    command = f"scatter {SCENES / 'b3.yaml'} spreads.yaml --workers 2"
    script = [sys.executable, "script.py", *words(command)]
    running = subprocess.Popen(script, cwd=tmp_path, stdout=subprocess.PIPE)
    while not list((tmp_path / "marks").glob("works *")):
        assert running.poll() is None
        time.sleep(0.01)
    running.kill()  # which leaves it no time to end others itself
    running.communicate()  # to the end of the last process that could print
    assert not list((tmp_path / "marks").glob("done *"))
