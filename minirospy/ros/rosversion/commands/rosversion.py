"""rosversion: print the version of a package or of the ROS distribution.

Source: http://wiki.ros.org/rosversion. minirospy is not a distribution, so -d prints ROS_DISTRO if a workspace or a real
ROS has set it, otherwise noetic, the last distribution of ROS 1, with which minirospy is compatible.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from minirospy.base.errors import NotFoundError
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Command
from minirospy.workspace.folders import distro_codename
from minirospy.workspace.manifest import read_manifest
from minirospy.workspace.packages import Packages

__all__ = ["COMMAND", "main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return an exit status as in minirospy.command.command."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser(
        "rosversion",
        "Print the version of a package, or the name of the ROS distribution.",
        "rosversion [-h] [-s] [-d] [-a] [package]",
        # ROS's own text, although it swaps the descriptions of the two forms.
        about="rosversion -d: Output the version of the given package\n"
        "rosversion package: Output the ROS distribution name",
        ros_argparse="rosversion",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )

    parser.add_argument(
        "package", nargs="?", help="The ROS package name (e.g. 'roscpp')", completer="package_names"
    )
    parser.add_argument("-s", "--skip-newline", action="store_true", help="Skip trailing newline")
    parser.add_argument("-d", "--distro", action="store_true", help="Output the ROS distribution name")
    parser.add_argument(
        "-a", "--all", action="store_true", help="Show all ROS package names and their versions"
    )
    return parser


def _rosversion(package: str | None, skip_newline: bool, distro: bool, all: bool) -> None:
    if (package is not None) + distro + all != 1:
        raise Misuse(
            "name one package, or -d for the distribution, or -a for every package",
            "one of the arguments package -d/--distro -a/--all is required",
        )

    if distro:
        text = distro_codename()
    elif all:
        folders = Packages().folders()
        manifests = {name: read_manifest(folders[name]) for name in sorted(folders)}
        text = "\n".join(
            f"{name}: {read.version}" for name, read in manifests.items() if not read.is_rosbuild
        )
    else:
        try:
            folder = Packages().find(str(package))
            manifest = read_manifest(folder)
            if manifest.is_rosbuild:
                raise NotFoundError("version", str(package), (), f"{manifest.path} has no version")
        except NotFoundError:
            print(f"Cannot locate [{package}]", flush=True)
            raise
        text = manifest.version
    sys.stdout.write(text if skip_newline else text + "\n")


COMMAND = Command("rosversion", _parser, _rosversion)

if __name__ == "__main__":
    sys.exit(main())
