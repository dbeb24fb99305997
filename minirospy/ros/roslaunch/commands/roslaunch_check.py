"""`rosrun roslaunch roslaunch-check`: check that launch files load and that the programs they run exist.

Source: http://wiki.ros.org/roslaunch/roslaunch-check, http://wiki.ros.org/roslaunch (roslaunch_add_file_check).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.base.errors import MinirospyError
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command
from minirospy.ros.roslaunch.launcher.check import faults_of, problem_line
from minirospy.ros.rosunit.runner.junit import failure_junit_xml, success_junit_xml
from minirospy.workspace.packages import Packages, package_name

__all__ = ["COMMAND", "main"]

_CLASS = "roslaunch.RoslaunchCheck"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 0 if all files are valid, else 1."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser(
        prog="roslaunch-check",
        usage="roslaunch-check [options] FILE|FOLDER [VARIABLE=value ...]",
        description="Loads launch files without running them; status 1 where one has a fault.",
    )

    parser.add_argument(
        "path", type=Path, help="a launch file, or a folder of them", completer="launch_files"
    )
    parser.add_argument(
        "variables", nargs="*", help="VARIABLE=value: put into the environment", completer="nothing"
    )

    parser.add_argument(
        "-o",
        "--output-file",
        type=Path,
        metavar="FILE",
        help="write the result there, as JUnit XML",
        completer="files",
    )

    parser.accept("-t", "--use-test-depends")
    parser.add_argument(
        "-i", "--ignore-unset-args", action="store_true", help="accept arguments without a default"
    )
    return parser


def _check(path: Path, variables: Sequence[str], output_file: Path | None, ignore_unset_args: bool) -> int:
    if not path.exists():
        raise MinirospyError(f"launch file or folder [{path}] does not exist")
    os.environ.update(dict(word.split("=", 1) for word in variables if "=" in word))
    files = [path] if path.is_file() else sorted(path.rglob("*.launch"))
    faults = [line for file in files for line in _faults(file, ignore_unset_args=ignore_unset_args)]
    if output_file:
        output_file.parent.mkdir(parents=True, exist_ok=True)
        name = _test_name(path.resolve())
        result = (output_file.name, "\n".join(faults), None, _CLASS, name)
        output_file.write_bytes(
            failure_junit_xml(*result) if faults else success_junit_xml(output_file.name, _CLASS, name)
        )
        print(f"...writing test results to {output_file}")
    if faults:
        print("FAILURE:", *faults, sep="\n", file=sys.stderr)
        return 1
    print("passed")
    return 0


def _faults(file: Path, *, ignore_unset_args: bool) -> list[str]:
    print(f"checking {file}")
    return [
        problem_line(each) for each in faults_of(str(file), Packages(), ignore_unset_args=ignore_unset_args)
    ]


def _test_name(path: Path) -> str:
    """Return the test name ``package_launch_file_launch``."""
    for folder in (path, *path.parents):
        name = package_name(folder) if folder.is_dir() else None
        if name:
            parts = path.relative_to(folder).as_posix().replace(".", "_").split("/")
            return "_".join([name, *filter(None, parts)])
    return path.name.replace(".", "_")


COMMAND = Command("roslaunch-check", _parser, _check)

if __name__ == "__main__":
    sys.exit(main())
