"""Results: answers that print, draw and save themselves, and files written whole or not at all.

A record derives from `Answer` and says in `table` what its columns are, each once: name, unit and
value. Text, HTML, rows, data frames and files follow; the command line prints the same tables.
"""

import csv
import html
import importlib
import json
import math
import os
import shutil
import tempfile
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from copy import deepcopy
from dataclasses import dataclass
from enum import Enum
from io import TextIOWrapper
from operator import itemgetter
from pathlib import Path
from secrets import token_hex
from typing import IO, Any, ClassVar, TypeAlias

from squeal.errors import BEYOND, ComputationError, InputError, visible

SHOWN = 40  # rows that the command line prints
FEW = 10  # rows in a representation
TABLES = (".csv", ".json")
FIGURES = (".pdf", ".png", ".svg")
TEMPORARY = ".squeal-"  # begins the names of files and folders that are removed at the end
JsonObject: TypeAlias = dict[str, Any]
"""An object as JSON holds it: values by key."""


def copied_attributes(source: object, names: str) -> dict[str, Any]:
    """Copies of some attributes of an object, by their names, which blanks separate in `names`."""
    return {name: deepcopy(getattr(source, name)) for name in names.split()}


@contextmanager
def _refused_by_system(path: Path) -> Iterator[None]:
    """Raise InputError where the system does not write to a path, as on a full disc."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None


def write_whole(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Write a file under another name and rename it when it is complete.

    It gets the permissions of a file that it replaces. write: is called with the open file. Raises
    InputError if the file cannot be written or `path` is a pipe or a device; no unfinished file is
    left then.
    """
    target = Path(os.path.realpath(path))  # behind a link, also one to no file
    # 17 characters: with a suffix to `path` the name could become longer than systems allow
    unfinished = target.with_name(f".{token_hex(8)}")
    with _refused_by_system(path):
        if target.exists() and not target.is_file():
            raise OSError("is no plain file")
        try:
            with open(unfinished, "xb") as stream:
                write(stream)
            _replace(target, unfinished)
        except BaseException:
            unfinished.unlink(missing_ok=True)
            raise


def _replace(target: Path, complete: Path) -> None:
    """Rename a complete file to `target`, with the permissions of a file that stands there."""
    if target.exists():
        shutil.copymode(target, complete)
    os.replace(complete, target)


@contextmanager
def _claimed(folder: Path) -> Iterator[None]:
    """Refuse to write into a folder that is not empty, or into which another process writes.

    Folders of `whole_folder` in it do not count. Raises InputError.
    """
    folder.mkdir(parents=True, exist_ok=True)
    claim = folder / f"{TEMPORARY}claim"
    try:
        claim.touch(exist_ok=False)
    except FileExistsError:
        raise InputError(f"{folder}: another process writes into it") from None
    try:
        if not all(entry.name.startswith(TEMPORARY) for entry in folder.iterdir()):
            raise InputError(f"{folder}: is not empty any more; a new or empty folder is allowed")
        yield
    finally:
        claim.unlink()


@contextmanager
def whole_folder(folder: Path, is_new: bool = False) -> Iterator[Path]:
    """A temporary folder, whose files and folders move to `folder` at the end of the context.

    `folder` may exist; files of the same names are replaced. If it `is_new` it must be empty, and
    of several processes one writes into it. After an error in the context nothing moves. Raises
    InputError.
    """
    existing = next(parent for parent in (folder, *folder.parents) if parent.is_dir())
    with (
        _refused_by_system(folder),
        tempfile.TemporaryDirectory(dir=existing, prefix=TEMPORARY) as temporary,
    ):
        root = Path(temporary)
        try:
            yield root
        except InputError as error:  # of a file there, whose name is not what was typed
            raise InputError(str(error).replace(temporary, str(folder))) from None
        moves = []  # what is complete, folders before what is in them, and where it belongs
        for complete in [root, *sorted(root.rglob("*"))]:
            target = folder / complete.relative_to(root)
            if target.exists():
                _refuse_other_kind(target, complete)
            moves.append((complete, target))
        with _claimed(folder) if is_new else nullcontext():
            for complete, target in moves:
                if complete.is_dir():
                    target.mkdir(parents=True, exist_ok=True)
                else:
                    _replace(target, complete)


