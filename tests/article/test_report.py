"""Tables of the report, and the findings against closed forms."""

import dataclasses
import hashlib
import math
import re
from typing import Annotated, Any, cast

import numpy as np
import pytest

from squeal.analysis.eigenvalues import analyse
from squeal.article.cases import CASES
from squeal.article.claims import CLAIMS
from squeal.article.equations import stiffness
from squeal.article.findings.equations import (
    energy_gained,
    friction_arm,
    integrand_sign,
    random_pads,
    singularity,
    slope,
    stiffness_entries,
)
from squeal.article.findings.motion import flipped
from squeal.article.report import contact_states
from squeal.article.report.article import eigenvalue_table
from squeal.article.report.latex import (
    counted,
    long_table,
    number,
    percent,
    plain_values,
    typeset,
)
from squeal.article.report.making import origin_table, versions
from squeal.article.report.parameters import angle, parameter_rows, start
from squeal.article.report.statements import agreement, together
from squeal.article.results.claims import JudgedClaim
from squeal.article.results.eigenvalues import EquilibriumPoles
from squeal.article.results.records import Missing, Result
from squeal.article.studies.eigenvalues import examined, poles
from squeal.io.provenance import provenance
from squeal.io.scene import read_scene
from squeal.model.equations import PadModel
from squeal.model.linear import Linearisation, linearise
from squeal.model.pad import PARAMETERS
from squeal.model.states import LEAD, NONE
from tests.conftest import ROOT

SCENES = ROOT / "workflow" / "scenes"


@pytest.fixture(scope="module")
def scenes():
    return {
        m: [read_scene(SCENES / f"{m}-{c}.yaml", "simulate") for c in CASES] for m in ("b1", "b2")
    }


def rows(table):
    """Cells of a LaTeX table's lines."""
    lines = [line for line in table.splitlines() if line.endswith(r"\\")]
    return [[cell.strip() for cell in line.removesuffix(r"\\").split("&")] for line in lines]


# The article's Table 1: which contact spring reaches its free length, and how.
PUBLISHED_TABLE_1 = {
    "1--2": {("3", "positive"), ("4", "positive")},
    "2--1": {("3", "negative"), ("4", "negative")},
    "1--3": {("4", "positive")},
    "3--1": {("4", "negative")},
    "1--4": {("3", "positive")},
    "4--1": {("3", "negative")},
    "2--3": {("3", "negative")},
    "3--2": {("3", "positive")},
    "2--4": {("4", "negative")},
    "4--2": {("4", "positive")},
}


def test_table_1_is_the_published_one():
    found: dict[str, set[tuple[str, str]]] = {}
    current = ""
    for condition, expression, sign, _ in rows(contact_states.table_1())[1:]:
        current = condition or current
        (spring,) = set(re.findall(r"r_(\d)", expression))
        found.setdefault(current, set()).add((spring, sign))
    assert found == PUBLISHED_TABLE_1
    assert list(found) == list(PUBLISHED_TABLE_1)


def test_table_2_has_the_published_rows():
    body = rows(contact_states.table_2())[1:]
    states = [re.findall(r"\((\w\w)\)", row[3])[0] for row in body]
    assert states == ["SS", "PC", "FC", "FC", "SS", "FC", "PC", "SS"]
    assert [bool(row[0]) for row in body] == [True, False, False, True, False, True, False, False]


