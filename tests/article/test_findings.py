"""Findings: what the contact laws may and may not feed in, and numbers with known values."""

import dataclasses
import json
import math

import numpy as np
import pytest

from squeal.article.findings import FINDINGS, MeasuredFinding, measure_findings
from squeal.article.findings.equations import energy_gained
from squeal.article.findings.motion import Study
from squeal.article.findings.work import contact_work
from squeal.article.records import from_dict
from squeal.article.studies.findings import Findings, sentences
from squeal.cli.main import main
from squeal.io.provenance import Provenance
from squeal.io.scene import Scene, read_scene
from squeal.model.contact import Formulation, LineForce
from tests.conftest import ROOT, SCENES
from tests.simulation.closed import upright
from tests.simulation.test_simulation import bounce


def study() -> Study:
    b1 = {case: read_scene(SCENES / f"b1-{case}.yaml") for case in "abcd"}
    b2 = {case: read_scene(SCENES / f"b2-{case}.yaml") for case in "abcd"}
    return Study(b1, b2, read_scene(SCENES / "b3.yaml"))


@pytest.fixture(scope="module")
def results():
    return {measured.id: measured for measured in measure_findings(study())}


def test_all_sixteen_are_measured(results):
    assert [f.id for f in FINDINGS] == [f"E{i}" for i in range(1, 17)]
    for name, finding in results.items():
        assert finding.outcome.endswith(".")
        assert all(math.isfinite(v) for v in finding.measured.values()), name


@pytest.mark.parametrize("model", ["B1", "B2"])
@pytest.mark.parametrize("case", ["a", "c"])
def test_works_add_up_to_the_energy_gained(model, case):
    scene = read_scene(SCENES / f"{model.lower()}-{case}.yaml")
    works = contact_work(scene)
    c = works.energies
    bare = c.kinetic + c.springs - c.load
    done = c.normal[-1] + works.friction
    assert done == pytest.approx(bare[-1] - bare[0], abs=1e-11 * works.kinetic)


@pytest.mark.parametrize("case", ["a", "b", "c", "d"])
def test_only_the_law_without_potential_feeds_energy_in(case):
    scene = read_scene(SCENES / f"b2-{case}.yaml")

    def fed(law: LineForce) -> float:
        works = contact_work(dataclasses.replace(scene, formulation=Formulation(law)))
        return works.fed / works.kinetic

    assert abs(fed("integral")) < 1e-11
    partial = any(s[0] != s[1] for s in study().cases[f"b2-{case}"].shares)
    assert (abs(fed("mean")) > 1e-6) is partial


def test_point_contacts_feed_nothing_in():
    works = contact_work(read_scene(SCENES / "b1-a.yaml"))
    assert abs(works.fed) < 1e-11 * works.kinetic


def test_a_drop_without_friction_gives_back_all_of_it():
    pad = upright(mu=0.0)
    height = 1e-3
    scene: Scene = bounce(pad, height, 0.02)
    works = contact_work(scene)
    # all that the fall gains is kinetic at the lowest level of the free fall, up to the sag
    assert works.friction == 0.0
    assert np.abs(works.energies.fed).max() < 1e-11 * works.kinetic


def test_energy_on_a_closed_path_vanishes_with_a_potential():
    pad = read_scene(SCENES / "b2-c.yaml").pad
    gained, energy = energy_gained(pad, "integral")
    assert abs(gained) < 1e-9 * energy
    assert abs(energy_gained(pad, "mean")[0]) > 1e-4 * energy


def test_measured_numbers_have_their_known_values(results):
    def numbers(key: str) -> dict[str, float]:
        return results[key].measured

    # Eq. (22) is a sum of two rank-one matrices: no determinant but with the printed K33
    assert numbers("E2")["exact_greatest"] < 1e-14 < 1e-4 < numbers("E2")["printed_median"]
    assert numbers("E1")["others_off"] < 1e-13 < numbers("E1")["K33_off"]
    assert numbers("E3")["ratio"] == pytest.approx(-1.0, rel=1e-12)
    # the exact arm of friction leaves the constant one at second order
    assert numbers("E10")["order"] == pytest.approx(2.0, abs=0.01)
    shares = numbers("E8")
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-12)
    assert numbers("E12")["imaginary"] < 1e-12
    # rows 1 and 2, and rows 2 and 3, of Eq. (21): K21 = 0 and K11 = k2 or k1; K31 is -h K11 but
    # for the tilt at the start
    for case, spring, sign in (("a", "k2", 1), ("b", "k1", -1)):
        pad = read_scene(SCENES / f"b2-{case}.yaml").pad
        x = pad.mu * pad.F_n / getattr(pad, spring)
        arm = math.hypot(pad.w, pad.h) * math.sin(math.atan2(pad.h, pad.w) + sign * pad.theta0)
        assert numbers("E9")[f"x_12_{case}"] == pytest.approx(x, rel=1e-9)
        assert numbers("E9")[f"x_23_{case}"] == pytest.approx(-x * pad.h / arm, rel=1e-9)
    assert numbers("E9")["as_printed"] < numbers("E9")["complete"]


def test_what_a_finding_is_worth_is_said_once():
    """E1 and E15 stand apart from what changes a figure, which is measured."""
    every = {one.id: one for one in FINDINGS}
    assert {name for name, one in every.items() if one.affects} == {
        name for name, one in every.items() if one.kind == "changes a result"
    }
    measured = {
        "E4": {"fed_mean": 0.2, "fed_integral": 1e-15},
        "E9": {"as_printed": 0.04, "complete": 0.17},
        "E5": {"apart": 0.02},
    }
    findings = tuple(
        MeasuredFinding.of(one, measured=measured.get(one.id, {}), outcome="") for one in FINDINGS
    )
    assert all(sentences(Findings(findings)).values())
    of_e9 = next(i for i, one in enumerate(findings) if one.id == "E9")
    same = dataclasses.replace(findings[of_e9], measured={"as_printed": 0.04, "complete": 0.04})
    elsewhere = dataclasses.replace(findings[of_e9], affects="Fig. 8")
    for other in (same, elsewhere):
        changed = Findings((*findings[:of_e9], other, *findings[of_e9 + 1 :]))
        assert not sentences(changed)["e4-and-e9-change-figures"]


def test_commands_of_several_scenes_name_them_all(capsys):
    scenes = ROOT / "workflow" / "scenes"
    assert main(["findings", "--scenes", str(scenes), "--json"]) == 0
    made = from_dict(Provenance, json.loads(capsys.readouterr().out)["provenance"])
    cases = [f"{model}-{case}.yaml" for model in ("b1", "b2") for case in "abcd"]
    assert [file.name for file in made.inputs] == [*cases, "b3.yaml"]
