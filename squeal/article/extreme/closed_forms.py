"""A pad that moves only up and down, or flies freely: motions known in closed form."""

import math

import numpy as np

from squeal.io.scene import Scene
from squeal.model.pad import Pad
from squeal.simulation import Simulation


def upright(**changes: float) -> Pad:
    """Springs upright and alike, no friction: nothing turns or shifts the pad."""
    values = {"m": 2.0, "w": 0.05, "h": 0.02, "k1": 3e5, "k2": 3e5, "k3": 5e5, "k4": 5e5}
    values |= {"L1": 0.4, "L2": 0.4, "alpha1": math.pi / 2, "alpha2": math.pi / 2}
    return Pad(**(values | {"mu": 0.0, "F_n": 400.0} | changes))


def _rates(pad: Pad) -> tuple[float, float, float, float]:
    """k, K and natural frequencies of the free and of the pressed pad."""
    k = pad.k1 + pad.k2
    K = k + (pad.k3 or 0.0) + (pad.k4 or 0.0)
    return k, K, math.sqrt(k / pad.m), math.sqrt(K / pad.m)


def bounce_times(pad: Pad, height: float, cycles: int) -> np.ndarray:
    """Times (4 cycles,) of the contact changes of a pad dropped from a height, both edges each.

    The fall takes 2 asin(sqrt(r/(1+r)/2)) / omega with r = k height / F_n, also where r is tiny.
    """
    k, _, free, pressed = _rates(pad)
    K = pad.m * pressed**2
    r = k * height / pad.F_n
    fall = 2 * math.asin(math.sqrt(r / (1 + r) / 2)) / free
    speed = math.sqrt((2 * pad.F_n * height + k * height**2) / pad.m)
    back = 2 * (math.pi - math.atan2(speed / pressed, pad.F_n / K)) / pressed
    period = 2 * fall + back
    one = np.array([fall, fall, fall + back, fall + back])
    return np.concatenate([n * period + one for n in range(cycles)])


def bounce_period(pad: Pad, height: float) -> float:
    """Time from one start of the fall to the next."""
    times = bounce_times(pad, height, 2)
    return float(times[4] - times[0])


def bounce_error(scene: Scene, found: Simulation) -> float:
    """Error of the contact changes of a dropped pad, relative to the time of the run."""
    height, stop = scene.initial[1], scene.stop or 0.0
    period = bounce_period(scene.pad, height)
    expected = bounce_times(scene.pad, height, math.ceil(stop / period))
    expected = expected[expected < stop]
    times = np.array([e.t for e in found.events or ()])
    if len(times) != len(expected):
        return math.inf
    return float(np.abs(times - expected).max() / stop)


def grazing_error(scene: Scene, found: Simulation) -> float:
    """Error of a pad let go where it just touches: y = -sag (1 - cos(omega t)).

    Whether it loses contact for an instant is up to rounding; it must not for longer.
    """
    _, K, _, rate = _rates(scene.pad)
    sag = scene.pad.F_n / K
    assert found.history is not None
    assert found.shares is not None
    if found.shares["1"] < 1.0 - 1e-6:
        return math.inf
    y = -sag * (1.0 - np.cos(rate * found.history["t"]))
    return float(np.abs(found.history["y"] - y).max() / sag)


def overturn_time(scene: Scene) -> float:
    """When a pad in free flight turns past 90 degrees."""
    return (math.pi / 2 - scene.pad.theta0) / scene.initial[5]


def collapse_time(scene: Scene, share: float) -> float:
    """When a pad thrown up between upright springs has them down to a share of their length."""
    k, _, rate, _ = _rates(scene.pad)
    sag, y0, speed = scene.pad.F_n / k, scene.initial[1], scene.initial[4]
    size, phase = math.hypot(y0 + sag, speed / rate), math.atan2(speed / rate, y0 + sag)
    return (phase - math.acos((sag + scene.pad.L1 * (1 - share)) / size)) / rate


def outrun_time(scene: Scene) -> float:
    """When a pad between level springs, x_dot = v sin(omega t), reaches the surface's speed."""
    _, _, rate, _ = _rates(scene.pad)
    greatest = -scene.initial[0] * rate
    assert scene.pad.V is not None
    return math.asin(scene.pad.V / greatest) / rate if greatest > scene.pad.V else math.inf
