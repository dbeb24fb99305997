"""Convert between CDR, the serialization of ROS 2, and that of ROS 1, without creating message objects.

The specs of a message in ROS 1 and in ROS 2 are merged into a layout: their common fields, in order. From the layout,
two functions are generated as straight-line Python code that moves bytes. A message of ROS 1 has no padding; in CDR each
number is aligned to its own size, a string's length includes a trailing NUL, and a struct without members takes a byte.
The alignment of most positions is known when the code is generated; otherwise, as after strings, it is computed.

Output is plain CDR version 1, little-endian; input may have either byte order.
Source: OMG DDS-XTypes 1.3, 7.4.1 (XCDR version 1), and http://wiki.ros.org/msg.
"""

from __future__ import annotations

import linecache
import struct
import weakref
from array import array
from collections.abc import Callable
from enum import Enum
from typing import NamedTuple, Union, cast

from minirospy.base.errors import DefinitionError, DeserializationError
from minirospy.core.idl.source import Source

__all__ = [
    "CDR_HEADER",
    "Fixed",
    "Item",
    "Layout",
    "Sequence",
    "Side",
    "Text",
    "Transcoder",
    "make_transcoder",
]

CDR_HEADER = bytes((0, 1, 0, 0))
"""The encapsulation of plain CDR version 1, little-endian; the last two bytes are options, which readers ignore."""

_SPARE = 10_000  # number of zero-size elements allowed in addition to one per byte of the message


class Side(Enum):
    """States whether an item exists in both message types, or in only one.

    An item that exists only in the source is skipped; one that exists only in the target is written as zeros.
    """

    BOTH = 0
    ROS1 = 1
    ROS2 = 2


class Fixed(NamedTuple):
    """``number`` values of ``width`` bytes each."""

    width: int
    number: int = 1
    side: Side = Side.BOTH


class Text(NamedTuple):
    """A string item."""

    side: Side = Side.BOTH


class Sequence(NamedTuple):
    """Elements that each have the layout ``items``. ``length`` is None if their number varies."""

    items: tuple[Item, ...]
    length: int | None = None
    side: Side = Side.BOTH


Item = Union[Fixed, Text, Sequence]  # noqa: UP007 - evaluated, and forward
Layout = tuple[Item, ...]


class Transcoder(NamedTuple):
    """Functions that convert bytes in either direction. Both raise DeserializationError if the bytes are truncated.

    ``to_cdr(data, header)``: ``header`` is like CDR_HEADER, possibly with options set.
    """

    to_cdr: Callable[[bytes | memoryview, bytes], bytes]
    to_ros1: Callable[[bytes | memoryview], bytes]


def make_transcoder(name: str, layout: Layout) -> Transcoder:
    """Return the functions that convert messages with this layout; ``name`` is shown in tracebacks.

    Raise DefinitionError if Python cannot compile them.
    """
    to_cdr = _compiled(f"{name} to CDR", _Generator(is_cdr_source=False, swaps=False).function(layout))
    little = _compiled(f"{name} from CDR", _Generator(is_cdr_source=True, swaps=False).function(layout))
    big: list[Callable[..., bytes]] = []

    def to_ros1(data: bytes | memoryview) -> bytes:
        kind = bytes(data[:2])
        if kind == b"\0\1":
            return little(data)
        if kind != b"\0\0":
            raise DeserializationError(
                f"{name}: these bytes are not plain CDR version 1: they start with {bytes(data[:4]).hex()}"
            )
        if not big:
            # Generate this function on first use, because messages from a machine with the other byte order are rare.
            generated = _Generator(is_cdr_source=True, swaps=True).function(layout)
            big.append(_compiled(f"{name} from big-endian CDR", generated))
        return big[0](data)

    return Transcoder(to_cdr, to_ros1)


# --- alignment


