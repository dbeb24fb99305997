"""ros/rosbag/migration/rules_files: paths of rules from old types to installed ones, and the migrated messages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from minirospy.core.idl.load import class_from_text, message_class
from minirospy.ros.rosbag.migration.bags import check_classes
from minirospy.ros.rosbag.migration.rules import (
    BagMigrationException,
    clean_name,
    constants_from_def,
    make_update_rule,
    migration_default_value,
    qualified_name,
)
from minirospy.ros.rosbag.migration.rules_files import MessageMigrator

HEADER = "uint32 seq\ntime stamp\nstring frame_id\n"
POINT = "float64 x\nfloat64 y\nfloat64 z\n"
RULE = "=" * 80 + "\nMSG: "
OLD_COLOR = "float32 r\nfloat32 g\nfloat32 b\n"


def rule(name: str, old: tuple[str, str], new: tuple[str, str], update: str, **members: object) -> str:
    """Return a rule in the format of a .bmr file."""
    fields = {"order": 0, "migrated_types": [], "valid": True} | members
    return (
        f"class {name}(MessageUpdateRule):\n"
        f"    old_type, old_full_text = {old!r}\n    new_type, new_full_text = {new!r}\n"
        + "".join(f"    {key} = {value!r}\n" for key, value in fields.items())
        + f"    def update(self, old_msg, new_msg):\n        {update}\n"
    )


def migrator(folder: Path, *rules: str) -> MessageMigrator:
    (folder / "rules.bmr").write_text("\n".join(rules), encoding="utf-8")
    return MessageMigrator([str(folder / "rules.bmr")], plugins=False)


def migrated(by: MessageMigrator, old: Any) -> Any:
    new = by.find_target(type(old))()
    by.migrate(old, new)
    return new


def color(**values: float) -> Any:
    made = class_from_text("std_msgs/ColorRGBA", OLD_COLOR)()
    for name, value in values.items():
        setattr(made, name, value)
    return made


def test_installed_type_needs_no_migration() -> None:
    by = MessageMigrator(plugins=False)
    same = class_from_text("std_msgs/String", "# a comment\nstring data # another\n")

    assert check_classes(by, [message_class("std_msgs/String"), same]) == []


def test_field_that_is_new_needs_a_rule(tmp_path: Path) -> None:
    (found,) = check_classes(MessageMigrator(plugins=False), [type(color())])
    assert [each.old_type for each in found.missing] == ["std_msgs/ColorRGBA"]

    installed = message_class("std_msgs/ColorRGBA")
    by = migrator(
        tmp_path,
        rule(
            "add_alpha",
            ("std_msgs/ColorRGBA", OLD_COLOR),
            ("std_msgs/ColorRGBA", installed._full_text),
            "new_msg.r, new_msg.a = old_msg.r, 1.0",
        ),
    )
    assert check_classes(by, [type(color())])[0].missing == []
    new = migrated(by, color(r=0.5))
    assert (new.r, new.a, type(new)) == (0.5, 1.0, installed)


def test_order_of_fields_is_migrated_without_a_rule() -> None:
    old = class_from_text("geometry_msgs/Point", "float64 z\nfloat64 x\nfloat64 y\n")()
    old.x, old.y, old.z = 1.0, 2.0, 3.0
    by = MessageMigrator(plugins=False)

    assert check_classes(by, [type(old)])[0].missing == []
    new: Any = migrated(by, old)
    assert (new.x, new.y, new.z) == (1.0, 2.0, 3.0)


def test_inner_messages_and_arrays_are_migrated() -> None:
    text = f"geometry_msgs/Point32[] points\n{RULE}geometry_msgs/Point32\nfloat32 y\nfloat32 x\nfloat32 z\n"
    old: Any = class_from_text("geometry_msgs/Polygon", text)()
    point = class_from_text("geometry_msgs/Point32", "float32 y\nfloat32 x\nfloat32 z\n")
    for number in range(3):
        each: Any = point()
        each.x = float(number)
        old.points.append(each)
    by = MessageMigrator(plugins=False)

    assert check_classes(by, [type(old)])[0].missing == []
    assert [each.x for each in migrated(by, old).points] == [0.0, 1.0, 2.0]


def test_renamed_type_goes_on_through_a_chain(tmp_path: Path) -> None:
    by = migrator(
        tmp_path,
        rule(
            "one",
            ("gone_msgs/A", "int32 data"),
            ("gone_msgs/A", "int64 data"),
            "new_msg.data = old_msg.data + 1",
        ),
        rule(
            "two",
            ("gone_msgs/A", "int64 data"),
            ("far_msgs/B", "int64 data"),
            "new_msg.data = old_msg.data",
            order=1,
        ),
        rule(
            "three",
            ("far_msgs/B", "int64 data"),
            ("std_msgs/String", "string data"),
            "new_msg.data = str(old_msg.data)",
        ),
    )
    old: Any = class_from_text("gone_msgs/A", "int32 data")()
    old.data = 41

    assert migrated(by, old).data == "42"
    assert by.find_target(type(old)) is message_class("std_msgs/String")


def test_type_that_has_gone_needs_half_a_rule() -> None:
    gone = class_from_text("gone_msgs/A", "int32 data")
    (found,) = check_classes(MessageMigrator(plugins=False), [gone])

    assert found.path[-1].new_class is None
    assert [each.new_type for each in found.missing] == [""]
    with pytest.raises(BagMigrationException, match=r"no valid migration path from \[gone_msgs/A\]"):
        MessageMigrator(plugins=False).migrate_raw(
            ("gone_msgs/A", b"", "x", None, gone),
            ("std_msgs/String", None, "y", None, message_class("std_msgs/String")),
        )


@pytest.mark.parametrize(
    ("rules", "said"),
    [
        ([rule("a", ("x/A", "int8 a"), ("x/A", "int8 b"), "pass"), rule("b", ("x/A", "int8 c"), ("x/A", "int8 d"), "pass")],
         "have the same order number. Ignoring"),
        ([rule("a", ("x/A", "int8 a"), ("x/B", "int8 b"), "pass"), rule("b", ("x/A", "int8 c"), ("x/C", "int8 d"), "pass")],
         "both attempting to rename type [x/A]"),
        ([rule("a", ("x/A", ""), ("x/B", ""), "pass"), rule("b", ("x/B", ""), ("x/A", ""), "pass")],
         "introduce a renaming cycle"),
        (["this is not Python"], "Cannot load rule file"),
        ([rule("a", ("x/A", "int8 a b c"), ("x/A", "int8 b"), "pass", migrated_types=[("B", "C")])],
         "invalid definition"),
    ],
)  # fmt: skip
def test_wrong_rules_are_reported_and_ignored(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], rules: list[str], said: str
) -> None:
    migrator(tmp_path, *rules)
    assert said in capsys.readouterr().err


def test_rule_that_is_not_valid_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagMigrationException, match="invalid rules"):
        migrator(tmp_path, rule("a", ("x/A", ""), ("x/A", "int8 b"), "pass", valid=False))


def test_made_rule_is_text_that_loads_and_executes_nothing_of_the_bag(tmp_path: Path) -> None:
    text = 'string s="""+quit()+"""\\\nint8 old\n'
    old = class_from_text("x/A", text)
    made = make_update_rule(
        MessageMigrator(plugins=False), old, class_from_text("x/A", "int8 old\nint8[3] more\n")
    )
    written = made(MessageMigrator(plugins=False), "here").get_class_def()
    assert written is not None
    assert "\t\tnew_msg.old = old_msg.old\n\t\t#No matching field name in old message\n" in written

    scope: dict[str, Any] = {"MessageUpdateRule": made.__mro__[1]}
    exec(written.replace("valid = False", "valid = True"), scope)
    again = scope[made.__name__](MessageMigrator(plugins=False), "there")
    assert again.old_md5sum == old._md5sum


def test_names() -> None:
    assert clean_name("std_msgs/Header", "x/A") == "Header"
    assert clean_name("x/B", "x/A") == "B"
    assert clean_name("y/B", "x/A") == "y/B"
    assert qualified_name("Header", "x/A") == "std_msgs/Header"
    assert qualified_name("B", "x/A") == "x/B"
    assert qualified_name("int8", "x/A") == "int8"
    assert constants_from_def("x/A", "int8 K=3\nint8 a\n") == {("K", 3, "int8")}


@pytest.mark.parametrize(
    ("type_", "text"),
    [
        ("int8", "0"),
        ("float64", "0."),
        ("string", "''"),
        ("uint8[]", "''"),
        ("uint8[4]", "chr(0)*4"),
        ("int32[]", "[]"),
        ("int32[2]", "[0,0]"),
        ("time", "self.get_new_class('time')()"),
        ("x/A", "self.get_new_class('x/A')()"),
    ],
)
def test_default_values(type_: str, text: str) -> None:
    assert migration_default_value(type_) == text
