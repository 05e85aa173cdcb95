"""Complex eigenvalue analysis of the article's eight cases by python-control: poles and loops.

Friction as a loop gain. About an equilibrium the motion changes the normal reaction by r' q;
Coulomb friction returns mu times this change as a load b (a force along the surface and its
moment). With everything else in the plant,

    M q'' + C q' + K_0 q = u,    z = Phi q,    u = mu z,

the loop gain is mu, and Phi = -dK/dmu at that place. On the line friction acts at the distance h
from the centre, so that Phi = b r' has rank one and the loop one input: the root locus over its
gain is the path of the poles over friction, and its gain margin the friction at which one of them
reaches the imaginary axis. On points the two edges have different arms; Phi has rank two, and mu
closes two loops at once.

The loop is that of a *frozen* equilibrium: the place stays where it is at the case's friction.
Friction moves the equilibrium too, which the plant does not know; the poles about the equilibrium
that follows friction are computed beside it.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq, linear_sum_assignment

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.records import Missing, Record, Result
from squeal.article.studies._scenes import read_scenes
from squeal.equilibrium import Path as Branch
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.linear import complex_eigenvalues
from squeal.linear.matrices import state_matrices
from squeal.model.equations import Linearisation, linearise
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.thresholds import critical_friction

ROUNDING = 1e-9  # real parts below this share of |s| are rounding
RANK = 1e-12  # singular values of the loop below this share of the greatest are rounding
RATIO = 0.005  # modal damping of the loops
GREATEST = 1.5  # loop gain, which is friction
AGREES = 1e-11  # of the greatest magnitude: poles by python-control and by squeal differ by less
GAINS = 151  # of a root locus, up to `GREATEST`
SAME_GAIN = 1e-9  # of a gain margin: gains that differ by less are one
Row = tuple[float, ...]


class Pole(Record):
    """Real part in 1/s, imaginary part in rad/s; damping_ratio None for a pole at the origin."""

    real: float
    imag: float
    frequency_hz: float
    damping_ratio: float | None


class EquilibriumPoles(Record):
    """Contact, reaction (N) and tilt (rad) of an equilibrium, its poles with Im >= 0, its verdict.

    free: the reaction (N) without friction; apart: greatest distance of an eigenvalue by squeal
    from the nearest of python-control's, over the greatest magnitude.
    """

    contact: str
    R_n: float
    free: float
    theta: float
    poles: tuple[Pole, ...]
    verdict: str
    apart: float


class Locus(Record):
    """The six poles over friction: real (1/s), imag (rad/s): a row per pole, over `mu`."""

    mu: Row
    real: tuple[Row, ...]
    imag: tuple[Row, ...]


class Loop(Record):
    """Friction as a loop gain about the equilibrium of a case under modal damping.

    inputs: of the loop; second: its second singular value over the first; poles: at the case's
    friction `mu`; frozen: the least gain at which a pole reaches the imaginary axis (the gain
    margin of the loop of gain one), None if none does up to `GREATEST`, and frequency_hz there;
    by_poles: the same gain from the poles of the closed loop; margin: frozen over mu; modulus: the
    least distance of the Nyquist curve from -1 at the case's friction, of a stable loop of one
    input; followed: the friction at which the equilibrium that follows friction loses stability,
    None as for frozen; ends: why it is not followed to `GREATEST`, empty if it is; locus, path: the
    poles about the frozen equilibrium, and about the one that follows; apart: greatest distance of
    a pole by python-control from an eigenvalue by squeal, at all frictions of both, over the
    greatest magnitude.
    """

    contact: str
    mu: float
    inputs: int
    second: float
    poles: tuple[Pole, ...]
    frozen: float | None
    by_poles: float | None
    frequency_hz: float | None
    margin: float | None
    modulus: float | None
    followed: float | None
    ends: str
    locus: Locus
    path: Locus
    apart: float


class Eigenvalues(Result):
    """scenes: without damping, loops: with the modal damping `ratio`, by name of the scene; a scene
    without steady sliding has the reason. apart: the greatest distance of a pole by python-control
    from an eigenvalue by squeal, of all, which is below `agrees`."""

    scenes: dict[str, EquilibriumPoles | Missing]
    loops: dict[str, Loop | Missing]
    apart: float
    agrees: float = AGREES
    ratio: float = RATIO
    greatest: float = GREATEST

    @property
    def wrong(self) -> str:
        """A sentence if python-control and squeal differ, else empty."""
        if self.apart < AGREES:
            return ""
        return f"poles by python-control are {self.apart:.1e} from the own eigenvalues"


def poles(system: Linearisation) -> tuple[Pole, ...]:
    """Poles with non-negative imaginary part by python-control, in order of frequency.

    Real parts of rounding size are set to zero. The damping ratio is None where python-control
    gives none (a pole at the origin).
    """
    import control

    A, B = state_matrices(*system)
    plant = control.ss(A, B, np.eye(6), np.zeros((6, 3)))  # poles depend on A alone
    with np.errstate(invalid="ignore", divide="ignore"):
        _, ratios, values = control.damp(plant, doprint=False)
    rows = []
    for s, ratio in zip(values, ratios, strict=True):
        if s.imag < 0.0:
            continue
        real = float(s.real)
        damping_ratio = float(ratio) if math.isfinite(ratio) else None
        if abs(s.real) < ROUNDING * abs(s):
            real = 0.0
            damping_ratio = 0.0
        rows.append(
            Pole(
                real=real,
                imag=float(s.imag),
                frequency_hz=float(s.imag) / (2 * math.pi),
                damping_ratio=damping_ratio,
            )
        )

    def rising_frequency(pole: Pole) -> tuple[float, float]:
        # two modes that have met share a frequency but for rounding: the one that grows comes first
        return float(f"{pole.imag:.9g}"), -pole.real

    return tuple(sorted(rows, key=rising_frequency))


def distance(by_control: np.ndarray, by_squeal: np.ndarray) -> float:
    """Greatest distance of an eigenvalue by squeal (n,) from the nearest pole by python-control
    (m,), over the greatest magnitude."""
    nearest = np.abs(by_control[:, None] - by_squeal[None, :]).min(axis=0)
    return float(nearest.max() / np.abs(by_squeal).max())


def examined(scene: Scene) -> EquilibriumPoles | Missing:
    """Equilibrium, poles and verdict of a scene, or the reason why there is none."""
    try:
        analysis = analyse(scene)
        without_friction = analyse(scene.replace(mu=0.0))
    except ComputationError as error:
        return Missing(str(error))
    rows = poles(analysis.matrices)
    upper = np.array([complex(p.real, p.imag) for p in rows])  # of the upper half plane
    by_squeal = np.array([e.value for e in analysis.spectrum.eigenvalues])
    assert analysis.R_n is not None
    assert without_friction.R_n is not None
    return EquilibriumPoles(
        contact=analysis.contact,
        R_n=analysis.R_n,
        free=without_friction.R_n,  # the reaction without friction
        theta=analysis.q[2],
        poles=rows,
        verdict=analysis.judgement.verdict,
        apart=distance(np.concatenate([upper, upper.conj()]), by_squeal),
    )


class FrictionLoop(NamedTuple):
    """The plant of a frozen equilibrium in natural units, and what closes it.

    rate (rad/s): of time; M, C, K_0 (3, 3); inputs (3, k), outputs (k, 3): the loop's load is
    mu inputs outputs q; second: the second singular value of that product over the first.
    """

    rate: float
    M: np.ndarray
    C: np.ndarray
    K_0: np.ndarray
    inputs: np.ndarray
    outputs: np.ndarray
    second: float

    def matrices(self, mu: float) -> Linearisation:
        """Of the closed loop."""
        return Linearisation(self.M, self.C, self.K_0 - mu * self.inputs @ self.outputs)

    @property
    def plant(self) -> Any:
        """python-control's system from the friction loads to their changes per unit of mu."""
        import control

        A, B = state_matrices(self.M, self.C, self.K_0)
        outputs = np.hstack([self.outputs, np.zeros_like(self.outputs)])
        return control.ss(A, B @ self.inputs, outputs, 0.0)


