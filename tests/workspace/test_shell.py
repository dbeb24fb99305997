"""workspace/shell: the functions and TAB in real shells. A shell that is not installed is skipped."""

from __future__ import annotations

import atexit
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

import minirospy
from minirospy.cli.registry import COMMANDS, SHELL_FUNCTIONS

SHELL = Path(minirospy.__file__).parent / "workspace" / "shell"
BIN = Path(sys.executable).parent

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="shells of POSIX systems")


class Result(NamedTuple):
    """A script's exit status and output."""

    status: int
    out: list[str]
    err: str


@cache
def dotfiles() -> Path:
    """Return the folder of zsh's completion cache, which all tests share because filling it takes a second."""
    folder = tempfile.TemporaryDirectory()
    atexit.register(folder.cleanup)
    return Path(folder.name)


class Shell:
    """A shell that has sourced minirospy's file, in a workspace with the package ``my_robot``."""

    def __init__(self, name: str, root: Path) -> None:
        self.name = name
        self.root = root
        self.package = root / "src" / "my_robot"
        self.environ = {
            "PATH": os.pathsep.join([str(root / "bin"), str(BIN), "/usr/bin", "/bin"]),
            "HOME": str(root),
            "ZDOTDIR": str(dotfiles()),
            "ROS_PACKAGE_PATH": str(root / "src"),
            "ROS_MASTER_URI": "http://localhost:1",
            "EDITOR": "echo EDIT",
        }

    def run(self, script: str, stdin: str = "", **environ: str) -> Result:
        """Run a script in the workspace."""
        file = SHELL / ("ros.fish" if self.name == "fish" else "ros.bash")
        bare = {"bash": ["--norc", "--noprofile"], "zsh": ["-f"], "fish": ["--no-config"]}[self.name]
        done = subprocess.run(
            [self.name, *bare, "-c", f". {file}\n{script}"],
            check=False,
            input=stdin,
            cwd=self.root,
            env={**self.environ, **environ},
            capture_output=True,
            text=True,
            timeout=30,
        )
        return Result(done.returncode, done.stdout.splitlines(), done.stderr)


def make_workspace(root: Path) -> None:
    package = root / "src" / "my_robot"
    for folder in ("scripts", "launch", "config", "deep/er", ".git"):
        (package / folder).mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_robot</name></package>")
    for folder in ("scripts", "deep/er", ".git"):
        (package / folder / "talker.py").write_text("#!/usr/bin/env python3\n")
    (package / "config" / "a map.yaml").write_text("{}\n")
    (package / "launch" / "all.launch").write_text(
        '<launch><arg name="rate" default="10"/><arg name="name" default="a robot"/></launch>'
    )
    (root / "devel").mkdir()
    (root / "devel" / "setup.bash").touch()

    if not (BIN / "rospack").exists():
        (root / "bin").mkdir()

        for name, function in (("rospack", "main"), ("rosstack", "rosstack")):
            stand_in = root / "bin" / name
            stand_in.write_text(
                f"#!{sys.executable}\nimport sys\n"
                f"from minirospy.ros.rospack.commands.rospack import {function}\nsys.exit({function}())\n"
            )
            stand_in.chmod(0o755)


@pytest.fixture(params=["bash", "zsh", "fish"])
def shell(request: pytest.FixtureRequest, tmp_path: Path) -> Shell:
    """Return each shell in turn."""
    if not shutil.which(request.param):
        pytest.skip(f"{request.param} is not installed")
    make_workspace(tmp_path)
    return Shell(request.param, tmp_path)


@pytest.fixture
def bash(tmp_path: Path) -> Shell:
    """Return bash."""
    if not shutil.which("bash"):
        pytest.skip("bash is not installed")
    make_workspace(tmp_path)
    return Shell("bash", tmp_path)


# --- roscd


def test_roscd(shell: Shell) -> None:
    assert shell.run("roscd my_robot; pwd") == (0, [str(shell.package)], "")
    assert shell.run("roscd my_robot/deep/er; pwd") == (0, [str(shell.package / "deep" / "er")], "")


def test_roscd_goes_to_a_metapackage_too(shell: Shell) -> None:
    (shell.root / "src" / "my_robots").mkdir()
    (shell.root / "src" / "my_robots" / "package.xml").write_text(
        "<package><name>my_robots</name><export><metapackage/></export></package>"
    )
    done = shell.run("roscd my_robots; pwd; rosls my_robots")
    assert (done.out, done.err) == ([str(shell.root / "src" / "my_robots"), "package.xml"], "")


