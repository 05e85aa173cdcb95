"""The house: which room may import which, how many there are, and how folded their code is."""

import ast
import functools
import graphlib
import re

import pytest

from benchmarks.count import (
    UPWARDS,
    Gauges,
    circle,
    downwards,
    gauges,
    graph,
    module_of,
    picture,
)
from tests.conftest import ROOT

MODULES = {module_of(file, ROOT): file for file in sorted((ROOT / "squeal").rglob("*.py"))}
CEILINGS = {
    "tokens": (363_950, 175_000),
    "tokens a code line": (9.71, 9.5),
    "paired assignments per 1,000 code lines": (0.19, 3),
    "comprehensions per 1,000 code lines": (28.0, 15),
    "conditional expressions per 1,000 code lines": (14.7, 12),
    "Any in signatures": (45, 60),
    "calls of locals()": (0, 0),
    "modules of our own loaded by a string": (2, 0),
}
"""Of the toolkit: what each gauge may be at most, which only ever falls, and what is wanted."""


@functools.cache  # asked for by this file alone, which every worker collects
def imports() -> dict[str, set[str]]:
    """What each module imports, but for the one import upwards."""
    links = graph(ROOT)
    assert UPWARDS[1] in links[UPWARDS[0]]  # else it is listed no longer
    return downwards(links)


@functools.cache
def toolkit() -> dict[str, float]:
    """The gauges of all modules but those of the article."""
    total = Gauges()
    for name, file in MODULES.items():
        if not name.startswith("squeal.article"):
            total += gauges(file.read_text(encoding="utf-8"))
    return total.table()


def room(module: str) -> str:
    """The folder or file directly under the package, or under its article, that holds a module."""
    parts = module.split(".")
    return ".".join(parts[: 3 if parts[1:2] == ["article"] else 2])


def test_a_room_imports_what_lies_below_only():
    """No toolkit imports the companion, no foundation a wall, no numerics plots or snakemake."""
    layers = ["squeal.errors", "squeal.numerics", "squeal.schema", "squeal.linear"]
    for name, others in imports().items():
        if not name.startswith("squeal.article"):
            assert not any(other.startswith("squeal.article") for other in others), name
        if room(name) in layers:
            below = layers[: layers.index(room(name)) + 1]
            assert {room(o) for o in others} <= set(below), name
        if not name.startswith(("squeal.plots", "squeal.reports", "squeal.article", "squeal.cli")):
            text = MODULES[name].read_text(encoding="utf-8")
            assert "matplotlib" not in text, name
            assert "import snakemake" not in text, name
            if name != "squeal":  # the front, which loads them when they are asked for
                assert "squeal.plots" not in {room(o) for o in others}, name


def test_modules_and_rooms_stand_on_no_circle():
    """Imports count wherever they stand: inside functions, and for type checkers alone."""
    links = {name: others - {"squeal"} for name, others in imports().items() if name != "squeal"}
    assert circle(links) == []  # the package itself names what it offers, loaded on first use
    rooms: dict[str, set[str]] = {}
    for name, others in links.items():
        mine = rooms.setdefault(room(name), set())
        mine |= {room(other) for other in others} - {room(name)}
    list(graphlib.TopologicalSorter(rooms).static_order())  # raises CycleError, naming it


def test_a_circle_is_seen():
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}) == ["b", "c"]
    assert circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_the_referee_shares_nothing_with_the_solvers():
    """It reads a system and an answer; of a pad it knows the equations that are judged."""
    for name in imports():
        if room(name) == "squeal.proof":
            shared = {room(other) for other in imports()[name]} - {"squeal.proof"}
            assert shared <= {"squeal.model"}, name


def test_there_are_at_most_30_rooms():
    rooms = {room(name) for name in MODULES if not name.endswith("__main__")}
    assert len(rooms - {"squeal", "squeal.article"}) <= 30, rooms


def test_contributing_shows_the_house_as_it_is():
    """`python -m benchmarks.count` prints the picture; paths that the page names are there."""
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert f"```text\n{picture(imports())}\n```" in page
    tracked = {"squeal", "tests", "benchmarks", "docs", "workflow", "paper", "examples"}
    named = set(re.findall(r"`([\w./]+/[\w./]*)`", page))
    missing = {p for p in named if p.split("/")[0] in tracked and not (ROOT / p).exists()}
    assert not missing


FOLDED = """
from importlib import import_module


def f(a: Any, b: dict[str, Any], *c: Any | None) -> Any:
    "A docstring."
    x, y = a, b  # a comment
    x, y = y, x
    z = [i for i in c] if a else {j for j in c}
    import_module("pandas")
    return import_module("squeal.errors"), import_module(a), locals()
"""


def test_each_gauge_counts_what_its_name_says():
    """Of a text that is read with the naked eye."""
    found = gauges(FOLDED)
    assert found.code_lines == 7
    assert gauges("x = 1").tokens == 3
    assert (found.paired_assignments, found.comprehensions) == (1, 2)
    assert (found.conditional_expressions, found.any_in_signatures) == (1, 3)
    assert (found.locals_calls, found.string_imports) == (1, 2)


@pytest.mark.parametrize("name", CEILINGS)
def test_no_gauge_grows(name, capsys):
    """Whoever lowers a gauge lowers its ceiling here."""
    ceiling, wanted = CEILINGS[name]
    with capsys.disabled():
        print(f"\n{name}: {toolkit()[name]:.6g} (at most {ceiling}, wanted {wanted})", end=" ")
    assert toolkit()[name] <= ceiling


def test_no_refusal_of_the_library_speaks_of_options():
    """Who calls from Python has arguments; the command line puts its options in their place."""
    spoken = []
    for file in sorted((ROOT / "squeal").rglob("*.py")):
        if {"cli", "article"} & set(file.parts):
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            warns = isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "warn"
            if not (warns or isinstance(node, ast.Raise)):
                continue
            texts = [part.value for part in ast.walk(node) if isinstance(part, ast.Constant)]
            spoken += [text for text in texts if re.search("--[a-z]", str(text))]
    assert spoken == []
