"""Coverage-guided fuzz of the readers: `make fuzz`, or `python -m benchmarks.fuzz [TARGET ...]`.

Each target, of `TARGETS`, runs in a child process by atheris (group `fuzz`), which keeps inputs
that reach new code and changes those. Seeds are files of the tests and what `_seeds` writes. What
may come of an input is an answer of finite numbers or a refusal (InputError); anything else, more
than 1 GB or 10 s is a finding: its input is kept in --folder, and the child goes on, or another one
in its place after a crash. `--runs N` are executions of each target; `--replay FILE` runs one input
of a target once.
"""

import argparse
import io
import json
import math
import mmap
import os
import re
import resource
import struct
import subprocess
import sys
import tempfile
import traceback
import warnings
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parent.parent
SECONDS = 10
BYTES = 10**9
SHORT = 20_000  # bytes of an input
CUT = b"|next|"  # between the members of an archive
SYSTEM = "M: {file: M.mtx}\nK: [{file: K.mtx}, {matrix: [[0, 1], [-1, 0]], factor: mu}]\n"
BODY = SYSTEM + "coordinates: {file: nodes.csv}\n"
SMALL = "M: {matrix: [[1, 0], [0, 1]]}\nK: {matrix: [[2, 0], [0, 3]]%s}\n%s\n"
ASSEMBLY = """\
components: {a: {file: a.yaml, load: {file: load.csv}}, b: {file: b.yaml}}
contact: [{between: [a, b], %s, normal: [1, 0, 0], stiffness: 4, friction: 0.1}]
"""
BESIDE = {
    "M.mtx": "%%MatrixMarket matrix array real general\n2 2\n1\n0\n0\n1\n",
    "K.mtx": "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 5\n2 2 6\n2 1 -1\n",
    "K.txt": "1,1, 1,1, 4.\n1,1, 1,2, -1.\n1,2, 1,2, 4.\n",
    "nodes.csv": "node,dof,x,y,z\n1,x,0,0,0\n2,x,1,0,0\n",
    "load.csv": "node,dof,force\n2,x,-3\n",
    "pairs.csv": "first,second,area\n1,1,0.5\n2,2,0.5\n",
    "ratios.csv": "frequency,ratio\n0.1,0.01\n1,0.02\n",
    "moduli.csv": "frequency,storage,loss\n0.1,1,0.01\n1,2,0.02\n",
    "modes.csv": "name,frequency_hz,damping_ratio,1:x\nA,0.3,0.01,1+0.1j\n",
    "elements.csv": "element,type,c1,c2,c3\n1,triangle,1,2,3\n",
    "three.csv": "node,dof,x,y,z\n1,x,0,0,0\n2,x,1,0,0\n3,fixed,0,1,0\n",
    "a.yaml": BODY,
    "b.yaml": BODY,
}
TABLES = {  # what names the table "given.csv", and such a table
    "nodes.csv": SMALL % ("", "coordinates: {file: given.csv}"),
    "elements.csv": SMALL % ("", "coordinates: {file: three.csv}\nelements: {file: given.csv}"),
    "ratios.csv": SMALL % ("", "damping: {ratios: {file: given.csv}}"),
    "moduli.csv": SMALL % (", modulus: {file: given.csv}", ""),
    "pairs.csv": "",
    "load.csv": "",
    "modes.csv": "",
}
SUFFIXES = (".mtx", ".mat", ".npz", ".hb", ".op4", ".op2", ".pch", ".full", ".txt", ".sti")


def _finite(value: Any) -> bool:
    if isinstance(value, dict | list | tuple):
        return all(map(_finite, value.values() if isinstance(value, dict) else value))
    return not isinstance(value, float) or math.isfinite(value)


