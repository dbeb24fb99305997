"""`rosbag record` and `rosrun rosbag record`: record topics into bags.

Source: http://wiki.ros.org/rosbag/Commandline#record. Options and errors are those of ROS's command and its C++ program.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import BagCompressionError, ROSInterruptException, UsageError
from minirospy.command.parser import Misuse, Parser, attach_completer
from minirospy.command.verbs import Command, Verb, with_options

if TYPE_CHECKING:
    from minirospy.ros.rosbag.recording.options import RecordOptions

__all__ = ["COMMAND", "VERB", "main", "without_split_size"]


class RecordArguments(NamedTuple):
    """Parsed command line of rosbag record."""

    topics: list[str]
    all: bool
    regex: bool
    publish: bool
    exclude: str
    quiet: bool
    output_prefix: str
    output_name: str
    split: bool
    max_splits: int
    size: int | None
    duration: str
    buffsize: int
    chunksize: int | None
    limit: int
    node: str
    bz2: bool
    lz4: bool
    tcpnodelay: bool
    udp: bool
    repeat_latched: bool
    min_space: str
    topic: list[str]
    mcap: bool
    zstd: bool


def main(argv: Sequence[str] | None = None) -> int:
    """Run `rosrun rosbag record`; return its exit status."""
    return COMMAND.main(list(without_split_size(sys.argv[1:] if argv is None else argv)))


def without_split_size(words: Sequence[str]) -> Iterator[str]:
    """Yield the words, replacing ``--split=N`` and ``--split N`` from old launch files with ``--split --size N``."""
    for number, word in enumerate(words):
        size = word.removeprefix("--split=")
        is_value = size == word and number and words[number - 1] == "--split" and word.lstrip("-").isdecimal()
        if is_value or (size != word and size):
            print(
                'Use of "--split <MAX_SIZE>" has been deprecated.  Please use --split --size <MAX_SIZE> or '
                "--split --duration <MAX_DURATION>",
                file=sys.stderr,
            )
            yield from ("--size", size) if is_value else ("--split", "--size", size)
        else:
            yield word


def _parser() -> Parser:
    parser = Parser(
        "rosbag record",
        "",
        "rosbag record TOPIC1 [TOPIC2 TOPIC3 ...]",
        about="Record a bag file with the contents of specified topics.",
    )
    parser.add_argument(
        "topics", nargs="*", help="topics, or with -e regular expressions", completer="topics"
    )
    add = parser.add_argument
    add("-a", "--all", action="store_true", help="record all topics")
    add("-e", "--regex", action="store_true", help="match topics using regular expressions")
    add("-p", "--publish", action="store_true", help="publish a msg when the record begin")
    add("-x", "--exclude", default="", metavar="EXCLUDE_REGEX", completer="nothing",
        help="exclude topics matching the follow regular expression (subtracts from -a or regex)")  # fmt: skip
    add("-q", "--quiet", action="store_true", help="suppress console output")
    add("-o", "--output-prefix", default="", metavar="PREFIX", completer="nothing",
        help="prepend PREFIX to beginning of bag name (name will always end with date stamp)")  # fmt: skip
    add("-O", "--output-name", default="", metavar="NAME", help="record to bag with name NAME.bag",
        completer="files")  # fmt: skip
    add("--split", action="store_true", help="split the bag when maximum size or duration is reached")
    add("--max-splits", type=int, default=0, metavar="MAX_SPLITS",
        help="Keep a maximum of N bag files, when reaching the maximum erase the oldest one to keep a constant number "
        "of files.")  # fmt: skip
    add("--size", type=int, default=None, metavar="SIZE",
        help="record a bag of maximum size SIZE MB. (Default: infinite)")  # fmt: skip
    add("--duration", default="", metavar="DURATION", completer="nothing",
        help="record a bag of maximum duration DURATION in seconds, unless 'm', or 'h' is appended.")  # fmt: skip
    add("-b", "--buffsize", type=int, default=256, metavar="SIZE",
        help="use an internal buffer of SIZE MB (Default: 256, 0 = infinite)")  # fmt: skip
    add("--chunksize", type=int, default=None, metavar="SIZE",
        help="Advanced. Record to chunks of SIZE KB (Default: 768)")  # fmt: skip
    add("-l", "--limit", type=int, default=0, metavar="NUM",
        help="only record NUM messages on each topic")  # fmt: skip
    add("--node", default="", metavar="NODE", help="record all topics subscribed to by a specific node",
        completer="nodes")  # fmt: skip
    add("-j", "--bz2", action="store_true", help="use BZ2 compression")
    add("--lz4", action="store_true", help="use LZ4 compression")
    add("--tcpnodelay", action="store_true",
        help="Use the TCP_NODELAY transport hint when subscribing to topics.")  # fmt: skip
    add("--udp", action="store_true", help="Use the UDP transport hint when subscribing to topics.")
    add("--repeat-latched", action="store_true",
        help="Repeat latched msgs at the start of each new bag file.")  # fmt: skip

    own = parser.own_options()
    space = own.add_argument(
        "-L",
        "--min-space",
        default="1G",
        metavar="SIZE",
        help="stop below this space on the disk (Default: 1G; G, M, k multipliers), as `rosrun rosbag record` of ROS",
    )
    attach_completer(space, "nothing")
    topic = own.add_argument(
        "--topic", action="append", default=[], metavar="TOPIC", help="a topic, as its name alone"
    )
    attach_completer(topic, "topics")
    own.add_argument(
        "--mcap", action="store_true", help="record MCAP files (minirospy[mcap]) instead of bags"
    )
    own.add_argument("--zstd", action="store_true", help="use Zstandard compression, with --mcap")
    return parser


def _record_verb(given: RecordArguments) -> int:
    # `rosbag record` rejects a prefix together with a name. `rosrun rosbag record` accepts both and ignores the prefix.
    if given.output_prefix and given.output_name:
        text = "Can't set both prefix and name."
        raise Misuse(text, text)
    return _record(given)


def _record(given: RecordArguments) -> int:
    from minirospy.base.names import is_legal_name, parse_arguments
    from minirospy.ros.rosbag.recording.options import MEGABYTE, RecordOptions, parse_duration, parse_size

    names = (*parse_arguments(given.topics).plain, *given.topic)
    if not names and not given.all and not given.node:
        text = "You must specify a topic name or else use the '-a' option."
        raise Misuse(text, text)
    if given.split and not given.duration and not given.size:
        text = "Split specified without giving a maximum duration or size"
        raise Misuse(text, text)
    for name in names:
        if not given.regex and not is_legal_name(name):
            raise UsageError(f"{name!r} is not a legal name of a topic: letters, digits, _ and /")
    _check_range("Buffer size", given.buffsize)
    chunksize = given.chunksize
    if chunksize is not None:
        _check_range("Chunk size", chunksize)
    elif given.mcap:
        chunksize = 4096
    else:
        chunksize = 768
    if given.size is not None and given.size < 0:
        raise UsageError("Split size must be 0 or positive")
    if given.limit > 0 and not names:
        raise UsageError("Specifying a count is not valid with automatic topic subscription.")

    return _run(
        RecordOptions(
            topics=names,
            all_topics=given.all,
            regex=given.regex,
            exclude=given.exclude,
            node=given.node,
            prefix=given.output_name or given.output_prefix,
            append_date=not given.output_name,
            split=given.split,
            max_splits=max(0, given.max_splits) if given.split else 0,
            max_size=(given.size or 0) * MEGABYTE,
            max_duration=parse_duration(given.duration) if given.duration else 0,
            buffer_size=given.buffsize * MEGABYTE,
            chunk_size=chunksize * 1024,
            limit=max(0, given.limit),
            min_space=parse_size(given.min_space),
            min_space_text=given.min_space,
            compression=_compression(given.bz2, given.lz4, given.zstd, given.mcap),
            tcp_nodelay=given.tcpnodelay,
            repeat_latched=given.repeat_latched,
            publish=given.publish,
            mcap=given.mcap,
        ),
        quiet=given.quiet,
    )


def _run(options: RecordOptions, *, quiet: bool) -> int:
    # imported here because --help does not need the client library
    from minirospy import client
    from minirospy.core.bag.compression import check_compression
    from minirospy.core.bag.mcap_writer import check_mcap
    from minirospy.ros.rosbag.recording.recorder import Recorder

    if options.mcap:
        check_mcap()
    else:
        check_compression(options.compression)
    recorder = Recorder(options)
    try:
        client.init_node("record", anonymous=True, log_level=client.WARN if quiet else None)
    except ROSInterruptException:
        return 0  # interrupted while waiting for the master
    return recorder.run()


def _compression(bz2: bool, lz4: bool, zstd: bool, mcap: bool) -> str:
    chosen = [name for name, is_chosen in (("bz2", bz2), ("lz4", lz4), ("zstd", zstd)) if is_chosen]
    if len(chosen) > 1:
        raise UsageError("Can only use one type of compression")
    if chosen == ["bz2"] and mcap:
        raise BagCompressionError("bz2", "MCAP files have lz4 (--lz4) and Zstandard (--zstd)")
    if chosen == ["zstd"] and not mcap:
        raise BagCompressionError("zstd", "bags have bz2 (-j) and lz4 (--lz4); MCAP files (--mcap) have zstd")
    return chosen[0] if chosen else "none"


def _check_range(what: str, value: int) -> None:
    if value < 0:
        raise UsageError(f"{what} must be 0 or positive")


VERB = Verb(
    "rosbag record",
    "Record a bag file with the contents of specified topics.",
    _parser,
    with_options(RecordArguments, _record_verb),
)
COMMAND = Command("record", _parser, with_options(RecordArguments, _record))
