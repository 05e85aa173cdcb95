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

from squeal.commands.cli import COMMANDS
from tests.commands.calls import assert_warns
from tests.conftest import ROOT, SCENES

B1, B2, B3 = (str(SCENES / f"{stem}.yaml") for stem in ("b1-c", "b2-c", "b3"))

# run before the command line: what Windows, macOS or a plain Python lack is not found
WITHOUT = """\
import importlib.abc, os, sys
class Missing(importlib.abc.MetaPathFinder):
    def find_spec(self, name, *_):
        if name.partition(".")[0] in {names}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Missing())
for name in ("fork", "forkpty"):
    if hasattr(os, name):
        delattr(os, name)
"""
POSIX = {"fcntl", "grp", "pwd", "resource", "termios"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "flit_core.wheel", "--outdir", str(folder), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel):
    """Folder with the unpacked wheel: the package and nothing of the repository."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(wheel.parent / "site")
    return wheel.parent / "site"


def test_wheel_and_sdist_hold_every_file_of_the_package(wheel, tmp_path):
    code = "import sys; from flit_core import buildapi; print(buildapi.build_sdist(sys.argv[1]))"
    subprocess.run([sys.executable, "-c", code, tmp_path], cwd=ROOT, check=True, text=True)
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        packed = {name.partition("/")[2] for name in archive.getnames()}
    kept = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "squeal").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert {"squeal/py.typed", "squeal/article/report/references.bib"} < kept
    assert any(file.endswith(".yaml") for file in kept)
    assert kept <= set(zipfile.ZipFile(wheel).namelist())
    assert kept | {"README.md", "LICENSE", "pyproject.toml"} <= packed


def test_the_wheel_installs_a_program_into_an_empty_environment(wheel, tmp_path):
    place = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", place], check=True)
    pip = [sys.executable, "-m", "pip", "--python", place / "bin" / "python"]
    offline = ["install", "--quiet", "--no-deps", "--no-index", wheel]
    subprocess.run([*pip, *offline], check=True, capture_output=True)
    (site,) = (place / "lib").glob("python*/site-packages")
    # its requirements from here; what is installed there comes first
    (site / "requirements.pth").write_text(f"{Path(numpy.__file__).parents[1]}\n")
    bare = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [place / "bin" / "squeal", "critical-friction", B2, "--json"],
        cwd=tmp_path, env=bare, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["critical"]
    where = [place / "bin" / "python", "-c", "import squeal; print(squeal.__file__)"]
    found = subprocess.run(where, cwd=tmp_path, env=bare, capture_output=True, text=True)
    assert found.stdout.startswith(str(site))


def run(installed, empty, *arguments, without=()):
    first = WITHOUT.format(names=set(without)) if without else ""
    code = f"{first}\nimport sys, squeal; from squeal.commands.cli import main\n"
    code += f"assert squeal.__file__.startswith({str(installed)!r})\n"
    code += "sys.exit(main(sys.argv[1:]))"
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        cwd=empty,
        env=os.environ | {"PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "Traceback" not in done.stderr
    return done.returncode, done.stdout, done.stderr


def sentence(err):
    assert err.startswith("squeal: ")
    assert err.count("\n") == 1
    return err


ANSWERS = {
    "simulate": [B1],
    "eigenvalues": [B2],
    "critical-friction": [B2],
    "advise": [B3],
    "sliding": [B2],
    "map": [B3, "--n", "10"],
    "export": [B2, "--output", "matrices"],
    "cite": [],
}
NEEDS = {
    "claims": ([], "repository"),
    "findings": ([], "repository"),
    "identify": (["--scenes", "none"], "existing folder"),
    "take": (["fig11"], "repository"),
    "terms": (["0:a.mtx", "1:b.mtx"], "matrix file"),
}


def test_all_commands_are_tried():
    assert {*ANSWERS, *NEEDS} == set(COMMANDS)


@pytest.mark.parametrize(
    ("command", "missing"),
    [*((command, {"heyoka", *POSIX}) for command in ANSWERS), ("simulate", ())],
)
def test_a_command_answers_in_an_empty_folder(installed, tmp_path, command, missing):
    """Without heyoka and POSIX too."""
    given = (*ANSWERS[command], "--json")
    code, out, err = run(installed, tmp_path, command, *given, without=missing)
    assert code == 0
    assert_warns(err, json.loads(out))
    if command == "simulate" and missing:
        assert "SciPy" in json.loads(out)["method"]
    assert os.listdir(tmp_path) == (["matrices"] if command == "export" else [])


@pytest.mark.parametrize("command", NEEDS)
def test_a_command_says_what_it_needs(installed, tmp_path, command):
    arguments, words = NEEDS[command]
    code, out, err = run(installed, tmp_path, command, *arguments)
    assert (code, out) == (2, "")
    assert words in sentence(err)


def test_a_search_without_heyoka_says_so(installed, tmp_path):
    code, out, err = run(installed, tmp_path, "identify", "--minutes", "0", without={"heyoka"})
    assert (code, out) == (1, "")
    assert "heyoka" in sentence(err)
    code, out, err = run(
        installed, tmp_path, "simulate", B1, "--integrator", "heyoka", without={"heyoka"}
    )
    assert (code, out) == (1, "")
    assert "heyoka" in sentence(err)


def test_every_public_name_and_command_imports_without_heyoka_and_posix(installed, tmp_path):
    code = WITHOUT.format(names={"heyoka", *POSIX}) + (
        "import importlib, pkgutil, squeal\n"
        "for name in squeal.__all__: getattr(squeal, name)\n"
        "for package in ('squeal.commands', 'squeal.article.commands'):\n"
        "    module = importlib.import_module(package)\n"
        "    for found in pkgutil.iter_modules(module.__path__):\n"
        "        importlib.import_module(f'{package}.{found.name}')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
