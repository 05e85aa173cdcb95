"""Findings that need single poses or matrices only: no motion is integrated here."""

import math
from typing import NamedTuple

import numpy as np

from squeal.article.equations import balanced, stiffness
from squeal.article.records import bound, rounded_up
from squeal.model.contact import CONSISTENT, FULL, LEAD, NONE, Formulation, contact_law, models_with
from squeal.model.equations import PadModel, linearise
from squeal.model.pad import PARAMETERS, Pad, coefficients, gaps, pose_of

PADS = 1000  # random pads for E2
PATH = 64  # points of the closed path of E4


class Measured(NamedTuple):
    """Numbers of one finding, and one sentence that states them."""

    numbers: dict[str, float]
    outcome: str


def stiffness_entries(pads: list[Pad]) -> Measured:
    """E1: the error of the printed K33 against the gradient of the spring forces, as a share of the
    exact K33, and that of the other entries of Eq. (22), as a share of the greatest entry."""
    # the greatest of all pads
    K33_error = 0.0
    other_errors = 0.0
    for pad in pads:
        # without contact the stiffness is that of the two springs alone
        exact = balanced(pad, linearise(PadModel("B3", pad), np.zeros(3), NONE).K)
        errors = np.abs(balanced(pad, stiffness(pad, printed=True)) - exact)
        K33_error = max(K33_error, errors[2, 2] / abs(exact[2, 2]))
        errors[2, 2] = 0.0
        other_errors = max(other_errors, errors.max() / np.abs(exact).max())
    return Measured(
        {"K33_off": K33_error, "others_off": other_errors},
        f"In the four cases the printed K33 misses the gradient by up to "
        f"{rounded_up(100 * K33_error, 3):.3g} % of it; the other eight entries differ by less "
        f"than {bound(other_errors)} of the greatest.",
    )


def random_pads() -> list[Pad]:
    """`PADS` pads with random sizes, stiffnesses and angles, reproducibly."""
    random = np.random.default_rng(1)
    angles = random.uniform(0.1, math.pi - 0.1, (PADS, 2))
    sizes = 10.0 ** random.uniform(-0.7, 0.7, (PADS, 3))
    pads = []
    for (alpha1, alpha2), (h, k2, k_c) in zip(angles, sizes, strict=True):
        pads.append(
            Pad(m=1.0, w=1.0, h=h, k1=1.0, k2=k2, k_c=k_c, alpha1=alpha1, alpha2=alpha2, mu=0.0)
        )
    return pads


def _singular_ratio(K: np.ndarray) -> float:
    """The least singular value of a matrix over the greatest."""
    values = np.linalg.svd(K, compute_uv=False)
    return float(values[-1] / values[0])


def singularity() -> Measured:
    """E2: least over greatest singular value of K, exact and as printed."""
    exact_ratios = []
    printed_ratios = []
    for pad in random_pads():
        exact_ratios.append(_singular_ratio(balanced(pad, stiffness(pad))))
        printed_ratios.append(_singular_ratio(balanced(pad, stiffness(pad, printed=True))))
    exact = max(exact_ratios)
    median = float(np.median(printed_ratios))
    return Measured(
        {"exact_greatest": exact, "printed_median": median},
        f"Over {PADS} random sets the least singular value of the exact K is less than "
        f"{bound(exact)} of the greatest; with K33 as printed the median is {median:.2g}.",
    )


def _pressed(pad: Pad, depth: float, tilt: float) -> np.ndarray:
    """A pose whose edges penetrate by depth + w tilt (leading) and depth - w tilt (trailing)."""
    y = -pad.y0 - pad.h * (1 - math.cos(tilt)) - depth
    return np.array([0.0, y, tilt - pad.theta0])


