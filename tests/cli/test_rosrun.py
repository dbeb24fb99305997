"""The command rosrun: which program of a package it runs and how, and the errors if there is none."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.ros.rosbash.commands import rosrun
from tests.cli.conftest import own_lines
from tests.conftest import write_files

BIN = Path(sys.executable).parent
posix = pytest.mark.skipif(sys.platform == "win32", reason="scripts of POSIX systems")


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the package ``my``, with Python and shell scripts, two of which have the same name."""
    folder = tmp_path / "src" / "my"
    texts = {
        "scripts/talker.py": "#!/usr/bin/env python3\nimport sys\nprint('talks', *sys.argv[1:])\nsys.exit(7)\n",
        "scripts/deep/down": '#!/bin/sh\necho deep down "$@"\n',
        "scripts/twin": "#!/bin/sh\necho twin of scripts\n",
        "nodes/twin": "#!/bin/sh\necho twin of nodes\n",
        "scripts/bare": 'echo no first line "$1"\n',
        "scripts/elsewhere": "#!/no/such/shell -x\n",
        "scripts/windows": "#!/bin/sh\r\necho x\r\n",
        "scripts/dies": "#!/bin/sh\nkill -TERM $$\n",
        "package.xml": "<package><name>my</name></package>",
    }
    write_files(folder, texts, executable=texts.keys() - {"package.xml"})
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    return folder


def rosrun_(*words: str, stdin: str = "", **environ: str) -> tuple[int, str, str]:
    """Return the command's exit status, and the output of the command and the program."""
    done = subprocess.run(
        [str(BIN / "rosrun"), *words],
        input=stdin, capture_output=True, text=True, timeout=30, check=False, env={**os.environ, **environ},
    )  # fmt: skip
    assert "Traceback" not in done.stderr
    return done.returncode, done.stdout, done.stderr


def test_words_and_status_are_the_programs_own(package: Path) -> None:
    assert rosrun_("my", "talker.py", "-h", "--prefix", "x") == (7, "talks -h --prefix x\n", "")


@posix
def test_a_program_in_a_folder_of_a_folder(package: Path) -> None:
    assert rosrun_("my", "down", "a")[:2] == (0, "deep down a\n")
    assert rosrun_("my", "scripts/deep/down", "b")[:2] == (0, "deep down b\n")


@posix
def test_of_several_of_one_name_one_is_chosen(package: Path) -> None:
    status, out, err = rosrun_("my", "twin", stdin="9\nx\n2\n")
    assert (status, out.splitlines()[1:]) == (0, ["twin of scripts"])
    assert out.startswith(
        "[rosrun] You have chosen a non-unique executable, please pick one of the following:\n"
    )
    assert err == f"1) {package}/nodes/twin\n2) {package}/scripts/twin\n#? #? #? "
    assert rosrun_("my", "nodes/twin")[1] == "twin of nodes\n"


@posix
def test_ambiguous_name_without_a_choice_is_an_error(package: Path) -> None:
    status, _, err = rosrun_("my", "twin")
    assert status == 2
    assert err.splitlines()[-1] == "#? rosrun: ERROR: nobody chose: name the path, as `rosrun my nodes/twin`"


@posix
def test_copy_in_devel_is_not_a_second_program(package: Path, tmp_path: Path) -> None:
    built = tmp_path / "devel" / "lib" / "my"
    built.mkdir(parents=True)
    for name in ("down", "compiled"):
        (built / name).write_text("#!/bin/sh\necho built\n")
        (built / name).chmod(0o755)
    prefix = str(tmp_path / "devel")
    assert rosrun_("my", "down", CMAKE_PREFIX_PATH=prefix)[1] == "deep down\n"
    assert rosrun_("my", "compiled", CMAKE_PREFIX_PATH=prefix)[1] == "built\n"
    (package / "scripts" / "deep" / "down").chmod(0o644)
    assert rosrun_("my", "down", CMAKE_PREFIX_PATH=prefix)[1] == "built\n"


@posix
def test_a_package_that_is_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The programs for share/PKG are in lib/PKG: in /usr/share and /usr/lib, or in a workspace's install folder."""
    share, programs = tmp_path / "share" / "theirs", tmp_path / "lib" / "theirs"
    share.mkdir(parents=True)
    programs.mkdir(parents=True)
    (share / "package.xml").write_text("<package><name>theirs</name></package>")
    (programs / "go").write_text('#!/bin/sh\necho went "$@"\n')
    (programs / "go").chmod(0o755)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "share"))
    for prefix in ("", str(tmp_path)):
        assert rosrun_("theirs", "go", "1", CMAKE_PREFIX_PATH=prefix)[:2] == (0, "went 1\n")
    assert "did you mean go?" in rosrun_("theirs", "goo")[2]


