"""rostest, rosunit and catkin_test_results compared with the real ones, on one package and its .test files."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.interop.conftest import PATIENCE

ROOT = Path(__file__).parents[2]
TESTED = ROOT / "tests" / "ros" / "rostest"
OUR_BIN = Path(sys.executable).parent
FILES = ("all.test", "nodes.test", "graph.test")
Case = tuple[str, str, tuple[str, ...]]


class Ran:
    """A command of real ROS or minirospy, with a separate ROS_HOME; both run at the same time."""

    def __init__(self, stack: str, home: Path, *command: str) -> None:
        self.home = home
        real = stack == "real"
        variables = {
            "PATH": "/usr/bin:/bin" if real else f"{OUR_BIN}:/usr/bin:/bin",
            "ROS_PACKAGE_PATH": f"{TESTED}:/usr/share" if real else str(TESTED),
            "ROS_HOME": str(home),
            "ROS_HOSTNAME": "localhost",
            "ROS_MASTER_URI": "http://localhost:1",
            **(
                {"ROS_ROOT": "/usr/share/ros", "ROS_DISTRO": "debian", "ROS_ETC_DIR": "/etc/ros"}
                if real
                else {}
            ),
        }

        if real:
            # Real rosunit runs a file with `python`, which Debian does not have.
            (home / "bin").mkdir(parents=True)
            (home / "bin" / "python").symlink_to("/usr/bin/python3")
            variables["PATH"] = f"{home / 'bin'}:{variables['PATH']}"

        keep = {name: value for name, value in os.environ.items() if not name.startswith(("ROS_", "PYTHON"))}
        self._popen = subprocess.Popen(
            command, env={**keep, **variables}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def end(self) -> tuple[int, str]:
        """Return the exit status and the output, without parts that differ between runs."""
        if not self._popen.stdout.closed:  # type: ignore[union-attr]
            self._out = self._popen.communicate(timeout=PATIENCE)[0].replace(str(self.home), "HOME")
        return self._popen.returncode, self._out

    def cases(self) -> dict[str, list[Case]]:
        """Return the cases in each result file, as (class, name, (kind and type of each fault, ...))."""
        found = {}
        for file in (self.home / "test_results").rglob("*.xml"):
            try:
                root = ElementTree.parse(file).getroot()
            except ElementTree.ParseError:
                # After a timeout, real rosunit leaves an empty file.
                continue
            found[str(file.relative_to(self.home))] = [
                (
                    case.get("classname") or "",
                    case.get("name") or "",
                    tuple(f"{each.tag} {each.get('type')}" for each in case if each.tag != "skipped"),
                )
                for case in root.iter("testcase")
            ]
        return found


def both(tmp_path: Path, *command: str) -> tuple[Ran, Ran]:
    return tuple(Ran(stack, tmp_path / stack, *command) for stack in ("real", "ours"))  # type: ignore[return-value]


def summary(text: str) -> list[str]:
    """Return the lines of the summary, without tracebacks and log files."""
    wanted = re.compile(r"\[Testcase:|\[\w+\]-|\[[\w./-]+\]\[|SUMMARY|.*\* |ERROR: The following")
    return [line.rstrip("-") for line in text.splitlines() if wanted.match(line)]


@pytest.fixture(scope="module")
def rostests(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, tuple[Ran, Ran]]]:
    """Run rostest on all files at the same time, because the tests wait more than they compute."""
    started = {
        file: both(tmp_path_factory.mktemp("rostest"), "rostest", "tested", file, "limit:=1.0")
        for file in FILES
    }
    yield started
    for runs in started.values():
        for run in runs:
            run.end()


@pytest.mark.parametrize("file", FILES)
def test_the_same_results(file: str, rostests: dict[str, tuple[Ran, Ran]]) -> None:
    runs = rostests[file]
    (real_status, real_text), (status, text) = (run.end() for run in runs)
    real, ours = (run.cases() for run in runs)
    assert summary(text) == summary(real_text)
    assert ours == real
    assert status == real_status


def test_rosunit(tmp_path: Path) -> None:
    runs = both(tmp_path, "rosunit", str(TESTED / "tested" / "test" / "bad.py"))
    (real_status, real_text), (status, text) = (run.end() for run in runs)
    assert summary(text) == summary(real_text)
    assert runs[1].cases() == runs[0].cases()
    assert status == real_status == 2


def test_catkin_test_results(tmp_path: Path) -> None:
    folder = tmp_path / "results"
    (folder / "p").mkdir(parents=True)
    for name, text in (
        ("bad", '<testsuite tests="3" errors="1" failures="0"/>'),
        ("good", '<testsuite tests="2" errors="0" failures="0"/>'),
        ("skipped", '<testsuite tests="3" errors="0" failures="0" skipped="2"/>'),
        ("several", '<testsuites><testsuite tests="2" errors="1" failures="0" skip="1"/></testsuites>'),
        ("other", "<a/>"),
        ("broken", "<testsuite"),
    ):
        (folder / "p" / f"{name}.xml").write_text(text)
    for number, words in enumerate(([], ["--all"], ["--all", str(folder / "no")])):
        runs = both(
            tmp_path / str(number), "catkin_test_results", *([str(folder)] if number < 2 else []), *words
        )
        real, ours = (run.end() for run in runs)
        assert ours == real


def test_rospack_depends_of_the_packages_of_ros(tmp_path: Path) -> None:
    """Compare only packages that exist here, because minirospy's do not depend on C++ packages."""
    known = {path.name for path in (ROOT / "minirospy" / "ros").iterdir()}
    known |= {path.name for path in (ROOT / "msgs").iterdir()}
    names = ("actionlib", "rosmsg", "rospy", "rostest")
    for runs in [both(tmp_path / name, "rospack", "depends1", name) for name in names]:
        (real_status, real), (status, ours) = (run.end() for run in runs)
        assert [each for each in real.split() if each in known] == ours.split()
        assert status == real_status == 0
