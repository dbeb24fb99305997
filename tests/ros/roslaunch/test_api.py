"""A user's program that launches nodes with every class in roslaunch's API, and the documented forms of `import roslaunch`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import psutil
import pytest
import roslaunch
import roslaunch.roslaunch_logs

from minirospy.ros.roslaunch.launcher.spec import ParameterCommand
from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.conftest import free_port
from tests.waiting import wait_until

SAID = """\
the master's run id True given
before start RLException
launched deep/one-1 True None x a:=b __name:=one True
stopped False True
no such program: RLException
ended True 3
after stop False
parent __name:=b ['b-4'] b
spins True True False
killed True True b-4
a text __name:=t
no file RLException
no launch file RLException
['robot', 'a.launch', 'x:=1'] ['robot/a.launch']
['robot/a.launch'] ['robot/a.launch']
['robot/a.launch', 'robot/a.launch'] ['robot/a.launch', 'robot/a.launch']
['robot', 'nope.launch'] RLException
['/no/such'] RLException
Node('', 't') raises ValueError | package must be non-empty
Node('p', '') raises ValueError | type must be non-empty
Node('p', 't', 'a/b') raises ValueError | node name cannot contain a namespace
output raises ValueError | output must be one of 'log', 'screen'
cwd raises ValueError | cwd must be one of 'ROS_HOME', 'node'
p t n /a/b/  False [] [] None
k True
[('n', (None, 'a'))]
['/a']
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals between processes")
def test_a_program_launches_nodes(master: str) -> None:
    proxy = MasterProxy(master, "/t")
    proxy.set_param("/run_id", "run")
    proxy.close()
    program = Path(__file__).parent / "api_program.py"
    done = subprocess.run(
        [sys.executable, str(program)], capture_output=True, text=True, timeout=200, check=False
    )
    assert done.stdout == SAID, done.stderr


LAUNCH = """
import os, roslaunch, signal, sys, time
launch = roslaunch.scriptapi.ROSLaunch()
launch.start()
process = launch.launch(roslaunch.core.Node('pkg', 'wait.py', 'a'))
print('pid', process.pid, flush=True)
"""


