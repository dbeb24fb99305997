"""Runs the ``<test>`` tags of a launch file, each with the file's nodes and a new master.

Source: http://wiki.ros.org/rostest, http://wiki.ros.org/roslaunch/XML/test.
"""

from __future__ import annotations

import contextlib
import io
import os
import shlex
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from minirospy.base.environment import Environment
from minirospy.base.errors import LaunchError, MasterUnreachableError, MinirospyError, NotFoundError
from minirospy.ros.roslaunch.launcher.runner import Launcher, RunOptions
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec, TestSpec
from minirospy.ros.rosunit.runner.junit import Result, TestCaseResult, TestError, TestFailure, read
from minirospy.ros.rosunit.runner.unit import XML_OUTPUT_FLAG, xml_results_file
from minirospy.runtime.master.master import Master
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.transport.access import Access
from minirospy.runtime.transport.loop import LoopThread
from minirospy.workspace.packages import NotExecutableError, Packages

__all__ = ["RosTest", "master_of_tests"]

_SHOWN_LINES = 20
_CLASS = "rostest.runner.RosTest"


@dataclass
class RosTest:
    """Runs a launch file's tests. ``own`` records whether each test could run; ``results`` holds the cases that the tests report.

    ``text``: print everything and write no XML files. ``reuse_master``: use the running master instead of starting one;
    ``clear`` deletes all of its parameters. ``results_dir``: folder for the XML files.
    """

    package: str
    spec: LaunchSpec
    environment: Environment
    packages: Packages
    results_dir: Path
    text: bool = False
    reuse_master: bool = False
    clear: bool = False
    own: Result = field(default_factory=lambda: Result("unittest.suite.TestSuite"))
    results: Result = field(default_factory=lambda: Result("ROSTEST"))
    is_interrupted: bool = False

    def run(self) -> None:
        """Run all tests in sequence, sorted by name. Stop on a signal."""
        nodes = {node.name for node in self.spec.nodes}
        by_name: dict[str, list[TestSpec]] = {}
        for test in self.spec.tests:
            by_name.setdefault(test.test_name, []).append(test)
            if test.node.name in nodes:
                print(
                    f"WARNING: {test.node.file}:{test.node.line}: test [{test.test_name}] is called as the node "
                    f"[{test.node.name}], whose place it takes where it is a node itself: give the <test> a name",
                    file=sys.stderr,
                )

        for name, tests in sorted(by_name.items()):
            case = TestCaseResult(f"test{name}")
            case.classname = _CLASS
            started = time.perf_counter()
            if len(tests) > 1:
                case.add_failure(_failure(f"Duplicate tests named [{name}] in rostest suite"))
            else:
                self._run(tests[0], case)
            case.time = time.perf_counter() - started
            self._finish(case)
            if self.is_interrupted:
                return

    def _run(self, test: TestSpec, case: TestCaseResult) -> None:
        why = self._why_not(test)
        if why:
            case.add_failure(_failure(why))
            return
        test = replace(test, node=test.node.named())
        for tries_left in range(max(test.retry, 0), -1, -1):
            case.errors.clear()
            case.failures.clear()
            self._try(test, case)
            file = self._results_file(test)
            results = read(file, f"{self.package}/{test.test_name}") if file.is_file() else Result("")
            is_good = case.passed and not results.num_errors and not results.num_failures
            if is_good or not tries_left or self.is_interrupted:
                self.results.accumulate(results)
                return

    def _why_not(self, test: TestSpec) -> str:
        """Return why a test cannot run, or an empty string if it can."""
        node = f"{test.node.package}/{test.node.type}"
        try:
            self.packages.find_executable(test.node.package, test.node.type)
        except NotExecutableError:
            return f"Test node [{node}] does not exist or is not executable"
        except NotFoundError as error:
            near = f" (did you mean {' or '.join(error.nearest)}?)" if error.nearest else ""
            if error.kind == "package":
                return f"Package [{test.node.package}] for test node [{node}] does not exist{near}"
            return f"Test node [{node}] does not exist or is not executable{near}"
        return ""

    def _try(self, test: TestSpec, case: TestCaseResult) -> None:
        """Run a test once; record in ``case`` the errors that the test's own results do not contain."""
        file = self._results_file(test)
        file.unlink(missing_ok=True)
        said = io.StringIO()

        with contextlib.ExitStack() as stack:
            if not self.text:
                stack.enter_context(contextlib.redirect_stdout(said))
                stack.enter_context(contextlib.redirect_stderr(said))
            try:
                environment = stack.enter_context(
                    master_of_tests(self.environment, self.run_id, reuse=self.reuse_master, clear=self.clear)
                )
                print(f"[ROSTEST]Running test [{test.test_name}]", flush=True)
                status = self._launch(test, environment, case)
            except LaunchError as error:
                case.add_failure(_failure(f"Test Fixture Nodes failed to launch: {error}"))
            except MasterUnreachableError as error:
                case.add_error(TestError("Exception", f"Could not connect to existing ROS master. {error}"))
            except MinirospyError as error:
                case.add_error(TestError(type(error).__name__, str(error)))
            else:
                if case.passed and not self.is_interrupted:
                    self._judge(test, case, file, status)
        self.own.system_out += said.getvalue()

    def _judge(self, test: TestSpec, case: TestCaseResult, file: Path, status: int) -> None:
        if self.text:
            if status:
                case.add_failure(_failure(f"test [{test.test_name}] ended with a status other than 0"))
        elif file.is_file():
            print(f"[ROSTEST]test [{test.test_name}] results are in [{file}]")
        else:
            text = f"test [{test.test_name}] did not generate test results"
            case.add_failure(_failure(text + self._last_lines(test)))

    def _launch(self, test: TestSpec, environment: Environment, case: TestCaseResult) -> int:
        """Run the nodes and the test until the test exits or exceeds its time limit."""
        words = [test.node.args, shlex.quote(f"{XML_OUTPUT_FLAG}{self._results_file(test)}")]
        if self.text:
            words.append("--text")
        node = replace(
            test.node,
            args=" ".join(filter(None, words)),
            # stop the whole launch when the test exits
            required=True,
            output="screen" if self.text else "log",
        )
        spec = replace(self.spec, nodes=[*self.spec.nodes, node], tests=[])

        launcher = Launcher(spec, environment, self.packages, RunOptions(strict=True, log_errors=True))
        timer = threading.Timer(test.time_limit, launcher.stop, ("time-limit",))
        timer.start()
        try:
            status = launcher.run()
        finally:
            timer.cancel()
        if launcher.stopped_by == "time-limit":
            what = f"test [{test.test_name}] of type [{test.node.package}/{test.node.type}]"
            text = f"max time [{test.time_limit}s] allotted for {what}"
            case.add_error(TestError("RLTestTimeoutException", text + self._last_lines(test)))
        elif launcher.stopped_by:
            self.is_interrupted = True
            case.add_error(TestError("KeyboardInterrupt", f"interrupted by {launcher.stopped_by}"))
        return status

    @property
    def run_id(self) -> str:
        """Return the run id, which names the folder for the nodes' log files."""
        return f"rostest-{os.getpid()}"

    def _results_file(self, test: TestSpec) -> Path:
        place = {"ROS_TEST_RESULTS_DIR": str(self.results_dir)}
        return Path(xml_results_file(self.package, test.test_name, False, place))

    def _last_lines(self, test: TestSpec) -> str:
        """Return the last lines of a test's output."""
        stem = test.node.name.lstrip("/").replace("/", "-")
        folder = self.environment.log_dir / self.run_id
        files = sorted(folder.glob(f"{stem}-*-stdout.log"), key=os.path.getmtime)
        if not files:
            return ""
        lines = files[-1].read_text(encoding="utf-8", errors="replace").splitlines()[-_SHOWN_LINES:]
        return "\n".join(["", f"the end of {files[-1]}:", *(f"  {line}" for line in lines)]) if lines else ""

    def _finish(self, case: TestCaseResult) -> None:
        self.own.add_case(case)
        if not self.text or not case.passed:
            print(case.line, flush=True)


@contextlib.contextmanager
def master_of_tests(
    environment: Environment, run_id: str, *, reuse: bool = False, clear: bool = False
) -> Iterator[Environment]:
    """Start a master with this run_id on a free port and yield its environment; stop the master after the block.

    ``reuse``: use the master that the environment specifies; ``clear`` deletes its parameters first.
    Raise MasterUnreachableError if that master does not respond.
    """
    if reuse:
        with contextlib.closing(MasterProxy(environment.master_uri, "/rostest")) as master:
            for name in master.get_param_names() if clear else ():
                master.delete_param(name)
            master.get_pid()
        yield environment
        return
    loop = LoopThread("rostest-master")

    async def start() -> Master:
        host, bind_host = environment.uri_host, environment.bind_host
        serving = Master(host=host, bind_host=bind_host, access=Access.parse(environment.allow))
        await serving.start()
        return serving

    serving = loop.run(start())
    try:
        serving.set_param("/roslaunch", "/run_id", run_id)
        yield environment._replace(master_uri=serving.uri)
    finally:
        loop.run(serving.close(), 5.0)
        loop.close()


def _failure(text: str) -> TestFailure:
    return TestFailure("AssertionError", text)