class _Position(NamedTuple):
    """A position in CDR data, known only modulo ``modulus`` (1, 2, 4 or 8)."""

    modulus: int
    remainder: int

    def after(self, size: int) -> _Position:
        return _Position(self.modulus, (self.remainder + size) % self.modulus)

    def after_any(self, width: int) -> _Position:
        """Return the position after any number of items of ``width`` bytes."""
        modulus = min(self.modulus, width)
        return _Position(modulus, self.remainder % modulus)

    def aligned(self, width: int) -> _Position:
        return self.after(-self.remainder % width) if width <= self.modulus else _Position(width, 0)

    def padding(self, width: int) -> int | None:
        """Return the number of bytes to the next multiple of ``width``, or None if it depends on the message."""
        return -self.remainder % width if width <= self.modulus else None

    def or_(self, other: _Position) -> _Position:
        """Return a position that covers both ``self`` and ``other``."""
        modulus = min(self.modulus, other.modulus)
        while (self.remainder - other.remainder) % modulus:
            modulus //= 2
        return _Position(modulus, self.remainder % modulus)


_UNKNOWN = _Position(1, 0)


class _Walk:
    """Computes the positions in layouts, and caches them, because layouts are nested."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, _Position], _Position] = {}

    def after(self, layout: Layout, start: _Position) -> _Position:
        """Return the position after a layout, as far as it is known."""
        key = (id(layout), start)
        if key not in self._known:
            position = start
            for item in layout:
                position = self._after_item(item, position)
            self._known[key] = position
        return self._known[key]

    def in_loop(self, layout: Layout, start: _Position) -> _Position:
        """Return the positions before each element and after the last one, as far as they are known."""
        while True:
            both = start.or_(self.after(layout, start))
            if both == start:
                return start
            start = both

    def _after_item(self, item: Item, position: _Position) -> _Position:
        if item.side is Side.ROS1 or _is_nothing(item):
            return position
        if isinstance(item, Fixed):
            return position.aligned(item.width).after(item.width * item.number)
        if isinstance(item, Text):
            return _UNKNOWN
        if item.length is None:
            position = position.aligned(4).after(4)
        block = block_of(item.items)
        if block:
            return position.or_(position.aligned(block.width)).after_any(block.width)
        return self.in_loop(item.items, position)


class Block(NamedTuple):
    """Elements whose bytes are the same in CDR and ROS 1, without padding. Each has ``size`` bytes, aligned to ``width``."""

    width: int
    size: int


def _is_nothing(item: Item) -> bool:
    """Return whether an item has no bytes in either message, because it is an array of length 0."""
    return (isinstance(item, Fixed) and not item.number) or (isinstance(item, Sequence) and item.length == 0)


def block_of(layout: Layout) -> Block | None:
    """Return the size and alignment of this layout's elements, if all their bytes are the same in both messages."""
    offset, width = 0, 0
    for item in layout:
        if not isinstance(item, Fixed) or item.side is not Side.BOTH or offset % item.width:
            return None
        width = max(width, item.width)
        offset += item.width * item.number
    # Padding depends on the first member: if it is not the widest one, elements may need padding in between.
    if not offset or offset % width or not isinstance(layout[0], Fixed) or layout[0].width != width:
        return None
    return Block(width, offset)


def _least_size(layout: Layout, absent: Side) -> int:
    """Return a layout's minimum size, without padding, in a message of the type that lacks the items marked ``absent``."""
    size = 0
    for item in layout:
        if item.side is absent:
            continue
        if isinstance(item, Fixed):
            size += item.width * item.number
        elif isinstance(item, Text) or item.length is None:
            size += 4
        else:
            size += item.length * _least_size(item.items, absent)
    return size


# --- generated functions


class _Copy(NamedTuple):
    """Bytes to copy."""

    size: int


class _Swap(NamedTuple):
    """Numbers of ``width`` bytes to read, byte-swap and write."""

    width: int
    size: int


class _Skip(NamedTuple):
    """Bytes to skip."""

    size: int