@pytest.mark.parametrize(
    "end",
    [
        "os.kill(os.getpid(), 9)",
        "os._exit(3)",
        "raise SystemExit(2)",
        "launch.parent.pm.shutdown()",
        "signal.raise_signal(15); launch.spin()",
        "signal.raise_signal(2)",
        "os.kill(launch.parent.runner._launcher._guardian._popen.pid, 9)",
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="signals between processes")
def test_no_node_outlives_its_program(master: str, package: Path, end: str) -> None:
    program = subprocess.Popen(
        [sys.executable, "-c", LAUNCH + end], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert program.stdout
    line = next(line for line in program.stdout if line.startswith("pid "))

    try:
        left = [psutil.Process(int(line.split()[1]))]
    except psutil.NoSuchProcess:
        left = []

    program.communicate(timeout=100)
    _, left = psutil.wait_procs(left, timeout=30)
    assert not left


def test_a_process_that_was_stopped_is_not_respawned(master: str, package: Path) -> None:
    """The process had exited by itself before, and was pending a respawn."""
    launch = roslaunch.scriptapi.ROSLaunch()
    launch.start()
    try:
        node = roslaunch.core.Node("pkg", "stop.py", "a", args="3", respawn=True, respawn_delay=1000.0)
        process = launch.launch(node)
        process.popen.wait(30)
        process.stop()
        monitor = launch.parent.pm
        wait_until(lambda: not monitor.get_active_names())
        assert (process.spawn_count, process.exit_code) == (1, 3)
        assert [each.name for each in monitor.dead_list] == [process.name]
    finally:
        launch.stop()


def test_the_run_id_is_the_programs(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The run id also applies to a master started by the launch."""
    uri = f"http://localhost:{free_port()}"
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    run_id = roslaunch.rlutil.get_or_generate_uuid(None, False)
    launch = roslaunch.parent.ROSLaunchParent(run_id, [])
    launch.start(auto_terminate=False)
    try:
        proxy = MasterProxy(uri, "/t")
        assert proxy.get_param("/run_id") == run_id
        proxy.close()
    finally:
        launch.shutdown()
    assert roslaunch.roslaunch_logs.get_run_id() is None


def test_a_listener_may_fail_and_may_stop_the_launch(
    master: str, package: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    died: list[str] = []

    class Listener(roslaunch.pmon.ProcessListener):  # type: ignore[misc,unused-ignore]
        def process_died(self, name: str, code: int) -> None:
            died.append(name.rpartition("-")[0])
            if len(died) == 1:
                raise RuntimeError("the first")
            launch.shutdown()

    text = '<launch><node name="a" pkg="pkg" type="wait.py"/><node name="b" pkg="pkg" type="stop.py" args="1"/></launch>'
    launch = roslaunch.parent.ROSLaunchParent(
        "run", [], roslaunch_strs=[text], process_listeners=[Listener()]
    )
    run_id = roslaunch.rlutil.get_or_generate_uuid(None, False)
    launch.run_id = run_id
    launch.start()
    monitor = launch.pm
    try:
        wait_until(lambda: died == ["b"])
        assert not monitor.done
        launch.runner.launch_node(roslaunch.core.Node("pkg", "stop.py", "c", args="0"))
        wait_until(lambda: monitor.done)
        assert (died[1], monitor.get_active_names()) == ("c", [])
        assert "a process listener failed\nTraceback" in capfd.readouterr().err
    finally:
        launch.shutdown()


def test_a_start_that_failed_may_be_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://no-such-host.invalid:11399")
    launch = roslaunch.parent.ROSLaunchParent("run", [])
    for _ in range(2):
        with pytest.raises(roslaunch.RLException, match="no ROS master answers at"):
            launch.start()
    launch.shutdown()


def test_a_monitor_of_ones_own(master: str, package: Path) -> None:
    monitor = roslaunch.pmon.start_process_monitor()
    died = roslaunch.pmon.ProcessListener()
    codes: list[int] = []
    died.process_died = lambda name, code: codes.append(code)
    monitor.add_process_listener(died)
    node = roslaunch.core.Node("pkg", "stop.py", "a", args="4")
    process = roslaunch.nodeprocess.create_node_process("run", node, master)
    monitor.register(process)
    assert process.start()
    wait_until(lambda: codes == [4])
    assert not monitor.done
    monitor.registrations_complete()
    monitor.join(30)
    assert monitor.done
    assert roslaunch.pmon.shutdown_process_monitor(monitor)


def test_nothing_is_left_of_a_program_that_forgets_its_launch(master: str, package: Path) -> None:
    """The nodes are stopped although the program does not call shutdown()."""
    code = (
        "import roslaunch, sys\n"
        "launch = roslaunch.scriptapi.ROSLaunch()\nlaunch.start()\n"
        "process = launch.launch(roslaunch.core.Node('pkg', 'wait.py', 'a', output='screen'))\n"
        "print('pid', process.pid, flush=True)\n"
    )
    # The output reaches end of file only when the node, which also has the pipe open, has exited.
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=100, check=False
    )
    assert "pid " in done.stdout
    assert done.returncode == 0


def test_a_configuration_runs_the_commands_that_it_was_given() -> None:
    config = roslaunch.ROSLaunchConfig()
    text = '<launch><rosparam command="delete" param="a"/><rosparam command="dump" file="f" ns="b"/><bogus/></launch>'
    roslaunch.XmlLoader().load_string(text, config, verbose=False)
    config.add_executable(roslaunch.core.Executable("echo", ["hi"], roslaunch.core.PHASE_SETUP))
    assert config.spec.commands == [ParameterCommand("/a"), ParameterCommand("/b", "f")]
    assert config.config_errors == ["unrecognized tag bogus"]
    assert [str(warning) for warning in config.spec.warnings] == ["<stdin>:1: unrecognized tag <bogus>"]
