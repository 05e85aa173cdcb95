"""The verdicts with other parameter sets: the folders beside the reference scenes."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from squeal.article.cases import CASES, HISTORY_FIGURES, stem
from squeal.article.claims import CLAIMS, judge_claims, linear_measures, measure_scenes
from squeal.article.claims.rules import hammering_cases
from squeal.article.records import Moved, Record, Result
from squeal.article.studies._heyoka import has_heyoka
from squeal.article.studies._scenes import REFERENCE, by_set, read_scenes
from squeal.article.studies._spread import moved
from squeal.article.studies.hammering import Motion, equilibrium_contact, motion
from squeal.article.studies.line_springs import on_springs
from squeal.article.studies.onset import RATIO, After, after, repeats
from squeal.io.scene import Scene
from squeal.model.contact import State
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.thresholds import critical_friction
from squeal.simulation.run import simulate

TWO = "two points"  # springs in place of the line, with its stiffness, F_n, y0 and start
RARE = 0.02  # a share of initial conditions that the text does not name
SAMPLES = 20001  # of the motion on these
FLATTEST = 0.296  # h/w below which delta can be positive in case (d), by Eq. (8)


class ParameterSet(Record):
    """A parameter set under the article's statements.

    numbers: ratios of parameters and initial values, as `ratios` gives them; parameters: the same
    in SI units by symbol, without the spring angles; satisfied: the independent statements;
    failing: ids of all that it does not satisfy; hammering, flutters: the cases by model that
    hammer, and whose sliding equilibrium flutters without damping; without: the cases by model that
    have no sliding equilibrium; critical: the friction at which B2 (c) begins to flutter, ends: at
    which its branch of equilibria ends, None if not up to the friction of the set; lost: share of
    time in which an edge is separated that touches in the equilibrium, mean over the cases in which
    both models have one, apart: in which any is, both also of two points (TWO); lasting: share of
    the initial conditions from which contact goes on changing with damping, lasting_repeats: the
    same in each repeat, of motions that do not come to one cycle, growth: greatest real part of the
    eigenvalues there, 1/ms, by motion (b1-a) that has a sliding equilibrium; face: greatest speed
    of the lower face while it touches, over that of the surface, by motion.
    """

    numbers: dict[str, float]
    parameters: dict[str, float]
    satisfied: int
    failing: tuple[str, ...]
    hammering: dict[str, tuple[str, ...]]
    flutters: dict[str, tuple[str, ...]]
    without: dict[str, tuple[str, ...]]
    critical: float | None
    ends: float | None
    lost: dict[str, float]
    apart: dict[str, float]
    lasting: dict[str, float]
    lasting_repeats: dict[str, tuple[float, ...]]
    growth: dict[str, float | None]
    face: dict[str, float]

    @property
    def outruns(self) -> tuple[str, ...]:
        """The motions in which the lower face is as fast as the surface: there friction would
        reverse, and the equations no longer hold."""
        return tuple(name for name, speed in self.face.items() if speed >= 1.0)

    def fastest(self, model: str) -> float:
        """The greatest of `face` of a model."""
        return max(speed for name, speed in self.face.items() if name.startswith(model.lower()))

    def lasting_beside_stable_sliding(self, model: str) -> dict[str, float]:
        """By case, of those in which contact goes on changing although sliding is stable, the share
        of the initial conditions from which it does."""
        shares = {}
        for case in CASES:
            name = stem(model, case)
            share = self.lasting.get(name, 0.0)
            if share > 0.0 and (self.growth[name] or 0.0) < 0.0:
                shares[case] = share
        return shares


class Sets(Result):
    """The parameter sets by name, the reference first; statements: how many are independent."""

    sets: dict[str, ParameterSet]
    statements: int

    @property
    def valid(self) -> dict[str, ParameterSet]:
        """The sets in whose motions the surface is always faster than the lower face."""
        return {name: of_set for name, of_set in self.sets.items() if not of_set.outruns}

    @property
    def flat(self) -> list[ParameterSet]:
        """The sets whose height allows a positive delta in case (d)."""
        return [of_set for of_set in self.sets.values() if of_set.numbers["h"] < FLATTEST]


def ratios(points: Scene, line: Scene) -> dict[str, float]:
    """Ratios of the parameters and initial values of both models to w, m, k1 and F_n / k1.

    What both models share is read from the line (B2).
    """
    b1 = points.pad
    b2 = line.pad
    sag = b2.F_n / b2.k1  # the length over which initial values and y0 count
    return {
        "h": b2.h / b2.w,
        "I": b2.I / (b2.m * (b2.w**2 + b2.h**2) / 3.0),  # over that of a rectangle 2 w by 2 h
        "k2": b2.k2 / b2.k1,
        "k3": b1.k3 / b1.k1,
        "k4": b1.k4 / b1.k1,
        "k_c": b2.k_c / b2.k1,
        "L": b2.L1 / b2.w,
        "mu": b2.mu,
        "F_n": b2.F_n / (b2.k1 * b2.w),
        "x": line.initial[0] / sag,
        "y1": points.initial[1] / sag,
        "y2": line.initial[1] / sag,
        "y0": (b2.y0 or 0.0) / sag,
    }


def parameters(points: Scene, line: Scene) -> dict[str, float]:
    """Parameters, initial values and observation time of both models in SI units."""
    given = points.pad.given() | line.pad.given()
    sizes = ("m", "w", "h", "I", "k1", "k2", "k3", "k4", "k_c", "L1", "mu", "F_n", "V", "x0", "y0")
    values = {name: float(given[name]) for name in sizes}
    values["x"] = line.initial[0]
    values["y1"] = points.initial[1]
    values["y2"] = line.initial[1]
    values["T"] = line.stop or 0.0
    return values


def edges_apart(line: Scene, in_equilibrium: State) -> dict[str, float]:
    """Shares of the time in which edges of the face are separated, on two springs in place of the
    line.

    `lost`: an edge that touches in the sliding equilibrium of the line (`in_equilibrium`); `apart`:
    any edge. The springs lie inside the edges and may touch while an edge is separated.
    """
    run = simulate(on_springs(line, 2).replace(V=None, outputs=("history",), samples=SAMPLES))
    assert run.history is not None
    q = np.array([run.history[name] for name in ("x", "y", "theta")])
    is_separated = line.pad_model.gaps(q) > 0.0  # (edge, time)
    touches_in_equilibrium = np.array(in_equilibrium)[:, None]
    return {
        "lost": float(np.mean(np.any(is_separated & touches_in_equilibrium, axis=0))),
        "apart": float(np.mean(np.any(is_separated, axis=0))),
    }


def cases_with(
    verdict: str | None, verdicts: Mapping[str, str | None]
) -> dict[str, tuple[str, ...]]:
    """By model the cases with a verdict, of the `verdicts` by name of the scene (b1-a)."""
    cases = {}
    for model in ("B1", "B2"):
        cases[model] = tuple(case for case in CASES if verdicts[stem(model, case)] == verdict)
    return cases


def damped_motions(scenes: Mapping[str, Scene]) -> dict[str, list[After]]:
    """What scenes come to at the damping ratio `RATIO`, a row per repeat; empty without heyoka."""
    if not has_heyoka():
        return {}
    return {name: repeats(s, RATIO, after(s, RATIO).row) for name, s in scenes.items()}


def mean_shares(
    motions: Mapping[str, Motion], line: Mapping[str, Scene], states: Mapping[str, State | None]
) -> dict[str, dict[str, float]]:
    """The means of `lost` and of `apart` over the cases in which both models have an equilibrium,
    by model, and with the line on two springs (`TWO`).

    motions, states: by name of the scene (b1-a), the latter the contact states of the sliding
    equilibria; line: the scenes of the line by case.
    """
    shares: dict[str, dict[str, list[float]]] = {"lost": {}, "apart": {}}
    for case in CASES:
        points_state = states[stem("B1", case)]
        line_state = states[stem("B2", case)]
        if points_state is None or line_state is None:
            continue
        two_points = edges_apart(line[case], line_state)
        for share, by_model in shares.items():
            for model in ("B1", "B2"):
                share_of_motion = getattr(motions[stem(model, case)], share)
                by_model.setdefault(model, []).append(share_of_motion)
            by_model.setdefault(TWO, []).append(two_points[share])
    means = {}
    for share, by_model in shares.items():
        means[share] = {model: sum(values) / len(values) for model, values in by_model.items()}
    return means


def parameter_set(scenes: Mapping[str, Scene]) -> ParameterSet:
    """A set from its eight scenes, by name."""
    b1 = {case: scenes[stem("B1", case)] for case in CASES}
    b2 = {case: scenes[stem("B2", case)] for case in CASES}
    cases = measure_scenes(b1, b2)
    linear = linear_measures({case: scene.pad for case, scene in b2.items()})
    judged = judge_claims({**cases, "b3": linear})
    # the statements that count: the others follow from these, or hold for any set
    independent = {claim.id for claim in CLAIMS if claim.informative}
    contact_states = {name: equilibrium_contact(scenes[name]) for name in cases}
    motions = {name: motion(case, contact_states[name]) for name, case in cases.items()}
    means = mean_shares(motions, b2, contact_states)
    with_equilibrium = {}
    verdicts: dict[str, str | None] = dict.fromkeys(cases)  # None without a sliding equilibrium
    for name, state in contact_states.items():
        if state is not None:
            with_equilibrium[name] = scenes[name]
            verdicts[name] = analyse(scenes[name]).judgement.verdict
    late = damped_motions(with_equilibrium)
    # share of the initial conditions, in each repeat
    lasting = {name: [row.lasting / row.starts for row in rows] for name, rows in late.items()}
    # of B2 (c), up to its own friction
    thresholds = critical_friction(b2["c"], b2["c"].pad.mu).points
    return ParameterSet(
        numbers=ratios(b1["c"], b2["c"]),
        parameters=parameters(b1["c"], b2["c"]),
        satisfied=sum(claim.holds for claim in judged if claim.id in independent),
        failing=tuple(claim.id for claim in judged if not claim.holds),
        hammering=hammering_cases(cases),
        flutters=cases_with("flutter", verdicts),
        without=cases_with(None, verdicts),
        critical=next((p.mu for p in thresholds if p.kind == "flutter"), None),
        ends=next((p.mu for p in thresholds if p.kind in ("fold", "lift-off")), None),
        lost=means["lost"],
        apart=means["apart"],
        lasting={name: shares[0] for name, shares in lasting.items()},
        lasting_repeats={name: tuple(s) for name, s in lasting.items() if len(s) > 1},
        growth={name: rows[0].growth for name, rows in late.items()},
        face={name: case.face for name, case in cases.items()},
    )


def study(files: Sequence[Path]) -> Sets:
    """The sets in the folders of the scene files."""
    sets = {
        name: parameter_set(read_scenes(files_of_set, HISTORY_FIGURES))
        for name, files_of_set in by_set(files).items()
    }
    spread: list[Moved] = []
    for name, of_set in sets.items():
        for case, shares in of_set.lasting_repeats.items():
            spread += moved(f"sets.{name}.lasting.{case}", shares)
    statements = sum(claim.informative for claim in CLAIMS)
    return Sets(sets=sets, statements=statements, spread=tuple(spread))


def sentences(record: Sets) -> Mapping[str, bool]:
    """What the paper says of all sets, and whether it holds."""
    sets = record.sets.values()
    flat = record.flat
    first = record.sets[REFERENCE]
    # lost, apart: shares of the time, see `ParameterSet`; TWO: the line on two points
    hammering = [s.hammering for s in sets]  # by set and model the cases
    both = [set(by_model["B1"]) & set(by_model["B2"]) for by_model in hammering]
    # without heyoka no damped motions are simulated, and the last sentence is not tested
    has_no_damped_motions = not first.lasting
    outrunning = {}  # by set the motions whose lower face is as fast as the surface
    without = {}  # by set and model the cases without a sliding equilibrium
    beside_stable_sliding = set()  # set, model and case in which contact goes on changing
    for name, of_set in record.sets.items():
        if of_set.outruns:
            outrunning[name] = of_set.outruns
        if any(of_set.without.values()):
            without[name] = of_set.without
        for model in ("B1", "B2"):
            for case, share in of_set.lasting_beside_stable_sliding(model).items():
                if share > RARE:
                    beside_stable_sliding.add((name, model, case))
    return {
        "four-sets-of-which-three-are-flat": len(sets) == 4 and len(flat) == 3,
        "one-set-satisfies-all-that-can-hold": record.sets["set-4"].satisfied
        == record.statements - 1,
        "flat-sets-need-much-friction": all(s.numbers["mu"] > 0.58 for s in flat),
        "c-alone-with-both-models-in-all-but-set-3": both == [{"c"}, {"c"}, set(), {"c"}],
        "points-hammer-in-d-in-every-set": all("d" in by_model["B1"] for by_model in hammering),
        "cases-differ-in-each-set": all(
            0 < len(by_model["B1"]) < len(CASES) for by_model in hammering
        ),
        "points-lose-more-in-every-set": all(s.lost["B1"] > s.lost["B2"] for s in sets),
        "edges-part-as-long-on-two-points": all(
            abs(s.lost[TWO] - s.lost["B2"]) < 0.05 and abs(s.apart[TWO] - s.apart["B2"]) < 0.06
            for s in sets
        ),
        "all-motions-of-set-2-and-one-of-set-4-outrun-the-surface": outrunning
        == {"set-2": tuple(HISTORY_FIGURES), "set-4": ("b2-c",)},
        "reference-and-set-3-alone-are-valid": [*record.valid] == [REFERENCE, "set-3"],
        "loss-from-full-contact-turns-the-order": all(s.apart["B1"] < s.apart["B2"] for s in sets),
        "only-c-of-the-line-flutters": first.flutters == {"B1": (), "B2": ("c",)},
        "flat-sets-flutter-on-points-alone": all(
            s.flutters["B2"] == () and "a" in s.flutters["B1"] for s in flat
        ),
        "c-of-set-2-alone-has-no-equilibrium": without == {"set-2": {"B1": (), "B2": ("c",)}},
        "contact-goes-on-beside-stable-sliding-in-all-but-set-2": has_no_damped_motions
        or beside_stable_sliding
        == {
            (REFERENCE, "B1", "d"),
            (REFERENCE, "B2", "d"),
            ("set-3", "B2", "a"),
            ("set-4", "B2", "c"),
        },
    }