def test_roscd_alone_goes_to_devel_and_from_there_to_src(shell: Shell) -> None:
    prefixes = f"/nowhere:{shell.root}/devel:/usr"
    script = "cd /; roscd; pwd; cd ..; cd src; pwd"
    expected = [str(shell.root / "devel"), str(shell.root / "src")]
    assert shell.run(script, CMAKE_PREFIX_PATH=prefixes) == (0, expected, "")


def test_roscd_alone_goes_to_ros_workspace_first(shell: Shell) -> None:
    variables = {"CMAKE_PREFIX_PATH": f"{shell.root}/devel", "ROS_WORKSPACE": str(shell.root / "src")}
    assert shell.run("roscd; pwd", **variables).out == [str(shell.root / "src")]


def test_roscd_alone_without_a_workspace(shell: Shell) -> None:
    done = shell.run("roscd", CMAKE_PREFIX_PATH="/usr:/nowhere")
    assert done.status == 1
    assert done.err.startswith("roscd: ERROR: no workspace: source its devel/setup.")
    assert shell.run("roscd").status == 1


def test_roscd_to_an_unknown_package_names_the_nearest(shell: Shell) -> None:
    done = shell.run("roscd my_robt")
    assert (done.status, done.out) == (1, [])
    assert len(done.err.splitlines()) == 1
    assert done.err.startswith("roscd: ERROR: package 'my_robt' not found; did you mean my_robot")


def test_roscd_to_a_missing_folder_is_an_error(shell: Shell) -> None:
    done = shell.run("roscd my_robot/nothing")
    assert (done.status, done.err) == (1, f"roscd: ERROR: folder {shell.package}/nothing does not exist\n")


def test_roscd_to_the_logs(shell: Shell) -> None:
    (shell.root / "logs").mkdir()
    (shell.root / "logs" / "latest").mkdir()
    logs = str(shell.root / "logs")
    script = "roscd log; pwd; roscd log/latest; pwd; rosls log"
    assert shell.run(script, ROS_LOG_DIR=logs).out == [logs, f"{logs}/latest", "latest"]
    assert shell.run("roscd test_results; pwd", ROS_TEST_RESULTS_DIR=logs).out == [logs]
    assert shell.run("rosls log", ROS_HOME=str(shell.root)).status > 0


@pytest.mark.parametrize("command", ["roscd", "rosed", "roscat", "roscp", "rosmv", "rospd", "rosls"])
def test_usage(shell: Shell, command: str) -> None:
    done = shell.run(f"{command} --help")
    assert (done.status, done.err) == (0, "")
    assert done.out[0].startswith(f"usage: {command} ")
    wrong = shell.run(f"{command} a b c d")
    assert (wrong.status, wrong.out) == (2, [])
    assert wrong.err.startswith(f"usage: {command} ")


@pytest.mark.parametrize(
    "command",
    [
        "rosls nobody",
        "rosed nobody x",
        "roscat nobody x",
        "roscp nobody x y",
        "rosmv -d nobody y",
        "rospd nobody",
    ],
)
def test_every_command_complains_of_an_unknown_package(shell: Shell, command: str) -> None:
    done = shell.run(command)
    assert (done.status, done.out) == (1, [])
    assert done.err.startswith(f"{command.split(maxsplit=1)[0]}: ERROR: package 'nobody' not found")


# --- rosls, rosed, roscp


def test_rosls(shell: Shell) -> None:
    assert shell.run("rosls my_robot") == (0, ["config", "deep", "launch", "package.xml", "scripts"], "")
    assert shell.run("rosls my_robot/config").out == ["a map.yaml"]
    assert "-rw" in shell.run("rosls -l my_robot/config").out[1]
    assert "-rw" in shell.run("rosls my_robot/config -l").out[1]


def test_rosed(shell: Shell) -> None:
    expected = (0, [f"EDIT {shell.package}/launch/all.launch"], "")
    assert shell.run("rosed my_robot all.launch") == expected
    assert shell.run("rosed my_robot launch/all.launch") == expected
    done = shell.run("rosed my_robot nothing.py")
    expected_complaint = f"file nothing.py does not exist in package [my_robot], which is in {shell.package}"
    assert (done.status, done.err) == (1, f"rosed: ERROR: {expected_complaint}\n")