def _refuse_other_kind(target: Path, complete: Path) -> None:
    """Refuse to put a file in the place of a folder or a device, or a folder in that of a file.

    Raises InputError.
    """
    if complete.is_dir() and not target.is_dir():
        raise InputError(f"{target}: cannot be written: is no folder")
    if complete.is_file() and not target.is_file():
        raise InputError(f"{target}: cannot be written: is no plain file")


def write_text(path: Path, text: str) -> None:
    """Write a text file whole, in UTF-8."""
    write_whole(path, lambda stream: stream.write(text.encode()))


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """A CSV file with a header line; None and NaN become empty fields."""

    def write(stream: IO[bytes]) -> None:
        text = TextIOWrapper(stream, "utf-8", newline="")
        table = csv.writer(text, lineterminator="\n")
        table.writerow(header)
        for row in rows:
            table.writerow(map(plain, row))
        text.detach()  # writes what it holds, and leaves the stream open

    write_whole(path, write)


def plain(value: object) -> object:
    """None for NaN, a float of Python for one of NumPy, whose digits depend on NumPy's options."""
    if not isinstance(value, float):
        return value
    if math.isnan(value):
        return None
    return float(value)


def to_json(value: object) -> str:
    """JSON text. Raises ComputationError if a number is not finite, which JSON cannot say."""
    try:
        return json.dumps(value, allow_nan=False, indent=1)
    except ValueError:
        raise ComputationError(f"a result is not a finite number; {BEYOND}") from None


def remaining(begun: float, done: int, count: int) -> str:
    """How long the rest of `count` things may take, in words.

    begun: when the first was begun (s, of `time.monotonic`); done: how many are done since.
    """
    seconds_each = (time.monotonic() - begun) / max(done, 1)
    seconds = seconds_each * (count - done)
    if seconds < 100:
        return f"about {seconds:.2g} s remain"
    return f"about {seconds / 60:.2g} min remain"


def number(value: float, digits: int = 6) -> str:
    """A number in so many digits, never "-0", and without a power of ten below a million.

    >>> number(-0.0), number(2 / 3), number(2 / 3, 3), number(11345.6, 4), number(1134560.0, 4)
    ('0', '0.666667', '0.667', '11350', '1.135e+06')
    """
    text = f"{value + 0.0:.{digits}g}"
    if "e+" in text and abs(value) < 1e6:
        return f"{float(text):.0f}"
    return text


def with_known_digits(value: float, low: float, high: float) -> str:
    """A value in as many digits as the interval from low to high leaves, at most twelve.

    >>> with_known_digits(0.7071067811865, 0.29, 1.13)
    '0.7'
    >>> with_known_digits(0.7071067811865, 0.70710677, 0.70710679)
    '0.70710678'
    """
    error = max(high - value, value - low)
    if not error > 0.0 or not value:
        return number(value, 12)
    digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(error)) + 1
    return number(value, min(max(digits, 1), 12))


