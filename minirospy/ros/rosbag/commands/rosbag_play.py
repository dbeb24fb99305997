"""`rosbag play` and `rosrun rosbag play`: publish the messages of bags with their original timing.

Source: http://wiki.ros.org/rosbag/Commandline#play. Options and messages are those of ROS's command and its C++ program.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import ROSInterruptException, UsageError
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Command, Verb, with_options
from minirospy.ros.rosbag.commands.rosbag_info import report

if TYPE_CHECKING:
    from minirospy.ros.rosbag.recording.schedule import PlayOptions

__all__ = ["COMMAND", "VERB", "main"]

_MAX_RATE = 1e6
_MAX_HZ = 1e4
_FOREVER = 1e12


class PlayArguments(NamedTuple):
    """Parsed command line of rosbag play."""

    bagfiles: list[str]
    prefix: str
    quiet: bool
    immediate: bool
    pause: bool
    queue: int
    clock: bool
    hz: float
    delay: float
    rate: float
    start: float
    duration: float
    skip_empty: float | None
    loop: bool
    keep_alive: bool
    try_future_version: bool
    topics: list[str]
    pause_topics: list[str]
    bags: list[str]
    wait_for_subscribers: bool
    rate_control_topic: str
    rate_control_max_delay: float
    foxglove: bool
    foxglove_port: int


def main(argv: Sequence[str] | None = None) -> int:
    """Run `rosrun rosbag play`; return its exit status."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser(
        "rosbag play",
        "",
        "rosbag play BAGFILE1 [BAGFILE2 BAGFILE3 ...]",
        about="Play back the contents of one or more bag files in a time-synchronized fashion.",
    )
    add = parser.add_argument
    add("bagfiles", nargs="*", help="bags, or MCAP files", completer="bag_files")
    add("-p", "--prefix", default="", metavar="PREFIX", help="prefix all output topics", completer="nothing")
    add("-q", "--quiet", action="store_true", help="suppress console output")
    add("-i", "--immediate", action="store_true", help="play back all messages without waiting")
    add("--pause", action="store_true", help="start in paused mode")
    add("--queue", type=int, default=100, metavar="SIZE",
        help="use an outgoing queue of size SIZE (defaults to 100)")  # fmt: skip
    add("--clock", action="store_true", help="publish the clock time")
    add("--hz", type=float, default=100.0, metavar="HZ",
        help="use a frequency of HZ when publishing clock time (default: 100)")  # fmt: skip
    add("-d", "--delay", type=float, default=0.2, metavar="SEC",
        help="sleep SEC seconds after every advertise call (to allow subscribers to connect)")  # fmt: skip
    add("-r", "--rate", type=float, default=1.0, metavar="FACTOR", help="multiply the publish rate by FACTOR")
    add("-s", "--start", type=float, default=0.0, metavar="SEC", help="start SEC seconds into the bag files")
    add("-u", "--duration", type=float, default=0.0, metavar="SEC",
        help="play only SEC seconds from the bag files")  # fmt: skip

    add("--skip-empty", type=float, default=None, metavar="SEC",
        help="skip regions in the bag with no messages for more than SEC seconds")  # fmt: skip
    add("-l", "--loop", action="store_true", help="loop playback")
    add("-k", "--keep-alive", action="store_true",
        help="keep alive past end of bag (useful for publishing latched topics)")  # fmt: skip
    add("--try-future-version", action="store_true",
        help="still try to open a bag file, even if the version number is not known to the player")  # fmt: skip
    # ROS's help shows no metavar for --topics and --pause-topics.
    lists = (
        ("--topics", "topics to play back"),
        ("--pause-topics", "topics to pause on during playback"),
        ("--bags", "bags files to play back from"),
    )
    for name, text in lists:
        metavar = "BAGS" if name == "--bags" else ""
        completer = "bag_files" if name == "--bags" else "topics"
        add(name, nargs="*", default=[], action="extend", help=text, metavar=metavar, completer=completer)
    add("--wait-for-subscribers", action="store_true",
        help="wait for at least one subscriber on each topic before publishing")  # fmt: skip
    add("--rate-control-topic", default="", metavar="RATE_CONTROL_TOPIC", completer="topics",
        help="watch the given topic, and if the last publish was more than <rate-control-max-delay> ago, wait until the "
        "topic publishes again to continue playback")  # fmt: skip
    add("--rate-control-max-delay", type=float, default=1.0, metavar="RATE_CONTROL_MAX_DELAY",
        help="maximum time difference from <rate-control-topic> before pausing")  # fmt: skip
    own = parser.own_options().add_argument
    own("--foxglove", action="store_true",
        help="serve Foxglove and Lichtblick, which get a timeline to pause, seek and change the rate")  # fmt: skip
    own("--foxglove-port", type=int, default=8765, metavar="PORT", help="port for that (8765)")
    return parser


