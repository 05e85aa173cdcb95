"""What every contact law satisfies: one formula for all states, in any arithmetic."""

import mpmath as mp
import numpy as np
import pytest

from squeal.errors import InputError
from squeal.model.contact import CONSISTENT, MODELS, Formulation, contact_law, states
from squeal.model.pad import PARAMETERS, coefficients, pose
from tests.conftest import HEYOKA, needs_heyoka, random_pad

if HEYOKA:
    import heyoka as hy

FORMULATIONS = (CONSISTENT, Formulation("mean"), Formulation("mean", "frame", "-"))
LAWS = [
    contact_law(name, formulation)
    for name, model in MODELS.items()
    for formulation in (FORMULATIONS if "line_force" in model.choices else (CONSISTENT,))
]


@pytest.mark.parametrize("law", LAWS, ids=str)
@needs_heyoka
def test_one_formula_serves_all_states_at_once(law):
    """States as arrays and as symbols against states as constants, in 30 digits."""
    pad, r = random_pad(5), np.random.default_rng(3)
    known = states(law.points)
    q = r.uniform(-0.1, 0.1, (3, len(known)))
    on = np.array(known, dtype=float).T
    c, at = coefficients(np, pad, law.absolute_gap), pose(np, tuple(q))
    touching = [any(state) for state in known]

    names = ("x", "y", "theta", *(f"on{i}" for i in range(law.points)))
    symbols = hy.make_vars(*names)
    symbolic = pose(hy, symbols[:3])
    outputs = [*law.loads(c, symbolic, symbols[3:]), law.energy(c, symbolic, symbols[3:])]
    compiled = hy.cfunc(outputs, symbols)(np.concatenate([q, on]))

    with np.errstate(all="ignore"):
        loads, energy = np.array(law.loads(c, at, on)), law.energy(c, at, on)
        signals = np.array(law.signals(c, at, on))
        forces, places = np.array(law.resultant(c, at, on))
    with mp.workdps(30):
        exact = coefficients(mp, pad, law.absolute_gap)
        for i, state in enumerate(known):
            here = pose(mp, tuple(map(mp.mpf, q[:, i])))
            expected = [float(v) for v in law.loads(exact, here, state)]
            expected.append(float(law.energy(exact, here, state)))
            assert [*loads[:, i], energy[i]] == pytest.approx(expected, rel=1e-12, abs=1e-16)
            assert compiled[:, i] == pytest.approx(expected, rel=1e-12, abs=1e-16)
            if touching[i]:
                given = [*law.signals(exact, here, state), *law.resultant(exact, here, state)]
                ours = [*signals[:, i], forces[i], places[i]]
                assert ours == pytest.approx([float(v) for v in given], rel=1e-11, nan_ok=True)
            else:
                assert expected == [0.0] * 4
                is_force = [signal.is_force for signal in law.plotted]
                assert np.isfinite(signals[:, i]).tolist() == is_force
                assert np.isnan(places[i])


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_derivatives_where_a_flag_is_zero(law):
    """Complex steps stay finite in every state, also for a level pad that is pressed down."""
    c = coefficients(np, random_pad(1, theta0=0.0), law.absolute_gap)
    at = pose(np, (0.0, -0.1 + 1e-200j, 0.0))
    for state in states(law.points):
        if all(state) or not any(state):
            assert np.isfinite(law.loads(c, at, state)).all()
            assert np.isfinite(law.energy(c, at, state))


def test_forces_derive_from_the_energy():
    """Without friction, in the laws that have a potential."""
    pad = random_pad(2, mu=0.0)
    for law in (contact_law(n, CONSISTENT) for n in MODELS):
        c = coefficients(np, pad, law.absolute_gap)
        for state in states(law.points):
            q = np.array([0.01, -0.02, 0.03 if state[-1] else -0.03])
            at = pose(np, tuple(q[:, None] + 1e-200j * np.eye(3)))
            slope = law.energy(c, at, state).imag * 1e200 * np.ones(3)
            loads = law.loads(c, pose(np, tuple(q)), state)
            assert -slope == pytest.approx(loads, rel=1e-10, abs=1e-15)


def test_each_model_uses_the_stiffnesses_of_its_law():
    used = {n: {p for p in PARAMETERS if m.uses(p)} for n, m in MODELS.items()}
    of_motion = {"L1", "L2", "F_n", "V", "mu_s", "mu_k", "v_ref", "x0", "y0"}
    assert used["B2"] - used["B3"] == of_motion
    assert used["BN"] == used["B2"]
    assert used["B1"] ^ used["B2"] == {"k3", "k4", "k_c"}
    with pytest.raises(InputError, match="'B9' is not allowed; it must be one of B1, B2, B3, BN"):
        contact_law("B9")
