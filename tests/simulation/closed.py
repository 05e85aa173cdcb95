"""A pad that only moves up and down, its motion in closed form, and any motion in quad."""

import math

import numpy as np

from squeal.model.pad import Pad
from squeal.simulation.hybrid import integrate
from squeal.simulation.run import in_natural_units
from tests.conftest import HEYOKA

if HEYOKA:
    import heyoka as hy

    from squeal.simulation.taylor import TaylorIntegrator


def quad(scene):
    """Units, last state and number of contact changes in quad precision."""
    units, model, start, stop = in_natural_units(scene)
    exact = TaylorIntegrator(model, 1e-30, hy.real128)
    start = np.array([hy.real128(float(v)) for v in start])
    _, state, _, changes = integrate(model, exact, units, start, stop)
    return units, np.array([float(v) for v in state]), changes


def upright(**changes):
    """Springs upright and alike, no friction."""
    values = {"m": 2.0, "w": 0.05, "h": 0.02, "k1": 3e5, "k2": 3e5, "k3": 5e5, "k4": 5e5}
    values |= {"L1": 0.4, "L2": 0.4, "alpha1": math.pi / 2, "alpha2": math.pi / 2}
    return Pad(**(values | {"mu": 0.0, "F_n": 400.0} | changes))


def bouncing(pad, height):
    """Of a pad that falls from a height: first touch, time in contact and depth."""
    k = pad.k1 + pad.k2
    K = k + (pad.k3 + pad.k4 if pad.k_c is None else pad.k_c)
    free = math.sqrt(k / pad.m)
    pressed = math.sqrt(K / pad.m)
    a = height + pad.F_n / k
    touch = math.acos((pad.F_n / k) / a) / free
    speed = a * free * math.sin(free * touch)
    # pressed: y = -F_n/K + F_n/K cos - speed/pressed sin, back at zero after
    back = 2 * (math.pi - math.atan2(speed / pressed, pad.F_n / K)) / pressed
    return touch, back, pad.F_n / K + math.hypot(pad.F_n / K, speed / pressed)