def test_penetrations_decide_table_2_as_eq_12_does():
    """Random tilted poses: the row chosen by x_cl has the state that the penetrations tell."""
    pad = read_scene(SCENES / "b2-c.yaml").pad
    model, random = PadModel("B2", pad), np.random.default_rng(3)
    seen = set()
    for _ in range(500):
        phi = random.uniform(-0.2, 0.2)
        y = -pad.y0 + random.uniform(-1.5, 1.5) * pad.w * phi
        x_cl = -(pad.y0 + y + pad.h) / math.tan(phi) + pad.h / math.sin(phi)
        x_l = -(pad.w * math.cos(phi) - pad.h * math.sin(phi))
        x_t = pad.w * math.cos(phi) + pad.h * math.sin(phi)
        row = 0 if x_cl <= x_l else 1 if x_cl < x_t else 2
        state = model.state_at(np.array([0.0, y, phi - pad.theta0]))
        sign = 1 if phi > 0 else -1
        by_tilt = [s for (tilt, s) in contact_states._EQUATION_12 if tilt == sign]
        assert state == by_tilt[row]
        seen.add((sign, row))
    assert len(seen) == 6
    assert LEAD in {s for _, s in contact_states._EQUATION_12}


def test_agreement_counts_what_is_reproduced():
    claims = [
        JudgedClaim(name, verdict, measured, "Sec. 4", "words", "a", scenes, 0.1, "informative", "")
        for name, verdict, measured, scenes in cast(
            Any,
            (
                ("B1-a-x", "reproduced", "1", ("b1-a",)),
                ("B2-a-y", "not reproduced", "theta 2 %", ("b1-a", "b2-a")),
                ("B2-a-x", "reproduced", "3", ("b2-a",)),
            ),
        )
    ]
    claims.append(dataclasses.replace(claims[1], case="a, b"))  # about another case, too
    for stem in ("b1-a", "b2-a"):
        text = agreement(claims, stem)
        assert "Of 2 statements of the article on this case alone" in text
        assert r"B2-a-y ($\theta$ 2\,\%)" in text
    assert "on this case alone is reproduced" in agreement(claims[:1], "b1-a")
    assert agreement(claims, "b2-b") == ""


@pytest.mark.parametrize(
    ("plain", "latex"),
    [
        ("theta0 + theta > 0", r"$\theta_0$ + $\theta$ $>$ 0"),
        ("1.2e-05 of K33", r"$1.2 \times 10^{-5}$ of $K_{33}$"),
        ("12.5 % of a_b", r"12.5\,\% of a\_b"),
        ("from -0.3 to +1", r"from $-0.3$ to $+1$"),
        ("B2-b-theta (24 x 24)", r"B2-b-theta (24 $\times$ 24)"),
        ("the theatre & more", r"the theatre \& more"),
    ],
)
def test_typeset(plain, latex):
    assert typeset(plain) == latex


@dataclasses.dataclass(frozen=True)
class Inner:
    share: Annotated[float, ".1%"]
    kinds: dict[str, Annotated[float, "power"]]
    rows: tuple[float, ...]


class Outer(Result, kw_only=True):
    inner: Inner | Missing
    error: Annotated[float, ".2g"]
    mu: float
    n: int
    word: str


def test_plain_values_of_a_result_by_dotted_name():
    inner = Inner(0.1234, {"as is": 1e-9}, (1.0, 2.0))
    found = Outer(inner=inner, error=1.26e-7, mu=0.77756, n=5, word="a_b")
    assert plain_values("x", found) == {
        "x.inner.share": r"12.3\,\%",
        "x.inner.kinds.as-is": "$10^{-9}$",
        "x.error": r"$1.3 \times 10^{-7}$",
        "x.mu": "$0.7776$",
        "x.n": "5",
        "x.word": r"a\_b",
    }
    missing = plain_values("x", dataclasses.replace(found, inner=Missing("none")))
    assert missing["x.inner.reason"] == "none"


def test_numbers_in_math():
    assert number(1234567.0, 3) == r"$1.23 \times 10^{6}$"
    assert number(float("nan")) == "--"
    assert percent(0.99874, 0) == r"99.9\,\%"
    assert percent(0.99999, 1) == r"99.999\,\%"
    assert percent(0.99, 0) == r"99\,\%"
    assert percent(1.0, 0) == percent(1.0 - 1e-16, 0) == r"100\,\%"
    assert plain_values("x", 0.9996, Annotated[float, ".1%"]) == {"x": r"99.96\,\%"}
    assert angle(math.pi) == r"\pi"
    assert angle(0.75 * math.pi) == r"0.75\,\pi"


