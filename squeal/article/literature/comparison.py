"""The toolkit on systems of the literature, against closed forms and printed numbers.

`provenance` says what each expected number is: 'derived' numbers are closed forms worked out for
the system at hand, those 'from the matrices' were computed from the printed ones before, and 'read
in a copy' ones are printed in the reference (for the bicycle: its Table 2, in the public
transcriptions by other authors, which agree with each other).
"""

import cmath
import math
from collections.abc import Iterator
from dataclasses import replace
from importlib import resources

import numpy as np

from squeal.article.results.stability import DERIVED, MATRICES, READ, Comparison
from squeal.io.short_form import PlainSystem, read_plain
from squeal.linear import CriticalPoint, critical_points
from squeal.linear.eigen import complex_eigenvalues

SYSTEMS = ("mode_coupling", "drum_brake", "ziegler", "wing", "bicycle")

Number = float | complex | None

# Table 2 of the bicycle benchmark: forward speed in m/s, some of the eigenvalues in 1/s
BICYCLE = {
    0.0: (3.13164324790656, 5.53094371765393, -3.13164324790656, -5.53094371765393),
    4.0: (0.41325331521125 + 3.07910818603206j, -1.42944427361326),
    5.0: (-0.77534188219585 + 4.46486771378823j, -0.32286642900409, -14.07838969279820),
    7.0: (-2.13875644258362 + 7.19525913329805j, 0.10268170574766, -18.15788466125262),
    10.0: (-3.72016840437287 + 10.90681139476287j, 0.16105338653172, -24.62459635017404),
}
BICYCLE_SPEEDS = (
    ("real roots meet, divergence turns into flutter", "flutter", 0.68428307889246),
    ("weave speed, flutter ends", "restabilised", 4.29238253634111),
    ("capsize speed", "divergence", 6.02426201538837),
)
WING = (0.09472173 + 2.52287659j, -0.88483025 + 8.44151216j, -0.91799817 + 1.7605842j)


def shown(value: Number) -> str:
    """A number as text, complex ones included."""
    if value is None:
        return "none"
    value = complex(value)
    if value.imag == 0.0:
        return f"{value.real:.9g}"
    return f"{value.real + 0.0:.8g}{value.imag:+.8g}i"  # no minus before a zero


def compare(
    system: PlainSystem,
    quantity: str,
    expected: Number,
    computed: Number,
    tolerance: float = 1e-12,
    provenance: str = DERIVED,
) -> Comparison:
    """A number of a system (None: there is none) and what the toolkit makes of it.

    tolerance: relative; the last printed digit where the number is printed.
    """
    if expected is None or computed is None:
        error = 0.0 if expected is computed else None
    else:
        error = abs(computed - expected) / (abs(expected) or 1.0)
    agrees = error is not None and error <= tolerance
    told = quantity, shown(expected), shown(computed)
    return Comparison(system.name, *told, error, agrees, provenance)


def literature_system(name: str) -> PlainSystem:
    """One of the systems shipped with the package, see `SYSTEMS`."""
    with resources.as_file(resources.files(__package__) / "systems" / f"{name}.yaml") as path:
        return read_plain(path)


def literature_rows() -> list[Comparison]:
    """All comparisons, system by system."""
    return [*_mode_coupling(), *_drum_brake(), *_ziegler(), *_wing(), *_bicycle()]


def _first(points: list[CriticalPoint], kind: str, attribute: str = "mu") -> float | None:
    found = [p for p in points if p.kind == kind]
    return float(getattr(found[0], attribute)) if found else None


def _nearest(system: PlainSystem, mu: float, expected: complex) -> complex:
    values = complex_eigenvalues(*system(mu)).values
    return complex(values[np.argmin(np.abs(values - expected))])


def _mode_coupling() -> Iterator[Comparison]:
    system = literature_system("mode_coupling")
    points = critical_points(system, 2.0)
    frequency = _first(points, "flutter", "frequency_hz")
    yield compare(system, "critical mu (flutter)", 0.75, _first(points, "flutter"))
    yield compare(system, "frequency at critical mu, Hz", math.sqrt(2) / (2 * math.pi), frequency)
    for mu in (0.5, 0.8, 1.0):
        for sign in (1, -1):
            expected = cmath.sqrt(-(2 + sign * cmath.sqrt(1 - 4 * mu / 3)))
            expected = -expected if expected.imag < 0 else expected
            computed = _nearest(system, mu, expected)
            yield compare(system, f"eigenvalue at mu = {mu:g}, 1/s", expected, computed)
    reverse = replace(system, K=(system.K[0], -system.K[1]))
    other = critical_points(reverse, 10.0)
    yield compare(system, "flutter, sliding reversed", None, _first(other, "flutter"))
    yield compare(system, "divergence, sliding reversed", 2.25, _first(other, "divergence"))


def _drum_brake() -> Iterator[Comparison]:
    system = literature_system("drum_brake")
    w1, w2 = (math.sqrt(system.K[0][i, i]) for i in (0, 1))
    expected = abs(w1**2 - w2**2) / (2 * w1 * w2)
    computed = _first(critical_points(system, 1.0), "flutter")
    yield compare(system, "critical mu, undamped", expected, computed)
    for e1, e2 in ((0.02, 0.02), (0.02, 0.04)):
        c1, c2 = e1 * w1, e2 * w2
        # Routh-Hurwitz conditions of the quartic
        a3, a2, a1 = c1 + c2, w1**2 + w2**2 + c1 * c2, c1 * w2**2 + c2 * w1**2
        mu = math.sqrt(a1 * (a2 * a3 - a1) / (a3 * w1 * w2) ** 2 - 1)
        points = critical_points(replace(system, C=(np.diag([c1, c2]),)), 1.0)
        label = f"damping ratios {e1 / 2:g} and {e2 / 2:g}"
        yield compare(system, f"critical mu, {label}", mu, _first(points, "flutter"), 1e-10)
        frequency = math.sqrt(a1 / a3) / (2 * math.pi)
        found = _first(points, "flutter", "frequency_hz")
        yield compare(system, f"frequency, {label}, Hz", frequency, found, 1e-10)


def _ziegler() -> Iterator[Comparison]:
    system = literature_system("ziegler")
    undamped = _first(critical_points(system, 4.0), "flutter")
    yield compare(system, "critical load, undamped", 3.5 - math.sqrt(2), undamped)
    for c in (0.01, 0.1, 1.0):
        damped = replace(system, C=(c * np.array([[2.0, -1.0], [-1.0, 1.0]]),))
        found = _first(critical_points(damped, 4.0), "flutter")
        yield compare(system, f"critical load, damping {c:g}", 41 / 28 + c**2 / 2, found, 1e-10)


def _wing() -> Iterator[Comparison]:
    system = literature_system("wing")
    # matrices read in the collection's file; the eigenvalues follow from them, to 8 decimals
    for value in WING:
        computed = _nearest(system, 0.0, value)
        yield compare(system, "eigenvalue, 1/s", value, computed, 1e-8, MATRICES)


def _bicycle() -> Iterator[Comparison]:
    system = literature_system("bicycle")
    points = critical_points(system, 10.0)
    for label, kind, speed in BICYCLE_SPEEDS:
        yield compare(system, f"{label}, m/s", speed, _first(points, kind), 1e-11, READ)
    for speed, values in BICYCLE.items():
        for value in values:
            computed = _nearest(system, speed, value)
            quantity = f"eigenvalue at {speed:g} m/s, 1/s"
            yield compare(system, quantity, value, computed, 1e-11, READ)
