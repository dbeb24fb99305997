"""Bags for tests of the dashboard: strings, a latched map of text, images."""

from __future__ import annotations

import struct
from io import BytesIO
from pathlib import Path

from sensor_msgs.msg import Image
from std_msgs.msg import String

from minirospy.core.bag.writer import BagWriter

SECOND = 10**9
START = 1_700_000_000 * SECOND


def text_body(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def image_body(level: int) -> bytes:
    """Return an image of 40 x 30 pixels, whose color changes from green to red with ``level`` from 0 to 255."""
    buffer = BytesIO()
    Image(
        width=40, height=30, encoding="rgb8", step=120, data=bytes([level, 255 - level, 60]) * 1200
    ).serialize(buffer)
    return buffer.getvalue()


def make_bag(path: Path, seconds: int = 20, *, hostile: str = "") -> Path:
    """Write a bag with ten strings per second on /chatter, two images per second on /camera, and one latched string on /map."""
    with path.open("wb") as stream:
        writer = BagWriter(stream)
        described = {"type": String._type, "md5sum": String._md5sum, "message_definition": String._full_text}
        image = {"type": Image._type, "md5sum": Image._md5sum, "message_definition": Image._full_text}
        chatter = writer.add_connection("/chatter", {**described, "callerid": "/talker"})
        map_ = writer.add_connection("/map", {**described, "latching": "1", "callerid": "/server"})
        camera = writer.add_connection("/camera", {**image, "callerid": "/camera"})
        writer.write(map_, START, text_body(hostile or "the map"))
        for number in range(seconds * 10):
            time = START + number * SECOND // 10
            writer.write(chatter, time, text_body(f"{hostile}message {number}"))
            if number % 5 == 0:
                writer.write(camera, time, image_body(number * 255 // (seconds * 10)))
        writer.close()
    return path


def make_bag_out_of_order(path: Path) -> Path:
    """Write a bag with a string per second on /chatter, whose chunks have the seconds 20 to 29, 0 to 9, 10 to 19."""
    with path.open("wb") as stream:
        writer = BagWriter(stream, chunk_threshold=200)
        described = {"type": String._type, "md5sum": String._md5sum, "message_definition": String._full_text}
        chatter = writer.add_connection("/chatter", {**described, "callerid": "/talker"})
        for first in (20, 0, 10):
            for number in range(first, first + 10):
                writer.write(chatter, START + number * SECOND, text_body(f"message {number}"))
        writer.close()
    return path
