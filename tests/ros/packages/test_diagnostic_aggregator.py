"""diagnostic_aggregator: its programs publish the same messages as the real ones for the same statuses (drive.txt)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from minirospy.ros.diagnostic_aggregator.aggregator import toplevel_level
from minirospy.ros.diagnostic_aggregator.analyzers import AnalyzerGroup, Item, strip_prefix

HERE = Path(__file__).parent / "aggregator"
PROGRAMS = Path(__file__).parents[3] / "minirospy" / "ros" / "diagnostic_aggregator" / "nodes"
GENERIC = "diagnostic_aggregator/GenericAnalyzer"


class Log:
    def __init__(self) -> None:
        self.texts: list[str] = []

    def warn(self, text: str) -> None:
        self.texts.append(text)

    error = warn


def test_programs_publish_the_same_as_real_ones(master: str) -> None:
    done = subprocess.run(
        [sys.executable, str(HERE / "drive.py"), str(PROGRAMS), sys.executable],
        capture_output=True,
        text=True,
        timeout=110,
        check=False,
    )
    assert done.stdout == (HERE / "drive.txt").read_text(encoding="utf-8"), done.stderr
    assert done.returncode == 0


@pytest.mark.parametrize("rate", ["0", "often", "-1", "true"])
def test_rate_that_is_not_a_number_is_one_line(rate: str, master: str) -> None:
    done = subprocess.run(
        [sys.executable, str(PROGRAMS / "aggregator_node"), f"_pub_rate:={rate}"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("ERROR: ~pub_rate is not a number above 0: ")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("params", "status"), [({"type": GENERIC, "path": "A", "name": "a"}, 0), ({"type": GENERIC}, 1)]
)
def test_loader_reports_whether_analyzers_can_be_made(
    params: dict[str, str], status: int, master: str
) -> None:
    words = [f"_analyzers/one/{key}:={value}" for key, value in params.items()]
    done = subprocess.run(
        [sys.executable, str(PROGRAMS / "analyzer_loader"), *words],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == status, done.stderr


def make(**analyzers: object) -> tuple[AnalyzerGroup, Log]:
    log = Log()
    return AnalyzerGroup("", {"analyzers": analyzers}, "/node", 0.0, log), log


@pytest.mark.parametrize(
    ("params", "text"),
    [
        (5, "Namespace /node/analyzers has no member 'type', unable to initialize analyzer for this namespace."),
        ({"type": GENERIC, "path": 5}, 'GenericAnalyzer was not given parameter "path". Namepspace: /node/analyzers/x'),
        ({"type": GENERIC, "path": "p", "name": {}}, "Parameter not a list or string, unable to return values."),
        ({"type": GENERIC, "path": "p", "name": ["a", 1]}, "Parameter is not a list of strings"),
        ({"type": GENERIC, "path": "p", "regex": "("}, "Attempted to make regex from (."),
        ({"type": "a/B"}, "Unable to find Analyzer class a/B. Check that Analyzer is fully declared."),
        ({"type": 5}, "Unable to find Analyzer class 5."),
        (
            {"type": GENERIC, "path": "p", "name": "a", "discard_stale": True, "timeout": 0},
            "Cannot discard stale items if no timeout specified.",
        ),
    ],
)  # fmt: skip
def test_wrong_parameters_are_reported(params: object, text: str) -> None:
    _, log = make(x=params)
    assert log.texts[0].startswith(text)


def test_analyzers_that_are_no_namespace_are_reported() -> None:
    log = Log()
    group = AnalyzerGroup("", {"analyzers": [1]}, "/node", 0.0, log)
    assert not group.is_complete
    assert log.texts[0] == "Parameter /node/analyzers is not a namespace of analyzers"


def test_status_with_a_level_that_is_none_is_an_error() -> None:
    log = Log()
    item = Item.of(DiagnosticStatus(level=-4, name="a"), 0.0, log)
    assert item.level == 2
    assert "Attempting to convert -4 into DiagnosticLevel" in log.texts[0]


@pytest.mark.parametrize(
    ("levels", "expected"), [([], -1), ([0, 1], 1), ([3, 3], 3), ([3, 0], 2), ([2, 3], 2), ([2], 2)]
)
def test_level_of_the_whole_tree(levels: list[int], expected: int) -> None:
    assert toplevel_level(levels) == expected


@pytest.mark.parametrize(
    ("name", "prefix", "left"),
    [
        ("/Robot/tilt: x", "tilt", "/Robot/x"),
        ("/Robot/tilt x", "tilt", "/Robot/x"),
        ("/Robot/untilted", "tilt", "/Robot/untilted"),
        ("/tilt/tilt: x", "tilt", "/tilt/tilt: x"),
        ("tilt: x", "tilt", ": x"),
        ("/Robot/x", "", "/Robot/x"),
    ],
)
def test_prefix_is_removed_from_the_last_part(name: str, prefix: str, left: str) -> None:
    assert strip_prefix(name, prefix) == left


def test_items_grow_old_by_the_given_clock() -> None:
    group, _ = make(x={"type": GENERIC, "path": "P", "contains": "a", "timeout": 5})
    group.analyze(Item("a", 10.0, 0, "fine"))
    assert [status.level for status in group.report(15.0)] == [0, 0]
    assert [status.level for status in group.report(15.1)] == [3, 3]
