"""Figures drawn by forks of one process that has loaded what they need, which halves their time.

The workflow starts that process, `python -m squeal.article.figures --for-others SOCKET`. The same
program asks it for a figure, and draws by itself where none answers.
"""

import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable
from functools import cache
from pathlib import Path

VARIABLE = "SQUEAL_DRAWING"
"""The variable of the environment that names the socket."""
FOR_OTHERS = "--for-others"
Draw = Callable[[list[str]], int]
"""Draws with the words of a command line and returns 0, 2 for a refusal."""


@cache  # which keeps the folder and the input's other end as long as this process lives
def start(program: str) -> tuple[tempfile.TemporaryDirectory[str], subprocess.Popen[bytes]]:
    """Start the process that draws, and name its socket in the environment."""
    folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
    os.environ[VARIABLE] = str(Path(folder.name) / "socket")
    command = [sys.executable, "-m", program, FOR_OTHERS, os.environ[VARIABLE]]
    # in a session of its own it is not interrupted together with this process, but ends after it
    return folder, subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True)


def ask(words: list[str]) -> int | None:
    """What drawing with some words of a command line returns, None where nobody draws."""
    if VARIABLE not in os.environ:
        return None
    with socket.socket(socket.AF_UNIX) as asking:
        try:
            asking.connect(os.environ[VARIABLE])
        except OSError:  # it is not ready yet, or lives on another machine
            return None
        socket.send_fds(asking, [json.dumps([os.getcwd(), *words]).encode()], [sys.stderr.fileno()])
        return next(iter(asking.recv(1)), 1)


def serve(path: str, draw: Draw) -> None:
    """Draw for everybody who asks, each in a fork, until the standard input ends."""
    import matplotlib.backends.backend_pdf
    import matplotlib.figure  # noqa: F401

    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for the forks
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(path)
        server.listen()
        while sys.stdin not in select.select([server, sys.stdin], [], [])[0]:
            asked, _ = server.accept()
            with asked:
                if os.fork() == 0:
                    _draw(asked, draw)


def _draw(asked: socket.socket, draw: Draw) -> None:
    code = 1
    try:
        sent, errors, _, _ = socket.recv_fds(asked, 1 << 16, 1)
        os.dup2(errors[0], sys.stderr.fileno())
        folder, *words = json.loads(sent)
        os.chdir(folder)
        code = draw(words)
    except SystemExit as refused:  # of the command line
        code = 2 if refused.code else 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        asked.send(bytes([code]))
        os._exit(0)


def run(draw: Draw) -> int:
    """The program that draws: for others, through another process, or by itself."""
    words = sys.argv[1:]
    if words[:1] == [FOR_OTHERS]:
        serve(words[1], draw)
        return 0
    drawn = ask(words)
    return draw(words) if drawn is None else drawn
