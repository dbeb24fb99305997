"""Bag files by path: open, copy, filter, compress and reindex them, and create their message classes.

The rosbag commands call these functions and add their output.
"""

from __future__ import annotations

import ast
import contextlib
import errno
import os
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

from minirospy.base.errors import BagError, BagFormatError, DefinitionError, UsageError, ValueTextError
from minirospy.base.times import Time
from minirospy.core.bag import compression as compressions
from minirospy.core.bag.base import BagReader
from minirospy.core.bag.mcap_reader import open_bag_or_mcap
from minirospy.core.bag.mcap_repair import MAGIC, McapRepair
from minirospy.core.bag.old_formats import unindexed_old_bag
from minirospy.core.bag.reader import ChunkedReader
from minirospy.core.bag.records import Connection, read_version
from minirospy.core.bag.repair import Repair
from minirospy.core.bag.writer import BagWriter, Continued

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message

__all__ = [
    "Expression",
    "Progress",
    "backup_path",
    "check_bag_name",
    "chunks_end",
    "class_of",
    "class_of_connection",
    "compress",
    "convert12",
    "copy_bag",
    "data_size",
    "filter_bag",
    "is_mcap",
    "left_out",
    "naming_full_disk",
    "new_bag",
    "open_reader",
    "reindex",
    "version_of",
]

Progress = Callable[[int], object]
"""A function to call repeatedly with the number of bytes processed so far."""

_WHOLE_NAMESPACE = {"eval", "exec", "locals", "vars", "globals", "dir"}


@contextlib.contextmanager
def open_reader(path: str) -> Iterator[BagReader]:
    """Yield a reader for a bag or an MCAP file. Raise BagError if the file is invalid, OSError if it cannot be read."""
    with open(path, "rb") as stream, contextlib.closing(open_bag_or_mcap(stream)) as reader:
        yield reader


def version_of(path: str) -> int:
    """Return a bag's version (200 means 2.0), even if it has no index. Raise BagFormatError if the file is not a bag."""
    with open(path, "rb") as stream:
        return read_version(stream)


