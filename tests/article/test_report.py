"""Tables come from the transition table; every value in the text comes from a result."""

import json
import math
import re

import numpy as np
import pytest

from squeal.article.cases import CASES, HISTORY_FIGURES
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
from squeal.article.report import tables
from squeal.article.report.build import agreement, all_values, angle
from squeal.article.report.latex import alternative, definitions, number, typeset
from squeal.article.report.layout import FIGURES, TABLES
from squeal.article.report.parameters import parameter_rows
from squeal.article.studies.claims import study as claims_study
from squeal.article.studies.eigenvalues import examined, poles
from squeal.commands.simulate import data as simulation_data
from squeal.files.provenance import provenance
from squeal.files.records import to_dict
from squeal.model.equations import PadModel
from squeal.model.linear import Linearisation, linearise
from squeal.model.pad import PARAMETERS
from squeal.model.states import LEAD, NONE
from squeal.scene import read_scene
from squeal.simulation import simulate
from tests.conftest import ROOT

SCENES = ROOT / "workflow" / "scenes"
TEXT = (ROOT / "paper" / "report.tex").read_text(encoding="utf-8")
PREAMBLE, REPORT = TEXT.split(r"\begin{document}")


@pytest.fixture(scope="module")
def scenes():
    return {
        m: [read_scene(SCENES / f"{m}-{c}.yaml", "simulate") for c in CASES] for m in ("b1", "b2")
    }


@pytest.fixture(scope="module")
def results(scenes):
    """Results as the report reads them, but one run standing for all cases of its model."""
    runs = {m: simulation_data(s[0], simulate(s[0])) for m, s in scenes.items()}
    found = {stem: runs[stem[:2]] for stem in HISTORY_FIGURES}
    made = provenance([], "squeal.article.studies.quasi_static").to_dict()
    claims = claims_study([SCENES / f"{stem}.yaml" for stem in HISTORY_FIGURES]).to_dict()
    return found | {
        "claims": claims | {"provenance": made},
        "findings": {"findings": [], "provenance": made},
        "quasi_static": {"share": {"as_printed": 0.1, "sign_aware": 0.9}, "mu": 0.5, "n": 9}
        | {"provenance": made},
        "eigenvalues": {
            "scenes": {"b2-a": to_dict(examined(scenes["b2"][0]))}
            | {f"b2-{c}": {"reason": "none"} for c in "bcd"},
            "provenance": made,
        },
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
    for condition, expression, sign, _ in rows(tables.table_1())[1:]:
        current = condition or current
        (spring,) = set(re.findall(r"r_(\d)", expression))
        found.setdefault(current, set()).add((spring, sign))
    assert found == PUBLISHED_TABLE_1
    assert list(found) == list(PUBLISHED_TABLE_1)


def test_table_2_has_the_published_rows():
    body = rows(tables.table_2())[1:]
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
        by_tilt = [s for (tilt, s) in tables._EQUATION_12 if tilt == sign]
        assert state == by_tilt[row]
        seen.add((sign, row))
    assert len(seen) == 6
    assert LEAD in {s for _, s in tables._EQUATION_12}


def test_every_value_of_the_text_is_defined(results, scenes):
    values = all_values(results, scenes)
    keys = set(re.findall(r"\\val\{([^}#]+)\}", REPORT))
    for figure, stem in re.findall(r"\\history\{(\w+)\}\{([\w-]+)\}", REPORT):
        assert HISTORY_FIGURES[stem] == int(figure.removeprefix("fig"))
        keys |= {f"{stem}.scene", f"{stem}.changes", f"{stem}.stop", f"agreement.{stem}"}
    keys |= {f"{stem}.scene" for stem in re.findall(r"\\scene\{([\w-]+)\}", REPORT)}
    assert len(keys) > 50
    assert keys <= set(values)
    lines = definitions(values).splitlines()
    assert len(lines) == len(values)  # no value breaks a line
    for text in values.values():
        assert text.count("{") == text.count("}")
        assert text.count("$") % 2 == 0
        assert not re.search(r"(?<!\\)[%&#]", text)


def test_no_number_is_typed_in_the_prose():
    body = REPORT.split(r"\begin{abstract}")[1].split(r"\bibliographystyle")[0]
    body = re.sub(r"(?<!\\)%.*", "", body)
    body = re.sub(r"\\begin\{equation\}.*?\\end\{equation\}", "", body, flags=re.S)
    body = re.sub(r"\\begin\{longtable\}.*", "", body)
    names = r"val|ref|label|cite[pt]?|aeqs?|afig|atab|asec|scene|name|figurefile|rows|input|texttt"
    body = re.sub(rf"\\({names})\{{[^}}]*\}}(\{{\w*\}})?", "", body)
    body = re.sub(r"\\history\{\w+\}\{[\w-]+\}", "", body)
    body = re.sub(r"[_^]\{?\d+\}?", "", body)  # indices of symbols
    body = re.sub(r"\b[BE]\d+\b", "", body)  # models and findings
    body = re.sub(r"[=>] 0\b", "", body)  # conditions such as R_n > 0
    assert re.findall(r".{0,30}\d.{0,30}", body) == []


def test_report_shows_all_figures_and_tables():
    shown = re.findall(r"\\(?:figurefile|history)\{fig(\d\d)\}", REPORT)
    assert [int(n) for n in shown] == list(FIGURES)
    read = re.findall(r"\\(?:input\{generated/|rows\{)([\w-]+)\}", TEXT)
    assert {f"{name}.tex" for name in read} == set(TABLES)
    assert REPORT.index("fig02") < REPORT.index("table1") < REPORT.index("fig04")


def test_agreement_counts_what_is_reproduced():
    claims = [
        {"id": "B1-a-x", "case": "a", "verdict": "reproduced", "measured": "1"},
        {"id": "B1-a-y", "case": "a", "verdict": "not reproduced", "measured": "theta 2 %"},
        {"id": "B2-a-x", "case": "a", "verdict": "reproduced", "measured": "3"},
    ]
    text = agreement(claims, "B1", "a")
    assert "Of 2 statements" in text
    assert r"B1-a-y ($\theta$ 2\,\%)" in text
    assert "is reproduced" in agreement(claims, "B2", "a")
    assert agreement(claims, "B2", "b") == ""


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


def test_numbers_in_math():
    assert number(1234567.0, 3) == r"$1.23 \times 10^{6}$"
    assert number(float("nan")) == "--"
    assert angle(math.pi) == r"\pi"
    assert angle(0.75 * math.pi) == r"0.75\,\pi"
    assert bytes.fromhex(alternative("delta é")).decode("utf-16") == "delta é"


def test_parameter_table_has_every_parameter(scenes):
    found = parameter_rows(scenes["b1"], scenes["b2"])
    assert len(found) >= len(PARAMETERS)
    assert all(len(row) == 6 and row[5] for row in found)
    angles = [row for row in found if row[0].startswith(r"$\alpha")]
    assert [row[3:5] for row in angles] == [["by case", "by case"]] * 2


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


def test_python_control_agrees_with_the_program(results):
    found = results["eigenvalues"]["scenes"]["b2-a"]
    assert found["apart"] < 1e-9
    table = tables.eigenvalue_table(results["eigenvalues"]["scenes"])
    assert f"{found['poles'][0]['frequency_hz']:.1f}" in table
    assert found["verdict"] in table
    assert "none" in table


def test_claims_table_holds_every_claim(results):
    text = tables.claims_table(results["claims"]["claims"])
    for claim in CLAIMS:
        assert claim.id in text


def test_results_are_json(results):
    assert json.loads(json.dumps(results))["b1-a"]["model"] == "B1"


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
