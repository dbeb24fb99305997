"""`rosrun roslaunch roslaunch-check`: whether launch files load, and what they run is there; as a test.

Source: http://wiki.ros.org/roslaunch/roslaunch-check, http://wiki.ros.org/roslaunch (roslaunch_add_file_check).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.cli.command import Parser, run
from minirospy.errors import MinirospyError
from minirospy.launch.check import faults_of, told
from minirospy.testing.junit import failure_junit_xml, success_junit_xml
from minirospy.workspace.packages import Packages, package_name

__all__ = ["main"]

_CLASS = "roslaunch.RoslaunchCheck"


def main(argv: Sequence[str] | None = None) -> int:
    """The command; 0 all files are right, 1 one is not."""
    return run("roslaunch-check", lambda: _check(sys.argv[1:] if argv is None else argv))


def _check(argv: Sequence[str]) -> int:
    parser = Parser(
        prog="roslaunch-check",
        usage="roslaunch-check [options] FILE|FOLDER [VARIABLE=value ...]",
        description="Loads launch files without running them; status 1 where one has a fault.",
    )
    parser.add_argument("path", type=Path, help="a launch file, or a folder of them")
    parser.add_argument("variables", nargs="*", help="VARIABLE=value: put into the environment")
    parser.add_argument(
        "-o", "--output-file", type=Path, metavar="FILE", help="write the result there, as JUnit XML"
    )
    parser.add_argument("-t", "--use-test-depends", action="store_true", help="accepted, without effect")
    parser.add_argument(
        "-i", "--ignore-unset-args", action="store_true", help="an argument without a default is no fault"
    )
    options = parser.parse_args(argv)
    path: Path = options.path
    if not path.exists():
        raise MinirospyError(f"there is no launch file or folder [{path}]")
    os.environ.update(word.split("=", 1) for word in options.variables if "=" in word)
    files = [path] if path.is_file() else sorted(path.rglob("*.launch"))
    faults = [line for file in files for line in _faults(file, ignore_unset_args=options.ignore_unset_args)]
    if options.output_file:
        output: Path = options.output_file
        output.parent.mkdir(parents=True, exist_ok=True)
        name = _test_name(path.resolve())
        result = (output.name, "\n".join(faults), None, _CLASS, name)
        output.write_bytes(
            failure_junit_xml(*result) if faults else success_junit_xml(output.name, _CLASS, name)
        )
        print(f"...writing test results to {output}")
    if faults:
        print("FAILURE:", *faults, sep="\n", file=sys.stderr)
        return 1
    print("passed")
    return 0


def _faults(file: Path, *, ignore_unset_args: bool) -> list[str]:
    print(f"checking {file}")
    return [told(each) for each in faults_of(str(file), Packages(), ignore_unset_args=ignore_unset_args)]


def _test_name(path: Path) -> str:
    """``package_launch_file_launch``."""
    for folder in (path, *path.parents):
        name = package_name(folder) if folder.is_dir() else None
        if name:
            parts = path.relative_to(folder).as_posix().replace(".", "_").split("/")
            return "_".join([name, *filter(None, parts)])
    return path.name.replace(".", "_")


if __name__ == "__main__":
    sys.exit(main())
