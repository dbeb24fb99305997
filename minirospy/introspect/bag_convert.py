"""Convert bags to MCAP files and back without loss of messages, times or connection headers."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable

from minirospy.base import private_files
from minirospy.base.errors import BagError, UsageError
from minirospy.core.bag.compression import check_compression
from minirospy.core.bag.mcap_writer import McapWriter, check_mcap_compression
from minirospy.core.bag.writer import BagWriter
from minirospy.introspect.bags import left_out, naming_full_disk, open_reader

__all__ = ["check", "convert"]


def check(source: str, target: str, *, compression: str, force: bool) -> None:
    """Check the arguments of :func:`convert` before anything is written.

    Raise UsageError if they are invalid, BagError or OSError if ``source`` cannot be read.
    """
    if not target.endswith((".bag", ".mcap")):
        raise UsageError(f"{target} must end with .bag or .mcap")
    if os.path.exists(target) and not force:
        raise UsageError(f"{target} exists already: remove it, or add -f")
    if os.path.exists(target) and os.path.samefile(source, target):
        raise UsageError(f"{target} is the file that is read")
    if target.endswith(".mcap"):
        check_mcap_compression(compression)
    else:
        check_compression(compression)
    with open_reader(source):
        pass


def convert(source: str, target: str, *, compression: str, force: bool, step: Callable[[int], object]) -> int:
    """Write the messages of a bag or MCAP file to ``target``, in MCAP format if its name ends in .mcap.

    Return the number of messages. ``step`` is called with the number of message bytes processed so far. ``force``:
    overwrite an existing file. An incomplete file is removed. Raise UsageError if ``target`` exists, BagError if the
    source is invalid, or OSError if a file cannot be read or written.
    """
    check(source, target, compression=compression, force=force)

    partial = f"{target}.active"
    count = done = 0
    with open_reader(source) as reader:
        reader.prepare()
        try:
            with naming_full_disk(target), open(partial, "w+b", buffering=0) as stream:
                is_mcap = target.endswith(".mcap")
                writer: BagWriter | McapWriter = (
                    McapWriter(stream, compression=compression)
                    if is_mcap
                    else BagWriter(stream, compression=compression)
                )
                numbers: dict[int, int] = {}
                for message in reader.messages():
                    connection = message.connection
                    if connection.id not in numbers:
                        numbers[connection.id] = writer.add_connection(connection.topic, connection.header)
                    writer.write(numbers[connection.id], message.time, message.body)
                    count += 1
                    done += len(message.body)
                    step(done)
                writer.close()
            private_files.replace_file(partial, target)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(partial)
            raise
    if foreign := left_out(reader):
        raise BagError(f"{source}: left out, as they cannot be converted to ROS 1: {foreign}")
    return count