class _Zeros(NamedTuple):
    """A run of zero-valued bytes (padding) to write."""

    size: int


class _Constant(NamedTuple):
    """Constant bytes to write."""

    value: bytes


class _Length(NamedTuple):
    """A length: the local variable to read it into, and the expression to write.

    The expression is None if the length is not written.
    """

    local: str
    written: str | None


_Token = Union[_Copy, _Swap, _Skip, _Zeros, _Constant, _Length]  # noqa: UP007 - evaluated
"""The generated function's operation on the next bytes. Do not compare tokens: named tuples of different classes may be
equal.
"""


class _Generator:
    """Generates one function. ``end`` is the position in the source; ``at`` is the position in the CDR being written."""

    def __init__(self, *, is_cdr_source: bool, swaps: bool) -> None:
        self._source = Source()
        self._is_cdr_source = is_cdr_source
        self._swaps = swaps
        self._absent = Side.ROS1 if is_cdr_source else Side.ROS2  # the side whose items the source lacks
        self._walk = _Walk()
        self._position = _Position(8, 0)
        # pending items; _flush() merges them and writes them in as few lines as possible
        self._tokens: list[_Token] = []

    def function(self, layout: Layout) -> str:
        line = self._source.line
        arguments = "data: Any" if self._is_cdr_source else "data: Any, header: bytes"
        with self._source.function(f"def transcode({arguments}) -> bytes:"):
            with self._source.block(f"if len(data) > {_LARGE}:"):
                line("# A slice of it is not a copy.")
                line("data = memoryview(data)")
            line(f"parts = [{'' if self._is_cdr_source else 'header'}]")
            line(f"end = {4 if self._is_cdr_source else 0}")
            if not self._is_cdr_source:
                line("at = 0")
            with self._source.block("try:"):
                line("add = parts.append")
                self._items(layout)
                self._flush()
            # On 32-bit Python an offset of 2 GiB or more raises an OverflowError.
            with self._source.block("except (struct.error, OverflowError) as error:"):
                line('raise DeserializationError("the message ends too early") from error')
            with self._source.block("if end > len(data):"):
                line('raise DeserializationError("the message ends too early")')
            if not self._is_cdr_source:
                with self._source.block("if end < len(data):"):
                    line('raise DeserializationError(f"{len(data) - end} bytes follow the message")')
            line('return b"".join(parts)')

        head = ["from __future__ import annotations", "", "import struct", "from typing import Any", ""]
        head += [f"{alias} = struct.Struct({letters!r})" for letters, alias in self._source.structs.items()]
        return "\n".join([*head, "", "", *self._source.lines, ""])

    # --- items

    def _items(self, layout: Layout) -> None:
        for item in layout:
            if _is_nothing(item):
                continue
            if isinstance(item, Fixed):
                self._fixed(item)
            elif isinstance(item, Text):
                self._text(item)
            else:
                self._sequence(item)

    def _fixed(self, item: Fixed) -> None:
        size = item.width * item.number
        if item.side is not Side.ROS1:
            self._align(item.width)
            self._position = self._position.after(size)
        if item.side is Side.BOTH:
            if self._swaps and item.width > 1:
                self._tokens.append(_Swap(item.width, size))
            else:
                self._tokens.append(_Copy(size))
        elif self._is_read(item):
            self._tokens.append(_Skip(size))
        else:
            self._tokens.append(_Zeros(size))

    def _text(self, item: Text) -> None:
        has_cdr = item.side is not Side.ROS1
        if has_cdr:
            self._align(4)
            self._position = _UNKNOWN
        if not self._is_read(item):
            # Write an empty string; in CDR it consists of a NUL.
            self._tokens.append(_Zeros(4) if self._is_cdr_source else _Constant(b"\1\0\0\0\0"))
            return

        count = self._length(item.side, is_text=True)
        if self._is_cdr_source and has_cdr:
            if item.side is Side.BOTH:
                self._source.line(f"add(data[end : end + {count} - 1])")
            self._source.line(f"end += {count}")
        elif item.side is Side.BOTH:
            self._source.line(f"add(data[end : (end := end + {count})])")
            self._source.line(f"at += {count}")
            self._tokens.append(_Zeros(1))
        else:
            self._source.line(f"end += {count}")

    def _sequence(self, item: Sequence) -> None:
        has_cdr = item.side is not Side.ROS1
        if item.length is not None:
            count = str(item.length)
        else:
            if has_cdr:
                self._align(4)
                self._position = self._position.after(4)
            if not self._is_read(item):
                self._tokens.append(_Zeros(4))
                return
            count = self._length(item.side, is_text=False)
        self._flush()

        block = block_of(item.items)
        if block and item.side is Side.BOTH and (not self._swaps or len(item.items) == 1):
            self._block(block, count, is_fixed=item.length is not None)
            return
        self._loop(item, count)

    def _block(self, block: Block, count: str, *, is_fixed: bool) -> None:
        """Generate one slice for elements whose bytes are the same in both messages."""
        line = self._source.line
        start = self._position

        def write() -> None:
            self._align(block.width)
            self._flush()
            size = _times(count, block.size)
            part = f"data[end : (end := end + {size})]"
            line(f"add(_swapped({part}, {block.width}))" if self._swaps else f"add({part})")
            if not self._is_cdr_source:
                line(f"at += {size}")

        if is_fixed or start.padding(block.width) == 0:
            write()
        else:
            # No padding follows an empty sequence.
            with self._source.block(f"if {count}:"):
                write()
        self._position = start.or_(start.aligned(block.width)).after_any(block.width)

    def _loop(self, item: Sequence, count: str) -> None:
        line = self._source.line
        if self._is_read(item):
            least = _least_size(item.items, self._absent)
            left = "len(data) - end" if least else f"len(data) + {_SPARE}"
            with self._source.block(f"if {_times(count, least or 1)} > {left}:"):
                line('raise DeserializationError("a length is longer than the message")')
        position = self._walk.in_loop(item.items, self._position)
        self._position = position
        with self._source.block(f"for _ in range({count}):"):
            self._items(item.items)
            self._flush()
            # The body of the loop is empty if the element's items have no bytes.
            line("pass")
        self._position = position

    # --- pieces

    def _is_read(self, item: Item) -> bool:
        return item.side is not self._absent

    def _align(self, width: int) -> None:
        padding = self._position.padding(width)
        self._position = self._position.aligned(width)
        if padding == 0:
            return
        if padding is not None:
            self._tokens.append(_Skip(padding) if self._is_cdr_source else _Zeros(padding))
            return
        mask = width - 1
        if self._is_cdr_source:
            self._flush()
            self._source.line(f"end += {'4 ' if width == 8 else ''}-end & {mask}")
            return
        last = self._tokens[-1] if self._tokens else None
        if isinstance(last, _Zeros) and last.size == 1:
            # Remove the tokens for a string's NUL and for the padding after it.
            self._tokens.pop()
            self._flush()
            self._source.line(f"add(_NUL[~at & {mask}])")
            self._source.line(f"at += (~at & {mask}) + 1")
            return
        self._flush()
        self._source.line(f"add(_PADDING[-at & {mask}])")
        self._source.line(f"at += -at & {mask}")

    def _length(self, side: Side, *, is_text: bool) -> str:
        """Generate code that reads the pending tokens and then a length; return the name of the length's variable.

        The code writes the length if both messages have it. In CDR a string's length includes the trailing NUL.
        """
        count = self._source.local("count")
        if side is not Side.BOTH:
            written = None
        elif not is_text:
            written = count
        else:
            written = f"{count} and {count} - 1" if self._is_cdr_source else f"{count} + 1"
        self._tokens.append(_Length(count, written))
        self._flush()
        return count

    def _flush(self) -> None:
        """Generate the lines of code for the pending tokens."""
        tokens, self._tokens = _joined(self._tokens), []
        if not tokens:
            return
        line = self._source.line
        read, write, targets, values = "", "", [], []
        read_size = write_size = 0
        for token in tokens:
            match token:
                case _Copy(size) | _Swap(_, size):
                    piece = self._source.local("piece")
                    read += f"{size}s"
                    write += f"{size}s"
                    targets.append(piece)
                    values.append(f"_swapped({piece}, {token.width})" if isinstance(token, _Swap) else piece)
                    read_size, write_size = read_size + size, write_size + size
                case _Skip(size):
                    read += f"{size}x"
                    read_size += size
                case _Zeros(size):
                    write += f"{size}x"
                    write_size += size
                case _Constant(value):
                    write += f"{len(value)}s"
                    values.append(repr(value))
                    write_size += len(value)
                case _Length(local, written):
                    read += "I"
                    targets.append(local)
                    read_size += 4
                    if written is not None:
                        write += "I"
                        write_size += 4
                        values.append(written)

        if read == write and len(targets) == 1 and values == targets and read.endswith("s"):
            line(f"add(data[end : (end := end + {read_size})])")
            if not self._is_cdr_source:
                line(f"at += {write_size}")
            return
        if targets:
            order = ">" if self._swaps else "<"
            comma = "," if len(targets) == 1 else ""
            struct_ = self._struct(order, read)
            line(f"{', '.join(targets)}{comma} = {struct_}.unpack_from(data, end)")
        if read_size:
            line(f"end += {read_size}")
        if values:
            line(f"add({self._struct('<', write)}.pack({', '.join(values)}))")
        elif write_size:
            line(f"add({bytes(write_size)!r})" if write_size <= _SPELLED else f"add(bytes({write_size}))")
        if write_size and not self._is_cdr_source:
            line(f"at += {write_size}")

    def _struct(self, order: str, letters: str) -> str:
        alias = "_struct_" + ("big_" if order == ">" else "") + letters
        return self._source.structs.setdefault(order + letters, alias)


