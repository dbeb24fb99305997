"""The functions and attributes of rosbag.bag with which programs repair bags."""

import io
import os
import shutil

import rosbag
import rosbag.bag as bags
import rospy
from referee import outcome, show
from std_msgs.msg import Int32, String

os.chdir(os.environ["ROS_HOME"])
os.environ["TZ"] = "UTC"

show("# constants")
for name in sorted(dir(bags)):
    if name.startswith(("_OP_", "_VERSION", "_INDEX", "_CHUNK_INDEX", "_FILE_HEADER")):
        show(name, repr(getattr(bags, name)))

show("# values")
TIME = rospy.Time(1, 2)
for name, value in (
    ("_pack_uint8", 5), ("_pack_uint32", 5), ("_pack_uint64", 5), ("_pack_time", TIME), ("_unpack_uint8", b"\5"),
    ("_unpack_uint32", b"\5\0\0\0"), ("_unpack_uint64", b"\5\0\0\0\0\0\0\0"), ("_unpack_time", b"\1\0\0\0\2\0\0\0"),
    ("_decode_str", b"abc"), ("_decode_str", "abc"), ("_decode_bytes", b"abc"), ("_median", [3, 1, 2]), ("_median", [1, 2]),
    ("_median", []),
):  # fmt: skip
    outcome(f"{name} {value!r}", lambda n=name, v=value: getattr(bags, n)(v))

show("# reading")
file = io.BytesIO(b"\3\0\0\0abcXYZ\7\0\0\0\1" + b"\2" * 8 + b"\1\0\0\0\2\0\0\0")
for name, *arguments in (
    ["_read_sized"], ["_read", 3], ["_read_uint32"], ["_read_uint8"], ["_read_uint64"], ["_read_time"], ["_read", 1],
    ["_read_sized"],
):  # fmt: skip
    outcome(name, lambda n=name, a=arguments: getattr(bags, n)(file, *a))
file = io.BytesIO()
bags._write_sized(file, b"abc")
bags._write_sized(file, "def")
show(file.getvalue())
file.seek(0)
bags._skip_sized(file)
show(file.tell())

show("# records")
HEADER = {
    "op": bags._pack_uint8(bags._OP_FILE_HEADER),
    "index_pos": bags._pack_uint64(7),
    "conn_count": bags._pack_uint32(1),
    "chunk_count": bags._pack_uint32(2),
}
file = io.BytesIO()
outcome("write", lambda: bags._write_header(file, HEADER))
show(file.getvalue())
for wanted in (None, bags._OP_FILE_HEADER, bags._OP_CHUNK):
    file.seek(0)
    outcome(f"read {wanted}", lambda w=wanted: bags._read_header(file, w))
file.seek(0)
show(bags._peek_next_header_op(file), file.tell())
for options in (
    {"data": b"data"},
    {"data": "text"},
    {"padded_size": 100},
    {"data": "text", "padded_size": 10},
):
    file = io.BytesIO()
    bags._write_record(file, HEADER, **options)
    file.write(b"rest")
    show(file.getvalue())
    file.seek(0)
    bags._skip_record(file)
    show(file.read())
file = io.BytesIO()
bags._write_record(file, HEADER, padded_size=bags._FILE_HEADER_LENGTH)
show(len(file.getvalue()))
file = io.BytesIO()
bags._write_record(file, {"op": b"\5", "a": "text"}, b"zz")
file.seek(0)
show(bags._read_header(file), bags._read_record_data(file))
for name, field in (
    ("uint8", "op"), ("uint32", "conn_count"), ("uint64", "index_pos"), ("str", "op"), ("bytes", "op"), ("uint32", "none"),
    ("time", "index_pos"), ("uint64", "op"),
):  # fmt: skip
    outcome(f"{name} {field}", lambda n=name, f=field: getattr(bags, f"_read_{n}_field")(HEADER, f))
for data in (b"\5\0\0\0a=bcd", b"\x09\0\0\0a=bcd", b"\3\0\0\0abc"):
    outcome(data, lambda d=data: bags._build_header_from_str(d, None))
outcome("no header", lambda: bags._read_header(io.BytesIO(b"")))

show("# a bag")
bag = rosbag.Bag("a.bag", "w", chunk_threshold=60)
for number in range(3):
    bag.write("/a", String(f"x{number}"), rospy.Time(10 + number))
bag.write("/b", Int32(5), rospy.Time(20))
show(
    bag._file_header_pos,
    bag._index_data_pos,
    bag._file.name,
    sorted(bag._topic_connections),
    bag._mode,
    bag._version,
)
bag.close()
show(bag._file)
bag = rosbag.Bag("a.bag")
show(
    bag._file_header_pos,
    bag._index_data_pos > 4000,
    bag._connection_count,
    bag._chunk_count,
    bag._version,
    bag._filename,
)
show(bag._output_file is bag._file, bag._is_file(bag._file), bag._is_file("a.bag"))
reader, file = bag._reader, bag._file
file.seek(bag._file_header_pos)
show(reader.read_file_header_record(), file.tell() == bag._chunks[0].pos)
header = reader.read_chunk_header()
show(header.compression, header.compressed_size == header.uncompressed_size, file.tell() == header.data_pos)
file.seek(bag._index_data_pos)
show(
    [
        (each.id, each.topic, each.datatype)
        for each in (reader.read_connection_record(file, False) for _ in range(2))
    ]
)
for _ in range(3):
    info = reader.read_chunk_info_record()
    show(info.pos in bag._chunk_headers, info.start_time, info.end_time, info.connection_counts)
outcome("no more", reader.read_chunk_info_record)
positions = [file.tell() for _ in bag.read_messages()]
show(positions == sorted(positions), len(set(positions)) > 1)
bag.close()

show("# repaired")
shutil.copy("a.bag", "b.bag")
with open("b.bag", "r+b") as file:
    file.seek(bag._file_header_pos)
    zero = dict(
        HEADER,
        index_pos=bags._pack_uint64(0),
        conn_count=bags._pack_uint32(0),
        chunk_count=bags._pack_uint32(0),
    )
    bags._write_record(file, zero, padded_size=bags._FILE_HEADER_LENGTH)
outcome("no index", lambda: rosbag.Bag("b.bag"))
bag = rosbag.Bag("b.bag", "a", allow_unindexed=True)
show(bag._index_data_pos, len(list(bag.reindex())) > 0)
bag.close()
show(rosbag.Bag("b.bag").get_message_count())

show("# a connection of the program's")
bag = rosbag.Bag("c.bag", "w")
for number, kind in enumerate((String, Int32)):
    fields = {
        "topic": "/c",
        "type": kind._type,
        "md5sum": kind._md5sum,
        "message_definition": kind._full_text,
    }
    connection = bags._ConnectionInfo(number, "/c", fields)
    bag._write_connection_record(connection, encrypt=False)
    bag._connections[number] = bag._topic_connections["/c"] = connection
    bag.write(
        "/c", kind(data="text" if kind is String else 7), rospy.Time(1 + number), connection_header=fields
    )
bag.close()
with rosbag.Bag("c.bag") as bag:
    show([(each.topic, each.datatype) for each in bag._connections.values()], bag.get_message_count())

show("# opened again")
bag = rosbag.Bag("a.bag", skip_index=True)
bag.close()
outcome("open", lambda: bag._open("a.bag", "r", True))
show(bag._file is not None, bag.get_message_count(), bag._clear_index(), bag._close_file(), bag._file)