def document(data: bytes) -> None:
    """A scene, system or assembly. It says what was read, and is read again from that."""
    from squeal import schema
    from squeal.errors import InputError
    from squeal.io import scene, system_files

    at = schema.Place("given.yaml")
    found = schema.parse_document(data, at)
    text = json.dumps(found)  # which is YAML, in letters without accents, but for infinity
    try:
        again = schema.parse_document(text.encode(), at)
    except InputError as error:
        raise AssertionError(f"not read again: {error}") from None
    assert json.dumps(again) == text or not _finite(found), "another document"
    if found.keys().isdisjoint(("M", "components")):
        made = scene.Scene.from_dict(found, at)
        assert _finite(made.to_dict()), "not finite"
        assert scene.Scene.from_dict(made.to_dict(), at) == made, "another scene"
    else:
        _asked(system_files.system_file(found, at, Path(), (0.1, 1.0)))


def _asked(file: Any) -> None:
    """The matrices of a system are finite, or refused where they are made of formulas."""
    import numpy as np

    for X in filter(lambda part: part is not None, file.system.at()):
        numbers = X.data if hasattr(X, "indptr") else X
        assert np.all(np.isfinite(numbers)), "not finite"
    if file.coordinates is not None:
        file.coordinates.displacements(np.ones(file.system.n))


