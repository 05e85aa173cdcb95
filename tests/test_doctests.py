"""Examples in docstrings run, and each public verb, class and method has one."""

import doctest
import importlib
import inspect

import pytest

import squeal
from tests.test_house import MODULES


@pytest.mark.usefixtures("coarse_charts", "without_layout")
@pytest.mark.parametrize("name", [n for n, file in MODULES.items() if ">>> " in file.read_text()])
def test_examples_print_what_they_show(name, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # where examples write their files
    monkeypatch.setenv("MPLBACKEND", "Agg")
    assert not doctest.testmod(importlib.import_module(name)).failed


def methods(kind: type) -> list[str]:
    """The public methods of a class that it or a class of the package below it defines."""
    names = set()
    for base in kind.__mro__:
        if base.__module__.startswith("squeal."):
            names |= {name for name in vars(base) if not name.startswith("_")}
    routines = {name: getattr(kind, name) for name in names if hasattr(kind, name)}
    return sorted(name for name, one in routines.items() if getattr(one, "__name__", "") == name)


@pytest.mark.parametrize("name", squeal.__all__)
def test_each_public_name_has_an_example(name):
    """A method that another class of answers overrides without a docstring inherits it."""
    offered = getattr(squeal, name)
    documented = {name: offered}
    if inspect.isclass(offered):
        for method in methods(offered):
            documented[f"{name}.{method}"] = getattr(offered, method)
    lacking = [key for key, value in documented.items() if ">>> " not in str(inspect.getdoc(value))]
    assert not lacking
