"""The classes of rosbag.Bag's ``_reader``: programs use it to read single messages, or to show the progress of indexing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from minirospy.base.times import Time
    from minirospy.core.bag.base import Position
    from minirospy.ros.rosbag.rosbag.bag import Bag
    from minirospy.ros.rosbag.rosbag.private import (
        BagMessage,
        BagMessageWithConnectionHeader,
        ConnectionFilter,
    )

__all__: list[str] = []


class _BagReader:
    """The reader of ``bag``, for any version of the format."""

    def __init__(self, bag: Bag) -> None:
        self.bag = bag

    def seek_and_read_message_data_record(
        self, position: Position, raw: bool, return_connection_header: bool = False
    ) -> BagMessage | BagMessageWithConnectionHeader:
        """Return the message at the position of an index entry. Raise ROSBagException."""
        return self.bag._read_message(position, raw, return_connection_header)

    def read_messages(
        self,
        topics: str | Iterable[str] | None,
        start_time: Time | None,
        end_time: Time | None,
        connection_filter: ConnectionFilter | None,
        raw: bool,
        return_connection_header: bool = False,
    ) -> Iterator[Any]:
        """Yield messages like Bag.read_messages."""
        return self.bag.read_messages(
            topics, start_time, end_time, connection_filter, raw, return_connection_header
        )


class _BagReader200(_BagReader):
    """The reader of a bag of version 2.0."""

    def prepare(self) -> None:
        """Read the index now if a subclass overrides how it is read."""
        if type(self)._read_connection_index_records is not _BagReader200._read_connection_index_records:
            self._read_connection_index_records()

    def _read_connection_index_records(self) -> None:
        """Read the index. A subclass may replace the bag's ``_chunks`` by an iterable that counts."""
        for _ in self.bag._chunks:
            # The first iteration reads the whole index, in one pass over the file.
            if not self.bag._connection_indexes_read:
                self.bag._connection_indexes_read = self.bag._connection_indexes is not None