def formula(data: bytes) -> None:
    """The value is that of Python's own arithmetic; slope and bound are numbers."""
    from squeal.errors import InputError
    from squeal.numerics.differentiation import Formula

    text = data.decode("utf-8", "surrogateescape")
    at = {"mu": 0.3, "a": 2.0, "b": -1.5}
    found = Formula(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        plain = re.sub(r"(?<![\w.])\d[\d_]*(?![\w.])", lambda m: f"float({m[0]!r})", text.strip())
        try:
            wanted = eval(plain, {"__builtins__": {}, "float": float}, at)
        except Exception:
            wanted = None
    for name in ("a", "mu"):
        try:
            value = found.value(at)
            slope = found.slope(at, name)
        except InputError:
            continue
        assert _finite([value, slope]), "not finite"
        same = isinstance(wanted, int | float) and math.isclose(value, wanted, rel_tol=1e-12)
        assert wanted is None or same, f"{value} for {wanted}"
        assert found.curvature(at, name, 0.1, 0.4) >= 0.0, "no bound"


def table(data: bytes) -> None:
    """A table beside a system file: coordinates, elements, damping, pairs, loads or a test."""
    from squeal import schema
    from squeal.io import components, system_files
    from squeal.io.loads import read_load
    from squeal.queries.compare import read_test

    name = list(TABLES)[data[0] % len(TABLES)] if data else "nodes.csv"
    path = Path("given.csv")
    at = schema.Place("given.yaml")
    body = _body()
    path.write_bytes(data[1:])
    if name == "modes.csv":
        assert _finite([mode[0] for mode in read_test(path, body[0])])
    elif name == "pairs.csv":
        assert _finite(sum(map(float, components._table_of_pairs(path).get("area", ()))))
    elif name == "load.csv":
        assert _finite(read_load(path, body[1], body[0]).tolist())
    else:
        _asked(system_files.system_file(yaml.safe_load(TABLES[name]), at, Path()))


@cache
def _body() -> tuple[Any, Any]:
    """Coordinates and a component that tables name nodes of."""
    from squeal.io import system_files
    from squeal.sparse.components import Component

    file = system_files.read_system("a.yaml")
    where: Any = file.coordinates
    nodes = [where.names[k] for k in where.nodes]
    return where, Component(file.system, nodes, where.directions, where.places[where.nodes])


def matrix(data: bytes) -> None:
    """A matrix file, its format by the first byte; archives are packed from their members."""
    import numpy as np

    from squeal.io.matrices import fingerprint, read_matrix

    suffix = SUFFIXES[data[0] % len(SUFFIXES)] if data else ""
    path = Path(f"given{suffix}")
    body = data[1:]
    if suffix == ".npz" and body[:2] != b"PK":
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            names = ("format", "shape", "data", "indices", "indptr")
            for name, member in zip(names, body.split(CUT), strict=False):
                archive.writestr(f"{name}.npy", member)
        body = stream.getvalue()
    elif suffix == ".mat" and data[0] >= 128:
        packed = zlib.compress(body[128:])
        body = body[:128] + struct.pack("<II", 15, len(packed)) + packed
    path.write_bytes(body)
    found = read_matrix(path, symmetric=[None, True, False][data[0] % 3] if data else None)
    assert np.all(np.isfinite(found.matrix.data)), "not finite"
    assert found.matrix.nnz <= 40 * len(data) + 40, "more entries than the file can hold"
    fingerprint(found.matrix)


TARGETS: dict[str, Callable[[bytes], None]] = {
    one.__name__: one for one in (document, formula, table, matrix)
}


def _seeds(target: str) -> list[bytes]:
    """Inputs to begin with."""
    import numpy as np
    from scipy.io import hb_write, savemat
    from scipy.sparse import csc_array

    from squeal.io.matrices import write_matrix
    from tests.io.test_matrices import REFUSED

    if target == "formula":
        texts = ("1", "mu", "1/a - 1", "-a**2*(b + 0.5)", "0.1 - 0.2/(1 + ((mu - 0.6)/1e-3)**2)")
        return [text.encode() for text in texts]
    if target == "table":
        return [bytes([k]) + BESIDE[name].encode() for k, name in enumerate(TABLES)]
    if target == "document":
        files = [*ROOT.glob("tests/*/*.yaml"), *ROOT.glob("workflow/scenes/*.yaml")]
        more = [BODY, ASSEMBLY % "distance: 0.1", ASSEMBLY % "pairs: {file: pairs.csv}"]
        more += filter(None, TABLES.values())
        text = ROOT.joinpath("docs/scene.md").read_text(encoding="utf-8")
        more += re.findall(r"(?s)```yaml\n(.*?)```", text)
        return [file.read_bytes() for file in files] + [text.encode() for text in more]
    seeds = []
    for name, content, *_ in REFUSED:
        kind = SUFFIXES.index(Path(name).suffix) if Path(name).suffix in SUFFIXES else 0
        if content is not None:
            given: Any = content
            seeds.append(bytes([kind]) + (given if isinstance(given, bytes) else given.encode()))
    some = np.array([[4.0, -1.0, 0.0], [-1.0, 3.0, 0.5], [0.0, 0.5, 2.0]])
    for suffix in (".mtx", ".mat", ".npz"):
        for X in (some, some * (1 + 0.1j)):
            write_matrix(f"seed{suffix}", X)
            seeds.append(bytes([SUFFIXES.index(suffix)]) + Path(f"seed{suffix}").read_bytes())
    with zipfile.ZipFile("seed.npz") as archive:
        members = [archive.read(f"{n}.npy") for n in ("format", "shape", "data", "indices")]
        members.append(archive.read("indptr.npy"))
        seeds.append(b"\2" + CUT.join(members))
    savemat("seed.mat", {"K": some, "text": "a"})
    seeds += [bytes([first]) + Path("seed.mat").read_bytes() for first in (1, 131)]
    hb_write("seed.hb", csc_array(some))
    seeds.append(b"\3" + Path("seed.hb").read_bytes())
    lines = [f"{i},1,{j},1,{some[i - 1, j - 1]}" for i in (1, 2, 3) for j in (1, 2, 3)]
    seeds += [b"\10" + ("*MATRIX INPUT, NAME=K\n" + "\n".join(lines) + "\n").encode()]
    seeds += [b"\6" + b"DMIG,K,0,6,1\nDMIG,K,1,1,,1,1,2.\nDMIG,K,2,1,,1,1,-1.\n,,2,1,3.\n"]
    for extra, write in (("pyyeti", _op4), ("h5py", _hdf5)):
        try:
            seeds += write(some)
        except ImportError:
            print(f"without {extra}", file=sys.stderr)
    return seeds


def _op4(some: Any) -> list[bytes]:
    from pyyeti.nastran import op4

    for k, binary in enumerate((False, True)):
        op4.write(f"seed{k}.op4", {"K": some}, binary=binary)
    return [b"\4" + Path(f"seed{k}.op4").read_bytes() for k in range(2)]


def _hdf5(some: Any) -> list[bytes]:
    import h5py

    with h5py.File("seed.h5", "w", userblock_size=512) as file:
        file["K"] = some
        group = file.create_group("S")
        group.attrs["MATLAB_sparse"] = 3
        group["data"] = some[0]
        group["ir"] = [0, 1, 2]
        group["jc"] = [0, 1, 2, 3]
    head = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    return [b"\1" + head + Path("seed.h5").read_bytes()[128:]]


def _words() -> str:
    """What libFuzzer puts into inputs: keys of files, and words that formats know."""
    from squeal.io.components import ASSEMBLY as assembly
    from squeal.io.scene import SCENE
    from squeal.io.system_keys import SYSTEM as system
    from squeal.io.system_keys import TERM

    groups = (SCENE, system, assembly, TERM)
    keys = sorted({path[-1] for group in groups for path, _ in group._paths()})
    keys += ["%%MatrixMarket matrix ", "coordinate", "array", "complex", "symmetric", "pattern"]
    keys += ["*MATRIX INPUT", "TYPE=SYMMETRIC", "DMIG", "1e308", "nan", "inf", ".nan", "-0", "&a "]
    keys += ["*a", "!!float ", "<<: ", "2147483648", "9" * 20, "1e-320", "\\xff\\xff\\xff\\xff"]
    return "".join(f'"{key}"\n' for key in keys)


class Findings:
    """Kinds of failure, each with the input that first met it."""

    def __init__(self, folder: Path, target: str) -> None:
        self.folder = folder
        self.target = target
        self.seen = {one.stem for one in folder.glob(f"{target}-*")}

    def add(self, data: bytes, words: str, key: str) -> None:
        """Keep an input, unless one of its kind was met before."""
        name = f"{self.target}-{sha256(key.encode()).hexdigest()[:8]}"
        if name not in self.seen:
            self.seen.add(name)
            (self.folder / f"{name}.input").write_bytes(data)
            (self.folder / f"{name}.txt").write_text(words, encoding="utf-8", errors="replace")


def judged(target: str, data: bytes) -> tuple[str, str] | None:
    """What is wrong with how an input ends, and what tells it from others; None if nothing is."""
    from squeal.errors import ComputationError, InputError

    begun = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            TARGETS[target](data)
        words = ""
    except (InputError, ComputationError) as error:
        words = str(error)
        if "\n" in words or len(words) > 2000 or not words.isprintable():
            return f"long: {words}", "long " + "".join(traceback.format_tb(error.__traceback__))
    except BaseException as error:
        text = traceback.format_exc()
        frames = [line for line in text.splitlines() if line.startswith("  File")][-3:]
        return text, f"{type(error).__name__} {frames}"
    if re.search("allocate|MemoryError", words):
        return words, "memory"
    took = resource.getrusage(resource.RUSAGE_SELF).ru_utime - begun
    return (f"{took:.1f} s: {words}", f"slow {words[:40]}") if took > SECONDS / 4 else None


def _takes(target: str, data: bytes) -> bool:
    """Does an input take more than the memory that is allowed, where more may be had?"""
    if not (pid := os.fork()):
        resource.setrlimit(resource.RLIMIT_AS, (8 * BYTES, resource.RLIM_INFINITY))
        judged(target, data)
        os._exit(0)
    _, status, used = os.wait4(pid, 0)
    here = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return bool(status) or 1024 * (used.ru_maxrss - here) > BYTES


def _child(target: str, folder: Path, corpus: Path, runs: int) -> None:
    """Run a target; a counter in the folder says how often, also after a crash."""
    import atheris

    with atheris.instrument_imports(include=["squeal", "yaml", "pyyeti"]):
        pass
    for one in sorted(corpus.iterdir())[:200]:  # what loads late
        judged(target, one.read_bytes())
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + BYTES, resource.RLIM_INFINITY))
    findings = Findings(folder, target)
    with (folder / f"{target}.count").open("r+b") as file:
        count = mmap.mmap(file.fileno(), 8)

    def once(data: bytes) -> None:
        count[:] = struct.pack("<q", struct.unpack("<q", count[:])[0] + 1)
        wrong = judged(target, data)
        # what was asked for may not have been used
        if wrong and "memory" in wrong[1].lower() and not _takes(target, data):
            return
        if wrong:
            findings.add(data, *wrong)

    options = [f"-runs={runs}", f"-timeout={60 * SECONDS}", f"-max_len={SHORT}", "-rss_limit_mb=0"]
    options += [f"-artifact_prefix={folder}/{target}-", f"-dict={folder}/words", "-verbosity=0"]
    atheris.Setup([sys.argv[0], *options, str(corpus)], once, enable_python_coverage=True)
    atheris.Fuzz()


