"""A map and the queries of single pads: the same verdict, the same critical friction."""

import csv

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.two_ways.asking import (
    PADS,
    ask,
    cases,
    near,
    pad_of,
    pads,
    path,
    quiet,
    run,
    setting,
    uniform,
    verdict_by,
    written,
)

WIDTH = uniform(1e-3, 0.5)
CELL = st.integers(0, 3)
MU_MAX = 2.0  # of both, if left out
UNKNOWN = "unknown"  # of a place where the map cannot know


def mapped(scene, widths, cell, *options):
    """The row of one cell of a map of four about the scene's own angles."""
    numbers, table = scene["parameters"], path("map.csv")
    axes = []
    for option, name, width in zip(
        ("--first", "--second"), ("alpha1", "alpha2"), widths, strict=True
    ):
        axes += [option, f"{name}:{numbers[name] - width!r}:{numbers[name] + width!r}"]
    found = ask("map", written(scene), *axes, "--n", 2, "--csv", table, *options)
    with table.open(newline="") as stream:
        row = list(csv.DictReader(stream))[cell]
    angles = [float(value) for name, value in row.items() if name.startswith("alpha")]
    return found, row, dict(zip(("alpha1", "alpha2"), angles, strict=True))


def alone(scene, place, *options):
    """What `critical-friction` says of the pad of one place."""
    return ask("critical-friction", written(scene), *setting(**place), *options)


def assert_one_verdict(scene, widths, cell):
    """Map, eigenvalues and the list of thresholds agree at one place."""
    mu = scene["parameters"]["mu"]
    _, row, place = mapped(scene, widths, cell)
    thresholds = alone(scene, place, "--mu-max", 1.001 * mu)
    if near(thresholds, mu):
        return
    ended, out, said = run("eigenvalues", written(scene), *setting(**place), "--json")
    if row["verdict"] == UNKNOWN:
        return
    if thresholds["mu_end"] < mu:
        assert row["verdict"] == "beyond a fold", (place, thresholds["end"])
        return
    assert ended == 0, said
    assert row["verdict"] == verdict_by(thresholds, mu, quiet(scene)), place
    assert f'"verdict": "{row["verdict"]}"' in out, place


@cases(12, 0.4)
@given(pads(), st.tuples(WIDTH, WIDTH), CELL)
def test_a_map_has_the_verdicts_of_the_queries(scene, widths, cell):
    assert_one_verdict(scene, widths, cell)


def assert_one_critical_friction(scene, widths, cell):
    """A contour's value is where the query first loses stability or the equilibrium."""
    found, row, place = mapped(scene, widths, cell, "--quantity", "critical-friction")
    if row["verdict"] == UNKNOWN:
        return
    thresholds = alone(scene, place)
    losses = [c for c in thresholds["critical"] if c["kind"] != "restabilised"]
    value = found["values"][cell // 2][cell % 2]
    assert row["critical-friction"] == ("" if value is None else repr(value))
    if thresholds["verdict_at_zero"] in ("flutter", "divergence"):
        assert value in (None, 0.0), place
    elif not losses and thresholds["mu_end"] == MU_MAX:
        assert value is None, (place, value)
    elif not losses:  # the equilibrium ends without a change of verdict, say turned past 90 degrees
        assert value == pytest.approx(thresholds["mu_end"], rel=1e-9), (place, thresholds["end"])
    else:
        exact = 1e-6 if losses[0]["kind"] == "fold" else 1e-9
        assert value == pytest.approx(losses[0]["mu"], rel=exact), (place, losses[0])


@cases(5, 0.05)
@given(pads(), st.tuples(WIDTH, WIDTH), CELL)
@example(pad_of(912), (0.346555, 0.157498), 0)
def test_a_map_has_the_critical_friction_of_the_queries(scene, widths, cell):
    assert_one_critical_friction(scene, widths, cell)


def pad_at(alpha1, alpha2, mu):
    """The pad with point contacts at a place where map and query once differed."""
    numbers = {"alpha1": alpha1, "alpha2": alpha2, "mu": mu}
    return {"model": "B1", "parameters": PADS["B1"] | numbers}


def test_no_fold_is_seen_beside_a_change_of_contact():
    # an edge parts and the pad becomes soft
    assert_one_verdict(pad_at(1.557509108607938, 1.5448663685984143, 0.9), (1e-9, 1e-9), 0)