def test_parameter_table_has_every_parameter(scenes):
    found = parameter_rows(scenes["b1"], scenes["b2"])
    assert len(found) >= sum(not p.needs for p in PARAMETERS.values())
    assert all(len(row) == 6 and row[5] for row in found)
    angles = [row for row in found if row[0].startswith(r"$\alpha")]
    assert [row[3:5] for row in angles] == [["by case", "by case"]] * 2


def test_how_the_scenes_start_is_told(scenes):
    own = [*scenes["b1"], *scenes["b2"]]
    at_rest = r"All scenes start at rest, with $x(0)$ and $\theta(0)$ zero, and last $3.162$\,ms."
    assert start(own) == at_rest
    moving = dataclasses.replace(own[0], initial=(1e-6, 0.0, 0.0, 0.0, 0.1, 0.0), stop=1.0)
    assert start([moving]).startswith(r"All scenes start as given, with $y(0)$ and $\theta(0)$")


def test_poles_of_a_pad_on_springs_alone():
    """Uncoupled: a frequency sqrt(k/m)/(2 pi), two poles at the origin, and a divergence."""
    K = np.diag([8.0e6, 0.0, -2.0e4])
    found = poles(Linearisation(np.diag([2.0, 2.0, 5e-4]), np.zeros((3, 3)), K))
    still = [p for p in found if p.imag == 0.0]
    (moving,) = (p for p in found if p.imag)
    assert moving.frequency_hz == pytest.approx(2000.0 / (2 * math.pi), rel=1e-12)
    assert moving.real == 0.0
    growth = math.sqrt(2.0e4 / 5e-4)
    assert sorted(p.real for p in still) == pytest.approx([-growth, 0.0, 0.0, growth], abs=1e-3)


def test_python_control_agrees_with_the_program(scenes):
    found = examined(scenes["b2"][0])
    assert isinstance(found, EquilibriumPoles)
    assert found.apart < 1e-9
    table = eigenvalue_table({"b2-a": found, "b2-b": Missing("none at all")})
    assert f"{found.poles[0].frequency_hz:.1f}" in table
    assert found.verdict in table
    assert "none at all" in table


def test_reactions_without_friction_are_alike_in_mirrored_cases(scenes):
    """(a) and (b) are mirror images where both springs are alike, and so is all but friction."""
    pair = [
        examined(dataclasses.replace(s, pad=s.pad.replace(k2=s.pad.k1))) for s in scenes["b2"][:2]
    ]
    a, b = (one for one in pair if isinstance(one, EquilibriumPoles))
    assert a.free == pytest.approx(b.free, rel=1e-9)
    assert a.R_n < a.free
    assert b.R_n > b.free


def test_flutter_begins_where_the_real_parts_do(scenes):
    scene = scenes["b2"][2]
    found = examined(scene)
    assert isinstance(found, EquilibriumPoles)
    for by, mu in found.flutter.items():
        assert mu is not None
        for factor, leaves in ((0.999, False), (1.001, True)):
            pad = scene.pad.replace(k_c=float(by) * scene.pad.k_c, mu=factor * mu)
            values = analyse(dataclasses.replace(scene, pad=pad)).spectrum.values
            assert (values.real.max() > 1e-6 * abs(values).max()) == leaves


def test_the_last_row_of_a_long_table_stays_with_that_before():
    for n in (1, 2, 4):
        body = long_table(["a"], [[str(i)] for i in range(n)]).split("\\endfoot\n")[1]
        assert body.count(r" \\*") == (n > 1)
        assert body.endswith(rf"{n - 1} \\" + "\n")
        if n > 1:
            assert rf"{n - 2} \\*" in body


