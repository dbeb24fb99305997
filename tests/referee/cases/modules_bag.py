"""Names of rosbag.bag that start with an underscore and that programs use nevertheless."""

import os

import genpy
import rosbag
import rosbag.bag
from referee import show
from std_msgs.msg import String

PATH = os.path.join(os.environ["ROS_HOME"], "case.bag")
with rosbag.Bag(PATH, "w", chunk_threshold=100) as bag:
    for number in range(20):
        bag.write("/odd" if number % 2 else "/even", String(str(number)), genpy.Time(100 + number))

for size in (0, 1, 999, 1000, 1024, 12345, 1e6, 3e9):
    show(size, rosbag.bag._human_readable_size(size), rosbag.bag._human_readable_frequency(size))

bag = rosbag.Bag(PATH)
show(bag._version, bag._mode, bag._connection_indexes_read, type(bag._reader).__name__, bag._filename == PATH)
entries = list(bag._get_entries())
show(all(isinstance(each, rosbag.bag._IndexEntry) for each in entries), entries[3].time)
show(all(isinstance(each, rosbag.bag._ChunkInfo) for each in bag._chunks), len(bag._chunks))
show(all(isinstance(each, rosbag.bag._ChunkHeader) for each in bag._chunk_headers.values()))
show(bag._reader.seek_and_read_message_data_record(entries[3].position, False))
show(bag._reader.seek_and_read_message_data_record(entries[3].position, True)[1][:3])
message = bag._reader.seek_and_read_message_data_record(entries[3].position, False, True)
show(type(message).__name__, message.connection_header["topic"])
show(len(list(bag._reader.read_messages("/odd", None, genpy.Time(105), None, False))))
(connection,) = bag._get_connections("/odd")
kind = rosbag.bag._get_message_type(connection)
show(kind._type, rosbag.bag._message_types[connection.md5sum] is kind)


class Counted(list):
    """Counts how far an iteration has come, as a progress bar does."""

    seen = 0

    def __iter__(self):
        for each in list.__iter__(self):
            Counted.seen += 1
            yield each


class Reader(rosbag.bag._BagReader200):
    def _read_connection_index_records(self):
        chunks = self.bag._chunks
        self.bag._chunks = Counted(chunks)
        super()._read_connection_index_records()
        self.bag._chunks = chunks
        show("read", Counted.seen, len(chunks))


class Bag(rosbag.bag.Bag):
    def read_index(self):
        if not self._connection_indexes_read and self._version == 200:
            self._reader._read_connection_index_records()

    def _create_reader(self):
        super()._create_reader()
        if self._version == 200:
            self._reader = Reader(self)


bag = Bag(PATH)
show(bag._connection_indexes_read, len(list(bag.read_messages())))
bag.read_index()
bag = Bag(PATH, skip_index=True)
show(bag._connection_indexes_read)
bag.read_index()
show(bag._connection_indexes_read, len(list(bag.read_messages("/odd"))))
