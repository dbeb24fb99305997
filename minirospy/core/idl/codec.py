"""Generate a message's ``serialize`` and ``deserialize`` as straight-line Python code.

The fields are in byte order, with nested messages expanded. Consecutive fixed-size values, and the length of the
following field, share one compiled ``struct``; an array of fixed-size messages is read by one ``iter_unpack``. Reading
never goes beyond the data: ``struct`` raises, a slice that is too short is detected at the end, and the number of
elements is checked before the loop if they consist of slices or have no bytes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

from minirospy.core.idl.digest import Lookup
from minirospy.core.idl.source import Source, python_name
from minirospy.core.idl.spec import PRIMITIVES, Field, FieldType, MessageSpec

__all__ = ["bytes_after_array", "keeps_buffer", "lazy_arrays", "write_deserialize", "write_serialize"]

_BYTES = {"b": 1, "B": 1, "h": 2, "H": 2, "i": 4, "I": 4, "q": 8, "Q": 8, "f": 4, "d": 8}
_SPARE = 10_000  # maximum number of zero-size elements, in addition to one per byte of the message
_TIMES = {"time": "_Time", "duration": "_Duration"}


class _Leaf(NamedTuple):
    """A field of a basic type; leaves are in the order of their bytes.

    ``path`` is the Python expression for reading or assigning it.
    """

    path: str
    type: FieldType

    @property
    def letters(self) -> str:
        """The field's format characters for ``struct`` if it has a fixed size, else ""."""
        if not self.type.is_array:
            return PRIMITIVES[self.type.base]
        return f"{self.type.length}s" if self.type.is_bytes and self.type.length else ""

    @property
    def has_length(self) -> bool:
        """Return whether the field's bytes start with a length."""
        return not self.letters and self.type.length is None

    @property
    def is_numbers(self) -> bool:
        """Return whether the field is an array that ``struct`` packs with a single call."""
        return self.type.is_array and not self.type.is_bytes and len(PRIMITIVES.get(self.type.base, "")) == 1

    def values(self) -> list[str]:
        """Return the expressions for the field's values, as ``struct`` packs them."""
        if self.type.base in _TIMES:
            return [f"{self.path}.secs", f"{self.path}.nsecs"]
        return [self.path]

    def packed(self) -> list[str]:
        """Return the expressions to pack; ``struct`` rejects numpy's bool, but accepts the sum of a numpy bool and an integer."""
        return [f"{self.path} + 0"] if self.type.base == "bool" and not self.type.is_array else self.values()


class _Chunk(NamedTuple):
    """Consecutive fixed-size fields, and the following field of another kind."""

    run: tuple[_Leaf, ...]
    tail: _Leaf | None


def keeps_buffer(spec: MessageSpec, lookup: Lookup) -> bool:
    """Return whether a message may be large and consist mostly of bytes, so that it should not be copied as a whole."""
    return any(
        (field.type.is_array and field.type.base in ("uint8", "char", "int8", "byte"))
        or (not field.type.is_primitive and keeps_buffer(lookup(field.type.base), lookup))
        for field in spec.fields
    )


def bytes_after_array(spec: MessageSpec, lookup: Lookup) -> int | None:
    """Return the number of bytes after a message's last field of variable length if that is a byte array, else None.

    A message with such a number may be sent in parts, as a split frame (``core/wire/framing``), because ``deserialize``
    reads the array and the fields after it by slices.
    """
    chunks = list(_chunks(spec.fields, "", lookup))
    letters = ""
    if chunks and chunks[-1].tail is None:
        letters = "".join(leaf.letters for leaf in chunks.pop().run)
    last = chunks[-1].tail if chunks else None
    return _size(letters) if last and last.has_length and last.type.is_bytes else None


def lazy_arrays(spec: MessageSpec) -> dict[str, str]:
    """Return the format characters of the fields that stay bytes until they are read: number arrays of any length."""
    return {
        python_name(field.name): PRIMITIVES[field.type.base]
        for field in spec.fields
        if field.type.is_array
        and field.type.length is None
        and len(PRIMITIVES.get(field.type.base, "")) == 1
        and not field.type.is_bytes
        and field.type.base != "bool"
    }


def write_serialize(source: Source, spec: MessageSpec, lookup: Lookup) -> None:
    """Add the method ``serialize``."""
    with source.function("def serialize(self, buff: Any) -> None:"):
        source.line('"""Write the message. Raise genpy.SerializationError."""')
        if list(_leaves(spec.fields, "", lookup)):
            with source.block("try:"):
                if not _is_fixed(spec, lookup):
                    source.line("write = buff.write")
                    write = "write"
                else:
                    write = "buff.write"
                _Writer(source, lookup, write).fields(spec.fields, "self")
            with source.block(
                "except (struct.error, TypeError, AttributeError, ValueError, OverflowError) as error:"
            ):
                source.line("self._check_types(error)")


