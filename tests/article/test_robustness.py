"""The claims around the report's pad: what is told does not hang on how it is computed."""

from pathlib import Path

import numpy as np

from squeal.article.ensembles.choice import read_choice
from squeal.article.studies import robustness
from tests.conftest import ROOT, needs_heyoka

pytestmark = needs_heyoka


def test_some_claims_hold_around_the_pad():
    pad = read_choice(Path(ROOT / "workflow/pad.json"))
    some = robustness.around(pad.numbers, 0.2, np.random.default_rng(1))[:24]
    held = robustness.holding(some, pad.law)
    assert 0.1 < held.mean() < 0.9