def friction_loop(scene: Scene) -> FrictionLoop:
    """The loop about the sliding equilibrium of a scene. Raises ComputationError without one.

    K is linear in mu at a fixed place, so that Phi = -dK/dmu = K(0) - K(1). By its singular value
    decomposition it is inputs times outputs, of as many columns and rows as its rank.
    """
    analysis = analyse(scene)
    model = damped_model(scene)
    pad = scene.pad
    q = np.array(analysis.q)
    rate = math.sqrt(pad.k1 / pad.m)  # the unit of frequency
    to_lengths = np.diag([1.0, 1.0, 1.0 / pad.w])  # (x, y, theta) from (x, y, w theta)
    K_0 = linearise(model.replace(mu=0.0), q, analysis.state).K
    K_1 = linearise(model.replace(mu=1.0), q, analysis.state).K
    # all matrices belong to (x, y, w theta), and are in units of m, k1 and `rate`
    phi = to_lengths @ (K_0 - K_1) @ to_lengths / pad.k1
    left, singular_values, right = np.linalg.svd(phi)
    rank = int(np.sum(singular_values > RANK * singular_values[0]))
    return FrictionLoop(
        rate=rate,
        M=to_lengths @ analysis.matrices.M @ to_lengths / pad.m,
        C=to_lengths @ analysis.matrices.C @ to_lengths / (pad.m * rate),
        K_0=to_lengths @ K_0 @ to_lengths / pad.k1,
        inputs=left[:, :rank],
        outputs=singular_values[:rank, None] * right[:rank],
        second=float(singular_values[1] / singular_values[0]),
    )


