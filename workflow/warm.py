"""Programs run by forks of processes that have loaded what most of them need.

`python -m workflow.warm MODULE ARGUMENT ...` is `python -m MODULE ARGUMENT ...`, run by a fork of
one of the two processes that the workflow starts, or by itself where none answers.
"""

import contextlib
import os
import socket
import sys
from collections.abc import Callable
from functools import cache, partial

VARIABLE = "SQUEAL_WARM"
"""The variable of the environment that names the folder of the sockets."""
FOR_OTHERS = "--for-others"
LIGHT, HEAVY = "light", "heavy"
"""The sockets: of the process that has loaded what all need, and of that with packages that take
long to load and that only some need: results name those of their own that were loaded."""
LOADED = {
    LIGHT: ("heyoka", "squeal.article.studies.ensembles"),
    HEAVY: ("matplotlib.backends.backend_pdf", "control", "squeal.article.studies.ensembles"),
}
NEED_CONTROL = ("eigenvalues", "loci", "precision")
"""The studies that load it."""


@cache  # which keeps the folder and the inputs' other ends as long as this process lives
def start() -> tuple[object, list[object]]:
    """Start the processes whose forks run programs, and name their folder in the environment."""
    import subprocess
    import tempfile

    folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
    os.environ[VARIABLE] = folder.name
    command = [sys.executable, "-m", "workflow.warm", FOR_OTHERS]
    # in sessions of their own they are not interrupted together with this process, but end after it
    return folder, [
        subprocess.Popen(
            [*command, f"{folder.name}/{name}"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )
        for name in LOADED
    ]


def kind(words: list[str]) -> str:
    """Which process runs a program with its arguments."""
    if words[0] == "squeal.article.figures":
        return HEAVY
    studies = words[0] == "squeal.article.studies"
    return HEAVY if studies and words[1:2] and words[1] in NEED_CONTROL else LIGHT


def ask(words: list[str]) -> int | None:
    """The exit code of a program with its arguments, run by a fork; None where nobody answers."""
    if VARIABLE not in os.environ:
        return None
    with socket.socket(socket.AF_UNIX) as asking:
        try:
            asking.connect(f"{os.environ[VARIABLE]}/{kind(words)}")
        except OSError:  # it has not begun yet, or lives on another machine
            return None
        streams = [sys.stdout.fileno(), sys.stderr.fileno()]
        socket.send_fds(asking, [os.fsencode("\0".join([os.getcwd(), *words]))], streams)
        return next(iter(asking.recv(1)), 1)


def load(process: str) -> None:
    """Import what its programs need; to draw once reads fonts and how formulas are set, and to tell
    once where a result comes from reads what all modules import."""
    import io
    from importlib import import_module

    from squeal.io.provenance import provenance

    for name in LOADED[process]:
        with contextlib.suppress(ImportError):  # heyoka is not made for every system
            import_module(name)
    provenance((), LOADED[process][-1])
    if process == LIGHT:
        return
    from matplotlib.figure import Figure

    from squeal.plots.style import style

    with style():
        figure = Figure(layout="constrained")
        figure.subplots().set_title(r"words and $\mu^2$")
        figure.savefig(io.BytesIO(), format="pdf")


def serve(path: str, load: Callable[[], None] = lambda: None) -> None:
    """Run programs for everybody who asks, each in a fork, until the standard input ends.

    Who asks while this process still has to `load` waits for it: that is shorter than to load the
    same.
    """
    import select
    import signal

    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for the forks
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(path)
        server.listen()
        load()
        while sys.stdin not in select.select([server, sys.stdin], [], [])[0]:
            asked, _ = server.accept()
            with asked:
                if os.fork() == 0:
                    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                    _answer(asked)


def _answer(asked: socket.socket) -> None:
    import fcntl

    code = 1
    try:
        sent, streams, _, _ = socket.recv_fds(asked, 1 << 16, 2)
        for own, other in zip((sys.stdout, sys.stderr), streams, strict=True):
            os.dup2(other, own.fileno())
        # who asked says no more: that it is gone is a signal, which ends this process
        fcntl.fcntl(asked, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(asked, fcntl.F_SETFL, os.O_ASYNC | os.O_NONBLOCK)
        with contextlib.suppress(BlockingIOError):
            asked.recv(1)  # it was gone before
            return
        folder, *words = os.fsdecode(sent).split("\0")
        os.chdir(folder)
        code = run(words)
        sys.stdout.flush()
        asked.send(bytes([code]))
    finally:
        os._exit(code)


def run(words: list[str]) -> int:
    """Run a program with its arguments as `python -m` does; returns its exit code."""
    import runpy
    import traceback

    sys.argv[1:] = words[1:]
    try:
        runpy.run_module(words[0], run_name="__main__", alter_sys=True)
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            return end.code or 0
        print(end.code, file=sys.stderr)
        return 1
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


def main() -> int:
    """Serve others, ask a process that does, or run a program here."""
    words = sys.argv[1:]
    if words[:1] == [FOR_OTHERS]:
        serve(words[1], partial(load, os.path.basename(words[1])))
        return 0
    done = ask(words)
    return run(words) if done is None else done


if __name__ == "__main__":
    sys.exit(main())