def write_deserialize(source: Source, spec: MessageSpec, lookup: Lookup) -> None:
    """Add the method ``deserialize``."""
    with source.function(f"def deserialize(self, data: Any) -> {spec.name}:"):
        source.line('"""Read the message from bytes. Raise genpy.DeserializationError."""')
        if spec.fields:
            with source.block("try:"):
                _Reader(source, lookup, keeps_buffer(spec, lookup)).message(spec)
            # On 32-bit Python an offset of 2 GiB or more raises an OverflowError.
            with source.block("except (struct.error, OverflowError) as error:"):
                source.line("raise genpy.DeserializationError(error) from error")
        source.line("return self")


# --- layout


def _leaves(fields: tuple[Field, ...], path: str, lookup: Lookup) -> Iterator[_Leaf]:
    for field in fields:
        inner = f"{path}.{python_name(field.name)}"
        if field.type.is_array or field.type.is_primitive:
            yield _Leaf(inner, field.type)
        else:
            yield from _leaves(lookup(field.type.base).fields, inner, lookup)


def _chunks(fields: tuple[Field, ...], path: str, lookup: Lookup) -> Iterator[_Chunk]:
    run: list[_Leaf] = []
    for leaf in _leaves(fields, path, lookup):
        if leaf.letters:
            run.append(leaf)
        else:
            yield _Chunk(tuple(run), leaf)
            run = []
    if run:
        yield _Chunk(tuple(run), None)


def _is_fixed(spec: MessageSpec, lookup: Lookup) -> bool:
    """Return whether a message has a known, fixed size above zero."""
    leaves = list(_leaves(spec.fields, "", lookup))
    return bool(leaves) and all(leaf.letters for leaf in leaves)


def _size(letters: str) -> int:
    """Return the size in bytes for some format characters; a number before ``s`` counts bytes."""
    size, count = 0, ""
    for letter in letters:
        if letter.isdigit():
            count += letter
        else:
            size, count = size + (int(count) if letter == "s" else _BYTES[letter]), ""
    return size


def _least_size(spec: MessageSpec, lookup: Lookup) -> int:
    """Return a message's minimum size in bytes."""
    size = 0
    for leaf in _leaves(spec.fields, "", lookup):
        if leaf.letters:
            size += _size(leaf.letters)
        elif leaf.has_length:
            size += 4
        elif PRIMITIVES.get(leaf.type.base):
            size += _size(PRIMITIVES[leaf.type.base]) * (leaf.type.length or 0)
        elif leaf.type.base == "string":
            size += 4 * (leaf.type.length or 0)
        else:
            size += _least_size(lookup(leaf.type.base), lookup) * (leaf.type.length or 0)
    return size


def _has_elements_without_bytes(spec: MessageSpec, lookup: Lookup) -> bool:
    """Return whether any array in a message, at any level, has elements that may have no bytes."""
    return any(
        not field.type.is_primitive
        and (
            (field.type.is_array and not _least_size(lookup(field.type.base), lookup))
            or _has_elements_without_bytes(lookup(field.type.base), lookup)
        )
        for field in spec.fields
    )


# --- writing


