"""Growth rates along a line: which pair and which real root lead, and where a pair turns real."""

import numpy as np

from squeal.linear.following.line import Line
from squeal.linear.following.locate import located
from squeal.linear.following.verdicts import Lead
from squeal.linear.following.windows import Guess
from squeal.linear.growth import Growth

BUDGET = 40  # states beyond those of the search, on which growth that changes hands twice is sought


class LineRates:
    """The rates of a line, as `verdict_changes` asks for them."""

    def __init__(self, line: Line) -> None:
        self.line, self.most = line, len(line.states) + BUDGET

    def growth(self, p: float) -> Growth:
        """What grows at p."""
        return self.line.growth(p)

    def lead(self, p: float) -> Lead | None:
        """Who leads at p; a root of which there is none grows by 0."""
        state = self.line.at(p)
        if len(self.line.states) > self.most:
            return None
        z, slopes, noise = state.roots, state.slopes, state.noise
        unit = self.line.rate
        if not self.line.damped:
            half = np.sqrt(-z + 0j)
            half = np.where(half == 0, 1e-300, half)
            z, slopes, noise, unit = half, -slopes / (2 * half), noise / np.abs(2 * half), 1.0
        rates = []
        for some in (state.oscillates, ~state.oscillates):
            k = int(np.argmax(np.where(some, z.real, -np.inf)))
            grows = bool(some[k] and z[k].real > noise[k])
            rates.append(
                np.array([z[k].real, slopes[k].real, noise[k]]) * unit if grows else np.zeros(3)
            )
        value, slope, _ = rates[0] - rates[1]
        return Lead(float(value), float(slope), float(rates[0][2] + rates[1][2]))

    def meeting(self, low: float, high: float) -> tuple[float, float] | None:
        """Where a growing pair meets on the real axis, from the side on which it is one."""
        if not self.line.damped:
            return None
        sides = [p for p in (low, high) if self.line.growth(p).verdict == "flutter"]
        if not sides:
            return None
        state = self.line.at(sides[0])
        z = state.roots
        k = int(np.argmax(np.where(state.oscillates, z.real, -np.inf)))
        both = [k, int(np.argmin(np.abs(z - z[k].conj())))]
        right, left = state.right[:, both], state.left[:, both]
        guess = Guess((low + high) / 2, complex(z[k].real), right, left, True, high - low)
        found = located(self.line, guess)
        if found is None or not low - found.half <= found.value <= high + found.half:
            return None
        met = self.line.at(float(np.clip(found.value, low, high)))
        k = int(np.argmax(met.roots.real))
        if abs(met.roots[k].imag) > 2 * met.noise[k]:  # one that meets while another pair leads
            return None
        return float(found.value), found.half
