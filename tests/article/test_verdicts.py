"""Verdicts of the report: each turns with the results behind it."""

import dataclasses
import itertools
from types import SimpleNamespace
from typing import Any, cast

import pytest

from squeal.article.claims import CLAIMS
from squeal.article.claims.rules import TRIED
from squeal.article.report import verdicts
from squeal.article.report.hammering import by_edges, by_model, settles, touching, under_load
from squeal.article.report.identification import hardest
from squeal.article.report.pads import consistent, kept_briefly, kept_by, lasts, origin
from squeal.article.results.claims import Hammering, JudgedClaim, Loaded, Settled
from squeal.article.results.eigenvalues import Eigenvalues, EquilibriumPoles
from squeal.article.results.ensembles import ELSEWHERE, Ensembles
from squeal.article.results.loci import HeldThreshold, Loci, Loop
from squeal.article.results.map_ranges import MapRanges, Span, Upright
from squeal.article.results.onset import Onset, Others
from squeal.article.results.records import Missing
from squeal.article.results.robustness import Share
from squeal.article.results.starts import KINDS, Map, SceneStarts, Starts, Swinging
from tests.article import known


def judged_pads(keep: int, lost: str) -> Ensembles:
    """Ensembles of which so many pads keep each conclusion; the plausible one loses a statement."""
    found = known.result("ensembles")
    assert isinstance(found, Ensembles)
    made = {
        name: dataclasses.replace(
            one,
            alone=dataclasses.replace(
                one.alone, every=dataclasses.replace(one.alone.every, keep=keep)
            ),
        )
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
        (True, 3, 0.1): "holds for pads fitted to it, few random ones",
        (True, 0, 0.0): "holds for one pad fitted to it, no random ones",
        (True, 3, 0.9): "holds for pads fitted to it, most random ones",
        (False, 3, 0.1): "holds for other pads: some fitted to it, few random ones",
        (False, 3, 0.3): "holds for other pads: some fitted to it, some random ones",
        (False, 0, 0.1): "holds for few random ones",
        (False, 0, 0.0): "not reproduced by any pad",
    }
    for (held, keep, share), verdict in words.items():
        claims = {"B12-c-severe": held}  # as worded, whatever becomes of the other statements
        found = some if keep else none
        one = found.conclusions["hammering"]
        random = {"every": Share(share, (0.0, 1.0)), "consistent": Share(share, (0.0, 1.0))}
        alone = dataclasses.replace(one.alone, random=random)
        drawn = {"hammering": dataclasses.replace(one, alone=alone)}
        found = dataclasses.replace(found, conclusions=drawn)
        assert verdicts.of_pads(claims, found, "hammering") == verdict
    statements = plausible.conclusions["hammering"].statements
    assert lasts(plausible, statements) == ["1", "10"]
    assert lasts(plausible, ["B12-c-severe"]) == ["1", "10", "40"]
    assert lasts(none, statements) == []
    text = kept_briefly(plausible, "hammering")
    assert text.startswith(
        "Kept by this pad over 1, 10 and 40 windows from the start, over one by "
        r"pads of 12 of 40 searches (2 of 5) and by 10\,\% (10\,\%) of random pads; with "
        r"2 related statements (Sec.~\ref{sec:ensembles}) by 12 (2) and 10\,\% (10\,\%)"
    )
    pad = plausible.chosen["consistent"]
    pad = dataclasses.replace(pad, failing=dict.fromkeys(pad.failing, ("B2-b-twice",)))
    always = dataclasses.replace(plausible, chosen={"consistent": pad})
    assert "by this pad over 1 to 40 windows from" in kept_briefly(always, "hammering")
    lost = judged_pads(3, "B12-c-severe")
    pad = dataclasses.replace(pad, failing=dict.fromkeys(pad.failing, ("B12-c-severe",)))
    lost = dataclasses.replace(lost, chosen={"consistent": pad})
    assert "of random pads, not by this; with" in kept_briefly(lost, "hammering")
    assert "Kept over one window by pads of" in kept_briefly(lost, "hammering")
    longer = dataclasses.replace(lost, windows=(3, 10))
    assert "Kept over 3 windows by pads of" in kept_briefly(longer, "hammering")
    unjudged = dataclasses.replace(some, chosen={})
    assert "of random pads; with" in kept_briefly(unjudged, "hammering")
    assert (
        "The pad of this report keeps all 3 together over 1 and 10 windows; pads of 2"
        in kept_by(plausible, "hammering")
    )
    assert "does not keep all 3 together; pads of 2 of the 5" in kept_by(some, "hammering")
    assert "; B12-c-severe alone by pads of 2 and 12 of them" in kept_by(some, "hammering")


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
        ("c", "c", "in (c), B2 in (c)"),
        ("a", "", "(a), B2 in no case"),
    ],
)
def test_hammering_is_told_by_model(b1, b2, words):
    assert by_model(Hammering({"B1": tuple(b1), "B2": tuple(b2)}, (), {})).endswith(words)