def closed_poles(loop: FrictionLoop, gains: np.ndarray) -> np.ndarray:
    """Poles (gains, 6) of the closed loop by python-control, in natural units.

    Those of a loop with one input are its root locus. With two inputs both are closed at once, with
    the same gain.
    """
    import control

    plant = loop.plant
    count = loop.inputs.shape[1]
    if count == 1:
        # python-control feeds back with the opposite sign
        return np.asarray(control.root_locus_map(-plant, gains=gains).loci)
    rows = []
    for mu in gains:
        friction = control.ss([], [], [], mu * np.eye(count))  # a gain alone, without states
        rows.append(control.feedback(plant, friction, sign=1).poles())
    return np.array(rows)


def gain_margins(loop: FrictionLoop) -> list[float]:
    """Gains up to `GREATEST` at which a pole reaches the axis, rising.

    By `control.stability_margins` for a loop L of one input. Not every version of it looks at the
    frequency zero, where the pole is on the axis at the gain with 1 + gain L(0) = 0: that gain is
    added. Of gains that differ by rounding the smallest is listed. A loop of two inputs has no gain
    margin, see `critical_gain`.
    """
    import control

    open_loop = -loop.plant  # python-control feeds back with the opposite sign
    margins, *_ = control.stability_margins(open_loop, returnall=True)
    gains = np.asarray(margins).tolist()
    static = float(np.real(open_loop(0.0)))
    if static < 0.0:
        gains.append(-1.0 / static)
    crossings: list[float] = []
    for gain in sorted(gains):
        is_listed = bool(crossings) and math.isclose(gain, crossings[-1], rel_tol=SAME_GAIN)
        if 0.0 < gain <= GREATEST and not is_listed:
            crossings.append(gain)
    return crossings


def critical_gain(loop: FrictionLoop, gains: np.ndarray, values: np.ndarray) -> float | None:
    """The gain at which the closed loop first has a pole in the right half plane, from its poles
    (gains, 6) at some gains; None if it has none at these."""
    unstable = values.real.max(axis=1) > 0.0
    if not unstable.any():
        return None
    first = int(np.argmax(unstable))
    if first == 0:
        return float(gains[0])

    def growth(mu: float) -> float:
        return float(closed_poles(loop, np.array([mu])).real.max())

    return float(brentq(growth, gains[first - 1], gains[first], xtol=1e-13))