def test_rosed_offers_a_choice_of_many_files(shell: Shell) -> None:
    done = shell.run("rosed my_robot talker.py", stdin="x\n2\n")
    assert done.out[-1].endswith(f"EDIT {shell.package}/scripts/talker.py")
    assert "You have chosen a non-unique filename" in done.err
    assert ".git" not in done.err
    assert shell.run("rosed my_robot talker.py", stdin="").status == 1


def test_rosed_with_a_file_whose_name_has_a_blank(shell: Shell) -> None:
    script = "rosed my_robot 'a map.yaml'"
    assert shell.run(script, EDITOR="cat").out == ["{}"]


def test_rosed_without_editor_says_so(bash: Shell) -> None:
    done = bash.run(
        f"PATH={bash.root}/bin; _ros_find() {{ echo {bash.package}; }}; rosed my_robot package.xml", EDITOR=""
    )
    assert (done.status, done.err) == (1, "rosed: ERROR: no editor is installed: set EDITOR to yours\n")


def test_roscp(shell: Shell) -> None:
    assert shell.run("roscp my_robot all.launch copy.launch") == (0, [], "")
    assert (shell.root / "copy.launch").read_bytes() == (shell.package / "launch" / "all.launch").read_bytes()
    done = shell.run("roscp my_robot nothing copy")
    assert done.status == 1
    assert done.err.startswith("roscp: ERROR: file nothing does not exist in package [my_robot]")


def test_roscat(shell: Shell) -> None:
    assert shell.run("roscat my_robot 'a map.yaml'") == (0, ["{}"], "")
    done = shell.run("roscat my_robot nothing")
    assert (done.status, done.out) == (1, [])
    assert done.err.startswith("roscat: ERROR: file nothing does not exist in package [my_robot]")


def test_rosmv(shell: Shell) -> None:
    assert shell.run("rosmv my_robot all.launch moved.launch") == (0, [], "")
    assert (shell.root / "moved.launch").is_file()
    assert not (shell.package / "launch" / "all.launch").exists()
    assert shell.run("rosmv -d my_robot elsewhere") == (0, [], "")
    assert (shell.root / "elsewhere" / "package.xml").is_file()
    assert not shell.package.exists()


# --- rospd and rosd


def test_the_stack(shell: Shell) -> None:
    root, package = str(shell.root), str(shell.package)
    assert shell.run("rosd").out == [f"0 {root}"]
    assert shell.run("rospd").out == [f"0 {root}", f"1 {root}"]
    assert shell.run("rospd my_robot; pwd").out == [f"0 {package}", f"1 {root}", package]
    turned = shell.run("rospd my_robot >/dev/null; rospd my_robot/deep >/dev/null; rospd 2; pwd")
    assert turned.out == [f"0 {root}", f"1 {package}/deep", f"2 {package}", root]


def test_the_stack_has_no_such_number(shell: Shell) -> None:
    done = shell.run("rospd my_robot >/dev/null; rospd 7")
    assert (done.status, done.out, done.err) == (
        1,
        [],
        "rospd: ERROR: the stack has no number 7: rosd shows it\n",
    )


# --- TAB


def bash_tab(bash: Shell, line: str, words: list[str] | None = None, at: int | None = None) -> list[str]:
    """Return bash's completions for TAB at the end of ``line``, or at ``at``. ``words`` is the line as bash splits it."""
    words = line.split(" ") if words is None else words
    current = len(words if at is None else line[:at].split(" ")) - 1
    done = bash.run(
        f"""
        COMP_LINE={shlex.quote(line)}; COMP_POINT={len(line) if at is None else at}
        COMP_WORDS=({shlex.join(words)}); COMP_CWORD={current}
        function=$(complete -p {words[0]} | sed 's/.*-F \\([^ ]*\\) .*/\\1/')
        "$function" {words[0]} "${{COMP_WORDS[COMP_CWORD]}}"
        printf '<%s>\\0' "${{COMPREPLY[@]}}"
        """
    )
    assert not done.err
    found = "\n".join(done.out).split("\0")[:-1]
    return [] if found == ["<>"] else [text[1:-1] for text in found]


def test_bash_tab(bash: Shell) -> None:
    assert bash_tab(bash, "roscd my_") == ["my_robot/"]
    assert bash_tab(bash, "roscd my_robot/d") == ["my_robot/deep/"]
    assert bash_tab(bash, "rosrun my_") == ["my_robot "]
    assert bash_tab(bash, "rosrun my_robot ") == ["talker.py "]
    assert bash_tab(bash, "roslaunch my_robot ") == ["all.launch "]
    assert bash_tab(bash, "roslaunch my_robot all.launch ") == ["rate:=", "name:="]
    assert bash_tab(bash, "rostopic ec") == ["echo "]
    assert bash_tab(bash, "minirospy topic ec") == ["echo "]
    assert bash_tab(bash, "rostopic echo ") == []
    assert bash_tab(bash, "rosmsg show std_msgs/Boo") == ["std_msgs/Bool "]