class _Writer:
    """Generates the lines that pass the fields' bytes to ``write``."""

    def __init__(self, source: Source, lookup: Lookup, write: str) -> None:
        self._source = source
        self._lookup = lookup
        self._write = write

    def fields(self, fields: tuple[Field, ...], path: str) -> None:
        for run, tail in _chunks(fields, path, self._lookup):
            name = self._prepared(tail) if tail else ""
            letters = "".join(leaf.letters for leaf in run)
            values = [value for leaf in run for value in self._fixed(leaf)]
            if tail and tail.has_length and not tail.is_numbers:
                letters += "I"
                values.append(f"len({name})")
            if letters:
                self._line(f"{self._write}({self._pack(letters, values)})")
            if tail:
                self._tail(tail, name)

    def _line(self, text: str) -> None:
        self._source.line(text)

    def _pack(self, letters: str, values: list[str]) -> str:
        """Return source code that packs values. If it packs several fields of a nested message, it looks up that message once."""
        owners = [value.rpartition(".")[0] for value in values]
        uses = Counter(owners)
        names: dict[str, str] = {}
        arguments = []
        for value, owner in zip(values, owners, strict=True):
            if "." not in owner or uses[owner] == 1:
                arguments.append(value)
                continue
            source = names.get(owner)
            if source is None:
                names[owner] = self._source.local(owner.rpartition(".")[2])
                source = f"({names[owner]} := {owner})"
            arguments.append(f"{source}{value.removeprefix(owner)}")
        return f"{self._source.struct(letters)}.pack({', '.join(arguments)})"

    def _fixed(self, leaf: _Leaf) -> list[str]:
        """Return the values of a fixed-size field. Check the length of byte arrays, because struct does not."""
        if not leaf.type.is_array:
            return leaf.packed()
        name = self._bytes(leaf)
        with self._source.block(f"if len({name}) != {leaf.type.length}:"):
            field = leaf.path.rpartition(".")[2]
            self._line(
                f'raise ValueError(f"{field} has {{len({name})}} bytes instead of {leaf.type.length}")'
            )
        return [name]

    def _prepared(self, leaf: _Leaf) -> str:
        """Generate code that converts a field's value for writing, before its length; return the name of the variable for it."""
        if leaf.type.is_bytes:
            return self._bytes(leaf)
        name = self._source.local(leaf.path.rpartition(".")[2])
        if not leaf.type.is_array:
            return self._encoded(name, leaf.path)
        self._line(f"{name} = {leaf.path}")
        if leaf.type.length is not None:
            with self._source.block(f"if len({name}) != {leaf.type.length}:"):
                field = leaf.path.rpartition(".")[2]
                if leaf.is_numbers:
                    self._line(f'{name} = {self._source.use("_flat")}("{field}", {name}, {leaf.type.length})')
                else:
                    self._line(
                        f'raise ValueError(f"{field} has {{len({name})}} values instead of {leaf.type.length}")'
                    )
        return name

    def _encoded(self, name: str, path: str) -> str:
        self._line(f"{name} = {path}")
        with self._source.block(f"if not isinstance({name}, bytes):"):
            self._line(f"{name} = {name}.encode()")
        return name

    def _bytes(self, leaf: _Leaf) -> str:
        name = self._source.local(leaf.path.rpartition(".")[2])
        self._line(f"{name} = {leaf.path}")
        with self._source.block(f"if not isinstance({name}, bytes):"):
            self._line(f"{name} = {self._source.use('_octets')}({name})")
        return name

    def _tail(self, leaf: _Leaf, name: str) -> None:
        type_ = leaf.type
        if leaf.is_numbers and type_.length is None:
            self._line(f'{self._write}({self._source.use("_packed")}("{PRIMITIVES[type_.base]}", {name}))')
        elif leaf.is_numbers:
            self._line(
                f"{self._write}({self._source.struct(f'{type_.length}{PRIMITIVES[type_.base]}')}.pack(*{name}))"
            )
        elif not type_.is_array or type_.is_bytes:
            self._line(f"{self._write}({name})")
        elif type_.base == "string":
            self._strings(name)
        else:
            self._elements(type_, name)

    def _strings(self, name: str) -> None:
        one = self._source.local("text")
        with self._source.block(f"for {one} in {name}:"):
            with self._source.block(f"if not isinstance({one}, bytes):"):
                self._line(f"{one} = {one}.encode()")
            self._line(f"{self._write}({self._source.struct('I')}.pack(len({one})))")
            self._line(f"{self._write}({one})")

    def _elements(self, type_: FieldType, name: str) -> None:
        one = self._source.local("each")
        fields = (
            (Field(one, FieldType(type_.base)),) if type_.is_primitive else self._lookup(type_.base).fields
        )
        leaves = (
            [_Leaf(one, FieldType(type_.base))]
            if type_.is_primitive
            else [*_leaves(fields, one, self._lookup)]
        )
        if leaves and all(leaf.letters and not leaf.type.is_array for leaf in leaves):
            letters = "".join(leaf.letters for leaf in leaves)
            pack = self._pack(letters, [value for leaf in leaves for value in leaf.packed()])
            self._line(f'{self._write}(b"".join([{pack} for {one} in {name}]))')
        elif leaves:
            with self._source.block(f"for {one} in {name}:"):
                self.fields(fields, one)


# --- reading


