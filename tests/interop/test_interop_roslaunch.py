# ruff: noqa: E501
"""Both stacks' roslaunch with the same files; minirospy's with a real roslaunch on the "other" machine, and with a real sshd.

The case launch_files of tests/referee compares the interpretation of the files in depth.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
from pathlib import Path

import pytest

from tests.conftest import free_port
from tests.interop.conftest import OUR_BIN, PATIENCE, REAL_BIN, environment
from tests.waiting import wait_until

INNER = '<launch><arg name="k" default="d" doc="a key"/><param name="p" value="$(arg k)"/><node name="in" pkg="pkg" type="wait.py"/></launch>'
OUTER = """<launch>
  <arg name="need" doc="needed"/><arg name="free" default="$(arg need)1"/>
  <arg name="c" default="no" if="0"/><arg name="c" default="$(eval need + 1)" unless="0"/><group><arg name="inner" default="2"/></group>
  <env name="E" value="a b"/><remap from="r" to="s"/>
  <rosparam>{a: {b: [1, x]}, t: 'yes'}</rosparam>
  <group ns="g"><node name="n" pkg="pkg" type="wait.py" args="$(arg need) 'x y'" launch-prefix="nice"><env name="F" value="2"/></node></group>
  <include file="$(dirname)/inner.launch" ns="i"/>
</launch>
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "pkg"
    folder.mkdir()
    text = "<version>1.0.0</version><description>d</description><maintainer email='a@b.c'>m</maintainer><license>x</license>"
    (folder / "package.xml").write_text(f"<package format='2'><name>pkg</name>{text}</package>")
    program = folder / "wait.py"
    program.write_text("#!/usr/bin/env python3\nimport time\ntime.sleep(1000)\n")
    program.chmod(0o755)
    (folder / "end.py").write_text("#!/usr/bin/env python3\nimport sys\nsys.exit(3)\n")
    (folder / "end.py").chmod(0o755)
    (folder / "inner.launch").write_text(INNER)
    (folder / "outer.launch").write_text(OUTER)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}:/usr/share")
    return folder


