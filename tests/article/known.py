"""Result files of the right form without computing anything: each record filled by its types."""

import dataclasses
import re
import types
import typing
from importlib import import_module
from inspect import signature
from typing import Any

import numpy as np

from squeal.article.cases import CASES, HISTORY_FIGURES, stem
from squeal.article.claims import CLAIMS
from squeal.article.claims.rules import TRIED
from squeal.article.ensembles.choosing import names
from squeal.article.ensembles.gather import COUNTS
from squeal.article.ensembles.space import DIMENSIONS, FORMULATIONS
from squeal.article.identify.space import START
from squeal.article.identify.stored import read_searches
from squeal.article.report.chapters import IDENTIFIED, STUDIES
from squeal.article.report.physics import generated as physics_chapter
from squeal.article.results import record_of
from squeal.article.results.claims import Hammering, Loaded
from squeal.article.results.ensembles import (
    Alone,
    Conclusion,
    Keeping,
    Kept,
    Lasted,
    Pad,
    Range,
    Seed,
    Twins,
)
from squeal.article.results.line_springs import Compared
from squeal.article.results.map_ranges import Span, Upright
from squeal.article.results.precision import Point, Timing
from squeal.article.results.records import Plain, Result
from squeal.article.results.robustness import Share
from squeal.article.results.starts import KINDS, Map, SceneStarts
from squeal.article.results.verify import Switches
from squeal.io.provenance import Provenance, provenance
from squeal.io.writing import to_json, write_text
from squeal.model.contact import FORMULATION_CHOICES
from squeal.model.pad import Pad as PadOfModel
from squeal.numerics.outline import outline
from tests.conftest import ROOT

B2 = [stem("B2", case) for case in CASES]
R = typing.TypeVar("R", bound=Result)
IDS = [claim.id for claim in CLAIMS]


def filled(kind: Any, **given: Any) -> Any:
    """A value of a type: 0.5, 3, "word", one entry in each list; `given` for a record's fields."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Literal:
        return inner[0]
    if origin in (typing.Union, types.UnionType):
        return filled(inner[0])
    if origin is tuple:
        return (filled(inner[0]),) if inner[1:] == (...,) else tuple(map(filled, inner))
    if origin is dict:
        return {"word": filled(inner[1])}
    if kind is Provenance:
        return provenance([], "squeal.errors")
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        if kind.__name__ == "Outline":
            ends = np.array([0.5, 1.5])
            return outline(((0.0, 2.0), (0.0, 2.0)), ends, ends, np.eye(2, dtype=int))
        hints = typing.get_type_hints(kind)
        names = [field.name for field in dataclasses.fields(kind) if field.init]
        return kind(**{name: filled(hints[name]) for name in names} | given)
    return {float: 0.5, int: 3, str: "word", bool: True}[kind]


def kinds(name: str) -> dict[str, type[Result]]:
    """The fields of a study's record with their types, and under "" the record itself."""
    study = import_module(f"squeal.article.studies.{name}").study
    record = record_of(name)
    assert record is typing.get_type_hints(study)["return"]
    return typing.get_type_hints(record) | {"": record}


def conclusion(*statements: str) -> Conclusion:
    """One that 8 of 40 pads of the consistent law and 30 of 320 of all keep."""
    own, every = Keeping(40, 8, 5, 2), Keeping(320, 30, 40, 12)
    share = Share(0.1, (0.05, 0.2))
    random = {"consistent": share, "every": share}
    alone = Alone(statements[-1], own, every, random)
    lasting = (Lasted(2, 8, 7),)
    return Conclusion(statements, alone, own, every, lasting, 10, random, (1e-4, 0.02))


