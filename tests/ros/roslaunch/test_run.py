"""roslaunch as a process: starting and stopping processes, and its output."""

from __future__ import annotations

import os
import signal
import socket
import stat
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import psutil
import pytest

from minirospy.base.environment import Environment
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.process import Guardian, Process, start_process
from minirospy.ros.roslaunch.launcher.runner import Launcher, RunOptions
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec, NodeSpec
from minirospy.ros.roslaunch.roslaunch.pmon import init_signal_handlers
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.workspace.packages import Packages
from tests.conftest import free_port, modules_loaded_by, write_files
from tests.ros.roslaunch.conftest import Start

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals between processes")

NODE = '<node pkg="pkg" type="wait.py" name='


def test_launcher_imports_little_before_it_starts_nodes() -> None:
    code = "import minirospy.ros.roslaunch.commands.roslaunch, minirospy.ros.roslaunch.launcher.runner"
    slow = {"asyncio", "concurrent.futures", "minirospy.workspace.plan", "yaml"}
    assert not slow & modules_loaded_by(code)


def test_nothing_outlives_a_roslaunch_that_is_killed(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{free_port()}")
    launch = start(f'{NODE}"a" output="screen"/>{NODE}"b" launch-prefix="env"/>', "--sigint-timeout=20")
    launch.read_until("waiting", "process[b-3]")
    children = launch.children()
    assert len(children) == 4
    launch.process.kill()
    _, left = psutil.wait_procs(children, timeout=30)
    assert not left
    # The pipe is closed at the end; the node received SIGINT.
    assert "ended by SIGINT" in launch.read_until("ended by")


def test_a_node_that_ignores_signals_is_killed(start: Start, master: str) -> None:
    ignoring = start(
        f'{NODE}"a" args="SIGINT SIGTERM" output="screen"/>', "--sigint-timeout=0.2", "--sigterm-timeout=0.2"
    )
    slow = start(f'{NODE}"b" args="SIGINT" output="screen"/>', "--sigint-timeout=0.2", "--sigterm-timeout=30")
    for launch in (ignoring, slow):
        launch.read_until("waiting SIGINT")
        launch.process.send_signal(signal.SIGINT)
    said, _ = ignoring.process.communicate(timeout=30)
    assert "[a-1] escalating to SIGTERM\n" in said
    assert "[a-1] escalating to SIGKILL\nShutdown errors:\n * process[a-1, pid " in said
    said, _ = slow.process.communicate(timeout=30)
    assert "[b-1] escalating to SIGTERM\n" in said
    assert "[b-1] escalating to SIGKILL\n" not in said


def test_run_id_that_leads_elsewhere_is_replaced(
    start: Start, master: str, package: Path, tmp_path: Path
) -> None:
    proxy = MasterProxy(master, "/t")
    proxy.set_param("/run_id", str(tmp_path / "elsewhere"))
    said, _ = start('<node pkg="pkg" type="stop.py" name="a" args="0"/>').process.communicate(timeout=30)
    assert "/run_id at the master cannot be the name of a folder" in said
    assert not (tmp_path / "elsewhere").exists()
    assert (Path(os.environ["ROS_HOME"]) / "log" / str(proxy.get_param("/run_id"))).is_dir()
    proxy.close()


def test_output_and_working_directory_of_a_node(start: Start, master: str, package: Path) -> None:
    home, run_id = Path(os.environ["ROS_HOME"]), MasterProxy(master, "/t")
    launch = start(
        '<env name="E" value="1 2"/><node pkg="pkg" type="stop.py" name="a" args="0" cwd="node"/>'
        '<node pkg="pkg" type="stop.py" name="b" args="0" output="screen"/>'
    )
    said, _ = launch.process.communicate(timeout=30)
    # Stderr is shown regardless of the value of `output`.
    assert said.count("err\n") == 2
    assert f"out {home} 1 2\n" in said
    folder = home / "log" / str(run_id.get_param("/run_id"))
    run_id.close()
    assert (folder / "a-1-stdout.log").read_text() == f"out {package} 1 2\n"
    log = next(folder.glob("roslaunch-*.log")).read_text()
    assert "process[a-1]: started with pid" in log
    assert f"... logging to {folder}/roslaunch-{socket.gethostname()}-{launch.process.pid}.log" in said


def test_a_program_that_is_missing_stops_no_other(start: Start, master: str) -> None:
    launch = start(
        '<node pkg="pkg" type="stop.p" name="a"/><node pkg="pkg" type="stop.py" name="b" args="0"/>'
    )
    said, _ = launch.process.communicate(timeout=30)
    assert "ERROR: cannot launch node of type [pkg/stop.p]: " in said
    assert "did you mean stop.py?" in said
    assert "[b-2] process has finished cleanly\nlog file: " in said
    assert launch.process.returncode == 0


def test_compiled_packages_are_named_and_the_rest_runs(start: Start, master: str) -> None:
    launch = start(
        '<node pkg="amcl" type="amcl" name="a"/><node pkg="pkg" type="stop.py" name="b" args="0"/>'
    )
    said, _ = launch.process.communicate(timeout=30)
    (line,) = (line for line in said.splitlines() if "amcl/amcl" in line and "ERROR" in line)
    assert line.startswith("ERROR: cannot launch node of type [amcl/amcl]: ")
    assert "which minirospy does not have: install it by RoboStack" in line
    assert "[b-2] process has finished cleanly" in said
    assert launch.process.returncode == 0


def test_installed_program_of_any_language_is_started(
    start: Start, master: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Debian and catkin install a C++ program as lib/PACKAGE/PROGRAM next to share/PACKAGE."""
    manifest = "<package><name>driver</name></package>"
    program = '#!/bin/sh\necho "started as $0 $1 $2"\n'
    write_files(
        tmp_path / "prefix",
        {"share/driver/package.xml": manifest, "lib/driver/driver_node": program},
        executable=["lib/driver/driver_node"],
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "prefix" / "share"))
    node = '<node pkg="driver" type="driver_node" name="a" args="port" output="screen"/>'
    said, _ = start(node).process.communicate(timeout=30)
    assert f"started as {tmp_path}/prefix/lib/driver/driver_node port __name:=a\n" in said
    assert "[a-1] process has finished cleanly" in said


def test_respawn_waits_for_its_delay(start: Start, master: str) -> None:
    launch = start(
        f'<node pkg="pkg" type="stop.py" name="a" args="0" respawn="true" respawn_delay="0.3"/>{NODE}"b"/>'
    )
    said = launch.read_until("restarting process", "process[a-1]: started with pid")
    assert said.index("[a-1] process has finished cleanly") < said.index("[a-1] restarting process")
    launch.process.send_signal(signal.SIGTERM)
    said, _ = launch.process.communicate(timeout=30)
    assert said.endswith("done\n")


def test_watch_starts_a_node_again_when_its_file_changes(start: Start, master: str, package: Path) -> None:
    launch = start(f'{NODE}"a" output="screen"/>', "--watch")
    launch.read_until("waiting")
    file = package / "wait.py"
    # Replace the file atomically, because roslaunch may read it at any moment.
    changed = package / "changed"
    changed.write_text(file.read_text().replace("waiting", "changed"))
    changed.replace(file)
    said = launch.read_until("changed __name:=a")
    assert f"[a-1] {file} has changed\nended by SIGINT\n[a-1] restarting process\n" in said


@pytest.mark.skipif(sys.platform == "win32", reason="a node reads exactly two bytes from a pipe")
@pytest.mark.parametrize("count", [1, 3])
def test_nodes_read_the_standard_input_of_roslaunch(
    count: int, start: Start, package: Path, master: str
) -> None:
    """A keyboard node in a launch file works as in ROS. Three similar nodes are forked from a preloaded process."""
    (package / "read.py").write_text(
        "import os, sys\nsys.stdout.write(f'read {os.read(0, 2).decode().strip()}\\n')\n"
    )
    nodes = [f'<node pkg="pkg" type="read.py" name="n{i}" output="screen"/>' for i in range(count)]
    said, _ = start("".join(nodes), stdin=subprocess.PIPE).process.communicate("a\nb\nc\n", timeout=60)
    assert sorted(line for line in said.splitlines() if line.startswith("read")) == [
        f"read {letter}" for letter in "abc"[:count]
    ]


def test_a_node_is_guarded_and_watched_before_it_is_announced(
    package: Path, master: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = NodeSpec("/a", "pkg", "wait.py")
    guarded: list[int] = []
    found: list[tuple[bool, Path | None]] = []
    monkeypatch.setattr(Guardian, "add", lambda _, process: guarded.append(process.pid))

    class Hearing(Output):
        def print(self, text: str = "", *, bold: bool = False) -> None:
            if text.startswith("process["):
                found.append((bool(guarded), launcher._files.changed(node)))

    def start_changed(*args: Any, **kwargs: Any) -> Process:
        process = start_process(*args, **kwargs)
        os.utime(package / "wait.py", ns=(1, 1))
        return process

    monkeypatch.setattr("minirospy.ros.roslaunch.launcher.node_start.start_process", start_changed)
    environment = Environment.read()
    launcher = Launcher(
        LaunchSpec(nodes=[node]), environment, Packages(environment), RunOptions(watch=True), Hearing()
    )
    launcher.start()
    launcher.close()
    assert found == [(True, package / "wait.py")]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGHUP")
@pytest.mark.parametrize(("before", "stops"), [(signal.SIG_IGN, False), (signal.SIG_DFL, True)])
def test_nohup_keeps_a_launch_running(before: signal.Handlers, stops: bool) -> None:
    """A shell whose terminal is closed sends SIGHUP to all its jobs. Nodes and roscore ignore it under nohup, too."""
    environment = Environment.read()
    launcher = Launcher(LaunchSpec(), environment, Packages(environment))
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    initial = {number: signal.getsignal(number) for number in numbers}
    try:
        signal.signal(signal.SIGHUP, before)
        with launcher.signals():
            assert (signal.getsignal(signal.SIGHUP) != before) is stops
        assert signal.getsignal(signal.SIGHUP) == before
        init_signal_handlers()
        assert (signal.getsignal(signal.SIGHUP) != before) is stops
    finally:
        for number, handler in initial.items():
            signal.signal(number, handler)


def test_rosparam_commands_come_before_the_parameters(start: Start, master: str, tmp_path: Path) -> None:
    proxy = MasterProxy(master, "/t")
    proxy.set_param("/old/a", 1)
    proxy.set_param("/kept", 2)
    proxy.set_param("/g/a", 3)
    launch = start(
        f'<rosparam command="dump" file="{tmp_path}/dump.yaml" param="old"/>'
        '<rosparam command="delete" param="old"/><rosparam command="delete" param="none"/>'
        '<group ns="g" clear_params="true"><param name="b" value="4"/></group>'
    )
    said, _ = launch.process.communicate(timeout=30)
    assert "CLEAR PARAMETERS\n * /g/\n\nPARAMETERS\n * /g/b: 4\n * /rosdistro: noetic\n" in said
    assert f"running rosparam dump {tmp_path}/dump.yaml /old\nrunning rosparam delete /old\n" in said
    assert "ERROR: parameter [/none] is not set\n" in said
    assert "No processes to monitor\nshutting down processing monitor...\n" in said
    assert (tmp_path / "dump.yaml").read_text() == "a: 1\n"
    assert (proxy.get_param("/g"), proxy.get_param("/kept")) == ({"b": 4}, 2)
    assert not proxy.has_param("/old")
    proxy.close()


@pytest.fixture
def ssh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a fake ssh that runs the remote command on this machine, and records its arguments."""
    folder = tmp_path / "bin"
    folder.mkdir()
    said = tmp_path / "ssh-said"
    program = folder / "ssh"
    program.write_text(f'#!/bin/sh\necho "$@" >> {said}\nfor last; do :; done\nexec sh -c "$last"\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    path = os.pathsep.join([str(folder), str(Path(sys.executable).parent), os.environ["PATH"]])
    monkeypatch.setenv("PATH", path)
    return said


MACHINE = '<machine name="m" address="127.0.0.1" user="somebody" env-loader="env" timeout="20"/>'


def test_a_node_on_another_machine(start: Start, master: str, ssh: Path) -> None:
    launch = start(
        f'{MACHINE}<node machine="m" pkg="pkg" type="wait.py" name="a" ns="deep" args="x"/>'
        '<node machine="m" pkg="pkg" type="stop.py" name="b" args="3"/><node pkg="pkg" type="no" name="c" machine="m"/>'
    )
    said = launch.read_until(
        "[127.0.0.1-0]: process[deep/a-1]: started with pid",
        "[127.0.0.1-0]: [b-2] process has died [pid ",
        "remote[127.0.0.1-0]: [c] cannot be launched",
    )
    assert "remote[127.0.0.1-0]: creating ssh connection to 127.0.0.1:22, user[somebody]\n" in said

    called = ssh.read_text()
    assert "-p 22 somebody@127.0.0.1 ROS_MASTER_URI=" in called
    assert " env roslaunch -c 127.0.0.1-0 -u http://localhost:" in called

    children = launch.children()
    launch.process.send_signal(signal.SIGINT)
    said, _ = launch.process.communicate(timeout=30)

    assert "[127.0.0.1-0] killing on exit\n" in said
    _, left = psutil.wait_procs(children, timeout=30)
    assert not left


def test_a_required_node_on_another_machine_ends_all(start: Start, master: str, ssh: Path) -> None:
    launch = start(
        f'{MACHINE}{NODE}"a"/><node machine="m" pkg="pkg" type="stop.py" name="b" args="3" required="true"/>'
    )
    said, _ = launch.process.communicate(timeout=30)
    assert "REQUIRED process [b-1] has died!\nInitiating shutdown!\n" in said
    assert launch.process.returncode == 1


def test_a_machine_that_cannot_be_reached(start: Start, master: str, ssh: Path) -> None:
    ssh.parent.joinpath("bin", "ssh").write_text("#!/bin/sh\necho no route >&2\nexit 255\n")
    launch = start(f'{MACHINE}<node machine="m" pkg="pkg" type="wait.py" name="a"/>')
    said, _ = launch.process.communicate(timeout=30)
    assert launch.process.returncode == 1
    assert "no route\n" in said
    text = "unable to start remote roslaunch child [127.0.0.1-0]: ssh ended with status 255\n"
    assert f"0.launch:1: {text}" in said


def test_local_leaves_other_machines_alone(start: Start, master: str) -> None:
    launch = start(
        f'{MACHINE}<node machine="m" pkg="pkg" type="wait.py" name="a"/>', "--local", "--no-summary"
    )
    said, _ = launch.process.communicate(timeout=30)
    assert "local only launch specified, will not launch remote nodes\n" in said
    assert "SUMMARY" not in said
    assert "No processes to monitor\n" in said


@pytest.mark.skipif(sys.platform == "win32", reason="permissions of POSIX systems")
def test_program_that_ros_refuses_is_named_and_runs(start: Start, master: str, package: Path) -> None:
    said, errors = start('<node pkg="pkg" type="stop.py" name="a" args="0"/>').process.communicate(timeout=30)
    path = package / "stop.py"
    assert f"WARNING: {path} is not executable, which ROS 1 refuses: chmod +x {path}" in said + (errors or "")
    assert "process has finished cleanly" in said


def test_ros_home_that_cannot_be_made_stops_no_node(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("below a file nothing can be made")
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "file" / "home"))
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{free_port()}")
    running = start('<node name="n" pkg="pkg" type="stop.py" args="0" output="screen" required="true"/>')
    said = running.read_until("out ")
    assert said.count("cannot be made") == 1
    assert f"nodes start in {tempfile.gettempdir()}; set ROS_HOME" in said
    assert f"out {os.path.realpath(tempfile.gettempdir())} " in said
