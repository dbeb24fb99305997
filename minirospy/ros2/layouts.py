"""Computes the layout common to a message's ROS 1 and ROS 2 specs, or the reason why there is none. Pure.

A ROS 2 spec is written as a ROS 1 spec: numeric types have their ROS 1 names, and times are ``builtin_interfaces/Time``.
"""

from __future__ import annotations

from collections.abc import Iterator

from minirospy.base.errors import BridgeError, DefinitionError
from minirospy.core.idl.cdr import (
    CDR_HEADER,
    Fixed,
    Item,
    Layout,
    Sequence,
    Side,
    Text,
    Transcoder,
    make_transcoder,
)
from minirospy.core.idl.digest import Lookup
from minirospy.core.idl.spec import Field, FieldType, MessageSpec
from minirospy.core.idl.validate import MAX_LEVELS, check_types
from minirospy.ros2.field_order import Array, Node, Reordered, inverse, reorder
from minirospy.ros2.field_order import Fixed as Wide
from minirospy.ros2.field_order import Text as String
from minirospy.ros2.rules import Rules, TypeRule, snake_case

__all__ = ["TypesDiffer", "layout_of", "ros2_field_type", "ros2_spec", "transcoder"]


class TypesDiffer(BridgeError):
    """Raised if a type cannot be bridged, because it is missing or incompatible on one side; the message states the reason."""


_WIDTHS = {
    "bool": 1, "int8": 1, "uint8": 1, "byte": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "int64": 8,
    "uint64": 8, "float32": 4, "float64": 8,
}  # fmt: skip
_SAME = {"char": "uint8"}
_ALIKE = {("byte", "uint8"), ("byte", "int8")}
_OF_ROS2 = {"boolean": "bool", "octet": "byte", "float": "float32", "double": "float64", "char": "uint8"}
_TIMES = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}
_TIME = Fixed(4, 2)
_DUMMY = "structure_needs_at_least_one_member"
_MAX_ITEMS = 8_000


def ros2_spec(full_name: str, fields: dict[str, str]) -> MessageSpec:
    """Return a type's spec, built from its fields as ``get_fields_and_field_types()`` of its ROS 2 class returns them.

    ``full_name`` is ``pkg/Name``. Raise TypesDiffer if a field's type does not exist in ROS 1.
    """
    package, _, name = full_name.partition("/")
    found = [Field(each, ros2_field_type(text)) for each, text in fields.items() if each != _DUMMY]
    return MessageSpec(package, name, tuple(found), (), "")


def ros2_field_type(text: str) -> FieldType:
    """Parse the type of a ROS 2 field, such as ``sequence<double, 3>``, ``uint8[16]`` or ``std_msgs/Header``.

    Raise TypesDiffer if ROS 1 has no such type.
    """
    if text.startswith("sequence<") and text.endswith(">"):
        inner = text[len("sequence<") : -1]
        head, comma, bound = inner.rpartition(",")
        return FieldType(_base(head if comma and bound.strip().isdigit() else inner, text), True)
    base, bracket, length = text.partition("[")
    return FieldType(_base(base, text), bool(bracket), int(length[:-1]) if bracket else None)


def _base(text: str, whole: str) -> str:
    base = text.strip()
    if base.startswith("string"):
        return "string"
    base = _OF_ROS2.get(base, base)
    if base in _WIDTHS or "/" in base:
        parts = base.split("/")
        return f"{parts[0]}/{parts[-1]}" if "/" in base else base
    raise TypesDiffer(f"ROS 1 has no type like [{whole}]")


def transcoder(
    ros1: MessageSpec, ros1_lookup: Lookup, ros2: MessageSpec, ros2_lookup: Lookup, rules: Rules
) -> Transcoder:
    """Return functions that convert a ROS 1 type to a ROS 2 type and back. Raise TypesDiffer if no layout fits both."""
    layout = layout_of(ros1, ros1_lookup, ros2, ros2_lookup, rules)
    try:
        made = make_transcoder(ros1.full_name, layout)
    except DefinitionError as error:
        raise TypesDiffer(str(error)) from error
    order = _Ordering(ros1_lookup, ros2_lookup, rules).message(ros1, ros2)
    if order is not None:
        made = _in_order(made, order)
    return _with_levels(made) if ros1.full_name == "rosgraph_msgs/Log" else made


def layout_of(
    ros1: MessageSpec, ros1_lookup: Lookup, ros2: MessageSpec, ros2_lookup: Lookup, rules: Rules
) -> Layout:
    """Return the layout of a message: ROS 1's fields in ROS 2's order. Raise TypesDiffer if no layout fits both types."""
    try:
        check_types(ros1, ros1_lookup)
    except DefinitionError as error:
        raise TypesDiffer(str(error)) from error
    return _Pairing(ros1_lookup, ros2_lookup, rules).message(ros1, ros2, ())