def test_hammering_under_load_is_told_from_the_way_of_delta():
    def told(*rows: Loaded) -> str:
        return under_load(Hammering({"B1": ("c",), "B2": ("c",)}, (), {"c": rows}))

    def row(share: float, *counts: int) -> Loaded:
        return Loaded(share, -0.9, 0.6, dict(zip(map(str, TRIED), counts, strict=True)))

    far, near, still = row(0.5, 9, 9, 9, 1), row(1.0, 9, 3, 0, 0), row(1.0, 3, 3, 3, 3)
    assert r"asks at $0.1$\,$w$ under each of them, at $0.25$" in told(far, near)
    assert r"at $0.25$\,$w$ up to $0.5$\,$F_n$, at $0.5$\,$w$ up to $0.5$\,$F_n$ and" in told(
        far, near
    )
    assert told(far, near).endswith(r"at $0.9$\,$w$ under none")
    assert r"asks at $0.1$\,$w$ up to $0.5$\,$F_n$, at" in told(far, still)  # seldom
    assert r"asks at $0.1$\,$w$ under none" in told(still, far)  # under a light load already
    assert r"$-0.9$ to $0.6$ while $R_n$ exceeds $0.5$\,$F_n$" in told(
        far, Loaded(2, None, None, dict.fromkeys(far.swings, 0))
    )
    assert under_load(Hammering({"B1": (), "B2": ()}, (), {})) == "Model B2 hammers in no case"


def test_what_the_rule_of_one_model_says_of_the_other():
    def told(*cases: str) -> str:
        return by_edges(Hammering({"B1": ("a",), "B2": ("c",)}, cases, {}))

    assert told("c").endswith("B2 hammers in (c), too")
    assert told("a", "c").endswith("B2 would hammer in (a) and (c)")
    assert told().endswith("B2 would hammer in no case")


def test_starts_that_hammer_without_losing_contact_are_counted():
    def told(*counts: int, window: int = 1) -> str:
        one = SceneStarts(1.0, 1.0, (Map(window, (), 0, 0, {}),), Swinging(*counts))
        return touching(Starts(scenes={"b2-b": one, "b2-c": one, "b1-a": Missing("")}, reach=1.0))

    words = told(121, 42, 32, 40)
    assert "(b) and (c) of model B2, undamped and over one window, 42 and 42 hammer by" in words
    assert "of these 32 and 32 never leave full contact and 40 and 40 never separate" in words
    assert "over 3 windows, 42" in told(121, 42, 32, 40, window=3)
    assert "one window, none hammers by the rule of B2 and touches" in told(121, 42, 0, 0)
    assert "is not known here" in touching(Starts(scenes={"b2-b": Missing("")}, reach=1.0))


def test_a_motion_that_settles_is_told_by_the_rule():
    assert "settles by this rule" in settles(Settled("b2-c", -1271.0, 1.5, 0.004))
    assert "too much" in settles(Settled("b2-c", -1271.0, 1.5, 0.04))
    assert settles(None) == "none was found that does"


