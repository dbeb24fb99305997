"""`rostest` and `rosunit`: run the tests in a launch file or a unit test file, and report the results.

Source: http://wiki.ros.org/rostest/Commandline, http://wiki.ros.org/rosunit.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.base import private_files
from minirospy.base.environment import Environment
from minirospy.base.errors import MinirospyError, NotFoundError, UsageError
from minirospy.command.parser import AssignmentParser, Misuse, Parser
from minirospy.command.verbs import Command
from minirospy.ros.rosunit.runner.junit import Result, report
from minirospy.ros.rosunit.runner.unit import begin_results, rostest_name_from_path
from minirospy.workspace.packages import Packages, package_name

__all__ = ["ROSTEST", "ROSUNIT", "rostest", "rosunit"]


def rostest(argv: Sequence[str] | None = None) -> int:
    """Run rostest; return 0 if all tests passed, 1 if one could not run or reported no results, 2 if one failed."""
    return ROSTEST.main(argv)


def rosunit(argv: Sequence[str] | None = None) -> int:
    """Run rosunit; return 0 if all tests passed, 1 if the file could not run or reported no results, 2 if one failed."""
    return ROSUNIT.main(argv)


def _rostest_parser() -> Parser:
    parser = AssignmentParser(
        prog="rostest",
        usage="rostest [options] PACKAGE FILE [arg:=value ...]\n       rostest [options] FILE [arg:=value ...]",
        description="Run each <test> of a launch file, with the file's nodes and a new master on a free port.",
        epilog="Exit status: 0 all passed, 1 a test could not be run or wrote no results, 2 a test failed.",
    )

    add = parser.add_argument
    add("what", nargs="*", help="a package and a file in it, or a file", completer="launch_words")
    add("-t", "--text", action="store_true", help="print everything, write no files of results")
    add(
        "--results-filename",
        metavar="NAME",
        help="name of the file of results, instead of the test's",
        completer="nothing",
    )
    add(
        "--results-base-dir",
        metavar="DIR",
        help="folder of results, instead of ~/.ros/test_results",
        completer="folders",
    )

    add("-r", "--reuse-master", action="store_true", help="use the master that runs")
    add("-c", "--clear", action="store_true", help="with --reuse-master: delete all its parameters first")
    add(
        "--package",
        metavar="PKG",
        help="name the results after this package, instead of the file's",
        completer="package_names",
    )
    add("--pkgdir", metavar="DIR", help="the folder that the file's name is relative to", completer="folders")
    return parser


def _rostest(
    what: list[str],
    text: bool,
    results_filename: str | None,
    results_base_dir: str | None,
    reuse_master: bool,
    clear: bool,
    package: str | None,
    pkgdir: str | None,
    args: dict[str, str],
) -> int:
    if not what:
        raise Misuse("You must supply a test file argument to rostest.")
    if clear and not reuse_master:
        raise Misuse("The --clear option is only valid with --reuse-master")

    packages = Packages()
    file = _file(what, packages)
    folder = pkgdir
    if not (package and folder):
        found = _package_of(file, "rostest", "--package NAME --pkgdir FOLDER")
        package, folder = package or found[0], folder or str(found[1])

    from minirospy.ros.roslaunch.launcher.load import load_files
    from minirospy.ros.rostest.runner.runner import RosTest

    base = _base(results_base_dir)
    # Delete the simulated boards that test nodes create, such as MINIROSPY_BOARD=$(anon test), when the nodes exit.
    os.environ["MINIROSPY_BOARD_TEMPORARY"] = "1"
    test = RosTest(
        package=package,
        spec=load_files([str(file)], args, packages),
        environment=Environment.read(),
        packages=packages,
        results_dir=base,
        text=text,
        reuse_master=reuse_master,
        clear=clear,
    )
    name = results_filename or rostest_name_from_path(os.path.abspath(folder), str(file))
    output = base / package / f"rostest-{name.removesuffix('.xml')}.xml"
    if text:
        test.run()
        return _told(test.own, test.results, "ROSTEST", None)
    log_file = test.environment.log_dir / f"{test.run_id}.log"
    print(f"... logging to {log_file}")
    begin_results(output)
    test.run()
    if test.spec.tests:
        print()
    status = _told(test.own, test.results, "ROSTEST", output)
    log_file.parent.mkdir(parents=True, exist_ok=True)
    with private_files.open_text(log_file, "w") as stream:
        stream.write(test.own.system_out)
    print(f"rostest log file is in {log_file}")
    return status


def _rosunit_parser() -> Parser:
    parser = Parser(
        "rosunit",
        "Runs a unit test's file, and reads the results that it writes.",
        "rosunit [options] <file> [test args...]",
        intermixed=False,
        epilog="Exit status: 0 all passed, 1 the file could not be run or wrote no results, 2 a test failed.",
    )

    add = parser.add_argument
    add(
        "file",
        nargs="?",
        help="a Python file, or a program, that calls rosunit.unitrun",
        completer="files",
    )
    add("arguments", nargs=argparse.REMAINDER, help="what the file is given", completer="files")

    add("-t", "--text", action="store_true", help="Run with stdout output instead of XML output")
    add("--time-limit", type=float, default=60.0, help="Set time limit for test")
    add("--name", metavar="TEST_NAME", help="Test name", completer="nothing")
    add(
        "--package",
        metavar="PACKAGE_NAME",
        help="Package name (optional)",
        completer="package_names",
    )
    return parser


def _rosunit(
    file: str | None,
    arguments: list[str],
    text: bool,
    time_limit: float,
    name: str | None,
    package: str | None,
) -> int:
    if not file:
        raise Misuse("You must supply a test file.")
    path = Path(file)
    if not path.is_file():
        raise MinirospyError(f"test file {path} does not exist")
    package = package or _package_of(path, "rosunit", "--package NAME")[0]
    name = name or path.stem

    from minirospy.ros.rosunit.runner.bare import run_bare

    base = _base(None)
    output = base / package / f"rostest-{name}.xml"
    results_file = base / package / f"rosunit-{name}.xml"
    if not text:
        begin_results(output)
    results, case = run_bare(path, arguments, results_file, package, name, seconds=time_limit, text=text)
    own = Result("unittest.suite.TestSuite")
    own.add_case(case)
    print(case.line)
    return _told(own, results, "ROSUNIT", None if text else output)


def _told(own: Result, results: Result, runner: str, output: Path | None) -> int:
    """If ``output`` is given, write the runner's own results there and print all results; return the exit status."""
    if output is not None:
        own.write(output)
        failed = [case.name for case in own.test_case_results if case.failures]
        print(report(results, runner, own.num_errors, failed))
    if own.num_errors or own.num_failures:
        return 1
    return 2 if results.num_errors or results.num_failures else 0


