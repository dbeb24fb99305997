"""Series from bags for the page's plots: parse a request, read the bags, return points as JSON. The functions block."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import NamedTuple

from minirospy.base.errors import BagError, BagUnindexedError, MinirospyError, UsageError
from minirospy.core.bag.base import BagReader
from minirospy.introspect import bag_series
from minirospy.introspect.bag_series import Budget, FieldPath, Sampler
from minirospy.introspect.bags import open_reader
from minirospy.web.dashboard.bag_folder import BagFolder
from minirospy.web.dashboard.json_session import Fields, number, text_of

__all__ = ["BagPath", "Operand", "SeriesRequest", "fields_of", "series_of"]

_MAX_COLUMNS = 5_000  # maximum number of columns: with MAX_SERIES series, 2,000,000 points
_MAX_SERIES = 100  # maximum number of series per request
_MARGIN_SECONDS = 10.0  # seconds before a range that are searched first for a point of the subtrahend
_WIDER = 4  # factor by which this margin grows until it contains such a point


class Operand(NamedTuple):
    """A field in a bag: its path, such as ``/odom/twist/twist/linear/x``, and the bag's name on the page."""

    bag: str
    path: str


class BagPath(NamedTuple):
    """A series that the page identifies by ``key``: a field in a bag or, with ``minus``, the difference of two fields."""

    key: str
    operand: Operand
    minus: Operand | None


class SeriesRequest(NamedTuple):
    """A page's request for series in a time range, in seconds since each bag's start (None: the whole bag)."""

    id: object
    start: float | None
    end: float | None
    columns: int
    paths: Sequence[BagPath]

    @classmethod
    def parse(cls, fields: Fields) -> SeriesRequest:
        """Parse a page's request. Raise LookupError, TypeError or UsageError if it is invalid."""
        columns = min(max(int(number(fields["columns"])), 1), _MAX_COLUMNS)
        start, end = (None if fields.get(name) is None else number(fields[name]) for name in ("start", "end"))
        wanted = fields["series"]
        if not isinstance(wanted, list):
            raise TypeError("series is a list")
        if len(wanted) > _MAX_SERIES:
            raise UsageError(f"a plot has {_MAX_SERIES} paths of bags at most")
        paths = []
        for each in wanted:
            if not isinstance(each, dict):
                raise TypeError("a series is an object")
            minus = each.get("minus")
            paths.append(
                BagPath(text_of(each, "key"), _operand(each), None if minus is None else _operand(minus))
            )
        return cls(fields.get("id"), start, end, columns, paths)


def _operand(fields: object) -> Operand:
    if not isinstance(fields, dict):
        raise TypeError("a path of a bag is an object")
    return Operand(text_of(fields, "bag"), text_of(fields, "path"))


def fields_of(folder: BagFolder, name: str) -> Fields:
    """Return the topics in a bag with their definitions. Raise BagError if the bag cannot be opened."""
    with ExitStack() as opened:
        reader = _open(folder, name, opened)
        start, end = bag_series.bag_span(reader)
        topics = [list(each) for each in bag_series.bag_topics(reader)]
    return {"name": name, "start": start / 1e9, "length": (end - start) / 1e9, "topics": topics}


def series_of(folder: BagFolder, request: SeriesRequest, on_share: Callable[[float], object]) -> Fields:
    """Return the requested series, and an error message for each one that cannot be read.

    ``on_share`` is called with the fraction read so far (0 to 1). An exception from it ends the reading.
    """
    errors: dict[str, str] = {}
    found: list[Fields] = []
    budget = Budget()
    by_bag: dict[str, list[BagPath]] = {}
    for each in request.paths:
        # Read all fields of a bag in one pass. Read each difference separately: it needs a second reader.
        place = each.operand.bag if each.minus is None else f"{each.key}\0"
        by_bag.setdefault(place, []).append(each)
    for done, group in enumerate(by_bag.values()):

        def report(share: float, done: int = done) -> None:
            on_share((done + share) / len(by_bag))

        try:
            found += _read(folder, group, request, report, errors, budget)
        except (MinirospyError, OSError, RecursionError, ValueError) as error:
            report(1.0)  # raises an exception if the page has disconnected
            name = group[0].operand.bag
            text = str(error) if name in str(error) else f"{name}: {error}"
            errors.update((each.key, text) for each in group)
    return {"id": request.id, "found": found, "errors": errors}


def _read(
    folder: BagFolder,
    group: Sequence[BagPath],
    request: SeriesRequest,
    on_share: Callable[[float], object],
    errors: dict[str, str],
    budget: Budget,
) -> list[Fields]:
    with ExitStack() as opened:
        reader = _open(folder, group[0].operand.bag, opened)
        topics = {each.topic for each in reader.connections.values()}
        first, last = bag_series.bag_span(reader)
        length = (last - first) / 1e9
        start, end = request.start, request.end
        shown = (0.0 if start is None else start, length if end is None else end)

        def on_time(time: float) -> None:
            on_share(min(1.0, max(0.0, (time - shown[0]) / max(shown[1] - shown[0], 1e-9))))

        paths, keys = [], []
        for each in group:
            try:
                paths.append(bag_series.field_path(each.operand.path, topics))
                keys.append(each.key)
            except (MinirospyError, RecursionError, ValueError) as error:
                errors[each.key] = str(error)
        found = bag_series.points(reader, paths, start, end, on_time)
        if minus := group[0].minus:
            other = _open(folder, minus.bag, opened)
            subtrahend = bag_series.field_path(
                minus.path, {each.topic for each in other.connections.values()}
            )
            # Read the subtrahend beyond both ends of the range: the difference interpolates it at each point's time.
            before = None if start is None else _start_before(other, subtrahend, start, on_time)
            around = bag_series.points(other, [subtrahend], before, None, on_time)
            difference = bag_series.differences((point for _, point in found), (point for _, point in around))
            found = ((0, point) for point in difference)
        samplers = bag_series.sample(found, len(paths), *shown, request.columns, budget)
    series = []
    for key, path, own in zip(keys, paths, samplers, strict=True):
        if not own and not budget.series:
            errors[key] = f"a plot has at most {bag_series.MAX_SERIES} series of bags"
        elif not own and start is None and end is None:
            errors[key] = f"no number at {path.topic} in the messages of this bag"
        series += [_series(key, label, sampler, length) for label, sampler in own.items()]
    return series


def _start_before(
    reader: BagReader, path: FieldPath, start: float, on_time: Callable[[float], object]
) -> float | None:
    """Return a time such that reading from there finds a point before ``start``; None (the bag's start) if there is none."""
    margin = _MARGIN_SECONDS
    while margin < start:
        for _ in bag_series.points(reader, [path], start - margin, start, on_time):
            return start - margin
        margin *= _WIDER
    return None


def _series(key: str, label: str, sampler: Sampler, length: float) -> Fields:
    times, values = sampler.result()
    return {
        "key": key,
        "label": label,
        "times": times,
        "values": values,
        "count": sampler.count,
        "exact": sampler.is_exact,
        "length": length,
    }


def _open(folder: BagFolder, name: str, opened: ExitStack) -> BagReader:
    try:
        reader = opened.enter_context(open_reader(str(folder.path_of(name))))
        reader.prepare()
    except BagUnindexedError as error:
        raise BagError(f"{error}. Run `rosbag reindex {name}`") from error
    return reader