def run(target: str, folder: Path, runs: int) -> int:
    """Run a target so often, in as many child processes as that takes; how often it ran."""
    corpus = folder / f"corpus-{target}"
    counter = folder / f"{target}.count"
    corpus.mkdir(exist_ok=True)
    counter.write_bytes(bytes(8))
    done = 0
    command = [sys.executable, "-m", "benchmarks.fuzz", target]
    with tempfile.TemporaryDirectory(dir="/dev/shm") as place:
        os.chdir(place)
        for name, text in BESIDE.items():
            Path(name).write_text(text, encoding="utf-8")
        for seed in _seeds(target):
            (corpus / sha256(seed).hexdigest()[:16]).write_bytes(seed)
        path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
        more = {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}
        while done < runs:
            child = [*command, "--folder", str(folder), "--child", str(runs - done)]
            ended = subprocess.run(child, env=os.environ | more, capture_output=True, check=False)
            before = done
            done = struct.unpack("<q", counter.read_bytes())[0]
            if ended.returncode:
                tail = ended.stderr.decode(errors="replace")[-3000:]
                Findings(folder, target).add(b"", tail, f"{ended.returncode} {tail[-200:]}")
            print(f"{target}: {done} executions, exit code {ended.returncode}", flush=True)
            if done == before:
                break
    return done


