"""Results as rows, for pandas and for anything else that takes tables."""

from dataclasses import asdict, is_dataclass
from typing import Any

from squeal.analysis.advice import Advice
from squeal.analysis.eigenvalues import Analysis
from squeal.analysis.modes import ModeSweep
from squeal.analysis.scatter import Scatter
from squeal.analysis.thresholds import CriticalFriction
from squeal.errors import InputError
from squeal.linear import Spectrum
from squeal.simulation import Simulation


def to_records(result: Any) -> list[dict[str, Any]]:
    """The rows of a result: eigenvalues, thresholds, levers, samples, or records in a sequence.

    Takes an Analysis or Spectrum (a row an eigenvalue), what sweep_mu gives (a mu and an
    eigenvalue), a CriticalFriction (a threshold), an Advice (a parameter), a Scatter (a sample), a
    ModeSweep (a value of the parameter and a mode), a Simulation with a history (a time), or a
    sequence of records such as unstable modes. Raises InputError for anything else.
    """
    if isinstance(result, Simulation):
        if result.history is None:
            raise InputError("to_records: history: missing; the scene's outputs must name it")
        columns = {name: values.tolist() for name, values in result.history.items()}
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    if isinstance(result, list) and result and all(map(_of_sweep, result)):
        return [
            {"mu": mu, "verdict": one.judgement.verdict} | row
            for mu, one in result
            if one is not None
            for row in to_records(one)
        ]
    if isinstance(result, Analysis):
        return to_records(result.spectrum)
    if isinstance(result, Spectrum):
        return [e.to_dict() for e in result.eigenvalues]
    if isinstance(result, CriticalFriction):
        return [asdict(point) for point in result.points]
    if isinstance(result, Advice):
        return [lever.to_record() for lever in result.levers]
    if isinstance(result, Scatter):
        n = len(result.critical)
        pairs = enumerate(result.critical.tolist(), 1)
        return [{"critical": mu, "share": i / n} for i, mu in pairs]
    if isinstance(result, ModeSweep):
        return [
            {result.parameter: mu, "mode": 1 + k // 2, "real": v.real, "imag": v.imag}
            for mu, row in zip(result.mus.tolist(), result.values, strict=True)
            for k, v in enumerate(row.tolist())
        ]
    if isinstance(result, list | tuple) and all(map(is_dataclass, result)):
        return [asdict(one) for one in result]
    raise InputError(
        f"to_records: {type(result).__name__} is not allowed; it must be an Analysis, Spectrum, "
        "CriticalFriction, Advice, Scatter, ModeSweep, Simulation, what sweep_mu gives or a "
        "sequence of records"
    )


def _of_sweep(entry: Any) -> bool:
    pair = isinstance(entry, tuple) and len(entry) == 2
    return pair and (entry[1] is None or isinstance(entry[1], Analysis))


def to_dataframe(result: Any) -> Any:
    """The rows of `to_records` as a pandas.DataFrame. Raises InputError without pandas too."""
    rows = to_records(result)
    try:
        import pandas  # type: ignore[import-untyped]
    except ImportError:
        raise InputError(
            "to_dataframe: pandas is not installed; install it, or use to_records"
        ) from None
    return pandas.DataFrame.from_records(rows)
