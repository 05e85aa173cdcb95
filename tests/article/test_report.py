"""Tables of the report, and the findings against closed forms."""

import dataclasses
import hashlib
import math
import re
from types import SimpleNamespace
from typing import Annotated, Any, cast

import numpy as np
import pytest

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
from squeal.article.report import contact_states, verdicts
from squeal.article.report.article import eigenvalue_table
from squeal.article.report.hammering import by_model, under_load
from squeal.article.report.identification import hardest
from squeal.article.report.latex import counted, number, plain_values, typeset
from squeal.article.report.making import origin_table, versions
from squeal.article.report.pads import kept_briefly, kept_by, lasts, origin
from squeal.article.report.parameters import angle, parameter_rows
from squeal.article.report.statements import agreement
from squeal.article.results.claims import Hammering, JudgedClaim, Loaded
from squeal.article.results.eigenvalues import EquilibriumPoles
from squeal.article.results.ensembles import ELSEWHERE, Ensembles
from squeal.article.results.loci import HeldThreshold, Loci, Loop
from squeal.article.results.map_ranges import Upright
from squeal.article.results.robustness import Share
from squeal.article.results.starts import KINDS, SceneStarts, Starts
from squeal.article.studies.eigenvalues import examined, poles
from squeal.files.provenance import provenance
from squeal.files.records import Missing, Result
from squeal.model.equations import PadModel
from squeal.model.linear import Linearisation, linearise
from squeal.model.pad import PARAMETERS
from squeal.model.states import LEAD, NONE
from squeal.scene import read_scene
from tests.article import known
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
        JudgedClaim(
            name, verdict, measured, "Sec. 4", "words", "a", ("b1-a",), 0.1, "informative", ""
        )
        for name, verdict, measured in cast(
            Any,
            (
                ("B1-a-x", "reproduced", "1"),
                ("B1-a-y", "not reproduced", "theta 2 %"),
                ("B2-a-x", "reproduced", "3"),
            ),
        )
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
    assert angle(math.pi) == r"\pi"
    assert angle(0.75 * math.pi) == r"0.75\,\pi"


def test_parameter_table_has_every_parameter(scenes):
    found = parameter_rows(scenes["b1"], scenes["b2"])
    assert len(found) >= sum(not p.needs for p in PARAMETERS.values())
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


def test_python_control_agrees_with_the_program(scenes):
    found = examined(scenes["b2"][0])
    assert isinstance(found, EquilibriumPoles)
    assert found.apart < 1e-9
    table = eigenvalue_table({"b2-a": found, "b2-b": Missing("none at all")})
    assert f"{found.poles[0].frequency_hz:.1f}" in table
    assert found.verdict in table
    assert "none at all" in table


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
        "two": provenance(files[1:], "squeal.scene"),
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


def judged_pads(keep: int, lost: str) -> Ensembles:
    """Ensembles of which so many pads keep each conclusion; the plausible one loses a statement."""
    found = known.result("ensembles")
    assert isinstance(found, Ensembles)
    made = {
        name: dataclasses.replace(one, every=dataclasses.replace(one.every, keep=keep))
        for name, one in found.conclusions.items()
    }
    pad = found.chosen["consistent"]
    pad = dataclasses.replace(pad, failing={**pad.failing, "1": (lost,), "3": None, "10": (lost,)})
    pad = dataclasses.replace(pad, failing={**pad.failing, "40": ("B2-c-hammer", "B2-d-trailing")})
    return dataclasses.replace(found, conclusions=made, chosen={**found.chosen, "consistent": pad})


