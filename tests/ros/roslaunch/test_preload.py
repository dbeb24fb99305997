"""Nodes that roslaunch forks from a preloaded process, compared with the same nodes that it starts."""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import psutil
import pytest

from minirospy.ros.roslaunch.launcher import preload
from minirospy.ros.roslaunch.launcher.preload import MIN_NODES, ForkedProcess, Preload, Start
from tests.conftest import free_port
from tests.ros.roslaunch.conftest import Running
from tests.ros.roslaunch.conftest import Start as RoslaunchStart

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks nodes")

PROBE = Path(__file__).with_name("probe.py")


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a preloaded process import its modules for longer than a machine may stall."""
    monkeypatch.setattr(preload, "REPLY_SECONDS", 100.0)


class Result(NamedTuple):
    """The outcome of a process."""

    status: int
    stdout: str
    stderr: str


class _Output:
    """A pipe, and a thread that reads it. ``first`` is set after the first line, or at the end."""

    def __init__(self) -> None:
        reader, self.writer = os.pipe()
        self.first = threading.Event()
        self._lines: list[bytes] = []
        self._thread = threading.Thread(target=self._read, args=(reader,))
        self._thread.start()

    def _read(self, reader: int) -> None:
        with open(reader, "rb") as file:
            for line in file:
                self._lines.append(line)
                self.first.set()
        self.first.set()

    def text(self) -> str:
        """Return everything that was written, once the pipe is closed."""
        self._thread.join()
        return b"".join(self._lines).decode()


class Runner:
    """Runs programs in both ways, in the folder ``folder``."""

    def __init__(self, folder: Path, **variables: str) -> None:
        self.folder = folder
        self.environ = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(("PYTHON", "COVERAGE_", "PYTEST_", "ROS_NAMESPACE"))
        } | variables
        self.preload = Preload()
        self.preload.prepare([self.start(PROBE)] * MIN_NODES)

    def start(self, program: Path, *arguments: str, **variables: str) -> Start:
        """Return how to run a program."""
        return Start((sys.executable, str(program), *arguments), {**self.environ, **variables}, self.folder)

    def write(self, text: str | bytes, name: str = "program.py", folder: Path | None = None) -> Path:
        """Write a program."""
        file = (folder or self.folder) / name
        file.write_bytes(text.encode() if isinstance(text, str) else text)
        return file

    def started(self, start: Start, act: Callable[[int], object] = lambda pid: None) -> Result:
        """Run a program as roslaunch starts it without a preloaded process."""
        out, error = _Output(), _Output()
        process = subprocess.Popen(
            start.command,
            env=dict(start.environ),
            cwd=start.folder,
            stdin=subprocess.DEVNULL,
            stdout=out.writer,
            stderr=error.writer,
            start_new_session=True,
        )
        return self._result(process, out, error, act)

    def forked(self, start: Start, act: Callable[[int], object] = lambda pid: None) -> Result:
        """Run a program in a fork of the preloaded process."""
        out, error = _Output(), _Output()
        process = self.fork(start, out.writer, error.writer)
        assert process
        return self._result(process, out, error, act)

    def _result(
        self,
        process: subprocess.Popen[bytes] | ForkedProcess,
        out: _Output,
        error: _Output,
        act: Callable[[int], object],
    ) -> Result:
        os.close(out.writer)
        os.close(error.writer)
        out.first.wait(60)
        act(process.pid)
        return Result(process.wait(60), out.text(), error.text())

    def fork(self, start: Start, stdout: int, stderr: int) -> ForkedProcess | None:
        """Fork a program with these standard streams."""
        with open(os.devnull, "rb") as stdin:
            return self.preload.fork(start, (stdin.fileno(), stdout, stderr))

    def both(self, start: Start, act: Callable[[int], object] = lambda pid: None) -> Result:
        """Run a program in both ways; require equal results and return them."""
        forked = self.forked(start, act)
        assert forked == self.started(start, act)
        return forked


@pytest.fixture
def runner(tmp_path: Path) -> Iterator[Runner]:
    """Yield a runner with a preloaded process."""
    made = Runner(tmp_path)
    yield made
    made.preload.close()
    assert not preloaded_processes(psutil.Process())


@pytest.mark.parametrize("namespace", [{}, {"ROS_NAMESPACE": "a/b"}], ids=["root", "namespace"])
@pytest.mark.parametrize(
    "variables",
    [
        {},
        {"PYTHONUNBUFFERED": "1"},
        {"PYTHONIOENCODING": "latin-1:replace"},
        {"LC_ALL": "C"},
        {"PYTHONUTF8": "1"},
    ],
    ids=["plain", "unbuffered", "encoding", "C", "UTF-8"],
)
def test_forked_node_has_the_state_of_a_started_one(
    tmp_path: Path, variables: dict[str, str], namespace: dict[str, str]
) -> None:
    runner = Runner(tmp_path, **variables)
    start = runner.start(PROBE, "an argument", "", "a:=b", "__name:=ä\udcff", **namespace)
    forked, started = runner.forked(start), runner.started(start)
    runner.preload.close()
    assert forked.status == started.status == 0, forked.stderr
    assert json.loads(forked.stdout) == json.loads(started.stdout)
    assert json.loads(forked.stdout)["parent"] == os.getpid()


PROGRAMS: dict[str, str | bytes] = {
    "end": "print('out'); import sys; print('err', file=sys.stderr)",
    "status": "import sys; sys.exit(3)",
    "text": "import sys; sys.exit('it failed')",
    "true": "import sys; sys.exit(True)",
    "os._exit": "import os; os._exit(4)",
    "abort": "import os; os.abort()",
    "traceback": "def f(x):\n    return 1 / x\n\nprint('out')\nf(0)\n",
    "cause": "try:\n    {}['a']\nexcept KeyError as e:\n    raise ValueError('ä') from e\n",
    "syntax": "print('out')\nif x\n",
    "encoding": b"# coding: latin-1\nprint(ascii('\xe4'))\n1/0 # \xe4\n",
    "not UTF-8": b"print('\xe4')\n",
    "nothing": "",
    "interrupt": "raise KeyboardInterrupt",
    "own interrupt": "class E(KeyboardInterrupt): pass\nraise E",
    "excepthook": "import sys\nsys.excepthook = lambda t, v, b: print(t, v, b.tb_lineno, b.tb_next)\n1/0",
    "atexit": "import atexit, threading, time\n"
    "atexit.register(lambda: print('atexit', '__file__' in globals()))\n"
    "has_printed = threading.Event()\n"
    "threading.Thread(target=lambda: (has_printed.wait(), time.sleep(0.1), print('thread'))).start()\n"
    "print('main')\nhas_printed.set()",
    "unflushed": "import sys; sys.stdout.write('no newline'); sys.stderr.write('x')",
    "names": "print(__name__, __file__, __package__, __spec__, __doc__, __builtins__.__name__)",
    "doc": "'''A docstring.'''\nx: int = 1\nprint(__doc__, sorted(globals()), __annotations__)",
    "future": "from __future__ import annotations\nx: y = 1\nprint(__annotations__)",
    "no future": "def f(x: int): pass\nprint(f.__annotations__)",
    "neighbour": "import neighbour; print(neighbour.__file__)",
    "spawn": "import multiprocessing\n\ndef f(x):\n    return x * x\n\nif __name__ == '__main__':\n"
    "    with multiprocessing.get_context('spawn').Pool(1) as pool:\n        print(pool.map(f, [3]))\n",
    "pickle": "import pickle\nclass A: pass\nprint(pickle.dumps(A), type(pickle.loads(pickle.dumps(A()))))",
    "child": "import os, subprocess\nprint(subprocess.run(['sh', '-c', 'echo $ROS_NAMESPACE'], "
    "capture_output=True, text=True).stdout, flush=True)\npid = os.fork()\nprint(pid and os.waitpid(pid, 0)[1])",
    "source": "import inspect, sys\nprint(inspect.getsource(sys.modules['__main__']))",
}


@pytest.mark.parametrize("unbuffered", ["", "1"], ids=["buffered", "unbuffered"])
def test_forked_program_ends_like_a_started_one(tmp_path: Path, unbuffered: str) -> None:
    variables = {"PYTHONUNBUFFERED": unbuffered} if unbuffered else {}
    made = Runner(tmp_path, **variables)
    made.write("", "neighbour.py")
    try:
        for name, text in PROGRAMS.items():
            start = made.start(made.write(text, f"my_{name}.py".replace(" ", "_")), ROS_NAMESPACE="ns")
            assert made.forked(start) == made.started(start), name
    finally:
        made.preload.close()


CONFIGURE = {
    "dictConfig": """logging.config.dictConfig({"version": 1, "handlers": {"h": {"class": "logging.StreamHandler"}},
    "root": {"handlers": ["h"], "level": "INFO"}})""",
    "fileConfig": """logging.config.fileConfig(io.StringIO('''[loggers]
keys=root
[handlers]
keys=h
[formatters]
keys=
[logger_root]
level=INFO
handlers=h
[handler_h]
class=StreamHandler
args=()
'''))""",
}


@pytest.mark.parametrize("configure", CONFIGURE.values(), ids=list(CONFIGURE))
@pytest.mark.parametrize(
    "imports", ["import rospy", "from rospy.core import logwarn", "import tf2_ros", "import rospy.names"]
)
def test_program_can_configure_logging_before_it_imports_rospy(
    runner: Runner, configure: str, imports: str
) -> None:
    report = """