class _Pairing:
    """Pairs the fields of a ROS 1 and a ROS 2 spec, recursively."""

    def __init__(self, ros1_lookup: Lookup, ros2_lookup: Lookup, rules: Rules) -> None:
        self._ros1 = ros1_lookup
        self._ros2 = ros2_lookup
        self._rules = rules
        self._items = 0

    def message(self, ros1: MessageSpec, ros2: MessageSpec, around: tuple[str, ...]) -> Layout:
        self._enter(around)
        rule = self._rules.message(ros1.full_name)
        fields1 = _inlined(ros1, rule, self._ros1)
        pairs = _paired(ros1.full_name, fields1, ros2, rule)
        order = {each.name: number for number, each in enumerate(ros2.fields)}

        items: list[Item] = []
        place = 0
        for each in (fields1[number] for number in _order(fields1, pairs, ros2)):
            partner = pairs.get(each.name)
            if partner is None:
                items += self._alone(each.type, Side.ROS1, around)
                continue
            number = order[partner.name]
            for skipped in ros2.fields[place:number]:
                items += self._alone(skipped.type, Side.ROS2, around)
            where = f"[{each.name}] of [{ros1.full_name}]"
            items += self._field(each.type, partner.type, where, (*around, ros2.full_name))
            place = number + 1
        for skipped in ros2.fields[place:]:
            items += self._alone(skipped.type, Side.ROS2, around)
        if not ros2.fields:
            # CDR does not allow empty structs, so rosidl adds a member to them.
            items.append(Fixed(1, side=Side.ROS2))
        self._items += len(items)
        return tuple(items)

    def _field(self, ros1: FieldType, ros2: FieldType, where: str, around: tuple[str, ...]) -> list[Item]:
        if ros1.is_array != ros2.is_array or ros1.length != ros2.length:
            raise TypesDiffer(f"{where} is a [{ros1}], in ROS 2 a [{ros2}]")
        return _repeated(self._single(ros1, ros2, where, around), ros1, Side.BOTH)

    def _single(self, ros1: FieldType, ros2: FieldType, where: str, around: tuple[str, ...]) -> Layout:
        base = _SAME.get(ros1.base, ros1.base)
        if base in _WIDTHS and (ros2.base == base or (base, ros2.base) in _ALIKE):
            return (Fixed(_WIDTHS[base]),)
        if base == "string" and ros2.base == "string":
            return (Text(),)
        if base in _TIMES and ros2.base == _TIMES[base]:
            return (_TIME,)
        if ros1.is_primitive or ros2.is_primitive:
            raise TypesDiffer(f"{where} is a [{ros1}], in ROS 2 a [{ros2}]")
        return self.message(self._ros1(ros1.base), self._ros2(ros2.base), around)

    def _alone(self, type_: FieldType, side: Side, around: tuple[str, ...]) -> list[Item]:
        """Return the layout items for a field that exists on only one side."""
        self._enter(around)
        base = _SAME.get(type_.base, type_.base)
        one: Layout
        if base in _WIDTHS:
            one = (Fixed(_WIDTHS[base], side=side),)
        elif base == "string":
            one = (Text(side),)
        elif base in _TIMES:
            one = (Fixed(4, 2, side),)
        else:
            spec = (self._ros1 if side is Side.ROS1 else self._ros2)(base)
            inner = (*around, base)
            one = tuple(item for each in spec.fields for item in self._alone(each.type, side, inner))
            if side is Side.ROS2 and not one:
                one = (Fixed(1, side=side),)
        self._items += len(one)
        return _repeated(one, type_, side)

    def _enter(self, around: tuple[str, ...]) -> None:
        if len(around) > MAX_LEVELS or self._items > _MAX_ITEMS:
            raise TypesDiffer(f"[{around[0]}] is too large, or nested too deeply")


class _Ordering:
    """Determines the order of the fields in two specs that :class:`_Pairing` has accepted, recursively."""

    def __init__(self, ros1_lookup: Lookup, ros2_lookup: Lookup, rules: Rules) -> None:
        self._ros1 = ros1_lookup
        self._ros2 = ros2_lookup
        self._rules = rules
        self._is_changed = False

    def message(self, ros1: MessageSpec, ros2: MessageSpec) -> Reordered | None:
        """Return how to reorder ROS 1's fields to ROS 2's order, or None if both orders are equal."""
        found = self._message(ros1, ros2)
        return found if self._is_changed else None

    def _message(self, ros1: MessageSpec, ros2: MessageSpec) -> Reordered:
        rule = self._rules.message(ros1.full_name)
        fields = _inlined(ros1, rule, self._ros1)
        pairs = _paired(ros1.full_name, fields, ros2, rule)
        order = _order(fields, pairs, ros2)
        self._is_changed |= order != tuple(range(len(fields)))
        nodes = []
        for each in fields:
            partner = pairs.get(each.name)
            nodes.append(self._node(each.type, partner.type if partner else None))
        return Reordered(tuple(nodes), order)

    def _node(self, ros1: FieldType, ros2: FieldType | None) -> Node:
        base = _SAME.get(ros1.base, ros1.base)
        one: Node
        if base in _WIDTHS:
            one = Wide(_WIDTHS[base])
        elif base in _TIMES:
            one = Wide(8)
        elif base == "string":
            one = String()
        elif ros2 is not None:
            one = self._message(self._ros1(base), self._ros2(ros2.base))
        else:
            fields = self._ros1(base).fields
            one = Reordered(tuple(self._node(each.type, None) for each in fields), tuple(range(len(fields))))
        return Array(one, ros1.length) if ros1.is_array else one


