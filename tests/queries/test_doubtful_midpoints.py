"""Counts between thresholds where the sign of a projected root is not that of the full system."""

from dataclasses import replace

import squeal
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.queries.systems import thresholds
from squeal.results.sources import EigenvalueSelection
from squeal.sparse import first_look
from squeal.sparse.first_look import FirstLook
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.region_roots import modes_in
from tests.sparse.test_first_look import BAND, random_brake

HIGH = 0.7  # of mu, in the middle of which damping is largest
REGION = EigenvalueSelection(BAND).rectangle


def least_growth(brake, mu):
    """Where the growth rate of the fastest root is least, near `mu`, and that rate (1/s)."""
    scaled = ScaledSystem(brake)

    def rate(at):
        return modes_in(scaled.at({"mu": at}), REGION, False, exact=1e-13).values.real.max()

    for step in (0.02, 0.01):  # the vertex of a parabola through three points
        below, here, above = rate(mu - step), rate(mu), rate(mu + step)
        mu -= step * (above - below) / (2 * (below - 2 * here + above))
    return mu, rate(mu)


def test_a_doubtful_sign_is_counted_in_full_before_another_basis_is_built(monkeypatch):
    """P(lambda + s) has the roots of P moved by -s: the least growth becomes a decay of 1e-6."""
    monkeypatch.setattr(first_look, "ONE_ROUND_ERROR", 1.0)  # errors of 4e-5 1/s remain
    brake = random_brake(1)
    M, C, K = brake.M[0].matrix, brake.C[0].matrix, brake.K[0].matrix
    more = Formula("mu * (0.7 - mu) * 4 / 0.49")  # 1 in the middle
    added = Term(0.2 * C, more)
    middle, rate = least_growth(replace(brake, C=(Term(C), added)), HIGH / 2)
    s = rate + 1e-6
    shifted_C = (Term(C + 2 * s * M), added)
    shifted_K = (Term(K + s * C + s * s * M), brake.K[1], Term(s * added.matrix, more))
    agreements = []
    projected = FirstLook.misses_none

    def noted(look, changes, growing):
        agreements.append(projected(look, changes, growing))
        return agreements[-1]

    def refused(*arguments):
        raise AssertionError("another basis is built")

    monkeypatch.setattr(FirstLook, "misses_none", noted)
    monkeypatch.setattr(thresholds, "reduced_for", refused)
    # the values of the search include 6.0371 / 12 of the range: the sign there is known
    high = middle * 12 / 6.0371
    answer = squeal.thresholds(replace(brake, C=shifted_C, K=shifted_K), high, band=BAND)
    assert agreements.count(False) == 1
    assert answer.certified
