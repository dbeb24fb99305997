"""Every type in msgs/ has the md5sum of real ROS 1 (golden.json, made by make_golden.py)."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

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


@pytest.mark.parametrize("name", sorted(GOLDEN["msg"]))
def test_messages(name: str) -> None:
    found = get_message_class(name)
    assert found is not None
    assert (found._type, found._md5sum) == (name, GOLDEN["msg"][name])


@pytest.mark.parametrize("name", sorted(GOLDEN["srv"]))
def test_services(name: str) -> None:
    found = get_service_class(name)
    assert found is not None
    assert (found._type, found._md5sum) == (name, GOLDEN["srv"][name])
