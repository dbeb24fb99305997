"""The commands `rostest` and `rosunit`: output, files and exit statuses. The package `tested` is in this folder."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from minirospy.base.errors import MinirospyError
from minirospy.ros.rostest.commands.rostest import rostest, rosunit
from minirospy.ros.rosunit.runner.bare import run_bare
from tests.waiting import wait_until

HERE = Path(__file__).parent
TEST = HERE / "tested" / "test"


@pytest.fixture(autouse=True)
def _tested(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(HERE))
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))


def start(command: str, *words: object) -> subprocess.Popen[str]:
    code = f"import sys; from minirospy.ros.rostest.commands.rostest import {command}; sys.exit({command}())"
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ran(command: str, *words: object) -> tuple[int, str, str]:
    popen = start(command, *words)
    out, err = popen.communicate(timeout=200)
    return popen.returncode, out, err


def write_test(path: Path, text: str) -> Path:
    path.write_text(f"<launch>{text}</launch>")
    return path


def cases(file: Path) -> list[str]:
    return [case.get("name") or "" for case in ElementTree.parse(file).getroot().iter("testcase")]


def test_each_outcome(tmp_path: Path) -> None:
    status, out, err = ran("rostest", "tested", "all.test", "limit:=1.0")
    assert (status, err) == (1, "")
    said = out.split("[ROSTEST]---")[0]

    for line in (
        "[Testcase: testgood] ... ok",
        "[Testcase: testbad] ... ok",
        "[Testcase: testlistens] ... ok",
        "[Testcase: testsecond-try] ... ok",
        "FAILURE: test [crash] did not generate test results",
        "  last words",
        "ERROR: max time [1.0s] allotted for test [sleepy] of type [tested/sleepy.py]",
        "FAILURE: Test node [tested/no_such.py] does not exist or is not executable",
        "FAILURE: Package [no_such_package_at_all] for test node [no_such_package_at_all/no_such.py] does not exist",
        "FAILURE: Duplicate tests named [twice] in rostest suite",
    ):
        assert line in said

    output = out[len(said) :]
    assert "[tested.rosunit-bad/test_fail][FAILURE]" in output
    assert "1 != 2 : one is not two" in output
    assert 'unittest/case.py", line' not in output
    assert "[tested.rosunit-second-try/test_twice][passed]" in output
    assert " * TESTS: 8\n\x1b[1;31m * ERRORS: 2\x1b[0m\n\x1b[1;31m * FAILURES: 5\x1b[0m" in output
    assert " * testcrash\n * testmissing\n * testno_package\n * testtwice\n" in output
    results = tmp_path / "test_results" / "tested"
    assert cases(results / "rosunit-good.xml") == ["test_one", "test_two"]
    assert len(cases(results / "rostest-test_all.xml")) == 9
    assert "to stdout: <&> &#x001B;[1m" in ElementTree.parse(results / "rosunit-good.xml").getroot()[2].text


def test_a_node_that_is_not_there(tmp_path: Path) -> None:
    text = '<node name="n" pkg="tested" type="no"/><test test-name="good" pkg="tested" type="good.py"/>'
    status, out, err = ran("rostest", "--package=a", "--pkgdir=/", write_test(tmp_path / "x.test", text))
    assert (status, err) == (1, "")
    assert "FAILURE: Test Fixture Nodes failed to launch" in out
    assert "executable [no] not found" in out


def test_a_test_called_as_a_node_is_warned_of(tmp_path: Path) -> None:
    text = '<node name="a" pkg="tested" type="crash.py"/><test test-name="a" pkg="tested" type="good.py"/>'
    status, _, err = ran("rostest", "--package=a", "--pkgdir=/", write_test(tmp_path / "x.test", text))
    assert status == 0
    assert "x.test:1: test [a] is called as the node [/a]" in err


def test_a_test_without_a_name_runs_under_a_unique_one(tmp_path: Path) -> None:
    """The test's results have no name, and its node is named after its type, as in real rostest."""
    text = '<test test-name="" pkg="tested" type="good.py"/><test test-name="" name="x" pkg="tested" type="good.py"/>'
    status, out, _ = ran("rostest", "--package=a", "--pkgdir=/", write_test(tmp_path / "x.test", text))
    assert status == 1
    assert "FAILURE: Duplicate tests named [] in rostest suite" in out

    text = text[: text.index("/>") + 2]
    status, out, _ = ran("rostest", "--package=a", "--pkgdir=/", write_test(tmp_path / "x.test", text))
    assert status == 0
    assert "[Testcase: test] ... ok" in out
    assert "[a.rosunit-/test_one][passed]" in out
    assert len(list((tmp_path / "log").rglob("good_py_*-1-stdout.log"))) == 1
    assert (tmp_path / "test_results" / "a" / "rosunit-.xml").is_file()


def test_a_failed_test_is_status_2_and_names_are_as_requested(tmp_path: Path) -> None:
    file = write_test(tmp_path / "x.test", '<test test-name="bad" pkg="tested" type="bad.py"/>')
    base = tmp_path / "results"
    options = ("--package", "mine", "--pkgdir", tmp_path, "--results-filename", "other.xml")
    status, out, _ = ran("rostest", *options, "--results-base-dir", base, file)
    assert status == 2
    assert f"[ROSUNIT] Outputting test results to {base / 'mine' / 'rostest-other.xml'}" in out
    assert sorted(path.name for path in base.rglob("*.xml")) == ["rostest-other.xml", "rosunit-bad.xml"]


