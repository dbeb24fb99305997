"""Rules that convert a message from an old type to a new one. They are read from .bmr files, or generated from the two types.

Source: http://wiki.ros.org/rosbag/migration. A generated rule copies the fields whose name and type are equal; the rule is
valid if no field is lost or needs an invented value. Text from a bag is never executed.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from minirospy.base.errors import DefinitionError
from minirospy.core.idl.spec import PRIMITIVES, FieldType

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message

__all__ = [
    "BagMigrationException",
    "MessageUpdateRule",
    "Migrator",
    "clean_name",
    "constants_from_def",
    "copy_message",
    "get_message_key",
    "get_path_key",
    "make_new_half_rule",
    "make_old_half_rule",
    "make_update_rule",
    "migration_default_value",
    "qualified_name",
]

MessageClass = Any
"""A message class, or None. Untyped, because third-party .bmr files use such classes without annotations."""

Key = tuple[str, str]


class BagMigrationException(Exception):
    """Raised if a migration is impossible or a rule is used incorrectly."""


class _Step(Protocol):
    """A step on a migration path."""

    @property
    def rule(self) -> MessageUpdateRule:
        """Return the rule that converts one class to another."""


class Migrator(Protocol):
    """The methods of :class:`minirospy.ros.rosbag.migration.rules_files.MessageMigrator` that rules call."""

    rename_map: dict[str, set[str]]

    def find_path(self, old_class: MessageClass, new_class: MessageClass) -> Sequence[_Step]:
        """Return the steps that lead from one class to another."""

    def filter_rules_unique(self, rules: Sequence[MessageUpdateRule]) -> list[MessageUpdateRule]:
        """Return the rules without duplicates."""

    def migrate(self, msg_from: Message, msg_to: Message) -> None:
        """Fill a new message from an old one."""

    def migrate_array(self, msg_from_array: Sequence[Message], msg_to_array: Sequence[Message]) -> None:
        """Fill new messages from old ones."""


class MessageUpdateRule:
    """Base class of all rules. Subclasses set the class attributes and override :meth:`update`.

    ``order`` sorts the rules for a type; ``migrated_types`` contains the pairs (old, new) of field types that update()
    migrates.
    """

    old_type = ""
    old_full_text = ""
    new_type = ""
    new_full_text = ""
    migrated_types: Sequence[tuple[str, str]] = ()
    order = -1
    valid = False

    def __init__(self, migrator: Migrator, location: str) -> None:
        self.migrator = migrator
        self.location = location
        self.rename_rule = self.old_type != self.new_type
        self.old_types, self.old_class = _classes(self.old_type, self.old_full_text)
        self.new_types, self.new_class = _classes(self.new_type, self.new_full_text)
        self.old_md5sum: str = self.old_class._md5sum if self.old_class else ""
        self.new_md5sum: str = self.new_class._md5sum if self.new_class else ""
        self.sub_rules_done = False
        self.sub_rules_valid = False
        self.sub_rules: list[MessageUpdateRule] = []

    def find_sub_paths(self) -> None:
        """Find the rules for field types that need migration; print a warning for each type without a rule."""
        self.sub_rules_valid = True
        for old_name, new_name in self.migrated_types:
            try:
                old_class = self.get_old_class(old_name)
            except KeyError:
                self._warn(f"specified migrated type [{old_name}] not found in old message types")
                continue
            try:
                new_class = self.get_new_class(new_name)
            except KeyError:
                self._warn(f"specified migrated type [{new_name}] not found in new message types")
                continue

            if get_path_key(old_class, new_class) != get_path_key(self.old_class, self.new_class):
                self.sub_rules += [node.rule for node in self.migrator.find_path(old_class, new_class)]
            if not all(rule.valid for rule in self.sub_rules):
                self.sub_rules_valid = False
                print(
                    f"WARNING: Within rule [{self.location}] cannot migrate from subtype [{old_name}] to [{new_name}]..",
                    file=sys.stderr,
                )
        self.sub_rules = self.migrator.filter_rules_unique(self.sub_rules)
        self.sub_rules_done = True

    def get_new_class(self, t: str) -> MessageClass:
        """Return the new message's class for a field type. Raise KeyError if no field has this type."""
        return _class_named(t, self.new_types, self.new_type)

    def get_old_class(self, t: str) -> MessageClass:
        """Return the old message's class for a field type. Raise KeyError if no field has this type."""
        return _class_named(t, self.old_types, self.old_type)

    def migrate(self, msg_from: Message, msg_to: Message) -> None:
        """Fill a field of the new message from the old message's field. Call this in update().

        Raise BagMigrationException if the field's types are not in ``migrated_types``.
        """
        self._check_migrated(msg_from._type, msg_to._type)
        self.migrator.migrate(msg_from, msg_to)

    def migrate_array(
        self, msg_from_array: Sequence[Message], msg_to_array: list[Message], msg_to_name: str
    ) -> None:
        """Fill an array field of the new message from the old message's field. Call this in update().

        Raise BagMigrationException if the types are not in ``migrated_types``, KeyError if the new message does not use
        the type.
        """
        msg_to_class = self.get_new_class(msg_to_name)
        msg_to_array[:] = [msg_to_class() for _ in msg_from_array]
        if msg_from_array:
            self._check_migrated(msg_from_array[0]._type, msg_to_class._type)
            self.migrator.migrate_array(msg_from_array, msg_to_array)

    def get_class_def(self) -> str | None:
        """Return a generated rule's source code for a .bmr file, or None for other rules."""
        return None

    def apply(self, old_msg: Message) -> Message:
        """Convert an old message to a new one and return it.

        Raise BagMigrationException if the rule or the message's class is invalid.
        """
        if not self.valid:
            raise BagMigrationException("Attempted to apply an invalid rule")
        if not self.sub_rules_done:
            raise BagMigrationException("Attempted to apply a rule without building up its sub rules")
        if not self.sub_rules_valid:
            raise BagMigrationException("Attempted to apply a rule without valid sub-rules")
        if get_message_key(old_msg) != get_message_key(self.old_class):
            raise BagMigrationException(
                f"Attempted to apply rule to incorrect class {get_message_key(old_msg)} {get_message_key(self.old_class)}."
            )
        new_msg: Message = self.new_class()
        self.update(old_msg, new_msg)
        return new_msg

    def update(self, old_msg: Message, new_msg: Message) -> None:
        """Fill the new message; subclasses override this method. The base class raises BagMigrationException."""
        raise BagMigrationException("Tried to use rule without update overidden")

    def _check_migrated(self, old_type: str, new_type: str) -> None:
        pair = clean_name(old_type, self.old_type), clean_name(new_type, self.new_type)
        if pair not in [tuple(each) for each in self.migrated_types]:
            raise BagMigrationException(
                f"Rule [{self.location}] tried to perform a migration from old [{pair[0]}] to new [{pair[1]}] "
                "not listed in migrated_types"
            )

    def _warn(self, text: str) -> None:
        self.sub_rules_valid = False
        print(f"WARNING: Within rule [{self.location}], {text}", file=sys.stderr)


