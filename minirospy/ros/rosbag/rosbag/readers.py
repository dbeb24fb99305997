"""What the real rosbag.Bag has as ``_reader``: programs read single messages by it, or show the progress of reading the index."""

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
    """A reader of the bag ``bag``, of any version."""

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
        """Yield messages, as Bag.read_messages."""
        return self.bag.read_messages(
            topics, start_time, end_time, connection_filter, raw, return_connection_header
        )


class _BagReader200(_BagReader):
    """A reader of a bag of version 2.0."""

    def prepare(self) -> None:
        """Read the index now where a derived class does it in its own way."""
        if type(self)._read_connection_index_records is not _BagReader200._read_connection_index_records:
            self._read_connection_index_records()

    def _read_connection_index_records(self) -> None:
        """Read the index. A derived class may put an iterable that counts in the place of the bag's ``_chunks``."""
        for _ in self.bag._chunks:
            # The first one reads all of it, in one pass over the file.
            if not self.bag._connection_indexes_read:
                self.bag._connection_indexes_read = self.bag._connection_indexes is not None