class _Reader:
    """Generates the lines that read fields from ``data``, starting at ``end``."""

    def __init__(self, source: Source, lookup: Lookup, keeps_buffer: bool) -> None:
        self._source = source
        self._lookup = lookup
        self._keeps_buffer = keeps_buffer
        self._slices = False

    def message(self, spec: MessageSpec) -> None:
        lazy = {f"self.{name}": name for name in lazy_arrays(spec)}
        chunks = list(_chunks(spec.fields, "self", self._lookup))
        names = self._create(spec, "self")
        if not chunks:
            return
        if _is_fixed(spec, self._lookup):
            self._run(chunks[0], names, "data")
            return

        if not self._keeps_buffer:
            with self._source.block("if not isinstance(data, bytes):"):
                self._line("data = bytes(data)")

        self._line("end = 0")
        if _has_elements_without_bytes(spec, self._lookup):
            self._line(f"spare = len(data) + {_SPARE}")
        may_be_split = bytes_after_array(spec, self._lookup) is not None
        raw = self._fields(chunks, names, lazy, may_be_split=may_be_split)
        if self._slices:
            with self._source.block("if end > len(data):"):
                self._line('raise genpy.DeserializationError("the message ends too early")')

        if raw:
            # Delete the slots' values, so that reading a slot calls __getattr__.
            self._line(" = ".join(f"self.{name}" for name in raw) + " = []")
            self._line("del " + ", ".join(f"self.{name}" for name in raw))
            self._line("self._raw = {" + ", ".join(f'"{name}": {local}' for name, local in raw.items()) + "}")

    def _line(self, text: str) -> None:
        self._source.line(text)

    def _create(self, spec: MessageSpec, path: str, owner: str = "") -> dict[str, str]:
        """Generate code that creates the messages and times in the message at ``path``; return a dict from path to local name."""
        names = {}
        for field in spec.fields:
            if field.type.is_array or (field.type.is_primitive and field.type.base not in _TIMES):
                continue
            name = python_name(field.name)
            names[f"{path}.{name}"] = local = self._source.local(name)
            self._line(f"{owner or path}.{name} = {local} = {self._new(field.type.base)}")
            if not field.type.is_primitive:
                names |= self._create(self._lookup(field.type.base), f"{path}.{name}", local)
        return names

    def _new(self, base: str) -> str:
        class_ = self._source.use(_TIMES[base]) if base in _TIMES else self._source.class_(base)
        return f"{self._source.use('_new')}({class_})"

    def _fields(
        self,
        chunks: list[_Chunk],
        names: dict[str, str],
        lazy: dict[str, str] | None = None,
        *,
        may_be_split: bool = False,
    ) -> dict[str, str]:
        """Generate code that reads the fields; for a lazy array it only slices out the raw bytes.

        Return a dict from field name to the local name of its bytes. ``may_be_split``: ``data`` may be a split frame, of which
        only slices can be read after the last array.
        """
        raw: dict[str, str] = {}
        for chunk in chunks:
            tail = chunk.tail
            count = self._run(chunk, names, "" if may_be_split and tail is None else "data, end")
            if tail is None:
                continue
            if lazy and tail.path in lazy:
                width = _BYTES[PRIMITIVES[tail.type.base]]
                raw[lazy[tail.path]] = local = self._source.local(lazy[tail.path])
                self._line(f"{local} = {self._slice(_times(count, width), whole=True)}")
            else:
                self._tail(tail.type, self._target(tail.path, names), count)
        return raw

    def _target(self, path: str, names: dict[str, str]) -> str:
        owner, dot, name = path.rpartition(".")
        return f"{names.get(owner, owner)}{dot}{name}"

    def _run(self, chunk: _Chunk, names: dict[str, str], arguments: str) -> str:
        """Generate code that reads consecutive fixed-size fields and the length that follows.

        ``arguments``: those of ``unpack_from``, or "" to read a slice. Return the length's local name, or the length itself if
        it is constant.
        """
        letters = "".join(leaf.letters for leaf in chunk.run)
        targets = []

        for leaf in chunk.run:
            if leaf.type.base in _TIMES:
                time = names.get(leaf.path, leaf.path)
                targets += [f"{time}.secs", f"{time}.nsecs"]
            else:
                targets.append(self._target(leaf.path, names))

        count = ""

        if chunk.tail and chunk.tail.has_length:
            letters += "I"
            count = self._source.local("count")
            targets.append(count)
        elif chunk.tail:
            count = str(chunk.tail.type.length)

        if letters:
            comma = "," if len(targets) == 1 else ""
            size = _size(letters)
            unpack = f"unpack_from({arguments})" if arguments else f"unpack({self._slice(str(size))})"
            self._line(f"({', '.join(targets)}{comma}) = {self._source.struct(letters)}.{unpack}")
            if arguments == "data, end":
                self._line(f"end += {size}")
            for leaf in chunk.run:
                if leaf.type.base == "bool" and not leaf.type.is_array:
                    target = self._target(leaf.path, names)
                    self._line(f"{target} = bool({target})")

        return count

    def _slice(self, size: str, whole: bool = False) -> str:
        """Return an expression for the next ``size`` bytes.

        ``whole``: the message stores the bytes, so they must not reference the buffer.
        """
        self._slices = True
        part = f"data[end : (end := end + {size})]"
        return f"bytes({part})" if whole and self._keeps_buffer else part

    def _text(self, size: str) -> str:
        part = self._slice(size)
        return (
            f'str({part}, "utf-8", "replace")' if self._keeps_buffer else f'{part}.decode("utf-8", "replace")'
        )

    def _tail(self, type_: FieldType, target: str, count: str) -> None:
        letters = PRIMITIVES.get(type_.base, "")
        if not type_.is_array:
            self._line(f"{target} = {self._text(count)}")
        elif type_.is_bytes:
            self._line(f"{target} = {self._slice(count, whole=True)}")
        elif len(letters) == 1:
            self._numbers(type_, letters, target, count)
        else:
            self._elements(type_, target, count)

    def _numbers(self, type_: FieldType, letters: str, target: str, count: str) -> None:
        if type_.length is None:
            values = f'{self._source.use("_numbers")}("{letters}", {count}).unpack_from(data, end)'
        else:
            values = f"{self._source.struct(f'{count}{letters}')}.unpack_from(data, end)"
        self._line(f"{target} = {f'list(map(bool, {values}))' if type_.base == 'bool' else values}")
        self._line(f"end += {_times(count, _BYTES[letters])}")

    def _elements(self, type_: FieldType, target: str, count: str) -> None:
        spec = None if type_.is_primitive else self._lookup(type_.base)
        least = _least_size(spec, self._lookup) if spec else 0
        if spec and not least:
            # The elements have no bytes. Without this limit, a short message could claim any number of them.
            self._line(f"spare -= {count}")
            with self._source.block("if spare < 0:"):
                self._line('raise genpy.DeserializationError("a length is longer than the message")')

        values = self._source.local(target.rpartition(".")[2])
        self._line(f"{target} = {values} = []")

        if type_.base == "string":
            one = self._source.local("size")
            with self._source.block(f"for _ in range({count}):"):
                self._line(f"({one},) = {self._source.struct('I')}.unpack_from(data, end)")
                self._line("end += 4")
                self._line(f"{values}.append({self._text(one)})")
            return

        each = self._source.local("each")
        if spec is None or _is_fixed(spec, self._lookup):
            self._fixed_elements(type_.base, spec, values, each, count)
            return

        if least and type_.length is None:
            # The elements consist of slices; a slice that is too short is only detected at the end of the message.
            with self._source.block(f"if {_times(count, least)} > len(data) - end:"):
                self._line('raise genpy.DeserializationError("a length is longer than the message")')
        with self._source.block(f"for _ in range({count}):"):
            self._line(f"{each} = {self._new(type_.base)}")
            self._line(f"{values}.append({each})")
            names = self._create(spec, each)
            self._fields(list(_chunks(spec.fields, each, self._lookup)), names)

    def _fixed_elements(
        self, base: str, spec: MessageSpec | None, values: str, each: str, count: str
    ) -> None:
        """Generate one ``iter_unpack`` over the bytes of all elements, which have a fixed size."""
        leaves = list(_leaves(spec.fields, each, self._lookup)) if spec else [_Leaf(each, FieldType(base))]
        letters = "".join(leaf.letters for leaf in leaves)
        assigned = [
            (value, self._source.local(value.rpartition(".")[2]), leaf)
            for leaf in leaves
            for value in leaf.values()
        ]

        locals_ = ", ".join(local for _, local, _ in assigned)
        comma = "," if len(assigned) == 1 else ""
        block = self._slice(_times(count, _size(letters)))
        with self._source.block(
            f"for {locals_}{comma} in {self._source.struct(letters)}.iter_unpack({block}):"
        ):
            self._line(f"{each} = {self._new(base)}")
            self._line(f"{values}.append({each})")
            names = self._create(spec, each) if spec else {}
            for value, local, leaf in assigned:
                given = f"bool({local})" if leaf.type.base == "bool" and not leaf.type.is_array else local
                self._line(f"{self._target(value, names)} = {given}")


def _times(count: str, width: int) -> str:
    if count.isdigit():
        return str(int(count) * width)
    return count if width == 1 else f"{width} * {count}"
