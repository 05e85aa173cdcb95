"""A map and the queries of single pads: the same verdict, the same critical friction."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.two_ways import asking
from tests.two_ways.asking import ask, cases, pads, path, run, setting, uniform, written

WIDTH = uniform(1e-3, 0.5)
CELL = st.integers(0, 3)
PARTS = {"alpha1": 1.557509108607938, "alpha2": 1.5448663685984143, "mu": 0.9}
PARTING = {"model": "B1", "parameters": asking.PADS["B1"] | PARTS}
MU_MAX = 2.0  # of both, if left out
UNKNOWN = "unknown"  # of a place where the map cannot know


def mapped(scene, widths, cell, *options):
    """The row of one cell of a map of four about the scene's own angles."""
    numbers = scene["parameters"]
    table = path("map.csv")

    def axis(name, width):
        return f"{name}:{numbers[name] - width!r}:{numbers[name] + width!r}"

    axes = ("--first", axis("alpha1", widths[0]), "--second", axis("alpha2", widths[1]))
    given = (*axes, "--n", 2, "--csv", table, *options)
    found = ask("map", written(scene), *given)
    row = asking.rows(table)[cell]
    angles = [float(value) for name, value in row.items() if name.startswith("alpha")]
    return found, row, dict(zip(("alpha1", "alpha2"), angles, strict=True))


@cases(3, 0.21)
@given(pads(), st.tuples(WIDTH, WIDTH), CELL)
@example(PARTING, (1e-9, 1e-9), 0)  # an edge parts, the pad becomes soft, and this is no fold
def test_a_map_has_the_verdicts_of_the_queries(scene, widths, cell):
    """Map, eigenvalues and the list of thresholds agree at one place."""
    mu = scene["parameters"]["mu"]
    _, row, place = mapped(scene, widths, cell)
    given = written(scene), *setting(**place)
    thresholds = ask("critical-friction", *given, "--mu-max", 1.001 * mu)
    if asking.near(thresholds, mu):
        return
    ended, out, said = run("eigenvalues", *given, "--json")
    if row["verdict"] == UNKNOWN:
        return
    if thresholds["mu_end"] < mu:
        assert row["verdict"] == "beyond a fold", (place, thresholds["end"])
        return
    assert ended == 0, said
    assert row["verdict"] == asking.verdict_by(thresholds, mu, scene), place
    assert f'"verdict": "{row["verdict"]}"' in out, place


@cases(1, 0.05)
@given(pads(), st.tuples(WIDTH, WIDTH), CELL)
@example(asking.pad_of(912), (0.346555, 0.157498), 0)
@example(asking.pad_of(29), (0.0259734, 0.0259734), 0)  # growth rises by 2 1/s over all of mu
def test_a_map_has_the_critical_friction_of_the_queries(scene, widths, cell):
    """A contour's value is where the query first loses stability or the equilibrium."""
    found, row, place = mapped(scene, widths, cell, "--quantity", "critical-friction")
    if row["verdict"] == UNKNOWN:
        return
    thresholds = ask("critical-friction", written(scene), *setting(**place))
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
        if value != pytest.approx(losses[0]["mu"], rel=exact):
            # a map sees growth beyond its rounding, which may be slow to rise
            assert value == pytest.approx(losses[0]["mu"], rel=1e-6), (place, losses[0])
            found = asking.roots(ask("eigenvalues", written(scene), *setting(**place, mu=value)))
            assert abs(found.real.max()) <= 1e-12 * abs(found).max(), (place, losses[0])
