"""Migrates stored messages to the installed types, by a path of rules from each old type to its newest version.

.bmr files contain explicit rules, ordered by type. The rules between them, and the rules for types that keep their name, are
generated from the two types. Source: http://wiki.ros.org/rosbag/migration.
"""

from __future__ import annotations

import inspect
import io
import sys
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from minirospy.ros.rosbag.migration.plugins import plugin_rule_files
from minirospy.ros.rosbag.migration.rules import (
    BagMigrationException,
    Key,
    MessageClass,
    MessageUpdateRule,
    copy_message,
    get_message_key,
    get_path_key,
    make_new_half_rule,
    make_old_half_rule,
    make_update_rule,
)

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message

__all__ = [
    "MessageMigrator",
    "Migration",
    "RuleChain",
    "ScaffoldNode",
]


class RuleChain:
    """A type's explicit rules: update rules sorted by ``order``, then the rule that renames the type, if any."""

    def __init__(self) -> None:
        self.chain: list[MessageUpdateRule] = []
        self.order_keys: set[int] = set()
        self.rename: MessageUpdateRule | None = None

    def rules(self) -> list[MessageUpdateRule]:
        """Return all rules in order."""
        return [*self.chain, *([self.rename] if self.rename else [])]


class ScaffoldNode:
    """A step on a migration path: converts one class to another with a rule; ``next`` is the following step."""

    def __init__(
        self, old_class: MessageClass, new_class: MessageClass, rule: MessageUpdateRule | None
    ) -> None:
        self.old_class = old_class
        self.new_class = new_class
        self._rule = rule
        self.next: ScaffoldNode | None = None

    @property
    def rule(self) -> MessageUpdateRule:
        """Return the rule for this step."""
        assert self._rule is not None
        return self._rule

    @rule.setter
    def rule(self, rule: MessageUpdateRule) -> None:
        self._rule = rule

    def has_rule(self) -> bool:
        """Return whether this step already has a rule."""
        return self._rule is not None


class Migration(NamedTuple):
    """A migration path for a type, and the rules that are missing on the path."""

    path: list[ScaffoldNode]
    missing: list[MessageUpdateRule]