def test_bash_takes_words_apart_at_colons(bash: Shell) -> None:
    line = "roslaunch my_robot all.launch rate:="
    assert bash_tab(bash, line, ["roslaunch", "my_robot", "all.launch", "rate", ":="]) == ["10 "]
    words = ["roslaunch", "my_robot", "all.launch", "rate", ":=", "1"]
    assert bash_tab(bash, line + "1", words) == ["10 "]
    words = ["roslaunch", "my_robot", "all.launch", "a", ":=", "5", "r"]
    assert bash_tab(bash, "roslaunch my_robot all.launch a:=5 r", words) == ["rate:="]


def test_bash_inserts_a_message(bash: Shell) -> None:
    assert bash_tab(bash, "rostopic pub /t std_msgs/Bool ") == ['"data: false" ']
    assert bash_tab(bash, "rostopic pub /t geometry_msgs/Point ") == ['"x: 0.0\ny: 0.0\nz: 0.0" ']
    # readline closes an open quote.
    assert bash_tab(bash, 'rostopic pub /t std_msgs/Bool "da') == ['data: false"']


def test_bash_completes_at_the_cursor(bash: Shell) -> None:
    # The cursor is before another word, so no space is added.
    assert bash_tab(bash, "rosrun my_robot ta --rate 5", at=len("rosrun my_robot ta")) == ["talker.py"]
    assert bash_tab(bash, "rosrun my_robot talker.py", at=len("rosrun my_robot ta")) == ["talker.py"]


def test_bash_completes_behind_a_break(bash: Shell) -> None:
    line = "roslaunch my_robot all.launch name:="
    words = ["roslaunch", "my_robot", "all.launch", "name", ":="]
    assert bash_tab(bash, line, words) == ["a\\ robot "]
    assert bash_tab(bash, line + '"a r', [*words, '"a r']) == ['a robot"']
    # Some users have removed the colon from COMP_WORDBREAKS.
    assert bash_tab(bash, line, [*words[:-2], "name:", "="]) == ["a\\ robot "]
    assert bash_tab(bash, line, [*words[:-2], "name:="]) == ["name:=a\\ robot "]
    assert bash_tab(bash, "rosparam load --x=", ["rosparam", "load", "--x", "="]) == []


def test_bash_completes_names_with_blanks(bash: Shell) -> None:
    assert bash_tab(bash, "rosed my_robot a") == ["a\\ map.yaml ", "all.launch "]
    assert bash_tab(bash, "rosed my_robot 'a ", ["rosed", "my_robot", "'a "]) == ["a map.yaml'"]


_COMMANDS = {*(entry.script for entry in COMMANDS if entry.script), *SHELL_FUNCTIONS}


def test_bash_knows_every_command(bash: Shell) -> None:
    lines = bash.run("complete -p").out
    assert {line.split()[-1] for line in lines if "_ros_complete_bash" in line} == _COMMANDS


def test_fish_knows_every_command(tmp_path: Path) -> None:
    if not shutil.which("fish"):
        pytest.skip("fish is not installed")
    make_workspace(tmp_path)
    lines = Shell("fish", tmp_path).run("complete").out
    assert {line.split()[-3] for line in lines if "_ros_complete" in line} == _COMMANDS


def test_tab_without_minirospy_is_silent(bash: Shell) -> None:
    done = bash.run("PATH=/nowhere; _ros_candidates 1 rostopic e; echo ${#_ros_found[@]}")
    assert (done.out, done.err) == (["0"], "")


def zsh_or_skip(tmp_path: Path) -> Shell:
    if not shutil.which("zsh"):
        pytest.skip("zsh is not installed")
    make_workspace(tmp_path)
    return Shell("zsh", tmp_path)


