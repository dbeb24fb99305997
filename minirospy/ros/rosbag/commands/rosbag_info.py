"""`rosbag info` and `rosbag filter`: summarize a bag, or copy part of it.

Source: http://wiki.ros.org/rosbag/Commandline.
"""

from __future__ import annotations

import os
import sys

from minirospy.base.errors import (
    BagEncryptedError,
    BagError,
    BagUnindexedError,
    McapUnindexedError,
    MessageException,
    MinirospyError,
    ValueTextError,
)
from minirospy.base.escape import escaped
from minirospy.command.command import complain
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Verb

__all__ = ["VERBS", "report"]


def report(line: str) -> None:
    """Print a message to stderr, after flushing stdout."""
    sys.stdout.flush()
    print(escaped(line, "\n"), file=sys.stderr)


def unreadable(path: str, error: BagError | OSError) -> str:
    """Return ROS's error message for a bag that cannot be opened or read."""
    if isinstance(error, BagEncryptedError):
        return f"ERROR: {error}"
    if isinstance(error, McapUnindexedError):
        return f"ERROR: {path} is not complete: {error.why}; `rosbag reindex {path}`"
    if isinstance(error, BagUnindexedError):
        return f"ERROR bag unindexed: {path}.  Run rosbag reindex."
    return f"ERROR reading {path}: {error}"


def _info_parser() -> Parser:
    parser = Parser(
        "rosbag info",
        "",
        "rosbag info [options] BAGFILE1 [BAGFILE2 BAGFILE3 ...]",
        about="Summarize the contents of one or more bag files.",
    )
    parser.add_argument("bags", nargs="*", help="bag files", metavar="BAGFILE", completer="bag_files")
    parser.add_argument("-y", "--yaml", action="store_true", help="print information in YAML format")
    parser.add_argument(
        "-k", "--key", metavar="KEY", help="print information on the given key", completer="nothing"
    )
    parser.add_argument("--freq", action="store_true", help="display topic message frequency statistics")
    return parser


def _info(bags: list[str], yaml: bool, key: str | None, freq: bool) -> int:
    if not bags:
        raise Misuse("a bag file is missing", "You must specify at least 1 bag file.")
    if key and not yaml:
        raise Misuse("-k needs -y", "You can only specify key when printing in YAML format.")
    from minirospy.core.bag import info
    from minirospy.introspect.bags import left_out, open_reader

    for number, path in enumerate(bags):
        try:
            with open_reader(path) as reader:
                summary = info.summarize(reader, path, frequencies=freq)
                span = info.span_out_of_order(reader)
                foreign = left_out(reader)
        except BagEncryptedError as error:
            report(unreadable(path, error))
            continue
        except (BagError, OSError) as error:
            report(unreadable(path, error))
            return 1

        if foreign:
            report(f"WARNING: {path}: left out, as they cannot be converted to ROS 1: {foreign}")
        if span:
            report(
                f"WARNING: {path}: its chunks are not in time order. ROS takes start, end and duration from the first and "
                f"the last chunk; the messages are from {span[0]:.2f} to {span[1]:.2f} ({span[1] - span[0]:.1f}s). "
                "`rosbag filter` with True writes them in order"
            )
        if not yaml:
            print(info.as_text(summary))
        elif not key:
            print(info.as_yaml(summary))
        else:
            try:
                print(info.value_of(info.as_yaml(summary), key))
            except LookupError:
                report(f'Error getting key "{key}"')
        if number < len(bags) - 1:
            print("---")
    return 0


_FILTER_USAGE = """\
rosbag filter [options] INBAG OUTBAG EXPRESSION

EXPRESSION can be any Python-legal expression.

The following variables are available:
 * topic: name of topic
 * m: message
 * t: time of message (t.secs, t.nsecs)"""
_FILTER_MISSING = (
    "You must specify an in bag, an out bag, and an expression.",
    "You must specify an out bag and an expression.",
    "You must specify an expression.",
)


def _filter_parser() -> Parser:
    parser = Parser("rosbag filter", "", _FILTER_USAGE, about="Filter the contents of the bag.")
    parser.add_argument(
        "words",
        nargs="*",
        metavar="INBAG OUTBAG EXPRESSION",
        help="the bag that is read, the one that is written, and what selects messages: \"topic == '/tf'\"",
        completer="bag_files",
    )
    parser.add_argument(
        "-p",
        "--print",
        metavar="PRINT-EXPRESSION",
        help="Python expression to print for verbose debugging. Uses same variables as filter-expression",
        completer="nothing",
    )
    return parser


def _filter(words: list[str], print: str | None) -> int:
    if len(words) != 3:
        text = _FILTER_MISSING[len(words)] if len(words) < 3 else "Too many arguments."
        raise Misuse(text, text)
    source, target, text = words
    if not os.path.isfile(source):
        report(f"Cannot locate input bag file [{source}]")
        return 2
    if os.path.realpath(source) == os.path.realpath(target):
        report(f"Cannot use same file as input and output [{source}]")
        return 3
    from minirospy.introspect import bags
    from minirospy.ros.rosbag.commands.rosbag_progress import showing_progress

    # Reject an invalid target name before displaying progress.
    bags.check_bag_name(target)
    keep = bags.Expression(text)
    show = bags.Expression(print) if print else None
    try:
        with bags.open_reader(source) as reader:
            total = bags.data_size(reader)
    except (BagError, OSError) as error:
        report(unreadable(source, error))
        return 0 if isinstance(error, BagEncryptedError) else 1

    try:
        # Hide the progress bar if matches are printed to the same terminal, because they would overwrite each other.
        with showing_progress(target, total, quiet=show is not None and sys.stdout.isatty()) as progress:
            bags.filter_bag(source, target, keep, progress, show=show, on_shown=_print_match, warn=report)
    except (BagError, ValueTextError, MessageException) as error:
        why = error if isinstance(error, MinirospyError) else MinirospyError(str(error))
        return complain("rosbag", why)
    return 0


def _print_match(kept: bool, value: object) -> None:
    print("MATCH" if kept else "NO MATCH", value)


VERBS = (
    Verb("rosbag info", "Summarize the contents of one or more bag files.", _info_parser, _info),
    Verb("rosbag filter", "Filter the contents of the bag.", _filter_parser, _filter),
)
