"""A file that holds computed samples, so that an interrupted run goes on where it ended.

Its first line is the digest of the question. Each further line holds a chunk of samples: the digest
of its record, a space, and the record, JSON of the chunk's number and its samples.
"""

import json
from collections.abc import Sequence
from dataclasses import astuple
from hashlib import sha256
from pathlib import Path

from squeal.io.writing import write_text
from squeal.results.scatter import Sample
from squeal.schema import Place, read_content


def read_or_begin(path: Path, question: str) -> dict[int, list[Sample]]:
    """Read the chunks of samples that a journal holds, by their number, or begin a new journal.

    What an interrupted write left of the last line is removed from the file.

    Parameters
    ----------
    path : Path
        The journal.
    question : str
        Digest of the question whose samples are wanted.

    Raises
    ------
    InputError
        For a file that holds samples of another question, or something else.
    """
    at = Place(str(path))
    text = ""
    if path.exists():
        text = read_content(path, at).decode(errors="replace")
    chunks = {}
    # whatever shows that this is no journal of this question raises ValueError or TypeError, here
    # or in a function that is called: one refusal below serves all
    try:
        if not text:  # a new file, or one that no line was written to
            text = f"{question}\n"
        head, *lines = text.split("\n")
        if head != question:
            raise ValueError
        # behind the last line end stands nothing, or a line that was cut off. The last whole line
        # may be broken too, if its write was killed; a broken one before it is refused
        complete = lines[:-1]
        if complete and not _is_intact(complete[-1]):
            complete.pop()
            at.warn("its last line is broken; the samples of this line are computed again")
        for line in complete:
            if not _is_intact(line):
                raise ValueError
            number, samples = json.loads(_record_of(line))
            chunks[number] = [Sample(*values) for values in samples]
    except (ValueError, TypeError):
        reason = "holds no samples of this question; the name of another file is allowed"
        raise at.refuse(reason) from None
    write_text(path, "\n".join([head, *complete, ""]))
    return chunks


def append(path: Path, number: int, samples: Sequence[Sample]) -> None:
    """Write a chunk of samples with its number to the end of a journal."""
    record = json.dumps([number, [astuple(sample) for sample in samples]])
    with path.open("a", encoding="utf-8") as stream:
        stream.write(f"{_line_of(record)}\n")


def _line_of(record: str) -> str:
    """A record behind its digest, which tells whether it was changed."""
    return f"{sha256(record.encode()).hexdigest()[:16]} {record}"


def _record_of(line: str) -> str:
    """The record of a line, without its digest."""
    _, _, record = line.partition(" ")
    return record


def _is_intact(line: str) -> bool:
    """True if the digest of a line is that of its record."""
    return line == _line_of(_record_of(line))
