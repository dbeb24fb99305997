"""roscore, rosrun, roslaunch and the demo as real processes: their output, child processes, and leftovers."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from minirospy.base.errors import MasterUnreachableError
from minirospy.cli import main as umbrella
from minirospy.ros.rosbash.commands import rosrun
from minirospy.ros.roslaunch.commands import roslaunch
from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.conftest import free_port

from .conftest import own_lines

BIN = Path(sys.executable).parent
posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals between processes")


def launched(file: Path) -> subprocess.CompletedProcess[str]:
    """Run roslaunch on a file whose nodes exit without being stopped."""
    return subprocess.run(
        [str(BIN / "roslaunch"), str(file)], capture_output=True, text=True, timeout=100, check=False
    )


@pytest.fixture
def port(monkeypatch: pytest.MonkeyPatch) -> int:
    """Return a free port, and set ROS_MASTER_URI to it."""
    number = free_port()
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{number}")
    return number


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a package that contains only scripts."""
    folder = tmp_path / "pkg"
    folder.mkdir()
    (folder / "package.xml").write_text("<package><name>pkg</name></package>")
    (folder / "wait.py").write_text(
        # Use a single write per line, because roslaunch writes to the same pipe at the same time.
        "#!/usr/bin/env python3\n"
        "import sys, time\nsys.stdout.write(' '.join(['waiting', *sys.argv[1:]]) + '\\n')\nsys.stdout.flush()\n"
        "try:\n    time.sleep(60)\nexcept KeyboardInterrupt:\n    print('interrupted', flush=True)\n"
    )
    (folder / "stop.py").write_text(
        "#!/usr/bin/env python3\nimport sys\nprint('stopping')\nsys.exit(int(sys.argv[1]))\n"
    )
    for program in folder.glob("*.py"):
        program.chmod(0o755)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    return folder


@pytest.fixture
def started() -> Iterator[list[subprocess.Popen[str]]]:
    running: list[subprocess.Popen[str]] = []
    yield running
    for process in running:
        # Also stop the child processes: an orphan would keep the pipe open.
        with contextlib.suppress(psutil.Error):
            for child in psutil.Process(process.pid).children(recursive=True):
                child.kill()
        process.kill()
        process.communicate()


def start(running: list[subprocess.Popen[str]], *command: str) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [str(BIN / command[0]), *command[1:]], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    running.append(process)
    return process


def read_until(process: subprocess.Popen[str], word: str) -> str:
    """Return the output up to the line that contains ``word``."""
    assert process.stdout
    said = ""
    for line in process.stdout:
        said += line
        if word in line:
            return said
    raise AssertionError(f"no {word!r} in:\n{said}")


# --- roscore


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_roscore_prints_its_address_and_exits(
    port: int, started: list[subprocess.Popen[str]], number: int
) -> None:
    core = start(started, "roscore", "-p", str(port))
    said = read_until(core, "Ctrl-C")
    assert f"ROS_MASTER_URI=http://localhost:{port}/\n" in said
    assert f"pid {core.pid}" in said
    assert "log file " in said
    proxy = MasterProxy(f"http://localhost:{port}", "/test")
    assert proxy.get_pid() == core.pid
    assert proxy.get_param("/rosdistro") == "noetic\n"
    assert set(proxy.get_param_names()) == {"/run_id", "/rosdistro", "/rosversion"}
    assert proxy.get_system_state().publishers == {"/rosout_agg": ["/rosout"]}
    proxy.close()
    core.send_signal(number)
    output, _ = core.communicate(timeout=30)
    assert (core.returncode, output) == (0, "master stopped\n")