def test_versions_that_differ_between_results_are_all_told():
    one = provenance([], "squeal.errors")
    other = dataclasses.replace(one, versions={"python": "2.7", "numpy": "0.1"})
    told = versions([one, other, one])
    assert told["version.python"] == f"{one.versions['python']}, 2.7"
    assert told["version.numpy"] == "0.1"


def test_origin_table_names_each_file_once_with_its_digest():
    files = [SCENES / "b1-a.yaml", SCENES / "b2-c.yaml"]
    made = {
        "one": provenance(files, "squeal.errors"),
        "two": provenance(files[1:], "squeal.io.scene"),
        "three": provenance([], "squeal.errors"),
    }
    body = rows(origin_table(made))[1:]
    for file, row in zip(files, body, strict=False):
        digest = hashlib.sha256(file.read_bytes()).hexdigest()[:16]
        assert row == [rf"\texttt{{{file.name}}}", rf"\texttt{{{digest}}}", ""]
    assert [row[2] for row in body[2:]] == ["b1-a, b2-c", "b2-c", "--"]
    assert body[2][1] == rf"\texttt{{{made['one'].source_sha256}}}" != body[3][1]


# findings: each number against a closed form


def test_printed_K33_lacks_the_second_spring():
    pads = random_pads(5, seed=4)
    found = stiffness_entries(pads).numbers
    assert found["others_off"] < 1e-14
    worst = 0.0
    for pad in pads:
        s1 = math.sin(pad.alpha1 + math.atan2(pad.h, pad.w)) ** 2 * pad.k1
        s2 = math.sin(pad.alpha2 + math.atan2(pad.h, pad.w)) ** 2 * pad.k2
        worst = max(worst, s2 / (s1 + s2))
        gradient = linearise(PadModel("B3", pad), np.zeros(3), NONE).K
        assert gradient == pytest.approx(stiffness(pad), rel=1e-9, abs=1e-12)
    assert found["K33_off"] == pytest.approx(worst, rel=1e-9)


def test_exact_stiffness_is_singular_and_the_printed_one_is_not():
    found = singularity().numbers
    assert found["exact_greatest"] < 1e-14
    assert found["printed_median"] > 1e-3


def test_only_the_mean_law_gains_energy(scenes):
    pad = scenes["b2"][2].pad
    mean, energy = energy_gained(pad, "mean")
    integral, _ = energy_gained(pad, "integral")
    assert abs(integral) < 1e-12 * energy
    assert abs(mean) > 1e-3 * energy


def test_single_pose_findings(scenes):
    pad = scenes["b2"][2].pad
    assert integrand_sign(pad).numbers["ratio"] == pytest.approx(-1.0, rel=1e-12)
    assert slope(pad).numbers["off"] < 1e-14
    assert friction_arm(scenes["b1"][2].pad).numbers["order"] == pytest.approx(2.0, abs=0.01)


def test_a_switch_turns_over_and_back(scenes):
    scene = scenes["b2"][0]
    for switch in ("line_force", "delta_from", "delta_moment"):
        other = flipped(scene, switch)
        assert getattr(other.formulation, switch) != getattr(scene.formulation, switch)
        assert flipped(other, switch) == scene


@pytest.mark.parametrize(
    ("n", "words"), [(0, "no change"), (1, "one change"), (2, "2 changes"), (14, "14 changes")]
)
def test_counted_things_agree_with_their_number(n, words):
    assert counted(n, "change") == words


def test_statements_that_exclude_each_other_cannot_all_hold():
    """That B2 (b) tilts up, and on which side its reaction acts while contact is kept."""
    informative = [claim.id for claim in CLAIMS if claim.informative]
    assert together(informative) == len(informative) - 1
    assert together(["B2-b-theta", "B2-b-tilt"]) == 1
    assert together(["B2-b-theta", "B2-b-trailing", "B2-only-c"]) == 2
    assert together(["B2-b-theta", "B2-b-trailing"]) == 2  # says nothing of the tilt by itself
    assert together(["B2-b-trailing", "B2-only-c"]) == 2
