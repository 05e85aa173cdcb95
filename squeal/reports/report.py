"""The verb `report`: one page about a brake, what to change, what grows, why and how sure it is."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.io.writing import write_text
from squeal.queries.check import check
from squeal.queries.critical_speeds import CriticalSpeeds, critical_speeds
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.energy import energy
from squeal.queries.mode_paths import Paths
from squeal.queries.options import Band, Subject, upper_end
from squeal.queries.remedies.changes import Brake
from squeal.queries.remedies.cures import find_meetings
from squeal.queries.remedies.parameters import find_remedies, keep_below
from squeal.queries.sensitivity import sensitivity
from squeal.queries.sweep import eigenvalue_paths
from squeal.queries.systems.all_roots import is_small
from squeal.queries.thresholds import thresholds
from squeal.reports.findings import Findings
from squeal.reports.page import page
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sources import SystemSource, unit_of
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds
from squeal.schema import Positive, public

CHART = 1.5  # the chart's range over the parameter's own value
BESIDE = 0.03  # of its frequency: how far a mode outside of a band is followed to its onset


@dataclass(frozen=True, eq=False, repr=False)
class Report(Findings):
    """What one page says of a brake; `save` writes the page.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
    >>> report = squeal.report(pair)
    >>> round(report.thresholds.first.mu, 9)
    0.75
    """

    own_endings = (".html",)

    def save(self, path: Path | str, inputs: Sequence[Any] = (), **drawn: Any) -> None:
        """Write the page as one HTML file (.html) that needs no other one; `inputs` are the files
        behind it. With the name of a table or a figure (.csv, .png, ...) the modes that grow are
        written or drawn, as `save` of other answers does. Raises InputError.

        Examples
        --------
        >>> import squeal
        >>> from pathlib import Path
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> squeal.report(pair).save("pair.html")
        >>> Path("pair.html").read_text()[:15]
        '<!doctype html>'
        """
        path = Path(path)
        if path.suffix == ".html":
            write_text(path, page(self, inputs))
        else:
            super().save(path, **drawn)


@public
def report(
    subject: Subject,
    high: float | None = None,
    band: Band | None = None,
    memory: Positive | None = None,
    progress: Callable[[str], None] | None = None,
    parts: Mapping[str, Sequence[int]] | None = None,
    low: float | None = None,
) -> Report:
    """Compute all that one page shows of a brake.

    Parameters
    ----------
    subject : Scene, SystemFile or TermSystem
        A system of more than 400 rows needs a band.
    high : float, optional
        Upper end of the range of the friction or of the free parameter, as `thresholds` takes it.
    band : (float, float), optional
        Lowest and highest frequency in Hz, of systems.
    memory, progress
        As `eigenvalues` takes them.
    parts
        As `energy` takes them.
    low : float, optional
        Lower end of the range, of systems, at most the parameter's own value; left out, that of
        `thresholds`.

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
    'Stability is first lost at mu = 0.75: flutter at 0.2251 Hz; mu = 1 lies 33.3 % above that.'
    """
    options: Any = {"band": band, "memory": memory, "progress": progress}
    end = upper_end(subject, high)
    # the thresholds are the first answer, since they refuse some subjects that the others take
    losses = thresholds(subject, end, low, **options)
    spectrum = eigenvalues(subject, **options)
    if low is not None and spectrum.value < low:
        raise InputError(
            f"low: {low:g} is not allowed; it must be at most {spectrum.value:g}, the present "
            f"{losses.parameter}"
        )
    rotor = _critical_speeds(subject, losses, band, memory)
    # modes get the numbers of the chart before any further answer names them
    chart = _chart(losses, spectrum.value, rotor is not None)
    paths = Paths(chart)
    spectrum = paths.numbered(spectrum)
    of_modes = sensitivity(subject, known=spectrum)
    of_onset = None
    with suppress(ComputationError):  # a loss of several modes at once has no derivatives
        of_onset = sensitivity(subject, of="threshold", known=losses)
    spectrum = spectrum.with_onsets(losses)
    outside = _thresholds_outside(subject, spectrum, losses, options)
    brake = Brake(spectrum, losses, end, options)
    return Report(
        name=spectrum.name,
        eigenvalues=spectrum,
        thresholds=losses,
        sensitivity=of_modes,
        onset=of_onset,
        check=None if isinstance(subject, Scene) else check(subject),
        energy=energy(spectrum, parts),
        search=find_remedies(brake, of_modes),
        cures=find_meetings(brake, paths),
        bound=keep_below(brake, outside),
        chart=chart,
        subject=subject,
        critical=rotor,
    )


def _chart(searched: Thresholds, value: float, is_rotor: bool) -> Sweep:
    """The eigenvalue paths up to a little more than the parameter's own value, which they hold."""
    high = min(CHART * value, searched.high)
    if high <= searched.low or is_rotor:  # a rotor runs up through its speeds
        high = searched.high
    return eigenvalue_paths(searched, min(searched.low, value), max(high, value))


def _critical_speeds(
    subject: Subject, losses: Thresholds, band: Band | None, memory: Positive | None
) -> CriticalSpeeds | None:
    """The critical speeds in the range of the thresholds; None where the parameter is no speed of a
    shaft, and of complex matrices."""
    if unit_of(losses.source):
        with suppress(InputError):
            return critical_speeds(subject, losses.high, losses.low, band=band, memory=memory)
    return None


def _thresholds_outside(
    subject: Subject, spectrum: Eigenvalues, losses: Thresholds, options: Mapping[str, Any]
) -> Thresholds | None:
    """Thresholds of what grows outside of the band.

    Of a small system these are the thresholds of all its roots, of a large one those near the
    fastest mode that was seen outside. None without a band or without growth in it, where nothing
    was seen outside, and of small complex matrices, whose thresholds are searched in bands alone.

    losses: the thresholds of the band; options: band, memory and progress, as `thresholds` takes
    them.
    """
    source = spectrum.source
    # `extent` names the band; without growth in it there is nothing to keep stable, and `bound` of
    # the report, for which these thresholds are, does not ask what lies outside
    if not isinstance(source, SystemSource) or not spectrum.extent or not spectrum.unstable:
        return None
    if is_small(source.file.system):
        if not source.file.system.real:
            return None
        return thresholds(subject, losses.high, losses.low, prove=False)
    fastest = spectrum.details.get("fastest_outside")
    if not fastest:
        return None
    hertz = fastest["frequency_hz"]
    near = {**options, "band": ((1.0 - BESIDE) * hertz, (1.0 + BESIDE) * hertz)}
    return thresholds(subject, losses.high, losses.low, prove=False, **near)