def ensembles(entry: Any) -> dict[str, Any]:
    """Ensembles of all formulations, of which one search has kept more and longer than the rest."""
    kept = Kept(20, 18, 12)
    share = Share(0.2, (0.1, 0.3))
    shares = dict.fromkeys(IDS, share)
    seed = Seed(kept, 9.5, 0.0, ("B2-d-trailing",), 40, 40, 0.2, 4.0, 5.0, 5.0)
    windows = ("1", "3", "10", "40")
    horizons = dict.fromkeys(windows, kept)
    failing: dict[str, tuple[str, ...] | None] = dict.fromkeys(windows, ("B2-d-trailing",))
    numbers = {d.name: d.low for d in DIMENSIONS}
    pads = {
        name: Pad(numbers, horizons, failing, 3.0 + i, 1.5, share)
        for i, name in enumerate(("consistent", "printed force"))
    }
    spans = {d.name: Range((d.low, d.high), d.log, d.low, d.high, 0.9, 0.5) for d in DIMENSIONS}
    words = [Switches.of(f) for f in FORMULATIONS]
    one = filled(entry("ensembles"), chance=shares, seeds=(seed,) * 5, best_pads=shares)
    parting = (40, *(0,) * 3, 30, *(0,) * 10, 10)
    one = dataclasses.replace(one, horizons=horizons, parting=parting)
    some = {"together": (40, 30, 20, 10), "most": (9, 9, 10, 11), "lacks": ("B2-b-twice",)}
    front = filled(entry("fronts"), **some)
    return {
        "ensembles": tuple(dataclasses.replace(one, formulation=f) for f in words),
        "fronts": tuple(dataclasses.replace(front, formulation=f) for f in words),
        "windows": (1, 3, 10, 40),
        "total": Kept(len(CLAIMS), 29, int(COUNTS.sum())),
        "counted": names(COUNTS),
        "contrasts": tuple(
            filled(
                entry("contrasts"),
                switch=switch,
                levels={a: 9.0, b: 9.5},
                unslid={a: 9.0, b: 9.5},
                p=p,
                random={a: 90, b: 90},
                ran={a: 70, b: 60},
                keep={key: {a: 9, b: 3} for key in ("hammering", "exaggeration")},
                p_keep={"hammering": 0.01, "exaggeration": 0.2},
            )
            for (switch, (a, b)), p in zip(
                FORMULATION_CHOICES.items(), (0.9, 0.5, 1e-4), strict=True
            )
        ),
        "ranges": dict.fromkeys(pads, spans),
        "samples": dict.fromkeys(pads, ((0.5,) * len(DIMENSIONS),)),
        "names": ("B2-a-leading", "B2-c-hammer", "B2-d-trailing"),
        "total_b2": 12,
        "rival": pads,
        "most": pads,
        "chosen": pads,
        "taken": "consistent",
        "left_out": "",
        "conclusions": {
            "hammering": conclusion("B2-c-hammer", "B2-only-c", "B12-c-severe"),
            "exaggeration": conclusion("B1-all-separate", "B12-more-loss"),
        },
        "twins": Twins(("B2-b-trailing", "B2-b-tilt"), 80, 80),
    }


