"""`rosbag export`: write topics of a bag as CSV or Parquet tables. This command does not exist in ROS."""

from __future__ import annotations

import os

from minirospy.base.errors import BagError, BagUnindexedError, NotFoundError
from minirospy.command.parser import Parser
from minirospy.command.verbs import Verb
from minirospy.ros.rosbag.commands.rosbag_info import report

__all__ = ["VERB"]


def _parser() -> Parser:
    parser = Parser(
        "rosbag export",
        "Write topics of a bag or an MCAP file as tables, one file for each topic: a row for each message, a column for each "
        "field, such as pose.position.x or position[elbow]. Byte arrays, such as images, are left out.",
    )
    parser.add_argument("bag", metavar="BAG", help="a bag or an MCAP file", completer="bag_files")
    parser.add_argument(
        "topics", nargs="*", metavar="TOPIC", help="topics (default: all)", completer="nothing"
    )
    parser.add_argument(
        "--format", default="csv", choices=("csv", "parquet"), help="parquet needs pyarrow (default: csv)"
    )
    parser.add_argument(
        "-o", "--output-dir", metavar="DIR", default=".", help="where the files are written (default: here)",
        completer="files",
    )  # fmt: skip
    parser.add_argument("-f", "--force", action="store_true", help="replace files")
    parser.add_argument("-q", "--quiet", action="store_true", help="print only errors")
    return parser


def _export(bag: str, topics: list[str], format: str, output_dir: str, force: bool, quiet: bool) -> None:
    from minirospy.introspect.bag_export import export

    if not os.path.exists(bag):
        raise NotFoundError("bag", bag)
    try:
        os.makedirs(output_dir, exist_ok=True)
        found = export(bag, topics, output_dir, format, force=force, warn=report)
    except BagUnindexedError as error:
        raise BagError(f"{bag}: {error}. Run `rosbag reindex {bag}`") from error
    except BagError as error:
        raise BagError(f"{bag}: {error}") from error
    if quiet:
        return
    for each in found:
        without = f", without {', '.join(each.left_out)}" if each.left_out else ""
        print(f"{os.path.normpath(each.path)}: {each.rows} rows, {each.columns} columns{without}")


VERB = Verb("rosbag export", "Write topics of a bag as CSV or Parquet.", _parser, _export)
