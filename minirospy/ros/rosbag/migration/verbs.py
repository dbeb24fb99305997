"""`rosbag check` and `rosbag fix`: migrate messages whose types have changed. Source: http://wiki.ros.org/rosbag/migration."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from minirospy.base import private_files
from minirospy.base.errors import BagEncryptedError, BagError, MessageException, MinirospyError
from minirospy.command.command import complain
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Verb
from minirospy.ros.rosbag.commands.rosbag_info import report, unreadable

if TYPE_CHECKING:
    from minirospy.core.idl.protocols import Message
    from minirospy.ros.rosbag.migration.rules import MessageUpdateRule
    from minirospy.ros.rosbag.migration.rules_files import MessageMigrator, Migration

__all__ = ["VERBS", "make_migrator", "print_migrations", "write_rules"]

_CHECK = "Determine whether a bag is playable in the current system, or if it can be migrated."
_FIX = "Repair the messages in a bag file so that it can be played in the current system."


def _check_parser() -> Parser:
    parser = Parser(
        "rosbag check", "", "rosbag check BAG [-g RULEFILE] [EXTRARULES1 EXTRARULES2 ...]", about=_CHECK
    )
    parser.add_argument(
        "words", nargs="*", metavar="BAG EXTRARULES", help="a bag file, and files of rules", completer="files"
    )
    parser.add_argument(
        "-g",
        "--genrules",
        metavar="RULEFILE",
        help="generate a rulefile named RULEFILE",
        completer="files",
    )

    parser.add_argument(
        "-a",
        "--append",
        action="store_true",
        help="append to the end of an existing rulefile after loading it",
    )
    parser.add_argument("-n", "--noplugins", action="store_true", help="do not load rulefiles via plugins")
    return parser


def _check(words: list[str], genrules: str | None, append: bool, noplugins: bool) -> int:
    if not words:
        raise Misuse("a bag file is missing", "You must specify a bag file to check.")
    if append and genrules is None:
        raise Misuse("-a needs -g", "Cannot specify -a without also specifying -g.")
    if genrules is not None:
        _check_rule_file(genrules, append=append)
    from minirospy.introspect import bags
    from minirospy.ros.rosbag.migration import bags as bag_migration

    path, *rule_files = words
    try:
        with bags.open_reader(path):
            pass
        migrator = make_migrator(
            [*rule_files, *([genrules] if append and genrules else [])], noplugins=noplugins
        )
        migrations = bag_migration.check_bag(migrator, path, report)
    except (BagError, OSError) as error:
        report(unreadable(path, error))
        return 0 if isinstance(error, BagEncryptedError) else 1

    if not migrations:
        print("Bag file does not need any migrations.")
        return 0
    print("The following migrations need to occur:")
    rules = print_migrations(migrations)
    if genrules is not None:
        return write_rules(genrules, migrator, rules)
    if rules:
        print("\nTo generate rules, please run with -g <rulefile>")
    else:
        print("\nAll rules defined.  Bag is ready to be migrated")
    return 0


def _check_rule_file(path: str, *, append: bool) -> None:
    exists = os.path.isfile(path)
    if exists and not append:
        text = f"The file {path} already exists.  Include -a if you intend to append."
        raise Misuse(text, text)
    if append and not exists:
        text = f"The file {path} does not exist, and so -a is invalid."
        raise Misuse(text, text)


def write_rules(path: str, migrator: MessageMigrator, rules: Sequence[MessageUpdateRule]) -> int:
    """Write the missing rules to a file for the user to complete. If a type was moved, prompt for its new name."""
    left = migrator.filter_rules_unique(rules)
    if not left:
        print(f"\nNo additional rule files needed to be generated.  {path} not created.")
        return 0

    texts: list[str] = []
    while left:
        more: list[MessageUpdateRule] = []
        for rule in left:
            if rule.new_class is not None:
                texts.append(rule.get_class_def() or "")
                continue
            new_class = _ask_new_class(rule.old_class._type)
            if new_class is None:
                return complain("rosbag", MinirospyError(f"no new type of {rule.old_class._type} was typed"))
            kind = migrator.make_update_rule(rule.old_class, new_class)
            made = kind(migrator, f"GENERATED.{kind.__name__}")
            made.find_sub_paths()
            needed = [each for each in migrator.expand_rules(made.sub_rules) if not each.valid]
            more += needed
            print(f"Creating the migration rule for {new_class._type} requires additional missing rules:")
            for each in needed:
                _print_change(each.old_class, each.new_class, 1)
            texts.append(made.get_class_def() or "")
        left = migrator.filter_rules_unique(more)

    with open(path, "a", encoding="utf-8") as file:
        file.write("".join(texts))
    print(f"\nThe necessary rule files have been written to: {path}")
    return 0


def _ask_new_class(old_type: str) -> type[Message] | None:
    """Prompt for the new type's name and return its class; return None at end of input."""
    from minirospy.core.idl.load import get_message_class

    print(f"The message type {old_type} appears to have moved.  Please enter the type to migrate it to.")
    while True:
        print(">", end="", flush=True)
        line = sys.stdin.readline()
        if not line:
            return None
        if found := get_message_class(line.strip()):
            return found
        print(f"'{line.strip()}' could not be found in your system.  Please make sure it is built.")