def test_what_the_article_argues_with_is_told_apart_from_our_reading():
    names = ("B1-all-separate", "B2-only-c", "B12-more-loss")
    assert "this pad keeps; the conclusion itself we read" in verdicts.argued(
        dict(zip(names, (True, True, False), strict=True))
    )
    assert "keeps all three" in verdicts.argued(dict.fromkeys(names, True))
    assert "this pad does not keep" in verdicts.argued(
        dict(zip(names, (True, False, True), strict=True))
    )


def test_a_verdict_turns_with_the_results_behind_it():
    def maps(printed, small, exists=0.7):
        share = SimpleNamespace(exists=exists)
        full = Upright(
            10,
            0.1,
            0.6,
            small,
            0.25,
            {"mu": {"0": small, "1": small + 2}, "h/w": {"0": 0, "1": small}},
            90,
            1,
            0,
            0.06,
            Span(0, 1),
        )
        printed_share = SimpleNamespace(share=SimpleNamespace(as_printed=printed))
        return full, cast(Any, printed_share), cast(Any, SimpleNamespace(share=share))

    assert verdicts.region(*maps(0.1, 0)[:2]) == "does not hold"
    assert verdicts.region(*maps(0.1, 10)[:2]) == "holds"
    words = verdicts.region(*maps(0.1, 3)[:2])
    assert words == "by full contact, depends most on friction and height"
    assert verdicts.region(*maps(0.1, 1)[:2]) == words
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


def test_the_influence_of_directions_is_judged_by_the_pads_that_part():
    found = judged_pads(3, "B2-b-twice")

    def influence(none: int, some: int, every: int) -> tuple[str, str]:
        parting = (none, *(0,) * 3, some, *(0,) * 10, every)  # in no case, in c only, in all
        many = (dataclasses.replace(e, parting=parting, random=500) for e in found.ensembles)
        return verdicts.influence(dataclasses.replace(found, ensembles=tuple(many)))

    verdict, words = influence(60, 30, 10)
    assert verdict == "mostly holds"
    assert "Of 100 random pads that run (consistent law) the surfaces" in words
    assert r"of 30\,\% part in some cases of B2, of 10\,\% in all" in words
    assert r"differ in 75\,\% of those that part (75 to 75\,\% by formulation)" in words
    assert influence(60, 10, 30)[0] == "seldom holds"
    assert influence(60, 0, 30)[0] == "not supported"
    some = (dataclasses.replace(e, parting=(60, 30, *(0,) * 13, 10)) for e in found.ensembles[:6])
    few = (dataclasses.replace(e, parting=(60, 10, *(0,) * 13, 30)) for e in found.ensembles[6:])
    verdict, words = verdicts.influence(dataclasses.replace(found, ensembles=(*some, *few)))
    assert verdict == "mostly holds, by 6 of 8 formulations"
    assert r"(25 to 75\,\% by formulation)" in words


def test_random_pads_that_run_are_counted_over_all_laws_and_the_consistent_one():
    found = judged_pads(3, "B2-b-twice")
    each = (dataclasses.replace(e, ran=10, random=100) for e in found.ensembles)
    made = dataclasses.replace(found, ensembles=tuple(each))
    assert verdicts.ran(made) == r"10\,\% (10\,\%)"
    some = tuple(
        dataclasses.replace(e, ran=50 if e == consistent(made) else 10) for e in made.ensembles
    )
    assert verdicts.ran(dataclasses.replace(made, ensembles=some)) == r"15\,\% (50\,\%)"


def test_an_equilibrium_in_any_contact_is_told_beside_one_in_full_contact():
    full = known.of(MapRanges).full
    words = verdicts.touching_at_rest(full)
    assert words == r"never small: 50\,\% to 99\,\% over 100 pads"
    some = dataclasses.replace(full, touching=Span(0.2, 0.99))
    assert verdicts.touching_at_rest(some).startswith(r"small for some: 20\,\% to")