def _in_order(made: Transcoder, order: Reordered) -> Transcoder:
    """Wrap conversion functions so that ROS 1 messages have ROS 1's field order."""
    back = inverse(order)

    def to_cdr(data: bytes | memoryview, header: bytes = CDR_HEADER) -> bytes:
        return made.to_cdr(reorder(order, data), header)

    def to_ros1(data: bytes | memoryview) -> bytes:
        return reorder(back, made.to_ros1(data))

    return Transcoder(to_cdr, to_ros1)


def _inlined(spec: MessageSpec, rule: TypeRule, lookup: Lookup) -> tuple[Field, ...]:
    """Return ROS 1's fields; replace an inlined field with the fields that it contains."""
    found: list[Field] = []
    for each in spec.fields:
        if each.name != rule.inlined:
            found.append(each)
        elif each.type.base in _TIMES:
            found += [Field("sec", FieldType("int32")), Field("nanosec", FieldType("uint32"))]
        else:
            found += lookup(each.type.base).fields
    return tuple(found)


def _order(fields: tuple[Field, ...], pairs: dict[str, Field], ros2: MessageSpec) -> tuple[int, ...]:
    """Return the indices of ROS 1's fields in ROS 2's order. A field missing in ROS 2 follows its predecessor."""
    places = {each.name: number for number, each in enumerate(ros2.fields)}
    keys = []
    place = -1
    for each in fields:
        partner = pairs.get(each.name)
        place = places[partner.name] if partner else place
        keys.append(place)
    return tuple(sorted(range(len(fields)), key=keys.__getitem__))


def _repeated(one: Layout, type_: FieldType, side: Side) -> list[Item]:
    if not type_.is_array:
        return list(one)
    if type_.length is not None and len(one) == 1 and isinstance(one[0], Fixed):
        return [Fixed(one[0].width, one[0].number * type_.length, one[0].side)]
    return [Sequence(one, type_.length, side)]


def _paired(ros1_name: str, fields: tuple[Field, ...], ros2: MessageSpec, rule: TypeRule) -> dict[str, Field]:
    """Return the ROS 2 field for each ROS 1 field, keyed by name. Raise TypesDiffer if a required field is missing."""
    names = {each.name: each for each in ros2.fields}
    if rule.fields is not None:
        known = {each.name for each in fields}
        for one, other in rule.fields.items():
            if one not in known:
                raise TypesDiffer(f"a rule names [{one}], which [{ros1_name}] lacks in ROS 1")
            if other not in names:
                raise TypesDiffer(f"a rule names [{other}], which [{ros2.full_name}] lacks in ROS 2")
        return {one: names[other] for one, other in rule.fields.items()}

    found: dict[str, Field] = {}
    for each in fields:
        if each.name in rule.only_ros1:
            continue
        partner = next((names[name] for name in _spellings(each.name) if name in names), None)
        if partner is None:
            raise TypesDiffer(f"[{ros2.full_name}] lacks the field [{each.name}] in ROS 2")
        found[each.name] = partner
    used = {each.name for each in found.values()}
    if len(used) < len(found):
        raise TypesDiffer(f"two fields of [{ros1_name}] have one name in ROS 2")
    for each in ros2.fields:
        if each.name not in used and each.name not in rule.only_ros2:
            raise TypesDiffer(f"[{ros1_name}] lacks the field [{each.name}] in ROS 1")
    return found


def _spellings(name: str) -> Iterator[str]:
    yield name
    yield snake_case(name)
    yield name.lower()


# --- rosgraph_msgs/Log

_LEVEL = 12  # offset of the level in the CDR of a log message, after the CDR header and the time
_LEVELS_OF_ROS2 = {1: 10, 2: 20, 4: 30, 8: 40, 16: 50}
_LEVELS_OF_ROS1 = {level: ros1 for ros1, level in _LEVELS_OF_ROS2.items()}


def _with_levels(made: Transcoder) -> Transcoder:
    """Wrap conversion functions so that they map log levels, which are single bits in ROS 1."""

    def to_cdr(data: bytes | memoryview, header: bytes = CDR_HEADER) -> bytes:
        found = bytearray(made.to_cdr(data, header))
        found[_LEVEL] = _LEVELS_OF_ROS2.get(found[_LEVEL], found[_LEVEL])
        return bytes(found)

    def to_ros1(data: bytes | memoryview) -> bytes:
        changed = bytearray(data)
        if len(changed) > _LEVEL:
            changed[_LEVEL] = _LEVELS_OF_ROS1.get(changed[_LEVEL], changed[_LEVEL])
        return made.to_ros1(bytes(changed))

    return Transcoder(to_cdr, to_ros1)