def integrand_sign(pad: Pad) -> Measured:
    """E3: mean of the integrand of Eq. (13) over Rn of Eq. (14c), in full contact."""
    model = PadModel("B2", pad)
    q = _pressed(pad, 1e-3 * pad.w, 4e-4)
    gap_l, gap_t = model.gaps(q)  # y_l - y_cl and y_t - y_cl
    Rn, _ = model.law.signals(model.c, pose_of(np, tuple(q)), FULL)
    ratio = float(pad.k_c * (gap_l + gap_t) / 2.0 / Rn)
    return Measured(
        {"ratio": ratio},
        f"In full contact the mean of the printed integrand is {ratio:.12g} times the Rn of "
        "Eq. (14c).",
    )


def energy_gained(pad: Pad, line_force: str) -> tuple[float, float]:
    """Work (J) of the contact forces on a closed path in partial contact, and the greatest contact
    energy (J) on it.

    The path is a circle in (y, w theta), passed through once, without friction. The work on it
    comes from the trapezoidal rule, which converges geometrically for a closed smooth path.
    line_force: the law, "integral" or "mean" (as printed), see `Formulation`.
    """
    frictionless = pad.replace(mu=0.0)
    formulation = Formulation(line_force=line_force)  # type: ignore[arg-type]
    model = PadModel("B2", frictionless, formulation)
    angles = 2 * math.pi * np.arange(PATH) / PATH  # along the circle
    radius = 1e-4 * pad.w
    # the tilt moves the edges by 19 radii and more: the leading edge alone touches
    tilts = (20 * radius + radius * np.cos(angles)) / pad.w
    # y of the centre of the circle: there the middle of the face is at the surface
    centre = _pressed(frictionless, 0.0, float(tilts[0]))[1]
    work = 0.0
    energy = 0.0
    step = 2 * math.pi / PATH * radius  # of the arc
    for angle, tilt in zip(angles, tilts, strict=True):
        q = np.array([0.0, centre + radius * math.sin(angle), tilt - frictionless.theta0])
        at = pose_of(np, tuple(q))
        load = model.law.loads(model.c, at, LEAD)
        # F_y dy + M dtheta with dy = cos(angle) step and w dtheta = -sin(angle) step
        work += load.y * step * math.cos(angle) - load.moment * step * math.sin(angle) / pad.w
        energy = max(energy, float(model.law.energy(model.c, at, LEAD)))
    return float(work), energy


def partial_contact_energy(pad: Pad) -> Measured:
    """E4: energy gained on a closed path in partial contact, without friction."""
    mean, energy = energy_gained(pad, "mean")
    integral, _ = energy_gained(pad, "integral")
    return Measured(
        {"mean": mean / energy, "integral": integral / energy},
        f"On one closed path in partial contact with mu = 0 the printed law does the work "
        f"{mean / energy:+.3g} times the greatest contact energy of the path, the consistent law "
        f"less than {bound(integral / energy)}.",
    )


def friction_arm(pad: Pad) -> Measured:
    """E10: order at which B1's friction moment departs from that at the constant arm h."""
    level = pad.replace(theta0=0.0)

    def departure(scale: float) -> float:
        """Friction's moment less h times friction, about a pose pressed in and tilted by 1e-3."""
        model = PadModel("B1", level)
        frictionless = PadModel("B1", level.replace(mu=0.0))
        # pressed in by 1e-3 w and tilted by 1e-3, both times `scale`
        at = pose_of(np, (0.0, -scale * 1e-3 * pad.w, scale * 1e-3))
        loads = model.law.loads(model.c, at, FULL)
        normal_loads = frictionless.law.loads(frictionless.c, at, FULL)
        return abs(float(loads.moment - normal_loads.moment - pad.h * loads.x))

    order = math.log2(departure(1.0) / departure(0.5))
    return Measured(
        {"order": order},
        f"Halving the displacement divides the difference of the friction moments by "
        f"{2**order:.3g}: order {order:.3f}.",
    )


def _rough(share: float) -> str:
    """A share of states that rounding decides, which is another on each processor."""
    return "more than 10 %" if share > 0.1 else f"{100.0 * share:.3g} %"