def test_a_verdict_on_motions_turns_with_the_pads_that_keep_it():
    some, none = judged_pads(3, "B2-c-hammer"), judged_pads(0, "B2-c-hammer")
    plausible = judged_pads(0, "B2-b-twice")
    words = {
        (True, 3): "holds for pads fitted to it",
        (True, 0): "holds for one pad fitted to it",
        (False, 3): "holds for other pads, fitted to it",
        (False, 0): "not reproduced by any pad",
    }
    for (held, keep), verdict in words.items():
        claims = dict.fromkeys(some.conclusions["hammering"].statements, held)
        assert verdicts.of_pads(claims, some if keep else none, "hammering") == verdict
    assert lasts(plausible, "hammering") == ["1", "10"]
    assert lasts(none, "hammering") == []
    text = kept_briefly(plausible, "hammering", "found somewhere")
    assert text.startswith("Kept over 1 and 10 windows by this pad, found somewhere; by pads of 12")
    assert "of 40 searches for all statements at once (consistent law: 2 of 5)" in text
    assert text.endswith(r"by 10.00\,\% of random pads (consistent: 10.00\,\%)")
    assert kept_briefly(some, "hammering", "found").endswith(", not by this pad")
    alone = dataclasses.replace(some, chosen={})
    assert kept_briefly(alone, "hammering", "found").endswith(
        "of random pads (consistent: 10.00\\,\\%)"
    )
    assert "keeps it over 1 and 10 windows; it is" in kept_by(plausible, "hammering")
    assert "does not keep it; it is kept by pads of 2 of the 5" in kept_by(some, "hammering")


def test_a_pad_is_said_to_be_sought_where_it_was():
    assert "in which case (c) alone separates" in origin(ELSEWHERE)
    assert origin("search 3 with the consistent law").startswith(
        "chosen from the ensembles (search"
    )


@pytest.mark.parametrize(
    ("b1", "b2", "words"),
    [
        ("acd", "c", "so that B2 alone sets (c) apart"),
        ("c", "ac", "so that B1 alone sets (c) apart"),
        ("ac", "cd", "and so both in (c)"),
        ("c", "c", "in (c), model B2 in (c)"),
        ("a", "", "(a), model B2 in no case"),
    ],
)
def test_hammering_is_told_by_model(b1, b2, words):
    assert by_model(Hammering({"B1": tuple(b1), "B2": tuple(b2)}, {})).endswith(words)


def test_hammering_under_load_is_told_from_the_way_of_delta():
    def told(*rows: Loaded) -> str:
        return under_load(Hammering({"B1": ("c",), "B2": ("c",)}, {"c": rows}))

    far, near, still = Loaded(0.5, -0.9, 0.5, 9), Loaded(1.0, -0.9, 0.05, 9), Loaded(1.0, -1, 1, 3)
    assert "under each of these loads" in told(far)
    assert told(far, near).endswith(r"up to $0.5$\,$F_n$")
    assert told(far, still).endswith(r"up to $0.5$\,$F_n$")
    assert told(near).endswith("by a light touch only")
    assert r"$-0.9$ to $0.5$ while $R_n$ exceeds $0.5$\,$F_n$" in told(
        far, Loaded(2, None, None, 0)
    )
    assert under_load(Hammering({"B1": (), "B2": ()}, {})) == "Model B2 hammers in no case"


def test_what_the_article_argues_with_is_told_apart_from_our_reading():
    names = ("B1-all-separate", "B2-only-c", "B12-more-loss")
    assert "but not our reading" in verdicts.argued(
        dict(zip(names, (True, True, False), strict=True))
    )
    assert "reproduces it" in verdicts.argued(dict.fromkeys(names, True))
    assert "does not" in verdicts.argued(dict(zip(names, (True, False, True), strict=True)))


def test_a_verdict_turns_with_the_results_behind_it():
    def maps(printed, small, exists=0.7):
        share = SimpleNamespace(exists=exists)
        full = Upright(10, 0.1, 0.6, small, 0.25)
        printed_share = SimpleNamespace(share=SimpleNamespace(as_printed=printed))
        return full, cast(Any, printed_share), cast(Any, SimpleNamespace(share=share))

    assert verdicts.region(*maps(0.1, 0)[:2]) == "does not hold"
    assert verdicts.region(*maps(0.1, 10)[:2]) == "holds"
    assert verdicts.region(*maps(0.1, 3)[:2]) == "depends on the pad"
    assert verdicts.region(*maps(0.4, 3)[:2]) == "not reproduced"
    held = {"B3-singular": True}
    assert verdicts.singular(held, maps(0.1, 0)[2]) == "does not follow"
    assert verdicts.singular(held, maps(0.1, 0, 0.0)[2]) == "follows"
    assert verdicts.singular({"B3-singular": False}, maps(0, 0, 0)[2]) == "not reproduced"


