"""Read a topic from a bag into a pandas or polars data frame."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Literal

from minirospy.base.errors import MinirospyError, NotFoundError
from minirospy.base.installation import install_command
from minirospy.introspect.columns import Column, Kind, columns

if TYPE_CHECKING:
    import pandas  # type: ignore[import-untyped,import-not-found,unused-ignore]
    import polars  # type: ignore[import-not-found,unused-ignore]

    from minirospy.base.times import Time
    from minirospy.ros.rosbag.rosbag.bag import Bag

__all__ = ["frame"]


def frame(
    bag: str | os.PathLike[str] | Bag,
    topic: str,
    *,
    start: Time | None = None,
    end: Time | None = None,
    library: Literal["pandas", "polars"] = "pandas",
) -> pandas.DataFrame | polars.DataFrame:
    """Return the messages on a topic of a bag or MCAP file as a data frame with one row per message.

    The column ``time`` (in pandas, the index) contains the times of receipt. Each other column is a field, such as
    ``twist.twist.linear.x`` or ``position[elbow]``. Times are in UTC with nanoseconds. Arrays without names remain lists, and
    bytes remain bytes. ``start`` and ``end``: times of receipt (rospy.Time), inclusive.

    Raise NotFoundError if the topic is not in the bag, MinirospyError if the topic has several types or the library is not
    installed, ROSBagException if the file is damaged, OSError if it cannot be read.
    """
    from minirospy.ros.rosbag.rosbag.bag import Bag as OpenBag

    table = {"pandas": _pandas, "polars": _polars}.get(library)
    if table is None:
        raise MinirospyError(f"library is '{library}': it must be 'pandas' or 'polars'")
    if isinstance(bag, (str, os.PathLike)):
        with OpenBag(os.fspath(bag)) as opened:
            times, found = _read(opened, topic, start, end)
    else:
        times, found = _read(bag, topic, start, end)
    try:
        return table(times, found)
    except ImportError as error:
        raise MinirospyError(f"a data frame needs {library}: {install_command(library)}") from error


def _read(bag: Bag, topic: str, start: Time | None, end: Time | None) -> tuple[list[int], list[Column]]:
    topics = bag.get_type_and_topic_info().topics
    name = topic if topic in topics else f"/{topic}"
    if name not in topics:
        raise NotFoundError("topic", topic, topics, f"the bag has {', '.join(sorted(topics)) or 'no topic'}")
    times: list[int] = []
    messages: list[Any] = []
    for _, message, time in bag.read_messages([name], start, end):
        times.append(time.to_nsec())
        messages.append(message)
    types = sorted({message._type for message in messages})
    if len(types) > 1:
        raise MinirospyError(f"topic {name} has messages of several types: {', '.join(types)}")
    return times, columns(messages)


def _pandas(times: list[int], found: list[Column]) -> pandas.DataFrame:
    import pandas  # type: ignore[import-untyped,import-not-found,unused-ignore]

    index = pandas.to_datetime(times, unit="ns", utc=True).rename("time")
    data: dict[str, Any] = {}
    for column in found:
        if column.kind is Kind.TIME:
            data[column.name] = pandas.to_datetime(column.values, unit="ns", utc=True)
        elif column.kind is Kind.DURATION:
            data[column.name] = pandas.to_timedelta(column.values, unit="ns")
        else:
            data[column.name] = column.values
    return pandas.DataFrame(data, index=index)


def _polars(times: list[int], found: list[Column]) -> polars.DataFrame:
    import polars  # type: ignore[import-not-found,unused-ignore]

    time = polars.Datetime("ns", "UTC")
    data: dict[str, Any] = {"time": polars.Series(times, dtype=polars.Int64).cast(time)}
    for column in found:
        if column.kind is Kind.PLAIN:
            values = [list(each) if isinstance(each, tuple) else each for each in column.values]
            data[column.name] = polars.Series(values, strict=False)
        else:
            kind = time if column.kind is Kind.TIME else polars.Duration("ns")
            data[column.name] = polars.Series(column.values, dtype=polars.Int64).cast(kind)
    return polars.DataFrame(data)