@dataclass(frozen=True)
class Column:
    """A column of a table: its name, its unit ("" for none) and its value in a row.

    Parameters
    ----------
    name : str
        The name, in files and records.
    unit : str
        The unit, "" for none.
    value : callable, optional
        Gives the value from a row's record; left out, the attribute of that name is it.
    shown : callable, optional
        Gives the text that people read from a row's record.
    hidden : bool
        Whether the column stands in files and records alone.
    words : str
        The head for people instead of the name.
    percent : bool
        Whether it is a share, which people read in %.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> Column("growth_rate", "1/s").of(SimpleNamespace(growth_rate=3.0))
    3.0
    """

    name: str
    unit: str = ""
    value: Callable[[Any], Any] | None = None
    shown: Callable[[Any], str] | None = None
    hidden: bool = False
    words: str = ""
    percent: bool = False

    def of(self, row: object) -> Any:
        """The value in a row.

        Examples
        --------
        >>> Column("last", value=lambda row: row[-1]).of((1.0, 2.0))
        2.0
        """
        if self.value is None:
            return getattr(row, self.name)
        return self.value(row)

    def cell(self, row: object) -> str:
        """The value for people.

        Examples
        --------
        >>> Column("share", value=lambda row: row[0], percent=True).cell((0.25,))
        '25'
        """
        if self.shown is not None:
            return self.shown(row)
        value = plain(self.of(row))
        if value is None:
            return "-"
        if isinstance(value, bool):
            return "yes" if value else "no"
        if not isinstance(value, float):
            return str(value)
        if self.percent:
            return number(100 * value)
        return number(value)

    @property
    def head(self) -> str:
        """The name for people, with its unit."""
        if self.words:
            return self.words
        parts = self.name.removesuffix("_hz").split("_")
        is_symbol = min(map(len, parts)) <= 2  # R_n stays R_n
        words = self.name if is_symbol else " ".join(parts)
        unit = self.unit
        if not unit and self.name.endswith("_hz"):
            unit = "Hz"
        elif not unit and self.percent:
            unit = "%"
        if unit:
            return f"{words}, {unit}"
        return words


def unit_word(unit: str) -> str:
    """A unit as columns name it, "" for a number without one."""
    return "" if unit == "1" else unit


def columns(names: str) -> tuple[Column, ...]:
    """Columns without a unit that are attributes of a row; shares are marked by a % at the end."""
    return tuple(Column(name.rstrip("%"), percent="%" in name) for name in names.split())


def in_order(heads: Iterable[Sequence[str]]) -> list[Column]:
    """Columns of a table whose rows are tuples: name and unit of each, in the order of values."""
    return [Column(name, unit, itemgetter(k)) for k, (name, unit) in enumerate(heads)]


def aligned_text(rows: Sequence[Sequence[str]], right: bool = True) -> str:
    """Rows of texts as columns of one width each, the first to the left.

    right: whether all columns but the first are aligned to the right.
    """
    return "\n".join(_aligned_lines(rows, right))


