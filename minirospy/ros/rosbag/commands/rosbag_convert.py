"""`rosbag convert`: convert bags to MCAP files and back. This command does not exist in ROS."""

from __future__ import annotations

import os

from minirospy.base.errors import BagError, BagUnindexedError, NotFoundError
from minirospy.base.installation import install_command
from minirospy.command.parser import Parser
from minirospy.command.verbs import Verb

__all__ = ["VERB"]


def _parser() -> Parser:
    parser = Parser(
        "rosbag convert",
        "Write the messages of a bag into an MCAP file, or those of an MCAP file into a bag, without loss. The ends of "
        f"the names specify which: .bag, .mcap. MCAP files need a library: {install_command('minirospy[mcap]')}",
    )
    parser.add_argument("source", metavar="FROM", help="a bag or an MCAP file", completer="bag_files")
    parser.add_argument("target", metavar="TO", help="the file that is written", completer="files")
    parser.add_argument(
        "-c",
        "--compression",
        default="none",
        choices=("none", "bz2", "lz4", "zstd"),
        help="how its chunks are compressed: bz2 in bags only, zstd in MCAP files only (default: none)",
    )
    parser.add_argument("-f", "--force", action="store_true", help="replace a file")
    parser.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    return parser


def _convert(source: str, target: str, compression: str, force: bool, quiet: bool) -> None:
    from minirospy.introspect.bag_convert import check, convert
    from minirospy.ros.rosbag.commands.rosbag_progress import showing_progress

    if not os.path.exists(source):
        raise NotFoundError("bag", source)
    try:
        check(source, target, compression=compression, force=force)
        with showing_progress(target, os.path.getsize(source), quiet=quiet) as step:
            convert(source, target, compression=compression, force=force, step=step)
    except BagUnindexedError as error:
        raise BagError(f"{source}: {error}. Run `rosbag reindex {source}`") from error
    except BagError as error:
        raise BagError(f"{source}: {error}") from error


VERB = Verb("rosbag convert", "Write a bag as an MCAP file, or an MCAP file as a bag.", _parser, _convert)
