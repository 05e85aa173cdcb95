"""The answers of two states of the program: stored by one, compared by the other.

`python -m benchmarks.same store FOLDER` draws pads, systems and broken files by a seed, asks every
verb of the command line and of Python about them, and writes inputs and answers to FOLDER (which
must not exist): about a thousand answers in three minutes. `python -m benchmarks.same compare
FOLDER [--close 1e-9]` asks the same questions about the stored inputs again, prints what differs,
and exits with 1 if anything does.

Numbers of JSON objects may differ by the relative distance `--close`; a number below that share of
the largest one in its own object is rounding. Printed numbers may differ by one in their last
digit. Words, keys, exit codes and the order of rows must be the same. Who made an answer
(`provenance`) is not compared.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import itertools
import json
import math
import os
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.io import mmwrite
from scipy.sparse import csc_array

import squeal
from squeal.cli.main import main as command_line
from squeal.errors import ComputationError, InputError
from squeal.examples.brake import solid_brake, write_parts
from squeal.io.writing import Answer, to_json
from squeal.linear.system import TermSystem
from tests.known import known_system
from tests.two_ways.asking import pad_of

SEED = 20261128
PADS = 40
SYSTEMS = 34
BROKEN = 160
CLOSE = 1e-9
SHOWN = 200  # lines of differences that are printed
WRITTEN = ("--table", "--output", "--shapes")
PICTURE = re.compile(r"base64,[^\"]*|<footer>.*?</footer>")
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|nan|inf")


@dataclass(frozen=True)
class Question:
    """Words of the command line, or with `python` a verb, a file and its keyword arguments."""

    words: tuple[Any, ...]
    python: bool = False

    @property
    def name(self) -> str:
        """What identifies the question, and for people what it asks."""
        return ("python " if self.python else "squeal ") + json.dumps(self.words)


# --- inputs -------------------------------------------------------------------------------------


def write_yaml(folder: Path, name: str, document: Any) -> str:
    """Write a document; returns its name."""
    (folder / name).write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return name


def write_system(folder: Path, name: str, system: TermSystem, second: str = "") -> str:
    """Write a system as a file with one Matrix Market file a term; returns the name.

    second: the name of a second parameter, which multiplies the first term of K.
    """
    document: dict[str, Any] = {"name": name, "parameter": system.parameter}
    document["parameters"] = dict(system.parameters) or {system.parameter: 0.4}
    for part, terms in (("M", system.M), ("C", system.C), ("K", system.K)):
        listed = []
        for number, term in enumerate(terms):
            file = f"{name}-{part}{number}.mtx"
            mmwrite(folder / file, csc_array(term.matrix), precision=17)
            factor = second if second and file.endswith("-K0.mtx") else term.factor.text
            listed.append({"file": file, "factor": factor})
        if listed:
            document[part] = listed
    if second:
        document["parameters"][second] = 1.0
    return write_yaml(folder, f"{name}.yaml", document)


def draw_pads(folder: Path, rng: np.random.Generator) -> list[str]:
    """Write scenes of all models, with a motion."""
    names = []
    for number in range(PADS):
        scene = pad_of(int(rng.integers(2**32)))
        scene["time"] = {"stop": 0.002, "samples": 21}
        scene["initial"] = {"y": round(float(rng.uniform(0.0, 2e-5)), 9)}
        names.append(write_yaml(folder, f"pad{number}.yaml", scene))
    return names


def draw_systems(folder: Path, rng: np.random.Generator) -> list[str]:
    """Write systems with known thresholds, as terms in files and in the short form."""
    names = []
    for number in range(SYSTEMS):
        rows = int(rng.integers(2, 13))
        damped = bool(rng.random() < 0.6)
        system, _ = known_system(rows, rng, damped)
        if number % 2:
            names.append(write_system(folder, f"system{number}", system, "stiff"))
            continue
        M = np.asarray(system.M[0].matrix)
        document: dict[str, Any] = {"M": np.eye(rows).tolist()}  # this form takes symmetric M
        for part, terms in (("C", system.C), ("K", system.K)):
            for power, term in enumerate(terms):
                divided = np.linalg.solve(M, np.asarray(term.matrix))
                document[f"{part}{power}"] = divided.tolist()
        document["parameters"] = {"mu": round(float(rng.uniform(0.1, 1.5)), 3)}
        names.append(write_yaml(folder, f"system{number}.yaml", document))
    return names


def break_file(folder: Path, rng: np.random.Generator, name: str, number: int) -> str:
    """Write a copy of a file with one fault; returns its name."""
    document = yaml.safe_load((folder / name).read_text(encoding="utf-8"))
    keys = sorted(document)
    key = keys[int(rng.integers(len(keys)))]
    inner = document[key]
    group = document
    if isinstance(inner, dict) and rng.random() < 0.8:
        group = inner
        key = sorted(inner)[int(rng.integers(len(inner)))]
    fault = int(rng.integers(5))
    if fault == 0:
        del group[key]
    elif fault == 1:
        group[f"{key}x"] = group.pop(key)
    elif fault == 2:
        values = [math.nan, -1.0, 0, "text", None, [], {}, True, 1e300, [[1.0]]]
        group[key] = values[int(rng.integers(len(values)))]
    elif fault == 3:
        group["unknown"] = 1
    else:
        group[key] = [group[key]]
    return write_yaml(folder, f"broken{number}.yaml", document)


# --- questions ----------------------------------------------------------------------------------


def of_pad(name: str, number: int) -> Iterator[Question]:
    """What is asked about a scene."""
    yield Question(("eigenvalues", name))
    yield Question(("critical-friction", name, "--max", "1.5"))
    yield Question(("eigenvalues", name, {"at": 0.3}), python=True)
    yield Question(("thresholds", name, {"high": 1.0}), python=True)
    yield Question(("sensitivity", name, {}), python=True)
    asked = [
        ("eigenvalues", name, "--sweep", "0:0.8:5"),
        ("eigenvalues", name, "--sensitivity", "--verbose"),
        ("critical-friction", name, "--sensitivity"),
        ("map", name, "--n", "5"),
        ("map", name, "--first", "mu:0:1", "--second", "k1:1e7:3e7", "--n", "4"),
        ("article", "sliding", name),
        ("simulate", name),
        ("export", name, "--output", "written"),
        ("map", name, "--n", "4", "--quantity", "critical-friction"),
        ("eigenvalues", name, "--set", "mu=0.21", "--table", "roots.csv"),
        ("simulate", name, "--integrator", "scipy", "--table", "history.csv"),
        ("scatter", name, "spreads.yaml", "--of", "growth"),
    ]
    for shift in range(6):
        yield Question(asked[(6 * number + shift) % len(asked)])
    if number in (0, 9):
        yield Question(("critical-friction", name, "--prove", "--max", "0.6"))
    if number % 9 == 0:
        yield Question(("report", name, "--output", "page.html"))
        yield Question(("advise", name))
        yield Question(("cycles", name, "--set", "damping.ratios=[0.02, 0.02, 0.02]"))


def of_system(name: str, number: int) -> Iterator[Question]:
    """What is asked about a system from matrices."""
    yield Question(("eigenvalues", name))
    yield Question(("critical-friction", name))
    yield Question(("check", name))
    yield Question(("thresholds", name, {"high": 1.0}), python=True)
    yield Question(("sweep", name, {"values": [0.1, 0.5, 1.2]}), python=True)
    asked = [
        ("eigenvalues", name, "--prove"),
        ("eigenvalues", name, "--sweep", "0:1.5:7"),
        ("eigenvalues", name, "--sweep", "0:1.5:4", "--method", "modal", "--modes", "2"),
        ("eigenvalues", name, "--band", "0.1:1.2", "--at", "0.7"),
        ("critical-friction", name, "--band", "0.1:1.2", "--max", "1.5"),
        ("critical-friction", name, "--sensitivity"),
        ("eigenvalues", name, "--sensitivity", "--modes", "3"),
        ("eigenvalues", name, "--region", "-1:1:0:6"),
        ("export", name, "--output", "written", "--method", "reduced", "--band", "0.1:1.5"),
        ("map", name, "--first", "mu:0:1", "--second", "stiff:0.9:1.1", "--n", "4"),
        ("critical-friction", name, "--prove", "--max", "1"),
        ("eigenvalues", name, "--at", "1.3", "--table", "roots.csv"),
    ]
    if number % 9 in (0, 5):
        yield Question(("report", name, "--output", "page.html"))
        yield Question(("advise", name))
        yield Question(("optimise", name, "--bounds", "stiff:0.8:1.2", "--starts", "1"))
    for shift in range(6):
        yield Question(asked[(6 * number + shift) % len(asked)])


def of_band(name: str) -> Iterator[Question]:
    """What is asked about a system of more than 400 rows."""
    band = ("--band", "500:6000")
    yield Question(("eigenvalues", name, *band))
    yield Question(("eigenvalues", name, "--modes", "4"))
    yield Question(("eigenvalues", name, *band, "--sweep", "0:0.6:4"))
    yield Question(("eigenvalues", name, *band, "--sweep", "0:0.6:3", "--method", "reduced"))
    yield Question(("critical-friction", name, *band, "--max", "0.8"))
    yield Question(("check", name))
    yield Question(("export", name, "--output", "written", "--method", "modal", *band))
    yield Question(("eigenvalues", name))
    yield Question(("critical-friction", name))
    yield Question(("eigenvalues", "assembly/assembly.yaml", *band))
    yield Question(("eigenvalues", "assembly/assembly.yaml", *band, "--set", "mu=0.3"))
    yield Question(("eigenvalues", "assembly/assembly.yaml", *band, "--shapes", "modes.vtk"))
    yield Question(("check", "assembly/assembly.yaml"))
    yield Question(("export", "assembly/assembly.yaml", *band, "--output", "written"))
    yield Question(("reduce", name, {"band": (500.0, 6000.0)}), python=True)


def of_program() -> Iterator[Question]:
    """Help, refused words, and the article."""
    for verb in ("check", "eigenvalues", "critical-friction", "map", "advise", "optimise"):
        yield Question((verb, "--help"))
    for verb in ("scatter", "report", "export", "simulate", "cycles"):
        yield Question((verb, "--help"))
    for verb in ("sliding", "claims", "findings", "identify", "cite", "take"):
        yield Question(("article", verb, "--help"))
    words = "|eigenvalue x|--help|article|article --help|--version|eigenvalues|eigenvalues no.yaml"
    words += "|eigenvalues pad0.yaml --ban 1|eigenvalues pad0.yaml --band 1:2|map pad0.yaml --n 0"
    words += "|eigenvalues pad0.yaml --set mu|eigenvalues pad0.yaml --set nu=1"
    words += "|critical-friction pad0.yaml --max -1|critical-friction system0.yaml --min 1 --max 0"
    words += "|eigenvalues system0.yaml --modes 0|eigenvalues system0.yaml --band 2:1"
    words += "|eigenvalues system0.yaml --table x.txt|eigenvalues pad0.yaml --table pad0.yaml"
    words += "|simulate system0.yaml|check pad0.yaml|scatter pad0.yaml no.yaml|article findings"
    words += "|article cite|article take|article take no"
    for line in words.split("|"):
        yield Question(tuple(line.split()))
    for verb in ("eigenvalues", "thresholds", "sensitivity"):
        yield Question((verb, "pad0.yaml", {"band": (1.0, 2.0)}), python=True)
        yield Question((verb, "system0.yaml", {"band": (2.0, 1.0)}), python=True)
        yield Question((verb, "system1.yaml", {"memory": -1.0}), python=True)


def draw(folder: Path) -> list[Question]:
    """Write the inputs into a folder; returns the questions about them."""
    rng = np.random.default_rng(SEED)
    spreads = {"mu": {"between": [0.1, 0.6]}, "k1": {"relative": 0.05}}
    write_yaml(folder, "spreads.yaml", {"samples": 12, "seed": 3, "spreads": spreads})
    questions: list[Question] = []
    pads = draw_pads(folder, rng)
    for number, name in enumerate(pads):
        questions += of_pad(name, number)
    systems = draw_systems(folder, rng)
    for number, name in enumerate(systems):
        questions += of_system(name, number)
    brake = solid_brake(500)
    write_parts(folder / "assembly", brake)
    questions += of_band(write_system(folder, "brake", brake.system))
    questions += of_program()
    for number in range(BROKEN):
        sound = pads if rng.random() < 0.5 else systems
        name = break_file(folder, rng, sound[int(rng.integers(len(sound)))], number)
        verbs = ["eigenvalues", "critical-friction", "check" if sound is systems else "simulate"]
        verb = verbs[int(rng.integers(len(verbs)))]
        questions.append(Question((verb, name)))
    return questions


# --- answers ------------------------------------------------------------------------------------


def files_of(written: Path) -> list[Path]:
    """The files that were written: one, or those of a folder."""
    if not written.is_dir():
        return [written]
    return sorted(file for file in written.rglob("*") if file.is_file())


def ask_command(words: tuple[Any, ...]) -> dict[str, Any]:
    """What a command printed, as text and as JSON, and what it wrote as a table."""
    answer: dict[str, Any] = {}
    for form, flags in (("text", ()), ("json", ("--json",))):
        shutil.rmtree("written", ignore_errors=True)
        out = io.StringIO()
        said = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
            try:
                code = command_line([*map(str, words), *flags])
            except SystemExit as ended:
                code = int(ended.code or 0)
        answer[f"{form}_code"] = code
        answer[f"{form}_said"] = said.getvalue()
        answer[form] = out.getvalue()
    with contextlib.suppress(json.JSONDecodeError):
        answer["json"] = json.loads(answer["json"])
        answer["json"].pop("provenance", None)
    for flag, name in itertools.pairwise(words):
        if flag in WRITTEN and answer["text_code"] == 0:
            for file in files_of(Path(name)):
                answer[str(file)] = PICTURE.sub("", file.read_text(encoding="utf-8"))
    return answer


def ask_python(words: tuple[Any, ...]) -> dict[str, Any]:
    """What a function of the package answered, as text and as object, or how it refused."""
    verb, name, options = words
    try:
        subject: Any = squeal.read_system(name) if "pad" not in name else squeal.read_scene(name)
        ask: Callable[..., Any] = getattr(squeal, verb)
        found = ask(subject, **options)
    except (ComputationError, InputError) as error:
        return {"refused": f"{type(error).__name__}: {error}"}
    if isinstance(found, Answer):
        return {"text": repr(found), "json": json.loads(to_json(found.to_dict()))}
    return {"text": f"{type(found).__name__} of {found.n} rows"}


def ask(question: Question) -> dict[str, Any]:
    """The answer; a traceback is one too."""
    try:
        return (ask_python if question.python else ask_command)(question.words)
    except Exception as error:  # what no user should see is what a comparison must show
        return {"raised": f"{type(error).__name__}: {error}"}


def answers(folder: Path, questions: list[Question]) -> dict[str, dict[str, Any]]:
    """The answers by the names of their questions, asked from within the folder of the inputs."""
    before = Path.cwd()
    given = {}
    os.chdir(folder)
    try:
        for question in questions:
            given[question.name] = ask(question)
    finally:
        os.chdir(before)
    return given


# --- comparison ---------------------------------------------------------------------------------


def largest(value: Any) -> float:
    """The largest finite number of an object."""
    if isinstance(value, dict):
        return max(map(largest, value.values()), default=0.0)
    if isinstance(value, list):
        return max(map(largest, value), default=0.0)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return abs(value) if is_number and math.isfinite(value) else 0.0


def differences(old: Any, new: Any, close: float, where: str = "", scale: float = 0.0) -> list[str]:
    """What differs between two JSON values, by key; `scale`: of the object that holds them."""
    if isinstance(old, dict) and isinstance(new, dict):
        scale = max(largest(old), largest(new))
        found = []
        for key in old | new:
            inner = f"{where}.{key}" if where else str(key)
            if key not in old or key not in new:
                found.append(f"{inner}: {'added' if key in new else 'missing'}")
            else:
                found += differences(old[key], new[key], close, inner, scale)
        return found
    if isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            return [f"{where}: {len(old)} entries, now {len(new)}"]
        found = []
        for i, (a, b) in enumerate(zip(old, new, strict=True)):
            found += differences(a, b, close, f"{where}[{i}]", scale)
        return found
    if isinstance(old, str) and isinstance(new, str):
        return text_differences(old, new, where)
    if isinstance(old, float) and isinstance(new, float | int) and not isinstance(new, bool):
        rounding = max(abs(old), abs(new)) <= close * scale
        if rounding or old == new or abs(old - new) <= close * abs(old):
            return []
    return [] if old == new and type(old) is type(new) else [f"{where}: {old!r}, now {new!r}"]


def last_digit(text: str) -> float:
    """The worth of the last digit of a printed number."""
    mantissa, _, exponent = text.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return 10.0 ** (int(exponent or 0) - decimals)


def same_numbers(old: str, new: str) -> bool:
    """Are these printed numbers the same but for one in their last digit, or both rounding?"""
    if old == new:
        return True
    try:
        a = float(old)
        b = float(new)
    except ValueError:
        return False
    if max(abs(a), abs(b)) < 1e-9 and "e" in old.lower():  # backward errors and the like
        return True
    whole = "." not in old + new and "e" not in (old + new).lower()
    return not whole and abs(a - b) <= 1.01 * max(last_digit(old), last_digit(new))


def text_differences(old: str, new: str, where: str) -> list[str]:
    """The lines of two texts that differ in more than the last digits of numbers."""
    if old == new:
        return []
    before = old.splitlines()
    after = new.splitlines()
    if len(before) != len(after):
        return [f"{where}: {len(before)} lines, now {len(after)}: {old[:200]!r}, now {new[:200]!r}"]
    found = []
    for a, b in zip(before, after, strict=True):
        same_words = NUMBER.sub("#", a).split() == NUMBER.sub("#", b).split()
        if not same_words or not all(map(same_numbers, NUMBER.findall(a), NUMBER.findall(b))):
            found.append(f"{where}: {a.strip()!r}, now {b.strip()!r}")
    return found


# --- commands -----------------------------------------------------------------------------------


def store(folder: Path) -> int:
    """Write inputs, questions and answers."""
    inputs = folder / "inputs"
    inputs.mkdir(parents=True)
    start = time.process_time()
    questions = draw(inputs)
    given = answers(inputs, questions)
    listed = [{"words": q.words, "python": q.python} for q in questions]
    text = json.dumps({"questions": listed, "answers": given}, indent=1)
    (folder / "answers.json").write_text(text, encoding="utf-8")
    refused = sum(a.get("text_code", 0) == 2 or "refused" in a for a in given.values())
    raised = [name for name, answer in given.items() if "raised" in answer]
    seconds = time.process_time() - start
    print(f"{len(given)} answers, {refused} of them refusals, in {seconds:.0f} CPU seconds")
    for name in raised:
        print(f"{name}: {given[name]['raised']}")
    return 0


def compare(folder: Path, close: float) -> int:
    """Ask again; print what differs."""
    stored = json.loads((folder / "answers.json").read_text(encoding="utf-8"))
    questions = [Question(tuple(q["words"]), q["python"]) for q in stored["questions"]]
    with tempfile.TemporaryDirectory() as scratch:  # where answers write, and others may compare
        inputs = Path(shutil.copytree(folder / "inputs", Path(scratch) / "inputs"))
        given = answers(inputs, questions)
    lines = []
    other = 0
    for name, old in stored["answers"].items():
        new = json.loads(json.dumps(given[name]))  # as the stored one went through JSON
        found = differences(old, new, close)
        other += bool(found)
        lines += [f"{name}: {line}" for line in found]
    print("\n".join(lines[:SHOWN]))
    if len(lines) > SHOWN:
        print(f"... and {len(lines) - SHOWN} more")
    print(f"{len(stored['answers'])} answers, {other} differ")
    return int(bool(lines))


def main() -> int:
    """Store or compare."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("what", choices=("store", "compare"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--close", type=float, default=CLOSE)
    given = parser.parse_args()
    folder = given.folder.resolve()
    return store(folder) if given.what == "store" else compare(folder, given.close)


if __name__ == "__main__":
    sys.exit(main())
