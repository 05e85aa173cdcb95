"""One page about a brake: what was read, what grows, since when, moved by what, and how sure."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from squeal.analysis.answers import Eigenvalues, Thresholds
from squeal.analysis.check import Check, check
from squeal.analysis.sensitivity import Sensitivity
from squeal.analysis.verbs import eigenvalues, sensitivity, thresholds
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Table, number, write_text
from squeal.schema import Positive, public


@dataclass(frozen=True, eq=False, repr=False)
class Report(Answer):
    """Eigenvalues at the brake's own parameter, thresholds up to `thresholds.high`, and what moves
    both, `onset` the first loss (None where several modes are lost at once); `check` says what
    matrices are. `save` writes the page."""

    name: str
    eigenvalues: Eigenvalues
    thresholds: Thresholds
    sensitivity: Sensitivity
    onset: Sensitivity | None
    check: Check | None
    subject: Any = field(repr=False)

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """What each answer warns of, once."""
        return tuple(dict.fromkeys((*self.eigenvalues.warnings, *self.thresholds.warnings)))

    @property
    def verdict(self) -> str:
        """The verdict in a line."""
        return self.eigenvalues.conclusion

    @property
    def loss(self) -> str:
        """The first loss of stability in a line."""
        found, where = self.thresholds, " within the band" * bool(self.eigenvalues.extent)
        own, first = found.parameter, found.first
        if found.verdict in ("flutter", "divergence"):
            return f"Unstable from {own} = {number(found.low, 4)} on"
        if first is None:
            return f"No loss of stability{where} up to {own} = {number(found.high, 4)}"
        at = f" at {number(first.frequency_hz, 4)} Hz" if first.frequency_hz else ""
        return f"Stability is first lost{where} at {own} = {number(first.mu, 4)}: {first.kind}{at}"

    def table(self) -> Table:
        """The modes that grow."""
        return self.eigenvalues.growing

    def parts(self) -> Sequence[str | Table]:
        lines = self.verdict, self.eigenvalues.beside, self.loss
        return [self.name, "\n".join(filter(None, lines)), self.table()]

    def to_dict(self) -> dict[str, Any]:
        head = {"name": self.name, "verdict_line": self.verdict, "loss_line": self.loss}
        return head | {
            "eigenvalues": self.eigenvalues.to_dict(),
            "thresholds": self.thresholds.to_dict(),
            **self.sensitivity.to_dict(),
            "onset_sensitivity": self.onset and self.onset.to_dict()["sensitivity"],
            "check": self.check and self.check.to_dict(),
        }

    def save(self, path: Path | str, inputs: Sequence[Any] = ()) -> None:
        """Write the page as one HTML file without references to others; `inputs` are the files
        behind it. Raises InputError."""
        path = Path(path)
        if path.suffix != ".html":
            raise InputError(f"{path}: the name must end in .html")
        page: Any = importlib.import_module("squeal.plots.page")
        write_text(path, page.page(self, inputs))


@public
def report(
    subject: object,
    high: float = 2.0,
    band: tuple[float, float] | None = None,
    memory: Positive | None = None,
    progress: Callable[[str], None] | None = None,
) -> Report:
    """Ask a brake all that one page shows.

    Parameters
    ----------
    subject : Scene, SystemFile or TermSystem
        A system of more than 400 rows needs a band.
    high : float
        Upper end of the range of the friction or of the free parameter.
    band : (float, float), optional
        Lowest and highest frequency in Hz, of systems.
    memory, progress
        As `eigenvalues` takes them.

    Returns
    -------
    Report
        Verdict, thresholds and sensitivities; ``save("brake.html")`` writes the page.

    Raises
    ------
    InputError
        For what does not fit the subject.
    ComputationError
        If no steady sliding exists, or the system does not fit into the memory.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0})
    >>> squeal.report(pair).loss
    'Stability is first lost at mu = 0.75: flutter at 0.2251 Hz'
    """
    asked: Any = {"band": band, "memory": memory, "progress": progress}
    crossed = thresholds(subject, high, **asked)  # it refuses what the others take
    found = eigenvalues(subject, **asked)
    moved, onset = sensitivity(subject, known=found), None
    with suppress(ComputationError):  # several modes are lost at once
        onset = sensitivity(subject, of="threshold", known=crossed)
    read = None if isinstance(subject, Scene) else check(subject)
    return Report(found.name, found.with_onsets(crossed), crossed, moved, onset, read, subject)
