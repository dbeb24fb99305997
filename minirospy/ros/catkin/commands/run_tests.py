"""Run the tests of a workspace's packages, for `catkin_make run_tests` and `catkin test`.

Source: http://wiki.ros.org/catkin/CMakeLists.txt (unit tests), http://wiki.ros.org/rostest (add_rostest).
"""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from collections.abc import Collection, Sequence
from pathlib import Path

from minirospy.base.child_lifetime import guard_children
from minirospy.base.errors import BuildError, MinirospyError, NotFoundError
from minirospy.base.installation import install_command
from minirospy.ros.catkin.commands.test_results import Counts, results_below
from minirospy.ros.rosunit.runner.bare import POLL_SECONDS, interrupt_noted
from minirospy.workspace.build import Workspace
from minirospy.workspace.download import download
from minirospy.workspace.packages import DIST_PACKAGES
from minirospy.workspace.plan import Plan, Test

__all__ = ["run_tests"]

# seconds to wait for a test to exit; slightly longer than roslaunch waits for its nodes
_END_SECONDS = 20.0


def run_tests(workspace: Workspace, plans: Sequence[Plan], chosen: Collection[str]) -> int:
    """Run the tests of the chosen packages (default: all); return 1 if a test failed.

    Raise BuildError or NotFoundError if a test cannot be run, MinirospyError on Ctrl-C.

    To choose a single test, use its target name in catkin, such as ``PACKAGE_rostest_test_x.test``. Results are written
    to ``build/test_results/PACKAGE`` as JUnit XML files.
    """
    targets = {name: plan for plan in plans for test in (None, *plan.tests) for name in _targets(plan, test)}
    wanted = {_flat(name) for name in chosen or [plan.name for plan in plans]}
    for name in sorted(wanted - targets.keys()):
        raise NotFoundError("package or test", name, targets, f"the workspace is {workspace.root}")

    worst = 0
    total = Counts()
    for plan in plans:
        if not any(targets[name] is plan for name in wanted):
            continue
        results = workspace.build / "test_results" / plan.name
        if _flat(plan.name) in wanted:
            # Remove old results: the tests that wrote them may no longer exist.
            for file in results.glob("*.xml"):
                file.unlink()
        download(plan, plan.downloads)
        for test in plan.tests:
            if not wanted & {*_targets(plan, None), *_targets(plan, test)}:
                continue
            path = plan.folder / test.path
            if not path.exists():
                raise BuildError(str(plan.cmake_lists), test.line, f"test file [{test.path}] does not exist")
            results.mkdir(parents=True, exist_ok=True)
            command = _COMMANDS[test.kind](plan, test, results)
            print(f"{plan.name}: {' '.join([test.kind, test.path, *test.arguments])}", flush=True)
            status = _run(command, _environment(workspace), _folder_of(test, plan, workspace))
            # pytest exits with status 5 if it finds no tests.
            worst |= status not in ((0, 5) if test.kind == "pytest" else (0,))
        for _, counts in results_below(results):
            if isinstance(counts, Counts):
                total = total.plus(counts)
        if plan.tests:
            print(f"{plan.name}: results are in {results}")

    print(f"Summary: {total}" + (" (a test could not be run)" if worst and not total.is_bad else ""))
    return int(worst)


def _run(command: Sequence[str], environment: dict[str, str], folder: str | Path) -> int:
    """Run a test and return its exit status. On Ctrl-C, wait for the test to stop its nodes, then raise MinirospyError."""
    with (
        interrupt_noted() as interrupted,
        guard_children(),
        subprocess.Popen(command, env=environment, cwd=folder) as popen,
    ):
        while (status := popen.poll()) is None and not interrupted.is_set():
            interrupted.wait(POLL_SECONDS)
        if status is None:
            # The terminal also sent SIGINT to the test, so only wait for it to exit.
            try:
                popen.wait(_END_SECONDS)
            except subprocess.TimeoutExpired:
                popen.terminate()
    if interrupted.is_set():
        raise MinirospyError("interrupted: the tests that were left have not run")
    assert status is not None
    return status


def _folder_of(test: Test, plan: Plan, workspace: Workspace) -> Path:
    """Return the folder in which to run a test. Create the folder if it is the package's build folder.

    As in catkin, ``nosetests --where=FOLDER`` runs in the given folder. A folder of pytest files is run in itself, a single
    pytest file in the build folder, and any other test in the package's folder.
    """
    if test.folder:
        return Path(test.folder)
    if test.kind == "pytest" and (plan.folder / test.path).is_dir():
        return plan.folder / test.path
    if test.kind == "pytest":
        build = workspace.build / plan.name
        build.mkdir(parents=True, exist_ok=True)
        return build
    return plan.folder


def _targets(plan: Plan, test: Test | None) -> list[str]:
    """Return the CMake targets that run all tests of a package or, if ``test`` is given, only that test.

    :func:`_flat` has replaced the separators in their names.
    """
    if test is None:
        return [_flat(plan.name)]
    kinds = {"pytest": ("nosetests", "pytests")}.get(test.kind, (test.kind,))
    return [_flat(f"{plan.name}_{kind}{rest}") for kind in kinds for rest in ("", f"_{test.path}")]


def _flat(name: str) -> str:
    """Replace the separators in a name with underscores, because CMake target names contain no slashes."""
    return re.sub(r"\W", "_", name)


def _pytest(plan: Plan, test: Test, results: Path) -> list[str]:
    if importlib.util.find_spec("pytest") is None:
        raise BuildError(str(plan.cmake_lists), test.line, f"tests need pytest: {install_command('pytest')}")
    path = plan.folder / test.path
    name = f"pytest-{path.stem}.xml"
    return [sys.executable, "-m", "pytest", "-q", str(path), f"--junitxml={results / name}"]


def _rostest(plan: Plan, test: Test, results: Path) -> list[str]:
    # Include the arguments in the name: the same file may be run with different arguments.
    stem = "__".join([os.path.splitext(test.path)[0], *test.arguments])
    name = re.sub(r"[^\w.-]", "_", stem)
    options = ["--package", plan.name, "--pkgdir", str(plan.folder), "--results-filename", f"{name}.xml"]
    file = str(plan.folder / test.path)
    program = [sys.executable, "-m", "minirospy.ros.rostest.commands.rostest"]
    return [*program, *options, "--results-base-dir", str(results.parent), file, *test.arguments]


def _launch_check(plan: Plan, test: Test, results: Path) -> list[str]:
    name = re.sub(r"[^\w.-]", "_", test.path)
    output = str(results / f"roslaunch-check_{name}.xml")
    program = [sys.executable, "-m", "minirospy.ros.roslaunch.commands.roslaunch_check", "-o", output]
    return [*program, *test.arguments, str(plan.folder / test.path)]


_COMMANDS = {"pytest": _pytest, "rostest": _rostest, "roslaunch-check": _launch_check}


def _environment(workspace: Workspace) -> dict[str, str]:
    """Return the environment with the workspace's folders prepended, as after sourcing its setup file."""

    def before(variable: str, path: Path) -> str:
        return os.pathsep.join(filter(None, [str(path), os.environ.get(variable, "")]))

    return {
        **os.environ,
        "PYTHONPATH": before("PYTHONPATH", workspace.devel / DIST_PACKAGES),
        "ROS_PACKAGE_PATH": before("ROS_PACKAGE_PATH", workspace.source),
        "CMAKE_PREFIX_PATH": before("CMAKE_PREFIX_PATH", workspace.devel),
        "ROS_TEST_RESULTS_DIR": str(workspace.build / "test_results"),
    }