def test_zsh_tab(tmp_path: Path) -> None:
    zsh = zsh_or_skip(tmp_path)
    # zsh has no compadd outside its line editor, so replace it with a function that prints.
    script = """
    compadd() { for last; do :; done; for each in "${(@P)last}"; do print -r -- "$*:$each"; done }
    tab() { words=("$@"); CURRENT=${#words}; _ros_complete_zsh }
    tab roscd my_; tab rosrun my_robot ''; tab roslaunch my_robot all.launch rate:=
    tab rostopic pub /t geometry_msgs/Point ''; tab rostopic pub /t std_msgs/Bool '"'
    # Without a candidate the word stays as it was typed.
    tab rosrun my_robot zzz
    print ${_comps[roscd]} ${_comps[rostopic]}
    """
    assert zsh.run(script) == (
        0,
        [
            "-U -Q -S  -a partial:my_robot/",
            "-U -Q -a ready:talker.py",
            "-U -Q -a ready:rate:=10",
            '-U -Q -a ready:"x: 0.0',
            "y: 0.0",
            'z: 0.0"',
            "-U -Q -a ready:data: false",
            "_ros_complete_zsh _ros_complete_zsh",
        ],
        "",
    )


def test_fish_tab(tmp_path: Path) -> None:
    if not shutil.which("fish"):
        pytest.skip("fish is not installed")
    make_workspace(tmp_path)
    fish = Shell("fish", tmp_path)
    lines = (
        "roscd my_",
        "rosrun my_robot ",
        "roslaunch my_robot all.launch rate:=",
        "rostopic pub /t std_msgs/Bool ",
        "rostopic pub /t geometry_msgs/Point ",
        "rostopic echo ",
    )
    done = fish.run("\n".join(f"complete -C '{line}'" for line in lines))
    assert done == (0, ["my_robot/", "talker.py", "rate:=10", "data: false", "{x: 0.0, y: 0.0, z: 0.0}"], "")
    assert fish.run("set PATH /nowhere; complete -C 'rostopic e'").err == ""


@pytest.mark.parametrize("name", ["bash", "zsh", "fish"])
def test_tab_at_the_keyboard(name: str, tmp_path: Path) -> None:
    """Run a shell in a terminal, press TAB, and read the line."""
    import pty
    import select

    if not shutil.which(name):
        pytest.skip(f"{name} is not installed")
    make_workspace(tmp_path)
    bare = {"bash": ["--norc", "--noprofile"], "zsh": ["-f"], "fish": ["--no-config"]}[name]
    # Fish requires a terminal that belongs to its session.
    own = "import fcntl, os, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); os.execvp(sys.argv[1], sys.argv[1:])"
    keyboard, terminal = pty.openpty()
    shell = subprocess.Popen(
        [sys.executable, "-c", own, name, *bare, "-i"], stdin=terminal, stdout=terminal, stderr=terminal, start_new_session=True,
        env={**Shell(name, tmp_path).environ, "TERM": "dumb"},
    )  # fmt: skip
    os.close(terminal)

    def read_until(text: bytes) -> None:
        seen = b""
        while text not in seen:
            assert select.select([keyboard], [], [], 20.0)[0], seen
            seen += os.read(keyboard, 65536)

    try:
        source = SHELL / ("ros.fish" if name == "fish" else "ros.bash")
        ready = "math 6 x 7" if name == "fish" else "echo $((6 * 7))"
        # Wait for the output, not its echo; from then on, the line editor reads.
        os.write(keyboard, f"source {source}\n{ready}\n".encode())
        read_until(b"42")
        message = rb"data:\ false" if name == "fish" else b'"data: false"'
        for typed, ending in (
            (b"rosrun my_robot ta", b"lker.py "),
            (b"roslaunch my_robot all.launch name:=", b"a\\ robot "),
            (b"rosed my_robot a\\ ", b"map.yaml "),
            (b'rosed my_robot "a ', b'map.yaml"'),
            (b"rostopic pub /t std_msgs/Bool ", message),
        ):
            os.write(keyboard, typed + b"\t")
            read_until(ending)
            os.write(keyboard, b"\x15")
    finally:
        shell.kill()
        shell.wait()
        os.close(keyboard)


# --- the files themselves


@pytest.mark.skipif(not shutil.which("shellcheck"), reason="shellcheck is not installed")
def test_shellcheck() -> None:
    done = subprocess.run(["shellcheck", SHELL / "ros.bash"], check=False, capture_output=True, text=True)
    assert done.stdout == ""


def test_lines_of_the_batch_file_end_as_cmd_needs_them() -> None:
    # cmd.exe does not find labels in a file with only line feeds.
    text = (SHELL / "ros.bat").read_bytes()
    assert text.count(b"\r\n") == text.count(b"\n") > 0
