"""Simulations as read back from the files that `squeal simulate` writes."""

import csv
import json
from pathlib import Path

import numpy as np

from squeal.article.records import from_dict
from squeal.errors import InputError
from squeal.io.provenance import Provenance
from squeal.plots.motion import Run
from squeal.simulation.observers import Event


def read_run(summary_file: Path, history_file: Path) -> Run:
    """Read the JSON summary and the CSV history of `squeal simulate`.

    Raises InputError if the summary lacks events, shares or extrema.
    """
    content = json.loads(summary_file.read_text(encoding="utf-8"))
    for key in ("events", "shares", "extrema"):
        if key not in content:
            raise InputError(f"{summary_file}: {key}: missing; the scene's outputs must name it")
    with history_file.open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    columns = zip(*rows, strict=True)
    history = {}
    for head, column in zip(header, columns, strict=True):
        name = head.partition(" [")[0]  # without its unit
        if name == "state":
            history[name] = np.array(column)
        else:
            history[name] = np.array([float(entry) if entry else np.nan for entry in column])
    extrema = {}
    for signal, ends in content["extrema"].items():
        extrema[signal] = None if ends is None else (ends[0], ends[1])
    return Run(
        name=summary_file.stem,
        model=content["model"],
        shares=content["shares"],
        stop=content["final"]["t"],
        events=tuple(Event(each["t"], each["from"], each["to"]) for each in content["events"]),
        extrema=extrema,
        provenance=from_dict(Provenance, content["provenance"]),
        history=history,
    )