def clean_name(name: str, top_name: str) -> str:
    """Remove the package from a type's name if it is std_msgs or the package of the enclosing message ``top_name``."""
    parts = name.split("/")
    for package in ("std_msgs", top_name.split("/", maxsplit=1)[0]):
        if package in parts:
            parts.remove(package)
    return "/".join(parts)


def qualified_name(name: str, top_name: str) -> str:
    """Return a type's name with its package. ``top_name`` is the type of the enclosing message."""
    clean = clean_name(name, top_name)
    if "/" in clean or clean in PRIMITIVES:
        return clean
    return "std_msgs/Header" if clean == "Header" else f"{top_name.split('/', maxsplit=1)[0]}/{clean}"


def get_message_key(c: MessageClass) -> Key | None:
    """Return a message class's key (type and md5sum), or None if ``c`` is not a message class."""
    try:
        return c._type, c._md5sum
    except AttributeError:
        return None


def get_path_key(c1: MessageClass, c2: MessageClass) -> tuple[Key | None, Key | None]:
    """Return a migration's key: the old and new classes' message keys."""
    return get_message_key(c1), get_message_key(c2)


def copy_message(msg_from: Message, msg_to: Message) -> None:
    """Fill a message from another one with the same fields."""
    buffer = io.BytesIO()
    msg_from.serialize(buffer)
    msg_to.deserialize(buffer.getvalue())


