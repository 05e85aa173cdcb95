"""Printed lists of the modes of a band, of chains whose roots are known in closed form."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from squeal.proof.bands import judge_modes, prove_modes
from squeal.proof.large import BandProof, prove_band
from squeal.proof.pieces import Piece, Side
from tests.proof.test_large import FLUTTER, QUIET, known_roots, two_chains
from tests.proof.test_roots import distances

LOW = 40.0
HIGH = 200.0


@pytest.fixture(scope="module")
def chains():
    """Two damped chains, one of whose pairs flutters: their proved pieces and listed roots."""
    M, K = two_chains(FLUTTER)
    C = csc_array(2.0 * M + 1e-6 * K)
    roots = known_roots(FLUTTER, 2.0, 1e-6)
    listed = roots[(roots.imag > LOW) & (roots.imag < HIGH)]
    return prove_band(M, C, K, 1.02 * HIGH, core=80), listed


def test_the_roots_of_the_closed_form_are_proved(chains):
    found, listed = chains
    proof = judge_modes(found, listed, LOW, HIGH)
    assert proof.status == "proved"
    assert max(distances(proof, listed)) < 1e-3
    assert (listed.real > 0.0).any()
    assert proof.growth_below == 0.0


def test_growth_of_a_quiet_list_is_bounded():
    M, K = two_chains(QUIET)
    C = csc_array(2.0 * M + 1e-6 * K)
    roots = known_roots(QUIET, 2.0, 1e-6)
    listed = roots[(roots.imag > LOW) & (roots.imag < HIGH)]
    proof = prove_modes(M, C, K, listed, LOW, HIGH)
    assert (proof.status, proof.growth_below) == ("proved", 0.0)
    assert listed.real.max() < 0.0


@pytest.mark.parametrize("seed", range(8))
def test_a_dropped_root_is_missed_where_it_was(chains, seed):
    found, listed = chains
    gone = np.random.default_rng(seed).integers(len(listed))
    proof = judge_modes(found, np.delete(listed, gone), LOW, HIGH)
    assert (proof.status, proof.reason) == ("refuted", "a root is missing")
    assert abs(proof.where - listed[gone]) < 1e-3


@pytest.mark.parametrize("seed", range(8))
def test_a_doubled_root_is_refuted(chains, seed):
    found, listed = chains
    twice = np.random.default_rng(seed).integers(len(listed))
    proof = judge_modes(found, [*listed, listed[twice]], LOW, HIGH)
    assert (proof.status, proof.reason) == ("refuted", "a root is listed that is none")


@pytest.mark.parametrize("seed", range(4))
def test_a_moved_root_has_its_true_distance(chains, seed):
    found, listed = chains
    rng = np.random.default_rng(seed)
    moved = listed.copy()
    which = rng.integers(len(listed))
    moved[which] += 0.01 * np.exp(2j * np.pi * rng.random())
    proof = judge_modes(found, moved, LOW, HIGH)
    assert distances(proof, moved)[which] == pytest.approx(0.01, abs=1e-3)


def test_a_root_at_the_end_of_the_band_is_open(chains):
    found, listed = chains
    end = float(listed.imag.max())
    without = listed[listed.imag < end]
    proof = judge_modes(found, without, LOW, end)
    assert (proof.status, proof.reason) == (
        "open",
        "a root may lie on either side of the band's end",
    )


def test_roots_where_none_are_are_refuted(chains):
    found, listed = chains
    gaps = np.sort(listed.imag)
    middle = (gaps[-1] + gaps[-2]) / 2.0
    width = (gaps[-1] - gaps[-2]) / 4.0
    proof = judge_modes(found, [middle * 1j], middle - width, middle + width)
    assert (proof.status, proof.reason) == ("refuted", "no root is there")


def test_what_decays_faster_than_is_listed_is_not_missed():
    def piece(root: complex) -> Piece:
        radius = 1e-9
        side: Side = "grows" if root.real > 0.0 else "decays"
        low = root.real - radius
        high = root.real + radius
        return Piece(np.array([root]), np.array([radius]), low, high, side, False)

    found = BandProof(10.0, (piece(-0.1 + 1j), piece(-0.8 + 2j), piece(0.9 + 2.5j)))
    assert judge_modes(found, [-0.1 + 1j], 0.5, 3.0).reason == "a root is missing"
    assert judge_modes(found, [-0.1 + 1j], 0.5, 3.0, rate=0.5).status == "proved"
    assert judge_modes(found, [-0.1 + 1j], 0.5, 3.0, rate=0.85).reason == "a root is missing"


def test_without_a_proof_the_reason_is_said():
    proof = prove_modes(np.diag([1.0, -1.0, 1.0]), None, np.eye(3), [1j], 0.5, 2.0)
    assert (proof.status, proof.reason) == ("open", "the diagonal of M is not positive")


@pytest.mark.parametrize(("low", "high"), [(-1.0, 2.0), (2.0, 1.0), (float("nan"), 1.0)])
def test_a_band_must_rise(low, high):
    with pytest.raises(ValueError, match="0 <= low < high"):
        prove_modes(np.eye(3), None, np.eye(3), [1j], low, high)