def test_that_friction_raises_the_reaction_is_an_identity_where_the_closed_form_holds():
    numbers = {"k2": 1.0, "k_c": 1.0, "mu": 0.25, "h": 0.5}  # 5 over 5 - 3/4

    def raised(margin: float) -> tuple[str, float]:
        claim = known.filled(JudgedClaim, verdict="reproduced", margin=margin)
        if margin < 0.0:
            claim = dataclasses.replace(claim, verdict="not reproduced")
        return verdicts.raised(claim, numbers)

    verdict, factor = raised(0.177)
    assert verdict == "an identity at rest"
    assert factor == pytest.approx(3.0 / 17.0)
    assert raised(0.3)[0] == "holds for this pad"
    assert raised(-0.1)[0] == "not reproduced"


def test_what_differs_between_cases_is_counted_on_random_pads():
    found = judged_pads(3, "B2-b-twice")
    parting = (60, *(0,) * 3, 30, *(0,) * 10, 10)  # in no case, in c only, in all
    some = tuple(dataclasses.replace(e, parting=parting) for e in found.ensembles)
    share = verdicts.differing(dataclasses.replace(found, ensembles=some))
    assert share == pytest.approx(0.3)
    assert verdicts.of_share(share) == "holds for some random pads"
    assert verdicts.of_share(0.7) == "holds for most random pads"
    assert verdicts.of_share(0.0) == "not supported"


def test_the_rotation_is_judged_by_the_thresholds_with_it_and_without():
    def rotation(**pairs: tuple[float | None, float | None]) -> tuple[str, str]:
        def up(mu: float | None) -> tuple[HeldThreshold, ...]:
            return () if mu is None else (HeldThreshold(mu, "flutter", "up"),)

        loci = known.of(Loci)
        scenes = tuple(
            dataclasses.replace(
                loci.scenes[0],
                name=name.replace("_", "-"),
                loop=Loop(False, "", up(free)),
                tilt_held=up(held),
            )
            for name, (free, held) in pairs.items()
        )
        return verdicts.rotation(dataclasses.replace(loci, scenes=scenes))

    verdict, words = rotation(b2_a=(0.9, None), b2_c=(0.2, 1.5))
    assert verdict == "supported"
    assert words == ("B2 (a) nowhere (at $0.9$), B2 (c) at $1.5$ (at $0.2$)")
    assert rotation(b2_c=(0.2, 1.5), b2_d=(0.46, 0.45))[0] == "depends on the case"
    verdict, words = rotation(b1_d=(None, 0.2), b2_d=(0.46, 0.45))
    assert verdict == "not supported"
    assert "B1 (d) at $0.2$ (nowhere)" in words
    assert rotation(b2_b=(None, None))[0] == "not decided"


def test_perpetual_contact_is_judged_by_other_starts():
    found = known.of(Starts)
    assert verdicts.perpetual(found)[0] == "does not hold"
    assert r"$20\,\%$" not in verdicts.perpetual(found)[1]
    assert r"20\,\% in (a)" in verdicts.perpetual(found)[1]
    never: dict[str, SceneStarts | Missing] = {
        name: dataclasses.replace(
            one,
            maps=tuple(dataclasses.replace(m, share={**m.share, KINDS[0]: 0.0}) for m in one.maps),
        )
        for name, one in found.scenes.items()
        if isinstance(one, SceneStarts)
    }
    assert verdicts.perpetual(dataclasses.replace(found, scenes=never))[0] == "supported"
    gone: dict[str, SceneStarts | Missing] = dict.fromkeys(found.scenes, Missing("left out"))
    assert verdicts.perpetual(dataclasses.replace(found, scenes=gone))[0] == "not judged"


def test_the_hardest_statements_are_those_that_fewest_pads_keep():
    shares = {c.id: Share(0.5, (0.4, 0.6)) for c in CLAIMS}
    shares |= {"B12-c-severe": Share(0.04, (0, 1)), "B2-only-c": Share(0.03, (0, 1))}
    shares |= {"B2-b-raised": Share(0.0, (0, 1)), "B1-b-ratio": Share(0.07, (0, 1))}
    assert hardest(shares) == ["B2-only-c", "B12-c-severe", "B1-b-ratio"]


@pytest.mark.parametrize(
    ("n", "words"), [(0, "no change"), (1, "one change"), (2, "2 changes"), (14, "14 changes")]
)
def test_counted_things_agree_with_their_number(n, words):
    assert counted(n, "change") == words