def test_cases_that_hammer_are_told_apart_by_what_holding_the_rotation_does():
    def rotation(**pairs: tuple[float | None, float | None]) -> str:
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
        return verdicts.rotation(dataclasses.replace(loci, scenes=scenes), hammering, onset)

    onset = dataclasses.replace(known.of(Onset), late={}, others={}, thresholds={})
    hammering = Hammering({"B1": ("a", "d"), "B2": ("c",)}, (), {})
    pairs = {"b1_a": (None, None), "b2_c": (0.2, 1.5), "b2_d": (0.46, 0.45)}
    assert rotation(**pairs) == (
        "of the cases that hammer (first row) B2 (c) at $0.2$ (held: $1.5$) flutters sooner with "
        "the rotation free; B1 (a) nowhere"
    )
    words = rotation(b1_d=(None, 0.185), b2_c=(0.2, None))
    assert "B2 (c) at $0.2$ (held: nowhere) flutters sooner" in words
    assert words.endswith("free; against: with it held B1 (d) at $0.185$ (free: nowhere)")
    assert "$0.2$ (held: $0.3$) and B2 (c) at $0.2$ (held: $1.5$) flutter sooner" in rotation(
        b1_d=(0.2, 0.3), b2_c=(0.2, 1.5)
    )
    assert "(first row) none flutters sooner" in rotation(b2_c=(0.5, 0.4))
    # with damping, from other starts or its own, another case goes on hammering, under either law
    quiet = known.filled(Others, hammer=0, edges=0)
    some = (known.filled(Others, hammer=0, edges=3), known.filled(Others, hammer=3))
    for lively, law in itertools.product(some, ("integral", "mean")):
        onset = dataclasses.replace(
            onset,
            late={f"b2-d-{law}": (Missing("the model ends"),)},
            others={f"b2-d-{law}": (quiet, lively)},
            thresholds={"b2-d-integral": 0.46},
        )
        words = rotation(**pairs)
        assert "; against: with it held B2 (d) at $0.45$ (free: $0.46$); B1 (a) nowhere" in words
    hammering = Hammering({"B1": (), "B2": ()}, (), {})
    onset = dataclasses.replace(onset, others=dict.fromkeys(onset.late, (quiet,)))
    assert rotation(b2_d=(0.2, 1.5)) == "no case hammers here"


def test_reactions_and_thresholds_are_told_by_case():
    def at(free, rubs, **flutter):
        return known.filled(EquilibriumPoles, R_n=rubs, free=free, flutter=flutter)

    quiet, lively = at(2.0, 1.5, half=None, one=None), at(2.0, 3.0, half=None, one=0.25)
    poles = Eigenvalues(
        provenance=known.of(Eigenvalues).provenance,
        scenes={"b2-a": quiet, "b2-b": lively, "b2-c": quiet},
        mu_max=1.0,
    )
    assert verdicts.beside_a(poles) == "to $2$ times that of (a) ($1$ without friction)"
    gone = dataclasses.replace(poles, scenes=poles.scenes | {"b2-a": Missing("none")})
    assert verdicts.beside_a(gone) == "not both have a place of rest"
    assert verdicts.by_stiffness(poles) == (
        r"with half and one times ours flutter begins at $\mu$ of none in (a), (c), "
        "none and $0.25$ in (b)"
    )


@pytest.mark.parametrize(
    ("b1", "b2", "words"),
    [
        (("a",), ("c",), "both models show"),
        ((), ("c",), "B2 alone shows"),
        ((), (), "no model shows"),
    ],
)
def test_hammering_of_experiments_is_that_of_the_models(b1, b2, words):
    assert verdicts.seen(Hammering({"B1": b1, "B2": b2}, (), {})) == words


def test_perpetual_contact_is_judged_by_other_starts():
    found = known.of(Starts)
    assert verdicts.perpetual(found)[0] == "does not hold"
    assert r"$20\,\%$" not in verdicts.perpetual(found)[1]
    assert r"20\,\% in (a)" in verdicts.perpetual(found)[1]
    assert verdicts.perpetual(found)[1].startswith("Over 10 windows B1 ")
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