def say(stack: str, *words: str) -> tuple[int, str]:
    program = (OUR_BIN if stack == "ours" else REAL_BIN) / "roslaunch"
    done = subprocess.run(
        [str(program), *words],
        env=environment("http://localhost:1", stack),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    return done.returncode, done.stdout


@pytest.mark.parametrize(
    "words",
    [["--nodes"], ["--files"], ["--dump-params"], ["--ros-args"], ["--args=/g/n"], ["--args=i/in"], ["--find-node=/i/in"]],
    ids=" ".join,
)  # fmt: skip
def test_roslaunch_options_print_the_same_without_running(package: Path, words: list[str]) -> None:
    words = [*words, str(package / "outer.launch"), "need:=5"]
    (real_status, real), (status, ours) = say("rospy", *words), say("ours", *words)
    # minirospy runs Python programs with its own interpreter.
    ours = ours.replace(f"{OUR_BIN / 'python'} ", "")
    assert (status, sorted(ours.splitlines())) == (real_status, sorted(real.splitlines()))


def launch(text: str, package: Path, uri: str, **variables: str) -> subprocess.Popen[str]:
    (package / "remote.launch").write_text(f"<launch>{text}</launch>")
    return subprocess.Popen(
        [str(OUR_BIN / "roslaunch"), str(package / "remote.launch")],
        env={**environment(uri, "ours"), **variables},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def read_until(process: subprocess.Popen[str], *words: str) -> str:
    said = ""
    assert process.stdout
    for line in process.stdout:
        said += line
        if all(word in said for word in words):
            return said
    raise AssertionError(said)


def listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def end(process: subprocess.Popen[str]) -> str:
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=PATIENCE)
    return said


def test_remote_node_by_a_real_roslaunch_child(package: Path, real_master: str, tmp_path: Path) -> None:
    """Each roslaunch accepts the other's calls."""
    folder = tmp_path / "bin"
    folder.mkdir()
    ssh = folder / "ssh"
    ssh.write_text('#!/bin/sh\nfor last; do :; done\nPATH=/usr/bin:/bin exec sh -c "$last"\n')
    ssh.chmod(0o755)
    process = launch(
        f'<machine name="m" address="127.0.0.1" user="somebody" env-loader="env" timeout="{PATIENCE}"/>'
        '<node machine="m" name="a" pkg="pkg" type="wait.py" ns="deep"/><node machine="m" name="b" pkg="pkg" type="end.py"/>',
        package,
        real_master,
        PATH=f"{folder}:{os.environ['PATH']}",
    )
    said = read_until(process, "process[deep/a-1]: started with pid", "[b-2] process has died")
    assert "[127.0.0.1-0]: " in said
    assert "[127.0.0.1-0] killing on exit" in end(process)


@pytest.mark.skipif(os.name != "posix" or not shutil.which("sshd", path="/usr/sbin"), reason="no sshd")
def test_remote_node_over_a_real_sshd(package: Path, real_master: str, tmp_path: Path) -> None:
    """Connect to the sshd's port with a key. The user name is the same, because another one would mean another machine."""
    for name in ("host", "user"):
        subprocess.run(
            ["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(tmp_path / name)], check=True
        )
    port = free_port()
    config = tmp_path / "sshd_config"
    config.write_text(
        f"Port {port}\nListenAddress 127.0.0.1\nHostKey {tmp_path}/host\nAuthorizedKeysFile {tmp_path}/user.pub\n"
        f"StrictModes no\nPidFile none\nPermitRootLogin yes\nUsePAM no\n"
    )
    os.makedirs("/run/sshd", exist_ok=True)
    server = subprocess.Popen(["/usr/sbin/sshd", "-D", "-f", str(config)], stderr=subprocess.PIPE, text=True)
    # Use the ssh command as a user types it, but with a key and known hosts that are not the user's own.
    folder = tmp_path / "bin"
    folder.mkdir()
    ssh = folder / "ssh"
    ssh.write_text(
        f'#!/bin/sh\nexec /usr/bin/ssh -i {tmp_path}/user -o IdentitiesOnly=yes -o UserKnownHostsFile={tmp_path}/known -l root "$@"\n'
    )
    ssh.chmod(0o755)
    loader = tmp_path / "env.sh"
    loader.write_text(
        f"#!/bin/sh\nexport PATH={OUR_BIN}:$PATH ROS_PACKAGE_PATH={tmp_path} ROS_HOME={tmp_path}/home ROS_HOSTNAME=localhost\n"
        'exec "$@"\n'
    )
    loader.chmod(0o755)
    name = f"far-{port}"
    text = (
        f'<machine name="m" address="{name}" ssh-port="{port}" env-loader="{loader}" timeout="{PATIENCE}"/>'
        '<node machine="m" name="a" pkg="pkg" type="wait.py"/>'
    )
    # Use a host name that only this ssh resolves, so that it does not count as this machine.
    ssh.write_text(
        ssh.read_text().replace("-l root", f"-l root -o HostName=127.0.0.1 -o HostKeyAlias={name}")
    )

    try:
        # A refused connection would cause a different error from that for an unknown key.
        wait_until(lambda: listens(port))
        process = launch(text, package, real_master, PATH=f"{folder}:{os.environ['PATH']}")
        refused, _ = process.communicate(timeout=PATIENCE)
        assert "Host key verification failed" in refused
        assert "unable to start remote roslaunch child" in refused

        process = launch(
            text, package, real_master, PATH=f"{folder}:{os.environ['PATH']}", ROSLAUNCH_SSH_UNKNOWN="1"
        )
        read_until(process, f"[{name}-0]: process[a-1]: started with pid")
        assert f"[{name}-0]: [a-1] killing on exit" in end(process)
    finally:
        server.terminate()
        server.communicate()
