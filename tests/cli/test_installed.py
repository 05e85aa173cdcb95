"""The package as people install it: from a wheel, in an empty folder, also without Linux' parts."""

import json
import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import numpy
import pytest

from tests.cli.calls import B1, B2, B3, assert_warns
from tests.conftest import ROOT

# What is told of the commands that one process runs, each in a folder of its own, without heyoka
# and what Windows or macOS lack; all public names and commands are imported too.
TOLD = """\
import contextlib, importlib, importlib.abc, io, json, os, pkgutil, sys, traceback
class Missing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, *_):
        if name.partition(".")[0] in {"heyoka", "fcntl", "grp", "pwd", "resource", "termios"}:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Missing())
del os.fork, os.forkpty
import squeal
from squeal.cli.main import main
told = {"": squeal.__file__}
for name, arguments in json.loads(sys.argv[1]).items():
    os.mkdir(name)
    os.chdir(name)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(arguments)
        except BaseException:
            code = traceback.print_exc()
    told[name] = (code, out.getvalue(), err.getvalue(), os.listdir())
    os.chdir("..")
for name in squeal.__all__:
    getattr(squeal, name)
for package in ("squeal.cli", "squeal.article.commands"):
    for found in pkgutil.iter_modules(importlib.import_module(package).__path__):
        importlib.import_module(f"{package}.{found.name}")
print(json.dumps(told))
"""
ANSWERS: dict = {
    "cycles": [B1, "--set", "damping.ratios=[0.1, 0.1, 0.1]", "--windows", "1"],
    "simulate": [B1, "--set", "stop=1e-3"],
    "eigenvalues": [B2], "thresholds": [B2], "sliding": [B2], "advise": [B3], "cite": [],
    "map": [B3, "--n", "10"], "export": [B2, "--output", "matrices"], "claims": [], "findings": [],
}  # fmt: skip
REFUSED: dict = {
    "search": ["identify", "--minutes=0"],
    "motion": ["simulate", B1, "--integrator=heyoka"],
}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "flit_core.wheel", "--outdir", str(folder), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def program(wheel):
    """Programs of an empty environment with the wheel, and where it lies there."""
    place = wheel.parent / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", place], check=True)
    pip = [sys.executable, "-m", "pip", "--python", place / "bin" / "python"]
    offline = ["install", "--quiet", "--no-deps", "--no-index", wheel]
    subprocess.run([*pip, *offline], check=True, capture_output=True)
    (site,) = (place / "lib").glob("python*/site-packages")
    # its requirements from here; what is installed there comes first
    (site / "requirements.pth").write_text(f"{Path(numpy.__file__).parents[1]}\n")
    return place / "bin", site


def run(*words, cwd):
    bare = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(words, cwd=cwd, env=bare, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def bare(program, tmp_path_factory):
    short = tmp_path_factory.mktemp("scenes")  # SciPy takes half a minute for the article's times
    for scene in (ROOT / "workflow" / "scenes").glob("*.yaml"):
        text = scene.read_text(encoding="utf-8")
        text = text.replace("stop: 0.003162278, samples: 4001", "stop: 0.0001, samples: 161")
        (short / scene.name).write_text(text, encoding="utf-8")
    commands = {name: [name, *given, "--json"] for name, given in ANSWERS.items()} | REFUSED
    for name in ("claims", "findings"):
        commands[name] += ["--scenes", short]
    words = (program[0] / "python", "-c", TOLD, json.dumps(commands, default=str))
    told = run(*words, cwd=tmp_path_factory.mktemp("empty"))
    assert told.pop("").startswith(str(program[1]))
    return told


def test_wheel_and_sdist_hold_every_file_of_the_package(wheel, tmp_path):
    code = "import sys; from flit_core import buildapi; print(buildapi.build_sdist(sys.argv[1]))"
    subprocess.run([sys.executable, "-c", code, tmp_path], cwd=ROOT, check=True, text=True)
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        packed = {name.partition("/")[2] for name in archive.getnames()}
    files = (path for path in (ROOT / "squeal").rglob("*") if path.is_file())
    kept = {path.relative_to(ROOT).as_posix() for path in files if "__pycache__" not in path.parts}
    assert {"squeal/py.typed", "squeal/article/report/references.bib"} < kept
    assert kept <= set(zipfile.ZipFile(wheel).namelist())
    assert kept | {"README.md", "LICENSE", "pyproject.toml"} <= packed
    read = {"benchmarks/sizes.py", "docs/theory.md", "paper/report.tex", "workflow/pad.json"}
    assert read | {"tests/conftest.py", "figures/brake.png"} <= packed  # by tests


def test_the_installed_program_finds_a_threshold_of_a_scene(program, tmp_path):
    assert run(program[0] / "squeal", "critical-friction", B2, "--json", cwd=tmp_path)["critical"]


@pytest.mark.parametrize("command", ANSWERS)
def test_a_command_answers_in_an_empty_folder(bare, command):
    code, out, err, files = bare[command]
    assert code == 0, err
    assert_warns(err, json.loads(out))
    if command == "simulate":
        assert "SciPy" in json.loads(out)["method"]
    assert files == (["matrices"] if command == "export" else [])


@pytest.mark.parametrize("asked", REFUSED)
def test_what_needs_heyoka_says_so(bare, asked):
    code, out, err, files = bare[asked]
    assert (code, out, files, err.count("\n"), "heyoka" in err) == (1, "", [], 1, True)