_LARGE = 4096
_SPELLED = 16


def _joined(tokens: list[_Token]) -> list[_Token]:
    """Return the tokens with adjacent ones of the same kind merged."""
    found: list[_Token] = []
    for token in tokens:
        last = found[-1] if found else None
        if isinstance(token, _Copy | _Skip | _Zeros) and isinstance(last, type(token)):
            found[-1] = token._replace(size=last.size + token.size)
        else:
            found.append(token)
    return found


def _times(count: str, size: int) -> str:
    if count.isdigit():
        return str(int(count) * size)
    return count if size == 1 else f"{size} * {count}"


def _swapped(data: bytes | memoryview, width: int) -> bytes:
    """Return numbers of ``width`` bytes with their byte order reversed."""
    if width == 1:
        return bytes(data)
    if len(data) % width:
        raise DeserializationError("the message ends too early")
    values = array({2: "H", 4: "I", 8: "Q"}[width], bytes(data))
    values.byteswap()
    return values.tobytes()


_NUL = tuple(bytes(count + 1) for count in range(8))
_PADDING = tuple(bytes(count) for count in range(8))


def _compiled(name: str, source: str) -> Callable[..., bytes]:
    """Execute the source of a function. It contains only sizes and names generated here, and no text from a definition."""
    file = f"<generated {name}>"
    names: dict[str, object] = {
        "DeserializationError": DeserializationError,
        "_NUL": _NUL,
        "_PADDING": _PADDING,
        "_swapped": _swapped,
    }
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
    try:
        exec(compile(source, file, "exec"), names)
    except (SyntaxError, RecursionError, MemoryError, OverflowError, struct.error) as error:
        raise DefinitionError(name, 1, f"Python cannot make a function of it: {error}") from error
    found = cast("Callable[..., bytes]", names["transcode"])
    weakref.finalize(found, linecache.cache.pop, file, None).atexit = False
    return found
