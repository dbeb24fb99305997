"""Compare calls of every callable name on the compatibility pages, with no argument, None, wrong types and normal values.

called_names.json contains the differences by reason, as dicts from call to [real, ours], and the calls that block in
both, which are not repeated. RECORD=1 rewrites it. A new difference gets the reason "", which fails until a reason is
written.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from xmlrpc.client import ServerProxy

import pytest

from tests.waiting import wait_until

from .conftest import running_master

HERE = Path(__file__).parent
RECORD = HERE / "called_names.json"
RECORDS = bool(os.environ.get("RECORD"))

sys.path.insert(0, str(HERE.parent / "referee"))
import compare_surface  # noqa: E402

sys.path.pop(0)


# Modules whose functions start processes, exit, or need objects of a running launch, test or node: programs in
# tests/referee/cases and tests/ros call them. The passed-on names of other modules are called where they are at home.
NOT_CALLED = (
    *(
        "actionlib",
        "diagnostic_updater._",
        "dynamic_reconfigure.parameter_generator",
        "genpy.gen",
        "rosbag.rosbag_main",
    ),
    *("rosgraph.rosgraph_main", "roslaunch", "rosmaster.main", "rosmaster.master", "rosmaster.registrations"),
    *(
        "roslib.network",  # real ROS's functions fail with Python 3
        "rosmaster.threadpool",
        "rospkg.",
        "rospy.impl",
        "rospy.logger",
        "rospy.rosconsole",
        "rostest",
        "rosunit",
    ),
)
CALLED = (
    "dynamic_reconfigure.parameter_generator_catkin",
    "rosmaster.master_api",
    "rospkg.os_detect",
)  # exceptions to NOT_CALLED


def callable_names() -> list[list[object]]:
    """Return [module, name or Class.member, its parameters without default, whether it has others] for the names on the pages."""
    real, ours = (
        compare_surface.described_by(python) for python in (compare_surface.REAL_PYTHON, sys.executable)
    )
    found: list[list[object]] = []
    pages = ("rospy", "modules", "tf")  # rospy first: calls of other modules set parameters
    for module in sorted(real, key=lambda each: (pages.index(compare_surface.page_of(each)), each)):
        if module.startswith(NOT_CALLED) and module not in CALLED:
            continue
        for name, _, state, _ in compare_surface.rows_of(module, real[module], ours[module]):
            owner, _, member = name.partition(".")
            described = real[module][owner]
            signature = described["members"][member] if member else described["is"]
            if state in ("left out", "missing") or isinstance(signature, str):
                continue
            parameters = [each for each in signature or [] if each[0] != "self" and "VAR" not in each[2]]
            required = [each[0] for each in parameters if not each[1]]
            found.append([module, name, required, len(parameters) > len(required) or signature is None])
    return found


def outcomes(python: str, task: dict[str, object], master: str, folder: Path) -> dict[str, str]:
    folder.mkdir()
    environment = {
        **{key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "MINIROSPY_"))},
        **dict.fromkeys(("HOME", "ROS_HOME"), str(folder)),
        "ROS_MASTER_URI": master,
        "ROS_IP": "127.0.0.1",
        # Real roslib needs this variable and the next one.
        "ROS_ROOT": "/nowhere",
        "ROS_PACKAGE_PATH": "/nowhere",
    }
    done = subprocess.run(
        [python, str(HERE / "called_names.py")],
        env=environment,
        cwd=folder,
        input=json.dumps(task),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    rows = (line.partition("\t") for line in done.stdout.splitlines())
    return {call: json.loads(outcome) for call, _, outcome in rows}


def wait_for_rosout(*masters: str) -> None:
    """Wait until each master's rosout node has registered everything, because the calls' results include it."""
    for uri in masters:
        with ServerProxy(uri) as master:
            wait_until(lambda master=master: master.lookupService("/t", "/rosout/set_logger_level")[0] == 1)  # type: ignore[misc]


@pytest.mark.timeout(1200)
def test_calls_have_the_recorded_outcomes(tmp_path: Path) -> None:
    record = json.loads(RECORD.read_text())
    names = callable_names()
    assert len(names) > 1100
    # Skip calls that are known to block; the others get as much time as a busy machine needs.
    task = {"names": names, "left_out": [] if RECORDS else record["waits"], "seconds": 4 if RECORDS else 60}
    with running_master("ours") as one, running_master("ours") as other, ThreadPoolExecutor(2) as pool:
        wait_for_rosout(one, other)
        runs = [
            pool.submit(outcomes, compare_surface.REAL_PYTHON, task, one, tmp_path / "real"),
            pool.submit(outcomes, sys.executable, task, other, tmp_path / "ours"),
        ]
        real, ours = (run.result() for run in runs)
    assert real.keys() == ours.keys()
    assert len(real) > 3000
    # A call that blocks in one of them is not made again, so its difference is not recorded.
    differing = {
        call: [real[call], ours[call]]
        for call in real
        if real[call] != ours[call] and "waits" not in (real[call], ours[call])
    }
    known = {
        call: (pair, reason) for reason, pairs in record["differs"].items() for call, pair in pairs.items()
    }

    if RECORDS:
        by_reason: dict[str, dict[str, list[str]]] = {}
        for call, pair in sorted(differing.items()):
            by_reason.setdefault(known.get(call, (pair, ""))[1], {})[call] = pair
        waits = sorted(call for call in real if "waits" in (real[call], ours[call]))
        RECORD.write_text(json.dumps({"waits": waits, "differs": by_reason}, indent=1, sort_keys=True) + "\n")
    changed = {
        call: (differing.get(call, "equal"), known[call][0] if call in known else "equal")
        for call in differing.keys() | known.keys()
        if call not in known or differing.get(call) != known[call][0]
    }
    assert changed == {}
    assert "" not in record["differs"]
