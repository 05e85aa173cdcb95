"""What a search for thresholds gives: changes of verdict and crossings of the imaginary axis."""

from dataclasses import dataclass

TIGHT = 1e-9  # of mu: an interval shorter than this has converged


@dataclass(frozen=True)
class CriticalPoint:
    """A change of verdict on the way up in mu.

    `converged`: the interval is no wider than 1e-9 of mu, and a root was seen to make the change.
    Where it is not the interval holds the change all the same: rounding leaves it more where growth
    hardly changes with mu, as at a window that almost closes.
    """

    mu: float
    kind: str  # flutter, divergence: what follows; restabilised: neither follows any more
    frequency_hz: float  # of the mode concerned, at mu; 0 where a real root is
    interval: tuple[float, float]  # bracket of mu; the point itself at a breakpoint
    converged: bool
    residual: float | None = None  # backward error of the root there, if it is known

    def __str__(self) -> str:
        return f"{self.kind} at mu = {self.mu:.9g}{_hertz(self.frequency_hz)}"


@dataclass(frozen=True)
class Crossing:
    """A pair or a real root that crosses the imaginary axis on the way up in mu."""

    mu: float
    kind: str  # flutter: a pair; divergence: a real root
    direction: str  # up: it starts to grow; down: it ceases
    frequency_hz: float  # at mu; 0 for divergence
    interval: tuple[float, float]  # bracket of mu, rounding included; the point itself at a jump
    mode: int  # by rising frequency at mu, from 1; of a coalescing pair the first
    changes_verdict: bool  # false where other modes grow all the same, and faster
    residual: float | None = None  # backward error of the root there, if it is known

    def __str__(self) -> str:
        return f"{self.kind} {self.direction} at mu = {self.mu:.9g}{_hertz(self.frequency_hz)}"


def _hertz(frequency: float) -> str:
    return f", {frequency:.6g} Hz" if frequency else ""
