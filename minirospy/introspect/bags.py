"""Bag files by their paths: open, copy, filter, compress, reindex; the message classes of what is in them.

What the commands of rosbag do, without what they print.
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
    "naming_full_disk",
    "new_bag",
    "open_reader",
    "reindex",
    "version_of",
]

Progress = Callable[[int], object]
"""Called with the number of bytes that are done, again and again."""

_WHOLE_NAMESPACE = {"eval", "exec", "locals", "vars", "globals", "dir"}


@contextlib.contextmanager
def open_reader(path: str) -> Iterator[BagReader]:
    """Yield a reader of a bag or an MCAP file. Raise BagError, OSError."""
    with open(path, "rb") as stream, contextlib.closing(open_bag_or_mcap(stream)) as reader:
        yield reader


def version_of(path: str) -> int:
    """Return a bag's version, 200 for 2.0, also if it has no index. Raise BagFormatError, OSError."""
    with open(path, "rb") as stream:
        return read_version(stream)


def is_mcap(path: str) -> bool:
    """Return whether a file is an MCAP file, by its first bytes. Raise OSError."""
    with open(path, "rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


def data_size(reader: BagReader) -> int:
    """Return the bytes of all chunks, decompressed; of a bag without chunks the size of the file."""
    headers = reader.chunk_headers().values()
    return sum(each.chunk.size for each in headers) or reader.size()


def chunks_end(path: str) -> int:
    """Return where the index of a bag of version 2.0 is; 0 if it has none. Raise OSError."""
    try:
        with open_reader(path) as reader:
            return reader.index_position if isinstance(reader, ChunkedReader) else 0
    except BagError:
        return 0


def backup_path(path: str) -> str:
    """Return where the original of a bag is kept: ``a.orig.bag``."""
    return "{}.orig{}".format(*os.path.splitext(path))


def class_of(type_: str, md5sum: str, definition: str, warn: Callable[[str], object]) -> type[Message]:
    """Return the class of a connection's messages, made of the definition in the bag.

    ``warn`` is called with ROS's line where the definition does not fit the md5sum, or is invalid: then the class has no
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
    """Write a bag again with this compression of its chunks. Raise BagError, OSError.

    Each connection is kept. Where the source is damaged, what was before the damage is in the target.
    """
    copy_bag(source, target, lambda connection: connection, compression, progress)


def copy_bag(
    source: str,
    target: str,
    change: Callable[[Connection], Connection],
    compression: str = compressions.NONE,
    progress: Progress = lambda done: None,
) -> None:
    """Write a bag again, in the order of time, with its connections as ``change`` returns them. Raise BagError, OSError."""
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
    """A Python expression of `rosbag filter` with the variables topic, m and t. Raise ValueTextError if it does not parse."""

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
        """Whether the message itself is looked at; if not, none is deserialized."""

    def __call__(self, topic: str, message: Message | None, time: Time) -> object:
        """Return the value of the expression. Raise ValueTextError with the error that it raises."""
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
    """Write the messages for which ``keep`` is true into a new bag; ``on_shown`` is called with each value of ``show``.

    Raise BagError, OSError, ValueTextError, MessageException.
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
    """Make the index of a bag of version 2.0, or an MCAP file, again, in place; return what could not be recovered.

    Raise BagError, OSError.
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
    """Write a bag of version 1.2, with or without an index, as a bag of version 2.0. Raise BagError, OSError."""
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
    """Raise UsageError if the name of a bag that is to be written is that of an MCAP file."""
    if path.endswith(".mcap"):
        raise UsageError(
            f"{path} would be a bag: end its name with .bag; `rosbag convert` makes an MCAP file of that"
        )


@contextlib.contextmanager
def new_bag(path: str, compression: str) -> Iterator[BagWriter]:
    """Yield the writer of a new file; chunks are compressed in parallel. Errors and Ctrl-C leave a bag of what was written.

    Raise UsageError if the name is that of an MCAP file, before anything is written.
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
    """Add the name of the file that is written to the OSError of a disk, or a quota, that is full."""
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
    """Return :func:`class_of` a connection. Raise BagFormatError."""
    try:
        return class_of(connection.type, connection.md5sum, connection.definition, warn)
    except DefinitionError as error:
        raise BagFormatError(f"Error generating datatype {connection.type}: {error}") from error
