"""Every type in msgs/ has the md5sum of real ROS 1 (golden.json, made by make_golden.py)."""

from __future__ import annotations

import json
from pathlib import Path

from minirospy.core.idl.load import get_message_class, get_service_class
from minirospy.core.idl.own_packages import own_definitions

GOLDEN = json.loads((Path(__file__).parent / "golden.json").read_text())


def test_the_golden_table_is_not_empty() -> None:
    assert len(GOLDEN["msg"]) >= 150
    assert len(GOLDEN["srv"]) > 15


def test_only_packages_of_this_project_are_not_in_the_table() -> None:
    for kind in ("msg", "srv"):
        defined = {f"{file.parts[-3]}/{file.stem}" for file in own_definitions().glob(f"*/{kind}/*.{kind}")}
        assert {name.partition("/")[0] for name in defined - GOLDEN[kind].keys()} <= {
            "minirospy_msgs",
            "rpi_msgs",
        }


# Not a test for each type: its overhead would be many times the cost of what it checks.
def test_messages() -> None:
    found = {name: get_message_class(name) for name in GOLDEN["msg"]}
    assert {name: each and (each._type, each._md5sum) for name, each in found.items()} == {
        name: (name, md5sum) for name, md5sum in GOLDEN["msg"].items()
    }


def test_services() -> None:
    found = {name: get_service_class(name) for name in GOLDEN["srv"]}
    assert {name: each and (each._type, each._md5sum) for name, each in found.items()} == {
        name: (name, md5sum) for name, md5sum in GOLDEN["srv"].items()
    }
