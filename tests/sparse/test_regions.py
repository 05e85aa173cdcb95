"""Regions, circles around them and how roots are counted there, against brute force."""

import numpy as np
import pytest

from squeal.errors import InputError
from squeal.sparse.argument_principle import Disc, Rectangle, _winding_number, band, disc_around

BOX = Rectangle(-3.0, 1.0, 2.0, 4.0)


def test_a_rectangle_holds_what_lies_within_its_sides(rng):
    assert (BOX.size, BOX.centre, BOX.radius) == (4 + 2j, -1 + 3j, 5**0.5)
    values = BOX.centre + 3 * (rng.uniform(-1, 1, 400) + 1j * rng.uniform(-1, 1, 400))
    inside = (values.real > -3) & (values.real < 1) & (values.imag > 2) & (values.imag < 4)
    assert 40 < inside.sum() < 360
    for share in (0.25, -0.25):
        wide = BOX.widened(share)
        assert wide == Rectangle(-3 - 4 * share, 1 + 4 * share, 2 - 2 * share, 4 + 2 * share)
    assert np.array_equal(BOX.contains(values), inside)
    assert np.array_equal(BOX.distance(values) < 0, inside)
    ways = np.array([1.5 + 3j, -3.25 + 3j, -1 + 1.5j, -1 + 4.75j, -1 + 3.5j, -2.75 + 3j])
    assert BOX.distance(ways).tolist() == [0.5, 0.25, 0.5, 0.75, -0.5, -0.25]
    assert Disc(2.0, 1j).contains(np.array([2.9j, 3.1j, -0.9j, 2 + 1.1j])).tolist() == [1, 0, 1, 0]


@pytest.mark.parametrize("ends", [(1, 1, 0, 1), (0, 1, 1, 1), (2, 1, 0, 1), (0, np.inf, 0, 1)])
def test_sides_must_be_apart_and_finite(ends):
    with pytest.raises(InputError, match="is not allowed"):
        Rectangle(*ends)


@pytest.mark.parametrize("ends", [(2.0, 2.0), (3.0, 2.0), (-1.0, 2.0), (1.0, np.inf)])
def test_a_band_must_rise_from_zero_on(ends):
    turn = 2 * np.pi
    assert band(0.0, 2.0) == Rectangle(-turn / 2, turn / 2, 0.0, 2 * turn)
    with pytest.raises(InputError, match="is not allowed"):
        band(*ends)


def test_the_outline_around_a_region_runs_as_far_from_roots_as_any(rng):
    for reach in (1.0, 3.0, 20.0):
        known = BOX.centre + 5 * (rng.uniform(-1, 1, 9) + 1j * rng.uniform(-1, 1, 9))
        disc = disc_around(BOX, known, reach)
        least = BOX.radius
        most = max(least + (min(reach, 3 * least) - least) / 4, 1.01 * least)
        assert disc.centre == BOX.centre
        assert least < disc.radius < most
        ends = np.array([least, most, *np.abs(known - BOX.centre)])  # the ends are as bad
        radii = np.linspace(least, most, 500)
        apart = np.abs(ends[:, None] - radii).min(axis=0)
        assert np.abs(ends - disc.radius).min() >= apart.max() - 1e-12


def logarithms(roots, nodes, rng):
    """Of a polynomial on the unit circle, the phase but for half turns."""
    places = np.exp(2j * np.pi * np.arange(nodes) / nodes)
    logs = np.log(places[:, None] - roots).sum(axis=1)
    return logs + 1j * np.pi * rng.integers(-3, 4, nodes)


def test_a_count_is_the_number_of_missing_roots_where_none_is_near_the_outline(rng):
    for _ in range(300):
        inside = rng.integers(0, 3)
        outside = rng.integers(0, 9)
        sizes = np.concatenate([rng.uniform(0, 0.3, inside), rng.uniform(3, 9, outside)])
        roots = sizes * np.exp(2j * np.pi * rng.random(len(sizes)))
        assert _winding_number(logarithms(roots, 32, rng)) == inside


@pytest.mark.parametrize(("nodes", "share"), [(8, 0.1), (16, 0.45), (32, 0.65)])
def test_a_missing_root_is_counted_or_leaves_the_count_open(nodes, share, rng):
    """Right wherever it lies, and settled at least for the share of radii that nodes resolve."""
    settled = 0
    for size in np.linspace(0.01, 1.6, 1000):
        roots = size * np.exp(2j * np.pi * rng.random(1))
        count = _winding_number(logarithms(roots, nodes, rng))
        assert count in (None, int(size < 1.0))
        settled += count is not None
    assert settled / 1000 > share
    assert _winding_number(logarithms(np.array([0.999]), nodes, rng)) is None


def test_a_known_root_at_a_node_leaves_the_count_open():
    """Its factor is zero there, so that the logarithms are not finite."""
    with np.errstate(all="ignore"):
        assert _winding_number(np.array([np.inf, 0, 0, 0, 0, 0, 0, 0], dtype=complex)) is None
