"""The site: its examples run, and its pages name every equation, finding and command."""

import ast
import importlib
import inspect
import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Callable
from pkgutil import resolve_name

import pytest

import squeal
from squeal.article.findings import FINDINGS
from squeal.cli.main import COMMANDS
from tests.conftest import ROOT

DOCS = ROOT / "docs"
INVENTORIES = sorted((DOCS / "inventories").glob("*.inv"))
KINDS: dict[str, Callable[[object], bool]] = {
    "class": inspect.isclass,
    "function": inspect.isroutine,
    "mod": inspect.ismodule,
}
PAGES = {page.stem: page.read_text(encoding="utf-8") for page in DOCS.glob("*.md")}
PRINTED = {  # what the examples say, each known otherwise
    "brake_damping": r"4 values of friction",
    "brake_energy": r"friction puts in 131\.4 1/s, damping takes 28\.22 1/s; in all 103\.2 1/s",
    "brake_shape": r"6697 Hz, damping -0\.245 %",  # as the README prints
    "brake_sweep": r"\d+ 1/s at most",
    "campbell": r"flutter",
    "chart": r"flutter in 49% of the area",  # 60 * 59 / 2 of 60 * 60 cells lie beyond mu = gap
    "column": r"flutter from P = 20\.051\d on",  # Beck 1952: 20.05
    "angles": r"'flutter': 0\.\d+",
    "critical_speeds": r"2 critical speeds",
    "friction_loop": r"gain margin 0\.765000",  # closed form
    "hammering": r"37 changes of contact",  # as results/b2-c.json has
    "levers": r"flutter from mu = 0\.315282",  # the README's threshold
    "mode_coupling": r"flutter from mu = 0\.750000000000\d+\n",  # closed form
    "pad_cycles": r"11 cycles",
    "pad_modes": r"1775 Hz",
    "pad_motion": r"both edges press 88% of the time",
    "scattered": r"\[0\.5\]",  # (a - b) / 2
    "thresholds": r"flutter from mu = 0\.315281722 at 1768\.9 Hz",
}


@pytest.mark.usefixtures("coarse_charts")
@pytest.mark.parametrize("name", sorted(path.stem for path in (DOCS / "gallery").glob("*.py")))
def test_examples_run_and_say_what_is_known(name, capsys, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    import matplotlib.pyplot as plt

    plt.switch_backend("Agg")
    runpy.run_path(str(DOCS / "gallery" / f"{name}.py"))
    assert len(plt.get_fignums()) >= 1
    plt.close("all")
    assert re.search(PRINTED[name], capsys.readouterr().out)


def test_twelve_pictures_of_the_gallery_take_ten_lines_each():
    short = []
    for path in (DOCS / "gallery").glob("*.py"):
        _, *statements = ast.parse(path.read_text(encoding="utf-8")).body
        own = [one for one in statements if not isinstance(one, ast.Import | ast.ImportFrom)]
        if sum(one.end_lineno - one.lineno + 1 for one in own if one.end_lineno) <= 10:
            short.append(path.stem)
    assert len(short) >= 12


CONF = """
import sys

sys.path.insert(0, "PATH")
extensions = ["pictures"]
sphinx_gallery_conf = {"examples_dirs": [], "gallery_dirs": []}
"""
PICTURE = """
Title
=====

.. image-sg:: /picture.png
   :alt: A brake
   :srcset: /picture.png
   :class: sphx-glr-single-img
"""


def test_a_picture_of_the_gallery_has_words_in_a_text_build(tmp_path):
    """`sphinx-build -b text` ended with: Unknown node: imgsgnode."""
    pytest.importorskip("sphinx_gallery")
    (tmp_path / "conf.py").write_text(CONF.replace("PATH", (DOCS / "_extensions").as_posix()))
    (tmp_path / "index.rst").write_text(PICTURE)
    shutil.copy(ROOT / "figures" / "brake.png", tmp_path / "picture.png")
    made = tmp_path / "made"
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "-b", "text", str(tmp_path), str(made)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert "[image: A brake]" in (made / "index.txt").read_text()


CODE = re.compile(r"^```(?:console|python|yaml|text|sh)\n(.*?)^```", re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("page", sorted(PAGES))
def test_code_is_at_most_88_columns_wide(page):
    """What commands print is folded where it is wider."""
    for block in CODE.findall(PAGES[page]):
        assert max(map(len, block.split("\n"))) <= 88, block


TABLE = "  name   one   two\n  a        1     2\n  ... 3 more\n  b       10    20"
FOLDED = (
    "  name   one\n  a        1\n  ... 3 more\n  b       10\n\n"
    "  name   two\n  a        2\n  ... 3 more\n  b       20"
)


def test_what_is_wide_is_folded(monkeypatch):
    monkeypatch.syspath_prepend(DOCS / "_extensions")
    folding = importlib.import_module("folding")
    monkeypatch.setattr(folding, "WIDTH", 14)
    assert folding.folded_output(TABLE) == FOLDED
    assert folding.folded_output("a few words in a line") == "a few words in\n    a line"
    monkeypatch.setattr(folding, "WIDTH", 30)
    folded = folding.folded_command("squeal it --band 1:2 --n 3")
    assert folded == "$ squeal it --band 1:2 \\\n    --n 3"


def test_theory_holds_every_equation_and_links_every_finding_that_changes_one():
    numbers = re.findall(r"\\qquad \((\d+)[a-z]?\)", re.sub(r"\s+", " ", PAGES["theory"]))
    assert sorted(set(map(int, numbers))) == list(range(1, 24))
    linked = set(re.findall(r"findings\.md#(e\d+)", PAGES["theory"]))
    assert linked <= {finding.id.lower() for finding in FINDINGS}
    equations = {f.id.lower() for f in FINDINGS if "Eq" in f.where}
    assert equations <= linked


def test_every_command_is_shown():
    shown = set(re.findall(r"^## ([a-z-]+)$", PAGES["queries"], re.M))
    assert set(COMMANDS) <= shown


def test_every_page_is_in_the_contents():
    found = re.findall(r"```\{toctree\}(.*?)```", "\n".join(PAGES.values()), re.S)
    assert PAGES.keys() - {"index"} <= set(re.findall(r"\w+", " ".join(found)))


def test_every_name_of_the_package_is_documented_once():
    pages = [path.read_text(encoding="utf-8") for path in (DOCS / "api").glob("*.md")]
    shown = re.findall(r"^\.\. auto(?:class|function):: squeal\.(\w+)$", "\n".join(pages), re.M)
    assert sorted(shown) == sorted(squeal.__all__)


def test_inventories_are_files_here_so_that_nothing_is_fetched(monkeypatch):
    monkeypatch.setattr(sys, "path", [*sys.path])  # which conf.py extends
    mapping = runpy.run_path(str(DOCS / "conf.py"))["intersphinx_mapping"]
    assert sorted(DOCS / place for _, place in mapping.values()) == INVENTORIES


@pytest.mark.parametrize("inventory", INVENTORIES, ids=lambda path: path.stem)
def test_stored_names_of_other_projects_exist_and_are_linked(inventory):
    folders = (DOCS.rglob("*.md"), (ROOT / "squeal").rglob("*.py"))
    text = "\n".join(path.read_text(encoding="utf-8") for paths in folders for path in paths)
    for line in inventory.read_text(encoding="utf-8").splitlines()[3:]:
        name, kind, _ = line.split()
        assert KINDS[kind](resolve_name(name)), name
        assert re.search(rf"(#|:class:`~?){re.escape(name)}[)`]", text), name