import rospy
rospy.logwarn("battery low")
logging.getLogger("minirospy.runtime.node.subscription").warning("topics")
print(sorted(name for name in sys.modules if name.startswith("rospy")))
print(rospy.__spec__.origin, rospy.__loader__ is rospy.__spec__.loader, rospy.core is sys.modules["rospy.core"])
"""
    text = f"import io, logging.config, sys\n{configure}\n{imports}\n{report}"
    result = runner.both(runner.start(runner.write(text)))
    assert "battery low" in result.stderr
    assert "topics" in result.stderr


def test_configuring_logging_after_the_import_of_rospy_disables_its_loggers(runner: Runner) -> None:
    text = "import io, logging.config, rospy\n" + CONFIGURE["dictConfig"] + "\nrospy.logwarn('battery low')"
    assert runner.both(runner.start(runner.write(text))) == Result(0, "", "")


def test_program_sees_whether_it_has_imported_rospy(runner: Runner) -> None:
    text = """import importlib.util, sys
print([name for name in sys.modules if name.startswith("rospy")])
print(importlib.util.find_spec("rospy").origin, "rospy" in sys.modules)
print(importlib.util.find_spec("rospy.core").origin, "rospy" in sys.modules)
import rospy
print(importlib.util.find_spec("rospy") is rospy.__spec__, importlib.reload(rospy) is rospy)
"""
    assert runner.both(runner.start(runner.write(text))).status == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL, signal.SIGHUP])
def test_signal_ends_a_forked_program_like_a_started_one(runner: Runner, number: signal.Signals) -> None:
    start = runner.start(runner.write("import os, time\nos.write(1, b'ready\\n') and time.sleep(60)\n"))

    def interrupt(pid: int) -> None:
        # The traceback marks the call that the signal interrupts.
        while psutil.Process(pid).status() != psutil.STATUS_SLEEPING:
            os.sched_yield()
        os.killpg(pid, number)

    result = runner.both(start, interrupt)
    assert result.status == -number


def test_programs_are_found_by_name_like_started_ones(runner: Runner) -> None:
    start = runner.start(
        runner.write("print('ready', flush=True)\nwhile True: pass\n", "named.py"), "__name:=x"
    )

    def look(pid: int) -> None:
        process = psutil.Process(pid)
        assert process.cmdline() == list(start.command)
        assert process.environ() == start.environ
        assert process.name() == Path(start.command[0]).name
        process.kill()

    runner.both(start, look)


def test_forked_programs_draw_different_random_numbers(runner: Runner) -> None:
    text = "import random, uuid, tempfile, secrets\n"
    text += "print(random.random(), uuid.uuid4(), uuid.uuid1(), tempfile.mktemp(), secrets.token_hex())"
    start = runner.start(runner.write(text))
    first, second = (runner.forked(start).stdout.split() for _ in range(2))
    assert not set(first) & set(second)


@pytest.mark.parametrize("name", ["logging.py", "rospy/__init__.py", "std_msgs/__init__.py", "queue.py"])
def test_program_beside_a_module_that_hides_a_loaded_one_is_not_forked(runner: Runner, name: str) -> None:
    folder = runner.folder / "nodes"
    file = folder / name
    file.parent.mkdir(parents=True)
    program = runner.write("", folder=folder)
    assert runner.forked(runner.start(program)).status == 0
    file.write_text("")
    assert runner.fork(runner.start(program), 1, 2) is None
    file.unlink()
    assert runner.forked(runner.start(program)).status == 0


@pytest.mark.parametrize(
    "variables",
    [
        {"PYTHONHASHSEED": "1"},
        {"PYTHONOPTIMIZE": "1"},
        {"PYTHONPATH": "/x"},
        {"TZ": "UTC"},
        {"COVERAGE_RUN": "1"},
    ],
)
def test_program_with_another_environment_is_not_forked(runner: Runner, variables: dict[str, str]) -> None:
    assert runner.fork(runner.start(PROBE, **variables), 1, 2) is None


@pytest.mark.parametrize(
    "variable", ["PYTHONHASHSEED", "PYTHONOPTIMIZE", "PYTHONSTARTUP", "COVERAGE_PROCESS_START"]
)
def test_python_with_special_settings_is_not_forked(tmp_path: Path, variable: str) -> None:
    made = Runner(tmp_path, **{variable: "1"})
    assert made.fork(made.start(PROBE), 1, 2) is None
    made.preload.close()


def test_other_commands_are_not_forked(runner: Runner) -> None:
    for command in (
        ("/bin/true",),
        (sys.executable,),
        (sys.executable, "-m", "this"),
        ("gdb", sys.executable, str(PROBE)),
        (sys.executable, str(runner.folder / "missing.py")),
    ):
        assert runner.fork(Start(command, runner.environ, runner.folder), 1, 2) is None
    elsewhere = Start((sys.executable, str(PROBE)), runner.environ, Path("/"))
    assert runner.fork(elsewhere, 1, 2) is None


def test_few_programs_are_not_forked(runner: Runner, monkeypatch: pytest.MonkeyPatch) -> None:
    start = runner.start(runner.write(""))
    few = Preload()
    few.prepare([start] * (MIN_NODES - 1))
    assert few.fork(start, (0, 1, 2)) is None
    monkeypatch.setenv("MINIROSPY_PRELOAD", "0")
    few.prepare([start] * MIN_NODES)
    assert few.fork(start, (0, 1, 2)) is None


def test_program_is_started_if_the_preloaded_process_was_killed(runner: Runner) -> None:
    start = runner.start(runner.write("print(1)"))
    assert runner.forked(start).stdout == "1\n"
    for process in preloaded_processes(psutil.Process()):
        process.kill()
    assert runner.fork(start, 1, 2) is None
    assert runner.fork(start, 1, 2) is None


def test_forked_process_is_waited_for_like_a_started_one(runner: Runner) -> None:
    process = runner.fork(runner.start(runner.write("import time; time.sleep(60)")), 1, 2)
    assert process
    assert process.poll() is None
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.01)
    process.terminate()
    assert process.wait() == process.poll() == process.returncode == -signal.SIGTERM
    process.kill()


@pytest.mark.parametrize("_", range(5))
def test_nodes_of_launches_in_two_threads_are_children(tmp_path: Path, _: int) -> None:
    runners = [Runner(tmp_path, LAUNCH=str(number)) for number in range(2)]
    program = runners[0].write("import time; time.sleep(60)")
    barrier = threading.Barrier(len(runners))
    nodes: list[ForkedProcess] = []

    def launch(made: Runner) -> None:
        barrier.wait()
        for _ in range(6):
            process = made.fork(made.start(program), 1, 2)
            assert process
            nodes.append(process)

    threads = [threading.Thread(target=launch, args=(made,)) for made in runners]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for made in runners:
        made.preload.close()
    parents = [psutil.Process(each.pid).ppid() for each in nodes]
    for each in nodes:
        os.kill(each.pid, signal.SIGKILL)
    assert parents == [os.getpid()] * 12
    assert [each.wait(60) for each in nodes] == [-signal.SIGKILL] * 12


def test_running_process_of_another_parent_has_no_exit_status() -> None:
    # The shell exits first, so that the process is an orphan.
    shell = ["sh", "-c", "sleep 60 >/dev/null & echo $!"]
    pid = int(subprocess.run(shell, stdout=subprocess.PIPE, check=True).stdout)
    process = ForkedProcess(("sleep", "60"), pid)
    assert process.poll() is None
    process.terminate()
    assert process.wait(60) == 0


def test_process_without_a_status_has_status_0(runner: Runner) -> None:
    process = runner.fork(runner.start(runner.write("raise SystemExit(3)")), 1, 2)
    assert process
    os.waitpid(process.pid, 0)
    assert process.poll() == process.wait(60) == 0


@pytest.mark.parametrize("is_on", [0, 1])
def test_fork_keeps_the_subreaper_setting_of_the_program(runner: Runner, is_on: int) -> None:
    library = ctypes.CDLL(None)
    value = ctypes.c_int()
    library.prctl(36, is_on, 0, 0, 0)  # PR_SET_CHILD_SUBREAPER
    try:
        assert runner.forked(runner.start(runner.write(""))).status == 0
        library.prctl(37, ctypes.byref(value), 0, 0, 0)  # PR_GET_CHILD_SUBREAPER
    finally:
        library.prctl(36, 0, 0, 0, 0)
    assert value.value == is_on


NODES = """<env name="E" value="1"/>
<node pkg="pkg" type="wait.py" name="a" output="screen" args="'an argument'"/>
<node pkg="pkg" type="wait.py" name="b" output="screen" ns="deep"/>
<node pkg="pkg" type="wait.py" name="c" output="screen" launch-prefix="env"/>
<node pkg="pkg" type="wait.py" name="d" cwd="node"/>
<node pkg="pkg" type="wait.py" name="e" output="screen"/>
<node pkg="pkg" type="stop.py" name="f" args="2" respawn="true" respawn_delay="1000"/>
"""


def preloaded_processes(process: psutil.Process) -> list[psutil.Process]:
    """Return the preloaded processes among the descendants."""
    found = []
    for each in process.children(recursive=True):
        # A process of another test may exit in the meantime.
        with contextlib.suppress(psutil.NoSuchProcess):
            if "preloaded.py" in " ".join(each.cmdline()):
                found.append(each)
    return found


def seen(launch: Running) -> list[list[object]]:
    """Return what a user sees of the nodes: command lines, parents, sessions, environment and folders."""
    said = ""
    while said.count("waiting") < 4 or "[f-6] process has " not in said:
        said += launch.read_until("\n")
    found: list[list[object]] = []
    for each in launch.children():
        arguments = [re.sub(r"/log/[^/]+/", "/log/RUN/", word) for word in each.cmdline()]
        if not any("wait.py" in word for word in arguments):
            continue
        assert os.getpgid(each.pid) == os.getsid(each.pid) == each.pid
        variables = {name: value for name, value in each.environ().items() if name != "MINIROSPY_PRELOAD"}
        found.append([arguments, each.ppid() == launch.process.pid, each.name(), each.cwd(), variables])
    return sorted(found, key=str)


def test_roslaunch_forks_nodes_that_look_and_end_like_started_ones(
    start: RoslaunchStart, master: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = []
    for value in ("1", "0"):
        monkeypatch.setenv("MINIROSPY_PRELOAD", value)
        launch = start(NODES)
        nodes = seen(launch)
        assert len(nodes) == 5
        launch.process.send_signal(signal.SIGINT)
        said, _ = launch.process.communicate(timeout=60)
        assert said.count("ended by SIGINT") == 4
        assert launch.process.returncode == 0
        results.append(nodes)
    assert results[0] == results[1]


def test_killed_roslaunch_leaves_no_forked_node(start: RoslaunchStart, master: str) -> None:
    launch = start(NODES)
    seen(launch)
    children = launch.children()
    launch.process.kill()
    _, left = psutil.wait_procs(children, timeout=60)
    assert not left


def test_preloaded_process_ends_when_roslaunch_is_killed_first(
    start: RoslaunchStart, monkeypatch: pytest.MonkeyPatch
) -> None:
    # No master answers here, so roslaunch waits before it starts a node.
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{free_port()}")
    launch = start(NODES, "--wait")
    launch.read_until("will wait for it to start")
    process = psutil.Process(launch.process.pid)
    children = process.children(recursive=True)
    launch.process.kill()
    _, left = psutil.wait_procs(children, timeout=60)
    assert not left


def test_preloaded_process_ends_after_the_start(start: RoslaunchStart, master: str) -> None:
    launch = start(NODES)
    seen(launch)
    assert not preloaded_processes(psutil.Process(launch.process.pid))


def test_forked_node_loads_no_module_and_compiles_no_pattern_of_xmlrpc(tmp_path: Path, master: str) -> None:
    made = Runner(tmp_path, ROS_MASTER_URI=master)
    text = """import re, sys
import rospy
from std_msgs.msg import String
loaded = set(sys.modules)
patterns = []
def record(pattern, flags=0, compile=re.compile):
    patterns.append(pattern)
    return compile(pattern, flags)
re.compile = record
rospy.init_node("node")
rospy.Publisher("a", String, queue_size=1)
rospy.Subscriber("a", String, print)
print([name for name in sorted(set(sys.modules) - loaded) if name.startswith(("minirospy", "asyncio"))])
print(patterns)
rospy.signal_shutdown("")
"""
    result = made.forked(made.start(made.write(text)))
    made.preload.close()
    assert result == Result(0, "[]\n[]\n", "")
