"""Export a topic of a bag as a table: CSV, or Parquet with the library pyarrow.

A table has one row for each message. Its columns are those of a notebook's data frames (``introspect/columns.py``), except that
each element of an array has its own column: ``ranges[7]``, ``transforms[0].transform.translation.x``. Byte arrays, such as
images, are left out. The bag is read in batches. It is read twice for Parquet, or if its messages contain arrays, because the
columns then depend on all messages.
"""

from __future__ import annotations

import contextlib
import csv
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, TextIO

from minirospy.base import private_files
from minirospy.base.errors import BagError, BagFormatError, MessageException, NotFoundError, UsageError
from minirospy.base.installation import install_command
from minirospy.core.bag.base import BagReader
from minirospy.core.bag.records import Connection
from minirospy.introspect.bags import class_of_connection, naming_full_disk, open_reader
from minirospy.introspect.columns import MAX_COLUMNS, Column, Kind, columns, leaves

__all__ = ["FORMATS", "Exported", "export", "file_name"]

FORMATS = ("csv", "parquet")
MAX_BATCH = 2_000  # maximum number of messages per batch
MAX_CELLS = 8_000_000  # maximum number of table cells per batch; each takes at least one byte of its message
_MAX_ELEMENTS = 10_000  # maximum number of array elements that get separate columns
_SECOND = 10**9
_MAX_INT64 = (1 << 63) - 1


class Exported(NamedTuple):
    """An exported table: its file, its numbers of rows and columns, and the omitted fields."""

    path: str
    rows: int
    columns: int
    left_out: Sequence[str]


class _Batch(NamedTuple):
    """Consecutive rows of a table: receive times in nanoseconds, and the columns by name."""

    times: list[int]
    columns: dict[str, Column]


def file_name(bag: str, topic: str, format_: str) -> str:
    """Return the file name for a topic's table: ``run_camera_info.csv`` for the topic /camera/info in run.bag."""
    stem = os.path.splitext(os.path.basename(bag))[0]
    return f"{stem}_{re.sub(r'[^A-Za-z0-9]+', '_', topic).strip('_') or 'topic'}.{format_}"


def export(
    bag: str,
    topics: Sequence[str],
    folder: str,
    format_: str,
    *,
    force: bool = False,
    warn: Callable[[str], object] = lambda line: None,
    step: Callable[[int], object] = lambda done: None,
) -> list[Exported]:
    """Write one table per topic into ``folder``, and return the tables. Without ``topics``, export all topics.

    ``step`` is called with the number of message bytes read so far. ``force``: overwrite existing files. Raise UsageError if a
    file exists or the format is unknown, NotFoundError if a topic is not in the bag, BagError if the bag is invalid or the
    library is missing, OSError if a file cannot be read or written. An incomplete file is removed.
    """
    if format_ not in FORMATS:
        raise UsageError(f"the format is {' or '.join(FORMATS)}, not '{format_[:20]}'")
    if format_ == "parquet":
        _import_pyarrow()
    done = 0

    def add(count: int) -> None:
        nonlocal done
        done += count
        step(done)

    with open_reader(bag) as reader:
        reader.prepare()
        known = {each.topic for each in reader.connections.values()}
        chosen = [_known(topic, known) for topic in topics] or sorted(known)
        targets = {
            topic: os.path.join(folder, file_name(bag, topic, format_)) for topic in dict.fromkeys(chosen)
        }
        # Some file systems do not distinguish upper and lower case, so compare casefolded names.
        if len({target.casefold() for target in targets.values()}) < len(targets):
            raise UsageError("two of these topics have the same file name: export them into two folders")
        for target in targets.values():
            if os.path.lexists(target) and not force:
                raise UsageError(f"{target} exists already: remove it, or add -f")
        return [_export_topic(reader, topic, target, format_, warn, add) for topic, target in targets.items()]


def _known(topic: str, known: set[str]) -> str:
    for name in (topic, f"/{topic}"):
        if name in known:
            return name
    raise NotFoundError("topic", topic, known, f"the bag has {', '.join(sorted(known)) or 'no topic'}")


