"""The house: which room may import which, and how many there are."""

import ast
import functools
import graphlib
from pathlib import Path

from tests.conftest import ROOT


def module_of(file: Path) -> str:
    return ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


MODULES = {module_of(file): file for file in sorted((ROOT / "squeal").rglob("*.py"))}


def imported(file: Path) -> set[str]:
    """Modules of the package that a file imports, inside functions too."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert not node.level, f"{file}: relative import"
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= (whole & MODULES.keys()) or {node.module}
    return {name for name in found if name.split(".")[0] == "squeal"}


@functools.cache  # asked for by this file alone, which every worker collects
def graph() -> dict[str, set[str]]:
    return {name: imported(file) for name, file in MODULES.items()}


def room(module: str) -> str:
    """The folder or file directly under the package, or under its article, that holds a module."""
    parts = module.split(".")
    return ".".join(parts[: 3 if parts[1:2] == ["article"] else 2])


def test_a_room_imports_what_lies_below_only():
    """No toolkit imports the companion, no foundation a wall, no numerics plots or snakemake."""
    layers = ["squeal.errors", "squeal.numerics", "squeal.linear"]
    for name, others in graph().items():
        if not name.startswith("squeal.article"):
            assert not any(other.startswith("squeal.article") for other in others), name
        if room(name) in layers:
            below = layers[: layers.index(room(name)) + 1]
            assert {room(o) for o in others} <= set(below), name
        if not name.startswith(("squeal.plots", "squeal.article", "squeal.cli")):
            text = MODULES[name].read_text(encoding="utf-8")
            assert "matplotlib" not in text, name
            assert "import snakemake" not in text, name
            assert "squeal.plots" not in {room(o) for o in others}, name


def test_no_circle_of_modules_or_rooms():
    rooms: dict[str, set[str]] = {}
    for name, others in graph().items():
        if name != "squeal":  # the package itself names what it offers, loaded on first use
            mine = rooms.setdefault(room(name), set())
            mine |= {room(o) for o in others if o != "squeal"} - {room(name)}
    for links in (graph(), rooms):
        list(graphlib.TopologicalSorter(links).static_order())  # raises CycleError, naming it


def test_the_referee_shares_nothing_with_the_solvers():
    """It reads a system and an answer; of a pad it knows the equations that are judged."""
    for name in graph():
        if room(name) == "squeal.proof":
            shared = {room(other) for other in graph()[name]} - {"squeal.proof"}
            assert shared <= {"squeal.model"}, name


def test_there_are_at_most_27_rooms():
    rooms = {room(name) for name in MODULES if not name.endswith("__main__")}
    assert len(rooms - {"squeal", "squeal.article"}) <= 27, rooms