def _base(folder: str | None) -> Path:
    from minirospy.workspace.folders import results_dir

    return Path(folder or results_dir()).absolute()


def _file(what: list[str], packages: Packages) -> Path:
    """Return the command line's launch file.

    Raise MinirospyError if the file does not exist or the arguments are invalid.
    """
    if len(what) == 1:
        if Path(what[0]).is_file():
            return Path(what[0]).resolve()
        raise MinirospyError(f"[{what[0]}] is not a launch file name: type rostest PACKAGE FILE, or a path")
    if len(what) > 2:
        raise UsageError("type rostest PACKAGE FILE, or rostest FILE (`rostest -h` shows what there is)")
    package, file = what
    try:
        return packages.find_resource(package, file)
    except NotFoundError as error:
        raise MinirospyError(
            f"[{file}] is neither a launch file in package [{package}] nor is [{package}] a launch file name: {error}"
        ) from error


def _package_of(file: Path, command: str, options: str) -> tuple[str, Path]:
    """Return the name and folder of the package that contains a file. Raise MinirospyError if there is none."""
    for folder in file.resolve().parents:
        name = package_name(folder)
        if name:
            return name, folder
    raise MinirospyError(f"{file} is in no package (no package.xml above it): type {command} {options} FILE")


ROSTEST = Command("rostest", _rostest_parser, _rostest, interrupted=1)
ROSUNIT = Command("rosunit", _rosunit_parser, _rosunit, interrupted=1)


if __name__ == "__main__":
    sys.exit(rostest())
