"""Whatever is typed or read, a command answers with finite numbers or refuses in one line.

`make test` tries some hundred inputs, always the same; with ANY_INPUT=20000 in the environment
(`make any-input`) so many are drawn anew.
"""

import json
import os
import resource
import time

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from squeal.io.scene import SCENE
from squeal.io.system_keys import SYSTEM
from tests.conftest import SCENES
from tests.two_ways.asking import SEEDS, cases, pad_of, run

TOTAL = int(os.environ.get("ANY_INPUT", "0"))
SECONDS = 10.0
BYTES = 10**9
SYSTEM_FILE = {
    "parameters": {"mu": 0.2, "gap": 0.5},
    "M": {"file": "M.mtx"},
    "C": [[0.02, 0.0], [0.0, 0.01]],
    "K": [{"file": "K.txt"}, {"matrix": [[0, 1], [-1, 0]], "factor": "mu"}]
    + [{"matrix": [[1, 0], [0, -1]], "factor": "0.1*gap"}],
    "damping": {"structural": 0.01},
    "coordinates": {"file": "nodes.csv"},
}
FILES = {
    "system.yaml": yaml.safe_dump(SYSTEM_FILE, sort_keys=False),
    "M.mtx": "%%MatrixMarket matrix array real general\n2 2\n1\n0\n0\n1\n",
    "K.txt": "1,1, 4.\n1,2, -1.\n2,1, -1.\n2,2, 5.\n",
    "nodes.csv": "node,dof,x,y,z\n1,x,0,0,0.5\n1,y,0,0,0.5\n",
    "spreads.yaml": "samples: 8\nspreads: {gap: {within: 0.1}}\n",
    "modes.csv": "name,frequency_hz,damping_ratio,1:x\nA,0.3,0.01,1+0.1j\n",
    "scene.yaml": (SCENES / "b2-c.yaml").read_text(encoding="utf-8"),
}
SCATTER = "scatter", "system.yaml", "spreads.yaml", "--of", "growth", "--journal", "journal"
# the file that is damaged, and a command that reads it
READERS = (
    ("scene.yaml", ("eigenvalues", "scene.yaml")),
    ("scene.yaml", ("sliding", "scene.yaml")),
    ("system.yaml", ("eigenvalues", "system.yaml")),
    ("system.yaml", ("check", "system.yaml")),
    ("M.mtx", ("eigenvalues", "system.yaml")),
    ("K.txt", ("eigenvalues", "system.yaml")),
    ("nodes.csv", ("check", "system.yaml")),
    ("spreads.yaml", SCATTER[:5]),
    ("modes.csv", ("eigenvalues", "system.yaml", "--test", "modes.csv")),
    ("result.json", ("cite", "result.json")),
    ("journal", SCATTER),
)
WORDS = [
    "",
    "nan",
    ".inf",
    "1e400",
    "-1",
    "0",
    "1:0:5",
    "0:1:3",
    "mu:0:1",
    "k1=2",
    "mu=x",
    "gap=0.1",
]
WORDS += [
    "time.stop=1e-4",
    "a\x1b[2Jb",
    "\u202e",
    "\ud800",
    "a\0b",
    "9" * 400,
    "/dev/zero",
    "x.csv",
]
WORDS += [
    "none/x.png",
    "full",
    "modal",
    "2",
    "0:2",
    "-1:1:0:2",
    "a.K=K.txt",
    "{a: *b}",
    "!!float x",
]
FLAGS = "--set --band --sweep --max --min --at --modes --region --method --table --figure --shape"
FLAGS += " --scatter --test --n --first --second --change --workers --memory --json --help --to"
COMMANDS = ("eigenvalues", "critical-friction", "sliding", "check", "cite", "advise", "export")
TOKENS = [
    b"",
    b"\0",
    b"\x1b[2J",
    b"\xff",
    b"\r",
    b"\n",
    b" ",
    b"-",
    b"*a",
    b"&a ",
    b"{",
    b"[[",
    b":",
]
TOKENS += [
    b"1e999",
    b".nan",
    b"nan",
    b"-0.0",
    b"1e-320",
    b"9" * 400,
    b"!!float x",
    b'"',
    b"\t",
    b",",
]
TOKENS += [
    "\u202e\u2028".encode(),
    b"mu",
    b"0",
    b"2",
    b"'",
    b"|",
    b"null",
    b"true",
    b"%",
    b"$\\foo$",
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the files, the journal of a run and a result among them."""
    place = tmp_path_factory.mktemp("any")
    before = os.getcwd()
    os.chdir(place)
    for name, text in FILES.items():
        (place / name).write_text(text, encoding="utf-8")
    code, _, said = checked_run(*SCATTER)
    assert code == 0, said
    code, out, _ = checked_run("eigenvalues", "scene.yaml", "--json")
    assert code == 0
    (place / "result.json").write_text(out, encoding="utf-8")
    yield place
    os.chdir(before)


def checked_run(*arguments):
    """Exit code and output of a command that ends as one may: soon, with finite numbers or a line
    that says why not, and with no control character."""
    begun = time.process_time()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        code, out, said = run(*arguments)
    except SystemExit as end:  # of --help
        return end.code, "", ""
    assert time.process_time() - begun < SECONDS
    assert 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) < BYTES
    assert all(c.isprintable() or c in "\n\t" for c in out + said)
    assert code in (0, 1, 2)
    if code:
        assert out == ""
        assert said.splitlines()[-1].startswith("squeal: ")
        assert len([x for x in said.splitlines() if not x.startswith("squeal: warning: ")]) == 1
    elif "--json" in arguments:
        json.loads(out, parse_constant=pytest.fail)
    else:
        assert " nan" not in out
    return code, out, said


def paths(document, before=()):
    """Every place in a document, as the keys that lead to it."""
    entries = document.items() if isinstance(document, dict) else enumerate(document)
    for key, value in entries:
        yield (*before, key)
        if isinstance(value, dict | list):
            yield from paths(value, (*before, key))


def broken(document, rng):
    """A document with a change that no file may have, and a word of the place that was changed."""
    copy = json.loads(json.dumps(document))
    places = list(paths(copy))
    *before, key = places[rng.integers(len(places))]
    inner = copy
    for step in before:
        inner = inner[step]
    words = [*before, key]
    numeric = isinstance(inner[key], int | float) and not isinstance(inner[key], bool)
    wrong = ["unknown", "list"]
    if numeric:
        wrong += ["nan", "inf", "text", "long"]
    kind = str(rng.choice(wrong))
    if kind == "unknown" and isinstance(inner, dict) and words[0] != "parameters":
        inner["nosuch"] = inner.pop(key)
    elif numeric:
        values = {"nan": np.nan, "inf": -np.inf, "text": "a\x1b[2J b", "long": int("9" * 400)}
        inner[key] = values.get(kind, [[]])
    else:
        inner[key] = [[]]
    return copy


@cases(30, 0.2, TOTAL)
@given(SEEDS)
def test_broken_documents_are_refused(folder, seed):
    """A key that is unknown, a list, or no number in the place of one: never an answer."""
    rng = np.random.default_rng(seed)
    scene = bool(rng.integers(2))
    document = broken(pad_of(int(rng.integers(2**32))) if scene else SYSTEM_FILE, rng)
    (folder / "broken.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    code, _, said = checked_run("eigenvalues", "broken.yaml")
    assert code == 2, document
    assert "broken.yaml" in said


@cases(60, 0.3, TOTAL)
@given(st.sampled_from(READERS), SEEDS)
def test_damaged_files_are_read_or_refused(folder, reader, seed):
    """Bytes changed, cut out, doubled or put in; what a journal holds is noticed."""
    name, command = reader
    rng = np.random.default_rng(seed)
    whole = (folder / name).read_bytes()
    wanted = checked_run(*SCATTER, "--json") if name == "journal" else None
    data = bytearray(whole)
    for _ in range(rng.integers(1, 4)):
        first = int(rng.integers(len(data) + 1))
        last = min(first + int(rng.choice([0, 1, 4, len(data)])), len(data))
        token = TOKENS[rng.integers(len(TOKENS))]
        data[first:last] = rng.choice([token, 3 * token, bytes(data[first:last]) * 2])
    try:
        (folder / name).write_bytes(data)
        code, out, said = checked_run(*command, "--json")
        if name == "journal" and code == 0:
            # a last line that broke off is told, and its samples are computed again
            left_out = {"provenance": None, "warnings": None}
            assert json.loads(out) | left_out == json.loads(wanted[1]) | left_out
        if name == "journal":
            assert code != 1, said
    finally:
        (folder / name).write_bytes(whole)


@cases(60, 0.3, TOTAL)
@given(SEEDS)
def test_options_are_taken_or_refused(folder, seed):
    """Any options with any values, of any command, for a scene and for a system."""
    rng = np.random.default_rng(seed)
    command = str(rng.choice(COMMANDS))
    file = str(rng.choice(["scene.yaml", "system.yaml", "M.mtx", "", "none.yaml"]))
    arguments = [command] if command == "cite" else [command, file]
    for _ in range(rng.integers(0, 3)):
        arguments.append(str(rng.choice(FLAGS.split())))
        word = WORDS[rng.integers(len(WORDS))]
        if rng.integers(5):
            arguments.append(word)
    checked_run(*arguments)


@cases(10, 0.2, TOTAL)
@given(SEEDS)
def test_valid_scenes_and_systems_are_answered(folder, seed):
    """Without an exception of ours: 0, or 1 with a reason, never refused."""
    rng = np.random.default_rng(seed)
    scene = pad_of(seed)
    (folder / "valid.yaml").write_text(yaml.safe_dump(scene), encoding="utf-8")
    assert checked_run("eigenvalues", "valid.yaml", "--json")[0] in (0, 1)
    numbers = {"mu": float(rng.uniform(0, 2)), "gap": float(rng.uniform(-2, 2))}
    system = SYSTEM_FILE | {"parameters": numbers}
    (folder / "valid.yaml").write_text(yaml.safe_dump(system), encoding="utf-8")
    assert checked_run("eigenvalues", "valid.yaml", "--json")[0] == 0


def test_every_key_is_known_to_what_is_broken_here():
    assert {*SYSTEM_FILE} <= {*SYSTEM.keys}
    assert {*pad_of(0)} <= {*SCENE.keys}