def modulus_margin(loop: FrictionLoop, mu: float) -> float:
    """Least distance of the Nyquist curve of a loop of one input at gain mu from -1."""
    import control

    _gain, _phase, modulus, *_ = control.stability_margins(-mu * loop.plant)
    return float(modulus)


def tracked(values: np.ndarray) -> np.ndarray:
    """Poles (gains, 6) in such an order that each column is near itself from gain to gain.

    By the assignment of least total distance; at first they are in order of the imaginary part.
    """
    rows = [values[0][np.argsort(values[0].imag)]]
    for row in values[1:]:
        _, order = linear_sum_assignment(np.abs(rows[-1][:, None] - row[None, :]))
        rows.append(row[order])
    return np.array(rows)


def locus(mus: np.ndarray, values: np.ndarray) -> Locus:
    """Poles (mus, 6) in rad/s."""
    rows = tracked(values).T
    return Locus(
        mu=tuple(mus.tolist()),
        real=tuple(tuple(row.tolist()) for row in rows.real),
        imag=tuple(tuple(row.tolist()) for row in rows.imag),
    )


class FollowedPoles(NamedTuple):
    """Frictions (n,) that the branch of equilibria reaches, poles (n, 6) about it by python-control
    in rad/s, and their greatest distance from eigenvalues by squeal."""

    mus: np.ndarray
    poles: np.ndarray
    apart: float


def followed_poles(scene: Scene, mus: np.ndarray) -> FollowedPoles:
    """Poles about the equilibrium that follows friction, at those of `mus` that it reaches."""
    import control

    branch = Branch.of(damped_model(scene), GREATEST)
    reached = mus[mus <= branch.mu_end]
    rows = []
    apart = 0.0
    for matrices in branch.many(reached.tolist()):
        A, B = state_matrices(*matrices)
        values = control.ss(A, B, np.eye(6), 0.0).poles()
        apart = max(apart, distance(values, complex_eigenvalues(*matrices).values))
        rows.append(values)
    return FollowedPoles(reached, np.array(rows), apart)


def frozen_distance(loop: FrictionLoop, gains: np.ndarray, values: np.ndarray) -> float:
    """Greatest distance of the poles (gains, 6) of the closed loop from eigenvalues by squeal."""
    greatest = 0.0
    for mu, row in zip(gains.tolist(), values, strict=True):
        by_squeal = complex_eigenvalues(*loop.matrices(mu)).values
        greatest = max(greatest, distance(row, by_squeal))
    return greatest


def critical_frequency(loop: FrictionLoop, gain: float) -> float:
    """Frequency in Hz of the closed loop's rightmost pole."""
    at_gain = closed_poles(loop, np.array([gain]))[0]
    rate = abs(at_gain[np.argmax(at_gain.real)].imag) * loop.rate
    return float(rate) / (2 * math.pi)


def loop_of(scene: Scene) -> Loop | Missing:
    """The loop of a scene under modal damping, or the reason why there is none.

    It has the critical gain (friction) of the frozen equilibrium by two methods, and the first loss
    of stability of the equilibrium that follows friction.
    """
    damped = dataclasses.replace(scene, damping=Damping(ratios=(RATIO,) * 3))
    mu = scene.pad.mu
    gains = np.linspace(0.0, GREATEST, GAINS)
    try:
        analysis = analyse(damped)
        loop = friction_loop(damped)
        thresholds = critical_friction(damped, GREATEST)
        followed = followed_poles(damped, gains)
    except ComputationError as error:
        return Missing(str(error))
    values = closed_poles(loop, gains)  # (gains, 6), in units of `loop.rate`
    by_poles = critical_gain(loop, gains, values)
    frozen = by_poles  # the critical gain that is reported, None if no gain is critical
    modulus = None
    # a loop of one input has a gain margin, which is the same gain by a second method
    if loop.inputs.shape[1] == 1:
        margins = gain_margins(loop)
        if margins:
            frozen = margins[0]
        if analysis.judgement.verdict == "stable":
            modulus = modulus_margin(loop, mu)
    # frictions at which the equilibrium that follows friction becomes unstable, rising
    losses = [p.mu for p in thresholds.points if p.kind in ("flutter", "divergence")]
    return Loop(
        contact=analysis.contact,
        mu=mu,
        inputs=loop.inputs.shape[1],
        second=loop.second,
        poles=poles(analysis.matrices),
        frozen=frozen,
        by_poles=by_poles,
        frequency_hz=None if frozen is None else critical_frequency(loop, frozen),
        margin=None if frozen is None else frozen / mu,
        modulus=modulus,
        followed=losses[0] if losses else None,
        ends=thresholds.end if followed.mus[-1] < GREATEST else "",
        locus=locus(gains, loop.rate * values),  # in 1/s
        path=locus(followed.mus, followed.poles),
        apart=max(followed.apart, frozen_distance(loop, gains, values)),
    )


