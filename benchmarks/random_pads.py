"""Random pads through the whole chain, against 50 digits and the literal equations.

`python -m benchmarks.random_pads [--pads 1000] [--wide] [--workers 2]` prints the largest
differences of equilibria, stiffness matrices, eigenvalues and thresholds, every verdict that is not
the exact one, and how many lists of roots and of thresholds are proved. Anything wrong in a proved
list is a contradiction, as is a right list that is refuted, and the exit status is 1.

Each pad has units of its own, so that no number is of a usual size; with `--wide` stiffnesses and
inertia also differ from each other by up to eight decades. Where gmpy2 is installed MPFR computes
the 50 digits, in half the time of mpmath.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from types import SimpleNamespace
from typing import Any

import mpmath as mp
import numpy as np

from squeal.article.transitions import EDGE_NAMES
from squeal.equilibrium import Path
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.linear import CriticalPoint, verdict
from squeal.model.contact import FORMULATION_CHOICES, Formulation
from squeal.model.pad import Model
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.ranges import DISAGREES
from squeal.queries.thresholds import critical_friction
from squeal.results.sources import PadSource
from squeal.results.thresholds import Thresholds
from tests import exact as exactly
from tests import naive
from tests.conftest import random_pad
from tests.exact import Exact, det, discriminant
from tests.linear.conftest import exact_verdict

MU_MAX = 1.0
SAMPLED = 5  # values of mu at which the verdict is compared, besides the middles between thresholds
APART = 1e-3  # of the spectral radius: eigenvalues closer than this are near a coalescence
SPREAD = ("I", "k2", "k3", "k4", "k_c")
DECADES = 8
ROUNDING = 16 * np.finfo(float).eps  # of mu, beside what the interval says
AT_CHANGE = 1e-12  # of mu: a threshold so close to a change of contact is that change


@dataclass
class Pad:
    """What was found for one pad; differences are relative, see `examine`.

    proved_roots, proved_thresholds: whether the referee proved the list, None where none was made;
    open_reason: why it did not prove the thresholds; seconds: CPU time of thresholds and proof.
    """

    seed: int
    model: str
    end: str = "no steady sliding"
    equilibrium: float = 0.0
    stiffness: float = 0.0
    eigenvalues: float = 0.0
    apart: float = 1.0
    thresholds: list[tuple[str, float]] = field(default_factory=list)
    verdicts: int = 0
    refused: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    contradictions: list[str] = field(default_factory=list)
    proved_roots: bool | None = None
    proved_thresholds: bool | None = None
    open_reason: str = ""
    seconds: float = 0.0


def scene_of(seed: int, wide: bool = False) -> Scene:
    """Model B1 or B2, the latter in the consistent formulation or in any, by turns."""
    r = np.random.default_rng([seed, 1])
    mass, length, time = 10.0 ** r.uniform([-2.0, -2.0, -4.0], [1.0, 0.0, -2.0])
    model: Model = "B1" if seed % 2 else "B2"
    pad = random_pad(seed, model)
    if wide:
        spread = {n: 10.0 ** r.uniform(-DECADES / 2, DECADES / 2) for n in SPREAD}
        pad = pad.replace(**{n: getattr(pad, n) * f for n, f in spread.items() if n in pad.given()})
    pad = pad.scaled(mass, length, time)
    if model == "B1":
        return Scene("B1", pad)
    chosen: Any = [str(r.choice(options)) for options in FORMULATION_CHOICES.values()]
    return Scene("B2", pad, Formulation(*chosen) if seed % 4 else Formulation())


def with_mpfr() -> None:
    """Let MPFR compute what is exact, if it is there."""
    try:
        import gmpy2
    except ImportError:
        return
    gmpy2.get_context().precision = mp.mp.prec
    names = ("mpc", "sqrt", "cbrt", "sin", "cos", "asin")
    numbers: Any = SimpleNamespace(mpf=gmpy2.mpfr, mp=mp.mp)
    vars(numbers).update({name: getattr(gmpy2, name) for name in names})
    vars(naive)["mp"] = vars(exactly)["mp"] = numbers


def _relative(found: Any, exact: Any, scale: Any) -> float:
    """Largest difference of two vectors or matrices over a common scale."""
    return float(max(abs(float(a) - b) for a, b in zip(found, exact, strict=True)) / scale)


def lead(exact: Exact, q: Any, mu: Any) -> Any:
    """By how much a pair grows faster than any real mode. Raises ArithmeticError without."""
    squares = exact.squares(q, mu)
    small = 1e-25 * max(abs(s) for s in squares)
    pairs = [abs(((-s) ** 0.5).real) for s in squares if abs(s.imag) > small]
    real = [(-s.real) ** 0.5 for s in squares if abs(s.imag) <= small and s.real < 0]
    if not pairs or not real:
        raise ArithmeticError(f"no pair and real mode both grow at mu = {mu}")
    return max(pairs) - max(real)


def _compare_spectrum(scene: Scene, pad: Pad, prove: bool) -> None:
    """Equilibrium, stiffness, eigenvalues and verdict at the scene's friction."""
    try:
        found = analyse(scene)
    except ComputationError as error:
        pad.refused.append(str(error))
        return
    exact = Exact(scene, found.state)
    mu = scene.pad.mu
    w = scene.pad.w
    q = exact.equilibrium(found.q, mu)
    lever = (1.0, 1.0, w)
    size = max(abs(v * f) for v, f in zip(q, lever, strict=True))
    pad.equilibrium = _relative(np.array(found.q) * lever, [q[0], q[1], w * q[2]], size)
    if any((gap < 0) != touches for gap, touches in zip(exact.gaps(q), found.state, strict=True)):
        pad.wrong.append("contact state")
    K = exact.stiffness(q, mu)
    balanced = []
    for i in range(3):
        balanced += [K[i][j] / lever[i] / lever[j] for j in range(3)]
    unit = np.array([1.0, 1.0, 1.0 / w])
    ours = (unit[:, None] * found.matrices.K * unit).ravel()
    pad.stiffness = _relative(ours, balanced, max(abs(k) for k in balanced))
    squares = exact.squares(q, mu)
    roots = [(-s) ** 0.5 for s in squares]
    upper = np.array([complex(root) for root in roots])
    expected = np.concatenate([upper, -upper])
    radius = np.abs(expected).max()
    distance = np.abs(found.spectrum.values[:, None] - expected) / radius
    pad.eigenvalues = float(max(distance.min(axis=0).max(), distance.min(axis=1).max()))
    pairs = itertools.combinations(expected, 2)
    pad.apart = float(min(abs(a - b) for a, b in pairs) / radius)
    pad.verdicts += 2
    right = exact_verdict(squares)
    if found.judgement.verdict != right:
        pad.wrong.append(f"verdict at mu = {mu:g}")
    if not prove:
        return
    listed = eigenvalues(scene)
    pad.proved_roots = listed.certified
    if listed.certified and listed.verdict != right:
        pad.contradictions.append(f"proved verdict at mu = {mu:g}")


