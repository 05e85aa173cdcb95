"""Made results on onset and attractors, from which sentences and tables follow."""

from typing import Any

from squeal.article.results import onset as results
from squeal.article.results.spectra import Spectra

SILENT = Spectra(scenes={}, ratio=0.005)


def settled_one(lost: float, face: float = 0.5, hammers: bool = False, edges: bool = False) -> Any:
    return results.Settled(lost, 2.0, hammers, edges, 5 if hammers else 0, -0.5, 0.5, face)


def step(
    mu: float, lost: float = 0.4, face: float = 0.5, hammers: bool = False, edges: bool = False
) -> results.Step:
    return results.Step.of(settled_one(lost, face, hammers, edges), mu=mu)


def late_one(lost=0.4, hammers=False, growth=0.1, peak=2.0, low=-1.0) -> results.Late:
    one = results.Settled(lost, peak, hammers, hammers, 8 if hammers else 0, low, 0.5, 0.5)
    return results.Late.of(one, ratio=0.005, growth=growth)


def others(
    lasting: int = 0,
    hammer: int = 0,
    edges: int = 0,
    growth: float = -0.1,
    early: tuple[bool, ...] = (False, False),
) -> results.Others:
    lively = settled_one(0.4, hammers=hammer > 0, edges=edges > 0) if lasting else None
    first = tuple(settled_one(0.4, hammers=one, edges=one) for one in early)
    return results.Others(0.005, first, 25, 0, lasting, hammer, edges, lively, growth)


QUIET = others()


def made(
    lasts: bool = True,
    law: bool = True,
    hammers: bool = False,
    growth: float = 0.1,
    threshold: float | None = 0.7,
    up: tuple[results.Step, ...] = (step(0.6, lost=0.0), step(0.7)),
    down: tuple[results.Step, ...] = (step(0.7), step(0.6, lost=0.0)),
    beyond: tuple[results.Step, ...] = (),
    lively: tuple[results.Step, ...] = (),
    least: float = 0.56,
    decay: float = 0.9,
    peak: float = 2.0,
    rate: float = 1.0,
    half: float = 0.1,
    b1: results.Others = QUIET,
    printed: results.Others = QUIET,
    integral: results.Others = QUIET,
) -> results.Onset:
    """A result with one motion under both laws, and one of model B1."""
    off = 0.4 if peak else 1.0
    late: dict[str, Any] = {
        "b1-c": (late_one(0.4 if hammers else 0.0, hammers, low=None),),
        "b2-c-mean": (late_one(off if lasts else 0.0, hammers, growth, peak),),
        "b2-c-integral": (late_one(0.0 if law else 0.4),),
    }
    points = tuple(
        results.CyclePoint(mu, 0.2, changes, 1.0, size)
        for mu, changes, size in ((0.8, 2, 0.9), (least, 2, 1.2), (0.7, 0, 1.0))
    )
    return results.Onset(
        late=late,
        others={"b1-c": (b1,), "b2-c-mean": (printed,), "b2-c-integral": (integral,)},
        mu=(0.6, 0.65, 0.7),
        sweeps={"b2-c-mean": (results.Sweep(0.005, up, down, beyond, lively),)},
        thresholds={"b1-c": None, "b2-c-mean": threshold},
        exponents={"b2-c-mean": results.Exponent(0.005, (rate,) * 3, (half,) * 3, 0.02, 40, False)},
        cycles=results.Cycles("b2-c-mean", 0.005, points[0], decay, 1e-6, points),
        ratio=0.005,
        ratios=(0.005,),
        windows=40,
        longer=150,
        early=(1, 3),
        wider=3.0,
        moving=0,
        seed=0,
        seen=2,
        step_windows=20,
        confidence=0.95,
    )
