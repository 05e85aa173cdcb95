"""The verdicts with other parameter sets: the folders beside the reference scenes."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

from squeal.analysis.thresholds import critical_friction
from squeal.article.cases import CASES, HISTORY_FIGURES, STEMS, stem
from squeal.article.claims import CLAIMS, judge_claims, linear_measures, measure_scenes
from squeal.article.claims.rules import hammering_cases
from squeal.article.records import Record, Result
from squeal.article.studies._scenes import read_scenes
from squeal.article.studies.hammering import contact, motion
from squeal.article.studies.onset import RATIO, after
from squeal.errors import ComputationError
from squeal.io.provenance import NOT_INSTALLED, version
from squeal.io.scene import Scene

REFERENCE = "reference"
FLATTEST = 0.296  # h/w below which delta can be positive in case (d), by Eq. (8)
Share = Annotated[float, ".1%"]


class ParameterSet(Record):
    """A parameter set under the article's statements.

    numbers: h/w, k2/k1, k3/k1, k4/k1, k_c/k1, L/w, mu and F_n/(k1 w); satisfied: the independent
    statements; failing: ids of all that it does not satisfy; hammering: the cases that hammer by
    model; critical, points: by case of B2 and of B1 the friction at which the equilibrium begins to
    flutter without damping, None if it does not up to that of the set; lost: mean share of time
    over the cases in which an edge is separated that touches in the equilibrium, by model; lasting:
    share of the initial conditions from which contact is lost on and on in case (d) with damping,
    by model.
    """

    numbers: dict[str, float]
    satisfied: int
    failing: tuple[str, ...]
    hammering: dict[str, tuple[str, ...]]
    critical: dict[str, float | None]
    points: dict[str, float | None]
    lost: dict[str, Share]
    lasting: dict[str, Share]


class Sets(Result):
    """The parameter sets by name, the reference first; statements: how many are independent."""

    sets: dict[str, ParameterSet]
    statements: int

    @property
    def flat(self) -> list[ParameterSet]:
        """Those whose height allows a positive delta in case (d)."""
        return [one for one in self.sets.values() if one.numbers["h"] < FLATTEST]


def _critical(scene: Scene) -> float | None:
    try:
        points = critical_friction(scene, scene.pad.mu).points
    except ComputationError:
        return None
    return next((point.mu for point in points if point.kind == "flutter"), None)


def parameter_set(scenes: Mapping[str, Scene]) -> ParameterSet:
    """A set from its nine scenes."""
    b1, b2 = ({c: scenes[stem(m, c)] for c in CASES} for m in ("B1", "B2"))
    cases = measure_scenes(b1, b2)
    linear = linear_measures({case: scene.pad for case, scene in b2.items()})
    judged = judge_claims({**cases, "b3": linear})
    independent = {claim.id for claim in CLAIMS if claim.informative}
    line, points = b2["c"].pad, b1["c"].pad
    lost = {name: motion(case, contact(scenes[name])).lost for name, case in cases.items()}
    assert points.k3 is not None
    assert points.k4 is not None
    assert line.k_c is not None
    assert line.F_n is not None
    late = {}
    if version("heyoka") != NOT_INSTALLED:
        for model, scene in (("B1", b1["d"]), ("B2", b2["d"])):
            row, _ = after(scene, RATIO)
            late[model] = row.lasting / row.starts
    return ParameterSet(
        numbers={
            "h": line.h / line.w,
            "k2": line.k2 / line.k1,
            "k3": points.k3 / points.k1,
            "k4": points.k4 / points.k1,
            "k_c": line.k_c / line.k1,
            "L": line.L1 / line.w,
            "mu": line.mu,
            "F_n": line.F_n / (line.k1 * line.w),
        },
        satisfied=sum(one.holds for one in judged if one.id in independent),
        failing=tuple(one.id for one in judged if not one.holds),
        hammering=hammering_cases(cases),
        critical={case: _critical(scene) for case, scene in b2.items()},
        points={case: _critical(scene) for case, scene in b1.items()},
        lost={
            model: sum(v for name, v in lost.items() if name.startswith(model.lower())) / 4
            for model in ("B1", "B2")
        },
        lasting=late,
    )


def study(files: Sequence[Path]) -> Sets:
    """The sets in the folders of the scene files."""
    folders = list(dict.fromkeys(file.parent for file in files))
    first, *others = sorted(folders, key=lambda folder: len(folder.parts))
    found = {}
    for name, folder in ((REFERENCE, first), *((one.name, one) for one in others)):
        own = [file for file in files if file.parent == folder and file.stem in STEMS]
        found[name] = parameter_set(read_scenes(own, HISTORY_FIGURES, "simulate"))
    return Sets(sets=found, statements=sum(claim.informative for claim in CLAIMS))


def sentences(found: Sets) -> Mapping[str, bool]:
    """What the paper says of all sets."""
    every, flat, first = found.sets.values(), found.flat, found.sets[REFERENCE]
    lines = [one.hammering["B2"] for one in every]
    lasting = {name: one.lasting for name, one in found.sets.items() if one.lasting}
    return {
        "three-flat-sets": len(flat) >= 3,
        "one-set-satisfies-all-that-can-hold": found.sets["set-4"].satisfied
        == found.statements - 1,
        "flat-sets-need-much-friction": all(one.numbers["mu"] > 0.58 for one in flat),
        "line-hammers-in-c-alone-in-three-sets": sorted(lines) == [(), ("c",), ("c",), ("c",)],
        "points-hammer-in-d-in-every-set": all("d" in one.hammering["B1"] for one in every),
        "cases-differ-in-each-set": all(0 < len(one.hammering["B1"]) < len(CASES) for one in every),
        "points-lose-more-in-every-set": all(one.lost["B1"] > one.lost["B2"] for one in every),
        "only-c-flutters": [c for c, mu in first.critical.items() if mu is not None] == ["c"],
        "no-point-contact-flutters": all(mu is None for mu in first.points.values()),
        "flutter-explains-the-reference-alone": all(
            mu is None for one in flat for mu in one.critical.values()
        ),
        "coexistence-depends-on-the-set": not lasting
        or [min(one.values()) > 0.0 for one in lasting.values()] == [True, False, False, False],
    }
