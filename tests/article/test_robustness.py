"""The claims around the report's pad: what is told does not hang on how it is computed."""

from pathlib import Path

import numpy as np

from squeal.article.ensembles.choice import read_choice
from squeal.article.studies import robustness
from tests.conftest import ROOT, needs_heyoka

pytestmark = needs_heyoka


def test_denser_samples_tell_the_same_verdicts():
    pad = read_choice(Path(ROOT / "workflow/pad.json"))
    some = robustness.around(pad.numbers, 0.2, np.random.default_rng(1))[:24]
    held = robustness.holding(some, pad.law)
    assert 0.1 < held.mean() < 0.9
    fine = robustness.holding(some, pad.law, robustness.PHASE / 8)
    assert np.array_equal(held, fine)