def is_mcap(path: str) -> bool:
    """Return whether a file starts with MCAP's magic bytes. Raise OSError if it cannot be read."""
    with open(path, "rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


def left_out(reader: BagReader) -> str:
    """Return one line that lists an MCAP file's unreadable topics, each with the reason, or "" if all can be read."""
    foreign: dict[str, str] = getattr(reader, "foreign", {})
    return "; ".join(f"{topic}: {why}" for topic, why in sorted(foreign.items()))


def data_size(reader: BagReader) -> int:
    """Return the total size of all chunks after decompression, in bytes, or the file's size if there are no chunks."""
    headers = reader.chunk_headers().values()
    return sum(each.chunk.size for each in headers) or reader.size()


def chunks_end(path: str) -> int:
    """Return the offset of a version 2.0 bag's index, or 0 if it has none. Raise OSError if the file cannot be read."""
    try:
        with open_reader(path) as reader:
            return reader.index_position if isinstance(reader, ChunkedReader) else 0
    except BagError:
        return 0


def backup_path(path: str) -> str:
    """Return the path for the backup of a bag: ``a.orig.bag`` for ``a.bag``."""
    return "{}.orig{}".format(*os.path.splitext(path))


def class_of(type_: str, md5sum: str, definition: str, warn: Callable[[str], object]) -> type[Message]:
    """Return the message class of a connection, generated from the definition in the bag.

    If the definition is invalid or does not match the md5sum, call ``warn`` with ROS's message and return a class without
    fields. Raise DefinitionError if the type's name is not legal.
    """
    from minirospy.core.idl.load import class_from_text

    try:
        found = class_from_text(type_, definition)
    except DefinitionError:
        found = class_from_text(type_, "")
        warn(f'WARNING: For type [{type_}] stored md5sum [{md5sum}] has invalid message definition."')
        return found

    if found._md5sum != md5sum:
        warn(
            f"WARNING: For type [{type_}] stored md5sum [{md5sum}] does not match message definition "
            f'[{found._md5sum}].\n  Try: "rosrun rosbag fix_msg_defs.py old_bag new_bag."'
        )
    return found


def compress(source: str, target: str, compression: str, progress: Progress) -> None:
    """Copy a bag with a different chunk compression. Raise BagError if it is invalid, OSError if a file operation fails.

    All connections are kept. If the source is damaged, the target contains the messages before the damage.
    """
    copy_bag(source, target, lambda connection: connection, compression, progress)


def copy_bag(
    source: str,
    target: str,
    change: Callable[[Connection], Connection],
    compression: str = compressions.NONE,
    progress: Progress = lambda done: None,
) -> None:
    """Copy a bag in time order; replace each connection by the result of ``change(connection)``.

    Raise BagError if the bag is invalid, OSError if a file operation fails.
    """
    with open_reader(source) as reader, new_bag(target, compression) as writer:
        numbers: dict[int, int] = {}
        connections = list(reader.connections.values())
        done = 0

        for _, data, found in reader.blocks([each.id for each in connections]):
            for time, rank, _, body, after in found:
                number = numbers.get(rank)
                if number is None:
                    number = numbers[rank] = _add(writer, change(connections[rank]))
                writer.write(number, time, data[body:after])
                done += after - body
            progress(done)


class Expression:
    """A Python expression for `rosbag filter`, in which the variables topic, m and t are available.

    Raise ValueTextError if its syntax is invalid.
    """

    def __init__(self, text: str) -> None:
        try:
            tree = ast.parse(text.strip(), "<expression>", "eval")
            self._call = eval(compile(f"lambda topic, m, t: {text}", "<expression>", "eval"))
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            why = error.msg if isinstance(error, SyntaxError) else str(error)
            raise ValueTextError(text, f"not a Python expression: {why}") from error
        self.text = text
        names = {each.id for each in ast.walk(tree) if isinstance(each, ast.Name)}
        self.needs_message = "m" in names or bool(names & _WHOLE_NAMESPACE)
        """True if the expression uses the message. If False, messages are not deserialized."""

    def __call__(self, topic: str, message: Message | None, time: Time) -> object:
        """Evaluate the expression for a message; return the value. Raise ValueTextError if the evaluation fails."""
        try:
            return self._call(topic, message, time)
        except Exception as error:
            raise ValueTextError(
                self.text, f"{type(error).__name__} for a message on {topic}: {error}"
            ) from error


class FilterResult(NamedTuple):
    """The numbers of messages that were kept and read."""

    kept: int
    read: int


def filter_bag(
    source: str,
    target: str,
    keep: Expression,
    progress: Progress,
    *,
    show: Expression | None = None,
    on_shown: Callable[[bool, object], object] = lambda kept, value: None,
    warn: Callable[[str], object] = lambda line: None,
) -> FilterResult:
    """Copy the messages for which ``keep`` is true to a new bag.

    With ``show``, call ``on_shown(is kept, value of show)`` for each message of the source.

    Raise BagError if the bag is invalid, OSError if a file operation fails, ValueTextError if the expression raises, or
    MessageException if a message cannot be deserialized.
    """
    needs_message = keep.needs_message or (show is not None and show.needs_message)
    kept = read = done = 0
    with (
        open_reader(source) as reader,
        naming_full_disk(target),
        new_bag(target, compressions.NONE) as writer,
    ):
        numbers: dict[int, int] = {}
        classes: dict[int, type[Message]] = {}
        connections = list(reader.connections.values())
        for _, data, found in reader.blocks([each.id for each in connections]):
            for nanoseconds, rank, _, start, end in found:
                connection, body = connections[rank], data[start:end]
                message = None
                if needs_message:
                    if rank not in classes:
                        classes[rank] = class_of_connection(connection, warn)
                    message = classes[rank]()
                    message.deserialize(body)
                time = Time(*divmod(nanoseconds, 10**9))

                chosen = bool(keep(connection.topic, message, time))
                if show is not None:
                    on_shown(chosen, show(connection.topic, message, time))
                if chosen:
                    if rank not in numbers:
                        numbers[rank] = _add(writer, connection)
                    writer.write(numbers[rank], nanoseconds, body)
                    kept += 1
                read += 1
                done += end - start
            progress(done)
    return FilterResult(kept, read)


def reindex(path: str, progress: Progress) -> list[str]:
    """Rebuild the index of a version 2.0 bag or an MCAP file in place. Return descriptions of the unrecoverable parts.

    Raise BagError if the file is not a bag, OSError if it cannot be read or written.
    """
    is_other = is_mcap(path)
    with open(path, "r+b") as stream:
        if is_other:
            mcap = McapRepair(stream)
            for position in mcap.run():
                progress(position)
            mcap.apply()
            return mcap.problems
        repair = Repair(stream)
        for position in repair.run():
            progress(position)
        repair.apply()
        BagWriter(stream, continued=Continued(repair.connections.values(), repair.chunks, repair.end)).close()
    return repair.problems


def convert12(source: str, target: str, progress: Progress) -> None:
    """Convert a version 1.2 bag, with or without an index, to version 2.0.

    Raise BagError if the bag is invalid, OSError if a file operation fails.
    """
    with open(source, "rb") as stream, new_bag(target, compressions.NONE) as writer:
        reader = unindexed_old_bag(stream)
        for position in reader.scan():
            progress(position)
        numbers: dict[int, int] = {}
        for message in reader.messages():
            number = message.connection.id
            if number not in numbers:
                numbers[number] = _add(writer, message.connection)
            writer.write(numbers[number], message.time, message.body)


def check_bag_name(path: str) -> None:
    """Raise UsageError if the file name of an output bag ends in .mcap."""
    if path.endswith(".mcap"):
        raise UsageError(
            f"{path} would be a bag: end its name with .bag; `rosbag convert` makes an MCAP file of that"
        )


@contextlib.contextmanager
def new_bag(path: str, compression: str) -> Iterator[BagWriter]:
    """Yield a writer for a new bag, which compresses chunks in parallel.

    The file is a valid bag even after Ctrl-C or an error, except an OSError. Raise UsageError before writing if the name has
    an MCAP file's extension.
    """
    check_bag_name(path)
    with contextlib.ExitStack() as stack:
        executor = None
        if compression != compressions.NONE:
            from concurrent.futures import ThreadPoolExecutor

            executor = stack.enter_context(ThreadPoolExecutor(os.cpu_count() or 1, "compress"))
        stream: BinaryIO = stack.enter_context(open(path, "wb", buffering=0))
        writer = BagWriter(stream, compression=compression, executor=executor)
        try:
            yield writer
        except OSError:
            raise
        except (Exception, KeyboardInterrupt):
            writer.close()
            raise
        writer.close()


@contextlib.contextmanager
def naming_full_disk(path: str) -> Iterator[None]:
    """Add the output file's name to an OSError that is caused by a full disk or an exceeded quota."""
    try:
        yield
    except OSError as error:
        full = {errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC)}
        if error.errno in full and error.filename is None:
            error.filename = path
        raise


def _add(writer: BagWriter, connection: Connection) -> int:
    return writer.add_connection(connection.topic, connection.header)


def class_of_connection(connection: Connection, warn: Callable[[str], object]) -> type[Message]:
    """Return the message class of a connection; see :func:`class_of`.

    Raise BagFormatError if its definition is invalid.
    """
    try:
        return class_of(connection.type, connection.md5sum, connection.definition, warn)
    except DefinitionError as error:
        raise BagFormatError(f"Error generating datatype {connection.type}: {error}") from error
