"""A pad that flutters, as a file; pictures are made without a layout."""

import pytest

PAD = """model: B1
parameters:
  {m: 0.2, w: 0.04, h: 0.014, k1: 2.0e7, k2: 2.6e7, k3: 8.7e6, k4: 8.7e6, L1: 0.8, L2: 0.8,
   alpha1: 0.5*pi, alpha2: pi, mu: 0.4, F_n: 4500.0}
"""


@pytest.fixture
def pad(tmp_path):
    path = tmp_path / "pad.yaml"
    path.write_text(PAD)
    return path


@pytest.fixture(scope="module", autouse=True)
def _without_layout(without_layout):
    """Of pictures that commands write their kind is at stake, and what they hold."""