class MessageMigrator:
    """Migrates messages with the rules from .bmr files and from packages (``plugins``).

    Raise BagMigrationException if a rule is marked as not valid.
    """

    def __init__(self, input_rule_files: Iterable[str] = [], plugins: bool = True) -> None:
        self.rulechains: defaultdict[str, RuleChain] = defaultdict(RuleChain)
        self.base_nodes: list[ScaffoldNode] = []
        self.extra_nodes: list[ScaffoldNode] = []
        self.first_type: dict[str, ScaffoldNode] = {}
        self.rename_map: dict[str, set[str]] = {}
        self.found_paths: dict[tuple[Key | None, Key | None], list[ScaffoldNode]] = {}
        self.found_targets: dict[Key | None, MessageClass] = {}
        self.false_rule_loaded = False

        for file in input_rule_files:
            self._load(Path(file), file)
        if plugins:
            for path, name in plugin_rule_files():
                self._load(path, name)
        if self.false_rule_loaded:
            raise BagMigrationException("Cannot instantiate MessageMigrator with invalid rules")

        self._build()
        nodes = [*self.base_nodes, *self.extra_nodes]
        self.class_dict = {
            get_message_key(each): each for node in nodes for each in (node.old_class, node.new_class)
        }

    def lookup_type(self, key: Key) -> MessageClass:
        """Return the class with this type and md5sum from the rules' definitions, or None if there is none."""
        return self.class_dict.get(key)

    def add_update_rule(self, r: MessageUpdateRule) -> None:
        """Add an explicit rule. Report and ignore a rule that conflicts with others."""
        if not r.valid:
            print(f"ERROR: Update rule [{r.location}] has valid set to False.", file=sys.stderr)
            self.false_rule_loaded = True
            return
        if r.old_class is None or r.new_class is None:
            return  # invalid definitions have already been reported
        why = self._why_renaming_fails(r) if r.rename_rule else self._why_updating_fails(r)
        if why:
            print(f"WARNING: {why}", file=sys.stderr)
            return

        chain = self.rulechains[r.old_type]
        if r.rename_rule:
            chain.rename = r
        else:
            chain.order_keys.add(r.order)
            chain.chain.append(r)
            chain.chain.sort(key=lambda each: each.order)

    def all_rules_valid(self) -> bool:
        """Return whether all rules are valid; a missing rule counts as invalid."""
        return not self.get_invalid_rules()

    def get_invalid_rules(self) -> list[MessageUpdateRule]:
        """Return the invalid rules, which the user must complete."""
        rules = [node.rule for node in (*self.base_nodes, *self.extra_nodes) if not node.rule.valid]
        return self.filter_rules_unique(rules)

    def filter_rules_unique(self, rules: Sequence[MessageUpdateRule]) -> list[MessageUpdateRule]:
        """Return the rules without duplicates."""
        found: dict[tuple[Key | None, Key | None], MessageUpdateRule] = {}
        for rule in rules:
            found.setdefault(get_path_key(rule.old_class, rule.new_class), rule)
        return list(found.values())

    def expand_rules(self, rules: Sequence[MessageUpdateRule]) -> list[MessageUpdateRule]:
        """Return the rules and all rules that they depend on, without duplicates."""
        expanded = []
        for rule in self.filter_rules_unique(rules):
            expanded += [rule, *self.expand_rules(rule.sub_rules)]
        return self.filter_rules_unique(expanded)

    def scaffold_range(self, old_type: str, new_type: str) -> list[ScaffoldNode]:
        """Return the steps from the first rule for ``old_type`` to the last rule that yields ``new_type``."""
        node = self.first_type.get(old_type)
        if node is None:
            return []
        found = [node]
        reached = False
        while node.next is not None and node.next.new_class is not None:
            node = node.next
            found.append(node)
            if node.new_class._type == new_type:
                reached = True
            elif reached:
                break
        return found

    def find_target(self, old_class: MessageClass) -> MessageClass:
        """Return the installed class to migrate ``old_class`` to, or None if none is installed."""
        from minirospy.core.idl.load import get_message_class

        key = get_message_key(old_class)
        if key not in self.found_targets:
            target = get_message_class(old_class._type)
            node = self.first_type.get(old_class._type)
            if target is None and node is not None:
                while node.next is not None:
                    node = node.next
                target = get_message_class(node.new_class._type) if node.new_class else None
            self.found_targets[key] = target
        return self.found_targets[key]

    def find_path(self, old_class: MessageClass, new_class: MessageClass) -> list[ScaffoldNode]:
        """Return the steps from one class to another, with a generated, possibly invalid rule for each missing one."""
        key = get_path_key(old_class, new_class)
        if key not in self.found_paths:
            if new_class is None:
                path = self._path_to_nowhere(old_class)
            elif get_message_key(old_class) == get_message_key(new_class):
                path = []
            else:
                path = self._path(old_class, new_class)
            self.found_paths[key] = path
        return self.found_paths[key]

    def migrate_raw(
        self,
        msg_from: tuple[str, bytes, str, object, MessageClass],
        msg_to: tuple[str, object, str, object, MessageClass],
    ) -> tuple[str, bytes, str, object, MessageClass]:
        """Convert a raw message (type, bytes, md5sum, position, class) to the new type.

        Raise BagMigrationException if there is no valid path.
        """
        path = self._valid_path(msg_from[4], msg_to[4], msg_from[0], msg_to[0])
        body = msg_from[1]
        if path and msg_from[2] != msg_to[2]:
            message = path[0].old_class()
            message.deserialize(body)
            buffer = io.BytesIO()
            self._apply(path, message).serialize(buffer)
            body = buffer.getvalue()
        return msg_to[0], body, msg_to[2], msg_to[3], msg_to[4]

    def migrate(self, msg_from: Message, msg_to: Message) -> None:
        """Fill a message of a new type from a message of an old type.

        Raise BagMigrationException if there is no valid path.
        """
        path = self._valid_path(type(msg_from), type(msg_to), msg_from._type, msg_to._type)
        if not path or msg_from._md5sum == msg_to._md5sum:
            copy_message(msg_from, msg_to)
            return
        message = path[0].old_class()
        copy_message(msg_from, message)
        copy_message(self._apply(path, message), msg_to)

    def migrate_array(self, msg_from_array: Sequence[Message], msg_to_array: Sequence[Message]) -> None:
        """Fill messages of a new type from the same number of messages of an old type.

        Raise BagMigrationException if the lengths differ, or there is no valid path.
        """
        if len(msg_from_array) != len(msg_to_array):
            raise BagMigrationException("Migrate array called on on arrays of unequal length.")
        for old, new in zip(msg_from_array, msg_to_array, strict=True):
            self.migrate(old, new)

    def make_update_rule(self, old_class: MessageClass, new_class: MessageClass) -> type[MessageUpdateRule]:
        """Return a rule that copies fields by name."""
        return make_update_rule(self, old_class, new_class)

    def make_old_half_rule(self, old_class: MessageClass) -> type[MessageUpdateRule]:
        """Return an invalid rule that converts from an old type to an unknown new type."""
        return make_old_half_rule(old_class)

    def make_new_half_rule(self, new_class: MessageClass) -> type[MessageUpdateRule]:
        """Return an invalid rule that converts from an unknown old type to a new type."""
        return make_new_half_rule(new_class)

    # -- loading

    def _load(self, path: Path, name: str) -> None:
        """Execute a rule file, which is Python code, and add its rules."""
        scope: dict[str, object] = {"MessageUpdateRule": MessageUpdateRule}
        try:
            exec(compile(path.read_text(encoding="utf-8"), name, "exec"), scope)
        except Exception as error:  # noqa: BLE001 - a user's program: its error affects only this file
            print(f"Cannot load rule file [{name}] in local package: {error}", file=sys.stderr)
            return
        for each, value in list(scope.items()):
            if (
                inspect.isclass(value)
                and issubclass(value, MessageUpdateRule)
                and value is not MessageUpdateRule
            ):
                self.add_update_rule(value(self, f"{name}:{each}"))

    def _why_renaming_fails(self, rule: MessageUpdateRule) -> str:
        chain = self.rulechains[rule.old_type]
        if chain.rename:
            return (
                f"Update rules [{chain.rename.location}] and [{rule.location}] both attempting to rename type "
                f"[{rule.old_type}]. Ignoring [{rule.location}]"
            )

        cycle: list[MessageUpdateRule] = []
        following: MessageUpdateRule | None = rule
        while following:
            cycle.append(following)
            if following.new_type == rule.old_type:
                return (
                    f"Update rules {[each.location for each in cycle]} introduce a renaming cycle. "
                    f"Ignoring [{rule.location}]"
                )
            known = following.new_type in self.rulechains
            following = self.rulechains[following.new_type].rename if known else None
        if chain.chain and rule.order <= chain.chain[-1].order:
            return f"Update rule [{rule.location}] which performs rename does not have largest order number. Ignoring"
        return ""

    def _why_updating_fails(self, rule: MessageUpdateRule) -> str:
        chain = self.rulechains[rule.old_type]
        for other in chain.chain:
            if other.order == rule.order:
                return (
                    f"Update rules [{other.location}] and [{rule.location}] for type [{rule.old_type}] have the same order "
                    f"number. Ignoring [{rule.location}]"
                )
        if chain.rename and rule.order >= chain.rename.order:
            return (
                f"Update rule [{rule.location}] has order number larger than rename rule "
                f"[{chain.rename.location}]. Ignoring"
            )
        return ""

    # -- the scaffold

    def _build(self) -> None:
        """Link each type's explicit rules in order; link the last one to a rule for the type's new name or installed class."""
        ends = []
        for type_, chain in list(self.rulechains.items()):
            self.rename_map[type_] = self._names_of(type_)
            previous: ScaffoldNode | None = None
            for rule in chain.rules():
                node = self._node(rule.old_class, rule.new_class, rule)
                if previous is None:
                    self.first_type[type_] = node
                elif get_message_key(previous.new_class) == get_message_key(node.old_class):
                    previous.next = node
                else:
                    previous.next = self._node(previous.new_class, node.old_class, None)
                    previous.next.next = node
                previous = node
            if previous:
                ends.append(previous)

        for node in ends:
            self._connect(node)
        for node in self.base_nodes:
            if not node.has_rule():
                node.rule = self._made(node.old_class, node.new_class)
        for node in list(self.base_nodes):
            node.rule.find_sub_paths()

    def _names_of(self, type_: str) -> set[str]:
        names = {type_}
        rename = self.rulechains[type_].rename
        while rename and rename.new_type not in names:
            names.add(rename.new_type)
            rename = self.rulechains[rename.new_type].rename if rename.new_type in self.rulechains else None
        return names

    def _connect(self, end: ScaffoldNode) -> None:
        """Link a type's last rule to the following step."""
        from minirospy.core.idl.load import get_message_class

        installed = get_message_class(end.new_class._type)
        if installed:
            rule = self._made(end.new_class, installed)
            if rule.valid:
                end.next = self._node(end.new_class, installed, rule)

        if end.old_class._type != end.new_class._type:
            following = self.scaffold_range(end.new_class._type, end.new_class._type)
            if not following and installed is not None:
                end.next = self._node(end.new_class, installed, None)
                return
            for node in reversed(following):
                if get_message_key(node.old_class) == get_message_key(end.new_class):
                    end.next = node
                    return
            # Link to the last step that accepts this class, to skip unnecessary conversions.
            for node in reversed(following if end.next is None else []):
                rule = self._made(end.new_class, node.old_class)
                if rule.valid:
                    end.next = self._node(end.new_class, node.old_class, rule)
                    end.next.next = node
                    return

        if end.next is None:
            rule = self._made(end.new_class, installed) if installed else self._half(end.new_class)
            end.next = self._node(end.new_class, None, rule)

    def _path_to_nowhere(self, old_class: MessageClass) -> list[ScaffoldNode]:
        """Return the path for a type that is not installed. Its last step has an incomplete rule, for the user to write."""
        steps = self.scaffold_range(old_class._type, "")
        steps = self._from_start(steps, old_class) or steps
        last = steps[-1].new_class if steps else old_class
        return [*steps, self._extra(last, None, self._half(last))]

    def _path(self, old_class: MessageClass, new_class: MessageClass) -> list[ScaffoldNode]:
        steps = self.scaffold_range(old_class._type, new_class._type)
        if not steps:
            return [self._extra(old_class, new_class, self._made_whole(old_class, new_class))]
        steps = self._to_end(steps, new_class)

        from_start = self._exact_start(steps, old_class)
        if from_start:
            return from_start
        rule = self._made_whole(old_class, new_class)
        if rule.valid and rule.sub_rules_valid:
            return [self._extra(old_class, new_class, rule)]
        from_start = self._from_start(steps, old_class)
        if from_start:
            return from_start
        first = steps[0].old_class
        return [self._extra(old_class, first, self._made_whole(old_class, first)), *steps]

    def _to_end(self, steps: list[ScaffoldNode], new_class: MessageClass) -> list[ScaffoldNode]:
        """Return the steps up to the one that produces ``new_class``; append a generated step if none does."""
        candidates = []
        for number, node in reversed(list(enumerate(steps))):
            if node.new_class is None or node.new_class._type != new_class._type:
                break
            candidates.append(number)
        for number in candidates:
            if get_message_key(steps[number].new_class) == get_message_key(new_class):
                return steps[: number + 1]
        for number in candidates:
            last = steps[number].new_class
            rule = self._made_whole(last, new_class)
            if rule.valid and rule.sub_rules_valid:
                return [*steps[: number + 1], self._extra(last, new_class, rule)]
        last = steps[-1].new_class
        return [*steps, self._extra(last, new_class, self._made_whole(last, new_class))]

    def _exact_start(self, steps: list[ScaffoldNode], old_class: MessageClass) -> list[ScaffoldNode]:
        for number, node in reversed(list(enumerate(steps))):
            if get_message_key(node.old_class) == get_message_key(old_class):
                return steps[number:]
        return []

    def _from_start(self, steps: list[ScaffoldNode], old_class: MessageClass) -> list[ScaffoldNode]:
        """Return the steps that start at ``old_class``, the first generated if necessary; return [] if no valid one exists."""
        if exact := self._exact_start(steps, old_class):
            return exact
        for number, node in reversed(list(enumerate(steps))):
            if node.old_class._type == old_class._type:
                rule = self._made_whole(old_class, node.old_class)
                if rule.valid and rule.sub_rules_valid:
                    return [self._extra(old_class, node.old_class, rule), *steps[number:]]
        return []

    def _node(
        self, old_class: MessageClass, new_class: MessageClass, rule: MessageUpdateRule | None
    ) -> ScaffoldNode:
        node = ScaffoldNode(old_class, new_class, rule)
        self.base_nodes.append(node)
        return node

    def _extra(
        self, old_class: MessageClass, new_class: MessageClass, rule: MessageUpdateRule
    ) -> ScaffoldNode:
        node = ScaffoldNode(old_class, new_class, rule)
        self.extra_nodes.append(node)
        return node

    def _made(self, old_class: MessageClass, new_class: MessageClass) -> MessageUpdateRule:
        kind = self.make_update_rule(old_class, new_class)
        return kind(self, f"GENERATED.{kind.__name__}")

    def _made_whole(self, old_class: MessageClass, new_class: MessageClass) -> MessageUpdateRule:
        rule = self._made(old_class, new_class)
        rule.find_sub_paths()
        return rule

    def _half(self, old_class: MessageClass) -> MessageUpdateRule:
        kind = self.make_old_half_rule(old_class)
        return kind(self, f"GENERATED.{kind.__name__}")

    def _valid_path(
        self, old_class: MessageClass, new_class: MessageClass, old_name: str, new_name: str
    ) -> list[ScaffoldNode]:
        path = self.find_path(old_class, new_class)
        if not all(node.rule.valid for node in path):
            raise BagMigrationException(
                f"Migrate called, but no valid migration path from [{old_name}] to [{new_name}]"
            )
        return path

    def _apply(self, path: Sequence[ScaffoldNode], message: Message) -> Message:
        for node in path:
            message = node.rule.apply(message)
        return message