def test_a_second_roscore_says_that_one_is_running(master: str) -> None:
    done = subprocess.run(
        [str(BIN / "roscore"), "-p", master.rsplit(":", 1)[1]],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr.startswith(
        "roscore: ERROR: roscore cannot run as another roscore/master is already running"
    )
    assert done.stderr.count("\n") == 1


def test_roscore_on_an_occupied_port() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        number = str(other.getsockname()[1])
        done = subprocess.run(
            [str(BIN / "roscore"), "-p", number], capture_output=True, text=True, timeout=100, check=False
        )
    assert (done.returncode, done.stderr) == (
        1,
        f"roscore: ERROR: port {number} is taken by another program or by a suspended master (no answer within 4 s): "
        "choose one with `roscore -p PORT`\n",
    )


@pytest.mark.parametrize("words", [["--nonsense"], ["-p", "x"], ["-p", "70000"]])
def test_roscore_typed_wrong(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    from minirospy.ros.rosmaster.commands.master import roscore

    assert roscore(words) == 2
    assert len(own_lines(capsys.readouterr().err)) == 1


# --- rosrun


def test_rosrun_passes_words_and_status_on(package: Path) -> None:
    done = subprocess.run(
        [str(BIN / "rosrun"), "pkg", "stop.py", "7", "-v"],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (7, "stopping\n", "")


@pytest.mark.parametrize(
    ("words", "status", "says"),
    [
        (["rpi_fero", "x"], 2, "did you mean rpi_feros"),
        (["rpi_feros", "led_actuato.py"], 3, "did you mean led_actuator.py"),
        (["rpi_feros"], 2, "type rosrun PACKAGE EXECUTABLE"),
        (["--what", "a", "b"], 2, "--what is unknown"),
    ],
)
def test_rosrun_usage_errors(
    words: list[str], status: int, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert rosrun.main(words) == status
    errors = capsys.readouterr().err
    assert says in errors
    assert len(own_lines(errors)) == 1


# --- roslaunch


@posix
def test_roslaunch_starts_a_master_and_leaves_nothing_behind(
    port: int, package: Path, started: list[subprocess.Popen[str]]
) -> None:
    file = package / "two.launch"
    file.write_text(
        '<launch><arg name="n" default="1"/><param name="p" value="$(arg n)"/>'
        '<node name="one" pkg="pkg" type="wait.py" args="-x" output="screen"><remap from="a" to="b"/></node>'
        '<node name="two" pkg="pkg" type="wait.py" ns="deep"/></launch>'
    )
    launch = start(started, "roslaunch", "pkg", "two.launch", "n:=5")
    said = read_until(launch, "waiting -x")

    assert "auto-starting new master\nprocess[master]: started with pid [" in said
    assert "PARAMETERS\n * /p: 5\n" in said
    assert "  /deep/\n    two (pkg/wait.py)\n" in said
    assert "waiting -x a:=b __name:=one __log:=" in said

    if "process[deep/two-3]" not in said:
        read_until(launch, "process[deep/two-3]: started with pid [")
    proxy = MasterProxy(f"http://localhost:{port}", "/test")
    assert proxy.get_param("/p") == 5

    proxy.close()
    children = psutil.Process(launch.pid).children(recursive=True)
    # The master, both nodes, and the guardian that stops them if roslaunch is killed.
    assert len(children) == 4

    launch.send_signal(signal.SIGINT)
    output, _ = launch.communicate(timeout=30)
    assert launch.returncode == 0
    assert "[deep/two-3] killing on exit\n[one-2] killing on exit\n" in output
    assert output.splitlines()[-4:] == [
        "[master] killing on exit",
        "shutting down processing monitor...",
        "... shutting down processing monitor complete",
        "done",
    ]

    _, left = psutil.wait_procs(children, timeout=30)
    assert not left
    assert list(Path(os.environ["ROS_LOG_DIR"]).glob("*/deep-two-3-stdout.log"))


@pytest.mark.parametrize(("code", "status"), [(0, 0), (3, 1)])
def test_a_required_node_ends_all(master: str, package: Path, code: int, status: int) -> None:
    file = package / "required.launch"
    file.write_text(
        f'<launch><node name="r" pkg="pkg" type="stop.py" args="{code}" required="true" output="screen"/>'
        '<node name="w" pkg="pkg" type="wait.py"/></launch>'
    )
    done = launched(file)
    assert done.returncode == status
    assert "REQUIRED process [r-1] has died!" in done.stderr
    assert "[w-2] killing on exit" in done.stdout
    assert "auto-starting" not in done.stdout


def test_nodes_run_without_log_files(
    master: str, package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The nodes' output goes to the terminal instead."""
    # An unbuffered node writes the line end separately, so that a line from roslaunch may come in between.
    monkeypatch.setenv("PYTHONUNBUFFERED", "")
    (tmp_path / "file").touch()
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "file"))
    file = package / "stops.launch"
    file.write_text('<launch><node name="s" pkg="pkg" type="stop.py" args="0"/></launch>')
    done = launched(file)
    assert done.returncode == 0
    assert re.fullmatch(
        rf"WARNING: cannot write logs to {tmp_path}/file/\S+: Not a directory; set ROS_LOG_DIR\n", done.stderr
    )
    assert "\nstopping\n" in done.stdout
    assert "[s-1] process has finished cleanly\nlog file: none\n" in done.stdout


def test_node_starts_if_its_folder_cannot_be_created(
    master: str, package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "file"))
    file = package / "stops.launch"
    file.write_text('<launch><node name="s" pkg="pkg" type="stop.py" args="0"/></launch>')
    done = launched(file)
    assert done.stderr == (
        f"WARNING: the folder {tmp_path}/file cannot be made: File exists; "
        f"nodes start in {tempfile.gettempdir()}; set ROS_HOME\n"
    )
    assert "[s-1] process has finished cleanly" in done.stdout


def test_a_node_that_dies_is_reported(master: str, package: Path) -> None:
    file = package / "dies.launch"
    file.write_text('<launch><node name="d" pkg="pkg" type="stop.py" args="3"/></launch>')
    done = launched(file)
    assert done.returncode == 0
    assert "[d-1] process has died [pid " in done.stderr
    assert "exit code 3, cmd " in done.stderr
    assert "log file: " in done.stderr
    assert "all processes on machine have died" in done.stdout


@pytest.mark.parametrize(
    ("words", "status", "says"),
    [
        ([], 2, "specify what to launch"),
        (["rpi_feros_bringu", "x.launch"], 1, "did you mean rpi_feros_bringup"),
        (["rpi_feros_bringup", "rpi_let.launch"], 1, "did you mean rpi_led.launch"),
        (["rpi_feros_bringup", "rpi_led"], 1, "did you mean rpi_led.launch?"),
        (["rpi_feros_bringup"], 1, "package [rpi_feros_bringup] has led_service.launch, move_led.launch, "),
        (["rpi_led.launch"], 1, "; did you mean `roslaunch rpi_feros_bringup rpi_led.launch`?"),
        (["rpi_feros", "rpi_led.launch"], 1, "; did you mean `roslaunch rpi_feros_bringup rpi_led.launch`?"),
        (["nope.launch"], 1, "or a path\n"),
        (["/no/such.launch"], 1, "is not a launch file name"),
        (
            [str(Path(__file__).parents[2] / "launch" / "rpi_let.launch")],
            1,
            "or a path; did you mean rpi_led.launch",
        ),
        (["--nonsense"], 2, "unrecognized arguments: --nonsense"),
    ],
)
def test_roslaunch_typed_wrong(
    words: list[str], status: int, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert roslaunch.main(words) == status
    errors = capsys.readouterr().err
    assert says in errors
    assert len(own_lines(errors)) == 1


def test_roslaunch_without_running(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = package / "a.launch"
    file.write_text(
        '<launch><arg name="who" doc="a name"/><param name="p" value="1"/>'
        '<node name="$(arg who)" pkg="pkg" type="wait.py"/></launch>'
    )
    assert roslaunch.main(["--nodes", str(file), "who:=me"]) == 0
    assert roslaunch.main(["--dump-params", str(file), "who:=me"]) == 0
    assert roslaunch.main(["--ros-args", str(file)]) == 0
    assert roslaunch.main(["--files", str(file), "who:=me"]) == 0
    assert roslaunch.main(["--args", "me", str(file), "who:=me"]) == 0
    command = f"{sys.executable} {package / 'wait.py'} __name:=me"
    assert capsys.readouterr().out == (
        f"/me\n/p: 1\n\nRequired Arguments:\n  who: a name\n{file}\n{command}\n"
    )


def test_tests_without_a_name_are_not_listed(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = package / "a.test"
    file.write_text(
        '<launch><test test-name="" pkg="pkg" type="wait.py"/><test test-name="" ns="g" pkg="pkg" type="wait.py"/>'
        '<test test-name="q" pkg="pkg" type="wait.py"/></launch>'
    )
    assert roslaunch.main(["--nodes", str(file)]) == 0
    assert roslaunch.main(["--find-node", "/", str(file)]) == 1
    out, err = capsys.readouterr()
    assert out == "/q\n"
    assert "there are: /q" in err


def test_undeclared_launch_argument_is_a_warning(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = package / "a.launch"
    file.write_text('<launch><arg name="speed" default="1"/><param name="p" value="$(arg speed)"/></launch>')
    assert roslaunch.main(["--dump-params", str(file), "sped:=2", "speed:="]) == 0
    captured = capsys.readouterr()
    assert captured.out == "/p: 1\n\n"
    assert captured.err.startswith("WARNING: arg [sped] not found; did you mean speed?")


def test_args_line_without_ros_master_uri(
    package: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The line is the same as real ROS's, so that it works in every terminal."""
    file = package / "a.launch"
    file.write_text('<launch><node name="n" ns="g" pkg="pkg" type="wait.py"/></launch>')
    assert roslaunch.main(["--args", "/g/n", str(file)]) == 0
    with_one = capsys.readouterr().out
    assert with_one.startswith('ROS_NAMESPACE="/g" ')
    monkeypatch.delenv("ROS_MASTER_URI")
    assert roslaunch.main(["--args", "/g/n", str(file)]) == 0
    assert capsys.readouterr().out == f'ROS_MASTER_URI="http://localhost:11311/" {with_one}'


def test_roslaunch_does_not_start_a_master_elsewhere(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from minirospy.base.environment import Environment
    from minirospy.ros.roslaunch.launcher.runner import Launcher
    from minirospy.ros.roslaunch.launcher.spec import LaunchSpec
    from minirospy.workspace.packages import Packages

    environment = Environment.read(
        {"ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}", "ROS_HOSTNAME": "localhost"}
    )
    monkeypatch.setattr(Environment, "master_is_local", property(lambda self: False))
    with pytest.raises(MasterUnreachableError):
        Launcher(LaunchSpec(), environment, Packages(environment)).run()


# --- the family and the demo


def test_family_lists_its_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert umbrella.main([]) == 2
    assert "minirospy demo " in capsys.readouterr().out
    assert umbrella.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("minirospy 0.")
    assert umbrella.main(["tpic"]) == 2
    assert "did you mean topic?" in capsys.readouterr().err


def test_the_demo_shows_the_led_following_and_leaves_no_file_of_its_board(
    started: list[subprocess.Popen[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "boards"
    monkeypatch.delenv("MINIROSPY_BOARD")
    monkeypatch.setenv("MINIROSPY_RUNTIME_DIR", str(folder))
    demo = start(started, "minirospy", "demo", "--presses", "1")
    output, _ = demo.communicate(timeout=200)
    assert "1: button 1 pressed  -> LED on GPIO 7 on after " in output
    assert "1: button 1 released -> LED on GPIO 7 off after " in output
    assert demo.returncode == 0

    boards = [
        process
        for process in psutil.process_iter(["cmdline"])
        if str(folder) in (process.info["cmdline"] or ())
    ]
    _, left = psutil.wait_procs(boards, timeout=30)
    assert not left
    assert not list(folder.iterdir())


@posix
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_the_demo_stops_its_nodes_at_a_signal(
    started: list[subprocess.Popen[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    monkeypatch.delenv("MINIROSPY_BOARD")
    monkeypatch.setenv("MINIROSPY_RUNTIME_DIR", str(tmp_path / "boards"))
    demo = start(started, "minirospy", "demo", "--presses", "1000")
    read_until(demo, "1: button 1 released")
    children = psutil.Process(demo.pid).children(recursive=True)
    assert len(children) >= 4  # roslaunch, the master and both nodes
    try:
        demo.send_signal(number)
        demo.communicate(timeout=100)
        assert demo.returncode == 128 + number
        _, left = psutil.wait_procs(children, timeout=30)
        assert not left
    finally:
        for child in children:
            with contextlib.suppress(psutil.Error):
                child.kill()
