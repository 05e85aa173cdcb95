"""`squeal map --quantity`: what could not be decided is told."""

import json

import numpy as np

from squeal.analysis.stack import PadStack
from squeal.cli.main import main
from tests.conftest import SCENES

B3 = str(SCENES / "b3.yaml")


def test_values_that_could_not_be_decided_are_told(capsys, monkeypatch):
    losses = PadStack.first_losses

    def undecided(stack, mu_max):
        found = losses(stack, mu_max)
        return found._replace(unknown=np.ones(stack.n, dtype=bool))

    monkeypatch.setattr(PadStack, "first_losses", undecided)
    query = ["map", B3, "--n", "2", "--quantity", "critical-friction", "--json"]
    assert main(query) == 0
    out, err = capsys.readouterr()
    found = json.loads(out)
    (words,) = found["warnings"]
    assert "100 %" in words
    assert words in err
    assert found["admissible"]  # the warning speaks of the quantity, not of equilibria