def _aligned_lines(rows: Sequence[Sequence[str]], right: bool) -> list[str]:
    """The lines of `aligned_text`, one a row."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for first, *others in rows:
        cells = ["", first.ljust(widths[0])]
        for cell, width in zip(others, widths[1:], strict=True):
            cells.append(cell.rjust(width) if right else cell.ljust(width))
        lines.append("  ".join(cells).rstrip())
    return lines


@dataclass(frozen=True, eq=False, repr=False)
class Table:
    """Columns and the records that they take their values from.

    Parameters
    ----------
    columns : sequence of Column
        What stands in each column.
    rows : sequence
        The records, one a row.
    title : str
        Stands above the table.
    nothing : str
        Stands in place of a table without records.
    rank : callable
        The importance of a record: of a long table people read the rows of the greatest one, among
        equal ones the rows nearest to either end.

    Examples
    --------
    >>> import squeal
    >>> shares = squeal.Table([squeal.Column("share", value=lambda row: row)], [0.25, 0.75])
    >>> shares.records()
    [{'share': 0.25}, {'share': 0.75}]
    """

    columns: Sequence[Column]
    rows: Sequence[Any]
    title: str = ""
    nothing: str = ""
    rank: Callable[[Any], Any] = lambda _: 0

    def _shown_rows(self, most: int) -> list[int]:
        """The indices, ascending, of the rows that are shown to people: at most so many."""
        count = len(self.rows)

        def importance(index: int) -> tuple[Any, int, int]:
            from_end = min(index, count - 1 - index)
            return self.rank(self.rows[index]), -from_end, -index

        order = sorted(range(count), key=importance, reverse=True)
        return sorted(order[:most])

    def _cells(self, indices: Sequence[int]) -> list[list[str]]:
        """The heads of the columns for people, then the cells of the rows with some indices."""
        shown = [column for column in self.columns if not column.hidden]
        lines = [[column.head for column in shown]]
        for index in indices:
            lines.append([column.cell(self.rows[index]) for column in shown])
        return lines

    def text(self, most: int = SHOWN) -> str:
        """The table for people, with at most `most` rows, those of the highest rank.

        They keep their order; a line stands for the rows that are left out between them.

        Examples
        --------
        >>> import squeal
        >>> table = squeal.Table([squeal.Column("speed", "m/s", lambda row: row)], [1.0, 2.0, 3.0])
        >>> print(table.text(most=2))
          speed, m/s
          1
          ... 1 more rows (all with --json)
          3
        """
        if not len(self.rows):
            return self.nothing or self.title
        indices = self._shown_rows(most)
        head, *row_lines = _aligned_lines(self._cells(indices), right=True)
        lines = [head]
        if self.title:
            lines.insert(0, self.title)

        def leave_out(count: int) -> None:
            """Say that `count` rows are left out here."""
            if count:
                lines.append(f"  ... {count} more rows (all with --json)")

        following = 0  # the row after the last one shown
        for index, line in zip(indices, row_lines, strict=True):
            leave_out(index - following)
            lines.append(line)
            following = index + 1
        leave_out(len(self.rows) - following)
        return "\n".join(lines)

    def html(self, most: int = FEW) -> str:
        """The table for a notebook.

        Examples
        --------
        >>> import squeal
        >>> squeal.Table([squeal.Column("speed", "m/s", lambda row: row)], [1.5]).html()
        '<table><tr><th>speed, m/s</th></tr><tr><td>1.5</td></tr></table>'
        """
        if not len(self.rows):
            return _paragraph(self.nothing or self.title)
        head, *rows = self._cells(self._shown_rows(most))
        body = _html_row(head, "th")
        for row in rows:
            body += _html_row(row, "td")
        omitted = len(self.rows) - most
        omission = _paragraph(f"{omitted} more rows") if omitted > 0 else ""
        return f"{_paragraph(self.title)}<table>{body}</table>{omission}"

    def records(self) -> list[JsonObject]:
        """A mapping of column names to values for each row.

        Examples
        --------
        >>> import squeal
        >>> squeal.Table([squeal.Column("speed", "m/s", lambda row: row)], [1.5]).records()
        [{'speed': 1.5}]
        """
        records = []
        for row in self.rows:
            records.append({column.name: plain(column.of(row)) for column in self.columns})
        return records

    def save(self, path: Path | str) -> None:
        """Write the table as CSV or JSON, by the end of the name.

        The CSV head reads "name [unit]"; the JSON holds `units` and a mapping for each of the
        `rows`. Raises InputError.

        Examples
        --------
        >>> import squeal
        >>> from pathlib import Path
        >>> table = squeal.Table([squeal.Column("speed", "m/s", lambda row: row)], [1.5])
        >>> table.save("speeds.csv")
        >>> Path("speeds.csv").read_text().splitlines()
        ['speed [m/s]', '1.5']
        """
        path = Path(path)
        units = {column.name: column.unit for column in self.columns}
        if path.suffix == ".json":
            write_text(path, to_json({"units": units, "rows": self.records()}) + "\n")
        elif path.suffix == ".csv":
            heads = []
            for name, unit in units.items():
                heads.append(f"{name} [{unit}]" if unit else name)
            write_csv(path, heads, [list(record.values()) for record in self.records()])
        else:
            raise InputError(f"{path}: the name must end in .csv or .json")


def _paragraph(text: str) -> str:
    """A paragraph in HTML; nothing of no text."""
    if not text:
        return ""
    return f"<p>{html.escape(text)}</p>"


def _html_row(cells: Sequence[str], tag: str) -> str:
    """A row of a table in HTML; tag: th of a head, else td."""
    row = ""
    for cell in cells:
        row += f"<{tag}>{html.escape(cell)}</{tag}>"
    return f"<tr>{row}</tr>"


class Mark(Enum):
    """How a panel shows the rows of a table."""

    POINTS = "points"
    LINES = "lines"
    STEPS = "steps"
    BARS = "bars"


@dataclass(frozen=True)
class Panel:
    """What one panel shows of an answer's table: column y over column x, by name or by index.

    each: the column whose values tell lines apart, one line a value; bars are shown of its first
    value.
    """

    x: str | int
    y: str | int
    mark: Mark = Mark.POINTS
    each: str = ""


class Answer(ABC):
    """What a question is answered with. Subclasses are records with a `table`.

    Examples
    --------
    >>> import squeal
    >>> mass = squeal.System([[1.0]], [[0.2]], [[4.0]], name="mass")  # -0.1 +- 1.9975i
    >>> answer = squeal.eigenvalues(mass)
    >>> isinstance(answer, squeal.Answer), len(answer.to_records())
    (True, 2)
    """

    warnings: tuple[str, ...] = ()  # what a user should know before using the answer
    panel: ClassVar[Panel]
    """What one panel shows; none of maps, conditions and energy over a sweep, drawn as they are."""
    grid: ClassVar[tuple[str | int, ...]] = ()
    """The columns, by name or by index, that are the axes of an array of the answer: no two rows
    that count have the same values in all of them."""
    own_endings: ClassVar[tuple[str, ...]] = ()
    """Endings of names that `save` of a subclass takes besides those of tables and figures."""

    @abstractmethod
    def table(self) -> Table:
        """The columns and rows of the answer.

        Examples
        --------
        >>> import squeal
        >>> mass = squeal.System([[1.0]], [[0.2]], [[4.0]], name="mass")  # -0.1 +- 1.9975i
        >>> [column.head for column in squeal.eigenvalues(mass).table().columns][:3]
        ['mode', 'real, 1/s', 'imag, rad/s']
        """

    def parts(self) -> Sequence[str | Table]:
        """What stands under each other for people: lines of text and tables.

        Examples
        --------
        >>> import squeal
        >>> mass = squeal.System([[1.0]], [[0.2]], [[4.0]], name="mass")  # -0.1 +- 1.9975i
        >>> print(squeal.eigenvalues(mass).parts()[0])
        mass
        Stable
        """
        return [self.table()]

    @abstractmethod
    def to_dict(self) -> JsonObject:
        """The answer as the JSON object that the command line prints.

        Examples
        --------
        >>> import squeal
        >>> mass = squeal.System([[1.0]], [[0.2]], [[4.0]], name="mass")  # -0.1 +- 1.9975i
        >>> document = squeal.eigenvalues(mass).to_dict()
        >>> document["verdict"], document["count"], document["certified"]
        ('stable', 2, True)
        """

    def text(self, most: int = SHOWN) -> str:
        """The answer for people, with at most so many rows of each table.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> print(squeal.thresholds(pair).text().splitlines()[0])
        pair: at mu = 0: marginal
        """
        texts = []
        for part in self.parts():
            text = part.text(most) if isinstance(part, Table) else part
            if text:
                texts.append(text)
        return visible("\n\n".join(texts))

    def __repr__(self) -> str:
        return self.text(FEW)

    def _repr_html_(self) -> str:
        """The answer for a notebook, which calls it by this name."""
        texts = []
        for part in self.parts():
            if isinstance(part, Table):
                texts.append(part.html())
            elif part:
                lines = "<br>".join(html.escape(part).split("\n"))
                texts.append(f"<p>{lines}</p>")
        return "".join(texts)

    def to_records(self) -> list[JsonObject]:
        """The rows of the table, each a mapping of column names to values.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> [record] = squeal.thresholds(pair).to_records()
        >>> record["kind"], round(record["mu"], 9)
        ('flutter', 0.75)
        """
        return self.table().records()

    def to_dataframe(self) -> Any:
        """The table's rows as a :class:`pandas.DataFrame`. Raises InputError without pandas.

        Examples
        --------
        >>> import squeal
        >>> mass = squeal.System([[1.0]], [[0.2]], [[4.0]], name="mass")  # -0.1 +- 1.9975i
        >>> squeal.eigenvalues(mass).to_dataframe()["damping_ratio"].round(9).tolist()
        [0.05, 0.05]
        """
        try:
            pandas = importlib.import_module("pandas")
        except ImportError:
            raise InputError(
                "pandas is not installed (pip install pandas); to_records() does without"
            ) from None
        names = [column.name for column in self.table().columns]
        return pandas.DataFrame.from_records(self.to_records(), columns=names)

    def to_xarray(self) -> Any:
        """The table's columns as a `xarray.Dataset` over the axes of a sweep, a map or a motion.

        Of rows with the same values on all axes the first counts: of a pair of roots that with
        Im lambda > 0. Raises InputError for other answers, and without xarray.

        Examples
        --------
        >>> import squeal
        >>> mass = squeal.System([[1.0]], [[0.2]], [[4.0]], name="mass")  # -0.1 +- 1.9975i
        >>> try:
        ...     squeal.eigenvalues(mass).to_xarray()  # a sweep, a map and a motion have axes
        ... except squeal.InputError as error:
        ...     print(error)
        to_xarray: Eigenvalues has no axes; to_dataframe has all
        """
        if not self.grid:
            raise InputError(f"to_xarray: {type(self).__name__} has no axes; to_dataframe has all")
        frame = self.to_dataframe()
        axes = []
        for axis in self.grid:  # the name of a column, or its index where names vary
            axes.append(axis if isinstance(axis, str) else frame.columns[axis])
        frame = frame.dropna(subset=axes).drop_duplicates(axes).set_index(axes)
        try:
            return frame.to_xarray()
        except ImportError:
            raise InputError(
                "xarray is not installed (pip install xarray); to_dataframe() does without"
            ) from None

    def save(self, path: Path | str, **drawn: Any) -> None:
        """Write the table as CSV or JSON, or the figure as PDF, PNG or SVG, by the end of the name.

        drawn: what `plot` takes for whole figures, such as shape=3. Raises InputError.

        Examples
        --------
        >>> import squeal
        >>> from pathlib import Path
        >>> mass = squeal.System([[1.0]], [[0.2]], [[4.0]], name="mass")  # -0.1 +- 1.9975i
        >>> squeal.eigenvalues(mass).save("roots.csv")
        >>> Path("roots.csv").read_text().splitlines()[0]
        'mode,real [1/s],imag [rad/s],frequency_hz,damping_ratio,residual,condition'
        """
        suffix = Path(path).suffix
        if suffix in TABLES:
            self.table().save(path)
            return
        if suffix not in FIGURES:
            allowed = ", ".join([*self.own_endings, *TABLES, *FIGURES])
            raise InputError(f"{path}: the name must end in one of {allowed}")
        from squeal.plots.answers import draw  # only what draws loads it

        draw(self, Path(path), **drawn)

    def plot(self, ax: Any = None, **style: Any) -> Any:
        """Draw the answer and return its first Axes.

        Without `ax` the whole figure is drawn, and pyplot shows it. With `ax`, or with options of
        Matplotlib's artists (`color="k"`), a single panel with the columns of the table is drawn.

        Whole figures take these options: eigenvalues of a system with coordinates `shape`, the
        number of the mode to draw; a sweep `damping` for damping ratios over frequency, and beside
        it `thresholds` and `width="column"` for one column of a paper; a motion `scene`.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> squeal.sweep(pair, [0.0, 0.5, 1.0]).plot().get_ylabel()
        'frequency [Hz]'
        """
        from squeal.plots.answers import plot

        return plot(self, ax, **style)