@posix
def test_prefix_and_debug(package: Path) -> None:
    assert rosrun_("--prefix", "echo 'a b'", "my", "down", "c")[1] == f"a b {package}/scripts/deep/down c\n"
    assert rosrun_("--prefix=echo", "my", "down")[1] == f"{package}/scripts/deep/down\n"
    _, out, err = rosrun_("-d", "my", "down", "c d")
    assert out == "deep down c d\n"
    assert err.splitlines() == [
        f"[rosrun] Looking in rospack dir: {package}",
        f"[rosrun] Running {package}/scripts/deep/down 'c d'",
    ]


@posix
def test_the_signal_that_ends_the_program_is_the_commands(package: Path) -> None:
    assert rosrun_("my", "dies")[0] == -signal.SIGTERM


@posix
def test_a_script_without_a_first_line_is_the_shells(package: Path) -> None:
    assert rosrun_("my", "bare", "x")[:2] == (0, "no first line x\n")


def fails(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    """Run a command that fails; return its exit status and minirospy's own error line."""
    status = rosrun.main(words)
    own = own_lines(capsys.readouterr().err)
    assert len(own) == 1
    return status, own[0].removeprefix("rosrun: ERROR: ")


@posix
@pytest.mark.parametrize(
    ("program", "why"),
    [
        ("elsewhere", "its first line names [/no/such/shell -x], which does not exist"),
        ("windows", "its lines end as those of Windows"),
    ],
)
def test_a_program_that_cannot_be_run(
    package: Path, program: str, why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    status, said = fails(capsys, "my", program)
    assert status == 2
    assert said.startswith(f"cannot run {package}/scripts/{program}: {why}")


def test_a_terminal_without_a_workspace(capsys: pytest.CaptureFixture[str]) -> None:
    assert fails(capsys, "rpi_test", "x.py")[1].endswith(
        "(no workspace is known in this terminal: `source WORKSPACE/devel/setup.bash`)"
    )


def test_usage_errors(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert fails(capsys, "my")[1].startswith("type rosrun PACKAGE EXECUTABLE: [my] has ")
    assert "talker.py" in fails(capsys, "my")[1]
    assert fails(capsys, "mi", "x") == (
        2,
        "package [mi] not found: ROS_PACKAGE_PATH names the folders that are searched",
    )
    assert "did you mean talker.py?" in fails(capsys, "my", "taker.py")[1]
    # The package is missing, or not separated by a space.
    for word in ("talker.py", "my/talker.py"):
        assert fails(capsys, word) == (2, "type rosrun PACKAGE EXECUTABLE, as `rosrun my talker.py`")
    assert fails(capsys, "nowhere.py")[1].startswith("package [nowhere.py] not found")

    # If there are no similar names, all programs are listed; a path is relative to the package.
    for wrong in ("zzz", "/etc/passwd"):
        status, said = fails(capsys, "my", wrong)
        assert status == 3
        assert said.startswith(f"executable [{wrong}] not found: package [my] in {package} has dies, ")
        assert "talker.py" in said

    (package.parent / "none").mkdir()
    (package.parent / "none" / "package.xml").write_text("<package><name>none</name></package>")
    assert fails(capsys, "none", "x")[1].endswith("/none has no programs")
    assert fails(capsys, "none")[1] == "type rosrun PACKAGE EXECUTABLE: [none] has no programs"
    assert fails(capsys, "--prefix") == (
        2,
        "option --prefix is unknown, or lacks its value (`rosrun -h` shows what there is)",
    )
    assert fails(capsys, "--prefix", "'a", "my", "talker.py") == (2, "--prefix ['a]: No closing quotation")


@posix
def test_python_file_that_ros_refuses_runs_with_a_warning(package: Path) -> None:
    path = package / "scripts" / "talker.py"
    run_ = "print('runs')\n"

    for text, mode, why in (
        (
            f"#!/usr/bin/env python3\n{run_}",
            0o644,
            f"is not executable, which ROS 1 refuses: chmod +x {path}",
        ),
        (run_, 0o755, "has no interpreter in its first line, which ROS 1 needs: #!/usr/bin/env python3"),
        (
            f"#!/usr/bin/env python3\r\n{run_}",
            0o755,
            f"has the line ends of Windows, which ROS 1 cannot run: sed -i 's/\\r$//' {path}",
        ),
    ):
        path.write_bytes(text.encode())
        path.chmod(mode)
        assert rosrun_("my", "talker.py") == (0, "runs\n", f"WARNING: {path} {why}\n")


@posix
def test_prefix_that_runs_python_gets_the_file_alone(package: Path) -> None:
    status, output, _ = rosrun_("--prefix", f"{sys.executable} -u", "my", "talker.py", "x")
    assert (status, output) == (7, "talks x\n")


@posix
def test_file_that_is_not_executable(package: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (package / "scripts" / "twin").chmod(0o644)
    (package / "nodes" / "twin").chmod(0o644)
    path = package / "nodes" / "twin"
    assert fails(capsys, "my", "twin") == (3, f"{path} is not executable: chmod +x {path}")


def test_a_bad_master_uri_is_no_hindrance(package: Path) -> None:
    assert rosrun_("my", "talker.py", ROS_MASTER_URI="nonsense")[0] == 7