def result(name: str) -> Result:
    """A result of a study; where the report names scenes, claims or programs, under these names."""
    types_of = kinds(name)

    def by(field: str, names: Any) -> dict[str, Any]:
        return {key: filled(typing.get_args(types_of[field])[1]) for key in names}

    def entry(field: str) -> Any:
        return typing.get_args(types_of[field])[0]

    given: dict[str, Any] = {}
    if types_of[""] is Plain:
        text = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "paper").glob("*.tex"))
        keys = re.findall(rf"\\val\{{{name}\.([^}}]+)\}}", text)
        given = {"values": dict.fromkeys(keys, 0.5)}
    elif name == "eigenvalues":
        given["scenes"] = by("scenes", B2)
    elif name == "energy":
        given["motions"] = by("motions", ("b1-c", "b2-c-mean", "b2-c-integral"))
    elif name == "ensembles":
        given = ensembles(entry)
    elif name == "findings":
        sliding = {"greatest": 0.25, "face": 0.5}
        given["findings"] = (filled(entry("findings"), id="E16", measured=sliding),)
    elif name == "map_ranges":
        small = {name: {"0.1": 2, "0.9": 8} for name in ("h/w", "k2/k1", "mu")}
        full = Upright(100, 0.1, 0.9, 10, 0.25, small, 90, 2, 1, 0.06, Span(0.5, 0.99))
        given = {"sweeps": by("sweeps", small), "members": by("members", CASES), "full": full}
    elif name == "line_springs":
        case = typing.get_args(types_of["cases"])[1]
        points = filled(typing.get_args(typing.get_type_hints(case)["thresholds"])[1])
        given["cases"] = {n: filled(case, thresholds={"0": points, "2": points}) for n in CASES}
        given["starts"] = {n: (Compared(1, (2, 3, 4), (1, 0, 8)),) for n in CASES}
    elif name == "starts":
        share = dict.fromkeys(KINDS, 0.2)
        some = Map(10, ("01", "23"), 3, 4, share)
        given["scenes"] = dict.fromkeys(HISTORY_FIGURES, SceneStarts(1e-6, 1e-5, (some,)))
    elif name == "onset":
        both = ("b1-d", "b2-c-mean", "b2-c-integral")
        given = {field: by(field, both) for field in ("late", "others", "sweeps", "exponents")}
        given["mu"] = (0.4, 0.5, 0.6)
        given["ratio"] = given["sweeps"]["b1-d"][0].ratio
        given["thresholds"] = {"b1-d": 0.7, "b2-c-mean": None, "b2-c-integral": 0.7}
        given["cycles"] = filled(typing.get_args(types_of["cycles"])[0], name="b1-d")
    elif name == "spectra":
        given["scenes"] = by("scenes", ("b1-d",))
    elif name == "accuracy":
        given["scenes"] = by("scenes", HISTORY_FIGURES)
    elif name == "angles":
        verdicts = ("stable", "marginal", "flutter", "divergence", "beyond a fold")
        given = {"verdicts": verdicts}
        given |= {f"share_{model}": dict.fromkeys(verdicts, 0.2) for model in ("b2", "b3")}
    elif name == "claims":
        given["claims"] = tuple(
            filled(entry("claims"), id=claim.id, case=claim.case) for claim in CLAIMS
        )
        swings = dict.fromkeys(map(str, TRIED), 9)
        rows = (Loaded(0.5, -0.5, 0.25, swings), Loaded(1.0, None, None, dict.fromkeys(swings, 0)))
        given["hammering"] = Hammering({"B1": ("a", "c"), "B2": ("c",)}, ("c",), {"c": rows})
    elif name == "loci":
        given["scenes"] = tuple(filled(entry("scenes"), name=one) for one in HISTORY_FIGURES)
    elif name == "stability":
        given["advice"] = dict.fromkeys(HISTORY_FIGURES, "words")
    elif name == "verify":
        given["formulations"] = tuple(
            filled(
                entry("formulations"), formulation=Switches.of(search.formulation), numbers=START
            )
            for search in read_searches([ROOT / IDENTIFIED])
        )
    elif name == "robustness":
        sample = entry("samples")
        share = filled(typing.get_args(typing.get_type_hints(sample)["claims"])[1])
        given["samples"] = (filled(sample, claims=dict.fromkeys(IDS, share)),)
    elif name == "precision":
        programs = ("squeal", "squeal, batch", "SciPy DOP853")
        given["points"] = tuple(
            filled(Point, path=one, error=1e-11, missed=0, extra=0) for one in programs
        )
        given["linear"] = tuple(
            filled(Timing, task=task, program=program)
            for task in ("sweep", "map", "threshold")
            for program in ("squeal", "numpy.linalg.eigvals")
        )
    return filled(types_of[""], **given)


def write(folder: Any) -> None:
    """results/NAME.json of all studies in a folder, but not those of simulations."""
    (folder / "results").mkdir()
    for name in STUDIES:
        write_text(folder / "results" / f"{name}.json", to_json(result(name).to_dict()))


def of(kind: type[R]) -> R:
    """A result of the right form without any computation."""
    found = result(kind.__module__.rpartition(".")[2])
    assert isinstance(found, kind)
    return found


def physics(**given: Result) -> dict[str, str]:
    """The physics chapter's values from some results and known ones in place of the others."""
    hints = typing.get_type_hints(physics_chapter)
    results: Any = [
        given.get(name) or of(hints[name]) for name in signature(physics_chapter).parameters
    ]
    return physics_chapter(*results)[0]


def one_of(pads: Any, i: int) -> PadOfModel:
    """One of many pads whose numbers are arrays."""
    return PadOfModel(**{name: float(v[i]) for name, v in pads.pad.given().items()})