def main() -> None:
    """Run the targets, or one input."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("targets", nargs="*", choices=[[], *TARGETS], metavar="TARGET")
    parser.add_argument("--runs", type=int, default=250_000)
    parser.add_argument("--folder", type=Path, default=Path("logs/fuzz"))
    parser.add_argument("--replay", type=Path)
    parser.add_argument("--child", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    folder = given.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    targets = given.targets or list(TARGETS)
    if given.replay is not None:
        data = given.replay.read_bytes()
        with tempfile.TemporaryDirectory() as place:
            os.chdir(place)
            for name, text in BESIDE.items():
                Path(name).write_text(text, encoding="utf-8")
            found = judged(targets[0], data)
            print(found[0] if found else "nothing is wrong")
        raise SystemExit(bool(found))
    if given.child:
        return _child(targets[0], folder, folder / f"corpus-{targets[0]}", given.child)
    (folder / "words").write_text(_words(), encoding="utf-8")
    done = {target: run(target, folder, given.runs) for target in targets}
    kinds = Counter(one.name.split("-")[0] for one in folder.glob("*.txt"))
    print(f"{sum(done.values())} executions: {done}")
    print(f"{sum(kinds.values())} findings in {folder}: {dict(kinds)}")
    raise SystemExit(bool(kinds))


if __name__ == "__main__":
    main()
