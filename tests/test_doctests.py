"""Examples in docstrings run."""

import doctest
import importlib

import pytest

from tests.test_house import MODULES


@pytest.mark.parametrize("name", [n for n, file in MODULES.items() if ">>> " in file.read_text()])
def test_examples(name):
    assert not doctest.testmod(importlib.import_module(name)).failed