def _fix_parser() -> Parser:
    parser = Parser("rosbag fix", "", "rosbag fix INBAG OUTBAG [EXTRARULES1 EXTRARULES2 ...]", about=_FIX)
    parser.add_argument(
        "words",
        nargs="*",
        metavar="INBAG OUTBAG EXTRARULES",
        help="a bag, the bag that is written, and files of rules",
        completer="files",
    )
    parser.add_argument("-n", "--noplugins", action="store_true", help="do not load rulefiles via plugins")
    parser.add_argument(
        "--force", action="store_true", help="proceed with migrations, even if not all rules defined"
    )
    return parser


def _fix(words: list[str], noplugins: bool, force: bool) -> int:
    if len(words) < 2:
        text = "You must pass an output bag file." if words else "You must pass input and output bag files."
        raise Misuse(text, text)
    source, target, *rule_files = words
    ending = os.path.splitext(target)[1]
    if ending != ".bag":
        is_rules = ending == ".bmr"
        text = (
            "Input file should be a bag file, not a rule file."
            if is_rules
            else "Output file must be a bag file."
        )
        raise Misuse(text, text)
    from minirospy.ros.rosbag.migration.bags import fix_bag
    from minirospy.ros.rosbag.migration.rules import BagMigrationException

    temporary = f"{target}.tmp"
    try:
        with open(temporary, "wb"):
            pass
    except OSError:
        report(f"Cannot open {target} for writing")
        return 1
    try:
        missing = fix_bag(
            make_migrator(rule_files, noplugins=noplugins), source, temporary, report, force=force
        )
        if not missing:
            private_files.replace_file(temporary, target)
    except (BagError, OSError) as error:
        if isinstance(error, OSError) and error.filename == temporary:
            error.filename = target
            raise
        report(unreadable(source, error))
        return 0 if isinstance(error, BagEncryptedError) else 1
    except (BagMigrationException, MessageException) as error:
        return complain("rosbag", MinirospyError(str(error)))
    finally:
        with contextlib.suppress(OSError):
            os.remove(temporary)

    if not missing:
        print("Bag migrated successfully.")
        return 0
    print("Bag could not be migrated.  The following migrations could not be performed:")
    print_migrations(missing)
    print(
        "Try running 'rosbag check' to create the necessary rule files or run 'rosbag fix' with the '--force' option."
    )
    return 1


def make_migrator(rule_files: Sequence[str], *, noplugins: bool) -> MessageMigrator:
    from minirospy.ros.rosbag.migration.rules import BagMigrationException
    from minirospy.ros.rosbag.migration.rules_files import MessageMigrator

    try:
        return MessageMigrator(rule_files, plugins=not noplugins)
    except BagMigrationException as error:
        raise MinirospyError(str(error)) from error


def print_migrations(migrations: Sequence[Migration]) -> list[MessageUpdateRule]:
    """Print the required migrations; return the missing rules."""
    rules = []
    for path, missing in migrations:
        _print_change(path[0].old_class, path[-1].new_class, 0)
        if missing:
            print(f"    {len(missing)} rules missing:")
        for rule in missing:
            _print_change(rule.old_class, rule.new_class, 1)
        rules += missing
    return rules


def _print_change(old: type[Message], new: type[Message] | None, indent: int) -> None:
    print("    " * indent + f" * From: {old._type} [{old._md5sum}]")
    print("    " * indent + "   To:   " + (f"{new._type} [{new._md5sum}]" if new else "Unknown"))


VERBS = (
    Verb("rosbag check", _CHECK, _check_parser, _check),
    Verb("rosbag fix", _FIX, _fix_parser, _fix),
)