def study(files: Sequence[Path]) -> Eigenvalues:
    """The eight cases of models B1 and B2."""
    scenes = read_scenes(files, HISTORY_FIGURES)
    undamped = {name: examined(scene) for name, scene in scenes.items()}
    loops = {name: loop_of(scene) for name, scene in scenes.items()}
    examined_scenes = (*undamped.values(), *loops.values())
    distances = [e.apart for e in examined_scenes if not isinstance(e, Missing)]
    return Eigenvalues(scenes=undamped, loops=loops, apart=max(distances, default=0.0))


def sentences(record: Eigenvalues) -> Mapping[str, bool]:
    """What the paper says of poles and loops, and whether it holds.

    Of cases without a loop the first sentence is False; the others speak of those that have one.
    """
    loops = {name: loop for name, loop in record.loops.items() if isinstance(loop, Loop)}
    points = [loop for name, loop in loops.items() if name.startswith("b1")]
    line = {name[-1]: loop for name, loop in loops.items() if name.startswith("b2")}  # by case
    past_margin = [
        name for name, loop in loops.items() if loop.margin is not None and loop.margin < 1.0
    ]

    def margin_agrees(loop: Loop) -> bool:
        """Whether both methods find the same critical gain, or neither finds one."""
        if loop.frozen is None or loop.by_poles is None:
            return loop.frozen == loop.by_poles
        return abs(loop.frozen - loop.by_poles) < 1e-7  # of a friction coefficient

    def frozen_as_followed(case: str) -> bool:
        """Whether both equilibria of the line lose stability, at nearly the same friction."""
        loop = line.get(case)
        if loop is None or loop.frozen is None or loop.followed is None:
            return False
        return abs(loop.frozen - loop.followed) < 1e-3 * loop.followed

    def stays_stable(case: str) -> bool:
        """Whether the equilibrium that follows friction stays stable up to the greatest friction,
        or to where its branch ends, while the frozen one loses stability."""
        loop = line.get(case)
        return loop is not None and loop.frozen is not None and loop.followed is None

    return {
        "python-control-agrees-with-own-eigenvalues": record.apart < AGREES
        and len(loops) == len(record.loops),
        "friction-is-one-loop-on-the-line-and-two-on-points": all(
            loop.inputs == 1 for loop in line.values()
        )
        and all(loop.inputs == 2 and loop.second < 1e-3 for loop in points),
        "gain-margin-agrees-with-root-locus": all(map(margin_agrees, loops.values())),
        "no-friction-destabilises-the-frozen-points": all(loop.frozen is None for loop in points),
        "frozen-equilibrium-of-the-line-loses-stability-in-every-case": all(
            loop.frozen is not None for loop in line.values()
        ),
        "b2-c-alone-is-past-its-gain-margin": past_margin == ["b2-c"],
        "frozen-and-followed-agree-in-c-and-d": all(map(frozen_as_followed, "cd")),
        "following-the-equilibrium-keeps-a-and-b-stable": all(map(stays_stable, "ab")),
    }