def _touching_by_equation(pad: Pad, y: float, tilt: float) -> tuple[bool, bool]:
    """Whether the leading edge at -w and the trailing edge at w touch by Eq. (12), for tilt > 0.

    Eq. (12) gives the abscissa x_cl, from the middle of the face, at which the lower face crosses
    the surface. The face is below the surface left of it: an edge at x touches where x < x_cl.
    """
    phi = pad.theta0 + (tilt - pad.theta0)  # theta0 + theta, rounded as in a pose
    x_cl = -(pad.y0 + y + pad.h) / math.tan(phi) + pad.h / math.sin(phi)
    return x_cl > -pad.w, x_cl >= pad.w


def contact_loss_point(pad: Pad) -> Measured:
    """E11: share of random poses whose contact state by Eq. (12) is not that of their edge
    penetrations, for three tilts."""
    random = np.random.default_rng(2)
    c = coefficients(math, pad, absolute_gap=True)
    count = 400
    numbers = {}
    shares = []
    for exponent in (-8, -12, -16):
        tilt = 10.0**exponent
        wrong = 0
        # height of the middle of the face over w tilt: at -1 and at 1 an edge begins to touch
        for height in random.uniform(-1.5, 1.5, count):
            y = -pad.y0 + height * pad.w * tilt
            gap_l, gap_t = gaps(c, pose_of(math, (0.0, y, tilt - pad.theta0)))
            by_penetration = (gap_l < 0.0, gap_t <= 0.0)  # equality as by Eq. (12)
            is_near_a_change = abs(abs(height) - 1.0) <= 1e-3  # where rounding may decide either
            if _touching_by_equation(pad, y, tilt) != by_penetration and not is_near_a_change:
                wrong += 1
        share = wrong / count
        numbers[f"wrong_1e{exponent}"] = share
        shares.append(f"{_rough(share)} (tilt 1e{exponent} rad)")
    return Measured(
        numbers,
        f"States decided by Eq. (12) differ from those of the penetrations in {', '.join(shares)} "
        f"of {count} poses each.",
    )


def missing_parameters() -> Measured:
    """E14: parameters that a scene needs and how many of them the article prints."""

    def needed(model: str) -> int:
        required = [name for name, parameter in PARAMETERS.items() if parameter.required]
        return sum(model in models_with(name) for name in required)

    b1 = needed("B1")
    b2 = needed("B2")
    return Measured(
        {"B1_needed": float(b1), "B2_needed": float(b2)},
        f"A simulation cannot do without {b1} parameters for B1 and {b2} for B2, "
        "besides the moment of inertia, for which a rectangle can stand, and the speed of the "
        "surface; of these the article prints the two spring angles of each case.",
    )


def slope(pad: Pad) -> Measured:
    """E15: delta of Eq. (17) with the slope (y_t - y_l)/(x_t - x_l) against the contact law."""
    law = contact_law("B2", CONSISTENT)
    c = coefficients(math, pad, absolute_gap=True)  # as B2 has them
    # a tilted pose in which the whole face is pressed in
    at = pose_of(math, tuple(_pressed(pad, 1e-3 * pad.w, 4e-4)))
    # of the leading and of the trailing edge: position along the surface, and gap (negative here)
    x_l = at.x_offset(c.rlx, c.rly)
    x_t = at.x_offset(c.rtx, c.rty)
    gap_l, gap_t = gaps(c, at)
    half = (x_t - x_l) / 2.0
    middle = (x_t + x_l) / 2.0
    # two-point Gauss quadrature, exact for the integrands: pressure and position times pressure
    points = middle + half * np.array([-1.0, 1.0]) / math.sqrt(3.0)
    pressure = -(gap_l + (points - x_l) * (gap_t - gap_l) / (x_t - x_l))
    delta = float((points * pressure).sum() / pressure.sum())
    _, delta_of_law = law.signals(c, at, FULL)
    off = abs(delta - float(delta_of_law)) / pad.w
    return Measured(
        {"off": off},
        f"As extracted the slope is 0/0; with trailing minus leading edge, Eq. (17) meets the "
        f"contact law to less than {bound(off)} w.",
    )
