"""More digits than a double has, without heyoka: extrapolated midpoint rule in mpmath's numbers."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.model.equations import PadModel, net_loads
from squeal.model.mechanics import Coefficients, facing, pose, spring_lengths
from squeal.model.states import State
from squeal.numerics.newton import complex_step
from squeal.simulation.legs import COLLAPSED, LIMITS, Integrator, Leg

DIGITS = 32  # of the arithmetic
TIGHTEST = 1e-24  # tolerance: some digits are lost in the extrapolation
COLUMNS = 16  # of the extrapolation; a step that needs more is halved
EASY = 9  # a step that needs fewer may grow
LONGEST = 0.5  # natural time units: contact changes are looked for between the ends of a step
SAMPLES = 33  # of a step, where gaps are looked at
LONGEST_LEG = 5000  # steps

Rates = Callable[[list[Any]], list[Any]]


class MpmathIntegrator(Integrator):
    """Gragg's, Bulirsch's and Stoer's method over one scaled pad, some seconds for a scene.

    The coefficients stay the doubles of the pad, so that the difference to a double run is that of
    the integration alone. The tolerance is at least `TIGHTEST`.
    """

    method = "mpmath extrapolation"

    def __init__(self, model: PadModel, tolerance: float) -> None:
        import mpmath

        self._ops = mpmath.MPContext()
        self._ops.dps = DIGITS
        self.tolerance = max(tolerance, TIGHTEST)
        self._model = model
        self.number: Any = self._ops.mpf
        self._c = Coefficients(*(self.number(float(value)) for value in model.c))
        pad = model.pad
        self._longest = LONGEST * min(1.0, math.sqrt(3 * pad.I / (pad.m * (pad.w**2 + pad.h**2))))

    def _rates(self, contact: State) -> Rates:
        c, law, ops = self._c, self._model.law, self._ops
        D = self._model.decay if "damping" in self._model.terms else None

        def rates(s: list[Any]) -> list[Any]:
            f = net_loads(ops, c, law, c.place(s), contact)
            found = [f.x / c.m, f.y / c.m, c.w * f.moment / c.I]
            if D is not None:
                found = [
                    a - sum(self.number(float(d)) * v for d, v in zip(row, s[3:], strict=True))
                    for a, row in zip(found, D, strict=True)
                ]
            return [*s[3:], *found]

        return rates

    def _midpoint(
        self, rates: Rates, s: list[Any], first: list[Any], size: Any, n: int
    ) -> list[Any]:
        """n steps of the midpoint rule over `size`, smoothed at the end."""
        h = size / n
        old, new = s, [a + h * r for a, r in zip(s, first, strict=True)]
        for _ in range(n - 1):
            slopes = rates(new)
            old, new = new, [a + 2 * h * r for a, r in zip(old, slopes, strict=True)]
        slopes = rates(new)
        return [(a + b + h * r) / 2 for a, b, r in zip(old, new, slopes, strict=True)]

    def _step(
        self, rates: Rates, s: list[Any], first: list[Any], size: Any
    ) -> tuple[list[Any] | None, int]:
        """The state after `size` and the columns it took; None if it took too many."""
        table: list[list[list[Any]]] = []
        for j in range(COLUMNS):
            row = [self._midpoint(rates, s, first, size, 2 * (j + 1))]
            for k in range(1, j + 1):
                ratio = self.number((j + 1) ** 2) / (j + 1 - k) ** 2 - 1
                pairs = zip(row[k - 1], table[-1][k - 1], strict=True)
                row.append([a + (a - b) / ratio for a, b in pairs])
            table.append(row)
            if j > 2:
                error = max(abs(a - b) for a, b in zip(row[-1], row[-2], strict=True))
                if error <= self.tolerance * max(map(abs, row[-1])):
                    return row[-1], j
        return None, COLUMNS

    def _watched(self, ops: Any, c: Coefficients, contact: State, s: Any) -> list[Any]:
        """What passes zero upwards where the leg ends: gaps by contact point, then the limits."""
        at = pose(ops, c.place(s))
        signs = [1.0 if touches else -1.0 for touches in contact]
        heights = zip(signs, self._model.law.gaps(c, at), strict=True)
        springs = zip(spring_lengths(ops, c, at), (c.L1, c.L2), strict=True)
        limits = [COLLAPSED - length / L for length, L in springs]
        return [*(sign * gap for sign, gap in heights), -facing(c, at), *limits]

    def _first_end(
        self, contact: State, ends: list[list[Any]], rates: list[list[Any]], size: float
    ) -> tuple[int, float] | None:
        """What ends the leg first within a step, and about when, from Hermite's polynomial."""
        s0, s1, r0, r1 = (np.array(v, dtype=float) for v in (*ends, *rates))
        a, b = size * s0[3:], size**2 / 2 * r0[3:]
        rest = s1[:3] - s0[:3] - a - b
        slope = size * s1[3:] - a - 2 * b
        bend = (size**2 * r1[3:] - 2 * b) / 2
        c3, c4, c5 = np.array([[10, -4, 1], [-15, 7, -2], [6, -3, 1]]) @ np.array(
            [rest, slope, bend]
        )

        def watched(u: Any) -> np.ndarray:
            q = [
                s0[i] + u * (a[i] + u * (b[i] + u * (c3[i] + u * (c4[i] + u * c5[i]))))
                for i in range(3)
            ]
            return np.array(np.broadcast_arrays(*self._watched(np, self._model.c, contact, q)))

        u = np.linspace(0.0, 1.0, SAMPLES)
        passed = watched(u)[:, 1:] > 0.0
        if not passed.any():
            return None
        found = []
        for i in np.flatnonzero(passed.any(axis=1)):
            k = int(np.argmax(passed[i]))
            low, high = u[k], u[k + 1]
            for _ in range(50):
                middle = (low + high) / 2
                low, high = (low, middle) if watched(middle)[i] > 0.0 else (middle, high)
            found.append((high, int(i)))
        when, what = min(found)
        return what, float(when)

    def _located(
        self, contact: State, rates: Rates, s: list[Any], first: list[Any], what: int, size: Any
    ) -> tuple[list[Any], Any]:
        """The state at which the entry `what` of `_watched` is zero, and when, near `size`."""
        for _ in range(8):
            end, _ = self._step(rates, s, first, size)
            if end is None:
                break
            value = self._watched(self._ops, self._c, contact, end)[what]
            plain = np.array(end, dtype=float)

            def along(q: Any) -> np.ndarray:
                return np.array(self._watched(np, self._model.c, contact, q))

            rate = float(complex_step(along, plain[:3], along=plain[3:])[what])
            if rate == 0.0:
                break
            change = value / rate
            size = size - change
            if abs(change) <= 10 * self.tolerance:
                return end, size + change
        raise ComputationError("a contact change could not be located with more digits")

    def advance(self, contact: State, t: float, state: np.ndarray, stop: float, dense: bool) -> Leg:
        """See `Integrator.advance`; there is no dense output. Raises ComputationError."""
        rates, s = self._rates(contact), [self.number(v) for v in state]
        now, size, steps = self.number(t), self.number(self._longest), 0
        first = rates(s)
        point, limit = None, None
        while now < stop and steps < LONGEST_LEG:
            size = min(size, stop - now)
            end, columns = self._step(rates, s, first, size)
            if end is None:
                size = size / 2
                if size < 1e-9:
                    raise ComputationError(
                        f"the motion is not smooth at natural time {float(now):.9g}"
                    )
                continue
            after, steps = rates(end), steps + 1
            met = self._first_end(contact, [s, end], [first, after], float(size))
            if met is not None:
                what, share = met
                s, lapse = self._located(contact, rates, s, first, what, share * size)
                now = now + lapse
                points = self._model.law.points
                point, limit = (what, None) if what < points else (None, LIMITS[what - points])
                break
            now, s, first = (stop if now + size >= stop else now + size), end, after
            if columns < EASY:
                size = min(1.5 * size, self.number(self._longest))
        return Leg(contact, t, now, np.array(s), point, steps, limit)
