"""The classes of rosbag.Bag's ``_reader``, which programs use to read single messages or show the indexing progress."""

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
    """The reader for ``bag``, for any format version."""

    def __init__(self, bag: Bag) -> None:
        self.bag = bag

    def seek_and_read_message_data_record(
        self, position: Position, raw: bool, return_connection_header: bool = False
    ) -> BagMessage | BagMessageWithConnectionHeader:
        """Return the message at an index entry's position. Raise ROSBagException if it cannot be read."""
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
        """Yield messages as Bag.read_messages does."""
        return self.bag.read_messages(
            topics, start_time, end_time, connection_filter, raw, return_connection_header
        )


class _BagReader200(_BagReader):
    """The reader for a version 2.0 bag."""

    def prepare(self) -> None:
        """Read the index now if a subclass overrides how it is read."""
        if type(self)._read_connection_index_records is not _BagReader200._read_connection_index_records:
            self._read_connection_index_records()

    def _read_connection_index_records(self) -> None:
        """Read the index. A subclass may first replace the bag's ``_chunks`` by an iterable that counts the chunks."""
        for _ in self.bag._chunks:
            # The first iteration reads the whole index, in one pass through the file.
            if not self.bag._connection_indexes_read:
                self.bag._connection_indexes_read = self.bag._connection_indexes is not None