def _play(given: PlayArguments) -> int:
    from minirospy.base.names import parse_arguments
    from minirospy.ros.rosbag.recording.schedule import PlayOptions

    paths = parse_arguments([*given.bagfiles, *given.bags]).plain
    if not paths:
        text = "You must specify at least 1 bag file to play back."
        raise Misuse(text, text)
    for name, value, most in (("--rate", given.rate, _MAX_RATE), ("--hz", given.hz, _MAX_HZ)):
        if not 1 / _MAX_RATE <= value <= most:
            raise UsageError(f"{name} must be above 0, and at most {most:g}")

    options = PlayOptions(
        prefix=given.prefix,
        immediate=given.immediate,
        paused=given.pause,
        queue_size=max(0, given.queue),
        clock=given.clock,
        clock_hz=given.hz,
        delay=_nanoseconds("--delay", given.delay),
        rate=given.rate,
        start=_nanoseconds("--start", given.start),
        duration=_nanoseconds("--duration", given.duration),
        skip_empty=None if given.skip_empty is None else _nanoseconds("--skip-empty", given.skip_empty),
        loop=given.loop,
        keep_alive=given.keep_alive,
        topics=frozenset(parse_arguments(given.topics).plain),
        pause_topics=frozenset(parse_arguments(given.pause_topics).plain),
        wait_for_subscribers=given.wait_for_subscribers,
        rate_control_topic=given.rate_control_topic,
        rate_control_max_delay=_nanoseconds("--rate-control-max-delay", given.rate_control_max_delay),
        quiet=given.quiet,
    )
    if not 0 <= given.foxglove_port < 65536:
        raise UsageError(f"--foxglove-port {given.foxglove_port} is not between 0 and 65535")
    return _run(paths, options, given.foxglove_port if given.foxglove else None)


def _nanoseconds(name: str, seconds: float) -> int:
    if not 0 <= seconds < _FOREVER:
        raise UsageError(f"{name} must be 0 or positive")
    return round(seconds * 1e9)


def _run(paths: list[str], options: PlayOptions, foxglove_port: int | None) -> int:
    # imported here because --help does not need the client library
    from minirospy import client
    from minirospy.introspect.bags import left_out
    from minirospy.ros.rosbag.recording.player import Player
    from minirospy.ros.rosbag.recording.sources import Bags

    with Bags(paths) as bags, contextlib.ExitStack() as serving:
        for path, reader in zip(paths, bags.readers, strict=True):
            if foreign := left_out(reader):
                report(f"WARNING: {path}: left out, as they cannot be converted to ROS 1: {foreign}")
        if foxglove_port is not None:
            from minirospy.web.serve import require_libraries

            require_libraries()

        def serve(first: int, last: int) -> None:
            from minirospy.web.playback import PlayerBridge

            assert foxglove_port is not None
            bridge = serving.enter_context(PlayerBridge(player, (first, last), foxglove_port))
            print("\n".join(bridge.lines), flush=True)

        try:
            # Use wall time, because the player itself may publish /clock.
            client.init_node("play", anonymous=True, disable_rostime=True)
            for path in paths:
                client.loginfo("Opening %s", path)
            if options.prefix:
                # Print two closing quotes, like the C++ program.
                client.loginfo("Using prefix '%s'' for topics ", options.prefix)
            player = Player(bags, options, serve if foxglove_port is not None else None)
            return player.run()
        except ROSInterruptException:
            return 0  # interrupted while registering
        finally:
            client.signal_shutdown("the end")


VERB = Verb(
    "rosbag play",
    "Play back the contents of one or more bag files in a time-synchronized fashion.",
    _parser,
    with_options(PlayArguments, _play),
)
COMMAND = Command("play", _parser, with_options(PlayArguments, _play))
