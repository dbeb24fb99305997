"""`roslaunch-deps`: the packages that launch files need.

Source: http://wiki.ros.org/roslaunch/Commandline%20Tools#roslaunch-deps.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from minirospy.cli.command import Parser, run, warn
from minirospy.launch.depends import FileNeeds, file_needs, missing_declarations, package_of
from minirospy.workspace.packages import Packages

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """The command; its exit status."""
    return run("roslaunch-deps", lambda: _deps(sys.argv[1:] if argv is None else argv))


def _deps(argv: Sequence[str]) -> int:
    parser = Parser(
        prog="roslaunch-deps",
        usage="roslaunch-deps [options] FILE [FILE ...]",
        description="Prints the packages that launch files need.",
    )
    parser.add_argument("files", nargs="+", metavar="FILE")
    parser.add_argument("-v", "--verbose", action="store_true", help="print what each file needs")
    parser.add_argument(
        "-w", "--warn", action="store_true", help="print the packages that package.xml does not name"
    )
    options = parser.parse_args(argv)
    files: list[str] = options.files
    for file in files:
        if not Path(file).is_file():
            parser.error(f"cannot locate {file}")
    needs = file_needs(files, Packages(), lambda problem: warn(str(problem)))
    if options.warn:
        print("Dependencies:")
    if options.verbose:
        _print_files(needs)
    own = package_of(files[0])
    wanted = {package for what in needs.values() for package in what.packages}
    # Its own package is named where nothing else is.
    print(" ".join(sorted(wanted - {own} or wanted)))
    if options.warn:
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


if __name__ == "__main__":
    sys.exit(main())
