"""Matrices in files."""

import numpy as np
import pytest
from scipy.sparse import random_array

from squeal.io.matrices import read_matrix


@pytest.fixture
def matrix():
    made = random_array((20, 20), density=0.2, format="csc", rng=np.random.default_rng(1))
    made.data -= 0.3
    return made


@pytest.fixture
def read(tmp_path):
    def made(name, content, **more):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_matrix(path, **more).matrix.toarray().tolist()

    return made