def test_text_shows_all_and_writes_nothing(tmp_path: Path) -> None:
    file = write_test(tmp_path / "x.test", '<test test-name="bad" pkg="tested" type="bad.py"/>')
    status, out, err = ran("rostest", "-t", "--package=a", "--pkgdir=/", file)
    assert status == 1
    assert "KeyError: 'lost'" in err
    assert "[Testcase: testbad] ... FAILURE!" in out
    assert not list(tmp_path.rglob("*.xml"))


def test_the_master_that_runs(tmp_path: Path, master: str) -> None:
    from minirospy.runtime.rpc.master_proxy import MasterProxy

    proxy = MasterProxy(master, "/test")
    proxy.set_param("/old", 1)
    text = '<param name="new" value="2"/><test test-name="good" pkg="tested" type="good.py"/>'
    file = write_test(tmp_path / "x.test", text)
    assert ran("rostest", "-r", "--package=a", "--pkgdir=/", file)[0] == 0
    assert {"/old", "/new"} <= set(proxy.get_param_names())
    assert ran("rostest", "-r", "-c", "--package=a", "--pkgdir=/", file)[0] == 0
    assert "/old" not in proxy.get_param_names()
    proxy.close()


@pytest.mark.skipif(sys.platform == "win32", reason="sends a Unix signal")
def test_ctrl_c_ends_all_tests(tmp_path: Path) -> None:
    text = "".join(
        f'<test test-name="{name}" name="{name}" pkg="tested" type="sleepy.py" time-limit="50"/>'
        for name in "ab"
    )
    popen = start("rostest", "--package=p", "--pkgdir=/", write_test(tmp_path / "x.test", text))
    wait_until(lambda: list((tmp_path / "log").glob("rostest-*/a-1-stdout.log")))
    os.kill(popen.pid, signal.SIGINT)
    out, err = popen.communicate(timeout=30)
    assert popen.returncode == 1
    assert "interrupted by SIGINT" in out
    assert "testb" not in out
    assert not err


@pytest.mark.skipif(sys.platform == "win32", reason="sends a Unix signal")
def test_ctrl_c_is_no_success_of_rosunit(tmp_path: Path) -> None:
    started, file = tmp_path / "started", tmp_path / "slow.py"
    file.write_text(f"import time\nopen({str(started)!r}, 'w')\ntime.sleep(60)\n")
    popen = start("rosunit", "--package=p", file)
    wait_until(lambda: started.exists() or popen.poll() is not None)
    os.kill(popen.pid, signal.SIGINT)
    _, err = popen.communicate(timeout=30)
    assert popen.returncode == 1
    assert "rosunit: ERROR: interrupted: how the test went is not known\n" in err


@pytest.mark.parametrize("command", [rostest, rosunit])
def test_ctrl_c_before_the_tests_is_no_success(
    command: Callable[[list[str]], int], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("minirospy.ros.rostest.commands.rostest._package_of", interrupted)
    assert command([str(TEST / "good.py")]) == 1


def test_no_test_outlives_a_ctrl_c_at_its_start(
    tmp_path: Path, interrupted_processes: list[subprocess.Popen[bytes]]
) -> None:
    with pytest.raises(MinirospyError, match="interrupted: how the test went is not known"):
        run_bare(TEST / "sleepy.py", [], tmp_path / "x.xml", "p", "sleepy", seconds=50, text=False)
    assert [each.returncode is None for each in interrupted_processes] == [False]


def test_rosunit() -> None:
    status, out, err = ran("rosunit", "--name=shown", TEST / "good.py")
    assert (status, err) == (0, "")
    assert "[Testcase: test_one] ... ok\n[Testcase: test_two] ... ok\n" in out
    assert (
        "[tested.rosunit-shown/test_one][passed]\n[tested.rosunit-shown/test_two][passed]\n\nSUMMARY\n" in out
    )
    status, out, _ = ran("rosunit", "--time-limit=0.5", TEST / "sleepy.py")
    assert status == 1
    assert "ERROR: test max time allotted: 0.5 s" in out
    status, out, _ = ran("rosunit", "--text", TEST / "crash.py")
    assert status == 1
    assert "ended with status 7" in out


ROSUNIT_USAGE = [
    "Usage: rosunit [options] <file> [test args...]",
    "",
    "rosunit: error: You must supply a test file.",
]


@pytest.mark.parametrize(
    ("command", "words", "status", "text"),
    [
        ("rostest", (), 2, "You must supply a test file argument to rostest."),
        ("rostest", ("a", "b", "c"), 2, "type rostest PACKAGE FILE, or rostest FILE"),
        ("rostest", ("tested", "no.test"), 1, "[no.test] is neither a launch file in package [tested]"),
        ("rostest", ("no_such", "no.test"), 1, "package [no_such] not found"),
        ("rostest", ("no.test",), 1, "[no.test] is not a launch file name"),
        ("rostest", ("-c", "tested", "all.test"), 2, "--clear option is only valid with --reuse-master"),
        ("rostest", ("OUTSIDE",), 1, "is in no package (no package.xml above it)"),
        ("rosunit", (), 2, "You must supply a test file."),
        ("rosunit", ("no.py",), 1, "test file no.py does not exist"),
        ("rosunit", ("OUTSIDE",), 1, "type rosunit --package NAME FILE"),
    ],
)
def test_typed_wrong(
    command: str,
    words: tuple[str, ...],
    status: int,
    text: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    import minirospy.ros.rostest.commands.rostest

    outside = write_test(tmp_path / "x.test", "")
    words = tuple(str(outside) if word == "OUTSIDE" else word for word in words)
    assert getattr(minirospy.ros.rostest.commands.rostest, command)(words) == status
    err = capsys.readouterr().err
    *ros, ours = err.splitlines()
    assert text in ours
    # rosunit without a file prints its usage first, as the real rosunit does.
    assert ros == (ROSUNIT_USAGE if (command, words) == ("rosunit", ()) else [])