def migration_default_value(field_type: str) -> str:
    """Return source code for a new field's default value, for a .bmr file."""
    type_ = _parsed(field_type)
    if type_.is_array:
        if type_.base in ("byte", "uint8"):
            return "''" if type_.length is None else f"chr(0)*{type_.length}"
        if type_.length is None:
            return "[]"
        return "[" + ",".join([migration_default_value(type_.base)] * type_.length) + "]"
    if type_.base in ("float32", "float64"):
        return "0."
    if type_.base == "string":
        return "''"
    if type_.base in PRIMITIVES and type_.base not in ("time", "duration"):
        return "0"
    return f"self.get_new_class('{field_type}')()"


def constants_from_def(core_type: str, msg_def: str) -> set[tuple[str, object, str]]:
    """Return the name, value and type of each constant in a full message definition."""
    from minirospy.core.idl.load import specs_of_text

    spec = specs_of_text(core_type, msg_def)[core_type]
    return {(each.name, each.value, each.type) for each in spec.constants}


Step = Callable[[MessageUpdateRule, "Message", "Message"], None]


def make_update_rule(
    migrator: Migrator, old_class: MessageClass, new_class: MessageClass
) -> type[MessageUpdateRule]:
    """Return a rule that copies fields with equal names. It is valid if all old fields are used and all new ones filled."""
    lines: list[str] = []
    steps: list[Step] = []
    migrated: list[tuple[str, str]] = []
    old_constants, new_constants = (
        constants_from_def(each._type, each._full_text) for each in (old_class, new_class)
    )
    lines += [
        f"#Constant '{name}' has changed" for name, _, _ in sorted(old_constants - new_constants, key=str)
    ]
    valid = not lines

    old_fields = dict(zip(old_class.__slots__, old_class._slot_types, strict=True))
    for name, new_type in zip(new_class.__slots__, new_class._slot_types, strict=True):
        old_type = old_fields.pop(name, None)
        problem = _mismatch(old_type, new_type)
        if not problem and _parsed(new_type).base not in PRIMITIVES:
            pair = _message_pair(migrator, (str(old_type), old_class._type), (new_type, new_class._type))
            if isinstance(pair, str):
                problem = pair
            else:
                if pair not in migrated:
                    migrated.append(pair)
                lines.append(_migration_line(name, _parsed(new_type)))
                steps.append(_migration_step(name, _parsed(new_type)))
        elif not problem:
            lines.append(f"new_msg.{name} = old_msg.{name}")
            steps.append(_copy_step(name))
        if problem:
            valid = False
            lines += [f"#{problem}", f"new_msg.{name} = {migration_default_value(new_type)}"]
    if old_fields:
        valid = False
        lines += [f"#No field to match field {name} from old message" for name in old_fields]

    def update(self: MessageUpdateRule, old_msg: Message, new_msg: Message) -> None:
        for step in steps:
            step(self, old_msg, new_msg)

    name = f"update_{old_class._type.replace('/', '_')}_{old_class._md5sum}"
    return _rule(name, old_class, new_class, lines, migrated, valid=valid, update=update)


def make_old_half_rule(old_class: MessageClass) -> type[MessageUpdateRule]:
    """Return an invalid rule that converts from an old type to an unknown new type."""
    name = f"update__{old_class._type.replace('/', '_')}__{old_class._md5sum}"
    return _rule(name, old_class, None, ["pass"], [], valid=False)


def make_new_half_rule(new_class: MessageClass) -> type[MessageUpdateRule]:
    """Return an invalid rule that converts from an unknown old type to a new type."""
    name = f"update_to_{new_class._type.replace('/', '_')}_{new_class._md5sum}"
    return _rule(name, None, new_class, ["pass"], [], valid=False)


