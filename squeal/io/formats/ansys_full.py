"""Ansys' .full: K and M, one triangle each, without constrained rows.

They are read in a process of its own, of bounded memory, for Ansys' package trusts what a damaged
file says and takes its process down.
"""

import os
import pickle
import subprocess
import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from scipy.sparse import csc_array

from squeal.io.formats.matrix_file import MatrixFile

FULL_MEMORY = 800_000_000  # bytes to read a .full, for each 1e6 of its own


def read_full(path: Path) -> dict[str, MatrixFile]:
    """The matrices that `send_full` sends. Raises ImportError, ValueError."""
    if find_spec("ansys") is None:
        raise ImportError(name="ansys")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    program = "from squeal.io.formats.ansys_full import send_full; send_full()"
    command = [sys.executable, "-c", program, str(path)]
    process = subprocess.run(command, capture_output=True, env=environment)
    if process.returncode:
        raise ValueError("the file is damaged")
    answer = pickle.loads(process.stdout)
    if isinstance(answer, Exception):
        raise answer
    return dict(answer)


def send_full() -> None:
    """Write what stands in the file that the first argument names, or the error that it raises."""
    out = os.dup(1)
    os.dup2(2, 1)  # where the package prints to
    answer: dict[str, MatrixFile] | Exception
    try:
        answer = _read_in_child(Path(sys.argv[1]))
    except ImportError as error:
        answer = error
    except Exception as error:  # the package's own need not be known where it is read
        answer = ValueError(str(error))
    with open(out, "wb") as stream:
        pickle.dump(answer, stream)


def _read_in_child(path: Path) -> dict[str, MatrixFile]:
    """One triangle each of K and M without the constrained rows, by their names; what the file
    lacks is left out. Runs in the child process alone, whose memory it limits."""
    from ansys.mapdl.reader import read_binary

    with suppress(ImportError):  # Windows has no such limits
        import resource

        most = FULL_MEMORY * (1 + path.stat().st_size // 10**6)
        resource.setrlimit(resource.RLIMIT_DATA, (most, resource.RLIM_INFINITY))
    file = read_binary(str(path))
    rows, stiffness, mass = file.load_km()
    constrained = set(map(tuple, file.const.tolist()))
    free = []
    labels = []
    for i, (node, freedom) in enumerate(rows.tolist()):
        if (node, freedom) not in constrained:
            free.append(i)
            labels.append((node, freedom + 1))  # Ansys counts from 0, labels count from 1
    matrices = {}
    for name, matrix in {"K": stiffness, "M": mass}.items():
        if matrix is not None:
            free_part = csc_array(matrix)[free][:, free]
            matrices[name] = MatrixFile(free_part, tuple(labels), symmetric=True)
    return matrices