def _distance(scene: Scene, path: Path, point: CriticalPoint) -> tuple[float, bool]:
    """Relative distance of a threshold from an exact one of any kind that is possible, the first in
    its interval or else the nearest; and whether the interval, widened by rounding, holds it."""
    near = np.flatnonzero(np.abs(path.branch.z[3] - point.mu) <= AT_CHANGE * point.mu)
    mu = min(point.mu, path.mu_end) * (1.0 - 1e-12)
    z, state = path.at(mu)
    exact = Exact(scene, state)
    q = path.statics.to_si(z)
    changed = []
    for i in near:
        changed += [e for e in range(len(EDGE_NAMES)) if path.branch.touching[e, i] != state[e]]
    if changed:
        conditions = [lambda q, _: exact.gaps(q)[changed[0]]]
    elif point.kind == "fold":
        conditions = [lambda q, mu: det(exact.stiffness(q, mu))]
    else:
        conditions = [
            lambda q, mu: discriminant(exact.cubic(q, mu)),
            lambda q, mu: exact.cubic(q, mu)[2],
            lambda q, mu: lead(exact, q, mu),
        ]
    rounding = ROUNDING * point.mu
    found = list[Any]()
    low = point.interval[0] - point.mu - rounding
    high = point.interval[1] - point.mu + rounding
    for condition in conditions:
        try:
            found.append(exact.critical(condition, q, mu)[1] - point.mu)
        except ArithmeticError:
            continue
        if low <= found[-1] <= high:
            break
    if not found:
        return np.inf, False
    off = min(found, key=abs)
    return abs(float(off / point.mu)), bool(low <= off <= high)


def _told(critical: Thresholds, mu: float) -> str:
    """The verdict at mu that the list of thresholds tells."""
    kinds = [point.kind for point in critical.points if point.mu < mu]
    last = kinds[-1] if kinds else critical.verdict or "open"
    return "marginal" if last == "restabilised" else last