def _rule(
    name: str,
    old_class: MessageClass,
    new_class: MessageClass,
    lines: Sequence[str],
    migrated: Sequence[tuple[str, str]],
    *,
    valid: bool,
    update: Step | None = None,
) -> type[MessageUpdateRule]:
    """Return a rule class that includes its own source code for a .bmr file."""
    old_type, old_text = (old_class._type, old_class._full_text.strip()) if old_class else ("", "")
    new_type, new_text = (new_class._type, new_class._full_text.strip()) if new_class else ("", "")
    pairs = "".join(f'\n\t\t("{old}","{new}"),' for old, new in migrated)
    body = [*lines] if any(not line.startswith("#") for line in lines) else [*lines, "pass"]
    text = (
        f'class {name}(MessageUpdateRule):\n\told_type = "{old_type}"\n\told_full_text = """\n{_quoted(old_text)}\n"""\n\n'
        f'\tnew_type = "{new_type}"\n\tnew_full_text = """\n{_quoted(new_text)}\n"""\n\n\torder = 0\n'
        f"\tmigrated_types = [{pairs}]\n\n\tvalid = {valid}\n\n\tdef update(self, old_msg, new_msg):\n"
        + "".join(f"\t\t{line}\n" for line in body)
    )

    members: dict[str, object] = {
        "old_type": old_type,
        "old_full_text": f"\n{old_text}\n",
        "new_type": new_type,
        "new_full_text": f"\n{new_text}\n",
        "order": 0,
        "migrated_types": list(migrated),
        "valid": valid,
        "get_class_def": lambda self: text,
    }
    if update:
        members["update"] = update
    return type(name, (MessageUpdateRule,), members)


def _quoted(text: str) -> str:
    """Escape a definition for use in a triple-quoted string."""
    return text.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')


def _mismatch(old_type: str | None, new_type: str) -> str:
    """Compare two field types; return why the field cannot be copied, or "" if it can."""
    if old_type is None:
        return "No matching field name in old message"
    old, new = _parsed(old_type), _parsed(new_type)
    if old.is_array != new.is_array:
        return "Could not match array with nonarray"
    if old.length != new.length:
        if old.length is None:
            return f"Converted from variable length array to fixed array of length {new.length}"
        if new.length is None:
            return f"Converted from fixed array of length {old.length} to variable length"
        return f"Fixed length array converted from {old.length} to {new.length}"
    if new.base in PRIMITIVES and old.base != new.base:
        return "Primitive type changed"
    return ""


def _message_pair(migrator: Migrator, old: tuple[str, str], new: tuple[str, str]) -> tuple[str, str] | str:
    """Return two fields' message types, or the reason why there is no migration between them.

    ``old`` and ``new`` are pairs: the field's type, and the type of the message that contains the field.
    """
    old_base, new_base = _parsed(old[0]).base, _parsed(new[0]).base
    pair = clean_name(old_base, old[1]), clean_name(new_base, new[1])
    old_name, new_name = qualified_name(old_base, old[1]), qualified_name(new_base, new[1])
    if old_name == new_name or new_name in migrator.rename_map.get(old_name, ()):
        return pair
    return f"No migration path between [{pair[0]}] and [{pair[1]}]"


def _migration_line(name: str, type_: FieldType) -> str:
    if type_.is_array:
        return f'self.migrate_array(old_msg.{name}, new_msg.{name}, "{type_.base}")'
    return f"self.migrate(old_msg.{name}, new_msg.{name})"


def _migration_step(name: str, type_: FieldType) -> Step:
    def migrate(rule: MessageUpdateRule, old_msg: Message, new_msg: Message) -> None:
        if type_.is_array:
            rule.migrate_array(getattr(old_msg, name), getattr(new_msg, name), type_.base)
        else:
            rule.migrate(getattr(old_msg, name), getattr(new_msg, name))

    return migrate


def _copy_step(name: str) -> Step:
    return lambda rule, old_msg, new_msg: setattr(new_msg, name, getattr(old_msg, name))


def _parsed(field_type: str) -> FieldType:
    base, bracket, rest = field_type.partition("[")
    length = rest.removesuffix("]")
    return FieldType(base, bool(bracket), int(length) if length else None)


def _class_named(name: str, classes: Mapping[str, MessageClass], top_name: str) -> MessageClass:
    for full_name in (name, f"std_msgs/{name}", f"{top_name.split('/', maxsplit=1)[0]}/{name}"):
        if full_name in classes:
            return classes[full_name]
    raise KeyError(name)


def _classes(type_: str, text: str) -> tuple[Mapping[str, MessageClass], MessageClass]:
    """Generate the classes for a full definition; return all of them, and the main type's class.

    Return ({}, None) if there is no type or the definition is invalid.
    """
    from minirospy.core.idl.load import classes_from_text

    if not type_:
        return {}, None
    try:
        classes = classes_from_text(type_, text)
    except DefinitionError as error:
        print(f"WARNING: a migration rule has an invalid definition: {error}", file=sys.stderr)
        return {}, None
    return classes, classes[type_]
