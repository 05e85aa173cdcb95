"""What moves the eigenvalues, or the first loss of stability: derivatives by each parameter."""

from __future__ import annotations

import cmath
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.io.writing import Answer, JsonObject, Mark, Panel, Table, in_order, number, plain

DEGREE = math.pi / 180
STEP = 0.01  # of a parameter's value: the small step whose effect is shown


class _EffectOnMode(NamedTuple):
    """What a small step of a parameter does to a mode: a row of the table.

    change: the step in words; growth_change (1/s), frequency_change (Hz): what the step adds to
    both; rank: of a long table the rows of the highest are shown.
    """

    mode: int
    frequency_hz: float
    growth_rate: float
    parameter: str
    change: str
    growth_change: float
    frequency_change: float
    rank: tuple[bool, float] = (False, 0.0)


@dataclass(frozen=True, eq=False, repr=False)
class Sensitivity(Answer):
    """Derivatives by each parameter, per unit of it, with all others held.

    Attributes
    ----------
    what : {"eigenvalues", "threshold"}
        What is differentiated.
    parameter : str
        The friction or free parameter.
    at : array (m,), float or None
        The eigenvalues, or the value of `parameter` at the first loss of stability.
    kind : str
        The verdict, or the kind of the loss.
    slopes : mapping of str to array
        Of each parameter the derivatives (m,) of the eigenvalues, not finite where two coalesce; or
        (2,) of the loss and of its frequency in Hz. Empty where stability is not lost.
    values, units : mapping
        Of the parameters.
    condition : array (m,) or None
        Condition numbers of the eigenvalues: 1 of real modes, infinite where two coalesce; NaN of
        an eigenvalue that does not solve the equations, so that its derivatives are NaN too.
    modes : array (m,) or None
        The numbers of the modes of the eigenvalues.
    note : str
        Which parameters are left out, and why.

    Examples
    --------
    >>> import squeal
    >>> one = squeal.System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
    >>> squeal.sensitivity(one).slopes["k"].imag.tolist()  # of +-i sqrt(k)
    [0.25, -0.25]
    """

    @property
    def panel(self) -> Panel:  # type: ignore[override]
        """Bars of the first loss, or of the mode that grows fastest."""
        if self.what == "threshold":
            return Panel("parameter", 2, Mark.BARS)
        return Panel("parameter", "dRe", Mark.BARS, "mode")

    what: str
    parameter: str
    at: Any
    kind: str
    slopes: Mapping[str, np.ndarray]
    values: Mapping[str, float]
    units: Mapping[str, str]
    condition: NDArray[np.float64] | None = None
    modes: NDArray[np.intp] | None = None
    note: str = ""

    def table(self) -> Table:
        """How far a small step of each parameter moves the loss of stability, or each mode.

        The fastest growing mode comes first, and of each mode the strongest effect. A step is 1 per
        cent of a parameter, 1 degree of an angle, and 1 of a parameter that is 0 and has no unit.

        Examples
        --------
        >>> import squeal
        >>> one = squeal.System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
        >>> found = squeal.sensitivity(one)
        >>> found.table().records()[0]["parameter"]  # no parameter moves the growth
        'mu'
        """
        if self.what == "threshold":
            return self._table_of_loss()
        roots = np.asarray(self.at, complex)
        upper = np.flatnonzero(roots.imag >= 0.0)  # one root of each pair, and the real roots
        by_growth = upper[np.argsort(-roots[upper].real, kind="stable")]
        rows = []
        for i in by_growth.tolist():
            for place, effect in enumerate(self._effects_on_mode(i)):  # 0 is the strongest
                # people see the rows of highest rank of a long table: first the strongest effects
                # on growing modes, then what acts on the modes that decay most slowly
                rank = (False, effect.growth_rate)
                if effect.growth_rate > 0.0:
                    rank = (True, -place)
                rows.append(effect._replace(rank=rank))
        heads = [("mode", ""), ("frequency_hz", ""), ("growth_rate", "1/s")]
        heads += [("parameter", ""), ("change", ""), ("dRe", "1/s"), ("df", "Hz")]
        title = "what a small change of a parameter does to each mode"
        nothing = "no root" if self.values else "no parameter is named"
        return Table(in_order(heads), rows, title, nothing, attrgetter("rank"))

    def _effects_on_mode(self, i: int) -> list[_EffectOnMode]:
        """What a small step of each parameter does to the mode of eigenvalue i, strongest first.

        The derivative by the parameter times the step; NaN where eigenvalues coalesce.
        """
        root = complex(self.at[i])
        assert self.modes is not None  # only those of a loss have no modes
        mode = int(self.modes[i])
        effects = []
        for name, slopes in self.slopes.items():
            step, step_text = self.step(name)
            if not step:
                continue
            slope = complex(slopes[i])
            if not cmath.isfinite(slope):
                slope = complex(math.nan, math.nan)
            effects.append(
                _EffectOnMode(
                    mode=mode,
                    frequency_hz=root.imag / math.tau,
                    growth_rate=root.real,
                    parameter=name,
                    change=step_text,
                    growth_change=step * slope.real,
                    frequency_change=step * (slope.imag / math.tau),
                )
            )
        effects.sort(key=lambda effect: _strength(effect.growth_change))
        return effects

    def _table_of_loss(self) -> Table:
        """How far a small step of each parameter moves the first loss, the strongest first.

        Where nothing is lost `slopes` is empty, and so is the table.
        """
        rows = []
        for name, slopes in self.slopes.items():
            step, step_text = self.step(name)
            if step:  # 0 of a parameter that has no small step
                # slopes (2,): of the value at which stability is lost, and of the frequency there
                value_change, frequency_change = (step * slopes).tolist()
                rows.append((name, step_text, value_change, frequency_change))
        rows.sort(key=lambda row: _strength(row[2]))
        if self.at is None:  # no row: the heads are those of eigenvalues
            head_of_change = ("dRe", "1/s")
            title = "stability is not lost: nothing moves its loss"
            if_empty = title
        else:
            head_of_change = (f"d {self.parameter}", "")
            title = f"what moves the first loss ({self.kind} at {self.parameter} = {self.at:.6g})"
            if_empty = "no other parameter"
        heads = [("parameter", ""), ("change", ""), head_of_change, ("df", "Hz")]
        return Table(in_order(heads), rows, title, if_empty)

    def step(self, name: str) -> tuple[float, str]:
        """A small step of a parameter in its unit, and in words.

        It is 1 degree of an angle, 1 per cent of another value, and 1 of a value that is 0 and has
        no unit. For a value of 0 that has a unit it is 0: the parameter has no row in the table.

        Examples
        --------
        >>> import squeal
        >>> one = squeal.System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
        >>> squeal.sensitivity(one).step("k")
        (0.04, '1 %')
        """
        if self.units[name] == "rad":
            return DEGREE, "1 degree"
        step = STEP * self.values[name]
        if not step and not self.units[name]:
            return 1.0, "1"
        return step, "1 %"

    def parts(self) -> Sequence[str | Table]:
        """The table, and which modes leave it in doubt.

        Examples
        --------
        >>> import squeal
        >>> one = squeal.System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
        >>> found = squeal.sensitivity(one)
        >>> len(found.parts())
        2
        """
        if self.condition is None or self.modes is None:  # of a threshold
            return [self.table(), self.note]
        # If a parameter has to change by the share d to reach a double root, the two eigenvalues
        # differ by about d^1/2 (Puiseux series), and their condition is about d^-1/2. Hence
        # d = 1 / condition^2; an eigenvalue is near if d is at most `STEP`
        is_near = STEP * self.condition**2 >= 1.0
        lines = []
        # one line for a conjugate pair, whose lower root has the same condition
        for i in np.flatnonzero(is_near & (np.imag(self.at) >= 0.0)).tolist():
            line = f"mode {self.modes[i]} coalesces with another one: it has no derivatives"
            if self.condition[i] < math.inf:
                line = (
                    f"mode {self.modes[i]} nearly coalesces with another one: its derivatives hold "
                    f"for changes far below {number(100 * self.condition[i] ** -2, 2)} %"
                )
            lines.append(line)
        return [self.table(), "\n".join([*lines, self.note])]

    def without(self, names: Collection[str], note: str) -> Sensitivity:
        """The sensitivity without some parameters; a note says why they are left out.

        Examples
        --------
        >>> import squeal
        >>> one = squeal.System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
        >>> list(squeal.sensitivity(one).without(["k"], "k is held").slopes)
        ['mu']
        """
        return replace(
            self,
            slopes={name: x for name, x in self.slopes.items() if name not in names},
            values={name: x for name, x in self.values.items() if name not in names},
            note=note,
        )

    def to_dict(self) -> JsonObject:
        if self.what == "threshold":
            if self.at is None:
                return {"sensitivity": None}
            loss: JsonObject = {"mu": self.at, "value": self.at, "kind": self.kind}
            loss["parameters"] = {}  # derivatives of the value at the loss
            loss["frequency_hz"] = {}  # and of the frequency there
            for name, (value_slope, frequency_slope) in self.slopes.items():
                loss["parameters"][name] = plain(float(value_slope))
                loss["frequency_hz"][name] = plain(float(frequency_slope))
            return {"sensitivity": loss}
        rows = []
        for name, slopes in self.slopes.items():
            derivatives: list[dict[str, float] | None] = []
            for slope in slopes.astype(complex).tolist():
                if cmath.isfinite(slope):
                    derivatives.append({"real": slope.real, "imag": slope.imag})
                else:
                    derivatives.append(None)
            rows.append({"parameter": name, "unit": self.units[name], "eigenvalues": derivatives})
        values = np.asarray(self.condition).tolist()  # JSON cannot say infinite
        conditions = [value if value < math.inf else None for value in values]
        return {"sensitivity": rows, "sensitivity_condition": conditions}


def _strength(change: float) -> float:
    """A key that sorts changes by their size: what is not finite first, then the largest."""
    return -float(np.nan_to_num(abs(change), nan=np.inf))
