"""`roslaunch-deps`: print the packages that launch files depend on.

Source: http://wiki.ros.org/roslaunch/Commandline%20Tools#roslaunch-deps.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from minirospy.command.command import warn as print_warning
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Command
from minirospy.ros.roslaunch.launcher.depends import FileNeeds, file_needs, missing_declarations, package_of
from minirospy.workspace.packages import Packages

__all__ = ["COMMAND", "main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser(
        "roslaunch-deps",
        "Print the packages that launch files need.",
        "roslaunch-deps [options] <file(s)...>",
        missing="please specify a launch file",
    )
    parser.add_argument("files", nargs="+", metavar="FILE", completer="launch_files")
    parser.add_argument("-v", "--verbose", action="store_true", help="Verbose output")
    parser.add_argument("-w", "--warn", action="store_true", help="Warn about missing manifest dependencies")
    return parser


def _deps(files: Sequence[str], verbose: bool, warn: bool) -> int:
    for file in files:
        if not Path(file).is_file():
            raise Misuse(f"cannot locate {file}")

    needs = file_needs(files, Packages(), lambda problem: print_warning(str(problem)))
    if warn:
        print("Dependencies:")
    if verbose:
        _print_files(needs)
    own = package_of(files[0])
    wanted = {package for what in needs.values() for package in what.packages}
    # Omit the files' own package, unless it is the only one.
    print(" ".join(sorted(wanted - {own} or wanted)))
    if warn:
        print("\nMissing declarations:")
        for package, missing in missing_declarations(needs).items():
            print(
                f"{package}/package.xml:",
                *(f"  <exec_depend>{name}</exec_depend>" for name in missing),
                sep="\n",
            )
    return 0


def _print_files(needs: Mapping[str, FileNeeds]) -> None:
    for file, what in needs.items():
        for package, program in what.nodes:
            print(f"{package} [{package}/{program}]")
        print(f"{package_of(file)} [{file}]")
    print("-" * 80)


COMMAND = Command("roslaunch-deps", _parser, _deps)

if __name__ == "__main__":
    sys.exit(main())