def _export_topic(
    reader: BagReader,
    topic: str,
    target: str,
    format_: str,
    warn: Callable[[str], object],
    add: Callable[[int], None],
) -> Exported:
    connections = [each for each in reader.connections.values() if each.topic == topic]
    types = sorted({each.type for each in connections})
    if len(types) > 1:
        raise BagError(f"topic {topic} has messages of several types: {', '.join(types)}")
    definitions = {(each.md5sum, each.definition): each for each in connections}
    classes = [class_of_connection(each, warn) for each in definitions.values()]
    message_class = classes[0]
    md5sums = sorted({each._md5sum for each in classes})
    if len(md5sums) > 1:
        raise BagError(
            f"topic {topic} has messages of several definitions of {types[0]}, with the md5sums {', '.join(md5sums)}"
        )
    fields = list(leaves(message_class))
    is_fixed = format_ == "csv" and not any(field.type.endswith("]") for field in fields)
    left_out = [
        field.path
        for field in fields
        if field.type.partition("[")[0] in ("uint8", "char") and "[" in field.type
    ]

    schema = _Schema(topic)
    if is_fixed:
        schema.columns = {_field_name(field.path): _Cells() for field in fields}
    else:
        for batch in _batches(reader, connections, message_class, lambda count: add(0), MAX_BATCH):
            schema.widen(batch)
    partial = f"{target}.active"
    rows = 0
    try:
        with naming_full_disk(target), _writer(format_, partial, schema) as writer:
            most = min(MAX_BATCH, MAX_CELLS // (len(schema.columns) + 1))
            for batch in _batches(reader, connections, message_class, add, most):
                writer.write(batch)
                rows += len(batch.times)
        private_files.replace_file(partial, target)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(partial)
        raise
    return Exported(target, rows, len(schema.columns) + 1, left_out)


def _batches(
    reader: BagReader,
    connections: Sequence[Connection],
    message_class: Any,
    add: Callable[[int], None],
    most: int,
) -> Iterator[_Batch]:
    topic = connections[0].topic
    times: list[int] = []
    messages: list[object] = []
    size = 0
    largest = 0  # bytes of the batch's largest message: an upper limit for the number of cells per row
    for stored in reader.messages([each.id for each in connections]):
        largest = max(largest, len(stored.body))
        if times and (len(times) == most or (len(times) + 1) * largest > MAX_CELLS):
            yield _batch(topic, times, messages)
            add(size)
            times, messages, size, largest = [], [], 0, len(stored.body)
        message = message_class()
        try:
            message.deserialize(stored.body)
        except MessageException as error:
            raise BagFormatError(
                f"a message on {stored.connection.topic} does not match its definition: {error}"
            ) from error
        times.append(stored.time)
        messages.append(message)
        size += len(stored.body)
    if times:
        yield _batch(topic, times, messages)
        add(size)


def _batch(topic: str, times: list[int], messages: list[object]) -> _Batch:
    found: dict[str, Column] = {}
    for name, column in _flat(columns(messages)):
        found[_field_name(name)] = column
        _check_width(topic, len(found))
    return _Batch(times, found)


def _check_width(topic: str, width: int) -> None:
    if width > MAX_COLUMNS:
        raise BagError(f"topic {topic} has too many columns for a table: more than {MAX_COLUMNS:,}")


def _field_name(name: str) -> str:
    """Return the column name for a field. The name ``time`` is reserved for the receive times."""
    return "message.time" if name == "time" else name


def _flat(found: Sequence[Column], prefix: str = "") -> Iterator[tuple[str, Column]]:
    """Yield (column name, column), with a separate column for each array element."""
    for column in found:
        name = prefix + column.name
        first = next((value for value in column.values if value is not None), None)
        if isinstance(first, bytes):
            continue
        if isinstance(first, list | tuple):
            yield from _elements(name, column.values)
        elif column.kind is Kind.PLAIN and hasattr(type(first), "to_nsec"):
            kind = Kind.TIME if hasattr(type(first), "to_time") else Kind.DURATION
            yield (
                name,
                Column(name, kind, [None if each is None else each.to_nsec() for each in column.values]),
            )
        else:
            yield name, Column(name, column.kind, column.values)


def _elements(name: str, arrays: Sequence[Sequence[object] | None]) -> Iterator[tuple[str, Column]]:
    longest = min(max((len(each) for each in arrays if each is not None), default=0), _MAX_ELEMENTS)
    for index in range(longest):
        values = [each[index] if each is not None and index < len(each) else None for each in arrays]
        present = [value for value in values if value is not None]
        element = f"{name}[{index}]"
        if not hasattr(type(present[0]), "_slot_types"):
            yield from _flat([Column(element, Kind.PLAIN, values)])
            continue
        for path, column in _flat(columns(present), f"{element}."):
            cells = iter(column.values)
            yield path, Column(path, column.kind, [None if each is None else next(cells) for each in values])


class _Cells:
    """The kind of a column, and the types of its values in all batches."""

    def __init__(self) -> None:
        self.kind = Kind.PLAIN
        self.types: set[type] = set()
        self.is_large = False  # set if a value exceeds a signed 64-bit integer

    def widen(self, column: Column) -> None:
        """Add the types in a batch's values to the known types."""
        self.kind = column.kind
        self.types |= {*map(type, column.values)} - {type(None)}
        if int in self.types and not self.is_large:
            self.is_large = any(type(each) is int and each > _MAX_INT64 for each in column.values)


class _Schema:
    """The columns of all batches, keyed by name, in order of first appearance."""

    def __init__(self, topic: str) -> None:
        self.columns: dict[str, _Cells] = {}
        self._topic = topic

    def widen(self, batch: _Batch) -> None:
        """Add the columns of a batch to the schema."""
        for name, column in batch.columns.items():
            self.columns.setdefault(name, _Cells()).widen(column)
            _check_width(self._topic, len(self.columns))


# --- writers


class _Writer(ABC):
    @abstractmethod
    def write(self, batch: _Batch) -> None:
        """Append the rows of a batch."""


@contextlib.contextmanager
def _writer(format_: str, path: str, schema: _Schema) -> Iterator[_Writer]:
    if format_ == "csv":
        with open(path, "w", newline="", encoding="utf-8", errors="backslashreplace") as stream:
            yield _CsvWriter(stream, schema)
        return
    pyarrow, parquet = _import_pyarrow()
    arrow_schema = _arrow_schema(pyarrow, schema)
    with parquet.ParquetWriter(path, arrow_schema) as writer:
        yield _ParquetWriter(pyarrow, arrow_schema, writer)


class _CsvWriter(_Writer):
    """Writes CSV. Times are seconds with nine decimals, booleans are true or false, and missing values are empty."""

    def __init__(self, stream: TextIO, schema: _Schema) -> None:
        self._names = list(schema.columns)
        self._table = csv.writer(stream)
        self._table.writerow(["time", *self._names])

    def write(self, batch: _Batch) -> None:
        nothing = [""] * len(batch.times)
        cells: list[Sequence[object]] = [[_seconds(time) for time in batch.times]]
        for name in self._names:
            column = batch.columns.get(name)
            cells.append(nothing if column is None else _csv_cells(column))
        self._table.writerows(zip(*cells, strict=True))


def _csv_cells(column: Column) -> Sequence[object]:
    if column.kind is not Kind.PLAIN:
        return ["" if each is None else _seconds(each) for each in column.values]
    return [("true" if each else "false") if isinstance(each, bool) else each for each in column.values]


def _seconds(nanoseconds: int) -> str:
    sign = "-" if nanoseconds < 0 else ""
    return "{}{}.{:09d}".format(sign, *divmod(abs(nanoseconds), _SECOND))


class _ParquetWriter(_Writer):
    """Writes Parquet, with times as UTC timestamps and durations as durations, both in nanoseconds."""

    def __init__(self, pyarrow: Any, schema: Any, writer: Any) -> None:
        self._pyarrow = pyarrow
        self._schema = schema
        self._writer = writer

    def write(self, batch: _Batch) -> None:
        if (latest := max(batch.times)) > _MAX_INT64:
            raise BagError(
                f"a message's time of receipt, {latest:,} ns, is too late for Parquet: export the topic as CSV"
            )
        nothing = [None] * len(batch.times)
        arrays = []
        for field in self._schema:
            column = batch.columns.get(field.name)
            values: Sequence[object] = nothing if column is None else column.values
            if field.name == "time":
                values = batch.times
            arrays.append(self._pyarrow.array(values, type=field.type))
        self._writer.write_table(self._pyarrow.Table.from_arrays(arrays, schema=self._schema))


def _arrow_schema(pyarrow: Any, schema: _Schema) -> Any:
    time = pyarrow.timestamp("ns", "UTC")
    fields = [("time", time)]
    for name, cells in schema.columns.items():
        if cells.kind is not Kind.PLAIN:
            fields.append((name, time if cells.kind is Kind.TIME else pyarrow.duration("ns")))
        elif str in cells.types:
            fields.append((name, pyarrow.string()))
        elif float in cells.types or not cells.types:
            fields.append((name, pyarrow.float64()))
        elif int in cells.types:
            fields.append((name, pyarrow.uint64() if cells.is_large else pyarrow.int64()))
        else:
            fields.append((name, pyarrow.bool_()))
    return pyarrow.schema(fields)


def _import_pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow  # type: ignore[import-not-found,unused-ignore]
        from pyarrow import parquet  # type: ignore[import-not-found,unused-ignore]
    except ImportError as error:
        raise BagError(f"Parquet needs the library pyarrow: {install_command('pyarrow')}") from error
    return pyarrow, parquet
