"""Modes of a band of more than 400 rows, proved on request; SciPy's dense roots are the truth."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigvals
from scipy.sparse import diags_array, eye_array

import squeal
from squeal.cli.main import main
from squeal.errors import InputError
from squeal.examples.brake import solid_brake, write_brake
from squeal.proof.large import BEYOND_CORE, prove_band
from squeal.proof.pieces import Piece, Side
from squeal.queries.systems.proofs import with_proved_bounds
from squeal.queries.systems.roots import system_roots
from tests.proof.test_large import FLUTTER, known_roots, two_chains

BAND = (500.0, 8000.0)


@pytest.fixture(scope="module")
def system():
    return solid_brake(500, around=42).system


def test_the_list_of_a_brake_is_proved(system):
    M, C, K = (matrix.toarray() for matrix in system.at({"mu": 0.4}))
    n = len(M)
    lower = np.hstack([-np.linalg.solve(M, K), -np.linalg.solve(M, C)])
    roots = eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower]))
    hertz = roots.imag / (2 * np.pi)
    wanted = roots[(hertz > BAND[0]) & (hertz < BAND[1])]
    answer = squeal.eigenvalues(system, 0.4, band=BAND, prove=True)
    assert answer.proof["status"] == "proved"
    assert answer.certified
    assert len(answer.values) == len(wanted)
    for root in answer.eigenvalues:
        assert np.abs(wanted - root.value).min() <= root.rounding + 1e-7
    assert answer.proof["growth_below"] >= 0.0
    counted = squeal.eigenvalues(system, 0.4, band=BAND)
    assert counted.proof["status"] == "counted"
    assert np.array_equal(counted.values, answer.values)


def test_where_it_is_open_the_count_holds():
    """One row is damped far beyond the others."""
    w = 2.0 * np.pi * np.array([10.0, 20.0, *np.linspace(200.0, 400.0, 400)])
    C = np.zeros(402)
    C[300] = 1e4
    system = squeal.System(eye_array(402), diags_array(C), diags_array(w**2))
    answer = squeal.eigenvalues(system, band=(5.0, 50.0), prove=True)
    assert answer.certified
    assert answer.proof["status"] == "counted"
    assert f"not proved: {BEYOND_CORE}" in answer.notes


def test_the_lowest_mode_of_a_band_is_judged_beside_the_others():
    w = 2.0 * np.pi * np.array([10.0, 20.0, *np.linspace(200.0, 400.0, 400)])
    C = np.zeros(402)
    C[:2] = 0.5, -0.002  # of which the second grows by 0.001 1/s
    system = squeal.System(eye_array(402), diags_array(C), diags_array(w**2))
    for modes in (1, 2):
        answer = squeal.eigenvalues(system, band=(5.0, 50.0), modes=modes, prove=True)
        assert (answer.verdict, answer.certified, answer.proof["status"]) == (
            "flutter",
            True,
            "proved",
        )
        assert len(answer.modes) == modes


@pytest.mark.parametrize("count", [1, 3])
def test_each_root_has_its_match(count):
    """No root is left out in silence where matches are missing."""
    roots = squeal.eigenvalues(squeal.System([[1.0]], [[0.2]], [[4.0]])).eigenvalues
    piece = Piece(np.zeros(1, complex), np.ones(1), -1.0, 1.0, "unknown", real=None)
    with pytest.raises(ValueError, match="zip"):
        with_proved_bounds(roots, count * [(piece,)])


def test_a_wrong_list_is_not_certified(system, monkeypatch):
    def without_one(*given, **more):
        roots = system_roots(*given, **more)
        return replace(roots, eigenvalues=roots.eigenvalues[:-1])

    monkeypatch.setattr("squeal.queries.systems.data_precision.system_roots", without_one)
    answer = squeal.eigenvalues(system, 0.4, band=BAND, prove=True)
    assert not answer.certified
    assert answer.proof["status"] == "open"
    assert answer.proof["reason"] == "the referee disagrees: a root is missing"


@pytest.mark.parametrize(("side", "verdict"), [("unknown", "flutter"), ("decays", None)])
def test_a_verdict_of_growth_stays_unless_the_proof_refutes_it(side, verdict, monkeypatch):
    """Chains of known growth with pieces made wider, by 10 1/s, than their growth; and with pieces
    of growing modes that claim these to decay."""
    M, K = two_chains(FLUTTER)
    band = (40.0 / (2 * np.pi), 200.0 / (2 * np.pi))

    def wider(*given, **more):
        proof = prove_band(*given, **more)
        pieces = []
        for piece in proof.pieces:
            high = piece.high + 10.0
            side_of_piece: Side = "unknown"
            if side == "decays" and piece.side == "grows":
                side_of_piece = "decays"
                high = -1e-3
            wide = piece.radii + 10.0
            low = piece.low - 10.0
            pieces.append(replace(piece, radii=wide, low=low, high=high, side=side_of_piece))
        return replace(proof, pieces=tuple(pieces))

    monkeypatch.setattr("squeal.proof.bands.prove_band", wider)
    asked = squeal.eigenvalues(squeal.System(M, K=K), band=band, prove=True)
    if side == "unknown":
        counted = squeal.eigenvalues(squeal.System(M, K=K), band=band)
        roots = known_roots(FLUTTER)
        growth = roots.real[(roots.imag > 40.0) & (roots.imag < 200.0)].max()
        assert counted.verdict == "flutter"
        assert counted.unstable[0].growth_rate == pytest.approx(growth, rel=1e-6)
    assert asked.verdict == verdict
    assert asked.certified
    assert asked.proof["status"] == "counted"
    bound = "exceeds the growth; a narrower band may be proved"
    assert asked.notes[-1].endswith(bound) == (side == "unknown")
    assert bool(asked.unstable) == (side == "unknown")


def test_what_has_no_proof_is_refused(system):
    with pytest.raises(InputError, match="above 400 rows the modes of a band"):
        squeal.eigenvalues(system, 0.4, prove=True)
    with pytest.raises(InputError, match="above 400 rows the modes of a band"):
        squeal.eigenvalues(system, 0.4, region=(-1e3, 1e3, 0.0, 1e4), prove=True)


def test_the_command_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_brake(tmp_path, solid_brake(500, around=42))
    words = ["eigenvalues", "system.yaml", "--band", "500:4000", "--prove", "--json"]
    assert main(words) == 0
    proof = json.loads(capsys.readouterr().out)["proof"]
    assert (proof["status"], proof["by"], proof["data"]) == ("proved", "enclosure", "as given")
