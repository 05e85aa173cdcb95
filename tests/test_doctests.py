"""Examples in docstrings run."""

import doctest
import importlib

import pytest

from tests.test_house import FILES, module_of

WITH_EXAMPLES = [f for f in FILES if ">>> " in f.read_text(encoding="utf-8")]


@pytest.mark.parametrize("file", WITH_EXAMPLES, ids=module_of)
def test_examples(file):
    assert not doctest.testmod(importlib.import_module(module_of(file))).failed
