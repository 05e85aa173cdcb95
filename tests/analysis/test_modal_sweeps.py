"""Real modes are of the structure as it stands, whatever formula its stiffness has."""

import numpy as np
import pytest
from scipy import sparse

import squeal
from squeal.analysis.answers import Axis
from squeal.analysis.systems import roots
from squeal.analysis.systems.roots import Wanted, reduced_for, system_roots
from squeal.errors import InputError, InputWarning
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula

N = 300


def disc_and_pad(kc):
    """A chain held by a contact at its first row alone, whose friction acts on the second."""
    chain = sparse.diags([[2.0] * (N - 1) + [1.0], [-1.0] * (N - 1), [-1.0] * (N - 1)], [0, 1, -1])
    free = sparse.lil_array(chain)
    free[0, 0] = 1.0
    contact = sparse.csr_array(([1.0], ([0], [0])), shape=(N, N))
    friction = sparse.csr_array(([1.0], ([1], [0])), shape=(N, N))
    factor = {"factor": Formula("kc")} if kc == "named" else {}
    K = (
        Term(sparse.csr_array(free * 1e6)),
        Term(contact * 4e6 if kc == "plain" else contact, **factor),
        Term(friction * 4e6, Formula("mu")),
    )
    numbers = {"kc": 4e6, "mu": 0.2}
    return TermSystem((Term(sparse.eye_array(N, format="csr")),), (), K, numbers)


def test_a_contact_with_a_factor_keeps_its_stiffness_in_a_modal_sweep():
    swept = []
    for kc in ("plain", "named"):
        system = disc_and_pad(kc)
        sweep = squeal.sweep(system, [0.0, 0.2], band=(1.0, 40.0), method="modal")
        swept.append([step.roots for step in sweep.steps])
    assert len(swept[0][0]) > 5
    for plain, named in zip(*swept, strict=True):
        assert np.allclose(plain, named, rtol=1e-9, atol=1e-6)
    full = np.sqrt(
        np.linalg.eigvalsh(system.K[0].matrix.toarray() + 4e6 * np.eye(N)[:, :1] @ np.eye(N)[:1])
    )
    inside = full[(full > 2 * np.pi) & (full < 80 * np.pi)]
    assert swept[1][0].imag == pytest.approx(inside, rel=1e-6)


def test_roots_that_real_modes_lose_are_told(monkeypatch):
    """Four real modes of the lowest frequencies reach no band above."""
    monkeypatch.setattr(roots, "REAL_MODES", 4)
    wanted = Wanted(band=(1.0, 40.0))
    every = system_roots(disc_and_pad("plain"), wanted).eigenvalues
    with pytest.warns(InputWarning, match="real modes lose") as told:
        reduction, region = reduced_for(disc_and_pad("plain"), wanted, [{"mu": 0.0}], "modal")
    lost = len(every) - len(reduction.values(region))
    assert lost > 1
    assert f"lose {lost} of {len(every)} roots" in str(told[0].message)


def test_a_chart_over_a_parameter_that_no_matrix_uses_is_refused():
    with pytest.raises(InputError, match="kc"):
        squeal.map(disc_and_pad("plain"), (Axis("mu", 0.0, 1.0, 2), Axis("kc", 1e6, 2e6, 2)))
