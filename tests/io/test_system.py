"""Plain systems from files: what is read and what is refused."""

import numpy as np
import pytest

from squeal.errors import InputError
from squeal.io.system import read_system

GOOD = """\
name: example
M: [[1, 0], [0, 2]]
C1: [[0.1, 0], [0, 0]]
K0: [[3, 1], [1, 4]]
K2: [[0, -1], [1e-3, 0]]
"""


def _read(tmp_path, text):
    path = tmp_path / "system.yaml"
    path.write_text(text, encoding="utf-8")
    return read_system(path).system


def test_polynomials_in_mu(tmp_path):
    system = _read(tmp_path, GOOD)
    M, C, K = system(2.0)
    assert np.array_equal(M, [[1, 0], [0, 2]])
    assert np.array_equal(C, np.array([[0.2, 0], [0, 0]]))
    assert np.array_equal(K, np.array([[3, -3], [1.004, 4]]))
    assert (system.name, system.parameter, system.n) == ("example", "mu", 2)


def test_damping_is_optional(tmp_path):
    system = _read(tmp_path, "M: [[1]]\nK0: [[2]]\n")
    assert system(1.0)[1] is None
    assert system.name == "system"


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("M: [[1]]\n", "K0", "missing"),
        ("K0: [[1]]\n", "M", "missing"),
        (GOOD + "K3: [[1, 2]]\n", "K3", "1 rows"),
        (GOOD + "K3: [[1, 2], [3]]\n", "K3", "row 2"),
        (GOOD + "K3: [[1, 2], [3, x]]\n", "K3.row 2", "'x'"),
        (GOOD + "K3: [[1, 2], [3, .nan]]\n", "K3.row 2", "nan"),
        (GOOD + "K3: [[1, 2], [3, true]]\n", "K3.row 2", "True"),
        (GOOD + "K3: []\n", "K3", "square matrix"),
        (GOOD + "K3: 1\n", "K3", "square matrix"),
        (GOOD + "L0: [[1]]\n", "L0", "unknown key"),
        (GOOD + "K10: [[1]]\n", "K10", "unknown key"),
        (GOOD + "parameter: 3\n", "parameter", "must be text"),
        (GOOD + "K0: [[1, 2], [3, 4]]\n", "", "twice"),
        ("M: [[1, 2], [2, 1]]\nK0: [[1, 0], [0, 1]]\n", "M", "positive definite"),
        ("M: [[1, 1], [0, 1]]\nK0: [[1, 0], [0, 1]]\n", "M", "symmetric"),
        ("M: [[0]]\nK0: [[1]]\n", "M", "positive definite"),
    ],
)
def test_refusals_name_file_key_and_value(tmp_path, text, where, what):
    with pytest.raises(InputError) as refused:
        _read(tmp_path, text)
    message = str(refused.value)
    assert str(tmp_path / "system.yaml") in message
    assert f": {where}" in message
    assert what in message
    assert "\n" not in message