def _compare_branch(scene: Scene, pad: Pad, wide: bool, prove: bool) -> None:
    """Thresholds, and verdicts between them, along the branch."""
    start = time.process_time()
    try:
        critical = critical_friction(scene, MU_MAX, prove=prove)
    except ComputationError as error:
        pad.refused.append(str(error))
        return
    pad.seconds = time.process_time() - start
    assert isinstance(critical.source, PadSource)
    path = critical.source.branch
    assert path is not None
    pad.end = critical.end
    if prove:
        pad.proved_thresholds = critical.certified
        pad.open_reason = "" if critical.certified else critical.proof_line
    refuted = DISAGREES in pad.open_reason
    already_wrong = len(pad.wrong)
    for point in critical.points:
        apart, held = _distance(scene, path, point)
        pad.thresholds.append((point.kind, apart))
        if not held or (point.converged and apart > 1e-9):
            pad.wrong.append(f"{point.kind} at mu = {point.mu:g} by {apart:.1e}")
        if not (point.converged or wide):
            pad.wrong.append(f"threshold at {point.mu:g} not converged")
    marks = [0.0, *(point.mu for point in critical.points), path.mu_end]
    mus = {(a + b) / 2 for a, b in itertools.pairwise(marks) if b > a}
    mus |= set((path.mu_end * (np.arange(SAMPLED) + 0.5) / SAMPLED).tolist())
    for mu in sorted(mus):
        z, state = path.at(mu)
        exact = Exact(scene, state)
        q = exact.equilibrium(path.statics.to_si(z), mu)
        told = exact_verdict(exact.squares(q, mu))
        matrices = path(mu)
        pad.verdicts += 2
        if told != _told(critical, mu):
            pad.wrong.append(f"verdict at mu = {mu:g} by the thresholds")
        if told != verdict(matrices.M, None, matrices.K):
            pad.wrong.append(f"verdict at mu = {mu:g}")
    wrong = pad.wrong[already_wrong:]
    if critical.certified:
        pad.contradictions += wrong
    elif refuted and not wrong:
        pad.contradictions.append("a right list is refuted")


def examine(seed: int, wide: bool = False, prove: bool = True) -> Pad:
    """Compare one pad; with `prove` also what the referee says of its roots and thresholds.

    Equilibria are measured by their largest coordinate (rotation as w theta), stiffness by the
    largest entry, eigenvalues by the spectral radius, thresholds by mu; `apart` is the least
    distance of two exact eigenvalues.
    """
    scene = scene_of(seed, wide)
    pad = Pad(seed, scene.model)
    try:
        _compare_spectrum(scene, pad, prove)
        _compare_branch(scene, pad, wide, prove)
    except ArithmeticError as error:
        pad.wrong.append(str(error))
    return pad


def summary(pads: Iterable[Pad]) -> str:
    """The largest differences and all that is wrong, in lines."""
    pads = list(pads)
    apart = [p for p in pads if p.apart > APART]
    close = [p for p in pads if p.apart <= APART]
    thresholds = [(kind, apart, p) for p in pads for kind, apart in p.thresholds]
    lines = [
        f"{len(pads)} pads, {sum(p.model == 'B1' for p in pads)} of model B1",
        f"equilibria differ by {max(p.equilibrium for p in pads):.1e}, "
        f"stiffness by {max(p.stiffness for p in pads):.1e}",
        f"eigenvalues by {max((p.eigenvalues for p in apart), default=0.0):.1e} of the spectral "
        f"radius; of {len(close)} pads with two of them closer than {APART:g} by "
        f"{max((p.eigenvalues for p in close), default=0.0):.1e}",
    ]
    for kind, count in sorted(Counter(kind for kind, *_ in thresholds).items()):
        worst = max((a, p.seed) for k, a, p in thresholds if k == kind)
        lines.append(f"{count} x {kind}: by {worst[0]:.1e} of mu (seed {worst[1]})")
    refused = Counter(reason.split(":")[0] for p in pads for reason in p.refused)
    lines += [f"{count} x refused: {reason}" for reason, count in refused.most_common()]
    wrong = [f"seed {p.seed}: {', '.join(p.wrong)}" for p in pads if p.wrong]
    lines.append(f"{sum(p.verdicts for p in pads)} verdicts; wrong: {len(wrong)}")
    roots = Counter(p.proved_roots for p in pads)
    lines.append(f"lists of roots: {roots[True]} proved, {roots[False]} open")
    proved = Counter(p.proved_thresholds for p in pads)
    asked = [p.seconds for p in pads if p.proved_thresholds is not None]
    cost = f", {np.median(asked):.2f} s each, {max(asked):.2f} s at most" if asked else ""
    lines.append(f"lists of thresholds: {proved[True]} proved, {proved[False]} open{cost}")
    lines += [f"seed {p.seed}: {p.open_reason}" for p in pads if p.open_reason]
    contradictions = [p for p in pads if p.contradictions]
    lines.append(f"contradictions: {len(contradictions)}")
    lines += [f"seed {p.seed}: {', '.join(p.contradictions)}" for p in contradictions]
    return "\n".join([*lines, *wrong])


def main() -> None:
    """Examine random pads and print a summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pads", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--wide", action="store_true", help="over eight decades")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.pads)
    with ProcessPoolExecutor(given.workers, initializer=with_mpfr) as pool:
        pads = list(pool.map(partial(examine, wide=given.wide), seeds, chunksize=5))
    print(summary(pads))
    sys.exit(1 if any(pad.contradictions for pad in pads) else 0)


if __name__ == "__main__":
    main()
