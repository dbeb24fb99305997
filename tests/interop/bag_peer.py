"""Write and read bags with Debian's rosbag or minirospy's, depending on the interpreter.

Usage: bag_peer.py write|read|copy FOLDER.

`write` writes bags of every kind to FOLDER. `read` prints the contents of each bag in FOLDER as one line of JSON.
`copy` copies none.bag in FOLDER message by message, to copy_COMPRESSION.bag.
"""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import genpy
import rosbag
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Header, Int32, String


def messages(number: int) -> list[tuple[str, Any]]:
    header = Header(seq=number, stamp=genpy.Time(50 + number, number), frame_id=f"frame{number % 3}")
    found: list[tuple[str, Any]] = [("/chatter", String(f"h\u00e4llo {number}")), ("/count", Int32(-number))]
    if number % 5 == 0:
        found.append(("/camera/image_raw", Image(header=header, height=20, width=30, encoding="mono8", step=30,
                                                 data=bytes(number % 256 for _ in range(600)))))  # fmt: skip
        found.append(
            ("/joint_states", JointState(header=header, name=["a", "b"], position=[0.5 * number, 1.0]))
        )
        found.append(("/pose", PoseStamped(header=header)))
    return found


def write(folder: Path) -> None:
    for compression in ("none", "bz2", "lz4"):
        with rosbag.Bag(
            str(folder / f"{compression}.bag"), "w", compression=compression, chunk_threshold=4000
        ) as bag:
            for number in range(200):
                for topic, message in messages(number):
                    bag.write(topic, message, genpy.Time(100 + number, number * 1000))
    rosbag.Bag(str(folder / "empty.bag"), "w").close()

    # Write messages out of order, several of them with the same time.
    with rosbag.Bag(str(folder / "shuffled.bag"), "w", chunk_threshold=10_000_000) as bag:
        for number in range(100):
            bag.write(f"/t{number % 4}", Int32(number), genpy.Time(1 + number * 7 % 50, 0))
    with rosbag.Bag(str(folder / "appended.bag"), "w") as bag:
        bag.write("/a", Int32(1), genpy.Time(1, 0))
    with rosbag.Bag(str(folder / "appended.bag"), "a", compression="lz4") as bag:
        bag.write("/a", Int32(2), genpy.Time(2, 0))
        bag.write("/b", String("new"), genpy.Time(3, 0))

    # Cut the file as a killed recorder would leave it.
    whole = (folder / "none.bag").read_bytes()
    at = whole.index(b"index_pos=") + len(b"index_pos=")
    (folder / "unindexed.bag").write_bytes(whole[:at] + bytes(8) + whole[at + 8 :])


def read(folder: Path) -> None:
    for path in sorted(folder.glob("*.bag")):
        found: dict[str, Any] = {"name": path.name}

        try:
            with rosbag.Bag(str(path)) as bag:
                digest = hashlib.sha256()
                for topic, message, stamp, header in bag.read_messages(return_connection_header=True):
                    digest.update(f"{topic} {message} {stamp.to_nsec()} {sorted(header.items())}".encode())
                found["messages"] = digest.hexdigest()
                raw = hashlib.sha256()
                for topic, (kind, body, md5sum, _, cls), stamp in bag.read_messages(
                    raw=True, start_time=genpy.Time(3, 0), topics=["/chatter", "/t1", "/a"]
                ):
                    raw.update(f"{topic} {kind} {body!r} {md5sum} {cls._md5sum} {stamp.to_nsec()}".encode())
                found["raw"] = raw.hexdigest()
                found["text"] = str(bag)
                found["yaml"] = bag._get_yaml_info()
                found["info"] = repr(bag.get_type_and_topic_info())
                found["compression"] = repr(tuple(bag.get_compression_info()))
                found["entries"] = [entry.time.to_nsec() for entry in bag._get_entries()]
        except rosbag.ROSBagException as error:
            found["error"] = f"{type(error).__name__}: {error}"

        print(json.dumps(found))


def copy(folder: Path) -> None:
    for compression in ("none", "bz2", "lz4"):
        with (
            rosbag.Bag(str(folder / "none.bag")) as bag,
            rosbag.Bag(str(folder / f"copy_{compression}.bag"), "w", compression, 4000) as other,
        ):
            for topic, message, stamp, header in bag.read_messages(raw=True, return_connection_header=True):
                other.write(topic, message, stamp, raw=True, connection_header=header)


if __name__ == "__main__":
    {"write": write, "read": read, "copy": copy}[sys.argv[1]](Path(sys.argv[2]))
